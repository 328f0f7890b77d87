"""Polynomial chaos of any function of independent uncertain inputs, with Monte Carlo where it is not smooth."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context

import numpy as np

from lampyris._core import cancellation, defaults
from lampyris._core.scalars import MAX_SEED, SEED_RANGE, in_range, is_real, is_whole, is_word
from lampyris.errors import SettingError, callable_or_none, plural, shown
from lampyris.typing import Floats
from lampyris.uncertainty.index_growth import FORCED, IndexGrowth, Terms, value_of
from lampyris.uncertainty.inputs import Input, Normal, Uniform
from lampyris.uncertainty.monte_carlo import mixtures, sampled
from lampyris.uncertainty.outcome import SobolIndices, UncertainOutcome, quantiles_of

SAMPLE = 20_000
"""Values of the expansion from which quantiles are computed."""
MOST_INPUTS = 12
MOST_WORKERS = 256
_STRICTER = 0.25
"""What the estimate from the surpluses is lowered by where the held-out error shows that it was too optimistic."""
_MARGIN = 0.25
"""Share of the tolerance at which the held-out error alone ends the growth: it is known to some tens of percent."""
_ROUNDING = 1e-11
"""Share of the outcome below which its changes are rounding."""

Function = Callable[[dict[str, float]], float]
"""From the values of all inputs, by name, to the outcome."""
Evaluate = Callable[[list[dict[str, float]]], Iterable[float]]
"""From the values at many points to the outcomes, in their order."""
Progress = Callable[[int, int], None]
"""Called with the runs so far and the most there may be."""


def expand(
    function: Function,
    inputs: Mapping[str, Input],
    *,
    tolerance: float = defaults.UNCERTAINTY_TOLERANCE,
    runs: int = defaults.EXPANSION_RUNS,
    method: str = defaults.UNCERTAINTY_METHOD,
    monte_carlo_runs: int = defaults.MONTE_CARLO_RUNS,
    held_out: int = defaults.HELD_OUT_RUNS,
    seed: int = 0,
    of: str = "",
    unit: str = "",
    progress: Progress | None = None,
    workers: int = 1,
) -> UncertainOutcome:
    """Mean, spread, quantiles and Sobol indices of a function of independent uncertain inputs.

    The function is expanded in polynomials orthonormal under the inputs' distributions (Legendre for :class:`Uniform`,
    Hermite for :class:`Normal`), by Smolyak pseudo-spectral projection (Conrad and Marzouk 2013) with the
    dimension-adaptive growth of Gerstner and Griebel (2003). All pairs of inputs are looked at before growth is left to the
    surpluses. The expansion is compared with random runs that it was not computed from; where its mean square error there
    is above ``tolerance`` times the variance, it grows on, and where that does not help the function is not smooth enough
    and Monte Carlo is used.

    Parameters
    ----------
    function : of the values of all inputs, by name. It is deterministic and gives a finite number.
    inputs : distribution by name, 1 to 12.
    tolerance : share of the variance that may be missing, 1e-9 to 0.5.
    runs : most evaluations for an expansion, held-out ones included.
    method : ``auto``, ``polynomial-chaos`` (never Monte Carlo; the held-out error says how good it is) or ``monte-carlo``.
    monte_carlo_runs : evaluations for Monte Carlo.
    held_out : evaluations that the expansion is compared with, at least 2.
    seed : of the held-out inputs, the sample for quantiles and Monte Carlo.
    of, unit : what the outcome is, for the result.
    progress : called with the runs so far and the most there may be.
    workers : processes that share the evaluations, 1 to 256; more than one only for a function that can be pickled, such as
        one of a module. The result is the same whatever their number.

    Raises
    ------
    SettingError : ``WORKERS``; ``UNCERTAIN_INPUTS``, ``TOLERANCE``, ``RUNS`` (fewer than the first indices need), ``METHOD``,
        ``MONTE_CARLO_RUNS``, ``HELD_OUT``, ``SEED``; ``UNCERTAIN_OUTCOME``: the function gave no finite number.

    Examples
    --------
    >>> made = expand(lambda x: x["a"] + 2.0 * x["b"], {"a": Uniform(-1.0, 1.0), "b": Normal(0.0, 1.0)})
    >>> round(made.mean, 9), round(made.variance, 6), round(made.sobol["b"].first, 6)
    (0.0, 4.333333, 0.923077)
    """
    _check(inputs, tolerance, runs, method, monte_carlo_runs, held_out, seed)
    callable_or_none("progress", progress)
    if not is_whole(workers, 1, MOST_WORKERS):
        raise SettingError.of(
            "WORKERS", "workers", shown(workers), where="uncertainty", allowed=f"1 to {MOST_WORKERS}"
        )
    with _evaluator(function, int(workers)) as evaluate:
        return _expanded(
            evaluate, inputs, tolerance, runs, method, monte_carlo_runs, held_out, seed, of, unit, progress
        )


@contextmanager
def _evaluator(function: Function, workers: int) -> Iterator[Evaluate]:
    """What evaluates many points in order, in this process or in several."""
    if workers == 1:
        yield lambda points: map(function, points)
        return
    # Not forked: threads of numerical libraries do not survive that.
    pool = ProcessPoolExecutor(workers, mp_context=get_context("spawn"))
    try:
        yield lambda points: pool.map(function, points, chunksize=max(1, len(points) // (4 * workers)))
    finally:
        pool.shutdown(cancel_futures=True)


def _expanded(
    evaluate: Evaluate,
    inputs: Mapping[str, Input],
    tolerance: float,
    runs: int,
    method: str,
    monte_carlo_runs: int,
    held_out: int,
    seed: int,
    of: str,
    unit: str,
    progress: Progress | None,
) -> UncertainOutcome:
    """See :func:`expand`."""
    names = tuple(inputs)
    given = tuple(inputs[name] for name in names)
    least = held_out + least_runs(len(names))
    if method != "monte-carlo" and runs < least:
        raise SettingError.of(
            "RUNS", "runs", f"{runs}", where="uncertainty",
            allowed=f"at least {least} for {plural(len(names), 'input')}, {held_out} of them held out",
        )  # fmt: skip
    model = _Model(evaluate, names, given, progress, monte_carlo_runs if method == "monte-carlo" else runs)
    draws = [np.random.Generator(np.random.PCG64(one)) for one in np.random.SeedSequence(seed).spawn(3)]
    note, held_out_error = "", None
    if method != "monte-carlo":
        growth, held_out_error = _grown(model, given, draws[0], tolerance, runs, held_out)
        if held_out_error > tolerance:
            note = (
                f"not smooth: the expansion's held-out error is {held_out_error:.2g} of the variance after "
                f"{model.runs} runs, above the tolerance {tolerance:g}"
            )
        if not note or method == "polynomial-chaos":
            z = _random(given, draws[1], SAMPLE)
            return _of_expansion(
                growth.terms, names, given, z, of, unit, model.runs, held_out_error, held_out, note
            )
        note += "; Monte Carlo instead"
        model.most = model.runs + monte_carlo_runs
    found = sampled(model, given, draws[2], monte_carlo_runs)
    return UncertainOutcome(
        of, unit, found.mean, found.sd, quantiles_of(found.sample), dict(zip(names, found.sobol, strict=True)),
        model.runs, "monte-carlo", held_out_error, held_out if held_out_error is not None else 0, 0,
        found.mean_error, found.sd_error, note, found.sample,
    )  # fmt: skip


def least_runs(count: int) -> int:
    """Evaluations of the indices of order up to 2, for so many inputs, at most."""
    return 1 + 6 * count + 2 * count * (count - 1)


class _Model:
    """The function of standardised inputs, its runs counted."""

    def __init__(
        self,
        evaluate: Evaluate,
        names: Sequence[str],
        inputs: Sequence[Input],
        progress: Progress | None,
        most: int,
    ) -> None:
        self._evaluate, self._names, self._inputs, self._progress = evaluate, names, inputs, progress
        self.most, self.runs = most, 0

    def __call__(self, z: Floats) -> list[float]:
        """The outcomes at standardised inputs, (n, d)."""
        cancellation.checkpoint()
        points = [
            {name: one.value(x) for name, one, x in zip(self._names, self._inputs, row, strict=True)}
            for row in z.tolist()
        ]
        outcomes = []
        for values, outcome in zip(points, self._evaluate(points), strict=True):
            cancellation.checkpoint()
            if not is_real(outcome):
                at = ", ".join(f"{name}={value:g}" for name, value in values.items())
                raise SettingError(
                    "UNCERTAIN_OUTCOME", f"{shown(outcome)} at {at}", allowed="a finite number"
                )
            self.runs += 1
            if self._progress is not None:
                self._progress(self.runs, self.most)
            outcomes.append(float(outcome))
        return outcomes


def _grown(
    model: _Model,
    inputs: Sequence[Input],
    rng: np.random.Generator,
    tolerance: float,
    runs: int,
    held_out: int,
) -> tuple[IndexGrowth, float]:
    """An expansion, and its mean square error at held-out inputs as a share of the variance."""
    z = _random(inputs, rng, held_out)
    truth = np.array(model(z))
    growth = IndexGrowth(model, inputs)
    growth.start()
    rounding = float(np.mean(truth * truth)) * _ROUNDING * _ROUNDING
    aim = tolerance
    while True:
        error = float(np.mean((value_of(growth.terms, inputs, z) - truth) ** 2))
        if error <= rounding and growth.open <= rounding:  # as of an outcome that no input changes
            return growth, 0.0
        variance = max(growth.variance, float(np.var(truth)))
        share = error / variance
        if share <= _MARGIN * tolerance:
            return growth, share
        if growth.open <= aim * growth.variance:
            if share <= tolerance:
                return growth, share
            aim *= _STRICTER
        if not growth.grow(runs - held_out):
            return growth, share


def _random(inputs: Sequence[Input], rng: np.random.Generator, count: int) -> Floats:
    """Random standardised inputs, (count, d)."""
    return np.stack([one.standard(rng, count) for one in inputs], axis=1)


def _of_expansion(
    terms: Terms,
    names: Sequence[str],
    inputs: Sequence[Input],
    z: Floats,
    of: str,
    unit: str,
    runs: int,
    error: float,
    held_out: int,
    note: str,
) -> UncertainOutcome:
    degrees = np.array(list(terms), dtype=np.int64)
    squares = np.square(np.array(list(terms.values())))
    used = degrees > 0
    together = used.sum(axis=1)
    variance = float(squares[together > 0].sum())
    mean = terms[(0,) * len(names)]
    if variance <= (_ROUNDING * mean) ** 2:
        variance = 0.0
    sample = value_of(terms, inputs, z)
    sobol = {}
    for k, name in enumerate(names):
        alone = float(squares[used[:, k] & (together == 1)].sum())
        total = float(squares[used[:, k]].sum())
        sobol[name] = SobolIndices(*(part / variance if variance > 0.0 else 0.0 for part in (alone, total)))
    return UncertainOutcome(
        of, unit, mean, variance**0.5, quantiles_of(sample), sobol, runs, "polynomial-chaos", error, held_out,
        len(terms), None, None, note, sample,
    )  # fmt: skip


def _check(
    inputs: Mapping[str, Input],
    tolerance: float,
    runs: int,
    method: str,
    monte_carlo_runs: int,
    held_out: int,
    seed: int,
) -> None:
    if not isinstance(inputs, Mapping) or not 1 <= len(inputs) <= MOST_INPUTS:
        count = len(inputs) if isinstance(inputs, Mapping) else shown(inputs)
        raise SettingError(
            "UNCERTAIN_INPUTS", f"{count}", where="inputs", allowed=f"1 to {MOST_INPUTS}, by name"
        )
    for name, one in inputs.items():
        if not isinstance(one, Uniform | Normal):
            raise SettingError(
                "UNCERTAIN_INPUTS", shown(one), where=f"inputs.{name}", allowed="Uniform or Normal"
            )

    def need(right: bool, name: str, value: object, allowed: str) -> None:
        if not right:
            raise SettingError.of(name.upper(), name, shown(value), where="uncertainty", allowed=allowed)

    need(in_range(tolerance, 1e-9, 0.5), "tolerance", tolerance, "1e-9 to 0.5")
    most = 10_000_000
    need(is_whole(runs, 1, most), "runs", runs, f"1 to {most:,}")
    need(
        is_word(method, defaults.UNCERTAINTY_METHODS),
        "method",
        method,
        ", ".join(defaults.UNCERTAINTY_METHODS),
    )
    fewest = 10 * len(mixtures(len(inputs)))
    need(
        is_whole(monte_carlo_runs, fewest, most),
        "monte_carlo_runs",
        monte_carlo_runs,
        f"{fewest} to {most:,}",
    )
    need(is_whole(held_out, 2, 100_000), "held_out", held_out, "2 to 100,000")
    need(is_whole(seed, 0, MAX_SEED), "seed", seed, SEED_RANGE)


assert FORCED == 2, "least_runs counts the indices of order up to 2"
