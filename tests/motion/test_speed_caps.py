"""Caps: their equations, and that each holds between the nodes as well, against the judge's own measure."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from speed_courses import random_course, random_curve

from lampyris.errors import SettingError
from lampyris.model.curve import Curve
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.motion import caps
from lampyris.motion.cap_values import Around
from lampyris.motion.geometry.clearance import wall_distance
from lampyris.motion.geometry.sampled_path import SampledPath, sample_curve
from lampyris.motion.laws import registry as laws
from lampyris.motion.laws.physical import Approach, PhysicalLaw
from lampyris.motion.safety.surroundings import cells_distance, least_around, reach_of, room, zone_limits
from lampyris.motion.safety.uncertainty import Uncertainty, uncertainty_cap
from lampyris.referee.caps import check_caps

FREE = Scene(Grid(np.zeros((40, 40), dtype=np.bool_), resolution=0.5), (0, 0), (1, 1))


def straight(
    xy: tuple[float, float], to: tuple[float, float], resolution: float, spacing: float
) -> SampledPath:
    """A course along one line."""
    d = np.array(to) - np.array(xy)
    long = float(np.hypot(*d))
    curve = Curve(
        np.array([xy]), np.array([d / long]), np.array([long * resolution]), np.zeros(1), to, resolution
    )
    return sample_curve(curve, spacing)


def test_a_bend_is_driven_at_the_lateral_limit() -> None:
    v = caps.curvature(np.array([0.0, 2.0, 0.5]), a_lat_max=0.8)
    assert v[0] == math.inf
    np.testing.assert_allclose(v[1:] ** 2 * np.array([2.0, 0.5]), 0.8, rtol=1e-15)


def test_the_approach_falls_in_proportion_and_ends_at_its_floor() -> None:
    v = caps.approach(np.array([3.0, 1.0, 0.5, 0.01, 0.0]), v_max=2.0, distance=1.0, v_app=0.05)
    assert v.tolist() == [math.inf, math.inf, 1.0, 0.05, 0.05]


def test_uncertainty_fits_the_room_and_the_looks() -> None:
    v = caps.narrow(np.array([1.0, 0.31, 0.0, math.inf]), sigma_0=0.02, sigma_v=0.1, k=3.0, creep=0.1)
    np.testing.assert_allclose(3.0 * (0.02 + 0.1 * v[:2]), [1.0, 0.31], rtol=1e-14)
    assert v[2:].tolist() == [0.1, math.inf]
    v = caps.undecided(np.array([1.0, 0.0, math.inf]), observations=4, period=0.25, creep=0.2)
    assert v.tolist() == [1.0, 0.2, math.inf]


def test_the_least_of_the_edges_at_a_node() -> None:
    assert least_around(np.array([3.0, 1.0, 2.0])).tolist() == [3.0, 1.0, 1.0, 2.0]


@pytest.mark.commit(1)
@pytest.mark.parametrize("fine", [1.0, 4.0])
def test_room_is_a_lower_bound_on_every_edge_and_a_close_one(fine: float) -> None:
    rng = np.random.default_rng(int(fine))
    lost = []
    for _ in range(40):
        course, scene = random_course(rng, fine=fine)
        if len(course) < 2:
            continue
        reach = reach_of(course, 3.0 * course.resolution)
        got = room(course, wall_distance(course.xy, scene.grid, reach), reach)
        assert course.curve is not None
        s = np.linspace(course.s[:-1], course.s[1:], 17)
        there = wall_distance(course.curve.at(s.ravel())[0], scene.grid, math.inf).reshape(17, -1).min(axis=0)
        edges = least_around(there)
        assert (np.minimum(got, reach) <= edges * (1 + 1e-12) + 1e-12).all()
        near = edges < 3.0 * course.resolution
        lost += ((edges - got)[near] / course.resolution).tolist()
    # Where the nearest wall is square to the way at mid-edge, what is lost is ds^2 / 8 over the distance.
    assert np.mean(lost) < (0.02 if fine == 4.0 else 0.2)
    assert len(lost) > 500


def test_along_a_wall_almost_nothing_is_lost() -> None:
    blocked = np.zeros((40, 40), dtype=np.bool_)
    blocked[11] = True
    course = straight((2, 10), (30, 10), 1.0, 0.25)
    got = room(course, wall_distance(course.xy, Grid(blocked), 9.0), 9.0)
    np.testing.assert_allclose(got, math.sqrt(0.25 - 0.125**2), rtol=1e-14)


def test_cells_distance_is_to_the_squares() -> None:
    xy = np.array([[0.0, 0.0], [2.5, 0.0], [0.0, 9.0]])
    cells = np.array([[3, 0], [-1, 1]])
    got = cells_distance(xy, cells, 0.5, 2.0)
    assert got is not None
    assert got.tolist() == [0.5 * math.hypot(0.5, 0.5), 0.0, math.inf]
    assert cells_distance(xy, cells + 50, 0.5, 2.0) is None


@pytest.mark.nightly
def test_no_zone_is_jumped_over() -> None:
    """Zones one cell wide, nodes much farther apart than that."""
    rng = np.random.default_rng(4)
    for spacing in (0.1, 0.5, 3.0):
        for _ in range(30):
            limits = np.where(rng.random((40, 40)) < 0.1, rng.uniform(0.05, 1.0, (40, 40)), np.inf)
            course = sample_curve(random_curve(rng, 0.5), spacing)
            if len(course) < 2:
                continue
            got = zone_limits(course, limits)
            assert course.curve is not None
            s = np.linspace(course.s[:-1], course.s[1:], 33)
            x, y = np.floor(course.curve.at(s.ravel())[0] + 0.5).astype(int).T
            there = limits[y, x].reshape(33, -1).min(axis=0)
            assert (got <= least_around(there)).all()


def test_a_zone_far_from_the_way_says_nothing() -> None:
    limits = np.full((40, 40), np.inf)
    limits[12:] = 0.3
    course = straight((2, 10), (30, 10), 0.5, 0.125)
    assert np.isinf(zone_limits(course, limits)).all()
    limits[10, 20] = 0.2
    slow = np.flatnonzero(zone_limits(course, limits) == 0.2)
    at = course.xy[slow, 0]
    # All nodes of edges that touch the cell, and no more.
    assert (at.min(), at.max()) == (pytest.approx(19.25), pytest.approx(20.75))


@pytest.mark.nightly
def test_the_stranger_passes_our_law_on_every_course() -> None:
    rng = np.random.default_rng(7)
    for _ in range(60):
        course, scene = random_course(rng)
        made = laws.profile(course, scene)
        assert course.curve is not None
        assert check_caps(made, course.curve, scene) is None


@pytest.mark.commit(1)
@pytest.mark.parametrize(
    ("off", "rule"), [("curvature", "curvature"), ("clearance", "clearance"), ("zones", "zone")]
)
def test_the_stranger_sees_a_rule_that_is_missing(off: str, rule: str) -> None:
    rng = np.random.default_rng(8)
    broken = set()
    for _ in range(30):
        course, scene = random_course(rng)
        made = laws.profile(course, scene, law=PhysicalLaw(**{off: False}))  # type: ignore[arg-type]
        assert course.curve is not None
        found = check_caps(made, course.curve, scene)
        broken |= {found.rule} if found else set()
        others = {"curvature": True, "clearance": True, "zones": True, off: False}
        assert check_caps(made, course.curve, scene, **others) is None
    assert broken == {rule}


def test_the_stranger_looks_between_the_nodes() -> None:
    """Caps taken at the nodes alone pass a narrow place too fast; so does a curve of another length."""
    limits = np.full((40, 40), np.inf)
    limits[10, 20] = 0.2
    course = straight((2.3, 10), (30.3, 10), 0.5, 0.5)
    scene = replace(FREE, zones=limits)
    made = laws.profile(course, scene, law=PhysicalLaw(zones=False))
    there = made.v.copy()
    there[np.floor(course.xy[:, 0] + 0.5) == 20] = 0.2
    assert course.curve is not None
    found = check_caps(replace(made, v=there), course.curve, scene)
    assert found is not None
    assert found.rule == "zone"
    behind = np.where(np.arange(40) <= 20, 0.2, np.inf) * np.ones((40, 1))
    slow = np.where(course.xy[:, 0] <= 20.4, 0.2, 0.3)
    found = check_caps(replace(made, v=slow), course.curve, replace(FREE, zones=behind), parts=16)
    assert found is not None
    assert found.rule == "zone"
    other = straight((2.3, 10), (29.3, 10), 0.5, 0.5).curve
    assert other is not None
    wrong = check_caps(made, other, scene)
    assert wrong is not None
    assert wrong.rule == "nodes"


def test_the_approach_holds_between_nodes() -> None:
    course = straight((2, 10), (30, 10), 0.5, 0.5)
    made = laws.profile(course, FREE, law=PhysicalLaw(approach=Approach(distance=4.0, speed=0.1)))
    s = np.linspace(made.s[:-1], made.s[1:], 9)
    x = np.linspace(made.v[:-1] ** 2, made.v[1:] ** 2, 9)
    left = made.s[-1] - s
    assert (np.sqrt(x) <= np.where(left < 4.0, np.maximum(left / 4.0, 0.1), 1.0) * (1 + 1e-12)).all()
    assert "approach" in made.cause


def test_the_uncertainty_law_slows_in_narrow_and_undecided_places() -> None:
    unknown = np.zeros((40, 40), dtype=np.bool_)
    unknown[13, 30:] = True
    walls = np.zeros((40, 40), dtype=np.bool_)
    walls[8, 5:15] = walls[12, 5:15] = True
    grid = Grid(walls | unknown, unknown, resolution=0.2)
    scene = Scene(grid, (0, 0), (1, 1), robot=Robot(radius=0.1, d_max=10.0, a_max=10.0))
    course = straight((1, 10), (38, 10), 0.2, 0.05)
    made = laws.profile(course, scene, law="uncertainty")
    narrow, open_ = made.v[(course.xy[:, 0] > 6) & (course.xy[:, 0] < 14)], made.v[course.xy[:, 0] == 22.0]
    # 1.5 cells of 0.2 m less the radius, less what half an edge costs.
    assert narrow.max() == pytest.approx((0.2 - 0.06) / 0.15, rel=0.01)
    assert open_ == 1.0
    assert {"uncertainty", "undecided"} <= set(made.cause)
    near = made.v[(course.xy[:, 0] > 31) & (course.xy[:, 0] < 33)]
    assert near.max() == pytest.approx((0.5 - 0.1) / 0.5, rel=0.01)
    assert (made.v <= laws.profile(course, scene).v).all()


def test_uncertainty_never_grows_slower_with_better_numbers() -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        course, scene = random_course(rng)
        base = Uncertainty(observations=6)
        v = np.minimum.reduce([c.v for c in uncertainty_cap(course, scene, base, Around())])
        for better in (
            replace(base, sigma_0=0.001),
            replace(base, sigma_v=0.01),
            replace(base, k=1.0),
            replace(base, observations=2),
            replace(base, period=0.05),
            replace(base, creep=0.3),
        ):
            caps_ = uncertainty_cap(course, scene, better, Around())
            assert (np.minimum.reduce([c.v for c in caps_]) >= v).all()


@pytest.mark.parametrize(
    ("kind", "given", "where"),
    [
        (Uncertainty, {"sigma_0": -1.0}, "physical.uncertainty.sigma_0"),
        (Uncertainty, {"sigma_v": 0.0}, "physical.uncertainty.sigma_v"),
        (Uncertainty, {"k": math.nan}, "physical.uncertainty.k"),
        (Uncertainty, {"observations": 2.5}, "physical.uncertainty.observations"),
        (Approach, {"distance": 0.0}, "physical.approach.distance"),
        (PhysicalLaw, {"curvature": 1}, "physical.curvature"),
        (PhysicalLaw, {"blind": 3.0}, "physical.blind"),
        (PhysicalLaw, {"moving": None}, "physical.moving"),
    ],
)
def test_settings_are_checked(kind: Any, given: dict[str, Any], where: str) -> None:
    with pytest.raises(SettingError) as raised:
        kind(**given)
    assert (raised.value.code, raised.value.where) == ("LAW_SETTING", where)


@pytest.mark.parametrize(
    "zones",
    [
        np.ones((3, 4)),
        np.zeros((40, 40)),
        np.full((40, 40), np.nan),
        np.full((40, 40), "a"),
        -np.ones((40, 40)),
    ],
)
def test_zones_are_positive_speeds_one_a_cell(zones: Any) -> None:
    with pytest.raises(SettingError, match="ZONES"):
        replace(FREE, zones=zones)


def test_zones_without_a_limit_are_none() -> None:
    assert replace(FREE, zones=np.full((40, 40), np.inf)).zones is None
    kept = replace(FREE, zones=np.ones((40, 40), dtype=np.int64)).zones
    assert kept is not None
    assert kept.dtype == np.float64
    assert not kept.flags.writeable
