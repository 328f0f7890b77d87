"""A result as JSON that says every bit of it, and the SHA-256 of that."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Set
from dataclasses import fields, is_dataclass
from enum import Enum
from typing import Any

import numpy as np

LEFT_OUT = frozenset({"timing", "scene", "frame"})
"""Fields that are no part of a result: how long it took, what was asked, and where the scene's map lies."""

ADDED = frozenset({"pose_path", "goal_tolerance", "rounds"})
"""Fields that came in after the hashes on record; they are part of a result where they hold something."""

ADDED_TO = frozenset(
    {(kind, "footprint") for kind in ("RandomWalk", "Patrol", "Crossing", "Recorded")}
    | {
        ("Scene", "via"),
        ("Scene", "via_order"),
        ("Plan", "via"),
        ("Plan", "via_at"),
        ("Plan", "via_lower_bound"),
        ("Plan", "tree"),
        ("Plan", "map_model"),
        ("Trace", "sensor"),
        ("Trace", "seen"),
        ("Trace", "goal_track"),
        ("Trace", "via"),
        ("Trace", "via_ticks"),
        ("Drive", "sensor"),
        ("Drive", "seen"),
        ("Drive", "via"),
        ("Drive", "via_times"),
        ("Drive", "timetables"),
        ("Plan", "time_lower_bound"),
    }
    | {("Recorded", "yaw"), ("Obstacle", "outline"), ("Track", "outline"), ("Track", "yaw")}
)
"""The same of some classes alone: others had a field of that name before."""

RENAMED = {("Moment", "obstacle"): "body"}
"""Fields that had another name when the hashes on record were made: a result is hashed under that name."""


def digest(value: Any) -> str:
    """SHA-256 of the canonical JSON, 64 hexadecimal digits."""
    text = json.dumps(canonical(value), sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    return hashlib.sha256(text.encode("ascii")).hexdigest()


def canonical(value: Any) -> Any:
    """The same in words of JSON: floats with all their bits, arrays as type, shape and hash of their bytes.

    Mappings keep their order, which is a part of the result; sets have none and are sorted.

    Raises
    ------
    TypeError : something of another kind: what a result is made of must be said here.
    """
    if isinstance(value, Enum):
        return canonical(value.value)
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        return value.hex()
    if isinstance(value, bytes):
        return hashlib.sha256(value).hexdigest()
    if isinstance(value, np.generic):
        return canonical(value.item())
    if isinstance(value, np.ndarray):
        return _array(value)
    if is_dataclass(value) and not isinstance(value, type):
        parts = [(one.name, getattr(value, one.name)) for one in fields(value) if one.name not in LEFT_OUT]
        kind = type(value).__name__
        kept = [
            (name, part)
            for name, part in parts
            if not (name in ADDED or (kind, name) in ADDED_TO) or not _is_empty(part)
        ]
        return {"": kind} | {RENAMED.get((kind, name), name): canonical(part) for name, part in kept}
    if isinstance(value, Mapping):
        return [[canonical(key), canonical(part)] for key, part in value.items()]
    if isinstance(value, Set):
        return sorted((canonical(part) for part in value), key=json.dumps)
    if isinstance(value, list | tuple):
        return [canonical(part) for part in value]
    raise TypeError(f"{type(value).__name__} has no canonical form")


def _is_empty(part: Any) -> bool:
    return part is None or (isinstance(part, tuple | str) and part in ((), "given"))


def _array(value: np.ndarray[Any, Any]) -> list[Any]:
    if value.dtype.kind not in "biuf":
        raise TypeError(f"arrays of {value.dtype} have no canonical form")
    small = np.ascontiguousarray(value, dtype=value.dtype.newbyteorder("<"))
    return [small.dtype.str, list(value.shape), hashlib.sha256(small.tobytes()).hexdigest()]
