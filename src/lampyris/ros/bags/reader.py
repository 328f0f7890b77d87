"""Bags of ROS 2 read: topics, and from them maps, paths, poses and tracks of obstacles."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from lampyris.errors import FileError, UsageError, did_you_mean, file_name, plural
from lampyris.io.tracks.timed_tracks import TimedTrack
from lampyris.model.grid import Grid
from lampyris.ros import messages
from lampyris.ros.messages import Fields, pose_of, seconds
from lampyris.ros.occupancy import grid_of, updated
from lampyris.ros.stores import USUAL, plain, rosbags_module, typestore
from lampyris.ros.transforms import Transforms, compose
from lampyris.typing import Floats

SUFFIXES = (".mcap", ".db3")
_GRIDS, _PATHS = (messages.OCCUPANCY_GRID,), (messages.PATH,)
_POSES = (messages.ODOMETRY, messages.POSE, messages.POSE_ESTIMATE)
_OBSTACLES = (messages.MARKERS, messages.ODOMETRY, messages.POSE, messages.POSE_ESTIMATE, messages.POSE_ARRAY)
_SOLID = (messages.CUBE, messages.SPHERE, messages.CYLINDER)


class BagTopic(NamedTuple):
    """A topic of a bag: its name, the type and the number of its messages."""

    name: str
    kind: str
    messages: int


@dataclass(frozen=True, slots=True)
class BagPath:
    """A nav_msgs/Path: seconds from the bag's start, the frame, and poses, float64 (n, 3)."""

    t: float
    frame: str
    poses: Floats


@dataclass(frozen=True, slots=True)
class BagTrack:
    """One obstacle of a bag: its name (topic, namespace and id) and its track in the map frame."""

    name: str
    track: TimedTrack


class Bag:
    """A bag of ROS 2 that is open for reading; see :func:`open_bag`.

    Attributes
    ----------
    topics : in the bag's order.
    start, duration : seconds: of the first message since the epoch, and from it to the last.
    """

    def __init__(self, path: Path, reader: Any, store: Any) -> None:
        self._path, self._reader, self._store = path, reader, store
        names: dict[tuple[str, str], int] = {}
        for one in reader.connections:
            key = (one.topic, one.msgtype)
            names[key] = names.get(key, 0) + one.msgcount
        self.topics = tuple(BagTopic(name, kind, count) for (name, kind), count in names.items())
        self._start = reader.start_time if reader.message_count else 0
        self.start = 1e-9 * self._start
        self.duration = 1e-9 * max(reader.duration - 1, 0)

    def read(self, *topics: str) -> Iterator[tuple[str, str, float, Fields]]:
        """BagTopic, type, seconds from the start, and fields of each message of some topics (none: all), in order of time.

        Raises
        ------
        FileError : ``BAG``: a message that is not of its type.
        """
        chosen = [one for one in self._reader.connections if not topics or one.topic in topics]
        for connection, t, data in self._raw(chosen) if chosen else ():
            try:
                held = plain(self._store.deserialize_cdr(data, connection.msgtype))
            except Exception as fault:
                what = f"a message of {connection.topic} is no {connection.msgtype}: {fault}"
                raise FileError("BAG", what, where=str(self._path)) from None
            yield connection.topic, connection.msgtype, 1e-9 * (t - self._start), held

    def _raw(self, chosen: list[Any]) -> Iterator[tuple[Any, int, bytes]]:
        """What the bag holds, undecoded; a place that cannot be read is a damaged bag."""
        count = 0
        try:
            for one in self._reader.messages(chosen):
                count += 1
                yield one
        except FileError:
            raise
        except Exception as fault:
            what = f"cannot be read after {plural(count, 'message')}: {_said(fault)}"
            raise FileError("BAG", what, where=str(self._path), **_wanted(self._path)) from None

    def topic(self, name: str | None, kinds: tuple[str, ...], usual: tuple[str, ...] = ()) -> BagTopic:
        """The topic of that name; without one the usual one, or the only one of these types.

        Raises
        ------
        UsageError : ``TOPIC``: there is none, or more than one.
        """
        fit = [one for one in self.topics if one.kind in kinds]
        if name is not None:
            found = next((one for one in fit if one.name == name), None)
        else:
            found = next((one for one in fit if one.name in usual), fit[0] if len(fit) == 1 else None)
        if found is None:
            names = [one.name for one in fit]
            short = " or ".join(kind.rpartition("/")[2] for kind in kinds)
            what = f"no topic {name}" if name is not None else f"{len(fit)} topics"
            raise UsageError(
                "TOPIC", f"{what} of type {short}", where=str(self._path), allowed=", ".join(names) or "none here",
                todo=did_you_mean(name, names) if name is not None else "name the topic" if names else "",
            )  # fmt: skip
        return found

    def grid(self, topic: str | None = None, *, costs: bool = False) -> Grid:
        """The last map of a topic of OccupancyGrid (``/map``), with the updates of ``TOPIC_updates``.

        Parameters
        ----------
        topic : None: ``/map``, or the only one.
        costs : whether its values are costs, as Nav2 publishes a costmap, or occupancies.

        Raises
        ------
        UsageError : ``TOPIC``.
        InputError : ``OCCUPANCY``: no map in that topic, or one that is none.
        """
        found = self.topic(topic, _GRIDS, ("/map",))
        held: Fields | None = None
        for name, _, _, fields in self.read(found.name, f"{found.name}_updates"):
            if name == found.name:
                held = fields
            elif held is not None:
                held = updated(held, fields)
        if held is None:
            raise FileError("BAG", f"{found.name} has no message", where=str(self._path))
        return grid_of(held, costs=costs, name=found.name.strip("/"))

    def paths(self, topic: str | None = None) -> tuple[BagPath, ...]:
        """The paths of a topic of nav_msgs/Path (``/plan``), in order.

        Raises
        ------
        UsageError : ``TOPIC``.
        """
        found = self.topic(topic, _PATHS, ("/plan",))
        made = []
        for _, _, t, fields in self.read(found.name):
            poses = np.array([pose_of(one["pose"]) for one in fields["poses"]]).reshape(-1, 3)
            made.append(BagPath(t, str(fields["header"]["frame_id"]), poses))
        return tuple(made)

    def poses(self, topic: str | None = None, frame: str = messages.MAP) -> Floats:
        """Poses of the robot: t (seconds from the start), x, y, yaw in the map frame, float64 (n, 4).

        Parameters
        ----------
        topic : of PoseStamped, PoseWithCovarianceStamped or Odometry; None: ``/pose``, ``/amcl_pose`` or ``/odom``. ``/tf``:
            the frame ``base_link`` by the transforms.
        frame : in which; the bag's transforms lead there.

        Raises
        ------
        UsageError : ``TOPIC``.
        FileError : ``BAG``: no transform leads from the frame of the messages to this one.
        """
        known = self.transforms()
        rows: list[tuple[float, float, float, float]] = []
        if topic == "/tf":
            for _, _, t, fields in self.read("/tf"):
                if any(
                    str(one["child_frame_id"]).lstrip("/") == messages.BASE for one in fields["transforms"]
                ):
                    when = next(
                        seconds(one["header"]["stamp"]) for one in fields["transforms"]
                        if str(one["child_frame_id"]).lstrip("/") == messages.BASE
                    )  # fmt: skip
                    at = known.between(messages.BASE, frame, when)
                    if at is not None:
                        rows.append((t, *at))
            return np.array(rows).reshape(-1, 4)
        usual = next(
            (
                n
                for n in ("/pose", "/amcl_pose", "/odom")
                if any(o.name == n and o.kind in _POSES for o in self.topics)
            ),
            "",
        )
        found = self.topic(topic, _POSES, (usual,))
        for _, _, t, fields in self.read(found.name):
            place = self._in(known, fields["header"], frame)
            rows.append((t, *compose(place, pose_of(_pose_in(fields["pose"])))))
        return np.array(rows).reshape(-1, 4)

    def tracks(self, topic: str | None = None, *, radius: float | None = None) -> tuple[BagTrack, ...]:
        """The tracks of obstacles in the map frame, times from the bag's start.

        Of a MarkerArray each solid marker (cylinder, sphere, cube) is one obstacle by its namespace and id, its radius
        half its size; of a PoseArray each place in it; any other topic is one obstacle. Places in other frames, such as
        that of the robot which saw it, are led to the map by the bag's transforms at the time of the message.

        Parameters
        ----------
        topic : None: ``/obstacles``, or the only topic of these types.
        radius : metres; None: that of the markers, and none for other topics.

        Raises
        ------
        UsageError : ``TOPIC``.
        FileError : ``BAG``: no transform leads to the map.
        """
        kinds = _OBSTACLES if topic is not None else (messages.MARKERS, messages.POSE_ARRAY)
        found = self.topic(topic, kinds, ("/obstacles",))
        known = self.transforms()
        rows: dict[str, list[tuple[float, float, float]]] = {}
        wide: dict[str, float] = {}
        for _, kind, t, fields in self.read(found.name):
            for name, head, at, size in _seen(kind, fields, found.name):
                stamp = seconds(head["stamp"])
                when = stamp - self.start if stamp >= self.start > 0 or self.start == 0 else t
                x, y, _ = compose(self._in(known, head, messages.MAP), at)
                row = rows.setdefault(name, [])
                if not row or when > row[-1][0]:
                    row.append((max(when, 0.0), x, y))
                wide[name] = max(size, wide.get(name, 0.0))
        made = []
        for name, row in rows.items():
            array = np.array(row)
            given = radius if radius is not None else wide[name] or None
            made.append(BagTrack(name, TimedTrack(array[:, 0].copy(), array[:, 1:].copy(), given)))
        return tuple(made)

    def transforms(self) -> Transforms:
        """What ``/tf_static`` and ``/tf`` of the bag say."""
        known = Transforms()
        for name, _, _, fields in self.read("/tf_static", "/tf"):
            known.add(fields, static=name == "/tf_static")
        return known

    def _in(self, known: Transforms, head: Fields, frame: str) -> tuple[float, float, float]:
        """The pose of a message's frame in another one at the message's time."""
        of = str(head["frame_id"]).lstrip("/")
        if of in ("", frame):
            return 0.0, 0.0, 0.0
        at = known.between(of, frame, seconds(head["stamp"]))
        if at is None:
            raise FileError(
                "BAG", f"no transform leads from frame {of} to {frame}", where=str(self._path),
                todo="record /tf and /tf_static too",
            )  # fmt: skip
        return at


def _pose_in(pose: Fields) -> Fields:
    """The pose within PoseWithCovariance, or itself."""
    inner: Fields = pose.get("pose", pose)
    return inner


def _seen(
    kind: str, fields: Fields, topic: str
) -> Iterator[tuple[str, Fields, tuple[float, float, float], float]]:
    """Name, header, pose and radius of each obstacle of a message."""
    if kind == messages.MARKERS:
        for one in fields["markers"]:
            if one["action"] == messages.ADD and one["type"] in _SOLID:
                size = 0.5 * max(float(one["scale"]["x"]), float(one["scale"]["y"]))
                yield (
                    f"{one['ns']}-{one['id']}" if one["ns"] else f"{one['id']}",
                    one["header"],
                    pose_of(one["pose"]),
                    size,
                )
    elif kind == messages.POSE_ARRAY:
        for k, pose in enumerate(fields["poses"]):
            yield f"{k}", fields["header"], pose_of(pose), 0.0
    else:
        yield topic.strip("/").replace("/", "-"), fields["header"], pose_of(_pose_in(fields["pose"])), 0.0


@contextmanager
def open_bag(path: str | os.PathLike[str]) -> Iterator[Bag]:
    """Open a bag of ROS 2: a folder with ``metadata.yaml``, one ``.mcap`` or one ``.db3``.

    Raises
    ------
    UsageError : ``EXTRA``: rosbags is not installed (``pip install 'lampyris[ros]'``).
    FileError : ``FILE_MISSING``; ``BAG``: not a bag, or a damaged one.
    """
    place = Path(file_name("path", path))
    rosbag2 = rosbags_module("rosbags.rosbag2")
    if not place.exists():
        raise FileError("FILE_MISSING", "no such file", where=repr(str(place)))
    if place.is_file() and place.suffix.lower() not in SUFFIXES:
        raise FileError(
            "BAG", "not a bag", where=str(place), allowed="a folder with metadata.yaml, .mcap or .db3"
        )
    reader = None
    try:
        try:
            reader = rosbag2.Reader(place)
            reader.open()
            store = _types(reader)
        except Exception as fault:
            raise FileError(
                "BAG", f"cannot be read as a bag: {_said(fault)}", where=str(place), **_wanted(place)
            ) from None
        yield Bag(place, reader, store)
    finally:
        with suppress(Exception):
            if reader is not None:
                reader.close()


def _said(fault: Exception) -> str:
    """The first line of a library's fault, without its full stop."""
    return (str(fault).splitlines() or [type(fault).__name__])[0].rstrip(".")


def _wanted(place: Path) -> dict[str, str]:
    """What is allowed in place of a bag that cannot be read, and what recovers one whose recorder was killed."""
    if place.is_dir():
        return {
            "allowed": "a folder with metadata.yaml and the files that it names",
            "todo": "`ros2 bag reindex` writes metadata.yaml again",
        }
    if place.suffix.lower() == ".mcap":
        return {
            "allowed": "an MCAP file that was written to its end",
            "todo": "`mcap recover` keeps what can be read of one whose recorder was killed",
        }
    return {
        "allowed": "an SQLite file of rosbag2",
        "todo": "`sqlite3 FILE .recover` keeps what can be read of a damaged one",
    }


def _types(reader: Any) -> Any:
    """The types of a bag: those that it defines itself, else those of the usual distribution."""
    types, kinds = rosbags_module("rosbags.typesys"), rosbags_module("rosbags.interfaces")
    found: dict[str, Any] = {}
    for one in reader.connections:
        if one.msgdef.format == kinds.MessageDefinitionFormat.MSG:
            found.update(types.get_types_from_msg(one.msgdef.data, one.msgtype))
    usual = typestore(USUAL)
    if all(usual.fielddefs.get(kind) == fields for kind, fields in found.items()):
        return usual
    store = types.get_typestore(types.Stores.EMPTY)
    store.register({**usual.fielddefs, **found})
    return store
