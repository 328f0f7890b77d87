"""What a check is: kinds of cases, each so many at each size, cut into parts that can be run anywhere.

A case is known by its check, its kind, its number and the seed: any part can be run alone, in any order, on
any number of workers, and gives the same bytes.
"""

from __future__ import annotations

import zlib
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

SIZES = ("commit", "nightly", "release")
KEPT_FAILURES = 20
"""Failures told whole of one part; the rest are counted."""
LEAST_CASES = 200
"""Cases of a kind from which on its :attr:`Kind.least` is judged: of fewer a share says little."""


@dataclass(frozen=True)
class Kind:
    """Cases of one kind.

    Parameters
    ----------
    what : one line on what a case is and what must hold.
    commit, nightly, release : how many cases each size has.
    chunk : how many one part has: some seconds' work.
    whole : how many there are, where the kind is exhaustive; None where cases are drawn and never run out.
    least : smallest share of the cases, 0 to 1, that must have been counted under a name of
        :attr:`Outcome.counts` (``read``, ``judged``), so that a draw whose cases no longer reach what they
        are to try does not pass for a proof. Judged over :data:`LEAST_CASES` cases and more.
    """

    what: str
    commit: int
    nightly: int
    release: int
    chunk: int
    whole: int | None = None
    least: Mapping[str, float] = field(default_factory=dict)

    def cases(self, size: str) -> int:
        """How many cases the size has."""
        return {"commit": self.commit, "nightly": self.nightly, "release": self.release}[size]

    def lacks(self, seen: Outcome) -> tuple[str, ...]:
        """What was counted in fewer of the kind's cases than :attr:`least` asks, a sentence each."""
        if seen.cases < LEAST_CASES:
            return ()
        return tuple(
            f"{name} in {seen.counts.get(name, 0):,} of {seen.cases:,} cases; "
            f"it must be in {share:.4g} of them"
            for name, share in self.least.items()
            if seen.counts.get(name, 0) < share * seen.cases
        )


@dataclass(frozen=True)
class Part:
    """The cases ``first`` to ``first + cases - 1`` of a kind."""

    kind: str
    first: int
    cases: int

    @property
    def numbers(self) -> range:
        """The cases' numbers."""
        return range(self.first, self.first + self.cases)


@dataclass(frozen=True)
class Ask:
    """What a run was asked for.

    Parameters
    ----------
    seed : root of every draw.
    size : one of :data:`SIZES`; a check may want to know, but a case is the same at every size.
    folder : input data, where a check reads some.
    workers : processes the run has; for checks that start processes of their own.
    """

    seed: int = 1
    size: str = "commit"
    folder: Path | None = None
    workers: int = 1

    def rng(self, check: str, kind: str, number: int) -> np.random.Generator:
        """The generator of one case: PCG64 from the seed, the check, the kind and the number alone."""
        words = [self.seed, zlib.crc32(check.encode()), zlib.crc32(kind.encode()), number]
        return np.random.Generator(np.random.PCG64(np.random.SeedSequence(words)))


@dataclass(frozen=True)
class Failure:
    """A case in which what is promised does not hold.

    Parameters
    ----------
    kind, number : the case.
    what : what was expected and what came, in a line or some.
    data : the case whole, in words of JSON, to become a regression test.
    cases : how many cases, from ``number`` on, have to be run to see it again.
    """

    kind: str
    number: int
    what: str
    data: Mapping[str, Any] = field(default_factory=dict)
    cases: int = 1


@dataclass(frozen=True)
class Outcome:
    """What came of some cases.

    Parameters
    ----------
    cases : how many were tried.
    failed : how many of them failed.
    failures : those told whole, at most :data:`KEPT_FAILURES` of a part.
    counts : how many cases had which property (``no-path``, ``accepted``): that the cases were not all alike.
    spreads : measured figures by name, such as milliseconds past a limit; their spread is printed.
    unfinished : parts in which the check itself raised, or did not try what it was asked.
    """

    cases: int = 0
    failed: int = 0
    failures: tuple[Failure, ...] = ()
    counts: Mapping[str, int] = field(default_factory=dict)
    spreads: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    unfinished: int = 0

    def __add__(self, other: Outcome) -> Outcome:
        spreads = {
            name: (*self.spreads.get(name, ()), *other.spreads.get(name, ()))
            for name in sorted({*self.spreads, *other.spreads})
        }
        return Outcome(
            self.cases + other.cases,
            self.failed + other.failed,
            self.failures + other.failures,
            dict(sorted((Counter(self.counts) + Counter(other.counts)).items())),
            spreads,
            self.unfinished + other.unfinished,
        )


class Tally:
    """Counts while a part runs."""

    def __init__(self, part: Part) -> None:
        self._part = part
        self._cases = 0
        self._failed: set[int] = set()
        self._failures: list[Failure] = []
        self._counts: Counter[str] = Counter()
        self._spreads: dict[str, list[float]] = {}

    def case(self, *properties: str) -> None:
        """One more case was tried, with these properties."""
        self._cases += 1
        self._counts.update(properties)

    def count(self, name: str, times: int = 1) -> None:
        """Something that was seen in passing."""
        self._counts[name] += times

    def fail(self, number: int, what: str, **data: Any) -> None:
        """Case ``number`` failed; the second failure of a case counts no more."""
        if number in self._failed:
            return
        self._failed.add(number)
        if len(self._failures) < KEPT_FAILURES:
            self._failures.append(Failure(self._part.kind, number, what, data))

    def measure(self, name: str, value: float) -> None:
        """A figure whose spread is to be told."""
        self._spreads.setdefault(name, []).append(float(value))

    def outcome(self) -> Outcome:
        """All of it."""
        spreads = {name: tuple(values) for name, values in sorted(self._spreads.items())}
        counts = dict(sorted(self._counts.items()))
        return Outcome(self._cases, len(self._failed), tuple(self._failures), counts, spreads)


@dataclass(frozen=True)
class Check:
    """One promise, or several that one kind of question proves.

    Parameters
    ----------
    name : what the command calls it.
    goals : the goals of docs/promises.md it serves: ``G1``.
    title : what is promised, in a line.
    kinds : the kinds of cases by name, or a function of what was asked, where they depend on data.
    run : does one part. It is called in any process: it must be a function of a module.
    alone : one part at a time, in this process: the check measures time or starts processes of its own.
    folder : reads the folder of ``--folder``.
    inputs : a word for all that verdicts hang on beside the package, the seed and the size, such as a hash of
        files; where there is another word, what was done counts no more. It may refuse what was asked.
    """

    name: str
    goals: tuple[str, ...]
    title: str
    kinds: Mapping[str, Kind] | Callable[[Ask], Mapping[str, Kind]]
    run: Callable[[Ask, Part], Outcome]
    alone: bool = False
    folder: bool = False
    inputs: Callable[[Ask], str] | None = None

    def kinds_for(self, ask: Ask) -> Mapping[str, Kind]:
        """The kinds there are for what was asked."""
        return self.kinds(ask) if callable(self.kinds) else self.kinds


def each(part: Part, judge: Callable[[int, Tally], None]) -> Outcome:
    """Judge each case of a part; an exception is a failure of its case."""
    tally = Tally(part)
    for number in part.numbers:
        tally.case()
        try:
            judge(number, tally)
        except Exception as error:
            tally.fail(number, f"{type(error).__name__}: {error}")
    return tally.outcome()


def gather(outcomes: Iterable[Outcome]) -> Outcome:
    """All of them as one, in order."""
    total = Outcome()
    for outcome in outcomes:
        total += outcome
    return total
