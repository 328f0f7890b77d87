"""The artificial potential field over a ground, as a push on waypoints."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lampyris._core.cancellation import checkpoint
from lampyris.planning.field.frame import PART
from lampyris.planning.swarm.encoding import Encoding
from lampyris.planning.swarm.optimisers.box import Points
from lampyris.planning.swarm.optimisers.particle import Push
from lampyris.planning.swarm.search_space import SearchSpace
from lampyris.planning.swarm.session import Task

NEAREST = 0.25
"""Distance to a wall, in cells, below which the potential rises no more: that of a blocked cell."""


def push_of(task: Task, encoding: Encoding, attract: float, repel: float, reach: float) -> Push:
    """What the field adds to the speeds of particles.

    Parameters
    ----------
    attract : share of the distance to the middle of its two neighbours.
    repel, reach : eta and d0 of the repulsion, cells.
    """
    away = repulsion(task.ground, repel, reach).reshape(-1, 2)
    width = int(encoding.size[0])
    ends = np.stack((task.start, np.array(task.ground.scene.goal))) + 0.5

    def push(particles: Points) -> Points:
        at = encoding.places(particles)
        n, k = at.shape[:2]
        row = np.empty((n, k + 2, 2))
        row[:, 0], row[:, 1:-1], row[:, -1] = ends[0], at, ends[1]
        force = attract * (0.5 * (row[:, :-2] + row[:, 2:]) - at)
        cell = np.minimum(np.floor(at).astype(np.int64), encoding.size - 1)
        force = force + away[cell[..., 1] * width + cell[..., 0]]
        return encoding.spread(force)

    return push


def repulsion(ground: SearchSpace, eta: float, reach: float) -> NDArray[np.float64]:
    """Push from walls at each cell, float64 (height, width, 2), cells an iteration; none exceeds one cell.

    It is minus the central difference of ``U = eta / 2 (1/d - 1/d0)^2``, d the distance to the nearest wall.
    In a blocked cell, where U is flat, it leads to the nearest cell from which the goal can be reached.
    """
    grid = ground.scene.grid
    height, width = grid.blocked.shape
    force = np.empty((height, width, 2))
    rows = max(1, PART // width)
    for y in range(0, height, rows):
        checkpoint()
        end = min(y + rows, height)
        # One row more on either side; at the edge of the map it is the edge again.
        d = np.maximum(np.minimum(ground.room[max(y - 1, 0) : end + 1], reach), NEAREST)
        rise = 1.0 / d - 1.0 / reach
        beyond = ((int(y == 0), int(end == height)), (1, 1))
        potential = np.pad(0.5 * eta * rise * rise, beyond, mode="edge")
        part = force[y:end]
        part[..., 0] = 0.5 * (potential[1:-1, :-2] - potential[1:-1, 2:])
        part[..., 1] = 0.5 * (potential[:-2, 1:-1] - potential[2:, 1:-1])
        ys, xs = np.nonzero(grid.blocked[y:end])
        here = np.stack((xs, y + ys), axis=1)
        part[ys, xs] = ground.cells(ground.nearest[ground.flat(here)]) - here
        np.minimum(np.maximum(part, -1.0), 1.0, out=part)
    return force
