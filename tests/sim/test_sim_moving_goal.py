"""A goal that moves: met at the earliest tick where its track is known, caught by a faster robot where it is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sim_planners import grid_of
from unknown_worlds import Watched, drawn_chase, earliest, judged, without_waits

import lampyris
from lampyris import referee
from lampyris.errors import SceneError, SettingError
from lampyris.model.trace import Outcome
from lampyris.planning import registry

KNOWING = ("sipp", "space-time-astar")
REACTING = ("dstar-lite", "lpa-star", "dstar", "astar")
HALL = lampyris.Grid(np.zeros((3, 12), dtype=bool))


def chases(seeds, knowing=KNOWING, reacting=REACTING):
    """Meetings by every planner, against a plain search; how many there were."""
    met = 0
    for seed in seeds:
        scene, track = drawn_chase(seed)
        best = earliest(scene, track)
        for name in knowing:
            quick = without_waits(track)
            for goal, soonest in ((track, best), (quick, earliest(scene, quick))):
                trace = judged(scene, registry.make(name, {}), goal_track=goal)
                assert (trace.ticks if trace.arrived else None) == soonest, (seed, name)
        for name in reacting:
            planner = Watched(registry.make(name, {}))
            trace = judged(scene, planner, goal_track=track)
            # The goal rests in every other tick, so the robot is the faster one.
            assert trace.arrived == (best is not None), (seed, name, trace.sentence)
            assert best is None or trace.ticks >= best
            assert not planner.wrong, (seed, name, planner.wrong)
        met += best is not None
    return met


def test_every_goal_that_can_be_met_is_met() -> None:
    assert chases(range(40)) > 15


@pytest.mark.nightly
def test_thousands_of_goals_that_can_be_met_are_met() -> None:
    print(chases(range(1000, 4000)), "of 3,000 goals met")


def test_the_meeting_is_earlier_than_a_chase() -> None:
    track = [(3, 1)] * 2 + [(x, 1) for x in range(4, 12)]
    scene = lampyris.Scene(HALL, (0, 1), (3, 1))
    known = judged(scene, registry.make("sipp", {}), goal_track=track)
    hidden = judged(scene, registry.make("sipp", {"tracks": "hidden"}), goal_track=track)
    assert known.ticks == earliest(scene, track) <= hidden.ticks
    back = [(11, 1)] + [(x, 1) for x in range(11, 5, -1)]
    ahead = lampyris.Scene(HALL, (0, 1), (11, 1))
    trace = judged(ahead, registry.make("space-time-astar", {}), goal_track=back)
    assert trace.arrived
    assert trace.replans == 0
    assert trace.goal_at(trace.ticks) == tuple(trace.robot[-1])


def test_the_meeting_is_on_the_shortest_path_where_that_is_in_time() -> None:
    # sipp drove 68.4 cells on env-1 where 56.8 lead to the same cell in the same tick.
    scene = lampyris.Scene(lampyris.load_grid("env-1"), (37, 8), (5, 38))
    track = [(5, 38), (5, 37), (5, 37), (5, 36), (5, 36), (6, 36)]
    for name in KNOWING:
        trace = judged(scene, registry.make(name, {}), goal_track=track)
        meeting = lampyris.Scene(scene.grid, scene.start, trace.goal_at(trace.ticks))
        assert trace.cost == pytest.approx(lampyris.plan(meeting, "dijkstra").cost)
        assert trace.ticks == earliest(scene, track)
    # A body that is in the way on the shortest path, and never on another one of as many ticks.
    stands = lampyris.Recorded([(6, 1)] * 30)
    around = lampyris.Scene(HALL, (0, 1), (11, 1), traffic=(stands,))
    trace = judged(around, registry.make("sipp", {}), goal_track=[(11, 1), (11, 1), (11, 0)])
    assert (trace.arrived, trace.ticks, trace.hits) == (True, 11, 0)


def test_a_goal_that_comes_to_the_robot_is_caught_where_it_stands() -> None:
    grid = grid_of("...")
    trace = judged(
        lampyris.Scene(grid, (0, 0), (1, 0)), registry.make("astar", {}), goal_track=[(1, 0), (0, 0)]
    )
    assert (trace.outcome, trace.ticks, trace.waits) == (Outcome.ARRIVED, 1, 1)


def test_obstacles_with_known_tracks_are_planned_around() -> None:
    passing = lampyris.Recorded([(6, y) for y in (0, 1, 2)] + [(6, 2)] * 4)
    scene = lampyris.Scene(HALL, (0, 1), (8, 1), traffic=(passing,))
    for name in KNOWING:
        trace = judged(scene, registry.make(name, {}), goal_track=[(8, 1)] * 3 + [(8, 0)])
        assert trace.arrived
        assert trace.replans == 0


def test_with_a_sensor_the_goal_is_pursued_on_what_is_known() -> None:
    for seed in range(8):
        scene, track = drawn_chase(seed)
        for name in ("dstar-lite", "sipp", "astar"):
            trace = judged(scene, registry.make(name, {}), goal_track=track, sensor=lampyris.Sensor(2.0))
            assert trace.arrived == (earliest(scene, track) is not None)


@pytest.mark.parametrize(
    ("track", "code"),
    [
        ([(4, 1), (5, 1)], "GOAL_TRACK.*begins"),
        ([(3, 1), (3, 2), (3, 3)], "GOAL_TRACK.*tick 2"),
        ([(3, 1), (3, 0), (3, -1)], "GOAL_TRACK.*tick 2"),
    ],
)
def test_tracks_that_cannot_be(track: list[tuple[int, int]], code: str) -> None:
    with pytest.raises(SceneError, match=code):
        lampyris.simulate(lampyris.Scene(HALL, (0, 1), (3, 1)), "astar", goal_track=track)


def test_edits_and_a_moving_goal_are_refused_together() -> None:
    scene = lampyris.Scene(HALL, (0, 1), (3, 1), edits=(lampyris.Edit(3, blocked=((2, 2),)),))
    with pytest.raises(SettingError, match="GOAL_EDITS"):
        lampyris.simulate(scene, "astar", goal_track=[(3, 1)])


def test_the_referee_refuses_a_goal_that_jumps_or_was_caught_before() -> None:
    track = [(6, 1)] * 3 + [(7, 1)]
    trace = judged(lampyris.Scene(HALL, (0, 1), (6, 1)), registry.make("astar", {}), goal_track=track)

    def rule(**changed):
        fault = referee.check_trace(replace(trace, **changed))
        return None if fault is None else fault.rule

    assert rule() is None
    assert rule(goal_track=np.array([(6, 1), (8, 1), (7, 1)])) == "goal"
    assert rule(goal_track=np.array([(5, 1), (6, 1), (7, 1)])) == "goal"
    assert rule(goal_track=np.array([(6, 1), (6, 3)])) == "goal"
    assert rule(goal_track=np.array([(6, 1)] * 3 + [(6, 0)])) == "outcome"
    early = np.array([(6, 1), (5, 1), (4, 1), (3, 1), (3, 1), (4, 1), (5, 1), (6, 1), (7, 1)])
    assert rule(goal_track=early) == "goal"
