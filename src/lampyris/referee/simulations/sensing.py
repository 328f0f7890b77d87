"""What a robot with a sensor claims to have seen, by the sensor's rule alone, and whether it drove over seen cells only.

The rule is written down here a second time, by cells that a segment crosses instead of a walk along it. With d = (dx, dy)
from the robot's cell to the other, the open square of cell (i, j) is crossed by the segment between the centres exactly if
2 |i dy - j dx| < |dx| + |dy|, for (i, j) between the two; a corner of cells lies on it exactly if the two sides are equal.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lampyris.model.grid import Grid
from lampyris.model.settings.sensor import Sensor
from lampyris.model.trace import Trace
from lampyris.referee.geometry.shapes import Ints, disc_cells
from lampyris.referee.verdict import Violation
from lampyris.typing import BoolGrid

Bools = NDArray[np.bool_]
_ANGLE = 1e-6
"""Radians that rounding may add to the field of view."""


def sensing_violation(trace: Trace) -> Violation | None:
    """Whether cells were seen that the sensor cannot have seen, or cells entered that had not been seen."""
    sensor, seen = trace.sensor, trace.seen
    if sensor is None and seen is None:
        return None
    if sensor is None or seen is None:
        return Violation("seen", "trace", "a sensor, or what it saw, is missing")
    if trace.edits or trace.scene.edits:
        return Violation("seen", "trace", "a sensor, and walls that come and go")
    if seen.shape != trace.scene.grid.blocked.shape or seen.min() < -1 or seen.max() > trace.ticks:
        return Violation("seen", "trace", f"not one tick from -1 to {trace.ticks} for each cell")
    return _bumpers(trace, seen) or _sights(trace, sensor, seen)


def _near(trace: Trace) -> int:
    """Columns and rows within which the robot's next step can touch a cell."""
    covered = disc_cells(trace.scene.robot.radius, trace.scene.grid.resolution)
    return int(np.abs(covered).max(initial=0)) + trace.scene.moves.reach


def _bumpers(trace: Trace, seen: Ints | NDArray[np.int32]) -> Violation | None:
    """Every cell that a step could touch is seen before the step is made."""
    near, (height, width) = _near(trace), seen.shape
    x, y = trace.robot.astype(np.int64).T
    now = np.arange(len(x))
    for dy in range(-near, near + 1):
        for dx in range(-near, near + 1):
            u, v = x + dx, y + dy
            inside = (u >= 0) & (u < width) & (v >= 0) & (v < height)
            at = np.where(inside, seen[np.where(inside, v, 0), np.where(inside, u, 0)], 0)
            late = inside & ((at < 0) | (at > now))
            if late.any():
                t = int(late.argmax())
                what = f"({u[t]}, {v[t]}), beside the robot at ({x[t]}, {y[t]}), has not been seen"
                return Violation("unseen", f"tick {t}", what)
    return None


def _sights(trace: Trace, sensor: Sensor, seen: Ints | NDArray[np.int32]) -> Violation | None:
    """Every cell that was seen was in sight at that tick."""
    rows, columns = np.nonzero(seen >= 0)
    ticks = seen[rows, columns].astype(np.int64)
    at = trace.robot[ticks].astype(np.int64)
    d = np.stack((columns, rows), axis=1) - at
    claimed = np.abs(d).max(axis=1, initial=0) > _near(trace)
    squared = (d * d).sum(axis=1) * trace.scene.grid.resolution * trace.scene.grid.resolution
    far = claimed & (squared > sensor.range_m * sensor.range_m * (1.0 + 1e-8))
    aside = claimed & _aside(trace, sensor, ticks, d)
    hidden = claimed & ~far & ~aside & ~_in_sight(trace.scene.grid, at, d, claimed)
    for wrong, what in (
        (far, "beyond the range"),
        (aside, "outside the field of view"),
        (hidden, "out of sight"),
    ):
        if wrong.any():
            k = int(wrong.argmax())
            where = f"({columns[k]}, {rows[k]}) is {what} of the robot at ({at[k, 0]}, {at[k, 1]})"
            return Violation("sight", f"tick {ticks[k]}", where)
    return None


def _aside(trace: Trace, sensor: Sensor, ticks: Ints, d: Ints) -> Bools:
    """Which cells lie outside the field of view of a robot that looks where it last moved to."""
    if sensor.field_of_view >= 2 * math.pi:
        return np.zeros(len(d), dtype=np.bool_)
    steps = np.diff(trace.robot.astype(np.int64), axis=0, prepend=trace.robot[:1])
    last = np.maximum.accumulate(np.where(steps.any(axis=1), np.arange(len(steps)), 0))
    heading = steps[last[ticks]]
    along = (d * heading).sum(axis=1)
    across = d[:, 0] * heading[:, 1] - d[:, 1] * heading[:, 0]
    angle = np.arctan2(np.abs(across), along)
    outside: Bools = heading.any(axis=1) & (angle > 0.5 * sensor.field_of_view + _ANGLE)
    return outside


def _in_sight(grid: Grid, at: Ints, d: Ints, asked: Bools) -> Bools:
    """Which cells are in sight of the cells at which the robot stood; offset by offset."""
    found = ~asked
    numbers = np.flatnonzero(asked)
    _, kind = np.unique(d[numbers], axis=0, return_inverse=True)
    order = np.argsort(kind.ravel(), kind="stable")
    cuts = np.flatnonzero(np.diff(kind.ravel()[order])) + 1
    for part in np.split(numbers[order], cuts) if len(numbers) else ():
        dx, dy = (int(v) for v in d[part[0]])
        x, y = at[part].T
        wall = grid.blocked[y + dy, x + dx]
        visible = ~wall & _clear(grid.blocked, x, y, dx, dy)
        # The sides of a wall that face the robot: the cell across must be free, and in sight.
        for u, v in ((dx - (dx > 0) + (dx < 0), dy), (dx, dy - (dy > 0) + (dy < 0))):
            if (u, v) != (dx, dy):
                visible |= wall & ~grid.blocked[y + v, x + u] & _clear(grid.blocked, x, y, u, v)
        found[part] = visible
    return found


def _clear(blocked: BoolGrid, x: Ints, y: Ints, dx: int, dy: int) -> Bools:
    """Whether no wall lies on the segments from (x, y) to (x + dx, y + dy), ends left out."""
    crossed, corners = _passed(dx, dy)
    clear = ~blocked[y[:, None] + crossed[:, 1], x[:, None] + crossed[:, 0]].any(axis=1)
    one, other = (blocked[y[:, None] + c[:, 1], x[:, None] + c[:, 0]] for c in corners)
    free: Bools = clear & ~(one & other).any(axis=1)
    return free


@lru_cache(maxsize=4096)
def _passed(dx: int, dy: int) -> tuple[Ints, tuple[Ints, Ints]]:
    """Offsets of the cells that a segment crosses, and of the two cells on either side of each corner that it meets."""
    a, b, sx, sy = abs(dx), abs(dy), 1 if dx > 0 else -1, 1 if dy > 0 else -1
    j, i = np.mgrid[0 : b + 1, 0 : a + 1]
    inner = 2 * np.abs(i * b - j * a) < a + b
    inner[0, 0] = inner[b, a] = False
    meets = (2 * i + 1) * b == (2 * j + 1) * a
    meets &= (i < a) & (j < b)
    signs = np.array([sx, sy])
    corner = np.stack((i[meets], j[meets]), axis=1)
    crossed = np.stack((i[inner], j[inner]), axis=1) * signs
    right, below = np.array([1, 0]), np.array([0, 1])
    return crossed, ((corner + right) * signs, (corner + below) * signs)
