"""What carries messages: conversions of messages, and Nav2's actions with goals that are not ours."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
from test_navigator import goal, rooms, started

from lampyris.errors import UsageError
from lampyris.ros import messages
from lampyris.ros.node import rclpy_transport
from lampyris.ros.node.navigator import Navigator
from lampyris.ros.node.rclpy_transport import Nav2Actions, from_ros, to_ros


class Message:
    """A message as rclpy makes it: attributes, and their types in words."""

    kinds: dict[str, str]

    def __init__(self, **fields: Any) -> None:
        self.__dict__.update(fields)

    def get_fields_and_field_types(self) -> dict[str, str]:
        return self.kinds


class Time(Message):
    kinds = {"sec": "int32", "nanosec": "uint32"}  # noqa: RUF012


class Header(Message):
    kinds = {"stamp": "builtin_interfaces/Time", "frame_id": "string"}  # noqa: RUF012


class Xyz(Message):
    kinds = {"x": "double", "y": "double", "z": "double"}  # noqa: RUF012


class Quaternion(Message):
    kinds = {"x": "double", "y": "double", "z": "double", "w": "double"}  # noqa: RUF012


class Pose(Message):
    kinds = {"position": "geometry_msgs/Point", "orientation": "geometry_msgs/Quaternion"}  # noqa: RUF012


class PoseStamped(Message):
    kinds = {"header": "std_msgs/Header", "pose": "geometry_msgs/Pose"}  # noqa: RUF012

    def __init__(self, x: float = 0.0, y: float = 0.0, yaw: float = 0.0) -> None:
        at = messages.pose(x, y, yaw)
        super().__init__(
            header=Header(stamp=Time(sec=0, nanosec=0), frame_id=""),
            pose=Pose(position=Xyz(**at["position"]), orientation=Quaternion(**at["orientation"])),
        )


class Grid(Message):
    kinds = {"data": "sequence<int8>"}  # noqa: RUF012


class PathMessage(Message):
    kinds = {"header": "std_msgs/Header", "poses": "sequence<geometry_msgs/PoseStamped>"}  # noqa: RUF012

    def __init__(self) -> None:
        super().__init__(header=Header(stamp=Time(sec=0, nanosec=0), frame_id=""), poses=[])


class Result:
    """Of ComputePathToPose and FollowPath, with the codes of Nav2."""

    UNKNOWN, TF_ERROR, GOAL_OCCUPIED, NO_VALID_PATH, INVALID_PATH = 200, 202, 206, 208, 103

    def __init__(self) -> None:
        self.path, self.planning_time, self.error_code, self.error_msg = (
            PathMessage(),
            Time(sec=-1, nanosec=0),
            0,
            "",
        )


class Goal:
    """A goal handle."""

    def __init__(self, **request: Any) -> None:
        self.request = SimpleNamespace(**request)
        self.is_cancel_requested, self.ended, self.feedback = False, "", []

    def succeed(self) -> None:
        self.ended = "succeeded"

    def abort(self) -> None:
        self.ended = "aborted"

    def canceled(self) -> None:
        self.ended = "cancelled"

    def publish_feedback(self, feedback: Any) -> None:
        self.feedback.append((feedback.distance_to_goal, feedback.speed))


class Loop:
    """In place of rclpy's transport: each call from an action lets the world go on for a while."""

    def __init__(self, node: Navigator, wire: Any) -> None:
        self.node, self.wire = node, wire

    def within(self, do: Any) -> Any:
        self.wire.run(self.node, 0.5)
        return do()

    def now(self) -> float:
        return float(self.wire.t)


@pytest.fixture
def classes(monkeypatch: pytest.MonkeyPatch) -> None:
    from lampyris.ros.node import rclpy_transport

    monkeypatch.setattr(
        rclpy_transport, "message_class", lambda kind: {"geometry_msgs/msg/PoseStamped": PoseStamped}[kind]
    )


@pytest.mark.usefixtures("classes")
def test_fields_become_messages_and_come_back() -> None:
    path = messages.path(1.5, np.array([[0.0, 1.0, 0.5], [2.0, 3.0, -0.5]]))
    made = to_ros(PathMessage(), path)
    assert [one.pose.position.y for one in made.poses] == [1.0, 3.0]
    assert from_ros(made) == path
    data = to_ros(Grid(), {"data": np.array([-1, 0, 100], dtype=np.int8)}).data
    assert (data.typecode, data.tolist()) == ("b", [-1, 0, 100])


@pytest.mark.usefixtures("classes")
def test_nav2s_actions_plan() -> None:
    node, wire, _ = started()
    actions = Nav2Actions(node, Loop(node, wire))
    asked, result = Goal(goal=PoseStamped(2.5, 2.5), start=PoseStamped(0.0, 2.8), use_start=True), Result()
    actions.compute_path(asked, result)
    assert (asked.ended, result.error_code) == ("succeeded", 0)
    assert len(result.path.poses) > 10
    assert result.planning_time.sec >= 0
    through = Goal(goals=[PoseStamped(0.5, 4.4), PoseStamped(2.5, 2.5)], start=PoseStamped(), use_start=False)
    actions.compute_path_through(through, result)
    assert through.ended == "succeeded"
    assert min(abs(p.pose.position.x - 0.5) + abs(p.pose.position.y - 4.4) for p in result.path.poses) < 0.15
    walled, result = Goal(goal=PoseStamped(1.05, 2.5), start=PoseStamped(), use_start=False), Result()
    actions.compute_path(walled, result)
    assert (walled.ended, result.error_code) == ("aborted", Result.GOAL_OCCUPIED)
    assert result.error_msg
    none, result = Goal(goals=[], start=PoseStamped(), use_start=False), Result()
    actions.compute_path_through(none, result)
    assert (none.ended, result.error_msg) == ("aborted", "no goals were given")


@pytest.mark.usefixtures("classes")
def test_nav2s_actions_heed_the_frame_of_a_pose() -> None:
    node, wire, _ = started()
    actions = Nav2Actions(node, Loop(node, wire))
    there = PoseStamped(2.5, 2.5)
    there.header.frame_id = "somewhere"
    asked, result = Goal(goal=there, start=PoseStamped(), use_start=False), Result()
    actions.compute_path(asked, result)
    assert (asked.ended, result.error_code) == ("aborted", Result.TF_ERROR)
    assert "somewhere" in result.error_msg
    line = PathMessage()
    line.poses = [PoseStamped(0.0, 2.8 + 0.1 * k, 1.5708) for k in range(12)]
    line.poses[3].header.frame_id = "somewhere"
    followed, result = Goal(path=line), Result()
    actions.follow_path(followed, result)
    assert followed.ended == "aborted"
    assert "somewhere" in result.error_msg


@pytest.mark.usefixtures("classes")
def test_nav2s_follow_path_drives_and_is_cancelled() -> None:
    node, wire, robot = started()
    actions = Nav2Actions(node, Loop(node, wire), lambda: SimpleNamespace(distance_to_goal=0.0, speed=0.0))
    line = PathMessage()
    line.poses = [PoseStamped(0.0, 2.8 + 0.1 * k, 1.5708) for k in range(12)]
    asked = Goal(path=line)
    actions.follow_path(asked, Result())
    assert (asked.ended, robot.hits) == ("succeeded", 0)
    assert abs(robot.y - 3.9) < 0.1
    assert abs(robot.x) < 0.05
    left = [distance for distance, _ in asked.feedback]
    assert left == sorted(left, reverse=True)
    assert max(speed for _, speed in asked.feedback) > 0.3
    again = Goal(path=line)
    again.is_cancel_requested = True
    actions.follow_path(again, Result())
    assert again.ended == "cancelled"
    empty = Goal(path=PathMessage())
    actions.follow_path(empty, Result())
    assert empty.ended == "aborted"


@pytest.mark.usefixtures("classes")
def test_a_goal_that_replaces_a_followed_path_aborts_it() -> None:
    """The old action must not report the arrival of the new goal as its own."""
    node, wire, robot = started()

    class Interrupted(Loop):
        calls = 0

        def within(self, do: Any) -> Any:
            self.calls += 1
            if self.calls == 4:
                wire.receive("/goal_pose", goal(0.0, 2.8))
            return super().within(do)

    line = PathMessage()
    line.poses = [PoseStamped(0.0, 2.8 + 0.1 * k, 1.5708) for k in range(12)]
    asked, result = Goal(path=line), Result()
    Nav2Actions(node, Interrupted(node, wire)).follow_path(asked, result)
    assert (asked.ended, result.error_code) == ("aborted", Result.UNKNOWN)
    assert "replaced" in result.error_msg
    wire.run(node, 20.0, lambda: node.goal is None)
    assert (node.outcome, robot.hits) == ("arrived", 0)


def test_waiting_requests_leave_a_thread_to_receive_the_map(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rclpy_transport, "MAP_WAIT", 30.0)
    came, node = threading.Event(), Mock(grid=None)
    wire = Mock(within=lambda do: do() and not came.is_set())

    def asked() -> None:
        rclpy_transport.await_map(node, wire)

    with ThreadPoolExecutor(rclpy_transport.THREADS) as pool:
        requests = [pool.submit(asked) for _ in range(rclpy_transport.THREADS)]
        pool.submit(came.set)
        for request in requests:
            request.result(timeout=20.0)


def test_services_are_refused_without_rclpy_and_the_reason_is_said() -> None:
    from lampyris.ros.node.dds_transport import DdsTransport

    with pytest.raises(UsageError, match="answers do not cross"):
        DdsTransport.serve(object.__new__(DdsTransport), None)


def test_cyclone_carries_what_rosbags_means() -> None:
    pytest.importorskip("rosbags", reason="the extra ros is not installed")
    pytest.importorskip("cyclonedds", reason="the extra ros-live is not installed")
    from lampyris.ros.node.dds_transport import from_dds, idl_type, to_dds
    from lampyris.ros.stores import build, typestore

    store = typestore()
    for kind, fields in (
        (messages.PATH, messages.path(1.25, np.array([[0.0, 1.0, 0.5]]))),
        (messages.TWIST, messages.twist(0.5, -0.25)),
        (
            messages.GRID_UPDATE,
            {"x": 1, "y": 2, "width": 1, "height": 2, "data": np.array([0, 100], dtype=np.int8)},
        ),
        (messages.MARKERS, {"markers": [messages.obstacle_marker(2.0, 7, 1.0, 2.0, 0.0, 0.3)]}),
    ):
        ours = to_dds(kind, fields)
        theirs = store.serialize_cdr(build(store, kind, fields), kind)
        back = from_dds(idl_type(kind).deserialize(bytes(theirs)))
        assert back == from_dds(idl_type(kind).deserialize(ours.serialize(use_version_2=False)))
        assert bytes(theirs)[4:] == ours.serialize(use_version_2=False)[4:]


def test_goal_message_is_in_the_map() -> None:
    """A goal in a frame that nothing leads from is left out, and said."""
    node, wire, _ = started()
    lost = goal(2.5, 2.5)
    lost["header"] = {"frame_id": "moon"}
    wire.receive("/goal_pose", lost)
    assert node.goal is None
    assert "moon" in node.status
    assert rooms().shape == (30, 41)
