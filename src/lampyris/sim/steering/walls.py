"""The walls as a robot that steers needs them: how far an arc is free, and how near a pose is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels.steering.arc_clearance import free_arc
from lampyris.planning.field.layers import clearance
from lampyris.sim.steering.arc import Arc, RobotPose, RobotShape, cos_sin
from lampyris.typing import Cell, Floats


class WallMap:
    """The map's blocked cells.

    Attributes
    ----------
    clear : metres from the centre of each cell to the nearest wall, (height, width); infinity: none.
    flat : the same, row by row.
    """

    def __init__(self, shape: RobotShape) -> None:
        grid = shape.grid
        self.shape = shape
        self._blocked: NDArray[np.bool_] = grid.blocked.copy()
        self._outline = [np.ascontiguousarray(shape.outline[:, k] / grid.resolution) for k in (0, 1)]
        self._arm = float(np.sqrt((shape.outline * shape.outline).sum(axis=1)).max())
        self._room = (np.zeros(len(shape.outline)), np.zeros(len(shape.outline)))
        self._prepare()

    def _prepare(self) -> None:
        self.clear: Floats = clearance(replace(self.shape.grid, blocked=self._blocked))
        self._cells = np.ascontiguousarray(self._blocked).view(np.uint8).ravel()
        self.flat = np.ascontiguousarray(self.clear).ravel()

    def block(self, cells: list[Cell]) -> None:
        """Take in cells that are blocked, too."""
        self._blocked = self._blocked.copy()
        for x, y in cells:
            self._blocked[y, x] = True
        self._prepare()

    def free(self, pose: RobotPose, arc: Arc, limit: float) -> float:
        """How far the robot can move along an arc until it comes to a wall or off the map, metres, at most ``limit``."""
        res = self.shape.grid.resolution
        hx, hy = (0.0, 0.0) if arc.in_place else cos_sin(arc.direction)
        cosine, sine = cos_sin(pose.yaw)
        height, width = self._blocked.shape
        bend = 0.0 if arc.in_place else -arc.bend
        return float(
            free_arc(
                self._cells, self.flat, width, height, res, *self._outline, self._arm, self.shape.margin,
                pose.x / res, -pose.y / res, hx, -hy, cosine, sine, bend, arc.turn, limit, *self._room,
            )
        )  # fmt: skip

    def stands(self, pose: RobotPose) -> bool:
        """Whether the robot can stand at a pose without touching a wall."""
        small = 1e-3 * self.shape.grid.resolution
        return self.free(pose, Arc(pose.yaw, 0.0, 0.0), small) > 0.0
