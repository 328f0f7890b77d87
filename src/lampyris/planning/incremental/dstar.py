"""D*: the first planner to repair its costs instead of searching from scratch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from lampyris.model.scene import Scene
from lampyris.planning.base import Traits
from lampyris.planning.incremental.search import Waves
from lampyris.planning.incremental.session import IncrementalSession


@dataclass(frozen=True, slots=True)
class DStar:
    """D* as published: costs spread from the goal in all directions, as far as the robot.

    After a change, cells are processed until the least on the open list costs as much as the robot's own.
    Stentz, "Optimal and efficient path planning for partially-known environments", ICRA 1994. Ours: costs are
    integers, a step that is not possible costs infinitely much, and the path is read off by the local parent
    rule, not along back pointers, whose ties depend on the past.
    """

    name: ClassVar[str] = "dstar"
    traits: ClassVar[Traits] = Traits(optimal=True, incremental=True)
    summary: ClassVar[str] = "D*: costs from the goal, raised and lowered where the map changed."
    source: ClassVar[str] = (
        "Stentz 1994, all three branches of PROCESS-STATE, the second a fresh test; exact integer costs and "
        "the local rule for the path are ours."
    )

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> IncrementalSession:
        """Start a session. Nothing is drawn from ``rng`` and there is no per-iteration record."""
        return IncrementalSession(scene, self.name, Waves, informed=False)
