"""Keepout zones: where a robot must not be, from a mask of Nav2's keepout filter.

A mask is a ROS map (YAML and picture): 100 keeps out, 1 to 99 cost as much as ``round(2.54 v)`` of a costmap, 0 and unknown
change nothing (Nav2, ``nav2_costmap_2d``: ``CostmapFilter::getMaskCost``, ``KeepoutFilter::process``). A mask may have another
size, resolution and origin than the map: each cell of the map takes the value of the mask at its centre.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from lampyris._core.limits import MAX_CELLS
from lampyris.errors import FileError, UsageError, plural
from lampyris.io.files import read_regular
from lampyris.io.maps.formats.document import FileSource, byte_limit
from lampyris.io.maps.formats.ros import read_ros
from lampyris.model.grid import MAX_TERRAIN, Grid, frozen
from lampyris.typing import BoolGrid, ByteGrid

SUFFIXES = (".yaml", ".yml")


def read_keepout(
    path: str | os.PathLike[str], grid: Grid, *, allow_outside: bool = False
) -> tuple[BoolGrid, ByteGrid, tuple[str, ...]]:
    """Read a keepout mask.

    Parameters
    ----------
    path : the mask's YAML.
    grid : the map.
    allow_outside : whether its picture may be outside its folder.

    Returns
    -------
    kept : where the robot must not be besides the map's own walls, bool, (height, width).
    costs : what the other cells cost at least, 0 to 252, uint8, (height, width).
    notes : notes for the user.

    Raises
    ------
    UsageError : SUFFIX: another kind of file.
    FileError : KEEPOUT_MAP: the mask covers no cell of the map; and what the reader of such maps says.
    LimitError : larger than a map may be.
    """
    name = os.fspath(path)
    suffix = Path(name).suffix.lower()
    if suffix not in SUFFIXES:
        raise UsageError("SUFFIX", repr(suffix), where=name, allowed=", ".join(SUFFIXES))
    reading = read_ros(FileSource(read_regular(name, byte_limit(MAX_CELLS)), name, MAX_CELLS, allow_outside))
    assert reading.occupancy is not None
    mask = Grid(np.zeros(reading.occupancy.shape, bool), None, reading.resolution or 1.0, reading.origin)
    y, x = np.indices(grid.blocked.shape)
    metres = grid.to_metres(np.column_stack((x.ravel(), y.ravel())))
    cells = np.floor(mask.to_points(metres[:, 0], metres[:, 1]) + 0.5 + 1e-9).astype(np.int64)
    on = (cells >= 0).all(axis=1) & (cells[:, 0] < mask.width) & (cells[:, 1] < mask.height)
    if not on.any():
        place = f"origin [{', '.join(f'{v:g}' for v in mask.origin)}]"
        raise FileError(
            "KEEPOUT_MAP",
            f"no cell of the map, {place}",
            where=name,
            allowed="a mask that covers cells of it",
        )
    value = np.zeros(grid.blocked.size, dtype=np.int64)
    value[on] = reading.occupancy[cells[on, 1], cells[on, 0]]
    at = np.maximum(value, 0).reshape(grid.blocked.shape)
    kept = (at == 100) & ~grid.blocked
    costs = np.minimum((254 * at + 50) // 100, MAX_TERRAIN)  # halves upwards, as std::round
    costs[kept | grid.blocked] = 0
    words = [f"{plural(int(kept.sum()), 'free cell')} kept out"]
    if costs.any():
        words.append(
            f"{plural(int((costs > 0).sum()), 'cell')} with a cost of {int(costs[costs > 0].min())} to {costs.max()}"
        )
    left = int((~on).sum())
    if left:
        words.append(f"{plural(left, 'cell')} beyond the mask")
    kept_notes = tuple(n for n in reading.notes if "occupancy 1 to 99" not in n)
    return frozen(kept), frozen(costs.astype(np.uint8)), (*kept_notes, f"keepout mask: {', '.join(words)}")
