"""Fields of one living map with different cells sealed, repaired from one to the next, not solved from scratch."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

from lampyris.model.grid import GridKey
from lampyris.model.moves import Moves
from lampyris.planning.field.layers import free_cells
from lampyris.planning.field.repair import FieldRepairer, Padded
from lampyris.planning.living_map import LivingMap
from lampyris.typing import Cell

KEPT = 3
"""Fields with sealed cells that are kept beside the bare one: the same gates are met again by every preview
until the robot stands before them."""

SHARED = 8
"""Fields that sessions which share them find solved: many runs on one map are usual."""
SHARED_CELLS = 1 << 15
"""Cells of a map up to which they are kept; 13 bytes a cell."""


@dataclass(slots=True)
class _Kept:
    """A field, its sealed cells, and those that the map has altered since."""

    repairer: FieldRepairer
    cells: frozenset[Cell]
    behind: dict[Cell, None] = field(default_factory=dict)


class FieldCache:
    """The field of a map and a few others of it, each with some cells sealed.

    Parameters
    ----------
    living : the map; tell :meth:`altered` what changes in it.
    moves, goal, rho, gamma : of the fields.
    shared : whether the bare field of a small map without terrain may be one that another session has solved; it is copied
        before it is changed.
    """

    def __init__(
        self, living: LivingMap, moves: Moves, goal: Cell, *, rho: float, gamma: float, shared: bool = False
    ) -> None:
        self._map = living
        self._shared = shared
        self._moves, self._goal, self._rho, self._gamma = moves, goal, rho, gamma
        self._kept: list[_Kept] = []
        self._bare: Padded | None = None
        self.spent = 0
        """Cells settled in fields, or seen by repairing them, so far."""

    def altered(self, cells: list[Cell]) -> None:
        """These cells of the map are other than before; a field hears of it when it is asked for."""
        for kept in self._kept:
            kept.behind.update(dict.fromkeys(cells))

    def sealed(self, cells: frozenset[Cell]) -> Padded:
        """The field with these cells sealed. It stays as it is until the map changes or others are asked for;
        with none sealed, until the map changes.
        """
        last = self._kept[-1] if self._kept else None
        if last is not None and not last.behind and last.cells == cells:
            return last.repairer.padded
        kept = next((k for k in self._kept if k.cells == cells), None)
        if kept is None and self._kept:
            # The nearest one, of equals the one not asked for the longest, becomes it or is copied for it.
            others = [k for k in self._kept if k.cells]
            full = bool(cells) and len(others) >= KEPT
            kept = min(others if full else self._kept, key=lambda k: len(k.cells ^ cells))
            if not full:
                kept = _Kept(kept.repairer.copy(), kept.cells, dict(kept.behind))
                self._kept.append(kept)
        if kept is None:
            kept = self._new()
        self._kept.remove(kept)  # permanently, if repairing it is stopped half way
        self._bring(kept, cells)
        self._kept.append(kept)
        return kept.repairer.padded

    def _new(self) -> _Kept:
        """The bare field, the first of all."""
        terrain = self._map.terrain if self._map.has_terrain else None
        free = self._map.free
        if self._is_shared:
            solved = _solved(*self._given)
            self._bare, repairer = solved.padded, solved.copy_on_write()
        else:
            repairer = FieldRepairer(
                free, self._moves, self._goal, terrain=terrain, rho=self._rho, gamma=self._gamma
            )
        self.spent += repairer.field.expansions
        self._kept.append(_Kept(repairer, frozenset()))
        return self._kept[-1]

    @property
    def _is_shared(self) -> bool:
        """Whether the bare field is that of a map as given which sessions share."""
        as_given = not self._map.has_terrain and not self._map.revision
        return self._shared and as_given and self._map.free.size <= SHARED_CELLS

    @property
    def _given(self) -> tuple[GridKey, float, Moves, Cell, float, float]:
        """What the bare field of the map as given depends on."""
        return GridKey(self._map.given), self._map.radius, self._moves, self._goal, self._rho, self._gamma

    def spare(self, ground: Padded, settings: Hashable) -> list[Any] | None:
        """Where sessions leave what they have worked out on a field for the next with the same settings; None: it is not
        the bare one that is shared, which never changes."""
        if ground is not self._bare or not self._is_shared:
            return None
        return _spare(*self._given, settings)

    def _bring(self, kept: _Kept, cells: frozenset[Cell]) -> None:
        """Repair a field to the map as it is, with these cells sealed."""
        differ = kept.behind | dict.fromkeys(sorted(kept.cells ^ cells))
        if not differ:
            return
        free, terrain = self._map.free, self._map.terrain if self._map.has_terrain else None
        freed = [(x, y) for x, y in differ if free[y, x] and (x, y) not in cells]
        blocked = [(x, y) for x, y in differ if not free[y, x] or (x, y) in cells]
        graded = [] if terrain is None else [((x, y), int(terrain[y, x])) for x, y in kept.behind]
        self.spent += kept.repairer.repair(blocked=blocked, freed=freed, terrain=graded).expansions
        kept.cells = cells
        kept.behind.clear()


@lru_cache(maxsize=SHARED)
def _solved(key: GridKey, radius: float, moves: Moves, goal: Cell, rho: float, gamma: float) -> FieldRepairer:
    """The bare field of a map as given; never repaired itself."""
    return FieldRepairer(free_cells(key.grid, radius), moves, goal, rho=rho, gamma=gamma)


@lru_cache(maxsize=2 * SHARED)
def _spare(
    key: GridKey, radius: float, moves: Moves, goal: Cell, rho: float, gamma: float, settings: Hashable
) -> list[Any]:
    """See :meth:`FieldCache.spare`; bounded, as studies try hundreds of settings on one map."""
    return []
