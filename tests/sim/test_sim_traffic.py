"""The four kinds: where they appear, how they move, what they wait for, and what is refused."""

from __future__ import annotations

import itertools
from collections import Counter

import numpy as np
import pytest
from sim_planners import Scripted, fail, found, grid_of

from lampyris.errors import LimitError, SceneError
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.traffic import Crossing, Patrol, RandomWalk, Recorded
from lampyris.sim.grid.loop import run
from lampyris.sim.world.cell_index import footprint
from lampyris_selfcheck.reference.motion.sim_monitor import Monitor, disc

OPEN = Grid(np.zeros((12, 12), dtype=bool))


def watch(scene, ticks, seed=0):
    """The traffic of a scene while the robot stands at its start."""
    return run(scene, Scripted((fail(),)), seed=seed, ticks=ticks, patience=ticks + 1)


def places(trace, k):
    return [tuple(c) for c in trace.tracks[k].tolist()]


def refused(scene, code):
    with pytest.raises(SceneError) as error:
        run(scene, Scripted((fail(),)), ticks=1)
    assert error.value.code == code, error.value
    return str(error.value)


# ---- footprints --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("resolution", [1.0, 0.05, 0.1, 0.25, 2.0])
def test_footprints_are_discs_against_squares_exactly(resolution):
    for tenths in range(60):
        radius = tenths * resolution / 10
        told = set(footprint(radius, resolution))
        assert told == disc(f"{tenths / 10}", "1"), (radius, resolution)


def test_a_radius_of_half_a_cell_is_one_cell_and_a_little_more_is_five():
    assert footprint(0.5, 1.0) == ((0, 0),)
    assert len(footprint(0.51, 1.0)) == 5
    assert len(footprint(0.71, 1.0)) == 9


# ---- random walkers ----------------------------------------------------------------------------------------


def test_all_walkers_are_there_at_once_and_each_on_its_own_cell():
    trace = watch(Scene(OPEN, (0, 0), (11, 11), traffic=RandomWalk(30)), 1)
    assert trace.appears == (0,) * 30
    assert len(set(trace.obstacles_at(0))) == 30
    assert {b.kind for b in trace.obstacle_specs} == {"random-walk"}
    assert all(b.yields for b in trace.obstacle_specs)


@pytest.mark.nightly
def test_first_places_are_uniform():
    counts = Counter()
    grid = Grid(np.zeros((3, 4), dtype=bool))
    for seed in range(1500):
        counts.update(watch(Scene(grid, (0, 0), (3, 2), traffic=RandomWalk(2)), 1, seed).obstacles_at(0))
    assert set(counts) == {(x, y) for x in range(4) for y in range(3)} - {(0, 0), (3, 2)}
    # 3,000 places on 10 cells: 300 each, standard deviation 16.
    assert all(abs(n - 300) < 5 * 16 for n in counts.values()), counts


@pytest.mark.nightly
def test_a_walker_stays_or_steps_to_each_legal_neighbour_equally_often():
    # On a map of 3 x 3 with start and goal taken out, the middle has six neighbours left: seven options.
    grid = Grid(np.zeros((3, 3), dtype=bool))
    counts = Counter()
    for seed in range(150):
        trace = watch(Scene(grid, (0, 0), (2, 2), "dissertation", traffic=RandomWalk(1)), 60, seed)
        here = places(trace, 0)
        counts.update(b for a, b in itertools.pairwise(here) if a == (1, 1))
    total = sum(counts.values())
    assert total > 1000
    assert set(counts) == {(x, y) for x in range(3) for y in range(3)} - {(0, 0), (2, 2)}
    share = total / 7
    assert all(abs(n - share) < 5 * np.sqrt(share) for n in counts.values()), counts


def test_walkers_respect_the_corner_rule_of_the_scene():
    grid = grid_of("S.....", ".#....", "......", "...#..", "......", ".....G")
    cut = {"octile": 0, "dissertation": 0}
    for moves in cut:
        trace = watch(Scene(grid, (0, 0), (5, 5), moves, traffic=RandomWalk(6)), 300)
        assert Monitor(trace).faults() == []
        for k in range(6):
            here = places(trace, k)
            for (x0, y0), (x1, y1) in itertools.pairwise(here):
                diagonal = x0 != x1 and y0 != y1
                cut[moves] += diagonal and bool(grid.blocked[y0, x1] or grid.blocked[y1, x0])
    assert cut["octile"] == 0
    assert cut["dissertation"] > 0


@pytest.mark.nightly
@pytest.mark.parametrize("rate", [0.1, 0.5, 1.0])
def test_rate_of_appearance(rate):
    first, last = [], []
    for seed in range(60):
        trace = watch(Scene(OPEN, (0, 0), (11, 11), traffic=RandomWalk(8, rate=rate)), 150, seed)
        assert 0 not in trace.appears
        assert len(trace.appears) <= 8
        assert list(trace.appears) == sorted(set(trace.appears))
        told = [(e.tick, e.cell) for e in trace.events if e.word == "appear"]
        assert told == [(t, places(trace, k)[0]) for k, t in enumerate(trace.appears)]
        if len(trace.appears) == 8:
            first.append(trace.appears[0])
            last.append(trace.appears[7])
    if rate == 1.0:
        assert set(first) == {1}
        assert set(last) == {8}
    else:
        # The eighth comes after 8 / rate ticks on average; standard deviation sqrt(8 (1 - rate)) / rate.
        error = np.sqrt(8 * (1 - rate)) / rate / np.sqrt(len(last))
        assert len(last) >= 50
        assert abs(np.mean(last) - 8 / rate) < 5 * error


def test_none_appears_where_there_is_no_room():
    # Two cells are free beside start and goal: of three walkers two can ever come.
    trace = watch(Scene(grid_of("...."), (0, 0), (3, 0), traffic=RandomWalk(3, rate=1.0)), 20)
    assert trace.appears == (1, 2)
    assert Monitor(trace).faults() == []


def test_more_walkers_than_the_map_has_room_for():
    said = refused(Scene(grid_of("....."), (0, 0), (4, 0), traffic=RandomWalk(4)), "OBSTACLE_ROOM")
    assert "3 of 4" in said
    said = refused(Scene(OPEN, (0, 0), (11, 11), traffic=RandomWalk(100, radius=2.0)), "OBSTACLE_ROOM")
    fit = int(said.split(": ")[2].split(" of 100")[0])
    assert 2 <= fit < 20


def test_more_bodies_than_a_simulation_may_have():
    grid = Grid(np.zeros((200, 200), dtype=bool))
    scene = Scene(grid, (0, 0), (9, 9), traffic=(RandomWalk(6000), Crossing(4001)))
    with pytest.raises(LimitError) as error:
        run(scene, Scripted((fail(),)), ticks=1)
    assert "10,001" in str(error.value)


def test_a_walker_in_a_dead_end_beside_the_robot_stays():
    # The robot stands in the only way out.
    trace = watch(Scene(grid_of("#..", "#.#"), (1, 0), (2, 0), traffic=RandomWalk(1)), 20)
    assert set(places(trace, 0)) == {(1, 1)}


# ---- patrols -----------------------------------------------------------------------------------------------


def test_a_patrol_drives_there_and_back_by_shortest_ways():
    scene = Scene(OPEN, (0, 0), (11, 11), traffic=Patrol(((2, 5), (6, 5), (6, 8))))
    there = [(2, 5), (3, 5), (4, 5), (5, 5), (6, 5), (6, 6), (6, 7), (6, 8)]
    cycle = there + there[-2:0:-1]
    assert places(watch(scene, 40), 0) == [cycle[t % len(cycle)] for t in range(41)]


def test_a_patrol_goes_round_walls_and_round_the_goal():
    grid = grid_of(".......", "...#...", "...#...", ".......")
    trace = watch(Scene(grid, (0, 3), (3, 0), traffic=Patrol(((1, 1), (5, 1)))), 30)
    assert Monitor(trace).faults() == []
    assert (5, 1) in places(trace, 0)
    assert (3, 3) in places(trace, 0)


def test_two_patrols_wait_for_each_other():
    scene = Scene(grid_of("......"), (3, 0), (5, 0), traffic=Patrol(((0, 0), (1, 0), (2, 0))))
    assert places(watch(scene, 5), 0) == [(0, 0), (1, 0), (2, 0), (1, 0), (0, 0), (1, 0)]
    beside = Scene(
        grid_of("......", "......"), (0, 1), (5, 1), traffic=(Patrol(((0, 0), (2, 0))), Patrol(((3, 0),)))
    )
    assert places(watch(beside, 4), 0) == [(0, 0), (1, 0), (2, 0), (1, 0), (0, 0)]
    head_on = Scene(
        grid_of("......", "#####."),
        (5, 1),
        (5, 0),
        traffic=(Patrol(((0, 0), (4, 0))), Patrol(((4, 0), (0, 0)))),
    )
    trace = watch(head_on, 9)
    # They meet in the lane and wait for each other for ever.
    assert places(trace, 0)[-5:] == [(2, 0)] * 5
    assert places(trace, 1)[-5:] == [(3, 0)] * 5
    assert Monitor(trace).faults() == []


def test_a_patrol_waits_for_the_robot():
    # The robot is driven into the lane and stands there; the patrol stops before it and goes on when it has
    # left.
    grid = grid_of("......", "......", "......")
    way = [(2, 2), (2, 1), (2, 0)]

    def answer(scene, change):
        told = planner.told
        if change.robot == (2, 1) and len(told) < 8:
            return fail()(scene, change)
        return found(way[way.index(change.robot) :], scene, commit=1)

    planner = Scripted((answer,))
    trace = run(Scene(grid, (2, 2), (2, 0), traffic=Patrol(((0, 1), (5, 1)))), planner)
    assert trace.arrived
    assert places(trace, 0)[:2] == [(0, 1), (1, 1)]
    assert set(places(trace, 0)[1:-1]) == {(1, 1)}
    assert Monitor(trace).faults() == []


def test_one_waypoint_stands_still_and_twice_the_same_is_one():
    assert set(places(watch(Scene(OPEN, (0, 0), (9, 9), traffic=Patrol(((4, 4),))), 5), 0)) == {(4, 4)}
    twice = Scene(OPEN, (0, 0), (9, 9), traffic=Patrol(((4, 4), (4, 4), (5, 4))))
    assert places(watch(twice, 3), 0) == [(4, 4), (5, 4), (4, 4), (5, 4)]


def test_patrols_that_cannot_be():
    walled = grid_of("..#..", "..#..")
    far = Patrol(((1, 0), (3, 0)))
    assert "waypoint 1" in refused(Scene(walled, (0, 0), (1, 1), traffic=far), "OBSTACLE_TRACK")
    into = (RandomWalk(0), Patrol(((1, 0), (2, 0))))
    said = refused(Scene(walled, (0, 0), (1, 1), traffic=into), "OBSTACLE_TRACK")
    assert "obstacle 1 meets a wall at waypoint 1, (2, 0)" in said
    here = Patrol(((2, 2),))
    for traffic, code in (
        (Patrol(((5, 5),)), "OBSTACLE_TRACK"),
        (Patrol(((0, 0),)), "OBSTACLE_TRACK"),
        ((here, here), "OBSTACLE_OVERLAP"),
        ((Recorded(((2, 2),)), here), "OBSTACLE_TRACK"),
    ):
        refused(Scene(OPEN, (0, 0), (5, 5), traffic=traffic), code)


# ---- crossing ----------------------------------------------------------------------------------------------


def test_crossing_goes_from_side_to_far_side_and_back():
    grid = Grid(np.zeros((20, 20), dtype=bool))
    seen = set()
    for seed in range(40):
        trace = watch(Scene(grid, (0, 0), (19, 19), traffic=Crossing(1)), 60, seed)
        here = places(trace, 0)
        assert not trace.obstacle_specs[0].yields
        x, y = [c[0] for c in here], [c[1] for c in here]
        across = min(x) < 2 and max(x) >= 18
        down = min(y) < 2 and max(y) >= 18
        assert across or down
        first = here[0]
        assert here.count(first) >= 2, "came back"
        seen.add((across, down, first[0] < 10, first[1] < 10))
        assert all(a != b for a, b in itertools.pairwise(here)), "nobody in its way"
    assert len(seen) >= 6


def test_crossing_keeps_to_the_robots_region():
    grid = grid_of("....#....", "....#....", "....#....", "....#....")
    for seed in range(20):
        trace = watch(Scene(grid, (0, 0), (3, 3), traffic=Crossing(2)), 20, seed)
        assert all(x < 4 for k in range(2) for x, _ in places(trace, k))


def test_crossing_does_not_wait_for_the_robot_but_for_others_and_turns_round():
    grid = Grid(np.zeros((1, 30), dtype=bool))
    trace = watch(Scene(grid, (0, 0), (29, 0), traffic=(Crossing(1), Patrol(((12, 0),)))), 60, seed=2)
    here = places(trace, 0)
    side = here[0][0] < 12
    stops = 11 if side else 13
    assert max(Counter(a for a, b in itertools.pairwise(here) if a == b).values()) >= 5
    assert here.count((stops, 0)) >= 6
    assert len(set(here)) > 3, "turned round and drove back"
    assert Monitor(trace).faults() == []


@pytest.mark.nightly
def test_crossing_runs_into_a_robot_that_stands():
    grid = grid_of(*["." * 11] * 3)
    hits = 0
    for seed in range(60):
        scene = Scene(grid, (0, 1), (10, 1), traffic=Crossing(6))

        def answer(scene, change):
            way = [(x, 1) for x in range(11)]
            if change.robot[0] >= 5:
                return fail()(scene, change)
            return found(way[way.index(change.robot) :], scene, commit=5)

        trace = run(scene, Scripted((answer,)), seed=seed, patience=40)
        assert Monitor(trace).faults() == []
        hits += trace.hits
    assert hits >= 10


def test_more_crossing_than_there_is_room_for():
    said = refused(Scene(grid_of("......"), (2, 0), (3, 0), "octile", traffic=Crossing(9)), "OBSTACLE_ROOM")
    assert "of 9 crossing" in said
    refused(Scene(grid_of(".."), (0, 0), (1, 0), traffic=Crossing(1)), "OBSTACLE_ROOM")
    assert (
        run(
            Scene(grid_of(".."), (0, 0), (1, 0), traffic=Crossing(0)), Scripted((fail(),)), ticks=1
        ).obstacle_specs
        == ()
    )


# ---- recorded ----------------------------------------------------------------------------------------------


def test_a_recorded_track_is_replayed_and_then_stays():
    track = ((5, 5), (5, 5), (6, 6), (7, 6))
    trace = watch(Scene(OPEN, (0, 0), (11, 11), traffic=Recorded(track)), 6)
    assert places(trace, 0) == [*track, (7, 6), (7, 6), (7, 6)]
    assert not trace.obstacle_specs[0].yields


def test_two_recorded_bodies_may_follow_each_other():
    a, b = ((3, 3), (4, 3), (5, 3)), ((2, 3), (3, 3), (4, 3))
    trace = watch(Scene(OPEN, (0, 0), (11, 11), traffic=(Recorded(a), Recorded(b))), 3)
    assert places(trace, 1) == [*b, (4, 3)]
    assert Monitor(trace).faults() == []


def test_tracks_that_cannot_be():
    wall = grid_of(".....", "..#..", ".....")
    into = (RandomWalk(0), Recorded(((1, 1), (2, 1))))
    said = refused(Scene(wall, (0, 0), (4, 2), traffic=into), "OBSTACLE_TRACK")
    assert "obstacle 1" in said
    assert "t = 1" in said
    refused(Scene(wall, (0, 0), (4, 2), traffic=Recorded(((3, 0),), radius=0.8)), "OBSTACLE_TRACK")
    refused(Scene(wall, (0, 0), (4, 2), traffic=Recorded(((0, 0),))), "OBSTACLE_START")
    near = Recorded(((5, 3),), radius=0.6)
    refused(Scene(OPEN, (3, 3), (9, 9), robot=Robot(radius=1.2), traffic=near), "OBSTACLE_START")


@pytest.mark.parametrize(
    ("a", "b", "what", "tick"),
    [
        (((3, 3),), ((3, 3),), "in one cell", 0),
        (((3, 3), (4, 3)), ((5, 3), (4, 3)), "in one cell", 1),
        (((3, 3), (4, 3)), ((4, 3), (3, 3)), "swap", 1),
        (((3, 3), (4, 4)), ((4, 3), (3, 4)), "cross", 1),
        (((3, 3), (3, 4), (4, 3)), ((3, 3 - 1), (3, 3), (4, 4)), "cross", 2),
        (((3, 3), (4, 3), (5, 3)), ((6, 3), (6, 3), (6, 3), (5, 3)), "in one cell", 3),
    ],
)
def test_tracks_that_meet(a, b, what, tick):
    said = refused(Scene(OPEN, (0, 0), (11, 11), traffic=(Recorded(a), Recorded(b))), "OBSTACLE_OVERLAP")
    assert "obstacles 0 and 1" in said
    assert what in said
    assert f"t = {tick};" in said


def test_sized_tracks_meet_by_their_footprints():
    a, b = Recorded(((2, 5),), radius=1.0), Recorded(((4, 5), (4, 5)), radius=1.0)
    assert "t = 0" in refused(Scene(OPEN, (9, 0), (11, 11), traffic=(a, b)), "OBSTACLE_OVERLAP")
    apart = Recorded(((5, 5), (5, 5)), radius=1.0)
    assert Monitor(watch(Scene(OPEN, (9, 0), (11, 11), traffic=(a, apart)), 3)).faults() == []


def test_lanes_of_recorded_tracks_are_left_alone():
    """A track that sweeps the map after tick 40 is never met, though everybody wanders until then."""
    grid = Grid(np.zeros((15, 15), dtype=bool))
    track = ((0, 7),) * 40 + tuple((x, 7) for x in range(1, 12))
    lane = {(x, y) for x in range(-1, 13) for y in (6, 7, 8)}
    # The lane leaves two columns at the right, so the patrol has to go round.
    traffic = (Recorded(track, radius=1.0), RandomWalk(20), Patrol(((3, 3), (9, 12))))
    trace = watch(Scene(grid, (0, 0), (14, 14), traffic=traffic), 60)
    assert Monitor(trace).faults() == []
    assert (9, 12) in places(trace, 21)
    for k in range(1, 22):
        assert not lane & set(places(trace, k))


def test_bodies_are_in_order_of_specification_then_of_appearance():
    traffic = (RandomWalk(2), Recorded(((5, 5),)), Crossing(1), RandomWalk(3, rate=1.0), Patrol(((8, 8),)))
    trace = watch(Scene(OPEN, (0, 0), (11, 11), traffic=traffic), 5)
    kinds = [b.kind for b in trace.obstacle_specs]
    assert kinds == ["random-walk"] * 2 + ["recorded", "crossing", "patrol"] + ["random-walk"] * 3
    assert trace.appears == (0, 0, 0, 0, 0, 1, 2, 3)
