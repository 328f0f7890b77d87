"""Hills: rolling ground that is costlier the higher it lies, with lakes, rocks and roads.

All in whole numbers, so that no machine's rounding can move a cell.
"""

from __future__ import annotations

import numpy as np

from lampyris.io.maps.recipes.draw import Draw
from lampyris.io.maps.recipes.noise import BITS, Whole, smooth
from lampyris.io.maps.recipes.recipe import RecipeSetting
from lampyris.io.maps.recipes.regions import keep_largest
from lampyris.typing import BoolGrid, ByteGrid

SETTINGS = (
    RecipeSetting("pitch", 16, 4, 1024, "from a hill to the next, about, cells"),
    RecipeSetting("levels", 5, 1, 64, "how many kinds of terrain there are besides plain ground, equally common"),
    RecipeSetting("dearest", 252, 1, 252, "terrain value of the highest: 63 is twice plain ground, 252 five times"),
    RecipeSetting("plain", 0.35, 0.0, 1.0, "share of the dry ground that is plain: what lies lowest"),
    RecipeSetting("water", 0.1, 0.0, 1.0, "share of the map under water, blocked: what lies lower still"),
    RecipeSetting("rocks", 0.01, 0.0, 1.0, "share of the cells that are a rock, blocked"),
    RecipeSetting("roads", 2, 0, 16, "roads from side to side, plain ground, over water on a causeway"),
    RecipeSetting("road", 2, 1, 64, "width of a road, cells"),
)  # fmt: skip
TOP = 1 << 10
"""Heights of the lattice are drawn below this."""


def hills(
    draw: Draw,
    width: int,
    height: int,
    *,
    pitch: int,
    levels: int,
    dearest: int,
    plain: float,
    water: float,
    rocks: float,
    roads: int,
    road: int,
) -> tuple[BoolGrid, ByteGrid]:
    """Smooth noise of three wavelengths, cut at heights that give each kind of ground its share of the map.

    What is left free without a path to the rest becomes water too.
    """
    land = _heights(draw, width, height, pitch)
    lake, level = _cut(land, water, plain, levels)
    blocked = lake | (draw.units(height, width) < rocks)
    terrain = (dearest * level // levels).astype(np.uint8)
    for _ in range(roads):
        lane = _road(draw, width, height, pitch, road)
        blocked[lane] = False
        terrain[lane] = 0
    blocked = keep_largest(blocked)
    terrain[blocked] = 0
    return blocked, terrain


def _heights(draw: Draw, width: int, height: int, pitch: int) -> Whole:
    """Three layers of noise, each of half the wavelength and half the height of the one before."""
    land: Whole = np.zeros((height, width), dtype=np.int32)
    for k in range(3):
        size = pitch >> k
        shape = (height // size + 2, width // size + 2)
        lattice = draw.belows(np.full(shape, TOP >> k)).astype(np.int32)
        land += smooth(lattice, width, height, size)
    return land


def _cut(land: Whole, water: float, plain: float, levels: int) -> tuple[BoolGrid, Whole]:
    """What is under water, and the level of each cell, 0 (plain) to ``levels``."""
    ascending = np.sort(land, axis=None)
    wet = int(water * land.size)
    low = wet + int(plain * (land.size - wet))
    cuts = [low + (land.size - low) * k // levels for k in range(levels)]
    # A share of 1 leaves nothing: no cell is higher than the highest.
    above = np.append(ascending, ascending[-1] + 1)
    level = np.searchsorted(above[cuts], land, side="right").astype(np.int32)
    return land < above[wet], level


def _road(draw: Draw, width: int, height: int, pitch: int, wide: int) -> BoolGrid:
    """The cells of a road that winds from one side of the map to the opposite one."""
    upright = draw.below(2) == 1
    length, across = (height, width) if upright else (width, height)
    stray = min(2 * pitch, across)
    lattice = draw.belows(np.full((2, length // (4 * pitch) + 2), 2 * stray + 1)).astype(np.int32) - stray
    middle = draw.below(across)
    at = np.clip(middle + (smooth(lattice, length, 1, 4 * pitch)[0] >> 2 * BITS), 0, across - 1)
    before = np.append(at[:1], at[:-1])
    first, last = np.minimum(at, before), np.maximum(at, before) + wide - 1
    place = np.arange(across, dtype=np.int32)[:, None]
    lane: BoolGrid = (place >= first) & (place <= last)
    return lane.T if upright else lane
