"""Jump point search: the shortest path, by scans of 64 cells at a time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from lampyris.model.scene import Scene
from lampyris.planning.base import Traits
from lampyris.planning.graph.jps_search import jump_search
from lampyris.planning.graph.session import GraphSession


@dataclass(frozen=True, slots=True)
class JumpPointSearch:
    """A* over jump points, found in bit-packed rows and columns; optimal, without settings.

    Harabor, Grastien, "Online graph pruning for pathfinding on grid maps", AAAI 2011, 1114-1119, and
    "Improving jump point search", ICAPS 2014, 128-135. The rules for moves that may not cut corners are
    derived, and optimality proven, in :mod:`lampyris.kernels.graph.jps`.

    For ``octile`` and ``dissertation`` moves, with a robot of any size, on plain ground. Its rules do not
    hold for ``four-connected`` and ``sixteen-connected`` moves nor on maps with terrain: there it plans as ``astar`` does.
    Packing the bits is done once, and repaired where the map changes; ``Plan.timing["pack_s"]`` tells it
    apart. ``Plan.expansions`` counts jump points.
    """

    name: ClassVar[str] = "jps"
    traits: ClassVar[Traits] = Traits(optimal=True)
    summary: ClassVar[str] = "Jump point search: the shortest path, by scans of 64 cells at a time."
    source: ClassVar[str] = (
        "Harabor, Grastien 2011 and 2014; the rules without corner cutting as derived here and packed stops "
        "are ours."
    )

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> GraphSession:
        """Start a session. Nothing is drawn from ``rng`` and there is no per-iteration record."""
        return GraphSession(scene, self.name, jump_search)
