"""Fastest: the shortest path, by whichever exact search is quickest on such a map."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from lampyris.model.scene import Scene
from lampyris.planning.base import Traits
from lampyris.planning.graph.fastest_search import suited
from lampyris.planning.graph.session import GraphSession


@dataclass(frozen=True, slots=True)
class Fastest:
    """One of three exact searches, chosen by the properties of the map when the session opens.

    * ``octile`` moves: jump point search; or, where runs stop at more than 1.22 places for each free cell
      (dense clutter, corridors one cell wide), the field of the goal, solved as far as the start.
    * ``dissertation`` moves: jump point search up to 0.3 such places for each free cell; beyond, A*, or
      the field where less than 55 % of the cells are free (corridors one cell wide).
    * ``four-connected`` and ``sixteen-connected`` moves, maps with terrain: A*.

    The limits are where the mean times of queries cross on maps of 512 x 512
    (``benchmarks/bench_query.py``). With octile moves, the field's time as a multiple of jump point
    search's, and the stops for each free cell: random 10 % 5.2 (0.63), 20 % 2.2 (0.99), 30 % 1.2 (1.18),
    35 % 0.87 (1.22), 40 % 0.55 (1.24), maze 0.41 (1.30). With dissertation moves and A* in the field's
    place: random 10 % 0.46 (0.37), 40 % 0.52 (1.12), mazes with corridors two and four wide 4.2 (0.17)
    and 10 (0.04); with the field again, maze 0.62 (0.44).

    ``Plan.expansions`` counts what the search that was chosen expands: jump points or cells.
    """

    name: ClassVar[str] = "fastest"
    traits: ClassVar[Traits] = Traits(optimal=True)
    summary: ClassVar[str] = "Fastest: the shortest path, by the exact search that is quickest on such a map."
    source: ClassVar[str] = "Ours; see jps, astar and the field for what it chooses from."

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> GraphSession:
        """Start a session. Nothing is drawn from ``rng`` and there is no per-iteration record."""
        return GraphSession(scene, self.name, suited)
