"""The memory of hybrid A* searches on one map."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels.hybrid import search as kernel
from lampyris.kernels.hybrid.goal_curve import SEGMENTS
from lampyris.planning.graph.expanded import run_noting
from lampyris.planning.hybrid.map import HybridMap
from lampyris.planning.hybrid.motions import motions_of
from lampyris.planning.lattice.shortcut import DRIVES
from lampyris.typing import Cells

_ROOM = 1 << 14
ZONE = 6.0
"""Turning radii of estimated cost within which the curve to the goal is the heuristic where it is greater."""
INTERVAL = 4.0
"""A curve to the goal is tried once for every expansion, and for one expansion more with each so many cells to go."""
CLOSED = 2
"""What the kernel writes into the last of a node's numbers once it is expanded."""
_NOTHING = 2e-6
"""Cells, and radians, below which a segment is left out."""
Pose = tuple[float, float, float]
"""x, y (cells, y down) and yaw."""


@dataclass(frozen=True, slots=True)
class PoseQuery:
    """What to search for; cells, y down.

    Parameters
    ----------
    place : x, y of the start.
    yaw : of the first of the headings, from which all others are whole bins away.
    headings : numbers of the headings at the start.
    goal : the pose to reach.
    any_yaw : whether its yaw is free.
    reach, yaw_reach : tolerances of position and yaw; a negative reach: the goal is reached by a curve alone.
    analytic : whether curves to the goal are tried.
    weight : of the heuristic.
    """

    place: tuple[float, float]
    yaw: float
    headings: tuple[int, ...]
    goal: Pose
    any_yaw: bool
    reach: float
    yaw_reach: float
    analytic: bool
    weight: float


@dataclass(frozen=True, slots=True)
class PathPiece:
    """A segment of a path, and how it is driven."""

    length: float
    turn: float
    lateral: float
    gear: int


@dataclass(frozen=True, slots=True)
class HybridPath:
    """A path.

    Parameters
    ----------
    pieces : its segments, in order.
    first : pose at the start.
    cost : in cells.
    exact : whether it ends at the goal, not only within the tolerances.
    """

    pieces: tuple[PathPiece, ...]
    first: Pose
    cost: float
    exact: bool


class HybridSearch:
    """The memory of searches: nodes, and which of them holds each cell and heading.

    Parameters
    ----------
    hybrid_map : the map.

    Attributes
    ----------
    expanded : the cells of the poses that are expanded, first come first, a part for each call of the kernel; None: they are
        not recorded. The kernel runs in its plain form where they are.
    """

    def __init__(self, hybrid_map: HybridMap) -> None:
        self.hybrid_map = hybrid_map
        self.expanded: list[Cells] | None = None
        self._bins = hybrid_map.shape.headings
        # Pages of memory that no search touches are never made.
        self._slot = np.zeros(hybrid_map.walls.size * self._bins, dtype=np.int32)
        self._room(_ROOM)
        self._first = 1
        self._count = np.zeros(6, dtype=np.int64)

    def _room(self, nodes: int) -> None:
        self._floats = np.zeros(3 * nodes)
        self._wholes = np.zeros(6 * nodes, dtype=np.int32)
        self._keys = np.zeros(nodes)
        self._heap = np.zeros(nodes, dtype=np.int32)

    @property
    def expansions(self) -> int:
        """Poses expanded in the last search."""
        return int(self._count[kernel.EXPANDED])

    @property
    def curves(self) -> int:
        """Curves to the goal that were checked for collisions in the last search."""
        return int(self._count[kernel.CURVES])

    def run(self, question: PoseQuery, field: NDArray[np.float32], limit: int | None) -> int:
        """Search; one of the kernel's outcomes."""
        hybrid_map, shape = self.hybrid_map, self.hybrid_map.shape
        self._question = question
        self._begin(field)
        motions = motions_of(shape)
        moves_x, moves_y = motions.displacements(question.yaw, self._bins)
        vertices = np.array(shape.footprint)
        whole = np.array(
            [
                hybrid_map.stride, hybrid_map.walls.size // hybrid_map.stride, hybrid_map.border, self._bins,
                len(motions.turned), shape.family, DRIVES[shape.drive], int(question.any_yaw), int(question.analytic),
                -1 if limit is None else limit, self._first,
            ],
            dtype=np.int64,
        )  # fmt: skip
        numbers = np.array(
            [
                shape.inner, shape.outer, shape.radius, shape.reverse_cost if shape.backward else 0.0, shape.switch_cost,
                shape.turn_cost, question.weight, ZONE * shape.radius, INTERVAL, question.reach, question.yaw_reach, question.yaw,
                2 * math.pi / self._bins, max(question.reach, 0.0),
            ]
        )  # fmt: skip
        border = hybrid_map.border
        goal = np.array([question.goal[0] + border, question.goal[1] + border, question.goal[2]])
        self._best = np.array([-1.0, -1.0, 0.0])
        self._segments = np.zeros(3 * SEGMENTS)
        room = (np.zeros(3 * SEGMENTS), np.zeros(SEGMENTS), np.zeros(SEGMENTS, dtype=np.int64))
        while True:
            outcome = self._called((
                    hybrid_map.walls, hybrid_map.clear, field, vertices[:, 0].copy(), -vertices[:, 1],
                    shape.cover.ravel(), whole, numbers, goal,
                    moves_x, moves_y, motions.parts.ravel(), motions.turned.ravel(), self._slot, self._floats, self._wholes,
                    self._keys, self._heap, self._count, self._best, self._segments, *room,
            ))  # fmt: skip
            if outcome != kernel.FULL:
                return outcome
            for name in ("_floats", "_wholes", "_keys", "_heap"):
                held = getattr(self, name)
                setattr(self, name, np.concatenate((held, np.zeros_like(held))))

    def _called(self, args: tuple[Any, ...]) -> int:
        """The kernel's outcome; the poses that it expands are recorded where that is asked for."""
        if self.expanded is None:
            return int(kernel.search(*args))
        outcome, changed = run_noting(kernel.search, args, self._wholes, CLOSED)
        nodes = changed[changed % 6 == 5] // 6
        at = np.stack((self._floats[3 * nodes], self._floats[3 * nodes + 1]), axis=-1)
        self.expanded.append((np.floor(at + 0.5) - self.hybrid_map.border).astype(np.int32))
        return int(outcome)

    def _begin(self, field: NDArray[np.float32]) -> None:
        """Put the start's headings into the heap."""
        question, hybrid_map = self._question, self.hybrid_map
        self._first += int(self._count[kernel.NODES])
        if self._first > 2**30:
            self._slot[:], self._first = 0, 1
        self._count[:] = 0
        x, y = question.place
        cell = hybrid_map.index((math.floor(x + 0.5), math.floor(y + 0.5)))
        border = hybrid_map.border
        for n, heading in enumerate(question.headings):
            state = cell * self._bins + heading
            self._floats[3 * n : 3 * n + 3] = x + border, y + border, 0.0
            self._wholes[6 * n : 6 * n + 6] = heading, -1, -1, 0, state, 0
            self._slot[state] = self._first + n
            self._keys[n], self._heap[n] = question.weight * float(field[cell]), n
        self._count[[kernel.WAITING, kernel.NODES]] = len(question.headings)

    def result(self) -> HybridPath | None:
        """The best path found; None: there is none."""
        cost, node, curved = self._best.tolist()
        if cost < 0:
            return None
        motions = motions_of(self.hybrid_map.shape)
        at = int(node)
        pieces: list[PathPiece] = []
        while True:
            parent, motion = self._wholes[6 * at + 1 : 6 * at + 3].tolist()
            if parent < 0:
                break
            length, turn, lateral, _ = motions.parts[motion].tolist()
            pieces.append(PathPiece(length, turn, lateral, int(motions.turned[motion, 1])))
            at = parent
        pieces.reverse()
        first = self._pose(at)
        if curved:
            for length, turn, lateral in self._segments.reshape(-1, 3).tolist():
                if abs(length) < _NOTHING and (length != 0.0 or abs(turn) < _NOTHING):
                    continue  # rounding of a curve that begins or ends straight
                gear = 0 if length == 0 else -1 if length < 0 else 1
                pieces.append(PathPiece(length, turn, lateral, gear))
        return HybridPath(tuple(pieces), first, cost, bool(curved))

    def _pose(self, node: int) -> Pose:
        x, y, _ = self._floats[3 * node : 3 * node + 3].tolist()
        border, question = self.hybrid_map.border, self._question
        yaw = question.yaw + int(self._wholes[6 * node]) * (2 * math.pi / self._bins)
        return x - border, y - border, yaw
