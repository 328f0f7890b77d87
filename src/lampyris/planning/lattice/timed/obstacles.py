"""Obstacles with known tracks as the timed search reads them: straight segments, in blocks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels.lattice.timed_search import FOREVER
from lampyris.model.traffic import Recorded
from lampyris.typing import Floats

BLOCK = 8
"""Segments of an obstacle that one block has."""


@dataclass(frozen=True, slots=True, eq=False)
class KnownObstacles:
    """See :mod:`lampyris.kernels.lattice.timed_search`.

    Parameters
    ----------
    block : float64 (7 m,). block_first : int64 (m + 1,). segment : float64 (6 k,).
    """

    block: Floats
    block_first: NDArray[np.int64]
    segment: Floats


def known_obstacles(recorded: Sequence[Recorded], resolution: float, now: float = 0.0) -> KnownObstacles:
    """The segments of recorded obstacles, discs of at least half a cell that stay at the end of their tracks.

    Parameters
    ----------
    resolution : metres a cell.
    now : ticks since they began to move; times count from there, and what is over is left out.
    """
    blocks: list[list[float]] = []
    firsts = [0]
    rows: list[list[float]] = []
    for one in recorded:
        radius = max(one.radius / resolution, 0.5)
        legs = _after(_legs(one), now)
        for k in range(0, len(legs), BLOCK):
            part = legs[k : k + BLOCK]
            # Where a leg ends the next one begins; the last one stands.
            xs = [leg[2] for leg in part] + [leg[2] + leg[4] * _length(leg) for leg in part]
            ys = [leg[3] for leg in part] + [leg[3] + leg[5] * _length(leg) for leg in part]
            blocks.append([min(xs), max(xs), min(ys), max(ys), part[0][0], part[-1][1], radius])
            rows += part
            firsts.append(len(rows))
    return KnownObstacles(
        np.array(blocks, dtype=np.float64).ravel(),
        np.array(firsts, dtype=np.int64),
        np.array(rows, dtype=np.float64).ravel(),
    )


def _length(leg: list[float]) -> float:
    return leg[1] - leg[0] if leg[4] or leg[5] else 0.0


def _after(legs: list[list[float]], now: float) -> list[list[float]]:
    """What is left of a track, with times from ``now`` on."""
    left: list[list[float]] = []
    for begin, end, x, y, vx, vy in legs:
        if end > now:
            gone = max(now - begin, 0.0)
            left.append([max(begin - now, 0.0), end - now, x + gone * vx, y + gone * vy, vx, vy])
    return left


def _legs(one: Recorded) -> list[list[float]]:
    """Begin, end, place at the begin and velocity of each part of a track with one velocity; ticks and cells."""
    track = np.array(one.track, dtype=np.int64)
    hops = np.diff(track, axis=0)
    legs: list[list[float]] = []
    for t, (vx, vy) in enumerate(hops.tolist()):
        if legs and legs[-1][4:] == [vx, vy]:
            legs[-1][1] = t + 1.0
        else:
            x, y = track[t].tolist()
            legs.append([float(t), t + 1.0, float(x), float(y), float(vx), float(vy)])
    x, y = track[-1].tolist()
    legs.append([float(len(hops)), FOREVER, float(x), float(y), 0.0, 0.0])
    return legs
