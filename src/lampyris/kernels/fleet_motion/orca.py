"""Optimal reciprocal collision avoidance among discs and walls.

J. van den Berg, S. J. Guy, M. Lin, D. Manocha, International Symposium of Robotics Research 2009 (STAR 70, 2011). For each
neighbour a robot takes half of the least change of velocity that keeps the two apart for a time horizon: a half-plane of
velocities. The velocity nearest to the preferred one within all half-planes and the speed limit is found by a linear program in
two dimensions; where there is none, the one that violates those of robots least.

Walls are half-planes that are never violated: with the nearest point of a blocked cell at distance g from the disc, the
robot approaches it by at most g / ``wall_time`` a second. The preferred velocity leads down the table of distances to the
robot's goal, to the farthest cell of the next few that can be seen.

Metres from the upper left corner of the map, y down. ``line`` holds px, py, dx, dy of each half-plane, the permitted velocities
to the left of (dx, dy).
"""

from __future__ import annotations

import math

from lampyris.kernels._jit import kernel, stopped
from lampyris.kernels.swarm.bins import fill_bins

TINY = 1e-10
AHEAD = 6
"""Cells that a robot looks ahead for its preferred velocity."""
AGAIN = 32
"""Steps after which a robot decides again, if it is on the same cell."""
WALLS = 24
"""Half-planes of walls at most."""
DONE, LIMIT = 0, 1


@kernel(out=("found",))
def _on_line(line, k, top, ox, oy, along, found):
    """The best velocity on the border of half-plane k within those before it; whether there is one."""
    px = line[4 * k]
    py = line[4 * k + 1]
    dx = line[4 * k + 2]
    dy = line[4 * k + 3]
    dot = px * dx + py * dy
    room = dot * dot + top * top - px * px - py * py
    if room < 0.0:
        return False
    root = math.sqrt(room)
    low = -dot - root
    high = -dot + root
    for j in range(k):
        jx = line[4 * j + 2]
        jy = line[4 * j + 3]
        cross = dx * jy - dy * jx
        side = jx * (py - line[4 * j + 1]) - jy * (px - line[4 * j])
        if abs(cross) <= TINY:
            if side < 0.0:
                return False
            continue
        t = side / cross
        if cross >= 0.0:
            high = min(high, t)
        else:
            low = max(low, t)
        if low > high:
            return False
    if along:
        t = high if ox * dx + oy * dy > 0.0 else low
    else:
        t = min(max(dx * (ox - px) + dy * (oy - py), low), high)
    found[0] = px + t * dx
    found[1] = py + t * dy
    return True


@kernel(out=("found",))
def _nearest(line, count, top, ox, oy, along, found):
    """The best velocity within half-planes; the number of those that it satisfies before one that it cannot."""
    if along:
        found[0] = ox * top
        found[1] = oy * top
    else:
        size = math.sqrt(ox * ox + oy * oy)
        share = top / size if size > top else 1.0
        found[0] = ox * share
        found[1] = oy * share
    for k in range(count):
        side = line[4 * k + 2] * (line[4 * k + 1] - found[1]) - line[4 * k + 3] * (line[4 * k] - found[0])
        if side > 0.0:
            x = found[0]
            y = found[1]
            if not _on_line(line, k, top, ox, oy, along, found):
                found[0] = x
                found[1] = y
                return k
    return count


@kernel(out=("proj", "found"))
def _least_bad(line, count, walls, first, top, proj, found):
    """The velocity that violates the half-planes of robots least, those of walls not at all."""
    worst = 0.0
    for k in range(first, count):
        px = line[4 * k]
        py = line[4 * k + 1]
        dx = line[4 * k + 2]
        dy = line[4 * k + 3]
        if dx * (py - found[1]) - dy * (px - found[0]) <= worst:
            continue
        for j in range(4 * walls):
            proj[j] = line[j]
        many = walls
        for j in range(walls, k):
            jx = line[4 * j + 2]
            jy = line[4 * j + 3]
            cross = dx * jy - dy * jx
            if abs(cross) <= TINY:
                if dx * jx + dy * jy > 0.0:
                    continue
                qx = 0.5 * (px + line[4 * j])
                qy = 0.5 * (py + line[4 * j + 1])
            else:
                t = (jx * (py - line[4 * j + 1]) - jy * (px - line[4 * j])) / cross
                qx = px + t * dx
                qy = py + t * dy
            ux = jx - dx
            uy = jy - dy
            size = math.sqrt(ux * ux + uy * uy)
            if size <= TINY:
                continue
            proj[4 * many] = qx
            proj[4 * many + 1] = qy
            proj[4 * many + 2] = ux / size
            proj[4 * many + 3] = uy / size
            many += 1
        x = found[0]
        y = found[1]
        if _nearest(proj, many, top, -dy, dx, True, found) < many:
            found[0] = x
            found[1] = y
        worst = dx * (py - found[1]) - dy * (px - found[0])


@kernel(out=("line",))
def _of_walls(px, py, size, blocked, width, height, cell, wall_time, top, line):
    """Half-planes of the blocked cells near a robot; how many. The map's edge is blocked cells, too."""
    count = 0
    reach = size + top * wall_time
    low_x = math.floor((px - reach) / cell)
    high_x = math.floor((px + reach) / cell)
    low_y = math.floor((py - reach) / cell)
    high_y = math.floor((py + reach) / cell)
    for v in range(low_y, high_y + 1):
        for u in range(low_x, high_x + 1):
            if 0 <= u < width and 0 <= v < height and blocked[v * width + u] == 0:
                continue
            gx = px - min(max(px, u * cell), (u + 1) * cell)
            gy = py - min(max(py, v * cell), (v + 1) * cell)
            square = gx * gx + gy * gy
            if square >= reach * reach or square <= 0.0 or count >= WALLS:
                continue
            away = math.sqrt(square)
            nx = gx / away
            ny = gy / away
            share = (size - away) / wall_time
            line[4 * count] = nx * share
            line[4 * count + 1] = ny * share
            line[4 * count + 2] = ny
            line[4 * count + 3] = -nx
            count += 1
    return count


@kernel(out=("line",))
def _of_robot(gx, gy, vx, vy, ux, uy, sum_, horizon, period, k, line):
    """The half-plane k of a neighbour at (gx, gy) from a robot of velocity (vx, vy); (ux, uy): the neighbour's."""
    rx = vx - ux
    ry = vy - uy
    square = gx * gx + gy * gy
    apart = square > sum_ * sum_
    time = horizon if apart else period
    wx = rx - gx / time
    wy = ry - gy / time
    size2 = wx * wx + wy * wy
    dot = wx * gx + wy * gy
    if not apart or (dot < 0.0 and dot * dot > sum_ * sum_ * size2):
        size = math.sqrt(size2)
        if size <= TINY:
            # Both stand on one point: the side is a matter of choice.
            wx = -1.0
            wy = 0.0
        else:
            wx /= size
            wy /= size
        dx = wy
        dy = -wx
        cx = (sum_ / time - size) * wx
        cy = (sum_ / time - size) * wy
    else:
        leg = math.sqrt(square - sum_ * sum_)
        if gx * wy - gy * wx > 0.0:
            dx = (gx * leg - gy * sum_) / square
            dy = (gx * sum_ + gy * leg) / square
        else:
            dx = -(gx * leg + gy * sum_) / square
            dy = -(gy * leg - gx * sum_) / square
        along = rx * dx + ry * dy
        cx = along * dx - rx
        cy = along * dy - ry
    line[4 * k] = vx + 0.5 * cx
    line[4 * k + 1] = vy + 0.5 * cy
    line[4 * k + 2] = dx
    line[4 * k + 3] = dy


@kernel()
def _sees(px, py, qx, qy, size, blocked, width, height, cell):
    """Whether a disc drives from p to q without touching a blocked cell."""
    dx = qx - px
    dy = qy - py
    square = dx * dx + dy * dy
    low_x = max(int((min(px, qx) - size) / cell), 0)
    high_x = min(int((max(px, qx) + size) / cell), width - 1)
    low_y = max(int((min(py, qy) - size) / cell), 0)
    high_y = min(int((max(py, qy) + size) / cell), height - 1)
    for v in range(low_y, high_y + 1):
        for u in range(low_x, high_x + 1):
            if blocked[v * width + u] == 0:
                continue
            # The square is convex: the middle of the gap to its centre's nearest point of the segment, then its corners.
            cx = (u + 0.5) * cell
            cy = (v + 0.5) * cell
            share = min(max(((cx - px) * dx + (cy - py) * dy) / square, 0.0), 1.0) if square > 0.0 else 0.0
            for corner in range(5):
                if corner > 0:
                    kx = (u + (corner % 2)) * cell
                    ky = (v + ((corner - 1) // 2)) * cell
                    share = (
                        min(max(((kx - px) * dx + (ky - py) * dy) / square, 0.0), 1.0)
                        if square > 0.0
                        else 0.0
                    )
                nx = px + share * dx
                ny = py + share * dy
                gx = nx - min(max(nx, u * cell), (u + 1) * cell)
                gy = ny - min(max(ny, v * cell), (v + 1) * cell)
                if gx * gx + gy * gy < size * size:
                    return False
    return True


@kernel(out=("aim_x", "aim_y"))
def _aim(
    i, here, px, py, size, blocked, width, height, cell, number, table, free, goal_x, goal_y, aim_x, aim_y
):
    """Where robot i drives: the farthest cell on a shortest path that can be seen, of the next few."""
    row = i * free
    u = here % width
    v = here // width
    ax = (u + 0.5) * cell
    ay = (v + 0.5) * cell
    seen = False
    for _ in range(AHEAD):
        best = table[row + number[v * width + u]]
        if best == 0:
            break
        bu = u
        bv = v
        for k in range(9):
            du = k % 3 - 1
            dv = k // 3 - 1
            nu = u + du
            nv = v + dv
            if not (0 <= nu < width and 0 <= nv < height) or number[nv * width + nu] < 0:
                continue
            if du != 0 and dv != 0 and (number[v * width + nu] < 0 or number[nv * width + u] < 0):
                continue
            value = table[row + number[nv * width + nu]]
            if value < best:
                best = value
                bu = nu
                bv = nv
        if bu == u and bv == v:
            break
        u = bu
        v = bv
        if seen and not _sees(px, py, (u + 0.5) * cell, (v + 0.5) * cell, size, blocked, width, height, cell):
            break
        seen = True
        ax = (u + 0.5) * cell
        ay = (v + 0.5) * cell
    aim_x[i] = ax
    aim_y[i] = ay


@kernel(
    out=(
        "x", "y", "vx", "vy", "aim_x", "aim_y", "at", "next_x", "next_y", "near", "apart", "line", "proj", "found", "first",
        "member", "random", "path", "count",
    ),
    each=30_000_000,
    of="x",
)  # fmt: skip
def steps(
    radius, top, blocked, close, width, height, cell, number, table, free, goal_x, goal_y, period, horizon, wall_time, most,
    largest, side, columns, rows, x, y, vx, vy, aim_x, aim_y, at, next_x, next_y, near, apart, line, proj, found,
    first, member, random, path, count, last, halt,
):  # fmt: skip
    """Steps of all robots until each is within a quarter of a cell of its goal (DONE) or there were ``last`` (LIMIT).

    Parameters
    ----------
    radius, top : float64 (n,): of each disc, and its greatest speed.
    blocked, close, width, height, cell : the map and where walls may be within reach, uint8 (width * height,), and the side of a
        cell.
    number, table, free : int32, the number of each free cell, -1 of others; steps to each robot's goal by number, of so many.
    period, horizon, wall_time : seconds of a step, and time horizons.
    most, largest : neighbours at most, and the greatest radius.
    side, columns, rows : bins.
    x, y, vx, vy : in and out, float64 (n,).
    aim_x, aim_y, at : where each robot drives, and the cell for which that was decided (-1: none yet).
    near .. member : scratch.
    path : out, float64 (steps * n * 2,): where all are after each step.
    count : in and out, int64 (1,): the steps done.
    """
    n = len(x)
    while count[0] < last:
        if stopped(halt):
            return LIMIT
        home = 0
        for i in range(n):
            gx = goal_x[i] - x[i]
            gy = goal_y[i] - y[i]
            if gx * gx + gy * gy <= 0.0625 * cell * cell:
                home += 1
        if home == n:
            return DONE
        fill_bins(x, y, side, columns, rows, first, member)
        for i in range(n):
            px = x[i]
            py = y[i]
            u = min(max(int(px / cell), 0), width - 1)
            v = min(max(int(py / cell), 0), height - 1)
            here = v * width + u
            if here != at[i] or (count[0] + i) % AGAIN == 0:
                at[i] = here
                if number[here] >= 0:
                    _aim(
                        i, here, px, py, radius[i], blocked, width, height, cell, number, table, free, goal_x, goal_y,
                        aim_x, aim_y,
                    )  # fmt: skip
            ox = aim_x[i] - px
            oy = aim_y[i] - py
            far = math.sqrt(ox * ox + oy * oy)
            if far < 0.25 * cell:
                at[i] = -1
            share = min(top[i], far / period) / far if far > 0.0 else 0.0
            random[0] = (random[0] * 1103515245 + 12345) & 0x7FFFFFFF
            turn = (random[0] / 2147483648.0 - 0.5) * 0.04
            # Robots that meet head on would push each other without end.
            wx = share * (ox - turn * oy)
            wy = share * (oy + turn * ox)
            reach = radius[i] + largest + horizon * top[i]
            square = reach * reach
            many = 0
            low_x = min(max(int((px - reach) / side), 0), columns - 1)
            high_x = min(max(int((px + reach) / side), 0), columns - 1)
            low_y = min(max(int((py - reach) / side), 0), rows - 1)
            high_y = min(max(int((py + reach) / side), 0), rows - 1)
            for b in range(low_y, high_y + 1):
                for k in range(first[b * columns + low_x], first[b * columns + high_x + 1]):
                    j = member[k]
                    gx = x[j] - px
                    gy = y[j] - py
                    d = gx * gx + gy * gy
                    if d >= square or j == i:
                        continue
                    if many < most:
                        many += 1
                    m = many - 1
                    while m > 0 and apart[m - 1] > d:
                        apart[m] = apart[m - 1]
                        near[m] = near[m - 1]
                        m -= 1
                    apart[m] = d
                    near[m] = j
                    if many == most:
                        square = apart[many - 1]
            walls = 0
            if close[here] != 0:
                walls = _of_walls(px, py, radius[i], blocked, width, height, cell, wall_time, top[i], line)
            for m in range(many):
                j = near[m]
                _of_robot(
                    x[j] - px, y[j] - py, vx[i], vy[i], vx[j], vy[j], radius[i] + radius[j], horizon, period, walls + m,
                    line,
                )  # fmt: skip
            total = walls + many
            done = _nearest(line, total, top[i], wx, wy, False, found)
            if done < walls:
                # Only rounding makes walls contradict each other: standing satisfies all of them.
                found[0] = 0.0
                found[1] = 0.0
            if done < total:
                _least_bad(line, total, walls, max(done, walls), top[i], proj, found)
            next_x[i] = found[0]
            next_y[i] = found[1]
        base = 2 * n * count[0]
        for i in range(n):
            vx[i] = next_x[i]
            vy[i] = next_y[i]
            x[i] += period * vx[i]
            y[i] += period * vy[i]
            path[base + 2 * i] = x[i]
            path[base + 2 * i + 1] = y[i]
        count[0] += 1
    return LIMIT
