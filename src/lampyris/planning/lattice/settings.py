"""Settings that the planners on a state lattice share."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from lampyris._core.settings import check_settings, flag, number, under_name, whole
from lampyris.errors import SettingError, shown
from lampyris.planning.lattice.primitives import HEADINGS

_JUDGED = ("goal_tolerance", "goal_yaw_tolerance", "reverse_cost", "turn_cost")


@dataclass(frozen=True, slots=True)
class LatticeSettings:
    """Settings of a planner on a state lattice.

    Parameters
    ----------
    weight : the path costs at most so many times the least cost in the lattice; 1 finds the least.
    headings : 16 or 32.
    reverse_cost : cost of a metre in reverse, in metres ahead.
    reverse : whether it may drive in reverse.
    turn_cost : a radian turned in place costs as much as so many metres ahead.
    goal_tolerance : distance from the goal at which it counts as reached.
    goal_yaw_tolerance : angle from the yaw of the goal at which it counts as reached; at least the nearest heading
        does.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    weight: float = number(1.5, 1.0, 1e3)
    headings: int = whole(16, 16, 32)
    reverse_cost: float = number(2.0, 1.0, 100.0)
    reverse: bool = flag(True)
    turn_cost: float = number(0.5, 1e-3, 100.0, unit="m/rad")
    goal_tolerance: float = number(0.0, 0.0, 1e3, unit="m")
    goal_yaw_tolerance: float = number(0.0, 0.0, math.pi, unit="rad")

    name: ClassVar[str] = "lattice"
    finds_disc_paths: ClassVar[bool] = True
    """A robot that turns in place finds a path wherever a disc around it, a cell wider than the robot, has one by octile
    steps: the lattice has these steps, and between them it turns."""

    def __post_init__(self) -> None:
        check_settings(self, under_name(self.name))
        if self.headings not in HEADINGS:
            raise SettingError.of(
                "HEADINGS", "headings", shown(self.headings), where=self.name, allowed="16 or 32"
            )

    def judged_by(self, resolution: float) -> dict[str, float]:
        """Attributes of a plan by which the referee judges its poses: what settings and the resolution alone decide."""
        attributes = {name: getattr(self, name) for name in _JUDGED}
        return {**attributes, "cost_penalty": 0.0}
