"""The cap of danger: normal clouds, the velocity obstacle's indices, and what they make of a scene."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from lampyris.errors import SettingError
from lampyris.model.grid import Grid
from lampyris.model.obstacles import ObstacleStates
from lampyris.model.path import path_of
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.motion.cap_values import Around, Cap
from lampyris.motion.geometry.sampled_path import SampledPath, sample_path
from lampyris.motion.safety.danger_cloud import (
    NODES,
    Cloud,
    CloudModel,
    approach,
    cloud_between,
    cloud_cap,
    degree,
    drops,
    drops_at,
    membership,
    slowed,
)

SCENE = Scene(Grid(np.zeros((41, 101), dtype=bool), resolution=0.2), (0, 20), (100, 20), robot=Robot(0.2))


def way() -> SampledPath:
    cells = np.array([(x, 20) for x in range(101)])
    return sample_path(path_of(cells, SCENE.moves), 0.2)


def cap(
    movers: ObstacleStates | None, settings: CloudModel | None = None, course: SampledPath | None = None
) -> Cap | None:
    found = cloud_cap(course or way(), SCENE, settings or CloudModel(), Around(obstacle_states=movers))
    return found[0] if found else None


def one(xy: tuple[float, float], velocity: tuple[float, float] | None, **more: float) -> ObstacleStates:
    speed = None if velocity is None else np.array([velocity])
    return ObstacleStates(np.array([xy]), np.array([0.3]), np.array([1.0]), speed, **more)


# clouds ----------


def test_the_nodes_are_those_of_gauss_and_hermite() -> None:
    x, w = np.polynomial.hermite.hermgauss(9)
    mine = sorted((side * node, share) for node, share in NODES for side in ((1, -1) if node else (1,)))
    assert [m[0] for m in mine] == pytest.approx(x.tolist(), abs=1e-14)
    assert [m[1] for m in mine] == pytest.approx((w / math.sqrt(math.pi)).tolist(), rel=1e-12)


@pytest.mark.parametrize(("share", "within"), [(0.0, 1e-15), (0.1, 3e-11), (0.2, 5e-6), (1 / 3, 2e-3)])
def test_membership_is_the_integral(share: float, within: float) -> None:
    cloud = Cloud(2.0, 1.5, share * 1.5)
    for x in np.linspace(-4, 8, 41):
        if share == 0.0:
            want = math.exp(-((x - 2.0) ** 2) / (2 * 1.5**2))
        else:
            want = quad(_under, 1e-12, 1.5 + 8 * cloud.he, args=(x, cloud), limit=200)[0]
            want += quad(_under, 1.5 - 8 * cloud.he, -1e-12, args=(x, cloud))[0] if share > 0.125 else 0.0
        assert float(membership(cloud, np.array([x]))[0]) == pytest.approx(want, abs=within)


def _under(y: float, x: float, cloud: Cloud) -> float:
    density = math.exp(-((y - cloud.en) ** 2) / (2 * cloud.he**2)) / (cloud.he * math.sqrt(2 * math.pi))
    return density * math.exp(-((x - cloud.ex) ** 2) / (2 * y * y))


@pytest.mark.parametrize("x", [0.0, 0.5, 1.7, 3.0])
def test_membership_is_the_mean_of_the_drops_there(x: float) -> None:
    cloud = Cloud(0.0, 1.0, 0.2)
    mu = drops_at(cloud, x, 100_000, np.random.default_rng(1))
    error = 5 * float(mu.std()) / math.sqrt(100_000) + 1e-5
    assert float(membership(cloud, np.array([x]))[0]) == pytest.approx(float(mu.mean()), abs=error)


def test_the_forward_generator() -> None:
    cloud = Cloud(3.0, 2.0, 0.4)
    x, mu = drops(cloud, 100_000, np.random.default_rng(2))
    assert float(x.mean()) == pytest.approx(3.0, abs=0.04)
    assert float(x.var()) == pytest.approx(2.0**2 + 0.4**2, rel=0.03)
    assert float(mu.mean()) == pytest.approx(1 / math.sqrt(2), abs=0.005)
    again = drops(cloud, 100_000, np.random.default_rng(2))
    assert again[0].tobytes() == x.tobytes()


def test_an_interval_gives_its_cloud() -> None:
    assert cloud_between(-3.0, 9.0, 0.5) == Cloud(3.0, 2.0, 0.5)


def test_a_degree_falls_from_one_to_nothing() -> None:
    x = np.array([-5.0, 0.0, 0.1, 1.0, 2.0, 5.0, 1e6, np.inf])
    mu = degree(Cloud(0.0, 1.0, 0.1), x)
    assert mu[0] == mu[1] == 1.0
    assert (np.diff(mu[1:5]) < 0).all()
    assert mu[-1] == 0.0


# the velocity obstacle ----------


def test_approach_agrees_with_small_steps_of_time() -> None:
    rng = np.random.default_rng(3)
    p, r = rng.normal(0, 3, (400, 2)), rng.normal(0, 1, (400, 2))
    radius, horizon = 0.8, 5.0
    time, gap = approach(p, r, radius, horizon)
    t = np.linspace(0, horizon, 5001)
    far = np.sqrt(((p[:, None, :] - r[:, None, :] * t[None, :, None]) ** 2).sum(axis=2))
    hits = 0
    for k in range(len(p)):
        if far[k, 0] <= radius:
            assert time[k] == gap[k] == 0.0
        elif far[k, 1] >= far[k, 0]:
            assert np.isinf(time[k])
            assert np.isinf(gap[k])
        else:
            assert gap[k] == pytest.approx(max(far[k].min() - radius, 0.0), abs=1e-3)
            inside = np.flatnonzero(far[k] < radius - 1e-4)
            if len(inside):
                hits += 1
                assert time[k] == pytest.approx(t[inside[0]], abs=0.03)
            elif gap[k] > 0:
                assert time[k] == pytest.approx(t[far[k].argmin()], abs=2e-3)
    assert hits > 20


def test_the_law_by_numbers() -> None:
    danger = np.array([0.0, 0.25, 0.95, 1.0])
    assert slowed(danger, v_max=2.0, creep=0.2).tolist() == pytest.approx([2.0, 1.5, 0.2, 0.2])


def test_one_obstacle_head_on_by_hand() -> None:
    movers = one((20.0, 20.0), (-0.5, 0.0))
    settings = CloudModel(hyper=0.0)
    found = cap(movers, settings)
    assert found is not None
    time = (4.0 - 0.5) / 1.5
    assert found.v[0] == pytest.approx(1.0 - math.exp(-(time**2) / (2 * 2.0**2)))
    # At node 5 the robot is 1 m on, the obstacle 0.5 m nearer.
    time = (4.0 - 1.0 - 0.5 - 0.5) / 1.5
    assert found.v[5] == pytest.approx(max(1.0 - math.exp(-(time**2) / (2 * 2.0**2)), 0.1))


# the cap ----------


def test_without_obstacles_there_is_no_cap() -> None:
    assert cap(None) is None
    assert cap(ObstacleStates(np.zeros((0, 2)), np.zeros(0), np.zeros(0))) is None


def test_a_crossing_obstacle_slows_and_a_receding_one_does_not() -> None:
    crossing, receding = cap(one((20, 5), (0, 0.75))), cap(one((20, 30), (0, 1.0)))
    assert crossing is not None
    assert receding is not None
    assert crossing.v[0] < 0.95
    assert crossing.v.min() < 0.3
    assert (np.minimum(receding.v, 1.0) > 0.95).all()
    assert crossing.cause == "danger"
    assert crossing.cause_index is not None
    assert set(crossing.cause_index[np.isfinite(crossing.v)].tolist()) == {0}


def test_nodes_beyond_the_horizon_are_not_judged() -> None:
    found = cap(one((60, 20), (-1, 0)))
    assert found is not None
    assert np.isinf(found.v[way().s > 6.0]).all()
    assert found.cause_index is not None
    assert (found.cause_index[way().s > 6.0] == -1).all()


def test_a_course_of_one_node() -> None:
    full = way()
    point = SampledPath(full.s[:1], full.xy[:1], full.heading[:1], full.curvature[:1], full.stop[:1], 0.2)
    found = cap(one((4, 20), (0, 0)), course=point)
    assert found is not None
    assert found.v.shape == (1,)


def test_the_worst_obstacle_is_named_and_more_obstacles_never_speed_up() -> None:
    rng = np.random.default_rng(4)
    for _ in range(20):
        m = int(rng.integers(2, 6))
        xy = np.stack((rng.uniform(10, 60, m), rng.uniform(0, 40, m)), axis=1)
        every = ObstacleStates(xy, np.full(m, 0.3), np.full(m, 1.0), rng.uniform(-0.7, 0.7, (m, 2)))
        whole = cap(every)
        assert whole is not None
        assert whole.cause_index is not None
        alone = []
        for k in range(m):
            assert every.velocity is not None
            part = cap(ObstacleStates(xy[k : k + 1], [0.3], [1.0], every.velocity[k : k + 1]))
            assert part is not None
            alone.append(part.v)
        table = np.array(alone)
        assert (whole.v == table.min(axis=0)).all()
        named = np.flatnonzero(whole.cause_index >= 0)
        assert (table[whole.cause_index[named], named] == whole.v[named]).all()


def test_longer_sight_and_wider_berth_never_speed_up() -> None:
    movers = one((25, 12), (-0.2, 0.3))
    for name, values in (("horizon", (3.0, 6.0, 9.0)), ("near", (0.5, 1.5, 3.0))):
        found = [cap(movers, CloudModel(**{name: value})) for value in values]
        for less, more in pairwise(found):
            assert less is not None
            assert more is not None
            judged = way().s <= 3.0
            assert (more.v[judged] <= less.v[judged] + 1e-12).all()


def test_an_unknown_velocity_is_taken_to_come_straight_at_the_robot() -> None:
    unknown, known = cap(one((20, 20), None)), cap(one((20, 20), (-1.0, 0.0)))
    assert unknown is not None
    assert known is not None
    assert unknown.v[:9] == pytest.approx(known.v[:9])
    aged = cap(one((20, 20), (-1.0, 0.0), age=0.5))
    moved = cap(one((17.5, 20), (-1.0, 0.0)))
    assert aged is not None
    assert moved is not None
    assert aged.v == pytest.approx(moved.v)


@pytest.mark.parametrize(
    ("kind", "name", "value"),
    [
        (CloudModel, "horizon", 0.0),
        (CloudModel, "near", -1.0),
        (CloudModel, "hyper", 0.34),
        (CloudModel, "creep", 0.0),
        (CloudModel, "creep", "slow"),
    ],
)
def test_settings_are_checked(kind: type, name: str, value: object) -> None:
    with pytest.raises(SettingError, match=rf"LAW_SETTING.*physical\.cloud\.{name}"):
        kind(**{name: value})


def test_a_cloud_must_not_be_a_mist() -> None:
    with pytest.raises(SettingError, match=r"cloud\.he"):
        Cloud(0.0, 1.0, 0.4)
    with pytest.raises(SettingError, match=r"cloud\.en"):
        Cloud(0.0, 0.0, 0.0)
