"""Rooms behind thin walls whose gates are counted: the recipe of the maps ``env-1`` to ``env-6``.

A gate is a free cell between two walls that face each other (method.md, "Gates").
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lampyris.io.maps.recipes.draw import Draw
from lampyris.io.maps.recipes.recipe import RecipeSetting
from lampyris.io.maps.recipes.regions import keep_largest
from lampyris.typing import BoolGrid, Cell

SETTINGS = (
    RecipeSetting("room", 8, 3, 4096, "least side of a room, cells"),
    RecipeSetting("rooms", 64, 1, 4096, "greatest number of rooms"),
    RecipeSetting("doors", 2, 1, 64, "greatest number of openings in a wall, each 1 to that many"),
    RecipeSetting("narrow", 0.6, 0, 1, "probability that an opening is one cell wide"),
    RecipeSetting("wide", 5, 3, 4096, "greatest width of the other openings, which have 3 cells or more"),
    RecipeSetting("clutter", 60, 0, 100_000, "things to try to put down"),
    RecipeSetting("bulk", 4, 1, 4096, "greatest side of a thing, cells"),
    RecipeSetting("keep", (), None, None, "cells that stay free together with their neighbours"),
    # Small things alone take the room of large ones, and about a fifth blocked is the most they reach.
    RecipeSetting("large", 0, 0, 100_000, "things with no side under half of bulk to try to put down first"),
)


def gates(
    draw: Draw,
    width: int,
    height: int,
    *,
    room: int,
    rooms: int,
    doors: int,
    narrow: float,
    wide: int,
    clutter: int,
    bulk: int,
    keep: tuple[Cell, ...],
    large: int,
) -> BoolGrid:
    """Rooms behind walls one cell thick, with openings narrow and wide, and things standing about.

    The only gates are the narrow openings: whatever else is put down keeps two free cells to its neighbours.
    So their number is chosen here, not met with. What is cut off all the same, by an angle in a corner of the
    map or a wall too short for an opening, is filled; that makes no gate, as it lies behind walls already.
    """
    walls = divide(
        draw, width, height, room=room, rooms=rooms, doors=doors, narrow=narrow, wide=wide, keep=keep
    )
    blocked = np.zeros((height, width), dtype=np.bool_)
    for wall in walls:
        wall.build(blocked)
    put_clutter(draw, blocked, large, bulk, keep, least=(bulk + 1) // 2)
    put_clutter(draw, blocked, clutter, bulk, keep)
    for wall in walls:
        wall.open(blocked)
    return keep_largest(blocked)


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
