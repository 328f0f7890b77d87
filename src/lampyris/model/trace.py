"""Trace: what happened, tick by tick."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import TYPE_CHECKING

import numpy as np

from lampyris._core.arrays import cells_of, items_of, numbers_of, whole_of
from lampyris._core.noun import Noun, Tabular
from lampyris._core.values import Value
from lampyris.model.edit import Edit
from lampyris.model.grid import Grid, frozen
from lampyris.model.path import Path
from lampyris.model.scene import Scene
from lampyris.model.settings.sensor import Sensor
from lampyris.model.traffic import Obstacle
from lampyris.typing import Cell, Cells, Floats

if TYPE_CHECKING:
    import pandas


class Outcome(StrEnum):
    """How a simulation ended. Only ``arrived`` is true.

    Examples
    --------
    >>> import lampyris
    >>> bool(lampyris.Outcome("arrived"))
    True
    >>> [outcome.value for outcome in lampyris.Outcome][:3]
    ['arrived', 'hit', 'blocked']
    """

    ARRIVED = "arrived"
    HIT = "hit"
    BLOCKED = "blocked"
    TIMEOUT = "timeout"
    NO_PATH = "no-path"
    START_OCCUPIED = "start-occupied"
    GOAL_OCCUPIED = "goal-occupied"
    COLLISION = "collision"
    STOPPED = "stopped"

    @property
    def sentence(self) -> str:
        """The sentence a person reads."""
        return _SENTENCES[self]

    def __bool__(self) -> bool:
        return self is Outcome.ARRIVED


_SENTENCES = {
    Outcome.ARRIVED: "The robot arrived at the goal.",
    Outcome.HIT: "An obstacle that does not yield ran into the robot while it stood still.",
    Outcome.BLOCKED: "The robot gave up: it made no progress for longer than it waits.",
    Outcome.TIMEOUT: "The last tick came before the robot arrived.",
    Outcome.NO_PATH: "No path: walls separate the start from the goal.",
    Outcome.START_OCCUPIED: "The start is not a free cell for this robot.",
    Outcome.GOAL_OCCUPIED: "The goal is not a free cell for this robot.",
    Outcome.COLLISION: "The robot drove into a moving obstacle.",
    Outcome.STOPPED: "The robot stopped: its data on obstacles could not be trusted.",
}


@dataclass(frozen=True, slots=True, repr=False)
class Event(Noun):
    """Something worth telling at a tick: ``appear wall opened replan wait repair gate hit arrive``."""

    tick: int
    word: str
    cell: Cell
    sentence: str = ""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Trace(Value, Tabular):
    """The result of a simulation in ticks.

    Parameters
    ----------
    scene : what was simulated.
    planner, seed : the planner, and the seed of all random draws.
    outcome : how it ended.
    robot : int32 (ticks + 1, 2); the robot's cell at each tick from 0. A waiting robot repeats its cell.
    tracks : one int32 (ticks + 1 - appears, 2) for each obstacle, from the tick it appeared.
    appears : the tick each obstacle appeared, never falling from one obstacle to the next.
    obstacle_specs : what each was.
    speed, cause, law, units : the robot's speed at each tick, what limits it, the speed law and its units.
    events : in order of time.
    replans, waits : how often.
    iterations : the planner's rounds that were driven.
    expansions : cells expanded, all plannings together.
    path : the driven path without waits; None if the robot could not start.
    detail : why it ended so, in words.
    timing : seconds; the only part that differs from run to run. ``planning_s`` is processor
        time in the planner. ``loading_s`` (loading and compiling machine code, once for a process) is a part
        of ``total_s`` and of no other.
    last_tick : the tick at which it would have ended in any case; None: not known.
    path_switches : how often a new plan left the path of the old one although its next step could be made.
    edits : the scene's edits with the cells that actually changed; edits without a cell are omitted.
    notes : deviations of the planner from the request (:attr:`lampyris.Plan.notes`), the latest about
        each setting; not compared.
    sensor : of a robot that began without the map; None: the map was known.
    seen : int32 (height, width); the tick at which each cell was first seen, -1 never. None without a sensor.
    goal_track : int32 (n, 2); the goal's cell at each tick from 0, after its end the last; None: the goal stood still.
    via, via_ticks : the scene's via points in the order of visits, and when each was reached, as far as they were.

    Examples
    --------
    >>> import lampyris
    >>> scene = lampyris.Scene(lampyris.load_grid("guide"), start=(1, 8), goal=(8, 2))
    >>> trace = lampyris.simulate(scene, "astar")
    >>> trace.outcome.value, trace.robot[-1].tolist()
    ('arrived', [8, 2])
    """

    scene: Scene
    planner: str
    seed: int
    outcome: Outcome
    robot: Cells
    tracks: tuple[Cells, ...]
    appears: tuple[int, ...]
    obstacle_specs: tuple[Obstacle, ...]
    speed: Floats
    cause: tuple[str, ...]
    law: str
    units: str
    events: tuple[Event, ...]
    replans: int
    waits: int
    iterations: int
    expansions: int
    path: Path | None
    detail: str = ""
    timing: Mapping[str, float] = field(default_factory=dict, compare=False)
    last_tick: int | None = None
    path_switches: int = 0
    edits: tuple[Edit, ...] = ()
    notes: tuple[str, ...] = field(default=(), compare=False)
    sensor: Sensor | None = None
    seen: Cells | None = None
    goal_track: Cells | None = None
    via: tuple[Cell, ...] = ()
    via_ticks: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "robot", cells_of("trace", "robot", self.robot))
        object.__setattr__(self, "speed", numbers_of("trace", "speed", self.speed, (None,), finite=False))
        tracks = items_of("trace", "tracks", self.tracks)
        object.__setattr__(self, "tracks", tuple(cells_of("trace", "tracks", t) for t in tracks))
        if self.seen is not None:
            seen = whole_of("trace", "seen", self.seen, self.scene.grid.blocked.shape).astype(np.int32)
            object.__setattr__(self, "seen", frozen(seen))
        if self.goal_track is not None:
            object.__setattr__(self, "goal_track", cells_of("trace", "goal_track", self.goal_track))

    def _brief(self) -> str:
        seen = f"{len(self.tracks)} obstacles, {self.replans} replans"
        return f"<Trace {self.outcome} by {self.planner}: {self.ticks} ticks, {seen}>"

    def to_pandas(self) -> pandas.DataFrame:
        """The robot's run as a table, a row a tick: metres of the map frame (y up) and radians.

        Columns ``x_m``, ``y_m``, ``yaw``, ``v`` (in :attr:`units`), ``tick``, ``cause``, ``x``, ``y`` (the cell) and
        ``event``, the words of the tick's events joined by ``+``.

        Raises
        ------
        UsageError : ``PANDAS``: pandas is not installed.
        """
        return self._table()

    @property
    def ticks(self) -> int:
        """How many ticks passed."""
        return len(self.robot) - 1

    @property
    def arrived(self) -> bool:
        """Whether the robot stands on the goal at the end."""
        return bool(self.outcome)

    @property
    def hits(self) -> int:
        """1 if an obstacle that does not yield ran into the standing robot."""
        return int(self.outcome is Outcome.HIT)

    @property
    def collisions(self) -> int:
        """Collisions of the robot's own making; the referee holds this at 0."""
        return int(self.outcome is Outcome.COLLISION)

    @property
    def cost(self) -> float:
        """Cost of the path driven, in cells."""
        return 0.0 if self.path is None else self.path.cost

    def goal_at(self, tick: int) -> Cell:
        """The goal's cell at a tick."""
        if self.goal_track is None:
            return self.scene.goal
        x, y = self.goal_track[min(tick, len(self.goal_track) - 1)].tolist()
        return x, y

    def known_at(self, tick: int) -> Grid:
        """The map as the robot knew it at the end of a tick; what it had not seen is ``unknown`` and blocked, though the
        robot took it for free. With a known map the map itself, whatever edits did to it.
        """
        grid = self.scene.grid
        if self.seen is None:
            return grid
        unseen = (self.seen < 0) | (self.seen > tick)
        return replace(grid, blocked=grid.blocked | unseen, unknown=unseen, terrain=None)

    def obstacles_at(self, tick: int) -> list[Cell]:
        """The cell of each obstacle that is there at a tick, in order of appearance."""
        return [
            (int(track[tick - t0, 0]), int(track[tick - t0, 1]))
            for track, t0 in zip(self.tracks, self.appears, strict=True)
            if t0 <= tick
        ]

    @property
    def sentence(self) -> str:
        """What a person should read."""
        return self.detail or self.outcome.sentence
