"""The nouns of a benchmark: a spread of timings, a figure (ours compared with a rival's), a verdict, a section.

A bench module has ``TITLE`` and ``bench(quick) -> Section``; :mod:`benchmarks` runs it and writes the page.
"""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, fields
from typing import Any


@dataclass(frozen=True, slots=True)
class Spread:
    """Repeated measurements of one thing: their middle, quartiles and number."""

    middle: float
    low: float
    high: float
    n: int

    @classmethod
    def of(cls, values: Sequence[float]) -> Spread:
        """The spread of one measurement or more."""
        if len(values) == 1:
            return cls(values[0], values[0], values[0], 1)
        low, middle, high = statistics.quantiles(values, n=4, method="inclusive")
        return cls(middle, low, high, len(values))

    def rate(self, scale: float) -> Spread:
        """Times turned into rates: ``scale`` divided by each."""
        return Spread(scale / self.middle, scale / self.high, scale / self.low, self.n)


@dataclass(frozen=True, slots=True)
class Figure:
    """One comparison, or one measurement alone.

    Parameters
    ----------
    task : what was done on what; the same words in every run, for :mod:`benchmarks.compare` looks it up.
    unit : of both spreads: ``ns a cell``, ``ms``, ``runs a second``, ``bytes a cell``.
    ours : what lampyris takes.
    rival, theirs : whom it is held against and what they take; None for a measurement alone.
    more_is_better : of the unit; so is ``runs a second``.
    asked : the least ratio that is claimed, or None.
    note : for the reader: other rules, a shortcut, what is not counted.
    """

    task: str
    unit: str
    ours: Spread
    rival: str | None = None
    theirs: Spread | None = None
    more_is_better: bool = False
    asked: float | None = None
    note: str = ""

    @property
    def key(self) -> str:
        """The figure's name in its section."""
        return self.task if self.rival is None else f"{self.task} | {self.rival}"

    @property
    def ratio(self) -> float | None:
        """How many times as good as the rival, middle against middle."""
        if self.theirs is None:
            return None
        a, b = (self.ours, self.theirs) if self.more_is_better else (self.theirs, self.ours)
        return a.middle / b.middle

    @property
    def holds(self) -> bool | None:
        """Whether the ratio is what was asked; None where nothing was."""
        return None if self.asked is None or self.ratio is None else self.ratio >= self.asked


@dataclass(frozen=True, slots=True)
class Verdict:
    """One claim judged, in a sentence with its numbers."""

    holds: bool
    text: str


@dataclass(frozen=True, slots=True)
class Table:
    """Rows as they stand on the page; every cell is ready text."""

    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    title: str = ""

    def __post_init__(self) -> None:
        for row in self.rows:
            assert len(row) == len(self.heads), f"{len(row)} cells under {len(self.heads)} heads: {row}"


@dataclass(frozen=True, slots=True)
class Section:
    """What one bench module found.

    Parameters
    ----------
    name, title : ``field``; a heading.
    how : what is timed, in a paragraph or list for the page; rules of rivals that differ from ours.
    tables : for the reader.
    figures : for machines: what claims are judged by, and what later records are compared with.
    verdicts : claims judged.
    """

    name: str
    title: str
    how: str
    tables: tuple[Table, ...] = ()
    figures: tuple[Figure, ...] = ()
    verdicts: tuple[Verdict, ...] = ()
    about: dict[str, str] = field(default_factory=dict)

    def record(self) -> dict[str, Any]:
        """Everything as plain data; figures with their ratio and key."""
        plain = asdict(self)
        plain["figures"] = [{"key": f.key, "ratio": f.ratio, **asdict(f)} for f in self.figures]
        return plain


def judge(what: str, figures: Sequence[Figure]) -> Verdict:
    """One verdict over figures that ask for the same ratio; each that falls short is named."""
    least = figures[0].asked
    assert least is not None
    ratios = {f.task: f.ratio for f in figures if f.ratio is not None}
    low, high = min(ratios.values()), max(ratios.values())
    short = [f"{task} ({ratio:.2f})" for task, ratio in ratios.items() if ratio < least]
    text = f"{what}: at least {least:g} times as good: {low:.3g}"
    text += f" to {high:.3g}, in {len(ratios) - len(short)} of {len(ratios)}" if len(ratios) > 1 else ""
    return Verdict(
        not short, text + (f"; short of it: {', '.join(short)}" if short and len(ratios) > 1 else "")
    )


def judge_cost(what: str, figures: Sequence[Figure]) -> Verdict:
    """The same where what is allowed is to take so many times as long: ``asked`` is 1 over that."""
    least = figures[0].asked
    assert least is not None
    shares = {f.task: 1 / f.ratio for f in figures if f.ratio is not None}
    over = [f"{task} ({share:.2f})" for task, share in shares.items() if share > 1 / least]
    text = (
        f"{what}: at most {1 / least:.3g} times: {min(shares.values()):.2f} to {max(shares.values()):.2f}, "
    )
    text += f"in {len(shares) - len(over)} of {len(shares)}"
    return Verdict(not over, text + (f"; more: {', '.join(over)}" if over else ""))


def figures_of(record: dict[str, Any]) -> list[Figure]:
    """The figures of a section's record, of an older or a newer version too."""
    known = {part.name for part in fields(Figure)}
    out = []
    for row in record["figures"]:
        given = {k: v for k, v in row.items() if k in known}
        for side in ("ours", "theirs"):
            if given.get(side) is not None:
                given[side] = Spread(**given[side])
        out.append(Figure(**given))
    return out
