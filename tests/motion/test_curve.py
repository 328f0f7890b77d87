"""Curves: drawn taut and rounded, judged by the referee and by looking at many of their points."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from curve_ways import Case, cases

from lampyris import Grid, Robot, Scene, api
from lampyris.errors import SettingError
from lampyris.kernels.motion.fillets import _arc_is_clear, share
from lampyris.kernels.motion.line_of_sight import line_gap
from lampyris.model.curve import Curve
from lampyris.motion.geometry.clearance import wall_distance
from lampyris.motion.geometry.curve import curve_of, polyline_of
from lampyris.motion.geometry.string_pulling import lines_of, pull_straight
from lampyris.referee import check_curve
from reference.kernel_forms import use
from sizes import some

OPEN = Grid(np.zeros((21, 21), dtype=bool))
SLOW = Robot(v_max=1.0, a_lat_max=0.5)  # A bend of 2 m at top speed.


def bytes_of(curve: Curve) -> tuple[Any, ...]:
    arrays = (curve.xy, curve.heading, curve.lengths, curve.curvature, curve.stops)
    return *(a.tobytes() for a in arrays), curve.end


def walls(rows: list[str]) -> Grid:
    return Grid(np.array([[c == "#" for c in row] for row in rows]))


def made(case: Case) -> Curve | str:
    """The curve of a case, or the refusal."""
    try:
        return curve_of(case.points, case.grid, case.robot, **case.how)
    except SettingError as e:
        return str(e)


@pytest.mark.nightly
def test_random_ways_pass_the_referee(monkeypatch: pytest.MonkeyPatch) -> None:
    use(monkeypatch, "compiled")
    stops = arcs = refused = 0
    for case in cases(240, seed=3):
        curve = made(case)
        if isinstance(curve, str):
            assert "PATH_BLOCKED" in curve
            refused += 1
            continue
        assert check_curve(curve, case.grid, case.robot, case.points) is None, case
        stops += len(curve.stops)
        arcs += int(np.count_nonzero(curve.curvature))
    # The cases are worth their while.
    assert stops > 60
    assert arcs > 250
    assert 0 < refused < 40


@pytest.mark.nightly
def test_both_forms_give_the_same_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    said: dict[str, list[Any]] = {}
    for form in ("plain", "compiled"):
        use(monkeypatch, form)
        curves = [made(case) for case in cases(60, seed=4)]
        said[form] = [c if isinstance(c, str) else bytes_of(c) for c in curves]
    assert said["plain"] == said["compiled"]


@pytest.mark.commit(2)
@pytest.mark.parametrize("number", range(1, 7))
def test_paths_of_planners_on_bundled_maps(number: int) -> None:
    grid = api.load_grid(f"env-{number}")
    shares = []
    for planner, moves in (("astar", "octile"), ("ad-gso", "dissertation"), ("theta-star", "octile")):
        for radius in (0.0, 0.45, 0.7, 1.4):
            robot = Robot(radius=radius * grid.resolution)
            scene = Scene(grid, (0, grid.height - 1), (grid.width - 1, 0), moves=moves, robot=robot)
            path = api.plan(scene, planner).path
            if path is None:
                continue
            points = polyline_of(path)
            curve = curve_of(points, grid, robot)
            assert check_curve(curve, grid, robot, points) is None
            # Looked at every fiftieth of a cell: exactly, and with no regard to how it was made.
            xy, heading = curve.at(np.arange(0.0, curve.length, 0.02 * grid.resolution))
            assert (wall_distance(xy, grid, 2 * robot.radius + 1) >= robot.radius - 1e-8).all()
            np.testing.assert_allclose(np.hypot(*heading.T), 1.0, rtol=1e-12)
            step = np.hypot(*np.diff(xy, axis=0).T) * grid.resolution
            assert step.max() <= 0.02 * grid.resolution * (1 + 1e-9)
            assert len(curve.stops) == 0
            shares.append(curve.length / (path.arc[-1] * grid.resolution))
    assert len(shares) >= 6
    assert max(shares) < 1.0
    assert min(shares) < 0.97


def test_an_arc_is_exact() -> None:
    for side, y in ((1.0, 10.0), (-1.0, -10.0)):
        points = np.array([(0.0, 10.0), (10.0, 10.0), (10.0, 10.0 + y)])
        curve = curve_of(points, OPEN, SLOW, shortcut=False)
        np.testing.assert_allclose(curve.xy, [(0, 10), (8, 10), (10, 10 + 2 * side)], atol=1e-15)
        np.testing.assert_allclose(curve.heading, [(1, 0), (1, 0), (0, side)], atol=1e-15)
        np.testing.assert_allclose(curve.lengths, [8, math.pi, 8], rtol=1e-15)
        np.testing.assert_allclose(curve.curvature, [0, side / 2, 0], rtol=1e-15)
        assert curve.end == (10.0, 10.0 + y)
        middle, heading = curve.at(np.array([8 + math.pi / 2]))
        np.testing.assert_allclose(middle, [(8 + math.sqrt(2), 10 + side * (2 - math.sqrt(2)))], rtol=1e-15)
        np.testing.assert_allclose(heading, [(math.sqrt(0.5), side * math.sqrt(0.5))], rtol=1e-15)


def test_the_radius_is_bounded_by_use_by_lines_and_by_walls() -> None:
    points = np.array([(5.0, 5.0), (8.0, 5.0), (8.0, 15.0)])

    def radius(robot: Robot, grid: Grid = OPEN, points: np.ndarray = points) -> float:
        curve = curve_of(points, grid, robot, shortcut=False)
        bends = curve.curvature[curve.curvature != 0]
        return float(1 / bends[0]) if len(bends) else 0.0

    assert radius(SLOW) == pytest.approx(2.0)
    assert radius(Robot(v_max=5.0, a_lat_max=1.0)) == pytest.approx(3.0)
    assert radius(Robot(v_max=0.1, turn_radius=2.5)) == pytest.approx(2.5)
    # The square around (7, 6) has its corner at (7.5, 5.5), within every arc of 0.5 (2 + sqrt 2) or more.
    blocked = np.zeros((21, 21), dtype=bool)
    blocked[6, 7] = True
    assert radius(SLOW, Grid(blocked)) == pytest.approx(0.5 * (2 + math.sqrt(2)), rel=5e-3)
    assert radius(SLOW, Grid(blocked)) <= 0.5 * (2 + math.sqrt(2)) + 1e-8
    disc = Robot(radius=0.3, v_max=1.0, a_lat_max=0.5)
    fits = (0.5 * math.sqrt(2) - 0.3) / (math.sqrt(2) - 1)
    assert radius(disc, Grid(blocked)) == pytest.approx(fits, rel=5e-3)
    # The smallest that the robot drives fits, if barely; where it does not, it is a stop.
    assert 1.6 <= radius(Robot(turn_radius=1.6, v_max=2.0), Grid(blocked)) <= 1.71
    stiff = Robot(v_max=1.0, turn_radius=2.0)
    curve = curve_of(points, Grid(blocked), stiff, shortcut=False)
    assert curve.stops.tolist() == [1]
    assert not curve.curvature.any()
    assert check_curve(curve, Grid(blocked), stiff, points) is None


def test_the_same_way_backwards_has_the_same_arc() -> None:
    rng = np.random.default_rng(9)
    bends = 0
    for _ in range(80):
        grid = Grid(rng.random((12, 12)) < 0.06)
        robot = Robot(radius=float(rng.choice([0.0, 0.8, 1.5])), v_max=2.0)
        points = rng.integers(1, 11, (3, 2)).astype(float)
        try:
            one, other = (curve_of(p, grid, robot, shortcut=False) for p in (points, points[::-1]))
        except SettingError:
            continue
        bends += int(one.curvature.any())
        np.testing.assert_allclose(np.sort(one.curvature), np.sort(-other.curvature), rtol=1e-9)
        assert one.length == pytest.approx(other.length, rel=1e-12)
    assert bends > 20


def test_neighbours_share_their_line_by_need() -> None:
    zigzag = np.array([(2.0, 2.0), (8.0, 2.0), (8.0, 5.0), (18.0, 5.0)])
    curve = curve_of(zigzag, OPEN, SLOW, shortcut=False)
    assert np.abs(curve.curvature).tolist() == pytest.approx([0, 1 / 1.5, 1 / 1.5, 0])
    # A gentle corner needs little and leaves the rest to the sharp one.
    uneven = np.array([(0.0, 2.0), (8.0, 2.0), (8.0, 4.2), (7.8, 14.0)])
    bends = 1 / np.abs(curve_of(uneven, OPEN, SLOW, shortcut=False).curvature[[1, 3]])
    np.testing.assert_allclose(bends, [2.0, 2.0], rtol=1e-12)
    # Two that both need more than half: one gives up, the other has what it needs.
    stiff = Robot(turn_radius=2.0, v_max=0.1)
    curve = curve_of(zigzag, OPEN, stiff, shortcut=False)
    assert len(curve.stops) == 1
    assert np.count_nonzero(curve.curvature) == 1
    assert check_curve(curve, OPEN, stiff, zigzag) is None


@pytest.mark.parametrize("form", ["plain", "compiled"])
def test_shares_fill_their_lines(form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    use(monkeypatch, form)
    rng = np.random.default_rng(8)
    for trial in range(60):
        n = int(rng.integers(3, 30))
        length = rng.uniform(0.1, 5.0, n - 1)
        slant = rng.uniform(0.1, 3.0, n) * (rng.random(n) < 0.9)
        slant[[0, -1]] = 0.0
        least = 0.0 if trial % 2 else 0.3
        pairs = np.minimum(length[:-1], length[1:])
        want = np.concatenate(([0.0], pairs, [0.0])) * rng.uniform(0.3, 1.0, n) * (slant > 0)
        want[want < least * slant] = 0.0
        given, got = want.copy(), np.zeros(n)
        share(length, slant, least, want, got)
        assert (got >= 0).all()
        assert (got <= given).all()
        assert (got[:-1] + got[1:] <= length * (1 + 1e-12)).all()
        assert ((want == 0) | (got >= least * slant * (1 - 1e-9))).all()
        # What is less than was wanted has no room left on one of its lines, or has given up.
        full = got[:-1] + got[1:] >= length * (1 - 1e-12)
        short = np.flatnonzero((got < want) & (want > 0))
        assert (full[short - 1] | full[short]).all()
        if least == 0.0:
            assert (got[given > 0] > 0).all()


def test_corners_that_no_arc_rounds_are_stops() -> None:
    back = np.array([(2.0, 2.0), (9.0, 2.0), (4.0, 2.0)])
    curve = curve_of(back, OPEN, SLOW, shortcut=False)
    assert curve.stops.tolist() == [1]
    assert curve.lengths.tolist() == [7.0, 5.0]
    assert check_curve(curve, OPEN, SLOW, back) is None
    # The way turns on the very corner of a wall: every arc would cut it.
    grid = walls([".....", ".....", "..#..", ".....", "....."])
    turn = np.array([(2.2, 1.5), (1.5, 1.5), (1.5, 2.2)])
    assert curve_of(turn, grid, SLOW).stops.tolist() == [1]
    # On the other side of it there is room.
    free = np.array([(0.0, 2.5), (1.5, 2.5), (1.5, 4.0)])
    assert len(curve_of(free, grid, SLOW, shortcut=False).stops) == 0


def test_own_lines_are_rounded_within_half_a_step_or_stops() -> None:
    """Corners of ``none`` had no curvature and, without a turning circle, no stops: they were free."""
    points = np.array([(2.0, 2.0), (8.0, 2.0), (9.0, 2.0), (9.0, 8.0)])
    curve = curve_of(points, OPEN, SLOW, smooth="none", shortcut=False)
    assert curve.lengths.tolist() == pytest.approx([6.5, np.pi / 4, 5.5], rel=1e-12)
    assert curve.curvature.tolist() == pytest.approx([0.0, 2.0, 0.0], rel=1e-12)
    assert len(curve.stops) == 0
    assert check_curve(curve, OPEN, SLOW, points) is None
    for stiff, stops in ((Robot(turn_radius=0.49), []), (Robot(turn_radius=0.51), [1])):
        assert curve_of(points, OPEN, stiff, smooth="none", shortcut=False).stops.tolist() == stops
    # Lines may be long: half a step is at most half a knight's.
    far = np.array([(2.0, 2.0), (9.0, 2.0), (9.0, 9.0)])
    long = curve_of(far, OPEN, SLOW, smooth="none", shortcut=False)
    assert long.lengths[0] == pytest.approx(7.0 - 0.5 * np.sqrt(5), rel=1e-12)
    # Straight back again: no arc makes it.
    back = np.array([(2.0, 2.0), (9.0, 2.0), (2.0, 2.0)])
    assert curve_of(back, OPEN, SLOW, smooth="none", shortcut=False).stops.tolist() == [1]
    # A corner around which a wall leaves no room is a stop, with any robot.
    grid = walls([".....", ".....", "..#..", ".....", "....."])
    turn = np.array([(2.2, 1.5), (1.5, 1.5), (1.5, 2.2)])
    assert curve_of(turn, grid, SLOW, smooth="none", shortcut=False).stops.tolist() == [1]


def test_a_point_is_a_curve_without_pieces() -> None:
    for points in (np.array([(3.0, 4.0)]), np.array([(3.0, 4.0)] * 5)):
        curve = curve_of(points, OPEN, SLOW)
        assert (curve.length, curve.end, len(curve.lengths)) == (0.0, (3.0, 4.0), 0)
        assert check_curve(curve, OPEN, SLOW, points) is None
    # There and back again is not worth the way.
    loop = np.array([(3.0, 4.0), (8.0, 4.0), (8.0, 7.0), (3.0, 4.0)])
    assert curve_of(loop, OPEN, SLOW).length == 0.0
    assert curve_of(loop, OPEN, SLOW, shortcut=False).length > 10.0


def test_points_on_a_line_and_points_twice_change_nothing() -> None:
    plain = np.array([(2.0, 2.0), (11.0, 5.0), (9.0, 14.0)])
    rich = np.concatenate((np.linspace(plain[0], plain[1], 7), np.linspace(plain[1], plain[2], 4)))
    one, other = (curve_of(p, OPEN, SLOW, shortcut=False) for p in (plain, rich))
    np.testing.assert_allclose(one.xy, other.xy, rtol=1e-12)
    np.testing.assert_allclose(one.lengths, other.lengths, rtol=1e-12)


def test_ends_are_told_as_they_were_given() -> None:
    near = 3e-10
    points = np.array([(2.0, 2.0), (9.0, 2.0), (9.0, 8.0), (9.0 + near, 8.0), (9.0 + 2 * near, 8.0)])
    for shortcut in (True, False):
        curve = curve_of(points, OPEN, SLOW, shortcut=shortcut)
        assert curve.end == (9.0 + 2 * near, 8.0)
        assert tuple(curve.xy[0]) == (2.0, 2.0)
        assert curve.lengths.min() > 1.0
        assert check_curve(curve, OPEN, SLOW, points) is None


def test_a_stretch_that_is_near_may_be_drawn_taut_as_near() -> None:
    grid = walls(["........", "........", "..#.....", "........"])
    # Half a cell from the wall and a cell and a half elsewhere, for a disc of one cell.
    points = np.array([(0.0, 1.0), (3.0, 1.0), (4.0, 0.0), (5.0, 1.0), (7.0, 1.0)])
    curve = curve_of(points, grid, Robot(radius=1.0))
    assert curve.lengths.tolist() == [7.0]
    # Where it keeps its distance it goes on keeping it.
    around = np.array([(0.0, 2.0), (0.0, 0.0), (2.0, 0.0), (5.0, 0.0), (5.0, 2.0)])
    xy, _ = curve_of(around, grid, Robot(radius=1.0)).at(np.linspace(0, 20, 900))
    assert wall_distance(xy, grid, 9.0).min() >= 1.0 - 1e-8


def test_a_line_of_sight_may_touch_but_not_cut() -> None:
    # Between two blocked cells that share a corner: a point passes, any disc does not.
    grid = walls([".....", "..#..", ".#...", ".....", "....."])
    around = np.array([(1.0, 1.0), (0.0, 1.0), (0.0, 3.0), (2.0, 3.0), (2.0, 2.0)])
    assert curve_of(around, grid, Robot()).lengths.tolist() == [math.sqrt(2)]
    assert curve_of(around, grid, Robot(radius=1e-6)).length > 3.0


def test_a_disc_keeps_its_distance_or_that_of_the_way() -> None:
    grid = walls([".......", ".......", ".......", "...#...", ".......", ".......", "......."])
    points = np.array([(0.0, 3.0), (2.0, 1.0), (4.0, 1.0), (6.0, 3.0)])
    # The detour is 1.5 from the wall; a point cuts as far as sight goes, a wide disc keeps away.
    lengths = [curve_of(points, grid, Robot(radius=r)).length for r in (0.0, 0.5, 1.0, 1.5, 3.0)]
    assert lengths == sorted(lengths)
    for r in (1.0, 1.5, 3.0):
        curve = curve_of(points, grid, Robot(radius=r))
        near = wall_distance(curve.at(np.linspace(0, curve.length, 400))[0], grid, 9.0).min()
        assert near >= min(r, 1.5 / math.sqrt(2)) - 1e-8


def test_walls_beyond_the_way_count() -> None:
    # Two and a half cells below the straight line from end to end, and five from the way itself.
    blocked = np.zeros((14, 14), dtype=bool)
    blocked[2, 5] = True
    points = np.array([(0.0, 5.0), (5.0, 10.0), (10.0, 5.0)])
    assert curve_of(points, Grid(blocked), Robot(radius=2.4)).lengths.tolist() == [10.0]
    assert curve_of(points, Grid(blocked), Robot(radius=2.6)).length > 11.0


def test_taut_is_hardly_longer_than_the_best_over_its_own_points() -> None:
    rng = np.random.default_rng(4)
    ratios = []
    for _ in range(6):
        blocked = rng.random((40, 40)) < 0.2
        blocked[:3, :3] = blocked[-3:, -3:] = False
        grid = Grid(blocked)
        path = api.plan(Scene(grid, (0, 0), (39, 39), moves="octile"), "astar").path
        if path is None:
            continue
        lines = lines_of(polyline_of(path), grid, 0.0)
        n = len(lines.xs)
        wall, (height, width) = lines.wall.ravel(), lines.wall.shape
        best = [0.0] + [math.inf] * (n - 1)
        for j in range(1, n):
            for i in range(j):
                through = best[i] + math.hypot(lines.xs[j] - lines.xs[i], lines.ys[j] - lines.ys[i])
                if through < best[j] and line_gap(
                    wall, width, height, lines.xs[i], lines.ys[i], lines.xs[j], lines.ys[j], lines.reach, 0.0
                ):
                    best[j] = through
        ratios.append(float(pull_straight(lines).length.sum()) / best[-1])
    assert len(ratios) >= 3
    assert min(ratios) >= 1 - 1e-12
    assert max(ratios) <= 1.03
    assert sum(ratios) <= 1.006 * len(ratios)


def test_terrain_keeps_the_way_as_it_is() -> None:
    terrain = np.zeros((21, 21), dtype=np.uint8)
    points = np.array([(2.0, 2.0), (2.0, 9.0), (12.0, 9.0)])
    assert curve_of(points, OPEN, SLOW).length < 13.0
    terrain[15, 15] = 9
    assert curve_of(points, Grid(np.zeros((21, 21), dtype=bool), terrain=terrain), SLOW).length > 15.0


@pytest.mark.nightly
@pytest.mark.parametrize(("form", "trials"), [*some([("compiled", 400), ("compiled", 1200)]), ("plain", 60)])
def test_lines_and_arcs_against_many_points(form: str, trials: int, monkeypatch: pytest.MonkeyPatch) -> None:
    use(monkeypatch, form)
    rng = np.random.default_rng(12)
    met = clear = 0
    share = np.linspace(0, 1, 800)[:, None]
    for _ in range(trials):
        blocked = rng.random((14, 17)) < rng.choice([0.005, 0.03, 0.1, 0.3])
        grid = Grid(blocked)
        wall, reach = blocked.ravel(), float(rng.choice([0.1, 0.6, 1.5, 4.0]))
        a, b = rng.uniform(-0.5, 13.0, (2, 2))
        gap = math.sqrt(line_gap(wall, 17, 14, *a, *b, reach, 0.0))
        seen = min(reach, float(wall_distance(a + share * (b - a), grid, 99.0).min()))
        # Points 0.02 apart see no nearer wall than the line, and at most half their distance farther.
        assert seen - 0.01 <= gap <= seen + 1e-8
        # An arc from a to b, its corner above the middle of the chord.
        chord = b - a
        rise = float(rng.choice([0.05, 0.3, 1.0])) * float(rng.choice([-1, 1]))
        corner = 0.5 * (a + b) + rise * np.array((-chord[1], chord[0]))
        into, out = corner - a, b - corner
        tangent = float(np.hypot(*into))
        into, out = into / tangent, out / tangent
        side = 1.0 if into[0] * out[1] - into[1] * out[0] > 0 else -1.0
        dot = float(into @ out)
        radius = tangent / math.sqrt((1 - dot) / (1 + dot))
        centre = a + side * radius * np.array((-into[1], into[0]))
        turn = side * math.acos(max(-1.0, min(1.0, dot))) * share[:, 0]
        u = a - centre
        points = centre + np.stack(
            (u[0] * np.cos(turn) - u[1] * np.sin(turn), u[0] * np.sin(turn) + u[1] * np.cos(turn)), axis=1
        )
        assert np.allclose(points[-1], b, atol=1e-6)
        nearest = float(wall_distance(points, grid, 99.0).min())
        for need in (0.5 * nearest - 0.02, nearest - 0.02, nearest + 1e-6, nearest + 0.5):
            if 1e-10 < need < 5.0:
                said = _arc_is_clear(wall, 17, 14, *corner, *into, *out, side, tangent, radius, need * need)
                assert bool(said) == (need < nearest), (need, nearest)
                met, clear = met + (not said), clear + bool(said)
    assert min(met, clear) > trials / 2


@pytest.mark.parametrize(
    ("points", "grid", "code", "words"),
    [
        ([], OPEN, "PATH_POINTS", "n >= 1"),
        ([(1.0, 2.0, 3.0)], OPEN, "PATH_POINTS", "n >= 1"),
        ([("a", "b")], OPEN, "PATH_POINTS", "n >= 1"),
        ([(1.0, 1.0), (math.nan, 2.0)], OPEN, "PATH_POINTS", r"points\[1\]"),
        ([(1.0, 1.0), (2.0, math.inf)], OPEN, "PATH_POINTS", r"points\[1\]"),
        ([(1.0, 1.0), (2.0, 1.0), (21.0, 3.0)], OPEN, "PATH_OUTSIDE", r"points\[2\]: \(21, 3\)"),
        ([(0.0, 1.0), (1.0, 1.0), (4.0, 1.0)], walls(["....."] * 1 + ["...#."]), "PATH_BLOCKED",
         r"from points\[1\]: at \(2.5, 1\) it enters blocked cell \(3, 1\)"),
        ([(0.0, 0.0), (0.0, 0.0), (3.0, 3.0)], walls(["....", "..#.", "..#.", "..#."]), "PATH_BLOCKED",
         r"from points\[0\]: at \(1.5, 1.5\) it enters blocked cell \(2, 2\)"),
        ([(1.0, 1.0)], walls(["..", ".#"]), "PATH_BLOCKED", r"points\[0\]: at \(1, 1\)"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(points: Any, grid: Grid, code: str, words: str) -> None:
    with pytest.raises(SettingError, match=words) as caught:
        curve_of(points, grid, SLOW)
    assert caught.value.code == code


def test_unknown_smoothing() -> None:
    with pytest.raises(SettingError, match="arcs, none"):
        curve_of(np.zeros((1, 2)), OPEN, SLOW, smooth="clothoid")  # type: ignore[arg-type]
