"""Run the parts of a check on some workers; the result is the same whatever their number."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass

from lampyris.errors import UsageError, did_you_mean
from lampyris.selfcheck import registry
from lampyris.selfcheck.check import Ask, Check, Kind, Outcome, Part, gather
from lampyris.selfcheck.ledger import Ledger

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
class Result:
    """What came of a check.

    Parameters
    ----------
    check : the check.
    ask : what it was asked.
    kinds : first case and number of cases of each kind.
    outcome : all that was seen.
    seconds : of work, on all workers together, in this run and those before it that the ledger holds.
    by_kind : the same as ``outcome``, kind by kind.
    lacks : what too few cases reached (:attr:`~lampyris.selfcheck.check.Kind.least`), a sentence each.
    """

    check: Check
    ask: Ask
    kinds: dict[str, tuple[int, int]]
    outcome: Outcome
    seconds: float
    by_kind: Mapping[str, Outcome]
    lacks: tuple[str, ...]

    @property
    def holds(self) -> bool:
        """Whether there were cases, of which none failed and enough reached what they were to try."""
        return self.outcome.cases > 0 and not self.outcome.failed and not self.lacks

    @property
    def bound(self) -> float | None:
        """With 95 % confidence no more than this share of such cases fails: 3 / n, where none of n did."""
        return 3 / self.outcome.cases if self.holds else None


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
    UsageError : no such kind; a range beyond an exhaustive kind's end.
    """
    ledger = ledger or Ledger(None)
    asked = _asked(check, ask, which)
    kinds = {name: _range(name, kind, ask, which) for name, kind in asked.items()}
    parts = [
        part for name, (first, cases) in kinds.items() for part in _parts(check, ask, name, first, cases)
    ]
    total = sum(part.cases for part in parts)
    known = {part: seen for part in parts if (seen := ledger.done(check, ask, part)) is not None}
    so_far = gather(outcome for outcome, _ in known.values())
    if tell:
        tell(sum(part.cases for part in known), total, so_far)
    done = sum(part.cases for part in known)
    for part, outcome, seconds in _run(check, ask, [part for part in parts if part not in known]):
        ledger.add(check, ask, part, outcome, seconds)
        known[part] = (outcome, seconds)
        so_far += Outcome(outcome.cases, outcome.failed, outcome.failures)
        done += part.cases
        if tell:
            tell(done, total, so_far)
    whole = gather(known[part][0] for part in parts)
    by_kind = {name: gather(known[part][0] for part in parts if part.kind == name) for name in kinds}
    lacks = tuple(f"{name}: {what}" for name, seen in by_kind.items() for what in asked[name].lacks(seen))
    return Result(check, ask, kinds, whole, sum(known[part][1] for part in parts), by_kind, lacks)


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


def _range(name: str, kind: Kind, ask: Ask, which: Range) -> tuple[int, int]:
    """First case and number of cases; an exhaustive kind ends where it ends."""
    cases = kind.cases(ask.size) if which.cases is None else which.cases
    if kind.whole is None:
        return which.first, cases
    if which.first >= kind.whole > 0 and which.only:
        raise UsageError("RANGE", f"{name} has {kind.whole:,} cases", allowed=f"first 0..{kind.whole - 1}")
    return which.first, max(0, min(cases, kind.whole - which.first))


def _parts(check: Check, ask: Ask, name: str, first: int, cases: int) -> Iterator[Part]:
    """Cut at multiples of the chunk, so that a longer run takes up the parts of a shorter one."""
    chunk = check.kinds_for(ask)[name].chunk
    end = first + cases
    while first < end:
        stop = min(end, (first // chunk + 1) * chunk)
        yield Part(name, first, stop - first)
        first = stop


def _run(check: Check, ask: Ask, parts: list[Part]) -> Iterable[tuple[Part, Outcome, float]]:
    if check.alone or ask.workers == 1 or len(parts) < 2:
        for part in parts:
            yield _timed(check.name, check, ask, part)
        return
    from joblib import Parallel, delayed

    pool = Parallel(n_jobs=min(ask.workers, len(parts)), return_as="generator_unordered", batch_size=1)
    # By name: a worker imports the check itself, and what is sent is small.
    yield from pool(delayed(_named)(check.name, ask, part) for part in parts)


def _named(name: str, ask: Ask, part: Part) -> tuple[Part, Outcome, float]:
    return _timed(name, registry.check(name), ask, part)


def _timed(name: str, check: Check, ask: Ask, part: Part) -> tuple[Part, Outcome, float]:
    began = time.perf_counter()
    outcome = check.run(ask, part)
    return part, outcome, time.perf_counter() - began


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
