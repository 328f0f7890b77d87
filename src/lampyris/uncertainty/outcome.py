"""The outcome of uncertain inputs: mean, spread, quantiles, and how much each input carries."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from lampyris._core.values import Value
from lampyris.typing import Floats

SHARES = (0.05, 0.25, 0.5, 0.75, 0.95)
"""Quantiles that are computed."""


@dataclass(frozen=True, slots=True)
class SobolIndices:
    """Which share of the variance an input carries.

    Parameters
    ----------
    first : by itself.
    total : by itself and together with others. The first-order indices of all inputs add up to at most 1, the total ones
        to at least 1.
    first_error, total_error : standard errors of a Monte Carlo estimate; None: from coefficients, without sampling.
    """

    first: float
    total: float
    first_error: float | None = None
    total_error: float | None = None


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class UncertainOutcome(Value):
    """What uncertain inputs make of an outcome.

    Parameters
    ----------
    of : what was computed, such as ``duration``; empty: the function's value.
    unit : of mean, standard deviation and quantiles.
    mean, sd : of the outcome.
    quantiles : by share, such as 0.95.
    sobol : by input, in the order in which they were given.
    runs : evaluations of the model in all, held-out ones included.
    method : ``polynomial-chaos`` or ``monte-carlo``.
    held_out_error : mean square error of the expansion at runs that it was not computed from, as a share of the variance;
        None: no expansion was tried.
    held_out : number of such runs.
    terms : polynomials of the expansion; 0 for Monte Carlo.
    mean_error, sd_error : standard errors of a Monte Carlo estimate, None for an expansion.
    note : that the outcome is not smooth, where the held-out error is above the tolerance; empty otherwise.
    sample : outcomes of random inputs, (n,): values of the expansion, or the Monte Carlo runs.
    """

    of: str
    unit: str
    mean: float
    sd: float
    quantiles: Mapping[float, float]
    sobol: Mapping[str, SobolIndices]
    runs: int
    method: str
    held_out_error: float | None
    held_out: int
    terms: int
    mean_error: float | None
    sd_error: float | None
    note: str
    sample: Floats = field(repr=False)

    @property
    def variance(self) -> float:
        """The square of the standard deviation."""
        return self.sd * self.sd


def quantiles_of(sample: Floats) -> dict[float, float]:
    """The quantiles of :data:`SHARES`, by linear interpolation."""
    return dict(zip(SHARES, np.quantile(sample, SHARES).tolist(), strict=True))
