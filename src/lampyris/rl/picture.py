"""Pictures of environments: the map with robots and goals, as an array."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lampyris.model.grid import Grid

_SIDE = 512
"""Pixels of the longer side, about."""
_COLOURS = ((31, 119, 180), (214, 39, 40), (44, 160, 44), (148, 103, 189), (255, 127, 14), (23, 190, 207))


def picture_of(
    grid: Grid, robots: Sequence[tuple[tuple[float, float], tuple[float, float]]]
) -> NDArray[np.uint8]:
    """The map, each robot as a disc of half a cell and its goal as a ring; uint8 (height, width, 3).

    Parameters
    ----------
    robots : where each is and where its goal is, cells.
    """
    scale = max(_SIDE // max(grid.height, grid.width), 4)
    grey = np.where(grid.blocked, 60, 250).astype(np.uint8)
    picture = np.repeat(np.repeat(grey, scale, axis=0), scale, axis=1)[:, :, None].repeat(3, axis=2)
    rows = (np.arange(picture.shape[0])[:, None] + 0.5) / scale - 0.5
    columns = (np.arange(picture.shape[1])[None, :] + 0.5) / scale - 0.5
    for k, (at, goal) in enumerate(robots):
        colour = _COLOURS[k % len(_COLOURS)]
        away = (columns - goal[0]) ** 2 + (rows - goal[1]) ** 2
        picture[(away <= 0.49) & (away >= 0.16)] = colour
        picture[(columns - at[0]) ** 2 + (rows - at[1]) ** 2 <= 0.2] = colour
    return picture
