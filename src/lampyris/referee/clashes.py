"""Every pair of obstacles at every tick: never together, never a swap, never crossing.

An obstacle covers cells (its footprint). Obstacles are compared by sorting: at one tick every covered cell is
written down with its owner, as one integer of tick and cell; a number written twice is two obstacles in one
cell. Between two ticks the cells newly covered are looked up among the cells covered before. So a hundred
ticks of sixty obstacles cost a few sorts, not 180,000 pairs.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lampyris.referee.geometry.shapes import Ints

_ENTRIES = 2_000_000
"""Covered cells held at once; longer runs are judged in stretches that share their border tick."""


@dataclass(frozen=True, slots=True)
class AgentTracks:
    """All obstacles of a run, the robot first.

    Parameters
    ----------
    at : int64 (ticks + 1, obstacles, 2), x and y; whatever where an obstacle is not there.
    there : bool (ticks + 1, obstacles).
    covers : by obstacle, the offsets of the cells it covers; (n, 2) each, and one object for all obstacles of one
        size.
    """

    at: Ints
    there: NDArray[np.bool_]
    covers: Sequence[Ints]


@dataclass(frozen=True, slots=True, order=True)
class Clash:
    """Two obstacles that broke a rule. The earliest sorts first; in one tick: together, swap, cross."""

    tick: int
    rank: int
    rule: str
    one: int
    other: int
    cell: tuple[int, int]


@dataclass(frozen=True, slots=True)
class _Covered:
    """Covered cells of a stretch, one entry for each; ``key`` is tick and cell in one integer."""

    tick: Ints
    obstacle: Ints
    x: Ints
    y: Ints


class ClashDetector:
    """Finds the first clash among obstacles.

    Parameters
    ----------
    traffic : the obstacles.
    width, height : of the map, cells.
    forgiven : pairs (robot, obstacle) that may be together at the last tick: an obstacle that ran into the
        standing robot.
    """

    def __init__(
        self, traffic: AgentTracks, width: int, height: int, forgiven: frozenset[int] = frozenset()
    ) -> None:
        self.traffic = traffic
        self.forgiven = forgiven
        self.last = len(traffic.at) - 1
        self.pad = max(int(np.abs(c).max()) for c in traffic.covers) + 1
        self.wide = width + 2 * self.pad
        self.high = height + 2 * self.pad
        # Obstacles of one size share one array of offsets: group them by that.
        groups: dict[int, list[int]] = {}
        for obstacle, cover in enumerate(traffic.covers):
            groups.setdefault(id(cover), []).append(obstacle)
        self.groups = [(np.array(b, dtype=np.int64), traffic.covers[b[0]]) for b in groups.values()]

    def first(self) -> Clash | None:
        """The first clash, or None."""
        for begin, end in self._segments():
            clash = self._judge(begin, end)
            if clash is not None:
                return clash
        return None

    def _segments(self) -> Iterator[tuple[int, int]]:
        each = max(1, sum(len(b) * len(c) for b, c in self.groups))
        size = max(1, _ENTRIES // each)
        begin = 0
        while True:
            end = min(self.last, begin + size)
            yield begin, end
            if end == self.last:
                return
            begin = end

    def _judge(self, begin: int, end: int) -> Clash | None:
        now = self._cover(begin, end)
        key = self._key(now.tick, now.x, now.y)
        order = np.argsort(key, kind="stable")
        clashes = [self._together(now, key, order)]
        if end > begin:
            # What was covered before a step, and by whom: only trusted up to the first tick with two in one
            # cell.
            until = self.last if clashes[0] is None else clashes[0].tick
            clashes += [self._swap(now, key, order, begin, end, until), self._cross(begin, end)]
        found = [c for c in clashes if c is not None]
        return min(found) if found else None

    def _key(self, tick: Ints, x: Ints, y: Ints) -> Ints:
        return (tick * self.high + y + self.pad) * self.wide + x + self.pad

    def _cover(self, begin: int, end: int, later: int = 0, mask: NDArray[np.bool_] | None = None) -> _Covered:
        """Covered cells of the ticks begin .. end; with ``later`` = 1 at their places one tick later."""
        at = self.traffic.at[begin + later : end + 1 + later]
        keep = self.traffic.there[begin : end + 1] if mask is None else mask
        ticks, obstacles, xs, ys = [], [], [], []
        for members, offsets in self.groups:
            t, m = np.nonzero(keep[:, members])
            b = members[m]
            place = at[t, b]
            n = len(offsets)
            ticks.append(np.repeat(t + begin, n))
            obstacles.append(np.repeat(b, n))
            xs.append((place[:, :1] + offsets[:, 0]).ravel())
            ys.append((place[:, 1:] + offsets[:, 1]).ravel())
        if len(ticks) == 1:
            return _Covered(ticks[0], obstacles[0], xs[0], ys[0])
        return _Covered(*(np.concatenate(part) for part in (ticks, obstacles, xs, ys)))

    def _together(self, now: _Covered, key: Ints, order: Ints) -> Clash | None:
        """Two obstacles that cover one cell at one tick."""
        ranked = key[order]
        twice = np.flatnonzero(ranked[1:] == ranked[:-1])
        for k in twice.tolist():
            i, j = int(order[k]), int(order[k + 1])
            tick, one, other = int(now.tick[i]), *sorted((int(now.obstacle[i]), int(now.obstacle[j])))
            if tick == self.last and one == 0 and other in self.forgiven:
                continue
            return Clash(tick, 0, "together", one, other, (int(now.x[i]), int(now.y[i])))
        return None

    def _moved(self, begin: int, end: int) -> NDArray[np.bool_]:
        """Who makes a step after each of the ticks begin .. end - 1; bool (end - begin, obstacles)."""
        at, there = self.traffic.at, self.traffic.there
        out: NDArray[np.bool_] = (at[begin + 1 : end + 1] != at[begin:end]).any(axis=2)
        return out & there[begin:end]

    def _swap(self, now: _Covered, key: Ints, order: Ints, begin: int, end: int, until: int) -> Clash | None:
        """Two obstacles each of which comes to cover a cell that the other has left."""
        new = self._cover(begin, end - 1, 1, self._moved(begin, end))
        ranked = key[order]
        want = self._key(new.tick, new.x, new.y)
        place = np.minimum(np.searchsorted(ranked, want), len(ranked) - 1)
        owner = now.obstacle[order[place]]
        met = (ranked[place] == want) & (owner != new.obstacle) & (new.tick < until)
        if not met.any():
            return None
        tick, one, other = new.tick[met], new.obstacle[met], owner[met]
        n = len(self.traffic.covers)
        pair = (tick * n + one) * n + other
        back = (tick * n + other) * n + one
        both = np.isin(pair, back)
        if not both.any():
            return None
        k = int(np.flatnonzero(both)[np.argmin(pair[both])])
        cell = (int(new.x[met][k]), int(new.y[met][k]))
        a, b = sorted((int(one[k]), int(other[k])))
        return Clash(int(tick[k]) + 1, 1, "swap", a, b, cell)

    def _cross(self, begin: int, end: int) -> Clash | None:
        """Two obstacles that drive the two diagonals of one 2x2 block in one tick."""
        step = self.traffic.at[begin + 1 : end + 1] - self.traffic.at[begin:end]
        turn = np.where(self.traffic.there[begin:end], step[..., 0] * step[..., 1], 0)
        blocks = []
        for sign in (1, -1):
            mask = turn == sign
            old = self._cover(begin, end - 1, 0, mask)
            d = step[old.tick - begin, old.obstacle]
            x, y = old.x + np.minimum(d[:, 0], 0), old.y + np.minimum(d[:, 1], 0)
            blocks.append((old, self._key(old.tick, x, y)))
        (falling, key_f), (rising, key_r) = blocks
        if not len(key_f) or not len(key_r):
            return None
        common, i, j = np.intersect1d(key_f, key_r, return_indices=True)
        if not len(common):
            return None
        f, r = int(i[0]), int(j[0])
        a, b = sorted((int(falling.obstacle[f]), int(rising.obstacle[r])))
        return Clash(int(falling.tick[f]) + 1, 2, "cross", a, b, (int(falling.x[f]), int(falling.y[f])))

    def covered(self, tick: int) -> dict[tuple[int, int], int]:
        """Every cell that an obstacle other than the robot covers at a tick, and which."""
        now = self._cover(tick, tick)
        cells = zip(now.x.tolist(), now.y.tolist(), strict=True)
        return {c: b for c, b in zip(cells, now.obstacle.tolist(), strict=True) if b != 0}
