"""The state of a drive in continuous time: what changes from period to period, besides the obstacles."""

from __future__ import annotations

from dataclasses import dataclass, field

from lampyris.model.curve import Curve
from lampyris.model.drive import PlannedTimes
from lampyris.model.trace import Outcome
from lampyris.sim.continuous.control import Decision
from lampyris.sim.continuous.leg import Leg


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
