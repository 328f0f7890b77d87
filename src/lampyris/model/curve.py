"""Curve: a drivable path of straight pieces and arcs, with exact length and curvature."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from lampyris._core import elementary
from lampyris._core.arrays import numbers_of, whole_of
from lampyris._core.values import Value
from lampyris.errors import SettingError, shown
from lampyris.typing import Floats, Points

_STRAIGHT = 1e-9
"""Turn of a piece (radians) below which the series for sin x / x is exact in double precision."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Curve(Value):
    """Straight lines and circular arcs, end to end; the robot drives it from s = 0 to ``length``.

    Positions are in cells: the centre of cell (x, y) is at (x, y), x to the right and y *down*, so that a
    positive curvature turns clockwise on the screen. Lengths are in metres.

    Parameters
    ----------
    xy : float64 (n, 2), cells: where each piece begins; n >= 0 (no piece: start and goal are one point).
    heading : float64 (n, 2): unit vector along which each piece begins.
    lengths : float64 (n,), metres, > 0.
    curvature : float64 (n,), 1/m: 0 on a straight piece, 1 / radius on an arc, with its sign.
    end : the last point, cells. Given besides the pieces, so that the goal is exact.
    resolution : metres a cell.
    stops : int64 (k,), rising: pieces before which the robot must stand still and turn on the spot, because
        no arc that it can drive fits there.
    """

    xy: Points
    heading: Points
    lengths: Floats
    curvature: Floats
    end: tuple[float, float]
    resolution: float
    stops: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    def __post_init__(self) -> None:
        lengths = numbers_of("curve", "lengths", self.lengths, (None,))
        n = len(lengths)
        for name, shape in (("xy", (n, 2)), ("heading", (n, 2)), ("lengths", (n,)), ("curvature", (n,))):
            object.__setattr__(self, name, numbers_of("curve", name, getattr(self, name), shape))
        if not (lengths > 0).all():
            raise SettingError("ARRAY", shown(self.lengths), where="curve.lengths", allowed="numbers > 0")
        x, y = numbers_of("curve", "end", self.end, (2,)).tolist()
        object.__setattr__(self, "end", (x, y))
        object.__setattr__(self, "stops", whole_of("curve", "stops", self.stops, (None,)))

    def _brief(self) -> str:
        return f"<Curve of {len(self.lengths)} pieces, {self.length:.6g} m, {len(self.stops)} stops>"

    @property
    def begins(self) -> Floats:
        """Distance at which each piece begins, and the whole length at the end; metres, shape (n + 1,)."""
        return np.concatenate(([0.0], np.cumsum(self.lengths)))

    @property
    def length(self) -> float:
        """Length of the whole, metres."""
        return float(self.begins[-1])

    def at(self, s: Floats) -> tuple[Points, Points]:
        """Position (cells) and heading (unit vectors) at distances ``s`` (metres); (m, 2) each.

        Distances beyond the ends give the ends. On an arc of curvature k, after a length l from its
        beginning, the heading has turned by k l, and the chord is l sin(k l / 2) / (k l / 2) long at half
        that turn.
        """
        s = np.atleast_1d(np.asarray(s, dtype=np.float64))
        if len(self.lengths) == 0:
            return np.tile(np.array(self.end), (len(s), 1)), np.tile((1.0, 0.0), (len(s), 1))
        begins = self.begins
        piece = np.clip(np.searchsorted(begins, s, side="right") - 1, 0, len(self.lengths) - 1)
        along = np.clip(s - begins[piece], 0.0, self.lengths[piece])
        half = 0.5 * self.curvature[piece] * along
        bent = np.abs(half) > _STRAIGHT
        chord = along * np.where(bent, elementary.sin(half) / np.where(bent, half, 1.0), 1.0)
        hx, hy = self.heading[piece, 0], self.heading[piece, 1]
        xy = self.xy[piece] + (chord / self.resolution)[:, None] * _turned(hx, hy, half)
        xy[s >= begins[-1]] = self.end
        return xy, _turned(hx, hy, 2.0 * half)


def _turned(hx: Floats, hy: Floats, angle: Floats) -> Points:
    """Vectors turned by angles (x towards y)."""
    c, s = elementary.cos(angle), elementary.sin(angle)
    return np.stack((hx * c - hy * s, hx * s + hy * c), axis=-1)
