"""Voronoi: the safest path, along the ridges of clearance."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import numpy as np

from lampyris._core.settings import check_settings, flag, under_name
from lampyris.model.scene import Scene
from lampyris.planning.base import Traits
from lampyris.planning.graph.session import GraphSession
from lampyris.planning.map_models.ridges import KnownWalls, RidgeSearch


class _Session(GraphSession):
    """A session that knows walls apart from cells where a robot with a radius cannot be."""

    def __init__(self, scene: Scene, name: str, *, border: bool) -> None:
        self._walls = KnownWalls(scene.grid.blocked)
        super().__init__(scene, name, partial(RidgeSearch, walls=self._walls, border=border), optimal=False)

    def _see(self) -> None:
        super()._see()
        self._walls.blocked = self._scene.grid.blocked


@dataclass(frozen=True, slots=True)
class Voronoi:
    """The path with the greatest clearance, along the Voronoi graph of the map.

    O'Dunlaing, Yap, "A retraction method for planning the motion of a disc", Journal of Algorithms 6 (1985),
    104-111: a disc that can pass at all can pass along the ridges of clearance, where two walls are equally near.

    Clearance is the exact distance from a cell's centre to the nearest wall. The path has two guarantees:

    * its least clearance is the greatest that any path from start to goal has
      (``Plan.map_model.clearance``, exact: a search for the widest path);
    * from the first branching of the ridges to the last, its least clearance there is the greatest that the ridges
      offer (``Plan.map_model.ridge_clearance``), and among such paths along ridges it is the shortest. So an end
      beside a wall, which limits the first number, does not make it take the narrow door.

    The ridges are what is left of all cells with at least the first clearance when they are worn away in the order
    of their clearance, connected as before and around the same obstacles, down to lines one cell wide; both ends
    stay. They are connected by sides where the moves may not cut corners, else by corners, too; no step of the path
    is a knight's. Terrain is not considered, moving obstacles count as walls.

    Parameters
    ----------
    border : whether the edge of the map counts as a wall. If not, the safest place of a map with few walls is its
        edge.

    Raises
    ------
    SettingError : ``border`` is not true or false.
    """

    border: bool = flag(True, title="edge of the map is a wall")

    name: ClassVar[str] = "voronoi"
    traits: ClassVar[Traits] = Traits(optimal=False)
    summary: ClassVar[str] = "Voronoi: the safest path, along the ridges farthest from walls."
    source: ClassVar[str] = (
        "O'Dunlaing and Yap 1985; ridges by thinning in the order of exact clearance, and the choice among them, "
        "are ours."
    )

    def __post_init__(self) -> None:
        check_settings(self, under_name(self.name))

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> GraphSession:
        """Start a session. Nothing is drawn from ``rng`` and there is no per-iteration record."""
        return _Session(scene, self.name, border=self.border)
