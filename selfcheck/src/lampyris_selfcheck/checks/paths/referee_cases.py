"""Lawful walks, and twelve ways of spoiling one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES, Moves
from lampyris.model.path import Path
from lampyris.typing import Cell
from lampyris_selfcheck.reference.paths.search import needs, steps

LEAST = 4
"""Cells of the shortest walk that is spoilt."""


@dataclass(frozen=True)
class WalkClaim:
    """A walk, what it was asked for, and what it claims.

    Parameters
    ----------
    blocked : of the map.
    moves : name of the step set.
    start, goal : the query.
    cells : the walk.
    claimed : straights, diagonals and knight's steps, as claimed; None: the true ones.
    cheaper : how much less than its steps cost it claims to cost.
    """

    blocked: np.ndarray
    moves: str
    start: Cell
    goal: Cell
    cells: tuple[Cell, ...]
    claimed: tuple[int, ...] | None = None
    cheaper: int = 0

    @property
    def grid(self) -> Grid:
        """The map."""
        return Grid(self.blocked)

    @property
    def path(self) -> Path:
        """The walk as a planner would hand it back."""
        moves = MOVES[self.moves]
        counts = counted(self.cells, moves) if self.claimed is None else self.claimed
        exact = moves.exact(counts) - self.cheaper if self.cheaper else None
        return Path(
            np.array(self.cells, dtype=np.int64).astype(np.int32).reshape(-1, 2), moves, counts, exact
        )


def counted(cells: tuple[Cell, ...], moves: Moves) -> tuple[int, ...]:
    """Straights, diagonals and knight's steps of a walk; what is none of them is counted by its size."""
    found = [0, 0, 0]
    for (x, y), (u, v) in pairwise(cells):
        found[min(abs((u - x) * (v - y)), 2)] += 1
    return tuple(found) if moves.knight else (found[0], found[1] + found[2])


def lawful(rng: np.random.Generator, moves: str) -> WalkClaim:
    """A random walk of at least :data:`LEAST` cells, on a map of 5 to 12 cells a side."""
    rules = [(dx, dy, needs(dx, dy, moves)) for dx, dy in steps(moves)]
    while True:
        height, width = (int(rng.integers(5, 13)) for _ in "hw")
        blocked = rng.random((height, width)) < rng.random() * 0.35
        free = {(int(x), int(y)) for y, x in np.argwhere(~blocked)}
        if not free:
            continue
        cell = sorted(free)[int(rng.integers(len(free)))]
        cells = [cell]
        ahead = rng.random()
        before = None
        for _ in range(int(rng.integers(LEAST, 25))):
            x, y = cells[-1]
            ways = [(dx, dy) for dx, dy, all_ in rules if all((x + a, y + b) in free for a, b in all_)]
            if not ways:
                break
            if before not in ways or rng.random() > ahead:
                before = ways[int(rng.integers(len(ways)))]
            cells.append((x + before[0], y + before[1]))
        if len(cells) >= LEAST:
            return WalkClaim(blocked, moves, cells[0], cells[-1], tuple(cells))


def no_cells(rng: np.random.Generator, asked: WalkClaim) -> WalkClaim | None:
    """An empty path: valid to a judge of segments."""
    return replace(asked, cells=(), claimed=(0, 0, 0) if MOVES[asked.moves].knight else (0, 0))


def late_start(rng: np.random.Generator, asked: WalkClaim) -> WalkClaim | None:
    """Without its first cell."""
    return replace(asked, cells=asked.cells[1:]) if asked.cells[1] != asked.start else None


def early_end(rng: np.random.Generator, asked: WalkClaim) -> WalkClaim | None:
    """Without its last cell."""
    return replace(asked, cells=asked.cells[:-1]) if asked.cells[-2] != asked.goal else None


def other_query(rng: np.random.Generator, asked: WalkClaim) -> WalkClaim | None:
    """Between two cells that were not asked for, and lawful: valid to a judge of segments."""
    k = int(rng.integers(1, len(asked.cells) - 1))
    if asked.cells[k] in (asked.start, asked.goal):
        return None
    cell = asked.cells[k]
    return replace(asked, goal=cell) if rng.integers(0, 2) else replace(asked, start=cell)


def backwards(rng: np.random.Generator, asked: WalkClaim) -> WalkClaim | None:
    """From the goal to the start."""
    return None if asked.start == asked.goal else replace(asked, cells=asked.cells[::-1])


def jump(rng: np.random.Generator, asked: WalkClaim) -> WalkClaim | None:
    """A cell in the middle left out, where what is left is no step."""
    k = int(rng.integers(1, len(asked.cells) - 1))
    (x, y), (u, v) = asked.cells[k - 1], asked.cells[k + 1]
    if (u - x, v - y) in steps(asked.moves):
        return None
    return replace(asked, cells=asked.cells[:k] + asked.cells[k + 1 :])


def stands_still(rng: np.random.Generator, asked: WalkClaim) -> WalkClaim | None:
    """A cell given twice in a row."""
    k = int(rng.integers(len(asked.cells)))
    return replace(asked, cells=(*asked.cells[: k + 1], *asked.cells[k:]))


def off_the_map(rng: np.random.Generator, asked: WalkClaim) -> WalkClaim | None:
    """A cell beyond an edge; -1 would read the far side of the map by Python's indices."""
    k = int(rng.integers(1, len(asked.cells) - 1))
    side = asked.blocked.shape[::-1]
    axis = int(rng.integers(2))
    cell = list(asked.cells[k])
    cell[axis] = int(rng.choice([-1, -side[axis], side[axis], 2**31 - 1, -(2**31)]))
    return replace(asked, cells=(*asked.cells[:k], (cell[0], cell[1]), *asked.cells[k + 1 :]))


def wall_along(rng: np.random.Generator, asked: WalkClaim) -> WalkClaim | None:
    """One of its cells is a wall."""
    return _walled(asked, asked.cells[int(rng.integers(len(asked.cells)))])


def cut_corner(rng: np.random.Generator, asked: WalkClaim) -> WalkClaim | None:
    """A wall beside a step that is not straight, among the cells that the step needs and does not enter."""
    beside = []
    for (x, y), (u, v) in pairwise(asked.cells):
        beside += [(x + a, y + b) for a, b in sorted(needs(u - x, v - y, asked.moves))]
    beside = [cell for cell in beside if cell not in asked.cells]
    return _walled(asked, beside[int(rng.integers(len(beside)))]) if beside else None


def wrong_counts(rng: np.random.Generator, asked: WalkClaim) -> WalkClaim | None:
    """A step too many or too few is claimed, of one kind."""
    counts = list(counted(asked.cells, MOVES[asked.moves]))
    counts[int(rng.integers(len(counts)))] += int(rng.choice([-1, 1]))
    return replace(asked, claimed=tuple(counts))


def wrong_length(rng: np.random.Generator, asked: WalkClaim) -> WalkClaim | None:
    """It claims to cost a little less, or more, than its steps do."""
    return replace(asked, cheaper=int(rng.choice([-1, 1])))


def _walled(asked: WalkClaim, cell: Cell) -> WalkClaim:
    blocked = asked.blocked.copy()
    blocked[cell[1], cell[0]] = True
    return replace(asked, blocked=blocked)


Spoil = Callable[[np.random.Generator, WalkClaim], WalkClaim | None]
TWELVE: tuple[tuple[str, Spoil, frozenset[str]], ...] = (
    ("no cells", no_cells, frozenset({"empty"})),
    ("starts late", late_start, frozenset({"start"})),
    ("ends early", early_end, frozenset({"goal"})),
    ("another query's", other_query, frozenset({"start", "goal"})),
    ("backwards", backwards, frozenset({"start"})),
    ("a jump", jump, frozenset({"step"})),
    ("stands still", stands_still, frozenset({"step"})),
    ("off the map", off_the_map, frozenset({"outside"})),
    ("a wall on the way", wall_along, frozenset({"wall"})),
    ("a corner cut", cut_corner, frozenset({"corner", "knight"})),
    ("wrong counts", wrong_counts, frozenset({"steps"})),
    ("wrong length", wrong_length, frozenset({"cost"})),
)
"""Each way with its name and the rules one of which must refuse it."""
_STEP_SETS = ("octile", "octile", "four-connected", "dissertation", "sixteen-connected")
"""Where a walk's moves come from: mostly the public rules' own."""


def drawn(rng: np.random.Generator, way: int | None) -> WalkClaim:
    """A lawful walk, spoilt in one of the twelve ways; as it is where ``way`` is None.

    Walks are drawn until one can be spoilt in this way: without diagonals no corner is cut.
    """
    while True:
        moves = _STEP_SETS[int(rng.integers(len(_STEP_SETS)))]
        asked = lawful(rng, moves)
        spoilt = asked if way is None else TWELVE[way][1](rng, asked)
        if spoilt is not None:
            return spoilt
