"""The referee of swarms: it passes what the simulation does, and names each rule that a defect breaks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from swarm_maps import filled, halls, walled

import lampyris
from lampyris.model.plan import Status
from lampyris.referee import check_swarm
from lampyris.referee.fleets.swarm import SwarmMotion
from lampyris.sim.swarm.simulation import RobotSwarm
from lampyris.swarms import three_peaks

Change = Callable[[lampyris.SwarmTrace], dict[str, Any]]


@pytest.fixture(scope="module")
def trace() -> lampyris.SwarmTrace:
    made = lampyris.swarm_robots(walled(), robots=30, seed=2, iterations=20, noise=0.05)
    assert check_swarm(made, every=True) is None
    assert made.status is Status.ITERATION_LIMIT
    return made


def put(name: str, index: Any, value: Any) -> Change:
    """One element of an array replaced; a function of the old one, or a value."""

    def change(trace: lampyris.SwarmTrace) -> dict[str, Any]:
        array = getattr(trace, name).copy()
        array[index] = value(array[index]) if callable(value) else value
        return {name: array}

    return change


def darker_leader(trace: lampyris.SwarmTrace) -> dict[str, Any]:
    """A robot follows one that is less bright."""
    leaders = trace.leaders.copy()
    t, i = np.argwhere(leaders >= 0)[5]
    leaders[t, i] = trace.luciferin[t + 1].argmin()
    return {"leaders": leaders}


def far_leader(trace: lampyris.SwarmTrace) -> dict[str, Any]:
    """Every robot follows the brightest of all, heard or not, and is said to be of its group."""
    leaders, groups = trace.leaders.copy(), np.zeros_like(trace.groups)
    for t in range(trace.iterations):
        leaders[t] = np.where(leaders[t] >= 0, trace.luciferin[t + 1].argmax(), -1)
    return {"leaders": leaders, "groups": groups}


def overlapping(trace: lampyris.SwarmTrace) -> dict[str, Any]:
    xy = trace.xy.copy()
    xy[3:, 4] = xy[3:, 5] + 0.01
    return {"xy": xy}


def swapped(trace: lampyris.SwarmTrace) -> dict[str, Any]:
    xy = trace.xy.copy()
    xy[5:, [0, 1]] = xy[5:, [1, 0]]
    return {"xy": xy}


def in_a_wall(trace: lampyris.SwarmTrace) -> dict[str, Any]:
    y, x = np.argwhere(trace.grid.blocked)[0]
    return put("xy", (slice(None), 0), trace.grid.to_metres((x, y)))(trace)


def one_more_neighbour(trace: lampyris.SwarmTrace) -> dict[str, Any]:
    """A count with the range that follows from it."""
    neighbours, ranges = trace.neighbours.copy(), trace.ranges.copy()
    beta = trace.settings.beta
    assert beta is not None
    i = next(
        i
        for i in range(trace.robots)
        if beta < ranges[-1, i] < trace.settings.sensor_range and neighbours[-1, i]
    )
    neighbours[-1, i] += 1
    ranges[-1, i] -= beta
    return {"neighbours": neighbours, "ranges": ranges}


def trees_as_groups(trace: lampyris.SwarmTrace) -> dict[str, Any]:
    """Only robots that follow each other are said to be a group: neighbours that nobody follows link none."""
    groups = np.empty_like(trace.groups)
    for t in range(trace.iterations):
        top = np.arange(trace.robots)
        for _ in range(trace.robots):
            ahead = trace.leaders[t, top]
            top = np.where(ahead >= 0, ahead, top)
        for root in np.unique(top):
            groups[t][top == root] = np.flatnonzero(top == root)[0]
    assert (groups != trace.groups).any()
    return {"groups": groups}


DEFECTS: dict[str, tuple[str, Change]] = {
    "overlap": ("contact", overlapping),
    "wall": ("wall", in_a_wall),
    "beyond the edge": ("wall", put("xy", (-1, 0), (-0.1, 3.0))),
    "two robots that change places": ("step", swapped),
    "not finite": ("finite", put("readings", (2, 3), np.nan)),
    "a measurement from nowhere": ("reading", put("readings", (2, 3), lambda old: old + 40.0)),
    "luciferin that does not decay": ("luciferin", put("luciferin", (4, 3), lambda old: old + 1e-3)),
    "luciferin at first": ("luciferin", put("luciferin", (0, 3), 4.0)),
    "a range that grows": ("range", put("ranges", (7, 3), lambda old: old + 1e-3)),
    "no leader although neighbours": ("leader", put("leaders", (slice(None), slice(None)), -1)),
    "a leader that is darker": ("leader", darker_leader),
    "a leader that is not heard": ("leader", far_leader),
    "one neighbour more": ("neighbours", one_more_neighbour),
    "a group without its leader": ("group", lambda t: {"groups": np.broadcast_to(np.arange(t.robots), t.groups.shape)}),
    "groups of followers alone": ("group", trees_as_groups),
    "encounters below none": ("encounters", lambda _: {"encounters": -5}),
    "encounters of nobody": ("encounters", lambda _: {"encounters": 10**6}),
    "walls met too often": ("encounters", lambda t: {"wall_encounters": t.robots * t.iterations + 1}),
    "one robot more held": ("held", put("held", (9, 1), lambda old: old + 1)),
    "one robot fewer held": ("held", lambda t: put("held", (-1, int(t.held[-1].argmax())), lambda old: old - 1)(t)),
    "a source that moved": ("sources", put("source_xy", (3, 0), lambda old: old + 0.1)),
    "found without holding": ("status", lambda t: {"status": Status.FOUND}),
    "a limit that was not reached": ("status", lambda t: {"status": Status.NO_PATH}),
    "settings with a default that is not resolved": ("settings", lambda t: {"settings": replace(t.settings, beta=None)}),
}  # fmt: skip


@pytest.mark.commit(12)
@pytest.mark.parametrize("defect", DEFECTS)
def test_a_defect_is_named(trace: lampyris.SwarmTrace, defect: str) -> None:
    rule, change = DEFECTS[defect]
    found = check_swarm(replace(trace, **change(trace)), every=rule in ("leader", "neighbours"))
    assert found is not None
    assert found.rule == rule, found


@pytest.mark.parametrize(
    ("source", "off"),
    [
        (lampyris.InverseSquare((6.0, 7.0), core=3.0), 0.1),
        (lampyris.Plume((6.0, 7.0), towards=0.7, width=3.0), 0.2),
        (None, 1.0),
    ],
    ids=["inverse-square", "plume", "three-peaks"],
)
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_measurements_of_the_gradient_are_judged(source: Any, off: float, noise: float) -> None:
    """What four sensors on the rim measured lies within what the signal is on the disc."""
    grid = walled()
    looked_for = (three_peaks(grid),) if source is None else (source,)
    made = lampyris.swarm_robots(
        grid, looked_for, robots=20, seed=3, iterations=10, method="gradient", noise=noise
    )
    assert check_swarm(made, every=True) is None
    off += 5 * noise * max(one.highest for one in looked_for)
    for sign in (1.0, -1.0):
        readings = made.readings.copy()
        readings[4, 7] += sign * off
        found = check_swarm(replace(made, readings=readings))
        assert found is not None
        assert found.rule == "reading"


def test_the_gradient_makes_no_groups() -> None:
    made = lampyris.swarm_robots(walled(), robots=10, seed=3, iterations=3, method="gradient")
    found = check_swarm(replace(made, groups=np.zeros_like(made.groups)))
    assert found is not None
    assert found.rule == "group"


@pytest.mark.parametrize("seed", range(4))
def test_groups_among_walls_are_made_again(seed: int) -> None:
    """Rooms whose robots do not hear each other: what is right passes, and one group of all is refused."""
    grid = halls()
    made = lampyris.swarm_robots(grid, robots=24, seed=seed, iterations=6, sensor_range=8.0)
    assert check_swarm(made, every=True) is None
    assert any(len(np.unique(row)) > 1 for row in made.groups)
    found = check_swarm(replace(made, groups=np.zeros_like(made.groups)), every=True)
    assert found is not None
    assert found.rule == "group"


def test_a_wall_between_robots_is_seen() -> None:
    """A swarm that hears through walls, judged by the rule that it may not."""
    grid = halls()
    made = lampyris.swarm_robots(grid, robots=20, seed=1, iterations=8, line_of_sight=False)
    assert check_swarm(made, every=True) is None
    found = check_swarm(replace(made, settings=replace(made.settings, line_of_sight=True)), every=True)
    assert found is not None
    assert found.rule in ("neighbours", "leader")


# ---- the motion within an iteration ----------------------


def motion(steps: int = 3, robots: int = 2) -> tuple[SwarmMotion, np.ndarray]:
    """A judge on an open map, and robots that stand a metre apart; steps of at most 0.1 m, 0.4 m an iteration."""
    grid = lampyris.Grid(np.zeros((10, 10), dtype=bool))
    judge = SwarmMotion(
        grid, filled(grid, radius=0.25, step=0.4, small_step=0.1, v_max=0.5, yaw_rate_max=1.0)
    )
    places = np.stack((3.0 + np.arange(robots), np.full(robots, 5.0)), axis=-1)
    return judge, np.tile(places, (steps + 1, 1, 1))


def test_standing_and_driving_straight_pass() -> None:
    judge, path = motion()
    path[:, 1, 0] += [0.0, 0.1, 0.2, 0.3]
    assert judge.see(path) is None


@pytest.mark.parametrize(
    ("rule", "moves"),
    [
        ("speed", [(0.0, 0.0), (0.11, 0.0), (0.11, 0.0), (0.11, 0.0)]),
        ("turn", [(0.0, 0.0), (0.1, 0.0), (0.1, 0.1), (0.1, 0.1)]),
        ("wall", [(0.0, 4.70), (0.0, 4.76), (0.0, 4.76), (0.0, 4.76)]),
    ],
)
def test_a_motion_that_no_robot_can_make(rule: str, moves: list[tuple[float, float]]) -> None:
    judge, path = motion()
    path[:, 1] += moves
    found = judge.see(path)
    assert found is not None
    assert found.rule == rule


def test_more_than_a_step_in_an_iteration() -> None:
    judge, path = motion(6)
    path[:, 1, 0] += 0.09 * np.arange(7)
    found = judge.see(path)
    assert found is not None
    assert found.rule == "step"


def test_a_contact_between_two_moments_is_seen() -> None:
    """Two discs pass each other within a small step; at both its ends they are apart."""
    judge, path = motion(1)
    # 0.5 m apart up to a rounding at both ends, and nearer in between.
    path[0] = [(3.0, 5.0), (3.05, 5.498)]
    path[1] = [(3.1, 5.0), (2.95, 5.498)]
    path[1, 1] = (3.05, 5.498)
    gap = np.sqrt(((path[:, 0] - path[:, 1]) ** 2).sum(axis=1))
    assert (gap >= 0.5).all()
    found = judge.see(path)
    assert found is not None
    assert found.rule == "contact"


def test_an_iteration_begins_where_the_last_one_ended() -> None:
    judge, path = motion()
    assert judge.see(path) is None
    found = judge.see(path + 0.01)
    assert found is not None
    assert found.rule == "start"


def test_the_corner_of_a_wall_is_seen_between_two_moments() -> None:
    blocked = np.zeros((10, 10), dtype=bool)
    blocked[4, 4] = True  # from (4, 5) to (5, 6) m
    grid = lampyris.Grid(blocked)
    judge = SwarmMotion(grid, filled(grid, radius=0.25, step=0.4, small_step=0.25))
    # Past the corner (4, 5), nearest halfway.
    ends = np.array([[[3.75, 4.91]], [[3.91, 4.75]]])
    corner = np.sqrt(((ends - [4.0, 5.0]) ** 2).sum(axis=2))
    assert (corner > 0.25).all()
    found = judge.see(ends)
    assert found is not None
    assert found.rule == "wall"


@pytest.mark.parametrize("seed", range(3))
def test_a_swarm_without_the_rule_of_apart_is_refused(seed: int) -> None:
    """The same robots, simulated half as large as they are judged: they overlap, and it is seen."""
    grid = walled(seed)
    small, true = (
        filled(grid, radius=0.05, step=0.125),
        filled(grid, radius=0.12, step=0.125, small_step=0.025),
    )
    places = np.array([[2.0, 2.0], [2.5, 2.0], [2.0, 2.5], [2.5, 2.5]]) + 3.0
    swarm = RobotSwarm(grid, (three_peaks(grid),), replace(small, small_step=0.025), places, seed)
    judge = SwarmMotion(grid, true)
    for _ in range(60):
        before = swarm.xy
        made = swarm.advance()
        cells = np.stack((made.path_x, made.path_y), axis=-1) / grid.resolution - 0.5
        found = judge.see(np.concatenate((before[np.newaxis], grid.to_metres(cells))))
        if found is not None:
            break
    assert found is not None
    assert found.rule in ("contact", "wall")
