"""The curve that a path of poses drives, its parts, and how two of them join."""

from __future__ import annotations

import math

import numpy as np

from lampyris._core import elementary
from lampyris.model.curve import Curve, PoseCurve
from lampyris.model.grid import Grid
from lampyris.model.path import Pose, PosePath
from lampyris.model.robot import Robot
from lampyris.typing import Floats, Points

_EQUAL = 1e-6
"""Difference of two curvatures (1/cell), or angle between two directions, that is rounding."""

CENTRE = 1e-6
"""Cells from the centre of a cell within which a pose is at it; and between two poses that are the same."""

_LEAST_ARM = 0.5
"""Cells: a turn in place counts at least as what a point so far from the base moves, so that a point robot needs time."""


def arm_of(robot: Robot, resolution: float) -> float:
    """Metres that a turn in place by one radian counts as: what the farthest point of the robot moves."""
    return max(robot.radius, _LEAST_ARM * resolution)


def outline_of(robot: Robot) -> tuple[Points, float]:
    """The vertices of a robot's footprint, and the margin around them that is of the robot; metres."""
    if robot.footprint is None:
        return np.zeros((1, 2)), robot.radius
    return np.array(robot.footprint), 0.0


def curve_of_poses(path: PosePath, grid: Grid, robot: Robot) -> PoseCurve:
    """Straight lines, arcs and turns in place in the order in which they are driven.

    The robot stands still where it changes between ahead and reverse, before and after a turn in place, and where the
    direction in which it travels changes.

    Parameters
    ----------
    grid : the map of the path.
    robot : its shape, and how far its farthest point moves when it turns in place.
    """
    points = grid.frame.to_points(path.poses[:, 0], path.poses[:, 1])
    yaws = path.poses[:, 2] - grid.origin[2]
    turn = np.remainder(np.diff(yaws) + math.pi, 2 * math.pi) - math.pi
    lengths, gears, arm = path.step_lengths, path.gears, arm_of(robot, grid.resolution)
    # Directions are those of rows that point down: a turn to the left is negative.
    d = np.diff(points, axis=0)
    bearing = elementary.atan2(d[:, 1], d[:, 0]) + turn / 2
    pieces: list[list[float]] = []  # x, y, direction, length, curvature, gear, yaw, turn
    stops: list[int] = []
    along = [0.0]
    for k in range(len(gears)):
        angle, gear = float(turn[k]), float(gears[k])
        length = abs(angle) * arm if gear == 0.0 else float(lengths[k])
        along.append(along[-1] + length)
        if length == 0.0:
            continue
        direction = 0.0 if gear == 0.0 else float(bearing[k])
        rate = math.copysign(1.0 / arm, angle) if gear == 0.0 else angle / length
        curvature = 0.0 if gear == 0.0 else -rate
        if pieces:
            last = pieces[-1]
            same = gear == last[5]
            bent = same and abs(math.remainder(direction - (last[2] + last[4] * last[3]), 2 * math.pi)) > 1e-4
            if same and not bent and abs(rate - last[7]) * grid.resolution < _EQUAL:
                last[3] += length
                continue
            if bent or not same or gear == 0.0:
                stops.append(len(pieces))
        pieces.append([*points[k], direction, length, curvature, gear, float(yaws[k]), rate])
    table = np.array(pieces).reshape(-1, 8)
    straight = (np.abs(table[:, 4]) * grid.resolution < _EQUAL) & (table[:, 5] != 0.0)
    table[straight, 4] = table[straight, 7] = 0.0
    directions, moves = table[:, 2], table[:, 5] != 0.0
    heading = np.column_stack((elementary.cos(directions), elementary.sin(directions))) * moves[:, None]
    outline, margin = outline_of(robot)
    x, y = points[-1].tolist()
    centred = np.abs(points - np.floor(points + 0.5)).max(axis=1) < CENTRE
    begins = np.concatenate(([0.0], np.cumsum(table[:, 3])))
    return PoseCurve(
        table[:, :2], heading, table[:, 3], table[:, 4] + 0.0, (x, y), grid.resolution, np.array(stops, dtype=np.int64),
        yaw=table[:, 6], turn=table[:, 7], end_yaw=float(yaws[-1]), outline=outline, margin=margin,
        states=np.unique(np.minimum(np.array(along)[centred], begins[-1])),
    )  # fmt: skip


def pose_at(curve: PoseCurve, s: float, grid: Grid) -> Pose:
    """The pose at a distance, in the map frame."""
    at = np.array([s])
    x, y = grid.frame.to_metres(curve.at(at)[0])[0].tolist()
    yaw = float(curve.yaw_at(at)[0]) + grid.origin[2]
    return x, y, math.remainder(yaw, 2 * math.pi)


def standing_at(pose: Pose, grid: Grid, robot: Robot) -> PoseCurve:
    """A curve of no length, for a robot that stands."""
    x, y = grid.frame.to_points(pose[0], pose[1]).tolist()
    outline, margin = outline_of(robot)
    nothing, none = np.zeros((0, 2)), np.zeros(0)
    return PoseCurve(
        nothing, nothing, none, none, (x, y), grid.resolution,
        yaw=none, turn=none, end_yaw=pose[2] - grid.origin[2], outline=outline, margin=margin, states=np.zeros(1),
    )  # fmt: skip


def part_of(curve: PoseCurve, s0: float, s1: float) -> PoseCurve:
    """What lies between two distances, ``s0 < s1``; it knows no states."""
    begins = curve.begins
    kept = np.flatnonzero((begins[1:] > s0 + 1e-12) & (begins[:-1] < s1 - 1e-12))
    low, high = np.maximum(begins[kept], s0), np.minimum(begins[kept + 1], s1)
    along = low - begins[kept]
    xy, heading = curve.at(low)
    inside = (curve.stops > kept[0]) & (curve.stops <= kept[-1])
    end, end_yaw = curve.at(np.array([s1]))[0][0].tolist(), float(curve.yaw_at(np.array([s1]))[0])
    return PoseCurve(
        xy, heading, high - low, curve.curvature[kept], (end[0], end[1]), curve.resolution, curve.stops[inside] - kept[0],
        yaw=curve.yaw[kept] + curve.turn[kept] * along, turn=curve.turn[kept], end_yaw=end_yaw,
        outline=curve.outline, margin=curve.margin,
    )  # fmt: skip


def backwards(curve: PoseCurve) -> PoseCurve:
    """The same curve from its end to its beginning, the robot's yaw as it is; it knows no states."""
    n = len(curve.lengths)
    turned = curve.curvature * curve.lengths
    cos, sin = elementary.cos(turned), elementary.sin(turned)
    hx, hy = curve.heading[:, 0], curve.heading[:, 1]
    heading = -np.column_stack((hx * cos - hy * sin, hx * sin + hy * cos))
    ends = np.concatenate((curve.xy[1:], [curve.end]))
    x, y = curve.xy[0].tolist()
    return PoseCurve(
        ends[::-1], heading[::-1] + 0.0, curve.lengths[::-1], -curve.curvature[::-1] + 0.0, (x, y), curve.resolution,
        (n - curve.stops)[::-1],
        yaw=(curve.yaw + curve.turn * curve.lengths)[::-1], turn=-curve.turn[::-1] + 0.0, end_yaw=float(curve.yaw[0]),
        outline=curve.outline, margin=curve.margin,
    )  # fmt: skip


def joined(first: PoseCurve, second: PoseCurve) -> PoseCurve:
    """One after the other; they meet at a pose. The states are those of the second."""
    n = len(first.lengths)
    if n == 0 or len(second.lengths) == 0:
        return second if n == 0 else first
    ends: Floats = first.curvature[-1:] * first.lengths[-1:]
    cos, sin = float(elementary.cos(ends)[0]), float(elementary.sin(ends)[0])
    hx, hy = first.heading[-1].tolist()
    gx, gy = second.heading[0].tolist()
    off = max(abs(hx * cos - hy * sin - gx), abs(hx * sin + hy * cos - gy))
    both = bool(first.in_place[-1]) and bool(second.in_place[0])
    stops_between = off > _EQUAL or both
    middle = [n] if stops_between else []
    return PoseCurve(
        np.concatenate((first.xy, second.xy)), np.concatenate((first.heading, second.heading)),
        np.concatenate((first.lengths, second.lengths)), np.concatenate((first.curvature, second.curvature)),
        second.end, second.resolution, np.concatenate((first.stops, np.array(middle, dtype=np.int64), second.stops + n)),
        yaw=np.concatenate((first.yaw, second.yaw)), turn=np.concatenate((first.turn, second.turn)),
        end_yaw=second.end_yaw, outline=second.outline, margin=second.margin, states=second.states + first.length,
    )  # fmt: skip


def tracked(curve: Curve | None) -> PoseCurve | None:
    """The curve, if it is one of a robot with a heading."""
    return curve if isinstance(curve, PoseCurve) else None
