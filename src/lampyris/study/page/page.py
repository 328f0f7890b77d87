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
from lampyris.report.html.render import PageFigure, render
from lampyris.report.html.table import Tab, Value
from lampyris.study.analysis.findings import Summary
from lampyris.study.analysis.fleet_tables import improvement_tabs, number_tabs
from lampyris.study.analysis.measures import ALL, TIMING
from lampyris.study.analysis.runs import Runs, runs_of
from lampyris.study.analysis.summary import summarise
from lampyris.study.analysis.summary_tables import map_tabs, order_tabs, pair_tabs, traffic_tabs
from lampyris.study.analysis.table import ResultTable
from lampyris.study.design.serialize import study_plain
from lampyris.study.design.study import RESULTS, Config, Study, StudyMap, canonical, sensor_words
from lampyris.study.design.traffic_labels import place_words, traffic_words
from lampyris.study.page import figures
from lampyris.study.page.films import films as films_of
from lampyris.study.page.fleet_figures import improvement_figures, number_figures, time_figures
from lampyris.study.page.summary_text import found, many

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
    fleets = study.kind == "fleet"
    legible = len(summary.entrants) <= figures.MAX_ROWS
    grounds = list(study.grounds.values())
    pairs, orders = pair_tabs(summary), order_tabs(summary)
    paired = figures.differences(summary) if legible else []
    return render(
        "study/page/page.html.j2",
        title=study.name or "a study",
        study=study,
        key=key_of(study),
        found=found(summary, runs),
        asked=_asked(study),
        entrants=(
            _entrants("planners", "Planners and their settings", study.planners),
            *([] if fleets else [_entrants("laws", "Speed laws and their settings", study.laws)]),
        ),
        pictures=[_picture(study, ground) for ground in grounds[:MAPS]],
        more_maps=many(len(grounds) - MAPS, "other map") if len(grounds) > MAPS else "",
        results=_results(summary, runs),
        quality=_quality(summary, runs, timing) if legible else ((), ()),
        too_many=None if legible else len(summary.entrants),
        differences=(pairs, paired) if pairs or paired else None,
        reference=summary.reference,
        ranks=(orders, figures.ranks(summary) if legible else []) if orders else None,
        form=None if fleets else figures.dissertation_form(summary, runs, timing),
        fleets=fleets,
        films=films_of(summary, runs) if films else None,
        maps=map_tabs(summary),
        outcomes=_outcomes(summary),
        unit=summary.unit,
        several_maps=summary.maps > 1,
        glossary=[
            (m.title, m.about) for m in ALL.values() if runs.has(m.name) and (timing or m not in TIMING)
        ],
        foot=f"lampyris {__version__}, results {RESULTS}, study {key_of(study)[:16]}",
    )


def key_of(study: Study) -> str:
    """SHA-256 of all that decides a study's results and of its names, in hex."""
    return hashlib.sha256(canonical(study_plain(study))).hexdigest()


def _asked(study: Study) -> list[tuple[str, Any]]:
    kinds = {
        "plan": "plans with their speeds", "simulate": "simulations in ticks",
        "drive": "drives in continuous time", "fleet": "plans for many robots",
    }  # fmt: skip
    names = list(dict.fromkeys(w.ground.name for w in study.worlds))
    if study.kind == "fleet":
        return [
            ("runs", f"{len(study):,} {_fleet_kind(study)}"),
            ("fleets", f"{len(study.worlds):,} on {many(len(names), 'map')}"),
            ("robots", ", ".join(dict.fromkeys(f"{c.count:,}" for c in study.traffic_cases))),
            ("seeds", f"{', '.join(map(str, study.seeds[:12]))}{', ...' if len(study.seeds) > 12 else ''}"),
            ("root seed", study.root),
            ("moves", study.moves),
            ("budget", _budget(study)),
            ("radius", _radii(study)),
            (
                "delays",
                ", ".join(dict.fromkeys(f"{c.rate:g}" for c in study.traffic_cases if c.rate is not None)),
            ),
            *_driving(study),
            ("version", f"lampyris {__version__}, results {RESULTS}"),
        ]
    live = any(c.count and c.tracks == "live" for c in study.traffic_cases)
    tracks = (
        "live: the same draws for everyone, but obstacles yield to the robot, so tracks may part"
        if live
        else "replayed: the same for all planners, whatever the others do"
    )
    return [
        ("runs", f"{len(study):,} {kinds[study.kind]}"),
        ("queries", f"{len(study.worlds):,} on {many(len(names), 'map')}"),
        (
            "traffic",
            "; ".join("none" if c.label == "none" else traffic_words(c.label) for c in study.traffic_cases),
        ),
        ("tracks", tracks if any(c.count for c in study.traffic_cases) else ""),
        ("seeds", f"{', '.join(map(str, study.seeds[:12]))}{', ...' if len(study.seeds) > 12 else ''}"),
        ("root seed", study.root),
        ("moves", study.moves),
        ("budget", _budget(study)),
        ("sensors", _sensors(study)),
        ("robot", _settings(study.robot)),
        ("drive", _settings(study.drive)),
        ("version", f"lampyris {__version__}, results {RESULTS}"),
    ]


def _sensors(study: Study) -> str:
    """What robots know of the map; nothing where all know it."""
    if not study.senses:
        return ""
    some = (p.sensor for p in study.planners)
    return "; ".join(dict.fromkeys("none: the map is known" if s is None else sensor_words(s) for s in some))


def _fleet_kind(study: Study) -> str:
    if "execute" in study.drive:
        return "drives of many robots"
    return "lifelong fleets" if "lifelong" in study.drive else "plans for many robots"


def _driving(study: Study) -> list[tuple[str, str]]:
    """How robots drive, a row a table."""
    tables: dict[str, Any] = dict(study.drive)
    execute = tables.pop("execute", {})
    tables |= {"drive": execute["settings"], "delay": execute["delays"]} if execute else {}
    return [(name, _settings(table)) for name, table in tables.items()]


def _radii(study: Study) -> str:
    given = dict.fromkeys(c.radius or study.robot["radius"] for c in study.traffic_cases)
    return ", ".join(f"{radius:g} m" if radius else "each robot fits in its cell" for radius in given)


def _budget(study: Study) -> str:
    parts = []
    if study.expansions is not None:
        what = "iterations a run" if study.kind == "fleet" else "expansions a call"
        parts.append(f"{study.expansions:,} {what}")
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


def _entrants(name: str, title: str, some: Sequence[Config]) -> Tab:
    rows = ((c.called, c.name, _settings(c.settings) or "none", c.origin or "lampyris") for c in some)
    return Tab(name, title, ("called", "name", "settings", "from"), tuple(rows), align="llll")


def _picture(study: Study, ground: StudyMap) -> tuple[bytes, str, str]:
    """A map as a small picture, what it shows, and its caption."""
    grid = ground.grid
    n = sum(w.ground.hash == ground.hash for w in study.worlds)
    what = many(n, "fleet") if study.kind == "fleet" else many(n, "query", "queries")
    words = f"{ground.name}, {grid.width} x {grid.height}, {what}"
    return thumbnail(grid, None, None), f"the map {ground.name}", words


def _among(traffic: str) -> str:
    return f"Results {place_words(traffic)}"


def _results(summary: Summary, runs: Runs) -> list[tuple[str, Sequence[Tab]]]:
    """Headings with their tables."""
    if summary.kind == "fleet":
        return [("Results by number of robots", (*number_tabs(summary), *improvement_tabs(summary, runs)))]
    return [
        (_among(traffic), traffic_tabs(summary, k, traffic))
        for k, traffic in enumerate(summary.traffic_cases)
    ]


def _quality(summary: Summary, runs: Runs, timing: bool) -> tuple[list[PageFigure], list[PageFigure]] | None:
    """Figures one below the other, and figures in pairs."""
    if summary.kind == "fleet":
        found = [*number_figures(summary, runs.study.traffic_cases), *improvement_figures(summary, runs)]
        found += time_figures(summary, runs) if timing else []
        return ([], [*found, *figures.profiles(summary)]) if found else None
    single = [*figures.success(summary), *figures.by_density(summary, runs), *figures.honest(summary)]
    pairs = [*figures.profiles(summary), *figures.trade(summary, runs)]
    return (single, pairs) if single or pairs else None


def _outcomes(summary: Summary) -> Tab | None:
    """How every run ended, where not all are the same."""
    words = list(dict.fromkeys(w for e in summary.entries for w in e.outcomes))
    if len(words) < 2:
        return None
    rows: list[tuple[Value, ...]] = [
        (e.entrant, traffic_words(e.traffic), *(e.outcomes.get(w, 0) for w in words)) for e in summary.entries
    ]
    what = "robots" if summary.kind == "fleet" else "traffic"
    note = "Words in capitals are codes of errors: refused by the planner, out of time, or a fault."
    return Tab("outcomes", "How the runs ended", ("", what, *words), tuple(rows), note)
