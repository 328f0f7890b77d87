# mypy: ignore-errors
"""Until the other files are there: what is not there yet does nothing. To be deleted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

try:
    from lampyris.motion.clearance import wall_distance
except ImportError:

    def wall_distance(xy, grid, reach):
        wy, wx = np.nonzero(grid.blocked)
        out = np.full(len(xy), np.inf)
        if len(wx):
            for k, (x, y) in enumerate(xy):
                gx, gy = np.maximum(np.abs(wx - x) - 0.5, 0), np.maximum(np.abs(wy - y) - 0.5, 0)
                d = np.sqrt((gx * gx + gy * gy).min()) * grid.resolution
                out[k] = d if d <= reach else np.inf
        return out


def _nothing(course, scene, settings, around):
    return []


try:
    from lampyris.motion.blind import BlindArea, blind_cap
except ImportError:

    @dataclass(frozen=True)
    class BlindArea:
        reach: float = 5.0

    blind_cap = _nothing
try:
    from lampyris.motion.three_speed import ThreeSpeed, three_speed_cap
except ImportError:

    @dataclass(frozen=True)
    class ThreeSpeed:
        period: float = 1.0

    three_speed_cap = _nothing
try:
    from lampyris.motion.cloud import CloudModel, cloud_cap
except ImportError:

    @dataclass(frozen=True)
    class CloudModel:
        horizon: float = 5.0

    cloud_cap = _nothing
try:
    from lampyris.motion.moving import MovingObstacles, moving_cap
except ImportError:

    @dataclass(frozen=True)
    class MovingObstacles:
        reaction: float = 0.1

    moving_cap = _nothing

__all__ = [
    "BlindArea",
    "CloudModel",
    "MovingObstacles",
    "ThreeSpeed",
    "blind_cap",
    "cloud_cap",
    "moving_cap",
    "three_speed_cap",
    "wall_distance",
]
