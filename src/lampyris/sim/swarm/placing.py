"""Where the robots of a swarm begin, and where sources are drawn."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lampyris.errors import SettingError
from lampyris.model.grid import Grid
from lampyris.planning.field.layers import free_cells, largest_region
from lampyris.typing import Floats

_TRIES = 1000
"""Draws for a robot before the map counts as full."""


def open_cells(grid: Grid, radius: float) -> NDArray[np.int64]:
    """The cells (x, y) of the largest region in which a disc can drive from one centre of a cell to the next.

    Raises
    ------
    SettingError : ``ROBOTS``: there is none.
    """
    free = np.array(free_cells(grid, radius))
    edge = math.ceil(max(0.0, radius / grid.resolution - 0.5) * (1.0 - 1e-9))
    if edge:
        free[:edge] = free[-edge:] = False
        free[:, :edge] = free[:, -edge:] = False
    cells = largest_region(free)
    if not len(cells):
        raise SettingError.of(
            "ROBOTS", "radius", f"{radius:g} m", allowed="a radius with which a robot fits on the map"
        )
    return cells


def draw_starts(grid: Grid, robots: int, radius: float, gap: float, rng: np.random.Generator) -> Floats:
    """Places at random, apart from each other and from walls; float64 (n, 2), metres from the upper left corner, y down.

    Robots are drawn one by one, uniformly over the region's cells and within a cell, and drawn again where there is no room.

    Raises
    ------
    SettingError : ``ROBOTS``: no room for so many.
    """
    cells = open_cells(grid, radius)
    size, away = grid.resolution, radius + gap
    side = 2 * away
    taken: dict[tuple[int, int], list[tuple[float, float]]] = {}
    made = np.empty((robots, 2))
    for k in range(robots):
        for _ in range(_TRIES):
            u = rng.random(3)
            column, row = cells[min(int(u[0] * len(cells)), len(cells) - 1)].tolist()
            x, y = (column + u.item(1)) * size, (row + u.item(2)) * size
            if not touches_wall(grid, x, y, away) and not _near(taken, side, x, y):
                break
        else:
            todo = "take fewer or smaller robots, or a larger map"
            raise SettingError.of("ROBOTS", "robots", f"{robots:,}", allowed=f"at most {k:,} here", todo=todo)
        taken.setdefault((int(x / side), int(y / side)), []).append((x, y))
        made[k] = x, y
    return made


def _near(taken: dict[tuple[int, int], list[tuple[float, float]]], side: float, x: float, y: float) -> bool:
    column, row = int(x / side), int(y / side)
    for v in range(row - 1, row + 2):
        for u in range(column - 1, column + 2):
            for ox, oy in taken.get((u, v), ()):
                if (ox - x) * (ox - x) + (oy - y) * (oy - y) < side * side:
                    return True
    return False


def touches_wall(grid: Grid, x: float, y: float, away: float) -> bool:
    """Whether a point, metres from the upper left corner, is nearer to a wall or the edge of the map than ``away``."""
    size = grid.resolution
    if min(x, y, grid.width * size - x, grid.height * size - y) < away:
        return True
    low_x, high_x = int((x - away) / size), int((x + away) / size)
    low_y, high_y = int((y - away) / size), int((y + away) / size)
    part = grid.blocked[low_y : high_y + 1, low_x : high_x + 1]
    for v, u in np.argwhere(part).tolist():
        left, top = (low_x + u) * size, (low_y + v) * size
        dx = x - min(max(x, left), left + size)
        dy = y - min(max(y, top), top + size)
        if dx * dx + dy * dy < away * away:
            return True
    return False
