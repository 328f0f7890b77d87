"""Drives of fleets in which several robots fail, and drives whose events follow each other within rounding."""

from __future__ import annotations

import numpy as np
import pytest
from drive_checks import least_gap, places

import lampyris
from lampyris.sim.fleet import execution
from sizes import sized


def stopped_between(trace: lampyris.FleetTrace) -> list[int]:
    """The failed robots that stand between two cells."""
    cells = trace.grid.to_points(*trace.at(trace.duration_s + 1.0).T)
    off = np.abs(cells - np.round(cells)).max(axis=1) > 1e-6
    return [k for k, _ in trace.faults if off[k]]


def faulty_drive(number: int) -> lampyris.FleetTrace:
    """A random fleet with two to four faults, often shortly after one another."""
    rng = np.random.default_rng([number, 71])
    grid = lampyris.load_grid(("guide", "rooms-20")[number % 2])
    fleet = lampyris.random_fleet(grid, int(rng.integers(4, 12)), seed=number)
    who = rng.permutation(len(fleet.robots))[: int(rng.integers(2, 5))]
    begin, spread = rng.uniform(0.0, 25.0), rng.choice([1.0, 5.0, 30.0])
    faults = [(int(k), float(begin + rng.uniform(0.0, spread))) for k in who]
    robot = lampyris.Robot(radius=0.35 * grid.resolution, d_max=float(rng.choice([0.3, 1.0, 4.0])))
    delays = lampyris.Delays(float(rng.choice([0.0, 0.2])), 3.0)
    obstacles = int(rng.choice([0, 0, 2]))
    return lampyris.simulate_fleet(
        fleet, faults=faults, robot=robot, delays=delays, seed=number, obstacles=obstacles, drive_limit=600.0
    )


@sized("count", 6, 200)
def test_drives_with_several_faults_are_accepted_by_the_referee(count: int) -> None:
    between, several = 0, 0
    for number in range(count):
        trace = faulty_drive(number)
        between += len(stopped_between(trace))
        several += len(trace.faults) > 1
        named = [k for k, _ in trace.faults]
        assert trace.contacts == 0
        assert trace.faults == tuple(sorted(trace.faults, key=lambda one: one[1]))
        assert np.isnan(trace.arrivals[named]).all()
    assert between > count // 2
    assert several > count // 2


def test_both_cells_under_a_robot_that_failed_first_stay_blocked_after_the_second_fault() -> None:
    fleet = lampyris.random_fleet(lampyris.load_grid("rooms-20"), 10)
    trace = lampyris.simulate_fleet(fleet, faults=[(3, 8.0), (9, 10.0)])
    assert trace.faults == ((3, 8.0), (9, 10.0))
    assert stopped_between(trace)
    assert least_gap(trace) > 1.0
    for k in stopped_between(trace):
        x, y = trace.grid.to_points(*trace.at(trace.duration_s + 1.0)[k])
        under = {(int(f(x)), int(g(y))) for f in (np.floor, np.ceil) for g in (np.floor, np.ceil)}
        for path in (path for other, path in enumerate(trace.plans[-1]) if other != k):
            assert not under & {tuple(cell) for cell in path.tolist()}


def test_a_fault_while_the_fleet_is_stopping_is_part_of_that_stop() -> None:
    fleet = lampyris.random_fleet(lampyris.load_grid("rooms-20"), 3, seed=154)
    trace = lampyris.simulate_fleet(fleet, faults=[(2, 24.5), (0, 23.8)], seed=154)
    assert trace.faults == ((0, 23.8), (2, 24.5))
    assert len(trace.plans) == 2
    for k, when in trace.faults:
        own = trace.robot == k
        assert (trace.t + trace.duration)[own].max() <= when + trace.robots[k].v_max / trace.robots[k].d_max


def test_all_robots_may_fail_at_once() -> None:
    fleet = lampyris.random_fleet(lampyris.load_grid("rooms-20"), 8)
    trace = lampyris.simulate_fleet(fleet, faults=[(k, 0.0) for k in range(8)])
    assert trace.faults == tuple((k, 0.0) for k in range(8))
    assert trace.sentence == "All 8 robots stopped permanently."
    assert np.array_equal(places(trace, np.array([100.0]))[0], fleet.grid.to_metres(fleet.starts))
    assert trace.notes == ()


def test_faults_after_the_end_are_noted() -> None:
    fleet = lampyris.random_fleet(lampyris.load_grid("rooms-20"), 8)
    trace = lampyris.simulate_fleet(fleet, faults=[(5, 1e6), (2, 3.0)])
    assert trace.faults == ((2, 3.0),)
    assert len(trace.notes) == 1
    assert "robot 5 at 1e+06 s" in trace.notes[0]
    tasks = lampyris.lifelong_fleet(fleet, 20, faults=[(5, 20), (2, 19)])
    assert tasks.faults == ((2, 19),)
    assert tasks.notes == ("faults after the end of the drive (20 ticks) had no effect: robot 5 at 20 ticks",)


def test_a_drive_that_is_cut_off_while_it_stops_is_not_planned_again() -> None:
    fleet = lampyris.random_fleet(lampyris.load_grid("rooms-20"), 8)
    trace = lampyris.simulate_fleet(fleet, faults=[(2, 9.9)], drive_limit=10.0)
    assert trace.status is lampyris.Status.LIMIT
    assert trace.faults == ((2, 9.9),)
    assert len(trace.plans) == 1


@pytest.mark.parametrize("seed", [0, 352])
def test_short_braking_distances_end_at_the_limit(seed: int) -> None:
    # v^2 / (2 d) is 0.25 mm here: end - v^2 / (2 d) may round to where the robot is.
    fleet = lampyris.random_fleet(lampyris.load_grid("rooms-20"), 20, seed=seed)
    robot = lampyris.Robot(radius=0.35, v_max=0.1, a_max=0.1, d_max=20.0)
    trace = lampyris.simulate_fleet(fleet, robot=robot, seed=seed, obstacles=6, drive_limit=100.0)
    assert trace.status is lampyris.Status.LIMIT
    assert 90.0 < trace.duration_s <= 100.0
    assert trace.notes == ()


def test_a_robot_that_only_passes_its_goal_has_not_arrived_when_the_time_is_over() -> None:
    grid = lampyris.Grid(np.array([[False] * 6, [True, True, False, True, True, True]]))
    fleet = lampyris.Fleet(grid, [lampyris.Agent((1, 0), (2, 0)), lampyris.Agent((0, 0), (5, 0))])
    first = np.array([(1, 0), (2, 0), (2, 0), (2, 1), (2, 1), (2, 1), (2, 0)])
    second = np.array([(0, 0), (0, 0), (1, 0), (1, 0), (2, 0), (3, 0), (4, 0), (5, 0)])
    plan = lampyris.FleetPlan(lampyris.Status.FOUND, "pibt", (first, second))
    on_goal = []
    for limit in np.arange(1.0, 24.0, 0.25):
        trace = lampyris.simulate_fleet(fleet, plan, drive_limit=float(limit))
        off = np.abs(trace.at(1e3) - fleet.grid.to_metres(fleet.goals)).max(axis=1)
        on_goal += [limit] if off[0] < 1e-9 and np.isnan(trace.arrivals[0]) else []
        if trace:
            assert off.max() < 1e-6
            break
    assert trace
    assert on_goal


@sized("count", 8, 300)
def test_drives_with_any_speed_and_acceleration_end(count: int) -> None:
    for number in range(count):
        rng = np.random.default_rng([number, 72])
        v, a, d = (float(10.0**power) for power in rng.uniform([-1.5, -1.5, -1.5], [1.0, 1.5, 2.5]))
        fleet = lampyris.random_fleet(lampyris.load_grid("rooms-20"), int(rng.integers(2, 16)), seed=number)
        trace = lampyris.simulate_fleet(
            fleet, robot=lampyris.Robot(radius=0.3, v_max=v, a_max=a, d_max=d), seed=number,
            delays=lampyris.Delays(float(rng.choice([0.0, 0.3])), 1.0), obstacles=int(rng.choice([0, 3])), drive_limit=200.0,
        )  # fmt: skip
        assert trace.notes == (), (v, a, d)
        assert trace.status is lampyris.Status.FOUND or trace.duration_s <= 200.0


def test_events_without_progress_in_time_end_the_drive(monkeypatch: pytest.MonkeyPatch) -> None:
    # No known drive stalls; with no room for events at one moment the first ones do.
    monkeypatch.setattr(execution, "_EVENTS", -1_000_000)
    fleet = lampyris.random_fleet(lampyris.load_grid("rooms-20"), 3)
    trace = lampyris.simulate_fleet(fleet)
    assert trace.status is lampyris.Status.LIMIT
    assert "without time passing" in trace.notes[0]
