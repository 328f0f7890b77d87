"""A drive whose controller steers: the robot goes where its commands lead it, which may be off the planned path.

As :mod:`lampyris.sim.continuous.drive`, but for what the robot does in a period: the controller of the path's present
section answers with an arc and a speed, the filter makes them safe, and the robot drives the arc exactly. What it drove is
one curve of poses, of one piece for each period; the planned paths are kept beside it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar

import numpy as np

from lampyris.errors import SettingError, shown
from lampyris.model.curve import Curve, PoseCurve
from lampyris.model.drive import Drive
from lampyris.model.plan import Plan
from lampyris.model.scene import Scene
from lampyris.model.settings.steering import Steering
from lampyris.model.trace import Outcome
from lampyris.motion.geometry.pose_curve import standing_at
from lampyris.motion.laws.registry import SpeedLaw
from lampyris.planning.base import Budget, Planner
from lampyris.sim.continuous.control import Decision
from lampyris.sim.continuous.drive import DriveSimulation
from lampyris.sim.continuous.pose_replanner import PoseReplanner
from lampyris.sim.sensor import ObstacleSensor
from lampyris.sim.steering.arc import LEAST_PIECE, Arc, DrivenPieces, RobotPose, RobotShape, angle_of, wrapped
from lampyris.sim.steering.braking_filter import FilteredPush, filtered, wished
from lampyris.sim.steering.control import Steer, SteeringController, View, stopping_speed
from lampyris.sim.steering.recovery import Recovery
from lampyris.sim.steering.reference import PathProgress
from lampyris.sim.steering.walls import WallMap
from lampyris.sim.traffic.motion_sources import MotionSource
from lampyris.sim.world.pose_lookup import PoseLookup
from lampyris.sim.world.trajectory import Trajectory, split
from lampyris.sim.world.waiting import WAITS

_AT_STOP = 0.02
"""Metres before the end of a section, as a share of the tolerance at the goal where that is less, at which it is done."""

_SPUN = 0.01
"""Radians from the yaw asked for at which a turn in place is done."""

_RECOVERY_TIME = 4.0
"""Seconds that a recovery takes, at most."""

_CRAWL = 1e-6
"""Metres a second that are taken for none."""

_PATIENCE = 1.5
"""Patiences without coming along the path after which the robot plans again, whatever keeps it."""

_TURNED = 0.5
"""Radians that count as coming along."""

_LEFT = 0.5
"""Metres more than the longest recovery, by which the robot has left the place where it made no progress."""

_MISSES = 5
"""Times that a robot that has missed the goal plans again before it gives up."""


class SteeredSimulation(DriveSimulation):
    """See :class:`lampyris.sim.continuous.drive.DriveSimulation`.

    Parameters
    ----------
    steerer : who steers.
    steering : its settings.
    """

    steers: ClassVar[bool] = True

    def __init__(
        self, scene: Scene, planner: Planner, steerer: SteeringController, steering: Steering, *,
        law: SpeedLaw = "physical", seed: int = 0, sources: Sequence[MotionSource] = (), sensor: ObstacleSensor | None = None,
        budget: Budget | None = None, **settings: object,
    ) -> None:  # fmt: skip
        self.steerer, self.steering = steerer, steering
        super().__init__(
            scene, planner, law=law, seed=seed, sources=sources, sensor=sensor, budget=budget, **settings
        )

    # ---- paths --------------------

    def _begin(self) -> None:
        if self.settings.tracking != "perfect":
            raise SettingError(
                "DRIVE_SETTING", shown(self.settings.tracking), where="tracking",
                allowed="perfect, where the controller steers",
            )  # fmt: skip
        self.shape = RobotShape(self.scene.robot, self.scene.grid)
        self.walls = WallMap(self.shape)
        self.pieces = DrivenPieces(self.shape)
        self.pose: RobotPose | None = None
        self.arc: Arc | None = None
        self.progress: PathProgress | None = None
        self._leg_s = 0.0
        self._path_times: list[float] = []
        self._misses = self._recoveries = 0
        self._recovery: Recovery | None = None
        self._recovered = self._recovery_s = 0.0
        self._stuck = self._replan_when_standing = False
        self._seen, self._stalled = (0, 0.0, 0.0), 0.0
        self._kept_at: RobotPose | None = None
        self._kept, self._longest_recovery = 0.0, 0.0
        self._fresh = True
        self._stopped = True
        super()._begin()
        if self.pose is None:
            self.pose = self._pose_of(self.state.leg.route)

    def _take(self, curve: Curve) -> None:
        super()._take(curve)
        self.state.s = self._leg_s = self.pieces.length
        assert isinstance(curve, PoseCurve)
        self._path_times.append(self.state.t)
        self.progress = PathProgress(curve, self.shape.arm)
        self._fresh = True
        if self.pose is None:
            self.pose = self._start(self.state.leg.route)

    def _pose_of(self, route: object) -> RobotPose:
        """Where a path begins."""
        assert isinstance(route, PoseLookup)
        x, y = route.at(0.0)
        res = self.scene.grid.resolution
        return RobotPose(x * res, -y * res, float(route.poses.yaw_at(np.zeros(1))[0]))

    def _start(self, route: object) -> RobotPose:
        """The start's own pose where the robot can stand there, else where the path begins."""
        first, asked, grid = self._pose_of(route), self.scene.start_pose, self.scene.grid
        if asked is None:
            return first
        x, y = grid.frame.to_points(asked[0], asked[1]).tolist()
        pose = RobotPose(x * grid.resolution, -y * grid.resolution, wrapped(asked[2] - grid.origin[2]))
        return pose if self.walls.stands(pose) else first

    def _know_goal(self, plan: Plan) -> None:
        """The planner's tolerance, the controller's, and how far the path ends from the goal."""
        super()._know_goal(plan)
        assert self.state.goal_tolerance is not None
        position, yaw = self.state.goal_tolerance
        off = 0.0
        asked = self.scene.goal_pose
        route = self.state.leg.route
        if asked is not None and isinstance(route, PoseLookup):
            off = abs(wrapped(route.poses.end_yaw - (asked[2] - self.scene.grid.origin[2])))
        one = self.steering
        self.state.goal_tolerance = (position + one.goal_tolerance, yaw + one.goal_yaw_tolerance + off)

    @property
    def xy(self) -> tuple[float, float]:
        """Where the robot is, cells."""
        if self.pose is None:
            return self.state.leg.route.at(0.0)
        res = self.scene.grid.resolution
        return self.pose.x / res, -self.pose.y / res

    def _replan(self, why: str) -> None:
        """Ask again from where the robot stands; the old path stays if there is no new one."""
        assert self.pose is not None
        message = self.watch.last
        if self.waiting.tries > 0 and self._recovery is None:
            self._stuck = True
        self.log.tell(self.state.t, "replan", self.xy, why)
        if self.state.map_changed:
            self.walls.block([c for c in self.watch.blocked if self.scene.grid.contains(c)])
        self.state.map_changed = False
        self.waiting.asked()
        grid = self.scene.grid
        x, y = grid.to_metres(self.xy).tolist()
        pose = (x, y, wrapped(self.pose.yaw + grid.origin[2]))
        assert isinstance(self.replanner, PoseReplanner)
        reaction = self._reaction(self.settings.decision_period)
        plan, curve = self.replanner.from_pose(pose, self.xy, message, reaction)
        self._end_without_path(plan)
        if curve is not None and len(curve.lengths):
            self._take(curve)

    # ---- one period --------------------

    def _move(self, end: float) -> Trajectory:
        """Decide and drive until ``end``."""
        period = end - self.state.t
        push = self._settled(self._push(period), period)
        assert self.pose is not None
        v = self.state.v
        segments = split(self.state.t, end, 0.0, v, push.a, None)
        length = segments[-1].after(end)[0]
        fresh_stop = v == 0.0
        self._stopped = fresh_stop
        self.arc = push.arc
        self.state.decision = Decision(push.a, push.cause, push.cause_index)
        # Obstacles that yield look along the arc as far as the robot may come in their next step, and brake.
        robot, speed = self.scene.robot, self.settings.obstacle_speed
        tick = self.scene.grid.resolution / (robot.v_max if speed is None else speed)
        ahead = robot.v_max * (tick + 0.5 * robot.v_max / robot.d_max)
        route = self.shape.route(self.pose, push.arc, max(length, LEAST_PIECE) + ahead)
        trajectory = Trajectory(route, segments)
        if self.settings.safety_filter == "none" and length > 0.0:
            self._hit_wall(trajectory, length)
        return trajectory

    def _settled(self, push: FilteredPush, period: float) -> FilteredPush:
        """The same, but standing where it would end at next to no speed."""
        v = self.state.v
        if v + push.a * period >= _CRAWL:
            return push
        if v == 0.0:
            return push._replace(a=0.0)
        return push._replace(a=max(min(push.a, -v / period * (1.0 + 1e-9)), -self.scene.robot.d_max))

    def _hit_wall(self, trajectory: Trajectory, length: float) -> None:
        """Without a filter a robot may come to a wall: that is the end."""
        assert self.pose is not None
        assert self.arc is not None
        free = self.walls.free(self.pose, self.arc, length)
        if free >= length:
            return
        one = trajectory.segments[0]
        disc = max(one.v * one.v + 2.0 * one.a * free, 0.0)
        # The later root where it brakes is behind the place where it stands.
        t = one.t + 2.0 * free / (one.v + math.sqrt(disc)) if free > 0.0 else one.t
        trajectory.cut(max(min(t, one.end), min(one.t + 1e-9, one.end)))
        at, res = self.shape.along(self.pose, self.arc, free), self.scene.grid.resolution
        place = (at.x / res, -at.y / res)
        self.log.tell(trajectory.segments[-1].end, "contact", place, "The robot drove into a wall.")
        self._end(Outcome.COLLISION, f"The robot drove into a wall at {trajectory.segments[-1].end:.3f} s.")

    def _push(self, period: float) -> FilteredPush:
        """What to drive until the next decision."""
        brake = self._must_brake()
        arc = self.arc if self.arc is not None else Arc(self.pose.yaw if self.pose else 0.0, 0.0, 0.0)
        if brake is not None or self.progress is None:
            why = brake or Decision(0.0, "wait")
            return FilteredPush(
                arc, -self.scene.robot.d_max if self.state.v > 0.0 else 0.0, why.cause, why.cause_index
            )
        view = self.view(period)
        if self._replan_when_standing and view.v > 0.0 and view.arc is not None:
            steer: Steer | None = Steer(view.arc, 0.0, "wait")
        else:
            steer = self._recover(view)
        if steer is None:
            view = self.view(period)  # recovery may have found a new path
            steer = self._steer(view)
        if steer is None:
            return FilteredPush(arc, -self.scene.robot.d_max if self.state.v > 0.0 else 0.0, "turn")
        push = wished(view, steer) if self.settings.safety_filter == "none" else filtered(view, steer)
        if view.v == 0.0 and push.a <= 0.0 and push.cause == "clearance":
            push = push._replace(cause="obstacle")  # it waits, as for any other obstacle
        return push

    def _recover(self, view: View) -> Steer | None:
        """The command of a recovery; None: there is none."""
        if self._recovery is None:
            if not self._stuck or view.v > 0.0:
                return None
            self._stuck = False
            self._recovery = Recovery(view, self._recoveries)
            self._longest_recovery = max(self._longest_recovery, self._recovery.left)
            self._recovery_s = self.pieces.length
            self._recoveries += 1
        steer = self._recovery.steer(view, self.pieces.length - self._recovery_s)
        self._recovery_s = self.pieces.length
        self._recovered += view.period
        if steer is not None and self._recovered < _RECOVERY_TIME:
            return steer
        if view.v > 0.0 and view.arc is not None:
            return Steer(view.arc, 0.0, "turn")
        self._recovery, self._recovered = None, 0.0
        self._replan("Moved away from where no safe motion led along the path.")
        self._stuck = False  # the new path is tried first
        return None

    def view(self, period: float) -> View:
        """What the controller sees now, with so many seconds until the next decision."""
        message = self.watch.last
        assert message is not None
        assert self.pose is not None
        assert self.progress is not None
        velocity = None if self.settings.obstacle_info == "positions" else message.velocity
        return View(
            t=self.state.t, period=period, pose=self.pose, v=self.state.v,
            arc=self.arc if self.state.v > 0.0 else None, shape=self.shape, walls=self.walls, leg=self.state.leg,
            progress=self.progress, message=message, velocity=velocity, noise=self.settings.noise,
            tries=self.waiting.tries,
        )  # fmt: skip

    def _steer(self, view: View) -> Steer | None:
        """The command; None: stand, at the end of a section."""
        progress, pose = view.progress, view.pose
        progress.update(pose)
        while not progress.done and self._section_done(view):
            if view.v > 0.0:
                return None
            progress.next()
            progress.update(pose)
            self._fresh = True
        if progress.done:
            return self._last_turn(view)
        one = progress.section
        if one.gear == 0:
            return self._spin(view, float(one.yaw[-1])) if self.shape.turns_in_place else None
        if self.shape.turns_in_place and (view.v == 0.0 or (view.arc and view.arc.in_place)):
            off = self._aside(view)
            turning = view.arc is not None and view.arc.in_place
            if abs(off) > (_SPUN if turning else self.steering.rotate_angle):
                return self._spin(view, pose.yaw + off)
            if turning:
                return None
        if self._fresh:
            self.steerer.begin(view)
            self._fresh = False
        return self.steerer.steer(view)

    def _aside(self, view: View) -> float:
        """Radians from the robot's yaw to the one with which it would drive towards the path ahead."""
        progress, pose = view.progress, view.pose
        one = progress.section
        if self.shape.sideways:
            return wrapped(float(one.yaw[progress.at]) - pose.yaw)
        if abs(progress.beside) < 0.5 * self.scene.grid.resolution:
            yaw = float(one.yaw[progress.at])
            return wrapped(yaw - pose.yaw)
        x, y, _ = progress.ahead(max(0.6, 2.0 * abs(progress.beside)))
        bearing = angle_of(y - pose.y, x - pose.x)
        return wrapped(bearing + (math.pi if one.gear < 0 else 0.0) - pose.yaw)

    def _section_done(self, view: View) -> bool:
        progress = view.progress
        if progress.section.gear == 0:
            return progress.left <= _SPUN
        return progress.left <= min(_AT_STOP, 0.2 * self.steering.goal_tolerance)

    def _spin(self, view: View, yaw: float) -> Steer | None:
        """Turn in place towards a yaw, and stop there."""
        off = wrapped(yaw - view.pose.yaw)
        if view.v > 0.0 and (view.arc is None or not view.arc.in_place or view.arc.turn * off < 0.0):
            return None
        left = abs(off) * self.shape.arm
        v = stopping_speed(left, view.v, view.period, self.scene.robot.d_max)
        return Steer(self.shape.spin(off), min(v, self.shape.spin_speed()), "turn")

    def _last_turn(self, view: View) -> Steer | None:
        """At the end of the path: turn to the goal's yaw, or see whether the robot has arrived."""
        end = view.progress.sections[-1].end if view.progress.sections else view.pose
        off = wrapped(end.yaw - view.pose.yaw)
        spinning = view.arc is not None and view.arc.in_place
        if (
            abs(off) > (_SPUN if spinning else 0.5 * self.steering.goal_yaw_tolerance)
            and self.shape.turns_in_place
        ):
            return self._spin(view, end.yaw)
        return None

    def _arrived(self, pose: RobotPose) -> bool:
        """Whether a robot that stands there has arrived."""
        if self.progress is None or not self.progress.sections:
            return False
        end, one = self.progress.sections[-1].end, self.steering
        dx, dy = end.x - pose.x, end.y - pose.y
        near = dx * dx + dy * dy <= one.goal_tolerance * one.goal_tolerance
        return near and abs(wrapped(end.yaw - pose.yaw)) <= one.goal_yaw_tolerance

    def _cut_at_goal(self, trajectory: Trajectory) -> None:
        """Arrival is seen at the end of a period."""

    def _go(self, trajectory: Trajectory) -> None:
        """Write down what was driven and go to its end."""
        assert self.pose is not None
        assert self.arc is not None
        decision, begin = self.state.decision, self.pieces.length
        last, before = trajectory.segments[-1], self.state.t
        length, v = last.after(last.end)
        if length > LEAST_PIECE:
            self.pieces.add(self.pose, self.arc, length, stop=self._stopped)
            after = self.shape.along(self.pose, self.arc, length)
            self.arc = self.arc._replace(direction=self.arc.direction + self.arc.bend * length)
            self.pose = after
        for one in trajectory.segments:
            self.log.add(replace(one, s=begin + one.s), 0, decision.cause, decision.cause_index)
        self.state.t, self.state.s, self.state.v = last.end, self.pieces.length, v
        self.others.arrive(self.state.t)
        self.others.let_go(trajectory.route, length)
        if self.state.outcome is not None:
            return
        if v == 0.0 and self._finished():
            self._arrive()
        elif self.state.t >= self.time_limit:
            self._end(Outcome.TIMEOUT, f"The robot had not arrived after {self.state.t:.6g} s, the limit.")
        else:
            self._wait(self.state.t - before)

    def _finished(self) -> bool:
        """Whether the robot, which stands, has arrived; one that has missed the goal plans again."""
        assert self.pose is not None
        if self.progress is None or not self.progress.done:
            return False
        if self._arrived(self.pose):
            return True
        off = (
            abs(wrapped(self.progress.sections[-1].end.yaw - self.pose.yaw))
            if self.progress.sections
            else 0.0
        )
        if self.shape.turns_in_place and off > 0.5 * self.steering.goal_yaw_tolerance:
            return False
        self._misses += 1
        if self._misses > _MISSES:
            self._end(Outcome.BLOCKED, f"Missed the goal {self._misses} times at {self._here()}.")
        else:
            self._replan("The end of the path was missed.")
        return False

    def _stalls(self, seconds: float) -> bool:
        """Whether the robot has not come along its path for long, whatever the reason."""
        if self.progress is None or self._recovery is not None:
            return False
        yaw = self.pose.yaw if self.pose else 0.0
        place = (self.progress.k, self.progress.s, yaw)
        k, s, before = self._seen
        if (
            place[0] != k
            or abs(place[1] - s) > 0.5 * self.scene.grid.resolution
            or abs(yaw - before) > _TURNED
        ):
            self._seen, self._stalled = place, 0.0
            return False
        self._stalled += seconds
        return self._stalled > _PATIENCE * max(self.settings.patience, 1.0)

    def _gives_up(self, seconds: float) -> bool:
        """Whether the robot has stood, waited and recovered at one place for longer than ``give_up``.

        A recovery moves it, and so does the way back: only farther away it has left that place.
        """
        if self.pose is None:
            return False
        if self._kept_at is not None:
            dx, dy = self.pose.x - self._kept_at.x, self.pose.y - self._kept_at.y
            left = self._longest_recovery + _LEFT
            if dx * dx + dy * dy > left * left:
                self._kept_at, self._kept, self._longest_recovery = None, 0.0, 0.0
        if self.state.v == 0.0 or self.state.decision.cause in WAITS or self._recovery is not None:
            if self._kept_at is None:
                self._kept_at = self.pose
            self._kept += seconds
        return self.state.v == 0.0 and self._kept > self.settings.give_up

    def _wait(self, seconds: float) -> None:
        if self._gives_up(seconds):
            where = f"at {self._here()}; the limit is {self.settings.give_up:g} s"
            self._end(Outcome.BLOCKED, f"Stood and recovered for {self._kept:.4g} s {where}.")
            return
        if self._stalls(seconds):
            self._stalled = 0.0
            if self.state.v == 0.0:
                self._stuck = True
            self._replan_when_standing = True
        if self._replan_when_standing and self.state.v == 0.0:
            self._replan_when_standing = False
            self._replan("Asked again: the robot did not come along its path.")
            return
        self.state.s -= self._leg_s
        super()._wait(seconds)
        # A new path has put it where it belongs.
        self.state.s = self.pieces.length

    # ---- the story --------------------

    def drive(self) -> Drive:
        """What has happened so far, with the curve that was driven and the paths that were planned."""
        made = super().drive()
        if self.pose is None:
            return made
        if self.pieces.rows:
            curve: Curve = self.pieces.curve(self.pose)
        else:
            x, y = self.scene.grid.to_metres(self.xy).tolist()
            curve = standing_at(
                (x, y, self.pose.yaw + self.scene.grid.origin[2]), self.scene.grid, self.scene.robot
            )
        paths = tuple(self.state.curves[-len(self._path_times) :]) if self._path_times else ()
        return replace(
            made, curves=(curve,), leg=made.leg * 0, controller=self.steering.name, paths=paths,
            path_times=tuple(self._path_times), safety_filter=self.settings.safety_filter,
        )  # fmt: skip
