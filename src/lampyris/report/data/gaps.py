"""Free distances of a drive: between the robot's rim and an obstacle's at some times."""

from __future__ import annotations

import numpy as np

from lampyris.model.curve import PoseCurve
from lampyris.model.drive import Drive
from lampyris.model.obstacles import Track
from lampyris.typing import Floats


def with_footprint(drive: Drive) -> bool:
    """Whether the robot drove as a footprint with a heading, and not as a disc."""
    poses = bool(drive.curves) and all(isinstance(curve, PoseCurve) for curve in drive.curves)
    return poses and drive.scene.robot.footprint is not None


def gaps_between(drive: Drive, track: Track, t: Floats) -> Floats:
    """Metres between the two rims at some times, below 0 where they overlap; infinity before the obstacle is there."""
    grid, robot = drive.scene.grid, drive.scene.robot
    centre = track.at(t)
    if with_footprint(drive):
        away = (
            _from_outline(np.array(robot.footprint), drive.poses(t), grid.frame.to_metres(centre))
            - track.radius
        )
    else:
        d = centre - drive.at(t)[0]
        away = np.sqrt((d * d).sum(axis=1)) * grid.resolution - (robot.radius + track.radius)
    return np.where(t >= track.t[0], away, np.inf)


def _from_outline(outline: Floats, poses: Floats, points: Floats) -> Floats:
    """Distance of points from an outline at poses, all in metres of the map frame; negative inside."""
    d = points - poses[:, :2]
    cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    x, y = cos * d[:, 0] + sin * d[:, 1], cos * d[:, 1] - sin * d[:, 0]
    best, inside = np.full(len(d), np.inf), np.zeros(len(d), dtype=np.bool_)
    for (ax, ay), (bx, by) in zip(outline.tolist(), np.roll(outline, -1, axis=0).tolist(), strict=True):
        ex, ey = bx - ax, by - ay
        share = np.clip(((x - ax) * ex + (y - ay) * ey) / (ex * ex + ey * ey), 0.0, 1.0)
        best = np.minimum(best, np.hypot(x - ax - share * ex, y - ay - share * ey))
        if ay != by:
            inside ^= ((ay > y) != (by > y)) & (x < ax + ex * (y - ay) / ey)
    return np.where(inside, -best, best)
