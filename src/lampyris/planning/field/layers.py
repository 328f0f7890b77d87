"""Layers: what a cell offers besides distance: whether the robot's centre may be there, and how far the
next wall is.

Walls are the *squares* of blocked cells, not their centres, and everything is measured in whole half cells,
so that a robot exactly as wide as an opening fits through it on every machine.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lampyris._core.arrays import index_array
from lampyris._core.cancellation import checkpoint
from lampyris.kernels.field.wall_distances import wall_distances
from lampyris.model.grid import Grid, frozen
from lampyris.model.moves import Moves
from lampyris.model.scene import Scene
from lampyris.typing import BoolGrid, FloatGrid

_NEVER = 2**60
"""Squared half cells to the nearest wall of a map that has none."""

_PART = 2**12
"""Cells that are converted at once."""
FORGIVEN = 1e-9
"""Share of a length that decimal rounding may eat, so that 0.3 m of radius fits a corridor of 0.6 m."""


def free_space(scene: Scene) -> BoolGrid:
    """Where the robot's centre may be; bool, (height, width), read-only."""
    return free_cells(scene.grid, scene.robot.radius)


def free_cells(grid: Grid, radius: float) -> BoolGrid:
    """Cells whose centre is at least ``radius`` metres from every wall; bool, (height, width), read-only.

    The distance is to the nearest point of a blocked cell's square, so up to half a cell every free cell
    will do. The edge of the map is not a wall.
    """
    reach = 2.0 * radius / grid.resolution * (1.0 - FORGIVEN)
    if reach <= 1.0:
        return frozen(~grid.blocked)
    return frozen(_squared_half_cells(grid.blocked) >= math.ceil(reach * reach))


def largest_region(free: BoolGrid) -> NDArray[np.int64]:
    """The cells (x, y) of the largest region of free cells that four-connected steps connect, row by row; int64, (n, 2)."""
    from scipy import ndimage  # bits: labels, whole numbers

    labels, regions = ndimage.label(free)
    if regions == 0:
        return np.zeros((0, 2), dtype=np.int64)
    sizes = np.bincount(index_array(labels.ravel()))[1:]
    y, x = np.nonzero(labels == 1 + int(sizes.argmax()))
    return np.stack((x, y), axis=1)


def moves_for(scene: Scene) -> Moves:
    """The scene's moves, made safe for a robot with a size, in the costs of its map.

    A robot of radius 0 keeps its steps as they are. Costs: see :func:`moves_on`.

    With a radius no diagonal cuts a corner. That is enough: every point of a step lies, in each axis, at
    least as far from a wall as one of the four cell centres around the step, so a disc swept from centre to
    centre keeps its distance if those four are free. Knight's steps are left out: halfway along one, a disc
    comes within a quarter of a cell of squares that its centre line does not touch.
    """
    return safe_moves(scene.grid, scene.robot.radius, scene.moves)


def safe_moves(grid: Grid, radius: float, moves: Moves) -> Moves:
    """See :func:`moves_for`; ``radius`` is the robot's, metres."""
    moves = moves_on(grid, moves)
    if radius <= 0:
        return moves
    kept = [k for k, (dx, dy) in enumerate(moves.offsets) if abs(dx) <= 1 and abs(dy) <= 1]
    return replace(
        moves,
        offsets=tuple(moves.offsets[k] for k in kept),
        costs=tuple(moves.costs[k] for k in kept),
        corner_cutting=False,
    )


def moves_on(grid: Grid, moves: Moves) -> Moves:
    """The same steps in the costs of a map: weighed exactly where the map has terrain."""
    return moves.plain() if grid.terrain is None else moves.weighed()


def clearance(grid: Grid) -> FloatGrid:
    """Distance from each cell's centre to the nearest wall surface; metres, float64, (height, width),
    read-only.

    0 in blocked cells, infinity where the map has no wall. The edge of the map is not a wall.
    """
    squared = _squared_half_cells(grid.blocked).reshape(-1)
    metres = squared.view(np.float64)
    # In the same memory, part by part: no more than the result itself is ever held.
    for k in range(0, squared.size, _PART):
        if k % (64 * _PART) == 0:
            checkpoint()
        part = squared[k : k + _PART]
        metres[k : k + _PART] = np.where(part < _NEVER, np.sqrt(part) * (0.5 * grid.resolution), np.inf)
    return frozen(metres.reshape(grid.blocked.shape))


def _squared_half_cells(blocked: BoolGrid) -> NDArray[np.int64]:
    return wall_distances(blocked, _NEVER, edge=True)
