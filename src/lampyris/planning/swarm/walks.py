"""Batches of walks over a ground, step by step: whole, or piece by piece."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from lampyris._core.arrays import index_array
from lampyris._core.cancellation import checkpoint
from lampyris.kernels.swarm.line_walks import walk_sums
from lampyris.planning.swarm.search_space import Flags, Ints, SearchSpace
from lampyris.typing import Cells

PART = 1 << 16
"""Steps that are worked on between two cancellation checks: a few milliseconds' work."""


def parts(n: int) -> Iterator[slice]:
    """n elements, :data:`PART` at a time, with a cancellation check before each."""
    for a in range(0, n, PART):
        checkpoint()
        yield slice(a, min(a + PART, n))


class WalkBatch(Protocol):
    """n walks, one after the other, each of at least one step; available, or made when they are asked for."""

    @property
    def steps(self) -> int:
        """How many steps they have in all."""

    @property
    def missing(self) -> Ints:
        """int64 (n,); steps by which a walk falls short of the goal (ants that gave up)."""

    def __len__(self) -> int: ...

    def __getitem__(self, k: int) -> WalkBatch:
        """One of them."""

    def pieces(self) -> Iterator[Piece]:
        """All steps in order, :data:`PART` or so at a time, with a cancellation check before each."""

    def whole(self) -> Paths:
        """All of them at once."""


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """Steps of some walks that follow each other: the first and the last may be in part.

    Parameters
    ----------
    walk : number of the first.
    paths : the steps; whether a walk falls short is not said.
    before : the step that was made before the first of them, in the same walk; -1: none.
    """

    walk: int
    paths: Paths
    before: int

    @property
    def walks(self) -> slice:
        """Which walks."""
        return slice(self.walk, self.walk + len(self.paths))


@dataclass(frozen=True, slots=True, eq=False)
class Paths:
    """n walks, step by step; a :class:`WalkBatch`.

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

    def __getitem__(self, k: int) -> Paths:
        a, b = int(self.first[k]), int(self.first[k + 1])
        ends = np.array([0, b - a], dtype=np.int64)
        return Paths(ends, self.at[a:b], self.step[a:b], self.legal[a:b], self.missing[k : k + 1])

    def total(self, each: NDArray[np.int64]) -> Ints:
        """Sum of a whole number of each step over each walk, int64 (n,)."""
        return np.add.reduceat(each, index_array(self.first[:-1]))

    @property
    def steps(self) -> int:
        """See :class:`WalkBatch`."""
        return int(self.at.size)

    def pieces(self) -> Iterator[Piece]:
        """See :class:`WalkBatch`."""
        for a in range(0, self.steps, PART):
            checkpoint()
            b = min(a + PART, self.steps)
            walk, first = _walks_between(self.first, a, b)
            paths = Paths(first, self.at[a:b], self.step[a:b], self.legal[a:b], np.zeros_like(first[1:]))
            yield Piece(walk, paths, int(self.step[a - 1]) if a > self.first[walk] else -1)

    def whole(self) -> Paths:
        """See :class:`WalkBatch`."""
        return self


def _walks_between(bounds: Ints, a: int, b: int) -> tuple[int, Ints]:
    """The walk that step a belongs to, and where those of steps a to b begin and end, counted from a."""
    walk = int(np.searchsorted(bounds, a, side="right")) - 1
    end = int(np.searchsorted(bounds, b))
    return walk, np.clip(bounds[walk : end + 1], a, b) - a


def walk_of(ground: SearchSpace, path: Paths) -> Cells:
    """The cells of a batch of one walk, both ends included; int32 (n, 2)."""
    cells = np.empty((path.steps + 1, 2), dtype=np.int32)
    for part in parts(path.steps):
        cells[part] = ground.cells(path.at[part])
    cells[-1:] = ground.cells(path.at[-1:] + ground.jump[path.step[-1:]])
    return cells


class LineWalks:
    """Walks along straight grid lines from node to node; a :class:`WalkBatch`.

    On a map of long corridors a swarm's walks have a hundred million steps: they are made piece by piece,
    each time that they are asked for, and thrown away. (Made at once, those of 30 particles on a spiral of
    1024 cells a side took 6.8 GB and 37 s, with a second between two looks; so they take 0.4 GB and 12 s.)

    Parameters
    ----------
    ground : where.
    nodes : cells, int64 (n, k + 1, 2); start first, goal last, start and goal differ.

    A leg takes steps of two neighbouring directions: straight and diagonal, or with knight's steps the two
    kinds that its slope lies between, or with ``four-connected`` the two straights. They are spread as evenly as
    Bresenham's line spreads them (IBM Systems Journal 4(1), 1965), so step i is known without those before.
    Without walls no path between the two cells is cheaper.
    """

    def __init__(self, ground: SearchSpace, nodes: Ints) -> None:
        self._ground, self._nodes = ground, nodes
        here, there = (part.reshape(-1, 2) for part in (nodes[:, :-1], nodes[:, 1:]))
        self._here = here
        kinds, counts = [], []
        for a in range(0, len(here), PART):
            checkpoint()
            some = slice(a, a + PART)
            kind, count = _mixture(ground, there[some] - here[some])
            kinds.append(kind)
            counts.append(count)
        one = len(kinds) == 1
        self._kinds, self._counts = (kinds[0], counts[0]) if one else map(np.concatenate, (kinds, counts))
        self._begin = np.zeros(len(here) + 1, dtype=np.int64)
        self._counts.sum(axis=1).cumsum(out=self._begin[1:])
        self._bounds = self._begin[:: nodes.shape[1] - 1]

    def __len__(self) -> int:
        return len(self._nodes)

    def __getitem__(self, k: int) -> LineWalks:
        return LineWalks(self._ground, self._nodes[k : k + 1].copy())

    @property
    def steps(self) -> int:
        """See :class:`WalkBatch`."""
        return int(self._begin[-1])

    @property
    def missing(self) -> Ints:
        """See :class:`WalkBatch`: they all end at the goal."""
        return np.zeros(len(self), dtype=np.int64)

    def pieces(self) -> Iterator[Piece]:
        """See :class:`WalkBatch`."""
        begin, last = self._begin, self._begin.size - 1
        # A leg weighs as much as a step, and is never cut: it is no longer than the map.
        if self.steps + last <= PART:
            checkpoint()
            yield Piece(0, self._paths(0, last, self._bounds), -1)
            return
        cuts = np.searchsorted(begin + np.arange(begin.size), np.arange(PART, self.steps + last, PART))
        a, before = 0, -1
        for b in (*cuts.tolist(), last):
            if begin[b] == begin[a]:  # no step, or no leg at all
                continue
            checkpoint()
            walk, first = _walks_between(self._bounds, int(begin[a]), int(begin[b]))
            paths = self._paths(a, b, first)
            yield Piece(walk, paths, before if begin[a] > self._bounds[walk] else -1)
            before, a = int(paths.step[-1]), b

    def sums(self, *, near: bool) -> Ints | None:
        """What the steps of each walk add up to, int64 (n, 5): see :mod:`lampyris.kernels.swarm.line_walks`.

        None where going through them by :meth:`pieces` is quicker. Nearness is 0 unless ``near``.
        """
        ground, at = self._ground, self._ground.flat(self._here)
        sums: Ints = np.zeros((len(self), 5), dtype=np.int64)
        none: Ints = np.zeros(0, dtype=np.int64)
        cells = (
            ground.free,
            ground.nearness if near else none,
            none if ground.terrain is None else ground.terrain,
        )
        steps = (at, self._kinds.ravel(), self._counts.ravel(), self._nodes.shape[1] - 1)
        if not walk_sums.pays(*cells, *ground.tables, *steps, sums.ravel()):
            return None
        walk_sums(*cells, *ground.tables, *steps, sums.ravel())
        return sums

    def _paths(self, a: int, b: int, first: Ints) -> Paths:
        """The steps of legs a to b."""
        ground, here = self._ground, self._here[a:b]
        kinds, counts = self._kinds[a:b], self._counts[a:b]
        many = counts.sum(axis=1)
        leg = np.arange(b - a).repeat(index_array(many))
        i = np.arange(leg.size) - (self._begin[a:b] - self._begin[a])[leg]
        total, second = many[leg], counts[leg, 1]
        half = total // 2
        passed = (i * second + half) // total
        turned = ((i + 1) * second + half) // total > passed
        jumps = ground.jump[kinds]
        at = ground.flat(here)[leg] + (i - passed) * jumps[leg, 0] + passed * jumps[leg, 1]
        step = np.where(turned, kinds[leg, 1], kinds[leg, 0])
        return Paths(first, at, step, ground.legal(at, step), np.zeros_like(first[1:]))

    def whole(self) -> Paths:
        """See :class:`WalkBatch`."""
        made = [piece.paths for piece in self.pieces()]
        if len(made) == 1:
            return made[0]
        at, step, legal = (
            np.concatenate([getattr(paths, name) for paths in made]) for name in ("at", "step", "legal")
        )
        return Paths(self._bounds, at, step, legal, self.missing)


def trace(ground: SearchSpace, nodes: Ints) -> Paths:
    """:class:`LineWalks`, made at once: for few."""
    return LineWalks(ground, nodes).whole()


def _mixture(ground: SearchSpace, d: Ints) -> tuple[Ints, Ints]:
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
