"""Queries of a study that are drawn from its seed, with headings or without."""

from __future__ import annotations

import hashlib
from itertools import islice
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lampyris._core import elementary
from lampyris._core.arrays import index_array
from lampyris._core.cancellation import uninterrupted
from lampyris.errors import FileError
from lampyris.io.text.strict_yaml import shown
from lampyris.model.path import Pose
from lampyris.planning.lattice.standing import COMPASS, Standing
from lampyris.study.design import schema as form
from lampyris.study.design.study import StudyMap, canonical
from lampyris.typing import BoolGrid, Cell

_BATCH = 4096
_BATCHES = 500


class QueryEnd(NamedTuple):
    """An end of a query: a cell, the pose in it where one is given, and the cells of a goal that moves."""

    cell: Cell
    pose: Pose | None = None
    track: tuple[Cell, ...] | None = None


def draw_queries(
    ground: StudyMap, free: BoolGrid, asked: form.RandomTable, root: int, standing: Standing | None = None
) -> list[tuple[QueryEnd, QueryEnd]]:
    """Different pairs of free cells with a path between them, by straight steps alone and so by any moves.

    Evenly over all such pairs that are far enough from each other. More of them begin with the same ones.

    Parameters
    ----------
    ground : the map.
    free : cells where the robot's centre may be.
    asked : how many, and how far apart.
    root : seed of the study.
    standing : where the footprint stands free: then each end is at the centre of its cell with one of eight headings at
        which it does, evenly over all such pairs of poses. That the robot gets from one to the other is for planners to
        find out. None: no headings.

    Raises
    ------
    FileError : ``QUERIES``: there are not so many.
    """
    with uninterrupted():
        from scipy.ndimage import label  # bits: whole numbers in, whole numbers out

    region, _ = label(free)
    cells = np.flatnonzero(region)
    cells = cells[np.argsort(region.ravel()[cells], kind="stable")]  # each region in one piece
    # A start is drawn with the share of goals that its region has, so that every pair is as likely.
    sizes = np.bincount(index_array(region.ravel()))[1:]
    turns = 1 if standing is None else COMPASS
    if asked.random > (most := turns * turns * _most_pairs(region, sizes, asked.least)):
        raise _too_few(ground, most, asked.random)
    begins = np.cumsum(sizes) - sizes
    shares = np.cumsum(np.square(sizes.astype(np.float64)))
    what = "queries" if standing is None else "queries with headings"
    seed = hashlib.sha256(canonical([root, what, ground.hash])).digest()
    rng = np.random.Generator(np.random.PCG64(int.from_bytes(seed[:16], "big")))
    # Pairs as one number each: most draws on a small map are of pairs that are there already.
    found: dict[int, None] = {}
    ends_of = _Ends(ground, standing)
    width, all_ = ground.grid.width, ground.grid.width * ground.grid.height
    for _ in range(_BATCHES if cells.size else 0):
        drawn = rng.random((_BATCH, 3 if standing is None else 5))
        which = np.searchsorted(shares, drawn[:, 0] * shares[-1], side="right").clip(max=len(sizes) - 1)
        ends = cells[begins[which, None] + np.floor(drawn[:, 1:3] * sizes[which, None]).astype(np.int64)]
        y, x = np.divmod(ends, width)
        apart = elementary.hypot(x[:, 0] - x[:, 1], y[:, 0] - y[:, 1])
        good = (apart >= asked.least) & (apart > 0)
        states = ends[good]
        if standing is not None:
            states = states * COMPASS + np.floor(drawn[good, 3:] * COMPASS).astype(np.int64)
        pairs = (states[:, 0] * (all_ * turns) + states[:, 1]).tolist()
        found.update(dict.fromkeys(pair for pair in pairs if pair in found or ends_of.stand(pair)))
        if len(found) >= asked.random:
            return [ends_of.pair(pair) for pair in islice(found, asked.random)]
    raise _too_few(ground, len(found), asked.random)


class _Ends:
    """Pairs of ends as one number each: what they are, and whether the footprint stands free at both."""

    def __init__(self, ground: StudyMap, standing: Standing | None) -> None:
        self._standing, self._width = standing, ground.grid.width
        self._turns = 1 if standing is None else COMPASS
        self._states = self._turns * ground.grid.width * ground.grid.height

    def stand(self, pair: int) -> bool:
        """Whether the robot stands free at both ends; true where there are no headings."""
        standing = self._standing
        return standing is None or all(
            standing.in_cell(*self._state(one)) for one in divmod(pair, self._states)
        )

    def pair(self, pair: int) -> tuple[QueryEnd, QueryEnd]:
        """Start and goal."""
        start, goal = divmod(pair, self._states)
        return self._end(start), self._end(goal)

    def _state(self, state: int) -> tuple[Cell, int]:
        number, heading = divmod(state, self._turns)
        return (number % self._width, number // self._width), heading

    def _end(self, state: int) -> QueryEnd:
        cell, heading = self._state(state)
        return QueryEnd(cell, None if self._standing is None else self._standing.pose_in_cell(cell, heading))


def _most_pairs(region: NDArray[np.integer[Any]], sizes: NDArray[np.integer[Any]], least: float) -> int:
    """No more pairs than so many can be drawn: those of cells of one region, if it reaches far enough."""
    with uninterrupted():
        from scipy.ndimage import find_objects  # bits: whole numbers in, whole numbers out

    most = 0
    for (rows, columns), size in zip(find_objects(region), sizes.tolist(), strict=True):
        reach = elementary.hypot(columns.stop - columns.start - 1, rows.stop - rows.start - 1)
        most += size * (size - 1) if reach >= least else 0
    return most


def _too_few(ground: StudyMap, there: int, asked: int) -> FileError:
    return FileError(
        "QUERIES",
        f"{there:,} of {asked:,} queries found on {shown(ground.name)}",
        allowed="as many as the map has, not too far apart",
    )
