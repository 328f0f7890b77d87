"""How far a glowworm moves at iteration t: small frozen rules."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Protocol

from lampyris._core.elementary import exp
from lampyris._core.scalars import is_real
from lampyris.errors import SettingError, shown


class StepRule(Protocol):
    """A step length for each iteration."""

    def at(self, t: int) -> float:
        """Length of the steps of iteration t = 0, 1, ..."""
        ...


HORIZON = 250.0
"""Iterations over which a step shrinks."""


@dataclass(frozen=True, slots=True)
class FixedStep:
    """The same step always: standard GSO (Krishnanand and Ghose: 0.03)."""

    length: float = 0.03

    def __post_init__(self) -> None:
        _positive(self)

    def at(self, t: int) -> float:
        """Length of the steps of iteration t."""
        return self.length


@dataclass(frozen=True, slots=True)
class DecayingStep:
    """Adaptive step: ``s(t + 1) = mu exp(-psi t) + xi``.

    Li and Huang 2018 (blind separation of speech by an improved GSO). In the copy that could be read, their
    table does not tell which of the three is 0.06 and which 0.03, so the defaults are ours.

    Parameters
    ----------
    mu : 0 < mu < 1; what the step begins with above its floor.
    psi : 0 < psi < 1; how fast that falls off.
    xi : the floor, > 0.
    """

    mu: float = 0.5
    psi: float = 0.03
    xi: float = 0.03

    def __post_init__(self) -> None:
        _positive(self)
        if not (self.mu < 1 and self.psi < 1):
            raise SettingError(
                "STEP", f"mu {shown(self.mu)}, psi {shown(self.psi)}", allowed="0 < mu, psi < 1"
            )

    def at(self, t: int) -> float:
        """Length of the steps of iteration t; the published t + 1 is the move that follows."""
        return self.mu * float(exp(-self.psi * t)) + self.xi


@dataclass(frozen=True, slots=True)
class CoolingStep:
    """IGSO's step, ours: ``s(t) = least + (most - least) exp(-fall t / horizon)``.

    He and Huang 2016 change the step with time; their formula could not be found.
    """

    most: float = 0.3
    least: float = 0.01
    fall: float = 5.0
    horizon: float = HORIZON

    def __post_init__(self) -> None:
        _positive(self)
        if self.least > self.most:
            raise SettingError(
                "STEP", f"least {shown(self.least)}, most {shown(self.most)}", allowed="least <= most"
            )

    def at(self, t: int) -> float:
        """Length of the steps of iteration t."""
        share = float(exp(-self.fall * t / self.horizon))
        return self.least + (self.most - self.least) * share


def _positive(rule: FixedStep | DecayingStep | CoolingStep) -> None:
    for f in fields(rule):
        value = getattr(rule, f.name)
        if not (is_real(value) and value > 0):
            raise SettingError.of("STEP", f.name, shown(value), allowed="a finite number > 0")
