"""Monte Carlo: mean, spread and Sobol indices from random runs, with standard errors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from lampyris.typing import Floats
from lampyris.uncertainty.inputs import Input
from lampyris.uncertainty.outcome import SobolIndices


class Sampled(NamedTuple):
    """What random runs say; ``sample`` are the outcomes at independent inputs."""

    mean: float
    sd: float
    mean_error: float
    sd_error: float
    sobol: list[SobolIndices]
    sample: Floats


def mixtures(count: int) -> tuple[int, ...]:
    """Which inputs are taken from B, as bits, in each set of runs; the rest are taken from A.

    None, all, one alone, all but one: with one or two inputs some of these are the same.
    """
    whole = (1 << count) - 1
    ones = [1 << k for k in range(count)]
    return tuple(sorted({0, whole, *ones, *(whole ^ one for one in ones)}))


def sampled(
    evaluate: Callable[[Floats], Sequence[float]],
    inputs: Sequence[Input],
    rng: np.random.Generator,
    runs: int,
) -> Sampled:
    """Estimates from so many runs; ``evaluate`` gives the outcomes at inputs (n, d).

    Two independent sets A and B of n inputs, and for each input k two more: A with column k of B, and B with column k of A.
    Mean and spread are those of A and B together. With the outcomes a, b, ``a_k`` and ``b_k`` of the four, the first-order
    index is ``2 (b_k - b) (a - a_k)`` and the total one ``(b - b_k)^2 + (a - a_k)^2``, each summed and over the sum of
    ``(a - b)^2 + (a_k - b_k)^2`` (Azzini, Mara, Rosati, "Comparison of two sets of Monte Carlo estimators of Sobol' indices",
    Environmental Modelling & Software 144, 2021). A single input has exactly 1. Standard errors are those of these ratios.
    """
    mixed = mixtures(len(inputs))
    n = runs // len(mixed)
    a, b = (np.stack([one.standard(rng, n) for one in inputs], axis=1) for _ in range(2))
    at: dict[int, Floats] = {}
    for mask in mixed:
        rows = np.where([mask >> k & 1 == 1 for k in range(len(inputs))], b, a)
        at[mask] = np.array(evaluate(rows))
    whole = mixed[-1]
    sample = np.concatenate((at[0], at[whole]))
    mean, variance = float(sample.mean()), float(sample.var(ddof=1))
    sobol = [_indices(at[0], at[whole], at[1 << k], at[whole ^ (1 << k)]) for k in range(len(inputs))]
    fourth = float(np.mean((sample - mean) ** 4))
    sd = variance**0.5
    sd_error = (
        (max(fourth - variance * variance, 0.0) / (4.0 * variance * len(sample))) ** 0.5 if sd > 0.0 else 0.0
    )
    return Sampled(mean, sd, sd / len(sample) ** 0.5, sd_error, sobol, sample)


def _indices(a: Floats, b: Floats, a_k: Floats, b_k: Floats) -> SobolIndices:
    below = np.square(a - b) + np.square(a_k - b_k)
    if float(below.sum()) == 0.0:
        return SobolIndices(0.0, 0.0, 0.0, 0.0)
    first, first_error = _ratio(2.0 * (b_k - b) * (a - a_k), below)
    total, total_error = _ratio(np.square(b - b_k) + np.square(a - a_k), below)
    return SobolIndices(first, total, first_error, total_error)


def _ratio(above: Floats, below: Floats) -> tuple[float, float]:
    """Ratio of two means, and its standard error to first order."""
    ratio = float(above.sum()) / float(below.sum())
    away = above - ratio * below
    return ratio, float(away.std(ddof=1)) / float(below.mean()) / len(away) ** 0.5
