"""Who is best, and when that may be said."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from summary_samples import metrics, study

from lampyris.study.analysis import compare
from lampyris.study.analysis.best import FEWEST, Best, best
from lampyris.study.analysis.runs import Runs, runs_of
from lampyris.study.analysis.summary import per_unit
from lampyris.study.design.study import StudyTraffic


def runs(make: Callable[[int, int], dict[str, Any]], seeds: int, planners: str = "abc") -> Runs:
    """Of one world: ``make(seed, entrant)``."""
    one = study(tuple(planners), maps=1, queries=1, seeds=seeds, traffic_cases=(StudyTraffic(),))
    many = len(planners)
    return runs_of(one, [(k, "done", "", make(k // many, k % many)) for k in range(many * seeds)])


def test_a_lead_that_some_runs_turn_round_is_none() -> None:
    """b's mean is the least, and b loses to a in half of the runs."""

    def make(s: int, e: int) -> dict[str, Any]:
        return metrics((20.0, 17.0 if s % 2 else 22.0, 30.0)[e])

    assert best(runs(make, 12))["cost"] == Best(("b",), False)


def test_a_lead_in_every_run_is_one_once_there_are_enough_runs() -> None:
    def make(s: int, e: int) -> dict[str, Any]:
        return metrics(20.0 + 3 * s + (0.5 + 0.1 * s) * e)

    for seeds in (1, 2, FEWEST - 1, FEWEST, 12):
        assert best(runs(make, seeds))["cost"] == Best(("a",), seeds >= FEWEST)


def test_who_agree_in_every_run_share_the_place_and_who_agree_in_the_mean_do_not() -> None:
    assert best(runs(lambda s, e: metrics(20.0 + s + (e == 2)), 8))["cost"] == Best(("a", "b"), True)
    turned = best(runs(lambda s, e: metrics((20.0 + s % 2, 21.0 - s % 2, 30.0)[e]), 8))
    assert turned["cost"] == Best(("a", "b"), False)
    assert "cost" not in best(runs(lambda s, e: metrics(20.0 + s), 8))


def test_more_is_better_where_it_is() -> None:
    found = best(runs(lambda s, e: metrics(20.0, speed_mean=1.0 + 0.1 * e + 0.01 * s), 8))
    assert found["speed_mean"] == Best(("c",), True)
    assert "cost_to_go" not in best(runs(lambda s, e: metrics(20.0 + e), 8))


def test_the_short_ways_of_who_often_fails_are_no_lead() -> None:
    """a arrives twice only; what it has of ways is compared where both have one."""

    def make(s: int, e: int) -> dict[str, Any]:
        return metrics((5.0, 20.0, 21.0)[e], arrived=bool(e or s < 2))

    found = best(runs(make, 12))
    assert found["cost"] == Best(("a",), False)
    assert found["arrived"] == Best(("b", "c"), True)


@pytest.mark.parametrize("seed", range(6))
def test_it_is_what_the_paired_intervals_say(seed: int) -> None:
    rng = np.random.default_rng(seed)
    costs = rng.normal((20.0, 20.8, 22.0), 1.0, (9, 3)) + rng.normal(0, 4, (9, 1))
    said = best(runs(lambda s, e: metrics(float(costs[s, e])), 9))["cost"]
    k = int(np.argmin(costs.mean(axis=0)))
    gaps = [compare.mean(per_unit((costs[:, k] - costs[:, e])[None])) for e in range(3) if e != k]
    assert said == Best(("abc"[k],), all(gap.high < 0 for gap in gaps))
