"""How a particle of numbers becomes a walk over a ground, and a path a particle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lampyris.planning.swarm.optimisers.box import Box, Points
from lampyris.planning.swarm.search_space import Flags, Ints, SearchSpace
from lampyris.planning.swarm.walks import LineWalks, trace
from lampyris.typing import Cells

LONGEST = 64
"""Steps of the longest leg that is tried when a path is written as waypoints."""


@dataclass(frozen=True, slots=True, eq=False)
class Encoding:
    """How a particle, numbers from 0 to 1, becomes waypoints on a map.

    Parameters
    ----------
    base : cells, int64 (k, 2); coordinates that particles do not choose.
    chosen : bool (k, 2); coordinates they do choose, one number each.
    size : int64 (2,); width and height of the map.
    """

    base: Ints
    chosen: Flags
    size: Ints

    @property
    def box(self) -> Box:
        """The unit box of all particles."""
        d = int(self.chosen.sum())
        return Box(np.zeros(d), np.ones(d))

    @property
    def sides(self) -> NDArray[np.float64]:
        """Cells along the side that each number of a particle spans, (d,)."""
        return np.broadcast_to(self.size, self.chosen.shape)[self.chosen].astype(np.float64)

    def places(self, particles: Points) -> NDArray[np.float64]:
        """Waypoints (n, k, 2) in cells of the map, not rounded; the middle of a cell is at .5."""
        points = np.repeat(self.base[np.newaxis] + 0.5, len(particles), axis=0)
        points[:, self.chosen] = particles * self.sides
        return points

    def spread(self, vectors: NDArray[np.float64]) -> Points:
        """Vectors (n, k, 2) in cells as vectors (n, d) in the box."""
        inside: Points = (vectors / self.size)[:, self.chosen]
        return inside

    def of(self, waypoints: Ints) -> Points:
        """The particle (1, d) of these cells (k, 2)."""
        return self.spread(waypoints[np.newaxis].astype(np.float64) + 0.5)

    def lines(self, ground: SearchSpace, start: Ints, particles: Points) -> LineWalks:
        """The walks of particles (n, d): each waypoint on the nearest cell from which the goal can be
        reached, joined by straight grid lines."""
        cells = np.minimum(np.floor(self.places(particles)).astype(np.int64), self.size - 1)
        snapped = ground.cells(ground.nearest[ground.flat(cells)].ravel()).astype(np.int64)
        n, k = len(particles), len(self.base)
        nodes = np.empty((n, k + 2, 2), dtype=np.int64)
        nodes[:, 0] = start
        nodes[:, 1:-1] = snapped.reshape(n, k, 2)
        nodes[:, -1] = ground.scene.goal
        return LineWalks(ground, nodes)


def anywhere(ground: SearchSpace, waypoints: Ints) -> Encoding:
    """Waypoints that may lie anywhere on the map."""
    return Encoding(waypoints, np.ones(waypoints.shape, dtype=np.bool_), _size(ground))


def on_lines(ground: SearchSpace, start: Ints, waypoints: Ints) -> Encoding:
    """Waypoints each on a grid line of its own, across the main direction from start to goal."""
    d = np.abs(np.array(ground.scene.goal) - start)
    chosen = np.zeros(waypoints.shape, dtype=np.bool_)
    chosen[:, 1 if d[0] >= d[1] else 0] = True
    return Encoding(waypoints, chosen, _size(ground))


def _size(ground: SearchSpace) -> Ints:
    height, width = ground.open_cells.shape
    return np.array([width, height], dtype=np.int64)


def evenly(start: Ints, goal: Ints, k: int) -> Ints:
    """k cells evenly spaced between two, int64 (k, 2)."""
    share = np.arange(1, k + 1, dtype=np.int64)[:, np.newaxis]
    return (start * (k + 1) + (goal - start) * share) // (k + 1)


def waypoints_of(ground: SearchSpace, path: Cells, k: int) -> Ints:
    """At least k waypoints whose straight grid lines cost exactly what a cheapest path costs; int64 (k', 2).

    From each waypoint the next is the farthest cell of the path, at most an even share of its length ahead,
    that a legal line of the same cost leads to; a neighbour always is. Left-over ones stand on the goal.
    """
    cells = path.astype(np.int64)
    steps = len(cells) - 1
    reach = min(LONGEST, -(-steps // (k + 1)))
    single = trace(ground, np.stack((cells[:-1], cells[1:]), axis=1))
    paid = np.concatenate(([0], np.cumsum(ground.plain(single.step) + ground.toll(single.at, single.step))))
    at, chosen = 0, []
    while at < steps:
        ahead = np.arange(at + 1, min(at + reach, steps) + 1)
        lines = trace(ground, np.stack((np.repeat(cells[at : at + 1], ahead.size, 0), cells[ahead]), axis=1))
        cost = lines.total(ground.plain(lines.step) + ground.toll(lines.at, lines.step))
        same = (lines.total((~lines.legal).astype(np.int64)) == 0) & (cost == paid[ahead] - paid[at])
        at = int(ahead[np.flatnonzero(same)[-1]])
        chosen.append(cells[at])
    chosen.pop()
    chosen += [cells[-1]] * (k - len(chosen))
    return np.array(chosen, dtype=np.int64).reshape(-1, 2)
