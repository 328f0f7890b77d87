"""Settings of AD-GSO, checked."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from lampyris._core.defaults import GAMMA, GATES, RHO
from lampyris._core.settings import check_settings, number, under_name, whole, word


@dataclass(frozen=True, slots=True)
class AdGsoSettings:
    """The settings of :class:`lampyris.planning.adgso.ad_gso.AdGso`, which says what each means.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    name: ClassVar[str] = "ad-gso"

    choice: str = word("greedy", ("greedy", "roulette", "exact"))
    nt: int = whole(10, 1, 10_000)
    mvr: int = whole(3, 1, 50)
    rho: float = number(RHO, 0.0, 1.0, above=True)
    gamma: float = number(GAMMA, 0.0, math.inf, above=True)
    gates: str = word(GATES, ("ignore", "close", "replan"))
    iter_max: int | None = whole(None, 1, 10**9, none="no limit")
    obstacle_density_weight: float = number(0.0, 0.0, 4.0)
    window: int = whole(3, 1, 50, unit="cells")
    traffic_density_weight: float = number(0.0, 0.0, 4.0)
    min_clearance: int = whole(0, 0, 50, unit="cells")
    max_extra: float | None = number(0.25, 0.0, math.inf, none="any length")

    def __post_init__(self) -> None:
        check_settings(self, under_name(self.name))
