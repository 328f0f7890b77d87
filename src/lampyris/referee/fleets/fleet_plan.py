"""Judges plans of fleets: every robot's path and every pair of robots, from the map alone.

Distances are worked out a second time, by waves over the whole map as bits of Python integers; conflicts by sorting
numbers of tick and cells. Nothing is taken from planners or kernels.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from lampyris.model.fleet.fleet import Fleet
from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.model.grid import Grid
from lampyris.model.plan import Status
from lampyris.referee.verdict import Violation
from lampyris.typing import BoolGrid, Cell, Cells

_ENTRIES = 4_000_000
"""Places of robots that are compared at once."""
_ALL = 4_000_000
"""Robots times cells up to which every shortest path is worked out again."""
_SOME = 64
_TOUCH = 1e-9
"""Cells by which rounding may bring discs that touch too near."""


def check_fleet_plan(
    plan: FleetPlan, fleet: Fleet, *, every: bool | None = None, factor: float | None = None
) -> Violation | None:
    """The first rule that a plan breaks, or None.

    Rules: ``paths`` (one for each robot), ``moves`` (a step set of fleets), ``start``, ``outside``, ``wall`` (a robot's disc
    reaches into one, or a diagonal step passes one beside it), ``step`` (to one of four or eight neighbours, or none), ``goal``,
    ``arrival`` (the path ends at the tick of the last arrival, and no sooner), ``vertex`` (two robots in one cell), ``swap``
    (two that change places), ``crossing`` (two diagonal steps of one 2 x 2 block), ``contact`` (two discs overlap, at a tick or
    on their steps; where a robot has a size), ``cost`` and ``makespan`` (as counted again), ``bound`` (the
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
    if plan.moves not in ("four-connected", "octile"):
        return Violation("moves", "plan", f"moves {plan.moves!r}")
    if len(plan.paths) != len(fleet.robots):
        return Violation("paths", "plan", f"{len(plan.paths)} paths for {len(fleet.robots)} robots")
    walls = _Walls(fleet)
    for k, path in enumerate(plan.paths):
        found = _check_path(k, path, fleet, plan.moves, walls.of(k), whole=plan.status is Status.FOUND)
        if found is not None:
            return found
    found = _check_pairs(plan.paths, fleet.grid) or check_contacts(plan.paths, fleet)
    if found is not None:
        return found
    return _check_costs(plan) or _check_bound(plan, fleet, every)


class _Walls:
    """Where each robot must not be: cells in which its disc reaches into a wall."""

    def __init__(self, fleet: Fleet) -> None:
        self._fleet = fleet
        self._made: dict[float, BoolGrid] = {}

    def of(self, k: int) -> BoolGrid:
        """Blocked cells for robot ``k``, bool (height, width)."""
        robot = self._fleet.robots[k].robot
        radius = 0.0 if robot is None else robot.radius / self._fleet.grid.resolution
        if radius <= 0.5 + _TOUCH:
            return self._fleet.grid.blocked
        if radius not in self._made:
            self._made[radius] = _widened(self._fleet.grid.blocked, radius)
        return self._made[radius]


def _widened(blocked: BoolGrid, radius: float) -> BoolGrid:
    """Cells with a blocked square nearer to their centre than ``radius`` cells; the edge of the map is no wall."""
    far = math.ceil(radius + 0.5)
    height, width = blocked.shape
    made = blocked.copy()
    wide = np.zeros((height + 2 * far, width + 2 * far), dtype=np.bool_)
    wide[far : far + height, far : far + width] = blocked
    for dy in range(-far, far + 1):
        for dx in range(-far, far + 1):
            aside, along = max(abs(dx) - 0.5, 0.0), max(abs(dy) - 0.5, 0.0)
            if math.sqrt(aside * aside + along * along) < radius - _TOUCH:
                made |= wide[far + dy : far + dy + height, far + dx : far + dx + width]
    return made


def _check_path(
    k: int, path: Cells, fleet: Fleet, moves: str, blocked: BoolGrid, *, whole: bool
) -> Violation | None:
    robot, grid = fleet.robots[k], fleet.grid
    x, y = path[:, 0].astype(np.int64), path[:, 1].astype(np.int64)
    if (int(x[0]), int(y[0])) != robot.start:
        return Violation("start", f"robot {k}", f"begins at ({x[0]}, {y[0]}), not at its start {robot.start}")
    outside = (x < 0) | (x >= grid.width) | (y < 0) | (y >= grid.height)
    if outside.any():
        t = int(outside.argmax())
        return Violation("outside", f"robot {k}, tick {t}", f"({x[t]}, {y[t]}) is outside the map")
    walls = blocked[y, x]
    if walls.any():
        t = int(walls.argmax())
        return Violation("wall", f"robot {k}, tick {t}", f"({x[t]}, {y[t]}) is blocked")
    aside, along = np.abs(np.diff(x)), np.abs(np.diff(y))
    length = np.maximum(aside, along) if moves == "octile" else aside + along
    if (length > 1).any():
        t = int((length > 1).argmax())
        return Violation(
            "step",
            f"robot {k}, tick {t + 1}",
            f"goes from ({x[t]}, {y[t]}) to ({x[t + 1]}, {y[t + 1]}) in a tick",
        )
    corners = (aside == 1) & (along == 1) & (blocked[y[:-1], x[1:]] | blocked[y[1:], x[:-1]])
    if corners.any():
        t = int(corners.argmax())
        what = f"passes the corner of a wall from ({x[t]}, {y[t]}) to ({x[t + 1]}, {y[t + 1]})"
        return Violation("wall", f"robot {k}, tick {t + 1}", what)
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
            (
                one
                for one in (
                    _first_vertex(flat, begin),
                    _first_swap(flat, begin),
                    _first_crossing(flat, begin, grid.width),
                )
                if one is not None
            ),
            default=None,
        )
        if found is not None:
            tick, rule, one, other, cell = found
            y, x = divmod(cell, grid.width)
            words = {
                "vertex": f"both in ({x}, {y})",
                "swap": f"change places at ({x}, {y})",
                "crossing": f"cross between ({x}, {y}) and ({x + 1}, {y + 1})",
            }[rule]
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
    order = np.lexsort((high, low, tick))
    t, p, q, first = tick[order], low[order], high[order], a[order]
    same = (t[1:] == t[:-1]) & (p[1:] == p[:-1]) & (q[1:] == q[:-1]) & (first[1:] != first[:-1])
    if not same.any():
        return None
    i = int(same.argmax())
    one, other = sorted((int(robot[order[i]]), int(robot[order[i + 1]])))
    return begin + int(t[i]) + 1, "swap", one, other, int(p[i])


def _first_crossing(flat: NDArray[np.int64], begin: int, width: int) -> _Conflict | None:
    """Two diagonal steps of a tick in one block of four cells, one along each of its diagonals."""
    old, new = flat[:-1], flat[1:]
    aside = new % width - old % width
    tick, robot = np.nonzero((aside != 0) & (new // width != old // width))
    if not len(tick):
        return None
    a, b = old[tick, robot], new[tick, robot]
    corner = np.minimum(a // width, b // width) * width + np.minimum(a % width, b % width)
    falls = (a % width < b % width) == (a // width < b // width)
    order = np.lexsort((falls, corner, tick))
    t, c, f = tick[order], corner[order], falls[order]
    crossed = (t[1:] == t[:-1]) & (c[1:] == c[:-1]) & (f[1:] != f[:-1])
    if not crossed.any():
        return None
    i = int(crossed.argmax())
    one, other = sorted((int(robot[order[i]]), int(robot[order[i + 1]])))
    return begin + int(t[i]) + 1, "crossing", one, other, int(c[i])


def check_contacts(paths: tuple[Cells, ...], fleet: Fleet) -> Violation | None:
    """No two discs overlap, neither at a tick nor on their steps; the earliest contact.

    All pairs that are near at the beginning of a tick are compared where their centres are nearest.
    """
    radii = [0.0 if one.robot is None else one.robot.radius / fleet.grid.resolution for one in fleet.robots]
    radius = np.array(radii)
    if not radius.any():
        return None
    last = max(len(path) for path in paths) - 1
    far = 2.0 * float(radius.max()) + 2.0 * math.sqrt(2.0) + _TOUCH
    for t in range(max(last, 1)):
        now, then = (
            np.array([path[min(tick, len(path) - 1)] for path in paths], dtype=np.float64)
            for tick in (t, t + 1)
        )
        pairs = cKDTree(now).query_pairs(far, output_type="ndarray")
        if not len(pairs):
            continue
        a, b = pairs.T
        apart = now[b] - now[a]
        drift = (then[b] - then[a]) - apart
        length = (drift * drift).sum(axis=1)
        share = np.clip(-(apart * drift).sum(axis=1) / np.where(length > 0, length, 1.0), 0.0, 1.0)
        nearest = np.sqrt(((apart + share[:, None] * drift) ** 2).sum(axis=1))
        hit = nearest < radius[a] + radius[b] - _TOUCH
        if hit.any():
            i = int(hit.argmax())
            one, other = sorted((int(a[i]), int(b[i])))
            what = f"come within {nearest[i]:.4g} cells; their radii are {radius[one]:.4g} and {radius[other]:.4g}"
            return Violation("contact", f"robots {one} and {other}, tick {t + 1}", what)
    return None


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
        aside, along = abs(x1 - x0), abs(y1 - y0)
        if not (max(aside, along) if plan.moves == "octile" else aside + along) <= length <= most:
            return Violation("bound", f"robot {k}", f"{length} steps at least, but its path has {most}")
    if every is None:
        every = robots * cells <= _ALL
    chosen = range(robots) if every else range(0, robots, max(1, robots // _SOME))
    walls = _Walls(fleet)
    groups: dict[int, tuple[BoolGrid, list[int]]] = {}
    for k in chosen:
        blocked = walls.of(k)
        groups.setdefault(id(blocked), (blocked, []))[1].append(k)
    found: dict[int, int | None] = {}
    for blocked, members in groups.values():
        ends = [(fleet.robots[k].start, fleet.robots[k].goal) for k in members]
        found |= zip(members, _distances(blocked, ends, diagonal=plan.moves == "octile"), strict=True)
    for k in chosen:
        distance = found[k]
        if distance != plan.shortest[k]:
            return Violation(
                "bound", f"robot {k}", f"{plan.shortest[k]} steps at least; the shortest path has {distance}"
            )
    return None


def _distances(blocked: BoolGrid, ends: Iterable[tuple[Cell, Cell]], *, diagonal: bool) -> list[int | None]:
    """Least number of steps between each pair of cells; None where there is no path.

    The map is one integer, a bit a cell and one blocked bit behind each row; a wave from either end is four shifts,
    until the two meet, and a diagonal step two of them, one after the other, in either order.
    """
    width = int(blocked.shape[1]) + 1
    rows = np.zeros((len(blocked), width), dtype=np.uint8)
    rows[:, :-1] = ~blocked
    free = int.from_bytes(np.packbits(rows.ravel(), bitorder="little").tobytes(), "little")

    def spread(front: int, seen: int) -> int:
        if diagonal:
            left, right = front << 1 & free, front >> 1 & free
            down, up = front << width & free, front >> width & free
            corners = (down << 1 & left << width) | (down >> 1 & right << width)
            corners |= (up << 1 & left >> width) | (up >> 1 & right >> width)
            return (left | right | down | up | corners) & free & ~seen
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
