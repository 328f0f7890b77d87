"""nav_msgs/OccupancyGrid to Grid, and updates of a part of it."""

from __future__ import annotations

import math

import numpy as np

from lampyris._core.limits import MAX_CELLS
from lampyris.errors import InputError, LimitError, SettingError
from lampyris.io.maps.formats.costmap import FROM_OCCUPANCY
from lampyris.model.grid import Grid
from lampyris.ros.messages import Fields, pose_of

OCCUPIED, FREE = 65, 19
"""From which occupancy a cell is blocked, and up to which it is free: what nav2_map_server saves by default, per cent."""


def grid_of(fields: Fields, *, costs: bool = False, name: str = "") -> Grid:
    """The grid of an OccupancyGrid.

    Parameters
    ----------
    fields : the message.
    costs : its values are costs as Nav2 publishes a costmap: 1 to 98 become terrain, 99 and 100 are blocked. Else they are
        occupancies: 65 and more is blocked, 19 and less free, all between unknown.
    name : of the grid.

    Raises
    ------
    InputError : ``OCCUPANCY``: a size that is not that of its data, a resolution that is none, values beyond -1 to 100.
    LimitError : ``MAP_TOO_LARGE``.
    """
    info = fields["info"]
    width, height = int(info["width"]), int(info["height"])
    data = np.asarray(fields["data"], dtype=np.int64)
    resolution = float(
        str(np.float32(info["resolution"]))
    )  # 32 bits in the message: the shortest number that it may be
    if not (width > 0 and height > 0 and data.size == width * height and math.isfinite(resolution)):
        what = f"{width} x {height} cells with {data.size:,} values"
        raise InputError("OCCUPANCY", what, where=name or "OccupancyGrid", allowed="one value a cell")
    if data.size > MAX_CELLS:
        raise LimitError(
            "MAP_TOO_LARGE", f"{data.size:,} cells", where=name or "OccupancyGrid", allowed=f"{MAX_CELLS:,}"
        )
    beyond = data[(data < -1) | (data > 100)]
    if beyond.size:
        raise InputError(
            "OCCUPANCY", f"value {beyond[0]}", where=name or "OccupancyGrid", allowed="-1 to 100"
        )
    data = data.reshape(height, width)[::-1]
    unknown = data < 0
    terrain = None
    if costs:
        blocked = (data >= 99) | unknown
        terrain = np.where(blocked, 0, FROM_OCCUPANCY[np.clip(data, 0, 100)])
    else:
        unknown |= (data > FREE) & (data < OCCUPIED)
        blocked = (data >= OCCUPIED) | unknown
    try:
        return Grid(blocked, unknown, resolution, pose_of(info["origin"]), name, terrain)
    except SettingError as fault:
        raise InputError(
            "OCCUPANCY", fault.what, where=name or "OccupancyGrid", allowed=fault.allowed
        ) from None


def updated(fields: Fields, update: Fields) -> dict[str, object]:
    """An OccupancyGrid after an OccupancyGridUpdate.

    Raises
    ------
    InputError : ``OCCUPANCY``: a part that is not within the map.
    """
    info = fields["info"]
    width, height = int(info["width"]), int(info["height"])
    x, y, w, h = (int(update[key]) for key in ("x", "y", "width", "height"))
    part = np.asarray(update["data"], dtype=np.int8)
    if min(x, y, w, h) < 0 or x + w > width or y + h > height or part.size != w * h:
        what = f"an update of {w} x {h} cells at ({x}, {y}) with {part.size:,} values"
        raise InputError("OCCUPANCY", what, where="update", allowed=f"within {width} x {height} cells")
    data = np.array(fields["data"], dtype=np.int8).reshape(height, width)
    data[y : y + h, x : x + w] = part.reshape(h, w)
    return {**fields, "data": data.ravel()}
