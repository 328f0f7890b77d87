"""Via points in simulations and drives: visited in order, judged, with sensors and among obstacles."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from sim_planners import grid_of
from unknown_worlds import exact_costs, judged

import lampyris
from lampyris import referee
from lampyris.errors import LampyrisError
from lampyris.model.trace import Outcome
from lampyris.planning import registry

ENV = lampyris.Scene(lampyris.load_grid("env-1"), (37, 8), (5, 38))
VIA = [(20, 30), (44, 44), (37, 8)]
NEAR = [(2, 2), (5, 0), (0, 0)]


def legs(scene, via):
    """The exact cost of the shortest path through some cells, by a plain search."""
    free, cells = ~scene.grid.blocked, (scene.start, *via, scene.goal)
    return sum(exact_costs(free, scene.moves, b)[tuple(a)] for a, b in pairwise(cells))


@pytest.mark.parametrize("name", ["astar", "dstar-lite", "sipp"])
def test_the_given_order_is_driven_at_the_cost_of_its_legs(name: str) -> None:
    scene = ENV.through(VIA)
    trace = judged(scene, registry.make(name, {}))
    assert trace.arrived
    assert trace.via == tuple(VIA)
    assert [tuple(trace.robot[tick]) for tick in trace.via_ticks] == VIA
    assert trace.path is not None
    assert trace.path.exact == legs(scene, VIA)
    assert sum(event.word == "via" for event in trace.events) == 3


def test_the_best_order_is_that_of_a_plan() -> None:
    scene = ENV.through(VIA[:2], order="best")
    trace, plan = judged(scene, registry.make("astar", {})), lampyris.plan(scene, "astar")
    assert trace.via == plan.via
    assert trace.path == plan.path


def test_the_start_and_the_same_cell_twice_are_visited_at_once() -> None:
    scene = lampyris.Scene(grid_of("....", "...."), (0, 0), (0, 0)).through([(0, 0), (3, 1), (3, 1), (0, 0)])
    trace = judged(scene, registry.make("astar", {}))
    assert trace.arrived
    assert trace.via_ticks == (0, 3, 3, 6)


@pytest.mark.parametrize("seed", range(2))
def test_via_points_with_a_sensor_and_among_obstacles(seed: int) -> None:
    scene = replace(ENV.through(VIA[:2]), traffic=(lampyris.RandomWalk(10),) if seed % 2 else ())
    trace = judged(
        scene, registry.make("dstar-lite", {}), sensor=lampyris.Sensor(5.0, unseen_cost=1.5), seed=seed
    )
    assert trace.arrived
    assert len(trace.via_ticks) == 2


def test_a_via_point_that_cannot_be_reached_ends_the_run() -> None:
    grid = grid_of("....#.", "....##", "......")
    for via, reached in (([(5, 0)], 0), ([(3, 0), (5, 0)], 1), ([(3, 0), (4, 0)], 1)):
        scene = lampyris.Scene(grid, (0, 0), (5, 2)).through(via)
        trace = judged(scene, registry.make("astar", {}))
        assert (trace.outcome, len(trace.via_ticks)) == (Outcome.NO_PATH, reached)


def test_a_via_point_in_a_wall_ends_the_run_among_obstacles_too() -> None:
    scene = replace(ENV.through([(36, 10), (40, 40)]), traffic=(lampyris.RandomWalk(2),))
    trace = judged(scene, registry.make("astar", {}))
    assert (trace.outcome, len(trace.via_ticks), trace.waits) == (Outcome.NO_PATH, 1, 1)
    assert trace.detail == "The via point (40, 40) is not a free cell for this robot."
    assert "The via point (40, 40) is not a free cell" in lampyris.drive(scene, "astar").detail


def test_a_drive_stands_on_each_via_point() -> None:
    scene = lampyris.Scene(grid_of("........", ".####...", "........"), (0, 0), (7, 2)).through(NEAR)
    for more in ({}, {"sensor_range": 2.0}):
        drive = lampyris.drive(scene, "dstar-lite", **more)
        assert drive.arrived
        assert len(drive.via_times) == 3
        xy, v = drive.at(np.array(drive.via_times))
        assert np.abs(xy - NEAR).max() < 1e-6
        assert (v == 0.0).all()
        assert (drive.optimum, drive.via) == (None, tuple(NEAR))
    late = replace(drive, via_times=(drive.via_times[0] + 1.0, *drive.via_times[1:]))
    assert referee.check_drive(late).rule == "via"
    assert referee.check_drive(replace(drive, via=drive.via[::-1])).rule == "via"
    assert referee.check_drive(replace(drive, via_times=drive.via_times[:2])).rule == "via"


def test_the_referee_refuses_visits_that_were_not() -> None:
    trace = judged(ENV.through(VIA), registry.make("astar", {}))

    def rule(**changed):
        fault = referee.check_trace(replace(trace, **changed))
        return None if fault is None else fault.rule

    a, b, c = trace.via_ticks
    assert rule() is None
    assert rule(via_ticks=(a + 1, b, c)) == rule(via_ticks=(a, b)) == "via"
    assert rule(via=(VIA[1], VIA[0], VIA[2])) == rule(via=()) == "via"


def test_what_does_not_go_with_via_points_is_refused() -> None:
    scene = ENV.through(VIA)
    with pytest.raises(LampyrisError, match="VIA"):
        lampyris.simulate(scene, "astar", goal_track=[(5, 38), (5, 37)])
    with pytest.raises(LampyrisError, match="VIA"):
        lampyris.drive(scene, "lattice")
