"""FleetTrace: the robots of a fleet in continuous time, phase by phase."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris._core.arrays import index_array
from lampyris._core.predicates import cells, fits, numbers
from lampyris._core.scalars import in_range
from lampyris._core.values import Value
from lampyris.errors import SettingError, plural, shown
from lampyris.model.fleet.delays import Delays
from lampyris.model.grid import Grid, frozen
from lampyris.model.obstacles import Track
from lampyris.model.plan import Status
from lampyris.model.robot import Robot
from lampyris.model.settings.fleet_drive import FleetDriveSettings
from lampyris.typing import Cells, Floats

WAITS = ("order", "turning", "delay", "obstacle", "replanning")
"""Why robots stand before they arrive: another robot has to leave a cell first; they turn in place; a delay; a moving obstacle;
a robot has failed and the others wait for a new plan, or without end."""
_LATEST = 1e12
"""Seconds: later than any drive."""
_SENTENCES = {
    Status.FOUND: "All robots arrived.",
    Status.NO_PATH: "Not all robots can arrive: robots that stopped are in their way.",
    Status.LIMIT: "Stopped at the time limit before all robots arrived.",
    Status.CANCELLED: "Stopped on request.",
}
_COLUMNS = ("t", "duration", "x", "y", "dx", "dy", "v", "a")


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FleetTrace(Value):
    """The motion of n robots as m phases of constant acceleration on straight lines; between its phases a robot stands.

    Parameters
    ----------
    status : ``found``: every robot arrived, those that failed left out.
    grid : the map.
    settings, delays, seed : of the simulation.
    robots : with every default filled in.
    starts, goals : int32 (n, 2), cells.
    robot : int32 (m,): whose phase it is, rising.
    t, duration : float64 (m,), seconds; the phases of a robot follow each other in time.
    x, y : float64 (m,), metres of the map frame: where a phase begins.
    dx, dy : float64 (m,): its direction, of length 1.
    v, a : float64 (m,): speed at the beginning, m/s, and acceleration, m/s2.
    arrivals : float64 (n,), seconds; NaN: not arrived.
    planned : float64 (n,), seconds: the tick of arrival of the plan times :attr:`tick`; NaN: there is no plan.
    waits : float64 (n, 5), seconds that each robot stood before it arrived, by :data:`WAITS`.
    tick : seconds of a tick of the plan: a step at the speed of the slowest robot.
    plans : the plans that were driven one after another: paths of all robots, a cell a tick. Empty with ``orca``.
    plan_times : float64 (plans,), seconds at which each began.
    faults : robots that stopped permanently, and when: pairs (robot, seconds).
    obstacles : tracks of the moving obstacles.
    contacts : pairs of robots that touched (``order``: none, by construction).
    obstacle_contacts : pairs of a robot and an obstacle that touched; the robot stood, unless ``moving_contacts`` says so.
    moving_contacts : those of them in which the robot was driving.
    wall_contacts : robots that touched a wall (``order``: none).
    delayed : moves that were delayed.
    rotations : rings of robots that exchanged their cells in one motion.
    detail : why, in words, where there is more to say than the status's own sentence.
    notes : notes for the user.
    timing : seconds by stage; the only part that differs from run to run.

    Raises
    ------
    SettingError : ``FLEET_TRACE``: an array of another kind or shape.

    Examples
    --------
    >>> import lampyris
    >>> fleet = lampyris.random_fleet(lampyris.load_grid("env-1"), 4)
    >>> trace = lampyris.simulate_fleet(fleet)
    >>> trace.status.value, trace.contacts
    ('found', 0)
    """

    status: Status
    grid: Grid
    settings: FleetDriveSettings
    delays: Delays
    seed: int
    robots: tuple[Robot, ...]
    starts: Cells
    goals: Cells
    robot: NDArray[np.int32]
    t: Floats
    duration: Floats
    x: Floats
    y: Floats
    dx: Floats
    dy: Floats
    v: Floats
    a: Floats
    arrivals: Floats
    planned: Floats
    waits: Floats
    tick: float
    plans: tuple[tuple[Cells, ...], ...] = ()
    plan_times: tuple[float, ...] = ()
    faults: tuple[tuple[int, float], ...] = ()
    obstacles: tuple[Track, ...] = ()
    contacts: int = 0
    obstacle_contacts: int = 0
    moving_contacts: int = 0
    wall_contacts: int = 0
    delayed: int = 0
    rotations: int = 0
    detail: str = ""
    notes: tuple[str, ...] = ()
    timing: Mapping[str, float] = field(default_factory=dict, compare=False)

    def __post_init__(self) -> None:
        kinds = (("status", Status), ("grid", Grid), ("settings", FleetDriveSettings), ("delays", Delays))
        for name, kind in kinds:
            if not isinstance(getattr(self, name), kind):
                raise SettingError(
                    "FLEET_TRACE", shown(getattr(self, name)), where=name, allowed=kind.__name__
                )
        given: Any = self.robots
        if not isinstance(given, tuple | list) or not all(isinstance(one, Robot) for one in given):
            raise SettingError("FLEET_TRACE", shown(given), where="robots", allowed="a list of robots")
        object.__setattr__(self, "robots", tuple(given))
        n = len(self.robots)
        for name in ("starts", "goals"):
            array: Any = cells(getattr(self, name))
            if array is None or len(array) != n:
                raise SettingError(
                    "FLEET_TRACE", shown(getattr(self, name)), where=name, allowed=f"{n} cells"
                )
            object.__setattr__(self, name, frozen(array))
        whose = numbers(self.robot, (None,))
        if whose is None or ((whose % 1 != 0) | (whose < 0) | (whose >= max(n, 1))).any():
            raise SettingError(
                "FLEET_TRACE", shown(self.robot), where="robot", allowed="numbers of robots (m,)"
            )
        object.__setattr__(self, "robot", frozen(whose.astype(np.int32)))
        forms: list[tuple[str, tuple[int, ...]]] = [(name, (len(whose),)) for name in _COLUMNS]
        forms += [("arrivals", (n,)), ("planned", (n,)), ("waits", (n, len(WAITS)))]
        for name, form in forms:
            array = numbers(getattr(self, name), (None,) * len(form))
            if array is None or not fits(array, form):
                raise SettingError(
                    "FLEET_TRACE", shown(getattr(self, name)), where=name, allowed=f"numbers {form}"
                )
            object.__setattr__(self, name, frozen(array))
        object.__setattr__(self, "plans", _plans(self.plans))
        for name, item in (("plan_times", float), ("faults", tuple), ("obstacles", Track)):
            items: Any = getattr(self, name)
            if not isinstance(items, tuple | list) or not all(isinstance(one, item) for one in items):
                raise SettingError(
                    "FLEET_TRACE", shown(items), where=name, allowed=f"a list of {item.__name__}"
                )
            object.__setattr__(self, name, tuple(items))

    def _brief(self) -> str:
        there = f"{self.arrived} of {plural(len(self.robots), 'robot')} arrived"
        head = f"<FleetTrace {self.status} by {self.settings.policy}: {there}"
        return f"{head} in {self.duration_s:.1f} s, {self.contacts} contacts>"

    def __bool__(self) -> bool:
        return bool(self.status)

    @property
    def sentence(self) -> str:
        """What a person should read."""
        return self.detail or _SENTENCES.get(self.status, self.status.sentence)

    @property
    def arrived(self) -> int:
        """How many robots are at their goals at the end."""
        return int(np.count_nonzero(~np.isnan(self.arrivals)))

    @property
    def duration_s(self) -> float:
        """When the last phase ends, seconds."""
        return float((self.t + self.duration).max(initial=0.0))

    @property
    def lateness(self) -> Floats:
        """Seconds that each robot arrived after the time of the plan, float64 (n,); negative: before it; NaN: unknown."""
        return frozen(self.arrivals - self.planned)

    @property
    def driving(self) -> Floats:
        """Seconds that each robot was in motion, float64 (n,)."""
        made = np.bincount(index_array(self.robot), weights=self.duration, minlength=len(self.robots))
        return frozen(made.astype(np.float64))

    @property
    def utilisation(self) -> float:
        """Share of the time until they arrived that robots were in motion."""
        until = np.where(np.isnan(self.arrivals), self.duration_s, self.arrivals)
        total = float(until.sum())
        return float(self.driving.sum()) / total if total > 0.0 else 0.0

    def wait_totals(self) -> dict[str, float]:
        """Seconds that all robots stood, by cause."""
        return dict(zip(WAITS, self.waits.sum(axis=0).tolist(), strict=True))

    def at(self, time: float) -> Floats:
        """Where every robot is, metres of the map frame, float64 (n, 2); after the end of the drive where it stands then.

        Raises
        ------
        SettingError : ``TIME``: no finite number of seconds from 0 on.
        """
        if not in_range(time, 0.0, _LATEST):
            raise SettingError.of(
                "TIME", "time", shown(time), allowed=f"seconds, a number from 0 to {_LATEST:g}"
            )
        made = self.grid.to_metres(self.starts.astype(np.float64))
        begun = np.flatnonzero(self.t <= time)
        if len(begun):
            # The phases of a robot rise in time, and its number with the row: the last one begun counts.
            last = np.zeros(len(self.robots), dtype=np.int64)
            np.maximum.at(last, self.robot[begun], begun + 1)
            on = last > 0
            rows = last[on] - 1
            past = np.minimum(time - self.t[rows], self.duration[rows])
            far = past * (self.v[rows] + 0.5 * self.a[rows] * past)
            made[on] = np.stack(
                (self.x[rows] + far * self.dx[rows], self.y[rows] + far * self.dy[rows]), axis=1
            )
        return frozen(made)


def _plans(given: Any) -> tuple[tuple[Cells, ...], ...]:
    """Plans as they are stored: read-only arrays of cells."""
    allowed = "plans, each a list of paths of cells (ticks + 1, 2)"
    if not isinstance(given, tuple | list) or not all(isinstance(one, tuple | list) for one in given):
        raise SettingError("FLEET_TRACE", shown(given), where="plans", allowed=allowed)
    made = []
    for one in given:
        paths = [cells(path) for path in one]
        if any(path is None or not len(path) for path in paths):
            raise SettingError("FLEET_TRACE", shown(one), where="plans", allowed=allowed)
        made.append(tuple(frozen(path) for path in paths if path is not None))
    return tuple(made)
