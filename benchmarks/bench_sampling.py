"""Planners that sample compared with OMPL: RRT-Connect for discs and for footprints, and lengths compared with AORRTC."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any
from unittest import mock

import numpy as np
from benchmarks.about import versions
from benchmarks.bench_pose_rivals import CAR, RESOLUTION
from benchmarks.bench_poses import pairs
from benchmarks.figures import Figure, Section, Spread, Table, Verdict, judge
from benchmarks.limits import A_CALL, EXPANSIONS
from benchmarks.maps import published_map, rooms
from benchmarks.pose_rivals import Ompl, Pose, Taken
from benchmarks.sampling_rivals import PARTS, ExactLines, OmplPlane, room_for

from lampyris.kernels._jit import compiled_only
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning import registry
from lampyris.planning.base import Budget
from lampyris.planning.field.layers import free_space, largest_region
from lampyris.referee import check_plan

TITLE = "Sampling planners compared with OMPL"
CHECKED = 0.5
"""Cells between two points of a line that OMPL's RRTConnect looks at."""
PAIRS, FIRST = 12, 3
"""Queries a map, of which planners that improve a path until their limit answer only the first."""
TIMES = 2
"""How often RRT-Connect answers each query, with new draws."""
LIMIT_S = 1.0
"""Limit of a planner that ends with its first path, and what one without an answer counts as."""
HOW = f"""Random pairs of cells (points, and discs of radius 0.3 m with cells of 0.25 m) and of poses (a car of 1.2 x 0.5 m,
radius 1.25 m, cells of {RESOLUTION} m). RRT-Connect, ours and OMPL's, answers {PAIRS} queries a map, {TIMES} times each with new
draws, all others the first {FIRST} of them once. Each call is timed in processor time of its thread; what depends on the
map alone is made before, each planner plans once before, and a query without an answer counts as the limit of {LIMIT_S:.0f}
s. Ours: `session.plan()` of an open session with seeds 0, 1, ..., each answer checked by the referee; `rrt-connect` without
shortcuts, as OMPL's `solve` makes none, and by default. `bit-star`, seeded, turns where AORRTC does, anywhere. OMPL:
`SimpleSetup.solve`, its callbacks Python and part of its time. RRTConnect looks up each {CHECKED} cells of a line in a map of
the squares of 1/{PARTS} cell where the disc has room, planners of poses in a map of free poses. AORRTC in the plane asks
compiled code whether a state or a whole line is free, which is exact, for points and discs alike, and each of its calls has a
process of its own: 2.0.1 now and then ends the process, which counts as no answer. Limits are of processor time: for
AORRTC 1.3 s, for our planners that improve a path 50 ms of all threads, and 1.3 s for comparison. OMPL asks Python for it
at each sample. Lengths are compared where both have a path: one of AORRTC's counts if it is no shorter than the straight
line (for ends that see each other it states 0) and free of walls: all its lines, exactly; of RRTConnect's every 1/16 cell
(of a footprint's path every 1/8 cell, and every 1/8 cell of the footprint). `pose-rrt-star` prices a metre in reverse as one
ahead, as AORRTC does."""

ASKED = 10.0
"""How many times faster RRT-Connect shall be in the median."""
AORRTC_S, OURS_S = 1.3, 0.05
DISC, POINT = Robot(radius=0.3), Robot()
MAPS = {
    "arena2": (DISC, POINT), "Berlin_0_256": (DISC, POINT), "AR0011SR": (DISC, POINT), "ht_0_hightown": (DISC, POINT),
    "maze512-32-0": (DISC, POINT), "random512-10-0": (POINT,), "16room_000": (POINT,),
}  # fmt: skip
SHORTEST = {"seeded": True, "turns": "anywhere", "samples": 1_000_000}
"""Settings of the planner whose lengths are compared with AORRTC's, which turns anywhere, too."""
SEEDED, SEEDED_POSES = "bit-star, seeded, turns anywhere, 50 ms", "pose-rrt-star, seeded, 50 ms"
AS_LONG, AS_LONG_POSES = "bit-star, seeded, turns anywhere, 1.3 s", "pose-rrt-star, seeded, 1.3 s"
"""The same within AORRTC's limit: what the shorter one does to lengths."""
POSE_MAPS = ("arena2", "den312d")
DECIMALS = 9
"""Of lengths that are compared: one curve that both find, summed in another order, is as long."""
AGAIN = 15
"""Calls with next to nothing to search."""
FIRST_PATH = ("rrt-connect, no shortcuts", "OMPL RRTConnect")
"""Whose time is compared."""
Run = Callable[[Scene, int, int], list[Taken]]
"""Asks a planner: scene, seed, how many times."""


def cell_scenes(name: str, robot: Robot, count: int) -> list[Scene]:
    """Scenes with random ends in the largest region of a published map; none if it is not at hand."""
    free = published_map(name)
    if free is None:
        return []
    grid = Grid(~free, resolution=0.25)
    blank = Scene(grid, start=(0, 0), goal=(0, 0), robot=robot)
    cells = largest_region(free_space(blank))
    rng = np.random.default_rng([grid.width, int(grid.blocked.sum())])
    ends = [[(int(x), int(y)) for x, y in cells[rng.integers(len(cells), size=2)]] for _ in range(count)]
    return [replace(blank, start=a, goal=b) for a, b in ends]


def pose_scenes(quick: bool, count: int) -> Iterator[tuple[str, list[Scene]]]:
    """Pairs of poses: rooms, and published maps."""
    yield (
        "rooms",
        pairs(Grid(np.kron(~rooms(65, 15), np.ones((8, 8), dtype=bool)), resolution=RESOLUTION), CAR, count),
    )
    for name in POSE_MAPS[: 1 if quick else None]:
        free = published_map(name)
        if free is not None:
            yield name, pairs(Grid(~free, resolution=RESOLUTION), CAR, count)


def ours(name: str, settings: dict[str, Any], limit: float, *, timed: bool = False) -> Run:
    """A planner of ours on a scene with a seed, asked so many times in one session.

    Parameters
    ----------
    limit : seconds that a failure counts as, and if ``timed`` the budget, of processor time.
    """

    def run(scene: Scene, seed: int, times: int) -> list[Taken]:
        session = registry.make(name, settings).open(scene, np.random.default_rng(seed))
        if name.startswith("pose"):
            session._search = session._search_among(frozenset())  # type: ignore[attr-defined]
        else:
            session.plan(None, Budget(expansions=100))  # memory of the map is made
        # Checked afterwards: the referee would empty the processor's caches between two calls.
        answers = [asked(session) for _ in range(times)]
        return [checked(scene, *answer) for answer in answers]

    def asked(session: Any) -> tuple[float, Plan]:
        budget = Budget(seconds=limit) if timed else None
        with mock.patch.object(
            time, "perf_counter", time.process_time
        ):  # the budget's seconds are the processor's
            begin = time.thread_time_ns()
            plan = session.plan(None, budget)
        return (time.thread_time_ns() - begin) / 1e9, plan

    def checked(scene: Scene, spent: float, plan: Plan) -> Taken:
        if not plan or (spent > limit and not timed):
            return Taken(max(spent, limit), None)
        assert check_plan(plan, scene) is None
        length = plan.any_angle_length if plan.pose_path is None else plan.pose_path.length_m
        return Taken(spent, length, plan.expansions)

    return run


def beside(scene: Scene) -> Scene:
    """The same with the goal next to the start, or at it: what a call takes that has next to nothing to search."""
    if scene.start_pose is not None:
        return Scene(scene.grid, start_pose=scene.start_pose, goal_pose=scene.start_pose, robot=scene.robot)
    room = free_space(scene)
    x, y = scene.start
    near = ((x + dx, y + dy) for dx, dy in ((1, 0), (0, 1), (-1, 0), (0, -1)))
    for u, v in near:
        if 0 <= u < scene.grid.width and 0 <= v < scene.grid.height and room[v, u]:
            return replace(scene, goal=(u, v))
    return replace(scene, goal=scene.start)


def _asked(rival: OmplPlane | Ompl, *, apart: bool = False) -> Run:
    def run(scene: Scene, _: int, times: int) -> list[Taken]:
        if isinstance(rival, OmplPlane):
            ask = rival.apart if apart else rival
            return [ask(scene.start, scene.goal) for _ in range(times)]
        return [rival(_pose(scene.start_pose), _pose(scene.goal_pose)) for _ in range(times)]

    return run


def measured(
    name: str, scenes: list[Scene], everyone: dict[str, Run]
) -> Iterator[tuple[str, list[Taken], tuple[str, ...]]]:
    """What everyone took for each scene, and their rows of the table; printed as they come."""
    for who, run in everyone.items():
        some, times = (scenes, TIMES) if any(one in who for one in FIRST_PATH) else (scenes[:FIRST], 1)
        run(scenes[0], 0, 1)  # machine code is loaded
        taken = [one for seed, scene in enumerate(some) for one in run(scene, seed, times)]
        found = [one.length for one in taken if one.length is not None and getattr(one, "free", True)]
        solved_by = sum(one.length is not None for one in taken)
        times_ms = [1e3 * one.seconds for one in taken]
        row = (
            name, who, f"{solved_by} of {len(taken)}", f"{len(found)}", f"{statistics.median(times_ms):.2f}",
            f"{statistics.fmean(times_ms):.2f}", f"{statistics.fmean(found):.1f}" if found else "",
        )  # fmt: skip
        print(row, flush=True)
        yield who, taken, row


def verdicts(figures: list[Figure], fewer: list[str], lengths: list[Figure]) -> tuple[Verdict, ...]:
    """What was asked, judged: times of RRT-Connect, on how many it solves fewer than OMPL's, lengths."""
    middle = statistics.median(figure.ratio or 0.0 for figure in figures)
    judged = [
        Verdict(
            middle >= ASKED,
            f"Median time of RRT-Connect, in the median of {len(figures)} maps and robots: at least {ASKED:g} times as "
            f"good: {middle:.3g}",
        ),
        judge("The same on each", figures),
        Verdict(
            not fewer,
            f"RRT-Connect solves as many as OMPL's or more: on {len(figures) - len(fewer)} of {len(figures)}"
            + (f"; fewer: {', '.join(fewer)}" if fewer else ""),
        ),
    ]
    if lengths:
        judged.append(judge("Length compared with AORRTC's in 1.3 s", lengths))
    return tuple(judged)


def bench(quick: bool) -> Section:
    """Everyone on every map; ratios of median times, of lengths, and who solves how many."""
    count, limit = (6 if quick else PAIRS), LIMIT_S
    rows: list[tuple[str, ...]] = []
    figures: list[Figure] = []
    lengths: list[Figure] = []
    solved: list[Figure] = []
    others: list[Figure] = []
    fewer: list[str] = []
    connect = {
        "rrt-connect, no shortcuts": ours("rrt-connect", {"shortcut": False, "samples": 1_000_000}, limit),
        "rrt-connect": ours("rrt-connect", {}, limit),
        SEEDED: ours("bit-star", SHORTEST, OURS_S, timed=True),
        AS_LONG: ours("bit-star", SHORTEST, AORRTC_S, timed=True),
        "bit-star, 50 ms": ours("bit-star", {"samples": 1_000_000}, OURS_S, timed=True),
    }
    poses = {
        "lattice": ours("lattice", {}, limit),
        "pose-rrt-connect, no shortcuts": ours("pose-rrt-connect", {"shortcut": False}, limit),
        "pose-rrt-connect": ours("pose-rrt-connect", {}, limit),
        SEEDED_POSES: ours("pose-rrt-star", {"seeded": True, "rounds": 1_000_000}, OURS_S, timed=True),
        AS_LONG_POSES: ours("pose-rrt-star", {"seeded": True, "rounds": 1_000_000}, AORRTC_S, timed=True),
    }

    def told(
        name: str,
        scenes: list[Scene],
        everyone: dict[str, Run],
        names: tuple[str, str, str, str],
    ) -> None:
        first, best, as_long, unit = names
        got: dict[str, list[Taken]] = {}
        for who, taken, row in measured(name, scenes, everyone):
            got[who] = taken
            rows.append(row)
        times = [
            Spread.of([1e3 * statistics.median(t.seconds for t in got[who])])
            for who in (first, "OMPL RRTConnect")
        ]
        figures.append(
            Figure(f"{name}, {first}", "ms, median", times[0], "OMPL RRTConnect", times[1], asked=ASKED)
        )
        expanded = statistics.median(t.expansions for t in got[first])
        nothing = [t.seconds for t in everyone[first](beside(scenes[0]), 0, AGAIN)]
        others.append(Figure(f"{name}, {first}, {EXPANSIONS}", "median", Spread.of([float(expanded)])))
        others.append(
            Figure(f"{name}, {first}, {A_CALL}", "ms, median", Spread.of([1e3 * statistics.median(nothing)]))
        )
        many = [
            Spread.of([float(sum(t.length is not None for t in got[who]))])
            for who in (first, "OMPL RRTConnect")
        ]
        solved.append(
            Figure(f"{name}, solved by {first}", f"of {len(got[first])}", many[0], more_is_better=True)
        )
        if many[0].middle < many[1].middle:
            fewer.append(f"{name} ({many[0].middle:.0f} compared with {many[1].middle:.0f})")
        for who in (best, as_long):
            both = [
                (round(a.length, DECIMALS), round(b.length, DECIMALS))
                for a, b in zip(got[who], got["OMPL AORRTC"], strict=True)
                if a.length is not None and b.length is not None and getattr(b, "free", True)
            ]
            if both:
                mean = [Spread.of([statistics.fmean(one)]) for one in zip(*both, strict=True)]
                what = f"{unit}, mean of {len(both)} pairs that both solve"
                asked, into = (1.0, lengths) if who == best else (None, others)
                into.append(
                    Figure(f"{name}, length of {who}", what, mean[0], "OMPL AORRTC", mean[1], asked=asked)
                )

    with compiled_only():
        for name, robots in list(MAPS.items())[: 3 if quick else None]:
            for robot in robots:
                scenes = cell_scenes(name, robot, count)
                if scenes:
                    grid = scenes[0].grid
                    walls, radius = np.asarray(grid.blocked), robot.radius / grid.resolution
                    room = room_for(walls, radius)
                    rivals = {
                        "OMPL RRTConnect": _asked(OmplPlane("RRTConnect", room, limit, CHECKED)),
                        "OMPL AORRTC": _asked(
                            OmplPlane("AORRTC", room, AORRTC_S, CHECKED, ExactLines(walls, radius)),
                            apart=True,
                        ),
                    }
                    what = "disc" if robot.radius else "point"
                    told(
                        f"{name}, {what}",
                        scenes,
                        connect | rivals,
                        ("rrt-connect, no shortcuts", SEEDED, AS_LONG, "cells"),
                    )
        for name, scenes in pose_scenes(quick, count):
            if scenes:
                walls = np.asarray(scenes[0].grid.blocked)
                rivals = {
                    "OMPL RRTConnect": _asked(
                        Ompl("RRTConnect", walls, RESOLUTION, limit, of_processor=True)
                    ),
                    "OMPL AORRTC": _asked(Ompl("AORRTC", walls, RESOLUTION, AORRTC_S, of_processor=True)),
                }
                told(
                    f"{name}, footprint", scenes, poses | rivals,
                    ("pose-rrt-connect, no shortcuts", SEEDED_POSES, AS_LONG_POSES, "m"),
                )  # fmt: skip
    heads = ("map", "planner", "solved", "free of walls", "median ms", "mean ms", "mean length")
    return Section(
        "sampling", TITLE, HOW, (Table(heads, tuple(rows)),), (*figures, *solved, *lengths, *others),
        verdicts(figures, fewer, lengths),
        versions(("numpy", "numba", "ompl")),
    )  # fmt: skip


def _pose(pose: Any) -> Pose:
    x, y, yaw = (float(v) for v in pose)
    return x, y, yaw
