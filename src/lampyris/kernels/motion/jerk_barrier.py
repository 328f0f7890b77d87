"""Newton's method on the barrier function of a jerk-limited velocity profile.

The definitions (jerk, limits, slack) and the method are those of :mod:`lampyris.motion.jerk`. The unknowns are
x = v^2 at the inner nodes of a segment of m edges; with mu > 0 and a weight of 0 or 1 the function is::

    weight * sum dt - mu * sum log slack

A node's limits involve only the two nodes on either side of it, so its second derivative has five diagonals
and a step takes time proportional to m.

All kernels share these arguments:

x, ahead : float64 (m + 1,): v^2 at each node.
ds : float64 (m,): edge lengths, m > 0.
top : float64 (m + 1,): upper bounds of x.
limits : float64 (3,): a_max, d_max, jerk_max.
from_rest : whether the robot starts at rest, so that the jerk at the first node is limited too.
"""

from __future__ import annotations

import math

from lampyris.kernels._helpers import stopped
from lampyris.kernels._jit import kernel
from lampyris.kernels.motion.banded_system import solve_banded

NOISE = 1.0 / 2**52
"""Rounding error of an edge's acceleration, as a share of v^2 over the edge length."""

_LN2_HIGH = float.fromhex("0x1.62e42feep-1")
_LN2_LOW = float.fromhex("0x1.a39ef35793c76p-33")

RATE, LEFT, RIGHT, ACCELERATION, HALF, LOW, HIGH, PUSH, WORTH, STIFF = range(10)
"""Rows of ``work``, each of m + 1 elements. By edge: half the derivative of its duration to speed and that
duration's derivatives to x at its two nodes; its acceleration; its share of the room that a change of
acceleration has; the force on its acceleration; what a longer duration is worth; the stiffness of its limits
of acceleration. By inner node: the forces of the jerk limit, from below and from above."""
ROWS = 10


@kernel(each=20_000)
def log_of_product(mantissa, exponent):
    """Natural logarithm of ``mantissa * 2**exponent`` with 0.5 <= mantissa < 1, the same bits on every machine."""
    if mantissa < 0.7071067811865476:
        mantissa *= 2.0
        exponent -= 1
    f = (mantissa - 1.0) / (mantissa + 1.0)
    z = f * f
    total = 0.0
    k = 23.0
    while k > 1.0:
        total = total * z + 1.0 / k
        k -= 2.0
    return exponent * _LN2_HIGH + (2.0 * f + (2.0 * f * (z * total) + exponent * _LN2_LOW))


@kernel(out=("sums",), each=3_000)
def measure(x, ds, top, limits, from_rest, sums):
    """The sums of the barrier function; 1 if every limit is kept strictly, else 0.

    Parameters
    ----------
    sums : out, float64 (2,): total time in seconds, and the sum of the logarithms of all slacks. Not written
        if the answer is 0.
    """
    m = len(ds)
    a_max, d_max, jerk_max = limits[0], limits[1], limits[2]
    time = 0.0
    lost = 0.0
    product = 1.0
    exponent = 0
    half_before = 0.0
    a_before = 0.0
    for e in range(m):
        if e < m - 1:
            slack = top[e + 1] - x[e + 1]
            if not (x[e + 1] > 0.0 and slack > 0.0):
                return 0
            product, more = math.frexp(product * x[e + 1])
            exponent += more
            product, more = math.frexp(product * slack)
            exponent += more
        dt = 2.0 * ds[e] / (math.sqrt(x[e]) + math.sqrt(x[e + 1]))
        a = (x[e + 1] - x[e]) * (0.5 / ds[e])
        half = 0.5 * jerk_max * dt + NOISE * max(x[e + 1], x[e]) / ds[e]
        if not (a_max - a > 0.0 and d_max + a > 0.0):
            return 0
        product, more = math.frexp(product * (a_max - a))
        exponent += more
        product, more = math.frexp(product * (d_max + a))
        exponent += more
        if e > 0:
            room = half_before + half
            change = a - a_before
            if not (room - change > 0.0 and room + change > 0.0):
                return 0
            product, more = math.frexp(product * (room - change))
            exponent += more
            product, more = math.frexp(product * (room + change))
            exponent += more
        # At rest the acceleration begins from 0, and ends at 0.
        if e == 0 and from_rest:
            if not half - a > 0.0:
                return 0
            product, more = math.frexp(product * (half - a))
            exponent += more
        if e == m - 1:
            if not half + a > 0.0:
                return 0
            product, more = math.frexp(product * (half + a))
            exponent += more
        half_before = half
        a_before = a
        # A compensated sum (Neumaier 1974).
        total = time + dt
        if time >= dt:
            lost += (time - total) + dt
        else:
            lost += (dt - total) + time
        time = total
    sums[0] = time + lost
    sums[1] = log_of_product(product, exponent)
    return 1


@kernel(out=("work",), each=5_000)
def _forces(x, ds, limits, from_rest, mu, weight, work):
    """Fill ``work`` for :func:`_assemble`; the forces at the first and the last node are of rows LOW and HIGH."""
    m = len(ds)
    n = m + 1
    jerk = 0.5 * limits[2]
    for e in range(m):
        pace = math.sqrt(x[e]) + math.sqrt(x[e + 1])
        rate = ds[e] / (pace * pace)
        a = (x[e + 1] - x[e]) * (0.5 / ds[e])
        under, over = mu / (limits[0] - a), mu / (limits[1] + a)
        per = 0.5 / ds[e]
        work[RATE * n + e] = rate
        work[LEFT * n + e] = -rate * (1.0 / math.sqrt(x[e])) if e > 0 else 0.0
        work[RIGHT * n + e] = -rate * (1.0 / math.sqrt(x[e + 1])) if e < m - 1 else 0.0
        work[ACCELERATION * n + e] = a
        work[HALF * n + e] = jerk * (2.0 * ds[e] / pace) + NOISE * max(x[e + 1], x[e]) / ds[e]
        work[PUSH * n + e] = under - over
        work[STIFF * n + e] = (under * under + over * over) * (per * per / mu)
    for i in range(1, m):
        room = work[HALF * n + i - 1] + work[HALF * n + i]
        change = work[ACCELERATION * n + i] - work[ACCELERATION * n + i - 1]
        work[LOW * n + i] = mu / (room - change)
        work[HIGH * n + i] = mu / (room + change)
    first, last = 0.0, mu / (work[HALF * n + m - 1] + work[ACCELERATION * n + m - 1])
    if from_rest:
        first = mu / (work[HALF * n] - work[ACCELERATION * n])
    work[LOW * n], work[HIGH * n] = first, 0.0
    work[LOW * n + m], work[HIGH * n + m] = 0.0, last
    for e in range(m):
        pull = 0.0
        push = work[PUSH * n + e]
        if e < m - 1:
            pull += work[LOW * n + e + 1] + work[HIGH * n + e + 1]
        if e > 0:
            pull += work[LOW * n + e] + work[HIGH * n + e]
            push += work[LOW * n + e] - work[HIGH * n + e]
        if e < m - 1:
            push -= work[LOW * n + e + 1] - work[HIGH * n + e + 1]
        if e == 0:
            pull, push = pull + first, push + first
        if e == m - 1:
            pull, push = pull + last, push - last
        work[PUSH * n + e] = push
        work[WORTH * n + e] = weight - jerk * pull


@kernel(out=("gradient", "diagonal", "near", "far"), each=10_000)
def _assemble(x, ds, top, limits, mu, work, gradient, diagonal, near, far):
    """Gradient and second derivative at the inner nodes; what is not convex of the latter is left out.

    Parameters
    ----------
    work : rows that :func:`_forces` has filled.
    gradient, diagonal, near, far : out, float64 (m - 1,): ``near`` and ``far`` are the entries one and two to
        the left of the diagonal.
    """
    m = len(ds)
    n = m + 1
    jerk = 0.5 * limits[2]
    for i in range(1, m):
        per_before, per = 0.5 / ds[i - 1], 0.5 / ds[i]
        centre = jerk * (work[RIGHT * n + i - 1] + work[LEFT * n + i])
        d = 0.0
        one = 0.0
        two = 0.0
        # The jerk limits of the nodes i + 1, i and i - 1: squares of their derivatives to x at node i, and
        # products with those to x at nodes i - 1 and i - 2.
        for side in range(2):
            sign = 1.0 - 2.0 * side
            row = LOW + side
            if i < m - 1:
                force = work[row * n + i + 1]
                here = jerk * work[LEFT * n + i] - sign * per
                d += force * force / mu * here * here
            force = work[row * n + i]
            hold = force * force / mu
            here = centre + sign * (per_before + per)
            d += hold * here * here
            if i > 1:
                one += hold * (jerk * work[LEFT * n + i - 1] - sign * per_before) * here
                per_two = 0.5 / ds[i - 2]
                force = work[row * n + i - 1]
                hold = force * force / mu
                here = jerk * work[RIGHT * n + i - 1] - sign * per_before
                d += hold * here * here
                before = jerk * (work[RIGHT * n + i - 2] + work[LEFT * n + i - 1])
                one += hold * (before + sign * (per_two + per_before)) * here
                if i > 2:
                    two += hold * (jerk * work[LEFT * n + i - 2] - sign * per_two) * here
        if i == 1:
            end = (jerk * work[RIGHT * n] - per_before) * work[LOW * n]
            d += end * end / mu
        if i == m - 1:
            end = (jerk * work[LEFT * n + m - 1] - per) * work[HIGH * n + m]
            d += end * end / mu
        v_before, v, v_after = math.sqrt(x[i - 1]), math.sqrt(x[i]), math.sqrt(x[i + 1])
        inverse = 1.0 / v
        rate = work[RATE * n + i]
        curve = max(work[WORTH * n + i], 0.0)
        d += curve * inverse * inverse * (rate / (v + v_after) + 0.5 * rate * inverse) + work[STIFF * n + i]
        rate = work[RATE * n + i - 1]
        curve, bend, stiff = max(work[WORTH * n + i - 1], 0.0), rate / (v_before + v), work[STIFF * n + i - 1]
        d += curve * inverse * inverse * (bend + 0.5 * rate * inverse) + stiff
        above, below = mu / x[i], mu / (top[i] - x[i])
        diagonal[i - 1] = d + (above * above + below * below) / mu
        near[i - 1] = one + (curve * bend * (1.0 / v_before) * inverse - stiff) if i > 1 else 0.0
        far[i - 1] = two
        slope = work[WORTH * n + i] * work[LEFT * n + i] - work[PUSH * n + i] * per
        slope += work[WORTH * n + i - 1] * work[RIGHT * n + i - 1] + work[PUSH * n + i - 1] * per_before
        gradient[i - 1] = slope + (below - above)


@kernel(out=("d", "first", "second", "step"), each=3_000)
def _solve(gradient, diagonal, near, far, d, first, second, step):
    """Newton's step; where rounding leaves the matrix indefinite, with a slightly greater diagonal.

    Parameters
    ----------
    d, first, second : float64 (m - 1,): destroyed.
    step : out, float64 (m - 1,).
    """
    n = len(gradient)
    shift = 0.0
    while shift <= 1.0:
        for i in range(n):
            d[i] = diagonal[i] * (1.0 + shift)
            first[i] = near[i]
            second[i] = far[i]
            step[i] = -gradient[i]
        if solve_banded(d, first, second, step):
            return
        shift = 1e-14 if shift == 0.0 else 100.0 * shift
    for i in range(n):
        step[i] = -gradient[i] / diagonal[i]


@kernel(
    out=("x", "ahead", "work", "gradient", "diagonal", "near", "far", "d", "first", "second", "step", "sums"),
    each=50_000,
)
def descend(
    x, ds, top, limits, from_rest, mu, weight, most,
    ahead, work, gradient, diagonal, near, far, d, first, second, step, sums, halt,
):  # fmt: skip
    """Lower the barrier function by Newton's method, never leaving the inside of the limits.

    Parameters
    ----------
    x : in and out: strictly within every limit; if it is not, nothing is done.
    most : the greatest number of steps.
    ahead : float64 (m + 1,). Given: the values of x at its two ends.
    work : float64 (ROWS (m + 1),). Others but ``sums``, float64 (2,): float64 (m - 1,). All are scratch.

    Returns
    -------
    The number of steps taken.
    """
    inner = len(ds) - 1
    if not measure(x, ds, top, limits, from_rest, sums):
        return 0
    merit = weight * sums[0] - mu * sums[1]
    for steps in range(most):
        if stopped(halt):
            return steps
        _forces(x, ds, limits, from_rest, mu, weight, work)
        _assemble(x, ds, top, limits, mu, work, gradient, diagonal, near, far)
        _solve(gradient, diagonal, near, far, d, first, second, step)
        fall = 0.0
        for i in range(inner):
            fall -= gradient[i] * step[i]
        if not fall > 0.1 * mu:
            return steps
        share = 1.0
        while True:
            if stopped(halt):
                return steps
            for i in range(inner):
                ahead[i + 1] = x[i + 1] + share * step[i]
            if measure(ahead, ds, top, limits, from_rest, sums):
                reached = weight * sums[0] - mu * sums[1]
                if reached <= merit - 1e-4 * share * fall:
                    break
            share *= 0.5
            if not share > 1e-12:
                return steps
        for i in range(inner):
            x[i + 1] = ahead[i + 1]
        merit = reached
    return most
