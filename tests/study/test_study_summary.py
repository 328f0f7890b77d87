"""Summaries: anyone who fails stays counted, the same worlds are compared, and every mean has its size."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from summary_samples import Made, by_chance, finite, metrics, runs, study

from lampyris.errors import UsageError
from lampyris.study.analysis import compare
from lampyris.study.analysis.findings import Summary
from lampyris.study.analysis.measures import ALL
from lampyris.study.analysis.runs import runs_of
from lampyris.study.analysis.summary import per_unit, scores, summarise
from lampyris.study.analysis.summary_tables import estimate_text, fixed, p_text, places_of, tabs
from lampyris.study.design.study import StudyTraffic

NAN = math.nan


def entry(summary: Summary, entrant: str, crowd: str = "none") -> object:
    return next(e for e in summary.entries if (e.entrant, e.traffic) == (entrant, crowd))


def test_seeds_are_averaged_before_anything_is_counted() -> None:
    values = np.array([[1.0, 3.0], [NAN, 5.0], [NAN, NAN]])
    assert per_unit(values).tolist() == [2.0, 5.0, pytest.approx(NAN, nan_ok=True)]
    assert per_unit(np.array([[1.0, NAN, 4.0]])).tolist() == [1.0, pytest.approx(NAN, nan_ok=True), 4.0]


def test_every_failure_stays_in_the_denominator() -> None:
    one = study(("a", "b"), maps=1, queries=4, seeds=3, traffic_cases=(StudyTraffic(),))
    ends = ("refused", "timeout", "failed")

    def make(w: int, c: int, s: int, e: int) -> Made:
        if e == 1 and w == 0:
            return ends[s], {}
        return "done", metrics(20.0 + w, not (e == 1 and w == 1))

    summary = summarise(runs(one, make))
    b = entry(summary, "b")
    assert (b.runs, b.queries) == (12, 4)
    assert b.endings == {"done": 9, "failed": 1, "refused": 1, "timeout": 1}
    assert b.outcomes == {"arrived": 6, "stuck": 3, "FAILED": 1, "REFUSED": 1, "TIMEOUT": 1}
    assert (b.own["arrived"].value, b.own["arrived"].runs) == (0.5, 12)
    assert (b.own["found"].value, b.own["found"].runs) == (0.75, 12)
    assert (b.own["cost"].value, b.own["cost"].units, b.own["cost"].runs) == (22.5, 2, 6)
    assert (b.own["collisions"].units, b.own["collisions"].runs) == (3, 9)


def test_a_mean_over_common_worlds_does_not_reward_who_fails_on_long_ways() -> None:
    one = study(("good", "lazy"), maps=1, queries=4, seeds=1, traffic_cases=(StudyTraffic(),))
    summary = summarise(
        runs(one, lambda w, c, s, e: ("done", metrics(10.0 * (w + 1) + e, not (e == 1 and w > 1))))
    )
    good, lazy = entry(summary, "good"), entry(summary, "lazy")
    assert good.own["cost"].value > lazy.own["cost"].value
    assert (good.common["cost"].value, lazy.common["cost"].value) == (15.0, 16.0)
    assert good.common["cost"].runs == lazy.common["cost"].runs == summary.common[0] == 2
    names = [tab.name for tab in tabs(summary)]
    assert "common-1" in names
    ranking = next(o for o in summary.orders if o.measure == "cost").ranking
    assert ranking.ranks == (1.0, 2.0)
    profile = next(w for w in summary.within if w.measure == "cost").profiles[1]
    assert profile.shares[-1] == 0.5


def test_who_never_arrives_is_left_out_of_the_common_worlds_and_named() -> None:
    one = study(("a", "b", "never"), maps=1, queries=3, seeds=2, traffic_cases=(StudyTraffic(),))
    summary = summarise(
        runs(one, lambda w, c, s, e: ("done", metrics(10.0 + w + e, e == 0 or (e == 1 and w > 0))))
    )
    assert summary.left_out == (("never",),)
    assert summary.common == (4,)
    tab = next(t for t in tabs(summary) if t.name == "common-1")
    assert [row[0] for row in tab.rows] == ["a", "b"]
    assert "never never did" in tab.note


def test_differences_are_taken_run_by_run() -> None:
    """Of a query that one solved with another seed than the other nothing can be said."""
    one = study(("a", "b"), maps=1, queries=3, seeds=2, traffic_cases=(StudyTraffic(),))
    solved = {0: ((1, 1), (1, 1)), 1: ((1, 0), (0, 1)), 2: ((1, 1), (0, 1))}

    def make(w: int, c: int, s: int, e: int) -> Made:
        return "done", metrics(10.0 + 100 * s + 2 * e, bool(solved[w][e][s]))

    pair = next(p for p in summarise(runs(one, make)).pairs if p.measure == "cost")
    assert (pair.entrant, pair.reference) == ("b", "a")
    assert pair.each == (2.0, 2.0)
    assert (pair.difference.value, pair.difference.units, pair.difference.runs) == (2.0, 2, 3)
    assert pair.test[:4] == (2, 0, 0, 2)
    arrived = next(p for p in summarise(runs(one, make)).pairs if p.measure == "arrived")
    assert arrived.each == (0.0, 0.0, -0.5)


@pytest.mark.nightly
def test_holm_is_over_all_comparisons_of_a_measure() -> None:
    summary = summarise(runs(study(queries=8), by_chance(1)))
    for name in {p.measure for p in summary.pairs}:
        some = [p for p in summary.pairs if p.measure == name]
        assert len(some) == 2 * 2
        assert [p.holm for p in some] == list(compare.holm([p.test.p for p in some]))


def test_early_failure_is_no_saving_of_work() -> None:
    one = study(("works", "gives up"), maps=1, queries=4, seeds=1, traffic_cases=(StudyTraffic(),))
    summary = summarise(
        runs(one, lambda w, c, s, e: ("done", metrics(10.0 if e == 0 else 1.0, e == 0 or w == 0)))
    )
    ranking = next(o for o in summary.orders if o.measure == "expansions").ranking
    assert ranking.ranks == ((2 + 1 + 1 + 1) / 4, (1 + 2 + 2 + 2) / 4)
    pair = next(p for p in summary.pairs if p.measure == "expansions")
    assert pair.difference.units == 1
    profile = next(w for w in summary.within if w.measure == "expansions").profiles[1]
    assert profile.shares == (0.25,)


def test_half_a_way_is_no_short_way() -> None:
    """Whatever a row says: what is told of ways is told of those that lead to the goal."""
    one = study(("a",), maps=1, queries=2, seeds=1, traffic_cases=(StudyTraffic(),))
    half = metrics(3.0) | {"arrived": False}
    own = entry(summarise(runs(one, lambda w, *_: ("done", half if w else metrics(20.0)))), "a").own
    assert (own["cost"].value, own["cost"].runs) == (20.0, 1)
    assert own["expansions"].runs == 2


def test_ranks_go_by_failures_first_and_then_by_the_mean() -> None:
    values = np.array([[[5.0, 9.0, 1.0, NAN], [5.0, 1.0, NAN, NAN]]])
    assert scores(np.concatenate([values, values]), False).tolist()[0] == [
        0.0,
        0.0,
        1.0,
        pytest.approx(NAN, nan_ok=True),
    ]
    both = np.array([[[2.0, 3.0]], [[2.0, 3.0]]])
    assert scores(both, True).tolist() == [[1.0, 0.0]] * 2


def naive(one: object, make: object, name: str, e: int, c: int) -> list[float]:
    """Means of the queries by loops."""
    out = []
    for w in range(len(one.worlds)):
        found = []
        for s in range(len(one.seeds)):
            ending, told = make(w, c, s, e)
            if ending == "done" and told.get(name) is not None:
                found.append(float(told[name]))
        if found:
            out.append(sum(found) / len(found))
    return out


@pytest.mark.commit(1)
@pytest.mark.parametrize("seed", range(4))
def test_means_are_those_of_plain_loops(seed: int) -> None:
    one, make = study(queries=5, seeds=3), by_chance(seed, 0.5)
    summary = summarise(runs(one, make))
    for c, crowd in enumerate(summary.traffic_cases):
        for e, entrant in enumerate(summary.entrants):
            for name in ("cost", "expansions", "collisions"):
                found, own = naive(one, make, name, e, c), entry(summary, entrant, crowd).own[name]
                assert own.units == len(found)
                assert own.value == pytest.approx(sum(found) / len(found))
                assert own.low <= own.value <= own.high or math.isnan(own.low)


@pytest.mark.nightly
def test_the_order_of_records_says_nothing() -> None:
    one, make = study(), by_chance(3)
    whole = runs(one, make)
    records = [
        (job.index, made[0], "X", made[1])
        for job in one.jobs()
        for made in [make(*np.unravel_index(job.index, whole.ending.shape))]
    ]
    shuffled = [records[k] for k in np.random.default_rng(1).permutation(len(records))]
    a, b = (summarise(runs_of(one, some)).as_json() for some in (records, shuffled))
    assert a == b


def test_the_machines_form_is_plain_and_finite() -> None:
    for failing in (0.0, 0.4, 1.0):
        plain = summarise(runs(study(), by_chance(0, failing))).as_json()
        assert json.loads(json.dumps(plain, allow_nan=False)) == plain
        assert finite(plain)
        assert (plain["unit"], plain["level"], plain["resamples"], plain["seed"]) == ("query", 0.95, 5000, 0)


def test_of_one_query_the_seed_is_the_unit() -> None:
    one = study(("a", "b"), maps=1, queries=1, seeds=9, traffic_cases=(StudyTraffic(),))
    summary = summarise(runs(one, lambda w, c, s, e: ("done", metrics(10.0 + s + e, s != 8))))
    assert summary.unit == "seed"
    assert entry(summary, "a").own["cost"].units == 8
    assert entry(summary, "a").own["arrived"].runs == 9
    assert "9 seeds of one query" in tabs(summary)[0].note


def test_what_was_not_run_yet_is_told_and_counted_nowhere() -> None:
    one = study(("a", "b"), maps=1, queries=4, seeds=2, traffic_cases=(StudyTraffic(),))
    summary = summarise(
        runs(one, lambda w, c, s, e: None if w == 3 and e == 1 else ("done", metrics(10.0 + w)))
    )
    assert (summary.asked, summary.known) == (16, 14)
    assert entry(summary, "b").own["arrived"].runs == 6
    assert next(o for o in summary.orders if o.measure == "cost").ranking.n == 3
    assert next(w for w in summary.within if w.measure == "cost").profiles[0].n == 6


def test_the_reference_can_be_chosen() -> None:
    made = runs(study(), by_chance(2))
    first, other = summarise(made), summarise(made, reference="c")
    assert (first.reference, other.reference) == ("a", "c")
    ac = next(p for p in first.pairs if p.entrant == "c" and p.measure == "cost")
    ca = next(p for p in other.pairs if p.entrant == "a" and p.measure == "cost")
    assert ac.difference.value == pytest.approx(-ca.difference.value)
    assert ac.test.p == pytest.approx(ca.test.p)
    with pytest.raises(UsageError, match="REFERENCE"):
        summarise(made, reference="nobody")


def test_seconds_stand_in_no_summary_that_is_not_asked_for_them() -> None:
    one = study(("a",), maps=1, traffic_cases=(StudyTraffic(),))
    made = runs(one, lambda w, c, s, e: ("done", metrics(10.0, cpu_s=0.5)))
    assert "cpu_s" not in summarise(made).entries[0].own
    assert "cpu_s" in summarise(made, timing=True).entries[0].own
    assert not any("timing" in tab.name for tab in tabs(summarise(made)))
    assert any("timing" in tab.name for tab in tabs(summarise(made, timing=True)))


@pytest.mark.commit(3)
@pytest.mark.parametrize("kind", ["plan", "simulate", "drive"])
@pytest.mark.parametrize("failing", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("planners", [("only",), ("a", "b"), tuple("abcdefgh")])
def test_tables_of_every_kind_hold_no_number_that_is_none(
    kind: str, failing: float, planners: tuple[str, ...]
) -> None:
    summary = summarise(runs(study(planners, kind=kind), by_chance(7, failing)))
    made = tabs(summary)
    assert made
    assert len({tab.name for tab in made}) == len(made)
    for tab in made:
        for texts in tab.texts():
            assert not any("nan" in t or "inf" in t for t in texts)


def test_the_cost_of_an_any_angle_planner_says_whose_it_is() -> None:
    one = study(("steps", "lines"), kind="plan", traffic_cases=(StudyTraffic(),))

    def make(w: int, c: int, s: int, e: int) -> Made:
        return "done", metrics(20.0 + w + e, length_any_angle=18.5 + w if e else None)

    some = {tab.name: tab for tab in tabs(summarise(runs(one, make)))}
    paths = some["paths-1"]
    column = paths.header.index("any-angle length (cells)")
    assert [row[column].split()[0] for row in paths.rows] == ["-", "21.00"]
    assert all("of its walk from cell to cell" in some[name].note for name in ("paths-1", "maps-1"))
    alone = {tab.name: tab for tab in tabs(summarise(runs(one, by_chance(1, 0.0))))}
    assert "any-angle length (cells)" not in alone["paths-1"].header
    assert not any("walk" in tab.note for tab in alone.values())


def test_ticks_are_said_to_be_those_until_arrival_and_are() -> None:
    one = study(("a",), maps=1, queries=1, seeds=2, traffic_cases=(StudyTraffic(),))

    def make(w: int, c: int, s: int, e: int) -> Made:
        return "done", metrics(10.0, s == 0) | {"ticks": 10 if s == 0 else 500}

    assert "until arrival" in ALL["ticks"].about
    assert entry(summarise(runs(one, make)), "a").own["ticks"].value == 10.0


def test_an_empty_study_has_tables_too() -> None:
    summary = summarise(runs(study(), lambda *_: None))
    assert summary.known == 0
    assert finite(summary.as_json())
    tabs(summary)


def test_names_of_entrants_say_what_there_are_several_of() -> None:
    two = study(("a", "b"), laws=("x", "y"))
    assert runs(two, lambda *_: None).entrants == ("a, x", "a, y", "b, x", "b, y")
    assert runs(study(("a",), laws=("x", "y")), lambda *_: None).entrants == ("x", "y")


def test_numbers_in_words() -> None:
    assert [places_of(v) for v in (0.0, 12345.0, 123.4, 12.3, 1.2, 0.05)] == [4, 0, 1, 2, 3, 4]
    assert [fixed(0.0, 3), fixed(-0.0001, 2), fixed(-1.5, 1)] == ["0", "0.00", "-1.5"]
    assert [p_text(p) for p in (NAN, 0.00001, 0.01234, 0.5)] == ["-", "< 0.0001", "0.012", "0.5"]
    e = entry(summarise(runs(study(("a",)), lambda *_: ("done", metrics(12.0)))), "a").own["cost"]
    assert estimate_text(e) == "12.00"
    assert estimate_text(e, 1.0, 7) == "12.00 n 12"
