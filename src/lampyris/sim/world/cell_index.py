"""Cell index: the map as the simulator walks it. Flat cell numbers, footprints, and the steps that walls allow.

A cell (x, y) is the number ``(y + 1) * stride + x + 1`` with ``stride = width + 2``: a border one cell wide
keeps neighbours of border cells from wrapping round to the other side. Dictionaries keyed by one small
integer are what makes a tick of sixty obstacles cost half a millisecond; keyed by pairs it takes twice as
long.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from lampyris.model.grid import Grid, GridKey, frozen
from lampyris.model.moves import Moves
from lampyris.model.scene import Scene
from lampyris.planning.field.footprint import footprint
from lampyris.planning.field.layers import free_cells, moves_for, safe_moves
from lampyris.typing import BoolGrid, Cell, Cells

Step: TypeAlias = tuple[int, int, int]
"""One step: the cell number it ends in, dx, dy."""

Entry: TypeAlias = tuple[Step, tuple[int, ...], tuple[int, ...]]
"""One step, the cells covered after it, and those of them that were not covered before."""

EIGHT: tuple[Cell, ...] = ((-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1))
"""Steps of an obstacle, row by row. The order decides which option a draw means, so it must never change."""


def dilated(mask: BoolGrid, offsets: tuple[Cell, ...]) -> BoolGrid:
    """Every cell from which ``offsets`` reach a True cell; bool, (height, width)."""
    if offsets == ((0, 0),):
        return mask.copy()
    height, width = mask.shape
    ys, xs = np.nonzero(mask)
    out = np.zeros_like(mask)
    for dx, dy in offsets:
        x, y = xs - dx, ys - dy
        inside = (x >= 0) & (x < width) & (y >= 0) & (y < height)
        out[y[inside], x[inside]] = True
    return out


class CellIndex:
    """Cell numbers of a map."""

    def __init__(self, grid: Grid) -> None:
        self.width = grid.width
        self.height = grid.height
        self.stride = grid.width + 2

    def number(self, cell: Cell) -> int:
        """The number of cell (x, y)."""
        return (cell[1] + 1) * self.stride + cell[0] + 1

    def cell(self, number: int) -> Cell:
        """The (x, y) of a cell number."""
        y, x = divmod(number, self.stride)
        return x - 1, y - 1

    def pairs(self, numbers: Iterable[int]) -> list[Cell]:
        """The (x, y) of each cell number, in their order."""
        stride = self.stride
        return [(number % stride - 1, number // stride - 1) for number in numbers]

    def cells(self, numbers: Sequence[int]) -> Cells:
        """The (x, y) of each cell number; int32, (n, 2)."""
        y, x = np.divmod(np.array(numbers, dtype=np.int64), self.stride)
        return np.stack((x - 1, y - 1), axis=1).astype(np.int32)

    def cells_of(self, numbers: NDArray[np.int64]) -> Cells:
        """The (x, y) of cell numbers of any shape; int32, (..., 2), a new array."""
        if self.width * self.height <= SMALL_CELLS:
            return _cells_by_number(self.width, self.height).take(numbers, axis=0)
        y, x = np.divmod(numbers, self.stride)
        return np.stack((x - 1, y - 1), axis=-1).astype(np.int32)

    def numbers(self, mask: BoolGrid) -> NDArray[np.int64]:
        """Numbers of all True cells, rising; int64, (n,)."""
        ys, xs = np.nonzero(mask)
        return (ys + 1) * self.stride + xs + 1


class Shape:
    """Obstacles of one size: what they cover, where they may stand, and how they may step. Filled in as they
    ask.

    Parameters
    ----------
    free : bool, (height, width): no wall under the footprint.
    barred : where the obstacle may not stand for other reasons; None: nowhere.
    offsets : its footprint.
    steps : the steps it knows.
    corner_cutting : whether a diagonal may pass a cell that is not free.
    radius : metres.
    bars_are_walls : whether a diagonal may not pass a cell that is barred either.
    like : a shape on the same map whose ``free`` is this very array: what is made of it is shared. None: there is none.
    """

    def __init__(
        self,
        space: CellIndex,
        free: BoolGrid,
        barred: BoolGrid | None,
        offsets: tuple[Cell, ...],
        steps: tuple[Cell, ...],
        corner_cutting: bool,
        radius: float = 0.0,
        bars_are_walls: bool = False,
        like: Shape | None = None,
    ) -> None:
        self.space = space
        self.offsets = offsets
        self.corner_cutting = corner_cutting
        self.radius = radius
        self._bars_are_walls = bars_are_walls
        self.small = offsets == ((0, 0),)
        self._known = steps
        self._barred = (
            None if barred is None else np.packbits(barred)
        )  # it is only looked at when the map changes
        self.single = self.small and all(abs(dx) <= 1 and abs(dy) <= 1 for dx, dy in steps)
        """Whether it covers one cell and steps to neighbours alone."""
        self._cover: dict[int, tuple[int, ...]] = {}
        self.renew(free, None if like is None or like.free is not free else like._freed)

    def renew(self, free: BoolGrid, freed: bytes | None = None) -> None:
        """Take a new map: where there is no wall under the footprint now, and the same by cell number, if that is known."""
        self.free = free
        self.open: BoolGrid = free
        self._freed = self._opened = _bordered(free) if freed is None else freed
        if self._barred is not None:
            barred = np.unpackbits(self._barred, count=free.size).reshape(free.shape).view(np.bool_)
            self.open = free & ~barred
            self._opened = _bordered(self.open)
        self._steps: dict[int, tuple[Step, ...]] = {}
        self._entries: dict[int, tuple[Entry, ...]] = {}
        self._bits: NDArray[np.uint8] | None = None

    def step_bits(self) -> NDArray[np.uint8]:
        """A bit for each of :data:`EIGHT` into which walls and bars allow a step, by cell number; uint8.

        Numbers are those of a map with a border one cell wide on all sides.
        """
        if self._bits is not None:
            return self._bits
        opened = bordered(self.open)
        free = opened if self._bars_are_walls else bordered(self.free)
        height, width = self.open.shape
        bits = np.zeros(opened.shape, dtype=np.uint8)
        inner = bits[1:-1, 1:-1]

        def at(mask: BoolGrid, dx: int, dy: int) -> BoolGrid:
            return mask[1 + dy : 1 + dy + height, 1 + dx : 1 + dx + width]

        for bit, (dx, dy) in enumerate(EIGHT):
            if (dx, dy) in self._known:
                may = at(opened, dx, dy)
                if dx and dy and not self.corner_cutting:
                    may = may & at(free, dx, 0) & at(free, 0, dy)
                inner |= may.view(np.uint8) << np.uint8(bit)
        self._bits = frozen(bits.reshape(-1))
        return self._bits

    def is_open(self, number: int) -> bool:
        """Whether the obstacle may stand on a cell, by its number."""
        return self._opened[number] != 0

    def opened(self) -> bytearray:
        """1 where the obstacle may stand, by cell number; a copy."""
        return bytearray(self._opened)

    def cover(self, number: int) -> tuple[int, ...]:
        """Numbers of the cells covered by an obstacle that stands on this one; cells off the map are left out."""
        if self.small:
            return (number,)
        cover = self._cover.get(number)
        if cover is None:
            s = self.space
            x0, y0 = s.cell(number)
            cells = ((x0 + dx, y0 + dy) for dx, dy in self.offsets)
            cover = tuple(s.number(c) for c in cells if 0 <= c[0] < s.width and 0 <= c[1] < s.height)
            self._cover[number] = cover
        return cover

    def steps(self, number: int) -> tuple[Step, ...]:
        """Every step that walls and bars allow from this cell."""
        steps = self._steps.get(number)
        if steps is None:
            stride, opened = self.space.stride, self._opened
            found = []
            for dx, dy in self._known:
                to = number + dy * stride + dx
                if opened[to] and self._clear(number, dx, dy):
                    found.append((to, dx, dy))
            steps = self._steps[number] = tuple(found)
        return steps

    def entries(self, number: int) -> tuple[Entry, ...]:
        """The steps from this cell with what they cover, in the same order."""
        entries = self._entries.get(number)
        if entries is None:
            before = set(self.cover(number))
            covers = [(step, self.cover(step[0])) for step in self.steps(number)]
            entries = self._entries[number] = tuple(
                (step, cover, tuple(c for c in cover if c not in before)) for step, cover in covers
            )
        return entries

    def _clear(self, number: int, dx: int, dy: int) -> bool:
        stride, freed = self.space.stride, self._opened if self._bars_are_walls else self._freed
        if dx * dy in (2, -2):
            return all(freed[number + sy * stride + sx] for sx, sy in passed(dx, dy))
        if dx and dy and not self.corner_cutting:
            return bool(freed[number + dx] and freed[number + dy * stride])
        return True


def bordered(mask: BoolGrid, below: int = 1) -> BoolGrid:
    """A mask with a border of False, one cell wide and ``below`` it so many; bool (height + 1 + below, width + 2)."""
    height, width = mask.shape
    out = np.zeros((height + 1 + below, width + 2), dtype=np.bool_)
    out[1 : height + 1, 1 : width + 1] = mask
    return out


def _bordered(mask: BoolGrid) -> bytes:
    """A mask by cell number. The border is False, and deep enough that a knight's step cannot leave it."""
    # Indexing bytes is five times quicker than indexing an array, and a third of the time went there.
    return bordered(mask, 2).tobytes()


def passed(dx: int, dy: int) -> tuple[Cell, Cell]:
    """The two cells that a knight's step passes between its ends, as offsets from its beginning."""
    if abs(dx) == 2:
        return (dx // 2, 0), (dx // 2, dy)
    return (0, dy // 2), (dx, dy // 2)


KEPT = 8
"""Shapes that are kept from one simulation to the next: many runs on one map are usual."""
SMALL_CELLS = 1 << 15
"""Cells of a map up to which they are kept, and walkers placed by a kernel: tens of bytes a cell."""
COMPILED_CELLS = 1 << 20
"""Cells of a map up to which ticks are compiled: some 20 bytes a cell for each simulation, AD-GSO and SIPP some 60 more."""


@lru_cache(maxsize=KEPT)
def _cells_by_number(width: int, height: int) -> Cells:
    """The (x, y) of every cell number of a map; int32, (n, 2)."""
    y, x = np.divmod(np.arange((height + 2) * (width + 2)), width + 2)
    return np.stack((x - 1, y - 1), axis=1).astype(np.int32)


def shared(scene: Scene) -> bool:
    """Whether simulations of this scene can share shapes: a map that nobody edits, and is not too large to keep."""
    return not scene.edits and scene.grid.blocked.size <= SMALL_CELLS


def robot_shape(scene: Scene, space: CellIndex) -> Shape:
    """The robot's own shape, with the moves that are safe for its size."""
    if shared(scene):
        return _kept_robot_shape(GridKey(scene.grid), scene.robot.radius, scene.moves)
    return _robot_shape(scene.grid, scene.robot.radius, moves_for(scene))


@lru_cache(maxsize=KEPT)
def _kept_robot_shape(key: GridKey, radius: float, moves: Moves) -> Shape:
    return _robot_shape(key.grid, radius, safe_moves(key.grid, radius, moves))


def _robot_shape(grid: Grid, radius: float, moves: Moves) -> Shape:
    space = CellIndex(grid)
    return Shape(
        space,
        free_cells(grid, radius),
        None,
        footprint(radius, grid.resolution),
        moves.offsets,
        moves.corner_cutting,
    )


def obstacle_shape(
    grid: Grid,
    moves: Moves,
    space: CellIndex,
    radius: float,
    kept_clear: BoolGrid | None,
    lane_bars: BoolGrid | None = None,
    like: Shape | None = None,
) -> Shape:
    """The shape of obstacles of that radius: eight neighbours, the scene's corner rule (a disc never cuts a
    corner).

    Parameters
    ----------
    kept_clear : cells that its footprint must never cover.
    lane_bars : cells where its centre must never be; it cuts no corners at them. None: nowhere.
    like : another shape on the map, of which this one uses what is the same for both.
    """
    offsets = footprint(radius, grid.resolution)
    barred = None if kept_clear is None else dilated(kept_clear, offsets)
    cutting = moves.corner_cutting and radius <= 0
    strict = lane_bars is not None
    if lane_bars is not None:
        barred, cutting = lane_bars if barred is None else barred | lane_bars, False
    same = like is not None and like.small and offsets == like.offsets
    free = like.free if like is not None and same else free_cells(grid, radius)
    return Shape(space, free, barred, offsets, EIGHT, cutting, radius, strict, like)
