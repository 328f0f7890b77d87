"""Edit: cells of the map that turn into walls or free while a simulation runs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from lampyris._core.noun import Noun
from lampyris._core.predicates import cell_of, items_of
from lampyris._core.scalars import is_whole
from lampyris.errors import LimitError, SceneError, SettingError, shown
from lampyris.model.grid import Grid
from lampyris.typing import Cell, CellsLike

MAX_EDITS = 10_000
MAX_EDITED = 2**24
"""Cells in all edits of a scene together."""


@dataclass(frozen=True, slots=True, repr=False)
class Edit(Noun):
    """Cells that become blocked or free at the beginning of a tick; tick 0 is before the first plan.

    Parameters
    ----------
    tick : >= 0.
    blocked : cells (x, y) that become walls, as far as allowed: see :mod:`lampyris.sim.grid.editing`.
    freed : cells that become free.

    Raises
    ------
    SettingError : ``EDIT``: a tick or a cell that is none, or a cell named twice.

    Examples
    --------
    >>> import lampyris
    >>> scene = lampyris.Scene(lampyris.load_grid("guide"), start=(1, 8), goal=(8, 2))
    >>> edit = lampyris.Edit(tick=2, blocked=((3, 3),))
    >>> edit.tick, edit.blocked
    (2, ((3, 3),))
    """

    tick: int
    blocked: tuple[Cell, ...] = ()
    freed: tuple[Cell, ...] = ()

    if TYPE_CHECKING:  # what is accepted; what is stored is declared above

        def __init__(
            self,
            tick: int,
            blocked: CellsLike = ...,
            freed: CellsLike = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        t: Any = self.tick
        if not is_whole(t, 0):
            raise SettingError("EDIT", f"tick {shown(t)}", where="edit", allowed="a whole number >= 0")
        object.__setattr__(self, "tick", int(t))
        seen: set[Cell] = set()
        for what in ("blocked", "freed"):
            cells = _cells(what, getattr(self, what))
            object.__setattr__(self, what, cells)
            for cell in cells:
                if cell in seen:
                    raise SettingError(
                        "EDIT",
                        f"{cell} twice at tick {t}",
                        where=f"edit.{what}",
                        allowed="each cell once, blocked or freed",
                    )
                seen.add(cell)


def check_edits(grid: Grid, edits: Any, *, first: int = 0) -> tuple[Edit, ...]:
    """Edits as a tuple, in order, on the map; one alone is taken as a list of one.

    Parameters
    ----------
    first : the earliest tick that any may have.

    Raises
    ------
    SettingError : ``TYPE``; ``EDIT_TICK``: a tick too early, or not after the one before.
    SceneError : ``EDIT_OUTSIDE``: a cell outside the map.
    LimitError : more than 10,000 edits, or 2^24 cells.
    """
    if not isinstance(edits, tuple | list):
        edits = () if edits is None else (edits,)
    if len(edits) > MAX_EDITS:
        raise LimitError("LIMIT", f"{len(edits):,} edits", where="edits", allowed=f"at most {MAX_EDITS:,}")
    least, cells = first, 0
    for k, edit in enumerate(edits):
        if not isinstance(edit, Edit):
            raise SettingError("TYPE", f"a {type(edit).__name__}", where=f"edits[{k}]", allowed="an Edit")
        if edit.tick < least:
            raise SettingError(
                "EDIT_TICK", f"tick {edit.tick}", where=f"edits[{k}]", allowed=f"at least {least} here"
            )
        least = edit.tick + 1
        cells += len(edit.blocked) + len(edit.freed)
        if cells > MAX_EDITED:
            raise LimitError("LIMIT", f"{cells:,} edited cells", where="edits", allowed=f"{MAX_EDITED:,}")
        check_edit(grid, edit, f"edits[{k}]")
    return tuple(edits)


def check_edit(grid: Grid, edit: Edit, where: str) -> None:
    """Refuse an edit with a cell outside the map.

    Raises
    ------
    SceneError : ``EDIT_OUTSIDE``.
    """
    for cell in (*edit.blocked, *edit.freed):
        if not grid.contains(cell):
            raise SceneError(
                "EDIT_OUTSIDE",
                f"cell {cell} is outside the map",
                where=where,
                allowed=f"x 0 to {grid.width - 1}, y 0 to {grid.height - 1}",
            )


def applied(grid: Grid, edits: Iterable[Edit]) -> Grid:
    """The map after these edits, one after the other; itself if there are none.

    An edited cell is known. Terrain is that of the map as given wherever a cell is free: a wall does not
    change the ground it stands on.
    """
    edits = tuple(edits)
    if not edits:
        return grid
    walls = grid.blocked.copy()
    unknown = None if grid.unknown is None else grid.unknown.copy()
    for edit in edits:
        for cells, blocked in ((edit.freed, False), (edit.blocked, True)):
            if cells:
                x, y = np.array(cells, dtype=np.int64).T
                walls[y, x] = blocked
                if unknown is not None:
                    unknown[y, x] = False
    return replace(grid, blocked=walls, unknown=unknown)


def _cells(what: str, given: Any) -> tuple[Cell, ...]:
    made = []
    for one in items_of(given):
        cell = cell_of(one)
        if cell is None:
            raise SettingError(
                "EDIT", f"{shown(one)} is not a cell", where=f"edit.{what}", allowed="two whole numbers x, y"
            )
        made.append(cell)
    return tuple(made)
