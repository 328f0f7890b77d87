"""What a command must not lead to: a robot that cannot stop before a wall or an obstacle.

A command is followed for a reaction time, then the robot brakes on the same arc. All along its outline must stay off blocked
cells of the map, and its disc off obstacles, which go on at the velocity that was seen last.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.ros.transforms import PlanePose
from lampyris.typing import Floats

SHARES = (1.0, 0.75, 0.5, 0.25, 0.1)
"""Of the speed that was asked for, which are tried."""


class ObservedObstacle(NamedTuple):
    """An obstacle as it was seen last: place (m), radius (m), velocity (m/s), time (s)."""

    x: float
    y: float
    radius: float
    vx: float
    vy: float
    t: float


class Safety:
    """Walls and outline, prepared.

    Parameters
    ----------
    grid : the map.
    robot : the robot, without the margin of its paths.
    """

    def __init__(self, grid: Grid, robot: Robot) -> None:
        self._grid, self._robot = grid, robot
        self._outline = _outline(robot, 0.5 * grid.resolution)

    def allowed(
        self,
        at: PlanePose,
        v: float,
        w: float,
        reaction: float,
        obstacles: Mapping[str, ObservedObstacle],
        now: float,
        gap: float,
    ) -> tuple[float, float, str]:
        """The command, or a slower one on the same arc that is safe, and what limits it ("": nothing).

        Parameters
        ----------
        at : pose in the map frame.
        v, w : the command, m/s and rad/s.
        reaction : seconds for which a command is followed at least.
        obstacles : by name.
        now : seconds.
        gap : metres to keep from obstacles.
        """
        cause = ""
        for share in SHARES:
            found = self._conflict(at, share * v, share * w, reaction, obstacles, now, gap)
            if not found:
                return share * v, share * w, cause
            cause = found
        return 0.0, 0.0, cause

    def hits_wall(self, at: PlanePose) -> bool:
        """Whether the outline covers a blocked cell at a pose."""
        return self._walls(np.array([at]))

    def _conflict(
        self,
        at: PlanePose,
        v: float,
        w: float,
        reaction: float,
        obstacles: Mapping[str, ObservedObstacle],
        now: float,
        gap: float,
    ) -> str:
        # The time to stop of whichever motion takes longer to stop; turns in place have no speed of their own.
        stop = abs(v) / self._robot.d_max
        far = abs(v) * reaction + 0.5 * abs(v) * stop
        turn = abs(w) * (reaction + 0.5 * stop)
        arm = max(self._robot.radius, self._grid.resolution)
        n = max(math.ceil((far + turn * arm) / (0.5 * self._grid.resolution)), 1) + 1
        t = np.linspace(0.0, reaction + stop, n)
        after = np.maximum(t - reaction, 0.0)
        share = 1.0 - 0.5 * after / stop if stop > 0 else np.ones(n)
        travelled = np.minimum(t, reaction) + after * share  # seconds at full speed
        poses = _arc(at, v, w, travelled)
        if self._walls(poses[1:]):
            return "clearance"
        for one in obstacles.values():
            age = max(now - one.t, 0.0) + t
            dx, dy = one.x + one.vx * age - poses[:, 0], one.y + one.vy * age - poses[:, 1]
            near = one.radius + self._robot.radius + gap
            d2 = dx * dx + dy * dy
            # Away from one that is near already is always allowed.
            if ((d2 < near * near) & (d2 < d2[0] - 1e-12)).any():
                return "moving obstacle"
        return ""

    def _walls(self, poses: Floats) -> bool:
        """Whether the outline touches a blocked cell at one of some poses; off the map nothing is blocked."""
        c, s = np.cos(poses[:, 2])[:, None], np.sin(poses[:, 2])[:, None]
        ox, oy = self._outline[:, 0], self._outline[:, 1]
        x, y = poses[:, 0, None] + c * ox - s * oy, poses[:, 1, None] + s * ox + c * oy
        cells = np.floor(self._grid.to_points(x.ravel(), y.ravel()) + 0.5).astype(np.int64)
        grid = self._grid
        on = (
            (cells[:, 0] >= 0) & (cells[:, 0] < grid.width) & (cells[:, 1] >= 0) & (cells[:, 1] < grid.height)
        )
        return bool(grid.blocked[cells[on, 1], cells[on, 0]].any())


def _arc(at: PlanePose, v: float, w: float, t: Floats) -> Floats:
    """Poses after driving an arc for some times, float64 (n, 3)."""
    x, y, yaw = at
    yaws = yaw + w * t
    if abs(w) < 1e-9:
        c, s = math.cos(yaw), math.sin(yaw)
        return np.column_stack((x + v * t * c, y + v * t * s, yaws))
    c, s = math.cos(yaw), math.sin(yaw)
    radius = v / w
    return np.column_stack((x + radius * (np.sin(yaws) - s), y - radius * (np.cos(yaws) - c), yaws))


def moved(at: PlanePose, v: float, w: float, t: float) -> PlanePose:
    """A pose after driving an arc for a time."""
    x, y, yaw = _arc(at, v, w, np.array([t]))[0].tolist()
    return x, y, yaw


def _outline(robot: Robot, spacing: float) -> Floats:
    """Points around the robot's outline, at most ``spacing`` apart, and its base; float64 (n, 2)."""
    if robot.footprint is None:
        n = max(math.ceil(2.0 * math.pi * robot.radius / spacing), 8)
        angle = np.arange(n) * (2.0 * math.pi / n)
        around = robot.radius * np.column_stack((np.cos(angle), np.sin(angle)))
        return np.vstack((np.zeros((1, 2)), around))
    points: list[Floats] = [np.zeros((1, 2))]
    corners = np.array(robot.footprint)
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        d = b - a
        n = max(math.ceil(float(np.sqrt((d * d).sum())) / spacing), 1)
        points.append(a + d * (np.arange(n) / n)[:, None])
    return np.vstack(points)
