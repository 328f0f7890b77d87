"""``lampyris/Drive-v0``: a disc that accelerates and turns, in continuous time."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray

from lampyris.errors import SettingError, shown
from lampyris.io.scenario.scenario import Scenario
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.settings.episodes import DriveEpisodeSettings
from lampyris.rl.episode_env import EpisodeEnv, EpisodeVectorEnv, count_of, limit_of
from lampyris.rl.scenes import tasks_of
from lampyris.sim.episodes.drives import DriveEpisodes


def _episodes(n: int, limit: int | None, tasks: dict[str, Any], settings: dict[str, Any]) -> DriveEpisodes:
    made = DriveEpisodeSettings(**settings)
    return DriveEpisodes(tasks_of(**tasks), n, made, limit_of(limit))


def _measures(episodes: DriveEpisodes) -> dict[str, NDArray[Any]]:
    return {
        "time": episodes.steps * episodes.settings.period,
        "length": episodes.driven,
        "time_to_go": episodes.left,
        "collision": episodes.hit,
    }


class DriveEnv(EpisodeEnv):
    """A disc with differential drive: it accelerates, brakes and turns; touching a wall ends the episode.

    Action: float32 (2,), -1 to 1: share of the maximum acceleration (of braking, if negative) and of the maximum yaw
    rate (positive: counterclockwise), for a period. The robot does not drive backwards.

    Observation: float32, a patch of cells (1: the robot's centre may not be there) in the frame of the robot, row by row
    from ahead on the left; the direction to the goal (ahead, left, a unit vector), its distance d in cells as
    d / (d + 10), and the speed as a share of ``v_max``.

    Reward, in seconds: minus the period, plus the time to go before it less that after it times the discount; time to go
    is the exact cost-to-go of the map, from the point where the robot is, at ``v_max``. A collision costs
    ``collision_cost`` and the time to go.

    Parameters
    ----------
    map, scenario, robot, moves, goals, random_start, task_seed : see :func:`lampyris.rl.scenes.tasks_of`.
    patch, shaped, discount, period, yaw_rate_max, goal_tolerance, collision_cost : see
        :class:`lampyris.model.settings.episodes.DriveEpisodeSettings`.
    max_episode_steps : None: no limit (``gymnasium.make`` has one of its own).
    render_mode : None or ``rgb_array``.

    Raises
    ------
    LampyrisError : a wrong argument; a robot that is no disc with differential drive.
    """

    def __init__(
        self,
        map: str | os.PathLike[str] | Grid | None = None,
        scenario: str | os.PathLike[str] | Scenario | Scene | None = None,
        robot: Robot | None = None,
        moves: str | None = None,
        goals: int | None = None,
        random_start: bool | None = None,
        task_seed: int = 0,
        max_episode_steps: int | None = None,
        render_mode: str | None = None,
        **settings: Any,
    ) -> None:
        tasks = {
            "map": map, "scenario": scenario, "robot": robot, "moves": moves, "goals": goals,
            "random_start": random_start, "task_seed": task_seed,
        }  # fmt: skip
        episodes = _episodes(1, max_episode_steps, tasks, settings)
        super().__init__(episodes, _SPACE, render_mode)

    def _actions(self, action: Any) -> NDArray[np.float64]:
        return _checked(action, (2,)).reshape(1, 2)

    def _measures(self) -> dict[str, NDArray[Any]]:
        return _measures(self.episodes)

    def _at(self) -> tuple[float, float]:
        x, y = self.episodes.points()[0].tolist()
        return x, y


class DriveVectorEnv(EpisodeVectorEnv):
    """Many :class:`DriveEnv` in one compiled loop; arguments and episodes are those of the single form."""

    def __init__(
        self,
        num_envs: int = 1,
        max_episode_steps: int | None = None,
        render_mode: str | None = None,
        **more: Any,
    ) -> None:
        tasks = {name: more.pop(name) for name in _TASKS if name in more}
        super().__init__(_episodes(count_of(num_envs), max_episode_steps, tasks, more), _SPACE)

    def _actions(self, actions: Any) -> NDArray[np.float64]:
        return _checked(actions, (self.num_envs, 2))

    def _measures(self) -> dict[str, NDArray[Any]]:
        return _measures(self.episodes)


def _checked(action: Any, shape: tuple[int, ...]) -> NDArray[np.float64]:
    made = np.asarray(action, dtype=np.float64)
    if made.shape != shape or not np.isfinite(made).all():
        raise SettingError(
            "ACTION", shown(action), where="action", allowed=f"finite numbers of shape {shape}"
        )
    return made


_SPACE = Box(-1.0, 1.0, (2,), np.float32)
_TASKS = ("map", "scenario", "robot", "moves", "goals", "random_start", "task_seed")
