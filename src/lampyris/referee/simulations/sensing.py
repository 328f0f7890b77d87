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
from lampyris.typing import BoolGrid, Floats

Bools = NDArray[np.bool_]
_ANGLE = 1e-6
"""Radians that rounding may add to the field of view."""
_BORDER = 1e-6
"""Cells by which a place may be rounded."""


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
    """Every cell that was seen was in sight at that tick of a robot that looks where it last moved to."""
    steps = np.diff(trace.robot.astype(np.int64), axis=0, prepend=trace.robot[:1])
    last = np.maximum.accumulate(np.where(steps.any(axis=1), np.arange(len(steps)), 0))
    return sight_violation(
        trace.scene.grid,
        sensor,
        seen,
        trace.robot.astype(np.float64),
        steps[last].astype(np.float64),
        _near(trace),
    )


def sight_violation(
    grid: Grid, sensor: Sensor, seen: Ints | NDArray[np.int32], xy: Floats, heading: Floats, near: int, give: float = _ANGLE
) -> Violation | None:  # fmt: skip
    """Whether a cell was seen that could not be seen at its tick.

    Parameters
    ----------
    seen : the tick of each cell, -1 never.
    xy, heading : where the robot is at each tick, cells, and where it looks, (0, 0): all around; (ticks, 2). A robot that
        stands on the border of two cells, but for rounding, looks from either.
    near : columns and rows within which it sees everything.
    give : radians that rounding may add to the field of view.
    """
    rows, columns = np.nonzero(seen >= 0)
    ticks = seen[rows, columns].astype(np.int64)
    cells = np.stack((columns, rows), axis=1)
    first: Violation | None = None
    left = np.arange(len(cells))
    for nudge in (
        (0.0, 0.0),
        (_BORDER, _BORDER),
        (-_BORDER, -_BORDER),
        (_BORDER, -_BORDER),
        (-_BORDER, _BORDER),
    ):
        at = np.floor(xy[ticks[left]] + 0.5 + nudge).astype(np.int64)
        wrong, words = _wrong(grid, sensor, cells[left], at, heading[ticks[left]], near, give)
        if not wrong.any():
            return None
        if first is None:
            k = int(wrong.argmax())
            (x, y), (u, v) = cells[left][k], at[k]
            first = Violation(
                "sight", f"tick {ticks[left][k]}", f"({x}, {y}) is {words[k]} of the robot at ({u}, {v})"
            )
            if (np.abs(xy - np.floor(xy)) == 0.0).all():
                return first  # in the middle of cells there is nothing to be rounded
        left = left[wrong]
    return first


def _wrong(
    grid: Grid, sensor: Sensor, cells: Ints, at: Ints, heading: Floats, near: int, give: float
) -> tuple[Bools, list[str]]:
    """Which cells could not be seen from where the robot was, and why not."""
    d = cells - at
    claimed = np.abs(d).max(axis=1, initial=0) > near
    squared = (d * d).sum(axis=1) * grid.resolution * grid.resolution
    far = claimed & (squared > sensor.range_m * sensor.range_m * (1.0 + 1e-8))
    aside = claimed & _aside(sensor, heading, d, give)
    hidden = claimed & ~far & ~aside & ~_in_sight(grid, at, d, claimed)
    words = np.where(far, "beyond the range", np.where(aside, "outside the field of view", "out of sight"))
    return far | aside | hidden, words.tolist()


def _aside(sensor: Sensor, heading: Floats, d: Ints, give: float) -> Bools:
    """Which cells lie outside the field of view."""
    if sensor.field_of_view >= 2 * math.pi:
        return np.zeros(len(d), dtype=np.bool_)
    along = (d * heading).sum(axis=1)
    across = d[:, 0] * heading[:, 1] - d[:, 1] * heading[:, 0]
    angle = np.arctan2(np.abs(across), along)
    outside: Bools = heading.any(axis=1) & (angle > 0.5 * sensor.field_of_view + give)
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
