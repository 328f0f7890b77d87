"""Jump point search over bit-packed rows and columns (64 cells a word).

Harabor and Grastien, "Online graph pruning for pathfinding on grid maps", AAAI 2011, 1114-1119; packed
scans and the pruning of intermediate jump points: the same, "Improving jump point search", ICAPS 2014,
128-135. The rules for steps that may not cut corners are derived here.

Rules, and why the path found is a cheapest one
----------------------------------------------
Steps cost a (straight) and b (diagonal), a < b < 2a. Of all cheapest paths to a cell take one whose
diagonals come as early as possible, and on it any cell n with its predecessor p and its successor n'. Call
``d`` the step into n and ``e`` the step out of it; ``side`` is a unit step square to a straight ``d``.

* d straight, e backwards in any way: p reaches n' at once for less. Not on a cheapest path.
* d straight, e = side: if p + side is free, the diagonal p, n' is legal (without corner cutting its two
  side cells are n and p + side; with it, it always is) and costs b < 2a. So **without corner cutting p +
  side is blocked**, with it this never happens.
* d straight, e = d + side: p, n + side, n' would cost the same with its diagonal earlier. Without corner
  cutting n + side is free (e needs it), so **p + side is blocked**; with it, **n + side is blocked**.
* d diagonal, e one of its two straights, or d again: natural.
* d diagonal (u, v), e = (-u, 0) or (0, -v): p reaches n' by one straight. Not on a cheapest path.
* d diagonal (u, v), e = (-u, v): p, p + (0, v), n' costs 2a < 2b if p + (0, v) is free. Without corner
  cutting it is, d needs it; with it, **p + (0, v) = n - (u, 0) is blocked**. And likewise for (u, -v).

So that way only goes on naturally (straight on, or from a diagonal into its straights) or turns where the
rule in bold type is met, and it is enough to follow these. Whether a turn is met depends only on d and on
cells beside n; so a straight run may skip to the first cell where one is met, and a diagonal run has to
look, at each of its cells, only along its two straights and (with corner cutting) at its own turns.

A cell may be reached at one and the same cost from several directions, with different turns. Keeping only
the first of them, as is usual, needs a proof of its own; here a cell keeps the *set* of directions it has
still to follow, gathered over all arrivals of least cost, so the argument above holds as it stands: by
induction along that way, each of its turning points is reached at its least cost and follows the
direction needed.

The stops of a run, precomputed a word at a time
------------------------------------------------
Where a run east along row y has to stop is a property of the cells alone: at a wall, or at x where a row
beside it turns from blocked (x - 1) to free (x) (with corner cutting: from blocked (x) to free (x + 1)). A
bit for each of these, in four arrays for the four directions, makes a run one shift and one count of zeros
for 64 cells. The goal is added to the stops for the time of a search.

Roads not taken, measured on seven MovingAI maps, the median query: buckets of f instead of a heap (the
same within 8 %, 1.3 times as long in mazes, with their empty levels); ending a diagonal run at the first
cell from which a straight run finds something, as published in 2011 (1.2 to 2.0 times, on a random map
0.9); ending it there only once f has risen (0.9 to 1.4). Turns looked for by branches, half of them
mispredicted, took a quarter more. What is found is listed first, written unconditionally, and a node is
one record: with everything taken up at once, in ten arrays, it took 0.9 (in a maze) to 3.3 times as long
(in clutter).
"""

from __future__ import annotations

from lampyris.kernels._helpers import STRETCH
from lampyris.kernels._jit import PATH, kernel, stopped, u64
from lampyris.kernels.graph.bits import ahead, back, bit

FOUND, EXHAUSTED, LIMIT, FULL = 0, 1, 2, 3


@kernel(out=("nodes", "heap"), inline=True)
def _push(nodes, heap, size, j, f):
    """Put a node into the heap, or up to where it belongs by now; return the size of the heap."""
    k = nodes[u64(6 * j + 5)]
    if k < 0:
        k = size
        size += 1
    while k > 0:
        up = (k - 1) >> 1
        if heap[u64(2 * up)] < f:
            break
        other = heap[u64(2 * up + 1)]
        heap[u64(2 * k)] = heap[u64(2 * up)]
        heap[u64(2 * k + 1)] = other
        nodes[u64(6 * other + 5)] = k
        k = up
    heap[u64(2 * k)] = f
    heap[u64(2 * k + 1)] = j
    nodes[u64(6 * j + 5)] = k
    return size


@kernel(out=("nodes", "heap"), inline=True)
def _pull(nodes, heap, size):
    """Take the first node out of a heap of ``size`` (which holds one less from then on)."""
    j = heap[u64(1)]
    size -= 1
    f = heap[u64(2 * size)]
    last = heap[u64(2 * size + 1)]
    k = 0
    while True:
        child = 2 * k + 1
        if child >= size:
            break
        if child + 1 < size and heap[u64(2 * child + 2)] < heap[u64(2 * child)]:
            child += 1
        if heap[u64(2 * child)] >= f:
            break
        other = heap[u64(2 * child + 1)]
        heap[u64(2 * k)] = heap[u64(2 * child)]
        heap[u64(2 * k + 1)] = other
        nodes[u64(6 * other + 5)] = k
        k = child
    heap[u64(2 * k)] = f
    heap[u64(2 * k + 1)] = last
    nodes[u64(6 * last + 5)] = k
    nodes[u64(6 * j + 5)] = -1
    return j


@kernel(out=("found",), inline=True)
def _look(
    words, east, south, west, north, stride, rise, goal, start_x, start_y, start_g, bits,
    straight, diagonal, cutting, steps, found,
):  # fmt: skip
    """Follow the directions in ``bits`` from a cell and list where they lead; return the end of the list.

    Each place is written at the end of the list unconditionally, and the end advances by one place or none.
    """
    tail = 0
    for d in range(8):
        if (bits >> d) & 1 == 0:
            continue
        u = steps[u64(2 * d)]
        v = steps[u64(2 * d + 1)]
        x = start_x
        y = start_y
        g = start_g
        down = v * stride
        at = y * stride + x
        col = x * rise + y
        if d >= 4 and cutting == 0 and (bit(words, at + u) | bit(words, at + down)) != 0:
            continue
        while True:
            if d >= 4:
                if bit(words, at + down + u) != 0:
                    break
                x += u
                y += v
                g += diagonal
                at += down + u
                col += u * rise + v
                if cutting != 0:
                    found[u64(tail)] = x
                    found[u64(tail + 1)] = y
                    found[u64(tail + 2)] = g
                    found[u64(tail + 3)] = d ^ 1
                    tail += 4 * (bit(words, at - u) & (1 - bit(words, at - u + down)))
                    found[u64(tail)] = x
                    found[u64(tail + 1)] = y
                    found[u64(tail + 2)] = g
                    found[u64(tail + 3)] = 11 - d
                    tail += 4 * (bit(words, at - down) & (1 - bit(words, at - down + u)))
                if at == goal:
                    found[u64(tail)] = x
                    found[u64(tail + 1)] = y
                    found[u64(tail + 2)] = g
                    tail += 4
                    break
            if u != 0:
                reach = ahead(words, east + at) if u > 0 else back(words, west + at)
                found[u64(tail)] = x + u * reach
                found[u64(tail + 1)] = y
                found[u64(tail + 2)] = g + straight * reach
                found[u64(tail + 3)] = 1 - u
                wall = bit(words, at + u * reach)
                tail += 4 - 4 * wall
                beside = reach == 1 and wall != 0
            if v != 0:
                reach = ahead(words, south + col) if v > 0 else back(words, north + col)
                found[u64(tail)] = x
                found[u64(tail + 1)] = y + v * reach
                found[u64(tail + 2)] = g + straight * reach
                found[u64(tail + 3)] = 2 - v
                wall = bit(words, at + reach * down)
                tail += 4 - 4 * wall
                below = reach == 1 and wall != 0
            if d < 4 or (cutting == 0 and (beside or below)):
                break
    return tail


@kernel(out=("node", "nodes", "heap", "state"), inline=True)
def _heed(
    words, stride, width, goal_x, goal_y, straight, bend, cutting, steps, turns, i, tail, found,
    node, nodes, heap, state,
):  # fmt: skip
    """Take up the places found from node i that are new, cheaper, or reached from a new direction."""
    count = state[u64(0)]
    size = state[u64(1)]
    best = state[u64(2)]
    most = len(nodes) // 6
    lag = 1 - cutting
    for k in range(0, tail, 4):
        x = found[u64(k)]
        y = found[u64(k + 1)]
        g = found[u64(k + 2)]
        a = abs(x - goal_x)
        b = abs(y - goal_y)
        f = g + straight * max(a, b) + bend * min(a, b)
        if f >= best:
            continue
        if a + b == 0:
            best = g
            state[u64(3)] = i
            continue
        d = found[u64(k + 3)]
        bits = 1 << d
        if d < 4:
            # One straight step on is ``on``; ``beside`` is the row to the south or the column to the east.
            on = steps[u64(2 * d + 1)] * stride + steps[u64(2 * d)]
            beside = stride if d & 1 == 0 else 1
            at = y * stride + x
            bits |= turns[u64(2 * d)] * (
                bit(words, at + beside - lag * on) & (1 - bit(words, at + beside + cutting * on))
            )
            bits |= turns[u64(2 * d + 1)] * (
                bit(words, at - beside - lag * on) & (1 - bit(words, at - beside + cutting * on))
            )
        cell = u64(y * width + x)
        j = node[cell] + 0
        at = 6 * j
        if not (0 <= j < count and nodes[u64(at)] == x and nodes[u64(at + 1)] == y):
            if count == most:
                state[u64(4)] = 1
                break
            j = count
            at = 6 * j
            count += 1
            node[cell] = j
            nodes[u64(at)] = x
            nodes[u64(at + 1)] = y
            nodes[u64(at + 5)] = -1
        elif g > nodes[u64(at + 2)]:
            continue
        elif g == nodes[u64(at + 2)]:
            # The directions followed already are in the upper byte.
            known = nodes[u64(at + 4)]
            bits &= ~(known | (known >> 8))
            if bits == 0:
                continue
            nodes[u64(at + 4)] = known | bits
            if nodes[u64(at + 5)] < 0:
                size = _push(nodes, heap, size, j, f)
            continue
        nodes[u64(at + 2)] = g
        nodes[u64(at + 3)] = i
        nodes[u64(at + 4)] = bits
        size = _push(nodes, heap, size, j, f)
    state[u64(0)] = count
    state[u64(1)] = size
    state[u64(2)] = best


@kernel()
def _count(nodes, x, y, i, halt):
    """How many cells the path over node i to a cell has."""
    cells = 1
    while i >= 0 and not stopped(halt):
        cells += max(abs(x - nodes[6 * i]), abs(y - nodes[6 * i + 1]))
        x = nodes[6 * i]
        y = nodes[6 * i + 1]
        i = nodes[6 * i + 3]
    return cells


@kernel(out=("path",), each=2000, of=PATH)
def unroll(nodes, x, y, i, path, halt):
    """Write the path over node i to a cell down, cell by cell.

    Parameters
    ----------
    nodes : as :func:`jump` leaves them.
    x, y : the goal, counted from 1.
    i : the last node.
    path : int32, (2 * n,); x and y of the path's n cells, the goal first, both counted from 0.
    """
    length = 1
    path[0] = x - 1
    path[1] = y - 1
    # From each node come diagonals, then straights: backwards straights, until both distances are equal.
    while i >= 0 and not stopped(halt):
        to_x = nodes[6 * i]
        to_y = nodes[6 * i + 1]
        while x != to_x or y != to_y:
            a = abs(x - to_x)
            b = abs(y - to_y)
            if a >= b:
                x += 1 if to_x > x else -1
            if b >= a:
                y += 1 if to_y > y else -1
            path[2 * length] = x - 1
            path[2 * length + 1] = y - 1
            length += 1
            if length % STRETCH == 0 and stopped(halt):
                return
        i = nodes[6 * i + 3]


@kernel(out=("node", "nodes", "heap", "state"), each=1200)
def jump(
    words, east, south, west, north, stride, rise, width,
    start_x, start_y, goal_x, goal_y, budget, straight, diagonal, cutting, steps, turns,
    found, node, nodes, heap, state, halt,
):  # fmt: skip
    """Cheapest path between two cells.

    Parameters ---------- words : uint64; bits, 64 in a word, the lowest first. From bit 0: rows of walls,
        1 where the robot may not be; x and y count from 1, a border of walls runs all around. From the
        bits ``east`` and ``west``: the same rows, 1 where a run along the row has to stop. From ``south``
        and ``north``: columns, likewise.
    stride, rise : bits of a row, bits of a column; multiples of 64.
    width : cells of a row, border included.
    budget : greatest number of expansions; -1: no limit.
    straight, diagonal : costs of a step.
    cutting : 1 where diagonals may cut corners, else 0.
    steps : int64, (16,); x and y of east, south, west, north, south-east, south-west, north-west,
        north-east.
    turns : int64, (8,); the directions, as bits, that a straight run has to follow when it meets a turn
        to the south or east, and to the north or west.
    found : int64, (4 m,); scratch: x, y, cost and direction of places; m is 9, and 8 times the shorter side
        (16 times with corner cutting).
    node : int32, (n,), n cells with the border; scratch, never cleared: the number of a cell's node, if
        that node says so, too.
    nodes : int64, (6 * m,); scratch: x, y, cost, predecessor, directions to follow and followed, place in
        the heap. Should there be more than m, the ending is FULL.
    heap : int64, (2 * m,); scratch: f and node.
    state : int64, (5,); the ending, expansions (of jump points), cells of the path, its exact cost (or -1),
        its last node.
    """
    # The goal is a stop for the time of this search.
    goal = goal_y * stride + goal_x
    goal_col = goal_x * rise + goal_y
    row_bit = u64(1) << (u64(goal) & u64(63))
    col_bit = u64(1) << (u64(goal_col) & u64(63))
    was_east = words[(east + goal) >> 6]
    was_west = words[(west + goal) >> 6]
    was_south = words[(south + goal_col) >> 6]
    was_north = words[(north + goal_col) >> 6]
    words[(east + goal) >> 6] = was_east | row_bit
    words[(west + goal) >> 6] = was_west | row_bit
    words[(south + goal_col) >> 6] = was_south | col_bit
    words[(north + goal_col) >> 6] = was_north | col_bit
    node[start_y * width + start_x] = 0
    nodes[0] = start_x
    nodes[1] = start_y
    nodes[2] = 0
    nodes[3] = -1
    nodes[4] = 255
    nodes[5] = 0
    heap[0] = 0
    heap[1] = 0
    state[0] = 1
    state[1] = 1
    state[2] = 0 if start_x == goal_x and start_y == goal_y else 1 << 62
    state[3] = -1
    state[4] = 0
    expansions = 0
    ending = EXHAUSTED
    while state[1] > 0 and heap[0] < state[2]:
        # A jump point may be a scan of the whole map: each is worth a look.
        if expansions == budget or stopped(halt):
            ending = LIMIT
            break
        expansions += 1
        i = _pull(nodes, heap, state[1])
        state[1] -= 1
        bits = nodes[u64(6 * i + 4)] & 255
        nodes[u64(6 * i + 4)] = (nodes[u64(6 * i + 4)] | bits << 8) & ~255
        tail = _look(
            words, east, south, west, north, stride, rise, goal, nodes[u64(6 * i)], nodes[u64(6 * i + 1)],
            nodes[u64(6 * i + 2)], bits, straight, diagonal, cutting, steps, found,
        )  # fmt: skip
        _heed(
            words, stride, width, goal_x, goal_y, straight, diagonal - straight, cutting, steps, turns, i,
            tail, found, node, nodes, heap, state,
        )  # fmt: skip
        if state[4] == 1:
            ending = FULL
            break
    words[(east + goal) >> 6] = was_east
    words[(west + goal) >> 6] = was_west
    words[(south + goal_col) >> 6] = was_south
    words[(north + goal_col) >> 6] = was_north
    best = state[2]
    last = state[3]
    if ending == EXHAUSTED and best < 1 << 62:
        ending = FOUND
    state[0] = ending
    state[1] = expansions
    state[2] = _count(nodes, goal_x, goal_y, last, halt) if ending == FOUND else 0
    state[3] = best if ending == FOUND else -1
    state[4] = last
