"""How a robot with a heading followed its paths: distance and yaw beside them, and how smoothly it drove."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from lampyris.model.curve import Curve, PoseCurve
from lampyris.typing import Floats

if TYPE_CHECKING:
    from lampyris.model.drive import Drive

LOOK = 0.05
"""Seconds between two looks at a drive."""

_POINTS = 4
"""Points of a path in each cell of its length."""

_PAIRS = 2_000_000
"""Pairs of a place and a point that are compared at once."""


def following(drive: Drive) -> dict[str, Any]:
    """Measures of a drive along poses, by name; None where there is nothing to measure.

    * ``cross_track_max``, ``cross_track_mean``: metres from the base to the nearest point of the path that it followed
      then, every :data:`LOOK` seconds; 0 if the controller is ``exact``.
    * ``yaw_error_max``, ``yaw_error_mean``: radians between the robot's yaw and that of the path at that point.
    * ``jerk_mean``: changes of the acceleration, summed up, by the duration; m/s3.
    * ``yaw_acceleration_mean``: changes of the yaw rate, summed up, by the duration; rad/s2.
    * ``stops``: how often the robot came to rest before the end.
    * ``contacts``: contacts while it moved that were reported, 0 or 1: one is the end.
    """
    found: dict[str, Any] = dict.fromkeys(
        (
            "cross_track_max",
            "cross_track_mean",
            "yaw_error_max",
            "yaw_error_mean",
            "jerk_mean",
            "yaw_acceleration_mean",
        )
    )
    rests = (drive.v[1:] == 0.0) & (drive.v[:-1] > 0.0)
    found["stops"] = int(rests[:-1].sum())
    found["contacts"] = sum(m.word == "contact" for m in drive.moments)
    if drive.duration <= 0.0:
        return found
    beside, off = _errors(drive)
    if len(beside):
        found["cross_track_max"], found["cross_track_mean"] = float(beside.max()), float(beside.mean())
        found["yaw_error_max"], found["yaw_error_mean"] = float(off.max()), float(off.mean())
    found["jerk_mean"] = float(np.abs(np.diff(drive.a)).sum() / drive.duration)
    found["yaw_acceleration_mean"] = float(np.abs(np.diff(_yaw_rates(drive))).sum() / drive.duration)
    return found


def _yaw_rates(drive: Drive) -> Floats:
    """Yaw rate at the beginning of each stretch, rad/s."""
    rate = np.zeros(len(drive.t))
    for leg in np.unique(drive.leg).tolist():
        curve = drive.curves[leg]
        if isinstance(curve, PoseCurve) and len(curve.lengths):
            own = drive.leg == leg
            rate[own] = curve.turn[curve.pieces_at(drive.s[own])] * drive.v[own]
    return rate


def _errors(drive: Drive) -> tuple[Floats, Floats]:
    """Metres and radians beside the path at each look."""
    times = np.arange(0.0, drive.duration, LOOK)
    if not drive.paths:
        return (np.zeros(len(times)),) * 2 if drive.goal_tolerance is not None else (np.zeros(0),) * 2
    xy = drive.at(times)[0]
    origin = drive.scene.grid.frame.origin[2]
    yaw = drive.poses(times)[:, 2] - origin
    since = np.array(drive.path_times)
    number = np.clip(np.searchsorted(since, times, side="right") - 1, 0, len(drive.paths) - 1)
    beside, off = np.zeros(len(times)), np.zeros(len(times))
    for k in np.unique(number).tolist():
        own = np.flatnonzero(number == k)
        beside[own], off[own] = _from_path(drive.paths[k], xy[own], yaw[own])
    return beside, off


def _from_path(path: Curve, xy: Floats, yaw: Floats) -> tuple[Floats, Floats]:
    """Metres to the nearest point of a path, and the difference from its yaw there; of equal ones, the least."""
    res = path.resolution
    s = np.linspace(0.0, path.length, max(math.ceil(path.length / res * _POINTS), 1) + 1)
    points = path.at(s)[0]
    yaws = path.yaw_at(s) if isinstance(path, PoseCurve) else np.zeros(len(s))
    beside, off = np.zeros(len(xy)), np.zeros(len(xy))
    chunk = max(1, _PAIRS // len(points))
    for k in range(0, len(xy), chunk):
        d = xy[k : k + chunk, None, :] - points
        distance = np.sqrt((d * d).sum(axis=2))
        turned = np.abs(np.remainder(yaws - yaw[k : k + chunk, None] + math.pi, 2 * math.pi) - math.pi)
        least = distance.min(axis=1)
        # Where the robot turns in place, or a path comes by twice, several points are as near.
        near = distance <= least[:, None] + 0.5 / _POINTS
        beside[k : k + chunk] = least * res
        off[k : k + chunk] = np.where(near, turned, np.inf).min(axis=1)
    return beside, off
