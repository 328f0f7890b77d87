"""Moving obstacles among a fleet: discs that walk at random from cell to cell and never wait for a robot."""

from __future__ import annotations

import math

import numpy as np

from lampyris._core.arrays import index_array
from lampyris._core.cancellation import checkpoint
from lampyris._core.elementary import interp
from lampyris._core.limits import MEMORY
from lampyris.errors import SettingError
from lampyris.model.grid import Grid
from lampyris.model.obstacles import Track
from lampyris.planning.field.layers import free_cells
from lampyris.typing import Floats

_STILL = 1e-9
"""Metres a second that are none."""
_EACH = 300
"""Bytes of an obstacle and a step while its track is made."""
_STEPS = np.array([(1, 0), (-1, 0), (0, 1), (0, -1)])


def walkers(
    grid: Grid, count: int, radius: float, speed: float, duration: float, rng: np.random.Generator
) -> tuple[Track, ...]:
    """Tracks of obstacles that go on from cell to cell, turning at random, for a time; metres, seconds.

    At each cell an obstacle goes on as before with chance 0.8 if it can, or else to any free neighbour. It keeps its radius
    from walls: to a disc wider than a cell only cells far enough from them are free.

    Raises
    ------
    SettingError : ``FLEET_DRIVE``: discs that fit nowhere.
    """
    if count == 0:
        return ()
    blocked = ~free_cells(grid, radius)
    from scipy import ndimage  # bits: labels, whole numbers

    labels, regions = ndimage.label(~blocked)
    if regions == 0:
        raise SettingError.of(
            "FLEET_DRIVE", "obstacle_radius", f"{radius:g} m: there is no place where such a disc touches no wall",
            allowed="less",
        )  # fmt: skip
    sizes = np.bincount(index_array(labels.ravel()))[1:]
    y, x = np.nonzero(labels == 1 + int(sizes.argmax()))
    free = np.stack((x, y), axis=1)
    blocked = np.pad(blocked, 1, constant_values=True)
    walks = speed > _STILL
    step = grid.resolution / speed if walks else duration
    needed = count * duration / step * _EACH / 2**20
    what = f"the tracks of {count:,} obstacles over {duration:g} s"
    MEMORY.demand(math.ceil(min(needed, 1e15)), what, instead="take a shorter drive_limit")
    steps = max(1, int(np.ceil(duration / step)))
    made = []
    for _ in range(count):
        checkpoint()
        here = free[int(rng.integers(len(free)))]
        cells, heading = [here], int(rng.integers(4))
        draws = rng.random((steps, 2))
        for go_on, other in draws.tolist():
            open_ = [
                k for k in range(4) if not blocked[here[1] + _STEPS[k, 1] + 1, here[0] + _STEPS[k, 0] + 1]
            ]
            if open_ and walks:
                if heading not in open_ or go_on > 0.8:
                    heading = open_[min(int(other * len(open_)), len(open_) - 1)]
                here = here + _STEPS[heading]
            cells.append(here)
        t = step * np.arange(steps + 1)
        made.append(Track(t, np.array(cells, dtype=np.float64), radius, max(speed, 1e-9) * (1.0 + 1e-9)))
    return tuple(made)


def sampled(tracks: tuple[Track, ...], grid: Grid, period: float, duration: float) -> Floats:
    """Where obstacles are every ``period`` seconds, metres of the map frame, float64 (samples, m, 2).

    Raises
    ------
    LimitError : ``MEMORY``.
    """
    needed = math.ceil(min(len(tracks) * duration / period * 48 / 2**20, 1e15))
    MEMORY.demand(
        needed,
        f"the places of {len(tracks):,} obstacles over {duration:g} s",
        instead="take a shorter drive_limit",
    )
    times = period * np.arange(int(np.ceil(duration / period)) + 2)
    cells = np.stack(
        [np.stack([interp(times, one.t, one.xy[:, c]) for c in range(2)], axis=1) for one in tracks],
        axis=1,
    )
    return grid.to_metres(cells)
