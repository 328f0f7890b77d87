"""A map as pixels: walls, unknown cells and the ground in one RGB array of about the size it is shown in.

The ground is a landscape (luciferin or cost) where one is given, and else the map's terrain.

A small map is enlarged by whole pixels, a large one is shrunk by whole blocks; a block is as dark as the
share of walls in it, lifted so that a wall one cell thick stays visible in a map of thousands, and its ground
is the mean of its free cells.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris.model.grid import Grid
from lampyris.report.style import CUT_OFF, FREE, UNKNOWN, UNKNOWN_STRIPE, WALL, Rgb, terrain_colours
from lampyris.typing import BoolGrid, ByteGrid, FloatGrid, Floats


@dataclass(frozen=True, slots=True)
class Raster:
    """Pixels of a map.

    Parameters
    ----------
    rgb : uint8 (rows, columns, 3).
    scale : pixels a cell; below 1 where the map was shrunk.
    """

    rgb: Rgb
    scale: float


def draw_map(grid: Grid, target: int, layer: FloatGrid | None = None, colours: Rgb | None = None) -> Raster:
    """The map as pixels, its longer side about ``target`` of them.

    Parameters
    ----------
    layer : (height, width), infinity where there is none; drawn in ``colours`` (256, 3), 0 to its greatest
        finite value. None: the terrain is drawn, where the map has any.
    """
    side = max(grid.height, grid.width)
    shrink = max(1, -(-side // target))
    grow = max(1, target // side)
    shade = _share(grid.blocked, shrink) ** 0.6
    unknown = grid.unknown & grid.blocked if grid.unknown is not None else None
    rgb = _ground(grid, layer, colours, shrink)
    rgb = np.round(rgb + (np.array(WALL) - rgb) * shade[..., None])
    pixels = rgb.astype(np.uint8).repeat(grow, axis=0).repeat(grow, axis=1)
    if unknown is not None:
        lost = _share(unknown, shrink) > 0.5
        lost = lost.repeat(grow, axis=0).repeat(grow, axis=1)
        y, x = np.arange(lost.shape[0])[:, None], np.arange(lost.shape[1])
        stripe = (x + y) % 8 < 2
        pixels[lost & ~stripe] = UNKNOWN
        pixels[lost & stripe] = UNKNOWN_STRIPE
    return Raster(pixels, grow / shrink)


def _ground(grid: Grid, layer: FloatGrid | None, colours: Rgb | None, shrink: int) -> Floats:
    """Colours of the free cells."""
    if layer is None or colours is None:
        if grid.terrain is not None:
            return terrain_colours()[_mean(grid.terrain, ~grid.blocked, shrink)].astype(np.float64)
        rows, columns = -(-grid.height // shrink), -(-grid.width // shrink)
        return np.broadcast_to(np.array(FREE, dtype=np.float64), (rows, columns, 3))
    value = _least(layer, shrink)
    known = np.isfinite(value)
    top = value[known].max() if known.any() else 0.0
    index = np.zeros(value.shape, dtype=np.int64)
    if top > 0:
        index[known] = np.round(value[known] * (255 / top))
    out: Floats = colours[index].astype(np.float64)
    out[~known] = CUT_OFF
    return out


def _share(mask: BoolGrid, size: int) -> FloatGrid:
    """The share of True in each block of size x size cells; beyond the map nothing is."""
    if size == 1:
        return mask.astype(np.float64)
    count: FloatGrid = _in_blocks(mask, size, False).sum(axis=(1, 3), dtype=np.float64)
    return count / (size * size)


def _mean(values: ByteGrid, where: BoolGrid, size: int) -> ByteGrid:
    """The mean of each block over the cells that count, rounded; all others are 0."""
    if size == 1:
        return values
    count = _in_blocks(where, size, False).sum(axis=(1, 3), dtype=np.int64)
    total = _in_blocks(values, size, 0).sum(axis=(1, 3), dtype=np.int64)
    mean: ByteGrid = ((2 * total + count) // np.maximum(2 * count, 1)).astype(np.uint8)
    return mean


def _least(values: FloatGrid, size: int) -> FloatGrid:
    """The least value in each block."""
    if size == 1:
        return values
    out: FloatGrid = _in_blocks(values, size, np.inf).min(axis=(1, 3))
    return out


def _in_blocks(values: NDArray[Any], size: int, edge: float) -> NDArray[Any]:
    """Cells as (block row, row, block column, column); ``edge`` fills up the last blocks."""
    h, w = values.shape
    filled = np.pad(values, ((0, -h % size), (0, -w % size)), constant_values=edge)
    return filled.reshape(filled.shape[0] // size, size, filled.shape[1] // size, size)
