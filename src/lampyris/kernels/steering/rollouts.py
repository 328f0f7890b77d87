"""Simulated motions of a robot under many commands at once, and what each of them costs: the loop of DWA and MPPI.

Motions advance together, step by step, in blocks whose arrays stay in the processor's first cache; the inner loops go over
motions, without branches, so that they are vectorised.
Positions are in metres, y up. The robot is compared with walls and obstacles at every second
step, and with the path at every fourth.
"""

from __future__ import annotations

import math

from lampyris.kernels._helpers import u64
from lampyris.kernels._jit import kernel

_SLOW = 1e-3
"""Metres a second below which curvature says nothing."""


@kernel(out=("bounds",), each=200, of="x")
def bound(x, y, bounds, begin, end):
    """Write the least and greatest x and y of a block; in four parts each, which advance together."""
    a0 = a1 = a2 = a3 = x[begin]
    b0 = b1 = b2 = b3 = x[begin]
    c0 = c1 = c2 = c3 = y[begin]
    d0 = d1 = d2 = d3 = y[begin]
    whole = begin + (end - begin) // u64(4) * u64(4)
    for k in range(begin, whole, u64(4)):
        a0 = min(a0, x[k])
        a1 = min(a1, x[k + u64(1)])
        a2 = min(a2, x[k + u64(2)])
        a3 = min(a3, x[k + u64(3)])
        b0 = max(b0, x[k])
        b1 = max(b1, x[k + u64(1)])
        b2 = max(b2, x[k + u64(2)])
        b3 = max(b3, x[k + u64(3)])
        c0 = min(c0, y[k])
        c1 = min(c1, y[k + u64(1)])
        c2 = min(c2, y[k + u64(2)])
        c3 = min(c3, y[k + u64(3)])
        d0 = max(d0, y[k])
        d1 = max(d1, y[k + u64(1)])
        d2 = max(d2, y[k + u64(2)])
        d3 = max(d3, y[k + u64(3)])
    for k in range(whole, end):
        a0 = min(a0, x[k])
        b0 = max(b0, x[k])
        c0 = min(c0, y[k])
        d0 = max(d0, y[k])
    bounds[0] = min(min(a0, a1), min(a2, a3))
    bounds[1] = max(max(b0, b1), max(b2, b3))
    bounds[2] = min(min(c0, c1), min(c2, c3))
    bounds[3] = max(max(d0, d1), max(d2, d3))


@kernel(out=("cost",), each=2_000, of="cost")
def add_obstacles(
    x, y, cosine, sine, bounds, box, ox, oy, ou, ow, radius, now, margin, reach, weight, hit, cost, begin, end,
):  # fmt: skip
    """Add to each motion of a block what nearness to obstacles costs after ``now`` seconds; returns how many were near enough."""
    low_x = bounds[0]
    high_x = bounds[1]
    low_y = bounds[2]
    high_y = bounds[3]
    found = 0.0
    for j in range(len(ox)):
        cx = ox[j] + ou[j] * now
        cy = oy[j] + ow[j] * now
        wide = radius[j] + margin
        far = wide + reach
        if cx < low_x - far or cx > high_x + far or cy < low_y - far or cy > high_y + far:
            continue
        found += 1.0
        touch = radius[j] * radius[j]
        scale = 1.0 / (wide * wide)
        low_a = box[0]
        high_a = box[1]
        low_b = box[2]
        high_b = box[3]
        for k in range(begin, end):
            dx = cx - x[k]
            dy = cy - y[k]
            a = cosine[k] * dx + sine[k] * dy
            b = cosine[k] * dy - sine[k] * dx
            a = max(max(low_a - a, a - high_a), 0.0)
            b = max(max(low_b - b, b - high_b), 0.0)
            square = a * a + b * b
            part = max(1.0 - square * scale, 0.0)
            cost[k] += weight * part * part + (hit if square < touch else 0.0)
    return found


@kernel(out=("cost",), each=1_000, of="cost")
def add_walls(
    x, y, cosine, sine, bounds, clear, width, height, resolution, disc_x, disc_y, disc_r, margin, far_off, weight, hit, cost,
    begin, end,
):  # fmt: skip
    """Add to each motion of a block what nearness to walls costs.

    A robot whose cell is ``far_off`` from walls is not near any; nor is one near it, by so much as it is nearer.
    """
    per_metre = 1.0 / resolution
    low_x = bounds[0]
    high_x = bounds[1]
    low_y = bounds[2]
    high_y = bounds[3]
    left = math.floor(low_x * per_metre + 0.5)
    right = math.floor(high_x * per_metre + 0.5)
    top = math.floor(0.5 - high_y * per_metre)
    bottom = math.floor(0.5 - low_y * per_metre)
    if left >= 0 and right < width and top >= 0 and bottom < height:
        wide = 0.5 * (right - left + 1) * resolution
        high = 0.5 * (bottom - top + 1) * resolution
        middle = clear[((top + bottom) // 2) * width + (left + right) // 2]
        if middle - math.sqrt(wide * wide + high * high) - resolution >= far_off:
            return
    for k in range(begin, end):
        column = int(x[k] * per_metre + 0.5)
        line = int(0.5 - y[k] * per_metre)
        if 0 <= column < width and 0 <= line < height and clear[line * width + column] >= far_off:
            continue
        worst = margin
        for j in range(len(disc_r)):
            px = x[k] + cosine[k] * disc_x[j] - sine[k] * disc_y[j]
            py = y[k] + sine[k] * disc_x[j] + cosine[k] * disc_y[j]
            column = int(px * per_metre + 0.5)
            line = int(0.5 - py * per_metre)
            if px < -0.5 * resolution or py > 0.5 * resolution or column >= width or line >= height:
                worst = -1.0
            else:
                worst = min(worst, clear[line * width + column] - disc_r[j])
        if worst < margin:
            part = 1.0 - max(worst, 0.0) / margin
            cost[k] += weight * part * part
            if worst < 0.0:
                cost[k] += hit


@kernel(inline=True)
def sample(number, first, stride, count, last):
    """Which sample of the path has a number: every so many of them count, and the last."""
    return last if number >= count else first + number * stride


@kernel(out=("at", "room", "cost"), each=500, of="cost")
def add_path(
    x, y, cosine, sine, path_x, path_y, path_c, path_s, path_left, first, stride, count, last,
    weight, yaw_weight, v_max, double, at, room, cost, begin, end,
):  # fmt: skip
    """Add to each motion of a block what distance and yaw beside the path cost, and move on along the path.

    ``room`` is the speed from which it can stop at the end of the path, at most ``v_max``; ``double`` is twice the braking.
    """
    for k in range(begin, end):
        near = int(at[k])
        here = u64(sample(near, first, stride, count, last))
        px = x[k]
        py = y[k]
        dx = path_x[here] - px
        dy = path_y[here] - py
        square = dx * dx + dy * dy
        while near < count:
            beyond = u64(sample(near + 1, first, stride, count, last))
            dx = path_x[beyond] - px
            dy = path_y[beyond] - py
            other = dx * dx + dy * dy
            if other > square:
                break
            square = other
            near += 1
            here = beyond
        at[k] = near
        room[k] = min(v_max, math.sqrt(double * path_left[here]))
        aligned = cosine[k] * path_c[here] + sine[k] * path_s[here]
        cost[k] += weight * math.sqrt(square) + yaw_weight * (1.0 - aligned)


@kernel(
    out=(
        "push",
        "side",
        "spin",
        "x",
        "y",
        "cosine",
        "sine",
        "before",
        "beside",
        "at",
        "room",
        "cost",
        "found",
        "bounds",
    ),
    each=20_000,
    of="spin",
)
def rollouts(
    noise_v, noise_w, noise_u, rows, hold, shift, nominal_v, nominal_w, nominal_u, spread_v, spread_w,
    steps, dt, start, gear, sideways, v_max, a_max, d_max, w_max, bend_max, a_lat, rate_weight,
    path_x, path_y, path_c, path_s, path_left, path_first, path_stride, path_count, path_last,
    path_weight, yaw_weight, progress_weight,
    clear, width, height, resolution, disc_x, disc_y, disc_r, margin,
    box, ox, oy, ou, ow, radius, obstacle_weight, collision_cost,
    push, side, spin, x, y, cosine, sine, before, beside, at, room, cost, found, bounds,
):  # fmt: skip
    """Simulate ``n`` motions of ``steps`` steps and add up their costs.

    Parameters
    ----------
    noise_v, noise_w, noise_u : float64 (rows * n,): deviation of the acceleration, the yaw rate and the sideways acceleration
        of each motion, row by row, times ``spread_v`` or ``spread_w``; step i takes row ``(shift + i) / hold``, or the last.
    nominal_v, nominal_w, nominal_u : float64 (steps,): the commands from which they deviate.
    start : float64 (6,): x, y, cosine and sine of the yaw, speed and sideways speed at the beginning.
    gear : 1 ahead, -1 in reverse; speeds are at least 0.
    sideways : 1 for an omnidirectional robot, whose speeds may be below 0.
    v_max, a_max, d_max, w_max : greatest speed, acceleration, braking and yaw rate.
    bend_max : greatest curvature, 1/m.
    path_x, path_y, path_c, path_s, path_left : samples of the path: points, direction of the yaw, metres left.
    path_first, path_stride, path_count, path_last : which of them count, from the robot on: so many, ``path_stride`` apart, and
        the last.
    clear, width, height : metres from the centre of each cell to the nearest wall, row by row.
    disc_x, disc_y, disc_r : discs that cover the robot, metres; y to the left.
    box : float64 (4,): the rectangle around the robot: least and greatest x, least and greatest y.
    ox, oy, ou, ow, radius : obstacles: metres, m/s, metres.
    push, side, spin : out, float64 (steps * n,): the commands within the robot's limits: accelerations ahead and to the left,
        yaw rates.
    x, y, cosine, sine, before, beside, at, room : out, float64 (n,): state of each motion; at the end its last pose.
    cost : out, float64 (n,).
    found : out, float64 (1,): triples of an obstacle, a step and a block that were near enough to be looked at.
    bounds : room for the least and greatest x and y of a block, float64 (4,).

    Returns
    -------
    The motion of least cost, of equal ones the first.
    """
    n = u64(len(cost))
    reach = math.sqrt(max(box[0] * box[0], box[1] * box[1]) + max(box[2] * box[2], box[3] * box[3]))
    double = 2.0 * d_max
    quickest = min(
        v_max, math.sqrt(double * path_left[sample(0, path_first, path_stride, path_count, path_last)])
    )
    for k in range(n):
        x[k] = start[0]
        y[k] = start[1]
        cosine[k] = start[2]
        sine[k] = start[3]
        before[k] = start[4]
        beside[k] = start[5]
        at[k] = 0.0
        room[k] = quickest
        cost[k] = 0.0
    share = 2.0 / steps
    seldom = 4.0 / steps
    # The lateral acceleration allows a yaw rate of a_lat / v. Where v divides, nothing is vectorised: three tangents of
    # that hyperbola stand for it, which lie below it by at most a ninth from a fifth of the top speed on.
    flat_a = 2.0 * a_lat / v_max
    steep_a = a_lat / (v_max * v_max)
    flat_b = 2.0 * flat_a
    steep_b = 4.0 * steep_a
    flat_c = 4.0 * flat_a
    steep_c = 16.0 * steep_a
    inverse = 1.0 / dt
    found[0] = 0.0
    # Where no motion can come near a wall at all, walls need not be looked at.
    column = min(max(math.floor(start[0] / resolution + 0.5), 0), width - 1)
    line = min(max(math.floor(0.5 - start[1] / resolution), 0), height - 1)
    open_ground = clear[line * width + column] - resolution > v_max * steps * dt + reach + margin
    # Discs of a robot whose own cell is so far from walls are farther than the margin.
    far_off = 0.0
    for j in range(len(disc_r)):
        far_off = max(far_off, math.sqrt(disc_x[j] * disc_x[j] + disc_y[j] * disc_y[j]) + disc_r[j])
    far_off += margin + 1.5 * resolution
    for block in range((n + u64(256) - 1) // u64(256)):
        begin = u64(block) * u64(256)
        end = min(begin + u64(256), n)
        for i in range(steps):
            first = u64(min((shift + i) // hold, rows - 1)) * n
            base = u64(i) * n
            mean_v = nominal_v[i]
            mean_w = nominal_w[i]
            pull_v = rate_weight * mean_v / spread_v
            pull_w = rate_weight * mean_w / spread_w
            if sideways == 0:
                # Loops of a few arrays each: with more of them the compiler does not prove that they are apart.
                if pull_v != 0.0 or pull_w != 0.0:
                    for k in range(begin, end):
                        cost[k] += pull_v * noise_v[first + k] + pull_w * noise_w[first + k]
                for k in range(begin, end):
                    old = before[k]
                    v = old + dt * min(max(mean_v + spread_v * noise_v[first + k], -d_max), a_max)
                    # It will be made to stop at the end of the section.
                    v = min(max(v, 0.0), room[k])
                    v = max(v, old - d_max * dt)
                    before[k] = v
                    push[base + k] = (v - old) * inverse
                for k in range(begin, end):
                    v = before[k]
                    lateral = max(max(flat_a - steep_a * v, flat_b - steep_b * v), flat_c - steep_c * v)
                    most = min(min(w_max, bend_max * v), lateral)
                    spin[base + k] = min(max(mean_w + spread_w * noise_w[first + k], -most), most)
                far = 0.5 * gear * dt
                for k in range(begin, end):
                    part = far * before[k]
                    x[k] += part * cosine[k]
                    y[k] += part * sine[k]
                for k in range(begin, end):
                    turned = spin[base + k] * dt
                    square = turned * turned
                    q = turned * (1.0 - square * (0.16666666666666666 - square * 0.008333333333333333))
                    p = 1.0 - square * (0.5 - square * 0.041666666666666664)
                    c = cosine[k]
                    s = sine[k]
                    cosine[k] = c * p - s * q
                    sine[k] = s * p + c * q
                for k in range(begin, end):
                    part = far * before[k]
                    x[k] += part * cosine[k]
                    y[k] += part * sine[k]
            else:
                mean_u = nominal_u[i]
                pull_u = rate_weight * mean_u / spread_v
                for k in range(begin, end):
                    cost[k] += (
                        pull_v * noise_v[first + k]
                        + pull_w * noise_w[first + k]
                        + pull_u * noise_u[first + k]
                    )
                    a = mean_v + spread_v * noise_v[first + k]
                    b = mean_u + spread_v * noise_u[first + k]
                    most = a_max / max(math.sqrt(a * a + b * b), a_max)
                    a *= most
                    b *= most
                    v = before[k] + a * dt
                    u = beside[k] + b * dt
                    size = math.sqrt(v * v + u * u)
                    most = room[k]
                    scale = most / max(size, max(most, _SLOW))
                    v *= scale
                    u *= scale
                    w = min(max(mean_w + spread_w * noise_w[first + k], -w_max), w_max)
                    turned = w * dt
                    square = turned * turned
                    q = turned * (1.0 - square * (0.16666666666666666 - square * 0.008333333333333333))
                    p = 1.0 - square * (0.5 - square * 0.041666666666666664)
                    c = cosine[k]
                    s = sine[k]
                    cosine[k] = c * p - s * q
                    sine[k] = s * p + c * q
                    x[k] += dt * (v * c - u * s)
                    y[k] += dt * (v * s + u * c)
                    before[k] = v
                    beside[k] = u
                    push[base + k] = a
                    side[base + k] = b
                    spin[base + k] = w
            if i % 2 == 0 and i + 1 < steps:
                continue
            bound(x, y, bounds, begin, end)
            found[0] += add_obstacles(
                x, y, cosine, sine, bounds, box, ox, oy, ou, ow, radius, (i + 1) * dt, margin, reach,
                share * obstacle_weight, share * collision_cost, cost, begin, end,
            )  # fmt: skip
            if not open_ground:
                add_walls(
                    x, y, cosine, sine, bounds, clear, width, height, resolution, disc_x, disc_y, disc_r, margin, far_off,
                    share * obstacle_weight, share * collision_cost, cost, begin, end,
                )  # fmt: skip
            if i % 4 != 3 and i + 1 < steps:
                continue
            add_path(
                x, y, cosine, sine, path_x, path_y, path_c, path_s, path_left, path_first, path_stride, path_count,
                path_last, seldom * path_weight, seldom * yaw_weight, v_max, double, at, room, cost, begin, end,
            )  # fmt: skip
    best = u64(0)
    for k in range(n):
        cost[k] += (
            progress_weight * path_left[sample(int(at[k]), path_first, path_stride, path_count, path_last)]
        )
        if cost[k] < cost[best]:
            best = k
    return best


@kernel(out=("nominal_v", "nominal_w", "nominal_u"), each=500, of="push")
def weighted(weight, push, spin, side, sideways, steps, nominal_v, nominal_w, nominal_u):
    """The mean of the commands of all motions by their weights, which sum to 1, step by step; into the nominal commands.

    The sums have four parts each, in a fixed order.
    """
    n = len(weight)
    whole = n - n % 4
    for i in range(steps):
        base = i * n
        a0 = 0.0
        a1 = 0.0
        a2 = 0.0
        a3 = 0.0
        b0 = 0.0
        b1 = 0.0
        b2 = 0.0
        b3 = 0.0
        for k in range(0, whole, 4):
            a0 += weight[k] * push[base + k]
            a1 += weight[k + 1] * push[base + k + 1]
            a2 += weight[k + 2] * push[base + k + 2]
            a3 += weight[k + 3] * push[base + k + 3]
            b0 += weight[k] * spin[base + k]
            b1 += weight[k + 1] * spin[base + k + 1]
            b2 += weight[k + 2] * spin[base + k + 2]
            b3 += weight[k + 3] * spin[base + k + 3]
        for k in range(whole, n):
            a0 += weight[k] * push[base + k]
            b0 += weight[k] * spin[base + k]
        nominal_v[i] = (a0 + a1) + (a2 + a3)
        nominal_w[i] = (b0 + b1) + (b2 + b3)
        if sideways != 0:
            c0 = 0.0
            for k in range(n):
                c0 += weight[k] * side[base + k]
            nominal_u[i] = c0
