"""Polyanya: the shortest path in the plane, turning at corners of obstacles."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import numpy as np

from lampyris.model.scene import Scene
from lampyris.planning.base import Traits
from lampyris.planning.graph.session import GraphSession
from lampyris.planning.map_models.polyanya_search import searching


@dataclass(frozen=True, slots=True)
class Polyanya:
    """The shortest path in the plane from the start to the goal, over a mesh of rectangles of free cells.

    Cui, Harabor, Grastien, "Compromise-free pathfinding on a navigation mesh", IJCAI 2017, 496-502. The mesh is made
    once for a map and again when the map changes.

    Its lines keep to the rules of ``theta-star`` and ``visibility-graph``, but turn at corners of obstacles, not at
    cell centres:

    * *A point, moves that may cut corners* (``dissertation``): lines may run along blocked cells and touch their
      corners, also between two that share a corner. ``Plan.waypoints`` are the corners, in halves of cells.
    * *A point, moves that may not* (``octile`` and others): lines may not touch a blocked cell. The shortest path
      does, so it is only the limit of legal ones; the waypoints keep 2^-16 of a cell away from each corner, in x and
      in y, and the plan is longer than the limit by less than 2^-14 of a cell a corner.
    * *A robot with a radius*: the corners are cell centres, and the path is that of ``visibility-graph``.

    ``Plan.map_model.bound`` is the length of the shortest path (the limit), the same as the visibility graph's: no path
    of straight lines is shorter, wherever it turns. ``Plan.path`` is a walk along the lines and need not be the
    cheapest walk: the trait ``optimal``, which speaks of walks, is false. Over terrain straight lines are not what
    is shortest; there, and for a point on maps of more than 8,192 cells from corner to corner, the answer is that of
    ``theta-star``, and ``Plan.map_model`` is None.
    """

    name: ClassVar[str] = "polyanya"
    traits: ClassVar[Traits] = Traits(optimal=False)
    summary: ClassVar[str] = (
        "Polyanya: the shortest path in the plane, over a mesh of rectangles of free cells."
    )
    source: ClassVar[str] = (
        "Cui, Harabor, Grastien 2017; the mesh, exact rays, corners that may not be touched and corridors one cell "
        "wide are ours."
    )

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> GraphSession:
        """Start a session. Nothing is drawn from ``rng`` and there is no per-iteration record."""
        make = partial(searching, wide=scene.robot.radius > 0)
        return GraphSession(scene, self.name, make, optimal=False)
