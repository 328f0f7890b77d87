"""The node in a graph of ROS 2 that is not ours: rclpy from wheels, a robot in a process of its own, loopback alone.

Nightly. It needs Linux with `unshare` and `ip`, and names of Pythons in the environment:

- LAMPYRIS_ROS_PYTHON has rclpy, as made by ``pip install ros-jazzy-rclpy ros-jazzy-rmw-fastrtps-cpp ros-jazzy-nav-msgs
  ros-jazzy-visualization-msgs`` and, for the transport ``rclpy``, what lampyris runs on; without nav2_msgs its actions are
  left out;
- LAMPYRIS_DDS_PYTHON has ``lampyris[ros-live]`` and no rclpy.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

HERE = Path(__file__).parent
pytestmark = [pytest.mark.source, pytest.mark.nightly]


def scenario(name: str, transport: str) -> dict[str, Any]:
    robot = os.environ.get("LAMPYRIS_ROS_PYTHON")
    node = robot if transport == "rclpy" else os.environ.get("LAMPYRIS_DDS_PYTHON")
    if not robot or not node:
        pytest.skip("LAMPYRIS_ROS_PYTHON or LAMPYRIS_DDS_PYTHON is not set")
    if not all(map(shutil.which, ("unshare", "ip"))):
        pytest.skip("no network namespaces here")
    words = [sys.executable, str(HERE / "graph_scenarios.py"), name, transport, node, robot]
    up = 'ip link set lo up multicast on; ip route add 224.0.0.0/4 dev lo; exec "$@"'
    path = os.pathsep.join([str(HERE.parents[1] / "src"), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        ["unshare", "-rn", "sh", "-c", up, "sh", *words], capture_output=True, text=True, timeout=300,
        env={**os.environ, "PYTHONPATH": path}, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    made: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    print(made)
    return made


both = pytest.mark.parametrize("transport", ["rclpy", "dds"])


@both
def test_it_drives_a_robot_that_is_not_ours_to_the_goal(transport: str) -> None:
    made = scenario("drive", transport)
    assert made["arrived"]
    assert made["hits"] == 0
    assert "lampyris" in made["names"]
    assert made["commands"] > 100
    if transport == "rclpy":
        assert made["plan"] > 10


@both
def test_stale_odometry_stops_it(transport: str) -> None:
    made = scenario("stale", transport)
    assert made["stands"]
    assert made["hits"] == 0
    braking = made["v"] ** 2 / 2.0  # the robot brakes with 1 m/s2
    assert (
        made["driven"] <= (0.3 + 0.1) * made["v"] + braking
    )  # 0.3 s until it is stale, 0.1 s of the two loops


@both
def test_a_killed_node_comes_again_and_drives_on(transport: str) -> None:
    made = scenario("node_killed", transport)
    assert made["stood"]
    assert made["arrived"]
    assert made["hits"] == 0


@both
def test_an_interrupted_node_sends_zero(transport: str) -> None:
    made = scenario("node_ends", transport)
    assert (made["wanted"], made["code"], made["hits"]) == (0.0, 0, 0)
    assert made["seconds"] < 0.4  # before the base's own watchdog


@both
def test_a_killed_robot_is_sent_zero_and_driven_on_when_it_comes_again(transport: str) -> None:
    made = scenario("robot_killed", transport)
    assert made["zero"]
    assert "no new /odom" in made["status"]
    assert made["arrived"]
    assert made["hits"] == 0


def test_nav2s_actions_by_its_own_client() -> None:
    python = os.environ.get("LAMPYRIS_ROS_PYTHON")
    if (
        python
        and subprocess.run(
            [python, "-c", "import nav2_msgs.action"], check=False, capture_output=True
        ).returncode
    ):
        pytest.skip("nav2_msgs is not installed there")
    made = scenario("actions", "rclpy")
    assert made["to_pose"]["status"] == "succeeded"
    x, y = made["to_pose"]["poses"][-1]
    assert abs(x - 2.5) + abs(y - 2.5) < 0.15
    assert made["through"]["status"] == "succeeded"
    assert min(abs(x - 0.5) + abs(y - 4.4) for x, y in made["through"]["poses"]) < 0.15
    for tag, error in (
        ("in_wall", "GOAL_OCCUPIED"), ("outside", "GOAL_OUTSIDE_MAP"), ("frame", "TF_ERROR"),
        ("no_goals", "NO_VIAPOINTS_GIVEN"), ("empty", "INVALID_PATH"),
    ):  # fmt: skip
        assert (made[tag]["status"], made[tag]["error"]) == ("aborted", error), tag
    assert made["follow"]["status"] == "succeeded"
    assert made["at"]["y"] == pytest.approx(4.3, abs=0.15)
    assert max(speed for _, speed in made["follow"]["feedback"]) > 0.2
    assert made["cancelling"] == 1
    assert made["cancelled"]["status"] == "cancelled"
    assert made["after_cancel"]["v"] == 0.0
    assert made["replaced"]["status"] == "aborted"
    assert made["replacing"]["status"] == "succeeded"
