"""Curve: a drivable path of straight pieces and arcs, with exact length and curvature; PoseCurve: with a yaw."""

from __future__ import annotations

import math
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
    stops : int64 (k,), rising: pieces before which the robot must stand still and turn in place, because
        no arc that it can drive fits there.

    Examples
    --------
    >>> import lampyris
    >>> scene = lampyris.Scene(lampyris.load_grid("guide"), start=(1, 8), goal=(8, 2))
    >>> curve = lampyris.smooth(scene, lampyris.plan(scene, "astar"), method="arcs").curve
    >>> round(curve.length, 2)
    10.35
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


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class PoseCurve(Curve):
    """A curve that the base of a robot with a heading follows: straight lines, arcs, and turns in place.

    A turn in place is a piece on which the base stands still: its ``heading`` is (0, 0), its curvature 0, and its length
    the distance that a point at ``1 / |turn|`` metres from the base moves, at least the farthest of the robot. So speed
    and acceleration along it are bounds on those of every point of the robot. On all other pieces the robot's yaw turns
    as the direction of travel does, and ``heading`` is that direction: in reverse, opposite to the yaw.

    Parameters
    ----------
    yaw : float64 (n,): yaw where each piece begins, radians counterclockwise from the rows of the map (y up), any multiple
        of a turn off.
    turn : float64 (n,): radians that the yaw turns a metre of the piece, counterclockwise; ``-curvature`` but in place.
    end_yaw : yaw at the end.
    outline : float64 (k, 2), metres, x ahead and y to the left: vertices of the robot's footprint; a disc has one, (0, 0).
    margin : metres around the outline that are of the robot, too: the radius of a disc, else 0.
    states : float64 (m,), rising: distances at which the base is at the centre of a cell, where a new path may begin.
    """

    yaw: Floats = field(kw_only=True)
    turn: Floats = field(kw_only=True)
    end_yaw: float = field(kw_only=True)
    outline: Points = field(kw_only=True)
    margin: float = field(default=0.0, kw_only=True)
    states: Floats = field(default_factory=lambda: np.zeros(0), kw_only=True)

    def __post_init__(self) -> None:
        Curve.__post_init__(self)
        n = len(self.lengths)
        for name, shape in (("yaw", (n,)), ("turn", (n,)), ("outline", (None, 2)), ("states", (None,))):
            object.__setattr__(self, name, numbers_of("curve", name, getattr(self, name), shape))
        end_yaw, margin = numbers_of(
            "curve", "end_yaw and margin", (self.end_yaw, self.margin), (2,)
        ).tolist()
        object.__setattr__(self, "end_yaw", end_yaw)
        object.__setattr__(self, "margin", margin)

    def _brief(self) -> str:
        return f"<PoseCurve of {len(self.lengths)} pieces, {self.length:.6g} m, {len(self.stops)} stops>"

    @property
    def in_place(self) -> NDArray[np.bool_]:
        """Whether each piece is a turn in place; bool (n,)."""
        still: NDArray[np.bool_] = (self.heading == 0.0).all(axis=1)
        return still

    @property
    def reach(self) -> float:
        """Distance from the base to the farthest vertex of the outline, metres."""
        return float(np.sqrt((self.outline * self.outline).sum(axis=1)).max())

    @property
    def movement(self) -> Floats:
        """Metres that a vertex of the outline moves at most, a metre of each piece; (n,)."""
        return np.where(self.in_place, 0.0, 1.0) + np.abs(self.turn) * self.reach

    @property
    def gears(self) -> NDArray[np.int64]:
        """How each piece is driven: 1 ahead (or sideways), -1 in reverse, 0 in place; (n,)."""
        along = self.heading[:, 0] * elementary.cos(self.yaw) - self.heading[:, 1] * elementary.sin(self.yaw)
        gears: NDArray[np.int64] = np.where(self.in_place, 0, np.where(along < -0.999, -1, 1)).astype(
            np.int64
        )
        return gears

    def pieces_at(self, s: Floats) -> NDArray[np.int64]:
        """The piece on which each distance lies; of a border, the piece that begins there."""
        found = np.searchsorted(self.begins, s, side="right") - 1
        return np.clip(found, 0, max(len(self.lengths) - 1, 0))

    def yaw_at(self, s: Floats) -> Floats:
        """Yaw at distances ``s`` (metres), radians in (-pi, pi] from the rows of the map; (m,)."""
        s = np.atleast_1d(np.asarray(s, dtype=np.float64))
        if len(self.lengths) == 0:
            yaw = np.full(len(s), self.end_yaw)
        else:
            begins, piece = self.begins, self.pieces_at(s)
            yaw = self.yaw[piece] + self.turn[piece] * np.clip(s - begins[piece], 0.0, self.lengths[piece])
            yaw[s >= begins[-1]] = self.end_yaw
        return math.pi - np.remainder(math.pi - yaw, 2 * math.pi)


def _turned(hx: Floats, hy: Floats, angle: Floats) -> Points:
    """Vectors turned by angles (x towards y)."""
    c, s = elementary.cos(angle), elementary.sin(angle)
    return np.stack((hx * c - hy * s, hx * s + hy * c), axis=-1)
