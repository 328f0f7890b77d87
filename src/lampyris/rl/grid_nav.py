"""``lampyris/GridNav-v0``: from cell to cell to a goal, with a reward that is exactly minus the regret."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from gymnasium.spaces import Discrete
from numpy.typing import NDArray

from lampyris.errors import SettingError, shown
from lampyris.io.scenario.scenario import Scenario
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.settings.episodes import CellEpisodeSettings
from lampyris.rl.episode_env import EpisodeEnv, EpisodeVectorEnv, count_of, limit_of
from lampyris.rl.scenes import tasks_of
from lampyris.sim.episodes.cells import CellEpisodes


def _episodes(n: int, limit: int | None, tasks: dict[str, Any], settings: dict[str, Any]) -> CellEpisodes:
    made = CellEpisodeSettings(**settings)
    return CellEpisodes(tasks_of(**tasks), n, made, limit_of(limit))


def _measures(episodes: CellEpisodes) -> dict[str, NDArray[Any]]:
    return {"regret": episodes.regret, "cost": episodes.cost, "steps": episodes.steps}


class GridNavEnv(EpisodeEnv):
    """A robot on a map, from cell to cell.

    Action k is step k of the scene's moves; of ``octile`` and ``dissertation``: 0 north-west, 1 north-east, 2 south-west,
    3 south-east, 4 west, 5 east, 6 north, 7 south; of ``four-connected`` the last four. A step that is not legal leaves
    the robot where it is.

    Observation: float32, a patch of cells around the robot (1: its centre may not be there), row by row from the north
    west; then the direction to the goal (east, north, a unit vector), its distance d in cells as d / (d + 10), and 1 if
    the robot has just moved.

    Reward, in cells: minus the cost of the step, plus the exact cost-to-go before it less that after it times the
    discount. With ``shaped=False`` the cost alone.

    Parameters
    ----------
    map, scenario, robot, moves, goals, random_start, task_seed : see :func:`lampyris.rl.scenes.tasks_of`.
    patch, shaped, discount, bump_cost : see :class:`lampyris.model.settings.episodes.CellEpisodeSettings`.
    max_episode_steps : None: no limit (``gymnasium.make`` has one of its own).
    render_mode : None or ``rgb_array``.

    Raises
    ------
    LampyrisError : a wrong argument.

    Examples
    --------
    >>> import gymnasium
    >>> import lampyris.rl
    >>> env = gymnasium.make("lampyris/GridNav-v0", map="env-1")
    >>> observation, info = env.reset(seed=1)
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
        super().__init__(episodes, Discrete(episodes.actions), render_mode)

    def _actions(self, action: Any) -> NDArray[np.int64]:
        if not self.action_space.contains(action):
            allowed = f"a whole number from 0 to {self.episodes.actions - 1}"
            raise SettingError("ACTION", shown(action), where="action", allowed=allowed)
        return np.array([action], dtype=np.int64)

    def _measures(self) -> dict[str, NDArray[Any]]:
        return _measures(self.episodes)

    def _at(self) -> tuple[float, float]:
        x, y = self.episodes.where()[0].tolist()
        return x, y


class GridNavVectorEnv(EpisodeVectorEnv):
    """Many :class:`GridNavEnv` in one compiled loop; arguments and episodes are those of the single form."""

    def __init__(
        self,
        num_envs: int = 1,
        max_episode_steps: int | None = None,
        render_mode: str | None = None,
        **more: Any,
    ) -> None:
        tasks = {name: more.pop(name) for name in _TASKS if name in more}
        episodes = _episodes(count_of(num_envs), max_episode_steps, tasks, more)
        super().__init__(episodes, Discrete(episodes.actions))

    def _actions(self, actions: Any) -> NDArray[np.int64]:
        chosen = np.ascontiguousarray(actions, dtype=np.int64)
        if chosen.shape != (self.num_envs,) or chosen.min() < 0 or chosen.max() >= self.episodes.actions:
            allowed = f"{self.num_envs} whole numbers from 0 to {self.episodes.actions - 1}"
            raise SettingError("ACTION", shown(actions), where="actions", allowed=allowed)
        return chosen

    def _measures(self) -> dict[str, NDArray[Any]]:
        return _measures(self.episodes)


_TASKS = ("map", "scenario", "robot", "moves", "goals", "random_start", "task_seed")
