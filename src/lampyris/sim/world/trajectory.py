"""Trajectory: the curve a robot is on, as kernels and loops want it, and the segments it has driven."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from lampyris.kernels.motion.curve_motion import place
from lampyris.model.curve import Curve
from lampyris.model.grid import frozen
from lampyris.typing import Floats


class CurvePieces(NamedTuple):
    """A curve's pieces as flat arrays, in the order in which kernels take them."""

    px: Floats
    py: Floats
    hx: Floats
    hy: Floats
    begins: Floats
    kappa: Floats


class CurveLookup:
    """A curve with a quick answer to "where is distance s".

    Attributes
    ----------
    curve : the path itself.
    length : metres.
    lines : its pieces, for kernels.
    """

    def __init__(self, curve: Curve) -> None:
        self.curve = curve
        self.length = curve.length
        columns = (*curve.xy.T, *curve.heading.T, curve.begins, curve.curvature)
        if not len(curve.lengths):  # one piece of no length, so that kernels need not ask
            x, y = curve.end
            columns = tuple(np.array(c) for c in ([x], [y], [1.0], [0.0], [0.0, 0.0], [0.0]))
        flat = [frozen(np.ascontiguousarray(a)) for a in columns]
        self.lines = CurvePieces(*flat)
        self._lists = [a.tolist() for a in flat]
        self._begins: list[float] = self._lists[4]
        self._place = place.linked()

    def __len__(self) -> int:
        return len(self._begins) - 1

    def piece(self, s: float) -> int:
        """The piece on which a distance lies."""
        return min(max(bisect_right(self._begins, s) - 1, 0), len(self) - 1)

    def at(self, s: float) -> tuple[float, float]:
        """Where a distance lies, cells."""
        if s >= self.length or not len(self):
            return self.curve.end
        lines = self._lists
        x, y = self._place(*lines, self.curve.resolution, self.piece(s), max(s, 0.0))
        return float(x), float(y)


@dataclass(slots=True)
class Segment:
    """A time of constant acceleration on one route.

    Parameters
    ----------
    t, end : from when to when, seconds.
    s, v, a : at its beginning: metres, m/s, m/s2.
    """

    t: float
    end: float
    s: float
    v: float
    a: float

    def after(self, t: float) -> tuple[float, float]:
        """Distance and speed at a time within it."""
        d = t - self.t
        return self.s + d * (self.v + 0.5 * self.a * d), max(self.v + self.a * d, 0.0)


@dataclass(slots=True)
class Trajectory:
    """What the robot does in one period: its route and its stretches, without a gap between them."""

    route: CurveLookup
    segments: list[Segment] = field(default_factory=list)

    def at(self, t: float) -> tuple[float, float]:
        """Distance and speed at a time; the ends answer for times outside."""
        for one in self.segments:
            if t < one.end:
                return one.after(max(t, one.t))
        return self.segments[-1].after(self.segments[-1].end)

    def cut(self, t: float) -> None:
        """Leave out what comes after ``t``."""
        self.segments[:] = [one for one in self.segments if one.t < t] or self.segments[:1]
        self.segments[-1].end = min(self.segments[-1].end, t)


def split(t: float, end: float, s: float, v: float, a: float, stop_at: float | None) -> list[Segment]:
    """One push from ``t`` to ``end``, cut where the robot comes to rest; it then stands.

    Parameters
    ----------
    stop_at : the distance at which it does, where that is known exactly; None: where the numbers say.
    """
    if v == 0.0 and a <= 0.0:
        return [Segment(t, end, s, 0.0, 0.0)]
    rest = -v / a if a < 0.0 else np.inf
    if stop_at is None and rest >= end - t:
        return [Segment(t, end, s, v, a)]
    halt = min(t + rest, end)
    there = s - 0.5 * v * v / a if stop_at is None else stop_at
    # The second may last no time at all: that it stands, and where, is exact then.
    return [Segment(t, halt, s, v, a), Segment(halt, end, there, 0.0, 0.0)]
