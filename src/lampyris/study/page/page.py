"""Page: a study as one HTML file: what was asked, what came of it, in tables and figures, and how to redo it.

The same results give the same bytes: what depends on the machine is left out unless asked for.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping, Sequence
from typing import Any

from lampyris import __version__
from lampyris.io.atomic_write import whole_file
from lampyris.io.maps.thumbnail import thumbnail
from lampyris.report.html import page as html
from lampyris.report.html.page import Markup
from lampyris.report.html.table import Tab, Value
from lampyris.study.analysis.findings import Summary
from lampyris.study.analysis.measures import ALL, TIMING
from lampyris.study.analysis.runs import Runs, runs_of
from lampyris.study.analysis.summary import summarise
from lampyris.study.analysis.summary_tables import crowd_tabs, map_tabs, order_tabs, pair_tabs
from lampyris.study.analysis.table import ResultTable
from lampyris.study.design.serialize import study_plain
from lampyris.study.design.study import RESULTS, Config, Study, canonical
from lampyris.study.design.traffic_labels import crowd_words
from lampyris.study.page import figures
from lampyris.study.page.films import films as films_of
from lampyris.study.page.summary_text import found, many

LONG = 30
"""Rows from which on a table is closed until it is asked for."""
MAPS = 24
"""Maps with a picture; of more, the first."""


def write_page(
    path: str | os.PathLike[str],
    study: Study,
    table: ResultTable,
    *,
    films: bool = True,
    timing: bool = False,
    reference: str | None = None,
) -> Summary:
    """Write the page of a study, whole or not at all, and give its summary.

    Parameters
    ----------
    films : whether a few runs are run again and shown.
    timing : whether seconds and memory stand in it; then it is not the same bytes twice.
    reference : whom the others are compared with; None: the first.

    Raises
    ------
    UsageError : no such reference.
    FileError : the system refuses to write.
    """
    runs = runs_of(study, table.records())
    summary = summarise(runs, reference=reference, timing=timing)
    with whole_file(path) as file:
        file.write(page_of(runs, summary, films=films, timing=timing).encode("utf-8"))
    return summary


def page_of(runs: Runs, summary: Summary, *, films: bool = True, timing: bool = False) -> str:
    """The page as text."""
    study = runs.study
    parts = [
        _asked(study),
        *_results(summary),
        _figures("quality", "Success, cost and work", _quality(summary, runs)),
        _differences(summary),
        _ranks(summary),
        _figures("form", "As the dissertation drew it", _form(summary, runs, timing)),
        films_of(summary, runs) if films else Markup(""),
        _maps(summary),
        _failures(summary),
        _counted(summary),
        _glossary(runs, timing),
        _again(study),
    ]
    there = [part for part in parts if part]
    title = study.name or "a study"
    foot = f"lampyris {__version__}, results {RESULTS}, study {key_of(study)[:16]}"
    return html.page(title, _lead(study, summary, runs, there), *there, foot=foot)


def key_of(study: Study) -> str:
    """SHA-256 of all that decides a study's results and of its names, in hex."""
    return hashlib.sha256(canonical(study_plain(study))).hexdigest()


_LINKS = (
    ("asked", "What was asked"), ("results-1", "Results"), ("quality", "Figures"),
    ("differences", "Differences"), ("ranks", "Ranks"), ("form", "The dissertation's form"),
    ("films", "Films"), ("maps", "Map by map"), ("again", "Run it again"),
)  # fmt: skip


def _lead(study: Study, summary: Summary, runs: Runs, there: Sequence[Markup]) -> Markup:
    """What the study asks, links to the sections that there are, and what came of it."""
    links = [(a, words) for a, words in _LINKS if any(p.startswith(f'<section id="{a}"') for p in there)]
    nav = html.items(html.tag("a", words, href=f"#{anchor}") for anchor, words in links)
    about = html.tag("p", study.about, class_="lead") if study.about else None
    told = [html.paragraph(sentence) for sentence in found(summary, runs)]
    return html.join((about, html.tag("nav", nav), html.section("found", "What came of it", *told)))


def _asked(study: Study) -> Markup:
    kinds = {
        "plan": "plans with their speeds", "simulate": "simulations in ticks",
        "drive": "drives in continuous time",
    }  # fmt: skip
    names = list(dict.fromkeys(w.ground.name for w in study.worlds))
    live = any(c.count and c.tracks == "live" for c in study.crowds)
    tracks = (
        "live: the same draws for everybody, but obstacles yield to the robot, so tracks may part"
        if live
        else "replayed: the same for everybody, whatever anybody does"
    )
    pairs: list[tuple[str, Any]] = [
        ("runs", f"{len(study):,} {kinds[study.kind]}"),
        ("queries", f"{len(study.worlds):,} on {many(len(names), 'map')}"),
        ("traffic", "; ".join("none" if c.label == "none" else crowd_words(c.label) for c in study.crowds)),
        ("tracks", tracks if any(c.count for c in study.crowds) else ""),
        ("seeds", f"{', '.join(map(str, study.seeds[:12]))}{', ...' if len(study.seeds) > 12 else ''}"),
        ("root seed", study.root),
        ("moves", study.moves),
        ("budget", _budget(study)),
        ("robot", _settings(study.robot)),
        ("drive", _settings(study.drive)),
        ("version", f"lampyris {__version__}, results {RESULTS}"),
        ("study", html.tag("code", key_of(study))),
    ]
    some = [_who("planners", "Planners and their settings", study.planners)]
    some.append(_who("laws", "Speed laws and their settings", study.laws))
    return html.section("asked", "What was asked", html.facts(pairs), _pictures(study), *some)


def _budget(study: Study) -> str:
    parts = []
    if study.expansions is not None:
        parts.append(f"{study.expansions:,} expansions a call")
    if study.seconds is not None:
        parts.append(f"{study.seconds:g} s a run: results depend on the machine")
    return ", ".join(parts) or "none"


def _settings(settings: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} {_setting(value)}" for name, value in sorted(settings.items()))


def _setting(value: Any) -> str:
    """A value of a setting, in words where it is none or a yes or no; a number as it would be typed."""
    if value is None:
        return "none"
    return ("no", "yes")[value] if isinstance(value, bool) else str(value)


def _who(name: str, title: str, some: Sequence[Config]) -> Markup:
    rows: list[tuple[Value, ...]] = []
    for who in some:
        settings = _settings(who.settings) or "none"
        rows.append((who.called, who.name, settings, who.origin or "lampyris"))
    tab = html.table(Tab(name, title, ("called", "name", "settings", "from"), tuple(rows), align="llll"))
    return html.fold(f"{title} ({len(rows)})", tab)


def _pictures(study: Study) -> Markup:
    """Each map as a small picture."""
    shown = []
    grounds = list(study.grounds.values())
    for ground in grounds[:MAPS]:
        grid = ground.grid
        n = sum(w.ground.hash == ground.hash for w in study.worlds)
        words = f"{ground.name}, {grid.width} x {grid.height}, {many(n, 'query', 'queries')}"
        picture = html.image(thumbnail(grid, None, None), "image/png", f"the map {ground.name}")
        shown.append(html.tag("figure", picture, html.tag("figcaption", words)))
    rest = len(grounds) - len(shown)
    more = html.paragraph(f"and {many(rest, 'other map')}") if rest > 0 else None
    return html.join((html.tag("div", *shown, class_="maps"), more))


def _results(summary: Summary) -> list[Markup]:
    """A section for each crowd."""
    out = []
    for k, crowd in enumerate(summary.crowds):
        title = (
            "Results without moving obstacles" if crowd == "none" else f"Results among {crowd_words(crowd)}"
        )
        tables = (_table(tab) for tab in crowd_tabs(summary, k, crowd))
        out.append(html.section(f"results-{k + 1}", title, *tables))
    return out


def _table(tab: Tab) -> Markup:
    """A table; a long one is closed."""
    drawn = html.table(tab)
    return html.fold(f"{tab.title} ({len(tab.rows)} rows)", drawn) if len(tab.rows) > LONG else drawn


def _figures(anchor: str, title: str, some: Sequence[Markup]) -> Markup:
    if not some:
        return Markup("")
    return html.section(anchor, title, *some)


def _quality(summary: Summary, runs: Runs) -> list[Markup]:
    if len(summary.entrants) > figures.MAX_ROWS:
        return [html.paragraph(f"No figures: {len(summary.entrants)} names would not be legible in them.")]
    pairs = [*figures.profiles(summary), *figures.trade(summary, runs)]
    out = [*figures.success(summary), *figures.by_density(summary, runs), *figures.honest(summary)]
    return [*out, html.tag("div", *pairs, class_="pair")] if pairs else out


def _differences(summary: Summary) -> Markup:
    tables = [_table(tab) for tab in pair_tabs(summary)]
    drawn = figures.differences(summary) if len(summary.entrants) <= figures.MAX_ROWS else []
    if not tables and not drawn:
        return Markup("")
    title = f"Differences from {summary.reference}"
    return html.section("differences", title, *tables, html.tag("div", *drawn, class_="pair"))


def _ranks(summary: Summary) -> Markup:
    tables = [_table(tab) for tab in order_tabs(summary)]
    if not tables:
        return Markup("")
    drawn = figures.ranks(summary) if len(summary.entrants) <= figures.MAX_ROWS else []
    return html.section("ranks", "Ranks", *tables, html.tag("div", *drawn, class_="pair"))


def _form(summary: Summary, runs: Runs, timing: bool) -> list[Markup]:
    charts = figures.dissertation_form(summary, runs, timing)
    if not charts:
        return []
    words = (
        "Bars of single runs on one map, the form of Figures 4.5 to 4.7. One map and a handful of runs say "
        "little: the figures above hold all runs, with intervals, and the same measure for everybody."
    )
    return [html.paragraph(words), html.tag("div", *charts, class_="pair")]


def _maps(summary: Summary) -> Markup:
    tabs = map_tabs(summary)
    if not tabs:
        return Markup("")
    folded = (html.fold(f"{tab.title} ({len(tab.rows)} rows)", html.table(tab)) for tab in tabs)
    return html.section("maps", "Map by map", *folded)


def _failures(summary: Summary) -> Markup:
    """How every run ended, where not all are the same."""
    words = list(dict.fromkeys(w for e in summary.entries for w in e.outcomes))
    if len(words) < 2:
        return Markup("")
    rows: list[tuple[Value, ...]] = [
        (e.entrant, crowd_words(e.crowd), *(e.outcomes.get(w, 0) for w in words)) for e in summary.entries
    ]
    note = "Words in capitals are codes of errors: refused by the planner, out of time, or a fault."
    tab = Tab("outcomes", "How the runs ended", ("", "traffic", *words), tuple(rows), note)
    return html.section("outcomes", "Endings", _table(tab))


def _counted(summary: Summary) -> Markup:
    """What the intervals are of, and what they do not say."""
    unit = "The unit is the query: its seeds are averaged first, and intervals and tests are over queries. "
    reach = (
        "An interval over queries speaks of queries like these on "
        f"{'these maps' if summary.maps > 1 else 'this map'} only: of other maps it says nothing."
    )
    if summary.unit == "seed":
        unit = "There is one query, so the unit is the seed. "
        reach = "An interval over seeds speaks of this query only: of other queries and maps it says nothing."
    return html.section("counted", "How it is counted", html.paragraph(unit + reach))


def _glossary(runs: Runs, timing: bool) -> Markup:
    some = [(m.title, m.about) for m in ALL.values() if runs.has(m.name) and (timing or m not in TIMING)]
    return html.section("glossary", "What the columns are", html.facts(some))


def _again(study: Study) -> Markup:
    words = (
        "The store holds the whole study, its maps too. A planner, law, map, seed or version that differs is "
        "another study, and a store refuses it."
    )
    lines = (
        "lampyris study STUDY.yaml --store STORE    # run, or go on after it was stopped\n"
        "lampyris study report STORE PAGE.html       # this page"
    )
    return html.section(
        "again", "Run it again", html.paragraph(words), html.tag("pre", html.tag("code", lines))
    )
