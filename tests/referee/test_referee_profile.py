"""The referee on speed profiles: lawful ones pass, every corruption is caught by the rule that names it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from referee_builders import dissertation, nearest_wall, physical, random_query

from lampyris.errors import InternalFault
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.path import Path, path_of
from lampyris.model.profile import Profile
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.referee import certify, check_profile
from sizes import sized

ROBOTS = (
    Robot(),
    Robot(v_max=3.0, a_max=0.2, d_max=0.4),
    Robot(v_max=0.3, a_max=5.0, d_max=7.0),
    Robot(radius=0.8, v_max=2.0, a_max=1.0, d_max=0.5),
)


def judge(profile: Profile, path: Path, scene: Scene, **more: Any) -> str | None:
    verdict = check_profile(profile, path, scene, **more)
    assert "np." not in str(verdict)
    return None if verdict is None else verdict.rule


def query(
    k: int, rng: np.random.Generator, least: int = 4, low: int = 5, high: int = 16
) -> tuple[Scene, Path]:
    robot = ROBOTS[k % len(ROBOTS)]
    resolution = float(rng.choice([1.0, 0.1, 2.5])) if not robot.radius else 1.0
    scene, path = random_query(
        rng, list(MOVES)[k % 4], robot.radius, least, low=low, high=high, share=0.25, resolution=resolution
    )
    return replace(scene, robot=robot), path


@sized("cases", 50, 300)
def test_lawful_profiles_pass(cases: int) -> None:
    rng = np.random.default_rng(11)
    for k in range(cases):
        scene, path = query(k, rng, least=1)
        assert judge(physical(path, scene), path, scene) is None
        assert judge(dissertation(path, scene), path, scene) is None


@pytest.mark.parametrize("robot", ROBOTS[:3])
@pytest.mark.parametrize("resolution", [1e-3, 1.0, 40.0])
def test_from_rest_to_rest_over_one_edge(robot: Robot, resolution: float) -> None:
    blocked = np.zeros((3, 4), bool)
    for wall in (None, (0, 0), (0, 2)):
        if wall is not None:
            blocked[wall] = True
        scene = Scene(Grid(blocked, resolution=resolution), (1, 1), (2, 1), robot=robot)
        path = path_of([[1, 1], [2, 1]], scene.moves)
        good = physical(path, scene)
        assert judge(good, path, scene) is None
        for factor in (0.99, 1.5 * scene.robot.v_max / robot.v_max * 1e3):
            assert judge(replace(good, t=good.t * factor), path, scene) == "time"


def test_slower_than_need_be_is_lawful() -> None:
    """Moving obstacles only ever make a robot slower: a quarter of every speed keeps every rule."""
    rng = np.random.default_rng(12)
    for k in range(60):
        scene, path = query(k, rng)
        p = physical(path, scene)
        ds = np.diff(p.s)
        v = p.v / 4
        a = np.append(np.diff(v**2) / (2 * ds), 0.0)
        t = np.append(0.0, np.cumsum(2 * ds / (v[:-1] + v[1:])))
        assert judge(replace(p, v=v, a=a, t=t), path, scene) is None


# ---- corruptions of the physical law ----

Made = Profile | None
Corruption = Callable[[Profile, Path, Scene, np.random.Generator], Made]


def with_speeds(p: Profile, v: Any) -> Profile:
    """Other speeds, with the accelerations and times that belong to them: only the speeds are wrong."""
    v = np.asarray(v, dtype=float)
    ds = np.diff(p.s)
    return replace(
        p,
        v=v,
        a=np.append(np.diff(v**2) / (2 * ds), 0.0),
        t=np.append(0.0, np.cumsum(2 * ds / np.maximum(v[:-1] + v[1:], 1e-9))),
    )


def one_node_short(p: Profile, path: Path, s: Scene, rng: np.random.Generator) -> Made:
    return Profile(p.law, p.s[:-1], p.v[:-1], p.a[:-1], p.t[:-1], p.cause[:-1], p.units)


def longer_road(p: Profile, path: Path, s: Scene, rng: np.random.Generator) -> Made:
    return replace(p, s=p.s * (1 + 1e-6))


def cells_for_metres(p: Profile, path: Path, s: Scene, rng: np.random.Generator) -> Made:
    return None if s.grid.resolution == 1 else replace(p, s=path.arc)


def unknown_law(p: Profile, path: Path, s: Scene, rng: np.random.Generator) -> Made:
    return replace(p, law="martial")


def negative(p: Profile, path: Path, s: Scene, rng: np.random.Generator) -> Made:
    v = p.v.copy()
    v[int(rng.integers(1, len(v) - 1))] *= -1
    return with_speeds(p, v)


def too_fast(p: Profile, path: Path, s: Scene, rng: np.random.Generator) -> Made:
    v = p.v.copy()
    v[int(rng.integers(1, len(v) - 1))] = s.robot.v_max * (1 + 1e-6)
    return with_speeds(p, v)


def rolls_over_the_goal(p: Profile, path: Path, s: Scene, rng: np.random.Generator) -> Made:
    v = p.v.copy()
    v[-1] = 1e-6
    return with_speeds(p, v)


def flying_start(p: Profile, path: Path, s: Scene, rng: np.random.Generator) -> Made:
    v = p.v.copy()
    v[0] = 1e-6
    return with_speeds(p, v)


def leaps(p: Profile, path: Path, s: Scene, rng: np.random.Generator) -> Made:
    k = int(rng.integers(1, len(p.v)))
    v = p.v.copy()
    v[k] = math.sqrt((v[k - 1] ** 2 + 2 * s.robot.a_max * (p.s[k] - p.s[k - 1])) * (1 + 1e-6))
    return with_speeds(p, v) if v[k] <= s.robot.v_max and k < len(v) - 1 else None


def brakes_too_late(p: Profile, path: Path, s: Scene, rng: np.random.Generator) -> Made:
    v = p.v.copy()
    v[-2] = math.sqrt(2 * s.robot.d_max * (p.s[-1] - p.s[-2]) * (1 + 1e-6))
    up = v[-3] ** 2 + 2 * s.robot.a_max * (p.s[-2] - p.s[-3])
    return with_speeds(p, v) if v[-2] <= s.robot.v_max and v[-2] ** 2 <= up else None


def other_acceleration(p: Profile, path: Path, s: Scene, rng: np.random.Generator) -> Made:
    a = p.a.copy()
    k = int(rng.integers(len(a)))
    a[k] += float(rng.choice([-1, 1])) * 1e-3 * s.robot.a_max
    return replace(p, a=a)


def time_runs_back(p: Profile, path: Path, s: Scene, rng: np.random.Generator) -> Made:
    t = p.t.copy()
    k = int(rng.integers(1, len(t) - 1))
    t[k], t[k + 1] = t[k + 1], t[k]
    return replace(p, t=t)


def time_stands(p: Profile, path: Path, s: Scene, rng: np.random.Generator) -> Made:
    t = p.t.copy()
    k = int(rng.integers(1, len(t)))
    t[k] = t[k - 1]
    return replace(p, t=t)


def early_everywhere(p: Profile, path: Path, s: Scene, rng: np.random.Generator) -> Made:
    return replace(p, t=p.t * (1 - 1e-6))


def late_once(p: Profile, path: Path, s: Scene, rng: np.random.Generator) -> Made:
    t = p.t.copy()
    t[int(rng.integers(1, len(t))) :] += 1e-3 * t[-1]
    return replace(p, t=t)


def late_start(p: Profile, path: Path, s: Scene, rng: np.random.Generator) -> Made:
    return replace(p, t=p.t + 1.0)


def ignores_walls(p: Profile, path: Path, s: Scene, rng: np.random.Generator) -> Made:
    """The lawful profile of a map without walls."""
    open_ = replace(s, grid=Grid(np.zeros_like(s.grid.blocked), resolution=s.grid.resolution))
    free = physical(path, open_)
    return None if (free.v <= p.v * (1 + 1e-6)).all() else free


PHYSICAL: list[tuple[Corruption, str]] = [
    (one_node_short, "nodes"),
    (longer_road, "s"),
    (cells_for_metres, "s"),
    (unknown_law, "law"),
    (negative, "speed"),
    (too_fast, "speed"),
    (rolls_over_the_goal, "goal"),
    (flying_start, "start"),
    (leaps, "acceleration"),
    (brakes_too_late, "braking"),
    (other_acceleration, "a"),
    (time_runs_back, "time"),
    (time_stands, "time"),
    (early_everywhere, "time"),
    (late_once, "time"),
    (late_start, "time"),
    (ignores_walls, "clearance"),
]


@pytest.mark.commit(6)
@sized("cases", 20, 100)
@pytest.mark.parametrize(("corrupt", "rule"), PHYSICAL, ids=lambda c: getattr(c, "__name__", ""))
def test_every_corruption_of_a_physical_profile_is_caught_by_its_rule(
    corrupt: Corruption, rule: str, cases: int
) -> None:
    rng = np.random.default_rng(28)
    met = 0
    for k in range(cases):
        scene, path = query(k, rng)
        good = physical(path, scene)
        bad = corrupt(good, path, scene, rng)
        if bad is not None:
            met += 1
            assert judge(bad, path, scene) == rule, (k, path.cells.tolist(), bad.v.tolist())
    assert met >= cases / 5


# ---- corruptions of the dissertation's law ----


def shown(p: Profile, v: Any) -> Profile:
    v = np.asarray(v, dtype=float)
    return replace(p, v=v, a=np.append(np.diff(v), 0.0))


def eighty_one(p: Profile, path: Path, s: Scene, rng: np.random.Generator) -> Made:
    v = p.v.copy()
    v[int(rng.integers(1, len(v) - 1))] = 81.0
    return shown(p, v)


def rises(p: Profile, path: Path, s: Scene, rng: np.random.Generator) -> Made:
    v = p.v.copy()
    longest = {0: 20.0, 1: 28.0, 2: 44.0}[int(abs(np.prod(path.cells[1] - path.cells[0])))]
    v[1] = longest + 1e-3
    return shown(p, v)


def falls(p: Profile, path: Path, s: Scene, rng: np.random.Generator) -> Made:
    v = p.v.copy()
    v[-2] = 40.001
    return shown(p, v) if v[-2] - v[-3] <= 20 else None


def ignores_rings(p: Profile, path: Path, s: Scene, rng: np.random.Generator) -> Made:
    """The lawful profile of a map without walls, and with room around it."""
    h, w = s.grid.blocked.shape
    open_ = replace(s, grid=Grid(np.zeros((h + 6, w + 6), bool)), start=(0, 0), goal=(0, 0))
    free = dissertation(replace(path, cells=path.cells + 3), open_)
    return None if (free.v <= p.v).all() else free


def ignores_bends(p: Profile, path: Path, s: Scene, rng: np.random.Generator) -> Made:
    """As fast as rises and falls allow, straight on through the bends."""
    d = np.diff(path.cells, axis=0)
    v = [0.0]
    for dx, dy in d:
        v.append(min(80.0, v[-1] + {0: 20, 1: 28, 2: 44}[abs(int(dx * dy))]))
    v[-1] = 0.0
    for i in range(len(v) - 2, -1, -1):
        v[i] = min(v[i], v[i + 1] + 40)
    heading = np.arctan2(d[:, 1], d[:, 0])
    turn = np.abs(np.degrees(np.remainder(heading[1:] - heading[:-1] + np.pi, 2 * np.pi) - np.pi))
    limit = np.where(turn < 22.5, 80, np.where(turn < 67.5, 60, 20))
    return shown(p, v) if (np.array(v[1:-1]) > limit).any() else None


def half_transfers(p: Profile, path: Path, s: Scene, rng: np.random.Generator) -> Made:
    return replace(p, t=p.t / 2)


def rolls_over_the_end(p: Profile, path: Path, s: Scene, rng: np.random.Generator) -> Made:
    v = p.v.copy()
    v[-1] = 1e-9
    return shown(p, v)


DISSERTATION: list[tuple[Corruption, str]] = [
    (one_node_short, "nodes"),
    (longer_road, "s"),
    (eighty_one, "speed"),
    (rolls_over_the_end, "goal"),
    (flying_start, "start"),
    (rises, "acceleration"),
    (falls, "braking"),
    (ignores_bends, "angle"),
    (ignores_rings, "ring"),
    (other_acceleration, "a"),
    (half_transfers, "time"),
]


@pytest.mark.commit(3)
@pytest.mark.parametrize(("corrupt", "rule"), DISSERTATION, ids=lambda c: getattr(c, "__name__", ""))
def test_every_corruption_of_the_dissertations_profile_is_caught(corrupt: Corruption, rule: str) -> None:
    rng = np.random.default_rng(29)
    met = 0
    for k in range(100):
        scene, path = query(k, rng)
        good = dissertation(path, scene)
        bad = corrupt(good, path, scene, rng)
        if bad is not None:
            met += 1
            assert judge(bad, path, scene) == rule, (k, path.cells.tolist(), bad.v.tolist())
    assert met >= 20


def test_a_robot_that_is_driving_already() -> None:
    scene = Scene(Grid(np.zeros((3, 12), bool)), (0, 1), (11, 1))
    path = path_of([[x, 1] for x in range(12)], scene.moves)
    v = np.minimum(0.5, np.append(np.full(11, 0.5), 0.0))
    moving = with_speeds(physical(path, scene), v)
    assert judge(moving, path, scene, v0=0.5) is None
    assert judge(moving, path, scene) == "start"
    assert judge(moving, path, scene, v0=0.4) == "start"


def test_creep_is_a_setting_of_the_law() -> None:
    blocked = np.zeros((3, 9), bool)
    blocked[0] = blocked[2] = True
    scene = Scene(Grid(blocked), (0, 1), (8, 1), robot=Robot(radius=0.5))
    path = path_of([[x, 1] for x in range(9)], scene.moves)
    assert nearest_wall(scene.grid, 4, 1) == 0.5
    good = physical(path, scene)
    assert good.v.max() == pytest.approx(0.1)
    assert judge(good, path, scene) is None
    assert judge(good, path, scene, creep=0.05) == "clearance"


def test_certify_needs_the_path() -> None:
    scene, path = query(0, np.random.default_rng(1))
    good = physical(path, scene)
    assert certify(good, scene, path) is good
    with pytest.raises(InternalFault, match="goal"):
        certify(rolls_over_the_goal(good, path, scene, np.random.default_rng(0)), scene, path)
