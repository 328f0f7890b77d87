"""Neighbours, leaders and groups of a swarm, recomputed for the referee; pairs within rounding of a limit may go either way."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from lampyris.model.swarm.swarm_trace import SwarmTrace
from lampyris.referee.verdict import Violation
from lampyris.typing import Floats

_SLACK = 1e-9
"""Share of a length that rounding may take."""
_AT_ONCE = 2_000_000
"""Pairs that are compared at once."""
_ITERATIONS = 24
_ROBOTS = 16
"""Iterations, and robots of each, whose neighbours are worked out again."""
_PAIRS = 8_000_000
"""Pairs of robots that are looked at for groups: of as many iterations of the same as these allow, one at least."""
_CORNER = 1e-6
"""Share of a cell by which a line that passes a corner of a wall may miss it."""


def neighbours_violation(trace: SwarmTrace, every: bool) -> Violation | None:
    """Neighbours counted again, with what rounding could decide left open."""
    if trace.settings.method != "gso":
        return None
    n = trace.robots
    for t in _times(trace.iterations, _ITERATIONS, every):
        robots = range(n) if every or n <= _ROBOTS else range(t % (n // _ROBOTS), n, n // _ROBOTS)
        for i in robots:
            away = trace.xy[t] - trace.xy[t, i]
            distance = np.sqrt((away * away).sum(axis=1))
            reach = trace.ranges[t, i]
            near = distance < reach * (1 + _SLACK) + _SLACK
            surely = distance < reach * (1 - _SLACK) - _SLACK
            brighter = trace.luciferin[t + 1] > trace.luciferin[t + 1, i]
            candidates = np.flatnonzero(near & brighter)
            seen, clearly = _seen(trace, t, i, candidates)
            least, most = int((clearly & surely[candidates]).sum()), int(seen.sum())
            if not least <= trace.neighbours[t, i] <= most:
                words = f"{trace.neighbours[t, i]} neighbours; counted {least} to {most}"
                return Violation("neighbours", f"iteration {t}, robot {i}", words)
            leader = int(trace.leaders[t, i])
            if leader >= 0 and leader not in candidates[seen]:
                return Violation("leader", f"iteration {t}, robot {i}", f"does not hear its leader {leader}")
    return None


def groups_violation(trace: SwarmTrace, every: bool) -> Violation | None:
    """Groups made again: robots that surely hear each other are in one, and each hangs together by links that may be heard.

    Links to leaders, which are neighbours, make trees. What is left to look at are pairs of two groups, none of which may be
    neighbours, and pairs of two trees of one group.
    """
    n = trace.robots
    if trace.settings.method != "gso":
        alone = (trace.groups == np.arange(n)).all() and (trace.leaders < 0).all()
        return None if alone else Violation("group", "trace", f"{trace.settings.method} makes no groups")
    most = _ITERATIONS if n * n * _ITERATIONS <= _PAIRS else max(1, _PAIRS // (n * n))
    for t in _times(trace.iterations, most, every):
        found = _groups_at(trace, t)
        if found is not None:
            return found
    return None


def _times(last: int, most: int, every: bool) -> range:
    """Iterations that are looked at."""
    return range(last) if every or last <= most else range(0, last, last // most)


def _groups_at(trace: SwarmTrace, t: int) -> Violation | None:
    group, leader, n = trace.groups[t], trace.leaders[t], trace.robots
    follows = np.flatnonzero(leader >= 0)
    links = coo_array((np.ones(len(follows)), (follows, leader[follows])), shape=(n, n))
    _, tree = connected_components(links, directed=False)
    apart, within = _pairs(trace, t, tree)
    for i, j in _maybe_heard(trace, t, apart).tolist():
        if _seen(trace, t, i, np.array([j]))[1][0]:
            words = f"hears robot {j} and is not in its group"
            return Violation("group", f"iteration {t}, robot {i}", words)
    root = list(range(n))  # of trees

    def top(k: int) -> int:
        while root[k] != k:
            root[k] = root[root[k]]
            k = root[k]
        return k

    more = len(np.unique(tree)) - len(np.unique(group))
    if more:
        for i, j in _maybe_heard(trace, t, within).tolist():
            a, b = top(int(tree[i])), top(int(tree[j]))
            if a != b and _seen(trace, t, i, np.array([j]))[0][0]:
                root[a] = b
                more -= 1
                if not more:
                    return None
        i = next(i for i in range(n) if top(int(tree[i])) != top(int(tree[group[i]])))
        words = f"is in the group of robot {group[i]}, to which no neighbours lead"
        return Violation("group", f"iteration {t}, robot {i}", words)
    return None


def _pairs(trace: SwarmTrace, t: int, tree: NDArray[np.int32]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pairs (i, j) by distance and brightness alone, (k, 2): sure ones of two groups, possible ones of two trees of a group."""
    xy, glow, reach, group, n = (
        trace.xy[t],
        trace.luciferin[t + 1],
        trace.ranges[t],
        trace.groups[t],
        trace.robots,
    )
    apart, within = [], []
    each = max(1, _AT_ONCE // n)
    for begin in range(0, n, each):
        rows = slice(begin, begin + each)
        distance = np.hypot(xy[rows, np.newaxis, 0] - xy[:, 0], xy[rows, np.newaxis, 1] - xy[:, 1])
        brighter = glow > glow[rows, np.newaxis]
        same = group == group[rows, np.newaxis]
        r = reach[rows, np.newaxis]
        sure = brighter & ~same & (distance < r * (1 - _SLACK) - _SLACK)
        may = brighter & same & (tree != tree[rows, np.newaxis]) & (distance < r * (1 + _SLACK) + _SLACK)
        apart.append(np.argwhere(sure) + np.array((begin, 0)))
        within.append(np.argwhere(may) + np.array((begin, 0)))
    return np.concatenate(apart), np.concatenate(within)


def _maybe_heard(trace: SwarmTrace, t: int, pairs: NDArray[np.int64]) -> NDArray[np.int64]:
    """Without the pairs (k, 2) between which some point of the line is clearly inside a wall."""
    if not trace.settings.line_of_sight:
        return pairs
    points = trace.grid.to_points(trace.xy[t, :, 0], trace.xy[t, :, 1]) + 0.5
    for samples in (8, 64):
        shares = (np.arange(samples) + 0.5) / samples
        kept = []
        each = max(1, _AT_ONCE // samples)
        for begin in range(0, len(pairs), each):
            some = pairs[begin : begin + each]
            a, b = points[some[:, 0], np.newaxis], points[some[:, 1], np.newaxis]
            at = a + shares[:, np.newaxis] * (b - a)
            cell = np.floor(at).astype(np.int64)
            inside = np.abs(at - cell - 0.5).max(axis=2) < 0.5 - 2 * _CORNER
            x = np.clip(cell[..., 0], 0, trace.grid.width - 1)
            y = np.clip(cell[..., 1], 0, trace.grid.height - 1)
            kept.append(some[~(trace.grid.blocked[y, x] & inside).any(axis=1)])
        pairs = np.concatenate(kept) if kept else pairs
    return pairs


def _seen(
    trace: SwarmTrace, t: int, i: int, others: NDArray[np.int64]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which of some robots are heard by robot i, if lines that graze a wall count, and if they do not."""
    yes = np.ones(len(others), dtype=bool)
    if not trace.settings.line_of_sight or not len(others):
        return yes, yes
    points = trace.grid.to_points(trace.xy[t, :, 0], trace.xy[t, :, 1]) + 0.5
    a, b = points[i], points[others]
    low = np.floor(np.minimum(a, b.min(axis=0))).astype(int)
    high = np.floor(np.maximum(a, b.max(axis=0))).astype(int) + 1
    part = trace.grid.blocked[max(low[1], 0) : high[1], max(low[0], 0) : high[0]]
    walls = np.argwhere(part)[:, ::-1] + np.maximum(low, 0)
    found = []
    for slack in (_CORNER, -_CORNER):  # squares made smaller, then larger
        hit = np.zeros(len(others), dtype=bool)
        for k, end in enumerate(b):
            hit[k] = _crosses(a, end, walls + slack, walls + 1.0 - slack)
        found.append(~hit)
    return found[0], found[1]


def _crosses(a: Floats, b: Floats, low: Floats, high: Floats) -> bool:
    """Whether a segment meets one of some rectangles (k, 2): by the shares of it that lie between their sides."""
    if not len(low):
        return False
    d = b - a
    begin, end = np.zeros(len(low)), np.ones(len(low))
    for axis in (0, 1):
        if d[axis] == 0.0:
            outside = (a[axis] < low[:, axis]) | (a[axis] > high[:, axis])
            begin = np.where(outside, 2.0, begin)
            continue
        one, other = (low[:, axis] - a[axis]) / d[axis], (high[:, axis] - a[axis]) / d[axis]
        begin, end = np.maximum(begin, np.minimum(one, other)), np.minimum(end, np.maximum(one, other))
    return bool((begin <= end).any())
