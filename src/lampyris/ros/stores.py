"""Messages of the package rosbags (extra ``ros``) from plain dictionaries, and back."""

from __future__ import annotations

import importlib
from functools import cache
from typing import Any

import numpy as np

from lampyris.errors import InputError, UsageError
from lampyris.ros.messages import GRID_UPDATE, Fields

DISTRIBUTIONS = ("humble", "iron", "jazzy", "kilted", "lyrical")
"""Distributions of ROS 2 with definitions of messages in rosbags."""
USUAL = "jazzy"

_UPDATE = "std_msgs/Header header\nint32 x\nint32 y\nuint32 width\nuint32 height\nint8[] data\n"
"""map_msgs/OccupancyGridUpdate, which rosbags does not have."""

_DTYPES = {
    "bool": "bool", "octet": "uint8", "byte": "uint8", "char": "uint8", **{
        name: name for name in
        ("int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float32", "float64")
    },
}  # fmt: skip


def rosbags_module(name: str) -> Any:
    """A module of rosbags.

    Raises
    ------
    UsageError : ``EXTRA``: rosbags is not installed.
    """
    try:
        return importlib.import_module(name)
    except ImportError as fault:
        raise UsageError(
            "EXTRA",
            f"bags need rosbags, which is not installed ({fault.name})",
            todo="pip install 'lampyris[ros]'",
        ) from None


@cache
def typestore(distribution: str = USUAL) -> Any:
    """The types of a distribution of ROS 2.

    Raises
    ------
    UsageError : ``EXTRA``; ``ROS_DISTRIBUTION``: rosbags knows no such distribution.
    """
    types = rosbags_module("rosbags.typesys")
    if distribution not in DISTRIBUTIONS:
        raise UsageError("ROS_DISTRIBUTION", repr(distribution), allowed=", ".join(DISTRIBUTIONS))
    store = types.get_typestore(types.Stores[f"ROS2_{distribution.upper()}"])
    store.register(types.get_types_from_msg(_UPDATE, GRID_UPDATE))
    return store


def build(store: Any, kind: str, fields: Fields) -> Any:
    """A message of rosbags; fields that are left out are zero or empty.

    Raises
    ------
    InputError : ``MESSAGE``: a field that messages of this type do not have.
    """
    definition = dict(store.fielddefs[kind][1])
    for name in fields:
        if name not in definition:
            raise InputError("MESSAGE", f"{kind} has no field {name}", allowed=", ".join(definition))
    return store.types[kind](**{name: _value(store, of, fields.get(name)) for name, of in definition.items()})


def _value(store: Any, of: Any, given: Any) -> Any:
    node, what = int(of[0]), of[1]
    if node == 1:  # a basic type
        name = what[0]
        if given is None:
            return "" if name == "string" else bool(0) if name == "bool" else _number(name, 0)
        return given if name in ("string", "bool") else _number(name, given)
    if node == 2:  # a message
        return build(store, what, given or {})
    element, length = what
    if int(element[0]) == 1 and element[1][0] != "string":
        values = np.zeros(length) if given is None else np.asarray(given)
        return values.astype(_DTYPES[element[1][0]])
    if given is None:
        given = [None] * (length if node == 3 else 0)
    return [_value(store, element, one) for one in given]


def _number(name: str, value: Any) -> Any:
    return float(value) if name.startswith("float") else int(value)


def plain(message: Any) -> Any:
    """A message as plain dictionaries; arrays of numbers stay arrays."""
    if hasattr(message, "__msgtype__"):
        names = (name for name in message.__dataclass_fields__ if name != "__msgtype__")
        return {name: plain(getattr(message, name)) for name in names}
    return [plain(one) for one in message] if isinstance(message, list) else message
