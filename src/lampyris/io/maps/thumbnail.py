"""Small pictures of maps, for lists."""

from __future__ import annotations

import io

import numpy as np
from numpy.typing import NDArray

from lampyris._core.arrays import index_array
from lampyris._core.cancellation import uninterrupted
from lampyris.model.grid import MAX_TERRAIN, Grid
from lampyris.typing import Cell

SIDE = 128
"""No thumbnail is wider or taller, pixels."""
SHADES = 8
"""Shades from blocked to free; more would double the size of the file and show nothing."""
BLOCKED_COLOUR, FREE_COLOUR = (43, 48, 58), (246, 244, 238)
START_COLOUR, GOAL_COLOUR = (4, 165, 96), (182, 16, 28)
CHEAP_COLOUR, COSTLY_COLOUR = (233, 224, 206), (186, 150, 96)
GROUNDS = 6
"""Shades of terrain, from the lowest value to 252: with the others as many as four bits hold."""
DOT = 5
"""Side of the mark of a start or goal, pixels."""


def thumbnail_pixels(grid: Grid, start: Cell | None, goal: Cell | None) -> NDArray[np.uint8]:
    """Palette indices of a map's thumbnail, uint8 (height, width), no side longer than :data:`SIDE`.

    A small map is enlarged, each cell to the same square; in a large one each pixel has the share of free
    cells of a square. 0 to SHADES - 1 go from blocked to free, then come start and goal, and then GROUNDS
    shades of terrain: for pixels that are mostly free, by the mean of their free cells.
    """
    side = max(grid.width, grid.height)
    shrink, grow = -(-side // SIDE), max(1, SIDE // side)
    ys, xs = np.arange(0, grid.height, shrink), np.arange(0, grid.width, shrink)
    free = np.add.reduceat(
        np.add.reduceat(~grid.blocked, index_array(ys), axis=0, dtype=np.int64), index_array(xs), axis=1
    )
    cells = np.outer(np.diff(ys, append=grid.height), np.diff(xs, append=grid.width))
    shade = (free * (SHADES - 1) * 2 + cells) // (2 * cells)
    if grid.terrain is not None:
        # Blocked cells have no terrain: the sum over a square is that of its free cells.
        total = np.add.reduceat(
            np.add.reduceat(grid.terrain, index_array(ys), axis=0, dtype=np.int64), index_array(xs), axis=1
        )
        ground = (total - 1) * GROUNDS // np.maximum(MAX_TERRAIN * free, 1)
        shade = np.where((2 * free > cells) & (total > 0), SHADES + 2 + ground, shade)
    pixels: NDArray[np.uint8] = shade.astype(np.uint8).repeat(grow, axis=0).repeat(grow, axis=1)
    for cell, colour in ((start, SHADES), (goal, SHADES + 1)):
        if cell is not None:
            x, y = ((c * grow + grow // 2) // shrink for c in cell)
            half = max(DOT, grow) // 2
            pixels[max(y - half, 0) : y + half + 1, max(x - half, 0) : x + half + 1] = colour
    return pixels


def thumbnail(grid: Grid, start: Cell | None, goal: Cell | None) -> bytes:
    """A map's thumbnail as a PNG with a palette."""
    with uninterrupted():
        from PIL import Image

    pixels = thumbnail_pixels(grid, start, goal)
    picture = Image.frombytes("P", pixels.shape[::-1], pixels.tobytes())
    ramp, grounds = (
        [
            (first * (count - 1 - k) + last * k) // (count - 1)
            for k in range(count)
            for first, last in zip(one, other, strict=True)
        ]
        for one, other, count in (
            (BLOCKED_COLOUR, FREE_COLOUR, SHADES),
            (CHEAP_COLOUR, COSTLY_COLOUR, GROUNDS),
        )
    )
    picture.putpalette([*ramp, *START_COLOUR, *GOAL_COLOUR, *(grounds if grid.terrain is not None else ())])
    out = io.BytesIO()
    picture.save(out, format="PNG", optimize=True, bits=4)
    return out.getvalue()
