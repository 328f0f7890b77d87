"""From a polyline, such as a path of cells, to a curve that a robot can drive without stopping in corners."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from lampyris._core import elementary
from lampyris._core.scalars import is_word
from lampyris.errors import SettingError, shown
from lampyris.kernels.motion.fillets import fit_corner_arcs, share
from lampyris.model.curve import Curve
from lampyris.model.grid import Grid
from lampyris.model.path import Path
from lampyris.model.robot import Robot
from lampyris.motion.geometry.string_pulling import Polyline, lines_of, pull_straight
from lampyris.typing import Floats, Points

LONGEST_STEP = math.sqrt(5.0)
"""Cells: the longest step of a planned path, a knight's."""

_HUGE = 1e6
"""Radius (cells) beyond which a bend counts as straight: its centre is still known to a ten-millionth."""


def polyline_of(path: Path) -> Points:
    """The centres of a path's cells, float64 (n, 2)."""
    return path.cells.astype(np.float64)


def curve_of(
    points: Points,
    grid: Grid,
    robot: Robot,
    *,
    smooth: Literal["arcs", "none"] = "arcs",
    shortcut: bool = True,
    tangent: Floats | None = None,
) -> Curve:
    """A drivable curve along a polyline: pulled straight, its corners rounded.

    The curve is never longer than the polyline, and never nearer to a blocked square than the robot's radius
    or, where the polyline itself is nearer, than that; it may touch where the polyline may. All to within
    four billionths of a cell. Each corner has the largest arc that the walls, its lines, its neighbours and
    use allow: beyond a radius of v_max squared / a_lat_max a robot would be no faster. A corner in which no arc
    of the robot's turn_radius fits (or none at all: where the path turns on the very corner of a wall, or
    back on itself) is a stop.

    Parameters
    ----------
    points : float (n, 2), cells, start first; n >= 1. Centres of cells or any points of the map.
    grid : the map. Its edge is no wall, but the robot's centre stays on it. Where it has terrain nothing is
        pulled straight: a shorter path may cost more.
    robot : its radius, turn_radius, v_max and a_lat_max matter.
    smooth : ``arcs``, or ``none``: each arc begins at most half a step away from its corner. That is half the
        shorter of the two lines that meet in the corner, as they are between the points given (or pulled
        straight), and never more than half of :data:`LONGEST_STEP`.
    shortcut : whether to pull it straight.
    tangent : float64 (n,), cells: how far from each point its arc may begin at most; None: as far as there is
        room. Only where it is not pulled straight, and no two points in a row are the same.

    Raises
    ------
    SettingError : ``PATH_POINTS`` (none, or not finite), ``PATH_OUTSIDE`` (off the map), ``PATH_BLOCKED``
        (the polyline goes through a blocked square; names the first), ``CURVE_SMOOTH``.
    """
    if not is_word(smooth, ("arcs", "none")):
        raise SettingError("CURVE_SMOOTH", shown(smooth), where="smooth", allowed="arcs, none")
    lines = lines_of(points, grid, robot.radius / grid.resolution)
    if shortcut and grid.terrain is None:
        lines = pull_straight(lines)
    if len(lines.length) == 0:
        nothing = np.zeros((0, 2))
        return Curve(nothing, nothing, np.zeros(0), np.zeros(0), lines.end, grid.resolution)
    corner, half = lines.corners(), _half_steps(lines)
    if len(corner) < len(lines.xs):
        lines, half = lines.kept(corner), half[corner]
    n = len(lines.xs)
    turn = _Turns.of(lines)
    want, far = np.full(n, np.inf), np.zeros(n)
    if tangent is not None:
        want = tangent[corner]
    if smooth == "none":
        want = np.minimum(want, half)
    useful = max(robot.v_max * robot.v_max / robot.a_lat_max, robot.turn_radius) / grid.resolution
    far = _tangents(lines, turn, useful, robot.turn_radius / grid.resolution, want)
    stops = np.flatnonzero(far[1:-1] == 0.0) + 1
    return _assembled(lines, turn, far, stops, grid.resolution)


def _half_steps(lines: Polyline) -> Floats:
    """Half the shorter of the two lines at each point, at most half of the longest step, cells, (n,)."""
    longest = np.full(1, LONGEST_STEP)
    before, after = (np.concatenate(pair) for pair in ((longest, lines.length), (lines.length, longest)))
    half: Floats = 0.5 * np.minimum(np.minimum(before, after), LONGEST_STEP)
    return half


class _Turns:
    """What is to be known of each corner, float64 (n,) each; 0 at both ends.

    slant : tangent of half the turn; 0 where it is a half turn, which no arc makes.
    side : 1 where the path turns from x towards y, else -1.
    angle : the turn, radians, >= 0.
    """

    def __init__(self, slant: Floats, side: Floats, angle: Floats) -> None:
        self.slant = slant
        self.side = side
        self.angle = angle

    @classmethod
    def of(cls, lines: Polyline) -> _Turns:
        """The turns of a polyline."""
        n = len(lines.xs)
        a, b = lines.heading[:-1], lines.heading[1:]
        dot = a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1]
        cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
        size = np.abs(cross)
        slant, side, angle = np.zeros(n), np.ones(n), np.zeros(n)
        # Of the two forms of tan(half) the one that does not cancel.
        wide = dot < 0.0
        upper = np.where(wide, 1.0 - dot, size)
        lower = np.where(wide, size, 1.0 + dot)
        # A half turn, to a ten-millionth: its arc would be as much smaller than its tangent.
        back = wide & (size < 1e-7)
        slant[1:-1] = np.where(back, 0.0, upper / np.where(back, 1.0, lower))
        side[1:-1] = np.where(cross < 0.0, -1.0, 1.0)
        angle[1:-1] = elementary.atan2(size, dot)
        return cls(slant, side, angle)


def _tangents(lines: Polyline, turn: _Turns, useful: float, least: float, most: Floats) -> Floats:
    """How far from each corner its arc leaves the lines, cells, (n,), at most ``most``; 0: no arc fits."""
    wall = lines.wall.ravel()
    height, width = lines.wall.shape
    hx, hy = lines.heading[:, 0].copy(), lines.heading[:, 1].copy()
    # A known arc is as wide as it is; the others are no wider than is of use.
    known = np.isfinite(most)
    useful = min(useful, _HUGE)
    radius = _HUGE if known.any() else useful
    want = np.where(known & (turn.slant > 0.0), most, useful * turn.slant)
    want[[0, -1]] = 0.0
    tangent = np.zeros(len(lines.xs))

    def fit() -> None:
        fit_corner_arcs(
            wall, width, height, lines.xs, lines.ys, hx, hy, turn.slant, turn.side, lines.length,
            lines.need, radius, least, want,
        )  # fmt: skip

    fit()
    share(lines.length, turn.slant, least, want, tangent)
    if (tangent < want).any():
        # A smaller arc lies nearer to the corner; walls that the larger one went around may be there.
        want = tangent
        fit()
    return want


def _assembled(
    lines: Polyline, turn: _Turns, tangent: Floats, stops: NDArray[np.int64], resolution: float
) -> Curve:
    """Lines and arcs in turn: the arc of corner k, then line k. What has no length is left out."""
    n = len(lines.length)
    begin = np.stack((lines.xs[:-1], lines.ys[:-1]), axis=1)
    bent = tangent[:-1] > 0.0
    slant = np.where(bent, turn.slant[:-1], 1.0)
    radius = np.where(bent, tangent[:-1] / slant, 1.0)
    straight = lines.length - tangent[:-1] - tangent[1:]
    before = np.concatenate((lines.heading[:1], lines.heading[:-1]))
    xy, heading = np.empty((2 * n, 2)), np.empty((2 * n, 2))
    length, curvature = np.empty(2 * n), np.zeros(2 * n)
    xy[0::2] = begin - tangent[:-1, None] * before
    xy[1::2] = begin + tangent[:-1, None] * lines.heading
    heading[0::2] = before
    heading[1::2] = lines.heading
    length[0::2] = np.where(bent, radius * turn.angle[:-1], 0.0)
    # Two arcs that meet leave some rounding between them, not a line.
    length[1::2] = np.where(straight > 1e-12 * lines.length, straight, 0.0)
    curvature[0::2] = np.where(bent, turn.side[:-1] / (radius * resolution), 0.0)
    kept = length > 0.0
    number = np.concatenate(([0], np.cumsum(kept)))
    return Curve(
        xy[kept] + lines.corner,
        heading[kept],
        length[kept] * resolution,
        curvature[kept],
        lines.end,
        resolution,
        number[2 * stops + 1],
    )
