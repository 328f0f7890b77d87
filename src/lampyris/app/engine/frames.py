"""Frames: nouns as the bytes that the page reads: a length, a kind of one letter, a payload, little endian.

======  ================================================================================================
``H``   JSON: what is to come
``T``   ticks of a simulation: see :func:`ticks_frame`
``D``   samples of a drive in continuous time: see :func:`drive_frame`
``C``   what each rule alone allows at ticks of a simulation: see :func:`caps_frame`
``E``   JSON: a list of events
``L``   a value for every cell: see :func:`layer_frame`
``P``   JSON: how far it has come
``B``   bytes of a file
``Z``   JSON: how it ended; the last frame of a run
``X``   JSON: an error, in the place of ``Z``
======  ================================================================================================
"""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris.errors import LampyrisError
from lampyris.typing import BoolGrid, Cells, Floats

NOWHERE = -32768
"""In place of a cell's coordinates: not there."""


def frame(kind: str, payload: bytes) -> bytes:
    """One frame."""
    return struct.pack("<IB", len(payload) + 1, ord(kind)) + payload


def json_frame(kind: str, value: Any) -> bytes:
    """A frame of JSON; what is not finite is null."""
    return frame(kind, json.dumps(value, allow_nan=False, separators=(",", ":")).encode())


def error_frame(fault: LampyrisError) -> bytes:
    """What was wrong, as the page says it."""
    return json_frame("X", fault_of(fault))


def fault_of(fault: LampyrisError) -> dict[str, Any]:
    """An error as plain data; the mistakes beside the first are its notes."""
    return {
        "code": fault.code,
        "what": fault.what,
        "where": fault.where,
        "allowed": fault.allowed,
        "todo": fault.todo,
        "notes": list(getattr(fault, "__notes__", ())),
    }


def ticks_frame(
    first: int, robot: Cells, speed: Floats, cause: NDArray[np.uint8], places: NDArray[np.int16], near: Floats
) -> bytes:
    """Ticks ``first``, ``first + 1``, ... of a simulation.

    Parameters
    ----------
    robot : (n, 2) cells. speed : (n,). cause : (n,), indices into the header's ``causes``.
    places : int16 (n, obstacles, 2), :data:`NOWHERE` where an obstacle has not appeared.
    near : (n,) metres between the robot's rim and the nearest obstacle's; infinity without obstacles.
    """
    n, obstacles = places.shape[:2]
    return frame(
        "T",
        struct.pack("<IHH", first, n, obstacles)
        + robot.astype("<i2").tobytes()
        + speed.astype("<f4").tobytes()
        + cause.astype(np.uint8).tobytes()
        + places.astype("<i2").tobytes()
        + near.astype("<f4").tobytes(),
    )


def drive_frame(
    first: int, robot: Floats, speed: Floats, cause: NDArray[np.uint8], places: Floats, near: Floats
) -> bytes:
    """Samples ``first``, ``first + 1``, ... of a drive in continuous time.

    A head (first u32, samples u16, obstacles u16); then f32: x and y of each sample, yaw, speed; u8: what limits the
    speed; f32: places of the obstacles, free distances.

    Parameters
    ----------
    robot : (n, 3): cells (y down) and the yaw from the rows to their right, which goes on beyond a full turn.
    speed : (n,) m/s. cause : (n,), indices into the header's ``causes``.
    places : (n, obstacles, 2) cells, :data:`NOWHERE` where an obstacle has not appeared.
    near : (n,) metres between the robot's outline and the nearest obstacle; infinity without obstacles.
    """
    n, obstacles = places.shape[:2]
    return frame(
        "D",
        struct.pack("<IHH", first, n, obstacles)
        + robot[:, :2].astype("<f4").tobytes()
        + robot[:, 2].astype("<f4").tobytes()
        + speed.astype("<f4").tobytes()
        + cause.astype(np.uint8).tobytes()
        + places.astype("<f4").tobytes()
        + near.astype("<f4").tobytes(),
    )


def caps_frame(first: int, ticks: Sequence[Sequence[tuple[str, float]]]) -> bytes | None:
    """What each rule alone allows at ticks ``first``, ``first + 1``, ...; None where none says anything.

    A head (first u32, ticks u16, rules u16), the rules' names (length u8, text), and for each rule a f32 a
    tick, not-a-number where it says nothing.
    """
    names = list(dict.fromkeys(name for tick in ticks for name, _ in tick))
    if not names:
        return None
    table = np.full((len(names), len(ticks)), np.nan, dtype="<f4")
    for k, tick in enumerate(ticks):
        for name, v in tick:
            table[names.index(name), k] = v
    words = [name.encode() for name in names]
    head = struct.pack("<IHH", first, len(ticks), len(names))
    return frame("C", head + b"".join(bytes([len(word)]) + word for word in words) + table.tobytes())


def layer_frame(name: str, values: Floats, shown: BoolGrid | None = None) -> bytes:
    """A value for every cell, in 255 steps from the least to the greatest; 0: none.

    Parameters
    ----------
    name : of the layer, as the header of the question has it.
    values : (height, width); infinite or not-a-number: none.
    shown : where it is drawn; None: wherever it is finite.
    """
    there = np.isfinite(values) if shown is None else shown & np.isfinite(values)
    low, high = (float(f(values[there])) for f in (np.min, np.max)) if there.any() else (0.0, 0.0)
    out = np.zeros(values.shape, dtype=np.uint8)
    scale = 254.0 / (high - low) if high > low else 0.0
    out[there] = np.round(1.0 + scale * (values[there] - low)).astype(np.uint8)
    word = name.encode()
    height, width = values.shape
    head = struct.pack("<B", len(word)) + word + struct.pack("<IIff", width, height, low, high)
    return frame("L", head + out.tobytes())
