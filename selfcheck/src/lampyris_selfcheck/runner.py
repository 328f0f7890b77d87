"""Run the parts of a check on some workers; the result is the same whatever their number."""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

from lampyris._core.cancellation import Cancelled
from lampyris.errors import UsageError, did_you_mean
from lampyris_selfcheck import registry
from lampyris_selfcheck.check import Ask, Check, Failure, Kind, Outcome, Part, gather
from lampyris_selfcheck.ledger import Ledger, key

LAST_LINES = 3
"""Of a traceback, told where a check raised."""
Told = Callable[[int, int, Outcome], None]
"""Cases done, cases in all, what came of them so far."""


@dataclass(frozen=True)
class Range:
    """Which cases of a check: all that its size has, unless told otherwise.

    Parameters
    ----------
    only : one kind; None for all.
    first : number of the first case of each kind.
    cases : how many of each kind; None for as many as the size has.
    """

    only: str | None = None
    first: int = 0
    cases: int | None = None


@dataclass(frozen=True)
class RunPlan:
    """What a run will ask.

    Parameters
    ----------
    kinds : the kinds of cases.
    ranges : first case and number of cases of each.
    inputs : the word of :attr:`Check.inputs`; empty without one.
    """

    kinds: Mapping[str, Kind]
    ranges: dict[str, tuple[int, int]]
    inputs: str = ""


@dataclass(frozen=True)
class OfKind:
    """What came of a kind of cases, and the seconds of work that they took."""

    outcome: Outcome
    seconds: float


@dataclass(frozen=True)
class Result:
    """What came of a check.

    Parameters
    ----------
    check : the check.
    ask : what it was asked.
    planned : which cases.
    of_kind : what was seen, kind by kind.
    wall : seconds that this run took.
    """

    check: Check
    ask: Ask
    planned: RunPlan
    of_kind: Mapping[str, OfKind]
    wall: float

    @property
    def outcome(self) -> Outcome:
        """All that was seen."""
        return gather(seen.outcome for seen in self.of_kind.values())

    @property
    def seconds(self) -> float:
        """Of work, on all workers together, in this run and those before it that the ledger holds."""
        return sum(seen.seconds for seen in self.of_kind.values())

    @property
    def lacks(self) -> tuple[str, ...]:
        """What too few cases reached (:attr:`~lampyris_selfcheck.check.Kind.least`), a sentence each."""
        return tuple(
            f"{name}: {what}"
            for name, seen in self.of_kind.items()
            for what in self.planned.kinds[name].lacks(seen.outcome)
        )

    @property
    def holds(self) -> bool:
        """Whether there were cases, of which none failed and enough reached what they were to try."""
        return self.outcome.cases > 0 and not self.outcome.failed and not self.lacks

    @property
    def bound(self) -> float | None:
        """With 95 % confidence no more than this share of such cases fails: 3 / n, where none of n did.

        Of drawn cases alone: those of an exhaustive kind are no sample, and all of them leave nothing open.
        """
        kinds = self.planned.kinds
        drawn = sum(seen.outcome.cases for name, seen in self.of_kind.items() if kinds[name].whole is None)
        return min(1.0, 3 / drawn) if self.holds and drawn else None


def run(
    check: Check,
    ask: Ask,
    which: Range = Range(),
    ledger: Ledger | None = None,
    tell: Told | None = None,
) -> Result:
    """Run a check.

    Parameters
    ----------
    check, ask : what, and how.
    which : a part of its cases; all by default.
    ledger : parts done earlier are taken from it, parts done now are put into it.
    tell : called after each part.

    Raises
    ------
    UsageError : as :func:`planned`. What a check itself raises is a failure of the part.
    """
    began = time.perf_counter()
    ledger = ledger or Ledger(None)
    plan = planned(check, ask, which)
    parts = [
        part
        for name, (first, cases) in plan.ranges.items()
        for part in _parts(plan.kinds[name].chunk, name, first, cases)
    ]
    keys = {part: key(check, ask, part, plan.inputs) for part in parts}
    known = {part: seen for part in parts if (seen := ledger.done(keys[part])) is not None}
    total = sum(part.cases for part in parts)
    done = sum(part.cases for part in known)
    so_far = gather(outcome for outcome, _ in known.values())
    if tell:
        tell(done, total, so_far)
    for part, outcome, seconds, whole in _run(check, ask, [part for part in parts if part not in known]):
        known[part] = (outcome, seconds)
        if whole:
            ledger.add(keys[part], outcome, seconds)
        so_far += Outcome(outcome.cases, outcome.failed, outcome.failures)
        done += part.cases
        if tell:
            tell(done, total, so_far)
    of_kind = {}
    for name in plan.ranges:
        mine = [known[part] for part in parts if part.kind == name]
        of_kind[name] = OfKind(gather(outcome for outcome, _ in mine), sum(seconds for _, seconds in mine))
    return Result(check, ask, plan, of_kind, time.perf_counter() - began)


def planned(check: Check, ask: Ask, which: Range = Range()) -> RunPlan:
    """What a run would ask, found out without asking it.

    Raises
    ------
    UsageError : no such kind; a range beyond the end of every kind; what the check itself refuses, such as a
        folder without its files.
    """
    kinds = _asked(check, ask, which)
    ranges = {name: _range(kind, ask, which) for name, kind in kinds.items()}
    if which.first and not any(cases for _, cases in ranges.values()):
        there = ", ".join(f"{name} {_there(kind, ask):,} cases" for name, kind in kinds.items())
        raise UsageError("RANGE", f"{check.name} has no case {which.first:,}", allowed=there)
    return RunPlan(kinds, ranges, check.inputs(ask) if check.inputs else "")


def _asked(check: Check, ask: Ask, which: Range) -> dict[str, Kind]:
    kinds = dict(check.kinds_for(ask))
    if which.only is None:
        return kinds
    if which.only not in kinds:
        raise UsageError(
            "KIND",
            f"{check.name} has no kind {which.only!r}",
            allowed=", ".join(kinds),
            todo=did_you_mean(which.only, kinds),
        )
    return {which.only: kinds[which.only]}


def _there(kind: Kind, ask: Ask) -> int:
    return kind.cases(ask.size) if kind.whole is None else kind.whole


def _range(kind: Kind, ask: Ask, which: Range) -> tuple[int, int]:
    """First case and number of cases; an exhaustive kind ends where it ends."""
    cases = kind.cases(ask.size) if which.cases is None else which.cases
    if kind.whole is None:
        return which.first, cases
    return which.first, max(0, min(cases, kind.whole - which.first))


def _parts(chunk: int, name: str, first: int, cases: int) -> Iterator[Part]:
    """Cut at multiples of the chunk, so that a longer run takes up the parts of a shorter one."""
    end = first + cases
    while first < end:
        stop = min(end, (first // chunk + 1) * chunk)
        yield Part(name, first, stop - first)
        first = stop


class _Done(NamedTuple):
    """A part, what came of it, its seconds, and whether it ran to its end: else it is run anew next time."""

    part: Part
    outcome: Outcome
    seconds: float
    whole: bool


def _run(check: Check, ask: Ask, parts: list[Part]) -> Iterator[_Done]:
    if check.alone or ask.workers == 1 or len(parts) < 2:
        for part in parts:
            yield _timed(check, ask, part)
        return
    from joblib import Parallel, delayed

    pool = Parallel(n_jobs=min(ask.workers, len(parts)), return_as="generator_unordered", batch_size=1)
    left = dict.fromkeys(parts)
    try:
        # By name: a worker imports the check itself, and what is sent is small.
        for done in pool(delayed(_named)(check.name, ask, part) for part in parts):
            del left[done.part]
            yield done
    except Exception:  # A worker was lost, and with it what it was at and what was to come.
        said = _last_lines()
        for part in left:
            yield _Done(part, _broken(part, said), 0.0, whole=False)


def _named(name: str, ask: Ask, part: Part) -> _Done:
    return _timed(registry.check(name), ask, part)


def _timed(check: Check, ask: Ask, part: Part) -> _Done:
    began = time.perf_counter()
    try:
        outcome, whole = _counted(part, check.run(ask, part)), True
    except (Exception, Cancelled):  # The check itself is at fault: the others are to be run all the same.
        outcome, whole = _broken(part, _last_lines()), False
    return _Done(part, outcome, time.perf_counter() - began, whole)


def _last_lines() -> str:
    return "; ".join(line.strip() for line in traceback.format_exc().splitlines()[-LAST_LINES:])


def _broken(part: Part, said: str) -> Outcome:
    """A part that did not come to its end: none of its cases was tried, and that is a failure."""
    failure = Failure(part.kind, part.first, f"the check raised: {said}", cases=part.cases)
    return Outcome(0, 1, (failure,), unfinished=1)


def _counted(part: Part, outcome: Outcome) -> Outcome:
    """The same, if each case was tried. One that failed need not have come to where it is counted."""
    if outcome.cases <= part.cases <= outcome.cases + outcome.failed:
        return replace(outcome, cases=part.cases)
    what = f"of {part.cases:,} cases {outcome.cases:,} were counted: the check does not try what it is asked"
    failure = Failure(part.kind, part.first, what, cases=part.cases)
    failures = (failure, *outcome.failures)
    return replace(outcome, failed=outcome.failed + 1, failures=failures, unfinished=1)


def spread(values: tuple[float, ...]) -> dict[str, float]:
    """Least, middle, 95 in 100 and greatest of some figures; nothing of none."""
    if not values:
        return {}
    ranked = sorted(values)
    last = len(ranked) - 1
    return {
        "least": ranked[0],
        "middle": ranked[last // 2],
        "95 %": ranked[(95 * last + 99) // 100],
        "greatest": ranked[last],
    }
