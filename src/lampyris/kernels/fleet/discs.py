"""PIBT for discs of several sizes, which may be larger than cells.

As in :mod:`.pibt`, robots decide by priority, and a robot that is in the way of another's step inherits its priority. With
discs there may be several in the way, and a step may be kept from by robots that are not on any cell of it. Two robots are kept
apart by the closest approach of their steps in the tick, which are straight lines. A robot that cannot leave stays, and the step
that asked it to is given up with all that was decided for its sake. So a robot has to stay against its will at most once
a tick, and what is decided never collides: who has not decided can always stay where it is.

Ours; the rule for single cells: K. Okumura et al., Artificial Intelligence 310, 2022.
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel, stopped
from lampyris.kernels.fleet.pibt import FULL, LIMIT, SOLVED, drawn, rearrange
from lampyris.kernels.fleet.steps import beside

FREE, STAYS = -1, -2


@kernel()
def meets(x, y, vx, vy, need):
    """Whether two robots come nearer in a tick than the root of ``need``.

    ``x``, ``y`` : from one to the other when it begins. ``vx``, ``vy`` : the difference of their steps.
    """
    along = x * vx + y * vy
    if along >= 0:
        return x * x + y * y < need
    length = vx * vx + vy * vy
    if along + length <= 0:
        return (x + vx) * (x + vx) + (y + vy) * (y + vy) < need
    return (x * x + y * y) * length - along * along < need * length


@kernel()
def _is_barred(xy, now, following, kind, need, far, occupied, width, height, i, there):
    """Whether robot ``i`` comes too near one that has decided when it steps to ``there``."""
    here = now[i]
    x = xy[2 * here]
    y = xy[2 * here + 1]
    ex = xy[2 * there] - x
    ey = xy[2 * there + 1] - y
    mine = kind[i]
    kinds = len(far)
    reach = far[mine]
    for v in range(max(0, y - reach), min(height, y + reach + 1)):
        for u in range(max(0, x - reach), min(width, x + reach + 1)):
            j = occupied[v * width + u]
            if j < 0 or j == i or following[j] < 0:
                continue
            to = following[j]
            vx = xy[2 * to] - u - ex
            vy = xy[2 * to + 1] - v - ey
            if meets(u - x, v - y, vx, vy, need[mine * kinds + kind[j]]):
                return True
    return False


@kernel()
def _blocking(xy, now, following, kind, need, far, occupied, width, height, i, there):
    """A robot that has to leave before ``i`` can step to ``there``; FREE if there is none, STAYS if it cannot leave."""
    here = now[i]
    x = xy[2 * here]
    y = xy[2 * here + 1]
    ex = xy[2 * there] - x
    ey = xy[2 * there + 1] - y
    mine = kind[i]
    kinds = len(far)
    reach = far[mine]
    found = FREE
    for v in range(max(0, y - reach), min(height, y + reach + 1)):
        for u in range(max(0, x - reach), min(width, x + reach + 1)):
            j = int(occupied[v * width + u])
            if j < 0 or j == i or (following[j] >= 0 and following[j] != now[j]):
                continue
            if meets(u - x, v - y, -ex, -ey, need[mine * kinds + kind[j]]):
                if following[j] >= 0:
                    return STAYS
                if found == FREE:
                    found = j
    return found


@kernel(out=("choice", "many", "key", "random"))
def _rank(edge, degree, table, never, here, row, choice, base, many, i, key, random):
    """Write the cells that robot ``i`` may go to, best first and ties at random, to ``choice[base:]``."""
    wide = len(edge) // len(degree)
    n = int(degree[here])
    found = 0
    for k in range(n + 1):
        u = int(edge[wide * here + k]) if k < n else int(here)
        far = int(table[row + u])
        if far == never:
            continue
        if k < n:
            one = beside(edge, wide, here, u)
            if one >= 0 and (table[row + one] == never or table[row + u - (one - here)] == never):
                continue
        random[0] = drawn(random[0])
        own = (far << 16) + (random[0] & 65535)
        j = found
        while j > 0 and key[j - 1] > own:
            key[j] = key[j - 1]
            choice[base + j] = choice[base + j - 1]
            j -= 1
        key[j] = own
        choice[base + j] = u
        found += 1
    many[i] = found


@kernel(
    out=(
        "order", "waited", "now", "following", "occupied", "choice", "many", "key", "turn", "mark", "decided", "stack",
        "random", "track", "visited", "tick",
    ),
    of="track",
    each=60_000,
)  # fmt: skip
def run(
    edge, degree, xy, table, never, goals, distance, kind, need, far, width, height, order, waited, now, following,
    occupied, choice, many, key, turn, mark, decided, stack, random, track, visited, tick, most, halt,
):  # fmt: skip
    """Steps until all robots are on their goals at once; SOLVED, LIMIT or FULL, see :func:`lampyris.kernels.fleet.pibt.run`.

    Parameters
    ----------
    edge, degree, table, goals, distance, order, waited, now, following, random, track, visited, tick, most : as there.
    xy : int32, (2 * cells,); the place of each cell.
    never : the entry of a cell that a robot cannot be on.
    kind : int32, (robots,); the size of each robot.
    need : float64, (kinds * kinds,); the squared distance of two sizes, in cells. ``far`` : int32, (kinds,); cells beyond which
        no robot can come too near in a tick.
    width, height : of the map. ``occupied`` : int32, (width * height,); -1.
    choice : int32, (places * robots,). ``key`` : int64, (places,). ``many``, ``turn``, ``mark``, ``decided``, ``stack`` : int32,
        (robots,) each; scratch.
    """
    robots = len(goals)
    cells = len(degree)
    places = len(key)
    for i in range(robots):
        occupied[xy[2 * now[i] + 1] * width + xy[2 * now[i]]] = i
    ending = LIMIT
    while True:
        home = 0
        for i in range(robots):
            if now[i] == goals[i]:
                home += 1
                if visited[i] < 0:
                    visited[i] = tick[0]
        if home == robots:
            ending = SOLVED
            break
        if tick[0] >= most or stopped(halt):
            break
        if (tick[0] + 2) * robots > len(track):
            ending = FULL
            break
        for i in range(robots):
            following[i] = -1
        count = 0
        for r in range(robots):
            root = order[r]
            if following[root] >= 0:
                continue
            if stopped(halt):
                break
            depth = 0
            stack[0] = root
            turn[root] = -1
            ended = 0  # of the robot that was asked last: 1 it leaves, 2 it cannot
            while depth >= 0:
                i = int(stack[depth])
                here = now[i]
                if turn[i] < 0:
                    _rank(
                        edge, degree, table, never, here, i * cells, choice, places * i, many, i, key, random
                    )
                    turn[i] = 0
                elif ended == 2:
                    while count > mark[i]:
                        count -= 1
                        following[decided[count]] = -1
                    turn[i] += 1
                ended = 0
                asked = FREE
                moves = False
                while not moves and asked < 0 and turn[i] < many[i]:
                    there = choice[places * i + turn[i]]
                    if following[i] < 0:
                        if _is_barred(xy, now, following, kind, need, far, occupied, width, height, i, there):
                            turn[i] += 1
                            continue
                        mark[i] = count
                        decided[count] = i
                        count += 1
                        following[i] = there
                    asked = _blocking(xy, now, following, kind, need, far, occupied, width, height, i, there)
                    if asked == STAYS:
                        while count > mark[i]:
                            count -= 1
                            following[decided[count]] = -1
                        turn[i] += 1
                    elif asked == FREE:
                        moves = True
                if asked >= 0:
                    depth += 1
                    stack[depth] = asked
                    turn[asked] = -1
                    continue
                if moves:
                    ended = 1
                else:
                    following[i] = here
                    ended = 2
                depth -= 1
        if stopped(halt):
            break
        for i in range(robots):
            occupied[xy[2 * now[i] + 1] * width + xy[2 * now[i]]] = -1
        tick[0] += 1
        for i in range(robots):
            u = following[i]
            now[i] = u
            occupied[xy[2 * u + 1] * width + xy[2 * u]] = i
            track[tick[0] * robots + i] = u
            waited[i] = 0 if u == goals[i] else waited[i] + 1
        rearrange(order, 0, waited, 0, distance)
    for i in range(robots):
        occupied[xy[2 * now[i] + 1] * width + xy[2 * now[i]]] = -1
    return ending
