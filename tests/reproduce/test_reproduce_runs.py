"""The runs, what is made of them, and the page: small studies, and the whole at night."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from lampyris.io.maps import library
from lampyris.reproduce import Report, RunProgress, Verdict, reproduce, work
from lampyris.reproduce.page import charts, page, story
from lampyris.reproduce.runs import measured, results, runs
from lampyris.reproduce.runs.measured import Costs, MemoryUse
from lampyris.reproduce.runs.results import Difference
from lampyris.reproduce.tables import printed as judged
from lampyris.reproduce.tables import printed_data
from lampyris.reproduce.tables.verdict import KINDS
from lampyris.study.analysis import compare
from lampyris.study.design.study import Study

KEPT = tuple(MemoryUse(n, 90_000.0 - k, 95_000.0) for k, n in enumerate(measured.PLANNERS))
COSTS = Costs(
    queries=6, cells=2500, kept=KEPT,
    costs_alone=15_000, luciferin=20_000, window=576, field_s=4e-5, plan_s=2e-4, jump_s=1e-5, astar_s=1e-4,
)  # fmt: skip


def small(quick: bool = False) -> dict[str, Study]:
    """Two queries on two maps, three values of nt; two seeds where something is drawn."""
    asked = BIG(True)
    some = {}
    for name, study in asked.items():
        ends = [w for w in study.worlds if w.ground.name in ("env-5", "env-6")]
        worlds = tuple(ends[:2] + ends[-2:])
        planners = tuple(w for w in study.planners if name != "nt" or w.called in ("nt 1", "nt 10", "nt 48"))
        some[name] = replace(study, worlds=worlds, planners=planners)
    return some


BIG = runs.studies


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Report, Path, list[RunProgress]]:
    out = tmp_path_factory.mktemp("reproduction")
    told: list[RunProgress] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(runs, "studies", small)
        patch.setattr(measured, "measure", lambda quick=False: COSTS)
        report = reproduce(out, workers=1, quick=True, progress=told.append)
    return report, out, told


def test_the_stored_queries_are_the_pairs_of_table_4_11() -> None:
    for k in range(1, 7):
        pairs = [(q.start, q.goal) for q in library.load(f"env-{k}").queries[:5]]
        assert pairs == results.pairs_of(str(k))


def test_the_studies_are_what_the_page_says() -> None:
    asked = runs.studies()
    assert [len(asked[n].worlds) for n in ("nt", "static", "moving")] == [240, 30, 30]
    assert [len(asked[n].seeds) for n in ("nt", "static", "moving")] == [1, 10, 5]
    assert [w.settings["nt"] for w in asked["nt"].planners] == list(runs.NT)
    assert set(range(8, 13)) <= set(runs.NT)
    gates = [(w.called, w.settings.get("gates")) for w in asked["static"].planners]
    assert gates == [
        ("mixed", "replan"), ("improved", "close"), ("ad-gso", "replan"), ("ad-gso, gates closed", "close"),
        ("ad-gso, gates ignored", "ignore"), ("astar", None),
    ]  # fmt: skip
    (crowd,) = asked["moving"].traffic_cases
    assert (crowd.kind, crowd.count, crowd.tracks) == ("random-walk", 20, "live")
    assert all(study.moves == "dissertation" for study in asked.values())


def test_drawn_queries_are_far_apart_and_the_same_every_time() -> None:
    first, again = (runs.studies()["nt"].worlds for _ in range(2))
    assert [w.query for w in first] == [w.query for w in again]
    assert len({(w.ground.name, w.query) for w in first}) == 240
    for w in first:
        dx, dy = abs(w.start[0] - w.goal[0]), abs(w.start[1] - w.goal[1])
        assert 1.4 * min(dx, dy) + abs(dx - dy) >= runs.FAR


@pytest.mark.nightly
def test_everything_is_written(made: tuple[Report, Path, list[RunProgress]]) -> None:
    report, out, _ = made
    assert report.page == out / "index.html"
    assert all(place.is_file() for place in report.files)
    assert report.figures == 2095
    assert sum(report.counts.values()) == 2095
    assert list(report.counts) == list(KINDS)
    with (out / "verdicts.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2095
    assert all(r["verdict"] in KINDS and r["why"] for r in rows)
    whole = json.loads((out / "verdicts.json").read_text(encoding="utf-8"))
    assert [len(t["verdicts"]) for t in whole["tables"].values()] == [len(v) for v in report.tables.values()]
    assert whole["conclusion"] == report.conclusion
    with (out / "claims_recomputed.csv").open(encoding="utf-8", newline="") as file:
        assert len(list(csv.DictReader(file))) == 88


class Reader(HTMLParser):
    """Counts figures on a page by the reasons that they tell, and looks for what must not be there."""

    def __init__(self) -> None:
        super().__init__()
        self.told: list[str] = []
        self.tags: set[str] = set()
        self.ids: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.tags.add(tag)
        if tag == "span" and given.get("title"):
            self.told.append(str(given["title"]))
        self.ids.add(str(given.get("id")))


@pytest.mark.nightly
def test_every_figure_is_on_the_page_with_its_verdict(made: tuple[Report, Path, list[RunProgress]]) -> None:
    report, _, _ = made
    reader = Reader()
    words = report.page.read_text(encoding="utf-8")
    reader.feed(words)
    wanted = sorted(f"{v.verdict}: {v.why}" for some in report.tables.values() for v in some)
    assert sorted(reader.told) == wanted
    assert not reader.tags & {"script", "iframe", "object", "form"}
    assert {f"table-{n.replace('.', '-')}" for n in printed_data.tables()} <= reader.ids
    for sign in ("✗", "⊘", "✓"):
        assert sign in words


def test_tables_of_means_have_their_intervals_beneath(made: tuple[Report, Path, list[RunProgress]]) -> None:
    """At 1280 pixels the widest of them would scroll sideways otherwise."""
    words = made[0].page.read_text(encoding="utf-8")
    for name in ("nt-means", "static-means", "moving-means"):
        assert f'<div class="stacked"><div class="tab" id="tab-{name}">' in words
        head = words.partition(f'id="tab-{name}"')[2].partition("</thead>")[0]
        assert head.count("<th ") <= 11
        assert ">queries</th>" in head
    assert ".stacked td small { display: block; }" in words
    assert "<small>[8 runs]</small>" in words


def test_the_mark_of_a_missing_bar_is_explained(made: tuple[Report, Path, list[RunProgress]]) -> None:
    """The small studies, like quick ones, have no run of some pairs of the first map."""
    words = made[0].page.read_text(encoding="utf-8")
    assert words.count("A grey × stands for a pair without runs") == len(charts.BARS) + 1
    found = found_in(made)
    whole = {m: dict.fromkeys(found.first[m], (1.0, 2.0)) for m in found.first}
    assert page._missing(replace(found, first=whole), "cost") == ""
    whole["mixed"]["cost"] = (1.0, math.nan)
    assert "grey ×" in page._missing(replace(found, first=whole), "cost")


def test_the_page_stands_on_the_runs(made: tuple[Report, Path, list[RunProgress]]) -> None:
    report, _, _ = made
    text = {r["id"]: v for r, v in zip(printed_data.rows("text"), report.tables["text"], strict=True)}
    assert "queries of our maps" in text["best-nt"].why
    assert "kB" in text["storage"].why
    row = next(
        v for v in report.tables["4.11"]
        if v.where == "environment 6, (48,49), to (1,49), ad-gso: path cost"
    )  # fmt: skip
    assert row.ours == "at least 47; length 47.8, sum 1132 on our env-6"
    assert row.verdict == "impossible"


def test_progress_ends_at_the_total_and_knows_the_time_left(
    made: tuple[Report, Path, list[RunProgress]],
) -> None:
    _, _, told = made
    assert told[-1].done == told[-1].total == sum(len(s) for s in small().values())
    assert told[-1].seconds_left == 0.0
    assert {stage.name for stage in told} == {"nt", "static", "moving"}
    assert [s.done for s in told] == sorted(s.done for s in told)


@pytest.mark.nightly
def test_what_is_in_the_stores_is_not_run_again(made: tuple[Report, Path, list[RunProgress]]) -> None:
    report, out, _ = made
    verdicts = (out / "verdicts.csv").read_bytes()
    page = report.page.read_bytes()
    told: list[RunProgress] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(runs, "studies", small)
        patch.setattr(measured, "measure", lambda quick=False: COSTS)
        patch.setattr("lampyris.study.execution.worker.work", None)
        reproduce(out, workers=1, quick=True, progress=told.append)
    assert told[0].done == len(small()["nt"])
    assert (out / "verdicts.csv").read_bytes() == verdicts
    assert report.page.read_bytes() == page


def test_units_are_queries_and_seeds_are_averaged(made: tuple[Report, Path, list[RunProgress]]) -> None:
    """Against a plain reading of the exported rows."""
    _, out, _ = made
    with (out / "runs" / "static-quick.csv").open(encoding="utf-8", newline="") as file:
        rows = [r for r in csv.DictReader(file) if r["planner"] == "mixed"]
    by: dict[tuple[str, str], list[float]] = {}
    for r in rows:
        by.setdefault((r["map"], r["query"]), []).append(float(r["cost"]))
    assert {len(v) for v in by.values()} == {2}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(runs, "studies", small)
        tables = runs.run_all(out / "runs", workers=1, quick=True)
    found = results.results(tables)
    (mixed,) = [m for m in found.static if m.name == "mixed"]
    assert mixed.means["cost"].n == len(by) == 4
    assert mixed.means["cost"].value == pytest.approx(np.mean([np.mean(v) for v in by.values()]))
    assert mixed.runs == 8


def fake(what: str, a: str, b: str, mean: float, holm: float) -> Difference:
    x = [mean, mean]
    return Difference(
        what, a, b, compare.mean(x), 100 * mean, compare.signed_rank(x, [0.0, 0.0]), holm
    )  # fmt: skip


def found_in(made: tuple[Report, Path, list[RunProgress]]) -> results.Results:
    """The results of the small studies."""
    _, out, _ = made
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(runs, "studies", small)
        return results.results(runs.run_all(out / "runs", workers=1, quick=True))


def dulled(
    found: results.Results, told: dict[tuple[str, str, str], tuple[float, float, float]]
) -> results.Results:
    """The same results with nothing told apart but what is named: its mean, share and p."""

    def turned(some: tuple[Difference, ...]) -> tuple[Difference, ...]:
        out = []
        for d in some:
            mean, share, p = told.get((d.what, d.a, d.b), (1.0, 1.0, 1.0))
            out.append(replace(d, mean=compare.mean([mean, mean]), share=share, holm=p))
        return tuple(out)

    return replace(
        found,
        static_differences=turned(found.static_differences),
        moving_differences=turned(found.moving_differences),
    )


VARIANTS = {
    ("ad-gso", "mixed"): "against mixed with gates found on the way by both (",
    (
        "ad-gso",
        "improved",
    ): "against improved as printed (AD-GSO finds gates on the way, improved closes them",
    ("ad-gso, gates closed", "improved"): "against improved with gates closed for both (",
}


def test_every_comparison_is_told_with_its_variant(made: tuple[Report, Path, list[RunProgress]]) -> None:
    """All pairs with the two hybrids, all measures, where nothing moves and among moving obstacles."""
    found = found_in(made)
    assert list(VARIANTS) == [pair for pair in results.PAIRS if pair[1] != "astar"]
    told = story.conclusion(found, COSTS)
    still, moving = told.split("Among moving obstacles")
    checked = 0
    for words, some in ((still, found.static_differences), (moving, found.moving_differences)):
        numbers = words.partition("In numbers" if words is still else "in numbers")[2]
        clauses = {
            pair: numbers.partition(start)[2].partition("; against")[0] for pair, start in VARIANTS.items()
        }
        assert all(clauses.values())
        assert numbers.index(VARIANTS["ad-gso", "improved"]) < numbers.index(
            VARIANTS["ad-gso, gates closed", "improved"]
        )
        for d in some:
            if (d.a, d.b) in VARIANTS:
                assert story.change(d, {"cost": "length"}.get(d.what, d.what)) in clauses[d.a, d.b], d
                checked += 1
    assert checked == 2 * 3 * 3
    for name in ("AD-GSO that finds gates on the way in", "AD-GSO with gates closed beforehand in"):
        assert name in told.partition("there arrived")[2]


def test_a_loss_in_the_comparison_as_printed_is_told(made: tuple[Report, Path, list[RunProgress]]) -> None:
    loss = {
        ("cost", "ad-gso", "improved"): (20.0, 44.0, 0.014),
        ("ticks", "ad-gso", "improved"): (9.0, 45.6, 0.03),
    }
    told = story.conclusion(dulled(found_in(made), loss), COSTS)
    assert "44.0 % more length (p = 0.014)" in told
    assert "45.6 % more ticks (p = 0.030)" in told
    assert "surely loses in: length (only against improved as printed)" in told
    assert "surely loses in: ticks (only against improved as printed)" in told
    assert told.count("surely gains in: nothing") == 2


def test_a_gain_is_claimed_only_where_it_holds(made: tuple[Report, Path, list[RunProgress]]) -> None:
    found = found_in(made)
    gain = {("iterations", *pair): (-5.0, -20.0, 0.001) for pair in VARIANTS}
    all_three = story.conclusion(dulled(found, gain), COSTS)
    assert "surely gains in: iterations (in all 3 comparisons);" in all_three
    del gain["iterations", "ad-gso", "improved"]
    two = story.conclusion(dulled(found, gain), COSTS)
    assert (
        "surely gains in: iterations (only against mixed with gates found on the way by both and against "
        "improved with gates closed for both);" in two
    )


def test_words_follow_the_numbers(made: tuple[Report, Path, list[RunProgress]]) -> None:
    """The same story told of other results says other things."""
    found = found_in(made)
    turned = [replace(d, mean=compare.mean([5.0, 5.0]), holm=0.001) for d in found.static_differences]
    other = replace(found, static_differences=tuple(turned))
    assert "surely gains in: nothing; it surely loses in: iterations (in all 3" in story.conclusion(
        other, COSTS
    )
    turned = [replace(d, mean=compare.mean([-5.0, -5.0]), holm=0.001) for d in found.static_differences]
    other = replace(found, static_differences=tuple(turned))
    kept = tuple(replace(k, kept=1e3) if k.planner == "ad-gso" else k for k in KEPT)
    assert "does not in: nothing" in story.conclusion(other, replace(COSTS, kept=kept, astar_s=1.0))
    assert story.change(fake("cost", "a", "b", -0.5, 0.5), "length").startswith("no difference")
    assert story.change(fake("cost", "a", "b", -0.5, 0.01), "length") == "50.0 % less length (p = 0.010)"
    assert story.change(fake("ticks", "a", "b", 0.5, 0.0), "ticks") == "50.0 % more ticks (p < 0.001)"
    none = tuple(replace(d, holm=1.0) for d in found.nt_differences)
    assert story.best_nt(replace(found, nt_differences=none)).ours == "not surely beaten"


def test_a_page_is_written_through_a_link_and_keeps_its_rights(tmp_path: Path) -> None:
    place = tmp_path / "page"
    place.write_text("old")
    place.chmod(0o640)
    (tmp_path / "index.html").symlink_to(place)
    work._write(tmp_path / "index.html", "new é")
    assert place.read_text(encoding="utf-8") == "new é"
    assert place.stat().st_mode & 0o777 == 0o640
    assert (tmp_path / "index.html").is_symlink()


def test_printed_tables_alone_need_no_runs() -> None:
    assert isinstance(judged.verdicts("4.9")[0], Verdict)


@pytest.mark.nightly
def test_memory_and_times_are_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(measured, "PLANNERS", ("ad-gso", "dijkstra"))
    monkeypatch.setattr(measured, "MAPS", ("env-6",))
    costs = measured.measure(quick=True)
    kept = {k.planner: k for k in costs.kept}
    # A field's arrays alone: no session of AD-GSO holds less.
    assert kept["ad-gso"].kept > costs.costs_alone + costs.luciferin
    assert all(k.peak >= k.kept for k in costs.kept)
    assert (costs.cells, costs.window) == (2500, 48 * 12)
    assert min(costs.field_s, costs.plan_s, costs.astar_s) > 0


@pytest.mark.nightly
def test_the_whole(tmp_path: Path) -> None:
    report = reproduce(tmp_path, workers=2)
    assert report.figures == 2095
    assert dict(report.runs) == {"nt": 2640, "static": 1800, "moving": 600}
    text = {r["id"]: v for r, v in zip(printed_data.rows("text"), report.tables["text"], strict=True)}
    assert text["best-nt"].ours.startswith("beaten by nt 11")
    assert "surely gains in: iterations (only against mixed" in report.conclusion
    assert "surely loses in: length (in all 3 comparisons)" in report.conclusion
