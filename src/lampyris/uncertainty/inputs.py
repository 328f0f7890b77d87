"""Uncertain inputs: a value that is uniform between two numbers, or normal around one."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import ClassVar, TypeAlias

import numpy as np

from lampyris._core.scalars import is_real
from lampyris.errors import SettingError, shown
from lampyris.typing import Floats
from lampyris.uncertainty.bases import (
    HERMITE_POINTS,
    PATTERSON_LEVELS,
    QuadratureRule,
    hermite,
    legendre,
    normal_rule,
    uniform_rule,
)

CUT = 6.0
"""Standard deviations from the mean at which a normal input is cut off; two draws in 10^9 are beyond."""
NOTATION = "LOW:HIGH (uniform), or normal(MEAN, SD)"


@dataclass(frozen=True, slots=True)
class Uniform:
    """A value that is anything between two numbers, all equally likely.

    Parameters
    ----------
    low, high : finite, low below high.

    Raises
    ------
    SettingError : ``UNCERTAIN_INPUT``.

    Examples
    --------
    >>> Uniform(0.8, 1.2).range
    (0.8, 1.2)
    """

    low: float
    high: float
    levels: ClassVar[int] = PATTERSON_LEVELS

    def __post_init__(self) -> None:
        if not (is_real(self.low) and is_real(self.high) and self.low < self.high):
            what = f"{shown(self.low)} to {shown(self.high)}"
            raise SettingError("UNCERTAIN_INPUT", what, where="uniform", allowed="two finite numbers, rising")

    @property
    def range(self) -> tuple[float, float]:
        """Least and greatest value."""
        return float(self.low), float(self.high)

    def rule(self, level: int) -> QuadratureRule:
        """The quadrature rule of a level."""
        return uniform_rule(level)

    def basis(self, z: Floats, degree: int) -> Floats:
        """The orthonormal polynomials at standardised values, (degree + 1, n)."""
        return legendre(z, degree)

    def standard(self, rng: np.random.Generator, count: int) -> Floats:
        """Random standardised values, in [-1, 1]."""
        return 2.0 * rng.random(count) - 1.0

    def value(self, z: float) -> float:
        """What a standardised value stands for."""
        low, high = self.range
        return low + (high - low) * (0.5 * (z + 1.0))


@dataclass(frozen=True, slots=True)
class Normal:
    """A value that is normally distributed, cut off at 6 standard deviations.

    Parameters
    ----------
    mean, sd : finite; the standard deviation is above 0.

    Raises
    ------
    SettingError : ``UNCERTAIN_INPUT``.

    Examples
    --------
    >>> Normal(2.0, 0.25).range
    (0.5, 3.5)
    """

    mean: float
    sd: float
    levels: ClassVar[int] = len(HERMITE_POINTS)

    def __post_init__(self) -> None:
        if not (is_real(self.mean) and is_real(self.sd) and self.sd > 0.0):
            what = f"mean {shown(self.mean)}, standard deviation {shown(self.sd)}"
            allowed = "two finite numbers, the standard deviation above 0"
            raise SettingError("UNCERTAIN_INPUT", what, where="normal", allowed=allowed)

    @property
    def range(self) -> tuple[float, float]:
        """Least and greatest value."""
        return self.mean - CUT * self.sd, self.mean + CUT * self.sd

    def rule(self, level: int) -> QuadratureRule:
        """The quadrature rule of a level."""
        return normal_rule(level)

    def basis(self, z: Floats, degree: int) -> Floats:
        """The orthonormal polynomials at standardised values, (degree + 1, n)."""
        return hermite(z, degree)

    def standard(self, rng: np.random.Generator, count: int) -> Floats:
        """Random standardised values, in standard deviations."""
        return np.clip(rng.standard_normal(count), -CUT, CUT)

    def value(self, z: float) -> float:
        """What a standardised value stands for."""
        return self.mean + self.sd * z


Input: TypeAlias = Uniform | Normal
"""The distribution of one input."""

_NORMAL = re.compile(r"normal\(([^,()]+),([^,()]+)\)")


def parse_input(text: str, name: str) -> Input:
    """``0.8:1.2`` or ``normal(0.15,0.02)`` as a distribution.

    Parameters
    ----------
    name : of the input, for errors.

    Raises
    ------
    SettingError : ``UNCERTAIN_INPUT``.
    """
    plain = text.replace(" ", "")
    normal = _NORMAL.fullmatch(plain)
    parts = normal.groups() if normal else tuple(plain.split(":"))
    try:
        first, second = (float(part) for part in parts)
        return Normal(first, second) if normal else Uniform(first, second)
    except (ValueError, SettingError) as problem:
        more = f" ({problem.allowed})" if isinstance(problem, SettingError) else ""
        raise SettingError(
            "UNCERTAIN_INPUT", shown(text), where=f"vary.{name}", allowed=NOTATION + more, setting="vary",
            value=f"{name}={text}"[:200],
        ) from None  # fmt: skip
