"""Plain numbers of a path, for tables and pages."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple, TypedDict

import numpy as np
from numpy.typing import NDArray

from lampyris._core.arrays import index_array
from lampyris.model.grid import Grid
from lampyris.model.path import Path
from lampyris.model.profile import Profile
from lampyris.typing import Cells, Floats

if TYPE_CHECKING:
    from lampyris.model.drive import Drive


class PathMetrics(TypedDict):
    """What :func:`path_metrics` returns.

    ``cells``: cells, both ends counted. ``straights``, ``diagonals``, ``knights``: steps of each kind.
    ``length_cells``, ``length_m``: geometric length, a diagonal sqrt 2. ``turns``: nodes at which the
    heading changes. ``turn_deg``: all turning added up, ``sharpest_deg``: the sharpest turn, both in
    degrees. ``smoothness``: 1 / (1 + turning in radians for each cell of length): 1 is a straight line.
    """

    cells: int
    straights: int
    diagonals: int
    knights: int
    length_cells: float
    length_m: float
    turns: int
    turn_deg: float
    sharpest_deg: float
    smoothness: float


def path_metrics(path: Path, grid: Grid) -> PathMetrics:
    """Lengths, steps and turns of a path on its map."""
    step = _steps(path.cells)
    kinds = np.bincount(index_array(np.abs(step[:, 0] * step[:, 1])), minlength=3)
    length = float(path.arc[-1])
    shape = _shape(step, length)
    return {
        "cells": len(path.cells),
        "straights": int(kinds[0]),
        "diagonals": int(kinds[1]),
        "knights": int(kinds[2]),
        "length_cells": length,
        "length_m": length * grid.resolution,
        "turns": shape["turns"],
        "turn_deg": shape["turn_deg"],
        "sharpest_deg": shape["sharpest_deg"],
        "smoothness": shape["smoothness"],
    }


class LineMetrics(TypedDict):
    """What :func:`line_metrics` returns: see :class:`PathMetrics`."""

    length_cells: float
    length_m: float
    turns: int
    turn_deg: float
    sharpest_deg: float
    smoothness: float


def line_metrics(points: Cells | Floats, grid: Grid) -> LineMetrics:
    """Length and turns of straight lines from one waypoint to the next, those of an any-angle plan.

    Parameters
    ----------
    points : int32 or float64 (k, 2), k >= 1, cells.
    """
    step = np.diff(points, axis=0) if points.dtype.kind == "f" else _steps(points)
    length = math.fsum(math.sqrt(dx * dx + dy * dy) for dx, dy in step.tolist())
    return {"length_cells": length, "length_m": length * grid.resolution, **_shape(step, length)}


def _steps(cells: Cells | Floats) -> NDArray[np.int64]:
    at = cells.astype(np.int64)
    return at[1:] - at[:-1]


class _Shape(TypedDict):
    turns: int
    turn_deg: float
    sharpest_deg: float
    smoothness: float


def _shape(step: NDArray[np.int64] | Floats, length: float) -> _Shape:
    """Turning from each step to the next, (n, 2)."""
    came, goes = step[:-1], step[1:]
    cross = came[:, 0] * goes[:, 1] - came[:, 1] * goes[:, 0]
    dot = (came * goes).sum(axis=1)
    turn = [math.atan2(abs(c), d) for c, d in zip(cross.tolist(), dot.tolist(), strict=True)]
    total = math.fsum(turn)
    return {
        "turns": sum(t > 0 for t in turn),
        "turn_deg": math.degrees(total),
        "sharpest_deg": math.degrees(max(turn, default=0.0)),
        "smoothness": 1.0 / (1.0 + total / length) if length else 1.0,
    }


class CauseShare(NamedTuple):
    """How much of a drive one cause holds: its share of the path and of the time, each 0 to 1."""

    cause: str
    distance: float
    time: float


def cause_shares(profile: Profile) -> tuple[CauseShare, ...]:
    """What limited a robot, the longest first.

    Each node stands for half of the edge before it and half of the one behind it. A profile of one node has
    no path and takes no time: its cause holds all of both.
    """
    return shares(profile.cause, _halves(profile.s), _halves(profile.t))


def drive_shares(drive: Drive) -> tuple[CauseShare, ...]:
    """What limited the robot, the longest first: shares of path and time, stretch by stretch."""
    time = np.diff(drive.t, append=drive.t[-1:])
    distance = time * (drive.v + 0.5 * drive.a * time)
    return shares(drive.cause, distance, time)


def shares(cause: Sequence[str], distance: Floats, time: Floats) -> tuple[CauseShare, ...]:
    """The same for parts of a drive with a cause, a path and a time each."""
    sums: dict[str, list[float]] = {}
    for word, s, t in zip(cause, distance.tolist(), time.tolist(), strict=True):
        both = sums.setdefault(word, [0.0, 0.0])
        both[0] += s
        both[1] += t
    whole, last = (float(x.sum()) for x in (distance, time))
    made = [
        CauseShare(word, s / whole if whole else 1 / len(sums), t / last if last else 1 / len(sums))
        for word, (s, t) in sums.items()
    ]
    return tuple(sorted(made, key=lambda c: (-c.time, -c.distance, c.cause)))


def worth_telling(some: Sequence[CauseShare]) -> tuple[CauseShare, ...]:
    """Without the two ends, where they take no time worth a word; all, if nothing else is left."""
    listed = tuple(c for c in some if c.cause not in ("start", "goal") or c.time >= 0.005)
    return listed or tuple(some)


def _halves(x: Floats) -> Floats:
    """What of a line each of its nodes stands for."""
    mid = np.concatenate((x[:1], (x[:-1] + x[1:]) / 2, x[-1:]))
    return np.diff(mid)
