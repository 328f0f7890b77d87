"""What searches that change their minds have in common: the estimate from the robot, a queue whose keys are
made again, changed cells, and the path read off finished costs.

Maps are padded and flat, with a border of walls as wide as the longest step. A step of kind k from a cell
into cell v costs ``price[k] * (setup[GROUND] + weight[v & setup[MASK]])``. Steps come in pairs, there and
back, which touch the same cells.
"""

from __future__ import annotations

from lampyris.kernels._helpers import LOOK, STRETCH
from lampyris.kernels._jit import PATH, kernel, stopped, u64
from lampyris.kernels.heap import put

GROUND, MASK, STRIDE, GOAL, ROBOT, ROBOT_X, ROBOT_Y, BIAS, SLOPE = 0, 1, 2, 3, 4, 5, 6, 7, 8
"""Places in ``setup``, int64 (12,): what plain ground weighs; -1 where each cell has a weight, 0 where all
have the one at 0; length of a padded row; the goal and the robot, flat, and the robot's padded column and
row; what is added to every estimate; four coefficients: h = max(slope[0] a + slope[1] b, slope[2] a +
slope[3] b) for a >= b, the distances along the axes. h must be consistent and a metric."""

NEVER = 2**61
"""The cost of cells that cannot reach the goal: more than any other; twice it still fits 64 bits."""

DONE, LIMIT = 0, 1
"""How a search ended: the cost of the robot's cell is known; the budget is spent."""


@kernel()
def estimate(setup, cell):
    """The metric of the open plane between the robot and a cell, and the bias."""
    row = cell // setup[STRIDE]
    a = abs(cell - row * setup[STRIDE] - setup[ROBOT_X])
    b = abs(row - setup[ROBOT_Y])
    if a < b:
        a, b = b, a
    one = setup[SLOPE] * a + setup[SLOPE + 1] * b
    two = setup[SLOPE + 2] * a + setup[SLOPE + 3] * b
    return setup[BIAS] + (one if one > two else two)


@kernel(out=("low", "key", "heap", "place"))
def refile(low, key, heap, place, setup, halt):
    """Renew all keys after the robot has moved, and the order of the queue."""
    count = int(heap[0])
    heap[0] = 0
    for i in range(1, count + 1):
        if i % LOOK == 0 and stopped(halt):
            return
        # What is filed takes no more room than what has been read.
        cell = int(heap[i])
        key[u64(cell)] = low[u64(cell)] + estimate(setup, cell)
        place[u64(cell)] = 0
        put(heap, place, key, low, cell)


@kernel(out=("free", "weight"))
def take_in(free, weight, changed, now_free, now_weight, setup):
    """Write what changed cells are now into the map: int32, uint8, uint8, (c,)."""
    for i in range(len(changed)):
        f = u64(changed[i])
        free[f] = now_free[i]
        weight[f & u64(setup[MASK])] = now_weight[i]


@kernel()
def look_ahead(free, weight, cost, u, jump, side, other, price, setup):
    """The least that a step from a free cell and its end's cost come to."""
    best = NEVER
    for k in range(len(jump)):
        v = u + u64(jump[k])
        if free[v] == 0 or free[u + u64(side[k])] == 0 or free[u + u64(other[k])] == 0:
            continue
        d = cost[v] + price[k] * (setup[GROUND] + weight[v & u64(setup[MASK])])
        if d < best:
            best = d
    return best


@kernel(out=("path",), each=5000, of=PATH)
def descend(free, weight, cost, jump, side, other, price, setup, path, halt):
    """The cheapest path from the robot to the goal, by costs that are right along every such path.

    In each cell the first step, in the order of the step set, that costs least with what its end costs: the
    local parent rule. Cells in ``path``, int32 (n,); returns how many, 0 if there is no path.
    """
    u = u64(setup[ROBOT])
    path[0] = u
    length = 1
    while u != setup[GOAL] and length < len(path):
        best = NEVER
        then = u
        for k in range(len(jump)):
            v = u + u64(jump[k])
            if free[v] == 0 or free[u + u64(side[k])] == 0 or free[u + u64(other[k])] == 0:
                continue
            d = cost[v] + price[k] * (setup[GROUND] + weight[v & u64(setup[MASK])])
            if d < best:
                best = d
                then = v
        if best == NEVER:
            return 0
        u = then
        path[length] = u
        length += 1
        if length % STRETCH == 0 and stopped(halt):
            return 0
    return length
