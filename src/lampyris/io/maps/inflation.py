"""Costs of the cells near walls, cell by cell as the inflation layer of Nav2 computes them.

Nav2, ``nav2_costmap_2d/plugins/inflation_layer.cpp``. With the distance d of a cell's centre from the centre of the
nearest blocked cell, and the robot's inscribed radius r, the cost is 254 for d = 0, 253 for d <= r, and
``252 * exp(-cost_scaling_factor * (d - r))``, cut to a whole number, up to the inflation radius in cells, rounded up.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lampyris._core import elementary
from lampyris._core.scalars import in_range
from lampyris.errors import SettingError, of_kind, shown
from lampyris.kernels.field.wall_distances import wall_distances
from lampyris.model.grid import MAX_TERRAIN, Grid, frozen
from lampyris.model.robot import GREATEST, Robot
from lampyris.model.settings.inflation import Inflation
from lampyris.typing import ByteGrid

LETHAL, INSCRIBED, UNKNOWN = 254, 253, 255
_NEVER = 2**60
_TABLE = 2**22
"""Squared distances in cells, up to which costs are looked up in a table."""


def inflation_costs(
    grid: Grid, inscribed_radius: float, inflation_radius: float, cost_scaling_factor: float = 10.0
) -> ByteGrid:
    """A costmap as Nav2's inflation layer makes it; uint8, (height, width), read-only.

    Parameters
    ----------
    grid : blocked cells that are not unknown are obstacles (254); terrain is what cells cost already.
    inscribed_radius : of the robot (:attr:`lampyris.Robot.inscribed_radius`), metres: cells no farther from an
        obstacle cost 253.
    inflation_radius : metres; cells farther from every obstacle keep their cost.
    cost_scaling_factor : 1/m.

    Returns
    -------
    0 free, 1 to 252, 253 (the robot's centre cannot be there), 254 obstacle, 255 unknown; the greater of inflation
    and terrain. Unknown cells stay so unless they are within the inscribed radius, which is Nav2's default.

    Raises
    ------
    SettingError : a radius or a factor that is negative, not finite or too large.

    Notes
    -----
    Nav2 spreads each obstacle from cell to cell, and where the nearest obstacle cannot be reached through cells that
    are nearest to it, takes one that is a little farther; distances are exact here, so that such cells cost a little
    more. Everything is computed with 64 bits; a map that came as a ROS message has a resolution of 32 bits.

    Examples
    --------
    >>> import numpy as np
    >>> wall = np.zeros((1, 6), dtype=bool)
    >>> wall[0, 0] = True
    >>> inflation_costs(Grid(wall, resolution=0.1), 0.15, 0.4, 5.0).tolist()
    [[254, 253, 196, 119, 72, 0]]
    """
    of_kind("grid", grid, Grid)
    if not in_range(inscribed_radius, 0.0, GREATEST):
        raise SettingError.of(
            "INSCRIBED_RADIUS", "inscribed_radius", shown(inscribed_radius), allowed="0 to 1e6 metres"
        )
    return _costs(grid, float(inscribed_radius), Inflation(inflation_radius, cost_scaling_factor))


def inflate(grid: Grid, robot: Robot, inflation_radius: float, cost_scaling_factor: float = 10.0) -> Grid:
    """The map with terrain that keeps a robot away from walls: every planner prefers the middle of a corridor.

    Parameters
    ----------
    grid : the map; each cell gets the greater of its terrain and the inflation.
    robot : its inscribed radius is where costs begin to fall.
    inflation_radius : metres; 0 leaves the map as it is.
    cost_scaling_factor : 1/m; a smaller factor keeps farther away.

    Returns
    -------
    A grid whose terrain is :func:`inflation_costs`; free cells of 253 have the highest terrain value, 252.

    Raises
    ------
    SettingError : a radius or a factor out of its range.

    Examples
    --------
    >>> import numpy as np
    >>> wall = np.zeros((1, 6), dtype=bool)
    >>> wall[0, 0] = True
    >>> inflate(Grid(wall, resolution=0.1), Robot(radius=0.15), 0.4, 5.0).terrain.tolist()
    [[0, 252, 196, 119, 72, 0]]
    """
    of_kind("grid", grid, Grid)
    of_kind("robot", robot, Robot)
    return inflated(grid, robot, Inflation(inflation_radius, cost_scaling_factor))


def inflated(grid: Grid, robot: Robot, settings: Inflation) -> Grid:
    """:func:`inflate` by declared settings."""
    if settings.inflation_radius == 0:
        return grid
    costs = _costs(grid, robot.inscribed_radius, settings)
    return replace(grid, terrain=np.where(grid.blocked, 0, np.minimum(costs, MAX_TERRAIN)))


def _costs(grid: Grid, inscribed: float, settings: Inflation) -> ByteGrid:
    lethal = grid.blocked if grid.unknown is None else grid.blocked & ~grid.unknown
    old = np.zeros(grid.blocked.shape, np.uint8) if grid.terrain is None else grid.terrain.copy()
    old[lethal] = LETHAL
    if grid.unknown is not None:
        old[grid.unknown] = UNKNOWN
    cells = math.ceil(settings.inflation_radius / grid.resolution)
    if cells == 0 or not lethal.any():
        return frozen(old)
    squared = _squared_cells(lethal)
    most = min(cells * cells, int(squared.max()))
    if most <= _TABLE:
        table = _cost_of(np.arange(most + 1), grid.resolution, inscribed, settings.cost_scaling_factor)
        table = np.append(table, np.uint8(0))
        costs = table[np.minimum(squared, most + 1)]
    else:
        near = squared <= most
        values, places = np.unique(squared[near], return_inverse=True)
        costs = np.zeros(squared.shape, np.uint8)
        costs[near] = _cost_of(values, grid.resolution, inscribed, settings.cost_scaling_factor)[places]
    made = np.maximum(old, costs)
    if grid.unknown is not None:
        within = grid.unknown & (costs >= INSCRIBED)
        made[within] = costs[within]
    return frozen(made)


def _cost_of(
    squared: NDArray[np.int64], resolution: float, inscribed: float, factor: float
) -> NDArray[np.uint8]:
    """Costs at squared distances in cells."""
    metres = np.sqrt(squared.astype(np.float64)) * resolution
    falling = MAX_TERRAIN * elementary.exp(np.minimum(-factor * (metres - inscribed), 0.0))
    costs = np.where(metres <= inscribed, INSCRIBED, np.floor(falling)).astype(np.uint8)
    costs[squared == 0] = LETHAL
    return costs


def _squared_cells(lethal: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Squared distance of each cell's centre from that of the nearest obstacle, in cells."""
    return wall_distances(lethal, _NEVER, edge=False) >> 2
