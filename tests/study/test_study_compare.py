"""Statistics: against counting by hand, other programs where they are independent, and simulation."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
import scipy
from scipy import stats

from lampyris.errors import SettingError
from lampyris.study.analysis import compare

# Demsar, JMLR 7 (2006), Table 6: AUC of four classifiers on 14 data sets. One pair is printed as 0.975 twice
# and ranked 2 and 3: the digits that told them apart are not in the table.
AUC = (
    (0.763, 0.768, 0.771, 0.798), (0.599, 0.591, 0.590, 0.569), (0.954, 0.971, 0.968, 0.967),
    (0.628, 0.661, 0.654, 0.657), (0.882, 0.888, 0.886, 0.898), (0.936, 0.931, 0.916, 0.931),
    (0.661, 0.668, 0.609, 0.685), (0.583, 0.583, 0.563, 0.625), (0.775, 0.838, 0.866, 0.875),
    (1.000, 1.000, 1.000, 1.000), (0.940, 0.962, 0.965, 0.962), (0.619, 0.666, 0.614, 0.669),
    (0.972, 0.981, 0.9751, 0.975), (0.957, 0.978, 0.946, 0.970),
)  # fmt: skip
SCIPY = tuple(int(part) for part in scipy.__version__.split(".")[:2])
GENERATOR = "rng" if SCIPY >= (1, 15) else "random_state"
NORMAL = "asymptotic" if SCIPY >= (1, 13) else "approx"
"""What older versions of SciPy call the same."""
NEMENYI = {2: 1.960, 3: 2.343, 4: 2.569, 5: 2.728, 6: 2.850, 7: 2.949, 8: 3.031, 9: 3.102, 10: 3.164}
"""Critical values at 5 %, ibid., Table 5."""


@pytest.mark.commit(1)
@pytest.mark.parametrize("n", [1, 2, 7, 30, 300])
def test_wilson_is_the_interval_that_scipy_has(n: int) -> None:
    for found in range(n + 1):
        low, high = stats.binomtest(found, n).proportion_ci(0.95, method="wilson")
        assert compare.wilson(found, n) == pytest.approx((low, high), abs=1e-12)


def test_wilson_solves_its_own_equation() -> None:
    z = stats.norm.ppf(0.975)
    for end in compare.wilson(17.5, 40.25):
        assert abs(17.5 / 40.25 - end) == pytest.approx(z * math.sqrt(end * (1 - end) / 40.25))


def test_a_share_counts_every_run() -> None:
    share = compare.success([3, 0, 2], [3, 3, 3])
    assert (share.value, share.n) == (5 / 9, 9)
    assert compare.success([], []) == (pytest.approx(math.nan, nan_ok=True), 0.0, 1.0, 0)
    with pytest.raises(SettingError):
        compare.wilson(3, 2)


def test_runs_of_one_query_that_always_agree_say_as_much_as_one() -> None:
    together = compare.success([10, 0] * 10, [10] * 20)
    alone = compare.success([1, 0] * 10, [1] * 20)
    assert together.low == pytest.approx(alone.low, abs=0.01)
    assert together.n == 200
    assert alone.n == 20


def test_runs_that_are_independent_say_as_much_as_they_are() -> None:
    # Every query succeeds in five of ten: less spread than chance has, so none is taken away.
    assert compare.success([5] * 20, [10] * 20)[1:3] == pytest.approx(compare.wilson(100, 200))


def test_where_nobody_failed_each_query_counts_once() -> None:
    assert compare.success([10] * 12, [10] * 12)[1:3] == pytest.approx(compare.wilson(12, 12))
    assert compare.success([0] * 12, [10] * 12)[1:3] == pytest.approx(compare.wilson(0, 12))


def exhaustive(x: Sequence[float]) -> tuple[float, float]:
    """BCa from every resample there is, by its definition."""
    n, middle = len(x), sum(x) / len(x)
    means = np.sort([sum(draw) / n for draw in itertools.product(x, repeat=n)])
    below = (np.sum(means < middle - 1e-12) + 0.5 * np.sum(abs(means - middle) <= 1e-12)) / len(means)
    leave = np.array([(sum(x) - v) / (n - 1) for v in x])
    d = leave.mean() - leave
    bend = (d**3).sum() / (6 * (d**2).sum() ** 1.5)
    z0 = stats.norm.ppf(below)
    levels = [stats.norm.cdf(z0 + (z0 + z) / (1 - bend * (z0 + z))) for z in stats.norm.ppf([0.025, 0.975])]
    return tuple(np.quantile(means, levels))


@pytest.mark.parametrize(
    "x",
    [
        (1.0, 2.0, 4.0, 9.0),
        (0.1, 0.2, 0.25, 3.0, 0.3),
        (5.0, 1.0, 1.5, 2.5, 2.0, 7.0),
        (0.0, 0.0, 0.0, 0.0, 0.0, 1.0),
    ],
)
def test_the_bootstrap_is_that_of_every_resample(x: tuple[float, ...]) -> None:
    found = compare.mean(x)
    spread = max(x) - min(x)
    assert found.value == pytest.approx(sum(x) / len(x))
    assert (found.low, found.high) == pytest.approx(exhaustive(x), abs=0.06 * spread)


@pytest.mark.parametrize("n", [5, 30, 250])
def test_the_bootstrap_is_near_that_of_scipy(n: int) -> None:
    x = np.random.default_rng(n).lognormal(size=n)
    drawn: dict[str, Any] = {GENERATOR: np.random.default_rng(1)}
    other = stats.bootstrap((x,), np.mean, n_resamples=4999, method="BCa", **drawn)
    low, high = other.confidence_interval
    found = compare.mean(x)
    assert (found.low, found.high) == pytest.approx((low, high), abs=0.08 * (high - low))


def test_the_bootstrap_follows_shift_and_scale_and_its_seed() -> None:
    x = np.random.default_rng(3).normal(size=40)
    a, b = compare.mean(x, 7), compare.mean(2 * x + 5, 7)
    assert b[:3] == pytest.approx(tuple(2 * v + 5 for v in a[:3]))
    assert compare.mean(x, 7) == a
    assert compare.mean(x, 8)[1:3] != a[1:3]


def test_what_has_no_value_is_neither_counted_nor_averaged() -> None:
    found = compare.mean([1.0, math.nan, 3.0, math.inf])
    assert (found.value, found.n) == (2.0, 2)
    assert compare.mean([math.nan] * 3).n == 0
    assert compare.mean([4.0]) == (
        4.0,
        pytest.approx(math.nan, nan_ok=True),
        pytest.approx(math.nan, nan_ok=True),
        1,
    )
    assert compare.mean([0.1 + 0.2, 0.3, 0.3])[1:] == (pytest.approx(0.3), pytest.approx(0.3), 3)
    for big in (1e200, 1e-200):
        assert all(math.isfinite(v) for v in compare.mean([big, 2 * big, 5 * big]))


def test_many_values_go_by_the_normal_curve_and_the_two_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    x = np.random.default_rng(1).gamma(2.0, size=compare.MAX_DRAWN)
    drawn = compare.mean(x)
    monkeypatch.setattr(compare, "MAX_DRAWN", 100)
    curve = compare.mean(x)
    assert curve[1:3] == pytest.approx(drawn[1:3], abs=0.05 * (drawn.high - drawn.low))


def covered(datasets: int, n: int) -> tuple[float, float]:
    """Share of intervals that hold the truth: of a lopsided mean, and of a share over dependent runs."""
    rng = np.random.default_rng([datasets, n])
    mean = share = 0
    for _ in range(datasets):
        found = compare.mean(rng.gamma(2.0, size=n))
        mean += found.low <= 2.0 <= found.high
        chance = rng.beta(2.0, 1.0, size=n)
        runs = compare.success(rng.binomial(10, chance), np.full(n, 10))
        share += runs.low <= 2 / 3 <= runs.high
    return mean / datasets, share / datasets


@pytest.mark.nightly
def test_intervals_hold_the_truth_about_as_often_as_they_say() -> None:
    mean, share = covered(300, 30)
    assert 0.90 <= mean <= 0.98
    assert 0.91 <= share <= 0.985


@pytest.mark.nightly
@pytest.mark.parametrize(("n", "least"), [(10, 0.88), (30, 0.92), (100, 0.935)])
def test_intervals_hold_the_truth_at_every_size(n: int, least: float) -> None:
    mean, share = covered(4000, n)
    assert least <= mean <= 0.965
    assert 0.92 <= share <= 0.98


def test_naive_intervals_of_dependent_runs_would_not() -> None:
    rng = np.random.default_rng(5)
    held = 0
    for _ in range(300):
        found = rng.binomial(10, rng.beta(0.6, 0.3, size=30)).sum()
        low, high = compare.wilson(found, 300)
        held += low <= 2 / 3 <= high
    assert held / 300 < 0.75


def test_equal_is_what_agrees_to_twelve_digits() -> None:
    a = 3 * math.sqrt(2) + 1
    b = math.sqrt(2) + 1 + math.sqrt(2) + math.sqrt(2)
    assert compare.gaps([a, 1.0, math.nan], [b, 2.0, 1.0]).tolist() == [
        0.0,
        -1.0,
        pytest.approx(math.nan, nan_ok=True),
    ]
    assert compare.same([math.inf, 1.0, math.inf], [math.inf, math.inf, 1.0]).tolist() == [True, False, False]
    assert compare.same([1.0, 0.0], [1.0 + 1e-9, 1e-300]).tolist() == [False, False]


def every_sign(d: Sequence[float]) -> float:
    """p of the signed-rank test by trying every assignment of signs, zeros ranked and then left out."""
    ranks = stats.rankdata(np.abs(d))
    kept = [r for r, v in zip(ranks, d, strict=True) if v]
    if not kept:
        return 1.0
    seen = sum(r for r, v in zip(ranks, d, strict=True) if v > 0)
    sums = [
        sum(r for r, up in zip(kept, signs, strict=True) if up)
        for signs in itertools.product((0, 1), repeat=len(kept))
    ]
    low = sum(s <= seen + 1e-9 for s in sums) / len(sums)
    high = sum(s >= seen - 1e-9 for s in sums) / len(sums)
    return min(1.0, 2 * min(low, high))


@pytest.mark.parametrize("seed", range(30))
def test_signed_ranks_count_every_sign(seed: int) -> None:
    rng = np.random.default_rng(seed)
    d = rng.integers(-3, 5, size=int(rng.integers(1, 11))).astype(float)
    found = compare.signed_rank(d, np.zeros(len(d)))
    assert found.p == pytest.approx(every_sign(d))
    assert (found.less, found.equal, found.more) == ((d < 0).sum(), (d == 0).sum(), (d > 0).sum())


@pytest.mark.parametrize("n", [6, 13, 40])
def test_signed_ranks_without_ties_are_those_of_scipy(n: int) -> None:
    rng = np.random.default_rng(n)
    a, b = rng.normal(size=n), rng.normal(0.4, 1, size=n)
    assert compare.signed_rank(a, b).p == pytest.approx(stats.wilcoxon(a, b, method="exact").pvalue)


def test_many_pairs_go_by_the_normal_curve_and_the_two_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(2)
    d = rng.integers(-4, 6, size=400).astype(float)
    found = compare.signed_rank(d, np.zeros(400))
    other = stats.wilcoxon(d, zero_method="pratt", correction=False, method=NORMAL)
    assert found.p == pytest.approx(float(other.pvalue), rel=1e-9)
    half = d[:190]
    exact = compare.signed_rank(half, np.zeros(190)).p
    monkeypatch.setattr(compare, "MAX_EXACT", 10)
    assert compare.signed_rank(half, np.zeros(190)).p == pytest.approx(exact, rel=0.05)


def test_signed_ranks_of_nothing() -> None:
    assert compare.signed_rank([], [])[:4] == (0, 0, 0, 0)
    assert compare.signed_rank([1.0, math.nan], [1.0, 2.0]) == (1, 0, 1, 0, 1.0)


def test_holm_by_hand() -> None:
    assert compare.holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx((0.03, 0.06, 0.06, 0.02))
    assert compare.holm([0.5, math.nan, 0.9])[0::2] == (1.0, 1.0)
    assert math.isnan(compare.holm([0.5, math.nan])[1])
    assert compare.holm([]) == ()


def test_holm_rejects_what_its_steps_reject() -> None:
    rng = np.random.default_rng(1)
    for _ in range(200):
        p = rng.uniform(0, 0.1, size=int(rng.integers(1, 8))).tolist()
        rejected = set()
        for done, k in enumerate(sorted(range(len(p)), key=p.__getitem__)):
            if p[k] > 0.05 / (len(p) - done):
                break
            rejected.add(k)
        assert {k for k, q in enumerate(compare.holm(p)) if q <= 0.05 + 1e-12} == rejected


def test_demsars_example() -> None:
    found = compare.friedman(np.array(AUC), more_is_better=True)
    assert [round(r, 3) for r in found.ranks] == [3.143, 2.000, 2.893, 1.964]
    n, k = 14, 4
    plain = 12 * n / (k * (k + 1)) * (sum(r * r for r in found.ranks) - k * (k + 1) ** 2 / 4)
    assert plain == pytest.approx(9.28, abs=0.005)
    other = stats.friedmanchisquare(*np.array(AUC).T)
    assert (found.chi2, found.p) == pytest.approx((other.statistic, other.pvalue))
    assert found.critical == pytest.approx(1.25, abs=0.005)
    # There at 5 % no two differ, and at 10 %, with a distance of 1.12, some do.
    assert compare.groups(found.ranks, found.critical) == ((3, 1, 2, 0),)
    assert compare.groups(found.ranks, 1.12) == ((3, 1, 2), (2, 0))


@pytest.mark.parametrize(("k", "q"), NEMENYI.items())
def test_critical_values_are_those_of_the_table(k: int, q: float) -> None:
    # The printed ones are cut, not rounded, in places: 2.343 is 2.3437.
    assert compare.critical_difference(k, 1) / math.sqrt(k * (k + 1) / 6) == pytest.approx(q, abs=1.1e-3)


@pytest.mark.parametrize("seed", range(20))
def test_friedman_with_ties_is_that_of_scipy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    x = rng.integers(0, 4, size=(int(rng.integers(3, 20)), int(rng.integers(3, 7)))).astype(float)
    found, other = compare.friedman(x), stats.friedmanchisquare(*x.T)
    assert (found.chi2, found.p) == pytest.approx((other.statistic, other.pvalue))


def test_who_failed_is_last_and_shares_the_place() -> None:
    x = [[1.0, math.nan, 2.0, math.nan], [5.0, 4.0, math.nan, 4.0]]
    for better in (False, True):
        ranks = compare.friedman(x, better).ranks
        assert ranks[1] == (3.5 + (1.5 if not better else 2.5)) / 2
    assert compare.friedman(x).ranks == (2.0, 2.5, 3.0, 2.5)


def test_ranks_of_little() -> None:
    assert compare.friedman(np.ones((5, 3)))[1:4] == (5, 0.0, 1.0)
    assert compare.friedman(np.full((5, 3), math.nan)).ranks == (2.0, 2.0, 2.0)
    assert math.isnan(compare.friedman([[1.0, 2.0]]).critical)
    assert math.isnan(compare.friedman([[1.0], [2.0]]).p)
    assert math.isnan(compare.friedman(np.empty((0, 3))).ranks[0])


@pytest.mark.parametrize("seed", range(20))
def test_groups_are_the_largest_sets_without_a_difference(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ranks = rng.uniform(1, 6, size=6).tolist()
    distance = float(rng.uniform(0.2, 3))
    sets = [
        set(some)
        for size in range(2, 7)
        for some in itertools.combinations(range(6), size)
        if max(ranks[k] for k in some) - min(ranks[k] for k in some) <= distance
    ]
    largest = {frozenset(s) for s in sets if not any(s < other for other in sets)}
    assert {frozenset(g) for g in compare.groups(ranks, distance)} == largest


def test_a_performance_profile_by_hand() -> None:
    a, b, c = compare.profiles([[1.0, 2.0, math.nan], [3.0, 3.0, 6.0], [math.nan] * 3, [0.0, 0.0, 5.0]])
    assert a == ((1.0,), (0.75,), 4)
    assert b == ((1.0, 2.0), (0.5, 0.75), 4)
    assert c == ((2.0,), (0.25,), 4)
    with pytest.raises(SettingError):
        compare.profiles([[-1.0, 2.0]])
    assert compare.profiles(np.empty((0, 2)))[0] == ((), (), 0)


def test_performance_profiles_are_their_definition() -> None:
    rng = np.random.default_rng(4)
    x = np.where(rng.uniform(size=(40, 4)) < 0.2, np.nan, rng.integers(1, 9, size=(40, 4)))
    found = compare.profiles(x)
    for tau in (1.0, 1.5, 2.0, 3.0, 8.0):
        for k in range(4):
            within = 0
            for row in x:
                solved = [v for v in row if not math.isnan(v)]
                within += not math.isnan(row[k]) and row[k] / min(solved) <= tau + 1e-12
            shares = [y for at, y in zip(*found[k][:2], strict=True) if at <= tau + 1e-12]
            assert (shares[-1] if shares else 0.0) == pytest.approx(within / 40)
