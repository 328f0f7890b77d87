"""The order of visits: a shortest path through given points, its two ends fixed.

Exact by dynamic programming over subsets (Held and Karp, 1962) up to :data:`EXACT_VIA` points. Beyond, cheapest
insertion, then moves of one to three points and reversals for as long as they make it shorter; the bound is then that
of the assignment problem: every point has one successor and one predecessor, and cycles are allowed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lampyris._core.cancellation import checkpoint

EXACT_VIA = 12
"""Up to so many via points the best order is exact."""
_FAR = 2**61


def best_order(costs: NDArray[np.int64]) -> tuple[list[int], int]:
    """The order in which to visit ``n`` points, and a cost that no order is below.

    Parameters
    ----------
    costs : int64 (n + 1, n + 1), at least 0: rows are the start and the points, columns the points and the goal;
        ``costs[0, j]`` from the start to point j, ``costs[i + 1, n]`` from point i to the goal.

    Returns
    -------
    order : the points, 0 to n - 1.
    least : the cost of that order where n is at most :data:`EXACT_VIA`, else a lower bound.

    Examples
    --------
    >>> best_order(np.array([[5, 1, 9], [0, 4, 2], [3, 0, 8]]))
    ([1, 0], 6)
    """
    n = len(costs) - 1
    if n <= EXACT_VIA:
        order = _held_karp(costs)
        return order, _cost(costs, order)
    from scipy.optimize import linear_sum_assignment  # bits: only the least sum, of whole numbers

    barred = costs.astype(np.float64)
    barred[np.arange(1, n + 1), np.arange(n)] = float(costs.sum()) + 1.0  # no point follows itself
    rows, columns = linear_sum_assignment(barred)
    return _improved(costs, _inserted(costs)), int(costs[rows, columns].sum())


def _cost(costs: NDArray[np.int64], order: list[int]) -> int:
    n = len(costs) - 1
    return int(costs[[0, *(k + 1 for k in order)], [*order, n]].sum())


def _held_karp(costs: NDArray[np.int64]) -> list[int]:
    """By subsets: the least cost from each point through a set of points to the goal; the first of equals."""
    n = len(costs) - 1
    inner, sets = costs[1:, :n], 1 << n
    to_go = np.full((sets, n), _FAR, dtype=np.int64)  # of what is still to be visited after this point
    then = np.zeros((sets, n), dtype=np.int8)
    to_go[0] = costs[1:, n]
    member = (np.arange(sets)[:, None] >> np.arange(n)) & 1 == 1
    for left in range(1, sets):
        points = np.flatnonzero(member[left])
        rest = to_go[left & ~(1 << points), points]
        options = inner[:, points] + rest
        best = options.argmin(axis=1)
        to_go[left], then[left] = options[np.arange(n), best], points[best]
    order: list[int] = []
    left = sets - 1
    if n:
        points = np.arange(n)
        at = int((costs[0, :n] + to_go[left & ~(1 << points), points]).argmin())
        order.append(at)
        left &= ~(1 << at)
        while left:
            at = int(then[left, at])
            order.append(at)
            left &= ~(1 << at)
    return order


def _inserted(costs: NDArray[np.int64]) -> list[int]:
    """Cheapest insertion: the point and the place that make the path least longer come next."""
    n = len(costs) - 1
    order: list[int] = []
    missing = list(range(n))
    while missing:
        checkpoint()
        rows, columns = np.array([0, *(k + 1 for k in order)]), np.array([*order, n])
        left = np.array(missing)
        more = costs[np.ix_(rows, left)].T + costs[np.ix_(left + 1, columns)] - costs[rows, columns]
        point, place = divmod(int(more.argmin()), len(rows))
        order.insert(place, missing.pop(point))
    return order


def _improved(costs: NDArray[np.int64], order: list[int]) -> list[int]:
    """Move one to three points elsewhere or reverse a part, for as long as that lowers the cost."""
    n, now = len(order), _cost(costs, order)
    better = True
    while better:
        better = False
        for i in range(n):
            checkpoint()
            for j in range(i + 1, n + 1):
                part, rest = order[i:j], order[:i] + order[j:]
                tries = [order[:i] + part[::-1] + order[j:]]
                if j - i <= 3:
                    tries += [rest[:k] + part + rest[k:] for k in range(len(rest) + 1) if k != i]
                for tried in tries:
                    cost = _cost(costs, tried)
                    if cost < now:
                        order, now, better = tried, cost, True
                        break
                if better:
                    break
            if better:
                break
    return order
