"""Office floors: corridors with rooms on both sides, doors, desks."""

from __future__ import annotations

import numpy as np

from lampyris.io.maps.recipes.draw import Draw
from lampyris.io.maps.recipes.recipe import RecipeSetting, too_small
from lampyris.typing import BoolGrid

SETTINGS = (
    RecipeSetting("corridor", 3, 1, 64, "width of a corridor, cells"),
    RecipeSetting("depth", 9, 2, 256, "least depth of a room, from the corridor to its window, cells"),
    RecipeSetting("room", 7, 2, 256, "least width of a room, cells"),
    RecipeSetting("door", 2, 1, 64, "width of a door, cells"),
    RecipeSetting("wing", 60, 10, 4096, "about how far corridors across are apart, cells"),
    RecipeSetting("open", 0.15, 0.0, 1.0, "share of the walls between neighbours that are missing"),
    RecipeSetting("joined", 0.1, 0.0, 1.0, "share of the other such walls that have a door"),
    RecipeSetting("desks", 0.5, 0.0, 1.0, "share of the places for a desk where one stands"),
)


def office(
    draw: Draw,
    width: int,
    height: int,
    *,
    corridor: int,
    depth: int,
    room: int,
    door: int,
    wing: int,
    open: float,
    joined: float,
    desks: float,
) -> BoolGrid:
    """Rows of rooms on both sides of long corridors, which corridors across connect.

    Every room has a door to its corridor, and desks never touch walls or each other: all is reachable.
    """
    tall = 2 * depth + corridor + 2
    count = (height - 1) // (tall + 1)
    if count < 1 or width < corridor + room + 3:
        raise too_small(
            "one corridor with rooms", width, height, f"{corridor + room + 3} x {tall + 2} or more"
        )
    blocked = np.ones((height, width), dtype=np.bool_)
    ends = [1 + (height - 1) * k // count for k in range(count + 1)]
    corridors = _corridors_across(draw, width, corridor, room, wing)
    parts = _between(corridors, width)
    for k in range(count):
        low, high = ends[k], ends[k + 1] - 2
        top = low + (high - low + 1 - corridor - 2) // 2
        blocked[top + 1 : top + corridor + 1, 1 : width - 1] = False
        for wall, y0, y1 in ((top, low, top - 1), (top + corridor + 1, top + corridor + 2, high)):
            for x0, x1 in parts:
                _rooms(draw, blocked, (x0, y0, x1, y1), wall, room, door, open, joined, desks)
    for x0, x1 in corridors:
        blocked[1 : height - 1, x0 : x1 + 1] = False
    return blocked


def _corridors_across(draw: Draw, width: int, corridor: int, room: int, wing: int) -> list[tuple[int, int]]:
    """Corridors across, (first, last) column of each: about evenly apart, none closer than a room."""
    count = max(1, (width - 2) // (wing + corridor))
    corridors = []
    for k in range(count):
        low, high = 1 + (width - 2) * k // count, (width - 2) * (k + 1) // count
        spare = max(0, (high - low + 1 - corridor - 2 * room - 2) // 2)
        at = (low + high + 1 - corridor) // 2 + draw.between(-spare, spare)
        corridors.append((at, at + corridor - 1))
    return corridors


def _between(corridors: list[tuple[int, int]], width: int) -> list[tuple[int, int]]:
    """The columns for rooms beside those corridors and the walls along them."""
    edges = [-1, *(edge for pair in corridors for edge in pair), width]
    parts = [(edges[k] + 2, edges[k + 1] - 2) for k in range(0, len(edges), 2)]
    return [(x0, x1) for x0, x1 in parts if x1 > x0]


def _rooms(
    draw: Draw,
    blocked: BoolGrid,
    box: tuple[int, int, int, int],
    wall: int,
    room: int,
    door: int,
    open: float,
    joined: float,
    desks: float,
) -> None:
    """A row of rooms that fills a box; ``wall`` is the row of the wall to their corridor."""
    x0, y0, x1, y1 = box
    while x0 <= x1:
        side = draw.between(room, 2 * room)
        last = x1 if x1 - x0 + 1 < side + 1 + room else x0 + side - 1
        blocked[y0 : y1 + 1, x0 : last + 1] = False
        _put_desks(draw, blocked[y0 + 2 : y1 - 1, x0 + 2 : last - 1], desks)
        wide = min(door, last - x0 + 1)
        at = draw.between(x0, last - wide + 1)
        blocked[wall, at : at + wide] = False
        if last < x1:
            if draw.unit() < open:
                blocked[y0 : y1 + 1, last + 1] = False
            elif draw.unit() < joined:
                wide = min(door, y1 - y0 + 1)
                at = draw.between(y0, y1 - wide + 1)
                blocked[at : at + wide, last + 1] = False
        x0 = last + 2


def _put_desks(draw: Draw, floor: BoolGrid, share: float) -> None:
    """Desks of 2 x 1 cells in rows, with two free cells between them, so that no gates come of it."""
    rows, columns = (floor.shape[0] + 2) // 3, (floor.shape[1] + 2) // 4
    if rows < 1 or columns < 1:
        return
    there = draw.units(rows, columns) < share
    floor[0 : 3 * rows : 3, 0 : 4 * columns : 4] = there
    floor[0 : 3 * rows : 3, 1 : 4 * columns : 4] = there
