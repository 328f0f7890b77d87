"""Where a tracked path costs more than was planned."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lampyris.typing import Cell

PLACES = 8
"""Spheres that a round adds or lets grow at most."""


def costly_places(
    path: NDArray[np.int64], plan: NDArray[np.number], track_cells: NDArray[np.int64], track: NDArray[np.number],
    around: float, wanted: float,
) -> list[Cell]:  # fmt: skip
    """Places of a planned path around which a tracked one costs most more, at least one; the costliest first.

    Parameters
    ----------
    path : int64 (n, 2): cells of the planned path. plan : (n,): its cost up to each.
    track_cells : int64 (m, 2): cells of the tracked path. track : (m,): its cost up to each.
    around : cost to both sides of a place that counts as its own.
    wanted : how much more cost the places should account for together.
    """
    passed = _nearest(path, track_cells)
    passed[-1] = len(plan) - 1
    # A place is behind it when it does not come back to it.
    behind = np.minimum.accumulate(passed[::-1])[::-1]
    last = np.maximum(np.searchsorted(behind, np.arange(len(plan)), side="right") - 1, 0)
    excess = np.diff(track[last] - plan, prepend=plan.dtype.type(0))
    right = np.searchsorted(plan, plan + around, side="right")
    left = np.searchsorted(plan, plan - around, side="left")
    found: list[Cell] = []
    while len(found) < PLACES and (wanted > 0 or not found):
        sums = np.concatenate((np.zeros(1, excess.dtype), np.cumsum(excess)))
        near = sums[right] - sums[left]
        k = int(near.argmax())
        if near[k] <= 0 and found:
            break
        wanted -= float(near[k])
        excess[left[k] : right[k]] = 0
        x, y = path[k].tolist()
        found.append((x, y))
    return found


def _nearest(path: NDArray[np.int64], cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """The place on a path that is nearest to each cell, the later of two as near."""
    backward = path[::-1]
    found = []
    for cell in cells:
        d = backward - cell
        found.append(len(path) - 1 - int((d * d).sum(axis=1).argmin()))
    return np.array(found)
