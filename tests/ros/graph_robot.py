"""A small robot of ROS 2 on rclpy, with nothing of lampyris: two rooms, a base that follows /cmd_vel, clients that ask.

A process of its own. Commands come as JSON lines on standard input, answers go out as JSON lines.
"""

from __future__ import annotations

import json
import math
import sys
import threading
import time
from typing import Any

import rclpy
from action_msgs.msg import GoalStatus
from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import OccupancyGrid, Odometry, Path
from nav_msgs.srv import GetPlan
from rclpy.action import ActionClient
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import String

LATCHED = QoSProfile(
    depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
)
WIDTH, HEIGHT, CELL, LEFT, LOW, RADIUS = 41, 30, 0.1, -1.0, 2.0, 0.2
RATE, DRAG = 50.0, 1.0
WATCHDOG = 0.5
"""Seconds without a command after which the base brakes by itself."""


def rooms() -> list[int]:
    """Two rooms with a door of 0.8 m."""
    cells = []
    for y in range(HEIGHT):
        for x in range(WIDTH):
            edge = x in (0, WIDTH - 1) or y in (0, HEIGHT - 1)
            cells.append(100 if edge or (x == 20 and not 20 <= y < 28) else 0)
    return cells


class Robot(Node):  # type: ignore[misc]
    """The base, its odometry, and what it has heard."""

    def __init__(self, x: float, y: float, yaw: float) -> None:
        super().__init__("robot")
        self.x, self.y, self.yaw, self.v, self.w = x, y, yaw, 0.0, 0.0
        self.wanted, self.heard = (0.0, 0.0), -math.inf
        self.odometry, self.cells = True, rooms()
        self.hits = self.commands = self.paths = 0
        self.driven = self.fastest = 0.0
        self.status: list[str] = []
        self.sent_at: list[float] = []
        self.latency: list[float] = []
        self.latest: Path | None = None
        # So deep that odometry on its way out does not wait for a slow reader.
        self.out = self.create_publisher(Odometry, "/odom", 10)
        self.map = self.create_publisher(OccupancyGrid, "/map", LATCHED)
        self.goals = self.create_publisher(PoseStamped, "/goal_pose", 5)
        self.create_subscription(Twist, "/cmd_vel", self.on_command, 10)
        self.create_subscription(Path, "/plan", self.on_plan, 5)
        self.create_subscription(String, "/lampyris/status", self.on_status, LATCHED)
        self.create_timer(1.0 / RATE, self.step)
        self.last = time.monotonic()
        grid = OccupancyGrid()
        grid.header.frame_id = "map"
        grid.info.resolution, grid.info.width, grid.info.height = CELL, WIDTH, HEIGHT
        grid.info.origin.position.x, grid.info.origin.position.y = LEFT, LOW
        grid.info.origin.orientation.w = 1.0
        grid.data = self.cells
        self.map.publish(grid)

    def on_command(self, message: Twist) -> None:
        now = time.monotonic()
        self.wanted, self.heard = (message.linear.x, message.angular.z), now
        self.commands += 1
        if self.sent_at:
            self.latency.append(now - self.sent_at.pop())
            self.sent_at.clear()

    def on_plan(self, message: Path) -> None:
        self.paths += 1
        self.latest = message

    def on_status(self, message: String) -> None:
        self.status.append(json.loads(message.data)["status"])

    def step(self) -> None:
        now = time.monotonic()
        dt, self.last = min(now - self.last, 0.1), now
        v, w = self.wanted if now - self.heard < WATCHDOG else (0.0, 0.0)
        rate = DRAG if abs(v) < abs(self.v) else 0.5
        self.v += max(-rate * dt, min(rate * dt, v - self.v))
        self.w += max(-3.0 * dt, min(3.0 * dt, w - self.w))
        self.x += self.v * math.cos(self.yaw) * dt
        self.y += self.v * math.sin(self.yaw) * dt
        self.yaw += self.w * dt
        self.driven += abs(self.v) * dt
        self.fastest = max(self.fastest, abs(self.v))
        self.hits += self.touches()
        if self.odometry:
            made = Odometry()
            made.header.stamp = self.get_clock().now().to_msg()
            made.header.frame_id, made.child_frame_id = "odom", "base_link"
            made.pose.pose.position.x, made.pose.pose.position.y = self.x, self.y
            made.pose.pose.orientation.z = math.sin(self.yaw / 2)
            made.pose.pose.orientation.w = math.cos(self.yaw / 2)
            made.twist.twist.linear.x, made.twist.twist.angular.z = self.v, self.w
            self.sent_at.append(time.monotonic())
            self.out.publish(made)

    def touches(self) -> bool:
        for k, cell in enumerate(self.cells):
            if cell:
                x, y = LEFT + CELL * (k % WIDTH), LOW + CELL * (k // WIDTH)
                dx = max(x - self.x, self.x - x - CELL, 0.0)
                dy = max(y - self.y, self.y - y - CELL, 0.0)
                if dx * dx + dy * dy < RADIUS * RADIUS:
                    return True
        return False

    def state(self) -> dict[str, Any]:
        late = sorted(self.latency)
        return {
            "x": self.x, "y": self.y, "v": self.v, "wanted": self.wanted[0], "hits": self.hits,
            "commands": self.commands, "paths": self.paths, "driven": self.driven, "fastest": self.fastest,
            "silent": time.monotonic() - self.heard, "status": self.status[-1] if self.status else "",
            "median_ms": 1e3 * late[len(late) // 2] if late else None,
            "p95_ms": 1e3 * late[int(0.95 * len(late))] if late else None,
        }  # fmt: skip


def pose(x: float, y: float, frame: str = "map") -> PoseStamped:
    made = PoseStamped()
    made.header.frame_id = frame
    made.pose.position.x, made.pose.position.y, made.pose.orientation.w = x, y, 1.0
    return made


def along(points: list[list[float]]) -> Path:
    made = Path()
    made.header.frame_id = "map"
    for (x, y), (to_x, to_y) in zip(points, [*points[1:], *points[-1:]], strict=True):
        one = pose(x, y)
        yaw = math.atan2(to_y - y, to_x - x) if (x, y) != (to_x, to_y) else one.pose.orientation.z
        one.pose.orientation.z, one.pose.orientation.w = math.sin(yaw / 2), math.cos(yaw / 2)
        made.poses.append(one)
    if len(points) > 1:
        made.poses[-1].pose.orientation = made.poses[-2].pose.orientation
    return made


def wait(future: Any, seconds: float) -> Any:
    """The result of a future that another thread fills; None: it is not there in time."""
    end = time.monotonic() + seconds
    while not future.done() and time.monotonic() < end:
        time.sleep(0.01)
    return future.result() if future.done() else None


class Asker:
    """Clients of the node's service and of Nav2's actions."""

    def __init__(self, node: Node) -> None:
        self.node = node
        self.clients: dict[str, Any] = {}
        self.running: dict[str, Any] = {}

    def plan(self, x: float, y: float) -> Any:
        client = self.node.create_client(GetPlan, "/lampyris/get_plan")
        if not client.wait_for_service(timeout_sec=20.0):
            return "no service"
        request = GetPlan.Request()
        request.goal = pose(x, y)
        answer = wait(client.call_async(request), 60.0)
        return None if answer is None else len(answer.plan.poses)

    def send(self, tag: str, kind: str, goal: dict[str, Any]) -> Any:
        """Give a goal to an action; what comes of it is asked for by its tag."""
        import nav2_msgs.action as actions

        of = getattr(actions, kind)
        name = {"ComputePathToPose": "compute_path_to_pose", "FollowPath": "follow_path"}.get(
            kind, "compute_path_through_poses"
        )
        if name not in self.clients:
            self.clients[name] = ActionClient(self.node, of, name)
        client = self.clients[name]
        if not client.wait_for_server(timeout_sec=20.0):
            return "no server"
        made = of.Goal()
        if kind == "FollowPath":
            made.path = along(goal["path"])
        elif kind == "ComputePathToPose":
            made.goal = pose(*goal["goal"])
        else:
            made.goals = [pose(*one) for one in goal["goals"]]
        if "start" in goal:
            made.start, made.use_start = pose(*goal["start"]), True
        told: list[tuple[float, float]] = []
        handle = wait(
            client.send_goal_async(
                made, lambda m: told.append((m.feedback.distance_to_goal, m.feedback.speed))
            ),
            30.0,
        )
        if handle is None or not handle.accepted:
            return "refused"
        self.running[tag] = (handle, handle.get_result_async(), told)
        return "accepted"

    def cancel(self, tag: str) -> Any:
        answer = wait(self.running[tag][0].cancel_goal_async(), 20.0)
        return None if answer is None else len(answer.goals_canceling)

    def result(self, tag: str, seconds: float) -> Any:
        _, future, told = self.running[tag]
        answer = wait(future, seconds)
        if answer is None:
            return None
        words = {
            GoalStatus.STATUS_SUCCEEDED: "succeeded", GoalStatus.STATUS_ABORTED: "aborted",
            GoalStatus.STATUS_CANCELED: "cancelled",
        }  # fmt: skip
        held = answer.result
        path = getattr(held, "path", None)
        names = {getattr(held, n): n for n in dir(held) if n.isupper() and isinstance(getattr(held, n), int)}
        return {
            "status": words.get(answer.status, str(answer.status)), "error": names.get(held.error_code, held.error_code),
            "poses": [] if path is None else [(p.pose.position.x, p.pose.position.y) for p in path.poses],
            "feedback": told,
        }  # fmt: skip


def main() -> None:
    rclpy.init()
    at = [float(word) for word in sys.argv[1:4]] or [0.0, 2.8, 2.0]
    robot = Robot(*at)
    executor = MultiThreadedExecutor(num_threads=4)
    executor.add_node(robot)
    threading.Thread(target=executor.spin, daemon=True).start()
    asker = Asker(robot)
    print(json.dumps("ready"), flush=True)
    for line in sys.stdin:
        word, *given = json.loads(line)
        if word == "goal":
            robot.goals.publish(pose(*given))
            answer: Any = None
        elif word == "odometry":
            robot.odometry, answer = given[0], robot.state()
        elif word == "names":
            answer = robot.get_node_names()
        elif word == "state":
            answer = robot.state()
        else:
            answer = getattr(asker, word)(*given)
        print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    main()
