"""Settings of AD-GSO, checked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from lampyris._core.predicates import is_real
from lampyris.errors import SettingError, did_you_mean, shown

CHOICES = ("greedy", "roulette", "exact")
GATES = ("ignore", "close", "replan")
MAX_NT = 10_000
MAX_MVR = 50


@dataclass(frozen=True, slots=True)
class AdGsoSettings:
    """The settings of :class:`lampyris.planning.adgso.ad_gso.AdGso`, which says what each means.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    name: ClassVar[str] = "ad-gso"

    choice: str = "greedy"
    nt: int = 10
    mvr: int = 3
    rho: float = 0.4
    gamma: float = 0.6
    gates: str = "ignore"
    iter_max: int | None = None
    obstacle_density_weight: float = 0.0
    window: int = 3
    traffic_density_weight: float = 0.0
    min_clearance: int = 0
    max_extra: float | None = 0.25

    def __post_init__(self) -> None:
        _one_of("CHOICE", "choice", self.choice, CHOICES)
        _one_of("GATES", "gates", self.gates, GATES)
        _whole("NT", "nt", self.nt, MAX_NT)
        _whole("MVR", "mvr", self.mvr, MAX_MVR)
        if self.iter_max is not None:
            _whole("ITER_MAX", "iter_max", self.iter_max, 10**9)
        _whole("WINDOW", "window", self.window, MAX_MVR)
        if not (is_real(self.min_clearance) and self.min_clearance == 0):
            _whole("MIN_CLEARANCE", "min_clearance", self.min_clearance, MAX_MVR)
        for what, weight in (
            ("obstacle_density_weight", self.obstacle_density_weight),
            ("traffic_density_weight", self.traffic_density_weight),
        ):
            if not (is_real(weight) and 0 <= weight <= 4):
                raise SettingError.of(what.upper(), what, shown(weight), where="ad-gso", allowed="0 to 4")
        if self.max_extra is not None and not (is_real(self.max_extra) and self.max_extra >= 0):
            allowed = "a share >= 0 (0.25: a quarter longer at most), or None"
            raise SettingError.of(
                "MAX_EXTRA", "max_extra", shown(self.max_extra), where="ad-gso", allowed=allowed
            )
        if not (is_real(self.rho) and 0 < self.rho <= 1):
            raise SettingError.of("RHO", "rho", shown(self.rho), where="ad-gso", allowed="0 < rho <= 1")
        if not (is_real(self.gamma) and self.gamma > 0):
            raise SettingError.of(
                "GAMMA", "gamma", shown(self.gamma), where="ad-gso", allowed="a finite number > 0"
            )


def _one_of(code: str, what: str, value: object, allowed: tuple[str, ...]) -> None:
    if not isinstance(value, str) or value not in allowed:
        todo = did_you_mean(value, allowed)
        raise SettingError.of(code, what, shown(value), where="ad-gso", allowed=", ".join(allowed), todo=todo)


def _whole(code: str, what: str, value: object, most: int) -> None:
    if not isinstance(value, int) or isinstance(value, bool) or not 1 <= value <= most:
        raise SettingError.of(
            code, what, shown(value), where="ad-gso", allowed=f"a whole number, 1 to {most}"
        )
