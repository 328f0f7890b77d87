"""Laws side by side, and every law on courses: causes that bind, limits that help, ours under the optimum."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from speed_courses import random_course, random_robot

from lampyris import api
from lampyris.errors import SettingError, UsageError
from lampyris.model.curve import Curve
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.obstacles import ObstacleStates
from lampyris.model.path import path_of
from lampyris.model.profile import Profile
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.motion.geometry.sampled_path import SampledPath, sample_curve
from lampyris.motion.laws import registry as laws
from lampyris.motion.laws.bounds import Constant
from lampyris.motion.laws.compare import compare, entry_of
from lampyris.motion.laws.dissertation_in_metres import cells_passed, covered
from lampyris.motion.laws.physical import PhysicalLaw
from lampyris.referee import check_motion, check_profile
from lampyris.referee.caps import check_caps
from lampyris.typing import Floats
from sizes import sized

METRIC = tuple(name for name in laws.names() if name != "dissertation")
OURS = ("physical", "uncertainty", "blind", "cloud")
"""Laws whose every rule looks at the map and the robot alone where nothing moves, ``three-speed`` besides."""


def courses(seed: int, count: int, **how: Any) -> list[tuple[SampledPath, Scene]]:
    rng = np.random.default_rng(seed)
    return [random_course(rng, **how) for _ in range(count)]


def at_nodes(made: Profile, course: SampledPath) -> Floats:
    """A profile's speeds at the nodes of its course; the optimum has more nodes, between them."""
    found = np.searchsorted(made.s, course.s)
    assert np.array_equal(made.s[found], course.s)
    return made.v[found]


@pytest.mark.commit(1)
@pytest.mark.parametrize("law", METRIC)
def test_every_law_can_be_driven_and_stands_where_it_must(law: str) -> None:
    for course, scene in courses(1, 25):
        made = laws.profile(course, scene, law=law)
        assert made.law == law
        assert made.units == "m/s"
        assert check_profile(made, None, scene, creep=0.1, slowest=1e-9) is None
        assert (at_nodes(made, course)[course.stop] == 0).all()
        assert made.xy is not None


@pytest.mark.parametrize("law", METRIC)
def test_every_law_drives_paths_of_one_and_two_nodes(law: str) -> None:
    scene = Scene(Grid(np.zeros((9, 9), dtype=np.bool_), resolution=0.5), (0, 0), (1, 1))
    still = Curve(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0), np.zeros(0), (3.0, 3.0), 0.5)
    made = laws.profile(sample_curve(still, 0.1), scene, law=law)
    assert (made.v.tolist(), made.duration) == ([0.0], 0.0)
    short = SampledPath(
        np.array([0.0, 0.2]), np.array([[3.0, 3.0], [3.4, 3.0]]), np.tile((1.0, 0.0), (2, 1)), np.zeros(2),
        np.zeros(2, dtype=np.bool_), 0.5,
    )  # fmt: skip
    made = laws.profile(short, scene, law=law)
    assert made.v.tolist() == [0.0, 0.0]
    # Full throttle to sqrt(2 a d ds / (a + d)) and full braking, if no cap binds.
    assert made.duration >= math.sqrt(2 * 0.2 * 3.0) * (1 - 1e-12)


@pytest.mark.commit(2)
@pytest.mark.parametrize("law", [*OURS, "three-speed", "constant", "optimum"])
def test_every_node_has_a_cause_that_binds(law: str) -> None:
    seen = set()
    for course, scene in courses(2, 15):
        made = laws.profile(course, scene, law=law)
        named = dict(made.caps)
        robot = scene.robot
        for k, cause in enumerate(made.cause):
            seen.add(cause)
            v, x = float(made.v[k]), made.v**2
            if cause in named and law != "constant":
                at = [value[k] for name, value in made.caps if name == cause]
                assert v == pytest.approx(min(at), rel=1e-12)
            elif cause == "acceleration":
                assert x[k] - x[k - 1] == pytest.approx(
                    2 * robot.a_max * (made.s[k] - made.s[k - 1]), rel=1e-9
                )
            elif cause == "braking":
                assert x[k] - x[k + 1] == pytest.approx(
                    2 * robot.d_max * (made.s[k + 1] - made.s[k]), rel=1e-9
                )
                ahead = int(made.cause_index[k])
                assert ahead > k
                assert set(made.cause[k:ahead]) == {"braking"}
                assert made.cause[ahead] != "braking"
            elif law != "constant":
                assert cause in ("start", "goal", "turn")
                assert v == 0.0
        assert all((made.v <= cap * (1 + 1e-12)).all() for _, cap in made.caps)
    assert {"start", "goal", "acceleration", "braking"} <= seen


def test_every_cause_of_ours_turns_up() -> None:
    seen = {c for course, scene in courses(3, 30) for c in laws.profile(course, scene).cause}
    assert {"limit", "curvature", "clearance", "zone", "turn"} <= seen


@sized("cases", 4, 25)
@pytest.mark.parametrize("law", [*OURS, "constant"])
def test_ours_is_never_faster_than_the_optimum_nor_slower_than_one_speed(law: str, cases: int) -> None:
    for course, scene in courses(4, cases):
        best = laws.profile(course, scene, law="optimum")
        made = laws.profile(course, scene, law=law)
        assert (made.v <= at_nodes(best, course) * (1 + 1e-12)).all()
        assert made.duration >= best.duration * (1 - 1e-12)
        if law == "physical":
            constant = laws.profile(course, scene, law="constant")
            assert (constant.v <= made.v * (1 + 1e-12)).all()


@pytest.mark.commit(1)
@pytest.mark.parametrize("name", ["v_max", "a_max", "d_max", "a_lat_max"])
def test_raising_a_limit_never_lengthens_the_time(name: str) -> None:
    rng = np.random.default_rng(5)
    for course, scene in courses(6, 25):
        more = replace(scene.robot, **{name: getattr(scene.robot, name) * float(rng.uniform(1, 3))})
        for law in ("physical", "optimum", "constant"):
            before = laws.profile(course, scene, law=law)
            after = laws.profile(course, replace(scene, robot=more), law=law)
            assert (at_nodes(after, course) >= at_nodes(before, course) * (1 - 1e-12)).all()
            assert after.duration <= before.duration * (1 + 1e-12)


def test_raising_a_zone_never_lengthens_and_a_new_one_never_shortens() -> None:
    for course, scene in courses(7, 25):
        free = laws.profile(course, replace(scene, zones=None)).duration
        slow = laws.profile(course, scene).duration
        assert scene.zones is not None
        quick = laws.profile(course, replace(scene, zones=scene.zones * 1.5)).duration
        assert free * (1 - 1e-12) <= quick <= slow * (1 + 1e-12)


def test_an_obstacle_or_a_wall_more_never_shortens_the_time() -> None:
    rng = np.random.default_rng(8)
    slower = 0
    for course, scene in courses(9, 40):
        some = rng.integers(0, 40, (12, 2))
        before = laws.profile(course, scene)
        after = laws.profile(course, scene, obstacles=some)
        assert (after.v <= before.v * (1 + 1e-12)).all()
        slower += after.duration > before.duration * 1.001
        blocked = scene.grid.blocked.copy()
        blocked[some[:, 1], some[:, 0]] = True
        walled = laws.profile(course, replace(scene, grid=replace(scene.grid, blocked=blocked)))
        assert (walled.v <= before.v * (1 + 1e-12)).all()
        # A cell of an obstacle is as near as a wall there.
        np.testing.assert_allclose(walled.v, after.v, rtol=1e-12)
    assert slower > 5


def test_one_speed_is_the_least_cap_of_ours() -> None:
    for course, scene in courses(10, 15):
        made = laws.profile(course, scene, law="constant")
        ours = laws.profile(course, scene)
        least = min(float(v.min()) for _, v in ours.caps)
        inner = made.v[[c in ("limit", "curvature", "clearance", "zone") for c in made.cause]]
        assert (inner == least).all()
        assert made.v.max() <= least
        assert course.curve is not None
        assert check_caps(made, course.curve, scene) is None
    quicker = laws.profile(course, scene, law=Constant(creep=0.5))
    assert quicker.duration <= made.duration


def test_a_variant_is_ours_with_a_rule_more() -> None:
    for course, scene in courses(11, 10):
        ours = laws.profile(course, scene)
        for law in ("uncertainty", "blind", "three-speed", "cloud"):
            assert (laws.profile(course, scene, law=law).v <= ours.v * (1 + 1e-12)).all()
            off = laws.with_settings(law, {law.replace("-", "_"): None})
            assert laws.profile(course, scene, law=off).v.tolist() == ours.v.tolist()


# ---- the dissertation's law on a course --------------------------------------------------------------


def test_a_slanting_line_passes_straight_and_diagonal_steps() -> None:
    curve = Curve(
        np.array([[1.0, 1.0]]), np.array([[2.0, 1.0]]) / math.sqrt(5), np.array([12 * math.sqrt(5)]),
        np.zeros(1), (25.0, 13.0), 1.0,
    )  # fmt: skip
    cells, where = cells_passed(sample_curve(curve, 0.25), 0, len(sample_curve(curve, 0.25)) - 1)
    step = np.diff(cells, axis=0)
    assert (np.abs(step).max(axis=1) == 1).all()
    turn = (step[1:] * step[:-1]).sum(axis=1) / np.sqrt((step[1:] ** 2).sum(1) * (step[:-1] ** 2).sum(1))
    assert turn.min() > 0.7
    assert (np.diff(where) > 0).all()
    assert (where[0], where[-1]) == (0.0, pytest.approx(12 * math.sqrt(5)))


def test_on_lines_from_cell_to_cell_it_is_the_law_of_the_path() -> None:
    way = np.array([(2, 2), (3, 2), (4, 2), (5, 3), (6, 4), (7, 4), (7, 5), (7, 6), (8, 7), (9, 7), (10, 7)])
    rng = np.random.default_rng(3)
    blocked = rng.random((14, 14)) < 0.3
    blocked[way[:, 1], way[:, 0]] = False
    scene = Scene(
        Grid(blocked, resolution=0.5), (2, 2), (10, 7), moves="dissertation", robot=Robot(v_max=1.6)
    )
    step = np.diff(way, axis=0).astype(float)
    long = np.hypot(*step.T)
    curve = Curve(way[:-1].astype(float), step / long[:, None], long * 0.5, np.zeros(10), (10.0, 7.0), 0.5)
    course = sample_curve(curve, 0.125)
    want = laws.profile(path_of(way, MOVES["dissertation"]), scene, law="dissertation")
    made = laws.profile(course, scene, law="dissertation")
    assert (made.units, made.law) == ("m/s", "dissertation")
    at = np.searchsorted(made.s, want.s * 0.5 - 1e-9)
    np.testing.assert_allclose(made.v[at], want.v * 1.6 / 80, rtol=1e-12)
    assert (made.v <= want.v.max() * 1.6 / 80).all()
    free = check_motion(made.s, made.v, made.a, made.t, a_max=1e9, d_max=1e9, v_max=1.6)
    assert free is None
    assert made.cause[0] == "start"
    assert made.cause[-1] == "goal"
    assert set(made.cause) <= {
        "start",
        "acceleration",
        "limit",
        "ring 1",
        "ring 2",
        "angle",
        "braking",
        "goal",
    }


def test_it_can_be_driven_on_every_course_and_obstacles_count() -> None:
    rng = np.random.default_rng(12)
    slower = 0
    for course, scene in courses(12, 25):
        made = laws.profile(course, scene, law="dissertation", v0=0.0)
        found = check_motion(made.s, made.v, made.a, made.t, a_max=1e9, d_max=1e9, v_max=scene.robot.v_max)
        assert found is None
        assert (made.v[course.stop] == 0).all()
        discs = ObstacleStates(rng.uniform(5, 35, (30, 2)), np.full(30, 0.3 * course.resolution), np.ones(30))
        among = laws.profile(course, scene, law="dissertation", obstacle_states=discs)
        assert (among.v <= made.v + 1e-12).all()
        slower += among.duration > made.duration * 1.001
        driving = laws.profile(course, scene, law="dissertation", v0=0.1)
        assert driving.v[0] <= 0.1
    assert slower > 8


def test_a_course_within_two_cells_is_driven() -> None:
    scene = Scene(Grid(np.zeros((9, 9), dtype=np.bool_), resolution=0.5), (0, 0), (1, 1))
    for end in (3.2, 3.9):
        curve = Curve(
            np.array([[3.0, 3.0]]),
            np.array([[1.0, 0.0]]),
            np.array([(end - 3.0) / 2]),
            np.zeros(1),
            (end, 3.0),
            0.5,
        )
        made = laws.profile(sample_curve(curve, 0.05), scene, law="dissertation")
        assert made.v.max() <= 0.25
        assert made.v[1:-1].min() > 0
        assert made.duration > 0


def test_discs_cover_the_cells_that_they_touch() -> None:
    one = ObstacleStates(np.array([[3.4, 3.0]]), np.array([0.05]), np.array([1.0]))
    scene = Scene(Grid(np.zeros((9, 9), dtype=np.bool_)), (0, 3), (8, 3))
    course = api.smooth(scene, np.array([[0.0, 3.0], [8.0, 3.0]]))

    def of(some: ObstacleStates | None) -> list[list[int]]:
        return covered(some, course, (9, 9)).tolist()

    assert of(one) == [[3, 3]]
    assert of(replace(one, radius=np.array([0.2]))) == [[3, 3], [4, 3]]
    assert len(of(replace(one, radius=np.array([0.7])))) == 6
    assert of(None) == []
    rng = np.random.default_rng(4)
    for _ in range(40):
        some = ObstacleStates(rng.uniform(-4, 12, (5, 2)).round(1), rng.uniform(0, 3, 5).round(1), np.ones(5))
        gx = np.maximum(np.abs(np.arange(9)[None, :, None] - some.xy[:, 0]) - 0.5, 0.0)
        gy = np.maximum(np.abs(np.arange(9)[:, None, None] - some.xy[:, 1]) - 0.5, 0.0)
        want = (gx * gx + gy * gy <= some.radius * some.radius).any(axis=2)
        assert of(some) == np.argwhere(want)[:, ::-1].tolist()


def test_a_disc_of_any_size_covers_no_more_than_the_rings_around_the_course_hold() -> None:
    """A radius of 1e9 m in a file of obstacles: each cell of the disc was looked at, for hours."""
    scene = Scene(Grid(np.zeros((50, 50), dtype=np.bool_), resolution=0.01), (0, 3), (8, 3))
    course = api.smooth(scene, np.array([[0.0, 3.0], [8.0, 3.0]]))
    huge = ObstacleStates(np.array([[3.4, 3.0], [2e9, 1e9]]), np.array([1e9, 3.0]), np.array([1.0, 1.0]))
    found = covered(huge, course, (50, 50))
    assert 5 * 9 <= len(found) <= 15 * 15
    law = laws.profile(course, scene, law="dissertation", obstacle_states=huge)
    taken = laws.profile(course, scene, law="dissertation", obstacles=np.argwhere(np.ones((50, 50))))
    assert np.array_equal(law.v, taken.v)


def test_an_arc_that_leaves_the_box_of_its_nodes_has_its_rings() -> None:
    angles, radius, middle = np.radians((20.0, 190.0)), 200.0, np.array((225.0, 20.0))
    begin, end = (middle + radius * np.array((math.cos(t), math.sin(t))) for t in angles.tolist())
    heading = np.array([[-math.sin(angles[0]), math.cos(angles[0])]])
    length = np.array([radius * float(angles[1] - angles[0])])
    bend = Curve(begin[None], heading, length, np.array([1 / radius]), (float(end[0]), float(end[1])), 1.0)
    course = sample_curve(bend, 1e6)
    assert course.xy[:, 1].max() < 214
    top = ObstacleStates(np.array([[225.0, 224.0]]), np.array([2.0]), np.array([1.0]))
    assert [225, 222] in covered(top, course, (450, 450)).tolist()


# ---- compare -----------------------------------------------------------------------------------------


def test_laws_side_by_side() -> None:
    for course, scene in courses(13, 12):
        if len(course) < 2:
            continue
        found = compare(course, scene, ["constant", "rpp", "dissertation", "physical", "optimum"])
        by = {e.law: e for e in found}
        assert [e.law for e in found] == ["constant", "rpp", "dissertation", "physical", "optimum"]
        assert by["optimum"].ratio == 1.0
        assert by["physical"].ratio >= 1.0 - 1e-12
        assert by["constant"].ratio >= by["physical"].ratio - 1e-12
        for name in ("constant", "physical", "optimum"):
            assert by[name].broken == ()
        for e in found:
            assert e.duration_s == e.profile.duration
            assert e.mean == pytest.approx(course.s[-1] / e.duration_s)
            assert e.ratio == pytest.approx(e.duration_s / by["optimum"].duration_s)


def test_what_breaks_a_limit_is_told() -> None:
    course, scene = courses(14, 1)[0]
    robot = Robot(v_max=0.4, a_max=2.0, d_max=2.0, a_lat_max=0.05)
    best = laws.profile(course, replace(scene, robot=robot), law="optimum")
    weak = {
        "a_max": "acceleration",
        "d_max": "braking",
        "a_lat_max": "lateral",
        "v_max": "v_max",
    }
    assert entry_of(best, course, robot, best.duration).broken == ()
    for name, word in weak.items():
        less = replace(robot, **{name: getattr(robot, name) * 0.9})
        assert entry_of(best, course, less, best.duration).broken == (word,)


def test_the_dissertations_law_knows_no_limit_of_the_robot() -> None:
    rng = np.random.default_rng(15)
    broken = set()
    for _ in range(20):
        course, scene = random_course(rng, robot=random_robot(rng), zones=False)
        broken |= set(compare(course, scene, ["dissertation"])[0].broken)
    assert {"acceleration", "braking", "lateral"} <= broken


# ---- settings ----------------------------------------------------------------------------------------


def test_settings_by_dotted_names() -> None:
    one = laws.with_settings("physical", {"creep": 0.2, "uncertainty.k": 2.0, "approach": {"distance": 3.0}})
    assert (one.creep, one.uncertainty.k, one.uncertainty.period) == (0.2, 2.0, 0.1)
    assert (one.approach.distance, one.name) == (3.0, "physical")
    blind = laws.with_settings("blind", {})
    assert blind == laws.LAWS["blind"].settings
    assert laws.with_settings("physical", {"blind": True}).blind == blind.blind
    assert laws.with_settings("blind", {"blind": False}).blind is None
    assert laws.with_settings("rpp", {"desired": 1}).desired == 1.0
    assert laws.with_settings("dissertation", {"v_90": 30}).v_90 == 30.0


@pytest.mark.parametrize("law", laws.names())
def test_all_settings_as_a_table_make_the_same_law(law: str) -> None:
    told = laws.settings_of(law)
    assert laws.with_settings(law, told) == laws.LAWS[law].settings
    assert "name" not in told
    if law == "uncertainty":
        assert told["uncertainty.k"] == 3.0
        assert told["blind"] is None


@pytest.mark.parametrize(
    ("law", "given", "say"),
    [
        ("physical", {"crep": 0.2}, "did you mean creep?"),
        ("physical", {"uncertainty.sigma": 0.2}, r"physical\.uncertainty has no setting 'sigma'"),
        ("physical", {"nothing.k": 0.2}, "has no setting 'nothing.k'"),
        ("physical", {"name": "mine"}, "has no setting 'name'"),
        ("rpp", {"rpp.desired": 1.0}, "has no setting"),
        ("physical", {"uncertainty": None, "uncertainty.k": 2.0}, "off"),
        ("physical", {"uncertainty.k": "two"}, r"physical\.uncertainty\.k"),
        ("physical", {"moving": None}, r"physical\.moving"),
        ("optimum", {"creep": 0.2}, "has no setting"),
    ],
)
def test_settings_nobody_knows(law: str, given: dict[str, Any], say: str) -> None:
    with pytest.raises(SettingError, match=rf"LAW_SETTING.*{say}"):
        laws.with_settings(law, given)


def test_a_law_nobody_knows() -> None:
    with pytest.raises(UsageError, match="did you mean three-speed"):
        laws.with_settings("three_speed", {})
    with pytest.raises(UsageError, match="LAW"):
        laws.profile(*courses(1, 1)[0], law=PhysicalLaw(name="mine"))
