"""Curves: whether pieces fit together, and how near lines and arcs come to walls, by other means.

Two figures are laid against each other along the axes that could part them: how far apart they are, or how
deep they overlap. An arc is judged by its chords. Between two of its points it strays from their chord by no
more than its rise, so a chord that is clear by more than that proves its arc clear, and one that is not is
halved; a chord's ends lie on the arc, so one of them too near proves the arc too near.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from lampyris.model.curve import Curve
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.referee.verdict import Violation
from lampyris.typing import Floats, Points

SLACK = 4e-9
"""Cells: what is forgiven to a clearance."""
_JOIN = 1e-9
"""Relative: what is forgiven to joints, ends, unit vectors and lengths."""
_FLAT = 1e-9
"""Rise of an arc over its chord (cells) that is nothing beside the slack."""

_GATHER = 500_000
"""Most pairs of a line and a square laid against each other at once."""

_Point: TypeAlias = tuple[float, float]
_Piece: TypeAlias = tuple[_Point, _Point, float, float]
"""Begin (cells), heading, length (cells), curvature (1 / cells)."""


def check_curve(curve: Curve, grid: Grid, robot: Robot, points: Points) -> Violation | None:
    """The first broken rule of a curve that was made of a polyline, or None.

    Rules, in this order: ``ends`` (it begins and ends where the polyline does), ``pieces`` (unit headings,
    stops between pieces), ``joints`` (each piece ends where the next begins, and in its direction unless
    that is a stop; straight lines need no stops if turn_radius is 0), ``turn radius``, ``longer`` (than the
    polyline), ``outside``, ``clearance`` (the disc must come no nearer to a wall than its radius, or than
    the polyline does anywhere).
    """
    xy = np.asarray(points, dtype=np.float64)
    polyline = [(float(x), float(y)) for x, y in xy]
    pieces = [
        ((float(x), float(y)), (float(hx), float(hy)), float(length), float(k))
        for (x, y), (hx, hy), length, k in zip(
            curve.xy, curve.heading, curve.lengths / grid.resolution, curve.curvature * grid.resolution,
            strict=True,
        )
    ]  # fmt: skip
    near = _JOIN * max(1, grid.width, grid.height)
    if curve.resolution != grid.resolution or curve.end != polyline[-1]:
        return Violation("ends", "end", f"it ends at {curve.end!r}, the polyline at {polyline[-1]!r}")
    first, last = (pieces[0][0], _at(pieces[-1], pieces[-1][2])[0]) if pieces else (curve.end, curve.end)
    if math.dist(first, polyline[0]) > near or math.dist(last, polyline[-1]) > near:
        return Violation(
            "ends", "curve", f"from {first} to {last}, the polyline from {polyline[0]} to {polyline[-1]}"
        )
    broken = _form_violation(curve, pieces, robot, near)
    if broken is not None:
        return broken
    length, walked = (
        math.fsum(p[2] for p in pieces),
        math.fsum(math.dist(a, b) for a, b in pairwise(polyline)),
    )
    if length > walked * (1 + _JOIN) + near:
        return Violation("longer", "curve", f"{length!r} cells, the polyline {walked!r}")
    return _place_violation(pieces, grid, robot.radius / grid.resolution, polyline)


def _form_violation(curve: Curve, pieces: list[_Piece], robot: Robot, near: float) -> Violation | None:
    """Rules ``pieces``, ``joints`` and ``turn radius``."""
    stops = curve.stops.tolist()
    if stops != sorted(set(stops)) or (stops and not 0 < stops[0] <= stops[-1] < len(pieces)):
        return Violation("pieces", "stops", f"{stops} for {len(pieces)} pieces")
    free = robot.turn_radius == 0.0 and all(k == 0.0 for *_, k in pieces)
    before: tuple[_Point, _Point] | None = None
    for number, piece in enumerate(pieces):
        begin, heading, length, bend = piece
        where = f"piece {number}"
        if abs(math.hypot(*heading) - 1.0) > _JOIN:
            return Violation("pieces", where, f"heading {heading} has length {math.hypot(*heading)!r}")
        if before is not None:
            if math.dist(before[0], begin) > near:
                return Violation("joints", where, f"begins at {begin}, the last ended at {before[0]}")
            turned = math.dist(before[1], heading)
            if turned > 10 * _JOIN and number not in stops and not free:
                return Violation("joints", where, f"turns by {turned:.3g} without a stop")
        size = abs(bend) / curve.resolution
        if size * robot.turn_radius > 1.0 + _JOIN:
            return Violation("turn radius", where, f"{1 / size!r} m, the robot's is {robot.turn_radius!r} m")
        if abs(bend) * length >= math.pi:
            return Violation("pieces", where, "an arc of half a turn or more")
        before = _at(piece, length)
    return None


def _place_violation(
    pieces: list[_Piece], grid: Grid, radius: float, polyline: list[_Point]
) -> Violation | None:
    """Rules ``outside`` and ``clearance``."""
    need = radius
    for a, b in pairwise(polyline):
        need = min(need, max(_gap(grid, a, b, need), 0.0))
    for number, piece in enumerate(pieces):
        where = f"piece {number}"
        for x, y in _extremes(piece):
            if not (
                -0.5 - SLACK <= x <= grid.width - 0.5 + SLACK
                and -0.5 - SLACK <= y <= grid.height - 0.5 + SLACK
            ):
                return Violation("outside", where, f"it runs through ({x}, {y})")
        wrong = _too_near(piece, grid, need)
        if wrong is not None:
            return Violation(
                "clearance", where, f"{wrong[0]!r} cells at {wrong[1]}, at least {need!r} is asked for"
            )
    return None


def _at(piece: _Piece, along: float) -> tuple[_Point, _Point]:
    """Where a piece is after some length, and its direction there."""
    (x, y), (hx, hy), _, bend = piece
    turn = bend * along
    cos, sin = math.cos(turn), math.sin(turn)
    if bend == 0.0:
        forth, aside = along, 0.0
    else:
        # 1 - cos = 2 sin^2 of the half, which does not cancel.
        forth, aside = sin / bend, 2.0 * math.sin(0.5 * turn) ** 2 / bend
    return (x + forth * hx - aside * hy, y + forth * hy + aside * hx), (
        hx * cos - hy * sin,
        hx * sin + hy * cos,
    )


def _extremes(piece: _Piece) -> list[_Point]:
    """Both ends of a piece and the points of an arc that lie farthest right, left, up or down."""
    _, (hx, hy), length, bend = piece
    found = [piece[0], _at(piece, length)[0]]
    if bend != 0.0:
        heading = math.atan2(hy, hx)
        low, high = sorted((heading, heading + bend * length))
        quarters = range(math.ceil(low / (math.pi / 2)), math.floor(high / (math.pi / 2)) + 1)
        along = [(k * math.pi / 2 - heading) / bend for k in quarters]
        found += [_at(piece, min(max(s, 0.0), length))[0] for s in along]
    return found


def _too_near(piece: _Piece, grid: Grid, need: float) -> tuple[float, _Point] | None:
    """A clearance of the piece that is less than asked for, and where; None if there is none."""
    *_, length, bend = piece
    if bend == 0.0:
        gap = _gap(grid, piece[0], _at(piece, length)[0], need)
        return None if gap >= need - SLACK else (gap, piece[0])
    squares = _squares(grid, _extremes(piece), need)
    if squares.shape[1] == 0:
        return None
    cuts = np.linspace(0.0, length, max(1, math.ceil(abs(bend) * length / 0.5)) + 1)
    begin, end = cuts[:-1], cuts[1:]
    while len(begin):
        a, b = _places(piece, begin), _places(piece, end)
        rise = abs(bend) * float(end[0] - begin[0]) ** 2 / 8.0
        gaps, there = _gaps(a, b, squares), _gaps(b, b, squares)
        seen = gaps if rise <= _FLAT else there
        k = int(seen.argmin())
        if seen[k] < need - SLACK:
            return float(seen[k]), (float(b[0, k]), float(b[1, k]))
        if rise <= _FLAT:
            return None
        unsure = gaps - rise < need - SLACK
        begin, end = begin[unsure], end[unsure]
        middle = 0.5 * (begin + end)
        begin, end = np.concatenate((begin, middle)), np.concatenate((middle, end))
    return None


def _places(piece: _Piece, along: Floats) -> Points:
    """Points of an arc, x and y, (2, m)."""
    (x, y), (hx, hy), _, bend = piece
    forth, aside = np.sin(bend * along) / bend, 2.0 * np.sin(0.5 * bend * along) ** 2 / bend
    return np.stack((x + forth * hx - aside * hy, y + forth * hy + aside * hx))


def _squares(grid: Grid, around: list[_Point], beyond: float) -> Points:
    """Centres of blocked squares, x and y, (2, n): all that may be so near to the box of some points."""
    pad = min(beyond, grid.width + grid.height) + 1.0
    (x0, x1), (y0, y1) = (
        (math.floor(min(v) - pad), math.ceil(max(v) + pad) + 1) for v in zip(*around, strict=True)
    )
    x0, y0 = max(0, x0), max(0, y0)
    rows, columns = np.nonzero(grid.blocked[y0:y1, x0:x1])
    return np.stack((columns + float(x0), rows + float(y0)))


def _gap(grid: Grid, a: _Point, b: _Point, beyond: float) -> float:
    """Clearance of the line a-b, cells, at most ``beyond``; less than 0 is how deep it is in a wall."""
    squares = _squares(grid, [a, b], beyond)
    return min(beyond, float(_gaps(np.array(a)[:, None], np.array(b)[:, None], squares)[0]))


def _gaps(a: Points, b: Points, squares: Points) -> Floats:
    """Clearance of lines from a to b, (2, m) each, from some squares, (2, n); (m,), infinity if none."""
    m, n = a.shape[1], squares.shape[1]
    out = np.full(m, np.inf)
    some = max(1, _GATHER // max(1, n))
    for k in range(0, m if n else 0, some):
        out[k : k + some] = _lines_to_squares(a[:, k : k + some], b[:, k : k + some], squares).min(axis=1)
    return out


def _lines_to_squares(a: Points, b: Points, squares: Points) -> Points:
    """Distance of each line from each square, (m, n), or less than 0: how deep they overlap.

    How far they are parted along x, along y and across the line. If they are, they are nearest at a corner
    of the square, against the line, or at an end of the line, against the square.
    """
    dx, dy = (b - a)[:, :, None]
    size = np.hypot(dx, dy)
    there = size > 0.0
    ux, uy = np.where(there, dx / np.where(there, size, 1.0), 1.0), dy / np.where(there, size, 1.0)
    # Squares' centres as seen from the middles of the lines.
    mx, my = squares[:, None, :] - (0.5 * (a + b))[:, :, None]
    apart = np.abs(ux * my - uy * mx) - 0.5 * (np.abs(ux) + np.abs(uy))
    apart = np.maximum(apart, np.maximum(np.abs(mx) - 0.5 * np.abs(dx), np.abs(my) - 0.5 * np.abs(dy)) - 0.5)
    best = np.full(apart.shape, np.inf)
    for sx, sy in ((-0.5, -0.5), (-0.5, 0.5), (0.5, 0.5), (0.5, -0.5)):
        along = (mx + sx) * ux + (my + sy) * uy
        aside = (my + sy) * ux - (mx + sx) * uy
        best = np.minimum(best, np.hypot(np.maximum(np.abs(along) - 0.5 * size, 0.0), aside))
    for sign in (-0.5, 0.5):
        gx = np.maximum(np.abs(mx - sign * dx) - 0.5, 0.0)
        gy = np.maximum(np.abs(my - sign * dy) - 0.5, 0.0)
        best = np.minimum(best, np.hypot(gx, gy))
    return np.where(apart > 0.0, best, apart)
