"""The state of a drive in continuous time: what changes from period to period, besides the obstacles; and its log."""

from __future__ import annotations

from dataclasses import dataclass, field, fields

from lampyris.model.curve import Curve
from lampyris.model.drive import Moment, PlannedTimes
from lampyris.model.trace import Outcome
from lampyris.sim.continuous.control import Decision
from lampyris.sim.continuous.leg import Leg
from lampyris.sim.world.trajectory import Segment


@dataclass(slots=True)
class DriveState:
    """Where the robot is, and what it is about to do.

    Parameters
    ----------
    leg : the present path.
    curves, timetables : of all legs so far; None: a leg without planned times.
    t, s, v : seconds, metres along the leg, m/s.
    periods : that are over.
    decision : the last one.
    outcome, detail : how it ended; None while it has not.
    fault, fault_since : what is wrong with the data, and since when; below 0: nothing is.
    map_changed : an update of the map blocks cells, and the path has not been planned again yet.
    goal_tolerance : metres and radians from the goal's pose at which the robot has arrived; None: it has no heading.
    total_s, loading_s : seconds of computing.
    """

    leg: Leg
    curves: list[Curve] = field(default_factory=list)
    timetables: list[PlannedTimes | None] = field(default_factory=list)
    t: float = 0.0
    s: float = 0.0
    v: float = 0.0
    periods: int = 0
    decision: Decision = field(default_factory=lambda: Decision(0.0, "start"))
    outcome: Outcome | None = None
    detail: str = ""
    fault: str = ""
    fault_since: float = -1.0
    map_changed: bool = False
    goal_tolerance: tuple[float, float] | None = None
    total_s: float = 0.0
    loading_s: float = 0.0


@dataclass
class Log:
    """What a :class:`lampyris.model.drive.Drive` is made from.

    A robot that goes on standing for the same reason is reported once, so that a long wait is one line.
    """

    t: list[float] = field(default_factory=list)
    s: list[float] = field(default_factory=list)
    v: list[float] = field(default_factory=list)
    a: list[float] = field(default_factory=list)
    leg: list[int] = field(default_factory=list)
    cause: list[str] = field(default_factory=list)
    cause_index: list[int] = field(default_factory=list)
    moments: list[Moment] = field(default_factory=list)

    def add(self, one: Segment, leg: int, cause: str, cause_index: int) -> None:
        """A stretch, because of something."""
        still = one.v == 0.0 and one.a == 0.0
        goes_on = still and bool(self.t) and self.v[-1] == 0.0 and self.a[-1] == 0.0
        if goes_on and (self.leg[-1], self.cause[-1], self.cause_index[-1]) == (leg, cause, cause_index):
            return
        if one.end > one.t:
            self._put(one.t, one.s, one.v, one.a, leg, cause, cause_index)

    def extend(self, columns: list[list[float]], leg: int, cause: list[str], cause_index: list[int]) -> None:
        """Many stretches of a path that :meth:`add` would take in: t, s, v and a of each."""
        for mine, more in zip((self.t, self.s, self.v, self.a), columns, strict=True):
            mine += more
        self.leg += [leg] * len(cause)
        self.cause += cause
        self.cause_index += cause_index

    def close(self, t: float, s: float, v: float, leg: int, cause: str, cause_index: int) -> None:
        """The end."""
        if self.t and t <= self.t[-1]:
            return
        self._put(t, s, v, 0.0, leg, cause, cause_index)

    def _put(self, t: float, s: float, v: float, a: float, leg: int, cause: str, cause_index: int) -> None:
        self.t.append(t)
        self.s.append(s)
        self.v.append(v)
        self.a.append(a)
        self.leg.append(leg)
        self.cause.append(cause)
        self.cause_index.append(cause_index)

    def copy(self) -> Log:
        """The same, apart."""
        return Log(*(list(getattr(self, f.name)) for f in fields(self)))

    def tell(self, t: float, word: str, xy: tuple[float, float], sentence: str, obstacle: int = -1) -> None:
        """A moment."""
        self.moments.append(Moment(t, word, xy, sentence, obstacle))
