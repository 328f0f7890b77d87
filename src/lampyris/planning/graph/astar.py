"""A*: the shortest path, searched from scratch at every call."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from lampyris.model.scene import Scene
from lampyris.planning.base import Traits
from lampyris.planning.graph.session import GraphSession
from lampyris.planning.graph.terrain_graph import search_of


@dataclass(frozen=True, slots=True)
class AStar:
    """A* with the exact distance on an empty grid as heuristic; optimal, without settings.

    Hart, Nilsson, Raphael, "A formal basis for the heuristic determination of minimum cost paths", IEEE
    TSSC 4(2):100-107, 1968.
    """

    name: ClassVar[str] = "astar"
    traits: ClassVar[Traits] = Traits(optimal=True)
    summary: ClassVar[str] = "A*: the shortest path, searched from scratch at every call."
    source: ClassVar[str] = (
        "Hart, Nilsson, Raphael 1968; exact integer costs, and queues by raise of f for a heap, are ours."
    )

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> GraphSession:
        """Start a session. Nothing is drawn from ``rng`` and there is no per-iteration record."""
        return GraphSession(scene, self.name, search_of)
