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

    choice: str = word("greedy", ("greedy", "roulette", "exact"), title="choice of the next cell")
    nt: int = whole(10, 1, 10_000, title="neighbours wanted")
    mvr: int = whole(3, 1, 50, title="most rings")
    rho: float = number(RHO, 0.0, 1.0, above=True, title="luciferin decay")
    gamma: float = number(GAMMA, 0.0, math.inf, above=True, title="luciferin enhancement")
    gates: str = word(GATES, ("ignore", "close", "replan"), title="narrow openings")
    iter_max: int | None = whole(None, 1, 10**9, none="no limit", title="most jumps")
    obstacle_density_weight: float = number(0.0, 0.0, 4.0)
    window: int = whole(3, 1, 50, unit="cells", title="window of the density")
    traffic_density_weight: float = number(0.0, 0.0, 4.0)
    min_clearance: int = whole(0, 0, 50, unit="cells")
    max_extra: float | None = number(0.25, 0.0, math.inf, none="any length", title="extra length allowed")

    def __post_init__(self) -> None:
        check_settings(self, under_name(self.name))
