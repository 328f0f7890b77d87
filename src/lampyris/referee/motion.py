"""Motions along a line: whether speeds, accelerations and times at nodes can be driven, and may be.

Nothing is known here of paths, maps or laws: distances, speeds and limits are all there is. Between two nodes
the acceleration is constant, so the speed is monotone and its square is a straight line over the distance: a
limit that holds at two neighbours holds between them, and so does any limit whose square is straight there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lampyris.referee.verdict import Violation
from lampyris.typing import Floats

EPSILON = 2.0**-52


def check_motion(
    s: ArrayLike,
    v: ArrayLike,
    a: ArrayLike,
    t: ArrayLike,
    *,
    a_max: float,
    d_max: float,
    v_max: float,
    caps: Sequence[tuple[str, Floats]] = (),
    v0: float | None = 0.0,
    jerk_max: float | None = None,
    tolerance: float = 1e-12,
) -> Violation | None:
    """Whether a robot can drive so, keeps every limit at and between nodes, and stands still at the end.

    Rules, in this order: ``nodes``, ``s``, ``speed``, ``goal``, ``start``, ``acceleration``, ``braking``,
    ``a``, each cap's own name, ``time``, ``jerk``. The first broken one is reported, at its first node or edge.

    Parameters
    ----------
    s, v, a, t : (n,): metres, m/s, m/s2 on the way to the next node (0 at the last), seconds from 0. A wait
        is two nodes at one distance, both with v = 0 and a = 0. An edge between two nodes at rest that lie
        apart is driven somehow in between: a must be 0 there, and the time no shorter than full throttle, the
        lesser cap of its two nodes, and full braking make it.
    a_max, d_max, v_max : limits, > 0.
    caps : (cause, m/s (n,)), infinity where one says nothing.
    v0 : the speed that the robot has at the first node; None: whatever it is.
    jerk_max : m/s3; None: no limit. The jerk at a node is the change of a there, divided by half the sum of
        the durations of the two edges; at a node at rest a begins from 0 and ends at 0, each over half of
        its edge's duration. Nothing is asked of the first node of a robot that drives already. Edges from
        rest to rest may take no less than ``(32 ds / jerk_max) ** (1 / 3)`` seconds.
    tolerance : share of a speed or time, so twice that share of a square. Rounding that no computation in
        doubles can avoid is forgiven besides: of a time, units in its last place (two more for each edge
        too short for the clock); of a jerk 1e-9, and what the last places of v make of it.
    """
    given = [np.asarray(x, dtype=np.float64) for x in (s, v, a, t)]
    n = len(given[0])
    limits = [np.asarray(cap, dtype=np.float64) for _, cap in caps]
    if n == 0 or any(x.shape != (n,) for x in (*given, *limits)) or not np.isfinite(given).all():
        return Violation("nodes", "motion", "s, v, a, t and caps must be equally many numbers, at least one")
    motion = _Motion(given, a_max, d_max, v_max, tolerance)
    least = np.minimum.reduce([np.full(n, v_max), *limits])
    return (
        motion.distances()
        or motion.speeds()
        or motion.ends(v0)
        or motion.accelerations()
        or motion.caps([name for name, _ in caps], limits)
        or motion.times(least, jerk_max)
        or (None if jerk_max is None else motion.jerks(jerk_max))
    )


def first(
    rule: str, bad: NDArray[np.bool_], sentence: Callable[[int], str], noun: str = "node"
) -> Violation | None:
    """A violation at the first True, if there is one."""
    if not bad.any():
        return None
    k = int(bad.argmax())
    return Violation(rule, f"{noun} {k}", sentence(k))


def rest_to_rest(ds: float, a_max: float, d_max: float, cap: float) -> float:
    """Seconds from rest to rest: full acceleration, a cruise at the cap if it is reached, full braking."""
    to_cap, from_cap = cap * cap / (2 * a_max), cap * cap / (2 * d_max)
    if to_cap + from_cap <= ds:
        return cap / a_max + cap / d_max + (ds - to_cap - from_cap) / cap
    peak = math.sqrt(2 * ds * a_max * d_max / (a_max + d_max))
    return peak / a_max + peak / d_max


class _Motion:
    """The numbers that several rules look at."""

    def __init__(
        self, given: Sequence[Floats], a_max: float, d_max: float, v_max: float, tolerance: float
    ) -> None:
        s, v, a, t = given
        self.s, self.v, self.a, self.t = s, v, a, t
        self.a_max, self.d_max, self.v_max, self.tol = a_max, d_max, v_max, tolerance
        self.ds = np.diff(s)
        self.rest = (v[:-1] == 0) & (v[1:] == 0)
        self.wait = self.ds == 0

    def distances(self) -> Violation | None:
        """Distances rise, but for waits."""
        s = self.s
        return first(
            "s", ~(self.ds >= 0), lambda k: f"s falls from {float(s[k])!r} to {float(s[k + 1])!r}", "edge"
        ) or first(
            "s",
            self.wait & ~(self.rest & (self.a[:-1] == 0)),
            lambda k: f"two nodes at {float(s[k])!r} m, where the robot does not stand",
            "edge",
        )

    def speeds(self) -> Violation | None:
        v = self.v
        bad = ~((v >= 0) & (v <= self.v_max * (1 + self.tol)))
        return first("speed", bad, lambda k: f"{float(v[k])!r} m/s; allowed 0 to {self.v_max:g}")

    def ends(self, v0: float | None) -> Violation | None:
        """It stands at the last node, nothing follows, and it begins with the speed it has."""
        v, last = self.v, f"node {len(self.v) - 1}"
        if v[-1] != 0:
            return Violation("goal", last, f"{float(v[-1])!r} m/s at the goal; must be 0")
        if v0 is not None and abs(v[0] - v0) > self.tol * v0:
            return Violation(
                "start",
                "node 0",
                f"{float(v[0])!r} m/s at the start; the robot drives {float(v0)!r} m/s there",
            )
        return None

    def accelerations(self) -> Violation | None:
        """No edge asks for more than a_max or d_max, and a is what the edge asks for."""
        v, a, ds = self.v, self.a, self.ds
        x0, x1 = v[:-1] ** 2, v[1:] ** 2
        give = 2 * self.tol * np.maximum(x0, x1)

        def needs(k: int) -> str:
            rate = (x1[k] - x0[k]) / (2 * ds[k])
            return (
                f"from {float(v[k])!r} to {float(v[k + 1])!r} m/s in {ds[k]:g} m needs {float(rate)!r} m/s2"
            )

        over = x1 - x0 > 2 * self.a_max * ds + give
        under = x0 - x1 > 2 * self.d_max * ds + give
        wrong = ~(np.abs(2 * a[:-1] * ds - (x1 - x0)) <= give)
        outside = ~((a <= self.a_max * (1 + self.tol)) & (a >= -self.d_max * (1 + self.tol)))
        found = (
            first("acceleration", over, lambda k: f"{needs(k)}; a_max is {self.a_max:g}", "edge")
            or first("braking", under, lambda k: f"{needs(k)}; d_max is {self.d_max:g}", "edge")
            or first("a", wrong, lambda k: f"a is {float(a[k])!r}; {needs(k)}", "edge")
            or first(
                "a", outside, lambda k: f"a is {float(a[k])!r}; allowed {-self.d_max!r} to {self.a_max!r}"
            )
        )
        if found is None and a[-1] != 0:
            found = Violation(
                "a", f"node {len(a) - 1}", f"a is {float(a[-1])!r} where no step follows; must be 0"
            )
        return found

    def caps(self, names: list[str], limits: list[Floats]) -> Violation | None:
        """No speed above any cap."""
        v = self.v
        for name, cap in zip(names, limits, strict=True):
            bad = ~(v <= cap * (1 + self.tol))
            found = first(name, bad, lambda k, cap=cap: f"{float(v[k])!r} m/s; allowed {float(cap[k])!r}")  # type: ignore[misc]
            if found is not None:
                return found
        return None

    def durations(self) -> Floats:
        """Seconds that a constant acceleration takes on each edge; from rest to rest, what the clock says."""
        pace = self.v[:-1] + self.v[1:]
        return np.where(self.rest, np.diff(self.t), 2 * self.ds / np.where(self.rest, 1.0, pace))

    def times(self, cap: Floats, jerk_max: float | None) -> Violation | None:
        """The clock begins at 0, strictly rises, and each edge takes as long as it must."""
        t = self.t
        if t[0] != 0:
            return Violation("time", "node 0", f"t begins at {float(t[0])!r}; must be 0")
        took, dt = np.diff(t), self.durations()
        # How far a clock that must rise may have run ahead of edges too short for it.
        short = np.cumsum(dt <= 4 * EPSILON * t[1:])
        give = EPSILON * t[1:] * (4 + 2 * short)
        total = np.cumsum(dt)
        sums = 4 * EPSILON * len(t) * total
        found = (
            first(
                "time", ~(took > 0), lambda k: f"t goes from {float(t[k])!r} to {float(t[k + 1])!r}", "edge"
            )
            or first(
                "time",
                ~(np.abs(took - dt) <= self.tol * dt + give),
                lambda k: f"{float(took[k])!r} s for an edge that takes {float(dt[k])!r} s",
                "edge",
            )
            or first(
                "time",
                ~(np.abs(t[1:] - total) <= self.tol * total + sums),
                lambda k: f"t is {float(t[k + 1])!r} after edges that take {float(total[k])!r} s together",
                "edge",
            )
        )
        for k in np.flatnonzero(self.rest & ~self.wait).tolist() if found is None else ():
            # A cap of 0 at an end, where the robot may stand, says nothing of the path.
            top = float(min(cap[k], cap[k + 1]) or max(cap[k], cap[k + 1]))
            least = rest_to_rest(float(self.ds[k]), self.a_max, self.d_max, top) if top else math.inf
            if jerk_max is not None:
                least = max(least, (32 * float(self.ds[k]) / jerk_max) ** (1 / 3))
            if not took[k] >= least * (1 - max(self.tol, 1e-12)) - give[k]:
                return Violation(
                    "time", f"edge {k}", f"{float(took[k])!r} s from rest to rest; at least {least!r} s"
                )
        return found

    def jerks(self, jerk_max: float) -> Violation | None:
        """The change of acceleration at each node, over the time from the middle of an edge to the next."""
        a, dt = self.a[:-1], self.durations()
        x = np.maximum(self.v[:-1], self.v[1:]) ** 2
        noise = np.where(self.wait, 0.0, 4 * EPSILON * x / np.where(self.wait, 1.0, self.ds))
        still = self.v == 0
        # Each edge against rest at its begin and its end, then neighbours against each other.
        for change, over, where, rough in (
            (a, dt / 2, still[:-1], noise),
            (a, dt / 2, still[1:], noise),
            (np.diff(a), (dt[1:] + dt[:-1]) / 2, ~still[1:-1], noise[1:] + noise[:-1]),
        ):
            bad = where & ~(np.abs(change) <= jerk_max * (1 + 1e-9) * over + rough)
            if bad.any():
                k = int(bad.argmax())
                change_text = f"a changes by {float(change[k])!r} m/s2 in {float(over[k])!r} s"
                return Violation("jerk", f"edge {k}", f"{change_text}; jerk_max is {jerk_max:g}")
        return None
