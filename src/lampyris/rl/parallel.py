"""The environment of several robots; it needs pettingzoo."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from gymnasium.spaces import Box, Discrete
from gymnasium.utils.seeding import np_random
from numpy.typing import NDArray
from pettingzoo import ParallelEnv

from lampyris.errors import SettingError, shown
from lampyris.model.grid import TERRAIN_UNIT
from lampyris.model.settings.episodes import CellEpisodeSettings
from lampyris.rl.episode_env import limit_of
from lampyris.rl.picture import picture_of
from lampyris.rl.scenes import tasks_of
from lampyris.typing import Cell

_STEPS = 500
_NAMES = ("map", "scenario", "robot", "moves", "goals", "random_start", "task_seed")


class ParallelGridNav(ParallelEnv[str, NDArray[np.float32], Any]):
    """See :func:`lampyris.rl.parallel_env`."""

    metadata: ClassVar[dict[str, Any]] = {
        "name": "lampyris_grid_nav_v0", "render_modes": ["rgb_array"], "is_parallelizable": True
    }  # fmt: skip

    def __init__(
        self, robots: int, max_episode_steps: int | None = _STEPS, render_mode: str | None = None, **more: Any
    ) -> None:
        tasks = {name: more.pop(name) for name in _NAMES if name in more}
        self._settings = CellEpisodeSettings(**more)
        self._limit = limit_of(max_episode_steps)
        self._tasks = tasks_of(**{"goals": max(robots, 16), **tasks})
        goals = {field.goal for field in self._tasks.fields}
        if len(goals) < robots:
            what = f"{len(goals)} different goals for {robots} robots"
            raise SettingError("EPISODE_SETTING", what, where="goals", allowed="at least as many as robots")
        self.render_mode = render_mode
        self.possible_agents = [f"robot_{k}" for k in range(robots)]
        self.agents: list[str] = []
        patch = self._settings.patch
        low = np.zeros(patch * patch + 4, dtype=np.float32)
        low[-4:-2] = -1.000001
        self._observed = Box(low, np.where(low < 0, -low, np.float32(1.0)))
        self._spaces = {name: Discrete(len(self._tasks.moves.offsets)) for name in self.possible_agents}
        self._half = patch // 2
        self._shut = np.pad((~self._tasks.free).astype(np.float32), self._half, constant_values=1.0)
        self._rng: np.random.Generator | None = None
        self._cell: dict[str, Cell] = {}
        self._field: dict[str, Any] = {}
        self._lost: dict[str, int] = {}
        self._steps = 0

    def observation_space(self, agent: str) -> Box:
        """Of a robot; the same object at each call."""
        return self._observed

    def action_space(self, agent: str) -> Any:
        """Of a robot; the same object at each call."""
        return self._spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, NDArray[np.float32]], dict[str, dict[str, Any]]]:
        """Put every robot at a start of its own, with a goal of its own. ``options`` are not used."""
        if seed is not None or self._rng is None:
            self._rng, _ = np_random(seed)
        self.agents = list(self.possible_agents)
        self._steps = 0
        width = self._tasks.scene.grid.width
        goals: set[Cell] = set()
        taken: set[Cell] = set()
        order = self._rng.permutation(len(self._tasks.fields)).tolist()
        chosen: list[int] = []
        for k in order:
            goal = self._tasks.fields[k].goal
            if goal not in goals and len(chosen) < len(self.agents):
                goals.add(goal)
                chosen.append(k)
        for name, k in zip(self.agents, chosen, strict=True):
            starts = [s for s in self._tasks.starts[k].tolist() if (s % width, s // width) not in taken]
            if not starts:
                raise SettingError(
                    "EPISODE_SETTING", "no start is left", where="robots", allowed="fewer robots"
                )
            place = starts[int(self._rng.integers(len(starts)))]
            self._cell[name] = (place % width, place // width)
            self._field[name] = self._tasks.fields[k]
            self._lost[name] = 0
            taken.add(self._cell[name])
        return {name: self._see(name, 0.0) for name in self.agents}, {
            name: self._info(name) for name in self.agents
        }

    def step(self, actions: dict[str, Any]) -> Any:
        """One action of each robot on the map; observations, rewards, terminations, truncations, infos by robot."""
        here = {name: self._cell[name] for name in self.agents}
        there, price = dict(here), {}
        for name in self.agents:
            there[name], price[name] = self._wanted(name, actions.get(name))
        _resolve(here, there)
        self._steps += 1
        late = self._limit is not None and self._steps >= self._limit
        unit = self._tasks.moves.unit
        rewards: dict[str, float] = {}
        for name in self.agents:
            field, a, b = self._field[name], here[name], there[name]
            cost = price[name] if a != b else self._settings.bump_cost * unit
            gone = cost + int(field.exact[b[1], b[0]]) - int(field.exact[a[1], a[0]])
            self._cell[name] = b
            self._lost[name] += gone
            shaped = (1.0 - self._settings.discount) * int(field.exact[b[1], b[0]]) - gone
            rewards[name] = (shaped if self._settings.shaped else -cost) / unit
        ended = {name: self._cell[name] == self._field[name].goal for name in self.agents}
        cut = {name: late and not ended[name] for name in self.agents}
        seen = {name: self._see(name, float(here[name] != there[name])) for name in self.agents}
        infos = {name: self._info(name) for name in self.agents}
        self.agents = [name for name in self.agents if not ended[name] and not late]
        return seen, rewards, ended, cut, infos

    def render(self) -> NDArray[np.uint8] | None:
        """The map with the robots and their goals."""
        if self.render_mode is None:
            return None
        return picture_of(self._tasks.scene.grid, [(self._cell[a], self._field[a].goal) for a in self.agents])

    def _wanted(self, name: str, action: Any) -> tuple[Cell, int]:
        """The cell that a robot wants to be in, and what the step costs."""
        moves, (x, y) = self._tasks.moves, self._cell[name]
        if action is None or not self._spaces[name].contains(action):
            allowed = f"a whole number from 0 to {len(moves.offsets) - 1}"
            raise SettingError("ACTION", shown(action), where=name, allowed=allowed)
        dx, dy = moves.offsets[int(action)]
        cells = [(x + dx, y + dy)]
        if dx and dy and not moves.corner_cutting:
            cells += [(x + dx, y), (x, y + dy)]
        grid = self._tasks.scene.grid
        if not all(grid.contains(cell) and self._tasks.free[cell[1], cell[0]] for cell in cells):
            return (x, y), 0
        cost = moves.costs[int(action)]
        if grid.terrain is not None:
            cost = cost // TERRAIN_UNIT * (TERRAIN_UNIT + int(grid.terrain[y + dy, x + dx]))
        return cells[0], cost

    def _see(self, name: str, moved: float) -> NDArray[np.float32]:
        (x, y), half = self._cell[name], self._half
        patch = self._shut[y : y + 2 * half + 1, x : x + 2 * half + 1].copy()
        for other in self.agents:
            dx, dy = self._cell[other][0] - x, self._cell[other][1] - y
            if other != name and abs(dx) <= half and abs(dy) <= half:
                patch[dy + half, dx + half] = 1.0
        goal = self._field[name].goal
        right, up = float(goal[0] - x), float(y - goal[1])
        away = float(np.sqrt(right * right + up * up))
        last = [right / away, up / away] if away > 0 else [0.0, 0.0]
        return np.array([*patch.ravel(), *last, away / (away + 10.0), moved], dtype=np.float32)

    def _info(self, name: str) -> dict[str, Any]:
        return {"cell": self._cell[name], "regret": self._lost[name] / self._tasks.moves.unit}


def _resolve(here: dict[str, Cell], there: dict[str, Cell]) -> None:
    """Keep robots where they are until no two want the same cell, one of another that stays, each other's, or to cross."""
    while True:
        wanted: dict[Cell, list[str]] = {}
        for name, cell in there.items():
            wanted.setdefault(cell, []).append(name)
        at = {cell: name for name, cell in here.items()}
        stay = set()
        for name, cell in there.items():
            a = here[name]
            if cell == a:
                continue
            other = at.get(cell)
            if len(wanted[cell]) > 1 or (other is not None and there[other] == a):
                stay.add(name)
            elif cell[0] != a[0] and cell[1] != a[1]:
                # The other diagonal of the same square, in either direction.
                for b, c in (((cell[0], a[1]), (a[0], cell[1])), ((a[0], cell[1]), (cell[0], a[1]))):
                    crossing = at.get(b)
                    if crossing is not None and there[crossing] == c:
                        stay.add(name)
        if not stay:
            return
        for name in stay:
            there[name] = here[name]
