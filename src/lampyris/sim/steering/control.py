"""What a controller that steers may look at, and what it answers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from lampyris.sim.continuous.leg import Leg
from lampyris.sim.sensor import ObstacleMessage
from lampyris.sim.steering.arc import Arc, RobotPose, RobotShape
from lampyris.sim.steering.reference import PathProgress
from lampyris.sim.steering.walls import WallMap
from lampyris.typing import Points


class Steer(NamedTuple):
    """What a controller wants for the next period.

    Parameters
    ----------
    arc : where to.
    v : speed at the end of the period, m/s; of a turn in place, that of the robot's farthest point.
    cause, cause_index : what limits the speed, as for :class:`lampyris.sim.continuous.control.Decision`.
    """

    arc: Arc
    v: float
    cause: str
    cause_index: int = -1


@dataclass(slots=True)
class View:
    """What the robot knows at the beginning of a period.

    Parameters
    ----------
    t, period : seconds.
    pose, v : where it is, and its speed along ``arc``.
    arc : what it drove last, from where it is; None: it stands.
    shape, walls : the robot, and the map.
    leg, progress : the path with its ceiling of speeds, and where on it the robot is.
    message : the last trusted message.
    velocity : of each obstacle, m/s, y down, (m, 2); None: not used.
    noise : metres that a reported position may be off.
    tries : new paths since the robot last got on.
    """

    t: float
    period: float
    pose: RobotPose
    v: float
    arc: Arc | None
    shape: RobotShape
    walls: WallMap
    leg: Leg
    progress: PathProgress
    message: ObstacleMessage
    velocity: Points | None
    noise: float
    tries: int


class SteeringController(Protocol):
    """A controller at work on one drive."""

    def begin(self, view: View) -> None:
        """A new path, or a new section of it."""
        ...

    def steer(self, view: View) -> Steer:
        """The command for the next period, on a section that is no turn in place."""
        ...


def towards(v: float, wanted: float, view: View) -> float:
    """The acceleration that comes nearest to a speed by the end of the period."""
    robot = view.shape.robot
    return min(max((wanted - v) / view.period, -robot.d_max), robot.a_max)


def stopping_speed(left: float, v: float, period: float, d_max: float) -> float:
    """The maximum speed at the end of a period from which the robot can still stand after ``left`` metres.

    It drives ``period (v + v1) / 2`` and then ``v1^2 / (2 d_max)``.
    """
    rest = left - 0.5 * period * v
    if rest <= 0.0:
        return 0.0
    b = 0.5 * d_max * period
    return math.sqrt(b * b + 2.0 * d_max * rest) - b
