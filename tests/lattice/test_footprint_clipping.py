"""Poses and sweeps of random footprints on random maps against polygons that shapely clips: no collision is missed.

All of it, 100,000 poses and 100,000 sweeps of each planner:

    python -m pytest -m nightly -s tests/lattice/test_footprint_clipping.py
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pytest
import shapely

from lampyris.kernels.hybrid.collision import FINE, piece_free
from lampyris.kernels.lattice.search import SHIFT
from lampyris.model.grid import Grid
from lampyris.model.robot import DRIVES, Polygon, Robot
from lampyris.model.scene import Scene
from lampyris.planning.hybrid.map import HybridMap
from lampyris.planning.hybrid.motions import HybridShape
from lampyris.planning.lattice.lattice import MARGIN
from lampyris.planning.lattice.lattice_planner import LatticePlanner, lattice_for
from lampyris.planning.lattice.map import LatticeMap
from lampyris.planning.lattice.poses import segments_of
from lampyris.planning.lattice.search import Found, LatticeSearch
from sizes import sized

SIDE = 26
"""Cells of a map's side."""
AREA = 1e-9
"""Overlap, in cells, from which on shapely's answer is a collision."""
MOVED = 0.02
"""Cells that a point moves at most between two poses at which a sweep is clipped."""
EACH = 40
"""Poses, and sweeps, of one robot on one map."""

Pose = tuple[float, float, float]


class Walls:
    """The blocked cells of a map as squares, rows downwards."""

    def __init__(self, blocked: np.ndarray) -> None:
        y, x = np.nonzero(blocked)
        self._squares = shapely.box(x - 0.5, y - 0.5, x + 0.5, y + 0.5)
        self._tree = shapely.STRtree(self._squares)

    def overlap(self, outlines: np.ndarray) -> float:
        """The greatest area that one of the outlines has in common with one square."""
        one, square = self._tree.query(outlines, predicate="intersects")
        common = shapely.area(shapely.intersection(outlines[one], self._squares[square]))
        return float(common.max(initial=0.0))

    def gap(self, outlines: np.ndarray) -> float:
        """The least distance of one of the outlines from a square."""
        return float(self._tree.query_nearest(outlines, return_distance=True)[1].min())


def outlines_at(footprint: Polygon, poses: np.ndarray) -> np.ndarray:
    """The footprint (y to the left) at poses whose y and yaw point down; shapely's polygons."""
    x, y = np.array(footprint).T[:, None, :] * np.array([1.0, -1.0])[:, None, None]
    cos, sin = np.cos(poses[:, 2:]), np.sin(poses[:, 2:])
    corners = np.stack((poses[:, :1] + cos * x - sin * y, poses[:, 1:2] + sin * x + cos * y), axis=2)
    polygons: np.ndarray = shapely.polygons(corners)
    return polygons


def along(pose: Pose, segment: tuple[float, float, float], arm: float) -> np.ndarray:
    """Poses of a straight line, an arc or a turn in place, so dense that no point moves farther than ``MOVED``."""
    (x, y, yaw), (length, turn, lateral) = pose, segment
    count = 2 + math.ceil((abs(length) + abs(turn) * arm) / MOVED)
    share = np.linspace(0.0, 1.0, count)
    start = np.exp(1j * (yaw + lateral))
    z = (
        length * share * start
        if turn == 0.0
        else length / turn * start * (np.exp(1j * turn * share) - 1) / 1j
    )
    return np.column_stack((x + z.real, y + z.imag, yaw + turn * share))


def drawn_footprint(rng: np.random.Generator) -> Polygon:
    """A rectangle whose base is anywhere in it, or a star-shaped outline, most often not convex."""
    if rng.random() < 0.4:
        ahead, back, left, right = rng.uniform(0.2, 3.0, 4)
        return (ahead, left), (-back, left), (-back, -right), (ahead, -right)
    while True:
        turns = np.sort(rng.uniform(0, 2 * math.pi, int(rng.integers(3, 11))))
        gaps = np.diff(turns, append=turns[0] + 2 * math.pi)
        if gaps.min() > 0.1 and gaps.max() < 3.0:
            reach = rng.uniform(0.4, 3.0, len(turns))
            corners = zip((reach * np.cos(turns)).tolist(), (reach * np.sin(turns)).tolist(), strict=True)
            return tuple(corners)


def drawn_map(rng: np.random.Generator) -> np.ndarray:
    blocked: np.ndarray = rng.random((SIDE, SIDE)) < rng.choice([0.01, 0.03, 0.06])
    blocked[rng.integers(SIDE), rng.integers(SIDE)] = True
    return blocked


class Judged(NamedTuple):
    """How many poses or sweeps were free, were refused, and were refused though shapely finds no overlap."""

    free: int
    refused: int
    careful: int

    def __add__(self, other: object) -> Judged:
        assert isinstance(other, Judged)
        return Judged(*(a + b for a, b in zip(self, other, strict=True)))


def judge(is_free: bool, outlines: np.ndarray, walls: Walls, room: float, what: object) -> Judged:
    """Compare an answer with shapely's; one that is too careful must be within ``room`` of a wall."""
    overlap = walls.overlap(outlines)
    if is_free:
        assert overlap <= AREA, what
        return Judged(1, 0, 0)
    if overlap > AREA:
        return Judged(0, 1, 0)
    assert walls.gap(outlines) <= room, what
    return Judged(0, 1, 1)


def lattice_cases(rng: np.random.Generator) -> tuple[Judged, Judged]:
    """Poses and sweeps of a random robot by the kernel that searches: what it reaches with one expansion."""
    footprint, drive = drawn_footprint(rng), DRIVES[int(rng.integers(len(DRIVES)))]
    robot = Robot(footprint=footprint, drive=drive, turn_radius=float(rng.uniform(1.0, 4.0)))
    blocked = drawn_map(rng)
    scene = Scene(Grid(blocked), (0, 0), (SIDE - 1, SIDE - 1), robot=robot)
    lattice = lattice_for(scene, LatticePlanner(headings=int(rng.choice([16, 32]))))
    lattice_map, walls = LatticeMap(scene.grid, lattice), Walls(blocked)
    search = LatticeSearch(lattice_map)
    anywhere = np.zeros(lattice_map.walls.size, dtype=np.int64)
    n = len(lattice.angles)
    poses = sweeps = Judged(0, 0, 0)
    room = math.sqrt(2) * MARGIN + MOVED
    while sum(poses[:2]) < EACH or sum(sweeps[:2]) < EACH:
        cell, heading = (int(rng.integers(SIDE)), int(rng.integers(SIDE))), int(rng.integers(n))
        index = lattice_map.index(cell)
        stands = lattice_map.is_free(cell, heading)
        here = np.array([(*cell, -lattice.angles[heading])])
        if sum(poses[:2]) < EACH:
            poses += judge(stands, outlines_at(footprint, here), walls, room, (footprint, cell, heading))
        if not stands or sum(sweeps[:2]) >= EACH:
            continue
        search.begin(anywhere, [(index, heading)], [(0, 0)])
        search.improve(1.0, 1)
        for k in range(lattice.first[heading], lattice.first[heading + 1]):
            there = index + int(lattice_map.offsets[k])
            to = lattice_map.cell(there)
            state = there * n + int(lattice.turned[k])
            if not scene.grid.contains(to):
                continue
            reached = search._mark[state] >> SHIFT == search._run
            if reached and search._parent[state] != k:
                continue  # a cheaper motion leads there
            motion = Found(((index, heading),), (k,), (there, int(lattice.turned[k])), 0, 0)
            first, segments = segments_of(motion, lattice_map)
            at = (float(first[0]), float(first[1]), float(first[2]))
            parts = []
            for segment in segments.tolist():
                parts.append(along(at, tuple(segment), robot.radius))
                at = tuple(parts[-1][-1].tolist())
            # The states of the lattice are where the segments end.
            assert math.dist(at[:2], to) < 1e-6
            outlines = outlines_at(footprint, np.concatenate(parts))
            sweeps += judge(bool(reached), outlines, walls, room, (footprint, cell, heading, k))
    return poses, sweeps


def hybrid_cases(rng: np.random.Generator) -> tuple[Judged, Judged]:
    """Poses and motions anywhere, as ``hybrid-astar`` and the shortcuts judge them."""
    footprint, blocked = drawn_footprint(rng), drawn_map(rng)
    shape = HybridShape(footprint, "omnidirectional", 2.0, 72, 1.5, 2.0, 1.0, 0.0)
    hybrid_map, walls = HybridMap(Grid(blocked), shape), Walls(blocked)
    vertices, border = np.array(footprint), hybrid_map.border
    whole = hybrid_map.stride, hybrid_map.walls.size // hybrid_map.stride, border
    outer, cover = vertices[:, 0].copy(), shape.cover.ravel()
    poses = sweeps = Judged(0, 0, 0)
    while sum(sweeps[:2]) < EACH:
        pose = (*rng.uniform(-0.4, SIDE - 0.6, 2).tolist(), float(rng.uniform(-4, 4)))
        stands = hybrid_map.stands(*pose)
        if sum(poses[:2]) < EACH:
            poses += judge(stands, outlines_at(footprint, np.array([pose])), walls, 1e-9, (footprint, pose))
        if not stands:
            continue
        length, turn, lateral = (
            float(rng.choice([0.0, 1.0]) * rng.uniform(-size, size)) for size in (6, 2, math.pi)
        )
        dense = along(pose, (length, turn, lateral), shape.outer)
        if np.abs(dense[:, :2] - (SIDE - 1) / 2).max() > SIDE / 2 - 2 * FINE:
            continue  # the base leaves the map, or nearly so, which is refused by itself
        is_free = piece_free(
            hybrid_map.walls, hybrid_map.clear, *whole, outer, -vertices[:, 1], cover, shape.inner, shape.outer,
            pose[0] + border, pose[1] + border, pose[2], length, turn, lateral,
        )  # fmt: skip
        # A piece is judged by axes, so diagonally it is root 2 times as careful, at either end of it.
        room = 2 * math.sqrt(2) * FINE + MOVED
        what = (footprint, pose, length, turn, lateral)
        sweeps += judge(bool(is_free), outlines_at(footprint, dense), walls, room, what)
    return poses, sweeps


@sized("count", 40, 100_000)
@pytest.mark.parametrize("planner", ["lattice", "hybrid-astar"])
def test_no_collision_is_missed(planner: str, count: int) -> None:
    cases = {"lattice": lattice_cases, "hybrid-astar": hybrid_cases}[planner]
    poses = sweeps = Judged(0, 0, 0)
    for number in range(-(-count // EACH)):
        one, other = cases(np.random.default_rng([26, number]))
        poses, sweeps = poses + one, sweeps + other
    print(f"{planner}: poses {poses}, sweeps {sweeps}")
    for judged in (poses, sweeps):
        assert sum(judged[:2]) >= count
        if count > 1000:
            assert min(judged.free, judged.refused) > count / 20
            assert judged.careful < judged.refused / 4
