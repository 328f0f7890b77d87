"""The dissertation's law on a course: the cells it passes, and their velocities in m/s between them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris import elementary
from lampyris.kernels.speed import clock
from lampyris.model.movers import Movers
from lampyris.model.profile import Profile
from lampyris.model.scene import Scene
from lampyris.motion.course import Course
from lampyris.motion.dissertation import DissertationLaw, cell_speeds
from lampyris.motion.profile import start_speed, stop_to_stop
from lampyris.motion.rings import as_cells
from lampyris.typing import Cell, Floats, Points

_PART = 0.25
"""Cells between two places where a course is asked for its cell."""

_CENTRE = 0.1
"""Cells from the centre of a cell within which a course goes there, and not just past."""


def cells_passed(course: Course, first: int, last: int) -> tuple[NDArray[np.int64], Floats]:
    """The cells that a course passes from node ``first`` to node ``last``, as single steps, and where.

    A step into a neighbour by its side and on to the next by its side is one diagonal step, unless the course
    bends at the neighbour's centre: a slanting line then has straight and diagonal steps, as a planner's path
    has, and no right angles.

    Returns
    -------
    int64 (m, 2), each a neighbour of the one before; float64 (m,), metres: where the course is nearest to the
    centre of each, the two ends for the first and the last.
    """
    s = course.s[first : last + 1]
    ds = s[1:] - s[:-1]
    parts = max(1, math.ceil(float(ds.max()) / (course.resolution * _PART) - 1e-6)) if len(ds) else 1
    fine = np.append((s[:-1, None] + ds[:, None] * (np.arange(parts) / parts)).ravel(), s[-1])
    if course.curve is not None:
        xy = course.curve.at(fine)[0]
    else:
        xy = np.stack([elementary.interp(fine, course.s, course.xy[:, k]) for k in (0, 1)], axis=-1)
    found = np.floor(xy + 0.5).astype(np.int64)
    new = np.append(0, np.flatnonzero((found[1:] != found[:-1]).any(axis=1)) + 1)
    off, nearest = _centres(xy, found, fine, new)
    kept: list[tuple[int, int, float, float]] = []
    for (x, y), at, aside in zip(found[new].tolist(), nearest, off, strict=True):
        kept.append((x, y, at, aside))
        if len(kept) >= 3:
            away = max(abs(x - kept[-3][0]), abs(y - kept[-3][1]))
            if away == 0:
                del kept[-2:]
            elif away == 1 and kept[-2][3] > _CENTRE:
                del kept[-2]
    cells = np.array([one[:2] for one in kept], dtype=np.int64)
    where = np.array([one[2] for one in kept])
    where[0], where[-1] = s[0], s[-1]
    return cells, where


def _centres(
    xy: Points, cells: NDArray[np.int64], s: Floats, new: NDArray[np.intp]
) -> tuple[list[float], list[float]]:
    """How near the course comes to the centre of each cell it passes, cells, and where, metres.

    Parameters
    ----------
    xy, cells, s : points of the course, the cell of each, and its distance.
    new : the first point in each cell.

    The places are apart from each other: at least a quarter of the way between two points on their own side
    of the border.
    """
    if len(xy) == 1:
        return [0.0], s.tolist()
    d, ds = xy[1:] - xy[:-1], s[1:] - s[:-1]
    square = np.maximum((d * d).sum(axis=1), 1e-300)
    best, at = np.full(len(xy), np.inf), s.copy()
    for part in (slice(None, -1), slice(1, None)):
        to = cells[part] - xy[:-1]
        share = np.clip((to * d).sum(axis=1) / square, 0.0, 1.0)
        gap = to - share[:, None] * d
        away = np.sqrt((gap * gap).sum(axis=1))
        nearer = away < best[part]
        best[part] = np.where(nearer, away, best[part])
        at[part] = np.where(nearer, s[:-1] + share * ds, at[part])
    border = np.concatenate(([s[0]], 0.5 * (s[new[1:]] + s[new[1:] - 1]), [s[-1]]))
    inward = np.concatenate(([0.0], 0.25 * ds[new[1:] - 1], [0.0]))
    ends = np.append(new[1:], len(xy))
    off, where = [], []
    for k, (a, b) in enumerate(zip(new.tolist(), ends.tolist(), strict=True)):
        nearest = a + int(best[a:b].argmin())
        off.append(float(best[nearest]))
        low, high = border[k] + inward[k], border[k + 1] - inward[k + 1]
        where.append(float(min(max(at[nearest], low), high)))
    return off, where


def course_profile(
    course: Course,
    scene: Scene,
    law: DissertationLaw,
    *,
    obstacles: Iterable[Cell] | NDArray[Any] = (),
    movers: Movers | None = None,
    v0: float = 0.0,
) -> Profile:
    """A profile in metres and seconds: the law's velocities, its greatest one taken as the robot's v_max.

    The law gives a velocity to each cell. From the centre of one to that of the next the square of the
    speed changes evenly, at a constant acceleration, whatever that is: the law does not know the robot's
    limits. Where the robot must stop and turn, one way of cells ends and another begins. A stretch of at most
    two cells has no velocity but the 0 of its ends: half way it is what one straight transfer gives.

    Raises
    ------
    SettingError : ``START_SPEED``.
    """
    n = len(course)
    scale = scene.robot.v_max / law.v_max
    bodies = np.concatenate((as_cells(obstacles), covered(movers, course.resolution)))
    v0 = start_speed(v0)
    if n == 1:
        zero = np.zeros(1)
        return Profile("dissertation", zero, zero, zero, zero, ("goal",), "m/s", xy=course.xy)
    x, cause, about = np.zeros(n), ["goal"] * n, np.full(n, -1, dtype=np.int64)
    x[0] = v0 * v0
    borders = [0, *(np.flatnonzero(course.stop[1:-1]) + 1).tolist(), n - 1]
    for a, b in pairwise(borders):
        cells, where = cells_passed(course, int(a), int(b))
        speed, words, of = cell_speeds(cells, scene, law, bodies, v0 / scale if a == 0 else 0.0)
        if len(cells) <= 2 and not speed.any():
            where = np.array([course.s[a], 0.5 * (course.s[a] + course.s[b]), course.s[b]])
            speed = np.array([0.0, min(law.v_max, law.a_straight), 0.0])
            words, of = ("start", "acceleration", "goal"), np.full(3, -1)
        here = slice(int(a), int(b) + 1)
        s = course.s[here]
        x[here] = elementary.interp(s, where, np.square(speed * scale))
        at = np.searchsorted(where, s)
        node = np.searchsorted(s, where, side="right") - 1 + int(a)
        for k, cell in zip(range(int(a), int(b) + 1), np.minimum(at, len(where) - 1).tolist(), strict=True):
            cause[k] = words[cell]
            about[k] = node[of[cell]] if of[cell] >= 0 else -1
            if words[cell] == "goal" and k < b:
                cause[k], about[k] = "braking", b
        if a == 0:
            x[0] = min(x[0], v0 * v0)
        else:
            cause[a], about[a] = "turn", -1
    cause[0] = "start"
    return _timed(course, scene, x, tuple(cause), about, law.a_straight * scale)


def _timed(
    course: Course, scene: Scene, x: Floats, cause: tuple[str, ...], about: NDArray[np.int64], rise: float
) -> Profile:
    """A profile from squared speeds."""
    n, robot = len(course), scene.robot
    v = np.sqrt(x)
    ds = course.s[1:] - course.s[:-1]
    pace = v[:-1] + v[1:]
    rest = pace == 0.0
    dt = 2.0 * ds / np.where(rest, 1.0, pace)
    for k in np.flatnonzero(rest).tolist():
        dt[k] = stop_to_stop(float(ds[k]), robot.a_max, robot.d_max, rise)[1]
    a, t = np.zeros(n), np.zeros(n)
    np.divide(x[1:] - x[:-1], 2.0 * ds, out=a[:-1])
    clock(dt, t)
    return Profile("dissertation", course.s, v, a, t, cause, "m/s", about, (), course.xy)


def covered(movers: Movers | None, resolution: float) -> NDArray[np.int64]:
    """The cells whose squares the discs of moving obstacles touch now; int64 (m, 2)."""
    out: list[tuple[int, int]] = []
    for k in range(0 if movers is None else len(movers)):
        assert movers is not None
        (x, y), reach = movers.xy[k].tolist(), float(movers.radius[k]) / resolution
        span = range(math.floor(x - reach + 0.5), math.floor(x + reach + 0.5) + 1)
        for cy in range(math.floor(y - reach + 0.5), math.floor(y + reach + 0.5) + 1):
            for cx in span:
                gx, gy = max(abs(cx - x) - 0.5, 0.0), max(abs(cy - y) - 0.5, 0.0)
                if gx * gx + gy * gy <= reach * reach:
                    out.append((cx, cy))
    return np.array(out, dtype=np.int64).reshape(-1, 2)
