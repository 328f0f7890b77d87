"""The referee of fleet drives sees every defect that is put into a good trace."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from drive_checks import crossing, places

import lampyris
from lampyris.referee import check_fleet_trace, check_lifelong
from lampyris.typing import Floats


@pytest.fixture(scope="module")
def good() -> lampyris.FleetTrace:
    fleet, plan = crossing()
    return lampyris.simulate_fleet(
        fleet, plan, robot=lampyris.Robot(radius=0.3), delays=lampyris.Delays(0.5, 2.0), seed=4
    )


def changed(values: Floats, row: int, value: float) -> Floats:
    made = np.array(values)
    made[row] = value
    return made


def swapped(trace: lampyris.FleetTrace) -> lampyris.FleetTrace:
    """The first robot comes to the cell that both pass when the second one does."""
    times = np.arange(0.0, trace.duration_s, 0.005)
    gap = places(trace, times) - trace.grid.to_metres((2, 2))
    first, second = times[(gap**2).sum(axis=2).argmin(axis=0)]
    shift = second - first
    waits = np.array(trace.waits)
    waits[0, 0] += shift
    arrivals = changed(trace.arrivals, 0, trace.arrivals[0] + shift)
    return replace(
        trace, t=np.where(trace.robot == 0, trace.t + shift, trace.t), arrivals=arrivals, waits=waits
    )


DEFECTS: dict[str, Callable[[lampyris.FleetTrace], lampyris.FleetTrace]] = {
    "start": lambda one: replace(one, starts=np.array([(0, 1), (2, 0)])),
    "phases": lambda one: replace(one, x=changed(one.x, 1, one.x[1] + 0.01)),
    "phases, time": lambda one: replace(one, t=changed(one.t, 1, one.t[1] - 0.1)),
    "phases, speed": lambda one: replace(one, v=changed(one.v, 1, one.v[1] * 0.9)),
    "direction": lambda one: replace(one, dx=changed(one.dx, 0, 0.9)),
    "speed": lambda one: replace(one, robots=tuple(replace(robot, v_max=0.5) for robot in one.robots)),
    "acceleration": lambda one: replace(one, robots=tuple(replace(robot, a_max=0.4) for robot in one.robots)),
    "acceleration, braking": lambda one: replace(one, robots=tuple(replace(robot, d_max=0.9) for robot in one.robots)),
    "goal": lambda one: replace(one, goals=np.array([(4, 3), (2, 4)])),
    "arrival": lambda one: replace(one, arrivals=changed(one.arrivals, 0, np.nan)),
    "arrival, time": lambda one: replace(one, arrivals=changed(one.arrivals, 0, one.arrivals[0] - 1.0)),
    "waits": lambda one: replace(one, waits=one.waits + 0.5),
    "wall": lambda one: replace(one, grid=lampyris.Grid(np.arange(25).reshape(5, 5) == 13)),
    "wall, beside": lambda one: replace(
        one, grid=lampyris.Grid(np.arange(25).reshape(5, 5) == 6),
        robots=tuple(replace(robot, radius=0.55) for robot in one.robots),
    ),
    "contact": lambda one: swapped(one),
    "obstacle": lambda one: replace(one, obstacles=(lampyris.Track([0.0], [(1, 2)], 0.3, 0.1),)),
    "order": lambda one: replace(one, plans=(backwards(one),)),
    "order, path": lambda one: replace(one, plans=((one.plans[0][1], one.plans[0][0]),)),
    "fault": lambda one: replace(one, faults=((0, 0.1),), arrivals=changed(one.arrivals, 0, np.nan)),
}  # fmt: skip


def backwards(one: lampyris.FleetTrace) -> tuple[np.ndarray, np.ndarray]:
    """A plan in which the second robot comes first."""
    first, second = one.plans[0]
    late = np.concatenate((np.repeat(first[:1], 9, axis=0), first[1:]))
    return late, second


def test_the_good_one_passes(good: lampyris.FleetTrace) -> None:
    assert check_fleet_trace(good) is None
    assert good.delayed > 0


@pytest.mark.parametrize("name", DEFECTS)
def test_each_defect_is_seen(good: lampyris.FleetTrace, name: str) -> None:
    found = check_fleet_trace(DEFECTS[name](good))
    assert found is not None
    assert found.rule == name.partition(",")[0]


def test_a_pair_that_touches_is_found_however_short(good: lampyris.FleetTrace) -> None:
    """Two robots cross at right angles; they touch for 7 ms."""
    n = 2
    radius, v = 0.3, 1.0
    # Their centres come within 0.5999 m of each other: the line between has length |offset| / sqrt 2.
    offset = 0.5999 * np.sqrt(2.0)
    grid = lampyris.Grid(np.zeros((9, 9), dtype=bool))
    starts = np.array([(0, 4), (4, 8)])
    at = grid.to_metres(starts)
    trace = replace(
        good, grid=grid, starts=starts, goals=starts, robots=(lampyris.Robot(radius=radius, v_max=v),) * n, robot=[0, 1],
        t=[0.0, offset], duration=[8.0, 8.0], x=at[:, 0], y=at[:, 1], dx=[1.0, 0.0], dy=[0.0, 1.0], v=[v, v], a=[0.0, 0.0],
        arrivals=[np.nan] * n, planned=[np.nan] * n, waits=np.zeros((n, 5)), plans=(), plan_times=(),
    )  # fmt: skip
    from lampyris.referee.fleets.fleet_trace import TracePositions

    assert len(TracePositions(trace).contacts()) == 1
    clear = replace(trace, t=[0.0, 0.6001 * np.sqrt(2.0)])
    assert TracePositions(clear).contacts() == []


@pytest.fixture(scope="module")
def service() -> lampyris.LifelongTrace:
    fleet = lampyris.random_fleet(lampyris.load_grid("guide"), 6, seed=1)
    return lampyris.lifelong_fleet(fleet, 60, faults=[(2, 20)])


def moved(
    one: lampyris.LifelongTrace, tick: int, robot: int, cell: tuple[int, int]
) -> lampyris.LifelongTrace:
    xy = np.array(one.xy)
    xy[tick:, robot] = cell
    return replace(one, xy=xy)


def first_done(one: lampyris.LifelongTrace) -> int:
    return int(np.flatnonzero(one.done >= 0)[0])


SERVICE: dict[str, Callable[[lampyris.LifelongTrace], lampyris.LifelongTrace]] = {
    "wall": lambda one: moved(one, 60, 0, tuple(np.argwhere(one.grid.blocked)[0][::-1].tolist())),
    "step": lambda one: jump(one),
    "vertex": lambda one: replace(
        one, xy=np.concatenate((one.xy[:, :1], one.xy[:, :1], one.xy[:, 2:]), axis=1)
    ),
    "fault": lambda one: replace(one, faults=((0, 1),)),
    "task": lambda one: replace(
        one, done=np.where(np.arange(len(one.done)) == first_done(one), one.done + 1, one.done)
    ),
    "task, robot": lambda one: replace(
        one, robot=np.where(one.robot == 0, 1, np.where(one.robot == 1, 0, one.robot))
    ),
    "task, early": lambda one: replace(one, assigned=np.where(one.done >= 0, one.done + 1, one.assigned)),
}


def jump(one: lampyris.LifelongTrace) -> lampyris.LifelongTrace:
    xy = np.array(one.xy)
    free = np.argwhere(~one.grid.blocked)[:, ::-1]
    taken = {tuple(cell) for cell in xy[60].tolist()}
    far = [c for c in free.tolist() if tuple(c) not in taken and abs(c - xy[59, 0]).sum() > 3]
    xy[60, 0] = far[0]
    return replace(one, xy=xy)


def test_a_lifelong_fleet_passes_and_defects_are_seen(service: lampyris.LifelongTrace) -> None:
    assert check_lifelong(service) is None
    for name, spoil in SERVICE.items():
        found = check_lifelong(spoil(service))
        assert found is not None, name
        assert found.rule == name.partition(",")[0], name


def test_robots_that_change_places_are_seen(service: lampyris.LifelongTrace) -> None:
    grid = lampyris.Grid(np.zeros((1, 2), dtype=bool))
    xy = np.array([[(0, 0), (1, 0)], [(1, 0), (0, 0)]])
    none: list[int] = []
    one = replace(
        service, grid=grid, xy=xy, tasks=(), robot=none, assigned=none, done=none, stop_ticks=(), faults=()
    )
    found = check_lifelong(one)
    assert found is not None
    assert found.rule == "swap"
