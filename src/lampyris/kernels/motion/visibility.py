"""What can be seen between the squares of a map, in whole numbers, and the nearest hiding place.

Points lie on a lattice of :data:`UNIT` steps a cell, counted so that cell (i, j) is the square from (i, j)
UNIT to (i + 1, j + 1) UNIT. The eye never lies on a border of cells: it is put on odd numbers, borders are
even. So every comparison is of whole numbers, and exact.

A sight may touch the corner or the side of an opaque square, but not pass between two that touch at a corner.
"""

from __future__ import annotations

from math import sqrt

from lampyris.kernels._jit import kernel, u64

UNIT = 2048
"""Steps of the lattice in a cell: half a millimetre in a cell of 1 m."""


@kernel()
def sees(opaque, width, ax, ay, bx, by):
    """Whether nothing opaque lies between a and b, or in the cell of a.

    Parameters
    ----------
    opaque : bool (height * width,), row by row.
    ax, ay : the eye; on no border of cells.
    bx, by : a corner of cells, or a point on no border.

    The cells of the segment in order (Amanatides and Woo 1987), the next border found by cross
    multiplication.
    """
    dx = bx - ax
    dy = by - ay
    cx = ax // UNIT
    cy = ay // UNIT
    if dx > 0:
        sx = 1
        wx = dx
        nx = (cx + 1) * UNIT - ax
    else:
        sx = -1
        wx = -dx
        nx = ax - cx * UNIT
    if dy > 0:
        sy = 1
        wy = dy
        ny = (cy + 1) * UNIT - ay
    else:
        sy = -1
        wy = -dy
        ny = ay - cy * UNIT
    while True:
        if opaque[u64(cy * width + cx)]:
            return False
        if nx >= wx and ny >= wy:
            return True
        first = nx * wy
        second = ny * wx
        if first < second:
            cx += sx
            nx += UNIT
        elif second < first:
            cy += sy
            ny += UNIT
        else:
            if opaque[u64(cy * width + cx + sx)] and opaque[u64((cy + sy) * width + cx)]:
                return False
            cx += sx
            cy += sy
            nx += UNIT
            ny += UNIT


@kernel(out=("seen",))
def cells_in_sight(opaque, width, height, ax, ay, reach, seen):
    """Mark the cells whose centre is in sight of a point.

    Parameters
    ----------
    opaque : bool (height * width,).
    ax, ay : the eye, on no border of cells.
    reach : steps of the lattice; farther centres are out of sight.
    seen : out, bool (height * width,), False.
    """
    half = UNIT // 2
    far = reach // UNIT + 1
    x0 = max(ax // UNIT - far, 0)
    x1 = min(ax // UNIT + far + 1, width)
    y0 = max(ay // UNIT - far, 0)
    y1 = min(ay // UNIT + far + 1, height)
    for y in range(y0, y1):
        by = y * UNIT + half
        for x in range(x0, x1):
            bx = x * UNIT + half
            if (bx - ax) * (bx - ax) + (by - ay) * (by - ay) > reach * reach:
                continue
            if not opaque[u64(y * width + x)] and sees(opaque, width, ax, ay, bx, by):
                seen[u64(y * width + x)] = True


@kernel(out=("seen", "walls"), each=1500, of="walls")
def sensed(opaque, seen, width, height, x, y, tick, limit, near, hx, hy, least, walls):
    """Note the tick at which a robot that looks around from a cell first sees each cell.

    A free cell is seen if the segment between the two centres is clear (:func:`sees`); a wall, if the free cell across
    one of its sides that face the robot is in sight, or is the robot's own. Both within the range and the field of
    view. What is near is seen in any case.

    Parameters
    ----------
    opaque : bool (height * width,); walls.
    seen : out, int32 (height * width,): -1, or the tick; cells that have one are passed over.
    x, y : the robot's cell.
    limit : the square of the range in cells.
    near : cells within so many columns and rows are seen whatever lies between.
    hx, hy : the heading, a step; 0, 0: the robot looks all around.
    least : cosine of half the field of view.
    walls : out, int64; the walls seen now for the first time, as numbers of cells. It has room for the square of cells
        within the range, or of those that are near.

    Returns
    -------
    How many walls; how many cells.
    """
    half = UNIT // 2
    ax = x * UNIT + half
    ay = y * UNIT + half
    reach = near
    while (reach + 1) * (reach + 1) <= limit:
        reach += 1
    count = 0
    cells = 0
    for cy in range(max(y - reach, 0), min(y + reach + 1, height)):
        for cx in range(max(x - reach, 0), min(x + reach + 1, width)):
            place = u64(cy * width + cx)
            if seen[place] >= 0:
                continue
            dx = cx - x
            dy = cy - y
            if max(abs(dx), abs(dy)) > near:
                squared = dx * dx + dy * dy
                if squared > limit:
                    continue
                if hx != 0 or hy != 0:
                    ahead = dx * hx + dy * hy
                    if ahead < least * sqrt(float(squared * (hx * hx + hy * hy))) - 1e-9:
                        continue
                if not opaque[place]:
                    if not sees(opaque, width, ax, ay, cx * UNIT + half, cy * UNIT + half):
                        continue
                else:
                    found = False
                    if dx != 0:
                        bx = cx - 1 if dx > 0 else cx + 1
                        if not opaque[u64(cy * width + bx)]:
                            found = sees(opaque, width, ax, ay, bx * UNIT + half, cy * UNIT + half)
                    if dy != 0 and not found:
                        by = cy - 1 if dy > 0 else cy + 1
                        if not opaque[u64(by * width + cx)]:
                            found = sees(opaque, width, ax, ay, cx * UNIT + half, by * UNIT + half)
                    if not found:
                        continue
            seen[place] = tick
            cells += 1
            if opaque[place]:
                walls[count] = cy * width + cx
                count += 1
    return count, cells


@kernel()
def behind(opaque, dark, spacious, width, height, vx, vy, dx, dy, pinhole, steps):
    """What is at the edge of the shadow that corner (vx, vy) throws for an eye that looks along (dx, dy).

    Parameters
    ----------
    opaque, dark, spacious : bool (height * width,): cells that hide; those of them that may hold an obstacle
        themselves; cells in which an obstacle's centre may be.
    vx, vy : the corner, shared by the cells vx - 1, vx and vy - 1, vy. The cell before it is known to be
        free.
    dx, dy : from the eye to the corner; neither is 0.
    pinhole : whether an obstacle comes through between two squares that touch at a corner.
    steps : cells to look at.

    Returns
    -------
    -1: nothing comes from there. -2: an obstacle may. Otherwise the dark cell at which the edge ends.
    """
    sx = 1 if dx > 0 else -1
    sy = 1 if dy > 0 else -1
    # The cell beyond the corner, and the two beside: one keeps the eye's column, the other its row.
    gx = vx if dx > 0 else vx - 1
    gy = vy if dy > 0 else vy - 1
    if gx < 0 or gy < 0 or gx >= width or gy >= height or opaque[u64(gy * width + gx)]:
        return -1
    low = opaque[u64((gy - sy) * width + gx)]
    high = opaque[u64(gy * width + gx - sx)]
    if not (low or high) or (low and high and not pinhole):
        return -1
    wx = dx if dx > 0 else -dx
    wy = dy if dy > 0 else -dy
    nx = UNIT
    ny = UNIT
    for _ in range(steps):
        place = gy * width + gx
        if opaque[u64(place)]:
            return place if dark[u64(place)] else -1
        if spacious[u64(place)]:
            return -2
        first = nx * wy
        second = ny * wx
        if first <= second:
            gx += sx
            nx += UNIT
        if second <= first:
            gy += sy
            ny += UNIT
        if gx < 0 or gy < 0 or gx >= width or gy >= height:
            return -1
        if first == second:
            low = opaque[u64((gy - sy) * width + gx)]
            if low and opaque[u64(gy * width + gx - sx)] and not pinhole:
                return -1
    return -1


@kernel()
def to_square(x, y, px, py, cx, cy):
    """At most the distance between the segment from (x, y) to (px, py) and the square of a cell; in cells.

    The distance changes by no more than the path along the segment: its least value at both ends and in the
    middle, less a quarter of the segment.
    """
    best = 1e18
    for k in range(3):
        qx = x + 0.5 * k * (px - x)
        qy = y + 0.5 * k * (py - y)
        gx = max(cx - qx, qx - cx - 1.0, 0.0)
        gy = max(cy - qy, qy - cy - 1.0, 0.0)
        d = sqrt(gx * gx + gy * gy)
        if d < best:
            best = d
    length = sqrt((px - x) * (px - x) + (py - y) * (py - y))
    return max(best - 0.25 * length, 0.0)


@kernel()
def to_segment(x, y, px, py, qx, qy):
    """Distance from (qx, qy) to the segment from (x, y) to (px, py)."""
    ux = px - x
    uy = py - y
    vx = qx - x
    vy = qy - y
    along = ux * vx + uy * vy
    square = ux * ux + uy * uy
    if along > 0.0:
        share = along / square if along < square else 1.0
        vx -= share * ux
        vy -= share * uy
    return sqrt(vx * vx + vy * vy)


@kernel()
def is_ahead(xs, ys, k, last, ex, ey):
    """Whether going on from node k, as far as node ``last``, ever leads along (ex, ey), not against."""
    for j in range(k + 1, last + 1):
        if (xs[u64(j)] - xs[u64(k)]) * ex + (ys[u64(j)] - ys[u64(k)]) * ey > 0.0:
            return True
    return False


@kernel()
def dark_around(dark, width, height, vx, vy, x, y, px, py):
    """At most the distance from a segment to the nearest dark square that has this corner; 1e18: none."""
    best = 1e18
    for cy in range(max(vy - 1, 0), min(vy + 1, height)):
        for cx in range(max(vx - 1, 0), min(vx + 1, width)):
            if dark[u64(cy * width + cx)]:
                d = to_square(x, y, px, py, cx, cy)
                if d < best:
                    best = d
    return best


@kernel(out=("before", "after"))
def nearest_hiding(
    opaque, dark, spacious, width, height, first, columns, xs, ys, eyes_x, eyes_y, last, limit, rho, lead, steps,
    before, after,
):  # fmt: skip
    """How near, along a sampled path, the nearest place is from which something hidden may come.

    Parameters
    ----------
    opaque, dark, spacious, width, height, steps : as for :func:`behind`.
    first, columns : int64; the corners that may hide something: those of row j have the columns
        ``columns[first[j] : first[j + 1]]``, rising.
    xs, ys : float64 (n,), nodes, cells, cell (i, j) being the square from (i, j) to (i + 1, j + 1).
    eyes_x, eyes_y : int64 (n,), the same on the lattice, on no border of cells.
    last : int64 (n,): the last node on which "ahead" of each node depends.
    limit : cells: farther places do not matter.
    rho : radius of what hides, cells; 0: it comes through between squares that touch at a corner.
    lead : how much nearer than its corner a dark square may be, less rho; 0 where nothing is dark.
    before, after : out, float64 (n,): cells from the segment before and the one after each node to the
        nearest such place, less rho for a dark one; ``limit`` where there is none, 0 in an opaque cell.

    Rows of corners outward from the node, in each the corners outward; what cannot be nearer than the best is
    not looked at.
    """
    n = len(xs)
    pinhole = rho == 0.0
    for k in range(n):
        x = xs[k]
        y = ys[k]
        ax = eyes_x[k]
        ay = eyes_y[k]
        if opaque[u64((ay // UNIT) * width + ax // UNIT)]:
            before[k] = 0.0
            after[k] = 0.0
            continue
        xb = xs[max(k - 1, 0)]
        yb = ys[max(k - 1, 0)]
        xa = xs[min(k + 1, n - 1)]
        ya = ys[min(k + 1, n - 1)]
        slack = lead + sqrt(
            max((x - xb) * (x - xb) + (y - yb) * (y - yb), (x - xa) * (x - xa) + (y - ya) * (y - ya))
        )
        best_b = limit
        best_a = limit
        up = ay // UNIT
        down = up + 1
        while up >= 0 or down <= height:
            if up >= 0 and (down > height or y - up <= down - y):
                row = up
                up -= 1
            else:
                row = down
                down += 1
            tall = row - y
            far = max(best_b, best_a) + slack
            if tall > far or -tall > far:
                break
            begin = first[u64(row)]
            end = first[u64(row + 1)]
            low = begin
            high = end
            while low < high:
                middle = (low + high) // 2
                if columns[u64(middle)] > x:
                    high = middle
                else:
                    low = middle + 1
            left = low - 1
            while left >= begin or low < end:
                if left >= begin and (low >= end or x - columns[u64(left)] <= columns[u64(low)] - x):
                    column = columns[u64(left)]
                    left -= 1
                else:
                    column = columns[u64(low)]
                    low += 1
                wide = column - x
                far = max(best_b, best_a) + slack
                if wide * wide + tall * tall > far * far:
                    break
                db = to_segment(x, y, xb, yb, column, row)
                da = to_segment(x, y, xa, ya, column, row)
                if db - lead >= best_b and da - lead >= best_a:
                    continue
                if not is_ahead(xs, ys, k, last[u64(k)], wide, tall):
                    continue
                dx = column * UNIT - ax
                dy = row * UNIT - ay
                if not sees(opaque, width, ax, ay, column * UNIT, row * UNIT):
                    continue
                what = behind(opaque, dark, spacious, width, height, column, row, dx, dy, pinhole, steps)
                if what == -1:
                    db = 1e18
                    da = 1e18
                elif what >= 0:
                    db = to_square(x, y, xb, yb, what % width, what // width) - rho
                    da = to_square(x, y, xa, ya, what % width, what // width) - rho
                if lead > 0.0:
                    db = min(db, dark_around(dark, width, height, column, row, x, y, xb, yb) - rho)
                    da = min(da, dark_around(dark, width, height, column, row, x, y, xa, ya) - rho)
                best_b = min(best_b, db)
                best_a = min(best_a, da)
        before[k] = max(best_b, 0.0)
        after[k] = max(best_a, 0.0)
