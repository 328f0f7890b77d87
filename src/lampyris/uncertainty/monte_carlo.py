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


def sampled(
    evaluate: Callable[[Floats], float], inputs: Sequence[Input], rng: np.random.Generator, runs: int
) -> Sampled:
    """Estimates from so many runs.

    Two independent sets A and B of n inputs, and for each input k the set A with column k of B: n = runs / (d + 2). Mean and
    spread are those of A and B together. First-order indices are the mean of ``f(B) (f(A_B) - f(A))`` (Saltelli et al.
    2010), total ones half the mean of ``(f(A) - f(A_B))^2`` (Jansen 1999), each over the variance; the outcome is
    centred first, which makes the former far less noisy. Standard errors are those of these means.
    """
    n = runs // (len(inputs) + 2)
    a, b = (np.stack([one.standard(rng, n) for one in inputs], axis=1) for _ in range(2))
    at_a, at_b = (np.array([evaluate(row) for row in rows]) for rows in (a, b))
    sample = np.concatenate((at_a, at_b))
    mean, variance = float(sample.mean()), float(sample.var(ddof=1))
    centred_a, centred_b = at_a - mean, at_b - mean
    sobol = []
    for k in range(len(inputs)):
        mixed = a.copy()
        mixed[:, k] = b[:, k]
        centred = np.array([evaluate(row) for row in mixed]) - mean
        first = centred_b * (centred - centred_a)
        total = 0.5 * (centred_a - centred) ** 2
        sobol.append(_indices(first, total, variance))
    fourth = float(np.mean((sample - mean) ** 4))
    sd = variance**0.5
    sd_error = (
        (max(fourth - variance * variance, 0.0) / (4.0 * variance * len(sample))) ** 0.5 if sd > 0.0 else 0.0
    )
    return Sampled(mean, sd, sd / len(sample) ** 0.5, sd_error, sobol, sample)


def _indices(first: Floats, total: Floats, variance: float) -> SobolIndices:
    if variance == 0.0:
        return SobolIndices(0.0, 0.0, 0.0, 0.0)
    root = len(first) ** 0.5
    return SobolIndices(
        float(first.mean()) / variance,
        float(total.mean()) / variance,
        float(first.std(ddof=1)) / variance / root,
        float(total.std(ddof=1)) / variance / root,
    )
