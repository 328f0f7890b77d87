"""The poses of a path of hybrid A*."""

from __future__ import annotations

import numpy as np

from lampyris.model.grid import Grid
from lampyris.model.path import PosePath
from lampyris.planning.hybrid.search import HybridPath
from lampyris.planning.lattice.poses import path_along
from lampyris.typing import Cells


def pose_path_of(found: HybridPath, lower_bound: float, grid: Grid, arm: float) -> tuple[PosePath, Cells]:
    """The poses of a path, and the cells that its base passes through.

    Parameters
    ----------
    lower_bound : of the cost of any path, in cells.
    arm : distance from the base to the farthest point of the robot, cells.
    """
    rows = np.array([(piece.length, piece.turn, piece.lateral) for piece in found.pieces]).reshape(-1, 3)
    gears = np.array([piece.gear for piece in found.pieces], dtype=np.int8)
    return path_along(found.first, rows, gears, found.cost, lower_bound, grid, arm)
