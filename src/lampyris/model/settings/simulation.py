"""Settings of a simulation in ticks."""

from __future__ import annotations

from dataclasses import dataclass

from lampyris._core.defaults import SIMULATION_PATIENCE
from lampyris._core.settings import check_settings, under_name, whole

MAX_TICKS = 10**9


@dataclass(frozen=True, slots=True)
class SimulationSettings:
    """How long a simulation in ticks goes on.

    Parameters
    ----------
    ticks : the last tick. The default is ten times (height + width), and four times the steps of the first plan
        on top, but at most 250,000.
    patience : consecutive ticks that the robot waits before it gives up.

    Raises
    ------
    SettingError : ``TICKS``, ``PATIENCE``.
    """

    ticks: int | None = whole(None, 1, MAX_TICKS, none="ample for the size of the map")
    patience: int | None = whole(None, 0, MAX_TICKS, unit="ticks", none=f"{SIMULATION_PATIENCE}")

    def __post_init__(self) -> None:
        check_settings(self, under_name(""))
