"""Which question a number is, for the exhaustive kinds of :mod:`lampyris_selfcheck.checks.paths.grids`.

A kind lists its queries (grid, start, goal) once a round. Which planner with which moves is asked turns with
the query and the round: the first round asks every query of somebody, 40 rounds (ten planners, four step
sets) ask each of everybody.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from lampyris_selfcheck.checks.paths.answers import exact
from lampyris_selfcheck.reference.paths.search import Cell

MOVES = ("octile", "dissertation", "four-connected", "sixteen-connected")
LONGEST = 8
"""Cells of the longest corridor."""
GRIDS_4X4 = 1 << 16
_STIR = 2_654_435_761
"""Knuth's multiplier: neighbouring queries go to planners that are not neighbours."""
_SPREAD = 40_503
"""Odd, so that every grid comes once a round; a part of a round has sparse grids and dense ones."""


@dataclass(frozen=True)
class GridQuery:
    """One question: which cells are free (bit y * width + x), the ends, the moves and who is asked.

    ``first``: it is the one question of its goal at which the whole field is judged too.
    """

    width: int
    height: int
    bits: int
    start: Cell
    goal: Cell
    moves: str
    planner: str
    first: bool = False


def rounds() -> int:
    """After how many rounds every query was put to every exact planner with all moves."""
    return len(exact()) * len(MOVES)


def _who(query: int, turn: int) -> tuple[str, str]:
    """Moves and planner; all moves within four turns."""
    k = ((query * _STIR >> 9) + turn) % rounds()
    return MOVES[k % 4], exact()[k // 4]


def rectangle(width: int, height: int, number: int) -> GridQuery:
    """Every grid of that size, every start and goal, free or blocked."""
    n = width * height
    turn, query = divmod(number, (1 << n) * n * n)
    index, ends = divmod(query, n * n)
    bits = index * _SPREAD % (1 << n)
    goal, start = divmod(ends, n)
    return GridQuery(
        width, height, bits, _cell(start, width), _cell(goal, width), *_who(query, turn), start == 0
    )


def rectangles(width: int, height: int) -> int:
    """Queries of one round of :func:`rectangle`."""
    n = width * height
    return (1 << n) * n * n


def corridor(number: int) -> GridQuery:
    """Corridors of one to eight cells, lying or standing; standing and lying change places each round."""
    turn, query = divmod(number, corridors())
    n, left = 1, query
    while left >= (size := (1 << n) * n * n):
        left -= size
        n += 1
    bits, ends = divmod(left, n * n)
    goal, start = divmod(ends, n)
    moves, planner = _who(query, turn // 2)
    if (query + turn) % 2:
        return GridQuery(1, n, bits, (0, start), (0, goal), moves, planner, start == 0)
    return GridQuery(n, 1, bits, (start, 0), (goal, 0), moves, planner, start == 0)


def corridors() -> int:
    """Queries of one round of :func:`corridor`."""
    return sum((1 << n) * n * n for n in range(1, LONGEST + 1))


def pair(number: int) -> GridQuery:
    """Ordered pairs of free cells of all 4x4 grids.

    Octile moves in the first round, then the others; the planners turn from pair to pair.
    """
    ends = _ends()
    turn, query = divmod(number, int(ends[-1]))
    bits = int(np.searchsorted(ends, query, side="right"))
    cells = [c for c in range(16) if bits >> c & 1]
    goal, start = divmod(query - (int(ends[bits - 1]) if bits else 0), len(cells))
    who = exact()
    planner = who[((query * _STIR >> 9) + turn // 4) % len(who)]
    where = _cell(cells[start], 4), _cell(cells[goal], 4)
    return GridQuery(4, 4, bits, *where, MOVES[turn % 4], planner, start == 0)


def pairs() -> int:
    """Queries of one round of :func:`pair`."""
    return int(_ends()[-1])


@cache
def _ends() -> NDArray[np.int64]:
    """How many pairs there are on the 4x4 grids up to each."""
    bits = np.arange(GRIDS_4X4, dtype=np.int64)
    free = sum((bits >> k & 1 for k in range(16)), np.zeros(GRIDS_4X4, dtype=np.int64))
    ends: NDArray[np.int64] = np.cumsum(free * free)
    return ends


def _cell(k: int, width: int) -> Cell:
    return k % width, k // width
