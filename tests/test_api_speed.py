"""Courses and profiles at the front door: every law on bundled maps, unknown words, and the referee."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lampyris import Plan, Robot, Scene, Status, api
from lampyris.errors import InternalFault, LampyrisError
from lampyris.io.maps.load import load_map
from lampyris.model.curve import Curve
from lampyris.model.grid import Grid
from lampyris.model.obstacles import ObstacleStates
from lampyris.motion.geometry.sampled_path import sample_curve
from lampyris.motion.laws import physical
from lampyris.motion.laws import registry as laws
from lampyris.motion.laws.physical import PhysicalLaw

RNG = np.random.default_rng(1)


@pytest.fixture(autouse=True)
def same_draws() -> None:
    """The same draws for a test whichever ran before it in this process."""
    global RNG
    RNG = np.random.default_rng(1)


def case(name: str, resolution: float = 1.0, **robot: Any) -> tuple[Plan, Scene]:
    document = load_map(name)
    query = document.queries[0]
    grid = replace(document.grid, resolution=resolution)
    scene = Scene(grid, query.start, query.goal, robot=Robot(**robot))
    return api.plan(scene, "astar"), scene


@pytest.mark.parametrize("name", ["guide", "env-1", "maze-31"])
@pytest.mark.parametrize("resolution", [1.0, 0.1])
def test_every_law_passes_the_referee_on_a_curve(name: str, resolution: float) -> None:
    plan, scene = case(name, resolution, radius=0.3 * resolution)
    course = api.smooth(scene, plan)
    for law in laws.names():
        made = api.speed_profile(scene, course, law)
        assert (made.law, made.units) == (law, "m/s")
        assert made.duration > 0


@pytest.mark.parametrize("law", laws.names())
def test_every_law_passes_the_referee_on_a_path(law: str) -> None:
    plan, scene = case("guide")
    made = api.speed_profile(scene, plan, law)
    assert made.law == law
    assert made.xy is None


def test_a_smooth_profile_is_that_of_the_course() -> None:
    plan, scene = case("env-1", 0.25, radius=0.05, turn_radius=0.1)
    course = api.smooth(scene, plan, spacing=0.05)
    assert np.diff(course.s).max() <= 0.05 * (1 + 1e-12)
    made = api.speed_profile(scene, plan, smooth="straight", spacing=0.05)
    assert made.v.tolist() == api.speed_profile(scene, course).v.tolist()
    lines = api.speed_profile(scene, plan, smooth="none")
    assert lines.xy is None
    assert (api.speed_profile(scene, api.smooth(scene, plan, method="none")).v[course.stop[:0]] == 0).all()


def test_a_polyline_from_elsewhere_is_a_way() -> None:
    plan, scene = case("guide")
    assert plan.path is not None
    points = plan.path.cells.astype(float)
    for smooth in ("straight", "arcs", "none"):
        assert (
            api.smooth(scene, points, method=smooth).s.tolist()
            == api.smooth(scene, plan, method=smooth).s.tolist()
        )
    assert api.smooth(scene, points).s.tolist() == api.smooth(scene, points, method="arcs").s.tolist()
    assert api.smooth(scene, plan).s[-1] < api.smooth(scene, points).s[-1]


def test_zones_and_rules_by_name_slow_down() -> None:
    plan, scene = case("env-1", radius=0.3)
    course = api.smooth(scene, plan, method="arcs")
    free = api.speed_profile(scene, course).duration
    zones = np.where(RNG.random(scene.grid.blocked.shape) < 0.2, 0.3, np.inf)
    slow = replace(scene, zones=zones)
    assert api.speed_profile(slow, course).duration > free
    assert "zone" in api.speed_profile(slow, course).cause
    assert api.speed_profile(slow, course, law_settings={"zones": False}).duration == free
    assert api.speed_profile(scene, course, law_settings={"clearance": False}).duration < free
    assert api.speed_profile(scene, course, law_settings={"creep": 0.5}).duration < free
    assert api.speed_profile(scene, course, law_settings={"uncertainty.k": 2.0}).duration > free
    assert api.speed_profile(slow, plan, law_settings={"approach": {"distance": 4.0}}).duration > free


def test_moving_obstacles_slow_down() -> None:
    plan, scene = case("env-1", radius=0.3)
    course = api.smooth(scene, plan)
    fast = int(api.speed_profile(scene, course).v.argmax())
    places = course.xy[fast] + RNG.uniform(-1, 1, (2000, 2))
    away = np.sqrt(((places[:, None] - course.xy) ** 2).sum(axis=2).min(axis=1))
    beside = places[(away > 0.8) & (away < 0.9)][:1]
    movers = ObstacleStates(beside, np.array([0.2]), np.array([0.05]))
    made = api.speed_profile(scene, course, obstacle_states=movers)
    assert made.duration > api.speed_profile(scene, course).duration
    assert "moving obstacle" in made.cause


@pytest.mark.parametrize(
    ("how", "code"),
    [
        ({"law": "fast"}, "LAW"),
        ({"law_settings": {"crep": 1}}, "LAW_SETTING"),
        ({"law": PhysicalLaw(), "law_settings": {"creep": 0.5}}, "LAW"),
        ({"smooth": "clothoids"}, "SMOOTH"),
        ({"smooth": "arcs", "spacing": 0.0}, "SPACING"),
        ({"smooth": "arcs", "spacing": float("nan")}, "SPACING"),
        ({"smooth": "arcs", "spacing": True}, "SPACING"),
        ({"v0": 5.0}, "PROFILE_INFEASIBLE"),
        ({"v0": -1.0}, "START_SPEED"),
    ],
)
def test_words_nobody_knows(how: dict[str, Any], code: str) -> None:
    plan, scene = case("guide")
    with pytest.raises(LampyrisError) as raised:
        api.speed_profile(scene, plan, **how)
    assert raised.value.code == code


def test_a_way_that_is_none() -> None:
    plan, scene = case("guide")
    with pytest.raises(LampyrisError, match="PROFILE"):
        api.speed_profile(scene, replace(plan, path=None, status=Status.NO_PATH))
    with pytest.raises(LampyrisError, match="TYPE"):
        api.speed_profile(scene, "guide")  # type: ignore[arg-type]
    with pytest.raises(LampyrisError, match="PATH_OUTSIDE"):
        api.smooth(scene, np.array([[0.0, 0.0], [99.0, 0.0]]))


@pytest.mark.parametrize("fault", ["faster", "clock", "clearance", "curvature", "zones"])
def test_the_referee_stands_at_the_door(fault: str, monkeypatch: pytest.MonkeyPatch) -> None:
    plan, scene = case("env-1", radius=0.3, a_lat_max=0.1)
    course = api.smooth(scene, plan)
    scene = replace(scene, zones=np.where(RNG.random(scene.grid.blocked.shape) < 0.2, 0.3, np.inf))
    true = laws.profile

    def lying(way: Any, scene: Any, **how: Any) -> Any:
        if fault not in ("faster", "clock"):
            return true(way, scene, **{**how, "law": laws.with_settings("physical", {fault: False})})
        made = true(way, scene, **how)
        return replace(made, v=made.v * 1.01) if fault == "faster" else replace(made, t=made.t * 1.01)

    monkeypatch.setattr(laws, "profile", lying)
    with pytest.raises(InternalFault):
        api.speed_profile(scene, course)


def test_room_at_the_nodes_alone_is_not_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    plan, scene = case("env-1", radius=0.3)
    course = api.smooth(scene, plan)
    monkeypatch.setattr(physical, "room", lambda course, distance, reach: distance)
    with pytest.raises(InternalFault, match="clearance"):
        api.speed_profile(scene, course)


def test_a_law_that_cannot_be_followed_between_nodes_is_seen() -> None:
    """The stretch of a zone between two nodes far apart, on a course that somebody made by hand."""
    _, scene = case("guide")
    zones = np.full(scene.grid.blocked.shape, np.inf)
    zones[:, 4] = 0.2
    curve = Curve(
        np.array([[1.0, 1.0]]), np.array([[1.0, 0.0]]), np.array([6.0]), np.zeros(1), (7.0, 1.0), 1.0
    )
    free = replace(scene, grid=replace(scene.grid, blocked=np.zeros_like(scene.grid.blocked)), zones=zones)
    made = api.speed_profile(free, sample_curve(curve, 2.0))
    assert made.v.max() <= 0.2


def test_dissertation_law_on_tiny_cells_at_a_great_speed_passes_the_referee() -> None:
    """Exit code 6: 1e6 m/s on cells of a micrometre take more than 1e12 m/s2, as the law asks."""
    scene = Scene(
        Grid(np.zeros((3, 9), dtype=np.bool_), resolution=1e-6), (0, 1), (8, 1), robot=Robot(v_max=1e6)
    )
    course = api.smooth(scene, np.array([[0.0, 1.0], [8.0, 1.0]]))
    made = api.speed_profile(scene, course, "dissertation")
    assert made.a.max() > 1e12
    assert made.v.max() > 1e4
