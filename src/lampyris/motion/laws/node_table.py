"""A table of every node of a path: what stands around it, how the path bends there, and what either allows."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris._core import elementary
from lampyris._core.predicates import cell_of
from lampyris.errors import SettingError, of_kind, shown
from lampyris.model.path import Path
from lampyris.model.plan import Plan
from lampyris.model.profile import NodeTable
from lampyris.model.scene import Scene
from lampyris.motion.laws import dissertation
from lampyris.motion.laws.rings import as_cells, count, headings
from lampyris.typing import Cell


def node_table(
    scene: Scene,
    path: Plan | Path,
    *,
    obstacles: Iterable[Cell] | NDArray[Any] = (),
    law: dissertation.DissertationLaw = dissertation.DEFAULT,
) -> NodeTable:
    """The inputs of the dissertation's speed law at each node of a path.

    Parameters
    ----------
    scene : the map.
    path : a path of cells, or a plan that found one, by whatever planner.
    obstacles : cells that moving obstacles cover; those off the map are ignored.
    law : its settings: which cells count, and the velocities.

    Raises
    ------
    SettingError : ``PROFILE``: a plan without a path; ``TYPE``: obstacles that are not cells, another law.

    Examples
    --------
    >>> import lampyris
    >>> scene = lampyris.Scene(lampyris.load_grid("guide"), (0, 9), (7, 0), "dissertation")
    >>> lampyris.node_table(scene, lampyris.plan(scene)).ring1[:4]
    array([5, 0, 2, 2])

    Source: dissertation, Algorithms 3.11 and 3.12, Tables 4.12 to 4.17.
    """
    of_kind("scene", scene, Scene)
    of_kind("law", law, dissertation.DissertationLaw)
    around = cells_given(obstacles)
    given = path.path if isinstance(path, Plan) else path
    if not isinstance(given, Path):
        raise SettingError("PROFILE", shown(path), where="path", allowed="a path, or a plan that found one")
    cells = given.cells.astype(np.int64)
    steps = headings(cells, None)
    one, two = count(
        cells, steps, scene.grid.blocked, around, law.ring1, law.ring2, law.outside1, law.outside2
    )
    by_rings, by_angle = dissertation.node_caps(steps, one, two, law, came=False)
    by_angle[np.isinf(by_angle)] = np.nan
    angle, d = np.full(len(cells), np.nan), np.diff(cells, axis=0)
    cross = d[:-1, 0] * d[1:, 1] - d[:-1, 1] * d[1:, 0]
    dot = d[:-1, 0] * d[1:, 0] + d[:-1, 1] * d[1:, 1]
    angle[1:-1] = np.round(180.0 - np.degrees(np.abs(elementary.atan2(cross, dot))), 9)
    return NodeTable(one, two, by_rings, angle, by_angle)


def nodes_of(scene: Scene, found: Plan) -> NodeTable | None:
    """The table of a plan's path of cells; None where there is none."""
    return None if found.path is None or found.pose_path is not None else node_table(scene, found)


def cells_given(obstacles: Any) -> NDArray[np.int64]:
    """Cells as int64 (m, 2).

    Raises
    ------
    SettingError : ``TYPE``: no list of cells.
    """
    listed = obstacles.tolist() if isinstance(obstacles, np.ndarray) else obstacles
    if isinstance(listed, list | tuple | set | frozenset):
        cells = [cell_of(one) for one in listed]
        if None not in cells:
            return as_cells([cell for cell in cells if cell is not None])
    raise SettingError("TYPE", shown(obstacles), where="obstacles", allowed="a list of cells (x, y)")
