"""Costs of all states of an empty square from one in its middle: Dijkstra's search without walls."""

from __future__ import annotations

from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.lattice.search import _pop, _push


@kernel(out=("costs", "keys", "states"), of="costs", each=15_000)
def spread(headings, first, step_x, step_y, turned, cost, half, start, costs, keys, states, halt):
    """Fill the costs from a heading in the middle.

    Parameters
    ----------
    headings, first, turned, cost : see :func:`lampyris.kernels.lattice.search.search`.
    step_x, step_y : int64 (primitives,): columns and rows that each moves.
    half : the square has ``2 * half + 1`` cells a side.
    start : the heading.
    costs : int64 (cells * headings,): by row, column and heading; -1 where the square has no way.
    keys, states : a heap; int64 and int32 of one length.

    Returns
    -------
    Whether the heap was large enough.
    """
    side = 2 * half + 1
    room = len(keys) - len(cost)
    for k in range(len(costs)):
        costs[u64(k)] = -1
    middle = (half * side + half) * headings + start
    costs[u64(middle)] = 0
    _push(keys, states, 0, 0, middle)
    waiting = 1
    look = 512
    while waiting > 0:
        if waiting >= room:
            return False
        look -= 1
        if look == 0:
            look = 512
            if stopped(halt):
                break
        key = int(keys[u64(0)])
        state = int(states[u64(0)])
        _pop(keys, states, waiting)
        waiting -= 1
        if key > costs[u64(state)]:
            continue
        cell = state // headings
        heading = state - cell * headings
        y = cell // side
        x = cell - y * side
        for p in range(first[u64(heading)], first[u64(heading + 1)]):
            to_x = x + step_x[u64(p)]
            to_y = y + step_y[u64(p)]
            if to_x < 0 or to_x >= side or to_y < 0 or to_y >= side:
                continue
            to = (to_y * side + to_x) * headings + turned[u64(p)]
            more = key + cost[u64(p)]
            old = costs[u64(to)]
            if old < 0 or more < old:
                costs[u64(to)] = more
                _push(keys, states, waiting, more, to)
                waiting += 1
    return True
