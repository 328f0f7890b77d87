"""LPA* and D* Lite: two estimates a cell, and a queue of the cells where they differ.

Koenig, Likhachev, Furcy, "Lifelong Planning A*", Artificial Intelligence 155, 2004; Koenig and Likhachev, "D*
Lite", AAAI 2002. Names as there: ``g`` is what a cell was found to cost, ``rhs`` what its neighbours' g make
it cost; where they differ the cell waits under the key ``(min(g, rhs) + h, min(g, rhs))``. Here both search
from the goal, so that costs stay good while the robot moves, and h is the metric of the open plane from the
robot, plus a bias: D* Lite's k_m, by which its old keys stay lower bounds. LPA* has none and rebuilds its queue.

Layout and ``setup``: see :mod:`.queue`.
"""

from __future__ import annotations

from lampyris.kernels._helpers import LOOK
from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.heap import put, take
from lampyris.kernels.incremental.queue import (
    BIAS,
    DONE,
    GOAL,
    GROUND,
    LIMIT,
    MASK,
    NEVER,
    ROBOT,
    estimate,
    look_ahead,
    take_in,
)


@kernel(out=("low", "key", "heap", "place"))
def _file(g, rhs, low, key, heap, place, setup, cell):
    """Into the queue under its key where g and rhs differ, out of it where they do not: UpdateVertex."""
    u = u64(cell)
    if g[u] == rhs[u]:
        if place[u] != 0:
            take(heap, place, key, low, cell)
        return
    low[u] = g[u] if g[u] < rhs[u] else rhs[u]
    key[u] = low[u] + estimate(setup, cell)
    put(heap, place, key, low, cell)


@kernel(out=("free", "weight", "rhs", "low", "key", "heap", "place"))
def edit(
    free,
    weight,
    g,
    rhs,
    low,
    key,
    heap,
    place,
    changed,
    now_free,
    now_weight,
    jump,
    side,
    other,
    price,
    setup,
    halt,
):
    """Take in changed cells: each cell with a step to, from or past one of them looks ahead again.

    The paper compares the old and the new cost of each edge instead, to look ahead only where it must; with
    eight edges a cell and both directions at once, looking is as quick.
    """
    take_in(free, weight, changed, now_free, now_weight, setup)
    for i in range(len(changed)):
        if i % LOOK == 0 and stopped(halt):
            return
        for k in range(-1, len(jump)):
            cell = int(changed[i])
            if k >= 0:
                cell += jump[k]
            u = u64(cell)
            if cell == setup[GOAL]:
                continue
            if free[u] != 0:
                rhs[u] = look_ahead(free, weight, g, u, jump, side, other, price, setup)
            else:
                rhs[u] = NEVER
            _file(g, rhs, low, key, heap, place, setup, cell)


@kernel(out=("g", "rhs", "low", "key", "heap", "place"), each=2600)
def d_star_lite(free, weight, g, rhs, low, key, heap, place, jump, side, other, price, setup, budget, halt):
    """D* Lite's ComputeShortestPath, optimised version; returns how it ended and how many cells it expanded.

    Parameters
    ----------
    free, weight : uint8, (n,), and (n,) or a single 0.
    g, rhs : int64, (n,); NEVER everywhere at first, but rhs 0 at the goal, which waits in the queue.
    low, key : int64, (n,); min(g, rhs) and min(g, rhs) + h + bias of cells in the queue.
    heap, place : see :func:`lampyris.kernels.heap.put`.
    jump, side, other : int64, (m,); offsets of each step's end and of the two cells that must be free
        besides.
    price : int64, (m,).
    setup : int64, (12,); see :mod:`.queue`. The bias must have grown by at least h between the robot's
        old cell and its new one, whenever it moved.
    budget : greatest number of expansions; -1: no limit. The search goes on from there when called again.
    """
    robot = u64(setup[ROBOT])
    expansions = 0
    turns = 0
    while heap[0] > 0:
        # Here everything is in order, so that it can go on from here when called again.
        if turns % LOOK == 0 and stopped(halt):
            return LIMIT, expansions
        turns += 1
        cell = heap[1] + 0
        u = u64(cell)
        least = g[robot] if g[robot] < rhs[robot] else rhs[robot]
        top = least + setup[BIAS]
        if rhs[robot] <= g[robot] and (key[u] > top or (key[u] == top and low[u] >= least)):
            break
        now = low[u] + estimate(setup, cell)
        if key[u] < now:
            key[u] = now
            put(heap, place, key, low, cell)
            continue
        if expansions == budget:
            return LIMIT, expansions
        expansions += 1
        old = g[u]
        burden = setup[GROUND] + weight[u & u64(setup[MASK])]
        if old > rhs[u]:
            g[u] = rhs[u]
            take(heap, place, key, low, cell)
        else:
            g[u] = NEVER
            _file(g, rhs, low, key, heap, place, setup, cell)
            if free[u] == 0:
                continue
        for k in range(len(jump)):
            s = u + u64(jump[k])
            if free[s] == 0 or free[u + u64(side[k])] == 0 or free[u + u64(other[k])] == 0:
                continue
            toll = price[k] * burden
            if g[u] < NEVER:
                if g[u] + toll < rhs[s]:
                    rhs[s] = g[u] + toll
                    _file(g, rhs, low, key, heap, place, setup, cell + jump[k])
            elif rhs[s] == old + toll and cell + jump[k] != setup[GOAL]:
                rhs[s] = look_ahead(free, weight, g, s, jump, side, other, price, setup)
                _file(g, rhs, low, key, heap, place, setup, cell + jump[k])
    return DONE, expansions


@kernel(out=("g", "rhs", "low", "key", "heap", "place"), each=6500)
def lpa_star(free, weight, g, rhs, low, key, heap, place, jump, side, other, price, setup, budget, halt):
    """LPA*'s ComputeShortestPath: as :func:`d_star_lite`, without a bias, and every neighbour looks ahead."""
    robot = u64(setup[ROBOT])
    expansions = 0
    turns = 0
    while heap[0] > 0:
        # Here everything is in order, so that it can go on from here when called again.
        if turns % LOOK == 0 and stopped(halt):
            return LIMIT, expansions
        turns += 1
        cell = heap[1] + 0
        u = u64(cell)
        least = g[robot] if g[robot] < rhs[robot] else rhs[robot]
        if rhs[robot] == g[robot] and (key[u] > least or (key[u] == least and low[u] >= least)):
            break
        if expansions == budget:
            return LIMIT, expansions
        expansions += 1
        if g[u] > rhs[u]:
            g[u] = rhs[u]
            take(heap, place, key, low, cell)
        else:
            g[u] = NEVER
            _file(g, rhs, low, key, heap, place, setup, cell)
            if free[u] == 0:
                continue
        for k in range(len(jump)):
            s = u + u64(jump[k])
            if free[s] == 0 or free[u + u64(side[k])] == 0 or free[u + u64(other[k])] == 0:
                continue
            if cell + jump[k] != setup[GOAL]:
                rhs[s] = look_ahead(free, weight, g, s, jump, side, other, price, setup)
                _file(g, rhs, low, key, heap, place, setup, cell + jump[k])
    return DONE, expansions
