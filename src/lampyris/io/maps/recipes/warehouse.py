"""Warehouses: racks in zones, aisles between them, docks along one side."""

from __future__ import annotations

import numpy as np

from lampyris.io.maps.recipes.draw import Draw
from lampyris.io.maps.recipes.recipe import RecipeSetting, too_small
from lampyris.typing import BoolGrid

SETTINGS = (
    RecipeSetting("depth", 2, 1, 32, "depth of a rack, cells"),
    RecipeSetting("aisle", 3, 1, 64, "width of the aisles between racks, cells"),
    RecipeSetting("cross", 4, 1, 64, "width of the aisles between zones and along the walls, cells"),
    RecipeSetting("zone", 30, 8, 1024, "side of a zone of racks, cells"),
    RecipeSetting("bay", 4, 1, 64, "length of a rack's bays, cells"),
    RecipeSetting("gaps", 0.08, 0.0, 1.0, "share of the bays that are missing"),
    RecipeSetting("turned", 0.3, 0.0, 1.0, "share of the zones whose racks stand the other way"),
    RecipeSetting("staging", 10, 2, 256, "depth of the floor before the docks, cells"),
    RecipeSetting("dock", 4, 1, 64, "width of a dock, cells"),
    RecipeSetting("pallets", 0.25, 0.0, 1.0, "share of the places on that floor where a pallet stands"),
)
DOCK_DEPTH = 3


def warehouse(
    draw: Draw,
    width: int,
    height: int,
    *,
    depth: int,
    aisle: int,
    cross: int,
    zone: int,
    bay: int,
    gaps: float,
    turned: float,
    staging: int,
    dock: int,
    pallets: float,
) -> BoolGrid:
    """A walled hall with zones of racks above and docks below.

    Racks and pallets never touch a wall or each other's ends, so every free cell is reached by aisles.
    """
    floor = height - DOCK_DEPTH - staging
    need = 2 * cross + 2 + depth
    if width < need or floor < need:
        raise too_small(
            "one rack", width, height, f"{need} x {need + DOCK_DEPTH + staging} or more for these settings"
        )
    blocked = np.ones((height, width), dtype=np.bool_)
    blocked[1 : height - DOCK_DEPTH, 1 : width - 1] = False
    for x0, x1 in _zones(1 + cross, width - 2 - cross, zone, cross):
        for y0, y1 in _zones(1 + cross, floor - 1, zone, cross):
            upright = draw.unit() < turned
            long, broad = (y1 - y0 + 1, x1 - x0 + 1) if upright else (x1 - x0 + 1, y1 - y0 + 1)
            racks = _racks(draw, long, broad, depth, aisle, bay, gaps)
            blocked[y0 : y1 + 1, x0 : x1 + 1] = racks.T if upright else racks
    _put_pallets(draw, blocked[floor + 1 : height - DOCK_DEPTH - 1, 2 : width - 2], pallets)
    for x in range(1 + dock, width - 1 - 2 * dock, 2 * dock):
        if draw.below(8):
            blocked[height - DOCK_DEPTH :, x : x + dock] = False
    return blocked


def _zones(low: int, high: int, side: int, cross: int) -> list[tuple[int, int]]:
    """Divide low..high into zones of about that side with aisles between: (first, last) of each."""
    count = max(1, (high - low + 1 + cross) // (side + cross))
    cells = high - low + 1 - (count - 1) * cross
    ends = [low + cells * k // count + k * cross for k in range(count + 1)]
    return [(ends[k], ends[k + 1] - cross - 1) for k in range(count)]


def _racks(draw: Draw, long: int, broad: int, depth: int, aisle: int, bay: int, gaps: float) -> BoolGrid:
    """Racks side by side, bool (broad, long); what is left over of the breadth widens the last aisle."""
    lines = max(1, (broad + aisle) // (depth + aisle))
    there = draw.units(lines, -(-long // bay)) >= gaps
    rows = np.zeros((broad, long), dtype=np.bool_)
    for k, line in enumerate(np.repeat(there, bay, axis=1)[:, :long]):
        rows[k * (depth + aisle) : k * (depth + aisle) + depth] = line
    return rows


def _put_pallets(draw: Draw, floor: BoolGrid, share: float) -> None:
    """Pallets of 2 x 2 cells at places of a lattice with two free cells between."""
    rows, columns = (floor.shape[0] + 2) // 4, (floor.shape[1] + 2) // 4
    if rows < 1 or columns < 1:
        return
    there = draw.units(rows, columns) < share
    for dy in range(2):
        for dx in range(2):
            floor[dy : 4 * rows : 4, dx : 4 * columns : 4] = there
