"""Baseline policies: a planner of lampyris that acts in an environment."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris import api
from lampyris._core import defaults, elementary
from lampyris.errors import InputError, SettingError
from lampyris.model.scene import Scene
from lampyris.planning.selection import chosen_planner
from lampyris.sim.episodes.cells import CellEpisodes
from lampyris.sim.episodes.drives import DriveEpisodes
from lampyris.typing import Cell

_AT = 0.05
"""Cells from a corner at which the robot turns to the next."""
_AHEAD = 0.02
"""Radians off its direction up to which the robot drives on."""


class PlannerPolicy:
    """Actions that follow the path of a planner; from a cell off its path the planner is asked again.

    In a ``GridNav`` environment it takes the steps of the path. In a ``Drive`` environment it turns in place at each
    corner of the path and drives straight between them, as fast as it can still stop.

    Parameters
    ----------
    env : an environment of lampyris, single or vector, wrapped or not.
    planner : a name, or a planner object, of planners on cells.
    settings : the planner's, as for :func:`lampyris.plan`.

    Raises
    ------
    SettingError : another environment.
    LampyrisError : see :func:`lampyris.plan`.

    Examples
    --------
    >>> policy = PlannerPolicy(env, "ad-gso")  # doctest: +SKIP
    >>> observation, reward, terminated, truncated, info = env.step(policy())  # doctest: +SKIP
    """

    def __init__(self, env: Any, planner: str | Any = defaults.PLANNER, **settings: Any) -> None:
        self._env = env.unwrapped
        episodes = getattr(self._env, "episodes", None)
        if not isinstance(episodes, CellEpisodes | DriveEpisodes):
            allowed = "lampyris/GridNav-v0 or lampyris/Drive-v0"
            raise SettingError("TYPE", f"a {type(self._env).__name__}", where="env", allowed=allowed)
        self._episodes = episodes
        self._planner = chosen_planner(api.plan, planner, None, settings, seed=0, budget=None, record=False)
        self._paths: dict[tuple[Cell, Cell], list[Cell]] = {}
        self._followed: list[dict[Cell, int]] = [{} for _ in range(episodes.n)]
        self._corners: list[list[tuple[float, float]]] = [[] for _ in range(episodes.n)]
        self._tasks: list[Any] = [None] * episodes.n

    def __call__(self, observation: Any = None) -> Any:
        """The next action; one for each environment of a vector. The observation is not used: it knows the map."""
        episodes = self._episodes
        if isinstance(episodes, CellEpisodes):
            steps = [self._step(episodes, k, (x, y)) for k, (x, y) in enumerate(episodes.where().tolist())]
            return np.array(steps, dtype=np.int64) if hasattr(self._env, "num_envs") else steps[0]
        driven = np.array([self._push(episodes, k) for k in range(episodes.n)], dtype=np.float32)
        return driven if hasattr(self._env, "num_envs") else driven[0]

    def _path(self, cell: Cell, goal: Cell) -> list[Cell]:
        """The cells from one cell to another.

        Raises
        ------
        InputError : ``NO_PATH``: the planner finds none.
        """
        if (cell, goal) not in self._paths:
            held = self._episodes.tasks.scene
            scene = Scene(held.grid, cell, goal, moves=held.moves, robot=held.robot)
            path = api.plan(scene, self._planner).path
            if path is None:
                what = f"{self._planner.name} finds no path from {cell} to {goal}"
                raise InputError("NO_PATH", what, where="planner", allowed="a planner that finds one")
            self._paths[cell, goal] = [(int(x), int(y)) for x, y in path.cells]
        return self._paths[cell, goal]

    def _step(self, episodes: CellEpisodes, k: int, cell: Cell) -> int:
        goal = episodes.tasks.fields[int(episodes.target[k])].goal
        if cell == goal:
            return 0
        followed = self._followed[k]
        if self._tasks[k] != goal or cell not in followed or episodes.steps[k] == 0:
            offsets = episodes.tasks.moves.offsets
            cells = self._path(cell, goal)
            followed = {a: offsets.index((b[0] - a[0], b[1] - a[1])) for a, b in pairwise(cells)}
            self._followed[k], self._tasks[k] = followed, goal
        return followed[cell]

    def _push(self, episodes: DriveEpisodes, k: int) -> tuple[float, float]:
        x, y = episodes.points()[k].tolist()
        goal = episodes.tasks.fields[int(episodes.target[k])].goal
        if self._tasks[k] != goal or episodes.steps[k] == 0:
            start = (math.floor(x + 0.5), math.floor(y + 0.5))
            self._corners[k] = [] if start == goal else corners_of(self._path(start, goal))[1:]
            self._tasks[k] = goal
        corners = self._corners[k]
        grid, robot = episodes.tasks.scene.grid, episodes.tasks.scene.robot
        speed, period = float(episodes.speed[k]), episodes.settings.period
        while corners and speed < 1e-9 and _apart((x, y), corners[0]) <= _AT:
            del corners[0]
        if not corners:
            return -1.0, 0.0
        right, up = corners[0][0] - x, y - corners[0][1]
        off = math.remainder(float(elementary.atan2(up, right)) - float(episodes.yaw[k]), math.tau)
        turn = max(-1.0, min(1.0, off / (episodes.yaw_rate * period)))
        if speed < 1e-9 and abs(off) > _AHEAD:
            return -1.0, turn
        left = max(_apart((x, y), corners[0]) - 0.5 * _AT, 0.0) * grid.resolution
        brake = robot.d_max * period
        # The speed from which it can still stop there, with a period of delay.
        wanted = min(robot.v_max, math.sqrt(brake * brake + 2.0 * robot.d_max * left) - brake)
        push = (wanted - speed) / (period * (robot.a_max if wanted > speed else robot.d_max))
        return max(-1.0, min(1.0, push)), turn if abs(off) < 0.5 else 0.0


def corners_of(cells: list[Cell]) -> list[tuple[float, float]]:
    """The ends of the straight parts of a path of cells."""
    kept = [cells[0]]
    for before, here, after in zip(cells, cells[1:], cells[2:], strict=False):
        if (here[0] - before[0], here[1] - before[1]) != (after[0] - here[0], after[1] - here[1]):
            kept.append(here)
    return [(float(x), float(y)) for x, y in [*kept, cells[-1]]]


def _apart(a: tuple[float, float], b: tuple[float, float]) -> float:
    return math.sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]))


def optimal_actions(env: Any) -> NDArray[np.int64]:
    """An optimal action in each environment of a ``GridNav`` vector, by the exact field; int64 (n,)."""
    episodes = env.unwrapped.episodes
    if not isinstance(episodes, CellEpisodes):
        raise SettingError("TYPE", "another environment", where="env", allowed="lampyris/GridNav-v0")
    return episodes.best_actions()
