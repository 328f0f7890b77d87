"""Messages of ROS 2 as plain dictionaries: field names to numbers, text, lists and arrays.

Each transport and the writer of bags turn them into messages of their own kind. Fields that are left out are zero, empty
or false. Times are seconds, places metres of the frame that the header names, angles radians counterclockwise.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from lampyris.io.maps.formats.ros_write import occupancy_of
from lampyris.model.grid import Grid
from lampyris.model.profile import Profile
from lampyris.typing import Floats

Fields: TypeAlias = Mapping[str, Any]

MAP, ODOM, BASE = "map", "odom", "base_link"
"""Frames of REP 105."""

OCCUPANCY_GRID = "nav_msgs/msg/OccupancyGrid"
GRID_UPDATE = "map_msgs/msg/OccupancyGridUpdate"
PATH = "nav_msgs/msg/Path"
ODOMETRY = "nav_msgs/msg/Odometry"
TF = "tf2_msgs/msg/TFMessage"
POSE = "geometry_msgs/msg/PoseStamped"
POSE_ESTIMATE = "geometry_msgs/msg/PoseWithCovarianceStamped"
POSE_ARRAY = "geometry_msgs/msg/PoseArray"
TWIST = "geometry_msgs/msg/Twist"
TWIST_STAMPED = "geometry_msgs/msg/TwistStamped"
MARKERS = "visualization_msgs/msg/MarkerArray"
TRAJECTORY = "trajectory_msgs/msg/JointTrajectory"
STRING = "std_msgs/msg/String"
BOOL = "std_msgs/msg/Bool"

ADD, DELETE, DELETE_ALL = 0, 2, 3
ARROW, CUBE, SPHERE, CYLINDER, LINE_STRIP, TEXT = 0, 1, 2, 3, 4, 9
"""Numbers of visualization_msgs/Marker."""


def stamp(t: float) -> dict[str, int]:
    """builtin_interfaces/Time, to the nearest nanosecond; also Duration."""
    sec, nanosec = divmod(round(t * 1e9), 1_000_000_000)
    return {"sec": sec, "nanosec": nanosec}


def seconds(time: Fields) -> float:
    """Seconds of a Time or Duration."""
    return float(time["sec"]) + 1e-9 * float(time["nanosec"])


def header(t: float, frame: str) -> dict[str, Any]:
    """std_msgs/Header."""
    return {"stamp": stamp(t), "frame_id": frame}


def point(x: float, y: float, z: float = 0.0) -> dict[str, float]:
    """geometry_msgs/Point or Vector3."""
    return {"x": float(x), "y": float(y), "z": float(z)}


def quaternion(yaw: float) -> dict[str, float]:
    """geometry_msgs/Quaternion of a turn about the vertical axis."""
    half = 0.5 * math.remainder(float(yaw), 2.0 * math.pi)
    return {"x": 0.0, "y": 0.0, "z": math.sin(half), "w": math.cos(half)}


def yaw_of(q: Fields) -> float:
    """Yaw of a quaternion."""
    x, y, z, w = (float(q[k]) for k in "xyzw")
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def pose(x: float, y: float, yaw: float) -> dict[str, Any]:
    """geometry_msgs/Pose."""
    return {"position": point(x, y), "orientation": quaternion(yaw)}


def pose_of(fields: Fields) -> tuple[float, float, float]:
    """x, y and yaw of a geometry_msgs/Pose."""
    return float(fields["position"]["x"]), float(fields["position"]["y"]), yaw_of(fields["orientation"])


def pose_stamped(t: float, at: Sequence[float], frame: str = MAP) -> dict[str, Any]:
    """geometry_msgs/PoseStamped."""
    return {"header": header(t, frame), "pose": pose(*at)}


def path(t: float, poses: Floats, times: Floats | None = None, frame: str = MAP) -> dict[str, Any]:
    """nav_msgs/Path.

    Parameters
    ----------
    t : of the path's own header.
    poses : float64 (n, 3): x, y, yaw.
    times : float64 (n,): when the robot is to be at each; None: ``t``.
    frame : of all poses.
    """
    at = [t] * len(poses) if times is None else times.tolist()
    rows = zip(at, poses.tolist(), strict=True)
    return {"header": header(t, frame), "poses": [pose_stamped(when, one, frame) for when, one in rows]}


def transform(t: float, parent: str, child: str, at: Sequence[float]) -> dict[str, Any]:
    """geometry_msgs/TransformStamped."""
    x, y, yaw = at
    return {
        "header": header(t, parent), "child_frame_id": child,
        "transform": {"translation": point(x, y), "rotation": quaternion(yaw)},
    }  # fmt: skip


def odometry(t: float, at: Sequence[float], v: float, w: float) -> dict[str, Any]:
    """nav_msgs/Odometry: the pose in ``odom``, the velocity in ``base_link``."""
    return {
        "header": header(t, ODOM), "child_frame_id": BASE,
        "pose": {"pose": pose(*at)}, "twist": {"twist": twist(v, w)},
    }  # fmt: skip


def twist(v: float, w: float) -> dict[str, Any]:
    """geometry_msgs/Twist."""
    return {"linear": point(v, 0.0), "angular": point(0.0, 0.0, w)}


def twist_stamped(t: float, v: float, w: float) -> dict[str, Any]:
    """geometry_msgs/TwistStamped."""
    return {"header": header(t, BASE), "twist": twist(v, w)}


def occupancy_grid(t: float, grid: Grid) -> dict[str, Any]:
    """nav_msgs/OccupancyGrid: 0 free, 100 blocked, -1 unknown; terrain as 1 to 98, as Nav2 publishes a costmap."""
    values = "costmap" if grid.terrain is not None else "occupancy"
    data = np.ascontiguousarray(occupancy_of(grid, values)[::-1]).ravel()
    return {
        "header": header(t, MAP),
        "info": {
            "map_load_time": stamp(t), "resolution": grid.resolution, "width": grid.width, "height": grid.height,
            "origin": pose(*grid.origin),
        },
        "data": data,
    }  # fmt: skip


def marker(
    t: float, ns: str, number: int, kind: int, at: Sequence[float], scale: Sequence[float],
    rgba: Sequence[float], **more: Any,
) -> dict[str, Any]:  # fmt: skip
    """visualization_msgs/Marker in the map frame; all other fields by name."""
    r, g, b, a = rgba
    return {
        "header": header(t, MAP), "ns": ns, "id": number, "type": kind, "action": ADD, "pose": pose(*at),
        "scale": point(*scale), "color": {"r": r, "g": g, "b": b, "a": a}, **more,
    }  # fmt: skip


def obstacle_marker(t: float, number: int, x: float, y: float, yaw: float, radius: float) -> dict[str, Any]:
    """An obstacle as a cylinder; its id is its number."""
    size = 2.0 * radius
    return marker(t, "obstacles", number, CYLINDER, (x, y, yaw), (size, size, 0.5), (0.85, 0.35, 0.1, 0.9))


def deleted(t: float, ns: str, number: int) -> dict[str, Any]:
    """The marker that removes another."""
    return marker(
        t, ns, number, CYLINDER, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0), action=DELETE
    )


def path_markers(t: float, poses: Floats, cause: str, at: Sequence[float], v: float) -> dict[str, Any]:
    """A path as a line, and above the robot its speed with what limits it."""
    points = [point(x, y) for x, y, _ in poses.tolist()]
    line = marker(
        t, "path", 0, LINE_STRIP, (0.0, 0.0, 0.0), (0.05, 0.0, 0.0), (0.1, 0.4, 0.9, 1.0), points=points
    )
    words = marker(
        t, "speed", 0, TEXT, at, (0.0, 0.0, 0.25), (0.1, 0.1, 0.1, 1.0), text=f"{v:.2f} m/s: {cause}"
    )
    return {"markers": [line, words] if points else [words]}


def speed_profile(profile: Profile, t: float = 0.0) -> dict[str, str]:
    """A speed profile with causes as JSON in a std_msgs/String, because no message of ROS has a place for causes.

    Keys: ``stamp`` (s), ``law``, ``units``, ``s`` (m), ``v`` (m/s), ``a`` (m/s2), ``t`` (s from the start), ``why``.
    """
    held = {
        "stamp": t, "law": profile.law, "units": profile.units,
        **{name: getattr(profile, name).tolist() for name in ("s", "v", "a", "t")},
        "why": [profile.why(k) for k in range(len(profile.s))],
    }  # fmt: skip
    return {"data": json.dumps(held)}


def speed_trajectory(t: float, profile: Profile) -> dict[str, Any]:
    """The same without causes as trajectory_msgs/JointTrajectory: one joint, ``path``, whose position is s."""
    rows = zip(*(getattr(profile, name).tolist() for name in ("s", "v", "a", "t")), strict=True)
    points = [
        {"positions": [s], "velocities": [v], "accelerations": [a], "time_from_start": stamp(when)}
        for s, v, a, when in rows
    ]
    return {"header": header(t, MAP), "joint_names": ["path"], "points": points}
