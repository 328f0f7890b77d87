"""The planners lattice and pad on all maps of Moving AI Lab: which queries they solve, how fast, at which bound."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from benchmarks.about import versions
from benchmarks.bench_poses import RESOLUTION, ROBOTS
from benchmarks.figures import Figure, Section, Spread, Table, Verdict
from benchmarks.limits import EXPANDED, IN_PLANNING, NEEDED, PER_MOTION
from benchmarks.maps import published_maps

from lampyris.kernels._jit import compiled_only
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan, Status
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning.lattice.lattice_planner import LatticePlanner
from lampyris.planning.lattice.pad.pad_planner import PadPlanner
from lampyris.planning.lattice.primitives import angles
from lampyris.referee import check_plan

TITLE = "Poses by map"
HOW = """Random pairs of free poses on every map at hand, cells of 0.125 m: a cell of a map of at most 130 cells a side is
laid out as 4 x 4 of these, one of at most 260 as 2 x 2, and of maps of more than 600 cells every second one is taken, so
that doors are as wide as a robot. *solved*: of the pairs that a search with weight 1 joins, those that every
other search joins; the others must find none. Milliseconds of this thread's processor time, medians over those that are
joined. *first*: a query on an open session, with the field of the goal, the search, and the shortcuts. *search*: the
same query again without shortcuts, whose field is there. *bound*: the greatest that is stated; every path, its bound
included, is checked by the referee, and no bound is below cost / optimal cost."""

WEIGHTS = (1.6, 1.09)
ASKED_MS = {1.6: 2.0, 1.09: 60.0}
SHARE = 0.2
"""Of the states that `lattice` expands `pad` shall expand at most so many."""


@dataclass(frozen=True, slots=True)
class Query:
    """Milliseconds, the bound and the expansions of one query; of `pad` how many of them are of its planning phases, and how
    many motions its path has."""

    first: float
    search: float
    bound: float
    expansions: int
    planned: int
    motions: int


def grids(quick: bool) -> Iterator[tuple[str, Grid]]:
    """The maps, smallest first."""
    for name, free in published_maps()[: 2 if quick else None]:
        side = max(free.shape)
        if side > 600:
            free = free[::2, ::2]
        times = 4 if side <= 130 else 2 if side <= 260 else 1
        yield name, Grid(np.kron(~free, np.ones((times, times), dtype=bool)), resolution=RESOLUTION)


def scenes(grid: Grid, robot: Robot, count: int) -> list[Scene]:
    """Pairs of poses of the lattice at which the robot stands free, whether a path joins them or not."""
    rng = np.random.default_rng([grid.width, int(grid.blocked.sum()), 1])
    ys, xs = np.nonzero(~grid.blocked)
    corner = (*grid.to_metres((int(xs[0]), int(ys[0]))).tolist(), 0.0)
    lattice_map = (
        LatticePlanner().open(Scene(grid, start_pose=corner, goal_pose=corner, robot=robot), rng).lattice_map
    )
    poses: list[tuple[float, float, float]] = []
    for _ in range(2000 * count):
        k, heading = int(rng.integers(len(xs))), int(rng.integers(16))
        cell = (int(xs[k]), int(ys[k]))
        if lattice_map.is_free(cell, heading):
            x, y = grid.to_metres(cell).tolist()
            poses.append((x, y, math.remainder(angles(16)[heading], 2 * math.pi)))
        if len(poses) == 2 * count:
            break
    ends = zip(poses[::2], poses[1::2], strict=False)
    return [Scene(grid, start_pose=a, goal_pose=b, robot=robot) for a, b in ends]


def optimal_cost(scene: Scene) -> float | None:
    """Metres of the cheapest path of the lattice; None: there is none."""
    found = LatticePlanner(weight=1.0, shortcut=False).open(scene, np.random.default_rng(0)).plan()
    assert found.status in (Status.FOUND, Status.NO_PATH)
    return None if found.pose_path is None else found.pose_path.cost_m


def asked(planner: LatticePlanner | PadPlanner, scene: Scene, optimum: float | None) -> Query | None:
    """One query, refereed; None: it found no path."""
    session = planner.open(scene, np.random.default_rng(0))
    session._search = session._search_among(frozenset())
    spent = []
    plan = None
    for again in range(2):
        if again:
            session._shortcut = False
        begin = time.thread_time_ns()
        found = session.plan()
        spent.append((time.thread_time_ns() - begin) / 1e6)
        plan = found if plan is None else plan
    assert plan is not None
    if plan.pose_path is None:
        assert plan.status is Status.NO_PATH
        return None
    assert check_plan(plan, scene) is None
    path = plan.pose_path
    assert path.bound <= planner.weight * (1 + 1e-9)
    if optimum is not None:
        assert path.cost_m <= path.bound * optimum * (1 + 1e-9)
    return Query(spent[0], spent[1], path.bound, plan.expansions, planned(plan), motions(plan))


def planned(plan: Plan) -> int:
    """Expansions of the planning phases of `pad`; 0 of another planner."""
    return sum(one.low_expansions + one.high_expansions for one in plan.rounds)


def motions(plan: Plan) -> int:
    """How many motions a path of `pad` has before shortcuts; 0 of another planner."""
    if not plan.rounds:
        return 0
    return (
        len(next((one.tracked for one in reversed(plan.rounds) if one.tracked), plan.rounds[-1].planned)) - 1
    )


def bench(quick: bool) -> Section:
    """Both planners, all robots, maps and weights."""
    count = 3 if quick else 10
    rows = []
    middles: dict[tuple[str, float], list[float]] = {}
    expanded: dict[tuple[str, float], dict[str, list[float]]] = {}
    least: dict[tuple[str, float], list[float]] = {}
    proved: dict[tuple[str, float], list[float]] = {}
    unlike = 0
    with compiled_only():
        for name, grid in grids(quick):
            for who, robot in ROBOTS.items():
                pairs = scenes(grid, robot, count)
                best = [optimal_cost(scene) for scene in pairs]
                joined = sum(cost is not None for cost in best)
                for planner in ("lattice", "pad"):
                    for weight in WEIGHTS:
                        one = (
                            LatticePlanner(weight=weight)
                            if planner == "lattice"
                            else PadPlanner(weight=weight)
                        )
                        got = [asked(one, scene, cost) for scene, cost in zip(pairs, best, strict=True)]
                        solved = sum(q is not None and c is not None for q, c in zip(got, best, strict=True))
                        unlike += sum((q is None) != (c is None) for q, c in zip(got, best, strict=True))
                        known = [q for q in got if q is not None]
                        if known:
                            first, search, expansions = (
                                statistics.median(getattr(q, what) for q in known)
                                for what in ("first", "search", "expansions")
                            )
                            both = expanded.setdefault((who, weight), {"lattice": [], "pad": []})
                            both[planner].append(expansions)
                            if planner == "pad":
                                moved = statistics.median(q.motions for q in known)
                                least.setdefault((who, weight), []).append(moved)
                                proof = statistics.median(q.planned for q in known)
                                proved.setdefault((who, weight), []).append(proof)
                            if planner == "lattice":
                                middles.setdefault((who, weight), []).append(search)
                            numbers = (
                                f"{first:.1f}", f"{search:.1f}", f"{expansions:.0f}",
                                f"{max(q.bound for q in known):.3f}",
                            )  # fmt: skip
                        else:
                            numbers = ("", "", "", "")
                        rows.append((
                            name, f"{grid.width} x {grid.height}", who, planner, f"{weight:g}",
                            f"{solved} of {joined}", *numbers,
                        ))  # fmt: skip
                        print(rows[-1], flush=True)
    heads = (
        "map",
        "cells",
        "robot",
        "planner",
        "weight",
        "solved",
        "first ms",
        "search ms",
        "expansions",
        "bound",
    )
    verdicts = [
        Verdict(
            unlike == 0,
            f"Every search joins the pairs that a search with weight 1 joins, and no others: {unlike} differ",
        )
    ]
    for (who, weight), of in middles.items():
        most = ASKED_MS[weight]
        within = sum(ms <= most for ms in of)
        verdicts.append(
            Verdict(
                statistics.median(of) <= most,
                f"{who}: median search of lattice at weight {weight:g} at most {most:g} ms: {statistics.median(of):.2f} in "
                f"the median of {len(of)} maps, {within} of them within it",
            )
        )
    figures = []
    for (who, weight), both in expanded.items():
        needed = [
            moved / max(full, 1.0) for full, moved in zip(both["lattice"], least[who, weight], strict=True)
        ]
        shares = [pad / max(full, 1.0) for full, pad in zip(both["lattice"], both["pad"], strict=True)]
        middle = statistics.median(shares)
        times = [pad / max(moved, 1.0) for pad, moved in zip(both["pad"], least[who, weight], strict=True)]
        proofs = [
            one / max(full, 1.0) for full, one in zip(both["lattice"], proved[who, weight], strict=True)
        ]
        task = f"{who}, weight {weight:g}"
        figures += [
            Figure(f"{task}, {what}", unit, Spread.of(values))
            for what, unit, values in (
                (EXPANDED, "of those of lattice", shares),
                (NEEDED, "of the expansions of lattice", needed),
                (PER_MOTION, "a motion", times),
                (IN_PLANNING, "of the expansions of lattice", proofs),
            )
        ]
        verdicts.append(
            Verdict(
                middle <= SHARE,
                f"{who}: expansions of pad at weight {weight:g} at most {SHARE:g} of those of lattice, its first try included: "
                f"{middle:.2f} in the median of {len(shares)} maps, {sum(share <= SHARE for share in shares)} of them within it",
            )
        )
    return Section(
        "pose_maps", TITLE, HOW, (Table(heads, tuple(rows), "Ten pairs each"),), tuple(figures), tuple(verdicts),
        versions(("numpy", "numba")),
    )  # fmt: skip
