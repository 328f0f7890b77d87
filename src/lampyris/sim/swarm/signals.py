"""What sensors of robots measure: the signal of all sources at points of the map, and noise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lampyris._core.elementary import cos, direction, exp, log, sin
from lampyris.errors import SettingError, shown
from lampyris.model.grid import Grid
from lampyris.model.swarm.sources import AnySource, InverseSquare, Plume, ThreePeaks, j1
from lampyris.typing import FloatGrid

Reals = NDArray[np.float64]
"""float64, any shape."""


def signal(sources: Sequence[AnySource], xy: Reals, t: float) -> Reals:
    """The sum of what all sources send to points, float64 (n,).

    Parameters
    ----------
    sources : at least one.
    xy : (n, 2), metres of the map frame.
    t : seconds since the beginning.
    """
    total = np.zeros(len(xy))
    for one in sources:
        total += _of(one, xy, t)
    return total


def _of(source: AnySource, xy: Reals, t: float) -> Reals:
    if isinstance(source, ThreePeaks):
        (cx, cy), w, h = source.centre, source.width / 6.0, source.height / 6.0
        return j1((xy[:, 0] - cx) / w, (xy[:, 1] - cy) / h)
    if isinstance(source, InverseSquare):
        ((px, py),) = source.places(t)
        dx, dy = xy[:, 0] - px, xy[:, 1] - py
        square = source.core * source.core
        out: Reals = source.strength * square / (dx * dx + dy * dy + square)
        return out
    if isinstance(source, Plume):
        ((px, py),) = source.places(t)
        dx, dy = xy[:, 0] - px, xy[:, 1] - py
        wx, wy = direction(source.towards)
        along, beside = wx * dx + wy * dy, wx * dy - wy * dx
        square = source.width * source.width
        wide = square + 2.0 * source.spread * np.maximum(along, 0.0)
        upwind = np.minimum(along, 0.0)
        thin = np.sqrt(square / wide)
        return source.strength * thin * exp(-0.5 * (beside * beside + upwind * upwind) / wide)
    raise SettingError("SOURCE", shown(source), where="sources", allowed="ThreePeaks, InverseSquare or Plume")


def signal_on(grid: Grid, sources: Sequence[AnySource], t: float) -> FloatGrid:
    """The signal at the centre of each free cell, less the least of them; infinity in walls; (height, width)."""
    y, x = np.mgrid[: grid.height, : grid.width]
    cells = np.stack((x.ravel(), y.ravel()), axis=-1)
    value: FloatGrid = signal(sources, grid.to_metres(cells), t).reshape(grid.height, grid.width)
    free = ~grid.blocked
    return np.where(free, value - (value[free].min() if free.any() else 0.0), np.inf)


def normal(rng: np.random.Generator, n: int) -> Reals:
    """Normal deviates by Box and Muller, the same on every machine; float64 (n,)."""
    half = -(-n // 2)
    radius = np.sqrt(-2.0 * log(1.0 - rng.random(half)))
    angle = 2.0 * np.pi * rng.random(half)
    both: Reals = np.concatenate((radius * cos(angle), radius * sin(angle)))
    return both[:n]
