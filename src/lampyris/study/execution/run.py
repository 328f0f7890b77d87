"""Run: a study from jobs to rows, wherever the work is done. Only this process judges, and only it stores.

A worker gets bytes and gives bytes: a batch as JSON, and what came of its jobs as JSON. Nothing in an answer
is believed: it is parsed, its keys must be those that were asked, and each result is judged again here
(:mod:`lampyris.study.execution.verify`) before it becomes a row. So one worker, many, or a cluster give the same rows,
and so does any order of the jobs.
"""

from __future__ import annotations

import json
import signal
import threading
import time
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from types import FrameType, TracebackType
from typing import Any, Final, Protocol

from lampyris._core import cancellation
from lampyris.errors import LampyrisError
from lampyris.study.design.row import Row
from lampyris.study.design.study import FleetQuery, Job, Study, StudyMap
from lampyris.study.execution.batches import Batch, Batches, Letters, entrants
from lampyris.study.execution.cluster import Cluster
from lampyris.study.execution.eta import EtaEstimator
from lampyris.study.execution.execution import Execution, Finished, Progress
from lampyris.study.execution.pool import BatchResult, Executor, Processes, SerialExecutor, Work
from lampyris.study.execution.verify import ResultVerifier
from lampyris.study.execution.worker import work

Sink = Callable[[Sequence[Row]], None]

MAX_DEATHS: Final = 3
"""Workers that a job may take with it before it is given up."""
MAX_DOUBTS: Final = 2
"""Answers to a job that may be unusable before it is given up."""
MAX_ANSWER: Final = 3 * 2**28
"""Bytes of an answer: a worker says what it likes, and what reads it takes several times as much. The arrays
of one run are 512 MiB at most before packing (:mod:`lampyris.study.execution.evidence`), as text a third more."""
HOPELESS: Final = 20
"""Unusable answers, before the first usable one, that end a study: then it is the workers, not the jobs."""
EVERY: Final = 0.1
"""Seconds between two calls of the sink, unless a batch takes longer."""
BEAT: Final = 0.5
"""Seconds between two reports of progress when there is nothing new."""


EARLY: Final = 8
"""Processes that may each compile an entrant's kernels, as far as the time left goes by it."""


class _Judging(Protocol):
    """See :class:`lampyris.study.execution.verify.ResultVerifier`."""

    def row(
        self, job: Job, result: Mapping[str, Any], ground: StudyMap, fleet: FleetQuery | None = None
    ) -> Row:
        """The row of a result, judged."""


def run(
    study: Study,
    sink: Sink,
    *,
    done: Collection[str] = (),
    where: Execution | None = None,
    progress: Callable[[Progress], None] | None = None,
    _work: Work | None = None,
    _judge: _Judging | None = None,
) -> Finished:
    """Run every job of a study that has no row yet.

    Parameters
    ----------
    study : what is run. Its jobs unfold as they are needed.
    sink : takes rows, from this thread only, at most a fifth of a second after they were judged or at the
        end of the batch that is being worked on here. What it raises ends the study. A second Ctrl-C may
        hit it: then it is given the same rows again.
    done : keys that have a row.
    where : see :class:`lampyris.study.execution.execution.Execution`; default this process.
    progress : is called with how far it is, at least every second unless a batch is worked on in this process.

    Raises
    ------
    KeyboardInterrupt
        After Ctrl-C; the rows judged until then are in the sink.
    LampyrisError
        WORKER_START: processes do not start. WORKER_ANSWER: none of the first :data:`HOPELESS` answers can be
        used; nothing is stored of them. Of a cluster: see :mod:`lampyris.study.execution.cluster`.
    """
    place = where or Execution()
    sitting = _Sitting(study, sink, done, place, progress, _judge or ResultVerifier())
    with _Calm(at_once=place.here) as calm:
        third_party = {who.name: who.origin for who in study.planners if who.origin}
        return sitting.through(_executor(place, _work or work, sitting.left, third_party), calm)


def _executor(where: Execution, call: Work, jobs: int, third_party: Mapping[str, str]) -> Executor:
    """Those who do the work; nobody is woken for nothing."""
    if where.here or not jobs:
        return SerialExecutor(call)
    if where.dask is None:
        return Processes(call, min(where.workers, jobs))
    return Cluster(call, where.dask, third_party)


class _Sitting:
    """One call of :func:`run`: what is asked, judged and stored."""

    def __init__(
        self,
        study: Study,
        sink: Sink,
        done: Collection[str],
        where: Execution,
        progress: Callable[[Progress], None] | None,
        judge: _Judging,
    ) -> None:
        self._sink, self._tell, self._judge = sink, progress, judge
        self._grounds = study.grounds
        self._batches = Batches(study, done, 2 if where.dask else where.workers, where.shuffle)
        self._fleets = study.fleets
        self._letters = Letters(self._grounds, study.memory, self._fleets)
        self._began = time.perf_counter()
        self._pace = EtaEstimator(self._began, entrants(study), min(where.workers, EARLY))
        self._pending: list[Row] = []
        self._fresh: list[Row] = []
        self._withheld: list[Row] = []
        self._usable = False
        self._useless = 0
        self._endings: Counter[str] = Counter()
        self._stored_at = self._reported_at = self._began
        self._out = 0

    @property
    def left(self) -> int:
        """Runs that have no row, as far as that is known; 0 only if there is none."""
        return max(self._batches.total - self._batches.before, int(self._batches.more))

    def through(self, executor: Executor, calm: _Calm) -> Finished:
        """Until every job has a row."""
        now = True
        try:
            self._report(executor)
            self._loop(executor, calm)
            self._pending += self._withheld
            now = False
        except BaseException:
            # Whatever ends it, what was judged is kept; if the sink itself raised, nothing is pending.
            self._store()
            raise
        finally:
            executor.stop(now)
        self._store()
        self._report(executor)
        return Finished(
            self._batches.total,
            self._batches.before,
            self._endings.total(),
            self._endings["failed"],
            self._endings["refused"],
            self._endings["timeout"],
            executor.died,
            time.perf_counter() - self._began,
        )

    def _loop(self, executor: Executor, calm: _Calm) -> None:
        """Ask while there is room, judge what comes, store, tell."""
        while True:
            calm.check()
            while executor.room(self._batches.seconds):
                self._batches.workers = max(executor.workers, self._batches.workers)
                batch = self._batches.take()
                if batch is None:
                    break
                self._out += 1
                executor.ask(batch, self._letters(batch))
            if not self._out and not self._batches.more:
                return
            with calm.waiting():
                answers = executor.answers(EVERY)
            for answer in answers:
                self._out -= 1
                self._take(answer)
                calm.check()
                self._store_soon(executor)
            self._store_soon(executor)

    def _take(self, answer: BatchResult) -> None:
        """Rows of an answer; what has none is asked again."""
        batch = answer.batch
        if answer.came == "lost":
            self._batches.again([batch])
            return
        if answer.came == "died":
            if len(batch.jobs) > 1:
                self._batches.again(batch.halves)
            elif batch.deaths + 1 < MAX_DEATHS:
                self._batches.at_last(Batch(batch.jobs, batch.deaths + 1, batch.doubts))
            else:
                self._fail(batch, f"WORKER_DIED: its worker died {MAX_DEATHS} times")
            return
        if answer.came == "back":
            self._batches.learn(len(batch.jobs), answer.seconds)
        words = answer.words
        doubtful: list[Job] = []
        for job, result in zip(batch.jobs, results_of(answer.data, batch), strict=True):
            row = None if result is None else self._judged(job, result)
            if isinstance(row, Row):
                self._usable = True
                self._pending.append(row)
                self._pace.came(_entrant(job), row.timing.get("wall_s"))
            else:
                doubtful.append(job)
                words = words or row or "an answer that is not the one to what was asked"
        if doubtful:
            self._useless += 1
            if not self._usable and self._useless >= HOPELESS:
                raise _hopeless(words)
            rest = Batch(tuple(doubtful), batch.deaths, batch.doubts + 1)
            if rest.doubts < MAX_DOUBTS:
                self._batches.again([rest])
            else:
                self._fail(rest, f"WORKER_ANSWER: {words}")

    def _judged(self, job: Job, result: Mapping[str, Any]) -> Row | str:
        """The row of one result; in words what is wrong with it if there is none."""
        try:
            ground, fleet = self._grounds[job.plain["map"]], self._fleets.get(job.plain.get("fleet", ""))
            row = self._judge.row(job, result, ground, *(() if fleet is None else (fleet,)))
        except Exception as fault:  # One result must not end a study of days; it is counted as failed.
            return f"cannot be judged: {type(fault).__name__}: {fault}"
        return row if row.key == job.key else "the row of another job"

    def _fail(self, batch: Batch, words: str) -> None:
        """Rows of jobs that are given up; not stored before it is known that others fare better."""
        for job in batch.jobs:
            self._pace.came(_entrant(job), None)
        self._withheld.extend(Row(job.key, "failed", error=words[:1000]) for job in batch.jobs)

    def _store_soon(self, executor: Executor) -> None:
        """Store and tell if it is time to."""
        now = time.perf_counter()
        if self._usable:
            self._pending += self._withheld
            self._withheld = []
        if self._pending and now - self._stored_at >= EVERY:
            self._store()
        if self._fresh or now - self._reported_at >= BEAT:
            self._report(executor)

    def _store(self) -> None:
        """Hand the rows over. A sink that raises gets them no more; one that Ctrl-C hit gets them again."""
        rows = self._pending
        if rows:
            try:
                self._sink(rows)
            except Exception:
                self._pending = []
                raise
            self._pending = []
            self._endings.update(row.ending for row in rows)
            if self._tell is not None:
                self._fresh.extend(rows)
        self._stored_at = time.perf_counter()

    def _report(self, executor: Executor) -> None:
        """Tell how far it is."""
        self._reported_at = now = time.perf_counter()
        if self._tell is None:
            return
        rows, self._fresh = tuple(self._fresh), []
        ran, total = self._endings.total(), self._batches.total
        done = min(self._batches.before + ran, total)
        self._tell(
            Progress(
                done,
                total,
                self._endings["failed"],
                self._endings["refused"],
                self._endings["timeout"],
                rows,
                self._pace.left(now, total - done),
                executor.workers,
            )
        )


def _entrant(job: Job) -> tuple[str, str]:
    return job.labels["planner"], job.labels["law"]


class _Calm:
    """Ctrl-C, seen where nothing is half done: between two answers.

    The pools wait in locks that an exception at any moment would leave shut, and a store writes. Where this
    process works itself (``at_once``) a job may take minutes, so Ctrl-C interrupts it. A second Ctrl-C
    interrupts everywhere. A handler that is not Python's own stays in charge.
    """

    def __init__(self, at_once: bool) -> None:
        self._at_once = at_once
        self._mine = self._asked = self._waits = False

    def __enter__(self) -> _Calm:
        self._mine = (
            threading.current_thread() is threading.main_thread()
            and signal.getsignal(signal.SIGINT) is signal.default_int_handler
        )
        if self._mine:
            cancellation.leave_next(True)
            signal.signal(signal.SIGINT, self._note)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._mine:
            self._restore()
            cancellation.leave_next(False)  # it has not come
        if kind is None:
            self.check()

    @contextmanager
    def waiting(self) -> Iterator[None]:
        """While the answers are waited for, or worked out here."""
        self._waits = True
        try:
            self.check()
            yield
        finally:
            self._waits = False

    def check(self) -> None:
        """Raise now if Ctrl-C was pressed."""
        if self._asked:
            self._asked = False
            raise KeyboardInterrupt

    def _note(self, number: int, frame: FrameType | None) -> None:
        self._restore()
        # Also where it is raised: in a function that C calls it is lost, and comes after this answer.
        self._asked = True
        if self._at_once and self._waits:
            raise KeyboardInterrupt

    def _restore(self) -> None:
        if self._mine:
            signal.signal(signal.SIGINT, signal.default_int_handler)
            self._mine = False


def results_of(data: bytes, batch: Batch) -> list[Mapping[str, Any] | None]:
    """The results in an answer, one a job; None for those that are missing or of another job."""
    none: list[Mapping[str, Any] | None] = [None] * len(batch.jobs)
    if len(data) > MAX_ANSWER:
        return none
    try:
        lock = json.loads(data)
    except (ValueError, RecursionError):
        return none
    results = lock.get("results") if isinstance(lock, dict) else None
    if not isinstance(results, list) or len(results) > len(batch.jobs):
        return none
    by_key = {result["key"]: result for result in results if isinstance(result, dict) and _keyed(result)}
    return [by_key.get(job.key) for job in batch.jobs]


def _keyed(result: Mapping[str, Any]) -> bool:
    return isinstance(result.get("key"), str)


def _hopeless(words: str) -> LampyrisError:
    return LampyrisError(
        "WORKER_ANSWER",
        f"none of the first {HOPELESS} answers of the workers can be used: {words}"[:1000],
        where="workers",
        todo="nothing was stored of them; look whether lampyris is the same everywhere and whole",
    )
