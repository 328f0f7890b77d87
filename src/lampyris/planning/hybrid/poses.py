"""The poses of a path of hybrid A*."""

from __future__ import annotations

import math

import numpy as np

from lampyris.kernels.curves.sampling import sample
from lampyris.model.grid import Grid
from lampyris.model.path import PosePath
from lampyris.planning.hybrid.search import HybridPath
from lampyris.planning.lattice.poses import STEP
from lampyris.typing import Cells, Floats


def to_cells(grid: Grid, x: float, y: float, yaw: float) -> tuple[float, float, float]:
    """A pose in metres of the map frame as cells, y down, with the yaw from x to y."""
    column, row = grid.frame.to_points(x, y).tolist()
    return column, row, grid.origin[2] - yaw


def pose_path_of(found: HybridPath, lower_bound: float, grid: Grid, arm: float) -> tuple[PosePath, Cells]:
    """The poses of a path, and the cells that its base passes through.

    Parameters
    ----------
    lower_bound : of the cost of any path, in cells.
    arm : distance from the base to the farthest point of the robot, cells.
    """
    rows = np.array([(piece.length, piece.turn, piece.lateral) for piece in found.pieces]).reshape(-1, 3)
    moved = np.abs(rows[:, 0]) + np.abs(rows[:, 1]) * arm
    counts = np.maximum(np.ceil(moved / STEP), 1).astype(np.int64)
    gears = np.repeat(np.array([piece.gear for piece in found.pieces], dtype=np.int8), counts)
    flat = np.zeros(3 * int(counts.sum()))
    if len(rows):
        sample(*found.first, *rows.T.copy(), counts, flat)
    points = np.concatenate((np.array([found.first]), flat.reshape(-1, 3)))
    yaw = math.pi - np.remainder(math.pi - (grid.origin[2] - points[:, 2]), 2 * math.pi)
    metres = np.column_stack((grid.frame.to_metres(points[:, :2]), yaw))
    cost = found.cost * grid.resolution
    bound = min(lower_bound * grid.resolution, cost)
    path = PosePath(metres, gears, cost, bound)
    return path, _passed(points)


def _passed(points: Floats) -> Cells:
    """Cells along points, each a straight or diagonal step from the last."""
    cells: Cells = np.floor(points[:, :2] + 0.5).astype(np.int32)
    changed = np.append(True, (cells[1:] != cells[:-1]).any(axis=1))
    return np.asarray(cells[changed], dtype=np.int32)
