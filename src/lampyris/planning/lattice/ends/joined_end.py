"""A pose beside the states of a lattice, and the exact curves that join it to states nearby.

A search can begin at all of these states at once, each at the cost of its curve, and end at any of those around the goal.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lampyris._core import elementary
from lampyris.kernels.hybrid import joins as kernel
from lampyris.model.path import Pose
from lampyris.planning.lattice.goal_field import GoalField
from lampyris.planning.lattice.lattice import UNIT
from lampyris.planning.lattice.map import LatticeMap
from lampyris.planning.lattice.poses import difference
from lampyris.planning.lattice.search import Found
from lampyris.planning.lattice.shortcut import ShortcutShape, covering_discs, kernel_numbers
from lampyris.typing import Floats

KEPT = 32
"""States that a pose is joined to, at most."""
_TURNS = 2
"""Cells on each side in which states are tried, for robots that turn in place."""
_LEAST, _FARTHEST = 3, 8
"""The same for cars, at least and at most."""
_SAME = 1e-9
"""Cells, and radians, by which two poses may differ that count as one."""
_SOME = 256
"""States of a car, those with the least lower bounds, whose curves are worked out first."""
_SWING = math.radians(70.0)
"""Angle between the headings of a car at a pose and at a state, at most."""


@dataclass(frozen=True, slots=True, eq=False)
class JoinedEnd:
    """The states that a pose is joined to by free curves, the cheapest of them.

    Parameters
    ----------
    pose : x, y (cells, y down) and yaw (from x to y).
    states : pairs of cell index and heading, one or more.
    costs : of the curves, in units of the lattice.
    curves : float64 (n, 3) each: segments from the pose to the state, or from there to the pose; see
        ``kernels.curves.sampling.moved``.
    """

    pose: Pose
    states: list[tuple[int, int]]
    costs: list[int]
    curves: list[Floats]

    def curve(self, state: tuple[int, int]) -> Floats:
        """The segments of the curve of a state."""
        return self.curves[self.states.index(state)]

    def only(self, kept: list[int]) -> JoinedEnd:
        """The same with some of the states, by their numbers."""
        return JoinedEnd(
            self.pose,
            [self.states[k] for k in kept],
            [self.costs[k] for k in kept],
            [self.curves[k] for k in kept],
        )


class Ends(NamedTuple):
    """Both ends of a search.

    Parameters
    ----------
    start, goal : poses that are joined to states; None: the path begins or ends at a state.
    """

    start: JoinedEnd | None
    goal: JoinedEnd | None

    def around(self, found: Found, first: Pose, segments: Floats) -> tuple[Pose, Floats]:
        """The first pose and the segments of a path of the lattice with the curves at its ends.

        Parameters
        ----------
        first, segments : of the path between states.
        """
        if self.start is not None and self.goal is not None and _same(self.start.pose, self.goal.pose):
            return self.start.pose, segments[:0]
        parts = [segments]
        if self.start is not None:
            begin = found.states[0] if found.states else found.last
            first, parts = self.start.pose, [self.start.curve(begin), segments]
        if self.goal is not None:
            parts.append(self.goal.curve(found.last))
        return first, np.concatenate(parts)

    def and_without(self) -> tuple[Ends, ...]:
        """These ends, then with the goal, the start, and both at the nearest states of the lattice."""
        parts = (self, Ends(self.start, None), Ends(None, self.goal), Ends(None, None))
        return tuple(dict.fromkeys(parts))


def _same(one: Pose, other: Pose) -> bool:
    """Whether two poses are one."""
    turned = abs(difference(one[2], other[2]))
    return max(abs(one[0] - other[0]), abs(one[1] - other[1]), turned) < _SAME


AT_STATES = Ends(None, None)
"""Both ends are states of the lattice."""


def joined_end(
    pose: Pose, robot: ShortcutShape, lattice_map: LatticeMap, *, into: bool = False
) -> JoinedEnd | None:
    """The states around a pose with free exact curves to them; None: the robot cannot stand there, or no curve is free.

    Parameters
    ----------
    pose : x, y (cells, y down) and yaw (from x to y).
    robot : the robot and its prices.
    into : whether curves lead from the states to the pose.
    """
    if not lattice_map.stands_free(robot.footprint, pose):
        return None
    car = robot.drive == "ackermann"
    states = _around(pose, robot, lattice_map)
    if not len(states):
        return None
    angles = np.array(lattice_map.lattice.angles)
    border = lattice_map.border
    nodes = np.empty((len(states) + 1, 3))
    nodes[0] = pose[0] + border, pose[1] + border, pose[2]
    nodes[1:, :2] = states[:, :2] + border
    nodes[1:, 2] = -angles[states[:, 2]]
    whole, numbers = kernel_numbers(robot, lattice_map)
    room = (np.zeros(15), np.zeros(3), np.zeros(5), np.zeros(5, dtype=np.int64))
    vertices = np.array(robot.footprint)
    body = vertices[:, 0].copy(), -vertices[:, 1], covering_discs(robot.footprint).ravel()
    least = _least_costs(nodes, states[:, 2], angles, robot)
    nearest = np.argsort(least, kind="stable")
    some = _SOME if car else len(states)
    while True:
        # Those that are left out cost more than the ones that count.
        among = np.concatenate(([0], np.sort(nearest[:some]) + 1))
        flat, costs = nodes[among].ravel(), np.zeros(len(among) - 1)
        kernel.join_costs(flat, into, whole, numbers, costs, *room)
        beyond = float(least[nearest[some]]) if some < len(states) else math.inf
        order = np.argsort(costs, kind="stable")
        order = order[costs[order] < beyond] + 1
        curves, taken = np.zeros(15 * KEPT), np.zeros(KEPT, dtype=np.int64)
        kernel.free_joins(
            lattice_map.walls,
            lattice_map.clear,
            *body,
            whole,
            numbers,
            flat,
            into,
            order,
            curves,
            taken,
            *room,
        )
        if some >= len(states) or (taken > 0).all():
            break
        some *= 4
    states = states[among[1:] - 1]
    taken = taken[taken > 0] - 1
    if not len(taken):
        return None
    rows = curves.reshape(KEPT, -1, 3)[: len(taken)]
    return JoinedEnd(
        pose,
        [(lattice_map.index((x, y)), h) for x, y, h in states[taken].tolist()],
        [math.ceil(cost * UNIT) for cost in costs[taken].tolist()],
        [row[driven] for row, driven in zip(rows, (rows[:, :, :2] != 0).any(axis=2), strict=True)],
    )


def _least_costs(nodes: Floats, headings: NDArray[np.int64], angles: Floats, robot: ShortcutShape) -> Floats:
    """Costs that no curve of a car between the first node and each other one undercuts, nor one of another drive; float64 (n,).

    Nor is it shorter than the straight line, nor than the turn at the least radius; and in the frame of either end a car gets
    so far to the side only by turning off.
    """
    (x, y, yaw), others = nodes[0], nodes[1:]
    dx, dy = others[:, 0] - x, others[:, 1] - y
    least: Floats = np.sqrt(dx * dx + dy * dy)
    if robot.drive != "ackermann":
        return least
    turns = np.remainder(others[:, 2] - yaw + math.pi, 2 * math.pi) - math.pi
    least = np.maximum(least, robot.radius * np.abs(turns))
    # Of a curve of length s no more than s * s / (2 * radius) leads to the side, seen from either end.
    cos, sin = elementary.direction(yaw)
    cosines, sines = elementary.cos(angles)[headings], -elementary.sin(angles)[headings]
    aside = np.maximum(np.abs(cos * dy - sin * dx), np.abs(cosines * dy - sines * dx))
    least = np.maximum(least, np.sqrt(2.0 * robot.radius * aside))
    return least * (1.0 - 1e-9)


def _around(pose: Pose, robot: ShortcutShape, lattice_map: LatticeMap) -> NDArray[np.int64]:
    """States in a square around a pose, x, y, heading; int64 (n, 3)."""
    car = robot.drive == "ackermann"
    reach = min(max(math.ceil(0.75 * robot.radius) + 1, _LEAST), _FARTHEST) if car else _TURNS
    x, y, yaw = pose
    grid, angles = lattice_map.grid, lattice_map.lattice.angles
    columns = np.arange(max(math.floor(x) - reach, 0), min(math.ceil(x) + reach, grid.width - 1) + 1)
    rows = np.arange(max(math.floor(y) - reach, 0), min(math.ceil(y) + reach, grid.height - 1) + 1)
    headings = [h for h, angle in enumerate(angles) if not car or abs(difference(-angle, yaw)) <= _SWING]
    room = lattice_map.room[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    dy, dx = np.nonzero(room >= max(lattice_map.lattice.inscribed - 1e-6, 1e-3))
    cells = np.column_stack((columns[dx], rows[dy]))
    turned = np.tile(np.array(headings, dtype=np.int64), len(cells))
    return np.column_stack((np.repeat(cells, len(headings), axis=0), turned)).astype(np.int64)


def heuristic_of(goal: JoinedEnd, lattice_map: LatticeMap, field: GoalField) -> NDArray[np.int64]:
    """The heuristic of a pose in all parts of the map, separated by walls, in which a state leads to it.

    In each part it is that of the cheapest state there, :func:`lowered`.

    Parameters
    ----------
    field : of an earlier map with the same goal, to be repaired.
    """
    found: NDArray[np.int64] | None = None
    for cell, _ in goal.states:
        if found is not None and found[cell] >= 0:
            continue
        base = lattice_map.heuristic((lattice_map.cell(cell),), field if found is None else None)
        here = [k for k, (other, _) in enumerate(goal.states) if base[other] >= 0]
        part = lowered(base, goal.only(here)) if here else base
        found = part if found is None else np.where(part >= 0, part, found)
    assert found is not None
    return found


def lowered(heuristic: NDArray[np.int64], end: JoinedEnd) -> NDArray[np.int64]:
    """A heuristic of one goal cell made one of a pose, which all of the end's states lead to.

    The heuristic at a state is at most what it costs to get from there to another plus the heuristic there. So it stays
    admissible, and consistent, if it is lowered by the most by which it exceeds the cost of the curve of one of these states.

    Parameters
    ----------
    heuristic : int64 (cells,), negative where the base must not be; the cell is that of one of the states.
    """
    more = excess(heuristic, end)
    return heuristic if more <= 0 else np.where(heuristic >= 0, np.maximum(heuristic - more, 0), heuristic)


def excess(heuristic: NDArray[np.int64], end: JoinedEnd) -> int:
    """The most by which a heuristic exceeds the cost of the curve of one of an end's states, all of which it is known at."""
    return max(int(heuristic[cell]) - cost for (cell, _), cost in zip(end.states, end.costs, strict=True))
