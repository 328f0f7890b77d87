"""Tracks: where recorded obstacles will be, and a path among them as arrays."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lampyris._core.scalars import in_range
from lampyris.errors import SettingError, shown
from lampyris.kernels.motion.collision_time import first_contact_time
from lampyris.model.obstacles import Track
from lampyris.model.traffic import ObstacleSpec, Recorded
from lampyris.typing import Floats

TOUCH = 1e-9
"""Metres: what comes no nearer than the sum of the radii less this, touches; to touch is no contact."""


def tracks_from_recorded(
    traffic: Iterable[ObstacleSpec], tick_seconds: float, resolution: float
) -> tuple[Track, ...]:
    """The recorded obstacles among ``traffic`` in continuous time, in order.

    In each tick an obstacle of the tick model moves straight and evenly from cell to cell. One of radius 0 is a
    disc of half a cell: it fills its cell from side to side.

    Raises
    ------
    SettingError : ``TICK``.
    """
    _positive("TICK", "tick_seconds", tick_seconds)
    made = []
    for one in traffic:
        if not isinstance(one, Recorded):
            continue
        cells = np.array(one.track, dtype=np.float64)
        d = np.diff(cells, axis=0)
        longest = float((d * d).sum(axis=1).max(initial=0.0))
        top = math.sqrt(longest) * resolution / tick_seconds
        # A track that waits has the same cell many times: only the corners are kept.
        turns = np.ones(len(cells), dtype=np.bool_)
        turns[1:-1] = (d[1:] != d[:-1]).any(axis=1)
        t = np.flatnonzero(turns).astype(np.float64) * tick_seconds
        made.append(Track(t, cells[turns], one.radius or 0.5 * resolution, top))
    return tuple(made)


class Discs(NamedTuple):
    """Tracks as the kernels want them: times from the robot's start, metres.

    Parameters
    ----------
    begin : int64 (m + 1,): the corners of disc i are ``begin[i]`` up to ``begin[i + 1]``.
    t, x, y : float64: corners.
    reach : float64 (m,): how near the centres may not come; 0 or less: never too near.
    top : float64 (m,): maximum speed, as driven.
    """

    begin: NDArray[np.int64]
    t: Floats
    x: Floats
    y: Floats
    reach: Floats
    top: Floats

    def __len__(self) -> int:
        return len(self.reach)


def discs_of(tracks: Sequence[Track], radius: float, t0: float, resolution: float) -> Discs:
    """Tracks as flat arrays; ``radius`` is what the robot and all margins take."""
    count = np.array([len(one.t) for one in tracks], dtype=np.int64)
    begin = np.concatenate((np.zeros(1, dtype=np.int64), np.cumsum(count)))
    if not tracks:
        none = np.zeros(0)
        return Discs(begin, none, none, none, none, none)
    t = np.concatenate([one.t for one in tracks]) - t0
    points = np.concatenate([one.xy for one in tracks]) * resolution
    reach = np.array([one.radius for one in tracks]) + (radius - TOUCH)
    top = []
    for a, b in zip(begin[:-1].tolist(), begin[1:].tolist(), strict=True):
        d = np.diff(points[a:b], axis=0)
        # An ulp more than computed: the kernel relies on it.
        speeds = np.sqrt((d * d).sum(axis=1)) / np.diff(t[a:b])
        top.append(float(speeds.max(initial=0.0)) * (1.0 + 1e-12))
    return Discs(begin, t, points[:, 0].copy(), points[:, 1].copy(), reach, np.array(top))


class CappedPath(NamedTuple):
    """A sampled path for driving among discs.

    Parameters
    ----------
    s, x, y : float64 (n,), n >= 2, metres.
    cap : float64 (n,), m/s.
    stop : bool (n,): where the robot must stand; the first and the last are not marked.
    """

    s: Floats
    x: Floats
    y: Floats
    cap: Floats
    stop: NDArray[np.bool_]


class TimedNodes(NamedTuple):
    """Nodes of a motion along a path: constant acceleration ``a[i]`` from node i to the next; float64 (k,)."""

    t: Floats
    s: Floats
    v: Floats
    a: Floats


def first_contact(path: CappedPath, motion: TimedNodes, discs: Discs) -> tuple[float, int]:
    """When a motion first meets a disc, seconds from the start, and which; infinity and -1: never."""
    if len(discs) == 0:
        return math.inf, -1
    t, who = first_contact_time(
        path.s, path.x, path.y, *motion, discs.begin, discs.t, discs.x, discs.y, discs.reach, discs.top
    )
    return (t if who >= 0 else math.inf), who


def _positive(code: str, where: str, value: float) -> None:
    if not in_range(value, 1e-9, 1e9):
        raise SettingError(code, shown(value), where=where, allowed="1e-9 to 1e9 seconds")
