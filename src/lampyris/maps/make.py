"""Seeded recipes: maps made, not drawn.

The same recipe, size, seed and settings give the same cells on every machine.

A recipe is one function ``(draw, width, height, **settings) -> blocked`` and one row of :data:`RECIPES`.
"""

from __future__ import annotations

import difflib
import inspect
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from lampyris.errors import LimitError, SettingError
from lampyris.maps.draw import Draw
from lampyris.typing import BoolGrid, Cell

MAX_CELLS = 2**24
"""Cells a map may have: beyond it one integer is no longer an exact octile cost (see model.moves)."""


@dataclass(frozen=True, slots=True)
class Recipe:
    """One way of making maps. ``settings`` maps each setting to its default."""

    name: str
    summary: str
    build: Callable[..., BoolGrid]

    @property
    def settings(self) -> Mapping[str, Any]:
        """Each setting with its default."""
        parameters = list(inspect.signature(self.build).parameters.values())[3:]
        return MappingProxyType({p.name: p.default for p in parameters})


@dataclass(frozen=True, slots=True)
class Edit:
    """A rectangle put right after the recipe: cells from (x, y) on that become wall or free."""

    x: int
    y: int
    width: int
    height: int
    wall: bool

    def apply(self, blocked: BoolGrid) -> None:
        """Write it into an array."""
        blocked[self.y : self.y + self.height, self.x : self.x + self.width] = self.wall


def make(
    recipe: str, width: int, height: int, seed: int, *, edits: Iterable[Edit] = (), **settings: Any
) -> BoolGrid:
    """The blocked cells of a new map, bool (height, width).

    Parameters
    ----------
    recipe : a name in :data:`RECIPES`.
    width, height : cells, 4 or more each.
    seed : 0 to 2^63 - 1.
    edits : rectangles written over the result, in order.
    settings : of the recipe.

    Raises
    ------
    SettingError : no such recipe or setting, a value out of its range.
    LimitError : more than 2^24 cells.
    """
    row = RECIPES.get(recipe)
    if row is None:
        raise SettingError(
            "RECIPE",
            f"no recipe is called {recipe!r}",
            allowed=", ".join(RECIPES),
            todo=_near(recipe, RECIPES),
        )
    for key in settings:
        if key not in row.settings:
            raise SettingError(
                "RECIPE",
                f"{recipe} has no setting {key!r}",
                allowed=", ".join(row.settings),
                todo=_near(key, row.settings),
            )
    for what, n in (("width", width), ("height", height)):
        if not isinstance(n, int) or isinstance(n, bool) or n < 4:
            raise SettingError("MAP_SIZE", f"{what} {n!r}", allowed="a whole number >= 4")
    if width * height > MAX_CELLS:
        raise LimitError("MAP_TOO_LARGE", f"{width} x {height} cells", allowed=f"{MAX_CELLS} cells")
    blocked = row.build(Draw(seed), width, height, **settings)
    for edit in edits:
        edit.apply(blocked)
    return blocked


def random_cells(draw: Draw, width: int, height: int, density: float = 0.2) -> BoolGrid:
    """Each cell is blocked with probability ``density``, whatever its neighbours are."""
    _share("density", density)
    return draw.units(height, width) < density


def gates(
    draw: Draw,
    width: int,
    height: int,
    room: int = 8,
    rooms: int = 64,
    doors: int = 2,
    narrow: float = 0.6,
    wide: int = 5,
    clutter: int = 60,
    bulk: int = 4,
    keep: Iterable[Cell] = (),
    large: int = 0,
) -> BoolGrid:
    """Rooms behind walls one cell thick, with openings narrow and wide, and things standing about.

    The only gates (free cells between two walls that face each other) are the narrow openings: whatever
    else is put down keeps two free cells to its neighbours. So their number is chosen here, not met with.

    Parameters
    ----------
    room : least side of a room, cells.
    rooms : greatest number of rooms.
    doors : greatest number of openings in a wall, each 1 to that many.
    narrow : probability that an opening is one cell wide.
    wide : greatest width of the others, which have 3 or more.
    clutter : things to try to put down.
    bulk : greatest side of a thing.
    keep : cells (x, y) that stay free together with their neighbours.
    large : things with no side under half of ``bulk`` to try to put down before those of ``clutter``: small
        ones alone take the room of large ones, and about a fifth blocked is the most they reach.
    """
    _whole("room", room, 3)
    _whole("rooms", rooms, 1)
    _whole("doors", doors, 1)
    _share("narrow", narrow)
    _whole("wide", wide, 3)
    _whole("clutter", clutter, 0)
    _whole("bulk", bulk, 1)
    _whole("large", large, 0)
    kept = tuple((int(x), int(y)) for x, y in keep)
    walls = divide(
        draw, width, height, room=room, rooms=rooms, doors=doors, narrow=narrow, wide=wide, keep=kept
    )
    blocked = np.zeros((height, width), dtype=np.bool_)
    for wall in walls:
        wall.build(blocked)
    put_clutter(draw, blocked, large, bulk, kept, least=(bulk + 1) // 2)
    put_clutter(draw, blocked, clutter, bulk, kept)
    for wall in walls:
        wall.open(blocked)
    return blocked


@dataclass(slots=True)
class Wall:
    """A straight wall one cell thick.

    ``upright`` at column ``at`` (else at row ``at``), from ``low`` to ``high`` along it.
    ``openings`` are (first cell, width) along the wall. ``joints`` are where other walls end against this
    one.
    """

    upright: bool
    at: int
    low: int
    high: int
    openings: list[tuple[int, int]]
    joints: list[int]

    def _span(self, low: int, high: int) -> tuple[slice, slice]:
        along, across = slice(low, high + 1), slice(self.at, self.at + 1)
        return (along, across) if self.upright else (across, along)

    def build(self, blocked: BoolGrid) -> None:
        """Write it whole."""
        blocked[self._span(self.low, self.high)] = True

    def open(self, blocked: BoolGrid) -> None:
        """Cut its openings."""
        for first, width in self.openings:
            blocked[self._span(first, first + width - 1)] = False

    def fits(self, first: int, width: int) -> bool:
        """Whether an opening there leaves wall: a cell at each end and joint, two between openings."""
        last = first + width - 1
        return (
            self.low < first
            and last < self.high
            and all(last + 1 < j or j < first - 1 for j in self.joints)
            and all(last + 2 < f or f + w - 1 < first - 2 for f, w in self.openings)
        )


def divide(
    draw: Draw,
    width: int,
    height: int,
    *,
    room: int,
    rooms: int,
    doors: int,
    narrow: float,
    wide: int,
    keep: tuple[Cell, ...],
) -> list[Wall]:
    """Divide a rectangle into rooms, the largest first, each time by a wall across the longer side."""
    walls: list[Wall] = []
    open_rooms = [(0, 0, width - 1, height - 1)]
    done = 0
    while open_rooms and len(open_rooms) + done < rooms:
        # The largest first, ties to the earliest: max() keeps the first of equals.
        k = max(range(len(open_rooms)), key=lambda i: _area(open_rooms[i]))
        x0, y0, x1, y1 = open_rooms.pop(k)
        wall = _wall_across(draw, walls, (x0, y0, x1, y1), room, keep)
        if wall is None:
            done += 1
            continue
        for _ in range(draw.between(1, doors)):
            _add_opening(draw, wall, narrow, wide)
        for other in walls:
            across = other.upright != wall.upright and other.low <= wall.at <= other.high
            if across and other.at in (wall.low - 1, wall.high + 1):
                other.joints.append(wall.at)
        walls.append(wall)
        if wall.upright:
            open_rooms += [(x0, y0, wall.at - 1, y1), (wall.at + 1, y0, x1, y1)]
        else:
            open_rooms += [(x0, y0, x1, wall.at - 1), (x0, wall.at + 1, x1, y1)]
    return walls


def _area(box: tuple[int, int, int, int]) -> int:
    return (box[2] - box[0] + 1) * (box[3] - box[1] + 1)


def _wall_across(
    draw: Draw, walls: list[Wall], box: tuple[int, int, int, int], room: int, keep: tuple[Cell, ...]
) -> Wall | None:
    """A wall across a room, clear of kept cells and of the openings it would end against; or None."""
    x0, y0, x1, y1 = box
    wide, tall = x1 - x0, y1 - y0
    upright = wide > tall or (wide == tall and draw.below(2) == 1)
    low, high = (x0 + room, x1 - room) if upright else (y0 + room, y1 - room)
    ends = (y0, y1) if upright else (x0, x1)
    across, along = (0, 1) if upright else (1, 0)
    places = [
        at
        for at in range(low, high + 1)
        if not any(abs(c[across] - at) <= 1 and ends[0] - 1 <= c[along] <= ends[1] + 1 for c in keep)
        and not any(
            w.upright != upright and w.at in (ends[0] - 1, ends[1] + 1) and f - 1 <= at <= f + n
            for w in walls
            for f, n in w.openings
        )
    ]
    return Wall(upright, draw.pick(places), *ends, [], []) if places else None


def _add_opening(draw: Draw, wall: Wall, narrow: float, wide: int) -> None:
    width = 1 if draw.unit() < narrow else draw.between(3, wide)
    width = min(width, wall.high - wall.low - 1)
    for _ in range(8):
        first = draw.between(wall.low + 1, max(wall.low + 1, wall.high - width))
        if wall.fits(first, width):
            wall.openings.append((first, width))
            return


def put_clutter(
    draw: Draw, blocked: BoolGrid, count: int, bulk: int, keep: tuple[Cell, ...], least: int = 1
) -> None:
    """Try ``count`` times to put a block or an angle where two free cells remain around it."""
    height, width = blocked.shape
    for _ in range(count):
        w, h = draw.between(least, bulk), draw.between(least, bulk)
        x, y = draw.between(0, width - 1), draw.between(0, height - 1)
        corner = draw.below(6)
        w, h = min(w, width - x), min(h, height - y)
        near = any(x - 2 < kx < x + w + 1 and y - 2 < ky < y + h + 1 for kx, ky in keep)
        if near or blocked[max(y - 2, 0) : y + h + 2, max(x - 2, 0) : x + w + 2].any():
            continue
        blocked[y : y + h, x : x + w] = True
        if corner < 4 and w > 2 and h > 2:
            # One quarter taken out leaves an angle: a dead corner, but no two walls that face each other.
            qx = x if corner & 1 else x + w // 2
            qy = y if corner & 2 else y + h // 2
            blocked[qy : min(qy + (h + 1) // 2, y + h), qx : min(qx + (w + 1) // 2, x + w)] = False


def _whole(what: str, value: Any, least: int) -> None:
    if not isinstance(value, int) or isinstance(value, bool) or not least <= value <= MAX_CELLS:
        raise SettingError("RECIPE", f"{what} {value!r}", allowed=f"a whole number >= {least}")


def _share(what: str, value: Any) -> None:
    if not isinstance(value, int | float) or isinstance(value, bool) or not 0 <= value <= 1:
        raise SettingError("RECIPE", f"{what} {value!r}", allowed="0 to 1")


def _near(word: Any, known: Iterable[str]) -> str:
    near = difflib.get_close_matches(str(word), list(known), 1)
    return f"did you mean {near[0]}?" if near else ""


RECIPES: Mapping[str, Recipe] = MappingProxyType(
    {
        r.name: r
        for r in (
            Recipe("gates", "rooms with narrow and wide openings, things standing about", gates),
            Recipe("random", "every cell blocked with the same probability", random_cells),
        )
    }
)
"""Every recipe by name."""
