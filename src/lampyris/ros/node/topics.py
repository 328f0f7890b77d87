"""Topics of the node: names, types, directions, and the quality of service that Nav2 has for them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple, Protocol

from lampyris.ros import messages
from lampyris.ros.messages import Fields


class Topic(NamedTuple):
    """A topic.

    Parameters
    ----------
    name, kind : its name and the type of its messages.
    sent : whether the node publishes it; else it subscribes.
    latched : transient local: late subscribers get the last message.
    reliable : else best effort, which receives from reliable publishers as well.
    depth : messages that are kept.
    """

    name: str
    kind: str
    sent: bool
    latched: bool = False
    reliable: bool = True
    depth: int = 1


TOPICS = (
    Topic("/map", messages.OCCUPANCY_GRID, False, latched=True),
    Topic("/map_updates", messages.GRID_UPDATE, False, depth=10),
    Topic("/tf_static", messages.TF, False, latched=True, depth=100),
    Topic("/tf", messages.TF, False, depth=100),
    Topic("/odom", messages.ODOMETRY, False, reliable=False, depth=5),
    Topic("/initialpose", messages.POSE_ESTIMATE, False, depth=5),
    Topic("/goal_pose", messages.POSE, False, depth=5),
    Topic("/obstacles", messages.MARKERS, False, reliable=False, depth=5),
    Topic("/obstacle_odom", messages.ODOMETRY, False, reliable=False, depth=10),
    Topic("/e_stop", messages.BOOL, False, depth=5),
    Topic("/plan", messages.PATH, True),
    Topic("/cmd_vel", messages.TWIST, True),
    Topic("/lampyris/markers", messages.MARKERS, True, latched=True),
    Topic("/lampyris/speed_profile", messages.STRING, True, latched=True),
    Topic("/lampyris/status", messages.STRING, True, latched=True),
)
"""All topics; ``/cmd_vel`` is of TwistStamped if the settings say so."""


def topics_for(stamped: bool, renamed: Mapping[str, str]) -> tuple[Topic, ...]:
    """The topics with other names, and the type of ``/cmd_vel``."""
    made = []
    for one in TOPICS:
        kind = messages.TWIST_STAMPED if stamped and one.name == "/cmd_vel" else one.kind
        made.append(one._replace(name=renamed.get(one.name, one.name), kind=kind))
    return tuple(made)


class Transport(Protocol):
    """What carries messages: rclpy, Cyclone DDS, or a list in a test."""

    def open(self, topics: tuple[Topic, ...], receive: Callable[[str, Fields], None]) -> None:
        """Offer and subscribe to topics; ``receive(name, fields)`` is called for each message that arrives."""

    def publish(self, topic: Topic, fields: Fields) -> None:
        """Send a message."""

    def now(self) -> float:
        """Seconds on the clock whose time stamps carry."""
