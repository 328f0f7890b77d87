"""The lattice of a robot: its primitives with their costs, and the cells that each of them sweeps."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from heapq import heappop, heappush

import numpy as np
from numpy.typing import NDArray

from lampyris._core import elementary
from lampyris._core.cancellation import checkpoint
from lampyris.errors import FileError, LimitError
from lampyris.kernels.lattice.sweep import sweep
from lampyris.model.lattice.motion_primitives import MotionPrimitives
from lampyris.model.robot import Polygon, circumscribed_radius, inscribed_radius
from lampyris.planning.lattice.primitives import (
    Primitive,
    angles,
    arc,
    back,
    in_place,
    quarter_turned,
    straight,
)
from lampyris.planning.lattice.sampled import LatticeMotion, sampled
from lampyris.typing import Floats

UNIT = 1 << 20
"""Cost of a cell's length: costs are whole numbers, so that equal costs are equal."""
STEP = 0.1
"""Maximum distance, in cells, that a point of the footprint moves between two poses of a sweep."""
DISCS = 3
"""Discs that cover a sweep."""
_DIRECTIONS = ((1, 0, 1.0), (1, 1, math.sqrt(2.0)), (0, 1, 1.0), (-1, 1, math.sqrt(2.0)))
"""Directions, x and y down, and the lengths of these vectors."""
MOST_REACH = 1_000
"""Cells that a motion with the footprint may reach."""
MOST_LENGTH = 200_000
"""Cells that all motions together may be long."""
MARGIN = STEP / 2 + 1e-6
"""By how much the footprint is widened in a sweep: no point of it is ever farther from a pose than that."""


@dataclass(frozen=True, slots=True)
class LatticeShape:
    """What a lattice depends on; lengths in cells.

    Parameters
    ----------
    footprint : vertices (x ahead, y to the left), counterclockwise, the base inside.
    drive : ``differential``, ``ackermann`` or ``omnidirectional``.
    turn_radius : smallest radius of an arc.
    headings : 16 or 32.
    reverse_cost : by how much a length driven in reverse costs more; infinite: none is.
    turn_cost : cost of a radian turned in place.
    primitives : the primitives of a file, in place of our own; ``headings`` is how many theirs are.
    """

    footprint: Polygon
    drive: str
    turn_radius: float
    headings: int = 16
    reverse_cost: float = 2.0
    turn_cost: float = 4.0
    primitives: MotionPrimitives | None = None


@dataclass(frozen=True, slots=True, eq=False)
class StateLattice:
    """Primitives sorted by their first heading, as the search reads them.

    Parameters
    ----------
    shape : what it was made from.
    primitives : all of them.
    first : int32 (headings + 1,): where the primitives of a heading begin.
    cell : int64 (n, 2): where each ends, y down.
    turned : int32 (n,): heading at the end.
    cost : int64 (n,).
    reach : float32 (n,): farthest point of each sweep from the centre of the first cell, cells.
    sweep_first, sweep : int32 (n + 1,), int32 (k, 2): the cells (x, y down) that each sweeps, from the outermost.
    disc_first, disc, disc_radius : int32 (n + 1,), int32 (k, 2), float32 (k,): discs that cover each sweep, the cell (x, y
        down) in whose centre each is, and its radius, cells.
    stand_first, stand : the same for the footprint standing at each heading.
    inscribed : radius of the greatest disc around the base within the footprint, cells.
    scale : admissible cost of a cell's length of an octile field over the cells of :attr:`low_clearance`.
    low_clearance : clearance of the cells over which that field runs, cells.
    """

    shape: LatticeShape
    primitives: tuple[LatticeMotion, ...]
    first: NDArray[np.int32]
    cell: NDArray[np.int64]
    turned: NDArray[np.int32]
    cost: NDArray[np.int64]
    reach: NDArray[np.float32]
    sweep_first: NDArray[np.int32]
    sweep: NDArray[np.int32]
    disc_first: NDArray[np.int32]
    disc: NDArray[np.int32]
    disc_radius: NDArray[np.float32]
    stand_first: NDArray[np.int32]
    stand: NDArray[np.int32]
    inscribed: float
    scale: float
    low_clearance: float

    @property
    def angles(self) -> tuple[float, ...]:
        """The angle of each heading, radians in [0, 2 pi)."""
        given = self.shape.primitives
        return angles(self.shape.headings) if given is None else given.headings

    @property
    def border(self) -> int:
        """Cells around a map that sweeps, and the footprint at any heading, may reach."""
        swept = int(max(np.abs(self.sweep).max(), np.abs(self.cell).max())) + 1
        return max(swept, math.ceil(circumscribed_radius(self.shape.footprint)) + 3)


@lru_cache(16)
def lattice_of(shape: LatticeShape) -> StateLattice:
    """The lattice of a shape; the same object for the same shape.

    Raises
    ------
    LimitError : ``LATTICE_REACH``: motions of more than 1,000 cells.
    FileError : primitives of a file that the robot cannot drive.
    """
    n = shape.headings
    quarter: list[LatticeMotion]
    made: list[LatticeMotion]
    if shape.primitives is None:
        # Everything is worked out for the headings of a quarter turn, and turned into the other quarters.
        ours = sorted(motions_of(shape), key=lambda one: one.start)
        quarter, times = list(ours), 4
        made = [quarter_turned(one, n, k) for k in range(4) for one in ours]
        turns = angles(n)[: n // 4]
    else:
        reverse = math.isfinite(shape.reverse_cost)
        given = sampled(shape.primitives, shape.drive, shape.turn_radius, reverse)
        made = quarter = sorted(given, key=lambda one: one.start)
        times, turns = 1, shape.primitives.headings
        if not any(one.cell != (0, 0) for one in made):
            raise FileError(
                "PRIMITIVE", "no motion to another cell", where=shape.primitives.name, allowed="one at least"
            )
    first = np.searchsorted([one.start for one in made], np.arange(n + 1)).astype(np.int32)
    cost = np.array([_cost(one, shape) for one in quarter] * times, dtype=np.int64)
    arm = circumscribed_radius(shape.footprint)
    demand_reach(quarter, arm)
    sweeps = [_swept(shape.footprint, one.poses(STEP, arm), arm) for one in quarter]
    swept = _turned(sweeps, times)
    covers = [_cover(cells) for cells in sweeps]
    poses = [np.array([(0.0, 0.0, angle)]) for angle in turns]
    stands = _turned([_swept(shape.footprint, pose, arm) for pose in poses], times)
    low, chains = _low_chains([one.poses(STEP, 0.0) for one in quarter])
    scale = min(int(c) / UNIT / o for c, o in zip(cost, chains * times, strict=True) if o > 0)
    inscribed = inscribed_radius(shape.footprint)
    return StateLattice(
        shape,
        tuple(made),
        first,
        np.array([(one.cell[0], -one.cell[1]) for one in made], dtype=np.int64),
        np.array([one.end for one in made], dtype=np.int32),
        cost,
        np.array([_reach(cells) for cells in swept], np.float32),
        *_joined(swept),
        *_joined(_turned([middles for middles, _ in covers], times)),
        np.concatenate([radii for _, radii in covers] * times),
        *_joined(stands),
        inscribed,
        scale * (1 - 1e-12),
        max(inscribed - low, 0.0),
    )


def demand_reach(motions: Sequence[LatticeMotion], arm: float) -> None:
    """Refuse motions that are too long to be laid out pose by pose.

    Parameters
    ----------
    arm : distance from the base to the farthest point of the robot, cells.

    Raises
    ------
    LimitError : ``LATTICE_REACH``, ``LATTICE_LENGTH``.
    """
    reach = arm + max((one.reach for one in motions), default=0.0)
    if reach > MOST_REACH:
        raise LimitError(
            "LATTICE_REACH",
            f"motions and footprint reach {reach:.0f} cells",
            allowed=f"at most {MOST_REACH} cells",
            todo="take a coarser resolution or a smaller turn_radius",
            setting="robot.turn_radius",
        )
    length = math.fsum(one.length for one in motions)
    if length > MOST_LENGTH:
        raise LimitError(
            "LATTICE_LENGTH",
            f"motions of {length:,.0f} cells together",
            allowed=f"at most {MOST_LENGTH:,} cells",
        )


def motions_of(shape: LatticeShape) -> Iterable[Primitive]:
    """The motions that begin at a heading of the first quarter turn."""
    n = shape.headings
    headings = range(n // 4)
    backward = math.isfinite(shape.reverse_cost) and shape.drive != "omnidirectional"
    radius = max(shape.turn_radius, 1.0)
    for k in headings:
        yield straight(n, k)
        if backward:
            yield straight(n, k, -1)
        for by in (1, -1):
            yield arc(n, k, by, radius)
            if backward:
                yield back(arc(n, (k + by) % n, -by, radius), n)
            if shape.drive != "ackermann":
                yield in_place(n, k, by)
    if shape.drive == "omnidirectional":
        yield from _sideways(n)


def _sideways(n: int) -> Iterable[Primitive]:
    """Motions along each lattice vector but the heading's own, without a turn."""
    for k in range(n // 4):
        for j in range(n):
            if j != k:
                ahead = straight(n, j)
                lateral = angles(n)[j] - angles(n)[k]
                yield Primitive(k, k, ahead.cell, ahead.pieces, angles(n)[k], lateral)


def _cost(one: LatticeMotion, shape: LatticeShape) -> int:
    if one.length == 0:
        return math.ceil(one.turn * shape.turn_cost * one.price * UNIT)
    factor = shape.reverse_cost if one.reverse else 1.0
    return math.ceil(one.length * factor * one.price * UNIT)


def _swept(footprint: Polygon, poses: Floats, arm: float) -> NDArray[np.int32]:
    """Cells (x, y down) that the footprint touches along poses (y up), those farthest from the start first."""
    checkpoint()
    reach = math.ceil(float(np.abs(poses[:, :2]).max()) + arm) + 2
    side = 2 * reach + 1
    touched = np.zeros(side * side, dtype=np.uint8)
    px, py = np.array([x for x, _ in footprint]), np.array([-y for _, y in footprint])
    yaw = -poses[:, 2]
    cos, sin = elementary.cos(yaw), elementary.sin(yaw)
    sweep(
        px,
        py,
        poses[:, 0] + reach,
        reach - poses[:, 1],
        cos,
        sin,
        MARGIN,
        touched,
        side,
        side,
    )
    y, x = np.nonzero(touched.reshape(side, side))
    cells = np.stack((x - reach, y - reach), axis=1)
    distance = (cells * cells).sum(axis=1)
    return cells[np.argsort(-distance, kind="stable")].astype(np.int32)


def _reach(cells: NDArray[np.int32]) -> float:
    """Distance from the centre of the cell (0, 0) to the farthest corner of any of the cells."""
    corner = np.abs(cells) + 0.5
    return math.sqrt(float((corner * corner).sum(axis=1).max()))


def _cover(cells: NDArray[np.int32]) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """Discs that cover the cells of a sweep: the cells in whose centres they are, and their radii.

    The cells are parted across the direction of :data:`_DIRECTIONS` in which they are longest.
    """
    x, y = cells[:, 0], cells[:, 1]
    along = [(x * across + y * down) / size for across, down, size in _DIRECTIONS]
    most = max(along, key=np.ptp)
    low = float(most.min())
    of = np.minimum((most - low) * (DISCS / max(float(np.ptp(most)), 1.0)), DISCS - 1).astype(np.int64)
    parts = [cells[of == part] for part in range(DISCS) if (of == part).any()]
    middles = [(part.min(axis=0) + part.max(axis=0)) // 2 for part in parts]
    radii = [_reach(part - middle) for part, middle in zip(parts, middles, strict=True)]
    return np.array(middles, dtype=np.int32), np.array(radii, dtype=np.float32)


def _turned(swept: list[NDArray[np.int32]], times: int) -> list[NDArray[np.int32]]:
    """The same cells, then turned counterclockwise by one quarter and so on, ``times`` in all; y points down."""
    quarters = [swept]
    for _ in range(times - 1):
        quarters.append([np.column_stack((cells[:, 1], -cells[:, 0])) for cells in quarters[-1]])
    return [cells for quarter in quarters for cells in quarter]


def _joined(parts: list[NDArray[np.int32]]) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    first = np.concatenate(([0], np.cumsum([len(part) for part in parts]))).astype(np.int32)
    return first, np.concatenate(parts)


def _low_chains(tracks: list[Floats]) -> tuple[float, list[float]]:
    """What a primitive costs at least in an octile field: ``(distance, costs)``.

    While the base moves along a primitive it passes through cells. Among the cells whose centres it passes within
    ``distance`` there is a chain of octile steps from the first cell to the last for every primitive; its cost is
    the least of all such chains.
    """
    passed = [_passed(track) for track in tracks]
    distance = 0.0
    for cells, end in passed:
        for limit in sorted(set(cells.values())):
            if _octile(cells, end, max(limit, distance)) < math.inf:
                distance = max(limit, distance)
                break
    return distance + 1e-9, [_octile(cells, end, distance) for cells, end in passed]


def _passed(track: Floats) -> tuple[dict[tuple[int, int], float], tuple[int, int]]:
    """The cells that a track passes through, with its least distance from the centre of each, and the last."""
    cells: dict[tuple[int, int], float] = {}
    for x, y, _ in track.tolist():
        for cx in range(math.ceil(x - 0.5 - 1e-9), math.floor(x + 0.5 + 1e-9) + 1):
            for cy in range(math.ceil(y - 0.5 - 1e-9), math.floor(y + 0.5 + 1e-9) + 1):
                near = math.sqrt((x - cx) * (x - cx) + (y - cy) * (y - cy))
                cells[cx, cy] = min(cells.get((cx, cy), math.inf), near)
    return cells, (round(track[-1, 0]), round(track[-1, 1]))


def _octile(cells: dict[tuple[int, int], float], end: tuple[int, int], limit: float) -> float:
    """Cost of the cheapest octile chain from (0, 0) within cells no farther than ``limit`` from the track."""
    best = {(0, 0): 0.0}
    heap = [(0.0, (0, 0))]
    while heap:
        cost, (x, y) = heappop(heap)
        if (x, y) == end:
            return cost
        for dx in (-1, 0, 1):
            for dy in (-1, 0, 1):
                to = (x + dx, y + dy)
                if cells.get(to, math.inf) <= limit:
                    more = cost + math.sqrt(dx * dx + dy * dy)
                    if more < best.get(to, math.inf):
                        best[to] = more
                        heappush(heap, (more, to))
    return math.inf
