"""Random scenes and plain counts for the tests of swarm planners."""

from __future__ import annotations

import numpy as np

from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene

NAMES = tuple(MOVES)


def random_scene(seed: int, *, low: int = 4, high: int = 22) -> Scene:
    """A map of scattered walls, sometimes with terrain, sometimes a wide robot; ends on cells that are free
    of walls, mostly."""
    rng = np.random.default_rng([77, seed])
    height, width = (int(n) for n in rng.integers(low, high, size=2))
    walls = rng.random((height, width)) < rng.choice([0.0, 0.1, 0.25, 0.35])
    if rng.random() < 0.3:
        walls[height // 2, :-1] = True  # a wall with a way round
    ends = [(int(rng.integers(width)), int(rng.integers(height))) for _ in range(2)]
    if rng.random() < 0.9:
        for x, y in ends:
            walls[y, x] = False
    terrain = None
    if rng.random() < 0.3:
        terrain = rng.integers(0, 253, size=(height, width)) * (rng.random((height, width)) < 0.5)
    robot = Robot(radius=float(rng.choice([0.0, 0.0, 0.0, 0.8])))
    return Scene(Grid(walls, terrain=terrain), ends[0], ends[1], NAMES[seed % len(NAMES)], robot)


def scene_of(rows: list[str], moves: str = "dissertation") -> Scene:
    """A scene drawn in rows: # walls, S start, G goal."""
    cells = {c: (x, y) for y, row in enumerate(rows) for x, c in enumerate(row) if c in "SG"}
    walls = np.array([[c == "#" for c in row] for row in rows])
    return Scene(Grid(walls), cells["S"], cells["G"], moves)
