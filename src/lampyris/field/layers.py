"""Layers: what a cell offers besides distance. Where the robot's centre may be, and how far the nearest wall is.

Walls are the *squares* of blocked cells, not their centres, and everything is measured in whole half cells, so that a
robot exactly as wide as an opening fits through it on every machine.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from lampyris.model.grid import Grid, frozen
from lampyris.model.moves import Moves
from lampyris.model.scene import Scene
from lampyris.typing import BoolGrid, FloatGrid

_NO_WALL = 2**62
"""Squared distance where the map has no wall at all."""

_FORGIVEN = 1e-9
"""Share of the squared radius that the rounding of decimal numbers may eat: 0.3 m in a 0.6 m corridor fits."""


def free_space(scene: Scene) -> BoolGrid:
    """Where the robot's centre may be: bool, (height, width), read-only."""
    return free_cells(scene.grid, scene.robot.radius)


def free_cells(grid: Grid, radius: float) -> BoolGrid:
    """Cells whose centre is at least ``radius`` metres from every wall; bool, (height, width), read-only.

    The distance is to the nearest point of a blocked cell's square, so up to half a cell every free cell will do. The
    edge of the map is not a wall.
    """
    reach = 2.0 * radius / grid.resolution
    if reach <= 1.0 + _FORGIVEN:
        return frozen(~grid.blocked)
    need = math.ceil(reach * reach * (1.0 - _FORGIVEN))
    return frozen(_squared_half_cells(grid.blocked) >= need)


def moves_for(scene: Scene) -> Moves:
    """The scene's moves, made safe for a robot with a size.

    With a radius no diagonal cuts a corner: a disc swept from centre to centre keeps its distance exactly if the centres of
    all four cells around the step are free (every point of the step is, in each axis, at least as far from a wall as
    one of the four). Knight's steps are left out: a disc on one passes within a quarter of a cell of cells that the
    segment does not touch. A robot of radius 0 keeps the moves as they are.
    """
    moves = scene.moves
    if scene.robot.radius <= 0:
        return moves
    kept = [k for k, (dx, dy) in enumerate(moves.offsets) if abs(dx) <= 1 and abs(dy) <= 1]
    return replace(
        moves,
        offsets=tuple(moves.offsets[k] for k in kept),
        costs=tuple(moves.costs[k] for k in kept),
        corner_cutting=False,
    )


def clearance(grid: Grid) -> FloatGrid:
    """Distance from each cell's centre to the nearest wall surface; metres, float64, (height, width), read-only.

    0 in blocked cells, infinity where the map has no wall. The edge of the map is not a wall.
    """
    squared = _squared_half_cells(grid.blocked)
    half = 0.5 * grid.resolution
    return frozen(np.where(squared >= _NO_WALL, np.inf, np.sqrt(squared.astype(np.float64)) * half))


def _squared_half_cells(blocked: BoolGrid) -> np.ndarray:  # type: ignore[type-arg]
    height, width = blocked.shape
    out = np.full(blocked.shape, _NO_WALL, dtype=np.int64)
    ys, xs = np.nonzero(blocked)
    gx = np.arange(width)
    gy = np.arange(height)
    for y, x in zip(ys, xs, strict=True):
        dx = np.maximum(2 * np.abs(gx - x) - 1, 0) ** 2
        dy = np.maximum(2 * np.abs(gy - y) - 1, 0) ** 2
        np.minimum(out, dx[None, :] + dy[:, None], out=out)
    return out
