"""Frames: nouns as the bytes that the page reads: a length, a kind of one letter, a payload, little endian.

======  ================================================================================================
``H``   JSON: what is to come
``T``   ticks of a simulation: see :func:`ticks_frame`
``D``   samples of a drive in continuous time: see :func:`drive_frame`
``U``   cells that a robot with a sensor has seen: see :func:`seen_frame`
``C``   what each rule alone allows at ticks of a simulation: see :func:`caps_frame`
``E``   JSON: a list of events
``L``   a value for every cell: see :func:`layer_frame`
``R``   the paths of a fleet: see :func:`paths_frame`
``G``   iterations of a swarm: see :func:`swarm_frame`
``O``   the order in which a planner expands cells: see :func:`order_frame`
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
from lampyris.typing import BoolGrid, Cell, Cells, Floats

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


def seen_frame(seen: NDArray[np.int32], first: int, last: int) -> bytes | None:
    """The cells that were seen for the first time at ticks ``first`` to ``last``; None where there are none.

    A head (cells u32), then u32: numbers of the cells, row by row from the top; u32: their ticks.

    Parameters
    ----------
    seen : int32 (height * width,): the tick at which each cell was first seen, -1 never.
    """
    cells = np.flatnonzero((seen >= first) & (seen <= last))
    if not len(cells):
        return None
    return frame(
        "U",
        struct.pack("<I", len(cells)) + cells.astype("<u4").tobytes() + seen[cells].astype("<u4").tobytes(),
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


def paths_frame(paths: Sequence[Cells], goals: Sequence[Cell], shortest: NDArray[np.int32] | None) -> bytes:
    """The paths of a fleet, half a byte for each step.

    A head (robots u32); then by robot i16: x and y of its first cell, x and y of its goal; u32: steps of its path; i32:
    steps of its shortest path, -1 unknown; then the steps of all robots one after another, two a byte, the first in the lower
    half: 0 wait, 1 x + 1, 2 y + 1, 3 x - 1, 4 y - 1.
    """
    n = len(paths)
    starts = np.array([path[0] for path in paths], dtype="<i2").reshape(n, 2)
    moves = [np.diff(path, axis=0) for path in paths]
    table = np.concatenate(moves) if moves else np.zeros((0, 2), dtype=np.int64)
    x, y = table[:, 0], table[:, 1]
    code = np.where(x != 0, 2 - x, np.where(y != 0, 3 - y, 0)).astype(np.uint8)
    code = np.append(code, np.zeros(len(code) % 2, dtype=np.uint8))
    least = np.full(n, -1) if shortest is None else shortest
    return frame(
        "R",
        struct.pack("<I", n)
        + np.hstack((starts, np.array(goals, dtype="<i2").reshape(n, 2))).astype("<i2").tobytes()
        + np.array([len(path) - 1 for path in paths], dtype="<u4").tobytes()
        + least.astype("<i4").tobytes()
        + (code[::2] | code[1::2] << 4).astype(np.uint8).tobytes(),
    )


def swarm_frame(
    first: int, places: Floats, luciferin: NDArray[np.uint8], sources: Floats, held: NDArray[np.int32]
) -> bytes:
    """Iterations ``first``, ``first + 1``, ... of a swarm.

    A head (first u32, iterations u16, robots u16, sources u16); then f32: places of the robots and of the sources, in
    cells (y down); u16: robots at each source; u8: luciferin, 0 to 255.

    Parameters
    ----------
    places : (n, robots, 2). luciferin : (n, robots). sources : (n, sources, 2). held : (n, sources).
    """
    n, robots = luciferin.shape
    return frame(
        "G",
        struct.pack("<IHHH", first, n, robots, sources.shape[1])
        + places.astype("<f4").tobytes()
        + sources.astype("<f4").tobytes()
        + np.minimum(held, 65535).astype("<u2").tobytes()
        + luciferin.tobytes(),
    )


def order_frame(planner: int, order: NDArray[Any], tree: bool) -> bytes:
    """The order in which a planner of a race expands cells, or in which its tree grows.

    A head (number of the planner u16, whether it is a tree u16, how many u32); then u32: numbers of the cells, row by row
    from the top; or of a tree f32 (x0, y0, x1, y1 in cells) for each of its lines.
    """
    body = order.astype("<f4" if tree else "<u4").tobytes()
    return frame("O", struct.pack("<HHI", planner, int(tree), len(order)) + body)


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
