"""What ``lampyris study`` shows of a study: before, while it runs, and after."""

from __future__ import annotations

import math
import sys
import time
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from types import TracebackType
from typing import Self

from rich.box import SIMPLE_HEAD
from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from lampyris.cli import text
from lampyris.report.html.table import DASH, Tab, Value
from lampyris.study.analysis.findings import Summary
from lampyris.study.design.row import Row
from lampyris.study.design.study import Study
from lampyris.study.execution.execution import Progress

ENDINGS = ("done", "refused", "timeout", "failed")
QUIET_S = 30.0
"""Where nobody looks on, a line comes with every tenth of the runs, or after so many seconds."""
MANY = 200_000
"""Runs of a study that is too large for a live table: whose run is whose would fill the memory."""


def plural(n: int, word: str) -> str:
    """``1 run``, ``2 runs``, ``3 queries``."""
    many = f"{word[:-1]}ies" if word.endswith("y") else f"{word}s"
    return f"{n:,} {word if n == 1 else many}"


def sizes(study: Study) -> str:
    """``30 queries on 6 maps x 3 crowds x 10 seeds x 3 planners x 1 law = 2,700 runs (simulate)``."""
    parts = (
        f"{plural(len(study.worlds), 'query')} on {plural(len(study.grounds), 'map')}",
        plural(len(study.crowds), "crowd"),
        plural(len(study.seeds), "seed"),
        plural(len(study.planners), "planner"),
        plural(len(study.laws), "law"),
    )
    return f"{' x '.join(parts)} = {plural(len(study), 'run')} ({study.kind})"


def endings(words: Iterable[str]) -> dict[str, int]:
    """How many runs ended how; every ending there is, also those of nobody."""
    counts = Counter(words)
    return {word: counts[word] for word in ENDINGS}


def told(counts: Mapping[str, int]) -> str:
    """``2,690 done, 10 failed``: the endings that occur."""
    return ", ".join(f"{n:,} {word}" for word, n in counts.items() if n) or "none"


def clock(seconds: float | None) -> str:
    """``1:02:03``, ``2:03``; ``-:--`` where it is not known."""
    if seconds is None or not math.isfinite(seconds):
        return "-:--"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"


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
        self._whose = {job.key: (job.labels["planner"], job.labels["law"]) for job in jobs}
        for planner in self.study.planners:
            for law in self.study.laws:
                self.counts[planner.called, law.called] = _Count()

    @property
    def good(self) -> str:
        """The metric that says a run was good."""
        return "found" if self.study.kind == "plan" else "arrived"

    def add(self, rows: Iterable[Row]) -> None:
        """Count these."""
        for row in rows:
            whose = self._whose.get(row.key)
            if whose is None:
                continue
            one = self.counts[whose]
            one.runs += 1
            one.good += bool(row.metrics.get(self.good))
            one.failed += row.ending in ("failed", "timeout")
            gap = row.metrics.get("gap")
            if isinstance(gap, int | float) and math.isfinite(gap):
                one.gaps += 1
                one.gap += gap

    def table(self) -> Table:
        """As people watch it."""
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


class Watch:
    """What a person sees while runs are made, on stderr: at a terminal a bar, else a line now and then.

    Parameters
    ----------
    quiet : no lines where there is no terminal.
    """

    def __init__(self, *, quiet: bool) -> None:
        self._quiet = quiet
        self._tenth, self._spoke = -1, time.monotonic()
        self._live: Live | None = None
        if sys.stderr.isatty():
            self._live = Live(console=Console(stderr=True), refresh_per_second=4, transient=True)

    def __enter__(self) -> Self:
        if self._live is not None:
            self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._live is not None:
            self._live.stop()

    def say(
        self, name: str, done: int, total: int, more: str, left: float | None, table: Table | None = None
    ) -> None:
        """How far it is; ``table`` stands under the bar."""
        words = f"{done:,} of {total:,} runs{more}"
        if self._live is not None:
            bar = ProgressBar(total=max(1, total), completed=done, width=40)
            line = Table.grid(padding=(0, 2))
            line.add_row(Text(name), bar, Text(words), Text(f"{clock(left)} left"))
            self._live.update(line if table is None else Group(line, table))
            return
        tenth, now = 10 * done // max(1, total), time.monotonic()
        if self._tenth < 0:
            self._tenth = tenth  # what was there before is said already
        late = now - self._spoke >= QUIET_S
        if not self._quiet and (tenth > self._tenth or late):
            about = "" if left is None or done >= total else f", about {clock(left)} left"
            print(f"{words}{about}", file=sys.stderr, flush=True)
            self._spoke = now
        self._tenth = max(self._tenth, tenth)


class Board(Watch):
    """The same of a study, with its live table under the bar."""

    def __init__(self, study: Study, tally: Tally, *, quiet: bool) -> None:
        super().__init__(quiet=quiet)
        self._study, self._tally = study, tally

    def show(self, progress: Progress) -> None:
        """How far it is."""
        table = self._tally.table() if self._live is not None and len(self._study) <= MANY else None
        failed = f", {progress.failed:,} failed"
        self.say(self._study.name, progress.done, progress.total, failed, progress.seconds_left, table)


def fits(one: Tab) -> bool:
    """Whether a table's lines are short enough for where they go."""
    rows = (one.header, *one.texts())
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    room = text.width()
    return room is None or sum(widths) + 3 * (len(widths) - 1) + 2 <= room


def tab(one: Tab) -> None:
    """A table for people."""
    text.line(one.title, style="bold")
    right = [name for name, side in zip(one.header, one.align, strict=True) if side != "l"]
    text.table("", one.header, one.texts(), right=right, whole=one.header[:1])
    if one.note:
        text.line(one.note, style="dim")


SHORT = {
    "plan": ("found", "cost", "gap", "length_any_angle", "time_s", "expansions"),
    "simulate": ("arrived", "collisions", "cost", "ticks", "expansions"),
    "drive": ("arrived", "collisions", "near_m", "length_m", "time_s"),
}
"""What the terminal shows of a study of each kind; the page has all of it."""


def summary(told: Summary) -> None:
    """The heart of a summary: a table for each crowd, and what was not done as asked."""
    from lampyris.study.analysis.measures import ALL
    from lampyris.study.analysis.summary_tables import ANY_ANGLE, estimate_text, sample, starts
    from lampyris.study.design.traffic_labels import crowd_words

    lines = False
    for crowd in told.crowds:
        title = "without moving obstacles" if crowd == "none" else f"among {crowd_words(crowd)}"
        some = [entry for entry in told.entries if entry.crowd == crowd and entry.runs]
        if not some:
            text.line(f"{title}: nothing yet")
            continue
        names = [n for n in SHORT[told.kind] if any(n in e.own and e.own[n].units for e in some)]
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
        tab(Tab("short", title, header, tuple(rows), align="l" + "r" * (len(header) - 1)))
    foot = f"{sample(told)} n: the runs behind a mean, where some have no value. {starts(told)}".rstrip()
    text.line(f"{ANY_ANGLE} {foot}" if lines else foot, style="dim")
    for note in told.notes:
        text.line(note)


def ready(rows: Sequence[Mapping[str, str]]) -> None:
    """The ready studies."""
    cells = [(row["name"], row["about"]) for row in rows]
    text.table("ready studies", ("name", "what it asks"), cells, whole=("name",))
    text.line("lampyris study NAME runs one; lampyris study write NAME FILE makes a copy to be edited.")
