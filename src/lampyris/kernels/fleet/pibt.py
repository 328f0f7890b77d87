"""PIBT: the next cell of every robot, by priority inheritance with backtracking and the swap rule.

K. Okumura, M. Machida, X. Defago, Y. Tamura, "Priority inheritance with backtracking for iterative multi-agent path
finding", Artificial Intelligence 310, 2022; the swap rule: K. Okumura, "Improving LaCAM for scalable eventually optimal
multi-agent pathfinding", IJCAI 2023, appendix; hindrance as the tie-break: "Lightweight and effective preference
construction in PIBT for large-scale multi-agent pathfinding", arXiv 2505.12623.

Robots decide in the order of their priorities. A robot tries its cells by distance to its goal; if another robot that
has not decided stands on one, that robot inherits the priority and has to decide first; if it cannot leave, the next
cell is tried. The recursion is an explicit stack, and a robot is on it at most once.

Cells are numbers of free cells; ``edge``, ``degree`` and ``passing``: see :mod:`.steps`. With octile moves a robot also tries
its next cell if a robot that has decided crosses its diagonal step.
"""

from __future__ import annotations

from lampyris.kernels._helpers import LOOK, fetch
from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.fleet.steps import crosses

SOLVED, LIMIT, FULL = 0, 1, 2
MASK = 0xFFFFFFFF
MISSING = 2**31 - 1
"""In place of the distance from a wall."""
AHEAD = 6
"""Robots between fetching what is read of one, and reading it."""


@kernel(inline=True)
def drawn(state):
    """The next state of a 32-bit xorshift generator (Marsaglia 2003); never 0 if ``state`` is not."""
    state ^= (state << 13) & MASK
    state ^= state >> 17
    return state ^ ((state << 5) & MASK)


@kernel()
def _exits(edge, degree, goals, occupant, back, cell):
    """From ``cell``, come to from ``back``: how many cells one can go on to, at most 2, and one of them.

    A dead end whose robot is on its goal is none: that robot need not move. Returned as ``cell * 16 + count``.
    """
    wide = len(edge) // len(degree)
    count = 0
    on = 0
    for k in range(degree[cell]):
        u = edge[wide * cell + k]
        if u == back:
            continue
        if degree[u] == 1 and occupant[u] >= 0 and goals[occupant[u]] == u:
            continue
        count += 1
        on = int(u)
        if count == 2:
            break
    return on * 16 + count


@kernel()
def _is_swap_required(edge, degree, table, goals, occupant, pusher, puller, front, back):
    """Whether ``pusher``, on ``front``, cannot pass ``puller``, on ``back``, unless the two swap their cells.

    The pusher is moved down its distances, the puller in front of it, until there is room to pass or one of them would
    be content.
    """
    cells = len(degree)
    mine = pusher * cells
    theirs = puller * cells
    while table[mine + back] < table[mine + front]:
        found = _exits(edge, degree, goals, occupant, front, back)
        if found % 16 >= 2:
            return False
        if found % 16 == 0:
            break
        front = back
        back = found // 16
    if table[theirs + front] >= table[theirs + back]:
        return False
    return table[mine + front] == 0 or table[mine + back] < table[mine + front]


@kernel()
def _is_swap_possible(edge, degree, goals, occupant, front, back):
    """Whether who leaves ``front`` by way of ``back`` comes to a cell with room for two to pass."""
    origin = front
    while back != origin:
        found = _exits(edge, degree, goals, occupant, front, back)
        if found % 16 >= 2:
            return True
        if found % 16 == 0:
            return False
        front = back
        back = found // 16
    return False


@kernel()
def _partner(edge, degree, table, goals, now, following, occupant, i, first):
    """The robot with which robot ``i``, which prefers ``first``, has to swap cells, or -1.

    With four-connected moves a cell ``first`` that is passing (see :mod:`.steps`) need not be asked about.
    """
    wide = len(edge) // len(degree)
    here = now[i]
    has_room = _exits(edge, degree, goals, occupant, here, first) % 16 >= 2
    if has_room and wide == 4:  # ``first`` is nearer to the goal, so that nobody needs to swap: see below
        return -1
    a = occupant[first]
    if (
        a >= 0
        and following[a] < 0
        and _is_swap_required(edge, degree, table, goals, occupant, i, a, here, first)
        and _is_swap_possible(edge, degree, goals, occupant, first, here)
    ):
        return int(a)
    # With room to pass on ``first`` nobody needs to swap with robot ``i``, to which it is no farther than its own cell.
    if has_room:
        return -1
    for k in range(degree[here]):
        u = edge[wide * here + k]
        a = occupant[u]
        if (
            a >= 0
            and u != first
            and _is_swap_required(edge, degree, table, goals, occupant, a, i, here, first)
            and _is_swap_possible(edge, degree, goals, occupant, first, here)
        ):
            return int(a)
    return -1


@kernel(out=("choice", "reserved"))
def _look(edge, degree, table, now, reserved, choice, places):
    """Write each robot's distances from the cells around it, then from its own, to ``choice[places * i:]``; count at
    ``reserved[cells + u]`` the robots that come nearer to their goals by cell u.

    Each robot's row of the table is elsewhere in memory. Here no reading waits for another, so rows are fetched at once, and
    nothing but the swap rule reads the tables again. With four-connected moves there are always four distances, ``MISSING``
    for a wall, so that no branch depends on the map.
    """
    robots = len(now)
    cells = u64(len(degree))
    wide = u64(len(edge)) // cells
    row = u64(0)
    base = u64(0)
    if wide == u64(4):
        for i in range(robots):
            if i + AHEAD < robots:
                here = u64(now[u64(min(i + 2 * AHEAD, robots - 1))])
                fetch(edge, u64(4) * here)
                here = u64(now[u64(i + AHEAD)])
                later = row + u64(AHEAD) * cells
                fetch(table, later + here)
                fetch(table, later + u64(edge[u64(4) * here]))
                fetch(table, later + u64(edge[u64(4) * here + u64(3)]))
            here = u64(now[i])
            n = int(degree[here])
            own = int(table[row + here])
            for k in range(4):
                u = u64(edge[u64(4) * here + u64(k)]) if k < n else here
                distance = int(table[row + u])
                reserved[cells + u] += int(distance < own)
                choice[base + u64(k)] = distance if k < n else MISSING
            choice[base + u64(4)] = own
            row += cells
            base += u64(5)
        return
    for i in range(robots):
        here = u64(now[i])
        n = int(degree[here])
        own = int(table[row + here])
        for k in range(n):
            u = u64(edge[wide * here + u64(k)])
            distance = int(table[row + u])
            choice[base + u64(k)] = distance
            reserved[cells + u] += int(distance < own)
        choice[base + u64(n)] = own
        row += cells
        base += u64(places)


@kernel(inline=True, out=("choice", "random"))
def _rank(edge, degree, now, reserved, choice, random, i):
    """As :func:`_rank_any` with four-connected moves, where a cell beside the robot's is never as far as its own.

    The five keys are sorted by a network of nine exchanges; a key ends with the number of its cell.
    """
    cells = u64(len(degree))
    own = int(now[u64(i)])
    here = u64(own)
    base = u64(5) * u64(i)
    row = u64(4) * here
    n = int(degree[here])
    state = drawn(random[0])
    random[0] = state
    b = u64(edge[row]) if n > 0 else here
    c = u64(edge[row + u64(1)]) if n > 1 else here
    d = u64(edge[row + u64(2)]) if n > 2 else here
    e = u64(edge[row + u64(3)]) if n > 3 else here
    last = int(choice[base + u64(4)])
    p = int(choice[base])
    q = int(choice[base + u64(1)])
    r = int(choice[base + u64(2)])
    s = int(choice[base + u64(3)])
    p = (((p << 8) + int(reserved[cells + b]) - int(p < last)) << 11) + ((state & 255) << 3)
    q = (((q << 8) + int(reserved[cells + c]) - int(q < last)) << 11) + (((state >> 8) & 255) << 3) + 1
    r = (((r << 8) + int(reserved[cells + d]) - int(r < last)) << 11) + (((state >> 16) & 255) << 3) + 2
    s = (((s << 8) + int(reserved[cells + e]) - int(s < last)) << 11) + (((state >> 24) & 255) << 3) + 3
    t = (last << 19) + 4
    p, q = (p, q) if p < q else (q, p)
    r, s = (r, s) if r < s else (s, r)
    p, r = (p, r) if p < r else (r, p)
    q, s = (q, s) if q < s else (s, q)
    q, r = (q, r) if q < r else (r, q)
    p, t = (p, t) if p < t else (t, p)
    q, t = (q, t) if q < t else (t, q)
    r, t = (r, t) if r < t else (t, r)
    s, t = (s, t) if s < t else (t, s)
    p &= 7
    q &= 7
    r &= 7
    s &= 7
    t &= 7
    choice[base] = own if p == 4 else int(edge[row + u64(p)])
    choice[base + u64(1)] = own if q == 4 else int(edge[row + u64(q)])
    choice[base + u64(2)] = own if r == 4 else int(edge[row + u64(r)])
    choice[base + u64(3)] = own if s == 4 else int(edge[row + u64(s)])
    choice[base + u64(4)] = own if t == 4 else int(edge[row + u64(t)])


@kernel(out=("choice", "key", "random"))
def _rank_any(edge, degree, now, reserved, choice, key, random, i):
    """Write the cells that robot ``i`` may go to, best first, to ``choice[len(key) * i:]``, where their distances are.

    By distance to its goal; of equal ones first those that fewest neighbours come nearer to their goals by
    (hindrance), then at random.
    """
    cells = len(degree)
    wide = len(edge) // cells
    here = now[i]
    base = len(key) * i
    n = int(degree[here])
    state = drawn(random[0])
    more = drawn(state) if n > 4 else state
    random[0] = more
    for k in range(n + 1):
        key[k] = int(choice[base + k]) << 16
    own = key[n] >> 16
    for k in range(n):
        distance = key[k] >> 16
        tie = False
        for j in range(n):
            tie = tie or (j != k and key[j] >> 16 == distance)
        if tie:
            u = int(edge[wide * here + k])
            hindered = int(reserved[cells + u]) - int(distance < own)
            key[k] += (hindered << 8) + (((state if k < 4 else more) >> (8 * (k % 4))) & 255)
    for k in range(n + 1):
        u = int(edge[wide * here + k]) if k < n else int(here)
        own = key[k]
        j = k
        while j > 0 and key[j - 1] > own:
            key[j] = key[j - 1]
            choice[base + j] = choice[base + j - 1]
            j -= 1
        key[j] = own
        choice[base + j] = u


@kernel(out=("following", "occupant", "reserved", "choice", "key", "turn", "partner", "stack", "random"))
def step(
    edge, degree, passing, table, goals, order, base, now, following, occupant, reserved, choice, key, turn, partner,
    stack, random, swapping, halt,
):  # fmt: skip
    """Decide the next cell of every robot; whether all could (without given cells, they always can).

    Parameters
    ----------
    edge, degree, passing : see :mod:`.steps`. ``table`` : (robots * cells,), see :mod:`.distances`.
    goals, now : int32, (robots,); cells.
    order, base : int32; the robots by falling priority are ``order[base:base + robots]``.
    following : int32, (robots,); the result. Given: -1, or a cell that the robot has to go to.
    occupant : int32, (cells,); the robot that is there now, or -1.
    reserved : uint8, (2 * cells,); 1 where a robot is next (the given ones), or 0; then scratch, 0.
    choice, key, turn, partner, stack : int32, (places * robots,), int64, (places,), and int32, (robots,) each; scratch. A robot
        may go to 5 places with four-connected, 9 with octile moves.
    random : int64, (1,); state of the generator, 1 .. 2**32 - 1.
    swapping : whether the swap rule applies.
    """
    cells = len(degree)
    wide = len(edge) // cells
    places = u64(len(key))
    straight = wide == 4  # then the first cell is nearer than the robot's own, unless it is that
    _look(edge, degree, table, now, reserved, choice, len(key))
    fits = True
    for r in range(len(goals)):
        root = int(order[u64(base + r)])
        if following[u64(root)] >= 0:
            continue
        if r % LOOK == 0 and stopped(halt):
            fits = False
            break
        if r + AHEAD < len(goals):
            later = u64(order[u64(base + r + AHEAD)])
            fetch(choice, places * later)
            fetch(edge, u64(wide) * u64(now[later]))
        depth = 0
        stack[0] = root
        turn[u64(root)] = -1
        ended = 0  # of the robot that was pushed last: 1 it moves, 2 it cannot
        while depth >= 0:
            i = int(stack[u64(depth)])
            here = int(now[u64(i)])
            n = int(degree[u64(here)])
            at = places * u64(i)
            k = int(turn[u64(i)])
            if k < 0:
                if straight:
                    _rank(edge, degree, now, reserved, choice, random, i)
                else:
                    _rank_any(edge, degree, now, reserved, choice, key, random, i)
                partner[u64(i)] = -1
                first = int(choice[at])
                if swapping and first != here and (not straight or passing[u64(first)] == 0):
                    found = _partner(edge, degree, table, goals, now, following, occupant, i, first)
                    if found >= 0:
                        partner[u64(i)] = found
                        low = at
                        high = at + u64(n)
                        while low < high:
                            u = choice[low]
                            choice[low] = choice[high]
                            choice[high] = u
                            low += u64(1)
                            high -= u64(1)
                k = 0
            elif ended == 2:
                k += 1
            moves = ended == 1
            ended = 0
            pushed = False
            while not moves and not pushed and k <= n:
                u = int(choice[at + u64(k)])
                a = int(occupant[u64(u)])
                if (
                    reserved[u64(u)] != 0
                    or (a >= 0 and following[u64(a)] == here)
                    or (not straight and crosses(edge, wide, occupant, following, here, u))
                ):
                    k += 1
                    continue
                reserved[u64(u)] = 1
                following[u64(i)] = u
                if a >= 0 and a != i and following[u64(a)] < 0:
                    depth += 1
                    stack[u64(depth)] = a
                    turn[u64(a)] = -1
                    pushed = True
                else:
                    moves = True
            turn[u64(i)] = k
            if pushed:
                continue
            if moves:
                a = int(partner[u64(i)])
                if (
                    a >= 0
                    and k == 0
                    and following[u64(a)] < 0
                    and reserved[u64(here)] == 0
                    and (straight or not crosses(edge, wide, occupant, following, int(now[u64(a)]), here))
                ):
                    following[u64(a)] = here
                    reserved[u64(here)] = 1
                ended = 1
            else:
                reserved[u64(here)] = 1
                following[u64(i)] = here
                ended = 2
            depth -= 1
        if ended == 2:
            fits = False
            break
    if cells < 8 * len(goals):
        for u in range(cells, 2 * cells):
            reserved[u64(u)] = 0
        return fits
    for i in range(len(goals)):
        here = int(now[i])
        for k in range(degree[here]):
            reserved[cells + edge[wide * here + k]] = 0
    return fits


@kernel(out=("order",))
def rearrange(order, base, waited, since, distance):
    """Sort the robots of ``order[base:]`` by falling priority: ticks off the goal, then distance at the start.

    Nearly sorted to begin with, so insertion is quick. ``waited[since + i]`` are the ticks of robot i.
    """
    for r in range(1, len(distance)):
        i = order[base + r]
        ticks = waited[since + i]
        far = distance[i]
        k = r
        while k > 0:
            j = order[base + k - 1]
            if waited[since + j] > ticks or (waited[since + j] == ticks and distance[j] >= far):
                break
            order[base + k] = j
            k -= 1
        order[base + k] = i


@kernel(out=("order", "waited", "arrived", "resting"))
def _resort(order, waited, distance, goals, now, arrived, resting):
    """Count another tick in ``waited``, and sort the robots as :func:`rearrange` does, from their order of the tick before.

    Robots off their goals keep their order, and those that have just left one come behind the others. Only the few that arrived
    are sorted, by distance, and merged with those that were there. ``arrived``, ``resting`` : int32, (robots,); scratch.
    """
    off = 0
    came = 0
    rest = 0
    for r in range(len(order)):
        i = int(order[r])
        if now[i] != goals[i]:
            waited[i] += 1
            order[off] = i
            off += 1
        elif waited[i] > 0:
            waited[i] = 0
            k = came
            while k > 0 and distance[arrived[k - 1]] < distance[i]:
                arrived[k] = arrived[k - 1]
                k -= 1
            arrived[k] = i
            came += 1
        else:
            resting[rest] = i
            rest += 1
    m = 0
    for k in range(rest):
        i = int(resting[k])
        while m < came and distance[arrived[m]] >= distance[i]:
            order[off + k + m] = arrived[m]
            m += 1
        order[off + k + m] = i
    while m < came:
        order[off + rest + m] = arrived[m]
        m += 1


@kernel(
    out=(
        "order", "waited", "now", "following", "occupant", "reserved", "choice", "key", "turn", "partner", "stack",
        "random", "track", "visited", "tick",
    ),
    of="track",
    each=15_000,
)  # fmt: skip
def run(
    edge, degree, passing, table, goals, distance, order, waited, now, following, occupant, reserved, choice, key, turn,
    partner, stack, random, swapping, track, visited, tick, most, halt,
):  # fmt: skip
    """Steps of PIBT until all robots are on their goals at once; SOLVED, LIMIT or FULL.

    Parameters
    ----------
    edge .. random, swapping : as for :func:`step`; ``distance``, int32, (robots,), as for :func:`rearrange`.
    order, waited : int32, (robots,); the robots by falling priority, and their ticks off the goal.
    track : int32, (ticks, robots); the cells of tick 0 are there. FULL: there was no room for another tick.
    visited : int32, (robots,); the first tick at which each robot was on its goal, or -1.
    tick : int64, (1,); the last tick that is written.
    most : tick after which to give up.
    """
    robots = len(goals)
    for i in range(robots):
        occupant[now[i]] = i
    ending = LIMIT
    is_sorted = False  # goals, and with them distances, may be others than in the last call
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
        step(
            edge, degree, passing, table, goals, order, 0, now, following, occupant, reserved, choice, key, turn, partner,
            stack, random, swapping, halt,
        )  # fmt: skip
        if stopped(halt):
            break
        for i in range(robots):
            occupant[now[i]] = -1
            reserved[following[i]] = 0
        tick[0] += 1
        for i in range(robots):
            u = following[i]
            now[i] = u
            occupant[u] = i
            track[tick[0] * robots + i] = u
        if not is_sorted:
            rearrange(order, 0, waited, 0, distance)
            is_sorted = True
        _resort(order, waited, distance, goals, now, stack, partner)
    for i in range(robots):
        occupant[now[i]] = -1
    return ending
