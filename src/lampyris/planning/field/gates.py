"""Gates: openings too narrow for the robot (the dissertation's raise states; method.md, "Gates")."""

from __future__ import annotations

import math
import weakref
from collections import deque
from collections.abc import Iterable
from dataclasses import fields
from itertools import repeat
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris._core.arrays import distinct
from lampyris._core.cancellation import checkpoint
from lampyris.kernels.field import gates as kernels
from lampyris.model.field import Gate
from lampyris.model.grid import Grid, frozen
from lampyris.model.robot import Robot
from lampyris.planning.field.layers import FORGIVEN
from lampyris.typing import BoolGrid, Cells

_POINT = Robot()
_AXES = ("", "x", "y", "xy")
_last: tuple[weakref.ref[BoolGrid], float, tuple[Gate, ...], NDArray[np.int64]] | None = None
"""Gates of the last map that was asked for, and of what: its cells, which are no other map's, and radius; and the numbers of
their cells, y * width + x, rising."""


def gate_mask(grid: Grid, robot: Robot = _POINT) -> BoolGrid:
    """Which cells are gates; bool, (height, width), read-only. See :func:`find_gates` for what a gate is."""
    mask = np.zeros(grid.blocked.shape, dtype=np.bool_)
    most = _most(grid, robot)
    if most == 1:
        return frozen(_single(grid.blocked) > 0)
    for lines, plane in ((grid.blocked, mask), (grid.blocked.T, mask.T)):
        for cells, _ in _narrow(lines, most):
            plane[cells] = True
    return frozen(mask)


def find_gates(grid: Grid, robot: Robot = _POINT) -> tuple[Gate, ...]:
    """Every gate of a map, sorted by row, then column.

    Without a radius, a gate is a free cell whose left and right, or whose upper and lower, neighbours are
    both blocked cells of the map. With a radius, it is a free cell of a run of free cells, along a row or a
    column between two blocked ones, that is narrower than the robot; then it takes the whole run to close
    the opening. Outside the map is not blocked here. Gates are found on the map as it is: closing one never
    makes another.

    Under ``min_clearance``, ad-gso looks for gates among the cells that are left for the robot's centre once
    walls, its radius and the margin are taken off: for a robot without a radius these are openings one cell
    wide there; for a robot with one there are none, as it has room in each of these cells.

    ``dead_end`` says that on one side of its passage there is no live cell to step to, where live means
    free and not itself a gate that is a dead end; of a gate on both axes, that this is so for both
    passages. Without a radius the step may cut corners (the dissertation's moves); with one it may not.

    Those of the last map are kept: every plan tells of them, and while an end is dragged over a map of
    512 x 512 with 4,600 gates, finding them again was half of the time of a plan.
    """
    return _known(grid, robot)[0]


def gates_along(grid: Grid, cells: Cells, robot: Robot = _POINT) -> tuple[Gate, ...]:
    """Those of :func:`find_gates` that some of these cells, (n, 2), lie on, each once, sorted by row, then column."""
    gates, there = _known(grid, robot)
    if not gates:
        return ()
    numbers = distinct(cells[:, 1].astype(np.int64) * grid.width + cells[:, 0])
    at = np.searchsorted(there, numbers)
    on = there[np.minimum(at, len(there) - 1)] == numbers
    return tuple(map(gates.__getitem__, at[on].tolist()))


def _known(grid: Grid, robot: Robot) -> tuple[tuple[Gate, ...], NDArray[np.int64]]:
    """Gates of a map, and the numbers of their cells."""
    global _last
    known = _last
    if known and known[0]() is grid.blocked and known[1] == robot.radius:
        return known[2:]
    gates, numbers = _found(grid, robot)
    _last = (weakref.ref(grid.blocked), robot.radius, gates, numbers)
    return gates, numbers


def _found(grid: Grid, robot: Robot) -> tuple[tuple[Gate, ...], NDArray[np.int64]]:
    """Every gate of a map, and the numbers of their cells."""
    most = _most(grid, robot)
    if most == 1:
        checkpoint()
        kind = _single(grid.blocked)
        there = np.flatnonzero(kind > 0)  # truth values are searched faster than numbers
        ys, xs = np.divmod(there, kind.shape[1])
        return _listed(grid, robot, kind, ys, xs, [grid.resolution] * len(there))
    kind = np.zeros(grid.blocked.shape, dtype=np.uint8)
    least = np.full(grid.blocked.shape, most + 1, dtype=np.uint16 if most < 2**16 - 1 else np.int64)
    for bit, lines in ((1, grid.blocked), (2, grid.blocked.T)):
        checkpoint()
        one, narrowest = (kind, least) if bit == 1 else (kind.T, least.T)
        for cells, lengths in _narrow(lines, most):
            one[cells] |= bit
            narrowest[cells] = np.minimum(narrowest[cells], lengths)
    checkpoint()
    ys, xs = np.nonzero(kind)
    return _listed(grid, robot, kind, ys, xs, (least[ys, xs] * grid.resolution).tolist())


def _single(blocked: BoolGrid) -> NDArray[np.uint8]:
    """Openings one cell wide: 1 with walls left and right, 2 with walls above and below, 3 with both, 0 elsewhere.

    The common case, and asked for at every plan: whole-map comparisons instead of lists of runs.
    """
    kind = np.zeros(blocked.shape, dtype=np.uint8)
    np.logical_and(blocked[:, :-2], blocked[:, 2:], out=kind.view(np.bool_)[:, 1:-1])
    upright = (blocked[:-2] & blocked[2:]).view(np.uint8)
    kind[1:-1] |= upright << 1
    kind *= (~blocked).view(np.uint8)
    return kind


def _listed(
    grid: Grid,
    robot: Robot,
    kind: NDArray[np.uint8],
    ys: NDArray[np.intp],
    xs: NDArray[np.intp],
    widths: list[float],
) -> tuple[tuple[Gate, ...], NDArray[np.int64]]:
    """Gates of these kinds, rows, columns and widths, and the numbers of their cells."""
    numbers = ys.astype(np.int64) * kind.shape[1] + xs
    if ys.size == 0:
        return (), numbers
    dead = _dead(grid.blocked, kind, ys, xs, robot.radius > 0)
    axes = map(_AXES.__getitem__, kind[ys, xs].tolist())
    checkpoint()
    return _gates(zip(xs.tolist(), ys.tolist(), strict=True), axes, widths, dead.tolist()), numbers


def _gates(*columns: Iterable[Any]) -> tuple[Gate, ...]:
    """Gates from the columns of their table: slot by slot, which takes a fifth of the time of ``Gate(...)``.

    Cluttered maps of millions of cells have gates by the hundred thousand.
    """
    cells = list(columns[0])
    gates = tuple(map(object.__new__, repeat(Gate, len(cells))))
    for slot, column in zip(fields(Gate), (cells, *columns[1:]), strict=True):
        deque(map(getattr(Gate, slot.name).__set__, gates, column), maxlen=0)
    return gates


def _most(grid: Grid, robot: Robot) -> int:
    """The widest run, in cells, that is too narrow for the robot."""
    if robot.radius <= 0:
        return 1
    return math.ceil(2.0 * robot.radius / grid.resolution * (1.0 - FORGIVEN)) - 1


Found = tuple[tuple[NDArray[np.intp], NDArray[np.intp]], NDArray[np.intp]]
"""Rows and columns of cells, and the lengths of the runs that they lie in."""


def _narrow(lines: BoolGrid, most: int) -> list[Found]:
    """Cells of each run of 1 to ``most`` free cells between two blocked ones of the same row."""
    if most < 1:
        return []
    width = lines.shape[1]
    walls = np.flatnonzero(lines)
    gap = np.diff(walls)
    # Few gaps are narrow: everything after this line is small.
    near = np.flatnonzero((gap > 1) & (gap <= most + 1))
    before, length = walls[near], gap[near] - 1
    same = before // width == (before + length + 1) // width
    before, length = before[same], length[same]
    out = []
    for k in range(1, int(length.max(initial=0)) + 1):
        before, length = before[length >= k], length[length >= k]
        out.append((np.divmod(before + k, width), length))
    return out


def _dead(
    blocked: BoolGrid, kind: NDArray[np.uint8], ys: NDArray[np.intp], xs: NDArray[np.intp], strict: bool
) -> NDArray[np.bool_]:
    """For each gate, whether it is a dead end."""
    state = np.pad(~blocked, 1).view(np.uint8)
    width = state.shape[1]
    axis = np.pad(kind, 1).ravel()
    cells = ((ys + 1) * width + xs + 1).astype(np.uint32)
    queue = np.append(cells, np.uint32(0))
    flat = state.ravel()
    kernels.dead_ends(flat, axis, queue, cells.size, width, int(strict))
    dead: BoolGrid = flat[cells] == 2
    return dead
