"""The node with rclpy, the robot's own ROS 2: topics, the service GetPlan, and Nav2's actions where its types are there."""

from __future__ import annotations

import array
import importlib
import queue
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from lampyris.errors import InputError, UsageError
from lampyris.ros import messages
from lampyris.ros.messages import Fields
from lampyris.ros.node.plan_answer import PlanAnswer
from lampyris.ros.node.topics import Topic

if TYPE_CHECKING:
    from lampyris.ros.node.navigator import Navigator

PLAN_SERVICE = "/lampyris/get_plan"
MAP_WAIT = 5.0
"""Seconds that a request waits for the first map."""
THREADS = 3
"""Of rclpy, for messages and requests."""
_waiters = threading.BoundedSemaphore(THREADS - 1)
"""Requests that may wait for the first map: one thread is left to receive it."""
T = TypeVar("T")


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
        try:
            rclpy, signals = importlib.import_module("rclpy"), importlib.import_module("rclpy.signals")
        except ImportError as fault:
            what = str(fault).splitlines()[0]
            raise UsageError(
                "EXTRA", f"rclpy is installed and cannot be imported: {what}",
                todo="source the setup file of the robot's ROS 2, or --transport dds",
            ) from None  # fmt: skip
        self._rclpy = rclpy
        if not rclpy.ok():
            rclpy.init(args=[], signal_handler_options=signals.SignalHandlerOptions.NO)
        self.node = rclpy.create_node(name)
        self._publishers: dict[str, Any] = {}
        self._servers: list[Any] = []
        self._inbox: queue.SimpleQueue[Callable[[], object]] = queue.SimpleQueue()
        self._executor: Any = None
        self._thread: threading.Thread | None = None
        self.offered: list[str] = []

    def open(self, topics: tuple[Topic, ...], receive: Callable[[str, Fields], None]) -> None:
        """See :class:`lampyris.ros.node.topics.Transport`; a topic whose type is not installed is left out with a note."""
        for topic in topics:
            try:
                kind = message_class(topic.kind)
            except ImportError:
                self.node.get_logger().warning(f"{topic.name} left out: {topic.kind} is not installed")
                continue
            if topic.sent:
                self._publishers[topic.name] = self.node.create_publisher(kind, topic.name, self._qos(topic))
            else:
                self.node.create_subscription(
                    kind, topic.name, self._receiver(topic.name, receive), self._qos(topic)
                )

    def _qos(self, topic: Topic) -> Any:
        qos = importlib.import_module("rclpy.qos")
        return qos.QoSProfile(
            depth=topic.depth,
            reliability=qos.ReliabilityPolicy.RELIABLE
            if topic.reliable
            else qos.ReliabilityPolicy.BEST_EFFORT,
            durability=qos.DurabilityPolicy.TRANSIENT_LOCAL
            if topic.latched
            else qos.DurabilityPolicy.VOLATILE,
        )

    def publish(self, topic: Topic, fields: Fields) -> None:
        """See :class:`lampyris.ros.node.topics.Transport`."""
        publisher = self._publishers.get(topic.name)
        if publisher is not None:
            publisher.publish(to_ros(publisher.msg_type(), fields))

    def now(self) -> float:
        """Seconds of the node's clock."""
        return 1e-9 * float(self.node.get_clock().now().nanoseconds)

    def _receiver(self, name: str, receive: Callable[[str, Fields], None]) -> Callable[[Any], None]:
        return lambda message: self._inbox.put(lambda: receive(name, from_ros(message)))

    def spin(self, seconds: float) -> None:
        """Do what has arrived until some seconds are over, or something has.

        rclpy waits in a thread of its own, which fills an inbox, so that an action that lasts does not hold up the rest; the
        core is called from here alone.
        """
        if self._thread is None:
            executors = importlib.import_module("rclpy.executors")
            self._executor = executors.MultiThreadedExecutor(num_threads=THREADS)
            self._executor.add_node(self.node)
            self._thread = threading.Thread(target=self._executor.spin, daemon=True)
            self._thread.start()
        try:
            self._inbox.get(timeout=max(seconds, 0.0) or 1e-4)()
            while True:
                self._inbox.get_nowait()()
        except queue.Empty:
            pass

    def within(self, do: Callable[[], T]) -> T:
        """Have something done where :meth:`spin` is called, and wait for what it returns."""
        done: Future[T] = Future()

        def call() -> None:
            try:
                done.set_result(do())
            except BaseException as fault:
                done.set_exception(fault)

        self._inbox.put(call)
        return done.result()

    def serve(self, navigator: Navigator) -> None:
        """Offer nav_msgs/srv/GetPlan, and Nav2's actions if nav2_msgs can be imported; ``offered`` names them."""
        services = importlib.import_module("nav_msgs.srv")

        def get_plan(request: Any, response: Any) -> Any:
            start = from_ros(request.start) if request.start.header.frame_id else None
            goals = [from_ros(request.goal)]
            await_map(navigator, self)
            answer = self.within(lambda: navigator.answer(start, goals))
            if answer.poses is not None:
                to_ros(response.plan, messages.path(self.now(), answer.poses))
            else:
                self.node.get_logger().warning(f"no path: {answer.detail}")
            return response

        group = importlib.import_module("rclpy.callback_groups").ReentrantCallbackGroup()
        self._servers.append(
            self.node.create_service(services.GetPlan, PLAN_SERVICE, get_plan, callback_group=group)
        )
        self.offered.append(f"{PLAN_SERVICE} (nav_msgs/srv/GetPlan)")
        try:
            actions = importlib.import_module("nav2_msgs.action")
        except ImportError:
            return
        server = importlib.import_module("rclpy.action").ActionServer
        handlers = Nav2Actions(navigator, self, actions.FollowPath.Feedback)
        for name, kind, handle in (
            ("compute_path_to_pose", "ComputePathToPose", handlers.compute_path),
            ("compute_path_through_poses", "ComputePathThroughPoses", handlers.compute_path_through),
            ("follow_path", "FollowPath", handlers.follow_path),
        ):
            of = getattr(actions, kind)
            made = server(
                self.node, of, name, _executing(of, handle), callback_group=group,
                cancel_callback=lambda _: importlib.import_module("rclpy.action").CancelResponse.ACCEPT,
            )  # fmt: skip
            self._servers.append(made)
            self.offered.append(f"{name} (nav2_msgs/action/{kind})")

    def close(self) -> None:
        """Leave the graph."""
        if self._executor is not None:
            self._executor.shutdown()
        if self._thread is not None:
            self._thread.join(timeout=2.0)
        self.node.destroy_node()
        if self._rclpy.ok():
            self._rclpy.shutdown()


def await_map(navigator: Navigator, transport: Any) -> None:
    """Wait for the first map, not for long: a client can ask before a latched map has come to a node that has just begun."""
    if not _waiters.acquire(blocking=False):
        return
    try:
        end = time.monotonic() + MAP_WAIT
        while transport.within(lambda: navigator.grid is None) and time.monotonic() < end:
            time.sleep(0.05)
    finally:
        _waiters.release()


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
    feedback : the class of FollowPath's feedback; None: none is given.
    """

    def __init__(
        self, navigator: Navigator, transport: Any, feedback: Callable[[], Any] | None = None
    ) -> None:
        self._navigator, self._transport, self._feedback = navigator, transport, feedback

    def compute_path(self, goal: Any, result: Any) -> None:
        """ComputePathToPose."""
        self._answer(goal, result, [goal.request.goal])

    def compute_path_through(self, goal: Any, result: Any) -> None:
        """ComputePathThroughPoses; ``goals`` is a list of PoseStamped, or since Kilted nav_msgs/Goals."""
        goals = goal.request.goals
        self._answer(goal, result, getattr(goals, "goals", goals))

    def _answer(self, goal: Any, result: Any, goals: Sequence[Any]) -> None:
        began = time.monotonic()
        start = from_ros(goal.request.start) if goal.request.use_start else None
        asked = [from_ros(one) for one in goals]
        await_map(self._navigator, self._transport)
        answer = self._transport.within(lambda: self._navigator.answer(start, asked))
        took = time.monotonic() - began
        to_ros(result.planning_time, messages.stamp(took))
        if answer.poses is not None:
            to_ros(result.path, messages.path(self._transport.now(), answer.poses))
            goal.succeed()
            return
        _fail(goal, result, answer)

    def follow_path(self, goal: Any, result: Any) -> None:
        """FollowPath: the core drives at its own rate; this waits for it, and gives feedback."""
        navigator, within = self._navigator, self._transport.within
        asked = [from_ros(one) for one in goal.request.path.poses]
        if len(asked) < 2:
            _fail(goal, result, PlanAnswer(None, "INVALID_PATH", f"a path of {len(asked)} poses"))
            return
        await_map(navigator, self._transport)
        try:
            poses = np.array(within(lambda: [navigator.in_map(one) for one in asked]))
        except InputError as refused:
            _fail(
                goal,
                result,
                PlanAnswer(None, "TF_ERROR" if refused.code == "FRAME" else "INVALID_PATH", str(refused)),
            )
            return
        mine = within(lambda: navigator.follow(poses))
        while True:
            goal_left, error, outcome, latest = within(
                lambda: (navigator.goal is not None, navigator.error, navigator.outcome, navigator.goals)
            )
            if latest != mine:
                _fail(goal, result, PlanAnswer(None, "UNKNOWN", "another goal has replaced this one"))
                return
            if goal.is_cancel_requested:
                within(navigator.cancel)
                within(navigator.stop)
                goal.canceled()
                return
            if error:
                detail = within(lambda: navigator.status)
                within(navigator.cancel)
                _fail(goal, result, PlanAnswer(None, error, detail))
                return
            if not goal_left:
                break
            self._report(goal)
            time.sleep(0.1)
        if outcome == "arrived":
            goal.succeed()
        else:
            _fail(goal, result, PlanAnswer(None, "UNKNOWN", f"the goal was dropped: {outcome}"))

    def _report(self, goal: Any) -> None:
        """FollowPath's feedback; its fields differ between distributions."""
        if self._feedback is None:
            return
        made = self._feedback()
        for name, value in (
            ("distance_to_goal", self._navigator.left),
            ("speed", abs(self._navigator.last.v)),
        ):
            if hasattr(made, name):
                setattr(made, name, float(value))
        goal.publish_feedback(made)


def _fail(goal: Any, result: Any, answer: PlanAnswer) -> None:
    """Abort with Nav2's error code, where the robot's own version of Nav2 has it."""
    code = getattr(type(result), answer.error, getattr(type(result), "UNKNOWN", None))
    if code is not None and hasattr(result, "error_code"):
        result.error_code = code
    if hasattr(result, "error_msg"):
        result.error_msg = answer.detail
    goal.abort()
