"""Where a robot with a shape and a heading stands free of walls, before anything is planned."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lampyris._core import elementary
from lampyris.kernels.lattice.sweep import sweep
from lampyris.model.grid import Grid
from lampyris.model.path import Pose
from lampyris.model.robot import Robot
from lampyris.planning.lattice.lattice_planner import outline_of_robot
from lampyris.typing import Cell

COMPASS = 8
"""Headings at a cell's centre that :meth:`Standing.in_cell` knows: multiples of 45 degrees from the rows of the map. Lattices
of 16 and of 32 headings have them, too."""
WIDENED = 0.05
"""Cells by which lattices widen a standing footprint."""


class Standing:
    """Whether a robot touches a wall where it stands. What is outside the map is no wall.

    Parameters
    ----------
    grid : the map.
    robot : its footprint, or a polygon of 16 vertices around its disc.
    """

    def __init__(self, grid: Grid, robot: Robot) -> None:
        self._grid = grid
        vertices = np.array(outline_of_robot(robot, grid.resolution)) / grid.resolution
        self._px, self._py = np.ascontiguousarray(vertices[:, 0]), np.ascontiguousarray(-vertices[:, 1])
        self._reach = math.ceil(math.sqrt(float((vertices * vertices).sum(axis=1).max()))) + 2
        self._stencils: dict[int, NDArray[np.int64]] = {}
        self._known: dict[tuple[Cell, int], bool] = {}

    def at(self, pose: Pose) -> bool:
        """Whether it stands free at a pose: metres of the map frame and radians."""
        x, y = self._grid.frame.to_points(pose[0], pose[1]).tolist()
        column, row = math.floor(x + 0.5), math.floor(y + 0.5)
        cells = self._touched(x - column, y - row, pose[2] - self._grid.origin[2], 0.0)
        return self._free((column, row), cells)

    def in_cell(self, cell: Cell, heading: int) -> bool:
        """Whether it stands free at the centre of a cell with one of eight headings, widened by 0.05 cell."""
        key = (cell, heading)
        if key not in self._known:
            if heading not in self._stencils:
                self._stencils[heading] = self._touched(0.0, 0.0, heading * (2 * math.pi / COMPASS), WIDENED)
            self._known[key] = self._free(cell, self._stencils[heading])
        return self._known[key]

    def pose_in_cell(self, cell: Cell, heading: int) -> Pose:
        """The pose at the centre of a cell with one of eight headings."""
        x, y = self._grid.to_metres(cell).tolist()
        return x, y, math.remainder(heading * (2 * math.pi / COMPASS) + self._grid.origin[2], 2 * math.pi)

    def _touched(self, x: float, y: float, yaw: float, margin: float) -> NDArray[np.int64]:
        """Offsets (dx, dy) of the cells that the footprint touches from the cell of the base; (n, 2)."""
        side = 2 * self._reach + 1
        touched = np.zeros(side * side, dtype=np.uint8)
        cos, sin = elementary.direction(-yaw)  # rows point down
        pose = (np.array([one]) for one in (x + self._reach, y + self._reach, cos, sin))
        sweep(self._px, self._py, *pose, margin, touched, side, side)
        row, column = np.divmod(np.flatnonzero(touched), side)
        return np.column_stack((column, row)) - self._reach

    def _free(self, cell: Cell, offsets: NDArray[np.int64]) -> bool:
        x, y = (offsets + cell).T
        inside = (x >= 0) & (y >= 0) & (x < self._grid.width) & (y < self._grid.height)
        return not self._grid.blocked[y[inside], x[inside]].any()
