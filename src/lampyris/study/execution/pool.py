"""Pool: batches done in this process, or in processes of this machine. Bytes go out and bytes come back.

Each worker is a pool of one process (loky, by way of joblib) with a queue of its own. So when a process dies
it is known which batch it died of: the first in its queue. The road not taken is one pool of many processes:
a death there breaks the whole pool, and nobody can say which of the batches on their way was the cause.
"""

from __future__ import annotations

import atexit
import os
import queue
import signal
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, Literal, Protocol, TypeAlias

from lampyris import __version__
from lampyris._core.system import has_parent
from lampyris.errors import LampyrisError
from lampyris.study.execution.batches import Batch

Work: TypeAlias = Callable[[bytes], bytes]
"""See :func:`lampyris.study.execution.worker.work`."""

Came: TypeAlias = Literal["back", "died", "lost", "fault"]
"""``back``: with data. ``died``: the worker died of it. ``lost``: for no fault of its own; ask again.
``fault``: the call itself raised."""

IDLE: Final = 20.0
"""Seconds until a process without work ends; the next study in this time finds it warm."""
STARTS: Final = 3
"""Times in a row that a worker may die before it ever said that it is there."""
LONG: Final = 2.0
"""Batches that take longer than this do not wait behind another one; shorter ones are sent in advance."""

ENVIRONMENT: Final = dict.fromkeys(
    (
        "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS",
        "VECLIB_MAXIMUM_THREADS", "NUMBA_NUM_THREADS",
    ),
    "1",
)  # fmt: skip
"""One thread a worker: there are as many workers as the user wants cores in use."""


@dataclass(frozen=True, slots=True, eq=False)
class BatchResult:
    """What became of a batch.

    Parameters
    ----------
    batch : that was asked.
    came : see :data:`Came`.
    data : the answer, where it came back.
    seconds : the worker had it; 0 where that is not known.
    words : of the fault.
    """

    batch: Batch
    came: Came
    data: bytes = b""
    seconds: float = 0.0
    words: str = ""


class Executor(Protocol):
    """Who does the work."""

    @property
    def workers(self) -> int:
        """At work now; 0 while they start."""

    @property
    def died(self) -> int:
        """Workers that died, or left the cluster."""

    def room(self, seconds: float) -> bool:
        """Whether another batch may be asked, if a batch takes so long."""

    def ask(self, batch: Batch, letter: bytes) -> None:
        """Ask a batch; its answer comes later."""

    def answers(self, timeout: float) -> list[BatchResult]:
        """What came since; waits so many seconds at most for the first."""

    def stop(self, now: bool) -> None:
        """Nothing more is asked. ``now``: what is still under way is given up."""


class SerialExecutor:
    """This process, one batch at a time, through the same bytes."""

    workers = 1
    died = 0

    def __init__(self, work: Work) -> None:
        self._work = work
        self._asked: tuple[Batch, bytes] | None = None

    def room(self, seconds: float) -> bool:
        """See :class:`Executor`."""
        return self._asked is None

    def ask(self, batch: Batch, letter: bytes) -> None:
        """See :class:`Executor`."""
        self._asked = batch, letter

    def answers(self, timeout: float) -> list[BatchResult]:
        """Does the work, however long it takes."""
        if self._asked is None:
            return []
        (batch, letter), self._asked = self._asked, None
        began = time.perf_counter()
        try:
            data = self._work(letter)
        except Exception as fault:  # Work never raises for what a job does: a bug of ours, and one batch.
            return [BatchResult(batch, "fault", words=fault_text(fault))]
        return [BatchResult(batch, "back", data, time.perf_counter() - began)]

    def stop(self, now: bool) -> None:
        """Nothing is under way."""


class _Slot:
    """One worker: a pool of one process, and what it was asked, in order."""

    def __init__(self) -> None:
        self.pool: Any = None
        self.turn = 0
        self.starts = 0
        self.ready = False
        self.since = 0.0
        self.asked: deque[Batch] = deque()
        self.last: Any = None


_warm: list[Any] = []
"""Pools that no study uses now. Their processes end by themselves after :data:`IDLE` seconds."""
# While all modules still stand: loky prints an AttributeError for each pool that is let go of later.
atexit.register(_warm.clear)


class Processes:
    """Processes of this machine.

    Parameters
    ----------
    work : a function of a module, which the processes import by name.
    workers : how many.

    Raises
    ------
    LampyrisError
        From ``answers``: WORKER_START: a worker dies again and again before it did anything.
    """

    def __init__(self, work: Work, workers: int) -> None:
        self._work = work
        self._ended: queue.SimpleQueue[tuple[_Slot, int, Batch | None, Any, float]] = queue.SimpleQueue()
        self._slots = [_Slot() for _ in range(workers)]
        self.died = 0
        for slot in self._slots:
            self._start(slot)

    @property
    def workers(self) -> int:
        """Processes that said that they are there."""
        return sum(slot.ready for slot in self._slots)

    def room(self, seconds: float) -> bool:
        """See :class:`Executor`."""
        return len(self._emptiest().asked) < (1 if seconds > LONG else 2)

    def ask(self, batch: Batch, letter: bytes) -> None:
        """See :class:`Executor`."""
        slot = self._emptiest()
        if not slot.asked:
            slot.since = time.perf_counter()
        slot.asked.append(batch)
        self._send(slot, batch, self._work, letter)

    def answers(self, timeout: float) -> list[BatchResult]:
        """See :class:`Executor`."""
        found: list[BatchResult] = []
        wait: float | None = timeout
        while True:
            try:
                ended = self._ended.get(timeout=wait) if wait else self._ended.get_nowait()
            except queue.Empty:
                return found
            wait = None
            found += self._one(*ended)

    def stop(self, now: bool) -> None:
        """Gives the processes back, or kills those that still have something to do."""
        for slot in self._slots:
            slot.turn += 1
            if slot.pool is None:
                continue
            if slot.asked or not slot.ready:
                _settle(slot.last)
                slot.pool.shutdown(wait=not now, kill_workers=True)
            else:
                _warm.append(slot.pool)
            slot.pool = None

    def _emptiest(self) -> _Slot:
        """The worker with the least to do; one that is there before one that is not."""
        return min(self._slots, key=lambda slot: (len(slot.asked), not slot.ready))

    def _start(self, slot: _Slot) -> None:
        """A worker, new or warm, which is asked to say that it is there."""
        slot.turn += 1
        slot.ready = False
        slot.pool = _warm.pop() if _warm and not slot.starts else _new_pool()
        self._send(slot, None, worker_version, __version__)

    def _send(self, slot: _Slot, batch: Batch | None, call: Callable[[Any], Any], argument: object) -> None:
        """Put a call into a worker's queue. Another thread reports the outcome."""
        turn, ended = slot.turn, self._ended

        def tell(future: Any) -> None:
            ended.put((slot, turn, batch, future, time.perf_counter()))

        try:
            slot.last = slot.pool.submit(call, argument)
            slot.last.add_done_callback(tell)
        except RuntimeError as fault:  # The process died and the pool was closed since.
            ended.put((slot, turn, batch, fault, time.perf_counter()))

    def _one(self, slot: _Slot, turn: int, batch: Batch | None, future: Any, at: float) -> list[BatchResult]:
        """What one call came to."""
        if turn != slot.turn or (not isinstance(future, Exception) and future.cancelled()):
            return []
        fault = future if isinstance(future, Exception) else future.exception()
        if fault is not None and (isinstance(fault, RuntimeError) and _broke(fault)):
            return self._restart(slot)
        if batch is None:
            if fault is not None:
                raise _no_start(fault_text(fault))
            slot.ready, slot.starts, slot.since = True, 0, at
            return []
        slot.asked.remove(batch)
        seconds, slot.since = at - slot.since, at
        if fault is not None:
            return [BatchResult(batch, "fault", seconds=seconds, words=fault_text(fault))]
        data = future.result()
        if not isinstance(data, bytes):
            return [
                BatchResult(batch, "fault", words=f"an answer that is a {type(data).__name__}, not bytes")
            ]
        return [BatchResult(batch, "back", data, seconds)]

    def _restart(self, slot: _Slot) -> list[BatchResult]:
        """The process is dead. The first of its batches is to blame if it had begun to work at all."""
        self.died += 1
        if not slot.ready:
            slot.starts += 1
            if slot.starts >= STARTS:
                raise _no_start(f"it died {slot.starts} times")
        batches, began = list(slot.asked), slot.ready
        slot.asked.clear()
        slot.pool.shutdown(wait=False, kill_workers=True)
        self._start(slot)
        return [
            BatchResult(batch, "died" if began and at == 0 else "lost") for at, batch in enumerate(batches)
        ]


def worker_version(version: str) -> str:
    """The version of lampyris in a worker, which it reports first."""
    return __version__


def fault_text(fault: BaseException) -> str:
    """A fault in one line."""
    return f"{type(fault).__name__}: {fault}" if str(fault) else type(fault).__name__


def _broke(fault: RuntimeError) -> bool:
    """Whether the process of a pool is gone."""
    from joblib.externals.loky.process_executor import BrokenProcessPool, ShutdownExecutorError

    return isinstance(fault, BrokenProcessPool | ShutdownExecutorError)


def _settle(future: Any) -> None:
    """Wait until the pool has taken note of a call.

    loky's own thread ends with a KeyError, printed, if its pool is killed between the call and that: 37 of 50
    pools that were stopped right after a call. It is a matter of milliseconds; never more than 2 s.
    """
    until = time.perf_counter() + 2.0
    while future is not None and not (future.running() or future.done()) and time.perf_counter() < until:
        time.sleep(0.001)


def _new_pool() -> Any:
    """A pool of one process."""
    from joblib.externals.loky import ProcessPoolExecutor

    return ProcessPoolExecutor(
        max_workers=1, timeout=IDLE, initializer=begin, initargs=(os.getpid(),), env=ENVIRONMENT
    )


def begin(parent: int) -> None:
    """The first thing in a worker: Ctrl-C is the parent's to see, and a worker outlives no parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_watch, args=(parent,), daemon=True, name="lampyris-watch").start()


def _watch(parent: int) -> None:
    """End when the parent did: killed, it cannot say so."""
    while has_parent(parent):
        time.sleep(1.0)
    os._exit(1)


def _no_start(words: str) -> LampyrisError:
    return LampyrisError(
        "WORKER_START",
        f"a worker process does not start: {words}",
        where="workers",
        todo="run with one worker to see why, or look for a limit on memory or processes",
    )
