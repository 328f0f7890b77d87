"""The dissertation's law on a sampled path: the cells it passes, and their velocities in m/s between them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris._core import elementary
from lampyris.kernels.motion.speed_passes import clock
from lampyris.model.obstacles import ObstacleStates
from lampyris.model.profile import Profile
from lampyris.model.scene import Scene
from lampyris.motion.geometry.sampled_path import SampledPath
from lampyris.motion.laws.dissertation import DissertationLaw, cell_speeds
from lampyris.motion.laws.rings import as_cells
from lampyris.motion.profile import start_speed, stop_to_stop
from lampyris.typing import Cell, Floats, Points

_PART = 0.25
"""Cells between two places where a sampled path is asked for its cell."""

_AROUND = 4
"""Cells that are looked at on each side of a sampled path: two for its rings, two for the cells of its nodes."""

_PAIRS = 500_000
"""Discs and rows that are looked at together."""

_CENTRE = 0.1
"""Cells from the centre of a cell within which a sampled path goes there, and not just past."""


def cells_passed(samples: SampledPath, first: int, last: int) -> tuple[NDArray[np.int64], Floats]:
    """The cells that a sampled path passes from node ``first`` to node ``last``, as single steps, and where.

    A step into a neighbour by its side and on to the next by its side is one diagonal step, unless the sampled path
    bends at the neighbour's centre: a slanting line then has straight and diagonal steps, as a planner's path
    has, and no right angles.

    Returns
    -------
    int64 (m, 2), each a neighbour of the one before; float64 (m,), metres: where the sampled path is nearest to the
    centre of each, the two ends for the first and the last.
    """
    s = samples.s[first : last + 1]
    ds = s[1:] - s[:-1]
    parts = max(1, math.ceil(float(ds.max()) / (samples.resolution * _PART) - 1e-6)) if len(ds) else 1
    fine = np.append((s[:-1, None] + ds[:, None] * (np.arange(parts) / parts)).ravel(), s[-1])
    if samples.curve is not None:
        xy = samples.curve.at(fine)[0]
    else:
        xy = np.stack([elementary.interp(fine, samples.s, samples.xy[:, k]) for k in (0, 1)], axis=-1)
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
    """How near the sampled path comes to the centre of each cell it passes, cells, and where, metres.

    Parameters
    ----------
    xy, cells, s : points of the sampled path, the cell of each, and its distance.
    new : the first point in each cell.

    The places are apart from each other: at least a quarter of the path between two points on their own side
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


def profile_on_samples(
    samples: SampledPath,
    scene: Scene,
    law: DissertationLaw,
    *,
    obstacles: Iterable[Cell] | NDArray[Any] = (),
    obstacle_states: ObstacleStates | None = None,
    v0: float = 0.0,
) -> Profile:
    """A profile in metres and seconds: the law's velocities, its greatest one taken as the robot's v_max.

    The law gives a velocity to each cell. From the centre of one to that of the next the square of the
    speed changes evenly, at a constant acceleration, whatever that is: the law does not know the robot's
    limits. Where the robot must stop and turn, one path of cells ends and another begins. A stretch of at most
    two cells has no velocity but the 0 of its ends: half way it is what one straight transfer gives.

    Raises
    ------
    SettingError : ``START_SPEED``.
    """
    n = len(samples)
    scale = scene.robot.v_max / law.v_max
    covered_cells = np.concatenate(
        (as_cells(obstacles), covered(obstacle_states, samples, scene.grid.blocked.shape))
    )
    v0 = start_speed(v0)
    if n == 1:
        zero = np.zeros(1)
        return Profile("dissertation", zero, zero, zero, zero, ("goal",), "m/s", xy=samples.xy)
    x, cause, cause_index = np.zeros(n), ["goal"] * n, np.full(n, -1, dtype=np.int64)
    x[0] = v0 * v0
    borders = [0, *(np.flatnonzero(samples.stop[1:-1]) + 1).tolist(), n - 1]
    for a, b in pairwise(borders):
        cells, where = cells_passed(samples, int(a), int(b))
        speed, words, of = cell_speeds(cells, scene, law, covered_cells, v0 / scale if a == 0 else 0.0)
        if len(cells) <= 2 and not speed.any():
            where = np.array([samples.s[a], 0.5 * (samples.s[a] + samples.s[b]), samples.s[b]])
            speed = np.array([0.0, min(law.v_max, law.a_straight), 0.0])
            words, of = ("start", "acceleration", "goal"), np.full(3, -1)
        here = slice(int(a), int(b) + 1)
        s = samples.s[here]
        x[here] = elementary.interp(s, where, np.square(speed * scale))
        at = np.searchsorted(where, s)
        node = np.searchsorted(s, where, side="right") - 1 + int(a)
        for k, cell in zip(range(int(a), int(b) + 1), np.minimum(at, len(where) - 1).tolist(), strict=True):
            cause[k] = words[cell]
            cause_index[k] = node[of[cell]] if of[cell] >= 0 else -1
            if words[cell] == "goal" and k < b:
                cause[k], cause_index[k] = "braking", b
        if a == 0:
            x[0] = min(x[0], v0 * v0)
        else:
            cause[a], cause_index[a] = "turn", -1
    cause[0] = "start"
    return _timed(samples, scene, x, tuple(cause), cause_index, law.a_straight * scale)


def _timed(
    samples: SampledPath,
    scene: Scene,
    x: Floats,
    cause: tuple[str, ...],
    cause_index: NDArray[np.int64],
    rise: float,
) -> Profile:
    """A profile from squared speeds."""
    n, robot = len(samples), scene.robot
    v = np.sqrt(x)
    ds = samples.s[1:] - samples.s[:-1]
    pace = v[:-1] + v[1:]
    rest = pace == 0.0
    dt = 2.0 * ds / np.where(rest, 1.0, pace)
    for k in np.flatnonzero(rest).tolist():
        dt[k] = stop_to_stop(float(ds[k]), robot.a_max, robot.d_max, rise)[1]
    a, t = np.zeros(n), np.zeros(n)
    np.divide(x[1:] - x[:-1], 2.0 * ds, out=a[:-1])
    clock(dt, t)
    return Profile("dissertation", samples.s, v, a, t, cause, "m/s", cause_index, (), samples.xy)


def covered(
    obstacle_states: ObstacleStates | None, samples: SampledPath, shape: tuple[int, int]
) -> NDArray[np.int64]:
    """The cells whose squares the discs of moving obstacles touch now; int64 (m, 2), each once.

    Only those of the map that the rings around the sampled path may hold: a disc may be of any size. Of each row a
    disc touches one run of cells, so the work is that of discs and rows, not of cells.

    Parameters
    ----------
    shape : height and width of the map.
    """
    nothing = np.zeros((0, 2), dtype=np.int64)
    if obstacle_states is None or len(obstacle_states) == 0:
        return nothing
    # An arc of less than half a turn leaves the line of its ends by less than half its length.
    around = _AROUND + 0.5 * float(np.diff(samples.s).max(initial=0.0)) / samples.resolution
    near = (samples.xy.min(axis=0) - around, samples.xy.max(axis=0) + around)
    x0, y0 = np.maximum(np.floor(near[0]), 0).astype(np.int64).tolist()
    x1, y1 = np.minimum(np.ceil(near[1]) + 1, shape[::-1]).astype(np.int64).tolist()
    if x0 >= x1 or y0 >= y1:
        return nothing
    # How many runs begin in each column, less how many ended before it.
    runs = np.zeros((y1 - y0, x1 - x0 + 1), dtype=np.int32)
    rows = np.arange(y0, y1)
    some = max(1, _PAIRS // len(rows))
    for k in range(0, len(obstacle_states), some):
        x, y = obstacle_states.xy[k : k + some, 0, None], obstacle_states.xy[k : k + some, 1, None]
        reach = obstacle_states.radius[k : k + some, None] / samples.resolution
        row, first, last = _runs(x, y, reach, rows, x0, x1 - 1)
        np.add.at(runs, (row, first - x0), 1)
        np.add.at(runs, (row, last + 1 - x0), -1)
    found = np.argwhere(np.cumsum(runs[:, :-1], axis=1) > 0)
    out: NDArray[np.int64] = found[:, ::-1] + np.array((x0, y0))
    return out


def _runs(
    x: Floats, y: Floats, reach: Floats, rows: NDArray[np.int64], least: int, most: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Row (by its place in ``rows``), first and last column of each run of cells that a disc touches.

    Parameters
    ----------
    x, y, reach : float64 (m, 1), cells.
    least, most : columns that are looked at.
    """
    gy = np.maximum(np.abs(rows - y) - 0.5, 0.0)
    half = np.sqrt(np.maximum(reach * reach - gy * gy, 0.0)) + 0.5

    def touched(column: Floats) -> NDArray[np.bool_]:
        gx = np.maximum(np.abs(column - x) - 0.5, 0.0)
        return np.asarray(gx * gx + gy * gy <= reach * reach)

    first, last = np.ceil(x - half), np.floor(x + half)
    # The root is rounded: the cells at either end are asked themselves.
    first = np.where(touched(first - 1.0), first - 1.0, np.where(touched(first), first, first + 1.0))
    last = np.where(touched(last + 1.0), last + 1.0, np.where(touched(last), last, last - 1.0))
    first, last = np.maximum(first, least), np.minimum(last, most)
    disc, row = np.nonzero((gy <= reach) & (first <= last))
    return row, first[disc, row].astype(np.int64), last[disc, row].astype(np.int64)
