"""Compare: what may be said of planners that met the same worlds, with intervals and the numbers behind them.

Every function takes plain numbers. A run that failed stays in every denominator: shares of success count it,
ranks put it last, performance profiles never reach it; only where a mean of something is asked that a failed
run does not have is it left out, and then the count beside the mean says so. What cannot be said (an interval
of one value, a test of no pairs) is NaN here and None in reports.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lampyris._core.arrays import index_array
from lampyris._core.cancellation import uninterrupted
from lampyris.errors import SettingError
from lampyris.typing import Floats

LEVEL = 0.95
"""Of all intervals; tests and critical differences are at 1 - LEVEL."""
RESAMPLES = 5_000
"""Of a bootstrap: the ends of an interval are then off by about 0.4 % in level. 10,000 took twice as long for
a difference in the third digit of an end."""
MAX_DRAWN = 5_000
"""Values up to which means are bootstrapped; beyond, the normal curve: its ends are then the same to a few
hundredths of the interval, and resamples of a hundred thousand values would take half a gigabyte."""
DIGITS = 12
"""Values that agree to so many digits are equal: costs are the same sums in another order."""
MAX_EXACT = 200
"""Pairs up to which the signed-rank test counts every assignment of signs; beyond, the normal curve."""


class Interval(NamedTuple):
    """An estimate, an interval of :data:`LEVEL` around it, and how many values are behind it."""

    value: float
    low: float
    high: float
    n: int


NOTHING = Interval(math.nan, math.nan, math.nan, 0)


def wilson(found: float, n: float) -> tuple[float, float]:
    """Wilson's interval of a share (JASA 22, 1927, 209-212); ``n`` need not be whole.

    Raises
    ------
    SettingError : fewer than none, or more than there are.
    """
    if not 0 <= found <= n:
        raise SettingError("COUNT", f"{found} of {n}", allowed="at most as many as there are")
    if n == 0:
        return 0.0, 1.0
    z = _normal_quantile(0.5 + LEVEL / 2)
    p, z2 = found / n, z * z / n
    middle = (p + z2 / 2) / (1 + z2)
    half = z / (1 + z2) * math.sqrt(p * (1 - p) / n + z2 / (4 * n))
    low = 0.0 if found == 0 else max(0.0, middle - half)
    return low, 1.0 if found == n else min(1.0, middle + half)


def success(found: ArrayLike, runs: ArrayLike) -> Interval:
    """A share of successes over all runs with Wilson's interval; ``n`` is the number of runs.

    Parameters
    ----------
    found, runs : of each query (or of all, as two plain numbers).

    Runs of one query are not independent: Wilson's interval is taken for as many runs as would say as much if
    they were (Kish's design effect: Survey Sampling, 1965, 258; from the spread of the shares between
    queries). It is never less than 1, and where all or none succeeded, so that there is no spread to judge
    by, each query counts as one.
    """
    x = np.atleast_1d(np.asarray(found, dtype=np.float64))
    m = np.atleast_1d(np.asarray(runs, dtype=np.float64))
    x, m = x[m > 0], m[m > 0]
    queries, n = len(m), float(m.sum())
    if not queries:
        return Interval(math.nan, 0.0, 1.0, 0)
    p = float(x.sum()) / n
    low, high = wilson(p * n / _design(x, m, p), n / _design(x, m, p))
    return Interval(p, low, high, round(n))


def _design(x: Floats, m: Floats, p: float) -> float:
    """How many dependent runs say as much as one; between 1 and the runs of a query."""
    queries, n = len(m), float(m.sum())
    if queries == 1:
        return 1.0
    most = n / queries
    if p in (0.0, 1.0):
        return most
    spread = queries / (queries - 1) * float(((x - p * m) ** 2).sum()) / n**2
    return min(max(1.0, spread / (p * (1 - p) / n)), most)


def mean(values: ArrayLike, seed: int = 0) -> Interval:
    """A mean with a bootstrap interval (BCa: Efron, JASA 82, 1987, 171-185).

    What is not finite is left out and not counted. Of one value there is no interval; of values that are
    all equal it has no width.
    """
    x = np.asarray(values, dtype=np.float64).ravel()
    x = x[np.isfinite(x)]
    n = len(x)
    if n == 0:
        return NOTHING
    value = math.fsum(x.tolist()) / n
    if n == 1:
        return Interval(value, math.nan, math.nan, 1)
    if same(x, x[0]).all():
        return Interval(value, value, value, n)
    if n > MAX_DRAWN:
        half = _normal_quantile(0.5 + LEVEL / 2) * float(x.std(ddof=1)) / math.sqrt(n)
        return Interval(value, value - half, value + half, n)
    sums = _resampled(x, seed)
    # A resample that is as good as the sample counts half: common where values are whole numbers.
    whole = float(x[None, :].sum(axis=1)[0])
    below = (np.count_nonzero(sums < whole) + 0.5 * np.count_nonzero(sums == whole)) / len(sums)
    low, high = ((1 - LEVEL) / 2, (1 + LEVEL) / 2)
    if 0 < below < 1:
        d = (x - value) / float(np.abs(x - value).max())
        z0, bend = _normal_quantile(below), float((d**3).sum()) / (6 * float((d**2).sum()) ** 1.5)
        low, high = (_bent(z0, bend, q) for q in (low, high))
    ends = np.quantile(sums, (low, high)) / n
    return Interval(value, float(ends[0]), float(ends[1]), n)


def _bent(z0: float, bend: float, q: float) -> float:
    """The level that BCa puts for one of the plain percentile method."""
    z = z0 + _normal_quantile(q)
    return _normal_share(z0 + z / (1 - bend * z))


def _resampled(x: Floats, seed: int) -> Floats:
    """Sums of x drawn again with replacement, one a resample."""
    counts = _draws(len(x), seed)
    # Not a matrix product: its last digits depend on the number of threads.
    rows = max(1, 1_000_000 // len(x))
    return np.concatenate([(counts[k : k + rows] * x).sum(axis=1) for k in range(0, len(counts), rows)])


@lru_cache(maxsize=6)
def _draws(n: int, seed: int) -> NDArray[np.uint8]:
    """How often each of n values is drawn in each resample, uint8 (RESAMPLES, n)."""
    rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, n])))
    out = np.empty((RESAMPLES, n), dtype=np.uint8)
    for row in out:
        # A value drawn more than 255 times of n > 255 has a chance below 1e-500.
        row[:] = np.bincount(index_array(rng.integers(0, n, n)), minlength=n)
    return out


def difference(a: ArrayLike, b: ArrayLike, seed: int = 0) -> Interval:
    """Mean of a - b over the pairs where both have a value, with its bootstrap interval."""
    return mean(gaps(a, b), seed)


def gaps(a: ArrayLike, b: ArrayLike) -> Floats:
    """a - b; exactly 0 where they agree to :data:`DIGITS` digits, NaN where one has no value."""
    x, y = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    out: Floats = np.where(same(x, y), 0.0, x - y)
    return out


def same(a: ArrayLike, b: ArrayLike) -> NDArray[np.bool_]:
    """Which values agree to :data:`DIGITS` digits."""
    x, y = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    with np.errstate(invalid="ignore", over="ignore"):
        near = np.abs(x - y) <= 10.0**-DIGITS * np.maximum(np.abs(x), np.abs(y))
    out: NDArray[np.bool_] = (x == y) | (near & np.isfinite(x) & np.isfinite(y))
    return out


class Signed(NamedTuple):
    """A signed-rank test of paired values: how many pairs, in how many a is less, equal and more, and p."""

    n: int
    less: int
    equal: int
    more: int
    p: float


def signed_rank(a: ArrayLike, b: ArrayLike) -> Signed:
    """Wilcoxon's signed-rank test, two-sided (Biometrics 1, 1945, 80-83), over pairs that both have a value.

    Pairs that are equal take part in the ranking and then stand aside (Pratt, JASA 54, 1959, 655-667): left
    out before, as Wilcoxon did, many equal pairs could make a difference more sure. Ties share their rank.
    Up to :data:`MAX_EXACT` pairs p is exact, ties or not: every assignment of signs is counted. p is NaN
    without a pair and 1 where all are equal.
    """
    d = gaps(a, b).ravel()
    d = d[~np.isnan(d)]
    less, more = int((d < 0).sum()), int((d > 0).sum())
    if len(d) == 0:
        return Signed(0, 0, 0, 0, math.nan)
    ranks = _ranks(np.abs(d))
    up, ranks = ranks[d > 0].sum(), ranks[d != 0]
    if not len(ranks):
        p = 1.0
    elif len(d) <= MAX_EXACT:
        p = _exact(np.rint(2 * ranks).astype(np.int64), round(2 * float(up)))
    else:
        z = (float(up) - float(ranks.sum()) / 2) / math.sqrt(float((ranks**2).sum()) / 4)
        p = 2 * _normal_share(-abs(z))
    return Signed(len(d), less, len(d) - less - more, more, min(1.0, p))


def _exact(ranks: NDArray[np.int64], up: int) -> float:
    """Two-sided p of a sum of ranks (both doubled, so that they are whole) when every sign has chance 1/2."""
    chance = np.zeros(int(ranks.sum()) + 1)
    chance[0] = 1.0
    top = 0
    for rank in ranks.tolist():
        moved = chance[: top + 1] / 2
        chance[: top + 1] /= 2
        chance[rank : top + rank + 1] += moved
        top += rank
    return 2 * min(float(chance[: up + 1].sum()), float(chance[up:].sum()))


def _ranks(x: Floats) -> Floats:
    """Ranks from 1, ties shared; equal is what agrees to :data:`DIGITS` digits with the next below it."""
    with uninterrupted():
        from scipy.stats import rankdata

    order = np.argsort(x, kind="stable")
    sorted_x = x[order]
    steps = ~same(sorted_x[1:], sorted_x[:-1])
    level = np.empty(len(x))
    level[order] = np.concatenate(([0.0], np.cumsum(steps)))
    out: Floats = rankdata(level)
    return out


def holm(p: Sequence[float]) -> tuple[float, ...]:
    """p corrected for being one of a family (Holm, Scand. J. Statist. 6, 1979, 65-70); NaN are no tests."""
    tests = sorted((k for k in range(len(p)) if not math.isnan(p[k])), key=lambda k: (p[k], k))
    out, least = [math.nan] * len(p), 0.0
    for done, k in enumerate(tests):
        least = max(least, min(1.0, (len(tests) - done) * p[k]))
        out[k] = least
    return tuple(out)


class Ranking(NamedTuple):
    """Average ranks over blocks, 1 the best, and whether they differ.

    Parameters
    ----------
    ranks : of each planner; those that failed share the last ones of a block.
    n : blocks.
    chi2, p : Friedman's test; NaN with fewer than two blocks or planners.
    critical : Nemenyi's critical difference; NaN likewise.
    """

    ranks: tuple[float, ...]
    n: int
    chi2: float
    p: float
    critical: float


def friedman(values: ArrayLike, more_is_better: bool = False) -> Ranking:
    """Friedman's test with ties (JASA 32, 1937, 675-701) and Nemenyi's critical difference.

    Parameters
    ----------
    values : (blocks, planners); NaN failed and is last, tied with others that failed. Infinities likewise.

    Source: Demsar, JMLR 7, 2006, 1-30, for the use on algorithms and the critical difference.
    """
    x = np.asarray(values, dtype=np.float64)
    n, k = x.shape
    x = np.where(np.isfinite(x), -x if more_is_better else x, np.inf)
    table = np.array([_ranks(row) for row in x]).reshape(n, k)
    average = table.mean(axis=0) if n else np.full(k, math.nan)
    if n < 2 or k < 2:
        return Ranking(tuple(average.tolist()), n, math.nan, math.nan, math.nan)
    # Sums of squares rather than the textbook's form: it needs no separate correction for ties.
    between = n * float(((average - (k + 1) / 2) ** 2).sum())
    within = float(((table - (k + 1) / 2) ** 2).sum()) / (n * (k - 1))
    chi2 = between / within if within > 0 else 0.0
    with uninterrupted():
        from scipy.stats import chi2 as chi2_law

    p = float(chi2_law.sf(chi2, k - 1))
    return Ranking(tuple(average.tolist()), n, chi2, p, critical_difference(k, n))


def critical_difference(k: int, n: int) -> float:
    """Average ranks of k planners over n blocks that are further apart than this differ (Nemenyi)."""
    return _studentized(k) / math.sqrt(2) * math.sqrt(k * (k + 1) / (6 * n))


def groups(ranks: Sequence[float], critical: float) -> tuple[tuple[int, ...], ...]:
    """The largest sets of planners none of which differ, best first; a planner alone is no set."""
    order = sorted(range(len(ranks)), key=lambda k: (ranks[k], k))
    out: list[tuple[int, ...]] = []
    last = 0
    for first in range(len(order)):
        end = first
        while end + 1 < len(order) and ranks[order[end + 1]] - ranks[order[first]] <= critical:
            end += 1
        if end > first and end > last:
            out.append(tuple(order[first : end + 1]))
            last = end
    return tuple(out)


class Performance(NamedTuple):
    """A performance profile: after each ratio, the share of problems solved within it; steps to the right."""

    ratios: tuple[float, ...]
    shares: tuple[float, ...]
    n: int


def profiles(values: ArrayLike) -> tuple[Performance, ...]:
    """A performance profile of each planner (Dolan and More, Math. Program. 91, 2002, 201-213).

    Parameters
    ----------
    values : (problems, planners), less is better, none below 0; NaN failed and is never reached. A problem
        that nobody solved stays in the denominator. Where the best is 0, others are infinitely worse.

    Raises
    ------
    SettingError : a value below 0.
    """
    x = np.asarray(values, dtype=np.float64)
    if (x < 0).any():
        raise SettingError("PROFILE", f"value {float(x[x < 0][0])}", allowed="0 or more")
    n, k = x.shape
    x = np.where(np.isfinite(x), x, np.inf)
    best = x.min(axis=1, keepdims=True) if k else np.empty((n, 0))
    ratio = np.full_like(x, np.inf)
    np.divide(x, best, out=ratio, where=(best > 0) & np.isfinite(x))
    ratio[same(x, best) & np.isfinite(x)] = 1.0
    out = []
    for column in ratio.T:
        at, counts = np.unique(column[np.isfinite(column)], return_counts=True)
        out.append(Performance(tuple(at.tolist()), tuple((np.cumsum(counts) / n).tolist()), n))
    return tuple(out)


def _normal_quantile(q: float) -> float:
    with uninterrupted():
        from scipy.special import ndtri

    return float(ndtri(q))


def _normal_share(z: float) -> float:
    with uninterrupted():
        from scipy.special import ndtr

    return float(ndtr(z))


@lru_cache(maxsize=64)
def _studentized(k: int) -> float:
    """Quantile at :data:`LEVEL` of the range of k standard normal values."""
    with uninterrupted():
        from scipy.stats import studentized_range

    law: Any = studentized_range
    return float(law.ppf(LEVEL, k, np.inf))
