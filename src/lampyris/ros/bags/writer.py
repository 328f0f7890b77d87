"""Bags of ROS 2: plans and runs as recorded topics that Foxglove, RViz and ``ros2 bag`` understand."""

from __future__ import annotations

import math
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from lampyris._core import elementary
from lampyris.errors import FileError, UsageError, file_name, of_kind
from lampyris.model.drive import Drive
from lampyris.model.obstacles import Track
from lampyris.model.plan import Plan
from lampyris.model.profile import Profile
from lampyris.model.scene import Scene
from lampyris.model.trace import Trace
from lampyris.ros import messages
from lampyris.ros.messages import Fields
from lampyris.ros.path_export import path_fields
from lampyris.ros.stores import USUAL, build, rosbags_module, typestore
from lampyris.typing import Floats

SUFFIXES = (".mcap", ".db3", "")
"""One file of MCAP, one of SQLite, or a folder with MCAP and ``metadata.yaml``."""
SAMPLE = 0.1
"""Seconds between two poses of a run in ticks, at most; a drive has those of its decisions."""
LATCHED = ("/map", "/tf_static", "/plan", "/lampyris/speed_profile")
"""Topics whose last message late subscribers get, as Nav2 offers them."""


class Stamped(NamedTuple):
    """A message of a bag."""

    t: float
    topic: str
    kind: str
    fields: Fields


def write_bag(
    what: Plan | Trace | Drive,
    path: str | os.PathLike[str],
    *,
    scene: Scene | None = None,
    profile: Profile | None = None,
    start: float = 0.0,
    distribution: str = USUAL,
) -> int:
    """Write a plan or a run as a bag of ROS 2.

    Topics: ``/map``, ``/tf_static`` (map to odom), ``/plan``, ``/lampyris/markers``, with a profile
    ``/lampyris/speed_profile``; of a run also ``/tf`` (odom to base_link), ``/pose``, ``/odom``, ``/cmd_vel``
    (TwistStamped) and ``/obstacles`` (MarkerArray: a cylinder for each, its id is its number).

    Parameters
    ----------
    what : a plan, a simulation in ticks (a tick is the time that the robot needs for a cell at its maximum speed) or a
        drive.
    path : ``.mcap`` or ``.db3`` for one file, a name without ending for a folder with ``metadata.yaml``. A file is
        replaced; a folder must not exist.
    scene : of a plan.
    profile : of the plan.
    start : seconds since the epoch at which it begins.
    distribution : of ROS 2, whose definitions of messages are written.

    Returns
    -------
    Number of messages.

    Raises
    ------
    UsageError : ``EXTRA``: rosbags is not installed (``pip install 'lampyris[ros]'``); ``SUFFIX``; ``BAG``: a plan without
        scene or path, a run that never began.
    FileError : ``FILE_WRITE``.
    """
    of_kind("profile", profile, Profile, none=True)
    target = Path(file_name("path", path))
    check_suffix(target)
    store = typestore(distribution)
    rows: Iterator[Stamped]
    if isinstance(what, Drive):
        rows = _drive(what)
    elif isinstance(what, Trace):
        rows = _trace(what)
    else:
        of_kind("what", what, Plan)
        of_kind("scene", scene, Scene)
        assert scene is not None
        rows = _plan(what, scene, profile)
    found = sorted(rows, key=lambda row: row.t)
    return _write(found, target, store, start)


def check_suffix(target: Path) -> None:
    """Refuse a file of another kind.

    Raises
    ------
    UsageError : ``SUFFIX``.
    """
    if target.suffix.lower() not in SUFFIXES:
        allowed = ".mcap, .db3, or no ending (a folder)"
        raise UsageError("SUFFIX", repr(target.suffix), where=str(target), allowed=allowed)


def _write(rows: list[Stamped], target: Path, store: Any, start: float) -> int:
    rosbag2 = rosbags_module("rosbags.rosbag2")
    sqlite = target.suffix.lower() == ".db3"
    plugin = rosbag2.StoragePlugin.SQLITE3 if sqlite else rosbag2.StoragePlugin.MCAP
    single = target.suffix != ""
    try:
        if not single and target.exists():
            raise FileError(
                "FILE_WRITE", "it exists", where=str(target), allowed="a folder that does not exist"
            )
        place = Path(os.path.realpath(target)).parent
        with tempfile.TemporaryDirectory(prefix=".lampyris-bag-", dir=place) as folder:
            bag = Path(folder) / target.stem
            with rosbag2.Writer(bag, version=9, storage_plugin=plugin) as writer:
                open_: dict[str, Any] = {}
                for row in rows:
                    if row.topic not in open_:
                        open_[row.topic] = writer.add_connection(
                            row.topic, row.kind, typestore=store, offered_qos_profiles=_qos(row.topic)
                        )
                    data = store.serialize_cdr(build(store, row.kind, _later(row.fields, start)), row.kind)
                    writer.write(open_[row.topic], round((start + row.t) * 1e9), data)
            if single:
                made = next(one for one in bag.iterdir() if one.name != "metadata.yaml")
                os.replace(made, target)
            else:
                shutil.move(bag, target)
    except OSError as problem:
        why = problem.strerror or str(problem)
        raise FileError(
            "FILE_WRITE", why, where=str(target), allowed="a place that can be written to"
        ) from None
    return len(rows)


def _later(value: Any, start: float) -> Any:
    """Fields with every stamp moved to the start of the bag."""
    if start == 0.0 or not isinstance(value, dict | list):
        return value
    if isinstance(value, list):
        return [_later(one, start) for one in value]
    return {
        key: messages.stamp(start + messages.seconds(one)) if key in ("stamp", "map_load_time") else _later(one, start)
        for key, one in value.items()
    }  # fmt: skip


def _qos(topic: str) -> list[Any]:
    """Reliable, the last message kept for late subscribers where Nav2 does so."""
    kinds = rosbags_module("rosbags.interfaces")
    kept = topic in LATCHED
    durability = kinds.QosDurability.TRANSIENT_LOCAL if kept else kinds.QosDurability.VOLATILE
    never = kinds.QosTime(2147483647, 4294967295)
    return [
        kinds.Qos(
            kinds.QosHistory.KEEP_LAST, 1 if kept else 10, kinds.QosReliability.RELIABLE, durability, never, never,
            kinds.QosLiveliness.AUTOMATIC, never, False,
        )
    ]  # fmt: skip


def _begin(scene: Scene) -> Iterator[Stamped]:
    yield Stamped(0.0, "/map", messages.OCCUPANCY_GRID, messages.occupancy_grid(0.0, scene.grid))
    fixed = [messages.transform(0.0, messages.MAP, messages.ODOM, (0.0, 0.0, 0.0))]
    yield Stamped(0.0, "/tf_static", messages.TF, {"transforms": fixed})


def _plan(plan: Plan, scene: Scene, profile: Profile | None) -> Iterator[Stamped]:
    if plan.path is None:
        raise UsageError("BAG", f"a plan without a path: {plan.sentence}", allowed="a plan that found a path")
    yield from _begin(scene)
    path = path_fields(plan, profile)
    yield Stamped(0.0, "/plan", messages.PATH, path)
    if profile is not None:
        yield from _speeds(0.0, profile)
    poses = np.array([messages.pose_of(one["pose"]) for one in path["poses"]])
    v, cause = (float(profile.v[0]), profile.why(0)) if profile is not None else (0.0, "no speed law")
    marks = messages.path_markers(0.0, poses, cause, poses[0].tolist(), v)
    yield Stamped(0.0, "/lampyris/markers", messages.MARKERS, marks)


def _speeds(t: float, profile: Profile) -> Iterator[Stamped]:
    yield Stamped(t, "/lampyris/speed_profile", messages.STRING, messages.speed_profile(profile, t))
    if profile.metric:
        made = messages.speed_trajectory(t, profile)
        yield Stamped(t, "/lampyris/speed_trajectory", messages.TRAJECTORY, made)


def _drive(drive: Drive) -> Iterator[Stamped]:
    if not drive.curves:
        raise UsageError("BAG", "a run that never began", allowed="a drive whose robot set off")
    scene = drive.scene
    yield from _begin(scene)
    paths = drive.paths or drive.curves
    legs = [int(np.flatnonzero(drive.leg == k)[0]) for k in range(len(paths)) if (drive.leg == k).any()]
    begins = list(drive.path_times) if drive.paths else [float(drive.t[k]) for k in legs]
    used = list(paths) if drive.paths else [paths[int(drive.leg[k])] for k in legs]
    curves = []
    for t, curve in zip(begins, used, strict=True):
        along = np.arange(0.0, curve.length, max(scene.grid.resolution, curve.length / 2000))
        poses = curve_poses(scene, curve, np.append(along, curve.length))
        curves.append((t, poses))
        yield Stamped(t, "/plan", messages.PATH, messages.path(t, poses))
    times = _times(drive.duration, min(drive.period, SAMPLE))
    poses = drive.poses(times)
    yaw = np.unwrap(poses[:, 2])
    speed = drive.at(times)[1] * _gears(poses, times)
    rate = np.gradient(yaw, times) if len(times) > 1 else np.zeros(1)
    k = np.clip(np.searchsorted(drive.t, times, side="right") - 1, 0, len(drive.t) - 1)
    causes = [drive.why(int(one)) for one in k]
    yield from _robot(times, poses, speed, rate)
    now = np.clip(np.searchsorted([t for t, _ in curves], times, side="right") - 1, 0, None)
    for t, at, v, cause, leg in zip(
        times.tolist(), poses.tolist(), speed.tolist(), causes, now.tolist(), strict=True
    ):
        marks = messages.path_markers(t, curves[leg][1], cause, at, v)
        if t != curves[leg][0]:  # the line is there already
            marks = {"markers": marks["markers"][-1:]}
        yield Stamped(t, "/lampyris/markers", messages.MARKERS, marks)
    yield from _obstacles(scene, drive.tracks, times)


def curve_poses(scene: Scene, curve: Any, s: Floats) -> Floats:
    """Poses along a curve: metres of the map frame and radians, float64 (n, 3)."""
    xy, heading = curve.at(s)
    turn = scene.grid.origin[2]
    along = elementary.atan2(0.0 - heading[:, 1], heading[:, 0])
    yaw = curve.yaw_at(s) if hasattr(curve, "yaw_at") else along
    return np.column_stack((scene.grid.to_metres(xy), np.asarray(yaw) + turn))


def _trace(trace: Trace) -> Iterator[Stamped]:
    scene, grid = trace.scene, trace.scene.grid
    tick = grid.resolution / scene.robot.v_max
    yield from _begin(scene)
    if trace.path is not None and len(trace.path.cells) > 1:
        yield Stamped(0.0, "/plan", messages.PATH, path_fields(trace))
    n = len(trace.robot)
    times: Floats = np.arange(n, dtype=np.float64) * tick
    xy = grid.to_metres(trace.robot)
    d = np.diff(xy, axis=0)
    moved = (d != 0).any(axis=1)
    yaw, last = np.zeros(n), grid.origin[2]
    steps = elementary.atan2(d[:, 1], d[:, 0]) if n > 1 else np.zeros(0)
    if moved.any():
        last = float(steps[np.flatnonzero(moved)[0]])
    yaw[0] = last
    for k in range(n - 1):
        last = float(steps[k]) if moved[k] else last
        yaw[k + 1] = last
    poses = np.column_stack((xy, yaw))
    speed = trace.speed if trace.units == "m/s" else np.append(elementary.hypot(d[:, 0], d[:, 1]) / tick, 0.0)
    rate = np.append(np.diff(np.unwrap(yaw)) / tick, 0.0) if n > 1 else np.zeros(n)
    yield from _robot(times, poses, speed, rate)
    for t, at, v, cause in zip(times.tolist(), poses.tolist(), speed.tolist(), trace.cause, strict=True):
        marks = messages.path_markers(t, np.zeros((0, 3)), cause, at, v)
        yield Stamped(t, "/lampyris/markers", messages.MARKERS, marks)
    tracks = []
    for cells, appears, one in zip(trace.tracks, trace.appears, trace.obstacle_specs, strict=True):
        when = (appears + np.arange(len(cells))) * tick
        radius = max(one.radius, 0.5 * grid.resolution)
        tracks.append(Track(when, cells.astype(np.float64), radius, math.inf))
    yield from _obstacles(scene, tuple(tracks), times)


def _robot(times: Floats, poses: Floats, speed: Floats, rate: Floats) -> Iterator[Stamped]:
    rows = zip(times.tolist(), poses.tolist(), speed.tolist(), rate.tolist(), strict=True)
    for t, at, v, w in rows:
        yield Stamped(
            t, "/tf", messages.TF, {"transforms": [messages.transform(t, messages.ODOM, messages.BASE, at)]}
        )
        yield Stamped(t, "/pose", messages.POSE, messages.pose_stamped(t, at))
        yield Stamped(t, "/odom", messages.ODOMETRY, messages.odometry(t, at, v, w))
        yield Stamped(t, "/cmd_vel", messages.TWIST_STAMPED, messages.twist_stamped(t, v, w))


def _obstacles(scene: Scene, tracks: tuple[Track, ...], times: Floats) -> Iterator[Stamped]:
    """All obstacles at each time, and at each time at which a track changes direction: interpolation gives the tracks back."""
    if not tracks:
        return
    end = float(times[-1])
    changes = np.concatenate([one.t for one in tracks])
    when = np.unique(np.concatenate((times, changes[changes <= end])))
    places = [scene.grid.to_metres(one.at(when)) for one in tracks]
    yaws = [one.heading(when) + scene.grid.origin[2] for one in tracks]
    for j, t in enumerate(when.tolist()):
        marks = [
            messages.obstacle_marker(t, k, float(places[k][j, 0]), float(places[k][j, 1]), float(yaws[k][j]), one.radius)
            for k, one in enumerate(tracks) if one.t[0] <= t
        ]  # fmt: skip
        yield Stamped(t, "/obstacles", messages.MARKERS, {"markers": marks})


def _times(duration: float, period: float) -> Floats:
    steps = max(math.ceil(duration / period - 1e-9), 1)
    return np.minimum(np.arange(steps + 1) * period, duration) if duration > 0 else np.zeros(1)


def _gears(poses: Floats, times: Floats) -> Floats:
    """1, or -1 where the robot drives against its heading."""
    if len(times) < 2:
        return np.ones(len(times))
    d = np.gradient(poses[:, :2], times, axis=0)
    ahead = d[:, 0] * elementary.cos(poses[:, 2]) + d[:, 1] * elementary.sin(poses[:, 2])
    return np.where(ahead < -1e-9, -1.0, 1.0)
