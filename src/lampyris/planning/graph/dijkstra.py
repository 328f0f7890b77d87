"""Dijkstra: the shortest path without a heuristic, for comparison."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import numpy as np

from lampyris.model.scene import Scene
from lampyris.planning.base import Traits
from lampyris.planning.graph.session import GraphSession
from lampyris.planning.graph.terrain_graph import search_of


@dataclass(frozen=True, slots=True)
class Dijkstra:
    """Dijkstra's search from the robot until the goal settles; optimal, without settings.

    Dijkstra, "A note on two problems in connexion with graphs", Numerische Mathematik 1:269-271, 1959.
    """

    name: ClassVar[str] = "dijkstra"
    traits: ClassVar[Traits] = Traits(optimal=True)
    summary: ClassVar[str] = "Dijkstra: the shortest path, searched in all directions."
    source: ClassVar[str] = "Dijkstra 1959; a queue for each step cost instead of a heap is ours."

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> GraphSession:
        """Start a session. Nothing is drawn from ``rng`` and there is no per-iteration record."""
        return GraphSession(scene, self.name, partial(search_of, informed=False))
