"""Polyanya: shortest paths in the plane, over a mesh of rectangles of free squares.

Cui, Harabor, Grastien, "Compromise-free pathfinding on a navigation mesh", IJCAI 2017, 496-502.

The lattice is that of :mod:`lampyris.kernels.map_models.visibility`: square (c, r) spans 2 c to 2 c + 2, corners of
squares are even, their centres odd; a line may run along the sides of blocked squares and through their corners. The
mesh is that of :mod:`.rectangle_mesh`.
A search node is a root, a side of a rectangle that is being entered, and the two rays from the root that bound what
it sees of that side. Rays are held as the whole points through which they run, never as the fractional points at
which they end: all decisions on what is seen are exact, in integers, and only lengths are floats.
"""

from __future__ import annotations

from math import sqrt

from lampyris.kernels._jit import PATH, kernel, stopped, u64
from lampyris.kernels.heap import put, take
from lampyris.kernels.map_models.corner_flags import LINE_X, LINE_Y, PORT, TOWARDS_X, TOWARDS_Y, TURN

FOUND, EXHAUSTED, LIMIT, FULL = 0, 1, 2, 3
ENDED = -2
"""Instead of a side: the node is the goal."""
POINT = -1
"""Instead of a side: everything around the root is in sight."""
CORNER = -3
"""Instead of a side: a corner on the chain of parents, which is not expanded."""
FIELDS = 10
"""Whole numbers of a node: root x and y; left ray; right ray; side, rectangle, parent; spare."""
EQUAL = 1e-9
"""Half squares by which two lengths to one corner may differ and still be the same."""


@kernel()
def _apart(ax, ay, bx, by):
    """Distance between two points."""
    return sqrt(float((bx - ax) * (bx - ax) + (by - ay) * (by - ay)))


@kernel()
def _side_of(rx, ry, ax, ay, bx, by):
    """Over 0 where b is to the left of the ray from r over a (with y upwards; so to its right on a map)."""
    return (ax - rx) * (by - ry) - (ay - ry) * (bx - rx)


@kernel()
def _estimate(rx, ry, lx, ly, qx, qy, sx, sy, tx, ty, gx, gy):
    """Least length from a root to the goal through what is seen of a side: the goal mirrored at its line if it lies
    on the root's side.

    Parameters
    ----------
    lx, ly, qx, qy : points on the left and the right ray.
    sx, sy, tx, ty : right and left end of the side.
    """
    x = float(gx)
    y = float(gy)
    if sy == ty:
        here = float(ry - sy)
        if here * (y - sy) > 0.0:
            y = 2.0 * sy - y
        if here == 0.0:
            # The root is an end of the side, or on its line: what it sees begins at the nearer end.
            near = min(max(rx, min(sx, tx)), max(sx, tx))
            return _apart(rx, ry, near, sy) + sqrt((x - near) * (x - near) + (y - sy) * (y - sy))
        a = rx + (lx - rx) * (float(sy - ry) / float(ly - ry)) if ly != ry else float(tx)
        b = rx + (qx - rx) * (float(sy - ry) / float(qy - ry)) if qy != ry else float(sx)
        at = rx + (x - rx) * (here / (float(ry) - y)) if y != ry else float(rx)
        at = min(max(at, min(a, b)), max(a, b))
        return sqrt((at - rx) * (at - rx) + here * here) + sqrt((x - at) * (x - at) + (y - sy) * (y - sy))
    here = float(rx - sx)
    if here * (x - sx) > 0.0:
        x = 2.0 * sx - x
    if here == 0.0:
        near = min(max(ry, min(sy, ty)), max(sy, ty))
        return _apart(rx, ry, sx, near) + sqrt((x - sx) * (x - sx) + (y - near) * (y - near))
    a = ry + (ly - ry) * (float(sx - rx) / float(lx - rx)) if lx != rx else float(ty)
    b = ry + (qy - ry) * (float(sx - rx) / float(qx - rx)) if qx != rx else float(sy)
    at = ry + (y - ry) * (here / (float(rx) - x)) if x != rx else float(ry)
    at = min(max(at, min(a, b)), max(a, b))
    return sqrt(here * here + (at - ry) * (at - ry)) + sqrt((x - sx) * (x - sx) + (y - at) * (y - at))


@kernel()
def _turns(corner, stride, rx, ry, x, y, hand):
    """1 where a path from r may turn at a corner, to the left (``hand`` 1) or to the right (-1)."""
    if (x | y) & 1:
        return 0
    flags = corner[u64((y >> 1) * stride + (x >> 1))]
    if flags & TURN == 0:
        return 0
    across = x - rx if flags & TOWARDS_Y else rx - x
    along = ry - y if flags & TOWARDS_X else y - ry
    return 1 if across * hand >= 0 and along * hand >= 0 else 0


@kernel(out=("nodes", "f", "h", "g", "place", "state"))
def _add(rx, ry, lx, ly, qx, qy, side, rect, parent, length, more, nodes, f, h, g, place, state):
    """Make a node, if there is room; :func:`_sort_in` puts it into the heap."""
    j = int(state[0])
    if j == len(f):
        state[1] = 1
        return
    state[0] = j + 1
    at = FIELDS * j
    nodes[u64(at)] = rx
    nodes[u64(at + 1)] = ry
    nodes[u64(at + 2)] = lx
    nodes[u64(at + 3)] = ly
    nodes[u64(at + 4)] = qx
    nodes[u64(at + 5)] = qy
    nodes[u64(at + 6)] = side
    nodes[u64(at + 7)] = rect
    nodes[u64(at + 8)] = parent
    g[u64(j)] = length
    h[u64(j)] = more
    f[u64(j)] = length + more
    place[u64(j)] = 0


@kernel(out=("heap", "place"))
def _sort_in(begin, end, nodes, f, h, heap, place):
    """Put the nodes of one expansion into the heap but for the best of them; return that, -1 if there are none.

    Most expansions make one node, which is often the next to be expanded: it need not pass through the heap.
    """
    best = -1
    for j in range(begin, end):
        if nodes[u64(FIELDS * j + 6)] == CORNER:
            continue
        if best < 0:
            best = j
        elif f[u64(j)] < f[u64(best)] or (f[u64(j)] == f[u64(best)] and h[u64(j)] < h[u64(best)]):
            put(heap, place, f, h, best)
            best = j
        else:
            put(heap, place, f, h, j)
    return best


@kernel(out=("best", "seen"))
def _worse(best, seen, run, at, length, ties):
    """1 where a corner has been reached by a shorter path (or, ``ties`` 0, one as short); else its length is kept."""
    if seen[u64(at)] == run:
        known = best[u64(at)]
        if length > known + EQUAL or (ties == 0 and length > known - EQUAL):
            return 1
        if length < known:
            best[u64(at)] = length
        return 0
    seen[u64(at)] = run
    best[u64(at)] = length
    return 0


@kernel(out=("port_best", "port_seen", "nodes", "f", "h", "g", "place", "state"))
def _reach_points(
    corner, stride, port_first, ports, gx, gy, home, run, port_best, port_seen, rx, ry, length, lx, ly,
    qx, qy, open_left, open_right, left_turn, right_turn, to_left, to_right, u, here, nodes, f, h, g,
    place, state,
):  # fmt: skip
    """Make the nodes of the goal, if it is on this rectangle (``home`` 1), and of the rectangle's ports."""
    # The goal, and the ports of this rectangle.
    last = port_first[u64(here + 1)]
    start = port_first[u64(here)] - home
    for i in range(start, last):
        x = gx
        y = gy
        v = -1
        if i >= port_first[u64(here)]:
            v = int(ports[u64(i)])
            y = 2 * (v // stride)
            x = 2 * v - y * stride
        turned = 0
        if open_left == 0 and _side_of(rx, ry, lx, ly, x, y) > 0:
            turned = 1 if left_turn else 3
        elif open_right == 0 and _side_of(rx, ry, qx, qy, x, y) < 0:
            turned = 2 if right_turn else 3
        if turned == 3:
            continue
        through = length + _apart(rx, ry, x, y)
        if turned == 1:
            through = to_left + _apart(lx, ly, x, y)
        elif turned == 2:
            through = to_right + _apart(qx, qy, x, y)
        if v >= 0 and _worse(port_best, port_seen, run, v, through, 0):
            continue
        parent = u
        if turned:
            # The corner has to be on the chain of parents.
            parent = int(state[0])
            if parent == len(f):
                state[1] = 1
                break
            state[0] = parent + 1
            nodes[u64(FIELDS * parent)] = lx if turned == 1 else qx
            nodes[u64(FIELDS * parent + 1)] = ly if turned == 1 else qy
            nodes[u64(FIELDS * parent + 6)] = CORNER
            nodes[u64(FIELDS * parent + 8)] = u
        _add(
            x, y, x, y, x, y, POINT if v >= 0 else ENDED, -1, parent, through, _apart(x, y, gx, gy),
            nodes, f, h, g, place, state,
        )  # fmt: skip


@kernel(out=("best", "seen", "nodes", "f", "h", "g", "place", "state"))
def _cross_sides(
    corner, stride, first, sides, out, open_to, gx, gy, run, best, seen, came, rx, ry, length, lx, ly,
    qx, qy, open_left, open_right, left_turn, right_turn, to_left, to_right, u, here, nodes, f, h, g,
    place, state,
):  # fmt: skip
    """Make the nodes of all sides through which a rectangle is left: of what is seen, and of what a turn leads to.

    Parameters
    ----------
    came : the rectangle before; -1: none.
    rx, ry, length : the root, and the length of the path to it.
    lx, ly, qx, qy : points on the left and the right ray, unless ``open_left``, ``open_right``.
    left_turn, right_turn, to_left, to_right : whether the path may turn where they end, and its lengths up to there.
    u, here : the node, and the rectangle.
    """
    for s in range(first[u64(here)], first[u64(here + 1)]):
        dx = sides[u64(5 * s)] + 0
        dy = sides[u64(5 * s + 1)] + 0
        cx = sides[u64(5 * s + 2)] + 0
        cy = sides[u64(5 * s + 3)] + 0
        behind = sides[u64(5 * s + 4)] + 0
        if behind == came:
            # Two rectangles share one side at the most.
            continue
        if out[u64(behind)] >= 0 and open_to[u64(behind)] != run and out[u64(here)] != behind:
            continue
        # Which parts are seen, and which are reached by a turn: left end of each part, then its right end.
        part_left = 0
        part_seen = 1
        part_right = 0
        alx = cx
        aly = cy
        arx = dx
        ary = dy
        if _side_of(rx, ry, dx, dy, cx, cy) == 0:
            # The side is in line with the root: it is entered at its nearer end.
            if not ((cx == rx and cy == ry) or (dx == rx and dy == ry)):
                nearer_c = abs(cx - rx) + abs(cy - ry) < abs(dx - rx) + abs(dy - ry)
                x = cx if nearer_c else dx
                y = cy if nearer_c else dy
                v = (y >> 1) * stride + (x >> 1)
                on = 1
                if open_left == 0 and _side_of(rx, ry, lx, ly, x, y) > 0:
                    on = 0
                if open_right == 0 and _side_of(rx, ry, qx, qy, x, y) < 0:
                    on = 0
                part_seen = 0
                if on == 1 and corner[u64(v)] & TURN != 0:
                    through = length + _apart(rx, ry, x, y)
                    if _worse(best, seen, run, v, through, 1) == 0:
                        more = _estimate(x, y, cx, cy, dx, dy, dx, dy, cx, cy, gx, gy)
                        _add(
                            x, y, cx, cy, dx, dy, s, here, u, through, more,
                            nodes, f, h, g, place, state,
                        )  # fmt: skip
                if on == 1:
                    continue
        if open_left == 0:
            if _side_of(rx, ry, lx, ly, dx, dy) >= 0:
                part_left = 1
                part_seen = 0
            elif _side_of(rx, ry, lx, ly, cx, cy) > 0:
                part_left = 2
                alx = lx
                aly = ly
        if open_right == 0:
            if _side_of(rx, ry, qx, qy, cx, cy) <= 0:
                part_right = 1
                part_seen = 0
            elif _side_of(rx, ry, qx, qy, dx, dy) < 0:
                part_right = 2
                arx = qx
                ary = qy
        if part_seen:
            more = _estimate(rx, ry, alx, aly, arx, ary, dx, dy, cx, cy, gx, gy)
            _add(
                rx, ry, alx, aly, arx, ary, s, here, u, length, more,
                nodes, f, h, g, place, state,
            )  # fmt: skip
        for turn in range(2):
            part = part_left if turn == 0 else part_right
            if part == 0 or (left_turn if turn == 0 else right_turn) == 0:
                continue
            x = lx if turn == 0 else qx
            y = ly if turn == 0 else qy
            through = to_left if turn == 0 else to_right
            parent = u
            alx2 = cx
            aly2 = cy
            arx2 = dx
            ary2 = dy
            if part == 2 and turn == 0:
                arx2 = 2 * x - rx
                ary2 = 2 * y - ry
            if part == 2 and turn == 1:
                alx2 = 2 * x - rx
                aly2 = 2 * y - ry
            if _side_of(x, y, dx, dy, cx, cy) == 0 and not ((cx == x and cy == y) or (dx == x and dy == y)):
                nearer_c = abs(cx - x) + abs(cy - y) < abs(dx - x) + abs(dy - y)
                nx = cx if nearer_c else dx
                ny = cy if nearer_c else dy
                v = (ny >> 1) * stride + (nx >> 1)
                if corner[u64(v)] & TURN == 0:
                    continue
                parent = int(state[0])
                if parent == len(f):
                    state[1] = 1
                    break
                through += _apart(x, y, nx, ny)
                if _worse(best, seen, run, v, through, 1):
                    continue
                state[0] = parent + 1
                nodes[u64(FIELDS * parent)] = x
                nodes[u64(FIELDS * parent + 1)] = y
                nodes[u64(FIELDS * parent + 6)] = CORNER
                nodes[u64(FIELDS * parent + 8)] = u
                x = nx
                y = ny
                alx2 = cx
                aly2 = cy
                arx2 = dx
                ary2 = dy
            more = _estimate(x, y, alx2, aly2, arx2, ary2, dx, dy, cx, cy, gx, gy)
            _add(
                x, y, alx2, aly2, arx2, ary2, s, here, parent, through, more,
                nodes, f, h, g, place, state,
            )  # fmt: skip


@kernel(out=("points",))
def _turning_points(nodes, last, points):
    """Write the roots on the chain of parents down, the last first, without those where the path goes straight on;
    return how many."""
    count = 0
    at = int(last)
    while at >= 0:
        x = nodes[u64(FIELDS * at)] + 0
        y = nodes[u64(FIELDS * at + 1)] + 0
        at = int(nodes[u64(FIELDS * at + 8)])
        if count > 0:
            bx = points[u64(2 * count - 2)]
            by = points[u64(2 * count - 1)]
            if bx == x and by == y:
                continue
            if (
                count > 1
                and _side_of(points[u64(2 * count - 4)], points[u64(2 * count - 3)], bx, by, x, y) == 0
            ):
                count -= 1
        points[u64(2 * count)] = x
        points[u64(2 * count + 1)] = y
        count += 1
    return count


@kernel(
    out=("open_to", "best", "seen", "port_best", "port_seen", "nodes", "f", "h", "g", "heap", "place", "points", "state"),
    each=600,
)  # fmt: skip
def polyanya(
    owner, corner, stride, rects, first, sides, port_first, ports, out, open_to, sx, sy, gx, gy, budget, run,
    best, seen, port_best, port_seen, nodes, f, h, g, heap, place, points, state, halt,
):  # fmt: skip
    """The shortest path in the plane between two lattice points that are no blocked square's inside.

    Parameters
    ----------
    owner .. out : see :mod:`.rectangle_mesh`.
    open_to : int32 (k,), 0 before the first run; scratch: dead ends that lead to the goal.
    sx, sy, gx, gy : the ends.
    budget : greatest number of nodes expanded; -1: no limit.
    run : the number of this search, from 1, never used twice with the same ``seen``.
    best, seen, port_best, port_seen : float64 and int32 (n,), scratch, ``seen`` 0 before the first run.
    nodes : int64 (10 m,); f, h, g : float64 (m,); heap, place : int32 (m + 1,), (m,): scratch, heap[0] is 0. Where m
        nodes are too few, FULL is returned.
    points : int64 (2 m,): x and y of the turning points, the goal first, the start last.
    state : int64 (5,): nodes made; turning points; the ending; nodes expanded; the last node.
    """
    heap[0] = 0
    state[0] = 0
    state[1] = 0
    state[4] = -1
    _add(sx, sy, sx, sy, sx, sy, POINT, -1, -1, 0.0, _apart(sx, sy, gx, gy), nodes, f, h, g, place, state)
    expanded = 0
    ending = EXHAUSTED
    whole = (gx | gy) & 1 == 0
    goal_at = (gy >> 1) * stride + (gx >> 1)
    # The rectangles around the goal: one for the centre of a square.
    goal_a = owner[u64(goal_at)]
    goal_b = owner[u64(goal_at - 1)] if whole else goal_a
    goal_c = owner[u64(goal_at - stride)] if whole else goal_a
    goal_d = owner[u64(goal_at - stride - 1)] if whole else goal_a
    for k in range(4):
        p = int(goal_a)
        if k > 0:
            p = int(goal_b if k == 1 else goal_c if k == 2 else goal_d)
        while p >= 0 and open_to[u64(p)] != run:
            open_to[u64(p)] = run
            p = int(out[u64(p)])
    hand = 0
    while hand >= 0 or heap[0] > 0:
        u = hand
        top = heap[1] + 0
        if hand < 0 or (
            heap[0] > 0
            and (f[u64(top)] < f[u64(hand)] or (f[u64(top)] == f[u64(hand)] and h[u64(top)] <= h[u64(hand)]))
        ):
            u = top
            if hand < 0:
                take(heap, place, f, h, u)
            else:
                # The one goes to where the other was.
                place[u64(u)] = 0
                heap[1] = hand
                place[u64(hand)] = 1
                put(heap, place, f, h, hand)
        hand = -1
        made = state[0] + 0
        at = FIELDS * u
        side = nodes[u64(at + 6)]
        if side == ENDED:
            ending = FOUND
            state[4] = u
            break
        if expanded == budget or (expanded % 16 == 15 and stopped(halt)):
            ending = LIMIT
            break
        rx = nodes[u64(at)]
        ry = nodes[u64(at + 1)]
        length = g[u64(u)] + 0.0
        if rx == gx and ry == gy:
            _add(gx, gy, gx, gy, gx, gy, ENDED, -1, u, length, 0.0, nodes, f, h, g, place, state)
            hand = _sort_in(made, state[0], nodes, f, h, heap, place)
            continue
        root = (ry >> 1) * stride + (rx >> 1)
        even = (rx | ry) & 1 == 0
        if even and side != POINT and seen[u64(root)] == run and length > best[u64(root)] + EQUAL:
            continue
        if side == POINT and even and port_seen[u64(root)] == run and length > port_best[u64(root)] + EQUAL:
            continue
        expanded += 1
        lx = nodes[u64(at + 2)]
        ly = nodes[u64(at + 3)]
        qx = nodes[u64(at + 4)]
        qy = nodes[u64(at + 5)]
        came = -1
        here = -1
        left_turn = 0
        right_turn = 0
        around = 1
        open_left = 1
        open_right = 1
        if side == POINT:
            around = 4 if even else 1
            # Lines with blocked squares on both sides.
            if even and corner[u64(root)] & PORT:
                for k in range(4):
                    ux = (1 - 2 * (k >> 1)) * (1 - (k & 1))
                    uy = (1 - 2 * (k >> 1)) * (k & 1)
                    low = root
                    if k >= 2:
                        low = root + uy * stride + ux
                    if corner[u64(low)] & (LINE_Y if k & 1 else LINE_X):
                        v = root + uy * stride + ux
                        if _worse(port_best, port_seen, run, v, length + 2.0, 0) == 0:
                            x = rx + 2 * ux
                            y = ry + 2 * uy
                            _add(
                                x, y, x, y, x, y, POINT, -1, u, length + 2.0, _apart(x, y, gx, gy),
                                nodes, f, h, g, place, state,
                            )  # fmt: skip
        else:
            came = nodes[u64(at + 7)]
            here = sides[u64(5 * side + 4)] + 0
            open_left = 1 if lx == rx and ly == ry else 0
            open_right = 1 if qx == rx and qy == ry else 0
            # A ray that ends at an end of the side may be turned at.
            if open_left == 0 and lx == sides[u64(5 * side + 2)] and ly == sides[u64(5 * side + 3)]:
                left_turn = _turns(corner, stride, rx, ry, lx, ly, 1)
            if open_right == 0 and qx == sides[u64(5 * side)] and qy == sides[u64(5 * side + 1)]:
                right_turn = _turns(corner, stride, rx, ry, qx, qy, -1)
        to_left = 0.0
        to_right = 0.0
        if left_turn:
            to_left = length + _apart(rx, ry, lx, ly)
            if _worse(best, seen, run, (ly >> 1) * stride + (lx >> 1), to_left, 1):
                left_turn = 0
        if right_turn:
            to_right = length + _apart(rx, ry, qx, qy)
            if _worse(best, seen, run, (qy >> 1) * stride + (qx >> 1), to_right, 1):
                right_turn = 0
        for k in range(around):
            if side == POINT:
                here = owner[u64(root - (k >> 1) * stride - (k & 1))] + 0
                if here < 0:
                    continue
            home = 1 if here == goal_a or here == goal_b or here == goal_c or here == goal_d else 0
            _reach_points(
                corner, stride, port_first, ports, gx, gy, home, run, port_best, port_seen, rx, ry, length, lx, ly,
                qx, qy, open_left, open_right, left_turn, right_turn, to_left, to_right, u, here, nodes, f, h, g,
                place, state
            )  # fmt: skip
            _cross_sides(
                corner, stride, first, sides, out, open_to, gx, gy, run, best, seen, came, rx, ry, length, lx, ly,
                qx, qy, open_left, open_right, left_turn, right_turn, to_left, to_right, u, here, nodes, f, h, g,
                place, state
            )  # fmt: skip
        if state[1] != 0:
            ending = FULL
            break
        hand = _sort_in(made, state[0], nodes, f, h, heap, place)
    state[2] = ending
    state[3] = expanded
    state[1] = _turning_points(nodes, int(state[4]), points) if ending == FOUND else 0


@kernel(out=("path",), each=2000, of=PATH)
def walk_along(square, stride, cell, x, y, diagonals, path, halt):
    """A walk by single steps through the squares that lines run through, the start first; return how many squares.

    Parameters
    ----------
    square : uint8 (n,), 1 where a square is free.
    cell : units in the side of a square.
    x, y : int64 (k,), the points, units; square (c, r) begins at c times ``cell``.
    diagonals : 2 where diagonals may cut corners, 1 where both side cells must be free, 0 where there are none.
    path : int32; the result, flat indices; room for the columns and rows that lines enter, 2 for each line and 1.
    """
    count = 0
    for leg in range(len(x) - 1):
        if stopped(halt):
            return count
        dx = x[leg + 1] - x[leg]
        dy = y[leg + 1] - y[leg]
        right = 1 if dx > 0 else -1
        down = 1 if dy > 0 else -1
        c = x[leg] // cell
        r = y[leg] // cell
        end_c = x[leg + 1] // cell
        end_r = y[leg + 1] // cell
        # From the side or the corner of a square a line leads into the square before it.
        if x[leg] % cell == 0 and (
            dx < 0 or (dx == 0 and square[u64((r if dy > 0 else r - 1) * stride + c)] == 0)
        ):
            c -= 1
        if y[leg] % cell == 0 and (dy < 0 or (dy == 0 and square[u64(r * stride + c)] == 0)):
            r -= 1
        if x[leg + 1] % cell == 0 and (dx > 0 or (dx == 0 and c < end_c)):
            end_c -= 1
        if y[leg + 1] % cell == 0 and (dy > 0 or (dy == 0 and r < end_r)):
            end_r -= 1
        wide = abs(dx)
        high = abs(dy)
        more = 1
        while more:
            at = r * stride + c
            if count == 0 or path[u64(count - 1)] != at:
                # Two steps around a corner may be one.
                if count > 1 and diagonals > 0:
                    two = path[u64(count - 2)] + 0
                    one = path[u64(count - 1)] + 0
                    over = at - two
                    slanting = (
                        over == stride + 1 or over == stride - 1 or over == -stride + 1 or over == -stride - 1
                    )
                    if slanting and (diagonals == 2 or square[u64(two + at - one)] != 0):
                        count -= 1
                if count > 0 and diagonals == 0:
                    one = path[u64(count - 1)] + 0
                    over = abs(at - one)
                    if over == stride + 1 or over == stride - 1:
                        # Without diagonals: by a free one of the two squares beside.
                        across = r * stride + one % stride
                        path[u64(count)] = (
                            across if square[u64(across)] != 0 else (one // stride) * stride + c
                        )
                        count += 1
                path[u64(count)] = at
                count += 1
            if c == end_c and r == end_r:
                more = 0
            else:
                # Where along the line the next column and the next row begin.
                border_x = abs((c + 1 if right > 0 else c) * cell - x[leg])
                border_y = abs((r + 1 if down > 0 else r) * cell - y[leg])
                late = border_x * high - border_y * wide
                if c == end_c:
                    late = 1
                elif r == end_r:
                    late = -1
                if late <= 0:
                    c += right
                if late >= 0:
                    r += down
    return count
