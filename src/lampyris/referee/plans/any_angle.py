"""Straight lines between waypoints: what a point or a disc driven along them meets."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from lampyris.model.moves import Moves
from lampyris.model.plan import Plan
from lampyris.model.scene import Scene
from lampyris.referee.geometry.shapes import Ints, _segment_to_squares, slack
from lampyris.referee.verdict import Violation
from lampyris.typing import BoolGrid, Cell

_BAND = 64
"""Rows looked at together: a long slanting line is near to few of the cells in the box around it."""


def lines_violation(plan: Plan, scene: Scene) -> Violation | None:
    """The first broken rule of a plan's waypoints; its path has been judged before.

    Rules, in this order: ``waypoints`` (there without a path; ends that are not the path's; a point
    outside the map, or twice in a row; points that the path does not visit one after the other; lines
    longer than the path), ``line`` (a wall on the way). A point robot must not run through a blocked
    square, nor touch one where corners may not be cut; a disc must not overlap one.
    """
    if plan.waypoints is None:
        return None
    points = plan.waypoints.astype(np.int64)
    if plan.path is None:
        return Violation("waypoints", "plan", "there are waypoints without a path")
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


def line_meets(blocked: BoolGrid, begin: Cell, end: Cell, scene: Scene) -> Cell | None:
    """A wall that the robot of a scene meets on the straight line between two cell centres, or None."""
    radius = scene.robot.radius / scene.grid.resolution
    reach = math.ceil(radius + 0.5)
    height, width = blocked.shape
    (x0, y0), (x1, y1) = begin, end
    top, bottom = max(0, min(y0, y1) - reach), min(height, max(y0, y1) + reach + 1)
    for row in range(top, bottom, _BAND):
        last = min(bottom, row + _BAND)
        left, right = _between(begin, end, row - reach, last - 1 + reach)
        x_from, x_to = max(0, left - reach), min(width, right + reach + 1)
        y, x = np.nonzero(blocked[row:last, x_from:x_to])
        if not len(x):
            continue
        gx, gy = x.astype(np.int64) + x_from - x0, y.astype(np.int64) + row - y0
        if scene.robot.radius > 0:
            distance = _segment_to_squares(x1 - x0, y1 - y0, gx, gy) * scene.grid.resolution
            hit = distance < scene.robot.radius - slack(scene.robot.radius)
        else:
            hit = _crosses(x1 - x0, y1 - y0, gx, gy, scene.moves)
        if hit.any():
            k = int(hit.argmax())
            return int(gx[k]) + x0, int(gy[k]) + y0
    return None


def _between(begin: Cell, end: Cell, low: int, high: int) -> tuple[int, int]:
    """Least and greatest column of the part of a line that lies between two rows."""
    (x0, y0), (x1, y1) = begin, end
    if y0 == y1:
        return min(x0, x1), max(x0, x1)
    at = [min(max((y - y0) / (y1 - y0), 0.0), 1.0) for y in (low, high)]
    xs = [x0 + t * (x1 - x0) for t in at]
    return math.floor(min(xs)), math.ceil(max(xs))


def _crosses(dx: int, dy: int, gx: Ints, gy: Ints, moves: Moves) -> NDArray[np.bool_]:
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
