"""Grids as xarray datasets: what ``Grid.to_xarray`` returns."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lampyris.errors import UsageError
from lampyris.model.grid import Grid

if TYPE_CHECKING:
    import xarray


def array_of(grid: Grid) -> xarray.Dataset:
    """See :meth:`lampyris.Grid.to_xarray`.

    Raises
    ------
    UsageError : ``XARRAY``: xarray is not installed; a map that is turned.
    """
    try:
        import xarray
    except ImportError:
        todo = "pip install 'lampyris[notebook]'"
        raise UsageError("XARRAY", "to_xarray needs xarray, which is not installed", todo=todo) from None
    x0, y0, yaw = grid.origin
    if yaw:
        what = f"the map is turned by {yaw:g} rad, so that rows and columns have no coordinates of their own"
        raise UsageError("XARRAY", what, where="origin", allowed="a yaw of 0")
    x = x0 + (np.arange(grid.width) + 0.5) * grid.resolution
    y = y0 + (np.arange(grid.height) + 0.5) * grid.resolution
    layers = {"blocked": grid.blocked, "unknown": grid.unknown, "terrain": grid.terrain}
    return xarray.Dataset(
        {name: (("y", "x"), layer[::-1].copy()) for name, layer in layers.items() if layer is not None},
        coords={
            "x": ("x", x, {"units": "m", "long_name": "x of the map frame"}),
            "y": ("y", y, {"units": "m", "long_name": "y of the map frame"}),
        },
        attrs={"name": grid.name, "resolution_m": grid.resolution},
    )
