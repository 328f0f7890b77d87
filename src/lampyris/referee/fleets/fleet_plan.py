"""Judges plans of fleets: every robot's path and every pair of robots, from the map alone.

Distances are worked out a second time, by waves over the whole map as bits of Python integers; conflicts by sorting
numbers of tick and cells. Nothing is taken from planners or kernels.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from lampyris.model.fleet.fleet import Fleet
from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.model.grid import Grid
from lampyris.model.plan import Status
from lampyris.referee.verdict import Violation
from lampyris.typing import Cell, Cells

_ENTRIES = 4_000_000
"""Places of robots that are compared at once."""
_ALL = 4_000_000
"""Robots times cells up to which every shortest path is worked out again."""
_SOME = 64


def check_fleet_plan(
    plan: FleetPlan, fleet: Fleet, *, every: bool | None = None, factor: float | None = None
) -> Violation | None:
    """The first rule that a plan breaks, or None.

    Rules: ``paths`` (one for each robot), ``start``, ``outside``, ``wall``, ``step`` (to one of four neighbours, or
    none), ``goal``, ``arrival`` (the path ends at the tick of the last arrival, and no sooner), ``vertex`` (two robots in
    one cell), ``swap`` (two that change places), ``cost`` and ``makespan`` (as counted again), ``bound`` (the
    shortest paths as worked out again, and their sum), ``improvements`` (they fall, and end at the plan's cost). Of a
    plan that is not found the paths are judged as far as they go, except for goal and arrival; robots then stay at their
    last cells.

    Parameters
    ----------
    plan : judged.
    fleet : what it was planned for.
    factor : what the planner promises: a plan that is found costs at most so many times its lower bound.
    every : whether each robot's shortest path is worked out again; False: those of some 64, evenly spaced, and of all
        that they lie between the distance without walls and the robot's own path. None: each if robots times cells of
        the map are at most 4 million (some 5 ms a robot on 256 x 256 cells).
    """
    if not plan.paths and plan.status is not Status.FOUND:
        return _check_bound(plan, fleet, every)
    costs, bound = plan.sum_of_costs, plan.lower_bound
    if (
        factor is not None
        and costs is not None
        and bound is not None
        and costs > factor * bound * (1 + 1e-12)
    ):
        return Violation(
            "bound", "plan", f"costs {costs}, more than {factor:g} times the lower bound {bound}"
        )
    if len(plan.paths) != len(fleet.robots):
        return Violation("paths", "plan", f"{len(plan.paths)} paths for {len(fleet.robots)} robots")
    for k, path in enumerate(plan.paths):
        found = _check_path(k, path, fleet, whole=plan.status is Status.FOUND)
        if found is not None:
            return found
    found = _check_pairs(plan.paths, fleet.grid)
    if found is not None:
        return found
    return _check_costs(plan) or _check_bound(plan, fleet, every)


def _check_path(k: int, path: Cells, fleet: Fleet, *, whole: bool) -> Violation | None:
    robot, grid = fleet.robots[k], fleet.grid
    x, y = path[:, 0].astype(np.int64), path[:, 1].astype(np.int64)
    if (int(x[0]), int(y[0])) != robot.start:
        return Violation("start", f"robot {k}", f"begins at ({x[0]}, {y[0]}), not at its start {robot.start}")
    outside = (x < 0) | (x >= grid.width) | (y < 0) | (y >= grid.height)
    if outside.any():
        t = int(outside.argmax())
        return Violation("outside", f"robot {k}, tick {t}", f"({x[t]}, {y[t]}) is outside the map")
    walls = grid.blocked[y, x]
    if walls.any():
        t = int(walls.argmax())
        return Violation("wall", f"robot {k}, tick {t}", f"({x[t]}, {y[t]}) is blocked")
    length = np.abs(np.diff(x)) + np.abs(np.diff(y))
    if (length > 1).any():
        t = int((length > 1).argmax())
        return Violation(
            "step",
            f"robot {k}, tick {t + 1}",
            f"goes from ({x[t]}, {y[t]}) to ({x[t + 1]}, {y[t + 1]}) in a tick",
        )
    if not whole:
        return None
    last = (int(x[-1]), int(y[-1]))
    if last != robot.goal:
        return Violation("goal", f"robot {k}", f"ends at {last}, not at its goal {robot.goal}")
    if len(path) > 1 and (int(x[-2]), int(y[-2])) == last:
        return Violation("arrival", f"robot {k}", f"is on its goal before its last tick {len(path) - 1}")
    return None


def _check_pairs(paths: tuple[Cells, ...], grid: Grid) -> Violation | None:
    """No two robots in one cell, none that change places; the earliest conflict."""
    robots, last = len(paths), max(len(path) for path in paths) - 1
    each = max(1, _ENTRIES // robots)
    for begin in range(0, last + 1, each):
        end = min(last, begin + each)
        flat = np.empty((end - begin + 1, robots), dtype=np.int64)
        for k, path in enumerate(paths):
            ticks = np.minimum(np.arange(begin, end + 1), len(path) - 1)
            flat[:, k] = path[ticks, 1].astype(np.int64) * grid.width + path[ticks, 0]
        found = min(
            (one for one in (_first_vertex(flat, begin), _first_swap(flat, begin)) if one is not None),
            default=None,
        )
        if found is not None:
            tick, rule, one, other, cell = found
            y, x = divmod(cell, grid.width)
            words = {"vertex": f"both in ({x}, {y})", "swap": f"change places at ({x}, {y})"}[rule]
            return Violation(rule, f"robots {one} and {other}, tick {tick}", words)
        if end == last:
            break
    return None


_Conflict = tuple[int, str, int, int, int]


def _first_vertex(flat: NDArray[np.int64], begin: int) -> _Conflict | None:
    order = np.argsort(flat, axis=1, kind="stable")
    ranked = np.take_along_axis(flat, order, axis=1)
    twice = ranked[:, 1:] == ranked[:, :-1]
    if not twice.any():
        return None
    t = int(twice.any(axis=1).argmax())
    k = int(twice[t].argmax())
    one, other = sorted((int(order[t, k]), int(order[t, k + 1])))
    return begin + t, "vertex", one, other, int(ranked[t, k])


def _first_swap(flat: NDArray[np.int64], begin: int) -> _Conflict | None:
    """Two steps of a tick that are each other's reverse: of one pair of cells (a number of tick, first cell and whether it
    goes across or down) and from different ones."""
    old, new = flat[:-1], flat[1:]
    tick, robot = np.nonzero(old != new)
    if not len(tick):
        return None
    a, b = old[tick, robot], new[tick, robot]
    low, high = np.minimum(a, b), np.maximum(a, b)
    edge = (tick * int(flat.max() + 1) + low) * 2 + (high - low > 1)
    order = np.argsort(edge, kind="stable")
    ranked = edge[order]
    same = (ranked[1:] == ranked[:-1]) & (a[order][1:] != a[order][:-1])
    if not same.any():
        return None
    i = int(same.argmax())
    p, q = int(order[i]), int(order[i + 1])
    one, other = sorted((int(robot[p]), int(robot[q])))
    return begin + int(tick[p]) + 1, "swap", one, other, int(low[p])


def _check_costs(plan: FleetPlan) -> Violation | None:
    """The figures of the plan, counted again from its paths."""
    if plan.status is not Status.FOUND:
        if plan.sum_of_costs is not None or plan.makespan is not None:
            return Violation("cost", "plan", "has a cost although no plan was found")
        return None
    ends = [len(path) - 1 for path in plan.paths]
    if plan.sum_of_costs != sum(ends):
        return Violation("cost", "plan", f"sum of costs {plan.sum_of_costs}; counted: {sum(ends)}")
    if plan.makespan != max(ends):
        return Violation("makespan", "plan", f"makespan {plan.makespan}; counted: {max(ends)}")
    costs = [cost for _, cost in plan.improvements]
    if any(b >= a for a, b in pairwise(costs)) or (costs and costs[-1] != sum(ends)):
        return Violation("improvements", "plan", f"costs {costs[-3:]} do not fall to the plan's {sum(ends)}")
    return None


def _check_bound(plan: FleetPlan, fleet: Fleet, every: bool | None) -> Violation | None:
    """The shortest paths that the lower bound is the sum of, by distances of our own.

    Of a higher bound that a planner proved it is only seen that the plan does not cost less.
    """
    costs = plan.sum_of_costs
    if costs is not None and plan.bound is not None and plan.bound > costs:
        return Violation("bound", "plan", f"costs {costs}, but a lower bound of {plan.bound} is claimed")
    if plan.shortest is None:
        return None
    robots, cells = len(fleet.robots), fleet.grid.blocked.size
    if plan.shortest.shape != (robots,):
        return Violation("bound", "plan", f"{plan.shortest.shape} shortest lengths for {robots} robots")
    for k, (one, length) in enumerate(zip(fleet.robots, plan.shortest.tolist(), strict=True)):
        (x0, y0), (x1, y1) = one.start, one.goal
        most = len(plan.paths[k]) - 1 if plan.status is Status.FOUND else length
        if not abs(x1 - x0) + abs(y1 - y0) <= length <= most:
            return Violation("bound", f"robot {k}", f"{length} steps at least, but its path has {most}")
    if every is None:
        every = robots * cells <= _ALL
    chosen = range(robots) if every else range(0, robots, max(1, robots // _SOME))
    distances = _distances(fleet.grid, [(fleet.robots[k].start, fleet.robots[k].goal) for k in chosen])
    for k, distance in zip(chosen, distances, strict=True):
        if distance != plan.shortest[k]:
            return Violation(
                "bound", f"robot {k}", f"{plan.shortest[k]} steps at least; the shortest path has {distance}"
            )
    return None


def _distances(grid: Grid, ends: Iterable[tuple[Cell, Cell]]) -> list[int | None]:
    """Least number of four-connected steps between each pair of cells; None where there is no path.

    The map is one integer, a bit a cell and one blocked bit behind each row; a wave from either end is four shifts,
    until the two meet.
    """
    width = grid.width + 1
    rows = np.zeros((grid.height, width), dtype=np.uint8)
    rows[:, :-1] = ~grid.blocked
    free = int.from_bytes(np.packbits(rows.ravel(), bitorder="little").tobytes(), "little")

    def spread(front: int, seen: int) -> int:
        return (front << 1 | front >> 1 | front << width | front >> width) & free & ~seen

    found: list[int | None] = []
    for (x0, y0), (x1, y1) in ends:
        fronts = [1 << (y0 * width + x0), 1 << (y1 * width + x1)]
        seen = fronts.copy()
        steps = 0
        # After a and b steps two balls first meet where the distance is a + b.
        while not seen[0] & seen[1] and all(fronts):
            side = steps % 2
            fronts[side] = spread(fronts[side], seen[side])
            seen[side] |= fronts[side]
            steps += 1
        found.append(steps if seen[0] & seen[1] else None)
    return found
