"""Maps and swarms that these tests share."""

from __future__ import annotations

import numpy as np

import lampyris
from lampyris.model.grid import Grid
from lampyris.model.settings.swarm import SwarmSettings


def walled(seed: int = 0, side: int = 24, share: float = 0.12) -> Grid:
    """A square map with single blocked cells at random."""
    rng = np.random.default_rng(seed)
    return lampyris.Grid(rng.random((side, side)) < share, resolution=0.5)


def halls() -> Grid:
    """Two halls and a wall between them with a door in a corner."""
    blocked = np.zeros((12, 20), dtype=bool)
    blocked[1:, 10] = True
    return lampyris.Grid(blocked)


def filled(grid: Grid, **settings: object) -> SwarmSettings:
    return SwarmSettings.of(settings).on(grid)
