"""What motions cost where there are no walls: an estimate that knows headings, for the order of a search.

It is no lower bound (in narrow places it may be too low, next to the tunnel's path too high), so that no bound rests on
it. Without it a robot that faces away from its goal would drive there in reverse, or search for long around both ends.
Such tables: R. Knepper, A. Kelly, "High performance state lattice planning using heuristic look-up tables", IROS 2006.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels.lattice.open_space import spread
from lampyris.planning.lattice.lattice import StateLattice

REACH = 3
"""Half the side of a table, in displacements of the longest motion."""
FAR = 6
"""The same of the tables of ``pad``: a car that turns round needs so much room, and a bound that knows it."""
_LARGEST = 48
"""Half its side at most, cells."""
NEVER = 1 << 40
"""A cost above any in a table."""


@dataclass(frozen=True, eq=False)
class OpenSpace:
    """Costs from the middle of an empty square.

    Parameters
    ----------
    half : the square has ``2 * half + 1`` cells a side.
    cost : int64 (headings, side, side, headings): from a heading in the middle to a row, a column and a heading.
    """

    half: int
    cost: NDArray[np.int64]

    @property
    def turn(self) -> NDArray[np.int64]:
        """Cost of coming back to the same cell with another heading, int64 (headings, headings)."""
        turn: NDArray[np.int64] = self.cost[:, self.half, self.half, :]
        return turn

    def to(self, heading: int) -> NDArray[np.int64]:
        """Costs to a heading in the middle of the square, from each row, column and heading of it."""
        table: NDArray[np.int64] = self.towards({heading})[heading]
        return table

    def towards(self, headings: Iterable[int]) -> NDArray[np.int64]:
        """Costs to a heading in the middle of the square, from each row, column and heading of it.

        Parameters
        ----------
        headings : those for which the result is filled; int64 (headings, side, side, headings).
        """
        back, filled = self._back
        for heading in sorted(set(headings) - filled):
            back[heading] = self.cost[:, ::-1, ::-1, heading].transpose(1, 2, 0)
            filled.add(heading)
        return back

    @cached_property
    def _back(self) -> tuple[NDArray[np.int64], set[int]]:
        """Room for the costs to each heading, next to one another in memory, and the headings that are there."""
        n, side = self.cost.shape[0], 2 * self.half + 1
        return np.empty((n, side, side, n), dtype=np.int64), set()

    @cached_property
    def least(self) -> NDArray[np.int64]:
        """Costs from a heading in the middle to each row and column, with any heading there; int64 (headings, side, side)."""
        found: NDArray[np.int64] = self.cost.min(axis=3)
        return found


@lru_cache(8)
def open_space_of(lattice: StateLattice, reach: int = REACH) -> OpenSpace:
    """The table of a lattice; the same object for the same lattice and reach."""
    n = lattice.shape.headings
    half = min(reach * int(np.abs(lattice.cell).max()), _LARGEST)
    side = 2 * half + 1
    step_x, step_y = (np.ascontiguousarray(lattice.cell[:, k]) for k in (0, 1))
    room = side * side * n
    quarter = []
    for heading in range(n // 4):
        costs = np.empty(side * side * n, dtype=np.int64)
        while not spread(
            n, lattice.first, step_x, step_y, lattice.turned, lattice.cost, half, heading, costs,
            np.zeros(room, dtype=np.int64), np.zeros(room, dtype=np.int32),
        ):  # fmt: skip
            room *= 2
        quarter.append(np.where(costs < 0, NEVER, costs).reshape(side, side, n))
    every = [quarter]
    for _ in range(3):
        # A quarter turn counterclockwise: rows point down.
        every.append([np.roll(np.rot90(one), n // 4, axis=2) for one in every[-1]])
    return OpenSpace(half, np.ascontiguousarray([one for part in every for one in part]))
