"""What the robot of a drive claims to have seen, and that it could always stand within it.

Period k begins at k times the period; there the robot looks around. While it lasts, the robot touches nothing but cells that
were seen by then, and at its end, as at its beginning, it could still stand before any other cell or wall by full braking. Both
are looked up every :data:`STEP` cells along the curves, with discs :data:`GIVE` cells smaller than the robot.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lampyris.model.drive import Drive
from lampyris.referee.geometry.lines_and_arcs import Pieces, pieces_of
from lampyris.referee.geometry.shapes import Ints
from lampyris.referee.simulations.sensing import sight_violation
from lampyris.referee.verdict import Violation
from lampyris.typing import Floats

STEP = 0.05
GIVE = 1e-6
_ROUNDED = 2e-3
"""Radians that the direction of view may be off: a tangent that is rounded."""


def drive_sensing_violation(drive: Drive) -> Violation | None:
    """Whether cells were seen that the sensor cannot have seen, or the robot relied on cells that it had not seen."""
    sensor, seen = drive.sensor, drive.seen
    if sensor is None and seen is None:
        return None
    if sensor is None or seen is None:
        return Violation("seen", "drive", "a sensor, or what it saw, is missing")
    many = max(math.ceil(drive.duration / drive.period - 1e-9), 1)
    if seen.shape != drive.scene.grid.blocked.shape or seen.min() < -1 or seen.max() >= many:
        return Violation("seen", "drive", f"not one period from -1 to {many - 1} for each cell")
    pieces = pieces_of(drive.curves, drive.scene.grid.resolution)
    begin = np.asarray(np.arange(many) * drive.period, dtype=np.float64)
    leg, s, _ = _state(drive, begin)
    xy, heading = _place(pieces, leg, s, drive.scene.grid.resolution)
    heading[np.maximum.accumulate((s > 0.0) | (leg > 0)) == 0] = 0.0
    near = math.ceil(drive.scene.robot.radius / drive.scene.grid.resolution - 1e-9) + 1
    return sight_violation(drive.scene.grid, sensor, seen, xy, heading, near, _ROUNDED) or _relied(
        drive, seen, pieces
    )


def _state(drive: Drive, t: Floats, before: bool = False) -> tuple[Ints, Floats, Floats]:
    """Curve, distance and speed at some times; ``before``: at the end of the stretch that ends there."""
    k = np.searchsorted(drive.t, t, side="left" if before else "right") - 1
    k = np.clip(k, 0, len(drive.t) - 1)
    d = np.minimum(t, drive.t[-1]) - drive.t[k]
    s = drive.s[k] + d * (drive.v[k] + 0.5 * drive.a[k] * d)
    return drive.leg[k], s, np.maximum(drive.v[k] + drive.a[k] * d, 0.0)


def _place(pieces: Pieces, leg: Ints, s: Floats, resolution: float) -> tuple[Floats, Floats]:
    """Where some distances along some curves are, in cells, and the unit vectors along the curve there."""
    piece = np.zeros(len(s), dtype=np.int64)
    for k in np.unique(leg).tolist():
        lo, hi = int(pieces.first[k]), int(pieces.first[k + 1])
        here = leg == k
        found = np.searchsorted(pieces.begin[lo:hi], s[here], side="right") - 1
        piece[here] = lo + np.clip(found, 0, max(hi - lo - 1, 0))
    place, along = pieces.place(piece, s)[:2]
    return np.asarray(place) / resolution, np.array(along)


def _relied(drive: Drive, seen: NDArray[np.int32], pieces: Pieces) -> Violation | None:
    """Whether the robot touches, or could not stand before, what had not been seen."""
    grid, robot = drive.scene.grid, drive.scene.robot
    step = STEP * grid.resolution
    # Where it drives: each stretch, which lies within one period.
    dt = np.diff(drive.t)
    length = dt * (drive.v[:-1] + 0.5 * drive.a[:-1] * dt)
    leg, s, k = _along(drive.leg[:-1], drive.s[:-1], length, step)
    period = np.floor(drive.t[:-1] / drive.period + 1e-6).astype(np.int64)
    found = _unknown(drive, seen, _place(pieces, leg, s, grid.resolution)[0], period[k], False)
    if found is not None:
        return found
    many = max(math.ceil(drive.duration / drive.period - 1e-9), 1)
    for before in (False, True):
        t = np.minimum((np.arange(many) + before) * drive.period, drive.duration)
        at, begin, v = _state(drive, t, before)
        leg, s, k = _along(
            at, begin, np.maximum(0.5 * v * v / robot.d_max - GIVE * grid.resolution, 0.0), step
        )
        found = _unknown(drive, seen, _place(pieces, leg, s, grid.resolution)[0], k, True)
        if found is not None:
            return found
    return None


def _along(leg: Ints, s: Floats, length: Floats, step: float) -> tuple[Ints, Floats, Ints]:
    """Distances along curves from s on, not more than a step apart; the last: which of the given each belongs to."""
    counts = np.ceil(length / step).astype(np.int64) + 1
    k = np.repeat(np.arange(len(s)), counts)
    number = np.arange(len(k)) - np.repeat(np.cumsum(counts) - counts, counts)
    return leg[k], s[k] + length[k] * number / np.maximum(counts[k] - 1, 1), k


def _unknown(
    drive: Drive, seen: NDArray[np.int32], xy: Floats, period: Ints, stands: bool
) -> Violation | None:
    """The first place at which the robot's disc overlaps a cell that had not been seen by its period, or a wall."""
    grid = drive.scene.grid
    radius = max(drive.scene.robot.radius / grid.resolution - GIVE, 0.0)
    wide = math.ceil(radius + 0.5)
    own = np.floor(xy + 0.5).astype(np.int64)
    for dy in range(-wide, wide + 1):
        for dx in range(-wide, wide + 1):
            x, y = own[:, 0] + dx, own[:, 1] + dy
            gx = np.maximum(np.abs(x - xy[:, 0]) - 0.5, 0.0)
            gy = np.maximum(np.abs(y - xy[:, 1]) - 0.5, 0.0)
            inside = (x >= 0) & (x < grid.width) & (y >= 0) & (y < grid.height)
            touched = inside & (gx * gx + gy * gy < radius * radius if radius else (dx == 0 and dy == 0))
            u, v = np.where(inside, x, 0), np.where(inside, y, 0)
            when = seen[v, u]
            bad = touched & ((when < 0) | (when > period) | (grid.blocked[v, u] if stands else False))
            if bad.any():
                j = int(bad.argmax())
                what = "could not stand before" if stands else "touches"
                at = f"({xy[j, 0]:.4g}, {xy[j, 1]:.4g})"
                sentence = f"the robot {what} cell ({x[j]}, {y[j]}) at {at}, which it has not seen to be free"
                return Violation("unseen", f"period {int(period[j])}", sentence)
    return None
