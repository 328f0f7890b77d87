"""The cap of moving obstacles: what it promises, by brute force, and that far ones may be left out."""

from __future__ import annotations

import numpy as np
import pytest

from lampyris.errors import SettingError
from lampyris.model.grid import Grid
from lampyris.model.obstacles import ObstacleStates
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.motion.cap_values import Around
from lampyris.motion.geometry.sampled_path import SampledPath
from lampyris.motion.safety.moving_obstacles import MovingObstacles, moving, moving_cap

SCENE = Scene(
    Grid(np.zeros((40, 40), dtype=bool), resolution=0.25),
    (0, 0),
    (39, 39),
    robot=Robot(radius=0.2, v_max=1.5, a_max=0.5, d_max=0.8),
)


def wandering(rng: np.random.Generator, n: int, kappa: float = 0.0) -> SampledPath:
    turn = np.cumsum(rng.normal(0.0, 0.15, n))[:-1]
    ds = rng.uniform(0.02, 0.4, n - 1)
    s = np.concatenate(([0.0], np.cumsum(ds)))
    step = (ds / 0.25)[:, None] * np.stack((np.cos(turn), np.sin(turn)), axis=-1)
    xy = np.concatenate((np.full((1, 2), 20.0), 20.0 + np.cumsum(step, axis=0)))
    return SampledPath(s, xy, np.tile((1.0, 0.0), (n, 1)), np.full(n, kappa), np.zeros(n, dtype=bool), 0.25)


def some(rng: np.random.Generator, m: int, age: float = 0.0) -> ObstacleStates:
    return ObstacleStates(rng.uniform(0, 40, (m, 2)), rng.uniform(0, 0.5, m), rng.uniform(0, 2, m), None, age)


def slow_cap(
    course: SampledPath, movers: ObstacleStates, settings: MovingObstacles
) -> tuple[list[float], list[int]]:
    """The same node by node, each edge at 400 points."""
    robot = SCENE.robot
    n = len(course)
    caps, whose = [], []
    for k in range(n):
        best, who = np.inf, -1
        for m in range(len(movers)):
            points = []
            for e in (k - 1, k):
                if 0 <= e < n - 1:
                    f = np.linspace(0.0, 1.0, 400)[:, None]
                    points.append(course.xy[e] + f * (course.xy[e + 1] - course.xy[e]))
            line = np.concatenate(points) if points else course.xy
            e2 = (line - movers.xy[m]) * 0.25
            d = float(np.sqrt((e2 * e2).sum(axis=1)).min()) - robot.radius - float(movers.radius[m])
            u, t, p = float(movers.top_speed[m]), settings.reaction, robot.d_max
            low, high = 0.0, 100.0
            for _ in range(60):
                v = 0.5 * (low + high)
                needed = v * t + v * v / (2 * p) + u * (movers.age + t + v / p)
                low, high = (v, high) if needed <= d - settings.margin else (low, v)
            if low < best:
                best, who = low, m
        caps.append(best)
        whose.append(who)
    return caps, whose


@pytest.mark.parametrize(
    "settings", [MovingObstacles(), MovingObstacles(0.0), MovingObstacles(0.4, margin=0.3)]
)
def test_beside_a_slow_twin(settings: MovingObstacles) -> None:
    rng = np.random.default_rng(4)
    bound = stood = 0
    for n, m in ((1, 3), (2, 1), (40, 6), (70, 2), (33, 1)):
        course, movers = wandering(rng, n), some(rng, m, 0.2)
        near = movers.xy.copy()
        near[0] = course.xy[n // 2] + rng.normal(0.0, 1.0, 2)
        movers = ObstacleStates(near, movers.radius, movers.top_speed, None, 0.2)
        made = moving_cap(course, SCENE, settings, Around(obstacle_states=movers))
        v = made[0].v if made else np.full(n, np.inf)
        cause_index = made[0].cause_index if made else np.full(n, -1)
        assert cause_index is not None
        for k, (slow, who) in enumerate(zip(*slow_cap(course, movers, settings), strict=True)):
            if np.isinf(v[k]):
                assert slow >= SCENE.robot.v_max - 1e-9
                assert cause_index[k] == -1
                continue
            # On samples the distance is a little greater than it is.
            assert v[k] <= slow + 1e-9
            assert v[k] == pytest.approx(slow, abs=2e-3)
            assert v[k] > 0.0 or slow < 2e-3
            if v[k] > 0.0:
                assert cause_index[k] == who
            bound += 1
            stood += v[k] == 0.0
    assert bound > 30
    assert stood > 0


def test_the_promise_itself() -> None:
    """From the cap's speed the robot stands before the obstacle can be there, and no faster."""
    rng = np.random.default_rng(8)
    d, u, t = rng.uniform(0, 5, 500), rng.uniform(0, 2, 500), 0.13
    v = moving(d, top_speed=u, reaction=t, age=0.05, d_max=0.7, margin=0.1)

    def needed(v: np.ndarray) -> np.ndarray:  # type: ignore[type-arg]
        return v * t + v * v / 1.4 + u * (0.05 + t + v / 0.7) + 0.1

    assert (needed(v)[v > 0] <= d[v > 0]).all()
    assert (needed(v * (1 + 1e-9) + 1e-9) > d).all()
    assert (v > 0).sum() > 200


def test_arcs_bulge_towards_the_obstacle() -> None:
    rng = np.random.default_rng(8)
    movers = some(rng, 5)
    flat = moving_cap(
        wandering(np.random.default_rng(1), 30), SCENE, MovingObstacles(), Around(obstacle_states=movers)
    )
    bent = moving_cap(
        wandering(np.random.default_rng(1), 30, 2.0), SCENE, MovingObstacles(), Around(obstacle_states=movers)
    )
    near = (flat[0].v > 0) & np.isfinite(flat[0].v)
    assert near.any()
    assert (bent[0].v[near] < flat[0].v[near]).all()


def test_more_movers_faster_movers_older_news_never_speed_up() -> None:
    rng = np.random.default_rng(15)
    course, movers = wandering(rng, 60), some(rng, 8)

    def speeds(movers: ObstacleStates) -> np.ndarray:  # type: ignore[type-arg]
        made = moving_cap(course, SCENE, MovingObstacles(), Around(obstacle_states=movers))
        return np.minimum(made[0].v if made else np.inf, SCENE.robot.v_max)

    before = speeds(movers)
    fewer = ObstacleStates(movers.xy[:-1], movers.radius[:-1], movers.top_speed[:-1])
    faster = ObstacleStates(movers.xy, movers.radius, movers.top_speed + 0.3)
    older = ObstacleStates(movers.xy, movers.radius, movers.top_speed, None, 0.4)
    assert (speeds(fewer) >= before).all()
    assert (speeds(faster) <= before).all()
    assert (speeds(older) <= before).all()
    assert (speeds(older) < before).any()


@pytest.mark.parametrize("age", [0.51, 1e9, -0.1, float("nan"), float("inf")])
def test_stale_news_is_no_news(age: float) -> None:
    course = wandering(np.random.default_rng(0), 5)
    made = moving_cap(
        course, SCENE, MovingObstacles(), Around(obstacle_states=some(np.random.default_rng(0), 0, age))
    )
    assert made[0].cause == "no data"
    assert not made[0].v.any()


def test_nobody_there_says_nothing() -> None:
    course = wandering(np.random.default_rng(0), 5)
    assert moving_cap(course, SCENE, MovingObstacles(), Around()) == []
    nobody = ObstacleStates(np.zeros((0, 2)), np.zeros(0), np.zeros(0))
    assert moving_cap(course, SCENE, MovingObstacles(), Around(obstacle_states=nobody)) == []


@pytest.mark.parametrize("name", ["reaction", "max_age", "margin"])
@pytest.mark.parametrize("value", [-0.1, float("nan"), float("inf"), "1", None, True])
def test_settings_are_checked(name: str, value: object) -> None:
    with pytest.raises(SettingError) as error:
        MovingObstacles(**{name: value})  # type: ignore[arg-type]
    assert error.value.where == f"physical.moving.{name}"
