"""Shortcuts of a path of poses: pieces of it are replaced by exact curves that cost less.

The path is cut into parts of equal cost. Between any two of the poses where it is cut the cheapest exact curve is worked
out (Reeds and Shepp, or Dubins; turn, straight line, turn; a straight line to any side, as the drive allows), and of all
sequences of parts and free curves the cheapest is taken. This is repeated on the path that results, which is cut at other
poses, until it saves little. The cost never rises, and nothing is random.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from lampyris._core.cancellation import checkpoint
from lampyris.kernels.curves.sampling import sample
from lampyris.kernels.hybrid import shortcut as kernel
from lampyris.kernels.hybrid.goal_curve import CAR, DUBINS, IN_PLACE, REEDS_SHEPP, SIDEWAYS
from lampyris.model.robot import Polygon, circumscribed_radius, inscribed_radius
from lampyris.planning.lattice.map import ClearanceMap
from lampyris.typing import Floats

DRIVES = {"ackermann": CAR, "differential": IN_PLACE, "omnidirectional": SIDEWAYS}
"""The number of each drive in kernels."""
DISCS = 8
"""Discs that cover a footprint, at most."""
NODES = 48
"""Poses between which curves are tried in one round, at most."""
ROUNDS = 2
"""Rounds, at most."""
_SPACING = 1.5
"""Cells of cost between two of the poses, at least."""
LEAST_SAVING = 0.01
"""Cells that a curve must save."""
_ENOUGH = 1e-3
"""Share of the cost below which a round's saving is the last."""
_SAME = 1e-9
"""Cells, and radians, by which two poses may differ that count as one."""
_FAR = 1e9
"""Cells of cost of a gap that only a curve may close."""
_SNAP = 0.05
"""Cells of cost within which a path is cut at the end of a segment."""


@dataclass(frozen=True, slots=True)
class ShortcutShape:
    """The robot and the prices; lengths in cells.

    Parameters
    ----------
    footprint : vertices (x ahead, y to the left), counterclockwise, the base inside.
    drive : ``differential``, ``ackermann`` or ``omnidirectional``.
    radius : of arcs.
    reverse_cost : by how much a length driven in reverse costs more; 0: none is.
    turn_cost : cost of a radian turned in place.
    """

    footprint: Polygon
    drive: str
    radius: float
    reverse_cost: float
    turn_cost: float

    def costs(self, segments: Floats) -> Floats:
        """The cost of each segment, float64 (n,)."""
        length, turn = segments[:, 0], segments[:, 1]
        driven = np.where(length < 0, -length * self.reverse_cost, length)
        return np.where(length == 0, np.abs(turn) * self.turn_cost, driven)


def covering_discs(footprint: Polygon) -> Floats:
    """Discs that cover a footprint: x, y (down), radius; float64 (n, 3).

    They stand in a row along the longer side of the rectangle around it, about as many as it is wide.
    """
    vertices = np.array(footprint)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    size = high - low
    axis = int(size[1] > size[0])
    count = min(DISCS, math.ceil(1.5 * size[axis] / size[1 - axis]))
    part = size[axis] / count
    discs = np.tile((low + high) / 2, (count, 1))
    discs[:, axis] = low[axis] + part * (np.arange(count) + 0.5)
    radius = math.sqrt(part * part + float(size[1 - axis] * size[1 - axis])) / 2
    return np.column_stack((discs[:, 0], -discs[:, 1], np.full(count, radius)))


@lru_cache(16)
def _radii(footprint: Polygon) -> tuple[float, float]:
    return inscribed_radius(footprint), circumscribed_radius(footprint)


@lru_cache(16)
def _outline(footprint: Polygon) -> tuple[Floats, Floats, Floats]:
    """Vertices, x and y (down), and the discs that cover it, flat."""
    vertices = np.array(footprint)
    return vertices[:, 0].copy(), -vertices[:, 1], covering_discs(footprint).ravel()


def kernel_numbers(robot: ShortcutShape, bordered: ClearanceMap) -> tuple[NDArray[np.int64], Floats]:
    """``whole`` and ``numbers`` of :func:`lampyris.kernels.hybrid.shortcut.shortcut`."""
    inscribed, circumscribed = _radii(robot.footprint)
    whole = np.array(
        [
            bordered.stride, bordered.walls.size // bordered.stride, bordered.border,
            REEDS_SHEPP if robot.reverse_cost > 0 else DUBINS, DRIVES[robot.drive],
        ],
        dtype=np.int64,
    )  # fmt: skip
    numbers = np.array(
        [
            inscribed, circumscribed, robot.radius,
            robot.reverse_cost, robot.turn_cost, LEAST_SAVING,
        ]
    )  # fmt: skip
    return whole, numbers


def shortened(first: Floats, segments: Floats, robot: ShortcutShape, bordered: ClearanceMap) -> Floats:
    """The segments of a path that begins and ends at the same poses, is free as well and costs as much or less.

    Parameters
    ----------
    first : float64 (3,): where the path begins: x, y (cells, y down) and yaw (from x to y).
    segments : float64 (n, 3): length, turn and lateral of its segments; see ``kernels.curves.sampling.moved``.
    robot : the robot.
    bordered : the map; its border is at least 3 cells wider than the robot reaches.
    """
    at = first + np.array([bordered.border, bordered.border, 0.0])
    for _ in range(ROUNDS if len(segments) else 0):
        checkpoint()
        cost = float(robot.costs(segments).sum())
        better = _round(at, segments, robot, bordered)
        saved = cost - float(robot.costs(better).sum())
        if saved <= 0:
            break
        segments = better
        if saved < _ENOUGH * cost:
            break
    return segments


def joined(
    start: Floats, first: Floats, segments: Floats, goal: Floats, robot: ShortcutShape, bordered: ClearanceMap
) -> Floats | None:
    """The segments of a path that begins and ends at other poses, joined to this one by exact curves; None: none is free.

    Parameters
    ----------
    start, goal : float64 (3,): poses where the robot touches no wall, as ``first`` of :func:`shortened`.
    first, segments, robot, bordered : as for :func:`shortened`.
    """
    border = np.array([bordered.border, bordered.border, 0.0])
    poses, parts, along, cuts = _cut_poses(first + border, segments, robot)
    ends = [start + border, goal + border]
    gaps = [float(np.abs(one - other).max()) for one, other in zip(ends, poses[[0, -1]], strict=True)]
    first_gap, last_gap = (0.0 if gap < _SAME else _FAR for gap in gaps)
    nodes = np.concatenate((ends[:1], poses, ends[1:]))
    costs = np.concatenate(([0.0], along + first_gap, [float(along[-1]) + first_gap + last_gap]))
    pieces = [parts[i:j] for i, j in pairwise(cuts)]
    path, cost = _cheapest(nodes, costs, [parts[:0], *pieces, parts[:0]], robot, bordered)
    return path if cost < _FAR else None


def _round(first: Floats, segments: Floats, robot: ShortcutShape, bordered: ClearanceMap) -> Floats:
    """The segments after one round."""
    poses, parts, along, cuts = _cut_poses(first, segments, robot)
    pieces = [parts[i:j] for i, j in pairwise(cuts)]
    return _cheapest(poses, along, pieces, robot, bordered)[0]


def _cut_poses(
    first: Floats, segments: Floats, robot: ShortcutShape
) -> tuple[Floats, Floats, Floats, np.ndarray]:
    """The path cut: poses where it is cut, its parts, the cost up to each of these poses, and between which parts they are."""
    if not len(segments):
        return first.reshape(1, 3), segments, np.zeros(1), np.zeros(1, dtype=np.int64)
    parts, costs, cuts = _cut(segments, robot.costs(segments))
    ends = np.zeros(3 * len(parts))
    sample(*first.tolist(), *parts.T.copy(), np.ones(len(parts), dtype=np.int64), ends)
    poses = np.concatenate((first, ends)).reshape(-1, 3)
    return poses[cuts], parts, np.concatenate(([0.0], np.cumsum(costs)))[cuts], cuts


def _cheapest(
    poses: Floats, along: Floats, pieces: list[Floats], robot: ShortcutShape, bordered: ClearanceMap
) -> tuple[Floats, float]:
    """The cheapest sequence of pieces between neighbouring poses, and of free curves; its segments, and its cost.

    Parameters
    ----------
    poses : float64 (n, 3).
    along : float64 (n,): cost of the path up to each of them.
    pieces : the n - 1 pieces of the path between them, segments of each.
    """
    nodes, n = poses.ravel(), len(poses)
    outline = _outline(robot.footprint)
    whole, numbers = kernel_numbers(robot, bordered)
    before, known, curves = np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.uint8), np.zeros(15 * n)
    count, best = np.zeros(2, dtype=np.int64), np.zeros(n)
    kernel.shortcut(
        bordered.walls, bordered.clear, *outline,
        whole, numbers, nodes, along, np.zeros(n), known, np.zeros(15 * n), best, before, curves, count,
        np.zeros(15), np.zeros(3), np.zeros(5), np.zeros(5, dtype=np.int64),
    )  # fmt: skip
    taken: list[list[list[float]]] = []
    j = n - 1
    while j > 0:
        i = int(before[j])
        curve = curves[15 * j : 15 * j + 15].reshape(-1, 3).tolist()
        driven = [segment for segment in curve if segment[0] != 0.0 or segment[1] != 0.0]
        taken.append(driven if driven or i < j - 1 else pieces[i].tolist())
        j = i
    return _merged([segment for part in taken[::-1] for segment in part]), float(best[-1])


def _cut(segments: Floats, costs: Floats) -> tuple[Floats, Floats, np.ndarray]:
    """Segments cut at equal distances of cost: parts, the cost of each, and the indices of poses where it is cut."""
    ends = np.concatenate(([0.0], np.cumsum(costs)))
    total = float(ends[-1])
    count = int(min(NODES, max(2, total // _SPACING)))
    wanted = np.linspace(0.0, total, count)
    near = np.clip(np.searchsorted(ends, wanted), 1, len(ends) - 1)
    near = np.where(wanted - ends[near - 1] < ends[near] - wanted, near - 1, near)
    wanted = np.unique(np.where(np.abs(ends[near] - wanted) <= _SNAP, ends[near], wanted))
    marks = np.unique(np.concatenate((ends, wanted)))
    of = np.searchsorted(ends, marks[:-1], side="right") - 1
    part = np.diff(marks)
    share = part / costs[of]
    parts = segments[of] * np.column_stack((share, share, np.ones(len(share))))
    return parts, part, np.searchsorted(marks, wanted)


def _merged(segments: list[list[float]]) -> Floats:
    """Neighbours that are parts of one straight line, arc or turn are one segment."""
    rows: list[list[float]] = []
    for length, turn, lateral in segments:
        if rows:
            last = rows[-1]
            bend = abs(length * last[1] - turn * last[0]) <= 1e-9 * abs(length * last[0])
            onward = length * last[0] > 0 if length or last[0] else turn * last[1] > 0
            if lateral == last[2] and onward and bend:
                last[0] += length
                last[1] += turn
                continue
        rows.append([length, turn, lateral])
    return np.array(rows).reshape(-1, 3)
