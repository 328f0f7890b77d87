"""Uncertainty: what uncertain settings do to an outcome, by polynomial chaos or Monte Carlo."""

from __future__ import annotations

from lampyris.uncertainty.expansion import expand
from lampyris.uncertainty.inputs import Normal, Uniform
from lampyris.uncertainty.outcome import UncertainOutcome

__all__ = ["Normal", "UncertainOutcome", "Uniform", "expand"]
