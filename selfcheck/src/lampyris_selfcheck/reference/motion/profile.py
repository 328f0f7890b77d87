"""Slow reference of the feasible profile: exact fractions, relaxed until nothing moves; no order, no rounding."""

from __future__ import annotations

from fractions import Fraction

Exact = list[Fraction]


def greatest(
    s: list[float], cap: list[float | None], a_max: float, d_max: float, v0: float, stops: set[int]
) -> Exact:
    """The greatest squares of speed under the caps (None: no cap) that can be driven, still at the end.

    Every bound is passed on to both neighbours again and again until a whole round changes nothing. The start
    is a bound like the others: where it comes out lower than v0^2, that start speed is too fast.
    """
    n = len(s)
    x: list[Fraction | None] = [None if c is None else Fraction(c) ** 2 for c in cap]
    for k in {n - 1, *stops}:
        x[k] = Fraction(0)
    start = Fraction(v0) ** 2
    x[0] = start if x[0] is None else min(x[0], start)
    changed = True
    while changed:
        changed = False
        for i in range(n):
            for j, rate in ((i - 1, a_max), (i + 1, d_max)):
                if 0 <= j < n and x[j] is not None:
                    reach = x[j] + 2 * Fraction(rate) * abs(Fraction(s[i]) - Fraction(s[j]))  # type: ignore[operator]
                    if x[i] is None or reach < x[i]:  # type: ignore[operator]
                        x[i] = reach
                        changed = True
    return [value for value in x if value is not None]


def keeps_all(s: list[float], x: Exact, cap: list[float | None], a_max: float, d_max: float) -> bool:
    """Whether squares of speed keep the caps and both accelerations, exactly."""
    for i, c in enumerate(cap):
        if c is not None and x[i] > Fraction(c) ** 2:
            return False
    for i in range(len(s) - 1):
        ds = Fraction(s[i + 1]) - Fraction(s[i])
        if x[i + 1] - x[i] > 2 * Fraction(a_max) * ds or x[i] - x[i + 1] > 2 * Fraction(d_max) * ds:
            return False
    return True
