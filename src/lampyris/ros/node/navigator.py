"""The core of the node: what it knows, when it plans, what it commands. It knows no transport.

Plans are made while the robot stands: a plan may take long, and nothing would watch over a robot that drives meanwhile.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from lampyris import api
from lampyris._core.defaults import NODE_LAW, PLANNER
from lampyris.errors import InputError, LampyrisError, SettingError
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan, Status
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.settings.ros_node import NodeSettings
from lampyris.planning.base import Budget
from lampyris.planning.registry import plans_poses, pose_names
from lampyris.ros import messages
from lampyris.ros.messages import Fields, pose_of, seconds
from lampyris.ros.node.follower import Follower, Velocity
from lampyris.ros.node.plan_answer import PlanAnswer
from lampyris.ros.node.route import route_of_path, route_of_plan, widened
from lampyris.ros.node.safety import ObservedObstacle, Safety, moved
from lampyris.ros.node.topics import Topic, Transport, topics_for
from lampyris.ros.occupancy import grid_of, updated
from lampyris.ros.path_export import path_poses
from lampyris.ros.transforms import KEPT, PlanePose, Transforms, compose, inverse
from lampyris.typing import Floats

STILL = 0.01
"""m/s and rad/s below which the robot stands."""
GAP = 0.02
"""Metres to keep from obstacles."""
OBSTACLE_RADIUS = 0.3
"""Metres: least radius of an obstacle that is known by its odometry alone."""

NAV2_ERRORS: Mapping[str, str] = {
    "START_OUTSIDE": "START_OUTSIDE_MAP", "GOAL_OUTSIDE": "GOAL_OUTSIDE_MAP",
    Status.START_OCCUPIED: "START_OCCUPIED", Status.GOAL_OCCUPIED: "GOAL_OCCUPIED",
    "FRAME": "TF_ERROR", Status.LIMIT: "TIMEOUT", Status.NO_PATH: "NO_VALID_PATH", Status.HEMMED_IN: "NO_VALID_PATH",
}  # fmt: skip
"""Names of the error codes of Nav2's ComputePathToPose."""


class Navigator:
    """Plans on the map that arrives, and drives the robot that reports its odometry.

    Parameters
    ----------
    robot : shape and limits.
    settings : how it drives.
    planner, planner_settings : who plans.
    law, law_settings : who decides speeds.
    renamed : other names of topics.
    """

    def __init__(
        self,
        robot: Robot,
        settings: NodeSettings | None = None,
        *,
        planner: str = PLANNER,
        planner_settings: Mapping[str, Any] | None = None,
        law: str = NODE_LAW,
        law_settings: Mapping[str, Any] | None = None,
        renamed: Mapping[str, str] | None = None,
    ) -> None:
        self.settings = settings or NodeSettings()
        if robot.drive == "ackermann" and not plans_poses(planner):
            raise SettingError(
                "PLANNER", f"planner {planner} for a robot that cannot turn in place", where="planner",
                allowed=", ".join(pose_names()),
            )  # fmt: skip
        self.robot, self.planner, self.law = robot, planner, law
        self._planner_settings, self._law_settings = dict(planner_settings or {}), dict(law_settings or {})
        given = dict(renamed or {})
        self.topics = topics_for(self.settings.stamped, given)
        self._by_name = {topic.name: usual for topic, usual in zip(self.topics, _usual(), strict=True)}
        self._sent: dict[str, Topic] = {
            usual: topic for topic, usual in zip(self.topics, _usual(), strict=True) if topic.sent
        }
        self.transport: Transport | None = None
        self._known = Transforms(KEPT)
        self._map: Fields | None = None
        self.grid: Grid | None = None
        self._safety: Safety | None = None
        self._odom: tuple[PlanePose, float, float, str] | None = None  # pose, v, w, frame
        self._odom_stamp, self._odom_at = -math.inf, -math.inf
        self.odometry_count = 0
        self._offset: PlanePose = (0.0, 0.0, 0.0)  # of the odometry's frame in the map, by /initialpose
        self._obstacles: dict[str, ObservedObstacle] = {}
        self._obstacles_at: float | None = None
        self._e_stop = False
        self.goal: PlanePose | None = None
        self.goals = 0  # counted: a client that waits for one sees by it that another has replaced it
        self._via: tuple[PlanePose, ...] = ()
        self._given: Floats | None = None  # a path to follow, planned elsewhere
        self._follower: Follower | None = None
        self._dirty = False  # the map has changed since the path was planned
        self._stands_since: float | None = None
        self._failed_at = -math.inf
        self._commanding = False
        self.status = ""
        self.outcome = ""
        self.error = ""
        self.last = Velocity(0.0, 0.0, "idle")

    # What arrives.

    def connect(self, transport: Transport) -> None:
        """Use a transport."""
        self.transport = transport
        transport.open(self.topics, self.receive)

    def receive(self, topic: str, fields: Fields) -> None:
        """Take in a message; one that makes no sense is reported on ``/lampyris/status`` and left out."""
        assert self.transport is not None
        now = self.transport.now()
        try:
            handle = {
                "/map": self._on_map, "/map_updates": self._on_update, "/tf": self._on_tf,
                "/tf_static": self._on_tf_static, "/odom": self._on_odom, "/initialpose": self._on_initial_pose,
                "/goal_pose": self._on_goal, "/obstacles": self._on_obstacles, "/obstacle_odom": self._on_obstacle_odom,
                "/e_stop": self._on_e_stop,
            }[self._by_name[topic]]  # fmt: skip
            handle(fields, now)
        except LampyrisError as fault:
            self._say(f"{topic} left out: {fault}", now)

    def _on_map(self, fields: Fields, now: float) -> None:
        grid = grid_of(fields, name="map")
        self._map = fields
        self._use(grid)

    def _on_update(self, fields: Fields, now: float) -> None:
        if self._map is not None:
            self._map = updated(self._map, fields)
            self._use(grid_of(self._map, name="map"))

    def _use(self, grid: Grid) -> None:
        if self.grid is not None and grid == self.grid:
            return
        self.grid, self._safety = grid, Safety(grid, self.robot)
        self._dirty = self._follower is not None

    def _on_tf(self, fields: Fields, now: float) -> None:
        self._take_transforms(fields, static=False)

    def _on_tf_static(self, fields: Fields, now: float) -> None:
        self._take_transforms(fields, static=True)

    def _take_transforms(self, fields: Fields, *, static: bool) -> None:
        for one in fields["transforms"]:
            held = one["transform"]
            _finite_pose({"position": held["translation"], "orientation": held["rotation"]}, "TRANSFORM")
        self._known.add(fields, static=static)

    def _on_odom(self, fields: Fields, now: float) -> None:
        stamp = seconds(fields["header"]["stamp"])
        at, turn = pose_of(fields["pose"]["pose"]), fields["twist"]["twist"]
        v, w = float(turn["linear"]["x"]), float(turn["angular"]["z"])
        if not all(map(math.isfinite, (*at, v, w))):
            raise InputError("ODOMETRY", "a number that is not finite", allowed="finite numbers")
        # A message that is sent again and again is no news.
        if stamp > self._odom_stamp or stamp == 0.0 or stamp < self._odom_stamp - 1.0:
            self._odom, self._odom_stamp, self._odom_at = (
                (at, v, w, str(fields["header"]["frame_id"])),
                stamp,
                now,
            )
            self.odometry_count += 1

    def _on_initial_pose(self, fields: Fields, now: float) -> None:
        at = _finite_pose(fields["pose"]["pose"], "POSE")
        here = self._odom[0] if self._odom is not None else (0.0, 0.0, 0.0)
        self._offset = compose(at, inverse(here))
        self._follower, self._dirty = None, False
        self._known = Transforms(KEPT)

    def _on_goal(self, fields: Fields, now: float) -> None:
        self.go_to(self.in_map(fields))

    def in_map(self, fields: Fields) -> PlanePose:
        """x, y (metres) and yaw (radians) in the frame `map` of a geometry_msgs/PoseStamped.

        Raises
        ------
        InputError : ``GOAL``: a number that is not finite; ``FRAME``: no transform from its frame to `map`.
        """
        frame, at = str(fields["header"]["frame_id"]).lstrip("/"), _finite_pose(fields["pose"], "GOAL")
        if frame in ("", messages.MAP):
            return at
        of = self._known.between(frame, messages.MAP)
        if of is None:
            raise InputError(
                "FRAME", f"a pose in the frame {frame}", allowed="map, or a frame that /tf leads from"
            )
        return compose(of, at)

    def go_to(self, goal: PlanePose, via: Sequence[PlanePose] = ()) -> None:
        """Drive to a pose of the map frame, through others."""
        self.cancel()
        self.goal, self._via, self.outcome, self.error = goal, tuple(via), "", ""
        self.goals += 1
        self._failed_at = -math.inf

    def follow(self, poses: Floats) -> int:
        """Drive along a path that was planned elsewhere, float64 (n, 3) in the map frame; the number of this goal."""
        end = tuple(poses[-1].tolist())
        self.go_to((end[0], end[1], end[2]))
        self._given = np.array(poses)
        return self.goals

    def cancel(self) -> None:
        """Stop, and forget the goal."""
        self.goal, self._via, self._given, self._follower, self._dirty = None, (), None, None, False
        self._stands_since = None
        self.outcome = "cancelled"

    def _on_obstacles(self, fields: Fields, now: float) -> None:
        self._obstacle_message(now)
        seen: dict[str, ObservedObstacle] = {}
        for one in fields["markers"]:
            key = f"{one['ns']}-{one['id']}"
            if one["action"] == messages.ADD and one["type"] in (
                messages.CUBE,
                messages.SPHERE,
                messages.CYLINDER,
            ):
                size = 0.5 * max(float(one["scale"]["x"]), float(one["scale"]["y"]))
                seen[key] = self._seen(key, one["header"], _finite_pose(one["pose"], "OBSTACLE"), size, now)
        other = {key: one for key, one in self._obstacles.items() if key.startswith("odom ")}
        self._obstacles = {**other, **seen}
        self._obstacles_at = now

    def _obstacle_message(self, now: float) -> None:
        """Start the clock of ``obstacle_timeout``; only a message that can be read sets it back."""
        if self._obstacles_at is None:
            self._obstacles_at = now

    def _on_obstacle_odom(self, fields: Fields, now: float) -> None:
        self._obstacle_message(now)
        key = f"odom {fields['child_frame_id']}"
        at = _finite_pose(fields["pose"]["pose"], "OBSTACLE")
        variance = float(fields["pose"]["covariance"][0]) if "covariance" in fields["pose"] else 0.0
        if not variance >= 0.0:
            raise InputError("OBSTACLE", f"variance {variance:g} of x", allowed="0 m2 or more")
        size = max(math.sqrt(variance), OBSTACLE_RADIUS)
        self._obstacles[key] = self._seen(key, fields["header"], at, size, now)
        self._obstacles_at = now

    def _seen(self, key: str, head: Fields, at: PlanePose, radius: float, now: float) -> ObservedObstacle:
        if not 0.0 <= radius < math.inf:
            raise InputError("OBSTACLE", f"radius {radius:g} of {key}", allowed="0 m or more, finite")
        frame = str(head["frame_id"]).lstrip("/")
        if frame not in ("", messages.MAP):
            at = compose(self._frame_in_map(frame), at)
        old = self._obstacles.get(key)
        vx = vy = 0.0
        if old is not None and now > old.t:
            vx, vy = (at[0] - old.x) / (now - old.t), (at[1] - old.y) / (now - old.t)
        return ObservedObstacle(at[0], at[1], radius, vx, vy, now)

    def _frame_in_map(self, frame: str) -> PlanePose:
        of = self._known.between(frame, messages.MAP)
        if of is not None:
            return of
        if self._odom is not None and frame == self._odom[3].lstrip("/"):
            return self._offset
        raise InputError("FRAME", f"the frame {frame}", allowed="map, or a frame that /tf leads from")

    def _on_e_stop(self, fields: Fields, now: float) -> None:
        self._e_stop = bool(fields["data"])

    # What is done.

    def pose(self, now: float) -> PlanePose | None:
        """Where the robot is now in the map frame: the last odometry, driven on; None: not known."""
        if self._odom is None:
            return None
        at, v, w, frame = self._odom
        of = (
            self._known.between(frame, messages.MAP) if frame.lstrip("/") != messages.MAP else (0.0, 0.0, 0.0)
        )
        age = min(max(now - self._odom_at, 0.0), self.settings.data_timeout)
        return moved(compose(self._offset if of is None else of, at), v, w, age)

    def plan(
        self, start: PlanePose | None, goal: PlanePose, via: Sequence[PlanePose] = (), now: float = 0.0
    ) -> PlanAnswer:
        """A path from a pose (None: where the robot is) to another, in the map frame."""
        at = start if start is not None else self.pose(now)
        if self.grid is None:
            return PlanAnswer(None, "NO_VALID_PATH", "no map has arrived")
        if at is None:
            return PlanAnswer(None, "TF_ERROR", "no pose of the robot is known")
        grid = self._among(self.grid, at, now) if self._obstacles else self.grid
        fault: LampyrisError | None = None
        for margin in dict.fromkeys((self.settings.margin, 0.0)):  # without the margin rather than not at all
            try:
                found, scene = self._planned(grid, at, goal, via, margin)
                if found.path is not None:
                    route = route_of_plan(scene, found, self.law, goal[2], **self._law_settings)
                    return PlanAnswer(
                        path_poses(found) if found.pose_path is not None else route.poses, route=route
                    )
                last = PlanAnswer(None, NAV2_ERRORS.get(found.status, "UNKNOWN"), found.sentence)
            except LampyrisError as raised:
                fault = raised
                last = PlanAnswer(None, NAV2_ERRORS.get(raised.code, "UNKNOWN"), str(raised))
        if fault is not None and fault.exit_code == 6:
            raise fault
        return last

    def answer(self, start: Fields | None, goals: Sequence[Fields]) -> PlanAnswer:
        """:meth:`plan` for another node; a robot that drives is stopped first, because nothing watches it meanwhile.

        Parameters
        ----------
        start : geometry_msgs/PoseStamped; None: where the robot is.
        goals : of the same type, passed one after the other.
        """
        if not goals:
            return PlanAnswer(None, "NO_VIAPOINTS_GIVEN", "no goals were given")
        try:
            here = None if start is None else self.in_map(start)
            *via, goal = [self.in_map(one) for one in goals]
        except InputError as refused:
            return PlanAnswer(None, NAV2_ERRORS.get(refused.code, "UNKNOWN"), str(refused))
        if self.goal is not None:
            self.stop()
        assert self.transport is not None
        return self.plan(here, goal, via, self.transport.now())

    def _planned(
        self, grid: Grid, at: PlanePose, goal: PlanePose, via: Sequence[PlanePose], margin: float
    ) -> tuple[Plan, Scene]:
        robot = widened(self.robot, margin)
        if plans_poses(self.planner):
            scene = Scene(grid, start_pose=at, goal_pose=goal, robot=robot)
        else:
            scene = Scene(grid, grid.to_cell(*at[:2]), grid.to_cell(*goal[:2]), robot=robot)
        if via:
            scene = scene.through([grid.to_cell(*one[:2]) for one in via])
        budget = Budget(seconds=60.0)
        return api.plan(
            scene, self.planner, record=False, budget=budget, planner_settings=self._planner_settings
        ), scene

    def _among(self, grid: Grid, at: PlanePose, now: float) -> Grid:
        """The map with obstacles that stand as blocked cells; those the robot touches are left out."""
        blocked = grid.blocked.copy()
        for one in self._obstacles.values():
            dx, dy = one.x - at[0], one.y - at[1]
            if (
                max(abs(one.vx), abs(one.vy)) > 0.05
                or dx * dx + dy * dy < (one.radius + self.robot.radius) ** 2
            ):
                continue
            angle = np.arange(16) * (2.0 * math.pi / 16)
            wide = one.radius / math.cos(math.pi / 16)  # the polygon is around the disc
            ring = np.column_stack((one.x + wide * np.cos(angle), one.y + wide * np.sin(angle)))
            cells = grid.polygon_cells(ring.tolist())
            blocked[cells[:, 1], cells[:, 0]] = True
        return replace(grid, blocked=blocked)

    def tick(self) -> None:
        """One control period: plan if there is a goal without a path, and command a velocity."""
        assert self.transport is not None
        now = self.transport.now()
        made = self._decide(now)
        self.last = made
        stamped = self.settings.stamped
        fields = messages.twist_stamped(now, made.v, made.w) if stamped else messages.twist(made.v, made.w)
        active = self.goal is not None or self._e_stop
        if active or self._commanding:  # when it is over, once more: zero
            self._publish("/cmd_vel", fields)
        self._commanding = active
        if self.goal is None and not self._e_stop:
            self._say("idle" if not self.outcome else f"idle: {self.outcome}", now)

    def _decide(self, now: float) -> Velocity:
        stop = self._why_stop(now)
        if stop:
            self._say(f"stopped: {stop}", now)
            return Velocity(0.0, 0.0, stop)
        at = self.pose(now)
        if self.goal is None or at is None or self._odom is None:
            return Velocity(0.0, 0.0, "idle")
        _, v, w, _ = self._odom
        if self._follower is None or self._dirty:
            if abs(v) > STILL or abs(w) > 0.05:
                return Velocity(0.0, 0.0, "stands to plan")
            if now - self._failed_at < 1.0:
                return Velocity(0.0, 0.0, "no path")
            self._publish("/cmd_vel", self._zero(now))
            self._replan(at, now)
            return Velocity(0.0, 0.0, "planned")
        made = self._follower.command(at, w)
        if made.done:
            self.goal, self._follower, self.outcome = None, None, "arrived"
            return Velocity(0.0, 0.0, "arrived")
        if made.lost:
            self._dirty = True
            return Velocity(0.0, 0.0, "off the path")
        return self._safe(made, at, v, now)

    def _why_stop(self, now: float) -> str:
        """Why the robot may not move at all; empty: it may."""
        if self._e_stop:
            return "emergency stop"
        if self.goal is None:
            return ""
        if self.grid is None:
            return "no map"
        if now - self._odom_at > self.settings.data_timeout:
            return (
                f"no new {self._name('/odom')} for {self.settings.data_timeout:g} s"
                if self._odom
                else "no odometry"
            )
        limit = self.settings.obstacle_timeout
        if self._obstacles_at is not None and limit > 0 and now - self._obstacles_at > limit:
            return f"no message about obstacles for {limit:g} s"
        return ""

    def _safe(self, wish: Velocity, at: PlanePose, v_now: float, now: float) -> Velocity:
        assert self._safety is not None
        assert self._follower is not None
        period = 1.0 / self.settings.rate
        # No harder than the robot accelerates; what brakes is passed on.
        age = min(max(now - self._odom_at, 0.0), self.settings.data_timeout)
        most = max(abs(v_now), abs(self.last.v)) + self.robot.a_max * period
        if age > 0.5 * self.settings.data_timeout:  # no faster without news of the robot
            most = abs(v_now)
        share = min(1.0, most / abs(wish.v)) if wish.v else 1.0
        reaction = 2.0 * period + age
        v, w, cause = self._safety.allowed(
            at, share * wish.v, share * wish.w, reaction, self._obstacles, now, GAP
        )
        made = Velocity(v, w, cause or wish.cause)
        self._say(f"driving: {made.cause}", now)
        if v == 0.0 and w == 0.0 and cause:
            self._stands_since = now if self._stands_since is None else self._stands_since
            if now - self._stands_since >= self.settings.patience:
                self._dirty, self._stands_since = True, None
        else:
            self._stands_since = None
        if int(now * 5.0) != int((now - period) * 5.0):  # five times a second
            marks = messages.path_markers(now, self._follower.route.poses, made.cause, at, v)
            self._publish("/lampyris/markers", {"markers": marks["markers"][-1:]})
        return made

    def _replan(self, at: PlanePose, now: float) -> None:
        assert self.goal is not None
        self._dirty, self._follower = False, None
        if self._given is not None:
            answer = self._given_route(self._given)
        else:
            answer = self.plan(at, self.goal, self._via, now)
        if answer.route is None:
            self._failed_at, self.error = now, answer.error
            self._say(f"no path: {answer.detail}", now)
            return
        self._via = ()
        self._failed_at, self.error = -math.inf, ""
        self._follower = Follower(answer.route, self.robot, self.settings)
        assert answer.poses is not None
        self._publish("/plan", messages.path(now, answer.poses))
        self._publish("/lampyris/speed_profile", messages.speed_profile(answer.route.profile, now))
        marks = messages.path_markers(now, answer.poses, "planned", at, 0.0)
        self._publish("/lampyris/markers", marks)

    def _given_route(self, poses: Floats) -> PlanAnswer:
        """The route of a path that was planned elsewhere."""
        assert self.grid is not None
        points = self.grid.to_points(poses[:, 0], poses[:, 1])
        keep = np.append(True, (np.abs(np.diff(points, axis=0)) > 1e-9).any(axis=1))
        scene = Scene(
            self.grid, self.grid.to_cell(*poses[0, :2].tolist()), self.grid.to_cell(*poses[-1, :2].tolist()),
            robot=self.robot,
        )  # fmt: skip
        try:
            path = api.smooth(scene, points[keep], method="arcs")
            route = route_of_path(scene, path, self.law, float(poses[-1, 2]), **self._law_settings)
        except LampyrisError as fault:
            return PlanAnswer(None, "INVALID_PATH", str(fault))
        return PlanAnswer(route.poses, route=route)

    @property
    def left(self) -> float:
        """Metres that are left of the path."""
        return self._follower.left if self._follower is not None else 0.0

    def stop(self) -> None:
        """Send a velocity of zero: the node ends."""
        if self.transport is not None:
            self._publish("/cmd_vel", self._zero(self.transport.now()))

    def _zero(self, now: float) -> dict[str, Any]:
        return messages.twist_stamped(now, 0.0, 0.0) if self.settings.stamped else messages.twist(0.0, 0.0)

    def _name(self, usual: str) -> str:
        return next(name for name, one in self._by_name.items() if one == usual)

    def _publish(self, usual: str, fields: Fields) -> None:
        assert self.transport is not None
        self.transport.publish(self._sent[usual], fields)

    def _say(self, status: str, now: float) -> None:
        """Publish the status if it is another."""
        if status != self.status:
            self.status = status
            self._publish("/lampyris/status", {"data": json.dumps({"stamp": now, "status": status})})


def _finite_pose(fields: Fields, code: str) -> PlanePose:
    """x, y (metres) and yaw (radians) of a geometry_msgs/Pose.

    Raises
    ------
    InputError : ``code``: a number that is not finite.
    """
    at = pose_of(fields)
    if not all(map(math.isfinite, at)):
        raise InputError(code, f"x, y, yaw = {at}", allowed="finite numbers")
    return at


def _usual() -> tuple[str, ...]:
    return tuple(one.name for one in topics_for(False, {}))
