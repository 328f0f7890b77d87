"""The walk of AD-GSO over a finished field: a growing window, a choice, a sub-path, again.

Two frames are used. The *map* is flat, row by row: cell = y * width + x. The *window* is a small square
around the robot, flat too, with a margin of two cells (the longest step) that is never open, so that no
step needs a test of bounds there. Both know a step as three offsets: where it leads, and the two cells that
must be open beside it (its own end again where it needs none), so that one rule serves every step set.

``shut`` holds bits: a cell is out of bounds for a choice when it shares a bit with the mask in force.

Over terrain a step costs its price times what the cell it enters weighs. Before paths are measured the
window takes those weights into ``toll``; on plain maps they stay 1. (Taken in with each ring they cost plain
maps 3 %, most of whose windows are never measured.)
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from lampyris.kernels._jit import PATH, kernel, stopped

WALL, OBSTACLE, GATE = 1, 2, 4
"""Bits of ``shut``: never free; under a moving obstacle now; free, but a gate one has yet to stand before."""

GREEDY, ROULETTE, EXACT = 0, 1, 2

ARRIVED, PAUSED, FULL, HEMMED, MET_GATE, SPENT = 0, 1, 2, 3, 4, 5
"""What :func:`walk` returns: at the goal; at the jump asked for; no room left in ``path`` or ``log``;
nothing to accept; stopped before a gate; looked at more cells than allowed."""

WIDTH, HEIGHT, GOAL, RULE, NT, MVR, LEAST = 0, 1, 2, 3, 4, 5, 6
"""Places in ``setup``. LEAST: rings always opened, as far as the longest step reaches, to see the parent."""

AT, LENGTH, JUMPS, LOOKED, DRAWN, FIRST, STOP, ALLOWED, GATE_AT, LOGGED = 0, 1, 2, 3, 4, 5, 6, 7, 8, 9
"""Places in ``tally``: where the walk stands, cells in ``path``, jumps, window cells looked at, draws used,
steps of the first sub-path that moved, the jump to pause at, most cells to look at, the gate that stopped
the walk, numbers in ``log``."""

LOG_HEAD = 6
"""One jump in ``log``: its cell, the chosen cell, whether by parents, where it begins in ``path``, how many
accepted cells, how many rings were opened; then those cells, in the order of the ring table."""

MARGIN = 2
TERRAIN_UNIT = 63
"""What plain ground weighs on a map with terrain; there the prices are those of plain maps."""
CANDIDATE, JOINED = 1, 2


@lru_cache(maxsize=64)
def ring_table(mvr: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Every cell of rings 1..mvr: dx, dy and its place in the window; three int64 arrays.

    Ring by ring, and in each by row, then column.
    """
    side = 2 * (mvr + MARGIN) + 1
    span = range(-mvr, mvr + 1)
    cells = sorted((max(abs(x), abs(y)), y, x) for y in span for x in span if x or y)
    dx = np.array([x for _, _, x in cells], dtype=np.int64)
    dy = np.array([y for _, y, _ in cells], dtype=np.int64)
    return dx, dy, (dy + mvr + MARGIN) * side + dx + mvr + MARGIN


@lru_cache(maxsize=64)
def step_table(offsets: tuple[tuple[int, int], ...], corner_cutting: bool, row: int) -> np.ndarray:
    """Where each step leads and the two cells that must be open beside it, in a frame of ``row`` cells a row.

    int64, three flat offsets a step. A diagonal that may not cut corners needs both side cells; a knight's
    step every cell its segment touches: the straight and the diagonal neighbour between its ends.
    """
    out = []
    for dx, dy in offsets:
        end = dy * row + dx
        if abs(dx) == 2:
            out += [end, dx // 2, dy * row + dx // 2]
        elif abs(dy) == 2:
            out += [end, dy // 2 * row, dy // 2 * row + dx]
        elif dx and dy and not corner_cutting:
            out += [end, dx, dy * row]
        else:
            out += [end, end, end]
    return np.array(out, dtype=np.int64)


@kernel(out=("wall", "mark", "queue"))
def open_window(luc, shut, mask, setup, at, ring_dx, ring_dy, ring_at, near, wall, mark, queue):
    """Open whole rings around ``at`` until nt cells are accepted; return rings opened and cells accepted.

    Accepted cells (lower luciferin, open, joined to ``at`` by steps through accepted cells) end as JOINED in
    ``mark``. The join is taken up again after each ring: a cell of an early ring may be reached only through
    a later one.
    """
    width, height = setup[WIDTH], setup[HEIGHT]
    mvr = setup[MVR]
    x, y = at % width, at // width
    here = luc[at]
    for i in range(len(mark)):
        wall[i] = 1
        mark[i] = 0
    centre = len(mark) // 2
    wall[centre] = 0
    mark[centre] = JOINED
    queue[0] = centre
    tail = 1
    k = 0
    ring = 0
    while ring < mvr and (ring < setup[LEAST] or tail - 1 < setup[NT]):
        ring += 1
        end = (2 * ring + 1) * (2 * ring + 1) - 1
        while k < end:
            cx, cy = x + ring_dx[k], y + ring_dy[k]
            if 0 <= cx < width and 0 <= cy < height:
                cell = cy * width + cx
                if shut[cell] & mask == 0:
                    wall[ring_at[k]] = 0
                    if luc[cell] < here:
                        mark[ring_at[k]] = CANDIDATE
            k += 1
        head = 0
        while head < tail:
            c = queue[head]
            head += 1
            for s in range(0, len(near), 3):
                n = c + near[s]
                if mark[n] == CANDIDATE and wall[c + near[s + 1]] == 0 and wall[c + near[s + 2]] == 0:
                    mark[n] = JOINED
                    queue[tail] = n
                    tail += 1
    return ring, tail - 1


@kernel(out=("toll",))
def weigh(terrain, setup, at, rings, ring_dx, ring_dy, ring_at, mark, toll):
    """What the accepted cells weigh; nothing to do on plain maps."""
    if len(terrain) > 0:
        for k in range((2 * rings + 1) * (2 * rings + 1) - 1):
            if mark[ring_at[k]] == JOINED:
                toll[ring_at[k]] = TERRAIN_UNIT + terrain[at + ring_dy[k] * setup[WIDTH] + ring_dx[k]]


@kernel(out=("dist", "queue", "queued"))
def measure(mark, wall, toll, near, price, dist, queue, queued):
    """Exact cost of the cheapest path from the centre to each accepted cell inside the set; -1 where none.

    Label correction over a first-in first-out ring: with at most three step prices and some dozens of cells
    it is done in little more than one pass; a heap costs more than it saves here. Over terrain cells come
    back more often, and the result is as exact.
    """
    room = len(queue)
    for i in range(len(dist)):
        dist[i] = -1
        queued[i] = 0
    centre = len(mark) // 2
    dist[centre] = 0
    queue[0] = centre
    head = 0
    waiting = 1
    while waiting > 0:
        c = queue[head]
        head = head + 1 if head + 1 < room else 0
        waiting -= 1
        queued[c] = 0
        for k in range(len(price)):
            s = 3 * k
            n = c + near[s]
            if mark[n] == JOINED and wall[c + near[s + 1]] == 0 and wall[c + near[s + 2]] == 0:
                d = dist[c] + price[k] * toll[n]
                if dist[n] < 0 or d < dist[n]:
                    dist[n] = d
                    if queued[n] == 0:
                        queued[n] = 1
                        queue[(head + waiting) % room] = n
                        waiting += 1


@kernel()
def choose(cost, luc, setup, at, draw, rings, ring_dx, ring_dy, ring_at, mark, dist):
    """The accepted cell to jump to, as a place in the ring table; -1 if there is none.

    Greedy: least luciferin, then cost-to-go, row, column. Exact: least path cost + cost-to-go, then luciferin, row,
    column. Roulette: cells in the order of the ring table share [0, 1) in proportion to luc(X) - luc(Y), and
    ``draw`` falls on one.
    """
    width, rule = setup[WIDTH], setup[RULE]
    end = (2 * rings + 1) * (2 * rings + 1) - 1
    best = -1
    if rule == ROULETTE:
        total = 0.0
        for k in range(end):
            if mark[ring_at[k]] == JOINED:
                total += luc[at] - luc[at + ring_dy[k] * width + ring_dx[k]]
        left = draw * total
        for k in range(end):
            if mark[ring_at[k]] == JOINED:
                best = k
                left -= luc[at] - luc[at + ring_dy[k] * width + ring_dx[k]]
                if left < 0.0:
                    break
        return best
    best_luc, best_cost = 0.0, 0
    for k in range(end):
        if mark[ring_at[k]] == JOINED:
            cell = at + ring_dy[k] * width + ring_dx[k]
            this_luc, this_cost = luc[cell], cost[cell]
            if rule == EXACT:
                this_cost += dist[ring_at[k]]
                less = this_cost < best_cost or (this_cost == best_cost and this_luc < best_luc)
            else:
                less = this_luc < best_luc or (this_luc == best_luc and this_cost < best_cost)
            if this_luc == best_luc and this_cost == best_cost:
                # The table goes ring by ring, so among equals rows and columns have to be compared.
                less = ring_dy[k] < ring_dy[best] or (
                    ring_dy[k] == ring_dy[best] and ring_dx[k] < ring_dx[best]
                )
            if best < 0 or less:
                best, best_luc, best_cost = k, this_luc, this_cost
    return best


@kernel(out=("sub_path",))
def follow(cost, step, shut, mask, far, at, to, sub_path):
    """Write the chain of parents from ``at`` to ``to``; return its steps, 0 if it misses or is obstructed.

    Costs fall along the chain, so once they are down to cost(to) it has passed or missed. It may leave the
    window; it costs no more than a path inside it, which bounds its length: of steps at the lowest price, over
    terrain on plain ground, against the highest on the heaviest.
    """
    c = at
    n = 0
    sub_path[0] = at
    while cost[c] > cost[to]:
        s = 3 * step[c]
        if (shut[c + far[s]] | shut[c + far[s + 1]] | shut[c + far[s + 2]]) & mask != 0:
            return 0
        c = c + far[s]
        n += 1
        sub_path[n] = c
    return n if c == to else 0


@kernel(out=("sub_path",))
def trace(setup, at, place, mark, wall, toll, near, price, dist, sub_path):
    """Write the cheapest path inside the accepted set to a window place, as map cells; return its steps.

    From its end backwards, each time to the first predecessor in the order of the step set: a local rule,
    as for parents, so that the path does not depend on the order in which cells were measured.
    """
    width, mvr = setup[WIDTH], setup[MVR]
    side = 2 * (mvr + MARGIN) + 1
    centre = len(mark) // 2
    c = place
    n = 0
    while c != centre:
        sub_path[n] = at + (c // side - mvr - MARGIN) * width + c % side - mvr - MARGIN
        n += 1
        for k in range(len(price)):
            s = 3 * k
            p = c + near[s]
            if (
                mark[p] == JOINED
                and wall[c + near[s + 1]] == 0
                and wall[c + near[s + 2]] == 0
                and dist[p] + price[k] * toll[c] == dist[c]
            ):
                c = p
                break
    sub_path[n] = at
    for i in range((n + 1) // 2):
        j = n - i
        sub_path[i], sub_path[j] = sub_path[j], sub_path[i]
    return n


@kernel(out=("tally", "log"))
def note(setup, tally, at, chosen, by_parents, rings, ring_dx, ring_dy, ring_at, mark, log):
    """Write one jump into ``log``: what it saw and what it chose."""
    first = tally[LOGGED]
    put = first + LOG_HEAD
    for k in range((2 * rings + 1) * (2 * rings + 1) - 1):
        if mark[ring_at[k]] == JOINED:
            log[put] = at + ring_dy[k] * setup[WIDTH] + ring_dx[k]
            put += 1
    log[first] = at
    log[first + 1] = chosen
    log[first + 2] = by_parents
    log[first + 3] = tally[LENGTH] - 1
    log[first + 4] = put - first - LOG_HEAD
    log[first + 5] = rings
    tally[LOGGED] = put


@kernel(
    out=("tally", "path", "log", "wall", "toll", "mark", "dist", "queue", "queued", "sub_path"),
    each=12_000,
    load=3,
    of=PATH,
)
def walk(
    cost, luc, step, shut, terrain, setup, tally, draws, path, log,
    ring_dx, ring_dy, ring_at, near, far, price,
    wall, toll, mark, dist, queue, queued, sub_path, halt,
):  # fmt: skip
    """Jump from window to window until the goal or a reason to stop; return that reason.

    The first sub-path respects moving obstacles. Later ones are a preview and do so where they can: where
    that leaves nothing to accept, the jump is previewed without them, for they will have moved.

    Parameters
    ----------
    cost, luc, step : the field, flat (height * width,).
    shut : bits WALL, OBSTACLE, GATE, flat.
    terrain : uint8, flat; empty on plain maps, and ``toll`` then holds 1 everywhere.
    setup, tally : see WIDTH.. and AT..; ``tally`` is read and written, so that a paused walk can go on.
    draws : numbers in [0, 1), one a jump, for roulette.
    path : flat cells; path[0] is the start, ``tally[LENGTH]`` of them are set.
    log : the record, see LOG_HEAD; empty: none is kept.
    ring_dx .. price : the tables of :func:`ring_table` and :func:`step_table`, and the steps' exact costs,
        over terrain divided by 63.
    wall .. sub_path : room to work in, (2 mvr + 2 MARGIN + 1) squared each, ``sub_path`` three times as much, over
        terrain fifteen times.
    """
    while True:
        at = tally[AT]
        if at == setup[GOAL]:
            return ARRIVED
        # Between two jumps a walk can be taken up again.
        if tally[JUMPS] >= tally[STOP] or stopped(halt):
            return PAUSED
        if tally[LENGTH] + len(sub_path) > len(path):
            return FULL
        if len(log) > 0 and tally[LOGGED] + LOG_HEAD + len(mark) > len(log):
            return FULL
        mask = WALL | OBSTACLE
        rings, accepted = open_window(
            luc, shut, mask, setup, at, ring_dx, ring_dy, ring_at, near, wall, mark, queue
        )
        tally[LOOKED] += (2 * rings + 1) * (2 * rings + 1) - 1
        if accepted == 0 and tally[LENGTH] > 1:
            mask = mask & WALL  # a plain 1 would be of another type, and the callee compiled twice
            rings, accepted = open_window(
                luc, shut, mask, setup, at, ring_dx, ring_dy, ring_at, near, wall, mark, queue
            )
            tally[LOOKED] += (2 * rings + 1) * (2 * rings + 1) - 1
        if tally[LOOKED] > tally[ALLOWED]:
            return SPENT
        if accepted == 0:
            return HEMMED
        draw = 0.0
        if setup[RULE] == ROULETTE:
            draw = draws[tally[DRAWN]]
            tally[DRAWN] += 1
        if setup[RULE] == EXACT:
            weigh(terrain, setup, at, rings, ring_dx, ring_dy, ring_at, mark, toll)
            measure(mark, wall, toll, near, price, dist, queue, queued)
        k = choose(cost, luc, setup, at, draw, rings, ring_dx, ring_dy, ring_at, mark, dist)
        chosen = at + ring_dy[k] * setup[WIDTH] + ring_dx[k]
        steps = follow(cost, step, shut, mask, far, at, chosen, sub_path)
        by_parents = 1 if steps > 0 else 0
        if steps == 0:
            if setup[RULE] != EXACT:
                weigh(terrain, setup, at, rings, ring_dx, ring_dy, ring_at, mark, toll)
                measure(mark, wall, toll, near, price, dist, queue, queued)
            steps = trace(setup, at, ring_at[k], mark, wall, toll, near, price, dist, sub_path)
        if len(log) > 0:
            note(setup, tally, at, chosen, by_parents, rings, ring_dx, ring_dy, ring_at, mark, log)
        tally[JUMPS] += 1
        done = 0
        while done < steps and shut[sub_path[done + 1]] & GATE == 0:
            done += 1
            path[tally[LENGTH]] = sub_path[done]
            tally[LENGTH] += 1
        tally[AT] = sub_path[done]
        if tally[FIRST] == 0:
            tally[FIRST] = done
        if done < steps:
            tally[GATE_AT] = sub_path[done + 1]
            return MET_GATE
