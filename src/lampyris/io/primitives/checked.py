"""Motions of a file, each checked where it is read, so that a refusal names its line."""

from __future__ import annotations

from lampyris.errors import FileError, LimitError, SettingError
from lampyris.model.lattice.motion_primitives import (
    MAX_HEADINGS,
    MAX_MOTIONS,
    MAX_POSES,
    Motion,
    MotionPrimitives,
    on_lattice,
)


class CheckedMotions:
    """Collects the motions of a file.

    Parameters
    ----------
    name : of the file.
    resolution, headings : of the lattice; checked.
    """

    def __init__(self, name: str, resolution: float, headings: tuple[float, ...]) -> None:
        self.name, self.resolution, self.headings = name, resolution, headings
        self.made: list[Motion] = []
        self._poses = 0

    def add(
        self,
        number: int,
        ends: tuple[int, int],
        cell: tuple[int, int],
        poses: list[tuple[float, float, float]],
        price: float,
        where: str,
    ) -> None:
        """One motion more.

        Raises
        ------
        FileError : it does not begin and end at states of the lattice.
        LimitError : too many.
        """
        self._poses += len(poses)
        if len(self.made) >= MAX_MOTIONS or self._poses > MAX_POSES:
            raise LimitError(
                "LIMIT",
                "too many primitives",
                where=where,
                allowed=f"{MAX_MOTIONS:,} primitives, of {MAX_POSES:,} poses in all",
            )
        line = int(where.removeprefix(f"{self.name}:").split(":")[0])
        try:
            motion = Motion(number, ends[0], ends[1], cell, poses, price, line)
            self.made.append(on_lattice(motion, self.headings, self.resolution))
        except SettingError as fault:
            raise FileError(
                fault.code, fault.what, where=f"{where}: primitive {number}", allowed=fault.allowed
            ) from None

    def primitives(self, opposite: bool, turn_radius: float) -> MotionPrimitives:
        """All of them.

        Raises
        ------
        FileError : there are none, or a turning radius out of its range.
        """
        try:
            return MotionPrimitives(
                self.resolution, self.headings, self.made, opposite, turn_radius, self.name
            )
        except SettingError as fault:
            raise FileError(fault.code, fault.what, where=self.name, allowed=fault.allowed) from None


def enough_headings(count: int, where: str) -> None:
    """Refuse more headings than a lattice may have.

    Raises
    ------
    LimitError : LIMIT.
    """
    if count > MAX_HEADINGS:
        raise LimitError("LIMIT", f"{count:,} headings", where=where, allowed=f"at most {MAX_HEADINGS}")
