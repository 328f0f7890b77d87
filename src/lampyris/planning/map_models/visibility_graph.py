"""Visibility graph: the shortest path of straight lines, and the bound that no path in the plane beats."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import numpy as np

from lampyris.model.scene import Scene
from lampyris.planning.base import Traits
from lampyris.planning.graph.session import GraphSession
from lampyris.planning.map_models.visibility_search import searching


@dataclass(frozen=True, slots=True)
class VisibilityGraph:
    """The shortest of all paths that any-angle planners may return, by way of the visibility graph.

    Lozano-Perez, Wesley, "An algorithm for planning collision-free paths among polyhedral obstacles", CACM 22
    (1979), 560-570: a shortest path in the plane turns at corners of obstacles only. For a point robot there are two
    optima:

    * *In the plane* a path turns at corners of blocked cells. Its length is ``Plan.map_model.bound``: no path of
      straight lines, whatever its turning points, is shorter. (Where corners may not be touched it is the limit of
      legal paths and not one of them.) It is found on the graph of convex corners, visibility looked up only from
      corners that are expanded, and only where a shortest path can go on around the blocked cell.
    * *Between cell centres*, where Theta* and this planner turn. The shortest such path need not turn beside a
      wall: between two shelves the best turning point may be a cell in the open. So the corners are not enough,
      and all cells count through which some path in the plane runs that is no longer than a bound. A* over them, led
      by the exact distance in the plane, gives ``Plan.waypoints``; where the bound proves too low it is raised.

    For a robot with a radius the corners of what its lines must keep to are themselves cell centres, and the two
    optima are one. Lines of sight, corner rule and the room for a robot with a radius are those of ``theta-star``
    (:mod:`lampyris.kernels.graph.any_angle`): bound <= this planner's length <= Theta*'s length.

    ``Plan.path`` is a walk along the lines, as of ``theta-star``, and need not be the cheapest walk: the trait
    ``optimal``, which speaks of walks, is false. Over terrain straight lines are not what is shortest; there the
    answer is that of ``theta-star``, and ``Plan.map_model`` is None.
    """

    name: ClassVar[str] = "visibility-graph"
    traits: ClassVar[Traits] = Traits(optimal=False)
    summary: ClassVar[str] = (
        "Visibility graph: the shortest of all any-angle paths, and the bound in the plane."
    )
    source: ClassVar[str] = (
        "Lozano-Perez and Wesley 1979; that paths in the plane bound which cell centres matter is ours."
    )

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> GraphSession:
        """Start a session. Nothing is drawn from ``rng`` and there is no per-iteration record."""
        make = partial(searching, wide=scene.robot.radius > 0)
        return GraphSession(scene, self.name, make, optimal=False)
