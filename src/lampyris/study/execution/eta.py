"""Time left: how long a study will take, from what its runs took so far."""

from __future__ import annotations

from collections import deque
from collections.abc import Hashable
from dataclasses import dataclass, field
from heapq import heappush, heappushpop


@dataclass(slots=True)
class _Sum:
    """Runs and the seconds that they took."""

    runs: int = 0
    seconds: float = 0.0

    def add(self, runs: int, seconds: float) -> None:
        self.runs += runs
        self.seconds += seconds


@dataclass(slots=True)
class _Mark:
    """What came since the mark before it, up to ``time``."""

    time: float
    work: float
    sums: dict[Hashable, _Sum] = field(default_factory=dict)


class EtaEstimator:
    """Seconds left: what is left of each entrant, times the mean of its runs, over the work done a second.

    Entrants differ by orders of magnitude, and the first worlds meet them one after the other: by the mean
    over all runs a study of a quick and a slow planner promised 20 minutes, 5 hours and one hour within its
    first minute. So nothing is said before every entrant has had runs, or :data:`SHARE` of all are done.

    Means and work are those of the last stretch: half of the time so far, and no less than :data:`STRETCH`
    seconds, for maps and traffic cases come in blocks. It begins with the first result, because what comes before
    that is starting. In each process the first run of an entrant compiles (seconds, where all others take
    hundredths), early or late: the slowest few of each are work done, but in no mean.

    Parameters
    ----------
    now : seconds of a clock.
    entrants : pairs of planner and law that have runs of their own; each has as many as the others.
    early : runs of each that may have had to compile: one a process; at least 1.
    """

    STRETCH = 20.0
    FIRST = 1.0
    SLOW = 10.0
    PATIENCE = 60.0
    """Seconds from which on one run of each entrant is enough, though it may have compiled."""
    SHARE = 0.05
    MARKS = 100
    """Marks of a stretch, about."""

    def __init__(self, now: float, entrants: int = 1, early: int = 1) -> None:
        self._began = now
        self._entrants = entrants
        self._early = early
        self._ran, self._work = 0, 0.0
        self._count: dict[Hashable, int] = {}
        self._slowest: dict[Hashable, list[float]] = {}
        self._ready = 0
        self._all: dict[Hashable, _Sum] = {}
        self._last: dict[Hashable, _Sum] = {}
        self._marks: deque[_Mark] = deque()
        self._next: dict[Hashable, _Sum] = {}

    def came(self, who: Hashable, seconds: float | None) -> None:
        """A run of an entrant came back; ``seconds`` that it took, None where unknown."""
        if seconds is None:
            seconds = self._mean(who) if who in self._count else 1.0
        n = self._count[who] = self._count.get(who, 0) + 1
        self._ran += 1
        self._work += seconds
        slowest = self._slowest.setdefault(who, [])
        if n <= self._early:
            heappush(slowest, seconds)
            return
        seconds = heappushpop(slowest, seconds)
        self._ready += n == self._early + 1
        for sums in (self._all, self._last, self._next):
            sums.setdefault(who, _Sum()).add(1, seconds)

    def left(self, now: float, remaining: int) -> float | None:
        """Seconds for ``remaining`` more; None while that is unknown."""
        if remaining <= 0:
            return 0.0
        self._slide(now)
        speed = self._speed(now)
        if speed is None or not self._known(now, remaining):
            return None
        means = {who: self._mean(who) for who in self._count}
        each = (self._ran + remaining) / self._entrants
        rest = {who: max(0.0, each - n) for who, n in self._count.items()}
        # Who has not been met yet is as slow as the others are on the average.
        unmet = each * max(0, self._entrants - len(means))
        runs = sum(rest.values()) + unmet
        seconds = sum(rest[who] * mean for who, mean in means.items())
        seconds += unmet * sum(means.values()) / len(means)
        return remaining * seconds / runs / speed if runs else None

    def _known(self, now: float, remaining: int) -> bool:
        """Whether enough has come to say anything."""
        if self._ready >= self._entrants or self._ran >= self.SHARE * (self._ran + remaining):
            return True
        return len(self._count) >= self._entrants and now - self._began >= self.PATIENCE

    def _mean(self, who: Hashable) -> float:
        """Seconds of a run of an entrant: in the last stretch, else of all, else of the quickest there is."""
        for sums in (self._last, self._all):
            if who in sums and sums[who].runs:
                return sums[who].seconds / sums[who].runs
        return self._slowest[who][0]

    def _speed(self, now: float) -> float | None:
        """Seconds of work done in a second: about as many as there are processes at work."""
        then, before = (self._marks[0].time, self._marks[0].work) if self._marks else (now, self._work)
        if self._work > before and now - then >= self.FIRST:
            return (self._work - before) / (now - then)
        if self._work > 0 and now - self._began >= self.SLOW:
            return self._work / (now - self._began)
        return None

    def _slide(self, now: float) -> None:
        """Put a mark, and leave behind what is older than the stretch."""
        span = max(self.STRETCH, (now - self._began) / 2)
        if self._ran and (not self._marks or now - self._marks[-1].time >= span / self.MARKS):
            if not self._marks:
                self._last = {}
            self._marks.append(_Mark(now, self._work, self._next))
            self._next = {}
        while len(self._marks) > 2 and self._marks[1].time <= now - span:
            self._marks.popleft()
            for who, gone in self._marks[0].sums.items():
                self._last[who].add(-gone.runs, -gone.seconds)
