"""The planner fastest-time: exact on the lattice of cell and step, a lower bound of every profile, and what it saves."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

import lampyris
from lampyris.errors import SettingError, UsageError
from lampyris.model.moves import MOVES, Moves
from lampyris.model.plan import Plan
from lampyris.motion.cap_values import Around
from lampyris.motion.geometry.sampled_path import sample_with_corners
from lampyris.motion.laws import registry as laws
from lampyris.motion.safety.blind_areas import BlindArea, blind_cap, caps_by_step
from lampyris.planning.base import Budget
from lampyris.testing import check_planner
from lampyris.travel_time.fastest_time import FastestTime
from lampyris.typing import BoolGrid, Cell, FloatGrid
from sizes import sized

ROBOT = lampyris.Robot(radius=0.1, v_max=1.3, a_max=0.6, d_max=0.9, a_lat_max=0.7, turn_radius=0.3)
"""Corners of 45 degrees are no limit, those of 90 are, and those of 135 are stops."""


def seconds_of(plan: Plan) -> float:
    """The least travel time that a plan states."""
    assert plan.time_lower_bound is not None
    return plan.time_lower_bound


def corner_speed(before: Cell, after: Cell, robot: lampyris.Robot) -> float:
    """By trigonometry: an arc tangent to both steps within half the shorter; 0: it does not fit."""
    turn = abs(math.remainder(math.atan2(after[1], after[0]) - math.atan2(before[1], before[0]), math.tau))
    if turn < 1e-9:
        return math.inf
    if turn > math.pi - 1e-9:
        return 0.0
    radius = 0.5 * min(math.hypot(*before), math.hypot(*after)) / math.tan(turn / 2)
    return 0.0 if radius < robot.turn_radius else math.sqrt(robot.a_lat_max * radius)


def clearance_speeds(walls: NDArray[np.bool_], robot: lampyris.Robot) -> NDArray[np.float64]:
    """The clearance cap of each cell of many maps (m, height, width), from all pairs of cells."""
    m, height, width = walls.shape
    y, x = (a.ravel() for a in np.mgrid[:height, :width])
    gap = np.hypot(*(np.maximum(np.abs(a[:, None] - a) - 0.5, 0.0) for a in (x, y)))
    blocked = walls.reshape(m, 1, -1)
    near = np.where(blocked, gap, np.inf).min(axis=2)
    stop = np.sqrt(2.0 * robot.d_max * np.maximum(near - robot.radius, 0.0))
    return np.minimum(robot.v_max, np.maximum(0.1 * robot.v_max, stop)).reshape(m, height, width)


def least_times(
    walls: NDArray[np.bool_],
    moves: Moves,
    robot: lampyris.Robot,
    start: Cell,
    goal: Cell,
    zones: FloatGrid | None = None,
) -> NDArray[np.float64]:
    """The least travel time of each of many maps by relaxing every pair of steps until nothing changes; infinity: none."""
    m, height, width = walls.shape
    caps = clearance_speeds(walls, robot)
    steps = moves.offsets

    def inside(x: int, y: int) -> bool:
        return 0 <= x < width and 0 <= y < height

    def legal(x: int, y: int, dx: int, dy: int) -> NDArray[np.bool_]:
        if not inside(x + dx, y + dy):
            return np.zeros(m, dtype=bool)
        ok = ~walls[:, y, x] & ~walls[:, y + dy, x + dx]
        # A robot with a radius cuts no corners, whatever the moves.
        return ok & ~walls[:, y, x + dx] & ~walls[:, y + dy, x]

    def half(x: int, y: int, k: int, corner: float, acceleration: float) -> NDArray[np.float64]:
        """Seconds on half of the step k from (x, y)."""
        dx, dy = steps[k]
        long = math.hypot(dx, dy)
        a, b = caps[:, y, x], caps[:, y + dy, x + dx]
        if zones is not None:
            limit = zones[min(y, y + dy) : max(y, y + dy) + 1, min(x, x + dx) : max(x, x + dx) + 1].min()
            a, b = np.minimum(a, limit), np.minimum(b, limit)
        if corner > 0.0:
            return long / (np.minimum(a, corner) + np.minimum(b, corner))
        v = np.maximum(a, b)
        ramp = v * v / (2 * acceleration)  # metres until v is reached
        return np.where(
            ramp >= long / 2,
            np.sqrt(2 * (long / 2) / acceleration),
            v / acceleration + (long / 2 - ramp) / v,
        )

    cells = [(x, y) for y in range(height) for x in range(width)]
    at = {(x, y, k): np.full(m, np.inf) for x, y in cells for k in range(len(steps))}
    for k, (dx, dy) in enumerate(steps):
        if inside(start[0] + dx, start[1] + dy):
            ok = legal(*start, dx, dy)
            at[start[0] + dx, start[1] + dy, k] = np.where(ok, half(*start, k, math.inf, 1.0), np.inf)
    edges = []
    for x, y in cells:
        for j, (dx, dy) in enumerate(steps):
            px, py = x - dx, y - dy
            if not inside(px, py):
                continue
            for k, (ex, ey) in enumerate(steps):
                if inside(x + ex, y + ey):
                    corner = corner_speed(steps[j], steps[k], robot)
                    cost = half(px, py, j, corner, robot.d_max) + half(x, y, k, corner, robot.a_max)
                    edges.append(
                        ((x, y, j), (x + ex, y + ey, k), np.where(legal(x, y, ex, ey), cost, np.inf))
                    )
    changed = True
    while changed:
        changed = False
        for one, other, cost in edges:
            new = at[one] + cost
            if (new < at[other] - 1e-12).any():
                at[other] = np.minimum(at[other], new)
                changed = True
    best = np.full(m, np.inf)
    for k, (dx, dy) in enumerate(steps):
        px, py = goal[0] - dx, goal[1] - dy
        if inside(px, py):
            best = np.minimum(best, at[(*goal, k)] + half(px, py, k, math.inf, 1.0))
    return best


def maps_of_16(numbers: Sequence[int]) -> NDArray[np.bool_]:
    """Maps of 4 x 4 whose walls are the bits of a number."""
    return (np.array(numbers)[:, None] >> np.arange(16) & 1).astype(bool).reshape(-1, 4, 4)


@sized("count", 60, 2**16)
def test_every_map_of_4_x_4_with_8_headings_equals_brute_force(count: int) -> None:
    numbers = list(range(count))
    if count < 2**16:  # few walls: of all maps one in twenty has a path
        draw = np.random.default_rng(1).integers(0, 2**16, (2, count))
        numbers = (draw[0] & draw[1] & 0x7FFE).tolist()
    solved = sum(solved_of(numbers[k : k + 4096]) for k in range(0, count, 4096))
    assert solved >= count // 40


def solved_of(numbers: Sequence[int]) -> int:
    """Compare the planner with brute force on some maps; how many of them have a path."""
    walls = maps_of_16(numbers)
    want = least_times(walls, MOVES["octile"], ROBOT, (0, 0), (3, 3))
    solved = 0
    for map_, least in zip(walls, want.tolist(), strict=True):
        if map_[0, 0] or map_[3, 3]:
            continue
        scene = lampyris.Scene(lampyris.Grid(map_), (0, 0), (3, 3), robot=ROBOT)
        session = FastestTime().open(scene, np.random.default_rng(0))
        plan = session.plan()
        assert bool(plan.status) == math.isfinite(least)
        if plan.status:
            solved += 1
            assert seconds_of(plan) == pytest.approx(least, rel=1e-9)
    return solved


@pytest.mark.parametrize("moves", ["octile", "four-connected"])
def test_random_maps_with_speed_zones_equal_brute_force(moves: str) -> None:
    rng = np.random.default_rng(5)
    for _ in range(3):
        walls = rng.random((5, 6)) < 0.2
        walls[0, 0] = walls[4, 5] = False
        zones = rng.choice([0.3, 0.6, 2.0], (5, 6))
        grid = lampyris.Grid(walls)
        scene = lampyris.Scene(grid, (0, 0), (5, 4), moves=moves, robot=ROBOT, zones=zones)
        (least,) = least_times(walls[None], MOVES[moves], ROBOT, (0, 0), (5, 4), zones).tolist()
        plan = lampyris.plan(scene, "fastest-time")
        assert bool(plan.status) == math.isfinite(least)
        if plan.status:
            assert seconds_of(plan) == pytest.approx(least, rel=1e-9)


def random_scene(seed: int, moves: str = "octile") -> lampyris.Scene:
    """A map of 30 x 40 cells of half a metre."""
    rng = np.random.default_rng(seed)
    walls: BoolGrid = rng.random((30, 40)) < 0.15
    walls[:3, :3] = walls[-3:, -3:] = False
    grid = lampyris.Grid(walls, resolution=0.5)
    return lampyris.Scene(grid, (1, 1), (38, 28), moves=moves, robot=replace(ROBOT, turn_radius=0.0))


@pytest.mark.parametrize("moves", sorted(MOVES))
def test_no_profile_is_faster_than_the_least_travel_time(moves: str) -> None:
    for seed in range(3):
        scene = random_scene(seed, moves)
        fast, short = (lampyris.plan(scene, name) for name in ("fastest-time", "astar"))
        assert bool(fast.status) == bool(short.status)
        if not fast.status:
            continue
        least = seconds_of(fast) * (1 - 1e-12)
        times = [lampyris.speed_profile(scene, plan).duration for plan in (fast, short)]
        assert least <= min(times)
        assert fast.cost >= short.cost - 1e-9


def test_it_saves_time_on_a_bundled_map() -> None:
    scene = lampyris.Scene(lampyris.load_grid("env-3"), (28, 7), (26, 26), robot=lampyris.Robot(radius=0.15))
    fast, short = (lampyris.plan(scene, name) for name in ("fastest-time", "astar"))
    times = [lampyris.speed_profile(scene, plan).duration for plan in (fast, short)]
    assert times[0] < 0.9 * times[1]
    seen = [
        lampyris.speed_profile(scene, plan, "blind").duration
        for plan in (lampyris.plan(scene, "fastest-time", blind=True), short)
    ]
    assert seen[0] < 0.6 * seen[1]


def test_the_cap_of_a_step_is_never_below_the_laws_own_on_a_path() -> None:
    scene = random_scene(1)
    plan = lampyris.plan(scene, "astar")
    assert plan.path is not None
    samples = sample_with_corners(plan.path, 0.5, scene.robot)
    (cap,) = blind_cap(samples, scene, BlindArea(), Around())
    by_step = caps_by_step(scene, ~scene.grid.blocked, scene.moves.offsets, BlindArea())
    cells = plan.path.cells
    limited = 0
    for k, (a, b) in enumerate(pairwise(cells)):
        step = scene.moves.offsets.index(tuple(int(v) for v in b - a))
        here = by_step[step, a[1], a[0]]
        assert cap.v[k] <= here + 1e-12
        assert cap.v[k + 1] <= here + 1e-12
        limited += math.isfinite(here)
    assert limited > 5
    least = seconds_of(lampyris.plan(scene, "fastest-time", blind=True)) * (1 - 1e-12)
    assert least <= laws.profile_on_cells(plan.path, scene, law="blind").duration


@pytest.mark.nightly
def test_it_keeps_the_contract_of_planners() -> None:
    check_planner(FastestTime())


def test_a_budget_of_expansions_is_kept() -> None:
    scene = random_scene(0)
    limited = FastestTime().open(scene, np.random.default_rng(0)).plan(None, Budget(expansions=20))
    assert limited.status == "limit"
    assert limited.expansions == 20


def test_walls_that_change_change_the_caps() -> None:
    scene = lampyris.Scene(lampyris.Grid(np.zeros((9, 9), bool)), (0, 4), (8, 4), robot=ROBOT)
    session = FastestTime().open(scene, np.random.default_rng(0))
    free = seconds_of(session.plan())
    wall = lampyris.Change(blocked=frozenset({(4, 3), (4, 5)}))
    slower = session.plan(wall)
    fresh = FastestTime().open(
        replace(scene, grid=lampyris.Grid(np.isin(np.arange(81).reshape(9, 9), (31, 49)))),
        np.random.default_rng(0),
    )
    assert seconds_of(slower) == seconds_of(fresh.plan()) > free


def test_the_bound_is_a_number_and_not_a_note() -> None:
    """Notes say what was done otherwise than asked, and studies list them as such."""
    scene = lampyris.Scene(lampyris.Grid(np.zeros((9, 9), bool)), (0, 4), (8, 4), robot=ROBOT)
    slow = replace(scene, zones=np.full((9, 9), 0.2))
    plan = lampyris.plan(slow, "fastest-time")
    assert plan.notes == ()
    assert plan.time_lower_bound == pytest.approx(8 / 0.2)
    assert lampyris.plan(scene, "astar").time_lower_bound is None
    legs = lampyris.plan(slow.through([(4, 4)]), "fastest-time")
    assert legs.time_lower_bound == pytest.approx(8 / 0.2)


def test_settings_out_of_range_are_refused() -> None:
    with pytest.raises(SettingError, match="creep 0"):
        FastestTime(creep=0.0)
    with pytest.raises(SettingError, match="clearance"):
        FastestTime(clearance=1)  # type: ignore[arg-type]


def test_settings_under_a_law() -> None:
    # The caps that the planner is given are those of the law, so no profile on its path is faster than what it states.
    scene = lampyris.Scene(lampyris.load_grid("rooms-20"), (1, 1), (18, 18), robot=ROBOT)
    for law, given in (("physical", {"creep": 0.9}), ("blind", {"blind.hidden_speed": 0.2}), ("optimum", {})):
        settings = lampyris.fastest_time_settings(law, given)
        plan = lampyris.plan(scene, "fastest-time", **settings)
        usual = lampyris.plan(scene, "fastest-time", blind=law == "blind")
        profile = lampyris.speed_profile(scene, plan, law, law_settings=given)
        assert seconds_of(plan) <= profile.duration * (1 + 1e-9)
        assert seconds_of(plan) != seconds_of(usual)
    assert lampyris.fastest_time_settings("cloud") == lampyris.fastest_time_settings()
    for law in ("dissertation", "rpp", "constant", "uncertainty"):
        with pytest.raises(UsageError, match=law):
            lampyris.fastest_time_settings(law)
