"""The primitives that the planner ``lattice`` makes for a robot, as values that can be written to a file."""

from __future__ import annotations

import math

from lampyris._core.scalars import in_range, is_whole
from lampyris.errors import SettingError, of_kind, shown
from lampyris.model.lattice.motion_primitives import Motion, MotionPrimitives
from lampyris.model.robot import Robot
from lampyris.planning.lattice.lattice import LatticeShape, demand_reach, motions_of
from lampyris.planning.lattice.primitives import HEADINGS, angles, quarter_turned

SPACING = 0.5
"""Cells between two poses, and so a turn in place has a pose each half cell of a circle with a radius of four cells."""
_ARM = 4.0


def motion_primitives(
    robot: Robot, resolution: float, *, headings: int = 16, reverse: bool = False
) -> MotionPrimitives:
    """The primitives of the planner ``lattice`` for a robot, pose by pose.

    Parameters
    ----------
    robot : its drive and turning radius.
    resolution : metres a cell.
    headings : 16 or 32.
    reverse : whether motions in reverse are among them, as SBPL has it; Nav2 derives them from the others.

    Raises
    ------
    SettingError : a resolution or a number of headings out of its range.
    LimitError : motions of more than 1,000 cells.

    Examples
    --------
    >>> made = motion_primitives(Robot(drive="ackermann", turn_radius=0.5), 0.05)
    >>> len(made.motions), len(made.headings)
    (48, 16)
    """
    of_kind("robot", robot, Robot)
    of_kind("reverse", reverse, bool)
    if not in_range(resolution, 1e-6, 1000):
        raise SettingError.of(
            "MAP_RESOLUTION", "resolution", shown(resolution), allowed="1e-6 to 1000 metres a cell"
        )
    if not is_whole(headings, 0) or int(headings) not in HEADINGS:
        raise SettingError.of("HEADINGS", "headings", shown(headings), allowed="16 or 32")
    headings = int(headings)
    shape = LatticeShape(
        (), robot.drive, robot.turn_radius / resolution, headings, 1.0 if reverse else math.inf
    )
    quarter = sorted(motions_of(shape), key=lambda one: one.start)
    demand_reach(quarter, 0.0)
    motions = [
        Motion(
            k % len(quarter),
            one.start,
            one.end,
            one.cell,
            one.poses(SPACING, _ARM if one.length == 0 else 0.0) * (resolution, resolution, 1.0),
        )
        for k, one in enumerate(quarter_turned(one, headings, q) for q in range(4) for one in quarter)
    ]
    return MotionPrimitives(
        resolution, angles(headings), motions, opposite=not reverse, turn_radius=robot.turn_radius
    )
