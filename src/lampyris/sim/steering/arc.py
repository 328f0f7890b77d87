"""Arcs: what a robot drives in one period, and the curve that comes of all of them.

Here positions are metres in the frame of the map's cells with y up: x = column * resolution, y = -row * resolution. Angles
are radians counterclockwise. Within a period the robot keeps the direction of travel in its own frame and the ratio of yaw rate
and speed, so that its base moves on an arc exactly, and only its speed changes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from lampyris._core import elementary
from lampyris.kernels.motion.curve_motion import chord
from lampyris.model.curve import PoseCurve
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.motion.geometry.pose_curve import arm_of, outline_of
from lampyris.sim.world.pose_lookup import PoseLookup
from lampyris.typing import Points

HAIR = 1.0 - 1e-9
"""Limits are kept with this share, so that rounding does not exceed them."""

LEAST_PIECE = 1e-12
"""Metres below which no piece is written down."""


def wrapped(angle: float) -> float:
    """An angle in [-pi, pi]."""
    return math.remainder(angle, 2.0 * math.pi)


def cos_sin(angle: float) -> tuple[float, float]:
    """Cosine and sine, the same on every machine."""
    _, sine, cosine = chord.linked()(angle)
    return float(cosine), float(sine)


def angle_of(dy: float, dx: float) -> float:
    """Direction of a vector, the same on every machine."""
    return float(elementary.atan2(dy, dx))


class RobotPose(NamedTuple):
    """Where the robot is: metres (y up) and radians."""

    x: float
    y: float
    yaw: float


class Arc(NamedTuple):
    """A motion of the robot: its direction, how it bends, and how the yaw turns.

    Parameters
    ----------
    direction : of travel where it begins.
    bend : radians that the direction turns a metre.
    turn : radians that the yaw turns a metre; of differential and ackermann drives the same.
    in_place : the base stands; ``turn`` is then radians a metre of the robot's farthest point.
    """

    direction: float
    bend: float
    turn: float
    in_place: bool = False


@dataclass(frozen=True)
class RobotShape:
    """A robot on a map, as arcs need it.

    Parameters
    ----------
    robot, grid : which.

    Attributes
    ----------
    sideways : whether it can move to any side.
    """

    robot: Robot
    grid: Grid
    outline: Points = field(init=False)
    margin: float = field(init=False)
    arm: float = field(init=False)
    yaw_rate: float = field(init=False)
    sideways: bool = field(init=False)

    def __post_init__(self) -> None:
        outline, margin = outline_of(self.robot)
        arm = arm_of(self.robot, self.grid.resolution)
        rate = self.robot.yaw_rate_max
        object.__setattr__(self, "outline", outline)
        object.__setattr__(self, "margin", margin)
        object.__setattr__(self, "arm", arm)
        object.__setattr__(self, "yaw_rate", self.robot.v_max / arm if rate is None else rate)
        object.__setattr__(self, "sideways", self.robot.drive == "omnidirectional")

    @property
    def turns_in_place(self) -> bool:
        """Whether it can turn in place."""
        return self.robot.drive != "ackermann"

    def most_bend(self, v: float) -> float:
        """Greatest curvature of the base's track at a speed, 1/m: by turning radius and lateral acceleration."""
        bend = math.inf if self.robot.turn_radius == 0.0 else 1.0 / self.robot.turn_radius
        if v > 0.0:
            bend = min(bend, self.robot.a_lat_max / (v * v))
        return bend * HAIR

    def most_turn(self, v: float) -> float:
        """Maximum yaw a metre at a speed, by the yaw rate."""
        return self.yaw_rate / v * HAIR if v > 0.0 else math.inf

    def most_speed(self, arc: Arc) -> float:
        """Maximum speed on an arc, m/s; in place, of the farthest point."""
        if arc.in_place:
            return self.spin_speed()
        v = self.robot.v_max
        if arc.bend != 0.0:
            v = min(v, math.sqrt(self.robot.a_lat_max / abs(arc.bend)) * HAIR)
        if arc.turn != 0.0:
            v = min(v, self.yaw_rate / abs(arc.turn) * HAIR)
        return v

    def spin(self, angle: float) -> Arc:
        """A turn in place towards an angle."""
        return Arc(0.0, 0.0, math.copysign(1.0 / self.arm, angle), in_place=True)

    def spin_speed(self) -> float:
        """Maximum speed of the farthest point in a turn in place, m/s."""
        return min(self.robot.v_max, self.yaw_rate * self.arm) * HAIR

    def along(self, pose: RobotPose, arc: Arc, s: float) -> RobotPose:
        """The pose after a distance."""
        if arc.in_place:
            return RobotPose(pose.x, pose.y, pose.yaw + arc.turn * s)
        ratio, sine, cosine = chord.linked()(0.5 * arc.bend * s)
        hx, hy = cos_sin(arc.direction)
        far = s * ratio
        return RobotPose(
            pose.x + far * (hx * cosine - hy * sine),
            pose.y + far * (hx * sine + hy * cosine),
            pose.yaw + arc.turn * s,
        )

    def route(self, pose: RobotPose, arc: Arc, length: float) -> PoseLookup:
        """The arc as a curve of one piece."""
        pieces = DrivenPieces(self)
        pieces.add(pose, arc, max(length, LEAST_PIECE), stop=False)
        return PoseLookup(pieces.curve(self.along(pose, arc, length)))


@dataclass
class DrivenPieces:
    """The curve that has been driven, piece by piece."""

    shape: RobotShape
    rows: list[tuple[float, float, float, float, float, float, float, float]] = field(default_factory=list)
    stops: list[int] = field(default_factory=list)
    length: float = 0.0

    def add(self, pose: RobotPose, arc: Arc, length: float, *, stop: bool) -> None:
        """A piece that begins at a pose; ``stop``: the robot stands where it begins."""
        if stop and self.rows:
            self.stops.append(len(self.rows))
        res = self.shape.grid.resolution
        hx, hy = (0.0, 0.0) if arc.in_place else cos_sin(arc.direction)
        bend = 0.0 if arc.in_place else -arc.bend + 0.0
        self.rows.append((pose.x / res, -pose.y / res, hx, -hy + 0.0, length, bend, pose.yaw, arc.turn))
        self.length += length

    def curve(self, end: RobotPose) -> PoseCurve:
        """All of it as a curve that ends at a pose."""
        res = self.shape.grid.resolution
        table = np.array(self.rows).reshape(-1, 8)
        return PoseCurve(
            table[:, :2], table[:, 2:4], table[:, 4], table[:, 5], (end.x / res, -end.y / res), res,
            np.array(self.stops, dtype=np.int64),
            yaw=table[:, 6], turn=table[:, 7], end_yaw=end.yaw, outline=self.shape.outline, margin=self.shape.margin,
        )  # fmt: skip
