"""Bidirectional A*: the shortest path, searched from both ends."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from lampyris.model.scene import Scene
from lampyris.planning.base import Traits
from lampyris.planning.graph.bidirectional_search import both_ends
from lampyris.planning.graph.session import GraphSession


@dataclass(frozen=True, slots=True)
class BidirectionalAStar:
    """A* from the start and from the goal, each cell expanded by one of the two at most; optimal.

    Pijls, Post, "Yet another bidirectional algorithm for finding the shortest path", Econometric Institute
    report 2009-10, Erasmus University Rotterdam. The stop rule is proven in
    :mod:`lampyris.kernels.graph.bidirectional`.

    On grids with the metric of the open plane as heuristic it expands about as many cells as A*, and each
    of them costs more: it is included for comparison, not for speed.
    """

    name: ClassVar[str] = "bidirectional-astar"
    traits: ClassVar[Traits] = Traits(optimal=True)
    summary: ClassVar[str] = "Bidirectional A*: the shortest path, searched from both ends."
    source: ClassVar[str] = (
        "Pijls, Post 2009 (NBA*); the proof, exact integer costs and queues by raise of f are ours."
    )

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> GraphSession:
        """Start a session. Nothing is drawn from ``rng`` and there is no per-iteration record."""
        return GraphSession(scene, self.name, both_ends)
