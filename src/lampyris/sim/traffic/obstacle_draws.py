"""Draws that belong to one obstacle: numbers by obstacle and count, not by their turn in one stream.

What an obstacle draws depends on the seed, on its kind and on its own number, and on nothing that others do.
So another obstacle, or a cell of the map that turns into a wall, changes the draws of nobody; it moves only
those whose place or path it takes. The numbers are those of SplitMix64 (Steele, Lea, Flood 2014), each
obstacle with a sequence of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels.simulation import draws
from lampyris.kernels.simulation.draws import APPEAR, PLACE, STEPS, TRIES
from lampyris.typing import Floats

WALKERS, CROSSING, PATROLS = 1, 2, 3
"""Kinds of obstacles, in the keys of their streams."""
Ints = NDArray[np.int64]
Words = NDArray[np.uint64]

_STREAM = 0x51AB1E
_LOW = 0x7FFFFFFF
KEPT_KEYS = 1024
"""Keys that are kept: several planners meet the obstacles of one seed."""


def seeded(seed: int, *which: int) -> np.random.SeedSequence:
    """The sequence of a seed and of numbers below 2^32 that tell apart what it is for; ``SeedSequence((seed, *which))``."""
    # NumPy takes three times as long over a tuple as over the 32 bits of each that it makes of it.
    words = (seed, *which)
    return np.random.SeedSequence(np.array(words, dtype=np.uint32) if seed < 1 << 32 else words)


@lru_cache(maxsize=KEPT_KEYS)
def key_of(seed: int, kind: int, number: int) -> int:
    """The key of the ``number``-th specification of a kind; 64 bits."""
    words = seeded(seed, _STREAM, kind, number + 1).generate_state(1, np.uint64)
    return int(words[0])


def mixed(z: Words) -> Words:
    """SplitMix64's mixing of arrays of words, as :func:`lampyris.kernels.simulation.draws.mixed` does it of one; uint64."""
    z = (z ^ (z >> np.uint64(30))) * np.uint64(draws.FIRST_FACTOR)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(draws.SECOND_FACTOR)
    return z ^ (z >> np.uint64(31))


def uniforms(key: int, what: int, own: Ints, count: Ints) -> Floats:
    """Numbers in [0, 1) by obstacle and count; the shape is that of ``own`` and ``count`` broadcast.

    Parameters
    ----------
    key : see :func:`key_of`.
    what : one of the words of :mod:`lampyris.kernels.simulation.draws`.
    own, count : int64: numbers of obstacles within the specification, and of draws; 0 or more.
    """
    golden = np.uint64(draws.GOLDEN)
    base = np.array([key], dtype=np.uint64)
    begin = mixed(base + (4 * np.atleast_1d(own) + what).astype(np.uint64) * golden)
    words = mixed(begin + (np.atleast_1d(count) + 1).astype(np.uint64) * golden)
    return (words >> np.uint64(11)).astype(np.float64) * draws.UNIT


def steps(key: int, count: int, first: int, ticks: int) -> Floats:
    """What walkers draw in some ticks: a number for each of ``count``, and two for appearing.

    Parameters
    ----------
    first, ticks : the first tick, and how many.

    Returns
    -------
    float64, (ticks, count + 2).
    """
    out = np.empty((ticks, count + 2))
    tick = np.arange(first, first + ticks, dtype=np.int64)[:, None]
    out[:, :count] = uniforms(key, STEPS, np.arange(count, dtype=np.int64)[None, :], tick)
    out[:, count:] = uniforms(key, APPEAR, np.arange(2, dtype=np.int64)[None, :], tick)
    return out


def steps_of_all(keys: Words, counts: Ints, first: int, ticks: int) -> Floats:
    """What the walkers of some specifications draw in some ticks; float64, flat: tick by tick, in each as :func:`steps`."""
    out = np.empty(ticks * int(counts.sum() + 2 * len(counts)))
    draws.draw_steps(keys, counts, first, ticks, out)
    return out


def ranks(cells: Ints, draw: float) -> Ints:
    """A random order of cells that a draw decides: the least is a cell drawn uniformly from them.

    A cell's rank does not depend on the other cells, so that taking one away moves nobody who was not on it.
    The kernel :func:`lampyris.kernels.simulation.obstacle_rules.rank` has the same numbers.
    """
    x = (cells * 0x9E3779B1 + int(draw * 2147483648.0)) & _LOW
    x = ((x ^ (x >> 16)) * 0x45D9F3B) & _LOW
    x = ((x ^ (x >> 15)) * 0x45D9F3B) & _LOW
    return x ^ (x >> 16)


def first_of(cells: Ints, draw: float) -> int:
    """The cell of least rank."""
    return int(cells[int(np.argmin(ranks(cells, draw)))])


def places_of_one_cell(
    key: int, first: int, count: int, size: tuple[int, int], opened: NDArray[np.uint8]
) -> list[int]:
    """The same as :func:`places` for walkers of one cell; fewer than asked for where no cell is left.

    Parameters
    ----------
    opened : by cell number, 1 where one may be put; those that are put close theirs.
    """
    found = np.zeros(count, dtype=np.int64)
    placed = draws.place(np.array([key], dtype=np.uint64), first, *size, opened, found) if count else 0
    cells: list[int] = found[:placed].tolist()
    return cells


def places(
    key: int,
    first: int,
    count: int,
    size: tuple[int, int],
    fits: Callable[[int], bool],
    left: Callable[[], Ints],
) -> Iterator[int]:
    """A cell for each of some walkers, drawn uniformly among those that fit when it is its turn.

    Parameters
    ----------
    first, count : the number of the first, and how many.
    size : width and height of the map. Cells are numbers of :class:`lampyris.sim.world.cell_index.CellIndex`.
    fits : whether a cell will do now; what is handed out counts as taken.
    left : all cells that will do now, for when chance does not find one.
    """
    width, height = size
    own = np.arange(first, first + count, dtype=np.int64)[:, None]
    some = 8

    def drawn(who: Ints, begin: int, end: int) -> Ints:
        u = uniforms(key, PLACE, who, np.arange(begin, end, dtype=np.int64)[None, :])
        y, x = np.divmod((u * (width * height)).astype(np.int64), width)
        return (y + 1) * (width + 2) + x + 1

    for k, row in enumerate(drawn(own, 0, some).tolist() if count else []):
        found = next(filter(fits, row), None)
        if found is None:
            found = next(filter(fits, drawn(own[k : k + 1], some, TRIES)[0].tolist()), None)
        if found is None:
            cells = left()
            if not len(cells):
                return
            found = first_of(cells, float(uniforms(key, PLACE, own[k], np.array([TRIES]))[0]))
        yield found
