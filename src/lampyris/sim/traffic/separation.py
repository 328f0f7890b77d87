"""Apart: discs that move in straight lines through one tick and never come nearer than their radii allow.

Every obstacle stands until it has chosen its step. A step is allowed if it keeps clear of the steps chosen before
and of those who still stand. So an obstacle that has not chosen may always stay, and no two discs ever meet, at any
moment of the tick.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from lampyris.model.traffic import Recorded
from lampyris.sim.world.cell_index import CellIndex
from lampyris.typing import BoolGrid

SLACK = 1e-10
"""Share of the sum of two radii that rounding may take; a tenth of what the referee counts as touching."""

STEP = math.sqrt(2.0)
"""The longest step of an obstacle, cells."""


class Motions:
    """Where every disc is at one moment, and where it will be at the end of a straight motion.

    Attributes
    ----------
    at, to : by obstacle: (x, y), cells, at the beginning and at the end.
    radii : by obstacle, cells.
    fixed : obstacles that follow a given track. Others keep off its lane, so they are not looked at here.
    side : of a bucket in which they are looked for, cells.
    """

    def __init__(self) -> None:
        self.at: list[tuple[float, float]] = []
        self.to: list[tuple[float, float]] = []
        self.radii: list[float] = []
        self.fixed: set[int] = set()
        self.side = 1.0
        self._buckets: dict[tuple[int, int], list[int]] = {}
        self._near: dict[int, list[int]] = {}

    def add(self, x: float, y: float, radius: float) -> None:
        """A new obstacle that stands."""
        self.at.append((x, y))
        self.to.append((x, y))
        self.radii.append(radius)
        if 2.0 * (radius + STEP) > self.side:
            self.side = 2.0 * (radius + STEP)
            self._sort()
        else:
            self._buckets.setdefault(self._bucket(x, y), []).append(len(self.at) - 1)
            self._near.clear()

    def begin(self, at: Iterable[tuple[float, float]]) -> None:
        """Every obstacle stands at these places."""
        self.at = list(at)
        self.to = list(self.at)
        self._sort()

    def _bucket(self, x: float, y: float) -> tuple[int, int]:
        return math.floor(x / self.side), math.floor(y / self.side)

    def _sort(self) -> None:
        self._near.clear()
        self._buckets.clear()
        for obstacle, (x, y) in enumerate(self.at):
            self._buckets.setdefault(self._bucket(x, y), []).append(obstacle)

    def near(self, obstacle: int) -> list[int]:
        """Obstacles that a step of this one might come too near to, whatever they do; fixed ones left out."""
        found = self._near.get(obstacle)
        if found is None:
            x, y = self.at[obstacle]
            u, v = self._bucket(x, y)
            reach = self.radii[obstacle] + 2.0 * STEP
            found = self._near[obstacle] = [
                k
                for i in (u - 1, u, u + 1)
                for j in (v - 1, v, v + 1)
                for k in self._buckets.get((i, j), ())
                if k != obstacle
                and k not in self.fixed
                and abs(self.at[k][0] - x) < reach + self.radii[k]
                and abs(self.at[k][1] - y) < reach + self.radii[k]
            ]
        return found

    def clear(self, obstacle: int, to: tuple[float, float]) -> bool:
        """Whether an obstacle may move to ``to``, as far as all others' present choice goes."""
        return all(self.apart(obstacle, to, other) for other in self.near(obstacle))

    def apart(self, obstacle: int, to: tuple[float, float], other: int) -> bool:
        """Whether an obstacle that moves to ``to`` keeps clear of another one's motion.

        Two that do not come nearer than they are now are clear of each other.
        """
        (x0, y0), (ax, ay) = self.at[obstacle], self.at[other]
        px, py = x0 - ax, y0 - ay
        dx, dy = to[0] - self.to[other][0] - px, to[1] - self.to[other][1] - py
        along = -(px * dx + py * dy)
        if along <= 0.0:
            return True
        length = dx * dx + dy * dy
        share = along / length if along < length else 1.0
        ex, ey = px + share * dx, py + share * dy
        far = self.radii[obstacle] + self.radii[other]
        return ex * ex + ey * ey >= far * far * (1.0 - SLACK)

    def settle(self, disturbed: Iterable[int]) -> set[int]:
        """Halt those that would meet an obstacle that is not where it was to be; all obstacles that halt.

        Parameters
        ----------
        disturbed : obstacles that have halted (``to`` is ``at``) or that are behind their time. Motions of all
            others were chosen clear of each other.
        """
        stopped: set[int] = set()
        queue = sorted(set(disturbed) - self.fixed)
        while queue:
            obstacle = queue.pop()
            for other in self.near(obstacle):
                if self.apart(obstacle, self.to[obstacle], other):
                    continue
                who = other if self.to[obstacle] == self.at[obstacle] else obstacle
                self.to[who] = self.at[who]
                stopped.add(who)
                queue.append(who)
        return stopped

    def room(self, mask: BoolGrid, radius: float) -> None:
        """Take from a mask the cells where a disc of that radius would meet a motion of this tick."""
        height, width = mask.shape
        for (x0, y0), (x1, y1), other in zip(self.at, self.to, self.radii, strict=True):
            far = radius + other
            left, right = max(math.ceil(min(x0, x1) - far), 0), min(math.floor(max(x0, x1) + far), width - 1)
            top, low = max(math.ceil(min(y0, y1) - far), 0), min(math.floor(max(y0, y1) + far), height - 1)
            if left > right or top > low:
                continue
            ys, xs = np.mgrid[top : low + 1, left : right + 1]
            near = _squares(xs - x0, ys - y0, x1 - x0, y1 - y0) < far * far * (1.0 - SLACK)
            mask[top : low + 1, left : right + 1] &= ~near


def _squares(px: np.ndarray, py: np.ndarray, dx: float, dy: float) -> np.ndarray:
    """Squared distances of points from the line from (0, 0) to (dx, dy)."""
    length = dx * dx + dy * dy
    share = np.clip((px * dx + py * dy) / length, 0.0, 1.0) if length else np.zeros(px.shape)
    ex, ey = px - share * dx, py - share * dy
    squared: np.ndarray = ex * ex + ey * ey
    return squared


def beside_lanes(space: CellIndex, tracks: Iterable[Recorded], radius: float, resolution: float) -> BoolGrid:
    """Where a disc's centre may not be, because a recorded obstacle comes too near there at some time.

    With no cut corners at these cells (both cells beside a diagonal step have to be free of them), a disc
    that steps between the other cells is clear of all tracks on its way, too: the point of a track next to a
    straight step is beside one of its ends, and that next to a diagonal one is too near to a cell beside it.

    Parameters
    ----------
    radius : of the disc, cells.

    Returns
    -------
    bool, (height, width).
    """
    lanes = Motions()
    known: set[tuple[tuple[int, int], tuple[int, int], float]] = set()
    for one in tracks:
        size = max(one.radius / resolution, 0.5)
        for a, b in zip(one.track, (*one.track[1:], one.track[-1]), strict=True):
            if (a, b, size) not in known:
                known |= {(a, b, size), (b, a, size)}
                lanes.at.append((float(a[0]), float(a[1])))
                lanes.to.append((float(b[0]), float(b[1])))
                lanes.radii.append(size)
    free = np.ones((space.height, space.width), dtype=np.bool_)
    lanes.room(free, radius)
    return ~free
