"""Environments for reinforcement learning: the checkers of gymnasium and PettingZoo, equal forms, exact regret."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import numpy as np
import pytest

import lampyris
from lampyris.errors import LampyrisError, SettingError, UsageError
from lampyris.model.path import path_of
from lampyris.model.settings.episodes import CellEpisodeSettings, DriveEpisodeSettings
from lampyris.sim.episodes.cells import CellEpisodes
from lampyris.sim.episodes.drives import DriveEpisodes
from lampyris.sim.episodes.tasks import Tasks
from reference.kernel_forms import use

gymnasium = pytest.importorskip("gymnasium")
pytest.importorskip("pettingzoo")

NAMES = ("lampyris/GridNav-v0", "lampyris/Drive-v0")
SMALL: dict[str, Any] = {"map": "guide", "goals": 3, "patch": 3}


@pytest.mark.parametrize("name", NAMES)
def test_check_env_of_gymnasium(name: str) -> None:
    from gymnasium.utils.env_checker import check_env

    env = gymnasium.make(f"lampyris.rl:{name}", render_mode="rgb_array", **SMALL)
    check_env(env.unwrapped)
    env.reset(seed=1)
    picture = env.render()
    assert picture.dtype == np.uint8
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) == 3  # walls, free cells, robot and goal


@pytest.mark.parametrize("name", NAMES)
def test_single_and_vector_form_give_equal_episodes(name: str) -> None:
    gymnasium.make(f"lampyris.rl:{name}", **SMALL)
    n = 3
    many = gymnasium.make_vec(name, num_envs=n, max_episode_steps=12, **SMALL)
    alone = [gymnasium.make(name, max_episode_steps=12, **SMALL) for _ in range(n)]
    seen, _ = many.reset(seed=5)
    for k, env in enumerate(alone):
        assert (env.reset(seed=5 + k)[0] == seen[k]).all()
    many.action_space.seed(3)
    over, episodes = [False] * n, 0
    for _ in range(60):
        actions = many.action_space.sample()
        seen, reward, ended, late, info = many.step(actions)
        for k, env in enumerate(alone):
            if over[k]:
                one: Any = (env.reset()[0], 0.0, False, False, {})
            else:
                one = env.step(actions[k])
            over[k] = one[2] or one[3]
            episodes += over[k]
            assert (one[0] == seen[k]).all()
            assert one[1:4] == (reward[k], ended[k], late[k])
            if over[k]:
                assert all(info[key][k] == value and info[f"_{key}"][k] for key, value in one[4].items())
    assert episodes >= 6


@pytest.mark.parametrize("terrain", [False, True])
def test_the_return_is_minus_the_regret(terrain: bool) -> None:
    """Costs of the path driven and of the optimal one come from the path's own class and from A*."""
    from lampyris.rl import GridNavEnv

    rng = np.random.default_rng(4)
    blocked = rng.random((12, 14)) < 0.2
    ground = np.where(blocked, 0, rng.integers(0, 250, blocked.shape)).astype(np.uint8) if terrain else None
    grid = lampyris.Grid(blocked, terrain=ground)
    env = GridNavEnv(map=grid, goals=4)
    for seed in range(6):
        _, task = env.reset(seed=seed)
        cells, total, bumps = [task["start"]], 0.0, 0
        while True:
            action = int(rng.integers(8)) if rng.random() < 0.5 else int(env.episodes.best_actions()[0])
            _, reward, ended, _, info = env.step(action)
            total += reward
            cell = tuple(env.episodes.where()[0].tolist())
            if cell == cells[-1]:
                bumps += 1
            else:
                cells.append(cell)
            if ended:
                break
        scene = lampyris.Scene(grid, task["start"], task["goal"])
        moves = env.episodes.tasks.moves
        driven = path_of(np.array(cells, dtype=np.int32), moves, grid.terrain)
        best = lampyris.plan(scene, "astar").path
        assert best is not None
        assert info["regret"] == (driven.exact - best.exact + bumps * moves.unit) / moves.unit
        assert total == pytest.approx(-info["regret"], abs=1e-9)
        assert task["optimal_cost"] == best.cost


def test_forms_of_the_loops_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = lampyris.Scene(lampyris.load_grid("guide"), (0, 9), (7, 0), robot=lampyris.Robot(radius=0.3))
    tasks = Tasks.of(scene, 3, True, 1)
    bytes_of = []
    for form in ("plain", "compiled"):
        use(monkeypatch, form)
        rng = np.random.default_rng(0)
        given = []
        for episodes in (
            CellEpisodes(tasks, 4, CellEpisodeSettings(discount=0.9), 9),
            DriveEpisodes(tasks, 4, DriveEpisodeSettings(), 40),
        ):
            episodes.seed(np.arange(4, dtype=np.uint64))
            episodes.begin()
            for _ in range(60):
                if isinstance(episodes, CellEpisodes):
                    answer = episodes.step(rng.integers(0, episodes.actions, 4))
                else:
                    answer = episodes.step(np.array([1.0, 0.3]) * rng.uniform(0, 1, (4, 2)))
                given += [part.tobytes() for part in answer]
            given.append(episodes.ended.tobytes() + getattr(episodes, "hit", episodes.ended).tobytes())
        bytes_of.append(given)
    assert bytes_of[0] == bytes_of[1]


@pytest.mark.parametrize("planner", ["ad-gso", "astar"])
def test_a_planner_drives_to_the_goal(planner: str) -> None:
    from lampyris.rl import DriveEnv, GridNavEnv, PlannerPolicy

    for kind in (GridNavEnv, DriveEnv):
        env = kind(**SMALL, max_episode_steps=900)
        policy = PlannerPolicy(env, planner)
        for seed in range(3):
            env.reset(seed=seed)
            ended = late = False
            while not (ended or late):
                _, _, ended, late, info = env.step(policy())
            assert ended
            assert not info.get("collision", False)
            if planner == "astar":
                assert info.get("regret", 0.0) == 0.0


def test_a_drive_never_enters_a_wall() -> None:
    """Places by the episodes' own record, distances by brute force over all blocked squares."""
    grid = lampyris.load_grid("env-1")
    scene = lampyris.Scene(grid, (37, 8), (5, 38), robot=lampyris.Robot(radius=0.4, v_max=3.0))
    episodes = DriveEpisodes(Tasks.of(scene, 2, True, 0), 40, DriveEpisodeSettings(), 60)
    episodes.seed(np.arange(40, dtype=np.uint64))
    episodes.begin()
    walls = np.argwhere(grid.blocked)[:, ::-1]
    rng, hits = np.random.default_rng(2), 0
    for _ in range(60):
        episodes.step(rng.uniform((0, -1), (1, 1), (40, 2)))
        hits += int(episodes.hit.sum())
        away = np.maximum(np.abs(episodes.points()[:, None] - walls[None]) - 0.5, 0.0)
        assert (away**2).sum(axis=2).min() >= 0.4**2
    assert hits > 10


def test_robots_of_the_parallel_form_never_meet() -> None:
    from pettingzoo.test import parallel_api_test

    from lampyris.rl import parallel_env

    parallel_api_test(parallel_env(3, **SMALL), num_cycles=30)
    env = parallel_env(8, map="guide", goals=12)
    rng, held = np.random.default_rng(0), 0
    env.reset(seed=2)
    for _ in range(120):
        if not env.agents:
            break
        before = {name: env._cell[name] for name in env.agents}
        actions = {name: int(rng.integers(8)) for name in env.agents}
        env.step(actions)
        after = {name: env._cell[name] for name in before}
        assert len(set(after.values())) == len(after)
        middles = [(a[0] + b[0], a[1] + b[1]) for a, b in zip(before.values(), after.values(), strict=True)]
        assert len(set(middles)) == len(middles)  # half-way: no two change places, no diagonals cross
        held += sum(before[name] == after[name] for name in before)
    assert held > 20


@pytest.mark.parametrize(
    ("given", "code"),
    [
        ({"patch": 4}, "EPISODE_SETTING"),
        ({"goals": 0}, "OPTIONS"),
        ({"goals": -1}, "EPISODE_SETTING"),
        ({"discount": 2.0}, "EPISODE_SETTING"),
        ({"moves": "sixteen-connected"}, "MOVES"),
        ({"max_episode_steps": 0}, "EPISODE_SETTING"),
        ({"render_mode": "human"}, "EPISODE_SETTING"),
        ({"map": "no-such-map"}, "FILE_MISSING"),
        ({"goals": 4, "random_start": False}, "EPISODE_SETTING"),
    ],
)
def test_wrong_arguments_are_refused(given: dict[str, Any], code: str) -> None:
    from lampyris.rl import GridNavEnv

    with pytest.raises(LampyrisError) as refused:
        GridNavEnv(**{"map": "guide", **given})
    assert refused.value.code == code


def refused(ask: Any, n: int) -> str:
    """Which setting is refused; nothing if none is."""
    try:
        ask(n)
    except SettingError as error:
        return error.setting
    return ""


@pytest.mark.nightly
def test_limits_are_asked_at_one_less_as_much_and_one_more() -> None:
    from lampyris.rl import episode_env, robots
    from lampyris.sim.episodes import tasks

    scene = lampyris.Scene(lampyris.Grid(np.zeros((1, 3), dtype=bool)), (0, 0), (2, 0))
    most = tasks.MAX_GOALS
    assert [refused(lambda n: CellEpisodeSettings(patch=n), n) for n in (29, 31, 33)] == ["", "", "patch"]
    found = [refused(lambda n: Tasks.of(scene, n, True, 0), n) for n in (most - 1, most, most + 1)]
    assert found == ["", "", "goals"]
    most = tasks.MAX_EPISODES
    assert [refused(episode_env.count_of, n) for n in (most - 1, most, most + 1)] == ["", "", "num_envs"]
    # The guide map has fewer cells than that, which is another mistake.
    most = robots.MAX_ROBOTS
    found = [refused(lambda n: robots.parallel_env(n, map="guide"), n) for n in (most - 1, most, most + 1)]
    assert found == ["goals", "goals", "robots"]


def test_a_scenario_gives_start_and_goal() -> None:
    from lampyris.rl import GridNavEnv, GridNavVectorEnv

    scene = lampyris.Scene(lampyris.load_grid("guide"), (0, 9), (7, 0))
    for seed in (1, 2):
        task = GridNavEnv(scenario=scene).reset(seed=seed)[1]
        assert (task["start"], task["goal"]) == ((0, 9), (7, 0))
    with pytest.raises(UsageError, match="the scenario states it"):
        GridNavEnv(scenario=scene, map="guide")
    with pytest.raises(SettingError):
        GridNavVectorEnv(2, scenario=scene).step([8, 0])


def test_without_gymnasium_one_sentence_says_what_to_install() -> None:
    code = (
        "import sys; sys.modules['gymnasium'] = None\n"
        "import lampyris\n"
        "try:\n    import lampyris.rl\n"
        "except lampyris.LampyrisError as error:\n    print(error)"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert said.stdout == "error[RL]: gymnasium is not installed; pip install 'lampyris[rl]'\n", said.stderr
