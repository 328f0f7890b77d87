"""What stands around a node: obstacles counted in the two rings of the dissertation's speed law."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from itertools import chain
from typing import Any, Final, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lampyris._core.predicates import array_of, fits
from lampyris._core.scalars import is_word
from lampyris.errors import SettingError, shown
from lampyris.typing import BoolGrid, Cell

Reading: TypeAlias = Literal["all", "ahead"]
RING1: Final = "all"
RING2: Final = "ahead"
"""Which cells of ring 1 and of ring 2 count where nothing else is said."""
"""Which cells of a ring count: all, or those within 45 degrees (included) of the incoming heading."""

_TAKEN, _OUTSIDE = 1, 2
"""Bits of what a cell holds; a free cell is 0."""

_SQUARE = [(dx, dy) for dy in range(-2, 3) for dx in range(-2, 3)]
_OFFSETS = [o for k in (1, 2) for o in _SQUARE if max(map(abs, o)) == k]
"""The eight cells of ring 1, then the sixteen of ring 2."""
_DX, _DY = np.array(_OFFSETS, dtype=np.int64).T.copy()


def _squared(offset: Cell) -> int:
    return offset[0] * offset[0] + offset[1] * offset[1]


def _ahead(heading: Cell, offset: Cell) -> bool:
    """Whether a cell lies within 45 degrees of a heading: ``cos >= sqrt(1/2)``, squared, in whole numbers."""
    dot = heading[0] * offset[0] + heading[1] * offset[1]
    squares = _squared(heading) * _squared(offset)
    return dot > 0 and 2 * dot * dot >= squares


_AHEAD = np.array([[_ahead(heading, offset) for heading in _SQUARE] for offset in _OFFSETS])
"""bool (24, 25): by offset and heading."""


def ring_counts(
    path_cells: ArrayLike,
    blocked: BoolGrid,
    obstacles: Iterable[Cell] | NDArray[Any] = (),
    *,
    previous: Cell | None = None,
    ring1: Reading = RING1,
    ring2: Reading = RING2,
    outside1: bool = True,
    outside2: bool = False,
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Count what stands in ring 1 and in ring 2 around each node of a path.

    A cell counts once if it is blocked or holds a moving obstacle and, by ``outside1`` and ``outside2``, if
    it is out of the map. Ring k is the cells at Chebyshev distance k: 8 and 16 of them.

    ``ahead`` is within 45 degrees of the incoming heading, 45 included. In ring 2, with the heading turned
    to (1, 0) or (1, 1): a straight heading has the five cells (2, -2) (2, -1) (2, 0) (2, 1) (2, 2), a
    diagonal one the five (2, 0) (2, 1) (2, 2) (1, 2) (0, 2), a knight's step (2, 1) the four (2, 0) (2, 1)
    (2, 2) (1, 2). 45 must be included: Table 4.14 counts 4 and 5 obstacles ahead of straight steps, at (34,
    22) and (39, 25), and without the corners there are only three cells.

    Parameters
    ----------
    path_cells : (n, 2), x and y; steps of at most two cells in each axis. They need not lie in the map.
    blocked : bool (height, width).
    obstacles : cells that moving obstacles cover; those outside the map are ignored.
    previous : the cell the robot came from, for the heading into the first node. None (or the first cell
        itself): that node takes the heading of the step that leaves it; the only node of a path has nothing
        ahead.
    ring1, ring2 : ``all`` or ``ahead``. The defaults are the reading that contradicts the tables least
        (method.md, "The dissertation's speed law").
    outside1, outside2 : whether cells out of the map count in that ring.

    Returns
    -------
    (n1, n2), int64 (n,) each.

    Raises
    ------
    SettingError : ``PATH_CELLS``, ``PATH_STEP``, ``READING``.
    """
    for name, reading in (("ring1", ring1), ("ring2", ring2)):
        if not is_word(reading, ("all", "ahead")):
            raise SettingError("READING", shown(reading), where=name, allowed="all or ahead")
    cells = cells_of(path_cells)
    return count(cells, headings(cells, previous), blocked, obstacles, ring1, ring2, outside1, outside2)


def count(
    cells: NDArray[np.int64],
    heading: NDArray[np.int64],
    blocked: BoolGrid,
    obstacles: Iterable[Cell] | NDArray[Any],
    ring1: Reading,
    ring2: Reading,
    outside1: bool,
    outside2: bool,
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """What :func:`ring_counts` counts, from cells (n, 2) and :func:`headings` (n,) that are known already."""
    window, x0, y0 = _window(cells, blocked, as_cells(obstacles))
    width = window.shape[1]
    at = cells[:, 1] * width + cells[:, 0] - (y0 * width + x0)
    # Offsets come first, nodes second: sums then run over whole rows, several times quicker than along
    # short ones.
    seen = window.take((_DY * width + _DX)[:, None] + at)
    counted = seen & _counted(ring1, ring2, outside1, outside2).take(heading, axis=1) != 0
    return counted[:8].sum(axis=0), counted[8:].sum(axis=0)


@cache
def _counted(ring1: Reading, ring2: Reading, outside1: bool, outside2: bool) -> NDArray[np.uint8]:
    """What counts by offset and heading, (24, 25): the bits of _TAKEN and _OUTSIDE, 0 where nothing does."""
    out = np.zeros(_AHEAD.shape, dtype=np.uint8)
    for ring, reading, outside in ((slice(0, 8), ring1, outside1), (slice(8, 24), ring2, outside2)):
        looked_at = _AHEAD[ring] | (reading == "all")
        out[ring] = looked_at * (_TAKEN | _OUTSIDE * outside)
    return out


def counted_around(ring1: Reading, ring2: Reading, outside1: bool, outside2: bool) -> NDArray[np.uint8]:
    """What counts, by place in the 5 x 5 square around a node (row by row) and heading; uint8 (25 * 25,).

    1: a taken cell counts, 2: a place off the map does. For a kernel.
    """
    square = np.zeros((25, 25), dtype=np.uint8)
    square[(_DY + 2) * 5 + _DX + 2] = _counted(ring1, ring2, outside1, outside2)
    return square.ravel()


def cells_of(path_cells: ArrayLike) -> NDArray[np.int64]:
    """A path's cells as int64 (n, 2).

    Raises
    ------
    SettingError : ``PATH_CELLS``: empty, not pairs, or not whole numbers.
    """
    given = array_of(path_cells)
    if given is None or not fits(given, (None, 2)) or len(given) == 0 or given.dtype.kind not in "iu":
        what = shown(path_cells) if given is None else f"shape {given.shape} of {given.dtype}"
        allowed = "whole numbers, shape (n, 2), n >= 1"
        raise SettingError("PATH_CELLS", what, where="cells", allowed=allowed)
    return given.astype(np.int64)


def headings(cells: NDArray[np.int64], previous: Cell | None) -> NDArray[np.int64]:
    """The step (dx, dy) into each node as one number, (dy + 2) * 5 + dx + 2; int64 (n,).

    The step into the first node comes from ``previous``; without one, it is the step that leaves the node,
    and 12 (none) if there is no such step either.

    Raises
    ------
    SettingError : ``PATH_STEP``: a step of nothing, or of more than two cells in an axis.
    """
    if previous is not None and (previous[0] != cells[0, 0] or previous[1] != cells[0, 1]):
        before = np.array([previous], dtype=np.int64)
    elif len(cells) > 1:
        before = 2 * cells[:1] - cells[1:2]
    else:
        return np.array([12])
    step = cells - np.concatenate((before, cells[:-1]))
    dx, dy = step[:, 0], step[:, 1]
    size = np.maximum(np.abs(dx), np.abs(dy))
    if size.min() == 0 or size.max() > 2:
        k = int(np.flatnonzero((size == 0) | (size > 2))[0])
        raise step_error(k, int(dx[k]), int(dy[k]), "one or two cells in an axis, and no standing still")
    return np.asarray(dy * 5 + dx + 12)


def step_error(node: int, dx: int, dy: int, allowed: str) -> SettingError:
    """A path that jumps."""
    return SettingError(
        "PATH_STEP", f"a step of ({dx}, {dy}) into node {node}", where="cells", allowed=allowed
    )


def as_cells(obstacles: Iterable[Cell] | NDArray[Any]) -> NDArray[np.int64]:
    """Cells as int64 (m, 2), from any iterable of pairs or an array."""
    if isinstance(obstacles, np.ndarray):
        return obstacles.astype(np.int64).reshape(-1, 2)
    return np.fromiter(chain.from_iterable(obstacles), dtype=np.int64).reshape(-1, 2)


def _window(
    cells: NDArray[np.int64], blocked: BoolGrid, obstacles: NDArray[np.int64]
) -> tuple[NDArray[np.uint8], int, int]:
    """What each cell within two of the path holds, and the cell (x0, y0) of its corner.

    A piece of the map is copied, not all of it: this runs at every tick, and a map may have millions of
    cells.
    """
    x, y = cells[:, 0], cells[:, 1]
    x0, y0, x1, y1 = int(x.min()) - 2, int(y.min()) - 2, int(x.max()) + 3, int(y.max()) + 3
    window = np.full((y1 - y0, x1 - x0), _OUTSIDE, dtype=np.uint8)
    height, width = blocked.shape
    left, top, right, bottom = max(x0, 0), max(y0, 0), min(x1, width), min(y1, height)
    if left < right and top < bottom:
        window[top - y0 : bottom - y0, left - x0 : right - x0] = blocked[top:bottom, left:right]
        x, y = obstacles[:, 0], obstacles[:, 1]
        near = (x >= left) & (x < right) & (y >= top) & (y < bottom)
        window[y[near] - y0, x[near] - x0] = _TAKEN
    return window, x0, y0
