"""Batches: the jobs of a study a handful at a time, as bytes for a worker; made as they are needed."""

from __future__ import annotations

from collections import OrderedDict, deque
from collections.abc import Collection, Hashable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import compress, product
from math import ceil, prod
from typing import Any

import numpy as np

from lampyris.study.design.serialize import packed_fleet
from lampyris.study.design.study import FleetQuery, Job, Study, StudyMap, canonical
from lampyris.study.design.study_map import pack

SECONDS = 0.5
"""Work of one batch. A worker that dies takes as much with it; asking costs about a millisecond."""
MAX_JOBS = 512
"""Most jobs of one batch, and with a few batches a worker the most that are held at once."""
WINDOW = 4096
"""Jobs that are held to be drawn from when the order is shuffled."""
PACKED = 16
"""Packed maps that are kept for the next batch."""


@dataclass(frozen=True, slots=True, eq=False)
class Batch:
    """Jobs that are asked of one worker at once.

    Parameters
    ----------
    jobs : at least one.
    deaths : times that a worker died of this very job; counted only of batches of one.
    doubts : times that the answer could not be used.
    """

    jobs: tuple[Job, ...]
    deaths: int = 0
    doubts: int = 0

    @property
    def halves(self) -> tuple[Batch, ...]:
        """Both halves, to find which job it is; nothing is known of them yet."""
        middle = len(self.jobs) // 2
        return tuple(Batch(part) for part in (self.jobs[:middle], self.jobs[middle:]) if part)


class Letters:
    """Batches as bytes, which is all that a worker gets.

    Parameters
    ----------
    grounds : maps by hash.
    memory : whether workers measure memory.
    fleets : the fleets of a study of fleets by hash.
    """

    def __init__(
        self, grounds: Mapping[str, StudyMap], memory: bool, fleets: Mapping[str, FleetQuery] | None = None
    ) -> None:
        self._grounds, self._fleets = grounds, fleets or {}
        self._memory = memory
        self._packed: OrderedDict[str, dict[str, Any]] = OrderedDict()

    def __call__(self, batch: Batch) -> bytes:
        """The batch as canonical JSON, with the maps that its jobs name."""
        hashes = sorted({job.plain["map"] for job in batch.jobs})
        request = {
            "grounds": {hash_: self._ground(hash_) for hash_ in hashes},
            "jobs": [job.plain for job in batch.jobs],
            "memory": self._memory,
        }
        if self._fleets:
            named = sorted({job.plain["fleet"] for job in batch.jobs})
            request["fleets"] = {hash_: packed_fleet(self._fleets[hash_]) for hash_ in named}
        return canonical(request)

    def _ground(self, hash_: str) -> dict[str, Any]:
        """A packed map; the last few are kept, because the next batch needs the same one."""
        if hash_ in self._packed:
            self._packed.move_to_end(hash_)
            return self._packed[hash_]
        packed = self._packed[hash_] = pack(self._grounds[hash_].grid)
        if len(self._packed) > PACKED:
            self._packed.popitem(last=False)
        return packed


class Batches:
    """The batches of a study, each made when it is asked for.

    Jobs of one world follow each other and stay together as far as the size allows: a worker keeps what it
    worked out of a world. Sizes begin at one job, double with every answer until a batch is about
    :data:`SECONDS` of work, and shrink towards the end, so that no worker is left with the last big one.

    Parameters
    ----------
    study : what is run.
    done : keys that have a row.
    workers : how many share the work; 1: no shrinking.
    shuffle : see :class:`lampyris.study.execution.execution.Execution`.
    """

    def __init__(self, study: Study, done: Collection[str], workers: int, shuffle: int | None) -> None:
        known = done if isinstance(done, set | frozenset | Mapping) else frozenset(done)
        self.total, jobs = distinct(study)
        self.skipped = 0
        self.workers = workers
        self._expected = min(len(known), self.total)
        self._exhausted = False
        unfinished = self._unfinished(jobs, known)
        self._jobs = unfinished if shuffle is None else shuffled(unfinished, shuffle)
        self._next = next(self._jobs, None)
        self._again: deque[Batch] = deque()
        self._last: deque[Batch] = deque()
        self._given = 0
        self._most = 1
        self._each: float | None = None

    @property
    def before(self) -> int:
        """Runs that had a row; until every job was seen, what is known of it."""
        return self.skipped if self._exhausted else max(self.skipped, self._expected)

    @property
    def more(self) -> bool:
        """Whether there is a batch to take."""
        return bool(self._again) or self._next is not None or bool(self._last)

    def take(self) -> Batch | None:
        """The next batch; None when there is none (a worker may still bring some back)."""
        if self._again:
            return self._again.popleft()
        if self._next is None:
            return self._last.popleft() if self._last else None
        size, jobs = self._size(), [self._next]
        self._next = next(self._jobs, None)
        while self._next is not None and len(jobs) < size:
            if 2 * len(jobs) >= size and _world(self._next) != _world(jobs[-1]):
                break
            jobs.append(self._next)
            self._next = next(self._jobs, None)
        self._given += len(jobs)
        return Batch(tuple(jobs))

    def again(self, batches: Iterable[Batch]) -> None:
        """Ask these again, before anything new."""
        self._again.extend(batches)

    def at_last(self, batch: Batch) -> None:
        """Ask it again when there is nothing else left.

        For a job of which a worker died. Asked again at once it is what the new worker begins with, and
        spends its first second on: of 30 workers killed from outside, two took the same job with them twice,
        for no fault of its own.
        """
        self._last.append(batch)

    def learn(self, jobs: int, seconds: float) -> None:
        """A batch of so many jobs came back and took so long.

        A job that is far quicker than what was believed is believed at once: the first ones compile.
        """
        if seconds <= 0:
            return
        self._most = min(2 * max(self._most, jobs), MAX_JOBS)
        each = seconds / jobs
        if self._each is None or each < self._each / 4:
            self._each = each
        else:
            self._each += 0.3 * (each - self._each)

    @property
    def seconds(self) -> float:
        """What a batch is believed to take."""
        return SECONDS if self._each is None else self._each * self._size()

    def _size(self) -> int:
        """Jobs of the next batch."""
        size = self._most
        if self._each is not None:
            size = min(size, int(SECONDS / self._each))
        if self.workers > 1:
            size = min(size, ceil((self.total - self.before - self._given) / (2 * self.workers)))
        return max(size, 1)

    def _unfinished(self, jobs: Iterator[Job], known: Collection[str]) -> Iterator[Job]:
        """Jobs without a row; counts the others."""
        for job in jobs:
            if job.key in known:
                self.skipped += 1
            else:
                yield job
        self._exhausted = True


def distinct(study: Study) -> tuple[int, Iterator[Job]]:
    """How many runs a study has, and the first job of each.

    Two planners of different label and equal settings (the default among a row of settings, twice) have the
    same keys. A study is a product, so a key occurs twice exactly where a factor does: nothing has to be
    remembered of millions of keys.
    """
    firsts = (
        _firsts((w.ground.hash, w.ground.grid.resolution, *w.identity) for w in study.worlds),
        _firsts(canonical(traffic.plain) for traffic in study.traffic_cases),
        _firsts(study.seeds),
        *_whose(study),
    )
    return prod(map(sum, firsts)), compress(study.jobs(), map(all, product(*firsts)))  # bits: yes and no


def entrants(study: Study) -> int:
    """Pairs of planner and law that have runs of their own; each has as many as the others."""
    return prod(map(sum, _whose(study)))  # bits: yes and no are counted


def _whose(study: Study) -> tuple[list[bool], list[bool]]:
    """Of each planner and each law, whether it is there for the first time."""
    return (
        _firsts((who.name, who.origin, canonical(who.settings), who.sensor) for who in study.planners),
        _firsts((who.name, canonical(who.settings)) for who in study.laws),
    )


def shuffled(jobs: Iterator[Job], seed: int) -> Iterator[Job]:
    """The same jobs in another order; no more than :data:`WINDOW` are held."""
    rng = np.random.Generator(np.random.PCG64(seed))
    held: list[Job] = []
    for job in jobs:
        held.append(job)
        if len(held) >= WINDOW:
            yield _drawn(held, rng)
    while held:
        yield _drawn(held, rng)


def _drawn(held: list[Job], rng: np.random.Generator) -> Job:
    """One of those, taken out."""
    at = int(rng.integers(len(held)))
    held[at], held[-1] = held[-1], held[at]
    return held.pop()


def _firsts(values: Iterable[Hashable]) -> list[bool]:
    """Of each value, whether it is there for the first time."""
    seen: set[Hashable] = set()
    firsts = []
    for value in values:
        firsts.append(value not in seen)
        seen.add(value)
    return firsts


def _world(job: Job) -> tuple[Any, ...]:
    """What a worker keeps between jobs."""
    plain = job.plain
    if "fleet" in plain:
        return (plain["map"], plain["resolution"], plain["fleet"], plain["robots"])
    poses = (*plain.get("start_pose", ()), *plain.get("goal_pose", ()))
    return (plain["map"], plain["resolution"], *plain["start"], *plain["goal"], *poses)
