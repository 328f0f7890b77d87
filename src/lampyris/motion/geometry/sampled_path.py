"""Sampled path: a path with nodes on it, where speeds are decided."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from lampyris._core.arrays import index_array
from lampyris._core.limits import NODES
from lampyris._core.values import Value
from lampyris.model.curve import Curve
from lampyris.model.path import Path
from lampyris.model.robot import Robot
from lampyris.typing import Floats, Points

_STRAIGHT = 1e-9
"""Sine of a turn below which two steps lie on one line."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SampledPath(Value):
    """Nodes along a path, from start to goal.

    Parameters
    ----------
    s : float64 (n,), metres from the start, strictly rising from 0; n >= 1.
    xy : float64 (n, 2), cells.
    heading : float64 (n, 2), unit vectors: where the robot leaves each node to (the last: where it came by).
    curvature : float64 (n,), 1/m, >= 0: the greatest that touches the node; that of a piece is constant
        between its nodes, so a limit held at both holds between them.
    stop : bool (n,): where the robot must stand still and turn in place.
    resolution : metres a cell.
    curve : where it comes from; None: a path of cells.

    Examples
    --------
    >>> import lampyris
    >>> scene = lampyris.Scene(lampyris.load_grid("guide"), start=(1, 8), goal=(8, 2))
    >>> sampled = lampyris.smooth(scene, lampyris.plan(scene, "astar"), spacing=0.5)
    >>> sampled.xy.shape[1], float(sampled.s[0])
    (2, 0.0)
    """

    s: Floats
    xy: Points
    heading: Points
    curvature: Floats
    stop: NDArray[np.bool_]
    resolution: float
    curve: Curve | None = None

    def __len__(self) -> int:
        return len(self.s)

    def _brief(self) -> str:
        stops = int(self.stop.sum())
        return f"<{type(self).__name__} of {len(self.s)} nodes, {self.s[-1]:.6g} m, {stops} stops>"


def sample_path(path: Path, resolution: float) -> SampledPath:
    """A path of cells as it is: nodes at the cells, corners without curvature and without stops.

    For a robot that goes from cell to cell, tick by tick; see :func:`sample_with_corners`.
    """
    # At every tick of a simulation: no call that is not needed.
    xy = path.cells.astype(np.float64)
    n = len(xy)
    s, heading = np.zeros(n), np.empty((n, 2))
    if n > 1:
        step = xy[1:] - xy[:-1]
        long = np.sqrt(step[:, 0] * step[:, 0] + step[:, 1] * step[:, 1])
        np.cumsum(long, out=s[1:])
        s *= resolution
        np.divide(step, long[:, None], out=heading[:-1])
        heading[-1] = heading[-2]
    else:
        heading[:] = 1.0, 0.0
    return SampledPath(s, xy, heading, np.zeros(n), np.zeros(n, dtype=np.bool_), resolution)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SampledCellPath(SampledPath):
    """A path of cells, its nodes the cells, with what its corners ask for.

    Parameters
    ----------
    cells : int64 (n, 2): the cells of the nodes.
    corners : how each corner is driven.
    """

    cells: NDArray[np.int64] = field(kw_only=True)
    corners: Corners = field(kw_only=True)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Corners(Value):
    """How the corners of a path of cells are driven, see :func:`corners_of_path`.

    Parameters
    ----------
    node : int64 (k,), rising: the nodes at which the path turns.
    radius : float64 (k,), metres: of the arc at each, >= 0.
    tangent : float64 (k,), metres: how far from the node the arc begins and ends.
    stop : bool (k,): where the robot stands still and turns in place instead.
    """

    node: NDArray[np.int64]
    radius: Floats
    tangent: Floats
    stop: NDArray[np.bool_]

    @property
    def deviation(self) -> float:
        """Metres by which the robot leaves the path at most, in the middle of an arc."""
        r, tangent = self.radius[~self.stop], self.tangent[~self.stop]
        # r and the tangent are the sides of a right triangle; its third joins the node and the centre.
        return float((np.sqrt(r * r + tangent * tangent) - r).max(initial=0.0))


def corners_of_path(path: Path, resolution: float, robot: Robot) -> Corners:
    """How a robot drives the corners of a path of cells without leaving it by more than half a step.

    Each corner is an arc that touches both steps, and begins and ends at most half the shorter of the two
    away from the node, so that the arcs of neighbouring corners do not overlap: its radius is that half,
    divided by the tangent of half the turn. Where that is less than the robot's turning circle, or the path
    turns back on itself, the corner is a stop. Walls need not be looked at: an arc stays within the cells
    that its two steps touch, and is no nearer to any wall than the nearest of the cells that a robot with a
    radius must have room in to make these steps (tests/motion/test_corners.py tries every pair of steps).
    Lines between other places than cells have no such cells: see :func:`lampyris.motion.geometry.curve.curve_of`.
    """
    step = np.diff(path.cells.astype(np.float64), axis=0) * resolution
    if len(step) < 2:
        nothing = np.zeros(0)
        return Corners(np.zeros(0, dtype=np.int64), nothing, nothing, np.zeros(0, dtype=np.bool_))
    long = np.sqrt(step[:, 0] * step[:, 0] + step[:, 1] * step[:, 1])
    a, b = step[:-1] / long[:-1, None], step[1:] / long[1:, None]
    cross = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    dot = a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1]
    turns = (cross > _STRAIGHT) | (dot < 0.0)
    back = cross <= _STRAIGHT
    # Of the two forms of the tangent of half the turn the one that does not cancel.
    wide = dot < 0.0
    slant = np.where(wide, 1.0 - dot, cross) / np.where(wide, np.where(back, 1.0, cross), 1.0 + dot)
    half = 0.5 * np.minimum(long[:-1], long[1:])
    radius = np.where(back, 0.0, half / np.where(turns & ~back, slant, 1.0))[turns]
    stop = (radius == 0.0) | (radius < robot.turn_radius)
    return Corners(np.flatnonzero(turns) + 1, radius, half[turns], stop)


def sample_with_corners(path: Path, resolution: float, robot: Robot) -> SampledCellPath:
    """A path of cells as it is, its corners driven as :func:`corners_of_path` says.

    A robot is at its fastest on an arc at one of the two ends, half-way to the neighbouring nodes; speeds are
    monotone between nodes. So the curvature of a corner counts at its node and at both neighbours.
    """
    plain, corners = sample_path(path, resolution), corners_of_path(path, resolution, robot)
    kappa, stop = np.zeros(len(plain)), np.zeros(len(plain), dtype=np.bool_)
    stop[corners.node[corners.stop]] = True
    arcs = ~corners.stop
    node, bend = corners.node[arcs], 1.0 / corners.radius[arcs]
    for k in (-1, 0, 1):
        np.maximum.at(kappa, node + k, bend)
    cells = path.cells.astype(np.int64)
    lines = (plain.s, plain.xy, plain.heading, kappa, stop, resolution)
    return SampledCellPath(*lines, cells=cells, corners=corners)


def places(route: Path | SampledPath) -> Points | None:
    """Where a profile's nodes are; None: at the cells of a path."""
    return route.xy if isinstance(route, SampledPath) and not isinstance(route, SampledCellPath) else None


def sample_curve(curve: Curve, spacing: float) -> SampledPath:
    """Nodes on a curve, at most ``spacing`` metres apart, one at each border of two pieces.

    Every piece is divided evenly. Between two stops there are at least two edges, so that the robot can
    drive between them.
    """
    wanted = np.maximum(np.ceil(curve.lengths / spacing), 1.0)
    NODES.demand(int(min(float(wanted.sum()), 1e15)) + 1, "the path", instead="choose a larger spacing")
    counts = wanted.astype(np.int64)
    halts = {0, len(curve.lengths), *curve.stops.tolist()}
    for k in range(len(counts)):
        if k in halts and k + 1 in halts and counts[k] == 1:
            counts[k] = 2
    begins = curve.begins
    border = np.concatenate(([0], np.cumsum(counts)))
    piece = np.repeat(np.arange(len(counts)), index_array(counts))
    share = (np.arange(len(piece)) - border[piece] + 1) / counts[piece]
    nodes = np.concatenate((begins[:1], begins[piece] + curve.lengths[piece] * share))
    nodes[border] = begins
    xy, heading = curve.at(nodes)
    n = len(nodes)
    kappa, stop = np.zeros(n), np.zeros(n, dtype=np.bool_)
    size = np.repeat(np.abs(curve.curvature), index_array(counts))
    kappa[:-1] = size
    kappa[1:] = np.maximum(kappa[1:], size)
    stop[border[curve.stops]] = True
    return SampledPath(nodes, xy, heading, kappa, stop, curve.resolution, curve)
