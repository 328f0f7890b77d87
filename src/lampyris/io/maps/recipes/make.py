"""Seeded recipes: maps made, not drawn.

The same recipe, size, seed and settings give the same cells on every machine.

A recipe is one file of :mod:`lampyris.io.maps.recipes` and one row of :data:`RECIPES`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from lampyris._core.limits import MAX_CELLS
from lampyris.errors import LimitError, SettingError, did_you_mean
from lampyris.io.maps.recipes import caves, gates, hills, maze, office, rooms, scatter, street, warehouse
from lampyris.io.maps.recipes.draw import Draw
from lampyris.io.maps.recipes.recipe import Recipe
from lampyris.typing import BoolGrid, ByteGrid


@dataclass(frozen=True, slots=True)
class RectangleEdit:
    """A rectangle put right after the recipe: cells from (x, y) on that become wall or free."""

    x: int
    y: int
    width: int
    height: int
    wall: bool

    def apply(self, blocked: BoolGrid) -> None:
        """Write it into an array."""
        blocked[self.y : self.y + self.height, self.x : self.x + self.width] = self.wall


@dataclass(frozen=True, slots=True, eq=False)
class RecipeCells:
    """The cells of a new map.

    Parameters
    ----------
    blocked : bool (height, width).
    terrain : uint8 (height, width), 0 to 252, as :class:`lampyris.model.grid.Grid` has it; None for recipes
        that have plain ground only.
    """

    blocked: BoolGrid
    terrain: ByteGrid | None = None


def make(
    recipe: str, width: int, height: int, seed: int, *, edits: Iterable[RectangleEdit] = (), **settings: Any
) -> BoolGrid:
    """The blocked cells of a new map, bool (height, width): :func:`make_ground` without the terrain."""
    return make_ground(recipe, width, height, seed, edits=edits, **settings).blocked


def make_ground(
    recipe: str, width: int, height: int, seed: int, *, edits: Iterable[RectangleEdit] = (), **settings: Any
) -> RecipeCells:
    """The cells of a new map.

    Parameters
    ----------
    recipe : a name in :data:`RECIPES`.
    width, height : cells, 4 or more each; some recipes need more.
    seed : 0 to 2^63 - 1.
    edits : rectangles written over the result, in order; they leave the terrain alone.
    settings : of the recipe; see ``RECIPES[recipe].table``.

    Raises
    ------
    SettingError : no such recipe or setting, a value out of its range, a map too small for the recipe.
    LimitError : more than 2^24 cells.
    """
    row = recipe_named(recipe)
    complete = row.complete(settings)
    for what, n in (("width", width), ("height", height)):
        if not isinstance(n, int) or isinstance(n, bool) or n < row.least:
            raise SettingError.of("MAP_SIZE", what, repr(n), allowed=f"a whole number >= {row.least}")
    if width * height > MAX_CELLS:
        what, most = f"{width} x {height} cells", f"at most {MAX_CELLS:,} cells"
        raise LimitError("MAP_TOO_LARGE", what, allowed=most, setting="size")
    built = row.build(Draw(seed), width, height, **complete)
    blocked, terrain = built if isinstance(built, tuple) else (built, None)
    for edit in edits:
        edit.apply(blocked)
    return RecipeCells(blocked, terrain)


def recipe_named(name: str) -> Recipe:
    """The recipe of that name.

    Raises
    ------
    SettingError : there is none.
    """
    row = RECIPES.get(name)
    if row is None:
        raise SettingError(
            "RECIPE",
            f"no recipe is called {name!r}",
            allowed=", ".join(RECIPES),
            todo=did_you_mean(name, RECIPES),
            setting="recipe",
        )
    return row


RECIPES: Mapping[str, Recipe] = MappingProxyType(
    {
        r.name: r
        for r in (
            Recipe("caves", "rounded caves, the largest of them", caves.caves, caves.SETTINGS),
            Recipe(
                "gates",
                "rooms with narrow and wide openings, things standing about",
                gates.gates,
                gates.SETTINGS,
            ),
            Recipe(
                "hills",
                "rolling ground, costlier the higher it lies, with lakes, rocks and roads",
                hills.hills,
                hills.SETTINGS,
            ),
            Recipe(
                "maze", "corridors with one path, or a few, between any two places", maze.maze, maze.SETTINGS
            ),
            Recipe(
                "office", "corridors with rooms on both sides, doors, desks", office.office, office.SETTINGS
            ),
            Recipe(
                "random",
                "every cell blocked with the same probability; parts may be cut off",
                scatter.scatter,
                scatter.SETTINGS,
                connected=False,
            ),
            Recipe("rooms", "rooms of many sizes, wall to wall, with doors", rooms.rooms, rooms.SETTINGS),
            Recipe("street", "a town: bent streets, avenues, alleys, yards", street.street, street.SETTINGS),
            Recipe("warehouse", "racks, aisles and docks", warehouse.warehouse, warehouse.SETTINGS),
        )
    }
)
"""Every recipe by name."""
