"""Measures of a run: by hand, and against a slow reference that shares nothing with them."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import lampyris
from lampyris.model.curve import Curve
from lampyris.model.drive import Drive, Moment
from lampyris.model.grid import Grid
from lampyris.model.obstacles import Track
from lampyris.model.path import path_of
from lampyris.model.plan import Plan, Status
from lampyris.model.profile import Profile
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.trace import Outcome, Trace
from lampyris.model.traffic import Crossing, Obstacle, Patrol, RandomWalk
from lampyris.planning.field.layers import clearance, free_space, moves_for
from lampyris.planning.field.solve import solve
from lampyris.report.data.measures import (
    METRICS,
    Known,
    drive_metrics,
    near_by_tick,
    plan_metrics,
    slack,
    trace_metrics,
)

WALKER = Obstacle("random-walk", 0.0, True)
SQRT2 = math.sqrt(2.0)


def known_of(scene: Scene) -> Known:
    field = solve(free_space(scene), moves_for(scene), scene.goal, terrain=scene.grid.terrain)
    x, y = scene.start
    exact = int(field.exact[y, x])
    return Known(exact if exact >= 0 else None, field.cost, clearance(scene.grid))


def trace_of(scene: Scene, robot: Any, tracks: Any = (), *, outcome: Outcome, **more: Any) -> Trace:
    """A trace made by hand."""
    cells = np.array(robot)
    way = [robot[0]] + [b for a, b in itertools.pairwise(robot) if a != b]
    said = {
        "planner": "hand", "seed": 0, "appears": (0,) * len(tracks), "obstacle_specs": (WALKER,) * len(tracks),
        "speed": np.zeros(len(cells)), "cause": ("limit",) * len(cells), "law": "physical", "units": "m/s",
        "events": (), "replans": 0, "waits": 0, "iterations": 0, "expansions": 0,
        "path": path_of(np.array(way), scene.moves),
    }  # fmt: skip
    return Trace(scene, outcome=outcome, robot=cells, tracks=tuple(map(np.array, tracks)), **{**said, **more})


# ---- by hand --------------------


def test_a_plan_by_hand() -> None:
    """(0,0) -> (1,1) -> (2,1) -> (3,0) on a map of 4 x 3 with one wall at (1, 0), cells of half a metre."""
    blocked = np.zeros((3, 4), dtype=np.bool_)
    blocked[0, 1] = True
    scene = Scene(Grid(blocked, resolution=0.5), (0, 0), (3, 0), moves="dissertation")
    path = path_of(np.array([(0, 0), (1, 1), (2, 1), (3, 0)]), scene.moves)
    plan = Plan(Status.FOUND, "hand", path, iterations=3, expansions=9)
    found = plan_metrics(plan, scene, known_of(scene))
    assert tuple(found) == METRICS
    assert (found["outcome"], found["found"], found["arrived"]) == ("found", True, True)
    assert found["cost"] == pytest.approx(1.4 + 1.0 + 1.4)
    assert found["optimal"] == pytest.approx(3.8)
    assert found["gap"] == 0.0
    assert found["cost_to_go"] == pytest.approx(3.8 + 2.4 + 1.4 + 0.0)
    assert found["length_cells"] == pytest.approx(1 + 2 * SQRT2)
    assert found["length_m"] == pytest.approx(0.5 + SQRT2)
    assert (found["turns"], found["turn_deg"]) == (2, pytest.approx(90.0))
    assert found["smoothness"] == pytest.approx(1 / (1 + (math.pi / 2) / (1 + 2 * SQRT2)))
    # From the centres of the four cells to the square of the wall: 0.5, 0.5, 0.5 sqrt 2 and 1.5 cells.
    assert found["clearance_least_m"] == pytest.approx(0.25)
    assert found["clearance_mean_m"] == pytest.approx(0.5 * (0.5 + 0.5 + 0.5 * SQRT2 + 1.5) / 4)
    assert (found["ticks"], found["iterations"], found["expansions"]) == (3, 3, 9)
    for name in (
        "time_s",
        "speed_mean",
        "speed_least",
        "hits",
        "near_m",
        "waits",
        "path_switches",
        "reference_ok",
    ):
        assert found[name] is None
    longer = path_of(np.array([(0, 0), (0, 1), (1, 1), (2, 1), (3, 1), (3, 0)]), scene.moves)
    assert plan_metrics(replace(plan, path=longer), scene, known_of(scene))["gap"] == pytest.approx(
        5 / 3.8 - 1
    )


def test_an_any_angle_plan_is_its_lines() -> None:
    """(0, 0) to (4, 1) and (4, 3): two lines with one corner; the walk by cells turns three times."""
    scene = Scene(Grid(np.zeros((4, 5), dtype=np.bool_), resolution=0.5), (0, 0), (4, 3), moves="octile")
    walk = path_of(np.array([(0, 0), (1, 0), (2, 1), (3, 1), (4, 1), (4, 2), (4, 3)]), scene.moves)
    cells = plan_metrics(Plan(Status.FOUND, "hand", walk), scene, known_of(scene))
    assert (cells["length_any_angle"], cells["turns"]) == (None, 3)
    assert cells["length_cells"] == pytest.approx(5 + SQRT2)
    plan = Plan(Status.FOUND, "hand", walk, waypoints=np.array([(0, 0), (4, 1), (4, 3)]))
    found = plan_metrics(plan, scene, known_of(scene))
    length, turn = math.sqrt(17) + 2, math.atan2(4, 1)
    assert found["length_any_angle"] == found["length_cells"] == pytest.approx(length)
    assert found["length_any_angle"] == plan.any_angle_length
    assert found["length_m"] == pytest.approx(length / 2)
    assert (found["turns"], found["turn_deg"]) == (1, pytest.approx(math.degrees(turn)))
    assert found["smoothness"] == pytest.approx(1 / (1 + turn / length))
    for name in ("cost", "gap", "cost_to_go", "ticks", "optimal"):
        assert found[name] == cells[name]
    straight = replace(plan, waypoints=np.array([(0, 0), (2, 1), (4, 2), (4, 3)]))
    assert plan_metrics(straight, scene, known_of(scene))["turns"] == 1


def test_a_plans_time_is_its_profiles_if_that_is_in_seconds() -> None:
    scene = Scene(Grid(np.zeros((1, 3), dtype=np.bool_)), (0, 0), (2, 0), moves="octile")
    plan = Plan(Status.FOUND, "hand", path_of(np.array([(0, 0), (1, 0), (2, 0)]), scene.moves))
    profile = Profile(
        "physical", [0, 1, 2], [0, 1, 0], [0.5, -0.5, 0], [0, 2, 4], ("start", "limit", "goal"), "m/s"
    )  # type: ignore[arg-type]
    found = plan_metrics(plan, scene, known_of(scene), profile)
    assert (found["time_s"], found["speed_mean"], found["speed_least"]) == (4.0, 1.0, 1.0)
    assert found["clearance_least_m"] is None  # no wall at all
    other = replace(profile, law="dissertation", units="velocity units")
    assert plan_metrics(plan, scene, known_of(scene), other)["time_s"] is None
    timed = replace(plan, schedule=np.array([0, 4, 5]))
    assert plan_metrics(timed, scene, known_of(scene))["ticks"] == 5


def test_near_misses_by_hand() -> None:
    """Half a metre a cell. Two apart in a row is one whole cell of free room: no near miss."""
    scene = Scene(Grid(np.zeros((9, 9), dtype=np.bool_), resolution=0.5), (0, 0), (4, 0), moves="octile")
    robot = [(0, 0), (1, 0), (2, 0), (3, 0), (4, 0)]
    away = [(8, 8)] * 5
    for track, misses, near in (
        (away, 0, 0.5 * (math.sqrt(16 + 64) - 1)),
        ([(2, 0), (3, 0), (4, 0), (5, 0), (6, 0)], 0, 0.5),
        ([(1, 1), (2, 1), (3, 1), (4, 1), (5, 1)], 5, 0.5 * (SQRT2 - 1)),
        ([(8, 8), (8, 7), (7, 6), (3, 1), (6, 4)], 1, 0.0),
    ):
        found = trace_metrics(trace_of(scene, robot, [away, track], outcome=Outcome.ARRIVED), known_of(scene))
        assert (found["near_misses"], found["near_m"]) == (misses, pytest.approx(near))
    alone = trace_metrics(trace_of(scene, robot, outcome=Outcome.ARRIVED), known_of(scene))
    assert (alone["near_misses"], alone["near_m"]) == (0, None)
    assert (alone["ticks"], alone["gap"], alone["cost"]) == (4, 0.0, 4.0)


def test_discs_larger_than_their_cells_count_with_their_radii() -> None:
    grid = Grid(np.zeros((20, 20), dtype=np.bool_), resolution=0.5)
    scene = Scene(grid, (2, 2), (3, 2), moves="octile", robot=Robot(radius=0.6))
    big = Obstacle("crossing", 0.8, False)
    made = trace_of(
        scene, [(2, 2), (3, 2)], [[(8, 2), (8, 2)]], outcome=Outcome.ARRIVED, obstacle_specs=(big,)
    )
    assert near_by_tick(made) == pytest.approx([3.0 - 1.4, 2.5 - 1.4])
    small = replace(made, obstacle_specs=(Obstacle("crossing", 0.1, False),))
    assert near_by_tick(small) == pytest.approx([3.0 - 0.85, 2.5 - 0.85])


def test_a_hit_touches_and_has_no_way() -> None:
    scene = Scene(Grid(np.zeros((5, 5), dtype=np.bool_)), (0, 0), (4, 0), moves="octile")
    made = trace_of(
        scene, [(0, 0), (1, 0), (1, 0)], [[(3, 0), (2, 0), (1, 0)]], outcome=Outcome.HIT, waits=1, replans=4,
        path_switches=1, iterations=2, expansions=30, speed=np.array([0.0, 0.5, 0.0]),
    )  # fmt: skip
    found = trace_metrics(made, known_of(scene))
    assert (found["hits"], found["collisions"], found["near_m"], found["near_misses"]) == (1, 0, 0.0, 2)
    assert (found["found"], found["arrived"], found["optimal"]) == (True, False, 4.0)
    for name in ("cost", "gap", "length_m", "ticks", "time_s", "cost_to_go", "turns", "clearance_mean_m"):
        assert found[name] is None
    assert (found["waits"], found["replans"], found["path_switches"], found["path_switches_per_100"]) == (
        1,
        4,
        1,
        50.0,
    )
    assert (found["speed_mean"], found["speed_least"]) == (0.5, 0.5)


def test_changes_of_mind_are_counted_by_the_hundred_ticks_whatever_the_replans() -> None:
    """AD-GSO changes its mind where it asks anew at a jump, which no replan is."""
    scene = Scene(Grid(np.zeros((5, 9), dtype=np.bool_)), (0, 0), (8, 0), moves="octile")
    robot = [(k, 0) for k in range(9)]
    made = trace_of(scene, robot, outcome=Outcome.ARRIVED, replans=1, path_switches=2)
    assert trace_metrics(made, known_of(scene))["path_switches_per_100"] == 25.0
    assert trace_metrics(replace(made, replans=0), known_of(scene))["path_switches_per_100"] == 25.0
    still = trace_of(scene, robot[:1], outcome=Outcome.TIMEOUT)
    assert trace_metrics(still, known_of(scene))["path_switches_per_100"] is None


def test_an_obstacle_counts_from_the_tick_it_appears() -> None:
    scene = Scene(Grid(np.zeros((5, 9), dtype=np.bool_)), (0, 0), (3, 0), moves="octile")
    made = trace_of(
        scene, [(0, 0), (1, 0), (2, 0), (3, 0)], [[(8, 4)] * 4, [(3, 1), (4, 1)]], outcome=Outcome.ARRIVED,
        appears=(0, 2),
    )  # fmt: skip
    assert near_by_tick(made)[2:] == pytest.approx([SQRT2 - 1, SQRT2 - 1])
    assert near_by_tick(made)[0] == pytest.approx(math.sqrt(80) - 1)


def test_published_lengths() -> None:
    grid = Grid(np.zeros((8, 8), dtype=np.bool_))
    scene = Scene(grid, (0, 0), (7, 3), moves="octile")
    plan = Plan(Status.NO_PATH, "hand")
    best = 4 + 3 * SQRT2

    def ok(published: float | None, scene: Scene = scene) -> Any:
        return plan_metrics(plan, scene, known_of(scene), None, published)["reference_ok"]

    assert ok(None) is None
    assert ok(best) is True
    assert ok(round(best, 3)) is True
    assert ok(best + 0.006) is False
    assert ok(8.0) is False
    assert ok(best, replace(scene, moves="dissertation")) is None
    assert ok(best, replace(scene, robot=Robot(radius=0.2))) is None
    shut = np.zeros((8, 8), dtype=np.bool_)
    shut[:, 4] = True
    assert ok(best, replace(scene, grid=Grid(shut))) is False
    assert slack(100.25) == pytest.approx(0.005)
    assert slack(1234567.0) == pytest.approx(12.34567)


def test_a_drive_by_hand() -> None:
    """Two metres straight, from rest to rest in 4 s; somebody passes twice, and one comes late."""
    grid = Grid(np.zeros((20, 30), dtype=np.bool_), resolution=1.0)
    scene = Scene(grid, (0, 0), (2, 0), moves="octile", robot=Robot(radius=0.25, a_max=0.5, d_max=0.5))
    line = Curve([(0, 0)], [(1, 0)], [2.0], [0.0], (2, 0), 1.0)  # type: ignore[arg-type]
    passing = Track(
        np.array([0.0, 1.0, 2.0, 3.0, 4.0]), np.array([(0, 9), (0, 1), (0, 9), (2, 1.2), (2, 9)]), 0.5, 100.0
    )
    late = Track(np.array([3.9, 4.0]), np.array([(2, 1.0), (2, 1.0)]), 0.5, 1.0)
    drive = Drive(
        scene, "hand", "physical", 0, Outcome.ARRIVED, (line,), np.array([0.0, 2.0, 4.0]),
        np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 0.0]), np.array([0.5, -0.5, 0.0]), np.zeros(3, int),
        ("acceleration", "braking", "goal"), np.full(3, -1), (passing, late), (WALKER, WALKER),
        (Moment(3.0, "hit", (0.0, 0.0)),), 0.1, replans=2, expansions=7,
    )  # fmt: skip
    found = drive_metrics(drive, known_of(scene))
    assert tuple(found) == METRICS
    assert (found["time_s"], found["length_m"], found["length_cells"]) == (4.0, 2.0, 2.0)
    assert (found["speed_mean"], found["speed_least"], found["waits"]) == (0.5, 1.0, 0.0)
    assert (found["hits"], found["replans"], found["expansions"]) == (1, 2, 7)
    assert (found["turns"], found["turn_deg"], found["smoothness"]) == (0, 0.0, 1.0)
    # At 1 s the robot is at 0.25 m, the passer at (0, 1); at 3 s at 1.75 m, the passer at (2, 1.2).
    assert found["near_m"] == pytest.approx(0.25, abs=1e-9)
    assert found["near_misses"] == 3
    for name in ("cost", "gap", "cost_to_go", "ticks", "path_switches", "iterations"):
        assert found[name] is None
    held = replace(
        drive, t=np.array([0.0, 2.0, 4.0, 9.0]), s=np.array([0.0, 1.0, 2.0, 2.0]), leg=np.zeros(4, int),
        v=np.array([0.0, 1.0, 0.0, 0.0]), a=np.array([0.5, -0.5, 0.0, 0.0]), cause_index=np.full(4, -1),
        cause=("acceleration", "braking", "wait", "goal"), outcome=Outcome.BLOCKED,
    )  # fmt: skip
    found = drive_metrics(held, known_of(scene))
    assert (found["waits"], found["time_s"], found["length_m"]) == (5.0, None, None)


def test_turning_of_a_drive() -> None:
    """A metre, a quarter circle of a metre's radius, a metre, a turn on the spot of 90 degrees, a metre."""
    grid = Grid(np.zeros((9, 9), dtype=np.bool_))
    scene = Scene(grid, (0, 0), (3, 2), moves="octile")
    quarter = math.pi / 2
    one = Curve([(0, 0), (1, 0), (2, 1)], [(1, 0), (1, 0), (0, 1)], [1, quarter, 1], [0, 1, 0], (2, 2), 1.0)  # type: ignore[arg-type]
    two = Curve([(2, 2)], [(1, 0)], [1.0], [0.0], (3, 2), 1.0)  # type: ignore[arg-type]
    ds = [2 + quarter, 1.0]
    t = [0.0, ds[0], ds[0] + ds[1]]
    drive = Drive(
        scene, "hand", "physical", 0, Outcome.ARRIVED, (one, two), np.array(t), np.array([0.0, 0.0, 1.0]),
        np.array([1.0, 1.0, 0.0]), np.zeros(3), np.array([0, 1, 1]), ("limit", "limit", "goal"),
        np.full(3, -1), (), (), (), 0.1,
    )  # fmt: skip
    found = drive_metrics(drive, known_of(scene))
    assert found["length_m"] == pytest.approx(3 + quarter)
    assert (found["turns"], found["turn_deg"]) == (2, pytest.approx(180.0))
    assert found["smoothness"] == pytest.approx(1 / (1 + math.pi / (3 + quarter)))
    assert (found["near_m"], found["near_misses"]) == (None, 0)


@pytest.mark.parametrize("run", ["plan", "simulate", "drive"])
def test_who_never_starts_has_only_an_outcome(run: str) -> None:
    shut = np.zeros((4, 4), dtype=np.bool_)
    shut[:, 2] = True
    scene = Scene(Grid(shut), (0, 0), (3, 3), moves="octile")
    made = getattr(lampyris, run)(scene, "astar")
    if run == "plan":
        found = plan_metrics(made, scene, known_of(scene))
    else:
        found = (trace_metrics if run == "simulate" else drive_metrics)(made, known_of(scene))
    assert (found["outcome"], found["found"], found["arrived"]) == ("no-path", False, False)
    for name in ("optimal", "gap", "cost", "length_m", "near_m", "speed_mean", "turns", "clearance_mean_m"):
        assert found[name] is None


# ---- the reference --------------------


def twin(trace: Trace) -> dict[str, Any]:
    """The same numbers by loops over cells, from the definitions alone."""
    scene, res = trace.scene, trace.scene.grid.resolution
    walls = [(x, y) for y, row in enumerate(scene.grid.blocked.tolist()) for x, b in enumerate(row) if b]

    def room(x: int, y: int) -> float:
        return (
            res * min(math.hypot(max(abs(x - a) - 0.5, 0), max(abs(y - b) - 0.5, 0)) for a, b in walls)
            - scene.robot.radius
        )

    near, misses = math.inf, 0
    for tick in range(trace.ticks + 1):
        least = math.inf
        x, y = trace.robot[tick].tolist()
        for track, t0, body in zip(trace.tracks, trace.appears, trace.obstacle_specs, strict=True):
            if t0 <= tick:
                a, b = track[tick - t0].tolist()
                rims = max(scene.robot.radius, res / 2) + max(body.radius, res / 2)
                least = min(least, max(res * math.hypot(x - a, y - b) - rims, 0.0))
        misses += least < res - 1e-9
        near = min(near, least)
    cells = [trace.robot[0].tolist()]
    for cell in trace.robot.tolist():
        if cell != cells[-1]:
            cells.append(cell)
    steps = [(b[0] - a[0], b[1] - a[1]) for a, b in itertools.pairwise(cells)]
    angle = [math.atan2(dy, dx) for dx, dy in steps]
    turn = [abs((b - a + math.pi) % (2 * math.pi) - math.pi) for a, b in itertools.pairwise(angle)]
    length = sum(math.hypot(dx, dy) for dx, dy in steps)
    moving = [v for v in trace.speed.tolist() if v > 0]
    rooms = [room(x, y) for x, y in cells]
    return {
        "near_m": near, "near_misses": misses, "length_cells": length, "length_m": length * res,
        "turns": sum(t > 1e-9 for t in turn), "turn_deg": math.degrees(sum(turn)),
        "smoothness": 1 / (1 + sum(turn) / length), "clearance_mean_m": sum(rooms) / len(rooms),
        "clearance_least_m": min(rooms), "speed_mean": sum(moving) / len(moving), "speed_least": min(moving),
        "ticks": trace.ticks,
    }  # fmt: skip


@pytest.mark.commit(1)
@pytest.mark.parametrize("law", ["physical", "dissertation"])
@pytest.mark.parametrize("seed", [0, 1, 2, 3, 4, 7])
def test_measures_are_the_twins(law: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    radius = (0.0, 0.3)[seed % 2]
    blocked = rng.random((18, 22)) < (0.03 if radius else 0.1)
    blocked[:3, :3] = blocked[-3:, -3:] = False
    blocked[9, 9] = True
    patrol = Patrol(((1, 17), (6, 17))) if not blocked[17, 1:7].any() else RandomWalk(1)
    scene = Scene(
        Grid(blocked, resolution=0.4), (1, 1), (20, 16), moves=("octile", "dissertation")[seed // 2 % 2],  # type: ignore[arg-type]
        robot=Robot(radius=radius), traffic=(RandomWalk(6), RandomWalk(4, 0.3), Crossing(2), patrol),
    )  # fmt: skip
    seen = 0
    for who in ("ad-gso", "astar"):
        for run in range(3):
            made = lampyris.simulate(scene, who, seed=10 * seed + run, law=law)
            found = trace_metrics(made, known_of(scene))
            for name, value in twin(made).items() if made.arrived else ():
                assert found[name] == pytest.approx(value, abs=1e-9), name
                seen += 1
    assert seen > 0


@pytest.mark.parametrize("who", ["ad-gso", "astar", "theta-star", "gso"])
def test_a_plan_measures_what_assess_says(who: str) -> None:
    """Optimum, gap and the sum of cost-to-go are those that the front door tells of the same plan."""
    grid = lampyris.load_grid("env-2")
    for moves in ("octile", "dissertation", "four-connected"):
        scene = Scene(grid, (24, 24), (35, 38), moves=moves)  # type: ignore[arg-type]
        made = lampyris.plan(scene, who)
        found = plan_metrics(made, scene, known_of(scene))
        assert found["optimal"] == pytest.approx(made.optimal_cost)
        assert found["gap"] == pytest.approx(made.gap)
        assert found["cost_to_go"] == pytest.approx(made.sum_cost_to_go)
