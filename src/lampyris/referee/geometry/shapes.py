"""Discs against squares: what a round obstacle on a grid touches.

A blocked cell is a closed unit square around its centre. A disc *overlaps* it when some point of the square
is strictly nearer to the disc's centre than the radius; touching is allowed. Distances are compared with a
slack of :data:`TOUCH`, so that a robot exactly as wide as an opening passes however its radius was rounded.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris.model.grid import Grid, frozen
from lampyris.typing import BoolGrid, Floats

Ints = NDArray[np.int64]

TOUCH = 1e-9
"""Overlap that counts as touching: metres, or share of the radius where that is more."""

_GATHER = 2_000_000
"""Most cells looked up at once; keeps a long path of a large robot within a few tens of megabytes."""


def slack(radius: float) -> float:
    """How much overlap is forgiven to a disc of that radius, metres."""
    return TOUCH * max(1.0, radius)


def _around(reach: int) -> tuple[Ints, Ints]:
    side = np.arange(-reach, reach + 1, dtype=np.int64)
    gx, gy = np.meshgrid(side, side)
    return gx.ravel(), gy.ravel()


@lru_cache(maxsize=256)
def disc_cells(radius: float, resolution: float) -> Ints:
    """Offsets of the cells that a disc standing on a cell's centre covers; (n, 2), its own cell first.

    Parameters
    ----------
    radius : metres; 0 covers its own cell.
    resolution : metres a cell.
    """
    reach = math.ceil(radius / resolution + 0.5)
    gx, gy = _around(reach)
    distance = np.hypot(np.maximum(np.abs(gx) - 0.5, 0.0), np.maximum(np.abs(gy) - 0.5, 0.0)) * resolution
    hit = (distance < radius - slack(radius)) & ((gx != 0) | (gy != 0))
    own = np.zeros((1, 2), dtype=np.int64)
    out: Ints = frozen(np.concatenate((own, np.stack((gx[hit], gy[hit]), axis=1))))
    return out


@lru_cache(maxsize=1024)
def swept_cells(dx: int, dy: int, radius: float, resolution: float) -> Ints:
    """Offsets of the cells that a disc covers on its straight path from cell (0, 0) to (dx, dy); (n, 2).

    ``radius`` in metres, > 0. A square is covered when it comes nearer to the segment between the two
    centres than the radius.
    """
    reach = math.ceil(radius / resolution + 0.5) + max(abs(dx), abs(dy))
    gx, gy = _around(reach)
    distance = _segment_to_squares(dx, dy, gx, gy) * resolution
    hit = distance < radius - slack(radius)
    out: Ints = frozen(np.stack((gx[hit], gy[hit]), axis=1))
    return out


def _segment_to_squares(dx: float, dy: float, gx: NDArray[Any], gy: NDArray[Any]) -> Floats:
    """Distance in cells between the segment (0, 0)-(dx, dy) and the unit squares centred on (gx, gy).

    Two convex figures that do not meet are nearest at a corner of one of them: an end of the segment against
    the square, or a corner of the square against the segment. Whether they meet is asked on the three axes
    that could part them.
    """
    ends = np.minimum(_point_to_squares(0, 0, gx, gy), _point_to_squares(dx, dy, gx, gy))
    length2 = dx * dx + dy * dy
    if length2 == 0:
        return ends
    best = ends
    sides = []
    for cx, cy in ((-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)):
        px, py = gx + cx, gy + cy
        along = np.clip((px * dx + py * dy) / length2, 0.0, 1.0)
        best = np.minimum(best, np.hypot(px - along * dx, py - along * dy))
        sides.append(px * dy - py * dx)
    across = np.array(sides)
    meet = (
        (gx + 0.5 > min(0, dx))
        & (gx - 0.5 < max(0, dx))
        & (gy + 0.5 > min(0, dy))
        & (gy - 0.5 < max(0, dy))
        & (across.min(axis=0) < 0)
        & (across.max(axis=0) > 0)
    )
    return np.where(meet, 0.0, best)


def _point_to_squares(x: float, y: float, gx: NDArray[Any], gy: NDArray[Any]) -> Floats:
    out: Floats = np.hypot(np.maximum(np.abs(gx - x) - 0.5, 0.0), np.maximum(np.abs(gy - y) - 0.5, 0.0))
    return out


def first_overlap(blocked: BoolGrid, x: Ints, y: Ints, offsets: Ints) -> tuple[int, int, int] | None:
    """The first place (x, y) from which one of the offsets lands on a wall: its index, and the wall's cell.

    Cells beyond the edge of the map are not walls.
    """
    height, width = blocked.shape
    chunk = max(1, _GATHER // max(1, len(offsets)))
    for k in range(0, len(x), chunk):
        cx = x[k : k + chunk, None] + offsets[:, 0]
        cy = y[k : k + chunk, None] + offsets[:, 1]
        inside = (cx >= 0) & (cx < width) & (cy >= 0) & (cy < height)
        hit = inside & blocked[np.where(inside, cy, 0), np.where(inside, cx, 0)]
        if hit.any():
            i, j = np.unravel_index(int(hit.argmax()), hit.shape)
            return k + int(i), int(cx[i, j]), int(cy[i, j])
    return None


def stands_free(grid: Grid, cell: tuple[int, int], radius: float) -> bool:
    """Whether a disc may stand on a cell of the map: the cell is free, and no wall's square is overlapped."""
    x, y = cell
    if grid.blocked[y, x]:
        return False
    here = np.array([[x, y]], dtype=np.int64)
    offsets = disc_cells(radius, grid.resolution)
    return first_overlap(grid.blocked, here[:, 0], here[:, 1], offsets) is None


def wall_distance(grid: Grid, x: Ints, y: Ints, beyond: float) -> Floats:
    """Distance from the centres of cells to the nearest wall's square, metres; infinity if beyond ``beyond``.

    Only the rows within ``beyond`` of a place can matter, and of each row only the nearest wall to the left
    or right: one sweep over the rows around the places, then one look-up for each place and row.
    """
    rows = math.ceil(min(beyond / grid.resolution, grid.height) + 0.5)
    # In pieces: the box around a long slanting path is mostly map that no node is near to.
    piece = max(128, 8 * rows)
    parts = [
        _wall_distance(grid, x[k : k + piece], y[k : k + piece], beyond) for k in range(0, len(x), piece)
    ]
    return np.concatenate(parts)


def _wall_distance(grid: Grid, x: Ints, y: Ints, beyond: float) -> Floats:
    res = grid.resolution
    rows = math.ceil(min(beyond / res, grid.height) + 0.5)
    cols = math.ceil(min(beyond / res, grid.width) + 0.5)
    x0, x1 = max(0, int(x.min()) - cols), min(grid.width, int(x.max()) + cols + 1)
    y0, y1 = max(0, int(y.min()) - rows), min(grid.height, int(y.max()) + rows + 1)
    crop = grid.blocked[y0:y1, x0:x1]
    far = 4 * (grid.width + grid.height)
    here = np.arange(x1 - x0, dtype=np.int64)
    left = np.maximum.accumulate(np.where(crop, here, -far), axis=1)
    right = np.minimum.accumulate(np.where(crop, here, far)[:, ::-1], axis=1)[:, ::-1]
    aside = np.minimum(here - left, right - here)
    best = np.full(len(x), np.inf)
    for dy in range(-rows, rows + 1):
        row = y + dy - y0
        inside = (row >= 0) & (row < y1 - y0)
        across = np.maximum(aside[np.where(inside, row, 0), x - x0] - 0.5, 0.0)
        distance2 = across**2 + max(abs(dy) - 0.5, 0.0) ** 2
        best = np.where(inside & (across < far / 2), np.minimum(best, distance2), best)
    distance = np.sqrt(best) * res
    return np.where(distance <= beyond, distance, np.inf)
