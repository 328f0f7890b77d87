"""Shortest curves of bounded curvature for a car that drives ahead and in reverse.

Reeds, Shepp, "Optimal paths for a car that goes both forwards and backwards", Pacific Journal of Mathematics
145(2), 1990. The shortest curve is one of 48 words. Eleven of them have formulas here (section 8 of the paper); the
others come from them by driving in the other direction (``flip``) and by mirroring (``mirror``).

Every formula solves the equations of the end of the curve, whatever the signs of its lengths. A word with a sign that
the paper excludes is therefore a curve to the goal as well, only never the shortest: signs are not tested, and no
case is lost to rounding where a length is 0.

Lengths are in turning radii, negative ones are driven in reverse. A kind of segment is 1 (to the left), 0 (straight)
or -1 (to the right).
"""

from __future__ import annotations

from math import inf, sqrt

from lampyris.kernels._jit import kernel, u64
from lampyris.kernels.curves.angles import PI, QUARTER, atan2, sine_cosine, wrapped

FAMILIES = 11
_KINDS = (
    1, 0, 1, 0, 0,
    1, 0, -1, 0, 0,
    1, -1, 1, 0, 0,
    1, -1, 1, 0, 0,
    1, -1, 1, -1, 0,
    1, -1, 1, -1, 0,
    1, -1, 0, 1, 0,
    1, 0, -1, 1, 0,
    1, -1, 0, -1, 0,
    -1, 0, -1, 1, 0,
    1, -1, 0, 1, -1,
)  # fmt: skip
"""Kinds of the segments of each family."""


@kernel(inline=True)
def _ends(u, v, xi, eta, yaw, sin_u, cos_u):
    """First and last arc of a curve of four arcs, the inner ones u and v = u or -u long."""
    # u - v is 0 or 2 u.
    if v == u:
        sin_d = 0.0
        cos_d = 1.0
    else:
        sin_d = 2.0 * sin_u * cos_u
        cos_d = 1.0 - 2.0 * sin_u * sin_u
    a = sin_u - sin_d
    b = cos_u - cos_d - 1.0
    t = atan2(eta * a - xi * b, xi * a + eta * b)
    if 2.0 * (cos_d - cos_u - cos_u) + 3.0 < 0.0:
        t += PI
    t = wrapped(t)
    return t, wrapped(t - u + v - yaw)


@kernel(inline=True)
def _family(family, x, y, yaw, s, c, xb, yb, best):
    """Lengths t, u, v of a family's curve to a goal, and whether it has one below ``best``; s, c: sine and cosine of yaw.

    (xb, yb) is where the start lies for a car at the goal that looks back: for curves driven from their end.
    """
    if family == 3 or family == 7 or family == 9:
        x = xb
        y = yb
    t = 0.0
    u = 0.0
    v = 0.0
    if family == 0 or family == 2 or family == 3 or family == 6 or family == 7:
        # Centre of the last circle, to the left, from that of the first.
        xi = x - s
        eta = y - 1.0 + c
    else:  # to the right
        xi = x + s
        eta = y - 1.0 - c
    square = xi * xi + eta * eta
    if family == 0:  # (8.1) L S L
        u = sqrt(square)
        if u >= best:
            return False, t, u, v
        t = atan2(eta, xi)
        v = wrapped(yaw - t)
    elif family == 1:  # (8.2) L S R
        if square < 4.0:
            return False, t, u, v
        u = sqrt(square - 4.0)
        if u >= best:
            return False, t, u, v
        t = wrapped(atan2(eta, xi) + atan2(2.0, u))
        v = wrapped(t - yaw)
    elif family == 2 or family == 3:  # (8.3), (8.4) L R L
        if square > 16.0:
            return False, t, u, v
        r = 0.25 * sqrt(square)
        u = -2.0 * atan2(r, sqrt((1.0 - r) * (1.0 + r)))
        t = wrapped(atan2(eta, xi) + 0.5 * u + PI)
        v = wrapped(yaw - t + u)
    elif family == 4:  # (8.7) L R L R
        r = 0.25 * (2.0 + sqrt(square))
        if r > 1.0:
            return False, t, u, v
        sin_u = sqrt((1.0 - r) * (1.0 + r))
        u = atan2(sin_u, r)
        t, v = _ends(u, -u, xi, eta, yaw, sin_u, r)
    elif family == 5:  # (8.8) L R L R
        r = 0.0625 * (20.0 - square)
        if r < 0.0 or r > 1.0:
            return False, t, u, v
        sin_u = -sqrt((1.0 - r) * (1.0 + r))
        u = atan2(sin_u, r)
        t, v = _ends(u, u, xi, eta, yaw, sin_u, r)
    elif square < 4.0:
        return False, t, u, v
    elif family == 6 or family == 7:  # (8.9) L R S L
        r = sqrt(square - 4.0)
        u = 2.0 - r
        if abs(u) + QUARTER >= best:
            return False, t, u, v
        t = wrapped(atan2(eta, xi) + atan2(r, -2.0))
        v = wrapped(yaw - QUARTER - t)
    elif family == 8 or family == 9:  # (8.10) L R S R
        u = 2.0 - sqrt(square)
        if abs(u) + QUARTER >= best:
            return False, t, u, v
        t = atan2(xi, -eta)
        v = wrapped(t + QUARTER - yaw)
    else:  # (8.11) L R S L R
        u = 4.0 - sqrt(square - 4.0)
        if abs(u) + PI >= best:
            return False, t, u, v
        t = atan2((4.0 - u) * xi - 2.0 * eta, -2.0 * xi + (u - 4.0) * eta)
        v = wrapped(t - yaw)
    return True, t, u, v


@kernel(inline=True)
def _segments(family, t, u, v):
    """The five signed lengths of a curve."""
    if family < 3:
        return t, u, v, 0.0, 0.0
    if family == 3:
        return v, u, t, 0.0, 0.0
    if family == 4:
        return t, u, -u, v, 0.0
    if family == 5:
        return t, u, u, v, 0.0
    if family == 6 or family == 8:
        return t, -QUARTER, u, v, 0.0
    if family == 7 or family == 9:
        return v, u, -QUARTER, t, 0.0
    return t, -QUARTER, u, -QUARTER, v


@kernel(inline=True)
def _switch(before, length):
    """Whether the gear changes to that of a segment."""
    return (before > 0.0 and length < 0.0) or (before < 0.0 and length > 0.0)


@kernel(inline=True)
def _priced(a, b, c, d, e, ahead, back, switch):
    """Cost of signed lengths, ahead and back by their prices, with each change of gear."""
    cost = 0.0
    last = 0.0
    changes = 0
    for part in (a, b, c, d, e):
        cost += part * ahead if part > 0.0 else -part * back
        if part != 0.0:
            if _switch(last, part):
                changes += 1
            last = part
    return cost + changes * switch


@kernel(out=("lengths", "kinds"))
def reeds_shepp(x, y, yaw, reverse, switch, lengths, kinds):
    """The cheapest of the words of Reeds and Shepp from the pose (0, 0, 0); returns its cost.

    Parameters
    ----------
    x, y, yaw : the goal, in turning radii and radians.
    reverse : what a length in reverse costs more than one ahead; with 1, and no ``switch``, it is the shortest curve
        of all.
    switch : cost of a change between driving ahead and in reverse, in turning radii.
    lengths : float64 (5,): signed lengths of the segments; 0 where there are fewer.
    kinds : int64 (5,).
    """
    s, c = sine_cosine(yaw)
    xb = x * c + y * s
    yb = x * s - y * c
    best = inf
    word = 0
    best_t = 0.0
    best_u = 0.0
    best_v = 0.0
    for form in range(4):
        flip = -1.0 if form & 1 else 1.0
        mirror = -1.0 if form & 2 else 1.0
        ahead = 1.0 if form & 1 == 0 else reverse
        back = reverse if form & 1 == 0 else 1.0
        for family in range(FAMILIES):
            found, t, u, v = _family(
                family,
                flip * x,
                mirror * y,
                flip * mirror * yaw,
                flip * mirror * s,
                c,
                flip * xb,
                mirror * yb,
                best,
            )
            if not found or abs(t) + abs(u) + abs(v) >= best:
                continue
            p0, p1, p2, p3, p4 = _segments(family, t, u, v)
            cost = _priced(p0, p1, p2, p3, p4, ahead, back, switch)
            if cost < best:
                best = cost
                word = 4 * family + form
                best_t = t
                best_u = u
                best_v = v
    family = word >> 2
    flip = -1.0 if word & 1 else 1.0
    side = -1 if word & 2 else 1
    p0, p1, p2, p3, p4 = _segments(family, best_t, best_u, best_v)
    lengths[u64(0)] = flip * p0
    lengths[u64(1)] = flip * p1
    lengths[u64(2)] = flip * p2
    lengths[u64(3)] = flip * p3
    lengths[u64(4)] = flip * p4
    for k in range(5):
        kinds[u64(k)] = side * _KINDS[5 * family + k]
    return best
