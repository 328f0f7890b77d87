"""Motion primitives into a file: Nav2's JSON, or SBPL's ``.mprim``."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path

import numpy as np

from lampyris._core.scalars import is_word
from lampyris.errors import SettingError, UsageError, file_name, of_kind, shown
from lampyris.io.files import write_file
from lampyris.model.lattice.motion_primitives import Motion, MotionPrimitives
from lampyris.model.robot import DRIVES
from lampyris.typing import Floats

ENDINGS = (".json", ".mprim")


def save_primitives(
    primitives: MotionPrimitives, path: str | os.PathLike[str], *, drive: str = "ackermann"
) -> None:
    """Write motion primitives; an existing file is replaced.

    Parameters
    ----------
    primitives : to be written.
    path : ``.json`` is Nav2's form, ``.mprim`` that of SBPL.
    drive : for the file's ``motion_model``.

    Raises
    ------
    UsageError : another ending.
    SettingError : motions that the format cannot express: in Nav2's, cost factors and motions in reverse.
    FileError : it cannot be written.

    Examples
    --------
    >>> import lampyris
    >>> robot = lampyris.Robot(drive="ackermann", turn_radius=0.5)
    >>> lampyris.save_primitives(lampyris.motion_primitives(robot, 0.1), "car.mprim")
    >>> lampyris.load_primitives("car.mprim").headings[:2]
    (0.0, 0.463647609001)
    """
    of_kind("primitives", primitives, MotionPrimitives)
    target = Path(file_name("path", path))
    if not is_word(drive, DRIVES):
        raise SettingError("DRIVE", shown(drive), where="drive", allowed=", ".join(DRIVES))
    ending = target.suffix.lower()
    if ending not in ENDINGS:
        raise UsageError("SUFFIX", repr(target.suffix), where=str(target), allowed=", ".join(ENDINGS))
    text = _json(primitives, drive) if ending == ".json" else _mprim(primitives)
    write_file(target, text.encode())


def _json(primitives: MotionPrimitives, drive: str) -> str:
    model = {"differential": "diff", "omnidirectional": "omni"}.get(drive, drive)
    if not primitives.opposite and drive != "omnidirectional":
        raise SettingError(
            "PRIMITIVE", "motions in reverse of their own", where="primitives", allowed="a .mprim for those"
        )
    if any(one.price != 1.0 for one in primitives.motions):
        raise SettingError(
            "PRIMITIVE", "motions with prices", where="primitives", allowed="a .mprim for those"
        )
    rows = []
    for k, one in enumerate(sorted(primitives.motions, key=lambda one: one.start)):
        length, arc, turn = _sizes(one)
        poses = one.poses if length == 0 else one.poses[1:]
        yaw = np.remainder(poses[:, 2], 2 * math.pi)
        row = {
            "trajectory_id": k,
            "start_angle_index": one.start,
            "end_angle_index": one.end,
            "left_turn": turn >= 0,
            "trajectory_radius": round(arc / abs(turn), 9) if arc else 0.0,
            "trajectory_length": round(length, 9),
            "arc_length": round(arc, 9),
            "straight_length": round(length - arc, 9),
            "poses": [
                [round(x, 9), round(y, 9), round(a, 9) % (2 * math.pi)]
                for (x, y, _), a in zip(poses.tolist(), yaw.tolist(), strict=True)
            ],
        }
        rows.append(row)
    head = {
        "motion_model": model,
        "turning_radius": primitives.turn_radius,
        "grid_resolution": primitives.resolution,
        "num_of_headings": len(primitives.headings),
        "heading_angles": list(primitives.headings),
        "number_of_trajectories": len(rows),
    }
    lines = ",\n    ".join(json.dumps(row, allow_nan=False) for row in rows)
    return (
        f'{{\n  "version": 1.0,\n  "lattice_metadata": {json.dumps(head, allow_nan=False)},\n'
        f'  "primitives": [\n    {lines}\n  ]\n}}\n'
    )


def _mprim(primitives: MotionPrimitives) -> str:
    motions = sorted(primitives.motions, key=lambda one: one.start)
    lines = [f"resolution_m: {primitives.resolution:.9g}"]
    if primitives.turn_radius > 0:
        lines.append(f"min_turning_radius_m: {primitives.turn_radius:.9g}")
    lines.append(f"numberofangles: {len(primitives.headings)}")
    lines += [f"angle:{k} {angle:.12f}" for k, angle in enumerate(primitives.headings)]
    lines.append(f"totalnumberofprimitives: {len(motions)}")
    counts: dict[int, int] = {}
    for one in motions:
        number = counts[one.start] = counts.get(one.start, -1) + 1
        lines += [
            f"primID: {number}",
            f"startangle_c: {one.start}",
            f"endpose_c: {one.cell[0]} {one.cell[1]} {one.end}",
            f"additionalactioncostmult: {one.price:g}",
            f"intermediateposes: {len(one.poses)}",
            *(f"{x:.9f} {y:.9f} {yaw:.9f}" for x, y, yaw in one.poses.tolist()),
        ]
    return "\n".join(lines) + "\n"


def _sizes(one: Motion) -> tuple[float, float, float]:
    """Length and length of the bent part, metres, and the turn, radians."""
    d: Floats = np.diff(one.poses, axis=0)
    lengths = np.sqrt(d[:, 0] * d[:, 0] + d[:, 1] * d[:, 1])
    bent = np.abs(d[:, 2]) > 1e-9
    return math.fsum(lengths.tolist()), math.fsum(lengths[bent].tolist()), math.fsum(d[:, 2].tolist())
