"""The node with rclpy, the robot's own ROS 2: topics, the service GetPlan, and Nav2's actions where its types are there."""

from __future__ import annotations

import array
import importlib
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from lampyris.ros import messages
from lampyris.ros.messages import Fields, pose_of
from lampyris.ros.topics import Topic

if TYPE_CHECKING:
    from lampyris.ros.navigator import Navigator, PlanAnswer

PLAN_SERVICE = "/lampyris/get_plan"


def installed() -> bool:
    """Whether rclpy can be imported."""
    from importlib.util import find_spec

    return find_spec("rclpy") is not None


def message_class(kind: str) -> Any:
    """The class of a type of messages."""
    package, sub, name = kind.split("/")
    return getattr(importlib.import_module(f"{package}.{sub}"), name)


def to_ros(made: Any, fields: Fields) -> Any:
    """Set fields of a message, which is returned; those that are left out stay as they are."""
    kinds = made.get_fields_and_field_types()
    for name, value in fields.items():
        kind = kinds[name]
        if kind.startswith("sequence<") or kind.endswith("]"):
            inner = kind.removeprefix("sequence<").partition(">")[0].partition(",")[0].partition("[")[0]
            if "/" in inner:
                package, _, short = inner.partition("/")
                of = message_class(f"{package}/msg/{short}")
                setattr(made, name, [to_ros(of(), one) for one in value])
            elif isinstance(value, np.ndarray) and value.dtype == np.int8:
                setattr(made, name, array.array("b", value.tobytes()))
            else:
                setattr(made, name, [float(one) if inner in ("double", "float") else one for one in value])
        elif "/" in kind:
            to_ros(getattr(made, name), value)
        else:
            setattr(made, name, float(value) if kind in ("double", "float") else value)
    return made


def from_ros(message: Any) -> Any:
    """Plain fields of a message; arrays of numbers stay arrays."""
    if hasattr(message, "get_fields_and_field_types"):
        return {name: from_ros(getattr(message, name)) for name in message.get_fields_and_field_types()}
    return [from_ros(one) for one in message] if isinstance(message, list) else message


class RclpyTransport:
    """Topics, services and actions by rclpy.

    Parameters
    ----------
    name : of the node.
    """

    services = True

    def __init__(self, name: str = "lampyris") -> None:
        import rclpy  # type: ignore[import-not-found, unused-ignore]
        from rclpy.signals import SignalHandlerOptions  # type: ignore[import-not-found, unused-ignore]

        self._rclpy = rclpy
        if not rclpy.ok():
            rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
        self.node = rclpy.create_node(name)
        self._publishers: dict[str, Any] = {}
        self._servers: list[Any] = []
        self._executor: Any = None
        self.offered: list[str] = []

    def open(self, topics: tuple[Topic, ...], receive: Callable[[str, Fields], None]) -> None:
        """See :class:`lampyris.ros.topics.Transport`; a topic whose type is not installed is left out with a note."""
        for topic in topics:
            try:
                kind = message_class(topic.kind)
            except ImportError:
                self.node.get_logger().warning(f"{topic.name} left out: {topic.kind} is not installed")
                continue
            if topic.sent:
                self._publishers[topic.name] = self.node.create_publisher(kind, topic.name, self._qos(topic))
            else:
                self.node.create_subscription(kind, topic.name, _receiver(topic.name, receive), self._qos(topic))

    def _qos(self, topic: Topic) -> Any:
        qos = importlib.import_module("rclpy.qos")
        return qos.QoSProfile(
            depth=topic.depth,
            reliability=qos.ReliabilityPolicy.RELIABLE if topic.reliable else qos.ReliabilityPolicy.BEST_EFFORT,
            durability=qos.DurabilityPolicy.TRANSIENT_LOCAL if topic.latched else qos.DurabilityPolicy.VOLATILE,
        )

    def publish(self, topic: Topic, fields: Fields) -> None:
        """See :class:`lampyris.ros.topics.Transport`."""
        publisher = self._publishers.get(topic.name)
        if publisher is not None:
            publisher.publish(to_ros(publisher.msg_type(), fields))

    def now(self) -> float:
        """Seconds of the node's clock."""
        return 1e-9 * float(self.node.get_clock().now().nanoseconds)

    def spin(self, seconds: float) -> None:
        """Take in what arrives until some seconds are over, or something has."""
        if self._executor is None:
            executors = importlib.import_module("rclpy.executors")
            self._executor = executors.SingleThreadedExecutor()
            self._executor.add_node(self.node)
        self._executor.spin_once(timeout_sec=seconds)

    def serve(self, navigator: Navigator) -> None:
        """Offer nav_msgs/srv/GetPlan, and Nav2's actions if nav2_msgs can be imported; ``offered`` names them."""
        services = importlib.import_module("nav_msgs.srv")

        def get_plan(request: Any, response: Any) -> Any:
            start, goal = pose_of(from_ros(request.start.pose)), pose_of(from_ros(request.goal.pose))
            given = bool(request.start.header.frame_id)
            answer = navigator.plan(start if given else None, goal, now=self.now())
            if answer.poses is not None:
                to_ros(response.plan, messages.path(self.now(), answer.poses))
            else:
                self.node.get_logger().warning(f"no path: {answer.detail}")
            return response

        self._servers.append(self.node.create_service(services.GetPlan, PLAN_SERVICE, get_plan))
        self.offered.append(f"{PLAN_SERVICE} (nav_msgs/srv/GetPlan)")
        try:
            actions = importlib.import_module("nav2_msgs.action")
        except ImportError:
            return
        server = importlib.import_module("rclpy.action").ActionServer
        handlers = Nav2Actions(navigator, self)
        for name, kind, handle in (
            ("compute_path_to_pose", "ComputePathToPose", handlers.compute_path),
            ("compute_path_through_poses", "ComputePathThroughPoses", handlers.compute_path_through),
            ("follow_path", "FollowPath", handlers.follow_path),
        ):
            self._servers.append(server(self.node, getattr(actions, kind), name, _executing(getattr(actions, kind), handle)))
            self.offered.append(f"{name} (nav2_msgs/action/{kind})")

    def close(self) -> None:
        """Leave the graph."""
        self.node.destroy_node()
        if self._rclpy.ok():
            self._rclpy.shutdown()


def _receiver(name: str, receive: Callable[[str, Fields], None]) -> Callable[[Any], None]:
    return lambda message: receive(name, from_ros(message))


def _executing(kind: Any, handle: Callable[[Any, Any], None]) -> Callable[[Any], Any]:
    """An execute callback that fills a result."""

    def execute(goal: Any) -> Any:
        result = kind.Result()
        handle(goal, result)
        return result

    return execute


class Nav2Actions:
    """What Nav2's actions ask for, done by the core. Goal handles and results are those of the robot's own nav2_msgs.

    Parameters
    ----------
    navigator : the core.
    transport : its transport.
    """

    def __init__(self, navigator: Navigator, transport: Any) -> None:
        self._navigator, self._transport = navigator, transport

    def compute_path(self, goal: Any, result: Any) -> None:
        """ComputePathToPose."""
        request = goal.request
        start = pose_of(from_ros(request.start.pose)) if request.use_start else None
        self._answer(goal, result, start, [pose_of(from_ros(request.goal.pose))])

    def compute_path_through(self, goal: Any, result: Any) -> None:
        """ComputePathThroughPoses; ``goals`` is a list of PoseStamped, or since Kilted nav_msgs/Goals."""
        request = goal.request
        goals = getattr(request.goals, "goals", request.goals)
        start = pose_of(from_ros(request.start.pose)) if request.use_start else None
        self._answer(goal, result, start, [pose_of(from_ros(one.pose)) for one in goals])

    def _answer(self, goal: Any, result: Any, start: Any, goals: list[Any]) -> None:
        began = time.monotonic()
        answer = self._navigator.plan(start, goals[-1], goals[:-1], now=self._transport.now())
        took = time.monotonic() - began
        to_ros(result.planning_time, messages.stamp(took))
        if answer.poses is not None:
            to_ros(result.path, messages.path(self._transport.now(), answer.poses))
            goal.succeed()
            return
        _fail(goal, result, answer)

    def follow_path(self, goal: Any, result: Any) -> None:
        """FollowPath: the core drives at its own rate; this waits and gives feedback.

        The executor is at work in this call, so messages are taken in and commands given from here.
        """
        poses = np.array([pose_of(from_ros(one.pose)) for one in goal.request.path.poses]).reshape(-1, 3)
        navigator = self._navigator
        if len(poses) < 2:
            from lampyris.ros.navigator import PlanAnswer

            _fail(goal, result, PlanAnswer(None, "INVALID_PATH", f"a path of {len(poses)} poses"))
            return
        navigator.follow(poses)
        watch = threading.Event()
        while navigator.goal is not None:
            if goal.is_cancel_requested:
                navigator.cancel()
                navigator.stop()
                goal.canceled()
                return
            if navigator.error:
                from lampyris.ros.navigator import PlanAnswer

                _fail(goal, result, PlanAnswer(None, navigator.error, navigator.status))
                navigator.cancel()
                return
            watch.wait(0.1)
        goal.succeed() if navigator.outcome == "arrived" else goal.abort()


def _fail(goal: Any, result: Any, answer: PlanAnswer) -> None:
    """Abort with Nav2's error code, where the robot's own version of Nav2 has it."""
    code = getattr(type(result), answer.error, getattr(type(result), "UNKNOWN", None))
    if code is not None and hasattr(result, "error_code"):
        result.error_code = code
    if hasattr(result, "error_msg"):
        result.error_msg = answer.detail
    goal.abort()
