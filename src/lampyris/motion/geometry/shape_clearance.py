"""Clearance of what drives a sampled path: of a point of the path, or of a robot with a heading and its footprint.

On a curve of poses (:class:`lampyris.model.curve.PoseCurve`) every rule that asks how far a wall is means the robot's
outline, and the robot's radius is taken as 0; elsewhere it means the centre of the robot's disc.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lampyris._core import elementary
from lampyris.kernels.motion.footprint_distance import wall_gaps
from lampyris.model.curve import PoseCurve
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.motion.geometry.clearance import wall_distance
from lampyris.motion.geometry.sampled_path import SampledPath
from lampyris.typing import Floats, Points


def distance_along(
    samples: SampledPath, grid: Grid, reach: float, nodes: slice | NDArray[np.int64] = slice(None)
) -> Floats:
    """Metres from the path's nodes (on a curve of poses: from the robot's rim there) to the nearest blocked square.

    Infinity beyond ``reach``; see :func:`lampyris.motion.geometry.clearance.wall_distance`.

    Parameters
    ----------
    nodes : which nodes; an index of arrays.
    """
    curve = samples.curve
    if isinstance(curve, PoseCurve):
        return footprint_clearance(curve, samples.s[nodes], samples.xy[nodes], grid, reach)
    return wall_distance(samples.xy[nodes], grid, reach)


def footprint_clearance(curve: PoseCurve, s: Floats, xy: Points, grid: Grid, reach: float) -> Floats:
    """Metres from the robot's rim to the nearest blocked square at distances along a curve; infinity beyond ``reach``.

    Parameters
    ----------
    s, xy : distances (metres) and where they lie (cells); (n,) and (n, 2).
    """
    res = grid.resolution
    gap = wall_distance(xy, grid, reach + curve.reach + curve.margin)
    if len(curve.outline) > 1:
        near = np.flatnonzero(np.isfinite(gap))
        yaw = curve.yaw_at(s[near])
        room, vertices = np.empty((2, len(curve.outline))), curve.outline / res
        cells = np.minimum(gap[near], reach * (1 + 1e-9) + res) / res
        wall_gaps(
            grid.blocked.ravel(), grid.width, grid.height, vertices[:, 0].copy(), vertices[:, 1].copy(),
            xy[near, 0].copy(), xy[near, 1].copy(), elementary.cos(yaw), elementary.sin(yaw), room[0], room[1], cells,
        )  # fmt: skip
        gap[near] = cells * res
    gap -= curve.margin
    np.maximum(gap, 0.0, out=gap)
    gap[gap > reach] = math.inf
    return gap


def edge_movement(samples: SampledPath) -> tuple[Floats, Floats]:
    """How far a point of the robot moves at most on each edge, metres, and how far it leaves the chord of that.

    A point that moves on an arc by a length m while it turns by an angle w is at most ``w m / 8`` from its chord.
    """
    ds = samples.s[1:] - samples.s[:-1]
    curve = samples.curve
    if isinstance(curve, PoseCurve):
        piece = curve.pieces_at(samples.s[:-1] + 0.5 * ds)
        moves = ds * curve.movement[piece]
        return moves, 0.125 * np.abs(curve.turn[piece]) * ds * moves
    bend = np.minimum(samples.curvature[1:], samples.curvature[:-1])
    return ds, 0.125 * bend * (ds * ds)


def radius_along(samples: SampledPath, robot: Robot) -> float:
    """Radius of the disc around the base, or the centre, that holds the robot, metres."""
    curve = samples.curve
    return curve.reach + curve.margin if isinstance(curve, PoseCurve) else robot.radius


def turn_rate(samples: SampledPath) -> Floats | None:
    """Radians a metre by which the robot's yaw turns at most on the edges at each node; None: it has no heading."""
    curve = samples.curve
    if not isinstance(curve, PoseCurve) or len(samples) < 2:
        return None
    rate = np.abs(curve.turn[curve.pieces_at(0.5 * (samples.s[1:] + samples.s[:-1]))])
    most: Floats = np.maximum(np.append(rate, rate[-1]), np.insert(rate, 0, rate[0]))
    return most
