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
CLASSES_5X5 = 4_211_744
"""Grids of five by five cells that do not turn or mirror into each other."""
_STIR = 2_654_435_761
"""Knuth's multiplier: neighbouring queries go to planners that are not neighbours."""
_SPREAD = 40_503
"""Odd, so that every grid comes once a round; a part of a round has sparse grids and dense ones."""
_PIECE = 1 << 18
"""Grids looked at together."""


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


def pair(number: int, *, classes: bool) -> GridQuery:
    """Ordered pairs of free cells of all 4x4 grids, or of one of each class under the eight symmetries.

    Octile moves in the first round, then the others; the planners turn from pair to pair.
    """
    ends = _ends(classes)
    turn, query = divmod(number, int(ends[-1]))
    k = int(np.searchsorted(ends, query, side="right"))
    bits = int(class_heads(4)[k]) if classes else k
    cells = [c for c in range(16) if bits >> c & 1]
    goal, start = divmod(query - (int(ends[k - 1]) if k else 0), len(cells))
    who = exact()
    planner = who[((query * _STIR >> 9) + turn // 4) % len(who)]
    where = _cell(cells[start], 4), _cell(cells[goal], 4)
    return GridQuery(4, 4, bits, *where, MOVES[turn % 4], planner, start == 0)


def pairs(*, classes: bool) -> int:
    """Queries of one round of :func:`pair`."""
    return int(_ends(classes)[-1])


def free_cells_of() -> NDArray[np.int64]:
    """How many cells of each 4x4 grid are free, (65,536,)."""
    bits = np.arange(GRIDS_4X4, dtype=np.int64)
    return sum((bits >> k & 1 for k in range(16)), np.zeros(GRIDS_4X4, dtype=np.int64))


def field(number: int) -> GridQuery:
    """A grid of each class of 5x5 grids and one of its free cells as the goal: nobody but the field is asked.

    Octile moves in the first round, then the others; the goals turn from grid to grid, and every four rounds.
    """
    turn, k = divmod(number, CLASSES_5X5)
    bits = int(class_heads(5)[k])
    cells = [c for c in range(25) if bits >> c & 1] or [0]
    goal = _cell(cells[((k * _STIR >> 9) + turn // 4) % len(cells)], 5)
    return GridQuery(5, 5, bits, goal, goal, MOVES[turn % 4], "field", first=True)


def fields() -> int:
    """After how many fields every free cell of each grid was the goal with all moves."""
    return CLASSES_5X5 * 25 * len(MOVES)


def classes(side: int) -> int:
    """How many classes there are, by Burnside's lemma: the mean of how many grids a symmetry leaves alone."""
    left = 0
    for places in _symmetries(side):
        seen, cycles = set[int](), 0
        for cell in range(side * side):
            cycles += cell not in seen
            while cell not in seen:
                seen.add(cell)
                cell = int(places[cell])
        left += 1 << cycles
    return left // 8


def _symmetries(side: int) -> list[NDArray[np.int64]]:
    """Where each cell comes from, by the eight ways to turn and mirror a square; the first moves none."""
    board = np.arange(side * side).reshape(side, side)
    return [np.rot90(flipped, quarter).ravel() for flipped in (board, board.T) for quarter in range(4)]


@cache
def class_heads(side: int) -> NDArray[np.int64]:
    """The least of each class of square grids that turn or mirror into each other; 5x5 takes 3 s."""
    cells = side * side
    heads = []
    for first in range(0, 1 << cells, _PIECE):
        least = np.arange(first, min(first + _PIECE, 1 << cells), dtype=np.int64)
        for places in _symmetries(side)[1:]:
            copy = sum(((least >> was & 1) << now for now, was in enumerate(places)), np.zeros_like(least))
            least = least[least <= copy]
        heads.append(least)
    return np.concatenate(heads)


@cache
def _ends(classes: bool) -> NDArray[np.int64]:
    free = free_cells_of()
    chosen = free[class_heads(4)] if classes else free
    ends: NDArray[np.int64] = np.cumsum(chosen * chosen)
    return ends


def _cell(k: int, width: int) -> Cell:
    return k % width, k // width


def parted_pairs() -> int:
    """Ordered pairs of free cells of all 4x4 grids with no way between them by steps to the four sides.

    By flood fill on all grids at once, one bit a cell; octile and knight's steps lead no further than such
    steps do, as their sides must be free.
    """
    bits = np.arange(GRIDS_4X4, dtype=np.int64)
    west, east = (sum(1 << (4 * y + x) for y in range(4) for x in range(4) if x != out) for out in (0, 3))
    parted = 0
    for k in range(16):
        here = bits & (1 << k)
        while True:
            wave = here | here << 4 | here >> 4 | (here & east) << 1 | (here & west) >> 1
            wave &= bits
            if np.array_equal(wave, here):
                break
            here = wave
        left = bits & ~here
        count = sum((left >> c & 1 for c in range(16)), np.zeros(GRIDS_4X4, dtype=np.int64))
        parted += int(count[(bits >> k & 1) == 1].sum())
    return parted
