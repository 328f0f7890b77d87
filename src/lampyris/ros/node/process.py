"""The node as a process: a transport, the core, and a loop at a fixed rate."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from lampyris.errors import UsageError
from lampyris.ros.node import rclpy_transport
from lampyris.ros.node.dds_transport import DdsTransport
from lampyris.ros.node.navigator import Navigator

TRANSPORTS = ("auto", "rclpy", "dds")


def transport_named(name: str, node: str = "lampyris", domain: int | None = None) -> Any:
    """A transport: rclpy if it can be imported (``auto``), else Cyclone DDS.

    Raises
    ------
    UsageError : ``EXTRA``: what it needs is not installed.
    """
    if name == "rclpy" and not rclpy_transport.installed():
        raise UsageError(
            "EXTRA", "rclpy is not installed", todo="source the robot's ROS 2, or --transport dds"
        )
    if name == "rclpy" or (name == "auto" and rclpy_transport.installed()):
        return rclpy_transport.RclpyTransport(node)
    return DdsTransport(node, domain)


def run(
    navigator: Navigator,
    transport: Any,
    *,
    seconds: float | None = None,
    said: Callable[[str], None] | None = None,
) -> None:
    """Run a node until it is interrupted; then the robot is sent a velocity of zero.

    New odometry is answered at once, and commands are given at the rate of the settings at least.

    Parameters
    ----------
    navigator, transport : the core and what carries its messages.
    seconds : how long; None: until interrupted.
    said : called with each new status.
    """
    navigator.connect(transport)
    period = 1.0 / navigator.settings.rate
    end = None if seconds is None else time.monotonic() + seconds
    due, seen, status = time.monotonic(), navigator.odometry_count, ""
    try:
        while end is None or time.monotonic() < end:
            transport.spin(max(due - time.monotonic(), 0.0))
            fresh, now = navigator.odometry_count != seen, time.monotonic()
            if fresh or now >= due:
                seen = navigator.odometry_count
                navigator.tick()
                due = now + period
            if said is not None and navigator.status != status:
                status = navigator.status
                said(status)
    except KeyboardInterrupt:
        pass
    finally:
        navigator.stop()
