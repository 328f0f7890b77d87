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
    told = [(float(x), float(y)) for x, y in xy]
    pieces = [
        ((float(x), float(y)), (float(hx), float(hy)), float(length), float(k))
        for (x, y), (hx, hy), length, k in zip(
            curve.xy, curve.heading, curve.lengths / grid.resolution, curve.curvature * grid.resolution,
            strict=True,
        )
    ]  # fmt: skip
    near = _JOIN * max(1, grid.width, grid.height)
    if curve.resolution != grid.resolution or curve.end != told[-1]:
        return Violation("ends", "end", f"it ends at {curve.end!r}, the polyline at {told[-1]!r}")
    first, last = (pieces[0][0], _at(pieces[-1], pieces[-1][2])[0]) if pieces else (curve.end, curve.end)
    if math.dist(first, told[0]) > near or math.dist(last, told[-1]) > near:
        return Violation(
            "ends", "curve", f"from {first} to {last}, the polyline from {told[0]} to {told[-1]}"
        )
    broken = _form_violation(curve, pieces, robot, near)
    if broken is not None:
        return broken
    length, walked = (math.fsum(p[2] for p in pieces), math.fsum(math.dist(a, b) for a, b in pairwise(told)))
    if length > walked * (1 + _JOIN) + near:
        return Violation("longer", "curve", f"{length!r} cells, the polyline {walked!r}")
    return _place_violation(pieces, grid, robot.radius / grid.resolution, told)


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


def _place_violation(pieces: list[_Piece], grid: Grid, radius: float, told: list[_Point]) -> Violation | None:
    """Rules ``outside`` and ``clearance``."""
    need = radius
    for a, b in pairwise(told):
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
    parts = 1 if bend == 0.0 else max(1, math.ceil(abs(bend) * length / 0.5))
    ahead = [(length * k / parts, length * (k + 1) / parts) for k in reversed(range(parts))]
    while ahead:
        begin, end = ahead.pop()
        a, b = _at(piece, begin)[0], _at(piece, end)[0]
        rise = abs(bend) * (end - begin) ** 2 / 8.0
        gap = _gap(grid, a, b, need + rise)
        if gap - (rise if rise > _FLAT else 0.0) >= need - SLACK:
            continue
        if rise <= _FLAT:
            return gap, a
        for point in (a, b):
            there = _gap(grid, point, point, need)
            if there < need - SLACK:
                return there, point
        middle = 0.5 * (begin + end)
        ahead += [(middle, end), (begin, middle)]
    return None


def _gap(grid: Grid, a: _Point, b: _Point, beyond: float) -> float:
    """Clearance of the line a-b, cells, at most ``beyond``; less than 0 is how deep it is in a wall."""
    (ax, ay), (bx, by) = a, b
    pad = min(beyond, grid.width + grid.height) + 1.0
    x0, x1 = max(0, math.floor(min(ax, bx) - pad)), math.ceil(max(ax, bx) + pad) + 1
    y0, y1 = max(0, math.floor(min(ay, by) - pad)), math.ceil(max(ay, by) + pad) + 1
    rows, columns = np.nonzero(grid.blocked[y0:y1, x0:x1])
    if len(rows) == 0:
        return beyond
    dx, dy = bx - ax, by - ay
    size = math.hypot(dx, dy)
    # Squares' centres, from the middle of the line: along it and across it.
    mx, my = columns + x0 - 0.5 * (ax + bx), rows + y0 - 0.5 * (ay + by)
    ux, uy = (dx / size, dy / size) if size > 0.0 else (1.0, 0.0)
    across = np.abs(ux * my - uy * mx) - 0.5 * (abs(ux) + abs(uy))
    gx, gy = np.abs(mx) - 0.5 - 0.5 * abs(dx), np.abs(my) - 0.5 - 0.5 * abs(dy)
    apart = np.maximum(np.maximum(gx, gy), across)
    # Nothing that is parted by so much on one axis can be nearer.
    close = apart < beyond
    if not close.any():
        return beyond
    mx, my, apart = mx[close], my[close], apart[close]
    return float(np.where(apart > 0.0, np.maximum(apart, _between(mx, my, ux, uy, size)), apart).min())


def _between(mx: Floats, my: Floats, ux: float, uy: float, size: float) -> Floats:
    """Distance from squares around (mx, my) to the line of that size and direction through (0, 0), if apart.

    The squares' corners against the line, and the line's ends against the squares.
    """
    best = np.full(len(mx), np.inf)
    for sx, sy in ((-0.5, -0.5), (-0.5, 0.5), (0.5, 0.5), (0.5, -0.5)):
        along = (mx + sx) * ux + (my + sy) * uy
        aside = (my + sy) * ux - (mx + sx) * uy
        best = np.minimum(best, np.hypot(np.maximum(np.abs(along) - 0.5 * size, 0.0), aside))
    for sign in (-0.5, 0.5):
        gx = np.maximum(np.abs(mx - sign * size * ux) - 0.5, 0.0)
        gy = np.maximum(np.abs(my - sign * size * uy) - 0.5, 0.0)
        best = np.minimum(best, np.hypot(gx, gy))
    return best
