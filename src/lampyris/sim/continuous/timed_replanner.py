"""The replanner of a robot that follows planned times: asks for them from when it can be there, and keeps them by curve."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lampyris.model.change import Change
from lampyris.model.curve import Curve, PoseCurve
from lampyris.model.drive import PlannedTimes
from lampyris.model.path import Pose
from lampyris.model.plan import Plan
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.motion.geometry.pose_curve import arm_of
from lampyris.sim.continuous.leg import Ceiling, Leg
from lampyris.sim.continuous.pose_replanner import PoseReplanner
from lampyris.sim.continuous.timetable import timetable_of
from lampyris.sim.sensor import ObstacleMessage
from lampyris.sim.world.pose_lookup import PoseLookup
from lampyris.typing import Cell, Floats


class TimedReplanner(PoseReplanner):
    """A session of a planner of poses with times; see :class:`PoseReplanner`.

    Obstacles whose tracks the planner knows are no obstacles where they are now: it knows where they will be.

    Attributes
    ----------
    known : numbers of these obstacles.
    now : seconds that are over.
    """

    known: frozenset[int] = frozenset()
    now: float = 0.0
    _seen: ObstacleMessage | None = None
    _begin: float = 0.0
    _lead: float = 0.0
    _made: tuple[Curve, PlannedTimes] | None = None

    def first(self, message: ObstacleMessage) -> Plan:
        """The first plan."""
        return PoseReplanner.first(self, self._unknown(message))

    def _bare(self) -> Scene:
        return replace(self.scene, traffic=())

    def again(
        self, leg: Leg, s: float, message: ObstacleMessage | None, reaction: float
    ) -> tuple[Plan, Curve | None]:
        """See :meth:`PoseReplanner.again`."""
        self._seen = message
        unknown = None if message is None else self._unknown(message)
        plan, curve = PoseReplanner.again(self, leg, s, unknown, reaction)
        if curve is not None:
            self._keep(plan, curve)
        return plan, curve

    def curve(
        self, plan: Plan, xy: tuple[float, float], message: ObstacleMessage | None, more: Floats | None = None
    ) -> Curve | None:
        """The path of a plan, whose times are kept."""
        curve = PoseReplanner.curve(self, plan, xy, message, more)
        if curve is not None:
            self._keep(plan, curve)
        return curve

    def leg(self, curve: Curve, ceiling: Ceiling) -> Leg:
        """The path with its ceiling of speeds and its planned times."""
        leg = PoseReplanner.leg(self, curve, ceiling)
        if self._made is not None and self._made[0] is curve:
            return replace(leg, timetable=self._made[1])
        return leg

    def _keep(self, plan: Plan, curve: Curve) -> None:
        path = plan.pose_path
        assert path is not None
        arm = arm_of(self.scene.robot, self.scene.grid.resolution)
        self._made = (curve, timetable_of(path, arm, self._begin, self._lead))

    def _joins(
        self, route: PoseLookup, s: float, message: ObstacleMessage | None
    ) -> list[tuple[float, PoseCurve | None]]:
        """See :meth:`PoseReplanner._joins`; on the way there all obstacles count."""
        return PoseReplanner._joins(self, route, s, self._seen)

    def _ask_from(self, pose: Pose | None, shut: frozenset[Cell], lead: PoseCurve | None = None) -> Plan:
        self._lead = 0.0 if lead is None else lead.length
        self._begin = self.now + least_seconds(self._lead, self.scene.robot)
        change = Change(pose=pose, obstacles=shut, blocked=self._news(), time_s=self._begin)
        return self._answer(change)

    def _unknown(self, message: ObstacleMessage) -> ObstacleMessage:
        """What it says of obstacles whose tracks are not known."""
        kept = np.array([k not in self.known for k in range(len(message.xy))], dtype=np.bool_)
        velocity = None if message.velocity is None else message.velocity[kept]
        return replace(
            message,
            xy=message.xy[kept],
            radius=message.radius[kept],
            top_speed=message.top_speed[kept],
            velocity=velocity,
        )


def least_seconds(length: float, robot: Robot) -> float:
    """How long a robot takes from rest to rest, at least; seconds."""
    each = 1.0 / robot.a_max + 1.0 / robot.d_max
    if length <= 0.5 * robot.v_max * robot.v_max * each:
        return float(np.sqrt(2.0 * length * each))
    return length / robot.v_max + 0.5 * robot.v_max * each
