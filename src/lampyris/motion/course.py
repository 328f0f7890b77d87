"""Course: a way with nodes on it, where speeds are decided."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lampyris.model.curve import Curve
from lampyris.model.path import Path
from lampyris.typing import Floats, Points


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """Nodes along a way, from start to goal.

    Parameters
    ----------
    s : float64 (n,), metres from the start, strictly rising from 0; n >= 1.
    xy : float64 (n, 2), cells.
    heading : float64 (n, 2), unit vectors: where the robot leaves each node to (the last: where it came by).
    curvature : float64 (n,), 1/m, >= 0: the greatest that touches the node; that of a piece is constant
        between its nodes, so a limit held at both holds between them.
    stop : bool (n,): where the robot must stand still and turn on the spot.
    resolution : metres a cell.
    curve : where it comes from; None: a path of cells, whose corners have no curvature.
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


def course_of_path(path: Path, resolution: float) -> Course:
    """A path of cells as it is: nodes at the cells, corners without curvature."""
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
    return Course(s, xy, heading, np.zeros(n), np.zeros(n, dtype=np.bool_), resolution)


def places(way: Path | Course) -> Points | None:
    """Where a profile's nodes are: told for a course; those of a path of cells are its cells."""
    return way.xy if isinstance(way, Course) else None


def course_of(curve: Curve, spacing: float) -> Course:
    """Nodes on a curve, at most ``spacing`` metres apart, one at each border of two pieces.

    Every piece is divided evenly. Between two stops there are at least two edges, so that the robot can
    drive between them.
    """
    counts = np.maximum(np.ceil(curve.lengths / spacing), 1).astype(np.int64)
    halts = {0, len(curve.lengths), *curve.stops.tolist()}
    for k in range(len(counts)):
        if k in halts and k + 1 in halts and counts[k] == 1:
            counts[k] = 2
    begins = curve.begins
    border = np.concatenate(([0], np.cumsum(counts)))
    piece = np.repeat(np.arange(len(counts)), counts)
    share = (np.arange(len(piece)) - border[piece] + 1) / counts[piece]
    nodes = np.concatenate((begins[:1], begins[piece] + curve.lengths[piece] * share))
    nodes[border] = begins
    xy, heading = curve.at(nodes)
    n = len(nodes)
    kappa, stop = np.zeros(n), np.zeros(n, dtype=np.bool_)
    size = np.repeat(np.abs(curve.curvature), counts)
    kappa[:-1] = size
    kappa[1:] = np.maximum(kappa[1:], size)
    stop[border[curve.stops]] = True
    return Course(nodes, xy, heading, kappa, stop, curve.resolution, curve)
