"""The lattice planner: states (cell, heading), motion primitives, a bound on every path."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from lampyris._core.settings import check_settings, flag, number, under_name, whole
from lampyris.errors import SettingError, shown
from lampyris.model.scene import Scene
from lampyris.planning.base import Traits
from lampyris.planning.lattice.primitives import HEADINGS
from lampyris.planning.lattice.session import LatticeSession


@dataclass(frozen=True, slots=True)
class LatticePlanner:
    """Weighted A* over a state lattice of cells and headings, for robots with a shape.

    Parameters
    ----------
    weight : the path costs at most so many times the least cost in the lattice; 1 finds the least.
    anytime : after the first path search with smaller weights, until the budget is used or the path is the best.
    headings : 16 or 32.
    reverse_cost : a metre in reverse costs as much as so many ahead.
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
    anytime: bool = flag(False)
    headings: int = whole(16, 16, 32)
    reverse_cost: float = number(2.0, 1.0, 100.0)
    reverse: bool = flag(True)
    turn_cost: float = number(0.5, 1e-3, 100.0, unit="m/rad")
    goal_tolerance: float = number(0.0, 0.0, 1e3, unit="m")
    goal_yaw_tolerance: float = number(0.0, 0.0, math.pi, unit="rad")

    name: ClassVar[str] = "lattice"
    traits: ClassVar[Traits] = Traits(optimal=False, plans_headings=True)
    summary: ClassVar[str] = "State lattice: poses for a robot with a shape, with a bound on the cost."
    source: ClassVar[str] = (
        "Pivtoraiko, Knepper, Kelly 2009; Likhachev, Gordon, Thrun 2003 (ARA*); primitives and heuristic are ours."
    )

    def __post_init__(self) -> None:
        check_settings(self, under_name(self.name))
        if self.headings not in HEADINGS:
            raise SettingError.of(
                "HEADINGS", "headings", shown(self.headings), where=self.name, allowed="16 or 32"
            )

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> LatticeSession:
        """Start a session. Nothing is drawn from ``rng`` and there is no per-iteration record."""
        return LatticeSession(self, scene)
