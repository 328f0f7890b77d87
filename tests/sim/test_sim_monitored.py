"""Some hundreds of seeded simulations of every kind and size, each judged by the slow monitor."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from sim_planners import Breadth, Scripted, drive

from lampyris import referee
from lampyris.errors import LampyrisError, SceneError
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.trace import Outcome
from lampyris.model.traffic import Crossing, Patrol, RandomWalk, Recorded
from lampyris.planners import registry
from lampyris.selfcheck.twins.sim_monitor import Monitor
from lampyris.sim.loop import run

KINDS = ("random-walk", "rate", "patrol", "crossing", "recorded", "all")


def planner(name):
    if name == "breadth":
        return Breadth()
    try:
        return registry.make(name, {})
    except (LampyrisError, ImportError) as error:  # pragma: no cover - only while a planner is being written
        pytest.skip(f"{name} cannot be opened: {error}")


def random_track(rng, blocked, length):
    """A walk that keeps out of walls, out of the far corners, and away from tick 0 at the start."""
    height, width = blocked.shape
    ys, xs = np.nonzero(~blocked)
    pick = int(rng.integers(len(xs)))
    track = [(int(xs[pick]), int(ys[pick]))]
    while len(track) < length:
        x, y = track[-1]
        steps = [(x + dx, y + dy) for dx in (-1, 0, 1) for dy in (-1, 0, 1)]
        steps = [c for c in steps if 0 <= c[0] < width and 0 <= c[1] < height and not blocked[c[1], c[0]]]
        track.append(steps[int(rng.integers(len(steps)))])
    return tuple(track)


def seeded_scene(seed, kind, robot_radius=0.0, body_radius=0.0, moves="octile"):
    """A random map with its ends free, and traffic of one kind."""
    rng = np.random.default_rng((seed, KINDS.index(kind)))
    width, height = (int(v) for v in rng.integers(12, 24, 2))
    sized = robot_radius > 0 or body_radius > 0
    blocked = rng.random((height, width)) < (0.03 if sized else rng.choice((0.0, 0.1, 0.25)))
    start, goal = (1, 1), (width - 2, height - 2)
    for x, y in (start, goal):
        blocked[max(y - 2, 0) : y + 3, max(x - 2, 0) : x + 3] = False
    free = [(int(x), int(y)) for y, x in zip(*np.nonzero(~blocked), strict=True)]

    def some(n):
        return [free[int(i)] for i in rng.integers(0, len(free), n)]

    count = 3 if sized else int(rng.integers(3, 14))
    traffic = []
    if kind in ("random-walk", "all"):
        traffic.append(RandomWalk(count, radius=body_radius))
    if kind in ("rate", "all"):
        traffic.append(RandomWalk(count, rate=0.5, radius=body_radius))
    if kind in ("crossing", "all"):
        traffic.append(Crossing(1 if kind == "all" else min(count, 5), radius=body_radius))
    if kind in ("patrol", "all"):
        traffic += [Patrol(tuple(some(3)), radius=body_radius) for _ in range(1 if kind == "all" else 3)]
    if kind in ("recorded", "all"):
        traffic += [Recorded(random_track(rng, blocked, 25), radius=body_radius) for _ in range(2)]
    return Scene(Grid(blocked), start, goal, moves, Robot(radius=robot_radius), tuple(traffic))


def simulate_all(name, seeds, **how):
    """Run them; how they ended, or why random tracks or waypoints were refused."""
    ended = Counter()
    driver = planner(name)
    for kind in KINDS:
        for seed in seeds:
            scene = seeded_scene(seed, kind, **how)
            try:
                trace = run(scene, driver, seed=seed, patience=15)
            except SceneError as error:
                ended[error.code] += 1
                continue
            faults = Monitor(trace).faults()
            assert faults == [], (kind, seed, faults[:5])
            if trace.outcome not in (Outcome.ARRIVED,):
                assert trace.detail, (kind, seed)
            ended[trace.outcome.value] += 1
    refused = {word: n for word, n in ended.items() if word.isupper()}
    assert set(refused) <= {"OBSTACLE_TRACK", "OBSTACLE_OVERLAP", "OBSTACLE_START"}, refused
    return ended


@pytest.mark.parametrize("moves", ["octile", "dissertation", "four"])
def test_small_bodies_obey_every_rule(moves):
    ended = simulate_all("breadth", range(20), moves=moves)
    assert ended["arrived"] >= 0.5 * sum(ended.values()), ended


@pytest.mark.parametrize(("robot", "body"), [(0.0, 1.0), (0.8, 0.0), (0.8, 1.2)])
def test_bodies_with_a_size_obey_every_rule(robot, body):
    ended = simulate_all("astar", range(12), robot_radius=robot, body_radius=body)
    assert ended["arrived"] >= 0.3 * sum(ended.values()), ended


@pytest.mark.parametrize("name", ["astar", "ad-gso"])
def test_our_planners_obey_every_rule(name):
    ended = simulate_all(name, range(100, 108))
    assert ended["arrived"] >= 0.6 * sum(ended.values()), ended


def test_knights_steps_among_traffic():
    driver = planner("astar")
    for seed in range(12):
        trace = run(seeded_scene(seed, "random-walk", moves="sixteen"), driver, seed=seed)
        assert Monitor(trace).faults() == []


@pytest.mark.parametrize(
    ("name", "how"),
    [
        ("breadth", {"moves": "dissertation"}),
        ("astar", {"moves": "sixteen"}),
        ("astar", {"robot_radius": 0.8, "body_radius": 1.2}),
    ],
)
def test_the_referee_agrees(name, how):
    driver = planner(name)
    for kind in KINDS:
        for seed in range(40, 46):
            try:
                trace = run(seeded_scene(seed, kind, **how), driver, seed=seed, patience=15)
            except SceneError:
                continue
            assert referee.check_trace(trace) is None, (kind, seed)


def test_the_monitor_is_awake():
    """A robot driven blindly through walkers by a loop with its checks taken out must be caught."""
    from lampyris.sim.world import World

    way = [(x, 5) for x in range(20)]
    scene = Scene(Grid(np.zeros((11, 20), dtype=bool)), (0, 5), (19, 5), traffic=RandomWalk(60))
    caught = 0
    for seed in range(6):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(World, "robot_may", lambda self, step: True)
            trace = run(scene, Scripted((drive(way),)), seed=seed)
        caught += bool(Monitor(trace).faults())
    assert caught >= 5
