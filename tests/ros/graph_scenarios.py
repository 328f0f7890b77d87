"""What is tried in a real graph of ROS 2, one scenario a call: the node and a robot, each a process, both in this namespace.

Called by test_graph.py within a network namespace that has loopback alone. It prints one JSON line.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
GOAL = (2.5, 2.5)


class Process:
    """The robot of graph_robot.py, in the Python that has rclpy."""

    def __init__(self, python: str, *at: float) -> None:
        # An environment of its own: nothing of lampyris can be imported there.
        plain = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
        self.child = subprocess.Popen(
            [python, str(HERE / "graph_robot.py"), *map(str, at)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=plain,
        )  # fmt: skip
        self.read()

    def read(self) -> Any:
        assert self.child.stdout is not None
        line = self.child.stdout.readline()
        if not line:
            raise RuntimeError("the robot has ended")
        return json.loads(line)

    def ask(self, *words: Any) -> Any:
        assert self.child.stdin is not None
        self.child.stdin.write(json.dumps(words) + "\n")
        self.child.stdin.flush()
        return self.read()

    def until(self, done: Callable[[dict[str, Any]], bool], seconds: float) -> dict[str, Any]:
        """The state in which something holds, or that in which the time was over."""
        end = time.monotonic() + seconds
        while True:
            state: dict[str, Any] = self.ask("state")
            if done(state) or time.monotonic() > end:
                return state
            time.sleep(0.02)

    def kill(self) -> None:
        self.child.kill()
        self.child.wait()


def node(python: str, transport: str, *more: str) -> subprocess.Popen[str]:
    words = [
        python, "-m", "lampyris", "ros", "--transport", transport, "--radius", "0.2", "--v-max", "0.6",
        "--planner", "astar", *more,
    ]  # fmt: skip
    return subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=sys.stderr, text=True)


def end(child: subprocess.Popen[str], how: int = signal.SIGINT) -> None:
    child.send_signal(how)
    child.wait(timeout=30.0)


def arrived(state: dict[str, Any]) -> bool:
    near = abs(state["x"] - GOAL[0]) < 0.1 and abs(state["y"] - GOAL[1]) < 0.1
    return bool(near and abs(state["v"]) < 1e-3 and "arrived" in state["status"])


def sent_until_planned(robot: Process) -> dict[str, Any]:
    """Give the goal until a path comes: a subscriber that has not been found yet misses what is not latched."""
    before, state = robot.ask("state")["paths"], {}
    for _ in range(30):
        robot.ask("goal", *GOAL)
        state = robot.until(lambda now: now["paths"] > before, 2.0)
        if state["paths"] > before:
            break
    return state


def drive(robot: Process, start: Callable[[], Any]) -> dict[str, Any]:
    """The map is there before the node; the goal in, the path out, driven there. The names of the nodes, one plan."""
    child = start()
    sent_until_planned(robot)
    state = robot.until(arrived, 60.0)
    made = {**state, "arrived": arrived(state), "names": robot.ask("names")}
    if child.args[child.args.index("--transport") + 1] == "rclpy":
        made["plan"] = robot.ask("plan", 0.0, 4.0)
    end(child)
    return made


def stale(robot: Process, start: Callable[[], Any]) -> dict[str, Any]:
    """Odometry ends while the robot drives at full speed."""
    child = start()
    sent_until_planned(robot)
    robot.until(lambda now: now["v"] > 0.38, 30.0)
    before = robot.ask("odometry", False)
    began = time.monotonic()
    zero = robot.until(lambda now: now["wanted"] == 0.0, 5.0)
    after = robot.until(lambda now: now["v"] == 0.0, 5.0)
    took = time.monotonic() - began
    end(child)
    return {
        "v": before["v"], "driven": after["driven"] - before["driven"], "stands": after["v"] == 0.0,
        "seconds": took, "until_zero": zero["driven"] - before["driven"], "status": after["status"],
        "hits": after["hits"], "silent": after["silent"],
    }  # fmt: skip


def node_killed(robot: Process, start: Callable[[], Any]) -> dict[str, Any]:
    """Killed while the robot drives: it sends nothing, the base's watchdog brakes. The next one drives on to the goal."""
    child = start()
    sent_until_planned(robot)
    robot.until(lambda now: now["v"] > 0.3, 30.0)
    before = robot.ask("state")
    end(child, signal.SIGKILL)
    stood = robot.until(lambda now: now["v"] == 0.0, 5.0)
    again = start()
    sent_until_planned(robot)
    state = robot.until(arrived, 60.0)
    end(again)
    return {
        "v": before["v"], "coasted": stood["driven"] - before["driven"], "stood": stood["v"] == 0.0,
        "arrived": arrived(state), "hits": state["hits"],
    }  # fmt: skip


def node_ends(robot: Process, start: Callable[[], Any]) -> dict[str, Any]:
    """Interrupted (Ctrl-C) while the robot drives: zero is sent before it leaves."""
    child = start()
    sent_until_planned(robot)
    before = robot.until(lambda now: now["v"] > 0.3, 30.0)
    began = time.monotonic()
    child.send_signal(signal.SIGINT)
    zero = robot.until(lambda now: now["wanted"] == 0.0, 0.4)
    took = time.monotonic() - began
    child.wait(timeout=30.0)
    stood = robot.until(lambda now: now["v"] == 0.0, 5.0)
    return {
        "v": before["v"], "wanted": zero["wanted"], "seconds": took, "code": child.returncode, "hits": stood["hits"]
    }  # fmt: skip


def robot_killed(robot: Process, start: Callable[[], Any], python: str) -> dict[str, Any]:
    """The robot is killed while it drives and comes again where it stood: the node sent zero, and drives it on."""
    child = start()
    watcher = Process(python)  # hears what the node sends; its own odometry and map are not heard
    watcher.ask("odometry", False)
    sent_until_planned(robot)
    before = robot.until(lambda now: now["v"] > 0.3, 30.0)
    robot.kill()
    zero = watcher.until(lambda now: now["wanted"] == 0.0, 5.0)
    time.sleep(0.5)
    held = watcher.ask("state")
    watcher.kill()
    second = Process(python, before["x"], before["y"], 1.0)
    state = second.until(arrived, 60.0)
    end(child)
    second.kill()
    return {
        "v": before["v"], "zero": zero["wanted"] == held["wanted"] == 0.0, "status": held["status"],
        "arrived": arrived(state), "hits": state["hits"] + before["hits"],
    }  # fmt: skip


def actions(robot: Process, start: Callable[[], Any]) -> dict[str, Any]:
    """Nav2's actions by rclpy's own ActionClient."""
    child = start()
    made: dict[str, Any] = {}

    def asked(tag: str, kind: str, goal: dict[str, Any], seconds: float = 60.0) -> Any:
        said = robot.ask("send", tag, kind, goal)
        return said if said != "accepted" else robot.ask("result", tag, seconds)

    made["to_pose"] = asked("a", "ComputePathToPose", {"goal": GOAL, "start": (0.0, 2.8)})
    made["through"] = asked("b", "ComputePathThroughPoses", {"goals": [(0.5, 4.4), GOAL]})
    made["in_wall"] = asked("c", "ComputePathToPose", {"goal": (1.05, 2.5)})
    made["outside"] = asked("d", "ComputePathToPose", {"goal": (50.0, 2.5)})
    made["frame"] = asked("e", "ComputePathToPose", {"goal": (*GOAL, "moon")})
    made["no_goals"] = asked("f", "ComputePathThroughPoses", {"goals": []})
    line = [(0.0, 2.8 + 0.05 * k) for k in range(31)]
    made["follow"] = asked("g", "FollowPath", {"path": line})
    made["at"] = robot.ask("state")
    back = line[::-1]
    robot.ask("send", "h", "FollowPath", {"path": back})
    robot.until(lambda now: now["v"] > 0.2, 20.0)
    made["cancelling"] = robot.ask("cancel", "h")
    made["cancelled"] = robot.ask("result", "h", 20.0)
    made["after_cancel"] = robot.until(lambda now: now["v"] == 0.0, 5.0)
    here = made["after_cancel"]
    ahead = [(here["x"], here["y"] - 0.05 * k) for k in range(12)]
    robot.ask("send", "i", "FollowPath", {"path": ahead})
    robot.until(lambda now: now["v"] > 0.1, 20.0)
    state = robot.ask("state")
    other = [(state["x"], state["y"] - 0.05 * k) for k in range(8)]
    robot.ask("send", "j", "FollowPath", {"path": other})
    made["replaced"] = robot.ask("result", "i", 30.0)
    made["replacing"] = robot.ask("result", "j", 30.0)
    made["empty"] = asked("k", "FollowPath", {"path": []})
    end(child)
    return made


def main() -> None:
    name, transport, node_python, robot_python = sys.argv[1:5]
    robot = Process(robot_python, 0.0, 2.8, 2.0)

    def start() -> Any:
        return node(node_python, transport)

    more = (robot_python,) if name == "robot_killed" else ()
    try:
        print(json.dumps(globals()[name](robot, start, *more)), flush=True)
    finally:
        robot.kill()


if __name__ == "__main__":
    main()
