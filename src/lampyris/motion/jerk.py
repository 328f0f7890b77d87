"""A limit on jerk: speeds whose acceleration changes no faster than the robot can bear.

What jerk is here
-----------------
A profile has one constant acceleration a[i] on each edge, taken as that of the middle of the edge's time. The
jerk at an inner node is the change of acceleration there over the time from one middle to the next, ``(a[i] -
a[i-1]) / ((dt[i-1] + dt[i]) / 2)``. At a node at rest (start, goal, a stop) the acceleration begins from 0
and ends at 0, each over half of its edge's time: ``2 a / dt``. A robot that drives already may begin with any
acceleration. Finer nodes bring this nearer to the jerk of a continuous motion.

How it is kept
--------------
In x = v^2 the accelerations are linear and the durations ``2 ds / (v[i] + v[i+1])`` convex. The jerk's limit,
``|a[i] - a[i-1]| <= jerk_max (dt[i-1] + dt[i]) / 2``, bounds a linear by a convex function: the set is not
convex, and no speeds are the greatest at every node. So this is a local method, from the inside: Newton's
method on ``sum dt - mu sum log (slack)`` (Fiacco and McCormick 1968), mu falling by 5 until mu times the
number of limits is a 1e-5 share of the time. A node's limits touch its two neighbours on either side alone,
so a step costs n operations. Every iterate keeps every limit strictly: whatever happens, what comes out is
feasible. The part of the second derivative that is not convex (the curvature of the durations in the jerk's
limit, where it outweighs the objective's) is left out, so every step descends.

It begins, from rest, with the profile without a jerk limit driven slower throughout: with v times k,
accelerations change by k^2 and jerks by k^3. A robot that drives already cannot do so; there a profile half
path between the fastest and the hardest braking is brought down to the limit by the method of centres (Huard
1967). Where that does not arrive, none is found and the start speed is refused; that none exists is not
proven. Times lost, beside bounds: docs/speed/profile.md.
"""

from __future__ import annotations

import math

import numpy as np

from lampyris.kernels.motion.jerk_barrier import NOISE, ROWS, descend, measure
from lampyris.kernels.motion.speed_passes import sweep
from lampyris.typing import Floats

_GAP = 1e-5
"""Share of the time that the barrier may leave."""

_STEPS = 1500
"""Newton steps for a stretch between two stops; 60 are usual, 600 with nodes 1e-9 beside 10 m apart."""


def jerks(ds: Floats, v: Floats) -> Floats:
    """The maximum jerk at each node by the definition above, m/s3 >= 0; shape (n,).

    Less what the rounding of v^2 may have made of it: between nodes 1e-9 m apart that is all of it.

    Parameters
    ----------
    ds : metres of each edge, (n - 1,).
    v : m/s, (n,). Edges at rest at both ends count nothing.
    """
    out = np.zeros(len(v))
    pace = v[:-1] + v[1:]
    moving = pace > 0.0
    dt = 2.0 * ds / np.where(moving, pace, 1.0)
    a = (v[1:] - v[:-1]) / dt
    rest = v == 0.0
    noise = NOISE * np.square(np.maximum(v[1:], v[:-1])) / ds
    alone = np.where(moving, 2.0 * (np.abs(a) - noise) / dt, 0.0)
    out[:-1] = np.where(rest[:-1], alone, 0.0)
    out[1:] = np.maximum(out[1:], np.where(rest[1:], alone, 0.0))
    inner = (np.abs(a[1:] - a[:-1]) - noise[1:] - noise[:-1]) / (0.5 * (dt[1:] + dt[:-1]))
    out[1:-1] = np.where(rest[1:-1], out[1:-1], inner)
    return np.maximum(out, 0.0)


def limited(
    ds: Floats, x: Floats, *, a_max: float, d_max: float, jerk_max: float, any_will_do: bool = False
) -> Floats | None:
    """Squares of speed with bounded jerk, at most ``x`` anywhere; None if none is found.

    Parameters
    ----------
    ds : metres of each edge, (n - 1,), > 0.
    x : v^2 at each node, (n,): the fastest profile without a limit on jerk, 0 at the last node. Its first
        value is kept. Where it is 0 the robot stands, and a stretch between two such nodes is solved alone.
    a_max, d_max, jerk_max : limits, > 0.
    any_will_do : stop at the first profile that keeps the limits.

    Only where the first value is not 0 can there be none: from rest, any profile will do, driven slowly.
    """
    out = x.copy()
    still = np.flatnonzero(x == 0.0).tolist()
    begin = 0
    for end in still if still[0] > 0 else still[1:]:
        if end - begin > 1 or x[begin] > 0.0:
            piece = _Stretch(ds[begin:end], x[begin : end + 1], a_max, d_max, jerk_max)
            found = piece.solve(any_will_do)
            if found is None:
                return None
            out[begin : end + 1] = found
        begin = end
    return out


def rest_to_rest(ds: float, rate: float, jerk_max: float, cap: float) -> float:
    """Seconds from rest to rest over ``ds`` metres with acceleration and braking of at most ``rate``.

    Jerk is jerk_max, 0 or -jerk_max throughout (the seven phases of textbooks), the same both ways. Unlike
    :func:`lampyris.motion.profile.stop_to_stop` it does not use the greater of two unequal limits.
    """

    def ramp(v: float) -> float:
        """Seconds from rest to v, half of which times v is the distance."""
        if v * jerk_max >= rate * rate:
            return v / rate + rate / jerk_max
        return 2.0 * math.sqrt(v / jerk_max)

    ramp_length = cap * ramp(cap) if math.isfinite(cap) else math.inf
    if ramp_length <= ds:
        return 2.0 * ramp(cap) + (ds - ramp_length) / cap
    # v ramp(v) = ds, either from a quadratic or from v^3 = ds^2 jerk_max / 4.
    flat = rate * rate / jerk_max
    v = 0.5 * (math.sqrt(flat * flat + 4.0 * rate * ds) - flat)
    if v < flat:
        v = cube_root(0.25 * ds * ds * jerk_max)
    return 2.0 * ramp(v)


def cube_root(x: float) -> float:
    """Cube root of a number >= 0 from ``+ - * /`` alone: the same bits everywhere."""
    if x == 0.0:
        return 0.0
    mantissa, exponent = math.frexp(x)
    third, rest = divmod(exponent, 3)
    mantissa = math.ldexp(mantissa, rest)
    root = 1.0
    for _ in range(8):
        root -= (root - mantissa / (root * root)) / 3.0
    return math.ldexp(root, third)


class _Stretch:
    """From a start, at rest or not, to a stop: squares of speed at the inner nodes are the unknowns y."""

    def __init__(self, ds: Floats, top: Floats, a_max: float, d_max: float, jerk_max: float) -> None:
        self.ds, self.top = ds, top
        self.a_max, self.d_max, self.jerk_max = a_max, d_max, jerk_max
        self.rest = bool(top[0] == 0.0)
        self.steps = 0

    def solve(self, any_will_do: bool) -> Floats | None:
        """The best squares of speed found, or the first, (m + 1,)."""
        worst = float(jerks(self.ds, np.sqrt(self.top)).max())
        if worst <= self.jerk_max:
            return self.top
        if len(self.ds) == 1:
            return None
        y = self._slowed(worst) if self.rest else self._centred()
        return None if y is None else self._whole(y if any_will_do else self._fastest(y))

    def _whole(self, y: Floats) -> Floats:
        return np.concatenate((self.top[:1], y, self.top[-1:]))

    def _slowed(self, worst: float) -> Floats:
        """The whole profile driven slower; jerk grows with the cube of speed."""
        share = min(0.99, 0.97 * cube_root(self.jerk_max / worst))
        y: Floats = self.top[1:-1] * (share * share)
        return y

    def _under(self, share: float) -> Floats | None:
        """The fastest profile under limits that are all less by a share; None if the start is too fast."""
        x = self.top * (1.0 - share)
        x[0] = self.top[0]
        rates = 2.0 * (1.0 - share) * self.ds
        codes, keeps = np.zeros(len(x), dtype=np.int64), np.zeros(len(x), dtype=np.bool_)
        sweep(x, self.a_max * rates, self.d_max * rates, keeps, codes, codes.copy())
        return None if x[0] < self.top[0] else x[1:-1]

    def _centred(self) -> Floats | None:
        """A profile within every limit for a robot that drives already; None if none is found."""
        low, high = 0.0, 1.0
        for _ in range(30):
            share = 0.5 * (low + high)
            low, high = (low, share) if self._under(share) is None else (share, high)
        y = self._under(0.5 * low)
        asked, self.jerk_max = self.jerk_max, math.inf
        if y is None or self._seconds(y) == math.inf:
            return None
        worst = self._worst(y)
        for _ in range(200):
            if worst < asked:
                self.jerk_max = asked
                return y
            # A little above the worst jerk there is: the centre of the limits then lies well below it.
            self.jerk_max = max(asked, 1.05 * worst)
            y = self._descend(y, 1.0, 0.0, 12)
            before, worst = worst, self._worst(y)
            if not worst < before * (1.0 - 1e-4):
                break
        self.jerk_max = asked
        return None

    def _worst(self, y: Floats) -> float:
        return float(jerks(self.ds, np.sqrt(self._whole(y))).max())

    def _fastest(self, y: Floats) -> Floats:
        """Down the barrier from a profile within every limit."""
        limits = 6 * len(self.ds) - 2
        mu = self._seconds(y) / limits
        while self.steps < _STEPS:
            y = self._descend(y, mu, 1.0, 50)
            if mu * limits <= _GAP * self._seconds(y):
                break
            mu *= 0.2
        return y

    def _limits(self) -> Floats:
        return np.array([self.a_max, self.d_max, self.jerk_max])

    def _seconds(self, y: Floats) -> float:
        """Total time; infinite if a limit is not kept strictly."""
        sums = np.empty(2)
        kept = measure(self._whole(y), self.ds, self.top, self._limits(), self.rest, sums)
        return float(sums[0]) if kept else math.inf

    def _descend(self, y: Floats, mu: float, weight: float, most: int) -> Floats:
        """Newton's method on ``weight * time - mu * sum log slack``, never leaving the inside."""
        x = self._whole(y)
        scratch = (x.copy(), np.empty(ROWS * len(x)), *np.empty((8, len(y))), np.empty(2))
        self.steps += descend(x, self.ds, self.top, self._limits(), self.rest, mu, weight, most, *scratch)
        return x[1:-1]
