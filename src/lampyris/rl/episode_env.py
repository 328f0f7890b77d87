"""What the environments share: gymnasium's single and vector form around episodes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Space
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from lampyris._core.scalars import is_whole
from lampyris.errors import SettingError, shown
from lampyris.rl.picture import picture_of
from lampyris.sim.episodes.cells import CellEpisodes
from lampyris.sim.episodes.drives import DriveEpisodes
from lampyris.sim.episodes.tasks import MAX_EPISODES

Episodes = CellEpisodes | DriveEpisodes


def observation_space(episodes: Episodes) -> Box:
    """The patch, 0 or 1, the direction to the goal, -1 to 1, its distance and the speed, 0 to 1."""
    low = np.zeros(episodes.observed, dtype=np.float32)
    low[-4:-2] = -1.0
    # A direction is a unit vector to within float32.
    return Box(
        np.where(low < 0, np.float32(-1.000001), low),
        np.where(low < 0, np.float32(1.000001), np.float32(1.0)),
    )


def limit_of(steps: int | None) -> int | None:
    """The limit of an episode.

    Raises
    ------
    SettingError : ``EPISODE_SETTING``.
    """
    if steps is not None and (not is_whole(steps) or steps < 1):
        raise SettingError(
            "EPISODE_SETTING", shown(steps), where="max_episode_steps", allowed="a whole number from 1"
        )
    return steps


class EpisodeEnv(gymnasium.Env[NDArray[np.float32], Any]):
    """One episode at a time."""

    metadata: ClassVar[dict[str, Any]] = {"render_modes": ["rgb_array"], "render_fps": 10}

    def __init__(self, episodes: Any, action_space: Space[Any], render_mode: str | None) -> None:
        if render_mode not in (None, "rgb_array"):
            raise SettingError(
                "EPISODE_SETTING", shown(render_mode), where="render_mode", allowed="None, rgb_array"
            )
        self.episodes = episodes
        self.render_mode = render_mode
        self.observation_space = observation_space(episodes)
        self.action_space = action_space
        self._seeded = False
        self._begun = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begin an episode. ``options`` are not used."""
        super().reset(seed=seed)
        if seed is not None:
            self.episodes.seed(np.array([seed], dtype=np.uint64))
        elif not self._seeded:
            self.episodes.seed(self.np_random.integers(2**63, size=1).astype(np.uint64))
        self._seeded = self._begun = True
        return self.episodes.begin()[0], self._task()

    def step(self, action: Any) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """One action."""
        if not self._begun:
            raise gymnasium.error.ResetNeeded("call reset() before step()")
        seen, reward, ended, late = self.episodes.step(self._actions(action))
        return seen[0], float(reward[0]), bool(ended[0]), bool(late[0]), self._info()

    def render(self) -> NDArray[np.uint8] | None:
        """The map with the robot and its goal; uint8 (height, width, 3), None without a render mode."""
        if self.render_mode is None:
            return None
        tasks = self.episodes.tasks
        goal = tasks.fields[int(self.episodes.target[0])].goal
        return picture_of(tasks.scene.grid, [(self._at(), goal)])

    def _task(self) -> dict[str, Any]:
        field = self.episodes.tasks.fields[int(self.episodes.target[0])]
        x, y = self._at()
        start = (int(x), int(y))
        return {
            "start": start,
            "goal": field.goal,
            "optimal_cost": field.moves.value(int(field.exact[start[1], start[0]])),
        }

    def _info(self) -> dict[str, Any]:
        return {name: values[0].item() for name, values in self._measures().items()}

    def _actions(self, action: Any) -> Any:
        raise NotImplementedError

    def _measures(self) -> dict[str, NDArray[Any]]:
        raise NotImplementedError

    def _at(self) -> tuple[float, float]:
        raise NotImplementedError


class EpisodeVectorEnv(VectorEnv[NDArray[np.float32], Any, NDArray[Any]]):
    """``num_envs`` episodes, stepped by one compiled loop. An episode that has ended begins again with the next step,
    whose action and reward (0) do not count: gymnasium's next-step mode.

    ``info`` holds what the single form says at each step, for the episodes that ended with this one (``_NAME`` says which).
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(self, episodes: Any, action_space: Space[Any]) -> None:
        self.episodes = episodes
        self.num_envs = episodes.n
        self.single_observation_space = observation_space(episodes)
        self.single_action_space = action_space
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(action_space, self.num_envs)
        self._seeded = False

    def reset(
        self, *, seed: int | Sequence[int] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begin all episodes. Environment k has seed ``seed + k``, or ``seed[k]``; ``options`` are not used."""
        n = self.num_envs
        if seed is None:
            super().reset()
            if not self._seeded:
                self.episodes.seed(self.np_random.integers(2**63, size=n).astype(np.uint64))
        else:
            own = [seed + k for k in range(n)] if isinstance(seed, int) else list(seed)
            if len(own) != n:
                raise SettingError("SEED", f"{len(own)} seeds", where="seed", allowed=f"one number, or {n}")
            super().reset(seed=own[0])
            self.episodes.seed(np.array(own, dtype=np.uint64))
        self._seeded = True
        return self.episodes.begin(), {}

    def step(
        self, actions: Any
    ) -> tuple[
        NDArray[np.float32], NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]
    ]:
        """One action of each."""
        seen, reward, ended, late = self.episodes.step(self._actions(actions))
        over = ended | late
        info: dict[str, Any] = {}
        if over.any():
            for name, values in self._measures().items():
                info[name], info[f"_{name}"] = np.array(values), over.copy()
        return seen, reward, ended, late, info

    def _actions(self, actions: Any) -> Any:
        raise NotImplementedError

    def _measures(self) -> dict[str, NDArray[Any]]:
        raise NotImplementedError


def count_of(num_envs: int) -> int:
    """How many environments.

    Raises
    ------
    SettingError : ``EPISODE_SETTING``.
    """
    if not is_whole(num_envs) or not 1 <= num_envs <= MAX_EPISODES:
        allowed = f"a whole number from 1 to {MAX_EPISODES:,}"
        raise SettingError("EPISODE_SETTING", shown(num_envs), where="num_envs", allowed=allowed)
    return int(num_envs)
