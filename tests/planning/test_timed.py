"""Planners that see traffic: their arrival against a plain search of cells and ticks, case by case."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pytest

from lampyris import api
from lampyris.errors import SceneError, SettingError
from lampyris.model.change import Change, ObstacleTrack
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan, Status
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.traffic import Crossing, RandomWalk, Recorded
from lampyris.planning.base import Budget
from lampyris.planning.field.footprint import footprint, reach_of
from lampyris.planning.spacetime.prediction import Forecaster
from lampyris.planning.spacetime.session import _hidden
from lampyris.planning.spacetime.sipp import Sipp
from lampyris.planning.spacetime.space_time_astar import SpaceTimeAStar
from lampyris.testing import check_planner
from lampyris_selfcheck.reference.paths.timed import EIGHT, Body, Cell, clash, earliest, legal
from sizes import sized, some

RNG = np.random.default_rng(0)  # never drawn from
PLANNERS = [Sipp(margin=0), SpaceTimeAStar(margin=0)]
IDS = [p.name for p in PLANNERS]
ONE = ((0, 0),)


def place(track: Sequence[Cell], period: int):
    """Where an obstacle is at a tick: its track, then its last ``period`` cells again and again."""
    n = len(track)
    return lambda t: track[t] if t < n else track[n - period + (t - n) % period]


def asked(
    planner, free, moves: str, start: Cell, goal: Cell, bodies: Sequence[ObstacleTrack], radius=0.0
) -> Plan:
    scene = Scene(Grid(~np.asarray(free)), start, goal, moves=moves, robot=Robot(radius=radius))
    return planner.open(scene, RNG).plan(Change(robot=start, obstacle_tracks=tuple(bodies)))


def by_tick(plan: Plan) -> list[Cell]:
    """The robot's cell at every tick of a plan."""
    assert plan.path is not None
    assert plan.schedule is not None
    cells = [tuple(c) for c in plan.path.cells.tolist()]
    ticks = plan.schedule.tolist()
    places = []
    for cell, now, then in zip(cells, ticks, [*ticks[1:], ticks[-1] + 1], strict=True):
        places += [cell] * (then - now)
    return places


def judge(plan: Plan, want: int | None, free, cutting: bool, bodies: Sequence[Body], own=ONE) -> None:
    """The arrival is the least there is, and nothing goes wrong on the way."""
    if want is None:
        assert not plan
        return
    assert plan.status is Status.FOUND
    assert plan.schedule is not None
    assert int(plan.schedule[-1]) == want
    places = by_tick(plan)
    for t, (a, b) in enumerate(pairwise(places), 1):
        assert a == b or legal(free, a, b, cutting)
        assert not any(clash(a, b, own, body, t) for body in bodies)


# ---- the contract, and what a person relies on ------------------------------


@pytest.mark.nightly
@sized("cases", 2, 4)
@pytest.mark.parametrize("planner", PLANNERS, ids=IDS)
def test_the_contract(planner, cases: int) -> None:
    check_planner(planner, cases=cases)


def test_it_waits_where_waiting_is_quickest() -> None:
    # A corridor one cell wide, and somebody crosses it.
    free = [[c == "." for c in row] for row in ("##.##", ".....", "##.##")]
    crossing = ObstacleTrack(0, ((2, 0), (2, 0), (2, 1), (2, 2)), 0, 1)
    plan = asked(Sipp(), free, "octile", (0, 1), (4, 1), [crossing])
    assert by_tick(plan) == [(0, 1), (1, 1), (1, 1), (2, 1), (3, 1), (4, 1)]
    assert plan.commit is None  # everything is known: nothing to ask again for


def test_somebody_on_the_goal_for_ever_is_told_from_walls() -> None:
    free = np.ones((3, 4), dtype=bool)
    plan = asked(Sipp(), free, "octile", (0, 0), (3, 2), [ObstacleTrack(0, ((3, 2),), 0, 1)])
    assert plan.status is Status.HEMMED_IN
    free[:, 2] = False
    assert asked(Sipp(), free, "octile", (0, 0), (3, 2), []).status is Status.NO_PATH


@pytest.mark.parametrize("planner", PLANNERS, ids=IDS)
@pytest.mark.parametrize("loop", [((6, 1), (5, 1), (4, 1), (5, 1)), ((6, 0), (6, 1), (5, 1), (5, 0))])
def test_a_track_that_ends_late_does_not_hide_one_that_goes_round(planner, loop: tuple[Cell, ...]) -> None:
    # The one that goes round was written out for 88 ticks; up to the end of the other, 401 ticks, nothing was said of it.
    free = [[c == "." for c in row] for row in ("...##..", ".......", "#######")]
    late = ((3, 1),) * 200 + ((2, 1),) + ((2, 0),) * 200
    seen = [ObstacleTrack(0, late, 0, 1), ObstacleTrack(1, loop, 0, 4)]
    bodies = [(place(one.track, one.period), ONE) for one in seen]
    want = earliest(free, EIGHT, False, (0, 1), (6, 1), bodies, until=500)
    judge(asked(planner, free, "octile", (0, 1), (6, 1), seen), want, free, False, bodies)
    scene = Scene(Grid(~np.array(free)), (0, 1), (6, 1))
    change = Change(robot=(0, 1), obstacle_tracks=tuple(seen), goal_track=((6, 1),))
    judge(planner.open(scene, RNG).plan(change), want, free, False, bodies)


@pytest.mark.parametrize("forecast", ["velocity", "still", "reach"])
def test_one_that_was_seen_long_ago_is_passed_over(forecast: str) -> None:
    scene = Scene(Grid(np.zeros((4, 9), dtype=bool)), (0, 2), (8, 2))
    session = Sipp(forecast=forecast, horizon=2).open(scene, RNG)
    lost = ObstacleTrack(0, ((4, 2), (4, 2)), 0, None)
    plan = session.plan(Change(robot=(0, 2), tick=40, obstacle_tracks=(lost,)))
    assert (plan.status, plan.schedule.tolist()[-1]) == (Status.FOUND, 48)


@pytest.mark.parametrize("planner", PLANNERS, ids=IDS)
@pytest.mark.parametrize("settings", [{}, {"tracks": "hidden"}, {"forecast": "reach"}], ids=str)
@pytest.mark.parametrize(
    ("track", "period", "said"),
    [
        (((3, 3), (6, 5)), None, "from (3, 3) to (6, 5) at t = 5"),
        (((3, 3), (4, 4), (4, 1)), 1, "from (4, 4) to (4, 1) at t = 6"),
        (((3, 3), (3, 4), (4, 4), (4, 3)), 3, None),
        (((3, 3), (3, 4), (3, 5), (3, 6)), 4, "from (3, 6) to (3, 3) at t = 8"),
    ],
)
def test_tracks_that_jump_are_refused(planner, settings, track, period: int | None, said: str | None) -> None:
    """They once raised IndexError, or counted as a step to a neighbour that was none."""
    scene = Scene(Grid(np.zeros((9, 9), dtype=bool)), (0, 0), (8, 8))
    session = type(planner)(**settings).open(scene, RNG)
    fine = ObstacleTrack(0, ((7, 7), (7, 6)), 4)
    change = Change(robot=(0, 0), tick=4, obstacle_tracks=(fine, ObstacleTrack(1, track, 4, period)))
    if said is None or (settings.get("tracks") == "hidden" and period):  # where it will be is not looked at
        assert session.plan(change).status is Status.FOUND
        return
    with pytest.raises(SceneError, match=re.escape(f"obstacle 1 jumps {said}")) as refused:
        session.plan(change)
    assert (refused.value.code, refused.value.exit_code) == ("OBSTACLE_SPEED", 3)
    # What was refused changes nothing of what comes after it.
    after = session.plan(Change(robot=(0, 0), tick=4, obstacle_tracks=(fine,)))
    fresh = (
        type(planner)(**settings).open(scene, RNG).plan(Change(robot=(0, 0), tick=4, obstacle_tracks=(fine,)))
    )
    assert after.path is not None
    np.testing.assert_array_equal(after.path.cells, fresh.path.cells)


def test_what_an_obstacle_outside_the_map_may_reach_is_known() -> None:
    """It once raised IndexError, or was taken to be at the other end of the map."""
    rng = np.random.default_rng(8)
    for _ in range(200):
        height, width = (int(v) for v in rng.integers(1, 6, 2))
        free = rng.random((height, width)) < 0.8
        x, y, horizon = (int(v) for v in (*rng.integers(-3, 8, 2), rng.integers(1, 5)))
        reached = {(x, y)}
        found = dict(Forecaster(free, ((0, 0),), guess="reach", growth=0.0)._reached((x, y), horizon))
        for k in range(1, horizon + 1):
            near = {(u + dx, v + dy) for u, v in reached for dx in (-1, 0, 1) for dy in (-1, 0, 1)}
            reached = {(u, v) for u, v in near if 0 <= u < width and 0 <= v < height and free[v, u]}
            assert set(map(tuple, found.get(k, np.zeros((0, 2))).tolist())) == reached
    for planner in PLANNERS:
        for track in (((9, 2), (8, 2)), ((-2, 2), (-1, 2)), ((50, 50),)):
            session = type(planner)(forecast="reach").open(
                Scene(Grid(np.zeros((5, 5), dtype=bool)), (0, 0), (4, 4)), RNG
            )
            change = Change(robot=(0, 0), tick=2, obstacle_tracks=(ObstacleTrack(0, track),))
            assert session.plan(change).status is Status.FOUND


def test_tracks_without_cells_or_with_an_impossible_period_are_refused() -> None:
    with pytest.raises(SettingError, match=re.escape("obstacle 3: track (); allowed: at least one cell")):
        ObstacleTrack(3, ())
    for period in (0, -1, 3):
        with pytest.raises(SettingError, match=f"period {period}; allowed: None, or 1 to 2"):
            ObstacleTrack(3, ((1, 1), (1, 2)), 0, period)


@pytest.mark.parametrize("planner", PLANNERS, ids=IDS)
def test_ticks_before_zero_are_like_others(planner) -> None:
    """Obstacles were once left out until tick 0."""
    free = [[c == "." for c in row] for row in ("##.##", ".....", "##.##")]
    crossing = ObstacleTrack(0, ((2, 0), (2, 0), (2, 1), (2, 2)), -9, 1)
    scene = Scene(Grid(~np.array(free)), (0, 1), (4, 1))
    plan = planner.open(scene, RNG).plan(Change(robot=(0, 1), tick=-9, obstacle_tracks=(crossing,)))
    assert by_tick(plan) == [(0, 1), (1, 1), (1, 1), (2, 1), (3, 1), (4, 1)]


def test_both_searches_arrive_at_the_same_tick_among_many() -> None:
    rng = np.random.default_rng(8)
    for _ in range(6):
        free = rng.random((24, 30)) >= 0.15
        free[0, 0] = free[23, 29] = True
        seen = []
        for k in range(25):
            x, y = int(rng.integers(30)), int(rng.integers(24))
            track = [(x, y)]
            for dx, dy in rng.integers(-1, 2, (40, 2)).tolist():
                x, y = min(max(x + dx, 0), 29), min(max(y + dy, 0), 23)
                track.append((x, y))
            seen.append(ObstacleTrack(k, tuple(track), 0, 1))
        one, other = (asked(p, free, "octile", (0, 0), (29, 23), seen) for p in PLANNERS)
        assert one.status is other.status
        if one:
            assert one.schedule[-1] == other.schedule[-1]


def test_expansions_are_kept_within_the_budget() -> None:
    scene = Scene(Grid(np.zeros((30, 30), dtype=bool)), (0, 0), (29, 29))
    for planner in PLANNERS:
        session = planner.open(scene, RNG)
        plan = session.plan(None, Budget(expansions=10))
        assert plan.status is Status.LIMIT
        assert plan.expansions <= 10
        assert session.plan()


def test_recorded_obstacles_of_a_scene_are_known_without_being_told() -> None:
    track = tuple((4, y) for y in range(5))
    scene = Scene(Grid(np.zeros((5, 9), dtype=bool)), (0, 2), (8, 2), traffic=(Recorded(track),))
    plan = api.plan(scene, "sipp")
    assert plan.schedule is not None
    bodies = [(place(track, 1), ONE)]
    judge(
        plan,
        earliest((~scene.grid.blocked).tolist(), EIGHT, False, (0, 2), (8, 2), bodies),
        (~scene.grid.blocked).tolist(),
        False,
        bodies,
    )


@pytest.mark.nightly
@pytest.mark.parametrize("forecast", some(["reach", "velocity", "still"]))
def test_simulations_among_unknown_obstacles_are_clean(forecast: str) -> None:
    grid = Grid(np.random.default_rng(9).random((20, 20)) < 0.1)
    walls = grid.blocked.copy()
    walls[:2, :2] = walls[-2:, -2:] = False
    scene = Scene(Grid(walls), (0, 0), (19, 19), traffic=(RandomWalk(8), Crossing(2)))
    for seed in range(3):
        trace = api.simulate(scene, "sipp", seed=seed, forecast=forecast, horizon=2)  # refereed
        assert trace.outcome.value in ("arrived", "blocked", "timeout", "hit")
        again = api.simulate(scene, "sipp", seed=seed, forecast=forecast, horizon=2)
        assert np.array_equal(trace.robot, again.robot)


def test_a_simulation_among_known_tracks_drives_the_plan_to_the_tick() -> None:
    rng = np.random.default_rng(10)
    for _ in range(4):
        tracks = []
        for column in range(2, 14, 3):
            down = [(column, y) for y in range(10)]
            tracks.append(Recorded(tuple(down if rng.random() < 0.5 else down[::-1])))
        scene = Scene(Grid(np.zeros((10, 16), dtype=bool)), (0, 4), (15, 5), traffic=tuple(tracks))
        plan = api.plan(scene, "sipp")
        trace = api.simulate(scene, "sipp")
        assert trace.arrived
        assert plan.schedule is not None
        assert trace.ticks == plan.schedule[-1]
        assert trace.replans == trace.path_switches == 0


@pytest.mark.parametrize("planner", ["sipp", "space-time-astar"])
@pytest.mark.parametrize("forecast", ["velocity", "reach", "still"])
def test_nobody_waits_for_ever_before_one_that_never_moves(planner: str, forecast: str) -> None:
    blocked = np.zeros((11, 11), dtype=bool)
    blocked[:, 5] = True
    blocked[5, 5] = blocked[10, 5] = False
    # It stands in the gap ahead; the other one is six ticks out of the way. The track ends at once, and an
    # obstacle is where it ended: also where tracks are hidden.
    scene = Scene(Grid(blocked), (0, 5), (10, 5), traffic=(Recorded(((5, 5),)),))
    trace = api.simulate(scene, planner, tracks="hidden", forecast=forecast)
    assert trace.arrived
    assert trace.waits <= 8
    assert trace.path_switches <= 2
    assert api.simulate(scene, planner).waits == 0


def test_what_is_hidden_of_a_track_is_its_future() -> None:
    scene = Scene(Grid(np.zeros((1, 9), dtype=bool)), (0, 0), (8, 0))
    # Ended at tick 2, on the only way: at tick 9 it is still there.
    ended = ObstacleTrack(0, ((3, 0), (2, 0), (1, 0)), 0, 1)
    plan = (
        Sipp(tracks="hidden", horizon=3)
        .open(scene, RNG)
        .plan(Change(robot=(0, 0), obstacle_tracks=(ended,), tick=9))
    )
    assert plan.schedule is not None
    assert plan.schedule[1] > 9 + 3
    # One that goes back and forth, by the tick: it is on (3, 0) and has come from (4, 0).
    paces = ObstacleTrack(0, ((3, 0), (4, 0)), 0, 2)
    assert _hidden(paces, 10) == ObstacleTrack(0, ((4, 0), (3, 0)), 9, None)
    assert _hidden(ended, 1) == ObstacleTrack(0, ((3, 0), (2, 0)), 0, None)
    assert _hidden(ended, 0) == ObstacleTrack(0, ((3, 0),), 0, None)


def test_a_margin_keeps_the_robot_on_its_way() -> None:
    scene = Scene(Grid(np.zeros((7, 12), dtype=bool)), (0, 3), (11, 3))
    still = ObstacleTrack(0, ((5, 3),), 0, None)
    seen = {}
    for margin in (0, 9):
        session = Sipp(margin=margin, forecast="still", horizon=50).open(scene, RNG)
        first = session.plan(Change(robot=(0, 3), obstacle_tracks=(still,)))
        # The obstacle leaves: straight on would now be as quick or quicker.
        second = session.plan(Change(robot=(0, 3), obstacle_tracks=()))
        seen[margin] = first.path.cells.tolist() == second.path.cells.tolist()
    assert seen[9]


@pytest.mark.parametrize(
    ("setting", "value", "code"),
    [
        ("forecast", "magic", "FORECAST"),
        ("horizon", -1, "HORIZON"),
        ("horizon", True, "HORIZON"),
        ("growth", float("nan"), "GROWTH"),
        ("margin", 2000, "MARGIN"),
        ("tracks", None, "TRACKS"),
    ],
)
def test_settings_out_of_range_are_refused(setting, value, code) -> None:
    with pytest.raises(SettingError) as refused:
        Sipp(**{setting: value})
    assert refused.value.code == code


def test_reach_is_where_two_footprints_meet() -> None:
    small, wide = ONE, footprint(1.2, 1.0)
    assert reach_of(small, wide) == wide
    for x, y in reach_of(wide, wide):
        assert {(x + a, y + b) for a, b in wide} & set(wide)
    assert len(reach_of(wide, wide)) > len(wide)
