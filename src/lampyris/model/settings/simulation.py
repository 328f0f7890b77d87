"""Settings of a simulation in ticks."""

from __future__ import annotations

import math
from dataclasses import dataclass

from lampyris._core.defaults import SIMULATION_PATIENCE, UNSEEN_COST
from lampyris._core.settings import check_settings, number, under_name, whole
from lampyris.errors import SettingError
from lampyris.model.settings.sensor import MOST_UNSEEN, Sensor

MAX_TICKS = 10**9
ALL_AROUND = 360.0


@dataclass(frozen=True, slots=True)
class SimulationSettings:
    """How long a simulation in ticks goes on, and what the robot sees of an unknown map.

    Parameters
    ----------
    ticks : the last tick. The default is ten times (height + width), and four times the steps of the first plan
        on top, but at most 250,000.
    patience : consecutive ticks that the robot waits before it gives up.
    sensor_range : sensor range: the robot starts without the map, and unseen cells count as free.
    field_of_view : angle that the sensor sees around the direction of the last move.
    unseen_cost : what a cell that has not been seen costs to enter, as a multiple of what it costs once it is seen. 1:
        paths over unseen cells are as good as others.

    Raises
    ------
    SettingError : ``TICKS``, ``PATIENCE``, ``SENSOR_RANGE``, ``FIELD_OF_VIEW``, ``UNSEEN_COST``.
    """

    ticks: int | None = whole(None, 1, MAX_TICKS, none="depends on the size of the map")
    patience: int | None = whole(None, 0, MAX_TICKS, unit="ticks", none=f"{SIMULATION_PATIENCE}")
    sensor_range: float | None = number(None, 1e-3, 1e6, unit="metres", none="the map is known")
    field_of_view: float = number(ALL_AROUND, 0.0, ALL_AROUND, unit="degrees", above=True)
    unseen_cost: float = number(UNSEEN_COST, 1.0, MOST_UNSEEN)

    def __post_init__(self) -> None:
        check_settings(self, under_name(""))
        if self.sensor_range is None and self.field_of_view != ALL_AROUND:
            raise SettingError.of(
                "FIELD_OF_VIEW", "field_of_view", f"{self.field_of_view:g} without a range of the sensor",
                allowed="a field of view together with sensor_range",
            )  # fmt: skip
        if self.sensor_range is None and self.unseen_cost != UNSEEN_COST:
            raise SettingError.of(
                "UNSEEN_COST", "unseen_cost", f"{self.unseen_cost:g} without a range of the sensor",
                allowed="a cost of unseen cells together with sensor_range",
            )  # fmt: skip

    @property
    def sensor(self) -> Sensor | None:
        """The sensor; None: the map is known."""
        if self.sensor_range is None:
            return None
        return Sensor(self.sensor_range, math.radians(self.field_of_view), self.unseen_cost)
