"""Polygons against the squares of blocked cells, by clipping."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lampyris.typing import BoolGrid, Floats

DEPTH = 1e-6
"""Cells by which a polygon may reach into a square: rounding of the poses."""


def placed(polygon: Floats, x: float, y: float, yaw: float) -> Floats:
    """The vertices of a polygon (its frame: y to the left) at a pose in cells (y down, yaw counterclockwise)."""
    cos, sin = math.cos(yaw), math.sin(yaw)
    ahead, left = polygon[:, 0], polygon[:, 1]
    return np.column_stack((x + cos * ahead - sin * left, y - (sin * ahead + cos * left)))


def overlapped(vertices: Floats, blocked: BoolGrid) -> tuple[int, int] | None:
    """A blocked cell whose square overlaps a polygon by more than :data:`DEPTH`; (x, y), or None.

    Parameters
    ----------
    vertices : float64 (k, 2), cells; a simple polygon.
    """
    height, width = blocked.shape
    x0, y0 = np.floor(vertices.min(axis=0) - 0.5).astype(int)
    x1, y1 = np.ceil(vertices.max(axis=0) + 0.5).astype(int) + 1
    x0, y0, x1, y1 = max(x0, 0), max(y0, 0), min(x1, width), min(y1, height)
    if x0 >= x1 or y0 >= y1:
        return None
    cells = np.argwhere(blocked[y0:y1, x0:x1])
    if not len(cells):
        return None
    centres = cells[:, ::-1] + (x0, y0)
    hit = _edges_enter(vertices, centres) | _holds(vertices, centres)
    if not hit.any():
        return None
    x, y = centres[int(hit.argmax())].tolist()
    return int(x), int(y)


def _edges_enter(vertices: Floats, centres: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Whether any edge runs through the inside of each square (Liang and Barsky's clipping)."""
    start = vertices[None, :, :]
    edge = np.roll(vertices, -1, axis=0)[None, :, :] - start
    half = 0.5 - DEPTH
    first = np.zeros((len(centres), len(vertices)))
    last = np.ones_like(first)
    outside: NDArray[np.bool_] = np.zeros(first.shape, dtype=np.bool_)
    for axis in (0, 1):
        low = centres[:, None, axis] - half - start[:, :, axis]
        high = centres[:, None, axis] + half - start[:, :, axis]
        step = np.broadcast_to(edge[:, :, axis], first.shape)
        still = step == 0
        outside |= still & ((low >= 0) | (high <= 0))
        safe = np.where(still, 1.0, step)
        a, b = low / safe, high / safe
        first = np.where(still, first, np.maximum(first, np.minimum(a, b)))
        last = np.where(still, last, np.minimum(last, np.maximum(a, b)))
    found: NDArray[np.bool_] = np.any(~outside & (first < last), axis=1)
    return found


def _holds(vertices: Floats, centres: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Whether the centre of each square lies within the polygon, by the parity of crossings."""
    x, y = centres[:, None, 0], centres[:, None, 1]
    ax, ay = vertices[None, :, 0], vertices[None, :, 1]
    bx, by = np.roll(vertices, -1, axis=0).T[:, None, :]
    with np.errstate(divide="ignore", invalid="ignore"):
        crosses = ((ay > y) != (by > y)) & (x < ax + (bx - ax) * (y - ay) / (by - ay))
    found: NDArray[np.bool_] = crosses.sum(axis=1) % 2 == 1
    return found


def along_arc(start: Floats, end: Floats, turn: float, share: float) -> tuple[float, float]:
    """A point of the arc from one point to another that turns by an angle (y down)."""
    dx, dy = end - start
    if abs(turn) < 1e-9:
        return start[0] + share * dx, start[1] + share * dy
    # The chord to the point is to the whole chord as the sines of half the angles are.
    ratio = math.sin(turn * share / 2) / math.sin(turn / 2)
    bend = turn * (share - 1) / 2
    cos, sin = math.cos(bend), -math.sin(bend)  # y points down
    return start[0] + ratio * (cos * dx - sin * dy), start[1] + ratio * (sin * dx + cos * dy)
