"""Straight lines between waypoints: what a point or a disc driven along them meets.

Waypoints are cells, or places in whole steps of 2^-16 of a cell: so what a point meets is decided in integers. A disc may
turn at any place, and its line need not run between free cells: only its distance from walls counts.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris.model.moves import Moves
from lampyris.model.plan import Plan
from lampyris.model.scene import Scene
from lampyris.referee.geometry.shapes import _segment_to_squares, slack
from lampyris.referee.verdict import Violation
from lampyris.typing import BoolGrid, Cell

_BAND = 64
"""Rows looked at together: a long slanting line is near to few of the cells in the box around it."""
_UNITS = 2**16
"""Steps in a cell, for waypoints that are no cells."""
_FAR = 2**13
"""Cells that such waypoints may be apart: the products of their differences have room in 64 bits."""
_BESIDE = 2
"""Cells, along either axis, that the path of a disc may pass beside such a waypoint: where its centre is on the lines there may
be no cell at whose centre it has room."""


def lines_violation(plan: Plan, scene: Scene) -> Violation | None:
    """The first broken rule of a plan's waypoints; its path has been judged before.

    Rules, in this order: ``waypoints`` (there without a path; ends that are not the path's; a point
    outside the map, or twice in a row; points that the path does not visit one after the other; lines
    longer than the path), ``line`` (a wall on the way). A point robot must not run through a blocked
    square, nor touch one where corners may not be cut; a disc must not overlap one.
    """
    if plan.waypoints is None:
        return None
    if plan.path is None:
        return Violation("waypoints", "plan", "there are waypoints without a path")
    if plan.waypoints.dtype.kind == "f":
        return _places_violation(plan, scene)
    points = plan.waypoints.astype(np.int64)
    cells = [(int(x), int(y)) for x, y in plan.path.cells]
    stated = [(int(x), int(y)) for x, y in points]
    if not stated or stated[0] != cells[0] or stated[-1] != cells[-1]:
        return Violation("waypoints", "plan", "the waypoints and the path have different ends")
    broken = _order_violation(stated, cells, scene)
    if broken is not None:
        return broken
    length = math.fsum(math.dist(a, b) for a, b in pairwise(stated))
    walked = math.fsum(math.dist(a, b) for a, b in pairwise(cells))
    said = plan.any_angle_length
    if length > walked * (1 + 1e-12) or said is None or abs(said - length) > 1e-12 * length:
        return Violation("waypoints", "plan", f"lines of {length!r} cells, said {said!r}, walk {walked!r}")
    for k, (begin, end) in enumerate(pairwise(stated)):
        wall = line_meets(scene.grid.blocked, begin, end, scene)
        if wall is not None:
            return Violation(
                "line", f"waypoint {k}", f"the line from {begin} to {end} meets the wall at {wall}"
            )
    return None


def _places_violation(plan: Plan, scene: Scene) -> Violation | None:
    """The same for waypoints that are not cells but places.

    The path of a point has to come to a cell that each place is in, or on the border of, one after the other; that of a disc
    near to it.
    """
    assert plan.waypoints is not None
    assert plan.path is not None
    disc = scene.robot.radius > 0
    beside = 2 * _BESIDE if disc else 1
    scaled = plan.waypoints * _UNITS
    if (scaled != np.floor(scaled)).any() or (np.abs(plan.waypoints) > _FAR).any():
        return Violation("waypoints", "plan", f"waypoints are whole steps of 1/{_UNITS} cell, {_FAR} at most")
    at = [(int(x), int(y)) for x, y in scaled.tolist()]
    cells = [(int(x), int(y)) for x, y in plan.path.cells]
    ends = [(x * _UNITS, y * _UNITS) for x, y in (cells[0], cells[-1])]
    if not at or at[0] != ends[0] or at[-1] != ends[1]:
        return Violation("waypoints", "plan", "the waypoints and the path have different ends")
    k = 0
    for i, (x, y) in enumerate(at):
        if i and at[i - 1] == (x, y):
            return Violation("waypoints", f"waypoint {i}", f"{(x, y)} follows itself")
        while (
            k < len(cells)
            and max(abs(cells[k][0] * _UNITS - x), abs(cells[k][1] * _UNITS - y)) * 2 > beside * _UNITS
        ):
            k += 1
        if k == len(cells):
            return Violation("waypoints", f"waypoint {i}", f"the path does not come to {(x, y)} in its turn")
    places = plan.waypoints.tolist()
    length = math.fsum(math.dist(a, b) for a, b in pairwise(places))
    walked = math.fsum(math.dist(a, b) for a, b in pairwise(cells))
    said = plan.any_angle_length
    if length > walked * (1 + 1e-12) or said is None or abs(said - length) > 1e-12 * length:
        return Violation("waypoints", "plan", f"lines of {length!r} cells, said {said!r}, walk {walked!r}")
    for k, (begin, end) in enumerate(pairwise(at)):
        if disc:
            outside = _outside(scene.grid.blocked, end)
            wall = outside or line_meets(scene.grid.blocked, _place(places[k]), _place(places[k + 1]), scene)
        else:
            wall = _wall_between(scene.grid.blocked, begin, end, scene.moves)
        if wall is not None:
            line = f"the line from {places[k]} to {places[k + 1]} meets the wall at {wall}"
            return Violation("line", f"waypoint {k}", line)
    return None


def _place(xy: list[float]) -> tuple[float, float]:
    return xy[0], xy[1]


def _outside(blocked: BoolGrid, place: Cell) -> Cell | None:
    """The nearest cell of the map to a place, in steps, that is not on the map; else None."""
    height, width = blocked.shape
    near = [
        min(max((v + _UNITS // 2) // _UNITS, 0), size - 1)
        for v, size in zip(place, (width, height), strict=True)
    ]
    if any(abs(v - n * _UNITS) * 2 > _UNITS for v, n in zip(place, near, strict=True)):
        return near[0], near[1]
    return None


def _wall_between(blocked: BoolGrid, begin: Cell, end: Cell, moves: Moves) -> Cell | None:
    """A blocked cell that the line between two places, in steps, must not meet and does, or None. The map's border is a
    wall too: a line that leaves the map is met by the nearest cell of the border."""
    height, width = blocked.shape
    half = _UNITS // 2
    (x0, y0), (x1, y1) = begin, end
    for value, size in ((x0, width), (x1, width), (y0, height), (y1, height)):
        low, high = -half, size * _UNITS - half
        if value < low or value > high or (value in (low, high) and not moves.corner_cutting):
            return min(max(x0 // _UNITS, 0), width - 1), min(max(y0 // _UNITS, 0), height - 1)
    left, right = (min(x0, x1) - half) // _UNITS, (max(x0, x1) + half) // _UNITS + 1
    top, bottom = (min(y0, y1) - half) // _UNITS, (max(y0, y1) + half) // _UNITS + 1
    left, top = max(0, left), max(0, top)
    y, x = np.nonzero(blocked[top : bottom + 1, left : right + 1])
    gx = (x.astype(np.int64) + left) * _UNITS - x0
    gy = (y.astype(np.int64) + top) * _UNITS - y0
    dx, dy = x1 - x0, y1 - y0
    sides = np.array(
        [
            (gx + i) * dy - (gy + j) * dx
            for i, j in ((-half, -half), (half, -half), (-half, half), (half, half))
        ]
    )
    if not len(gx):
        return None
    low, high = sides.min(axis=0), sides.max(axis=0)
    if moves.corner_cutting:
        # Only the inside of a cell is forbidden.
        hit = (low < 0) & (high > 0)
        hit &= (
            (gx + half > min(0, dx))
            & (gx - half < max(0, dx))
            & (gy + half > min(0, dy))
            & (gy - half < max(0, dy))
        )
    else:
        hit = (low <= 0) & (high >= 0)
        hit &= (gx + half >= min(0, dx)) & (gx - half <= max(0, dx))
        hit &= (gy + half >= min(0, dy)) & (gy - half <= max(0, dy))
    if not hit.any():
        return None
    k = int(hit.argmax())
    return int(x[k]) + left, int(y[k]) + top


def _order_violation(stated: list[Cell], cells: list[Cell], scene: Scene) -> Violation | None:
    """Whether the path visits the waypoints one after the other."""
    at = 0
    for k, point in enumerate(stated):
        where = f"waypoint {k}"
        if not scene.grid.contains(point):
            return Violation("waypoints", where, f"{point} is outside the map")
        if k and stated[k - 1] == point:
            return Violation("waypoints", where, f"{point} follows itself")
        try:
            at = cells.index(point, at)
        except ValueError:
            return Violation("waypoints", where, f"the path does not come to {point} in its turn")
    return None


def line_meets(
    blocked: BoolGrid, begin: tuple[float, float], end: tuple[float, float], scene: Scene
) -> Cell | None:
    """A wall that the robot of a scene meets on the straight line between two cell centres, of a disc any two places; or None."""
    radius = scene.robot.radius / scene.grid.resolution
    reach = math.ceil(radius + 0.5)
    height, width = blocked.shape
    (x0, y0), (x1, y1) = begin, end
    top, bottom = max(0, math.floor(min(y0, y1)) - reach), min(height, math.ceil(max(y0, y1)) + reach + 1)
    for row in range(top, bottom, _BAND):
        last = min(bottom, row + _BAND)
        left, right = _between(begin, end, row - reach, last - 1 + reach)
        x_from, x_to = max(0, left - reach), min(width, right + reach + 1)
        y, x = np.nonzero(blocked[row:last, x_from:x_to])
        if not len(x):
            continue
        cx, cy = x.astype(np.int64) + x_from, y.astype(np.int64) + row
        gx, gy = cx - x0, cy - y0
        if scene.robot.radius > 0:
            distance = _segment_to_squares(x1 - x0, y1 - y0, gx, gy) * scene.grid.resolution
            hit = distance < scene.robot.radius - slack(scene.robot.radius)
        else:
            hit = _crosses(x1 - x0, y1 - y0, gx, gy, scene.moves)
        if hit.any():
            k = int(hit.argmax())
            return int(cx[k]), int(cy[k])
    return None


def _between(begin: tuple[float, float], end: tuple[float, float], low: int, high: int) -> tuple[int, int]:
    """Least and greatest column of the part of a line that lies between two rows."""
    (x0, y0), (x1, y1) = begin, end
    if y0 == y1:
        return math.floor(min(x0, x1)), math.ceil(max(x0, x1))
    at = [min(max((y - y0) / (y1 - y0), 0.0), 1.0) for y in (low, high)]
    xs = [x0 + t * (x1 - x0) for t in at]
    return math.floor(min(xs)), math.ceil(max(xs))


def _crosses(dx: float, dy: float, gx: NDArray[Any], gy: NDArray[Any], moves: Moves) -> NDArray[np.bool_]:
    """Which unit squares, centred on (gx, gy), the segment from (0, 0) to (dx, dy) must not meet.

    In whole half cells: segment and square are apart if they are on one of the axes x and y, or square to
    the segment. Touching, and that can only be at a corner, counts as apart where corners may be cut.
    """
    corners = np.array(
        [(2 * gx + sx) * dy - (2 * gy + sy) * dx for sx, sy in ((-1, -1), (1, -1), (-1, 1), (1, 1))]
    )
    low, high = corners.min(axis=0), corners.max(axis=0)
    near = (
        (2 * gx + 1 >= 2 * min(0, dx))
        & (2 * gx - 1 <= 2 * max(0, dx))
        & (2 * gy + 1 >= 2 * min(0, dy))
        & (2 * gy - 1 <= 2 * max(0, dy))
    )
    met: NDArray[np.bool_] = near & (
        (low < 0) & (high > 0) if moves.corner_cutting else (low <= 0) & (high >= 0)
    )
    return met
