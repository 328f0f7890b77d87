"""Motion primitives as the generator of ``nav2_smac_planner`` writes them.

``lattice_metadata`` has ``grid_resolution``, ``heading_angles`` and more; each of ``primitives`` its headings as numbers and
its ``poses`` (metres, radians) without the first, which is the origin. Motions in reverse are not in the file: a robot
that may reverse drives each motion from the opposite heading backwards.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

from lampyris._core.scalars import in_range
from lampyris.errors import FileError, SettingError
from lampyris.io.primitives.checked import CheckedMotions, enough_headings
from lampyris.io.text.strict_json import JsonDocument, pointer, read_json
from lampyris.io.text.strict_yaml import KeyPath, shown
from lampyris.model.lattice.motion_primitives import MotionPrimitives, headings_of

LENGTH_SLACK = 0.05
"""Share by which ``trajectory_length`` may differ from the length of the poses."""


def read_nav2(data: bytes, name: str) -> MotionPrimitives:
    """The primitives of a file.

    Raises
    ------
    FileError : with line, and the path to the value.
    LimitError : too large.
    """
    return _Reader(read_json(data, name)).primitives()


class _Reader:
    def __init__(self, document: JsonDocument) -> None:
        self._document = document

    def primitives(self) -> MotionPrimitives:
        """The primitives of the document."""
        head = ("lattice_metadata",)
        self._value(head, dict, "a table")
        resolution = self._number((*head, "grid_resolution"), 1e-6, 1000.0, "metres a cell")
        angles = self._value((*head, "heading_angles"), list, "a list of radians")
        enough_headings(len(angles), self._document.at(*head, "heading_angles"))
        try:
            headings = headings_of(angles)
        except SettingError as fault:
            raise self._refuse((*head, "heading_angles"), fault.what, fault.allowed) from None
        self._same((*head, "num_of_headings"), len(headings), "the number of heading_angles")
        radius = 0.0
        if "turning_radius" in self._document.data["lattice_metadata"]:
            radius = self._number((*head, "turning_radius"), 0.0, 1e6, "metres")
        listed = self._value(("primitives",), list, "a list")
        self._same((*head, "number_of_trajectories"), len(listed), "the number of primitives")
        motions = CheckedMotions(self._document.where, resolution, headings)
        for k in range(len(listed)):
            self._motion(motions, ("primitives", k))
        if not listed:
            raise self._refuse(("primitives",), "no primitive", "at least one")
        return motions.primitives(opposite=True, turn_radius=radius)

    def _motion(self, motions: CheckedMotions, at: KeyPath) -> None:
        self._value(at, dict, "a table")
        number = self._whole((*at, "trajectory_id"), 2**31)
        most = len(motions.headings) - 1
        start = self._whole((*at, "start_angle_index"), most)
        end = self._whole((*at, "end_angle_index"), most)
        listed = self._value((*at, "poses"), list, "a list of [x, y, yaw]")
        poses = [self._pose((*at, "poses", k)) for k in range(len(listed))]
        if not poses:
            raise self._refuse((*at, "poses"), "no pose", "at least one")
        cell = motions.resolution
        if max(abs(poses[0][0]), abs(poses[0][1])) > 1e-6 * cell:
            poses.insert(0, (0.0, 0.0, motions.headings[start]))
        x, y = poses[-1][0] / cell, poses[-1][1] / cell
        if max(abs(x), abs(y)) > 1e4:
            raise self._refuse((*at, "poses", len(listed) - 1), "ends too far away", "within 10,000 cells")
        motions.add(number, (start, end), (round(x), round(y)), poses, 1.0, self._document.at(*at))
        self._check_length(motions, (*at, "trajectory_length"))

    def _check_length(self, motions: CheckedMotions, at: KeyPath) -> None:
        """Refuse a stated length that is not that of the poses."""
        if at[-1] not in self._table(at[:-1]):
            return
        stated = self._number(at, 0.0, 1e6, "metres")
        poses = motions.made[-1].poses.tolist()
        steps = [
            math.sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]))
            for a, b in pairwise(poses)
        ]
        length = math.fsum(steps)
        if abs(length - stated) > LENGTH_SLACK * length + 0.1 * motions.resolution:
            raise self._refuse(at, f"{stated:g} m, and poses along {length:.5g} m", "the length of the poses")

    def _pose(self, at: KeyPath) -> tuple[float, float, float]:
        given = self._value(at, list, "[x, y, yaw]")
        if len(given) != 3:
            raise self._refuse(at, f"{len(given)} numbers", "[x, y, yaw]")
        x, y, yaw = (self._number((*at, k), -1e6, 1e6, "metres or radians") for k in range(3))
        return x, y, yaw

    # ---- values --------------------

    def _table(self, at: KeyPath) -> dict[Any, Any]:
        found: Any = self._document.data
        for step in at:
            found = found[step]
        table: dict[Any, Any] = found
        return table

    def _value(self, at: KeyPath, kind: type, allowed: str) -> Any:
        parent = self._table(at[:-1])
        if isinstance(parent, dict) and at[-1] not in parent:
            raise self._refuse(at[:-1], f"no {shown(str(at[-1]))}", allowed)
        value: Any = parent[at[-1]]
        if not isinstance(value, kind) or isinstance(value, bool):
            raise self._refuse(at, shown(value), allowed)
        return value

    def _number(self, at: KeyPath, low: float, high: float, unit: str) -> float:
        value = self._value(at, (int, float), "a number")  # type: ignore[arg-type]
        if not in_range(value, low, high):
            raise self._refuse(at, shown(value), f"{low:g} to {high:g} {unit}")
        return float(value)

    def _whole(self, at: KeyPath, most: int) -> int:
        value = self._value(at, int, f"a whole number, 0 to {most:,}")
        if not 0 <= value <= most:
            raise self._refuse(at, shown(value), f"a whole number, 0 to {most:,}")
        return int(value)

    def _same(self, at: KeyPath, count: int, what: str) -> None:
        """Refuse a stated count that is not what is there; it need not be stated."""
        if at[-1] in self._table(at[:-1]) and self._number(at, 0, 1e9, "") != count:
            raise self._refuse(at, shown(self._table(at[:-1])[str(at[-1])]), f"{count}, {what}")

    def _refuse(self, at: KeyPath, what: str, allowed: str) -> FileError:
        where = f"{self._document.at(*at)}: {pointer(at)}"
        return FileError("PRIMITIVE", what, where=where, allowed=allowed)
