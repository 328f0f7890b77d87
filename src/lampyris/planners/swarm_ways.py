"""Ways: a batch of walks over a ground, step by step; and how a particle of numbers becomes one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lampyris.halting import look
from lampyris.planners.swarm_ground import Flags, Ground, Ints
from lampyris.swarm.box import Box, Points
from lampyris.typing import Cells

LONGEST = 64
"""Steps of the longest leg that is tried when a way is written as waypoints."""


@dataclass(frozen=True, slots=True, eq=False)
class Ways:
    """n walks, one after the other, each of at least one step.

    Parameters
    ----------
    first : int64 (n + 1,); where each walk's steps begin, and the end of the last.
    at : int64 (steps,); the flat cell each step leaves.
    step : int64 (steps,); which of the moves it is.
    legal : bool (steps,); whether it may be made.
    missing : int64 (n,); steps by which a walk falls short of the goal (ants that gave up).
    """

    first: Ints
    at: Ints
    step: Ints
    legal: Flags
    missing: Ints

    def __len__(self) -> int:
        return int(self.first.size) - 1

    def __getitem__(self, k: int) -> Ways:
        a, b = int(self.first[k]), int(self.first[k + 1])
        ends = np.array([0, b - a], dtype=np.int64)
        return Ways(ends, self.at[a:b], self.step[a:b], self.legal[a:b], self.missing[k : k + 1])

    def total(self, each: NDArray[np.int64]) -> Ints:
        """Sum of a whole number of each step over each walk, int64 (n,)."""
        return np.add.reduceat(each, self.first[:-1])


def walk_of(ground: Ground, way: Ways) -> Cells:
    """The cells of a batch of one walk, both ends included; int32 (n, 2)."""
    last = way.at[-1:] + ground.jump[way.step[-1:]]
    return ground.cells(np.concatenate((way.at, last)))


def trace(ground: Ground, nodes: Ints) -> Ways:
    """Walks along straight grid lines from node to node.

    Parameters
    ----------
    nodes : cells, int64 (n, k + 1, 2); start first, goal last, start and goal differ.

    A leg takes steps of two neighbouring directions: straight and diagonal, or with knight's steps the two
    kinds that its slope lies between, or with ``four`` the two straights. They are spread as evenly as
    Bresenham's line spreads them (IBM Systems Journal 4(1), 1965), so step i is known without those before.
    Without walls no way between the two cells is cheaper.
    """
    n, legs = nodes.shape[0], nodes.shape[1] - 1
    a = nodes[:, :-1].reshape(-1, 2)
    kinds, counts = _mixture(ground, nodes[:, 1:].reshape(-1, 2) - a)
    many = counts.sum(axis=1)
    begin = np.concatenate((np.zeros(1, dtype=np.int64), np.cumsum(many)))
    leg = np.repeat(np.arange(many.size), many)
    i = np.arange(begin[-1]) - begin[leg]
    look()
    total, second = many[leg], counts[leg, 1]
    half = total // 2
    passed = (i * second + half) // total
    look()
    turned = ((i + 1) * second + half) // total > passed
    jumps = ground.jump[kinds]
    look()
    at = ground.flat(a)[leg] + (i - passed) * jumps[leg, 0] + passed * jumps[leg, 1]
    step = np.where(turned, kinds[leg, 1], kinds[leg, 0])
    look()
    return Ways(begin[:: legs or 1], at, step, ground.legal(at, step), np.zeros(n, dtype=np.int64))


def _mixture(ground: Ground, d: Ints) -> tuple[Ints, Ints]:
    """For each leg (m, 2) the numbers of its two steps and how many of each; int64 (m, 2) both."""
    sign = np.sign(d)
    far, near = np.abs(d).max(axis=1), np.abs(d).min(axis=1)
    flat = np.abs(d[:, 0]) >= np.abs(d[:, 1])
    zero = np.zeros_like(far)
    along = np.where(flat[:, np.newaxis], sign * (1, 0), sign * (0, 1))
    moves = ground.moves
    if not moves.diagonal:
        pair, counts = (along, sign - along), (far, near)
    elif not moves.knight:
        pair, counts = (along, sign), (far - near, near)
    else:
        knight = np.where((near > 0)[:, np.newaxis], sign + along, zero[:, np.newaxis])
        steep = 2 * near > far
        one = np.where(steep[:, np.newaxis], sign, along)
        pair = (one, knight)
        counts = (np.where(steep, 2 * near - far, far - 2 * near), np.where(steep, far - near, near))
    number = np.zeros((5, 5), dtype=np.int64)
    for (dx, dy), k in ground.number.items():
        number[dx, dy] = k
    kinds = np.stack([number[p[:, 0], p[:, 1]] for p in pair], axis=1)
    return kinds, np.stack(counts, axis=1)


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

    def ways(self, ground: Ground, start: Ints, particles: Points) -> Ways:
        """The walks of particles (n, d): each waypoint on the nearest cell from which the goal can be
        reached, joined by straight grid lines."""
        cells = np.minimum(np.floor(self.places(particles)).astype(np.int64), self.size - 1)
        snapped = ground.cells(ground.nearest[ground.flat(cells)].ravel()).astype(np.int64)
        n, k = len(particles), len(self.base)
        nodes = np.empty((n, k + 2, 2), dtype=np.int64)
        nodes[:, 0] = start
        nodes[:, 1:-1] = snapped.reshape(n, k, 2)
        nodes[:, -1] = ground.scene.goal
        return trace(ground, nodes)


def anywhere(ground: Ground, waypoints: Ints) -> Encoding:
    """Waypoints that may lie anywhere on the map."""
    return Encoding(waypoints, np.ones(waypoints.shape, dtype=np.bool_), _size(ground))


def on_lines(ground: Ground, start: Ints, waypoints: Ints) -> Encoding:
    """Waypoints each on a grid line of its own, across the main direction from start to goal."""
    d = np.abs(np.array(ground.scene.goal) - start)
    chosen = np.zeros(waypoints.shape, dtype=np.bool_)
    chosen[:, 1 if d[0] >= d[1] else 0] = True
    return Encoding(waypoints, chosen, _size(ground))


def _size(ground: Ground) -> Ints:
    height, width = ground.open_cells.shape
    return np.array([width, height], dtype=np.int64)


def evenly(start: Ints, goal: Ints, k: int) -> Ints:
    """k cells evenly spaced between two, int64 (k, 2)."""
    share = np.arange(1, k + 1, dtype=np.int64)[:, np.newaxis]
    return (start * (k + 1) + (goal - start) * share) // (k + 1)


def waypoints_of(ground: Ground, way: Cells, k: int) -> Ints:
    """At least k waypoints whose straight grid lines cost exactly what a cheapest way costs; int64 (k', 2).

    From each waypoint the next is the farthest cell of the way, at most an even share of its length ahead,
    that a legal line of the same cost leads to; a neighbour always is. Left-over ones stand on the goal.
    """
    cells = way.astype(np.int64)
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
