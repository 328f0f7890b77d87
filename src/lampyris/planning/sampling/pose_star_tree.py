"""A tree of poses around a path: it is rewired as it grows, so that the path costs less and less."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels.curves.sampling import sample
from lampyris.kernels.sampling import pose_connect, pose_star, pose_steps
from lampyris.kernels.sampling.tree import cut, hang
from lampyris.planning.lattice.shortcut import DRIVES, ShortcutShape
from lampyris.planning.sampling.pose_trees import CellPose, PoseTask
from lampyris.typing import Floats

_APART = 2.0
"""Cells between poses of the path near which samples are drawn, about."""
_NOTHING = 2e-6
"""Cells, and radians, below which a segment is left out."""
_OFF = 2e-4
"""Cells, and radians, by which segments that are left out may move the end of a path, all together."""


class PoseStarTree:
    """RRT* over poses, begun with a path.

    Parameters
    ----------
    task : what to do.
    cells : int32 (f,): cells where the base may be, of the padded map.
    key : 32 bits that all draws come from.
    robot : prices of segments.
    """

    def __init__(self, task: PoseTask, cells: NDArray[np.int32], key: int, robot: ShortcutShape) -> None:
        self._task, self._cells, self._robot = task, cells, robot
        hybrid_map, shape = task.hybrid_map, task.hybrid_map.shape
        self._room = 1 << 11
        self._nodes, self._pieces, self._paid = (np.zeros(n * self._room) for n in (4, 15, 1))
        self._parent, self._child, self._after, self._before = (
            np.full(self._room, -1, dtype=np.int32) for _ in range(4)
        )
        self._roots, self._ends = len(task.starts), len(task.goals)
        self._count = np.zeros(4, dtype=np.int64)
        self._count[pose_star.NODES] = self._roots + self._ends
        for n, (x, y, yaw) in enumerate((*task.starts, *task.goals)):
            cost = 0.0 if n < self._roots else math.inf
            self._nodes[4 * n : 4 * n + 4] = x + hybrid_map.border, y + hybrid_map.border, yaw, cost
        rows = hybrid_map.walls.size // hybrid_map.stride
        self._whole = np.array(
            [
                hybrid_map.stride, rows, hybrid_map.border, shape.family, DRIVES[shape.drive], key, 0, self._room,
                self._roots, self._ends,
            ],
            dtype=np.int64,
        )  # fmt: skip
        self._numbers = np.array(
            [
                shape.inner, shape.outer, shape.radius, task.reverse, task.turn_cost, task.step, shape.radius, math.inf,
            ]
        )  # fmt: skip
        self._beacons = np.zeros(0)

    @property
    def taken(self) -> int:
        """Samples taken."""
        return int(self._count[pose_star.SAMPLED])

    @property
    def cost(self) -> float:
        """Of the best path, cells; infinite: there is none."""
        return float(self._nodes[4 * self._goal() + 3])

    def _goal(self) -> int:
        costs = self._nodes[4 * self._roots + 3 : 4 * (self._roots + self._ends) : 4]
        return self._roots + int(costs.argmin())

    def take(self, first: CellPose, segments: Floats) -> None:
        """Take in a path from a start to a goal: free, and cheaper than the best one.

        Parameters
        ----------
        first : one of the starts.
        segments : float64 (n, 3): length, turn and lateral of each.
        """
        parts, costs = segments, self._robot.costs(segments)
        border = self._task.hybrid_map.border
        while int(self._count[pose_star.NODES]) + len(parts) + 2 >= self._room:
            self._grow()
        ends = np.zeros(3 * len(parts))
        begin = (first[0] + border, first[1] + border, first[2])
        self.follow(first, segments)
        sample(*begin, *parts.T.copy(), np.ones(len(parts), dtype=np.int64), ends)
        poses = ends.reshape(-1, 3)
        at = _nearest(first[2], self._task.starts)
        goal = self._roots + _nearest(float(poses[-1, 2]), self._task.goals)
        for k, (part, cost) in enumerate(zip(parts, costs.tolist(), strict=True)):
            n = goal
            if k < len(parts) - 1:
                n = int(self._count[pose_star.NODES])
                self._count[pose_star.NODES] += 1
                self._nodes[4 * n : 4 * n + 3] = poses[k]
                self._child[n] = -1
            elif self._parent[goal] >= 0:
                cut.plain(self._parent, self._child, self._after, self._before, goal)
            self._nodes[4 * n + 3] = self._nodes[4 * at + 3] + cost
            self._paid[n] = cost
            self._pieces[15 * n : 15 * n + 15] = 0.0
            self._pieces[15 * n : 15 * n + 3] = part
            hang.plain(self._parent, self._child, self._after, self._before, n, at)
            at = n

    def follow(self, first: CellPose, segments: Floats) -> None:
        """Draw samples near a path from now on."""
        border = self._task.hybrid_map.border
        counts = np.maximum(np.ceil(np.abs(segments[:, 0]) / _APART), 1).astype(np.int64)
        self._beacons = np.zeros(3 * int(counts.sum()))
        begin = (first[0] + border, first[1] + border, first[2])
        sample(*begin, *segments.T.copy(), counts, self._beacons)

    def run(self, samples: int) -> None:
        """Take so many samples more."""
        hybrid_map = self._task.hybrid_map
        vertices = np.array(hybrid_map.shape.footprint)
        end = self.taken + samples
        room = (np.zeros(5), np.zeros(15), np.zeros(3), np.zeros(5), np.zeros(5, dtype=np.int64))
        most = 2 * pose_star.NEAREST
        near, far = np.zeros(most, dtype=np.int64), np.zeros(most)
        while True:
            self._whole[pose_connect.SAMPLES] = end - self.taken
            outcome = pose_star.improve_poses(
                hybrid_map.walls, hybrid_map.clear, vertices[:, 0].copy(), -vertices[:, 1], hybrid_map.shape.cover.ravel(),
                self._cells, self._beacons, self._whole, self._numbers, self._nodes, self._parent, self._child, self._after,
                self._before, self._paid, self._pieces, *room, near, far, self._count,
            )  # fmt: skip
            if outcome != pose_connect.FULL:
                return
            self._grow()

    def stepped(self, first: CellPose, segments: Floats, step: float, which: int) -> Floats | None:
        """The segments of a free path after steps of its poses, each of which made it cheaper; None: none did.

        Parameters
        ----------
        first : where the path begins.
        segments : float64 (n, 3): length, turn and lateral of its segments.
        step : cells.
        which : of its poses: the middles of the first, third, ... segment (0), of the others (1), or where segments meet (2).
        """
        hybrid_map = self._task.hybrid_map
        border = hybrid_map.border
        begin = (first[0] + border, first[1] + border, first[2])
        halves = np.repeat(segments * (0.5, 0.5, 1.0), 2, axis=0)
        ends = np.zeros(3 * len(halves))
        sample(*begin, *halves.T.copy(), np.ones(len(halves), dtype=np.int64), ends)
        begins, every = ((1, 4), (3, 4), (2, 2))[which]
        cuts = [0, *range(begins, len(halves), every), len(halves)]
        many = len(cuts)
        nodes, pieces = np.zeros((many + 1, 4)), np.zeros((many, 5, 3))
        nodes[0, :3], nodes[1:-1, :3] = begin, ends.reshape(-1, 3)[np.array(cuts[1:]) - 1]
        at = 4 * (self._roots + _nearest(float(nodes[many - 1, 2]), self._task.goals))
        goal = self._nodes[at : at + 3].copy()
        goal[2] = nodes[many - 1, 2] + math.remainder(goal[2] - nodes[many - 1, 2], 2 * math.pi)
        nodes[many - 1, :3] = goal
        for k, (i, j) in enumerate(pairwise(cuts), 1):
            pieces[k, : j - i] = halves[i:j]
        paid = self._robot.costs(pieces.reshape(-1, 3)).reshape(-1, 5).sum(axis=1)
        vertices = np.array(hybrid_map.shape.footprint)
        flat_nodes, flat_pieces = nodes.ravel(), pieces.ravel()
        better = pose_steps.step_poses(
            hybrid_map.walls, hybrid_map.clear, vertices[:, 0].copy(), -vertices[:, 1], hybrid_map.shape.cover.ravel(),
            self._whole, self._numbers, step, flat_nodes, paid, flat_pieces, np.zeros(5), np.zeros(30), np.zeros(3),
            np.zeros(5), np.zeros(5, dtype=np.int64),
        )  # fmt: skip
        if not better:
            return None
        parts = _parts(flat_pieces.reshape(-1, 3))
        ends = np.zeros(3 * len(parts))
        sample(*begin, *parts.T.copy(), np.ones(len(parts), dtype=np.int64), ends)
        off = ends[-3:] - goal
        off[2] = math.remainder(off[2], 2 * math.pi)
        return parts if float(np.abs(off).max()) < _OFF else None

    def _grow(self) -> None:
        """Twice the room."""
        for name in ("_nodes", "_pieces", "_paid", "_parent", "_child", "_after", "_before"):
            held = getattr(self, name)
            setattr(self, name, np.concatenate((held, np.full_like(held, -1))))
        self._room *= 2
        self._whole[pose_connect.ROOM] = self._room

    def path(self) -> tuple[CellPose, Floats]:
        """The first pose, and length, turn and lateral of each segment, float64 (n, 3), of the best path."""
        border, node, parts = self._task.hybrid_map.border, self._goal(), []
        while self._parent[node] >= 0:
            parts.append(self._pieces[15 * node : 15 * node + 15].reshape(5, 3))
            node = int(self._parent[node])
        rows = np.concatenate(parts[::-1]) if parts else np.zeros((0, 3))
        x, y, yaw = self._nodes[4 * node : 4 * node + 3].tolist()
        return (x - border, y - border, yaw), _parts(rows)

    def edges(self) -> Floats:
        """Lines from nodes to their parents, for pictures: x0, y0, x1, y1, cells; float64 (m, 4)."""
        n = int(self._count[pose_star.NODES])
        used = np.flatnonzero(self._parent[:n] >= 0)
        xy = self._nodes[: 4 * n].reshape(n, 4)[:, :2] - self._task.hybrid_map.border
        return np.concatenate((xy[used], xy[self._parent[used]]), axis=1)


def _parts(rows: Floats) -> Floats:
    """The segments that lead anywhere."""
    far = np.where(rows[:, 0] != 0, np.abs(rows[:, 0]), np.abs(rows[:, 1]))
    parts: Floats = rows[far >= _NOTHING]
    return parts


def _nearest(yaw: float, poses: tuple[CellPose, ...]) -> int:
    """Which of some poses at one place has the yaw nearest to one."""
    turns = [abs(math.remainder(yaw - other, 2 * math.pi)) for _, _, other in poses]
    return turns.index(min(turns))
