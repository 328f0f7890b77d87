"""D* and Focussed D*: costs with back pointers, and waves that raise what rose and lower what fell.

Stentz, "Optimal and efficient path planning for partially-known environments", ICRA 1994; "The focussed D*
algorithm for real-time replanning", IJCAI 1995. Names as there: h is a cell's cost, k (here ``low``) the
least h since it was put on the open list; a cell with k < h is *raised* and first warns those whose back
pointers lead to it, a cell with k = h lowers its neighbours. The open list goes by k; focussed, by ``k + g(X,
R)``, g being the metric of the open plane from the robot, and then by k. With g = 0 the second is the first,
so one kernel serves both.

Ours: how the bias is kept (its pseudocode was not to be found in full). A key is what k, g and the bias came
to when it was made; the bias grows by g(R_old, R_new) when the robot moves, so that by the triangle
inequality no key is too great, and one that is too small is renewed when it comes to the top: as D* Lite
does it.

Where a step is no longer possible at all, the cell whose back pointer used it costs ``NEVER``.

Layout and ``setup``: see :mod:`.queue`.
"""

from __future__ import annotations

from lampyris.kernels._helpers import LOOK
from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.heap import put, take
from lampyris.kernels.incremental.queue import (
    BIAS,
    DONE,
    GROUND,
    LIMIT,
    MASK,
    NEVER,
    ROBOT,
    estimate,
    take_in,
)

NEW = -2
"""In ``back``: never met. The goal has -1."""


@kernel(out=("h", "low", "key", "heap", "place"))
def _insert(h, low, key, heap, place, setup, cell, cost):
    """INSERT: onto the open list with a new cost."""
    u = u64(cell)
    least = low[u] if place[u] != 0 else h[u]
    low[u] = cost if cost < least else least
    h[u] = cost
    key[u] = low[u] + estimate(setup, cell)
    put(heap, place, key, low, cell)


@kernel(out=("free", "weight", "h", "low", "key", "heap", "place"))
def edit(free, weight, h, low, key, heap, place, changed, now_free, now_weight, jump, setup, halt):
    """MODIFY-COST for all steps to, from and past changed cells: their ends go back onto the open list."""
    take_in(free, weight, changed, now_free, now_weight, setup)
    for i in range(len(changed)):
        if i % LOOK == 0 and stopped(halt):
            return
        for k in range(-1, len(jump)):
            cell = int(changed[i])
            if k >= 0:
                cell += jump[k]
            u = u64(cell)
            if place[u] == 0 and h[u] < NEVER:
                _insert(h, low, key, heap, place, setup, cell, h[u])


@kernel(out=("h", "low", "key", "back", "heap", "place"), each=4000)
def process(
    free, weight, h, low, key, back, heap, place, jump, side, other, price, opposite, setup, budget, halt
):
    """PROCESS-STATE until the robot's cell cannot be had for less; returns how it ended, and expansions.

    Parameters
    ----------
    free, weight : uint8, (n,), and (n,) or a single 0.
    h, low, key : int64, (n,); h NEVER everywhere at first, but 0 at the goal, which is on the open list.
    back : int8, (n,); the step that leads on to the goal; NEW, and -1 at the goal.
    heap, place : the open list, see :func:`lampyris.kernels.heap.put`.
    jump, side, other : int64, (m,); offsets of each step's end and of the two cells that must be free
        besides.
    price, opposite : int64, (m,); the latter: which step leads back.
    setup : int64, (12,); see :mod:`.queue`. The bias must have grown by at least g between the robot's
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
        k_old = low[u]
        value = k_old + estimate(setup, cell)
        if key[u] < value:
            key[u] = value
            put(heap, place, key, low, cell)
            continue
        top = h[robot] + setup[BIAS]
        if value > top or (value == top and k_old >= h[robot]):
            break
        if expansions == budget:
            return LIMIT, expansions
        expansions += 1
        take(heap, place, key, low, cell)
        if k_old < h[u]:
            _lean(free, weight, h, back, jump, side, other, price, setup, cell, value, k_old)
        # Not "else": a raised cell that has found as much as it had before goes on as a lowered one.
        lower = k_old == h[u]
        burden = setup[GROUND] + weight[u & u64(setup[MASK])]
        for k in range(len(jump)):
            there = cell + jump[k]
            v = u64(there)
            child = back[v] == opposite[k]
            open_ = free[u] != 0 and free[v] != 0
            open_ = open_ and free[u + u64(side[k])] != 0 and free[u + u64(other[k])] != 0
            if not open_:
                if child and h[v] != NEVER:
                    _insert(h, low, key, heap, place, setup, there, NEVER)
                continue
            cost = h[u] + price[k] * burden
            if cost > NEVER:
                cost = NEVER
            if (child and h[v] != cost) or (back[v] == NEW and cost < NEVER):
                back[v] = opposite[k]
                _insert(h, low, key, heap, place, setup, there, cost)
            elif not child and h[v] > cost:
                if lower:
                    back[v] = opposite[k]
                    _insert(h, low, key, heap, place, setup, there, cost)
                elif place[u] == 0:
                    _insert(h, low, key, heap, place, setup, cell, h[u])
            elif not child and not lower and place[v] == 0 and h[v] < NEVER:
                onward = h[v] + price[k] * (setup[GROUND] + weight[v & u64(setup[MASK])])
                now = h[v] + estimate(setup, there)
                if h[u] > onward and (now > value or (now == value and h[v] > k_old)):
                    _insert(h, low, key, heap, place, setup, there, h[v])
    return DONE, expansions


@kernel(out=("h", "back"))
def _lean(free, weight, h, back, jump, side, other, price, setup, cell, value, k_old):
    """A raised cell looks for a neighbour whose cost is settled and by which it costs less."""
    u = u64(cell)
    if free[u] == 0:
        return
    for k in range(len(jump)):
        v = u + u64(jump[k])
        if free[v] == 0 or free[u + u64(side[k])] == 0 or free[u + u64(other[k])] == 0 or h[v] == NEVER:
            continue
        cost = h[v] + price[k] * (setup[GROUND] + weight[v & u64(setup[MASK])])
        if cost >= h[u]:
            continue
        now = h[v] + estimate(setup, cell + jump[k])
        if now < value or (now == value and h[v] <= k_old):
            back[u] = k
            h[u] = cost
