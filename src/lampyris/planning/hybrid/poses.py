"""The poses of a path of hybrid A*."""

from __future__ import annotations

import math

import numpy as np

from lampyris.kernels.curves.sampling import sample
from lampyris.model.grid import Grid
from lampyris.model.path import PosePath
from lampyris.planning.hybrid.search import Found
from lampyris.planning.lattice.poses import STEP, cells_passed
from lampyris.typing import Cell, Cells, Floats


def to_cells(grid: Grid, x: float, y: float, yaw: float) -> tuple[float, float, float]:
    """A pose in metres of the map frame as cells, y down, with the yaw from x to y."""
    column, row = grid.frame.to_points(x, y).tolist()
    return column, row, grid.origin[2] - yaw


def pose_path_of(found: Found, lower_bound: float, grid: Grid, arm: float) -> tuple[PosePath, Cells]:
    """The poses of a path, and the cells that its base passes through.

    Parameters
    ----------
    lower_bound : of the cost of any path, in cells.
    arm : distance from the base to the farthest point of the robot, cells.
    """
    parts: list[Floats] = [np.array([found.first])]
    gears: list[int] = []
    for piece in found.pieces:
        count = max(1, math.ceil((abs(piece.length) + abs(piece.turn) * arm) / STEP))
        flat = np.zeros(3 * count)
        rows = (np.array([one]) for one in (piece.length, piece.turn, piece.lateral))
        sample(*piece.pose, *rows, np.array([count]), flat)
        parts.append(flat.reshape(-1, 3))
        gears += [piece.gear] * count
    points = np.concatenate(parts)
    cells: list[Cell] = []
    cells += cells_passed(points, cells)
    yaw = math.pi - np.remainder(math.pi - (grid.origin[2] - points[:, 2]), 2 * math.pi)
    metres = np.column_stack((grid.frame.to_metres(points[:, :2]), yaw))
    cost = found.cost * grid.resolution
    bound = min(lower_bound * grid.resolution, cost)
    path = PosePath(metres, np.array(gears, dtype=np.int64), cost, bound)
    return path, np.array(_joined(cells), dtype=np.int32)


def _joined(cells: list[Cell]) -> list[Cell]:
    """The same cells with the missing ones between two that are not neighbours."""
    found = cells[:1]
    for x, y in cells[1:]:
        while max(abs(x - found[-1][0]), abs(y - found[-1][1])) > 1:
            a, b = found[-1]
            found.append((a + (x > a) - (x < a), b + (y > b) - (y < b)))
        found.append((x, y))
    return found
