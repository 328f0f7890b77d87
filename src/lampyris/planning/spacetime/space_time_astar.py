"""Space-time A*: the earliest arrival by a search of cells and ticks; what SIPP is measured against."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from lampyris.model.scene import Scene
from lampyris.planning.base import Traits
from lampyris.planning.spacetime.session import Timed, TimedSession


@dataclass(frozen=True, slots=True)
class SpaceTimeAStar(Timed):
    """A* over cells and ticks, with waiting; the settings are those of :class:`Timed`.

    Solves the same problems as :class:`lampyris.planning.spacetime.sipp.Sipp` with the same arrival, and expands a
    state for every tick it might wait, where SIPP expands one for a whole safe interval.

    Silver, "Cooperative pathfinding", AIIDE 2005, for one robot.
    """

    name: ClassVar[str] = "space-time-astar"
    traits: ClassVar[Traits] = Traits(optimal=False, incremental=True, sees_traffic=True)
    summary: ClassVar[str] = "Space-time A*: the earliest arrival, by a search of every cell and tick."
    source: ClassVar[str] = "Silver 2005. Ours: diagonal crossings, footprints, forecasts, the margin."

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> TimedSession:
        """Start a session. Nothing is drawn from ``rng`` and there is no per-iteration record."""
        return TimedSession(scene, self.name, self, by_ticks=True)
