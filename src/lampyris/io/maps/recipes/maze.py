"""Mazes: one path between any two places, or a few more."""

from __future__ import annotations

import numpy as np

from lampyris.io.maps.recipes.draw import Draw
from lampyris.io.maps.recipes.recipe import RecipeSetting, too_small
from lampyris.io.maps.recipes.regions import spanning_tree
from lampyris.typing import BoolGrid

SETTINGS = (
    RecipeSetting("corridor", 1, 1, 256, "width of a corridor, cells"),
    RecipeSetting("wall", 1, 1, 256, "thickness of a wall, cells"),
    RecipeSetting(
        "loops", 0.0, 0.0, 1.0, "share of the remaining walls that are opened; 0 is a perfect maze"
    ),
)


def maze(draw: Draw, width: int, height: int, *, corridor: int, wall: int, loops: float) -> BoolGrid:
    """A random spanning tree of a lattice, with corridors for its edges.

    Cells that are left over when the sides are no multiple of the pitch thicken the outer walls.
    """
    pitch = corridor + wall
    columns, rows = (width - wall) // pitch, (height - wall) // pitch
    if columns < 1 or rows < 1:
        raise too_small(
            "one corridor and its walls", width, height, f"{pitch + wall} x {pitch + wall} or more"
        )
    node = np.arange(rows * columns, dtype=np.int64).reshape(rows, columns)
    a = np.concatenate((node[:, :-1].ravel(), node[:-1].ravel()))
    b = np.concatenate((node[:, 1:].ravel(), node[1:].ravel()))
    opened = spanning_tree(draw, node.size, a, b)
    opened |= draw.units(1, len(a))[0] < loops
    # One lattice cell, wall to its right and wall below it, as a 2 x 2 pattern blown up to its true widths.
    pattern = np.ones((rows, 2, columns, 2), dtype=np.bool_)
    pattern[:, 0, :, 0] = False
    split = rows * (columns - 1)
    pattern[:, 0, :-1, 1] = ~opened[:split].reshape(rows, columns - 1)
    pattern[:-1, 1, :, 0] = ~opened[split:].reshape(rows - 1, columns)
    small = pattern.reshape(2 * rows, 2 * columns)
    large = np.repeat(small, np.tile((corridor, wall), rows), axis=0)
    large = np.repeat(large, np.tile((corridor, wall), columns), axis=1)
    left, top = wall + (width - wall - columns * pitch) // 2, wall + (height - wall - rows * pitch) // 2
    blocked = np.ones((height, width), dtype=np.bool_)
    inner = large[: rows * pitch - wall, : columns * pitch - wall]
    blocked[top : top + inner.shape[0], left : left + inner.shape[1]] = inner
    return blocked
