"""The headings with which moving obstacles that are polygons begin."""

from __future__ import annotations

import math
from itertools import pairwise

from lampyris._core import elementary
from lampyris.model.grid import Grid
from lampyris.sim.traffic.traffic import Shuttle, Traffic


def first_headings(traffic: Traffic, grid: Grid) -> dict[int, float]:
    """The headings with which obstacles begin, by their number; those left out begin along the rows, to the right.

    Radians counterclockwise from the rows: the direction of the first step, or the yaw that a recorded track states.
    """
    cell, found = traffic.world.space.cell, {}
    for driver in traffic.drivers:
        if isinstance(driver, Shuttle) and len(driver.route) > 1:
            (ax, ay), (bx, by) = cell(driver.route[0]), cell(driver.route[1])
            found[driver.obstacle] = direction(bx - ax, by - ay)
    for obstacle, spec in () if traffic.recording is None else traffic.recording.tracks:
        moves = [(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(spec.track) if a != b]
        if spec.yaw:
            found[obstacle] = in_cells(spec.yaw[0], grid)
        elif moves:
            found[obstacle] = direction(*moves[0])
    return found


def in_cells(yaw: float, grid: Grid) -> float:
    """A yaw of the map frame from the rows of the grid, radians."""
    return math.remainder(yaw - grid.origin[2], 2.0 * math.pi)


def direction(dx: float, dy: float) -> float:
    """Heading of a step in columns and rows, radians counterclockwise."""
    return float(elementary.atan2(0.0 - dy, dx))
