"""ChainPlan: a planner's answer for a chain."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from lampyris._core.arrays import numbers_of
from lampyris._core.values import Value
from lampyris.errors import SettingError, of_kind, shown
from lampyris.model.chain.chain import Chain
from lampyris.model.grid import Grid
from lampyris.model.plan import Status
from lampyris.typing import Floats


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ChainPlan(Value):
    """Configurations from start to goal; between two of them all joints turn evenly and at once.

    Parameters
    ----------
    status : how the search ended.
    planner : ``rrt``, ``rrt-connect`` or ``rrt-adaptive``.
    grid : the map.
    chain : the chain that moves.
    start, goal : configurations asked for, float64 (joints,), radians.
    configurations : float64 (n, joints), the first the start and the last the goal; None unless found.
    released : of ``rrt-adaptive``: joints in the order in which they were released; the others stayed near the line
        from start to goal. Of the others: all joints.
    samples : configurations drawn.
    checks : configurations looked at for collisions.
    nodes : configurations in the trees.
    seed : of all draws.
    timing : seconds by stage; the only part that differs from run to run.

    Examples
    --------
    >>> import lampyris
    >>> import numpy as np
    >>> arm = lampyris.Chain((5.0, 5.0), links=[1.0, 1.0], widths=0.2)
    >>> plan = lampyris.plan_chain(lampyris.Grid(np.zeros((10, 10), dtype=bool)), arm, [0.0, 0.0], [1.5, 0.5])
    >>> bool(plan), plan.configurations[-1].tolist()
    (True, [1.5, 0.5])
    """

    status: Status
    planner: str
    grid: Grid
    chain: Chain
    start: Floats
    goal: Floats
    configurations: Floats | None = None
    released: tuple[int, ...] = ()
    samples: int = 0
    checks: int = 0
    nodes: int = 0
    seed: int = 0
    timing: Mapping[str, float] = field(default_factory=dict, compare=False)

    def __post_init__(self) -> None:
        of_kind("chain", self.chain, Chain)
        n = self.chain.joints
        for name in ("start", "goal"):
            object.__setattr__(self, name, numbers_of("chain_plan", name, getattr(self, name), (n,)))
        if self.configurations is not None:
            made = numbers_of("chain_plan", "configurations", self.configurations, (None, n))
            object.__setattr__(self, "configurations", made)
        if (self.configurations is None) == (self.status is Status.FOUND):
            what, allowed = f"status {shown(self.status)}", "configurations exactly when the status is found"
            raise SettingError("CHAIN_PLAN", what, where="chain_plan.configurations", allowed=allowed)

    def _brief(self) -> str:
        if self.configurations is None:
            return f"<ChainPlan {self.status} by {self.planner}>"
        some = f"{len(self.released)} of {self.chain.joints} joints released"
        return f"<ChainPlan found by {self.planner}: {len(self.configurations)} configurations, {some}>"

    @property
    def turned(self) -> float | None:
        """How far all joints turn in sum, radians; None without configurations."""
        if self.configurations is None:
            return None
        return float(np.abs(np.diff(self.configurations, axis=0)).sum())

    def __bool__(self) -> bool:
        return bool(self.status)
