"""The node without a transport: a robot that is not ours, a clock that is simulated."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest

import lampyris
from lampyris.errors import SettingError
from lampyris.model.settings.ros_node import NodeSettings
from lampyris.ros.node.navigator import Navigator

RESOLUTION, PERIOD = 0.1, 0.05


def rooms() -> np.ndarray:
    """Two rooms of 2 x 3 m, a wall with a door of 0.8 m between them, walls around."""
    data = np.zeros((30, 41), dtype=np.int8)  # row 0 is at the bottom, as in the message
    data[0], data[-1], data[:, 0], data[:, -1] = 100, 100, 100, 100
    data[:, 20] = 100
    data[20:28, 20] = 0
    return data


def grid_message(data: np.ndarray) -> dict[str, Any]:
    """An OccupancyGrid, written out by hand."""
    height, width = data.shape
    pose = {
        "position": {"x": -1.0, "y": 2.0, "z": 0.0},
        "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
    }
    info = {"resolution": np.float32(RESOLUTION), "width": width, "height": height, "origin": pose}
    return {"header": {"frame_id": "map"}, "info": info, "data": data.ravel()}


class Robot:
    """A differential robot: follows velocities with limited accelerations, knows its walls, and nothing of lampyris."""

    def __init__(self, x: float, y: float, yaw: float, data: np.ndarray, radius: float) -> None:
        self.x, self.y, self.yaw, self.v, self.w = x, y, yaw, 0.0, 0.0
        self.wanted = (0.0, 0.0)
        self.data, self.radius = data, radius
        self.hits, self.driven, self.fastest = 0, 0.0, 0.0
        self.odometry = True

    def step(self, dt: float, a: float = 0.5, d: float = 1.0) -> None:
        v, w = self.wanted
        slower = abs(v) < abs(self.v)
        self.v += max(-(d if slower else a) * dt, min((d if slower else a) * dt, v - self.v))
        self.w += max(-3.0 * dt, min(3.0 * dt, w - self.w))
        self.x += self.v * math.cos(self.yaw) * dt
        self.y += self.v * math.sin(self.yaw) * dt
        self.yaw += self.w * dt
        self.driven += abs(self.v) * dt
        self.fastest = max(self.fastest, abs(self.v))

    def look(self) -> None:
        rows, columns = np.nonzero(self.data == 100)
        left, low = -1.0 + columns * RESOLUTION, 2.0 + rows * RESOLUTION
        dx = np.maximum(np.maximum(left - self.x, self.x - left - RESOLUTION), 0.0)
        dy = np.maximum(np.maximum(low - self.y, self.y - low - RESOLUTION), 0.0)
        self.hits += bool((dx * dx + dy * dy < self.radius * self.radius).any())


class Wire:
    """A transport of lists, with latched topics, and a world with a clock around it."""

    def __init__(self, robot: Robot | None = None, start: float = 100.0) -> None:
        self.t, self.robot = start, robot
        self.sent: list[tuple[float, str, Any]] = []
        self.receive: Any = None
        self.latched: dict[str, Any] = {}

    def open(self, topics: Any, receive: Any) -> None:
        self.receive = receive
        wanted = {topic.name for topic in topics if topic.latched and not topic.sent}
        for name, fields in self.latched.items():
            if name in wanted:
                receive(name, fields)

    def publish(self, topic: Any, fields: Any) -> None:
        self.sent.append((self.t, topic.name, fields))
        if topic.name == "/cmd_vel" and self.robot is not None:
            self.robot.wanted = (fields["linear"]["x"], fields["angular"]["z"])

    def now(self) -> float:
        return self.t

    def of(self, name: str) -> list[Any]:
        return [fields for _, topic, fields in self.sent if topic == name]

    def run(self, node: Navigator, seconds: float, until: Any = None) -> None:
        """Robot and node side by side: the robot at 100 Hz, odometry and commands at 20 Hz."""
        assert self.robot is not None
        for _ in range(round(seconds / PERIOD)):
            for _ in range(5):
                self.robot.step(PERIOD / 5)
            self.robot.look()
            self.t += PERIOD
            if self.robot.odometry:
                self.receive("/odom", odom(self.robot, self.t))
            node.tick()
            if until is not None and until():
                return


def odom(robot: Robot, t: float) -> dict[str, Any]:
    sec, part = divmod(t, 1.0)
    z, w = math.sin(robot.yaw / 2), math.cos(robot.yaw / 2)
    return {
        "header": {"stamp": {"sec": int(sec), "nanosec": int(part * 1e9)}, "frame_id": "odom"},
        "child_frame_id": "base_link",
        "pose": {
            "pose": {
                "position": {"x": robot.x, "y": robot.y, "z": 0.0},
                "orientation": {"x": 0.0, "y": 0.0, "z": z, "w": w},
            }
        },
        "twist": {"twist": {"linear": {"x": robot.v, "y": 0.0, "z": 0.0}, "angular": {"x": 0.0, "y": 0.0, "z": robot.w}}},
    }  # fmt: skip


def goal(x: float, y: float, yaw: float = 0.0) -> dict[str, Any]:
    turned = {"x": 0.0, "y": 0.0, "z": math.sin(yaw / 2), "w": math.cos(yaw / 2)}
    return {
        "header": {"frame_id": "map"},
        "pose": {"position": {"x": x, "y": y, "z": 0.0}, "orientation": turned},
    }


def started(**settings: Any) -> tuple[Navigator, Wire, Robot]:
    data = rooms()
    robot = Robot(0.0, 2.8, 2.0, data, 0.2)
    wire = Wire(robot)
    wire.latched["/map"] = grid_message(data)
    return joined(wire, **settings), wire, robot


def joined(wire: Wire, **settings: Any) -> Navigator:
    node = Navigator(lampyris.Robot(radius=0.2, v_max=0.6), NodeSettings(**settings), planner="astar")
    node.connect(wire)
    return node


def marker(x: float, y: float, radius: float, number: int = 0) -> dict[str, Any]:
    pose = goal(x, y)["pose"]
    size = {"x": 2 * radius, "y": 2 * radius, "z": 1.0}
    return {
        "header": {"frame_id": "map"},
        "ns": "people",
        "id": number,
        "type": 3,
        "action": 0,
        "pose": pose,
        "scale": size,
    }


def test_it_drives_through_the_door_to_the_goal() -> None:
    node, wire, robot = started()
    wire.run(node, 0.5)
    assert wire.of("/cmd_vel") == []  # nothing is commanded without a goal
    wire.receive("/goal_pose", goal(2.5, 2.5, 1.0))
    wire.run(node, 60.0, lambda: node.goal is None)
    assert node.outcome == "arrived"
    assert robot.hits == 0
    assert math.dist((robot.x, robot.y), (2.5, 2.5)) < 0.1
    assert abs(math.remainder(robot.yaw - 1.0, 2 * math.pi)) < 0.08
    assert 0.4 < robot.fastest <= 0.6 * 1.001  # it follows the profile, no faster than the robot may
    assert robot.driven > 3.5  # there is a way around
    path = wire.of("/plan")[-1]["poses"]
    assert path[0]["header"]["frame_id"] == "map"
    assert len(path) > 10
    profile = json.loads(wire.of("/lampyris/speed_profile")[-1]["data"])
    assert len(profile["why"]) == len(profile["v"]) > 10
    assert profile["why"][-1] == "goal"


def test_stale_odometry_stops_the_robot_within_its_braking_distance() -> None:
    node, wire, robot = started(data_timeout=0.2)
    wire.receive("/goal_pose", goal(2.5, 2.5))
    wire.run(node, 60.0, lambda: robot.v > 0.55)
    robot.odometry = False
    wire.run(node, 0.2)
    v, before = robot.v, robot.driven
    wire.run(node, 5.0)
    assert robot.v == 0.0
    assert (
        robot.driven - before <= v * 2 * PERIOD + v * v / 2.0 + 1e-9
    )  # a period until it is noticed, then d = 1 m/s2
    assert "no new /odom" in node.status
    robot.odometry = True
    wire.run(node, 60.0, lambda: node.goal is None)
    assert (node.outcome, robot.hits) == ("arrived", 0)


def test_odometry_that_repeats_itself_is_stale() -> None:
    node, wire, robot = started(data_timeout=0.2)
    wire.receive("/goal_pose", goal(2.5, 2.5))
    wire.run(node, 60.0, lambda: robot.v > 0.5)
    frozen = odom(robot, wire.t)
    robot.odometry = False
    for _ in range(40):
        wire.receive("/odom", frozen)
        wire.run(node, PERIOD)
    assert robot.v == 0.0
    assert "no new /odom" in node.status


def test_emergency_stop_and_its_release() -> None:
    node, wire, robot = started()
    wire.receive("/goal_pose", goal(2.5, 2.5))
    wire.run(node, 60.0, lambda: robot.v > 0.3)
    wire.receive("/e_stop", {"data": True})
    wire.run(node, 2.0)
    assert (robot.v, node.status) == (0.0, "stopped: emergency stop")
    wire.receive("/e_stop", {"data": False})
    wire.run(node, 60.0, lambda: node.goal is None)
    assert (node.outcome, robot.hits) == ("arrived", 0)


def test_a_restarted_node_gets_the_latched_map_and_drives_on() -> None:
    node, wire, robot = started()
    wire.receive("/goal_pose", goal(2.5, 2.5))
    wire.run(node, 60.0, lambda: robot.v > 0.3)
    robot.wanted = (0.0, 0.0)  # the base's own watchdog
    node = joined(wire)
    assert node.grid is not None
    wire.run(node, 1.0)
    assert robot.v == 0.0  # a new node has no goal
    wire.receive("/goal_pose", goal(2.5, 2.5))
    wire.run(node, 60.0, lambda: node.goal is None)
    assert (node.outcome, robot.hits) == ("arrived", 0)


@pytest.mark.nightly
def test_a_restarted_robot_with_a_new_odometry_is_driven_on() -> None:
    node, wire, robot = started(data_timeout=0.2)
    wire.receive("/goal_pose", goal(2.5, 2.5))
    wire.run(node, 60.0, lambda: robot.v > 0.3)
    robot.odometry, robot.wanted, robot.v = False, (0.0, 0.0), 0.0
    wire.run(node, 2.0)
    wire.t -= 50.0  # its clock begins again
    node._odom_at -= 50.0
    robot.odometry = True
    wire.run(node, 60.0, lambda: node.goal is None)
    assert (node.outcome, robot.hits) == ("arrived", 0)


def test_a_wall_that_appears_is_driven_around_or_stopped_for() -> None:
    node, wire, robot = started()
    wire.receive("/goal_pose", goal(2.5, 2.5))
    wire.run(node, 60.0, lambda: robot.v > 0.3)
    shut = {"x": 20, "y": 20, "width": 1, "height": 8, "data": np.full(8, 100, dtype=np.int8)}
    robot.data[20:28, 20] = 100
    wire.receive("/map_updates", shut)
    wire.run(node, 5.0)
    assert robot.v == 0.0
    assert (node.error, robot.hits) == ("NO_VALID_PATH", 0)
    robot.data[20:28, 20] = 0
    wire.receive("/map_updates", {**shut, "data": np.zeros(8, dtype=np.int8)})
    wire.run(node, 60.0, lambda: node.goal is None)
    assert (node.outcome, robot.hits) == ("arrived", 0)


def test_an_obstacle_in_the_door_is_waited_for() -> None:
    node, wire, robot = started(patience=60.0, obstacle_timeout=0.0)
    wire.receive("/goal_pose", goal(2.5, 2.5))
    wire.run(node, 60.0, lambda: robot.v > 0.2)
    wire.receive("/obstacles", {"markers": [marker(1.05, 4.4, 0.3)]})
    near = math.inf
    for _ in range(160):
        wire.run(node, PERIOD)
        near = min(near, math.dist((robot.x, robot.y), (1.05, 4.4)))
    assert 0.5 < near < 0.8  # it came close, and never touched
    assert (robot.v, node.status) == (0.0, "driving: moving obstacle")
    wire.receive("/obstacles", {"markers": []})
    wire.run(node, 60.0, lambda: node.goal is None)
    assert (node.outcome, robot.hits) == ("arrived", 0)


def test_silence_about_obstacles_stops_it() -> None:
    node, wire, robot = started(obstacle_timeout=0.5)
    wire.receive("/obstacles", {"markers": []})
    wire.receive("/goal_pose", goal(2.5, 2.5))
    wire.run(node, 3.0)
    assert robot.v == 0.0
    assert "obstacles" in node.status


def test_initial_pose_and_transforms_place_the_robot() -> None:
    node, wire, robot = started()
    robot.x, robot.y, robot.yaw = 0.0, 0.0, 0.0  # the odometry begins at zero
    wire.run(node, PERIOD)
    wire.receive(
        "/initialpose", {"header": {"frame_id": "map"}, "pose": {"pose": goal(0.5, 3.0, 1.0)["pose"]}}
    )
    assert node.pose(wire.t) == pytest.approx((0.5, 3.0, 1.0))
    turned = goal(0, 0, 0.5)["pose"]["orientation"]
    one = {
        "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": "map"}, "child_frame_id": "odom",
        "transform": {"translation": {"x": 1.0, "y": 2.0, "z": 0.0}, "rotation": turned},
    }  # fmt: skip
    wire.receive("/tf", {"transforms": [one]})
    assert node.pose(wire.t) == pytest.approx((1.0, 2.0, 0.5))


def test_questions_for_paths_have_nav2s_errors() -> None:
    node, _, _ = started()
    found = node.plan((0.0, 2.8, 0.0), (2.5, 2.5, 0.0))
    assert found.poses is not None
    assert found.error == ""
    inside = node.plan((0.0, 2.8, 0.0), (1.05, 2.5, 0.0))
    outside = node.plan((0.0, 2.8, 0.0), (50.0, 2.5, 0.0))
    assert (inside.error, outside.error) == ("GOAL_OCCUPIED", "GOAL_OUTSIDE_MAP")
    assert node.plan(None, (2.5, 2.5, 0.0)).error == "TF_ERROR"


def test_a_car_needs_a_planner_of_poses() -> None:
    with pytest.raises(SettingError, match="turn in place"):
        Navigator(lampyris.Robot(drive="ackermann", turn_radius=0.5), planner="astar")


def test_messages_that_make_no_sense_are_left_out() -> None:
    node, wire, robot = started()
    wrong = odom(robot, wire.t)
    wrong["pose"]["pose"]["position"]["x"] = math.nan
    wire.receive("/odom", wrong)
    assert node.pose(wire.t) is None
    assert "/odom left out" in node.status
    short = {**grid_message(rooms()), "data": np.zeros(3, dtype=np.int8)}
    wire.receive("/map", short)
    assert node.grid is not None
    assert "/map left out" in node.status


def _obstacle_odom(variance: float) -> dict[str, Any]:
    pose = {"pose": goal(1.0, 3.0)["pose"], "covariance": [variance] * 36}
    return {"header": {"frame_id": "map"}, "child_frame_id": "cart", "pose": pose}


_BENT = {"translation": {"x": math.nan, "y": 0.0, "z": 0.0}, "rotation": goal(0, 0)["pose"]["orientation"]}
_TRANSFORM = {
    "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": "map"},
    "child_frame_id": "odom",
    "transform": _BENT,
}


@pytest.mark.parametrize(
    ("topic", "fields"),
    [
        ("/goal_pose", goal(math.nan, 2.5)),
        ("/goal_pose", goal(2.5, math.inf)),
        ("/initialpose", {"header": {"frame_id": "map"}, "pose": {"pose": goal(math.nan, 3.0)["pose"]}}),
        ("/tf", {"transforms": [_TRANSFORM]}),
        ("/tf_static", {"transforms": [_TRANSFORM]}),
        ("/obstacles", {"markers": [marker(math.nan, 4.4, 0.3)]}),
        ("/obstacles", {"markers": [marker(1.05, 4.4, math.nan)]}),
        ("/obstacles", {"markers": [marker(1.05, 4.4, -0.3)]}),
        ("/obstacle_odom", _obstacle_odom(-1.0)),
        ("/obstacle_odom", _obstacle_odom(math.nan)),
    ],
)
def test_numbers_that_are_not_finite_are_left_out(topic: str, fields: dict[str, Any]) -> None:
    node, wire, robot = started()
    before = node.pose(wire.t)
    wire.receive(topic, fields)
    assert f"{topic} left out" in node.status
    assert (node.pose(wire.t), node.goal) == (before, None)
    wire.run(node, PERIOD)  # it goes on
    assert robot.v == 0.0


def test_obstacles_that_cannot_be_read_are_no_news() -> None:
    node, wire, robot = started(obstacle_timeout=0.5)
    wire.receive("/goal_pose", goal(2.5, 2.5))
    for _ in range(60):
        wire.receive("/obstacles", {"markers": [marker(math.nan, 4.4, 0.3)]})
        wire.run(node, PERIOD)
    assert robot.v == 0.0
    assert node._why_stop(wire.t) == "no message about obstacles for 0.5 s"


def test_the_value_that_no_occupancy_can_have_is_named() -> None:
    node, wire, _ = started()
    data = rooms()
    data[0, 0] = -7
    wire.receive("/map", grid_message(data))
    assert "value -7; allowed: -1 to 100" in node.status
