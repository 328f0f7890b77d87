"""Sensor: how far a robot sees that does not know its map."""

from __future__ import annotations

import math
from dataclasses import dataclass

from lampyris._core.defaults import UNSEEN_COST
from lampyris._core.noun import Noun
from lampyris._core.settings import check_settings, number, under_name

FULL_TURN = 2.0 * math.pi
MOST_UNSEEN = 5.0
"""Highest price of a cell that has not been seen: that of the highest terrain value."""


@dataclass(frozen=True, slots=True, repr=False)
class Sensor(Noun):
    """A range sensor on a robot that begins without a map; cells count as free until they are seen, and may cost more.

    A free cell is seen when the straight segment from the centre of the robot's cell to its centre passes through no
    wall and not between two walls that touch at a corner; so visibility is symmetric. A wall
    is seen when the free cell across one of its sides that face the robot is in sight, or is the robot's own cell. Both
    must be within the range and the field of view. In addition there are bumpers: the robot knows every cell that its next
    step could touch, whatever the range and the field of view.

    Parameters
    ----------
    range_m : maximum distance between the centres of the robot's cell and a cell that it sees, metres.
    field_of_view : angle that it sees, radians, half of it on either side of the direction of the robot's last move. Before
        its first move it sees in all directions.
    unseen_cost : what a cell that has not been seen costs the planner to enter, as a multiple of what it costs once it is
        seen; with terrain at most five times plain ground. Above 1 paths over seen cells are preferred, and the planner is
        asked again whenever cells have been seen.

    Raises
    ------
    SettingError : ``RANGE_M``, ``FIELD_OF_VIEW``, ``UNSEEN_COST``.

    Examples
    --------
    >>> import lampyris
    >>> scene = lampyris.Scene(lampyris.load_grid("env-1"), start=(37, 8), goal=(5, 38))
    >>> trace = lampyris.simulate(scene, "dstar-lite", sensor=lampyris.Sensor(5.0))
    >>> trace.outcome.value, trace.replans > 0
    ('arrived', True)
    """

    range_m: float = number(None, 1e-3, 1e6, unit="m")
    field_of_view: float = number(FULL_TURN, 0.0, FULL_TURN, unit="rad", above=True)
    unseen_cost: float = number(UNSEEN_COST, 1.0, MOST_UNSEEN)

    def __post_init__(self) -> None:
        check_settings(self, under_name("sensor"))

    def _brief(self) -> str:
        cost = "" if self.unseen_cost == UNSEEN_COST else f", unseen cells cost {self.unseen_cost:g}"
        return f"<Sensor {self.range_m:g} m, {math.degrees(self.field_of_view):.4g} degrees{cost}>"
