"""FleetPlan: the paths of all robots of a fleet, and what they cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris._core.predicates import cells, numbers
from lampyris._core.scalars import is_whole
from lampyris._core.values import Value
from lampyris.errors import SettingError, plural, shown
from lampyris.model.grid import MapFrame, frozen
from lampyris.model.plan import Status
from lampyris.typing import Cells

Counts = NDArray[np.int32]
"""int32, (n,)."""

_SENTENCES = {
    Status.FOUND: "All robots reach their goals.",
    Status.NO_PATH: "No plan: the robots cannot all reach their goals.",
    Status.ITERATION_LIMIT: "Stopped before all robots stood on their goals at once.",
    Status.LIMIT: "Stopped at the budget before a plan was found.",
    Status.CANCELLED: "Stopped on request.",
}


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FleetPlan(Value):
    """The result of a planner of fleets.

    Parameters
    ----------
    status : how it ended; only ``found`` is true: every robot reaches its goal and stays there.
    planner : the planner's name.
    paths : one for each robot, in the order of the fleet: int32 (ticks + 1, 2), its cell (x, y) at every tick, from
        its start to the tick of its final arrival. It stays at the last cell from then on. Without a complete plan:
        the paths up to the last tick that was planned; empty if there are none.
    shortest : number of steps of each robot's shortest path on the map without the others, int32 (robots,); None: unknown.
    iterations : what the planner counts and a budget limits: configurations tried (``lacam``), these and neighbourhoods
        (``lns``), ticks (``pibt``), searches of one robot (``prioritised-sipp``), nodes of the constraint tree (``cbs``,
        ``eecbs``).
    expansions : states made: configurations, ticks, states of a cell and an interval or a tick.
    improvements : rows of iteration and sum of costs, at each plan that cost less than the ones before.
    seed : the seed of the random draws.
    frame : where the map's cells lie in metres.
    timing : seconds by stage; the only part that differs from run to run.
    detail : why, in words, where there is more to say than the status's own sentence.
    notes : notes for the user.
    bound : a lower bound of the sum of costs that the planner proved; None: the sum of the shortest paths.
    moves : name of the step set, ``four-connected`` or ``octile``. Every step takes one tick, a diagonal one, too, and costs 1.

    Raises
    ------
    SettingError : ``FLEET_PLAN``: a path that is none, no path of a plan that is found, or a bound that is none.

    Examples
    --------
    >>> import lampyris
    >>> fleet = lampyris.random_fleet(lampyris.load_grid("env-1"), 4)
    >>> plan = lampyris.plan_fleet(fleet)
    >>> bool(plan), plan.sum_of_costs >= plan.lower_bound
    (True, True)
    """

    status: Status
    planner: str
    paths: tuple[Cells, ...] = ()
    shortest: Counts | None = None
    iterations: int = 0
    expansions: int = 0
    improvements: tuple[tuple[int, int], ...] = ()
    seed: int = 0
    frame: MapFrame | None = None
    timing: Mapping[str, float] = field(default_factory=dict, compare=False)
    detail: str = ""
    notes: tuple[str, ...] = ()
    bound: int | None = None
    moves: str = "four-connected"

    def __post_init__(self) -> None:
        given: Any = self.paths
        status: Any = self.status
        if not isinstance(status, Status):
            allowed = ", ".join(one.value for one in Status)
            raise SettingError("FLEET_PLAN", shown(status), where="status", allowed=allowed)
        if not isinstance(given, tuple | list) or (self.status is Status.FOUND and not given):
            raise SettingError("FLEET_PLAN", shown(given), where="paths", allowed="a path for each robot")
        paths = _together(given)
        if paths is None:
            paths = []
            for k, one in enumerate(given):
                path = cells(one)
                if path is None or not len(path):
                    allowed = "whole numbers (ticks + 1, 2)"
                    raise SettingError("FLEET_PLAN", shown(one), where=f"paths[{k}]", allowed=allowed)
                paths.append(frozen(path))
        object.__setattr__(self, "paths", tuple(paths))
        bound: Any = self.bound
        if bound is not None and not is_whole(bound, 0):
            raise SettingError(
                "FLEET_PLAN", shown(bound), where="bound", allowed="a whole number >= 0, or None"
            )
        if self.shortest is not None:
            lengths = numbers(self.shortest, (None,))
            if lengths is None or (lengths < 0).any() or (lengths >= 2**31).any() or (lengths % 1).any():
                allowed = "whole numbers of steps >= 0 (robots,), or None"
                raise SettingError("FLEET_PLAN", shown(self.shortest), where="shortest", allowed=allowed)
            object.__setattr__(self, "shortest", frozen(lengths.astype(np.int32)))

    def _brief(self) -> str:
        head = f"<FleetPlan {self.status} by {self.planner}: {plural(len(self.paths), 'robot')}"
        if not self:
            return f"{head}>"
        gap = "" if self.gap is None else f", gap {self.gap:.2%}"
        return f"{head}, makespan {self.makespan}, sum of costs {self.sum_of_costs}{gap}>"

    def __bool__(self) -> bool:
        return bool(self.status)

    @property
    def makespan(self) -> int | None:
        """The tick of the last arrival; None when not found."""
        return max(len(path) for path in self.paths) - 1 if self else None

    @property
    def sum_of_costs(self) -> int | None:
        """Sum over the robots of the ticks until each stays at its goal permanently, waiting included (the convention of
        the MovingAI benchmark); None when not found."""
        return sum(len(path) - 1 for path in self.paths) if self else None

    @property
    def lower_bound(self) -> int | None:
        """No plan costs less: the sum of the robots' shortest paths, or more if the planner proved more. None: unknown."""
        alone = None if self.shortest is None else int(self.shortest.sum(dtype=np.int64))
        return max((one for one in (alone, self.bound) if one is not None), default=None)

    @property
    def gap(self) -> float | None:
        """How much more than the lower bound the plan costs, as a fraction; None where one is unknown."""
        costs = self.sum_of_costs
        if costs is None or self.lower_bound is None:
            return None
        return (costs - self.lower_bound) / self.lower_bound if self.lower_bound else 0.0

    @property
    def sentence(self) -> str:
        """What a person should read."""
        return self.detail or _SENTENCES.get(self.status, self.status.sentence)

    def at(self, tick: int) -> Cells:
        """The cell of every robot at a tick, int32 (robots, 2); after its last cell a robot stays there."""
        made = np.array([path[min(tick, len(path) - 1)] for path in self.paths], dtype=np.int32)
        return frozen(made.reshape(-1, 2))


def _together(given: Sequence[Any]) -> list[Cells] | None:
    """Read-only copies of paths as planners make them, in one block of memory; None if one of them is anything else."""
    for one in given:
        if (
            type(one) is not np.ndarray
            or one.dtype != np.int32
            or one.ndim != 2
            or one.shape[1] != 2
            or not len(one)
        ):
            return None
    if not given:
        return []
    block = frozen(np.concatenate(given))
    ends = np.cumsum([len(one) for one in given]).tolist()
    return [block[end - len(one) : end] for one, end in zip(given, ends, strict=True)]
