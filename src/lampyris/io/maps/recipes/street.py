"""Towns: bent streets around blocks of houses, avenues across, alleys, yards and parks.

All in whole numbers, so that no machine's sine or rounding can move a house.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lampyris.io.maps.recipes.draw import Draw
from lampyris.io.maps.recipes.noise import BITS, Whole, smooth
from lampyris.io.maps.recipes.recipe import RecipeSetting
from lampyris.io.maps.recipes.regions import keep_largest
from lampyris.typing import BoolGrid

SETTINGS = (
    RecipeSetting("block", 24, 6, 1024, "side of a block of houses on average, cells"),
    RecipeSetting("road", 4, 2, 64, "width of a street, cells; every fourth is half as wide again"),
    RecipeSetting(
        "bend", 14, 0, 1024, "how far streets stray from straight, cells; at most half a block is used"
    ),
    RecipeSetting("avenues", 1, 0, 16, "straight avenues that cut through the blocks"),
    RecipeSetting("rings", 1, 0, 8, "round streets about the middle"),
    RecipeSetting("merged", 0.12, 0.0, 1.0, "share of the streets between two blocks that are built over"),
    RecipeSetting("alleys", 0.5, 0.0, 1.0, "share of the blocks with an alley through them"),
    RecipeSetting("yards", 0.5, 0.0, 1.0, "share of those that have a yard on it"),
    RecipeSetting("parks", 0.07, 0.0, 1.0, "share of the blocks that are parks, free but for trees"),
)
TREES = 0.06


def street(
    draw: Draw,
    width: int,
    height: int,
    *,
    block: int,
    road: int,
    bend: int,
    avenues: int,
    rings: int,
    merged: float,
    alleys: float,
    yards: float,
    parks: float,
) -> BoolGrid:
    """A bent chessboard of blocks and streets, cut by straight avenues and round streets.

    What is left free without a path to the rest is built over.
    """
    bend = min(bend, block // 2)
    u = np.arange(width, dtype=np.int32)[None, :] + _bent(draw, width, height, block, bend)
    v = np.arange(height, dtype=np.int32)[:, None] + _bent(draw, width, height, block, bend)
    across = _Cuts.drawn(draw, width + 2 * bend, block, road)
    down = _Cuts.drawn(draw, height + 2 * bend, block, road)
    u += bend
    v += bend
    column, row = across.part[u], down.part[v]
    shape = (down.count, across.count)
    houses = _built(draw, column, row, shape, across, down, merged)
    free = _inside(draw, (column, across.place[u], across.length), (row, down.place[v], down.length), shape,
                   alleys, yards)  # fmt: skip
    houses &= ~free
    park = draw.units(*shape) < parks
    trees = draw.units(height, width) < TREES
    both = (column >= 0) & (row >= 0)
    houses = np.where(both & park[row, column], trees, houses)
    for _ in range(avenues):
        _cut_straight(draw, houses, road + road // 2)
    for k in range(rings):
        _cut_round(draw, houses, road, k + 1, rings)
    return keep_largest(houses)


def _bent(draw: Draw, width: int, height: int, block: int, bend: int) -> Whole:
    """How far each cell is shifted, -bend to bend, int32 (height, width): smooth noise."""
    pitch = 5 * block
    rows, columns = height // pitch + 2, width // pitch + 2
    values = (draw.belows(np.full((rows, columns), 2 * bend + 1)) - bend).astype(np.int32)
    spread = smooth(values, width, height, pitch)
    return (spread + (1 << (2 * BITS - 1))) >> 2 * BITS


@dataclass(frozen=True, slots=True)
class _Cuts:
    """One axis divided into blocks and streets.

    ``part`` is the block of each cell, or -1 - k for the street behind block k; ``place`` its place in the
    block, ``length`` the length of each block, ``main`` whether the street behind a block is a main street.
    """

    part: Whole
    place: Whole
    length: Whole
    main: BoolGrid

    @property
    def count(self) -> int:
        return len(self.length)

    @staticmethod
    def drawn(draw: Draw, cells: int, block: int, road: int) -> _Cuts:
        part, place = [], []
        lengths: list[int] = []
        main: list[bool] = []
        at, turn = 0, draw.below(4)
        while at < cells:
            k, length = len(lengths), draw.between(block - block // 2, block + block // 2)
            wide = (k + turn) % 4 == 0
            gap = road + (road // 2 if wide else 0)
            part.append(np.repeat([k, -1 - k], [length, gap]))
            place.append(np.concatenate((np.arange(length), np.zeros(gap, dtype=np.int64))))
            lengths.append(length)
            main.append(wide)
            at += length + gap
        return _Cuts(
            np.concatenate(part).astype(np.int32),
            np.concatenate(place).astype(np.int32),
            np.array(lengths, dtype=np.int32),
            np.array(main),
        )


def _built(
    draw: Draw,
    column: Whole,
    row: Whole,
    shape: tuple[int, int],
    across: _Cuts,
    down: _Cuts,
    merged: float,
) -> BoolGrid:
    """Where houses stand: the blocks, and the streets between merged ones (main streets never are)."""
    over_upright = (draw.units(*shape) < merged) & ~across.main[None, :]
    over_level = (draw.units(*shape) < merged) & ~down.main[:, None]
    in_column, in_row = column >= 0, row >= 0
    built: BoolGrid = in_column & in_row
    built |= ~in_column & in_row & over_upright[row, -1 - column]
    built |= in_column & ~in_row & over_level[-1 - row, column]
    return built


def _inside(
    draw: Draw,
    x: tuple[Whole, Whole, Whole],
    y: tuple[Whole, Whole, Whole],
    shape: tuple[int, int],
    alleys: float,
    yards: float,
) -> BoolGrid:
    """What is free inside the blocks: an alley through the middle third, a yard on it."""
    (column, px, lengths_x), (row, py, lengths_y) = x, y
    has_alley = draw.units(*shape) < alleys
    upright = draw.belows(np.full(shape, 2)) == 1
    long = np.where(upright, lengths_x[None, :], lengths_y[:, None]).astype(np.int64)
    at = long // 3 + draw.belows(long // 3 + 1)
    wide = 1 + draw.belows(np.full(shape, 2))
    has_yard = has_alley & (draw.units(*shape) < yards)
    # A street's -1 - k indexes some block from the end; what is said of it there is not used by the caller.
    inside = (column >= 0) & (row >= 0)
    first = at.astype(np.int32)
    along = np.where(upright[row, column], px, py)
    behind = along - first[row, column]
    free: BoolGrid = has_alley[row, column] & (behind >= 0) & (behind < wide.astype(np.int32)[row, column])
    quarter_x, quarter_y = (lengths_x // 4)[column], (lengths_y // 4)[row]
    yard = (px >= quarter_x) & (px < lengths_x[column] - quarter_x)
    yard &= (py >= quarter_y) & (py < lengths_y[row] - quarter_y)
    free |= has_yard[row, column] & yard
    return free & inside


def _cut_straight(draw: Draw, houses: BoolGrid, wide: int) -> None:
    """A straight avenue from one side of the map to the opposite one."""
    height, width = houses.shape
    if draw.below(2):
        x0, y0, x1, y1 = 0, draw.below(height), width - 1, draw.below(height)
    else:
        x0, y0, x1, y1 = draw.below(width), 0, draw.below(width), height - 1
    a, b = y1 - y0, x0 - x1
    x, y = np.arange(width, dtype=np.int64)[None, :], np.arange(height, dtype=np.int64)[:, None]
    # |a (x - x0) + b (y - y0)| <= wide / 2 * sqrt(a^2 + b^2), squared.
    off = a * (x - x0) + b * (y - y0)
    houses[4 * off * off <= wide * wide * (a * a + b * b)] = False


def _cut_round(draw: Draw, houses: BoolGrid, wide: int, k: int, rings: int) -> None:
    """The k-th of so many round streets about a point near the middle."""
    height, width = houses.shape
    side = min(width, height)
    cx = width // 2 + draw.between(-(side // 20), side // 20)
    cy = height // 2 + draw.between(-(side // 20), side // 20)
    radius = side * k * 2 // (5 * rings)
    x, y = np.arange(width, dtype=np.int64)[None, :], np.arange(height, dtype=np.int64)[:, None]
    squared = (x - cx) * (x - cx) + (y - cy) * (y - cy)
    houses[(squared >= radius * radius) & (squared <= (radius + wide) * (radius + wide))] = False
