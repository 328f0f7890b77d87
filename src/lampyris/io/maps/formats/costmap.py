"""Costmap values: what a number from 0 to 255 says of a cell, as the costmaps of ROS 2 have it.

0 is free, 1 to 252 is terrain (:class:`lampyris.model.grid.Grid` says what it costs), 253 is inscribed (a
robot whose centre is there touches something) and 254 lethal, both blocked here, and 255 is unknown.

Nav2 publishes a costmap as an occupancy grid, in which there are only 0 to 100 and -1, by a table of its
own (``costmap_2d_publisher.cpp``): 0, 253, 254 and 255 become 0, 99, 100 and -1, and a value c from 1 to 252
becomes ``1 + 97 (c - 1) / 251`` in whole numbers, so 1 to 98. :data:`FROM_OCCUPANCY` is the way back. Two or
three values share an occupancy from 1 to 97, and the costliest of them is taken, ``min(252, 1 + (251 v - 1) /
97)``: of what was rounded off none is given away for nothing, and there and back again is the same
occupancy. The road not taken is Nav2's constructor of a Costmap2D from an occupancy grid, ``round(2.54 v)``:
it is not the inverse of the table, 98 comes back as 249 and 99 as terrain.
"""

from __future__ import annotations

import numpy as np

from lampyris._core.arrays import index_array
from lampyris.errors import SettingError, plural
from lampyris.io.maps.formats.document import (
    BLOCKED,
    FREE,
    UNKNOWN,
    CodeGrid,
    FileSource,
    Occupancy,
    Reading,
    grid_codes,
    look_up,
)
from lampyris.model.grid import MAX_TERRAIN, Grid
from lampyris.typing import ByteGrid

INSCRIBED, LETHAL, NO_INFORMATION = 253, 254, 255
ALLOWED = "0 free, 1 to 252 terrain, 253 and 254 blocked, 255 unknown"

_CODES = np.full(256, FREE, dtype=np.uint8)
_CODES[[INSCRIBED, LETHAL]] = BLOCKED
_CODES[NO_INFORMATION] = UNKNOWN
_TERRAIN = np.arange(256, dtype=np.uint8)
_TERRAIN[MAX_TERRAIN + 1 :] = 0


def _to_occupancy() -> Occupancy:
    cost = np.arange(256)
    table = 1 + 97 * (cost - 1) // 251
    table[[0, INSCRIBED, LETHAL, NO_INFORMATION]] = 0, 99, 100, -1
    return table.astype(np.int8)


def _from_occupancy() -> CodeGrid:
    value = np.arange(256)
    table = np.minimum(MAX_TERRAIN, 1 + (251 * value - 1) // 97)
    table[0], table[99], table[100] = 0, INSCRIBED, LETHAL
    table[101:] = NO_INFORMATION  # -1 is 255 as a byte; nothing else is ever looked up there
    return table.astype(np.uint8)


TO_OCCUPANCY = _to_occupancy()
"""The occupancy of each costmap value, int8 (256,)."""
FROM_OCCUPANCY = _from_occupancy()
"""The costmap value of each occupancy, as a byte, uint8 (256,)."""


def read_costs(costs: ByteGrid) -> Reading:
    """Codes and terrain of costmap values, uint8 (height, width)."""
    codes = look_up(_CODES, costs)
    count = np.bincount(index_array(costs.ravel()), minlength=256)
    return Reading(codes, (_note(count),), terrain=look_up(_TERRAIN, costs))


def _note(count: np.ndarray) -> str:
    """How many cells there are of which kind, and between which values the terrain lies."""
    used = np.flatnonzero(count[1 : MAX_TERRAIN + 1]) + 1
    words = ["no terrain"]
    if used.size:
        n = int(count[1 : MAX_TERRAIN + 1].sum())
        low, high = int(used[0]), int(used[-1])
        words = [f"{plural(n, 'cell')} of terrain, " + (f"{low} to {high}" if low < high else f"all {low}")]
    words.append(f"{int(count[INSCRIBED] + count[LETHAL]):,} blocked")
    words.append(f"{int(count[NO_INFORMATION]):,} unknown")
    return f"read as costmap values: {', '.join(words)}"


def costs_of(grid: Grid, *, terrain: bool = True) -> ByteGrid:
    """The costmap value of each cell, uint8 (height, width): 254 blocked, 255 unknown, and where it is free
    its terrain, or 0 where that is not wanted.
    """
    costs = np.zeros_like(grid.blocked, dtype=np.uint8)
    if terrain and grid.terrain is not None:
        costs[:] = grid.terrain
    codes = grid_codes(grid)
    costs[codes == BLOCKED] = LETHAL
    costs[codes == UNKNOWN] = NO_INFORMATION
    return costs


def no_numbers(source: FileSource, kind: str) -> None:
    """Refuse ``values="costmap"`` for a format that has no numbers.

    Raises
    ------
    SettingError : VALUES.
    """
    if source.values == "costmap":
        raise SettingError(
            "VALUES",
            f"{kind} has no costmap values",
            where=source.name,
            allowed="costmap values in PNG, BMP, PGM, NumPy, CSV or ROS YAML",
            setting="values",
        )
