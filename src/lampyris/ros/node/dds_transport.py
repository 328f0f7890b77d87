"""The node without ROS: topics over Cyclone DDS (extra ``ros-live``), shown in the graph as a node.

Services and actions do not work so: implementations of DDS match requests with answers in ways of their own. They need rclpy.
"""

from __future__ import annotations

import importlib
import threading
import time
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from lampyris.errors import UsageError
from lampyris.ros.messages import Fields
from lampyris.ros.node.topics import Topic
from lampyris.ros.stores import USUAL, typestore

GRAPH_TOPIC, GRAPH_KIND = "ros_discovery_info", "rmw_dds_common/msg/ParticipantEntitiesInfo"
NO_SERVICES = (
    "services and actions need rclpy: answers do not cross from one implementation of DDS to another; "
    "source the robot's ROS 2, or install rclpy"
)
_SCALARS = {"bool": bool, "string": str, "byte": "uint8", "octet": "uint8", "char": "uint8"}


def dds_module(name: str) -> Any:
    """A module of cyclonedds.

    Raises
    ------
    UsageError : ``EXTRA``: it is not installed.
    """
    try:
        return importlib.import_module(name)
    except ImportError as fault:
        raise UsageError(
            "EXTRA", f"neither rclpy nor cyclonedds is installed ({fault.name})",
            todo="source the robot's ROS 2, or pip install 'lampyris[ros-live]'",
        ) from None  # fmt: skip


@cache
def idl_type(kind: str, distribution: str = USUAL) -> Any:
    """The class of Cyclone DDS for a type of messages."""
    idl, types = dds_module("cyclonedds.idl"), dds_module("cyclonedds.idl.types")
    package, _, name = kind.split("/")
    fields = {
        field: _field(types, of, distribution) for field, of in typestore(distribution).fielddefs[kind][1]
    }
    return idl.make_idl_struct(name, f"{package}.msg.dds_.{name}_", fields)


def _field(types: Any, of: Any, distribution: str) -> Any:
    node, what = int(of[0]), of[1]
    if node == 1:
        kind = _SCALARS.get(what[0], what[0])
        return getattr(types, kind) if isinstance(kind, str) else kind
    if node == 2:
        return idl_type(what, distribution)
    element, length = what
    inner = _field(types, element, distribution)
    return types.array[inner, length] if node == 3 else types.sequence[inner]


def to_dds(kind: str, fields: Fields, distribution: str = USUAL) -> Any:
    """A message of Cyclone DDS from plain fields; those that are left out are zero or empty."""
    definition = typestore(distribution).fielddefs[kind][1]
    return idl_type(kind, distribution)(
        **{name: _to(of, fields.get(name), distribution) for name, of in definition}
    )


def _to(of: Any, given: Any, distribution: str) -> Any:
    node, what = int(of[0]), of[1]
    if node == 1:
        kind = what[0]
        if kind == "string":
            return given or ""
        if kind == "bool":
            return bool(given)
        return float(given or 0.0) if kind.startswith("float") else int(given or 0)
    if node == 2:
        return to_dds(what, given or {}, distribution)
    element, length = what
    if given is None:
        given = [None] * (length if node == 3 else 0)
    if isinstance(given, np.ndarray):
        return given.tolist()
    return [_to(element, one, distribution) for one in given]


def from_dds(message: Any) -> Any:
    """Plain fields of a message of Cyclone DDS."""
    if hasattr(message, "__idl_typename__"):
        return {name: from_dds(getattr(message, name)) for name in message.__dataclass_fields__}
    if isinstance(message, list) and message and hasattr(message[0], "__idl_typename__"):
        return [from_dds(one) for one in message]
    return message


class DdsTransport:
    """Topics over Cyclone DDS.

    Parameters
    ----------
    name : of the node.
    domain : of DDS; None: ``ROS_DOMAIN_ID``, else 0.
    distribution : of ROS 2, whose types are spoken.
    """

    services = False

    def __init__(self, name: str = "lampyris", domain: int | None = None, distribution: str = USUAL) -> None:
        import os

        domains = dds_module("cyclonedds.domain")
        typestore(distribution)  # rosbags is there, or a sentence says that it is not
        self._name, self._distribution = name, distribution
        number = int(os.environ.get("ROS_DOMAIN_ID") or 0) if domain is None else domain
        self._participant = domains.DomainParticipant(number)
        self._writers: dict[str, Any] = {}
        self._readers: list[tuple[Topic, Any]] = []
        self._receive: Callable[[str, Fields], None] | None = None
        self._arrived = threading.Event()
        self._graph: Any = None

    def open(self, topics: tuple[Topic, ...], receive: Callable[[str, Fields], None]) -> None:
        """See :class:`lampyris.ros.node.topics.Transport`."""
        pub, sub = dds_module("cyclonedds.pub"), dds_module("cyclonedds.sub")
        listeners = dds_module("cyclonedds.core")
        self._receive = receive
        arrived = self._arrived

        class Wake(listeners.Listener):  # type: ignore[misc, name-defined]
            def on_data_available(self, reader: Any) -> None:
                arrived.set()

        for topic in topics:
            made = self._topic(f"rt{topic.name}", topic.kind)
            if topic.sent:
                self._writers[topic.name] = pub.DataWriter(self._participant, made, qos=_qos(topic))
            else:
                reader = sub.DataReader(self._participant, made, qos=_qos(topic), listener=Wake())
                self._readers.append((topic, reader))
        self._show()

    def _topic(self, name: str, kind: str) -> Any:
        topics = dds_module("cyclonedds.topic")
        return topics.Topic(self._participant, name, idl_type(kind, self._distribution))

    def _show(self) -> None:
        """Tell the graph of ROS that this participant is a node; without it the node has no name there."""
        pub = dds_module("cyclonedds.pub")
        graph = Topic(f"/{GRAPH_TOPIC}", GRAPH_KIND, True, latched=True)
        self._graph = pub.DataWriter(self._participant, self._topic(GRAPH_TOPIC, GRAPH_KIND), qos=_qos(graph))

        def gid(entity: Any) -> dict[str, Any]:
            return {"data": list(entity.guid.bytes)}

        node = {
            "node_namespace": "/", "node_name": self._name,
            "reader_gid_seq": [gid(one) for _, one in self._readers],
            "writer_gid_seq": [gid(one) for one in self._writers.values()],
        }  # fmt: skip
        fields = {"gid": gid(self._participant), "node_entities_info_seq": [node]}
        self._graph.write(to_dds(GRAPH_KIND, fields, self._distribution))

    def publish(self, topic: Topic, fields: Fields) -> None:
        """See :class:`lampyris.ros.node.topics.Transport`."""
        self._writers[topic.name].write(to_dds(topic.kind, fields, self._distribution))

    def now(self) -> float:
        """Seconds of the system's clock."""
        return time.time()

    def spin(self, seconds: float) -> None:
        """Take in what arrives until some seconds are over, or something has."""
        self._arrived.wait(seconds)
        self._arrived.clear()
        assert self._receive is not None
        for topic, reader in self._readers:
            for sample in reader.take(N=100):
                if hasattr(sample, "__idl_typename__"):  # else a note that a writer has left
                    self._receive(topic.name, from_dds(sample))

    def serve(self, navigator: Any) -> None:
        """Refuse to offer services and actions.

        Raises
        ------
        UsageError : ``SERVICES``: always.
        """
        raise UsageError("SERVICES", NO_SERVICES)

    def close(self) -> None:
        """Leave the graph."""
        self._writers.clear()
        self._readers.clear()
        self._graph = self._participant = None


def _qos(topic: Topic) -> Any:
    core, util = dds_module("cyclonedds.qos"), dds_module("cyclonedds.util")
    policy = core.Policy
    wait = policy.Reliability.Reliable(util.duration(milliseconds=100))
    return core.Qos(
        wait if topic.reliable else policy.Reliability.BestEffort,
        policy.Durability.TransientLocal if topic.latched else policy.Durability.Volatile,
        policy.History.KeepLast(topic.depth),
        policy.DataRepresentation(use_cdrv0_representation=True),
    )
