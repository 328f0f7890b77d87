"""Maps of IR-SIM as grids."""

from __future__ import annotations

from typing import Any

import numpy as np

from lampyris.errors import SettingError, shown
from lampyris.model.grid import Grid
from lampyris.typing import BoolGrid

OCCUPIED = 50.0
"""Occupancy, 0 to 100, above which IR-SIM takes a cell as occupied."""
_SQUARE = 1e-6
"""Relative difference of the two sides of a cell."""


def grid_of(env_map: Any, resolution: float | None = None) -> Grid:
    """The map of an IR-SIM environment as a grid; see :meth:`lampyris.Grid.from_irsim`.

    Parameters
    ----------
    env_map : what ``env.get_map(resolution)`` returns, or the environment.
    resolution : metres a cell, with an environment; None: 0.1.

    Raises
    ------
    SettingError : ``IRSIM``: something else, or cells that are not squares.
    """
    if hasattr(env_map, "get_map"):
        env_map = env_map.get_map(0.1 if resolution is None else resolution)
    elif resolution is not None:
        raise SettingError("IRSIM", shown(resolution), where="resolution", allowed="None: the map has one")
    if not all(hasattr(env_map, name) for name in ("width", "height", "resolution", "obstacle_list")):
        allowed = "an environment of IR-SIM, or what its get_map() returns"
        raise SettingError("IRSIM", f"a {type(env_map).__name__}", where="env_map", allowed=allowed)
    width, height, step = (float(getattr(env_map, name)) for name in ("width", "height", "resolution"))
    x0, y0 = (float(value) for value in np.asarray(getattr(env_map, "world_offset", (0.0, 0.0))).ravel()[:2])
    occupancy = getattr(env_map, "grid", None)
    if occupancy is None:
        columns, rows = max(round(width / step), 1), max(round(height / step), 1)
        blocked = np.zeros((rows, columns), dtype=np.bool_)
    else:
        values = np.asarray(occupancy, dtype=np.float64)
        blocked = np.ascontiguousarray(values.T[::-1] > OCCUPIED)
        rows, columns = blocked.shape
        step = width / columns
        if abs(height / rows - step) > _SQUARE * step:
            what = f"cells of {step:g} x {height / rows:g} m"
            raise SettingError("IRSIM", what, where="env_map", allowed="square cells")
    for obstacle in env_map.obstacle_list:
        _cover(blocked, getattr(obstacle, "_geometry", obstacle), x0, y0, step)
    return Grid(blocked, resolution=step, origin=(x0, y0, 0.0), name="ir-sim")


def _cover(blocked: BoolGrid, geometry: Any, x0: float, y0: float, step: float) -> None:
    """Block every cell that a shapely geometry touches."""
    import shapely  # what made the geometry

    rows, columns = blocked.shape
    left, low, right, high = geometry.bounds
    i = np.arange(max(int((left - x0) / step) - 1, 0), min(int((right - x0) / step) + 2, columns))
    j = np.arange(max(int((low - y0) / step) - 1, 0), min(int((high - y0) / step) + 2, rows))
    if not len(i) or not len(j):
        return
    x, y = np.meshgrid(x0 + i * step, y0 + j * step)
    touched = shapely.intersects(shapely.box(x, y, x + step, y + step), geometry)
    blocked[np.ix_(rows - 1 - j, i)] |= touched
