"""Trees of poses on one map, and the path that they find."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels.curves.sampling import sample
from lampyris.kernels.sampling import pose_connect as kernel
from lampyris.planning.hybrid.map import HybridMap
from lampyris.planning.lattice.shortcut import DRIVES
from lampyris.typing import Cell, Floats

_NOTHING = 2e-6
"""Cells, and radians, below which a segment is left out."""
_SPACING = 1.0
"""Cells between points of the curves that a picture shows."""

CellPose = tuple[float, float, float]
"""x, y (cells, y down) and yaw (from x to y)."""


@dataclass(frozen=True, slots=True, eq=False)
class PoseTask:
    """What one search is to do.

    Parameters
    ----------
    hybrid_map : the map, and the robot.
    starts, goals : poses at either end; all of an end are at one place.
    step : length of a curve by which a tree grows, cells.
    reverse, turn_cost : cost of a cell's length in reverse, 0: none is driven; of a radian turned in place.
    """

    hybrid_map: HybridMap
    starts: tuple[CellPose, ...]
    goals: tuple[CellPose, ...]
    step: float
    reverse: float
    turn_cost: float


class PoseTrees:
    """Two trees that grow until they meet.

    Parameters
    ----------
    task : what to do.
    cells : int32 (f,): cells where the base may be, of the padded map.
    key : 32 bits that all draws come from.
    samples : that are taken at most.
    most : no path that costs as much, in cells, is of use; infinite: any is.
    """

    def __init__(self, task: PoseTask, cells: NDArray[np.int32], key: int, samples: int, most: float) -> None:
        self._task, self._cells = task, cells
        shape, hybrid_map = task.hybrid_map.shape, task.hybrid_map
        self._room = min(samples, 1 << 10) + 128
        self._nodes, self._pieces = np.empty(8 * self._room), np.empty(30 * self._room)
        self._parent = np.empty(2 * self._room, dtype=np.int32)
        self._count = np.zeros(7, dtype=np.int64)
        border = hybrid_map.border
        for tree, poses in enumerate((task.starts, task.goals)):
            for k, (x, y, yaw) in enumerate(poses):
                n = tree * self._room + k
                self._nodes[4 * n : 4 * n + 4] = x + border, y + border, yaw, 0.0
                self._parent[n] = -1
            self._count[tree] = len(poses)
        self._whole = np.array(
            [
                hybrid_map.stride, hybrid_map.walls.size // hybrid_map.stride, border, shape.family, DRIVES[shape.drive], key,
                0, self._room,
            ],
            dtype=np.int64,
        )  # fmt: skip
        self._numbers = np.array(
            [
                shape.inner,
                shape.outer,
                shape.radius,
                task.reverse,
                task.turn_cost,
                task.step,
                shape.radius,
                most,
            ]
        )

    @property
    def taken(self) -> int:
        """Samples taken."""
        return int(self._count[kernel.SAMPLED])

    @property
    def curves(self) -> int:
        """Curves checked for collisions."""
        return int(self._count[kernel.CURVES])

    def run(self, samples: int) -> bool:
        """Take so many samples more, or fewer if the trees meet; whether they did."""
        hybrid_map = self._task.hybrid_map
        vertices = np.array(hybrid_map.shape.footprint)
        end = self.taken + samples
        room = (np.zeros(5), np.zeros(15), np.zeros(3), np.zeros(5), np.zeros(5, dtype=np.int64))
        while True:
            self._whole[kernel.SAMPLES] = end - self.taken
            outcome = kernel.connect_poses(
                hybrid_map.walls, hybrid_map.clear, vertices[:, 0].copy(), -vertices[:, 1], hybrid_map.shape.cover.ravel(),
                self._cells, self._whole, self._numbers, self._nodes, self._parent, self._pieces, *room, self._count,
            )  # fmt: skip
            if outcome != kernel.FULL:
                return bool(outcome == kernel.FOUND)
            self._grow()

    def _grow(self) -> None:
        """Twice the room."""
        old = self._room
        for name, wide in (("_nodes", 4), ("_pieces", 15), ("_parent", 1)):
            held = getattr(self, name).reshape(2, old * wide)
            wider = np.concatenate((held, np.empty_like(held)), axis=1)
            setattr(self, name, wider.ravel())
        second = self._parent[2 * old :]
        second[second >= old] += old
        self._room = 2 * old
        self._whole[kernel.ROOM] = self._room

    def path(self) -> tuple[CellPose, Floats]:
        """The first pose, and length, turn and lateral of each segment, float64 (n, 3); the trees have met."""
        border = self._task.hybrid_map.border
        node, parts = int(self._count[kernel.FIRST_MET]), []
        while self._parent[node] >= 0:
            parts.append(self._piece(node))
            node = int(self._parent[node])
        parts.reverse()
        x, y, yaw = self._nodes[4 * node : 4 * node + 3].tolist()
        node = int(self._count[kernel.SECOND_MET])
        while self._parent[node] >= 0:
            back = self._piece(node)[::-1]
            parts.append(back * np.array([-1.0, -1.0, 1.0]))
            node = int(self._parent[node])
        rows = np.concatenate(parts) if parts else np.zeros((0, 3))
        far = np.where(rows[:, 0] != 0, np.abs(rows[:, 0]), np.abs(rows[:, 1]))
        return (x - border, y - border, yaw), rows[far >= _NOTHING]

    def _piece(self, node: int) -> Floats:
        piece: Floats = self._pieces[15 * node : 15 * node + 15].reshape(5, 3)
        return piece

    def edges(self) -> Floats:
        """The curves of both trees in straight pieces: x0, y0, x1, y1, cells; float64 (m, 4)."""
        border = self._task.hybrid_map.border
        found = []
        for tree in (0, 1):
            for node in range(tree * self._room, tree * self._room + int(self._count[tree])):
                p = int(self._parent[node])
                if p < 0:
                    continue
                piece = self._piece(node)
                piece = piece[piece[:, 0] != 0]
                if not len(piece):
                    continue
                turned = float(self._piece(node)[0, 1]) if self._piece(node)[0, 0] == 0 else 0.0
                counts = np.maximum(np.ceil(np.abs(piece[:, 0]) / _SPACING), 1).astype(np.int64)
                flat = np.zeros(3 * int(counts.sum()))
                x, y, yaw = self._nodes[4 * p : 4 * p + 3].tolist()
                sample(x, y, yaw + turned, *piece.T.copy(), counts, flat)
                points = np.concatenate(([[x, y]], flat.reshape(-1, 3)[:, :2])) - border
                found.append(np.concatenate((points[:-1], points[1:]), axis=1))
        return np.concatenate(found) if found else np.zeros((0, 4))


def base_cells(hybrid_map: HybridMap) -> NDArray[np.int32]:
    """Flat cells of the padded map where the base may be."""
    y, x = np.nonzero(hybrid_map.low)
    return ((y + hybrid_map.border) * hybrid_map.stride + x + hybrid_map.border).astype(np.int32)


def separated(hybrid_map: HybridMap, a: Cell, b: Cell) -> bool:
    """Whether walls separate two cells for the base, however the robot is turned."""
    from scipy import ndimage  # bits: labels, whole numbers

    labels, _ = ndimage.label(hybrid_map.low, np.ones((3, 3)))
    there = int(labels[a[1], a[0]])
    return there != int(labels[b[1], b[0]])


def plain_distance(a: CellPose, b: CellPose) -> float:
    """Distance of two poses' places."""
    return math.sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]))
