"""Traffic: what moves besides the robot. A scene holds specifications; a simulation turns them into obstacles
with tracks.

Yielding: random walkers and patrols wait for the robot; crossing and recorded obstacles do not. One of
those that runs into a robot which stands still is the outcome ``hit``, counted apart from a collision of
the robot's own making.

An obstacle is a disc, or a polygon with a heading that follows its direction of motion: during a step it turns at an even
rate, the shorter way, to the direction of the step; while it stands it keeps its heading. Before they move, recorded,
crossing and patrolling obstacles have the direction of their first step, random walkers that of the rows (to the right).
Planners and whatever keeps a distance take the disc around the polygon; contacts in drives are those of the polygon.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from lampyris._core.noun import Noun
from lampyris._core.predicates import cell_of, items_of, numbers
from lampyris._core.scalars import in_range, is_real
from lampyris.errors import LimitError, SettingError, shown
from lampyris.model.robot import Polygon, circumscribed_radius, footprint_of
from lampyris.typing import Cell, CellsLike, Floats

MAX_OBSTACLES = 10_000
COUNT_RANGE = f"a whole number, 0 to {MAX_OBSTACLES:,}"

BOUND_MARGIN = 1e-6
"""Metres by which the radius of a polygon exceeds the distance to its farthest vertex: more than what counts as contact."""


@dataclass(frozen=True, slots=True, repr=False)
class RandomWalk(Noun):
    """Obstacles that step to a uniformly chosen free neighbour or stay (method.md, "Moving obstacles").

    Parameters
    ----------
    count : greatest number on the map.
    rate : mean number that appears each tick until ``count`` are there, 0 < rate <= 1 (1 is the
        dissertation's "one an iteration"); None: all are there from the start.
    radius : metres; 0 is one cell, as in the dissertation. With a footprint it is the distance from the centre to the
        farthest vertex and a micrometre more, whatever was given.
    starts : cells (x, y) where the first of them begin, such as those drawn in a map; the others begin where
        the simulation's seed says. No more than ``count``, each once, and without a rate.
    footprint : vertices (x ahead, y to the left) of the outline in metres, in order, around the centre (0, 0); None: a disc.

    Examples
    --------
    >>> import lampyris
    >>> scene = lampyris.Scene(lampyris.load_grid("guide"), start=(1, 8), goal=(8, 2))
    >>> trace = lampyris.simulate(scene, "ad-gso", traffic=lampyris.RandomWalk(count=4), seed=1)
    >>> len(trace.tracks)
    4
    """

    count: int
    rate: float | None = None
    radius: float = 0.0
    starts: tuple[Cell, ...] = ()
    footprint: Polygon | None = None

    if TYPE_CHECKING:  # what is accepted; what is stored is declared above

        def __init__(
            self,
            count: int,
            rate: float | None = ...,
            radius: float = ...,
            starts: CellsLike = ...,
            footprint: Sequence[Sequence[float]] | None = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        object.__setattr__(self, "count", _count(self.count))
        starts = _cells("TRAFFIC_STARTS", self.starts)
        object.__setattr__(self, "starts", starts)
        if len(starts) > self.count or (starts and self.rate is not None):
            what = f"{len(starts)} starts of {self.count} walkers, rate {shown(self.rate)}"
            raise SettingError("TRAFFIC_STARTS", what, allowed="no more than the count, and no rate")
        if len(set(starts)) < len(starts):
            raise SettingError("TRAFFIC_STARTS", "a cell twice", allowed="each cell once")
        _set_shape(self)
        if self.rate is not None and not (is_real(self.rate) and 0 < self.rate <= 1):
            raise SettingError.of(
                "TRAFFIC_RATE",
                "traffic.rate",
                shown(self.rate),
                allowed="0 < rate <= 1, or None (all walkers at the start)",
            )


@dataclass(frozen=True, slots=True, repr=False)
class Patrol(Noun):
    """One obstacle that moves back and forth along waypoints by shortest paths.

    It waits where its path is occupied.

    Parameters
    ----------
    waypoints : cells (x, y), at least one; one alone stands still.
    radius, footprint : as of :class:`RandomWalk`.

    Examples
    --------
    >>> import lampyris
    >>> scene = lampyris.Scene(lampyris.load_grid("guide"), start=(1, 8), goal=(8, 2))
    >>> patrol = lampyris.Patrol([(2, 2), (8, 8)], radius=0.3)
    >>> lampyris.simulate(scene, "astar", traffic=patrol).outcome.value
    'arrived'
    """

    waypoints: tuple[Cell, ...]
    radius: float = 0.0
    footprint: Polygon | None = None

    if TYPE_CHECKING:  # what is accepted; what is stored is declared above

        def __init__(
            self,
            waypoints: CellsLike,
            radius: float = ...,
            footprint: Sequence[Sequence[float]] | None = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        _set_shape(self)
        object.__setattr__(self, "waypoints", _cells("TRAFFIC_WAYPOINTS", self.waypoints))
        if not self.waypoints:
            raise SettingError("TRAFFIC_WAYPOINTS", "no waypoint", allowed="at least one cell")


@dataclass(frozen=True, slots=True, repr=False)
class Crossing(Noun):
    """Obstacles that cross the map back and forth between two opposite sides, without yielding to the robot.

    Parameters
    ----------
    count : how many; their paths are drawn from the simulation's seed.
    radius, footprint : as of :class:`RandomWalk`.

    Examples
    --------
    >>> import lampyris
    >>> scene = lampyris.Scene(lampyris.load_grid("guide"), start=(1, 8), goal=(8, 2))
    >>> trace = lampyris.simulate(scene, "astar", traffic=lampyris.Crossing(1), seed=3)
    >>> trace.outcome.value
    'arrived'
    """

    count: int
    radius: float = 0.0
    footprint: Polygon | None = None

    if TYPE_CHECKING:  # what is accepted; what is stored is declared above

        def __init__(
            self,
            count: int,
            radius: float = ...,
            footprint: Sequence[Sequence[float]] | None = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        object.__setattr__(self, "count", _count(self.count))
        _set_shape(self)


@dataclass(frozen=True, slots=True, repr=False)
class Recorded(Noun):
    """One obstacle that replays a track independently of the others: one cell a tick, then it stays at the last.

    Parameters
    ----------
    track : cells (x, y), one a tick from tick 0, each equal or 8-adjacent to the one before.
    radius, footprint : as of :class:`RandomWalk`.
    yaw : with a footprint, its heading at each tick, radians counterclockwise in the map frame, in place of the direction
        of motion; between two ticks it turns at an even rate, the shorter way.

    Examples
    --------
    >>> import lampyris
    >>> scene = lampyris.Scene(lampyris.load_grid("guide"), start=(1, 8), goal=(8, 2))
    >>> walker = lampyris.Recorded(track=[(5, 1), (6, 1), (7, 1)])
    >>> lampyris.simulate(scene, "astar", traffic=walker).outcome.value
    'arrived'
    """

    track: tuple[Cell, ...]
    radius: float = 0.0
    footprint: Polygon | None = None
    yaw: tuple[float, ...] = ()

    if TYPE_CHECKING:  # what is accepted; what is stored is declared above

        def __init__(
            self,
            track: CellsLike,
            radius: float = ...,
            footprint: Sequence[Sequence[float]] | None = ...,
            yaw: Sequence[float] | Floats = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        _set_shape(self)
        object.__setattr__(self, "track", _cells("OBSTACLE_TRACK", self.track))
        if not self.track:
            raise SettingError("OBSTACLE_TIME", "empty track", allowed="at least one cell")
        for t, (a, b) in enumerate(zip(self.track, self.track[1:], strict=False)):
            if max(abs(a[0] - b[0]), abs(a[1] - b[1])) > 1:
                raise SettingError(
                    "OBSTACLE_SPEED", f"jumps from {a} to {b} at t = {t + 1}", allowed="one cell a tick"
                )
        object.__setattr__(self, "yaw", _yaw(self))


ObstacleSpec: TypeAlias = RandomWalk | Patrol | Crossing | Recorded


@dataclass(frozen=True, slots=True, repr=False)
class Obstacle(Noun):
    """A moving obstacle as it was in a simulation.

    Parameters
    ----------
    kind : ``random-walk``, ``patrol``, ``crossing`` or ``recorded``.
    radius : metres.
    yields : whether it waits for the robot.
    footprint : offsets (dx, dy) of the cells it covers around its own; (0, 0) alone for a small one.
    outline : vertices (x ahead, y to the left) of a polygon, metres; None: a disc.
    """

    kind: str
    radius: float
    yields: bool
    footprint: tuple[Cell, ...] = field(default=((0, 0),))
    outline: Polygon | None = None


def _count(count: Any) -> int:
    if not (isinstance(count, int | np.integer) and not isinstance(count, bool) and count >= 0):
        raise SettingError.of("TRAFFIC_COUNT", "traffic.count", shown(count), allowed=COUNT_RANGE)
    if count > MAX_OBSTACLES:
        what = f"{shown(count)} obstacles"
        raise LimitError("LIMIT", what, allowed=f"at most {MAX_OBSTACLES:,}", setting="traffic.count")
    return int(count)


def obstacle_footprint(given: object, where: str = "traffic.footprint") -> Polygon:
    """The outline of an obstacle from its vertices; see :func:`lampyris.model.robot.footprint_of`.

    Raises
    ------
    SettingError : ``TRAFFIC_FOOTPRINT``.
    """
    return footprint_of(given, where, "TRAFFIC_FOOTPRINT")


def bound_radius(polygon: Polygon) -> float:
    """The radius of the disc around an obstacle's centre that stands for its polygon, metres."""
    return circumscribed_radius(polygon) + BOUND_MARGIN


def _set_shape(one: RandomWalk | Patrol | Crossing | Recorded) -> None:
    """Check radius and footprint; a footprint determines the radius."""
    radius = one.radius
    if not in_range(radius, 0, 1e6):
        raise SettingError.of("TRAFFIC_RADIUS", "traffic.radius", shown(radius), allowed="0 to 1e6 metres")
    if one.footprint is not None:
        polygon = obstacle_footprint(one.footprint)
        object.__setattr__(one, "footprint", polygon)
        radius = bound_radius(polygon)
    object.__setattr__(one, "radius", float(radius))


def _yaw(one: Recorded) -> tuple[float, ...]:
    """The headings that are given with a track."""
    given = numbers(one.yaw, (None,))
    right = given is not None and np.isfinite(given).all() and len(given) in (0, len(one.track))
    if given is None or not right or (len(given) and one.footprint is None):
        raise SettingError(
            "OBSTACLE_YAW", shown(one.yaw), where="traffic.yaw",
            allowed="with a footprint, one finite number for each cell of the track, radians; or none",
        )  # fmt: skip
    return tuple(given.tolist())


def _cells(code: str, cells: Any) -> tuple[Cell, ...]:
    """Cells as pairs of whole numbers; nothing is rounded."""
    made = []
    for one in items_of(cells):
        cell = cell_of(one)
        if cell is None:
            raise SettingError(code, f"{shown(one)} is not a cell", allowed="two whole numbers x, y")
        made.append(cell)
    return tuple(made)
