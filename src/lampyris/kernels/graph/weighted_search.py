"""A* and Dijkstra where cells weigh differently: one loop, exact integer costs, a binary heap.

Over terrain a step can raise f = g + h by any amount, so the queues by raise of :mod:`.search` have no use
here. The heap orders by f, then by h (of equals the one nearer the goal), then by cell (row by row): an order
of the cells themselves and not of how they came in, so which cells are expanded depends on the map alone.

The heap holds a cell once. Its keys lie in the heap, not with the cells: a comparison then reads two places
side by side and not two cells anywhere on the map. ``place`` says where in the heap each cell is, so a better
path moves it up and nothing stale is ever taken out. (Pushing it a second time and skipping it later needs no
``place``, but heaps of up to eight entries a cell.)

Layout and bases as in :mod:`.search`: rows padded with blocked cells, and nothing cleared between two
searches, each counting from a base ``span`` lower than the last.
"""

from __future__ import annotations

from lampyris.kernels._helpers import LOOK, STRETCH
from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.graph.search import EXHAUSTED, FOUND, LIMIT

TERRAIN_UNIT = 63
"""What plain ground weighs."""


@kernel(out=("keys", "ties", "items", "place"))
def rise(keys, ties, items, place, at, key, tie, item):
    """Put an entry into the heap at ``at`` or, while it comes before what is there, nearer the top.

    Parameters
    ----------
    keys, ties : int64; the entries' keys, compared first by one, then by the other, then by item.
    items : int32; what is in the heap.
    place : int32; where in the heap each item is (only set, never read).
    at : a free place: the first behind the heap, or the item's own if its key has fallen.
    """
    while at > 0:
        above = (at - 1) >> 1
        k = keys[u64(above)]
        t = ties[u64(above)]
        i = items[u64(above)]
        if k < key or (k == key and (t < tie or (t == tie and i < item))):
            break
        keys[u64(at)] = k
        ties[u64(at)] = t
        items[u64(at)] = i
        place[u64(i)] = at
        at = above
    keys[u64(at)] = key
    ties[u64(at)] = tie
    items[u64(at)] = item
    place[u64(item)] = at


@kernel(out=("keys", "ties", "items", "place"))
def sink(keys, ties, items, place, size, at, key, tie, item):
    """Put an entry into a heap of that size at ``at`` or, while another comes before it, farther down."""
    while True:
        child = 2 * at + 1
        if child >= size:
            break
        k = keys[u64(child)]
        t = ties[u64(child)]
        i = items[u64(child)]
        if child + 1 < size:
            k2 = keys[u64(child + 1)]
            t2 = ties[u64(child + 1)]
            i2 = items[u64(child + 1)]
            if k2 < k or (k2 == k and (t2 < t or (t2 == t and i2 < i))):
                child, k, t, i = child + 1, k2, t2, i2
        if key < k or (key == k and (tie < t or (tie == t and item < i))):
            break
        keys[u64(at)] = k
        ties[u64(at)] = t
        items[u64(at)] = i
        place[u64(i)] = at
        at = child
    keys[u64(at)] = key
    ties[u64(at)] = tie
    items[u64(at)] = item
    place[u64(item)] = at


@kernel(out=("keys", "ties", "items", "place", "g", "step", "result"), each=3800)
def weighted_search(
    free, weight, stride, start, goal, budget, base, span,
    offset, via, across, dx, dy, price, first, follow, slope,
    keys, ties, items, place, g, step, result, halt,
):  # fmt: skip
    """Cheapest path from start to goal; or, without a goal, everything that can be reached.

    Parameters
    ----------
    free, stride, start, goal, budget, offset, via, across, dx, dy, first, follow, slope, result : as for
        :func:`lampyris.kernels.graph.search.search`; no step of ``follow`` may be needed whatever the terrain.
    weight : uint8, (n,), padded; the terrain.
    base : what every g of this search is counted from: at least ``span`` below the base of the search before.
    span : more than any cost.
    price : int64, (steps,); what each step costs times what the cell it enters weighs (63 for plain ground).
    keys, ties, items : int64, int64 and int32, (n,); the heap. ``items`` holds the path at the end, goal
        first.
    place : int32, (n,); scratch.
    g : int64, (n,); base + cost of the cells met; anything else is at least base + span.
    step : int8, (n,); scratch.
    """
    major0 = slope[0]
    minor0 = slope[1]
    major1 = slope[2]
    minor1 = slope[3]
    # Flat index to row by a product: exact below 2^50 cells thanks to the half, and quicker than a division.
    rows = 1.0 / stride
    gy = goal // stride
    gx = goal - gy * stride
    unseen = base + span
    g[start] = base
    step[start] = len(offset)
    size = 1
    rise(keys, ties, items, place, 0, base, 0, start)
    expansions = 0
    ending = EXHAUSTED
    while size > 0:
        cell = int(items[u64(0)])
        if cell == goal:
            ending = FOUND
            break
        if expansions == budget or (expansions % LOOK == 0 and stopped(halt)):
            ending = LIMIT
            break
        expansions += 1
        size -= 1
        last = u64(size)
        if size > 0:
            sink(keys, ties, items, place, size, 0, keys[last], ties[last], items[last])
        u = u64(cell)
        paid = g[u]
        y = int((cell + 0.5) * rows)
        x = cell - y * stride
        for i in range(first[u64(step[u])], first[u64(step[u] + 1)]):
            k = u64(follow[u64(i)])
            v = u + u64(offset[k])
            if free[v] == 0:
                continue
            reached = paid + price[k] * (TERRAIN_UNIT + weight[v])
            # With a consistent heuristic no closed cell is ever reached for less.
            if g[v] <= reached:
                continue
            if free[u + u64(via[k])] == 0 or free[u + u64(across[k])] == 0:
                continue
            a = abs(x + dx[k] - gx)
            b = abs(y + dy[k] - gy)
            if a < b:
                a, b = b, a
            h = max(major0 * a + minor0 * b, major1 * a + minor1 * b)
            at = size
            if g[v] < unseen:
                at = int(place[v])
            else:
                size += 1
            g[v] = reached
            step[v] = k
            rise(keys, ties, items, place, at, reached + h, h, cell + offset[k])
    length = 0
    if ending == FOUND:
        cell = goal
        items[0] = goal
        length = 1
        while cell != start:
            cell = cell - offset[step[cell]]
            items[length] = cell
            length += 1
            if length % STRETCH == 0 and stopped(halt):
                break
    result[0] = ending
    result[1] = expansions
    result[2] = length
    result[3] = g[goal] - base if ending == FOUND else -1
