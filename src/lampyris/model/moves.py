"""Moves: the steps a robot may make from a cell, and what each costs, exactly.

Every cost is an integer, so that two costs are equal when they are and never by float accident.

For ``octile`` moves a diagonal is sqrt 2. Take a convergent p/q of sqrt 2 (a Pell number pair): with
straight = q and diagonal = p, two different pairs (n straights, m diagonals), (n', m') are ordered by ``n q
+ m p`` exactly as by ``n + m sqrt 2`` whenever ``|m - m'| < q``. (A reversal needs ``|dn + dm sqrt 2| <
|dm| |sqrt 2 - p/q|``; the left side is at least ``1 / (2.83 |dm|)`` because ``dn^2 - 2 dm^2`` is a non-zero
integer, the right side below ``|dm| / (2.83 q^2)``.) q = 38,613,965 exceeds the 2^24 cells a map may have,
so one 64-bit integer *is* the pair: exact order, exact ties.

On maps with terrain n and m count 63rds, weighed by the cells entered, and may exceed q on paths of a hundred
thousand cells and more. The order is then that of the cost with p/q for sqrt 2, which is 2.4e-16 of it away,
and what :meth:`Moves.value` gives is right to the same share.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import lru_cache
from types import MappingProxyType
from typing import Any

import numpy as np

from lampyris._core.noun import Noun
from lampyris._core.predicates import cell_of
from lampyris._core.scalars import is_whole
from lampyris.errors import SettingError, did_you_mean, shown
from lampyris.model.grid import TERRAIN_UNIT
from lampyris.typing import FloatGrid, IntGrid

PELL_Q = 38_613_965
PELL_P = 54_608_393
_INVERSE_P = pow(PELL_P, -1, PELL_Q)
_PART = 1 << 14
"""Cells whose costs are worked out at a time."""

# Order of the local parent rule (method.md, "The field"): offset parent - cell, diagonals first. It
# reproduces Table 4.2.
_EIGHT = ((-1, -1), (1, -1), (-1, 1), (1, 1), (-1, 0), (1, 0), (0, -1), (0, 1))
_FOUR = _EIGHT[4:]
_KNIGHT = ((-2, -1), (2, -1), (-2, 1), (2, 1), (-1, -2), (1, -2), (-1, 2), (1, 2))


@dataclass(frozen=True, slots=True, repr=False)
class Moves(Noun):
    """A step set and its exact integer costs.

    A knight's step (``sixteen-connected`` only) needs every cell its segment touches free: the straight and the
    diagonal neighbour between its ends.

    Parameters
    ----------
    name : ``dissertation``, ``octile``, ``four-connected`` or ``sixteen-connected``.
    offsets : (dx, dy) of each step, in the order in which the local parent rule prefers ``parent - cell``.
    costs : integer cost of each step, same order.
    unit : integer cost of a straight step: ``cost / unit`` is a length in cells.
    corner_cutting : whether a diagonal may pass a blocked side cell. If not, both side cells must be free.
    scale : by how much every cost is multiplied: 1, or 63 on a map with terrain, where a step into a cell
        of terrain value c costs ``costs[k] // 63 * (63 + c)`` (see :class:`lampyris.model.grid.Grid`).

    Examples
    --------
    >>> import lampyris
    >>> octile = lampyris.MOVES["octile"]
    >>> len(octile.offsets), octile.corner_cutting
    (8, False)
    """

    name: str
    offsets: tuple[tuple[int, int], ...]
    costs: tuple[int, ...]
    unit: int
    corner_cutting: bool
    scale: int = 1
    _dear: tuple[int, int] = field(init=False, repr=False, compare=False)
    """Exact costs of a diagonal and of a knight's step: every query asks for them."""

    def __post_init__(self) -> None:
        if not _are_moves(self):
            raise SettingError(
                "MOVES",
                f"offsets {shown(self.offsets)}, costs {shown(self.costs)}, unit {shown(self.unit)}",
                where=shown(self.name),
                allowed="pairs of whole numbers, a whole cost for each, a whole unit",
            )
        steps: dict[int, int] = {}
        for (dx, dy), cost in zip(self.offsets, self.costs, strict=False):
            steps.setdefault(abs(dx * dy), cost)
        object.__setattr__(self, "_dear", (steps.get(1, 0), steps.get(2, 0)))

    def __hash__(self) -> int:
        # Many caches are by moves; the offsets would take ten times as long, and follow from the name in all that is usual.
        return hash((self.name, self.unit, self.scale, self.corner_cutting))  # bits: for dicts alone

    def _brief(self) -> str:
        return f"<Moves {self.name}{'' if self.scale == 1 else ' on terrain'}>"

    def weighed(self) -> Moves:
        """The same steps with costs in 63rds, for maps with terrain. Those that are already: themselves."""
        if self.scale == TERRAIN_UNIT:
            return self
        costs = tuple(TERRAIN_UNIT * c for c in self.costs)
        return replace(self, costs=costs, unit=TERRAIN_UNIT * self.unit, scale=TERRAIN_UNIT)

    def plain(self) -> Moves:
        """The same steps with the costs of maps without terrain. Those that are already: themselves."""
        if self.scale == 1:
            return self
        costs = tuple(c // self.scale for c in self.costs)
        return replace(self, costs=costs, unit=self.unit // self.scale, scale=1)

    @property
    def straight(self) -> int:
        """Exact cost of a straight step."""
        return self.unit

    @property
    def diagonal(self) -> int:
        """Exact cost of a diagonal step; 0 where there is none."""
        return self._dear[0]

    @property
    def knight(self) -> int:
        """Exact cost of a knight's step; 0 where there is none."""
        return self._dear[1]

    @property
    def reach(self) -> int:
        """Chebyshev length of the longest step: 1, or 2 for ``sixteen-connected``."""
        return _reach(self.offsets)

    def exact(self, counts: tuple[int, ...]) -> int:
        """Exact integer cost of so many straights, diagonals and (if any) knight's steps."""
        paid = (n * c for n, c in zip(counts, (self.unit, *self._dear), strict=False))
        return sum(paid)  # bits: whole numbers

    def value(self, exact: int) -> float:
        """A cost as a length in cells, correctly rounded from the exact integer."""
        if self.name == "octile":
            n, m = octile_pair(exact)
            return (n + m * math.sqrt(2.0)) / self.scale
        return exact / self.unit

    def values(self, exact: IntGrid) -> FloatGrid:
        """The same for a whole array; negative entries (no cost) become infinity."""
        e: Any = np.asarray(exact)
        out = np.empty(e.shape)
        if e.ndim != 2:
            self._write_values(e, out)
            return out
        rows = max(1, _PART // max(e.shape[1], 1))
        for y in range(0, len(e), rows):
            self._write_values(e[y : y + rows], out[y : y + rows])
        return out

    def _write_values(self, exact: IntGrid, out: FloatGrid) -> None:
        """See :meth:`values`; for so many cells that what is in between stays in the processor's cache."""
        e = np.asarray(exact, dtype=np.int64)
        if self.name == "octile":
            # A remainder by two divisions by one number takes NumPy half as long as %. What is left of e and the inverse
            # are both below 2^26, so that their product stays within 64 bits.
            m = (e - e // PELL_Q * PELL_Q) * _INVERSE_P
            m -= m // PELL_Q * PELL_Q
            np.multiply(m, math.sqrt(2.0), out=out)
            out += (e - m * PELL_P) // PELL_Q
            if self.scale != 1:
                out /= self.scale
        else:
            np.divide(e, self.unit, out=out)
        np.copyto(out, np.inf, where=e < 0)


@lru_cache(maxsize=32)
def _reach(offsets: tuple[tuple[int, int], ...]) -> int:
    return max(max(abs(dx), abs(dy)) for dx, dy in offsets)


def _are_moves(one: Moves) -> bool:
    """Whether its parts are of the right kinds, and fit."""
    listed = isinstance(one.offsets, tuple) and isinstance(one.costs, tuple)
    return (
        isinstance(one.name, str)
        and listed
        and 0 < len(one.offsets) == len(one.costs)
        and all(cell_of(offset) is not None for offset in one.offsets)
        and all(map(is_whole, (*one.costs, one.unit, one.scale)))
    )


def octile_pair(exact: int) -> tuple[int, int]:
    """The (straights, diagonals) that an exact octile cost stands for."""
    m = (exact % PELL_Q) * _INVERSE_P % PELL_Q
    return (exact - m * PELL_P) // PELL_Q, m


def _eight(name: str, straight: int, diagonal: int, cutting: bool) -> Moves:
    return Moves(name, _EIGHT, (diagonal,) * 4 + (straight,) * 4, straight, cutting)


MOVES = MappingProxyType(
    {
        "octile": _eight("octile", PELL_Q, PELL_P, False),
        "dissertation": _eight("dissertation", 10, 14, True),
        "four-connected": Moves("four-connected", _FOUR, (1,) * 4, 1, False),
        "sixteen-connected": Moves(
            "sixteen-connected", _KNIGHT + _EIGHT, (22,) * 8 + (14,) * 4 + (10,) * 4, 10, False
        ),
    }
)
"""Every step set by name."""


def moves_named(name: str | Moves) -> Moves:
    """The step set of that name.

    Raises
    ------
    SettingError : no such name.
    """
    if isinstance(name, Moves):
        return name
    try:
        return MOVES[name]
    except (KeyError, TypeError):
        raise SettingError.of(
            "MOVES", "moves", shown(name), allowed=", ".join(MOVES), todo=did_you_mean(name, MOVES)
        ) from None
