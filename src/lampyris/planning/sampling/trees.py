"""Searches that sample, each with the memory of one call: they go on, batch by batch."""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels.sampling import batch, draws, growth
from lampyris.kernels.sampling import connect as pair
from lampyris.kernels.sampling.takeover import take_over
from lampyris.planning.sampling.ground import EVEN, Chain, SamplingMap, neighbourhood
from lampyris.typing import Floats

FACTOR = 1.1
"""By which neighbourhoods are greater than the least that is proven to do."""
BLOCKED = 1 << 17
"""Places for blocked lines of a search at most: a megabyte."""
_WHOLE = 2**32
_NO_SIDES = np.empty(0, dtype=np.int32)
_SHORTER = 0.9995
"""The cells of the best path are computed again when it is shorter by this factor."""


@dataclass(frozen=True, slots=True)
class Query:
    """What a search is to do.

    Parameters
    ----------
    ground : the map.
    start, goal : flat cells, free.
    key : 32 bits that all draws come from.
    samples : that it takes at most, in all batches.
    step : longest line by which a tree grows, cells.
    narrow : share of samples that are cells in narrow places.
    near : share of samples that are cells near the best path, once there is one.
    seeded : whether a path from elsewhere may be taken into the tree, once.
    """

    ground: SamplingMap
    start: int
    goal: int
    key: int
    samples: int
    step: float
    narrow: float
    near: float = 0.0
    seeded: bool = False

    def room(self) -> int:
        """Nodes and samples of one tree, at most."""
        return min((2 if self.seeded else 1) * self.samples, len(self.ground.cells)) + 2


class SampledSearch:
    """One search.

    Attributes
    ----------
    best : length of the shortest path so far, cells; infinite: none.
    lines : straight lines checked for collisions.
    """

    best = math.inf

    def __init__(self, query: Query, count: int) -> None:
        self._query = query
        self._count = np.zeros(count, dtype=np.int64)
        self._trail = np.empty(0, dtype=np.int32)
        self._trailed = math.inf
        self._whole_ = np.zeros(0, dtype=np.int64)

    @abstractmethod
    def run(self, samples: int) -> None:
        """Take so many samples more.

        Raises
        ------
        Cancelled : the call is to stop; the search is of no more use.
        """

    def go_on_from(self, turns: Chain) -> None:
        """Take a path of free lines into the tree: flat cells, start first, goal last; at most as many as ``samples``.

        For searches whose query says that they are ``seeded``, between two batches.
        """
        raise NotImplementedError

    @abstractmethod
    def chain(self) -> Chain:
        """Vertices of the best path, start first; there is one."""

    @abstractmethod
    def edges(self) -> Floats:
        """Straight lines of all trees: x0, y0, x1, y1 of the cells of the map; float64 (m, 4)."""

    @property
    @abstractmethod
    def lines(self) -> int:
        """Straight lines checked for collisions."""

    @property
    @abstractmethod
    def taken(self) -> int:
        """Samples taken."""

    def _whole(self, base: int, **more: int) -> NDArray[np.int64]:
        ground, query = self._query.ground, self._query
        whole = [0] * 16
        whole[draws.STRIDE], whole[draws.RULE] = ground.stride, ground.rule
        whole[draws.WIDE], whole[draws.HIGH] = ground.wide, ground.high
        whole[draws.BASE], whole[draws.KEY] = base, query.key
        whole[draws.START], whole[draws.GOAL] = query.start, query.goal
        whole[draws.NARROW] = int(query.narrow * _WHOLE)
        whole[draws.NEAR] = int(query.near * _WHOLE)
        for name, value in more.items():
            whole[getattr(draws, name.upper())] = value
        return np.array(whole, dtype=np.int64)

    def _drawn_from(self) -> tuple[NDArray[Any], ...]:
        """The map, and the cells that samples are drawn from; those of the best path once it is shorter by some."""
        ground = self._query.ground
        if self._query.near > 0.0 and self.best < self._trailed * _SHORTER:
            self._trailed = self.best
            self._trail = ground.along(self.chain())
        return ground.board.free, EVEN, ground.cells, ground.narrow, self._trail

    def _goes_on(self) -> bool:
        """Whether there will be more batches, as far as it is known: a first path that is straight ends the search."""
        query = self._query
        return self.taken > 0 or not query.ground.straight(query.start, query.goal)

    def _place_of_buckets(self) -> tuple[int, int, int]:
        ground = self._query.ground
        return ground.stride, ground.wide, int(self._whole_[draws.BASE])

    def _place(self, flat: int) -> tuple[int, int]:
        y, x = divmod(flat, self._query.ground.stride)
        return x, y


def _informed_radius(
    query: Query, best: float, x: NDArray[np.int32], y: NDArray[np.int32], ends: tuple[int, int]
) -> float:
    """Radius of the neighbourhood for the nodes that a path shorter than the best may lead through."""
    area, some = float(len(query.ground.cells)), len(x)
    if math.isfinite(best):
        least = query.ground.distance(query.start, query.goal)
        side = math.sqrt(max(best * best - least * least, 0.0))
        area = min(area, 3.141592653589793 / 4.0 * best * side)
        length = np.zeros(len(x))
        for end in ends:
            dx, dy = (v.astype(np.float64) - float(v[end]) for v in (x, y))
            length += np.sqrt(dx * dx + dy * dy)
        some = int(np.count_nonzero(length < best))
    return max(neighbourhood(area, some, FACTOR), 1.5)


def _up(
    node: int, parent: NDArray[np.int32], x: NDArray[np.int32], y: NDArray[np.int32], stride: int
) -> Chain:
    """Flat cells from a node to the root of its tree."""
    nodes = []
    while node >= 0:
        nodes.append(node)
        node = int(parent[node])
    return y[nodes] * np.int32(stride) + x[nodes]


def _edges(
    parent: NDArray[np.int32], x: NDArray[np.int32], y: NDArray[np.int32], used: NDArray[np.int64]
) -> Floats:
    """The lines from nodes to their parents."""
    used = used[parent[used] >= 0]
    p = parent[used]
    return np.column_stack((x[used], y[used], x[p], y[p])).astype(np.float64)


class OneTree(SampledSearch):
    """RRT, and with ``star`` RRT*: a tree from the start.

    Parameters
    ----------
    query : what to do.
    bias : share of samples that are the goal until it is reached.
    star : whether paths are improved.
    informed : whether samples are drawn only from where a shorter path may lead through.
    ancestors : of a parent, that are tried in its place.
    """

    def __init__(self, query: Query, bias: float, *, star: bool, informed: bool, ancestors: int) -> None:
        super().__init__(query, 5)
        ground = query.ground
        room = query.room()
        self._bucket, base = ground.buckets(room)
        self._star = star
        self._whole_ = self._whole(
            base, star=star, informed=informed, ancestors=ancestors, bias=int(bias * _WHOLE)
        )
        *rows, self._sides = ground.scratch(10, 2 * room, np.int32)
        self._x, self._y, self._parent, self._link, self._near, self._changed, *self._kin = (
            one[:room] for one in rows
        )
        (self._stack,) = ground.scratch(1, 2 * room, np.int64)
        (self._cost,) = ground.scratch(1, room, np.float64)
        radii = [neighbourhood(len(ground.cells), 1 << k, FACTOR) for k in range(32)] if star else [0.0]
        self._radius = np.array(radii)
        x, y = self._place(query.start)
        self._x[0], self._y[0], self._parent[0], self._cost[0] = x, y, -1, 0.0
        for kin in self._kin:
            kin[0] = -1
        b = (y >> 3) * ground.wide + (x >> 3)
        self._bucket[b], self._link[0], self._sides[:2] = base, 0, -1
        self._count[growth.NODES], self._count[growth.REACHED] = 1, -1

    def go_on_from(self, turns: Chain) -> None:
        """See :meth:`SampledSearch.go_on_from`."""
        rows = (self._bucket, self._link, self._sides, self._x, self._y, self._parent, *self._kin, self._cost)
        room = len(self._cost)
        count, unused = np.array([self._count[growth.NODES], 0, 0]), np.empty(room, dtype=np.int32)
        stale = np.empty(room, dtype=np.uint8)
        take_over(turns, *self._place_of_buckets(), *rows, stale, unused, self._changed, count)
        self._count[growth.NODES], self._count[growth.REACHED] = count[0], count[2]
        self._note()

    def run(self, samples: int) -> None:
        """See :meth:`SampledSearch.run`."""
        self._whole_[draws.SAMPLES] = samples
        if self._whole_[draws.INFORMED] and math.isfinite(self.best):
            nodes = int(self._count[growth.NODES])
            ends = (0, int(self._count[growth.REACHED]))
            self._radius[:] = _informed_radius(self._query, self.best, self._x[:nodes], self._y[:nodes], ends)
        given = (
            *self._drawn_from(), self._whole_, self._query.step, self._radius, self._bucket,
            self._link, self._sides, self._stack, self._x, self._y, self._parent, *self._kin, self._cost, self._near,
            self._changed, self._count,
        )  # fmt: skip
        if self._star and self._goes_on():
            growth.grow.expect((self._query.samples - self.taken) // samples, *given)
        growth.grow(*given)
        self._note()

    def _note(self) -> None:
        reached = int(self._count[growth.REACHED])
        if reached >= 0:
            self.best = float(self._cost[reached])

    def chain(self) -> Chain:
        """See :meth:`SampledSearch.chain`."""
        reached = int(self._count[growth.REACHED])
        return _up(reached, self._parent, self._x, self._y, self._query.ground.stride)[::-1]

    def edges(self) -> Floats:
        """See :meth:`SampledSearch.edges`."""
        return _edges(self._parent, self._x, self._y, np.arange(int(self._count[growth.NODES])))

    @property
    def lines(self) -> int:
        """See :attr:`SampledSearch.lines`."""
        return int(self._count[growth.LINES])

    @property
    def taken(self) -> int:
        """See :attr:`SampledSearch.taken`."""
        return int(self._count[growth.SAMPLED])


class TwoTrees(SampledSearch):
    """RRT-Connect: trees from the start and from the goal."""

    def __init__(self, query: Query) -> None:
        super().__init__(query, 6)
        ground = query.ground
        # By one sample either tree grows by as many nodes at most as there are steps across the map.
        reach = 2 + math.ceil(2.0 * ground.diagonal() / max(1.0, query.step - 1.0))
        self._room = room = min(query.samples * reach, len(ground.cells)) + 2
        self._whole_ = self._whole(0, reach=reach)
        *rows, self._sides = ground.scratch(4, 4 * room, np.int32)
        self._x, self._y, self._parent = (one[: 2 * room] for one in rows)
        (self._stack,) = ground.scratch(1, 4 * room, np.int64)
        for tree, flat in enumerate((query.start, query.goal)):
            n = tree * room
            self._x[n], self._y[n] = self._place(flat)
            self._parent[n], self._sides[2 * n : 2 * n + 2] = -1, -1
        self._count[:2] = 1

    def run(self, samples: int) -> None:
        """See :meth:`SampledSearch.run`."""
        ground = self._query.ground
        self._whole_[draws.SAMPLES] = samples
        outcome = pair.connect(
            ground.board.free, EVEN, ground.cells, ground.narrow, self._whole_, self._query.step, self._sides, self._stack,
            self._x, self._y, self._parent, self._count,
        )  # fmt: skip
        if outcome == growth.FOUND:
            self._chain = self._stack[: int(self._count[pair.VERTICES])].astype(np.int32)
            y, x = np.divmod(self._chain, ground.stride)
            dx, dy = x[1:] - x[:-1], y[1:] - y[:-1]
            self.best = math.fsum(np.sqrt((dx * dx + dy * dy).astype(np.float64)).tolist())

    def chain(self) -> Chain:
        """See :meth:`SampledSearch.chain`."""
        return self._chain

    def edges(self) -> Floats:
        """See :meth:`SampledSearch.edges`."""
        used = np.concatenate([tree * self._room + np.arange(int(self._count[tree])) for tree in (0, 1)])
        return _edges(self._parent, self._x, self._y, used)

    @property
    def lines(self) -> int:
        """See :attr:`SampledSearch.lines`."""
        return int(self._count[pair.LINES])

    @property
    def taken(self) -> int:
        """See :attr:`SampledSearch.taken`."""
        return int(self._count[pair.SAMPLED])


class BatchSearch(SampledSearch):
    """BIT*: batches of samples, searched in the order of what a path through them may cost."""

    def __init__(self, query: Query, *, ancestors: int) -> None:
        super().__init__(query, 10)
        ground = query.ground
        self._room = room = query.room()
        self._bucket, base = ground.buckets(room)
        self._whole_ = self._whole(base, ancestors=ancestors)
        self._x, self._y, self._link, self._near, self._changed, self._tree = np.empty(
            (6, room), dtype=np.int32
        )
        self._kin = np.full((4, room), -1, dtype=np.int32)
        self._cost, self._stale = np.full(room, np.inf), np.zeros(room, dtype=np.uint8)
        self._heaps(8 * min(room, 2048) + 2 * room)
        self._blocked = np.zeros(min(1 << (8 * room).bit_length(), BLOCKED), dtype=np.int64)
        for n, flat in enumerate((query.start, query.goal)):
            self._x[n], self._y[n] = x, y = self._place(flat)
            b = (y >> 3) * ground.wide + (x >> 3)
            self._link[n], self._bucket[b] = self._bucket[b], base + n
        self._cost[0], self._stale[0], self._tree[0] = 0.0, 1, 0
        self._count[[growth.NODES, batch.JOINED, batch.FRESH]] = 2, 1, 1

    def go_on_from(self, turns: Chain) -> None:
        """See :meth:`SampledSearch.go_on_from`."""
        rows = (self._bucket, self._link, _NO_SIDES, self._x, self._y, *self._kin, self._cost, self._stale)
        count = self._count[[growth.NODES, batch.JOINED, 0]]
        take_over(turns, *self._place_of_buckets(), *rows, self._tree, self._changed, count)
        self._count[[growth.NODES, batch.JOINED]], self._count[batch.FRESH] = count[:2], 1
        self.best = float(self._cost[1])

    def _heaps(self, size: int) -> None:
        self._edge_key, self._edge = np.empty(size), np.empty(size, dtype=np.int64)
        self._vertex_key, self._vertex = np.empty(size), np.empty(size, dtype=np.int64)

    def run(self, samples: int) -> None:
        """See :meth:`SampledSearch.run`."""
        self._whole_[draws.SAMPLES] = samples
        nodes = int(self._count[growth.NODES])
        radius = _informed_radius(self._query, self.best, self._x[:nodes], self._y[:nodes], (0, 1))
        while True:
            given = (
                *self._drawn_from(), self._whole_, radius, self._bucket, self._link, self._x,
                self._y, *self._kin, self._cost, self._stale, self._tree, self._edge_key, self._edge, self._vertex_key,
                self._vertex, self._near, self._changed, self._blocked, self._count,
            )  # fmt: skip
            if self._goes_on():
                batch.search_batch.expect((self._query.samples - self.taken) // samples, *given)
            outcome = batch.search_batch(*given)
            if outcome != batch.FULL:
                break
            for name in ("_edge_key", "_edge", "_vertex_key", "_vertex"):
                held = getattr(self, name)
                setattr(self, name, np.concatenate((held, np.empty_like(held))))
        self.best = float(self._cost[1])

    def chain(self) -> Chain:
        """See :meth:`SampledSearch.chain`."""
        return _up(1, self._kin[0], self._x, self._y, self._query.ground.stride)[::-1]

    def edges(self) -> Floats:
        """See :meth:`SampledSearch.edges`."""
        return _edges(self._kin[0], self._x, self._y, np.arange(int(self._count[growth.NODES])))

    @property
    def lines(self) -> int:
        """See :attr:`SampledSearch.lines`."""
        return int(self._count[growth.LINES])

    @property
    def taken(self) -> int:
        """See :attr:`SampledSearch.taken`."""
        return int(self._count[growth.SAMPLED])
