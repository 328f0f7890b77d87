"""The time left of a study: nothing before it can be known, and no swings after."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Hashable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
import study_hands as hands
from summary_samples import study

from lampyris.study.design.row import Row
from lampyris.study.design.study import Config, Job, Study, StudyMap
from lampyris.study.execution import run as running
from lampyris.study.execution.batches import entrants
from lampyris.study.execution.eta import EtaEstimator
from lampyris.study.execution.execution import Execution


def test_the_seconds_left_are_those_of_the_last_stretch() -> None:
    pace = EtaEstimator(100.0)

    def left(now: float, came: int) -> float | None:
        for _ in range(came):
            pace.came("a", None)
        return pace.left(now, 100)

    assert left(100.5, 0) is None
    assert left(108.0, 10) is None  # eight seconds of starting, and the first results
    assert left(108.5, 20) is None
    assert left(110.0, 20) == pytest.approx(5.0)
    for second in range(111, 200):  # ten times slower from here on
        told = left(float(second), 2)
    assert told == pytest.approx(50.0)
    assert pace.left(200.0, 0) == 0


def test_slow_jobs_have_a_pace_from_the_first_one_on() -> None:
    pace = EtaEstimator(0.0)
    assert pace.left(30.0, 10) is None
    pace.came("a", 60.0)
    assert pace.left(60.0, 9) == pytest.approx(540.0)
    pace.came("a", 30.0)
    assert pace.left(90.0, 8) == pytest.approx(240.0)


def test_nothing_is_said_before_every_entrant_or_a_twentieth_is_back() -> None:
    pace = EtaEstimator(0.0, 2)
    for k in range(40):
        pace.came("quick", 0.1)
        assert pace.left(0.1 * (k + 1), 959 - k) is None
    pace.came("slow", 9.0)
    assert pace.left(13.0, 959) is None  # its first run may have compiled
    pace.came("slow", 9.0)
    assert pace.left(22.0, 958) is not None
    alone = EtaEstimator(0.0, 2)
    for _ in range(49):
        alone.came("quick", 0.1)
    assert alone.left(4.9, 951) is None
    alone.came("quick", 0.1)
    alone.left(5.0, 950)
    alone.came("quick", 0.1)
    assert alone.left(6.1, 949) is not None


def test_who_could_not_be_timed_counts_as_its_others() -> None:
    pace = EtaEstimator(0.0, 1)
    for second in range(1, 12):
        pace.came("a", 2.0 if second % 2 else None)
        left = pace.left(2.0 * second, 10)
    assert left == pytest.approx(20.0)


@pytest.mark.parametrize("shuffle", [False, True])
@pytest.mark.parametrize("workers", [1, 2])
def test_quick_and_slow_planners_do_not_make_it_swing(workers: int, shuffle: bool) -> None:
    """40 worlds of 10 seeds, six planners between 5 ms and 2 s, the first run of each 3 s longer.

    What is said is within 1.35 of the truth from its first word on. By the runs of the last stretch, anyone who
    they were of, it was up to ten times as much.
    """
    takes = (0.005, 0.01, 0.02, 0.02, 0.3, 2.0)
    jobs = [(e, w) for w in range(40) for _ in range(10) for e in range(len(takes))]
    rng = np.random.default_rng(5)
    if shuffle:
        jobs = [jobs[k] for k in rng.permutation(len(jobs))]
    free = [0.0] * workers
    met: list[set[int]] = [set() for _ in range(workers)]
    back: list[tuple[float, int, float]] = []
    for e, _ in jobs:
        k = free.index(min(free))
        seconds = takes[e] * rng.uniform(0.7, 1.3) + (0.0 if e in met[k] else 3.0)
        met[k].add(e)
        free[k] += seconds
        back.append((free[k], e, seconds))
    back.sort()
    end, pace = back[-1][0], EtaEstimator(0.0, len(takes), workers)
    worst, silent, spoken = 1.0, 0.0, 0
    told = 0.0
    for n, (now, e, seconds) in enumerate(back, 1):
        pace.came(e, seconds)
        if now - told < 0.25:
            continue
        told = now
        left = pace.left(now, len(back) - n)
        if left is None:
            silent = now
        elif end - now > 60:
            spoken += 1
            worst = max(worst, left / (end - now), (end - now) / left)
    assert spoken > 100
    assert silent < 0.08 * end
    assert worst < 1.35, worst


class Timed(hands.Judge):
    """Says how long each run took."""

    def row(self, job: Job, result: Mapping[str, Any], ground: StudyMap) -> Row:
        made = super().row(job, result, ground)
        return replace(made, timing={"wall_s": 7.0 if job.labels["planner"] == "b" else 0.5})


def test_a_study_tells_its_pace_of_every_run(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[tuple[Hashable, float | None]] = []
    made: list[tuple[int, int]] = []

    class Spy(EtaEstimator):
        def __init__(self, now: float, entrants: int = 1, early: int = 1) -> None:
            made.append((entrants, early))
            super().__init__(now, entrants, early)

        def came(self, who: Hashable, seconds: float | None) -> None:
            told.append((who, seconds))
            super().came(who, seconds)

    monkeypatch.setattr(running, "EtaEstimator", Spy)
    one = hands.study_of(3)
    running.run(one, lambda rows: None, where=Execution(1), _work=hands.work, _judge=Timed())
    assert made == [(2, 1)]
    assert Counter(told) == {(("a", "law"), 0.5): 24, (("b", "law"), 7.0): 24}


def test_entrants_of_equal_settings_are_one() -> None:
    one = study(("a", "b", "c"), laws=("physical", "constant"))
    assert entrants(one) == 6
    twice = (*one.planners, Config("a", {}, "a again"))
    same = Study(**{f: getattr(one, f) for f in one.__slots__} | {"planners": twice})
    assert (len(same), entrants(same)) == (len(one) * 4 // 3, 6)
