"""Drive: what happened in continuous time, the robot between cells, with real accelerations."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lampyris._core import elementary
from lampyris._core.arrays import items_of, numbers_of, whole_of
from lampyris._core.noun import Noun, Tabular
from lampyris._core.values import Value
from lampyris.errors import SettingError
from lampyris.model.curve import Curve, PoseCurve
from lampyris.model.grid import frozen
from lampyris.model.obstacles import Track
from lampyris.model.profile import reason
from lampyris.model.scene import Scene
from lampyris.model.settings.sensor import Sensor
from lampyris.model.settings.steering import BRAKING, EXACT
from lampyris.model.trace import Outcome
from lampyris.model.traffic import Obstacle
from lampyris.typing import Cell, Cells, Floats, Points

if TYPE_CHECKING:
    import pandas

AT_GOAL = 1e-6
"""Cells along either axis within which a robot that stands is at its goal: so says the simulation, and so
says the referee."""


@dataclass(frozen=True, slots=True, repr=False)
class Moment(Noun):
    """Something worth telling: ``appear replan wait hit contact fault stop arrive``.

    Parameters
    ----------
    t : seconds.
    word : what.
    xy : where, cells.
    sentence : in words.
    obstacle : which obstacle; -1: none.
    """

    t: float
    word: str
    xy: tuple[float, float]
    sentence: str = ""
    obstacle: int = -1


AT_PLACE = 0.02
"""Cells before a place of a timetable at which a robot counts as there: it may wait so far before the place."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class PlannedTimes(Value):
    """When a plan wants the robot to be where on a curve.

    Parameters
    ----------
    s : float64 (n,): metres along the curve, rising.
    reach, leave : float64 (n,): seconds from the start of the drive at which it reaches each place and leaves it, rising.

    Raises
    ------
    SettingError : ``ARRAY``: arrays of unequal lengths, or no place; places or times that fall.
    """

    s: Floats
    reach: Floats
    leave: Floats

    def __post_init__(self) -> None:
        object.__setattr__(self, "s", numbers_of("timetable", "s", self.s, (None,)))
        for name in ("reach", "leave"):
            checked = numbers_of("timetable", name, getattr(self, name), (len(self.s),))
            object.__setattr__(self, name, checked)
        times = np.column_stack((self.reach, self.leave)).ravel()
        if not len(times) or (np.diff(self.s) < 0).any() or (np.diff(times) < 0).any():
            raise SettingError(
                "ARRAY",
                f"{len(self.s)} places",
                where="timetable",
                allowed="one or more places, and times, that rise",
            )

    def farthest(self, t: Floats) -> Floats:
        """How far the robot may be at some times without being early, metres."""
        times = np.column_stack((self.reach, self.leave)).ravel()
        return elementary.interp(t, times, np.repeat(self.s, 2))

    def times(self, s: Floats) -> Floats:
        """When the robot is to leave some places, seconds; before the first place and after the last one, as there."""
        s = np.clip(np.atleast_1d(np.asarray(s, dtype=np.float64)), self.s[0], self.s[-1])
        k = np.clip(np.searchsorted(self.s, s, side="right") - 1, 0, len(self.s) - 1)
        after = np.minimum(k + 1, len(self.s) - 1)
        length = self.s[after] - self.s[k]
        share = np.where(length > 0, (s - self.s[k]) / np.where(length > 0, length, 1.0), 0.0)
        planned: Floats = self.leave[k] + share * (self.reach[after] - self.leave[k])
        return planned


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Drive(Value, Tabular):
    """The result of a simulation in continuous time.

    The robot's motion is a list of segments: segment k begins at ``t[k]`` on curve ``leg[k]`` at distance
    ``s[k]`` with speed ``v[k]`` and has the constant acceleration ``a[k]`` until ``t[k + 1]``; the last entry
    is the end (a = 0). Where the leg changes the robot stands still.

    Parameters
    ----------
    scene : what was simulated.
    planner, law, seed : the planner, the speed law, and the seed of all random draws.
    outcome : how it ended.
    curves : the paths followed, one after the other.
    t, s, v, a : float64 (n,); seconds, metres, m/s, m/s2.
    leg : int64 (n,), index into ``curves``.
    cause, cause_index : what limits the speed of each segment, and (int64 (n,)) which obstacle or node, -1 none.
    tracks : where each obstacle was.
    obstacle_specs : what each was.
    moments : events in order of time.
    period : seconds between two decisions.
    optimum : seconds that the fastest drive of the first curve takes without obstacles; None: not known.
    replans, expansions : of the planner.
    error : maximum distance between where the robot was and where it was commanded to be, metres.
    detail : why it ended so, in words.
    timing : seconds; the only part that differs from run to run. ``planning_s`` is processor
        time in the planner. ``loading_s`` (loading and compiling machine code, once for a process) is a part
        of ``total_s`` and of no other.
    notes : deviations from the request: attributes that the planner weakened (the latest about each
        setting), a time limit that was cut; not compared.
    goal_tolerance : of a robot with a heading: metres and radians from the goal's pose within which the planner's goal lies;
        None: the planner was one of cells.
    controller : ``exact``, or the name of a controller that steers; then there is one curve, which the robot drove.
    safety_filter : filter on the commands of a controller that steers: ``braking`` or ``none``.
    paths : of a controller that steers, the paths that were planned, one after the other; else empty.
    path_times : seconds at which the robot began to follow each of them.
    timetables : of a planner of times, the planned times along each curve (:class:`PlannedTimes`), None where it has none;
        else empty.
    sensor : of a robot that began without the map; None: the map was known.
    seen : int32 (height, width); the number of the period at whose beginning each cell was first seen, -1 never. None without a
        sensor.
    via, via_times : the scene's via points in the order of visits, and the seconds at which the robot stood on each, as far as it
        did.

    Examples
    --------
    >>> import lampyris
    >>> scene = lampyris.Scene(lampyris.load_grid("guide"), start=(1, 8), goal=(8, 2))
    >>> drive = lampyris.drive(scene, "astar")
    >>> drive.outcome.value, float(drive.v[-1])
    ('arrived', 0.0)
    """

    scene: Scene
    planner: str
    law: str
    seed: int
    outcome: Outcome
    curves: tuple[Curve, ...]
    t: Floats
    s: Floats
    v: Floats
    a: Floats
    leg: NDArray[np.int64]
    cause: tuple[str, ...]
    cause_index: NDArray[np.int64]
    tracks: tuple[Track, ...]
    obstacle_specs: tuple[Obstacle, ...]
    moments: tuple[Moment, ...]
    period: float
    optimum: float | None = None
    replans: int = 0
    expansions: int = 0
    error: float = 0.0
    detail: str = ""
    timing: Mapping[str, float] = field(default_factory=dict, compare=False)
    notes: tuple[str, ...] = field(default=(), compare=False)
    goal_tolerance: tuple[float, float] | None = None
    controller: str = EXACT
    safety_filter: str = BRAKING
    paths: tuple[Curve, ...] = ()
    path_times: tuple[float, ...] = ()
    timetables: tuple[PlannedTimes | None, ...] = ()
    sensor: Sensor | None = None
    seen: Cells | None = None
    via: tuple[Cell, ...] = ()
    via_times: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if self.seen is not None:
            seen = whole_of("drive", "seen", self.seen, self.scene.grid.blocked.shape).astype(np.int32)
            object.__setattr__(self, "seen", frozen(seen))
        n = len(items_of("drive", "cause", self.cause))
        for name, kind in (
            ("t", float),
            ("s", float),
            ("v", float),
            ("a", float),
            ("leg", int),
            ("cause_index", int),
        ):
            checked = numbers_of if kind is float else whole_of
            object.__setattr__(self, name, checked("drive", name, getattr(self, name), (n,)))

    def _brief(self) -> str:
        seen = f"{len(self.tracks)} obstacles, {self.replans} replans"
        return f"<Drive {self.outcome} by {self.planner}, {self.law}: {self.duration:.6g} s, {seen}>"

    def to_pandas(self) -> pandas.DataFrame:
        """The robot's drive as a table, a row for each segment and one for the end: metres, seconds, m/s.

        Columns ``t_s``, ``x_m``, ``y_m``, ``yaw`` (map frame, y up), ``v`` at that time, ``a`` until the next row,
        ``s`` along the curve number ``leg``, ``cause`` and ``why``.

        Raises
        ------
        UsageError : ``PANDAS``: pandas is not installed.
        """
        return self._table()

    @property
    def duration(self) -> float:
        """Seconds from the start to the end."""
        return float(self.t[-1]) if len(self.t) else 0.0

    @property
    def arrived(self) -> bool:
        """Whether the robot stands on the goal at the end."""
        return bool(self.outcome)

    def at(self, t: Floats) -> tuple[Points, Floats]:
        """Where the robot is at some times (cells, (m, 2)) and how fast (m/s, (m,))."""
        t = np.clip(np.atleast_1d(np.asarray(t, dtype=np.float64)), self.t[0], self.t[-1])
        k = np.clip(np.searchsorted(self.t, t, side="right") - 1, 0, len(self.t) - 1)
        d = t - self.t[k]
        s = self.s[k] + d * (self.v[k] + 0.5 * self.a[k] * d)
        xy = np.zeros((len(t), 2))
        for leg in np.unique(self.leg[k]).tolist():
            here = self.leg[k] == leg
            xy[here] = self.curves[leg].at(s[here])[0]
        return xy, np.maximum(self.v[k] + self.a[k] * d, 0.0)

    def poses(self, t: Floats) -> Floats:
        """Where the robot is at some times and its yaw: metres of the map frame and radians, (m, 3).

        Of a robot on a path of cells the yaw is the direction of the path.
        """
        t = np.clip(np.atleast_1d(np.asarray(t, dtype=np.float64)), self.t[0], self.t[-1])
        k = np.clip(np.searchsorted(self.t, t, side="right") - 1, 0, len(self.t) - 1)
        d = t - self.t[k]
        s = self.s[k] + d * (self.v[k] + 0.5 * self.a[k] * d)
        frame = self.scene.grid.frame
        poses = np.zeros((len(t), 3))
        for leg in np.unique(self.leg[k]).tolist():
            here = self.leg[k] == leg
            curve = self.curves[leg]
            xy, heading = curve.at(s[here])
            poses[here, :2] = frame.to_metres(xy)
            along = elementary.atan2(-heading[:, 1], heading[:, 0])
            poses[here, 2] = curve.yaw_at(s[here]) if isinstance(curve, PoseCurve) else along
        poses[:, 2] = math.pi - np.remainder(math.pi - poses[:, 2] - frame.origin[2], 2 * math.pi)
        return poses

    @property
    def lateness(self) -> Floats | None:
        """By how much the robot is later at the begin of each stretch than planned, seconds, float64 (n,); 0: it is not.

        None: no times were planned.
        """
        planned = self.planned_times
        return None if planned is None else np.maximum(np.nan_to_num(self.t - planned), 0.0)

    @property
    def planned_times(self) -> Floats | None:
        """When the robot was to leave the place where each stretch begins, seconds, float64 (n,); None: none were planned.

        NaN on curves without planned times. A robot counts as at a place from 0.02 cells before it on.
        """
        if not any(self.timetables):
            return None
        planned = np.full(len(self.t), np.nan)
        for leg, table in enumerate(self.timetables):
            here = self.leg == leg
            if table is not None and here.any():
                planned[here] = table.times(self.s[here] + AT_PLACE * self.scene.grid.resolution)
        return planned

    @property
    def planned_arrival(self) -> float | None:
        """When the last plan with times reaches the goal, seconds from the start; None: no times were planned."""
        known = [table for table in self.timetables if table is not None]
        return float(known[-1].reach[-1]) if known else None

    def why(self, k: int) -> str:
        """What bound the speed of stretch ``k``, in words."""
        return self.cause[k] if self.cause[k] == "braking" else reason(self.cause, self.cause_index, k)

    @property
    def sentence(self) -> str:
        """What a person should read."""
        return self.detail or self.outcome.sentence
