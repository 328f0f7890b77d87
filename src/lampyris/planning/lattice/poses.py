"""Poses in metres and lattice states: from one to the other."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lampyris._core.arrays import index_array
from lampyris.kernels.curves.sampling import sample
from lampyris.model.grid import Grid
from lampyris.model.path import Pose, PosePath
from lampyris.planning.lattice.lattice import UNIT, StateLattice
from lampyris.planning.lattice.map import LatticeMap
from lampyris.planning.lattice.primitives import Primitive, angles
from lampyris.planning.lattice.sampled import LatticeMotion
from lampyris.planning.lattice.search import Found
from lampyris.typing import Cell, Cells, Floats

STEP = 0.45
"""Cells that a point of the robot moves at most between two poses of a path."""


def headings_near(headings: int | tuple[float, ...], yaw: float) -> list[int]:
    """Headings by their distance from a yaw in the frame of the cells, the nearest first."""
    turns = angles(headings)
    return sorted(range(len(turns)), key=lambda k: (abs(difference(turns[k], yaw)), k))


def difference(a: float, b: float) -> float:
    """The angle a - b in [-pi, pi]."""
    return math.remainder(a - b, 2 * math.pi)


def distance(a: tuple[float, float], b: tuple[float, float]) -> float:
    """Distance between two points."""
    dx, dy = a[0] - b[0], a[1] - b[1]
    return math.sqrt(dx * dx + dy * dy)


def states_near(grid: Grid, headings: int | tuple[float, ...], pose: Pose) -> list[tuple[Cell, int]]:
    """The lattice states around a pose, the nearest first: the four nearest cells with the nearest heading."""
    (x, y), yaw = grid.frame.to_points(pose[0], pose[1]).tolist(), pose[2] - grid.origin[2]
    cells = [(cx, cy) for cx in _around(x) for cy in _around(y)]
    cells = sorted(filter(grid.contains, cells), key=lambda c: (distance(c, (x, y)), c))
    heading = headings_near(headings, yaw)[0]
    return [(cell, heading) for cell in cells]


def to_cells(grid: Grid, x: float, y: float, yaw: float) -> tuple[float, float, float]:
    """A pose in metres of the map frame as cells, y down, with the yaw from x to y."""
    column, row = grid.frame.to_points(x, y).tolist()
    return column, row, grid.origin[2] - yaw


def _around(value: float) -> tuple[int, int]:
    low = math.floor(value)
    return low, low + 1


def pose_path_of(found: Found, lattice_map: LatticeMap, arm: float) -> tuple[PosePath, Cells]:
    """The poses of a path of the lattice, and the cells that its base passes through.

    Parameters
    ----------
    arm : distance from the base to the farthest point of the robot, cells.
    """
    lattice, grid = lattice_map.lattice, lattice_map.grid
    tracks = _tracks_of(lattice, arm)
    taken = np.array(found.primitives, dtype=np.int64)
    counts = tracks.count[taken]
    begin = np.concatenate(([0], np.cumsum(counts)))
    rows = np.arange(begin[-1]) + np.repeat(tracks.first[taken] - begin[:-1], index_array(counts))
    index = np.array([cell for cell, _ in found.states], dtype=np.int64)
    y, x = np.divmod(index, lattice_map.stride)
    points = np.empty((len(rows) + 1, 3))
    points[:-1] = tracks.poses[rows]
    points[:-1, 0] += np.repeat(x - lattice_map.border, index_array(counts))
    points[:-1, 1] = np.repeat(y - lattice_map.border, index_array(counts)) - points[:-1, 1]
    points[-1] = (*lattice_map.cell(found.last[0]), lattice.angles[found.last[1]])
    cells = np.floor(points[:, :2] + 0.5).astype(np.int32)
    entered = np.append(True, (cells[1:] != cells[:-1]).any(axis=1))
    yaw = math.pi - np.remainder(math.pi - points[:, 2] - grid.origin[2], 2 * math.pi)
    metres = np.column_stack((grid.frame.to_metres(points[:, :2]), yaw))
    prices = tracks.price[taken]
    to_m = grid.resolution / UNIT
    path = PosePath(
        metres,
        np.repeat(tracks.gear[taken], index_array(counts)),
        found.cost * to_m,
        found.lower_bound * to_m,
        np.repeat(prices, index_array(counts)) if (prices != 1.0).any() else None,
    )
    return path, np.asarray(cells[entered])


@dataclass(frozen=True, slots=True, eq=False)
class _Tracks:
    """The poses along each primitive of a lattice but the last, one after another.

    Parameters
    ----------
    poses : float64 (k, 3): x, y (cells, y up) and yaw.
    first, count : int64 (n,): where those of a primitive begin, and how many they are.
    gear, price : int64, float64 (n,): how each is driven, and the factor of its cost.
    """

    poses: Floats
    first: NDArray[np.int64]
    count: NDArray[np.int64]
    gear: NDArray[np.int64]
    price: Floats


@lru_cache(16)
def _tracks_of(lattice: StateLattice, arm: float) -> _Tracks:
    """The poses along the primitives: a path has the same few again and again, and sines take most of its time."""
    tracks = [one.poses(STEP, arm)[:-1] for one in lattice.primitives]
    count = np.array([len(track) for track in tracks], dtype=np.int64)
    return _Tracks(
        np.concatenate(tracks),
        np.cumsum(count) - count,
        count,
        np.array([gear_of(one) for one in lattice.primitives], dtype=np.int64),
        np.array([one.price for one in lattice.primitives]),
    )


def path_along(
    first: Pose,
    segments: Floats,
    gears: NDArray[np.int8],
    cost: float,
    lower_bound: float,
    grid: Grid,
    arm: float,
) -> tuple[PosePath, Cells]:
    """The poses along straight lines, arcs and turns in place, and the cells that the base passes through.

    Parameters
    ----------
    first : where it begins: x, y (cells, y down) and yaw (from x to y).
    segments : float64 (n, 3): length, turn and lateral; see ``kernels.curves.sampling.moved``.
    gears : int8 (n,): how each is driven.
    cost : in cells.
    lower_bound : of the cost of the paths that the planner's bound speaks of, in cells.
    arm : distance from the base to the farthest point of the robot, cells.
    """
    moved = np.abs(segments[:, 0]) + np.abs(segments[:, 1]) * arm
    counts = np.maximum(np.ceil(moved / STEP), 1).astype(np.int64)
    flat = np.zeros(3 * int(counts.sum()))
    if len(segments):
        sample(*first, *segments.T.copy(), counts, flat)
    points = np.concatenate((np.array([first]), flat.reshape(-1, 3)))
    yaw = math.pi - np.remainder(math.pi - (grid.origin[2] - points[:, 2]), 2 * math.pi)
    metres = np.column_stack((grid.frame.to_metres(points[:, :2]), yaw))
    bound = min(lower_bound * grid.resolution, cost * grid.resolution)
    path = PosePath(metres, np.repeat(gears, index_array(counts)), cost * grid.resolution, bound)
    cells: Cells = np.floor(points[:, :2] + 0.5).astype(np.int32)
    changed = np.append(True, (cells[1:] != cells[:-1]).any(axis=1))
    return path, np.asarray(cells[changed], dtype=np.int32)


def segments_of(found: Found, lattice_map: LatticeMap) -> tuple[Pose, Floats]:
    """The first pose (cells, y down, yaw from x to y) and the segments of a path of our own primitives.

    Returns
    -------
    float64 (n, 3): length, turn and lateral; see ``kernels.curves.sampling.moved``.
    """
    lattice = lattice_map.lattice
    index, heading = found.states[0] if found.states else found.last
    x, y = lattice_map.cell(index)
    rows: list[tuple[float, float, float]] = []
    for k in found.primitives:
        primitive = lattice.primitives[k]
        assert isinstance(primitive, Primitive)
        rows += [(length, -turn, -primitive.lateral) for length, turn in primitive.pieces]
    return (float(x), float(y), -lattice.angles[heading]), np.array(rows).reshape(-1, 3)


def gear_of(primitive: LatticeMotion) -> int:
    """How a primitive is driven: 1 ahead, -1 in reverse, 0 in place."""
    if primitive.length == 0:
        return 0
    return -1 if primitive.reverse else 1
