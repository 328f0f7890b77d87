"""A study as text and as JSON: what it is, counts while it runs, and its results."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.table import Table
from rich.text import Text

from lampyris.cli import text
from lampyris.cli.progress import ProgressDisplay
from lampyris.cli.tables import print_tab
from lampyris.cli.text import plural
from lampyris.report.html.table import DASH, Tab, Value
from lampyris.study.analysis.findings import Summary
from lampyris.study.analysis.measures import solved_name
from lampyris.study.design.row import Row
from lampyris.study.design.study import Study
from lampyris.study.design.traffic_labels import place_words, traffic_words
from lampyris.study.execution.execution import Progress

ENDINGS = ("done", "refused", "timeout", "failed")
MANY = 200_000
"""Runs of a study that is too large for a live table: the table from run to planner would fill the memory."""
SHORT = {
    "plan": ("found", "cost", "gap", "length_any_angle", "time_s", "expansions"),
    "simulate": ("arrived", "collisions", "cost", "ticks", "expansions"),
    "drive": ("arrived", "collisions", "near_m", "length_m", "time_s"),
    "fleet": ("found", "ratio", "makespan", "expansions"),
}
"""What the terminal shows of a study of each kind; the page has all of it."""


POSES = ("found", "length_m", "bound", "reversals", "time_s", "expansions")
"""The same of plans of poses."""


def sizes(study: Study) -> str:
    """``30 queries on 6 maps x 3 traffic cases x 10 seeds x 3 planners x 1 law = 2,700 runs (simulate)``."""
    if study.kind == "fleet":
        of_fleets = (
            f"{plural(len(study.worlds), 'fleet')} on {plural(len(study.grounds), 'map')}",
            "1 number of robots"
            if len(study.traffic_cases) == 1
            else f"{len(study.traffic_cases):,} numbers of robots",
            plural(len(study.seeds), "seed"),
            plural(len(study.planners), "planner"),
        )
        return f"{' x '.join(of_fleets)} = {plural(len(study), 'run')} (fleet)"
    parts = (
        f"{plural(len(study.worlds), 'query')} on {plural(len(study.grounds), 'map')}",
        plural(len(study.traffic_cases), "traffic case"),
        plural(len(study.seeds), "seed"),
        plural(len(study.planners), "planner"),
        plural(len(study.laws), "law"),
    )
    return f"{' x '.join(parts)} = {plural(len(study), 'run')} ({study.kind})"


def facts(study: Study) -> list[tuple[str, str]]:
    """What a study is."""
    fleets = study.kind == "fleet"
    work = "iterations a run" if fleets else "expansions a call"
    budget = [f"{study.expansions:,} {work}"] if study.expansions is not None else []
    budget += [f"{study.seconds:g} s a run (results depend on the machine)"] if study.seconds else []
    rows = [
        ("study", study.name),
        ("asks", study.about),
        ("runs", sizes(study)),
        ("maps", ", ".join(ground.name for ground in study.grounds.values())),
        ("planners", ", ".join(who.called for who in study.planners)),
        ("laws", "" if fleets else ", ".join(who.called for who in study.laws)),
        (
            "robots" if fleets else "traffic",
            ", ".join(f"{one.count:,}" for one in study.traffic_cases)
            if fleets
            else "; ".join(traffic_words(traffic.label) for traffic in study.traffic_cases),
        ),
        ("budget", ", ".join(budget) or "none"),
    ]
    return [(key, value) for key, value in rows if value]


def record(study: Study, path: Path) -> dict[str, Any]:
    """What a study is, for machines."""
    return {
        "study": study.name,
        "kind": study.kind,
        "store": str(path),
        "runs": len(study),
        "maps": len(study.grounds),
        "queries": len(study.worlds),
        "traffic_cases": [traffic.label for traffic in study.traffic_cases],
        "seeds": len(study.seeds),
        "planners": [who.called for who in study.planners],
        "laws": [who.called for who in study.laws],
        "budget": {"expansions": study.expansions, "seconds": study.seconds},
    }


def endings(words: Iterable[str]) -> dict[str, int]:
    """How many runs ended how; with every ending, also those that do not occur."""
    counts = Counter(words)
    return {word: counts[word] for word in ENDINGS}


def endings_text(counts: Mapping[str, int]) -> str:
    """``2,690 done, 10 failed``: the endings that occur."""
    return ", ".join(f"{n:,} {word}" for word, n in counts.items() if n) or "none"


@dataclass
class _Count:
    """Of one planner and law."""

    runs: int = 0
    good: int = 0
    failed: int = 0
    gaps: int = 0
    gap: float = 0.0


@dataclass
class Tally:
    """Counts while a study runs, a row for each planner and law; failures stay in the denominators."""

    study: Study
    counts: dict[tuple[str, str], _Count] = field(default_factory=dict)

    def __post_init__(self) -> None:
        jobs = self.study.jobs() if len(self.study) <= MANY else ()
        self._entrant_of = {job.key: (job.labels["planner"], job.labels["law"]) for job in jobs}
        for planner in self.study.planners:
            for law in self.study.laws:
                self.counts[planner.called, law.called] = _Count()

    @property
    def good(self) -> str:
        """The metric that says a run was good."""
        return solved_name(self.study.kind)

    def add(self, rows: Iterable[Row]) -> None:
        """Count these."""
        for row in rows:
            entrant = self._entrant_of.get(row.key)
            if entrant is None:
                continue
            one = self.counts[entrant]
            one.runs += 1
            one.good += bool(row.metrics.get(self.good))
            one.failed += row.ending in ("failed", "timeout")
            gap = row.metrics.get("gap")
            ratio = row.metrics.get("ratio")
            gap = ratio - 1.0 if isinstance(ratio, int | float) else gap
            if isinstance(gap, int | float) and math.isfinite(gap):
                one.gaps += 1
                one.gap += gap

    def table(self) -> Table:
        """The table that is shown while the study runs."""
        laws = len(self.study.laws) > 1
        each = len(self.study) // max(1, len(self.counts))
        table = Table(box=SIMPLE_HEAD, pad_edge=False)
        for name in ("planner", "law", "runs", self.good, "mean gap", "failed"):
            if name != "law" or laws:
                table.add_column(name, justify="left" if name in ("planner", "law") else "right")
        for (planner, law), one in self.counts.items():
            share = f"{one.good / one.runs:.1%}" if one.runs else "-"
            gap = f"{one.gap / one.gaps:.2%}" if one.gaps else "-"
            cells = [Text(planner), *([Text(law)] if laws else [])]
            table.add_row(*cells, f"{one.runs:,} of {each:,}", share, gap, f"{one.failed:,}" or "-")
        return table


class StudyProgress(ProgressDisplay):
    """Progress of a study, with its live table under the bar."""

    def __init__(self, study: Study, tally: Tally, *, quiet: bool) -> None:
        super().__init__(quiet=quiet)
        self._study, self._tally = study, tally

    def show(self, progress: Progress) -> None:
        """Show the progress."""
        table = self._tally.table() if self._live is not None and len(self._study) <= MANY else None
        failed = f", {progress.failed:,} failed"
        self.update(self._study.name, progress.done, progress.total, failed, progress.seconds_left, table)


def print_summary(results: Summary) -> None:
    """Print the heart of a summary: a table for each kind of traffic, and notes."""
    from lampyris.study.analysis.measures import ALL
    from lampyris.study.analysis.summary_tables import ANY_ANGLE, estimate_text, sample, starts

    lines = False
    for traffic in results.traffic_cases:
        title = place_words(traffic)
        some = [entry for entry in results.entries if entry.traffic == traffic and entry.runs]
        if not some:
            text.line(f"{title}: nothing yet")
            continue
        short = POSES if results.of_poses else SHORT[results.kind]
        names = [n for n in short if any(n in e.own and e.own[n].units for e in some)]
        if not any(e.own["collisions"].value > 0 for e in some if "collisions" in e.own):
            names = [n for n in names if n != "collisions"]
        lines = lines or "length_any_angle" in names
        if "length_any_angle" in names:  # there is room for one of them; the page has both
            names = [n for n in names if n != "time_s"]
        header = ("", "runs", *(ALL[n].title for n in names))
        rows: list[tuple[Value, ...]] = []
        for e in some:
            texts = (estimate_text(e.own[n], ALL[n].scale, e.runs) if n in e.own else DASH for n in names)
            rows.append((e.entrant, e.runs, *texts))
        print_tab(Tab("short", title, header, tuple(rows), align="l" + "r" * (len(header) - 1)))
    foot = (
        f"{sample(results)} n: the runs behind a mean, where some have no value. {starts(results)}".rstrip()
    )
    text.line(f"{ANY_ANGLE} {foot}" if lines else foot, style="dim")
    for note in results.notes:
        text.line(note)


def print_ready(rows: Sequence[Mapping[str, str]]) -> None:
    """Print the ready studies."""
    cells = [(row["name"], row["about"]) for row in rows]
    text.table("ready studies", ("name", "what it asks"), cells, whole=("name",))
    text.line("lampyris study NAME runs one; lampyris study write NAME FILE makes a copy to be edited.")
