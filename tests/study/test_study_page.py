"""The page of a study: the same bytes for the same results, and nothing that loads, runs or misleads."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import TextIO

import numpy as np
import pytest
from matplotlib.figure import Figure
from summary_samples import by_chance, metrics, rows, study

from lampyris.errors import FileError, UsageError
from lampyris.study.analysis.runs import runs_of
from lampyris.study.analysis.summary import summarise
from lampyris.study.analysis.table import table_of
from lampyris.study.design.study import Config, Study, StudyTraffic
from lampyris.study.design.study_file import load_study
from lampyris.study.execution.worker import run_job
from lampyris.study.page.films import choose
from lampyris.study.page.page import key_of, page_of, write_page
from sizes import sized

sys.path.insert(0, str(Path(__file__).parents[1] / "report"))
from html_reader import Reader, read
from test_report_html import HOSTILE

ONE_CROWD = (StudyTraffic(),)


def page(one: Study, make: object, tmp_path: Path, **more: object) -> str:
    """The page of made-up results, without films."""
    out = tmp_path / "page.html"
    write_page(out, one, table_of(one, rows(one, make)), films=False, **more)
    return out.read_text("utf-8")


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures are made and not drawn, which takes nearly all of a page's time: its own words are judged."""

    def savefig(figure: Figure, out: TextIO, **how: object) -> None:
        out.write('<svg width="1" height="1"></svg>')

    monkeypatch.setattr(Figure, "savefig", savefig)


def told(words: str) -> str:
    return " ".join(" ".join(read(words).words).split())


@pytest.mark.nightly
def test_the_same_results_are_the_same_bytes(tmp_path: Path) -> None:
    one, make = study(maps=1), by_chance(1)
    all_rows = rows(one, make)
    keys = list(all_rows)
    mixed = {keys[k]: all_rows[keys[k]] for k in np.random.default_rng(2).permutation(len(keys))}
    write_page(tmp_path / "a.html", one, table_of(one, all_rows), films=False)
    write_page(tmp_path / "b.html", one, table_of(one, mixed), films=False)
    assert (tmp_path / "a.html").read_bytes() == (tmp_path / "b.html").read_bytes()


@pytest.mark.nightly
@pytest.mark.usefixtures("undrawn")
def test_seconds_and_memory_are_left_out_unless_asked_for(tmp_path: Path) -> None:
    one, make = study(), by_chance(1)
    assert "CPU (s)" not in page(one, make, tmp_path)
    assert "0.25" in page(one, make, tmp_path, timing=True)


@pytest.mark.nightly
@pytest.mark.usefixtures("undrawn")
def test_a_page_says_what_was_asked_and_how_it_ended(tmp_path: Path) -> None:
    one = study(
        about="Which is shorter?",
        traffic_cases=(StudyTraffic(), StudyTraffic("random-walk", 5, tracks="live")),
    )
    words = told(page(one, by_chance(4), tmp_path))
    for wanted in (
        "made up", "Which is shorter?", "72 runs: 3 methods on 6 queries of 2 maps", "map 0",
        "Among 5 random walkers (live)",
        "obstacles yield to the robot", key_of(one), "refused", "timeout", "Wilcoxon", "BCa", "seed 0",
        "6 queries, the 2 seeds of each averaged", "What the columns are", "Run it again",
    ):  # fmt: skip
        assert wanted in words, wanted


@pytest.mark.nightly
@pytest.mark.usefixtures("undrawn")
def test_a_page_says_it_in_words_for_people(tmp_path: Path) -> None:
    one = study(
        traffic_cases=(StudyTraffic("patrol", 1), StudyTraffic("random-walk", 5), StudyTraffic("crossing", 2)),
        seeds=90, expansions=5_000_000, robot={"jerk_max": None, "radius": 0.25, "reverse": True},
    )  # fmt: skip
    words = told(page(one, lambda w, c, s, e: ("done", metrics(9.0 + e)), tmp_path))
    for wanted in (
        "5,000,000 expansions a call", "jerk_max none, radius 0.25, reverse yes", "Among 1 patrol,",
        "Among 5 random walkers,", "Results among 2 crossing obstacles", "4,860 runs: 3 methods",
        "over the 540 of 540 worlds",
    ):  # fmt: skip
        assert wanted in words, wanted
    assert "random-walk" not in words
    assert {c.label for c in one.traffic_cases} == {"1 patrol", "5 random-walk", "2 crossing"}


@pytest.mark.nightly
@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize(
    ("maps", "queries", "says"),
    [
        (2, 3, "over queries speaks of queries like these on these maps only"),
        (1, 3, "over queries speaks of queries like these on this map only"),
        (1, 1, "over seeds speaks of this query only"),
    ],
)
def test_a_page_says_how_far_its_intervals_reach(maps: int, queries: int, says: str, tmp_path: Path) -> None:
    words = told(page(study(maps=maps, queries=queries), by_chance(1), tmp_path))
    assert f"An interval {says}" in words.partition("How it is counted")[2]


@pytest.mark.usefixtures("undrawn")
def test_a_page_says_who_collided(tmp_path: Path) -> None:
    def make(w: int, c: int, s: int, e: int) -> tuple[str, dict[str, object]]:
        return "done", metrics(10.0 + e, collisions=2 if (w, e) == (1, 2) else 0, hits=0)

    words = told(page(study(traffic_cases=ONE_CROWD), make, tmp_path))
    assert "The robot collided in 2 of c's runs." in words
    assert "An obstacle ran into the robot in no run." in words


@pytest.mark.nightly
@pytest.mark.usefixtures("undrawn")
def test_the_sample_size_stands_beside_every_mean(tmp_path: Path) -> None:
    """A cell with an interval is in a table that says how many; one of other runs says so itself."""
    text = page(study(queries=4), by_chance(5, 0.5), tmp_path)
    tables = re.findall(
        r'<div class="tab".*?</table></div>(?:<p class="note">.*?</p>)?</div>', text, re.DOTALL
    )
    with_means = [t for t in tables if "[" in t]
    assert len(with_means) > 6
    for one in with_means:
        assert "resamples, seed 0" in one
        assert ">runs<" in one


@sized("pages", 1, 100)
def test_hostile_names_are_shown_and_not_obeyed(tmp_path: Path, pages: int) -> None:
    for k in [*range(0, len(HOSTILE) - 3, 5)][-pages:]:
        names = HOSTILE[k : k + 4]
        one = study(
            ("a", "b"), maps=1, queries=2, seeds=1, traffic_cases=ONE_CROWD, name=names[0], about=names[1]
        )
        planners = (Config("ad-gso", {names[2]: names[3]}, names[2]), Config("astar", {}, names[3] or "-"))
        one = Study(**{f: getattr(one, f) for f in one.__slots__} | {"planners": planners})
        runs = runs_of(one, [(k, "done", "", metrics(10.0 + k, outcome=names[0])) for k in range(len(one))])
        read(page_of(runs, summarise(runs), films=False))


@pytest.mark.commit(1)
@pytest.mark.parametrize("kind", ["plan", "simulate", "drive"])
@pytest.mark.parametrize(
    ("shape", "failing"),
    [(("only", 1, 1), 0.0), (("only", 3, 2), 1.0), (("ab", 1, 3), 0.0), (("abcd", 2, 1), 1.0)],
)
def test_poor_studies_have_sound_pages(
    kind: str, failing: float, shape: tuple[str, int, int], tmp_path: Path
) -> None:
    names, queries, seeds = shape
    planners = ("only",) if names == "only" else tuple(names)
    one = study(planners, maps=1, queries=queries, seeds=seeds, kind=kind, traffic_cases=ONE_CROWD)
    words = told(page(one, by_chance(1, failing), tmp_path))
    assert not re.search(r"\bnan\b|\binf\b|\bNone\b.*\bNone\b.*\[", words)


@pytest.mark.usefixtures("undrawn")
def test_a_study_that_has_not_begun_has_a_page(tmp_path: Path) -> None:
    words = told(page(study(), lambda *_: None, tmp_path))
    assert "0 runs of 72, 72 not run yet" in words
    half = told(page(study(), lambda w, c, s, e: ("done", metrics(9.0)) if w < 3 else None, tmp_path))
    assert "36 runs of 72, 36 not run yet" in half


@pytest.mark.nightly
@pytest.mark.usefixtures("undrawn")
def test_the_dissertations_bars_tell_the_two_measures_of_its_cost_column(tmp_path: Path) -> None:
    one = study(("dstar-lpso", "dstar16-lpso", "ad-gso"), traffic_cases=ONE_CROWD)
    words = told(page(one, by_chance(2, 0.0), tmp_path))
    for wanted in ("Figure 4.5", "Figure 4.6", "Figure 4.7", "sum of the cost-to-go", "by the true length"):
        assert wanted in words
    other = told(page(study(traffic_cases=ONE_CROWD), by_chance(2, 0.0), tmp_path))
    assert "Figure 4.6" in other
    assert "by the true length" not in other


@pytest.mark.nightly
def test_of_crowds_of_one_kind_success_is_drawn_over_their_numbers(
    tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    def fewer(w: int, c: int, s: int, e: int) -> tuple[str, dict[str, object]]:
        return "done", metrics(9.0, arrived=c + e < 4)

    some = (StudyTraffic("random-walk", 10), StudyTraffic(), StudyTraffic("random-walk", 5))
    text = page(study(traffic_cases=some), fewer, tmp_path)
    assert "over the number of obstacles (random walkers)" in told(text)
    (drawn,) = re.findall(
        r"<svg[^>]*density.*?</svg>|<svg(?:(?!</svg>).)*moving obstacles.*?</svg>", text, re.DOTALL
    )
    assert all(f">{count}<" in drawn for count in (0, 5, 10))
    request.getfixturevalue("undrawn")
    for traffic_cases in (some[:2], (*some, StudyTraffic("patrol", 3))):
        assert "over the number of obstacles" not in told(
            page(study(traffic_cases=traffic_cases), fewer, tmp_path)
        )


@pytest.mark.nightly
@pytest.mark.usefixtures("undrawn")
def test_of_very_many_entrants_there_are_tables_and_no_figures(tmp_path: Path) -> None:
    planners = tuple(f"p{k}" for k in range(90))
    one = study(planners, maps=1, queries=2, seeds=1, traffic_cases=ONE_CROWD)
    text = page(one, by_chance(1, 0.0), tmp_path)
    assert "90 names would not be legible" in told(text)
    assert text.count("<svg") == 3


def test_a_wrong_reference_and_a_place_that_cannot_be_written(tmp_path: Path) -> None:
    one = study()
    table = table_of(one, rows(one, by_chance(1)))
    with pytest.raises(UsageError):
        write_page(tmp_path / "a.html", one, table, films=False, reference="nobody")
    with pytest.raises(FileError):
        write_page(tmp_path / "none" / "a.html", one, table, films=False)
    assert not list(tmp_path.iterdir())


SMALL = """
version: 1
name: films
maps:
  - {bundled: guide}
planners: [ad-gso, astar]
preset: dissertation
traffic: [{kind: random-walk, count: 3}]
seeds: 2
"""


@pytest.mark.nightly
def test_films_are_run_again_and_are_the_same_bytes(tmp_path: Path) -> None:
    (tmp_path / "s.yaml").write_text(SMALL)
    one = load_study(tmp_path / "s.yaml")
    records = []
    for job in one.jobs():
        trace = run_job(job.plain, one.grounds[job.plain["map"]].grid).noun
        told = metrics(trace.cost or 0.0, trace.arrived)
        records.append((job.index, "done", "", told | {"ticks": trace.ticks}))
    runs = runs_of(one, records)
    summary = summarise(runs)
    chosen = choose(summary, runs)
    assert chosen is not None
    assert chosen.entrants == (0, 1)
    first = page_of(runs, summary)
    assert first.count("data:image/webp") == 2
    assert first == page_of(runs, summary)
    assert len(first) < 2_000_000
    read(first)


def test_the_film_is_of_the_world_where_one_failed() -> None:
    one = study(("a", "b", "c"), traffic_cases=ONE_CROWD)
    make = by_chance(0, 0.0)
    records = []
    for job in one.jobs():
        w, c, s, e = np.unravel_index(job.index, (6, 1, 2, 3))
        ending, numbers = make(w, c, s, e)
        if (w, s, e) in ((3, 1, 2), (4, 0, 1)):
            numbers = metrics(99.0, False)
        records.append((job.index, ending, "", numbers))
    runs = runs_of(one, records)
    chosen = choose(summarise(runs), runs)
    assert chosen is not None
    assert (chosen.world, chosen.seed, chosen.entrants) == (3, 1, (0, 2, 1))
    assert "other does not" in chosen.why


@pytest.mark.nightly
def test_a_drive_has_a_film_and_a_plan_or_a_failure_has_none(tmp_path: Path) -> None:
    drives = SMALL.replace("name: films", "name: films\nkind: drive").replace("seeds: 2", "seeds: 1")
    (tmp_path / "s.yaml").write_text(drives.replace("[ad-gso, astar]", "[astar]"))
    one = load_study(tmp_path / "s.yaml")
    runs = runs_of(one, [(0, "done", "", metrics(9.0))])
    text = page_of(runs, summarise(runs))
    assert text.count("data:image/webp") == 1
    assert "Of all worlds" not in told(text)
    for kind, record in (("plan", ("done", "", metrics(9.0))), ("simulate", ("failed", "MEMORY", {}))):
        runs = runs_of(study(("a", "b"), kind=kind, traffic_cases=ONE_CROWD), [(0, *record)])
        assert choose(summarise(runs), runs) is None
        assert "data:image/webp" not in page_of(runs, summarise(runs))


def test_the_reader_would_see_what_is_wrong() -> None:
    for bad in ("<p><b></p>", "<script></script>", '<p onclick="x"></p>', '<img src="http://a">'):
        reader = Reader()
        reader.feed(bad)
        assert reader.wrong or reader.open
