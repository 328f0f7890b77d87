"""Profile: how fast, and why."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lampyris.model.grid import frozen
from lampyris.typing import Floats


@dataclass(frozen=True, slots=True, eq=False)
class Profile:
    """A speed for every node of a path, with the cause that binds it.

    Parameters
    ----------
    law : ``physical`` (SI units) or ``dissertation`` (velocity units, one transfer a node).
    s : distance along the path at each node; metres for ``physical``, cells for ``dissertation``; shape (n,).
    v : speed at each node; m/s, or velocity units.
    a : acceleration on the way to the next node (0 at the last); m/s2, or velocity units a transfer.
    t : time of arrival at each node; seconds, or transfers.
    cause : what binds each speed.
    units : the unit of v.
    """

    law: str
    s: Floats
    v: Floats
    a: Floats
    t: Floats
    cause: tuple[str, ...]
    units: str

    def __post_init__(self) -> None:
        n = len(self.cause)
        for name in "svat":
            array = frozen(np.array(getattr(self, name), dtype=np.float64))
            if array.shape != (n,) or not np.isfinite(array).all():
                raise ValueError(f"Profile.{name} must be {n} finite numbers")
            object.__setattr__(self, name, array)

    @property
    def mean(self) -> float:
        """Mean over the nodes with v > 0, as the dissertation counts (0 if there is none)."""
        moving = self.v[self.v > 0]
        return float(moving.sum() / len(moving)) if len(moving) else 0.0

    @property
    def duration(self) -> float:
        """Time from start to goal, in the unit of t."""
        return float(self.t[-1])
