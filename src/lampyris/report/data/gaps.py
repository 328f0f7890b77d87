"""Free distances of a drive: between the robot's rim and an obstacle's at some times."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lampyris.model.curve import PoseCurve
from lampyris.model.drive import Drive
from lampyris.model.obstacles import Track
from lampyris.typing import Floats


def with_footprint(drive: Drive) -> bool:
    """Whether the robot drove as a footprint with a heading, and not as a disc."""
    poses = bool(drive.curves) and all(isinstance(curve, PoseCurve) for curve in drive.curves)
    return poses and drive.scene.robot.footprint is not None


def gaps_between(drive: Drive, track: Track, t: Floats) -> Floats:
    """Metres between the two rims at some times; infinity before the obstacle is there.

    Below 0 where they overlap; 0 where the obstacle is a polygon.
    """
    grid, robot = drive.scene.grid, drive.scene.robot
    centre = track.at(t)
    if track.outline is not None:
        return np.where(t >= track.t[0], _between_outlines(drive, track, t), np.inf)
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


def _between_outlines(drive: Drive, track: Track, t: Floats) -> Floats:
    """Distance of a polygon from the robot at some times, metres, 0 where they overlap; (m,)."""
    frame, robot = drive.scene.grid.frame, drive.scene.robot
    poses, headed = drive.poses(t), with_footprint(drive)
    theirs = _placed(
        np.array(track.outline), frame.to_metres(track.at(t)), track.heading(t) + frame.origin[2]
    )
    if headed:
        ours = _placed(np.array(robot.footprint), poses[:, :2], poses[:, 2])
        gap = np.minimum(_vertices_from(ours, theirs), _vertices_from(theirs, ours))
        return np.asarray(np.where(_edges_cross(ours, theirs), 0.0, np.maximum(gap, 0.0)))
    gap = _vertices_from(poses[:, None, :2], theirs) - robot.radius
    return np.asarray(np.maximum(gap, 0.0))


def _placed(outline: Floats, at: Floats, yaw: Floats) -> Floats:
    """An outline at poses; (m, k, 2)."""
    cos, sin = np.cos(yaw)[:, None], np.sin(yaw)[:, None]
    x, y = outline.T
    return np.asarray(at[:, None] + np.stack((cos * x - sin * y, sin * x + cos * y), axis=2))


def _vertices_from(points: Floats, polygon: Floats) -> Floats:
    """Least distance of points (m, k, 2) from polygons (m, n, 2), negative if one is inside; (m,)."""
    p, a = points[:, :, None], polygon[:, None]
    b = np.roll(polygon, -1, axis=1)[:, None]
    edge, away = b - a, p - a
    share = np.clip((away * edge).sum(axis=3) / (edge * edge).sum(axis=3), 0.0, 1.0)
    rest = away - share[..., None] * edge
    distance = np.sqrt((rest * rest).sum(axis=3).min(axis=2))
    with np.errstate(divide="ignore", invalid="ignore"):
        ahead = p[..., 0] < a[..., 0] + edge[..., 0] * away[..., 1] / edge[..., 1]
    inside = (((a[..., 1] > p[..., 1]) != (b[..., 1] > p[..., 1])) & ahead).sum(axis=2) % 2 == 1
    least: Floats = np.where(inside, -distance, distance).min(axis=1)
    return least


def _edges_cross(one: Floats, other: Floats) -> NDArray[np.bool_]:
    """Whether edges of two polygons cross, case by case; (m,)."""
    a, b = one[:, :, None], other[:, None]
    u, v = np.roll(one, -1, axis=1)[:, :, None] - a, np.roll(other, -1, axis=1)[:, None] - b
    first = _cross(u, b - a) * _cross(u, b + v - a) < 0.0
    second = _cross(v, a - b) * _cross(v, a + u - b) < 0.0
    return np.asarray((first & second).any(axis=(1, 2)))


def _cross(u: Floats, v: Floats) -> Floats:
    return np.asarray(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])
