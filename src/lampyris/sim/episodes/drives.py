"""Episodes in continuous time, many at once."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris.errors import SettingError
from lampyris.kernels.episodes.drives import step_drives
from lampyris.model.settings.episodes import DriveEpisodeSettings
from lampyris.planning.field.layers import clearance
from lampyris.sim.episodes.cells import NEVER
from lampyris.sim.episodes.tasks import BorderedTasks, Tasks, bordered, generators
from lampyris.typing import Points

_DRAWN = 5.0
"""Yaw that says that it is drawn."""


class DriveEpisodes:
    """``n`` discs on one map, each in an episode of its own: an action is a share of acceleration and yaw rate for a period.

    Parameters
    ----------
    tasks : where episodes begin and end. The robot is the disc of the scene, with its limits.
    n : how many.
    settings : of observations, rewards and motion.
    limit : steps after which an episode is cut off; None: never.

    Raises
    ------
    SettingError : a robot that does not turn in place, or whose shape is not a disc.
    """

    def __init__(
        self, tasks: Tasks, n: int, settings: DriveEpisodeSettings, limit: int | None = None
    ) -> None:
        self.tasks, self.n, self.settings = tasks, n, settings
        scene = tasks.scene
        grid, robot = scene.grid, scene.robot
        if robot.footprint is not None or robot.drive != "differential" or robot.turn_radius > 0:
            allowed = "a disc with differential drive and turn_radius 0"
            raise SettingError("ROBOT_LIMIT", "another robot", where="robot", allowed=allowed)
        border = math.ceil(settings.patch // 2 * 1.5) + 2
        self.map = BorderedTasks.of(tasks, border)
        self.yaw_rate = settings.yaw_rate_max if robot.yaw_rate_max is None else robot.yaw_rate_max
        room = np.where(grid.blocked, 0.0, clearance(grid) / grid.resolution).astype(np.float32)
        to_go = [bordered(np.where(f.exact < 0, -1.0, f.cost), border, -1.0) for f in tasks.fields]
        yaw = 0.0 if scene.start_pose is None else math.remainder(scene.start_pose[2], math.tau)
        drawn = len(tasks.starts[0]) > 1 or scene.start_pose is None
        self._map: tuple[Any, ...] = (
            self.map.shut, bordered(grid.blocked.astype(np.uint8), border, 0), bordered(room, border, -1.0),
            np.concatenate(to_go), self.map.starts, self.map.first, self.map.goals, self.map.width,
            settings.patch, robot.radius / grid.resolution, robot.v_max, robot.a_max, robot.d_max,
            self.yaw_rate, grid.resolution, settings.period, settings.goal_tolerance,
            settings.collision_cost, _DRAWN if drawn else yaw, int(settings.shaped), settings.discount,
            NEVER if limit is None else limit,
        )  # fmt: skip
        self.x, self.y, self.yaw, self.speed, self.left, self.driven = (np.zeros(n) for _ in range(6))
        self.target, self.steps, self.ended = (np.zeros(n, dtype=np.int64) for _ in range(3))
        self.hit = np.zeros(n, dtype=np.bool_)
        self._generator = np.ones(n, dtype=np.int64)

    @property
    def observed(self) -> int:
        """Numbers of an observation."""
        return self.settings.patch * self.settings.patch + 4

    def seed(self, seeds: NDArray[np.uint64]) -> None:
        """Seed what is drawn, one seed for each episode."""
        self._generator = generators(seeds)

    def begin(self) -> NDArray[np.float32]:
        """Begin all episodes; float32 (n, :attr:`observed`)."""
        none = np.zeros((self.n, 2))
        return self._step(np.full(self.n, -1, dtype=np.int64), none)[0]

    def step(
        self, action: NDArray[np.floating[Any]]
    ) -> tuple[NDArray[np.float32], NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_]]:
        """One action of each, (n, 2): shares of acceleration and of yaw rate, -1 to 1; what is beyond is cut off.

        Returns observations, rewards (seconds), what has ended (arrived, or touched a wall: ``hit``), what was cut off.
        """
        return self._step(np.zeros(self.n, dtype=np.int64), np.asarray(action, dtype=np.float64))

    def _step(
        self, begin: NDArray[np.int64], action: NDArray[np.float64]
    ) -> tuple[NDArray[np.float32], NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_]]:
        n = self.n
        seen = np.empty(n * self.observed, dtype=np.float32)
        reward = np.empty(n)
        ended, late = np.empty(n, dtype=np.bool_), np.empty(n, dtype=np.bool_)
        step_drives(
            begin, np.ascontiguousarray(action[:, 0]), np.ascontiguousarray(action[:, 1]), *self._map, self.x,
            self.y, self.yaw, self.speed, self.target, self.steps, self.left, self.driven, self.ended,
            self._generator, seen, reward, ended, late, self.hit,
        )  # fmt: skip
        return seen.reshape(n, self.observed), reward, ended, late

    def points(self) -> Points:
        """Where the centres are, cells of the map; float64 (n, 2)."""
        return np.stack((self.x, self.y), axis=1) - self.map.border
