"""Design: what a study runs. It unfolds into jobs, each with a key that says all that decides its result.

Every planner and every speed law meets the same worlds: the seed of a world comes from the map, the query,
the traffic and the number of the seed, never from who plans. A job is plain data: it can cross to another
process, or another machine, as JSON.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from types import MappingProxyType
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lampyris import __version__
from lampyris._core.defaults import TRACKS, UNSEEN_COST
from lampyris.model.grid import Grid
from lampyris.model.path import Pose
from lampyris.model.robot import Polygon
from lampyris.model.settings.sensor import FULL_TURN, Sensor
from lampyris.typing import Cell

RESULTS = 1
"""Raised whenever the same job would give another result than before: part of every key."""

Kind: TypeAlias = Literal["plan", "simulate", "drive", "fleet"]
"""What a run is: a plan with its speeds, a simulation in ticks, a drive in continuous time, or a plan for many robots."""
ROBOTS = "robots"
"""Kind of the traffic of a study of fleets, in which each traffic case is a number of robots."""

Tracks: TypeAlias = Literal["replayed", "live"]
"""``replayed``: where obstacles are is drawn once, without the robot, and is the same for all planners no matter
what happens. ``live``: the draws are the same, but obstacles yield to the robot (the dissertation's rule), so
that from the first time that one waits for it their tracks are its own."""


SENSOR_LABELS = ("sensor_range", "field_of_view", "unseen_cost")
"""Labels of the jobs of a study in which some robot has a sensor."""


@dataclass(frozen=True, slots=True)
class Config:
    """A planner or a speed law with all its settings, none left to a default, and what a table calls it.

    ``origin`` is the distribution and version that a third-party planner comes from; empty for our own. ``sensor``
    is that of a robot that begins without the map; None: the planner knows the map.
    """

    name: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    label: str = ""
    origin: str = ""
    sensor: Sensor | None = None

    @property
    def called(self) -> str:
        """What a table calls it."""
        name = self.label or self.name
        return name if self.sensor is None else f"{name} ({sensor_words(self.sensor)})"

    @property
    def starts_exact(self) -> bool:
        """Whether it is a swarm planner of ours that starts from the exact shortest path."""
        return not self.origin and self.settings.get("seeded") is True


def sensor_words(sensor: Sensor) -> str:
    """What a table calls a sensor: ``sensor 6 m, 90 deg, unseen 2``."""
    angle = "" if sensor.field_of_view >= FULL_TURN else f", {math.degrees(sensor.field_of_view):.4g} deg"
    cost = "" if sensor.unseen_cost == UNSEEN_COST else f", unseen {sensor.unseen_cost:g}"
    return f"sensor {sensor.range_m:g} m{angle}{cost}"


@dataclass(frozen=True, slots=True)
class StudyTraffic:
    """What moves in a world.

    Parameters
    ----------
    kind : ``none``, ``random-walk``, ``patrol``, ``crossing`` or ``mixed``; in a study of fleets ``robots``.
    count : how many.
    rate : chance a tick that a random walker appears; None: all from the start. Of ``robots``: chance that a move is delayed;
        None: the study says.
    radius : metres; of polygons that of the disc around them. Of ``robots``: 0: the study says.
    tracks : see :data:`Tracks`.
    footprint : vertices (x ahead, y to the left) of the outline of each, metres; None: discs.
    """

    kind: str = "none"
    count: int = 0
    rate: float | None = None
    radius: float = 0.0
    tracks: Tracks = TRACKS
    footprint: Polygon | None = None

    @property
    def label(self) -> str:
        """What a table calls it."""
        if self.kind == "none" or not self.count:
            return "none"
        if self.kind == ROBOTS:
            more = f" of radius {self.radius:.6g} m" if self.radius else ""
            return f"{self.count} robots{more}{'' if self.rate is None else f', {self.rate:.6g} of moves delayed'}"
        more = "" if self.rate is None else f", rate {self.rate:g}"
        more += "" if not self.radius else f", radius {self.radius:.6g} m"
        more += "" if self.footprint is None else f", {len(self.footprint)} vertices"
        return f"{self.count} {self.kind}{more}{' (live)' if self.tracks == 'live' else ''}"

    @property
    def plain(self) -> dict[str, Any]:
        """As JSON holds it."""
        outline = {} if self.footprint is None else {"footprint": [list(vertex) for vertex in self.footprint]}
        return {
            "kind": self.kind, "count": self.count, "rate": self.rate, "radius": self.radius,
            "tracks": self.tracks, **outline,
        }  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class StudyMap:
    """A map of a study.

    Parameters
    ----------
    name : what tables call it; one name, one map within a study.
    grid : its cells.
    hash : of its cells (:func:`lampyris.io.maps.map_hash.map_hash`).
    """

    name: str
    grid: Grid
    hash: str


@dataclass(frozen=True, slots=True, eq=False)
class FleetQuery:
    """The robots of a fleet, in their order: a fleet of n robots is the first n.

    Parameters
    ----------
    name : what tables call it.
    ends : start and goal of each, int32 (robots, 4): x, y, x, y.
    hash : of the ends.
    """

    name: str
    ends: NDArray[np.int32]
    hash: str


def fleet_query(name: str, ends: Any) -> FleetQuery:
    """The robots with these ends, (robots, 4)."""
    made = np.ascontiguousarray(ends, dtype="<i4")
    made.flags.writeable = False
    return FleetQuery(name, made, hashlib.sha256(made.tobytes()).hexdigest())


@dataclass(frozen=True, slots=True, eq=False)
class World:
    """A query on a map.

    Parameters
    ----------
    ground : the map.
    start, goal : cells.
    published : the optimal length that a benchmark states, if one does.
    start_pose, goal_pose : x, y (metres of the map frame) and yaw (radians) for planners of poses, in these cells;
        None: any heading at the centre of the cell.
    fleet : the robots, in a study of fleets; ``start`` and ``goal`` are those of the first.
    goal_track : the goal's cell at each tick, of a goal that moves; after the last it stays.
    """

    ground: StudyMap
    start: Cell
    goal: Cell
    published: float | None = None
    start_pose: Pose | None = None
    goal_pose: Pose | None = None
    fleet: FleetQuery | None = None
    goal_track: tuple[Cell, ...] | None = None

    @property
    def identity(self) -> tuple[Any, ...]:
        """What tells it from others on its map."""
        robots = None if self.fleet is None else self.fleet.hash
        return self.start, self.goal, self.start_pose, self.goal_pose, robots, self.goal_track

    @property
    def query(self) -> str:
        """What a table calls the query."""
        if self.fleet is not None:
            return self.fleet.name
        words = f"{_end_words(self.start, self.start_pose)} to {_end_words(self.goal, self.goal_pose)}"
        if self.goal_track is None:
            return words
        mark = hashlib.sha256(canonical(self.goal_track)).hexdigest()[:6]
        return f"{words}, which moves for {len(self.goal_track) - 1} ticks ({mark})"

    @property
    def poses(self) -> dict[str, list[float]]:
        """The poses that are given, by name, as JSON holds them, with the origin of their map; empty where there are none.

        The hash of a map is that of its cells, which says nothing of where metres are.
        """
        given = {"start_pose": self.start_pose, "goal_pose": self.goal_pose}
        poses = {name: list(pose) for name, pose in given.items() if pose is not None}
        return {**poses, "origin": list(self.ground.grid.origin)} if poses else {}


def _end_words(cell: Cell, pose: Pose | None) -> str:
    """``(8, 0)``, or ``(4.25 m, 3.75 m, 90 deg)`` for a pose."""
    if pose is None:
        return f"({cell[0]}, {cell[1]})"
    return f"({pose[0]:.6g} m, {pose[1]:.6g} m, {math.degrees(pose[2]):.4g} deg)"


@dataclass(frozen=True, slots=True, eq=False)
class Study:
    """A whole study: ``worlds x traffic_cases x seeds x planners x laws`` jobs, in that order.

    In a study of fleets a world is a fleet, a traffic case the number of its robots that are there, and there is one law,
    which says nothing.

    Parameters
    ----------
    name : what it is called.
    kind : of its runs.
    worlds, planners, laws, traffic_cases : see there; at least one of each.
    seeds : numbers of the seeds, each once.
    moves : the step set's name.
    robot : every setting of :class:`lampyris.model.robot.Robot`.
    expansions : budget of one call of a planner; None: no limit.
    seconds : budget of one run (CPU). A study with it is marked: its results depend on the machine.
    ticks, patience : of simulations; None: their defaults.
    drive : settings of drives (:class:`lampyris.model.settings.drive.DriveSettings`), complete; empty otherwise. Of fleets that
        drive: ``execute`` (settings and delays), of lifelong ones ``lifelong`` (ticks and window).
    root : seed of the study.
    memory : whether the peak of memory is measured, in a second run of each job.
    about : what it asks, for people.
    notes : sentences for a person on what of its maps is left out; not kept in a store.

    Examples
    --------
    >>> import lampyris
    >>> from pathlib import Path
    >>> _ = Path("s.yaml").write_text("{version: 1, maps: [{bundled: guide}], planners: [astar, gso]}")
    >>> study = lampyris.load_study("s.yaml")
    >>> [planner.name for planner in study.planners]
    ['astar', 'gso']
    """

    name: str
    kind: Kind
    worlds: tuple[World, ...]
    planners: tuple[Config, ...]
    laws: tuple[Config, ...]
    traffic_cases: tuple[StudyTraffic, ...] = (StudyTraffic(),)
    seeds: tuple[int, ...] = (0,)
    moves: str = "octile"
    robot: Mapping[str, Any] = field(default_factory=dict)
    expansions: int | None = None
    seconds: float | None = None
    ticks: int | None = None
    patience: int | None = None
    drive: Mapping[str, Any] = field(default_factory=dict)
    root: int = 0
    memory: bool = False
    about: str = ""
    notes: tuple[str, ...] = field(default=(), compare=False)

    def __len__(self) -> int:
        return (
            len(self.worlds) * len(self.traffic_cases) * len(self.seeds) * len(self.planners) * len(self.laws)
        )

    @property
    def senses(self) -> bool:
        """Whether some robot has a sensor in place of the map."""
        return any(planner.sensor is not None for planner in self.planners)

    @property
    def grounds(self) -> Mapping[str, StudyMap]:
        """Its maps by hash."""
        return {world.ground.hash: world.ground for world in self.worlds}

    @property
    def fleets(self) -> Mapping[str, FleetQuery]:
        """Its fleets by hash; none but in a study of fleets."""
        return {world.fleet.hash: world.fleet for world in self.worlds if world.fleet is not None}

    def jobs(self) -> Iterator[Job]:
        """Every job, in the order that its index says."""
        index = 0
        for world in self.worlds:
            for traffic in self.traffic_cases:
                for number in self.seeds:
                    seed = world_seed(self.root, world, traffic, number)
                    for planner in self.planners:
                        for law in self.laws:
                            made = _job if world.fleet is None else _fleet_job
                            yield made(self, index, world, traffic, number, seed, planner, law)
                            index += 1


@dataclass(frozen=True, slots=True)
class Job:
    """One run.

    Parameters
    ----------
    index : its place in the study.
    key : SHA-256 of the canonical JSON of ``plain``, in hex: equal keys, equal results.
    plain : all that decides the result, as JSON holds it. ``map`` is the hash of the map's cells.
    labels : what tables group by, and the published length. Decides nothing.
    """

    index: int
    key: str
    plain: Mapping[str, Any]
    labels: Mapping[str, Any]


def world_seed(root: int, world: World, traffic: StudyTraffic, number: int) -> int:
    """The seed of everything that is drawn in a world, 0 to 2^63 - 1: the same for every planner.

    Live and replayed traffic is drawn alike: they begin in the same places.
    """
    drawn = {**traffic.plain, "tracks": "live"}
    if world.fleet is not None:  # the same draws whatever the robots' size and delays
        drawn |= {"radius": 0.0, "rate": None}
    poses: list[Any] = [world.poses] if world.poses else []
    poses += [] if world.fleet is None else [world.fleet.hash]
    poses += [] if world.goal_track is None else [world.goal_track]
    identity = canonical([root, world.ground.hash, world.start, world.goal, *poses, drawn, number])
    return int.from_bytes(hashlib.sha256(identity).digest()[:8], "big") >> 1


def canonical(value: Any) -> bytes:
    """JSON with one spelling: keys sorted, no spaces, every digit of a number, nothing that is not finite."""
    return json.dumps(
        value, sort_keys=True, separators=(",", ":"), allow_nan=False, ensure_ascii=True, default=_plain
    ).encode("ascii")


def _plain(value: Any) -> Any:
    """A mapping that is not a dict; nothing else is guessed."""
    if isinstance(value, Mapping):
        return dict(value)
    raise TypeError(f"{type(value).__name__} is not plain data")


def _job(
    study: Study,
    index: int,
    world: World,
    traffic: StudyTraffic,
    number: int,
    seed: int,
    planner: Config,
    law: Config,
) -> Job:
    """One job of a study."""
    plain = {
        "version": [__version__, RESULTS],
        "kind": study.kind,
        "map": world.ground.hash,
        "resolution": world.ground.grid.resolution,
        "start": list(world.start),
        "goal": list(world.goal),
        **world.poses,
        "moves": study.moves,
        "robot": dict(study.robot),
        "traffic": traffic.plain,
        "seed": seed,
        "planner": {"name": planner.name, "settings": dict(planner.settings), "origin": planner.origin},
        "law": {"name": law.name, "settings": dict(law.settings)},
        "budget": {"expansions": study.expansions, "seconds": study.seconds},
        "ticks": study.ticks,
        "patience": study.patience,
        "drive": dict(study.drive),
        **({} if planner.sensor is None else {"sensor": asdict(planner.sensor)}),
        **({} if world.goal_track is None else {"goal_track": [list(cell) for cell in world.goal_track]}),
    }
    labels = {
        "map": world.ground.name,
        "query": world.query,
        "traffic": traffic.label,
        "seed": number,
        "planner": planner.called,
        "law": law.called,
        "published": world.published,
    }
    if study.senses:
        labels |= sensor_labels(planner.sensor)
    key = hashlib.sha256(canonical(plain)).hexdigest()
    return Job(index, key, MappingProxyType(plain), MappingProxyType(labels))


def sensor_labels(sensor: Sensor | None) -> dict[str, float | None]:
    """The columns of a study with sensors: range in metres, degrees and price; None where the map is known."""
    if sensor is None:
        return dict.fromkeys(SENSOR_LABELS)
    values = (sensor.range_m, round(math.degrees(sensor.field_of_view), 9), sensor.unseen_cost)
    return dict(zip(SENSOR_LABELS, values, strict=True))


def _fleet_job(
    study: Study,
    index: int,
    world: World,
    traffic: StudyTraffic,
    number: int,
    seed: int,
    planner: Config,
    law: Config,
) -> Job:
    """One job of a study of fleets."""
    assert world.fleet is not None
    robot, drive = dict(study.robot), {key: dict(table) for key, table in study.drive.items()}
    if traffic.radius:
        robot["radius"] = traffic.radius
    if traffic.rate is not None:
        drive["execute"]["delays"] = {**drive["execute"]["delays"], "probability": traffic.rate}
    plain = {
        "version": [__version__, RESULTS],
        "kind": study.kind,
        "map": world.ground.hash,
        "resolution": world.ground.grid.resolution,
        "fleet": world.fleet.hash,
        "robots": traffic.count,
        "moves": study.moves,
        "robot": robot,
        "seed": seed,
        "planner": {"name": planner.name, "settings": dict(planner.settings), "origin": planner.origin},
        "budget": {"expansions": study.expansions, "seconds": study.seconds},
        **drive,
    }
    labels = {
        "map": world.ground.name,
        "query": world.query,
        "robots": traffic.count,
        "radius": robot["radius"],
        "delays": drive["execute"]["delays"]["probability"] if "execute" in drive else None,
        "seed": number,
        "planner": planner.called,
        "law": law.called,
    }
    key = hashlib.sha256(canonical(plain)).hexdigest()
    return Job(index, key, MappingProxyType(plain), MappingProxyType(labels))
