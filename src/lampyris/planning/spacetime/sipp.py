"""SIPP: safe interval path planning, the earliest arrival among obstacles whose tracks are known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from lampyris.model.scene import Scene
from lampyris.planning.base import Traits
from lampyris.planning.spacetime.session import Timed, TimedSession


@dataclass(frozen=True, slots=True)
class Sipp(Timed):
    """SIPP on the eight (or four) steps, with waiting; the settings are those of :class:`Timed`.

    No vertex, swap or diagonal-crossing conflict with any track that is known; for those that are not, with
    the forecast. The arrival is the earliest there is for known tracks, within the tick model of
    :mod:`lampyris.sim.grid.loop`: every step takes one tick. Of paths that arrive at the same tick it takes a short
    one, not always the shortest. With ``sixteen-connected`` moves it drives the eight single steps.

    Phillips, Likhachev, "SIPP: Safe interval path planning for dynamic environments", ICRA 2011.
    """

    name: ClassVar[str] = "sipp"
    # What is least is the tick of arrival, not the cost.
    traits: ClassVar[Traits] = Traits(optimal=False, incremental=True, sees_traffic=True)
    summary: ClassVar[str] = "SIPP: the earliest arrival among moving obstacles, waiting where that helps."
    source: ClassVar[str] = (
        "Phillips, Likhachev 2011. Ours: diagonal crossings, footprints, forecasts, the margin for a change."
    )

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> TimedSession:
        """Start a session. Nothing is drawn from ``rng`` and there is no per-iteration record."""
        return TimedSession(scene, self.name, self, by_ticks=False)
