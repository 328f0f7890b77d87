"""The cap of blind areas: its equation, what it sees, and what it promises."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from lampyris.errors import SettingError
from lampyris.kernels.motion import visibility
from lampyris.kernels.motion.visibility import UNIT
from lampyris.model.curve import Curve
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.motion.cap_values import Around
from lampyris.motion.geometry.sampled_path import SampledPath, sample_curve
from lampyris.motion.safety.blind_areas import (
    BlindArea,
    blind_cap,
    hiding_distance,
    need,
    stop_within,
    visible_cells,
)
from lampyris_selfcheck.reference.motion import sight
from reference.kernel_forms import use
from sizes import sized

ROBOT = Robot(radius=0.2)


def straight(points: list[tuple[float, float]], resolution: float, spacing: float) -> SampledPath:
    """A polyline driven without stops: corners count as bends of no length."""
    xy = np.array(points, dtype=np.float64)
    d = np.diff(xy, axis=0)
    size = np.sqrt((d * d).sum(axis=1))
    curve = Curve(
        xy[:-1], d / size[:, None], size * resolution, np.zeros(len(d)), tuple(points[-1]), resolution
    )
    return sample_curve(curve, spacing)


def caps(
    course: SampledPath, grid: Grid, settings: BlindArea | None = None, robot: Robot = ROBOT
) -> np.ndarray:
    scene = Scene(grid, (0, 0), (0, 0), robot=robot)
    (cap,) = blind_cap(course, scene, settings or BlindArea(), Around())
    assert cap.cause == "blind area"
    assert cap.v.shape == course.s.shape
    return cap.v


def draw(rows: list[str]) -> np.ndarray:
    return np.array([[c == "#" for c in row] for row in rows])


# the equation ----------


@pytest.mark.parametrize("seed", range(5))
def test_the_law_uses_up_its_distance_exactly(seed: int) -> None:
    rng = np.random.default_rng(seed)
    for _ in range(200):
        p, t, u, a = rng.uniform(0.1, 3.0), rng.uniform(0, 1.0), rng.uniform(0, 2.0), rng.uniform(0.1, 2.0)
        d = rng.uniform(0, 10.0)
        v = float(stop_within(np.array([d]), d_max=p, reaction=t, hidden_speed=u, a_max=a)[0])
        w = v + a * t
        used = v * t + 0.5 * a * t * t + w * w / (2 * p) + u * (t + w / p)
        if v > 0:
            assert used == pytest.approx(d, rel=1e-9)
        else:
            assert used >= d * (1 - 1e-12)


def test_without_acceleration_it_is_the_formula_of_the_literature() -> None:
    p, t, u, d = 1.3, 0.4, 0.7, 2.5
    v = stop_within(np.array([d, np.inf, 0.0]), d_max=p, reaction=t, hidden_speed=u, a_max=0.0)
    assert v[0] == pytest.approx(-(p * t + u) + math.sqrt((p * t + u) ** 2 + 2 * p * (d - u * t)))
    assert np.isinf(v[1])
    assert v[2] == 0.0
    still = stop_within(np.array([d]), d_max=p, reaction=0.0, hidden_speed=0.0, a_max=1.0)
    assert still[0] == pytest.approx(math.sqrt(2 * p * d)), "Lumelsky's bound"


def test_need_is_where_the_law_allows_top_speed() -> None:
    settings, robot = BlindArea(hidden_speed=1.4, reaction=0.3), Robot(v_max=1.7, d_max=0.8, a_max=0.6)
    v = stop_within(np.array([need(robot, settings)]), d_max=0.8, reaction=0.3, hidden_speed=1.4, a_max=0.6)
    assert v[0] == pytest.approx(1.7)


# where it slows ----------


def corridor(door: bool) -> Grid:
    blocked = np.ones((40, 160), dtype=bool)
    blocked[22:34] = False
    if door:
        blocked[:22, 80:90] = False
    return Grid(blocked, resolution=0.1)


def test_an_open_field_does_not_slow_and_a_corridor_does_not_creep() -> None:
    course = straight([(2, 28), (157, 28)], 0.1, 0.1)
    assert np.isinf(caps(course, Grid(np.zeros((60, 160), dtype=bool), resolution=0.1))).all()
    assert np.isinf(caps(course, corridor(door=False))).all()
    near = straight([(2, 24), (157, 24)], 0.1, 0.1)
    assert np.isinf(caps(near, corridor(door=False))).all(), "along a wall"


def test_a_side_door_slows_before_it_and_not_after() -> None:
    course = straight([(2, 30), (157, 30)], 0.1, 0.1)
    v = caps(course, corridor(door=True))
    x = course.xy[:, 0]
    assert np.isinf(v[x < 55]).all()
    approach = v[(x > 62) & (x < 78)]
    assert (np.diff(approach) < 0).all()
    assert 0.1 <= v[(x > 76) & (x < 79)].min() < 0.45
    assert np.isinf(v[x > 95]).all()


def test_what_cannot_get_out_hides_nothing() -> None:
    blocked = np.ones((40, 160), dtype=bool)
    blocked[22:34] = False
    blocked[:22, 80:83] = False  # a slit of 0.3 m
    course = straight([(2, 30), (157, 30)], 0.1, 0.1)
    grid = Grid(blocked, resolution=0.1)
    assert np.isinf(caps(course, grid, BlindArea(hidden_radius=0.5))).all()
    assert caps(course, grid, BlindArea(hidden_radius=0.1)).min() < 1.0


def test_a_rough_wall_does_not_creep() -> None:
    rng = np.random.default_rng(3)
    blocked = np.zeros((60, 300), dtype=bool)
    blocked[:20] = True
    blocked[20] = rng.random(300) < 0.3
    course = straight([(2, 34), (297, 34)], 0.05, 0.1)
    assert np.isinf(caps(course, Grid(blocked, resolution=0.05))).all()
    assert caps(course, Grid(blocked, resolution=0.05), BlindArea(hidden_radius=0.0)).min() < 0.5


def test_reach_limits_the_speed_everywhere() -> None:
    course = straight([(2, 28), (157, 28)], 0.1, 0.5)
    grid = Grid(np.zeros((60, 160), dtype=bool), resolution=0.1)
    v = caps(course, grid, BlindArea(reach=1.0))
    want = stop_within(np.array([1.0 - 0.4]), d_max=1.0, reaction=0.2, hidden_speed=1.0, a_max=0.5)
    assert v == pytest.approx(np.full(len(course), want[0]))
    enough = need(ROBOT, BlindArea()) + 0.4
    assert np.isinf(caps(course, grid, BlindArea(reach=enough * 1.001))).all()


def test_unknown_cells_hide_and_hold() -> None:
    blocked = np.zeros((60, 160), dtype=bool)
    unknown = np.zeros_like(blocked)
    unknown[20:40, 80:] = True
    course = straight([(2, 30), (70, 30)], 0.1, 0.1)
    grid = Grid(blocked | unknown, unknown=unknown, resolution=0.1)
    d = hiding_distance(course, Scene(grid, (0, 0), (0, 0), robot=ROBOT), BlindArea())
    x = course.xy[:, 0]
    near = (x > 60) & (x < 69)
    # The square begins at x = 79.5; the nearest point of the edge ahead is a node nearer; the mover is 0.2 m.
    want = 0.1 * (79.5 - x[near]) - 0.1 - 0.2
    assert (d[near] <= want + 0.1 + 1e-9).all()
    assert (d[near] >= want - 0.05).all()
    wall = caps(course, Grid(blocked | unknown, resolution=0.1))
    assert np.isinf(wall[x < 55]).all()
    assert (caps(course, grid)[near] <= wall[near]).all()
    assert (caps(course, grid, BlindArea(unknown="map")) == wall).all()


def test_creep_is_the_floor() -> None:
    course = straight([(2, 24), (157, 24)], 0.1, 0.1)
    grid = corridor(door=True)
    assert caps(course, grid, BlindArea(creep=0.3)).min() == pytest.approx(0.3)


def test_more_walls_hide_more_and_raising_a_danger_never_speeds_up() -> None:
    rng = np.random.default_rng(5)
    for _ in range(8):
        blocked = rng.random((30, 60)) < 0.1
        blocked[15] = False
        course = straight([(1, 15), (58, 15)], 0.2, 0.3)
        grid = Grid(blocked, resolution=0.2)
        base = caps(course, grid)
        for worse in (BlindArea(hidden_speed=1.5), BlindArea(reaction=0.5), BlindArea(reach=1.5)):
            assert (caps(course, grid, worse) <= base).all()
        assert (caps(course, grid, robot=replace(ROBOT, radius=0.3)) <= base).all()
        assert (caps(course, grid, robot=replace(ROBOT, d_max=2.0)) >= base).all()


# what it promises ----------


@pytest.mark.nightly
@sized("cases", 3, 8)
def test_no_mover_that_turns_up_ahead_can_touch_the_robot_while_it_moves(cases: int) -> None:
    places, broken = zip(*(brute_force(seed, BlindArea()) for seed in range(cases)), strict=True)
    assert sum(broken) == 0
    assert sum(places) > 625 * cases


@pytest.mark.nightly
@sized("cases", 3, 8)
def test_the_brute_force_notices_a_mover_faster_than_promised(cases: int) -> None:
    assert sum(brute_force(seed, BlindArea(), faster=1.2)[1] for seed in range(cases)) > 2.5 * cases


def brute_force(seed: int, settings: BlindArea, faster: float = 1.0) -> tuple[int, int]:
    """Every place, every time: a mover that turns up there, goes anywhere at top speed, through walls even.

    At each moment: points that are not seen next to points that are, where a mover's centre may be. Of those
    that going on leads nearer to, the greatest disc that the mover may have reached must not touch the robot
    while it goes on accelerating for the reaction time and then brakes. Returns how many places were looked
    at, and how many of them broke the promise.
    """
    rng = np.random.default_rng(seed)
    res, fine = 0.25, 4
    blocked = np.zeros((24, 36), dtype=bool)
    for _ in range(9):
        x, y, w, h = rng.integers(0, 34), rng.integers(0, 22), rng.integers(1, 7), rng.integers(1, 7)
        blocked[y : y + h, x : x + w] = True
    way = [(2.0, 12.0), (18.0, float(rng.integers(9, 15))), (33.0, 12.0)]
    for (x0, y0), (x1, y1) in pairwise(way):
        for f in np.linspace(0, 1, 80):
            x, y = round(x0 + f * (x1 - x0)), round(y0 + f * (y1 - y0))
            blocked[y - 1 : y + 2, x - 1 : x + 2] = False
    grid = Grid(blocked, resolution=res)
    course = straight(way, res, 0.05)
    cap = caps(course, grid, settings)
    v = np.minimum(np.where(np.isinf(cap), ROBOT.v_max, cap), ROBOT.v_max)
    creeping = v <= settings.creep * ROBOT.v_max
    height, width = blocked.shape
    gy, gx = np.mgrid[0 : height * fine, 0 : width * fine]
    points = np.stack(((gx.ravel() + 0.5) / fine, (gy.ravel() + 0.5) / fine), axis=1)
    free = ~np.kron(blocked, np.ones((fine, fine), dtype=bool)).ravel()
    room = wall_gap(points, blocked) * res >= settings.hidden_radius
    count = broken = 0
    # Between two nodes the speed is never above the greater of theirs: half way, at that speed.
    for k in range(0, len(course) - 1, 5):
        for share, speed in ((0.0, v[k]), (0.5, max(v[k], v[k + 1]))):
            if creeping[k] or creeping[k + 1]:
                continue
            s0 = course.s[k] + share * (course.s[k + 1] - course.s[k])
            eye = at(course, np.array([s0]))[0] + 0.5
            near = free & (np.abs(points - eye).max(axis=1) < (need(ROBOT, settings) + 0.4) / res + 1)
            seen = np.zeros(len(points), dtype=bool)
            seen[near] = sight.seen_points(blocked, eye, points[near])
            shape = (height * fine, width * fine)
            beside = np.zeros(shape, dtype=bool)
            lit = seen.reshape(shape)
            beside[1:] |= lit[:-1]
            beside[:-1] |= lit[1:]
            beside[:, 1:] |= lit[:, :-1]
            beside[:, :-1] |= lit[:, 1:]
            gaps = points[near & ~seen & beside.ravel() & room]
            gaps = gaps[ahead(course, s0, eye, gaps)]
            count += len(gaps)
            t, gone = stopping(speed, settings.reaction)
            track = at(course, s0 + gone) + 0.5
            far = np.sqrt(((gaps[:, None, :] - track[None, :, :]) ** 2).sum(axis=2)) * res
            reached = ROBOT.radius + settings.hidden_radius + faster * settings.hidden_speed * t
            # The border itself lies between two points that are a quarter of a cell apart.
            broken += int((far + res / fine < reached[None, :]).any(axis=1).sum())
    return count, broken


def stopping(v: float, reaction: float) -> tuple[np.ndarray, np.ndarray]:
    """Times and distances of a robot that accelerates for the reaction time and then brakes."""
    a, p = ROBOT.a_max, ROBOT.d_max
    w = v + a * reaction
    t = np.linspace(0.0, reaction + w / p, 40)
    late = np.maximum(t - reaction, 0.0)
    early = np.minimum(t, reaction)
    return t, v * early + 0.5 * a * early**2 + w * late - 0.5 * p * late**2


def at(course: SampledPath, s: np.ndarray) -> np.ndarray:
    return np.stack([np.interp(s, course.s, course.xy[:, k]) for k in (0, 1)], axis=1)


def ahead(course: SampledPath, s0: float, eye: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Points that going on, as far as the robot needs to stand, leads nearer to."""
    track = at(course, s0 + np.linspace(0.02, 0.8, 30)) + 0.5
    now = ((points - eye) ** 2).sum(axis=1)
    later = ((points[:, None, :] - track[None, :, :]) ** 2).sum(axis=2).min(axis=1)
    return later < now - 1e-9


def wall_gap(points: np.ndarray, blocked: np.ndarray) -> np.ndarray:
    """Cells from points to the nearest wall."""
    best = np.full(len(points), np.inf)
    for y, x in zip(*np.nonzero(blocked), strict=True):
        gx = np.maximum(np.maximum(x - points[:, 0], points[:, 0] - x - 1), 0.0)
        gy = np.maximum(np.maximum(y - points[:, 1], points[:, 1] - y - 1), 0.0)
        best = np.minimum(best, gx * gx + gy * gy)
    return np.sqrt(best)


# sight ----------


def test_sight_is_exact() -> None:
    rng = np.random.default_rng(11)
    checked = [0, 0]
    for _ in range(500):
        height, width = rng.integers(1, 7, 2)
        opaque = rng.random((height, width)) < rng.uniform(0, 0.5)
        ax, ay = (int(rng.integers(0, n * UNIT // 2)) * 2 + 1 for n in (width, height))
        if rng.random() < 0.5:  # centres of cells: ties at corners are common
            ax, ay = (int(rng.integers(0, n)) * UNIT + UNIT // 2 for n in (width, height))
        bx, by = (int(rng.integers(0, n)) * UNIT + UNIT // 2 for n in (width, height))
        if rng.random() < 0.5:
            bx, by = (int(rng.integers(0, n + 1)) * UNIT for n in (width, height))
        if opaque[ay // UNIT, ax // UNIT]:
            continue
        want = sight.sees(opaque, ax, ay, bx, by, UNIT)
        assert visibility.sees.run_plain(opaque.ravel(), int(width), ax, ay, bx, by) == want
        checked[want] += 1
    assert min(checked) > 100


def test_visible_cells_are_symmetric_and_know_the_reach() -> None:
    rng = np.random.default_rng(12)
    for _ in range(4):
        blocked = rng.random((9, 11)) < 0.25
        grid = Grid(blocked, resolution=0.5)
        cells = [(x, y) for y in range(9) for x in range(11) if not blocked[y, x]]
        seen = {cell: visible_cells(grid, cell, np.inf) for cell in cells}
        for a in cells:
            assert seen[a][a[1], a[0]]
            assert not seen[a][blocked].any()
            for b in cells:
                assert seen[a][b[1], b[0]] == seen[b][a[1], a[0]]
        near = visible_cells(grid, cells[0], 1.0)
        ys, xs = np.nonzero(seen[cells[0]])
        inside = (xs - cells[0][0]) ** 2 + (ys - cells[0][1]) ** 2 <= 4
        assert sorted(zip(xs[inside], ys[inside], strict=True)) == sorted(
            zip(*np.nonzero(near)[::-1], strict=True)
        )


def test_visible_cells_by_eye() -> None:
    blocked = draw([".....", "..#..", "....."])
    seen = visible_cells(Grid(blocked), (2, 2), np.inf)
    assert (seen == draw(["#...#", "##.##", "#####"])).all()
    assert not seen.flags.writeable


def test_the_nearest_hiding_place_agrees_with_the_cells_that_are_seen() -> None:
    """Where the law says that nothing hides within a distance, no seen cell has an unseen neighbour there."""
    rng = np.random.default_rng(13)
    settings = BlindArea(hidden_radius=0.0)
    told = 0
    for _ in range(12):
        blocked = rng.random((25, 40)) < 0.06
        blocked[12] = False
        grid = Grid(blocked, resolution=0.25)
        course = straight([(2, 12), (37, 12)], 0.25, 0.25)
        scene = Scene(grid, (0, 0), (0, 0), robot=ROBOT)
        d = hiding_distance(course, scene, settings)
        for k in range(0, len(course) - 1, 3):
            cell = (int(course.xy[k, 0]), 12)
            if course.xy[k, 0] != cell[0]:
                continue
            seen = visible_cells(grid, cell, np.inf)
            for y, x in zip(*np.nonzero(seen), strict=True):
                for nx, ny in ((x + 1, y), (x, y + 1), (x, y - 1)):
                    if not (cell[0] < nx < 40 and 0 <= ny < 25) or blocked[ny, nx] or seen[ny, nx]:
                        continue
                    gap = math.hypot(nx - cell[0], ny - 12) * 0.25
                    assert d[k] <= gap + 1e-9, (cell, (nx, ny))
                    told += 1
    assert told > 300


# both forms, settings ----------


def test_both_forms_of_the_kernels_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    results = {}
    for form in ("plain", "compiled"):
        use(monkeypatch, form)
        rng = np.random.default_rng(14)
        found = []
        for _ in range(12):
            blocked = rng.random((14, 30)) < rng.uniform(0, 0.3)
            unknown = rng.random((14, 30)) < rng.uniform(0, 0.1)
            grid = Grid(blocked | unknown, unknown=unknown, resolution=0.2)
            course = straight([(1, 7), tuple(rng.uniform(3, 12, 2)), (27, 6)], 0.2, 0.3)
            settings = BlindArea(hidden_radius=float(rng.choice([0.0, 0.2, 0.5])))
            scene = Scene(grid, (0, 0), (0, 0), robot=ROBOT)
            found.append(hiding_distance(course, scene, settings).tobytes())
            found.append(visible_cells(grid, (5, 7), 3.0).tobytes())
        results[form] = found
    assert results["plain"] == results["compiled"]


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("hidden_speed", -1.0),
        ("hidden_radius", math.nan),
        ("reaction", "1"),
        ("reach", 0.0),
        ("creep", 0.0),
        ("creep", True),
        ("unknown", "free"),
    ],
)
def test_settings_are_checked(name: str, value: object) -> None:
    with pytest.raises(SettingError, match=rf"LAW_SETTING.*physical\.blind\.{name}"):
        BlindArea(**{name: value})  # type: ignore[arg-type]


def test_a_robot_of_absurd_speed_is_answered() -> None:
    course = straight([(2, 30), (157, 30)], 0.1, 0.1)
    v = caps(course, corridor(door=True), robot=Robot(v_max=1e6, d_max=1e-6))
    assert (v == 1e5).any(), "creep"
    assert np.isinf(v[-1])


def test_a_course_of_one_node_and_a_cell_off_the_map() -> None:
    course = sample_curve(
        Curve(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0), np.zeros(0), (5.0, 28.0), 0.1), 0.1
    )
    assert np.isinf(caps(course, corridor(door=True))).all(), "nothing is ahead"
    with pytest.raises(SettingError, match="CELL"):
        visible_cells(corridor(door=True), (-1, 0), 1.0)
