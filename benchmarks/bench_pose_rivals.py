"""Planners of poses compared with OMPL and pathplanning: time with failures counted at the limit, and length."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from benchmarks.about import versions
from benchmarks.bench_poses import RESOLUTION, pairs
from benchmarks.figures import Figure, Section, Spread, Table, judge
from benchmarks.limits import PLAIN
from benchmarks.maps import maze, published_map, rooms
from benchmarks.pose_rivals import (
    LENGTH,
    RADIUS,
    TOLERANCE,
    WIDTH,
    YAW_TOLERANCE,
    Ompl,
    Pathplanning,
    Pose,
    Taken,
)

from lampyris.kernels._jit import compiled_only
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning import registry
from lampyris.planning.base import Budget
from lampyris.referee import check_plan

TITLE = "Poses compared with OMPL and pathplanning"
ASKED = 50.0
"""How many times quicker ours shall be on rooms and mazes."""
LONGER = 1.03
"""How much longer than AORRTC's a path of ours may be."""
LIMIT_S = 10.0
HOW = f"""A car, {LENGTH} x {WIDTH} m, turning radius {RADIUS} m, cells of {RESOLUTION} m, random pairs of poses joined by a path.
A cell of a published map is as many cells of ours as make its doors wider than the car: 8 a side of room-64-64-8, 4 of
maze-128-128-10 and den312d, 1 of maze512-32-0.
Each call is timed in processor time of its thread; what depends on the map alone is made before, each planner plans once
before (ours as many other queries, so that all machine code is loaded), and a query without an answer counts as
the limit, {LIMIT_S:g} s. Ours: `session.plan()` of
an open session, the heuristic of the goal and the shortcuts included, each answer checked by the referee. OMPL:
`SimpleSetup.solve` in its space of Reeds-Shepp
curves, one run without a seed; its callback is Python, a lookup in a map of free poses (72 yaws, the base in the middle of a
cell), and part of its time. pathplanning: its Hybrid A*, cells of 0.25 m, weight 1.5; it may end {TOLERANCE} m and
{YAW_TOLERANCE} rad from the goal, and where it is compared with ours, ours may too, with shortcuts and without (it makes
none). Paths of the rivals are not checked by
our referee. AORRTC runs to its limit of 1.3 s."""

AORRTC_S = 1.3
CAR = Robot(
    footprint=tuple((x * LENGTH / 2, y * WIDTH / 2) for x, y in ((1, 1), (-1, 1), (-1, -1), (1, -1))),
    drive="ackermann", turn_radius=RADIUS,
)  # fmt: skip
OURS: dict[str, tuple[str, dict[str, Any]]] = {
    "lattice, weight 1.5": ("lattice", {"weight": 1.5}),
    "lattice, weight 1.5, tolerance": (
        "lattice", {"weight": 1.5, "goal_tolerance": TOLERANCE, "goal_yaw_tolerance": YAW_TOLERANCE},
    ),
    PLAIN: (
        "lattice",
        {"weight": 1.5, "goal_tolerance": TOLERANCE, "goal_yaw_tolerance": YAW_TOLERANCE, "shortcut": False},
    ),
    "lattice, weight 1.08": ("lattice", {"weight": 1.08}),
    "hybrid-astar": ("hybrid-astar", {}),
}  # fmt: skip


PUBLISHED = (("room-64-64-8", 8), ("maze-128-128-10", 4), ("maze512-32-0", 1), ("den312d", 4))
"""Maps of Moving AI Lab, and how many cells of ours a cell of each has a side, so that doors are wider than the robot.
The last is a cave of a game, for comparison."""


def grids(quick: bool) -> Iterator[tuple[str, Grid]]:
    """Rooms and mazes: generated ones, and published ones if they are at hand."""
    yield "rooms", Grid(np.kron(~rooms(65, 15), np.ones((8, 8), dtype=bool)), resolution=RESOLUTION)
    yield "maze", Grid(np.kron(~maze(33, 1 / 3), np.ones((12, 12), dtype=bool)), resolution=RESOLUTION)
    for name, side in () if quick else PUBLISHED:
        free = published_map(name)
        if free is not None:
            yield name, Grid(np.kron(~free, np.ones((side, side), dtype=bool)), resolution=RESOLUTION)


def ours(name: str, settings: dict[str, Any], limit: float) -> Callable[[Scene], tuple[Taken, int]]:
    """A planner of ours on a scene: what it took, and its expansions."""

    def run(scene: Scene) -> tuple[Taken, int]:
        session = registry.make(name, settings).open(scene, np.random.default_rng(0))
        session._search = session._search_among(frozenset())  # type: ignore[attr-defined]
        begin = time.thread_time_ns()
        plan = session.plan(None, Budget(seconds=limit))
        spent = (time.thread_time_ns() - begin) / 1e9
        if not plan:
            return Taken(max(spent, limit), None), plan.expansions
        assert check_plan(plan, scene) is None
        assert plan.pose_path is not None
        return Taken(spent, plan.pose_path.length_m), plan.expansions

    return run


def rivals(grid: Grid, limit: float) -> dict[str, Callable[[Pose, Pose], Taken]]:
    """The others, prepared for a map."""
    walls = np.asarray(grid.blocked)
    return {
        "OMPL RRTConnect": Ompl("RRTConnect", walls, RESOLUTION, limit),
        "pathplanning Hybrid A*": Pathplanning(walls, RESOLUTION, limit),
        "OMPL AORRTC": Ompl("AORRTC", walls, RESOLUTION, AORRTC_S),
    }


AGAINST = (
    ("lattice, weight 1.5", "OMPL RRTConnect"),
    ("lattice, weight 1.5, tolerance", "pathplanning Hybrid A*"),
    ("hybrid-astar", "OMPL RRTConnect"),
    (PLAIN, "pathplanning Hybrid A*"),
)
"""Whose times are compared: the same tolerance at the goal. Nothing is claimed of the last: it says what shortcuts take."""


def bench(quick: bool) -> Section:
    """Every planner on every map; ratios of mean times, and of lengths compared with AORRTC."""
    count, limit = (2, 2.0) if quick else (10, LIMIT_S)
    rows: list[tuple[str, ...]] = []
    figures, lengths = [], []
    with compiled_only():
        for name, grid in grids(quick):
            drawn = pairs(grid, CAR, 2 * count)
            scenes, spare = drawn[:count], drawn[count:] or drawn
            if not drawn:
                continue
            got: dict[str, list[Taken]] = {}
            rates: list[float] = []
            for who, (planner, settings) in OURS.items():
                run = ours(planner, settings, limit)
                for scene in spare:
                    run(scene)  # machine code of all that it comes to is loaded, tables of the robot are made
                each = [run(scene) for scene in scenes]
                got[who] = [taken for taken, _ in each]
                if who == "lattice, weight 1.08":
                    rates = [expansions / 1e3 / taken.seconds for taken, expansions in each if taken.length]
            for who, rival in rivals(grid, limit).items():
                rival(_pose(scenes[0].start_pose), _pose(scenes[0].goal_pose))
                got[who] = [rival(_pose(s.start_pose), _pose(s.goal_pose)) for s in scenes]
            for who, taken in got.items():
                found = [one for one in taken if one.length is not None]
                rows.append((
                    name, who, f"{len(found)} of {len(taken)}", _ms(statistics.fmean(t.seconds for t in taken)),
                    _ms(statistics.median(t.seconds for t in taken)),
                    f"{statistics.fmean(t.length or 0.0 for t in found):.1f}" if found else "",
                ))  # fmt: skip
                print(rows[-1], flush=True)
            for mine, theirs in AGAINST:
                mean = [
                    Spread.of([1e3 * statistics.fmean(t.seconds for t in got[one])]) for one in (mine, theirs)
                ]
                asked = None if name == PUBLISHED[-1][0] or mine == PLAIN else ASKED
                figures.append(Figure(f"{name}, {mine}", "ms, mean", mean[0], theirs, mean[1], asked=asked))
            figures.append(
                Figure(
                    f"{name}, expansions of lattice at weight 1.08",
                    "a ms",
                    Spread.of(rates),
                    more_is_better=True,
                )
            )
            both = [
                (mine.length, theirs.length)
                for mine, theirs in zip(got["lattice, weight 1.08"], got["OMPL AORRTC"], strict=True)
                if mine.length is not None and theirs.length is not None
            ]
            if both:
                mean = [Spread.of([statistics.fmean(one)]) for one in zip(*both, strict=True)]
                lengths.append(Figure(
                    f"{name}, length of lattice at weight 1.08", "m, mean of pairs that both solve", mean[0],
                    "OMPL AORRTC", mean[1], asked=1 / LONGER,
                ))  # fmt: skip
    heads = ("map", "planner", "solved", "mean ms", "median ms", "mean length, m")
    timed = [one for one in figures if one.asked]
    verdicts = [judge("Mean time of a query", timed)]
    if lengths:  # else no pair was solved by both
        verdicts.append(judge("Length compared with AORRTC's, ours at most 3 % longer", lengths))
    return Section(
        "pose-rivals", TITLE, HOW, (Table(heads, tuple(rows)),), (*figures, *lengths), tuple(verdicts),
        versions(("numpy", "numba", "ompl", "pathplanning")),
    )  # fmt: skip


def _pose(pose: Any) -> Pose:
    x, y, yaw = (float(v) for v in pose)
    return x, y, yaw


def _ms(seconds: float) -> str:
    return f"{1e3 * seconds:.2f}" if seconds < 0.1 else f"{1e3 * seconds:.0f}"
