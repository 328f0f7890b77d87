"""Cluster: batches done by the workers of a Dask cluster that is already running.

What crosses the network: the name of :func:`errand` and of the work, bytes to the workers, bytes back. Dask
writes calls and errors with pickle; ours hold names, text and bytes only, no code of ours and no objects.
An answer is parsed as JSON and judged like any other, so that a worker that lies gets no row past the judge.

A process does one batch at a time, whatever threads it has: what :mod:`lampyris.study.execution.worker` keeps between jobs
is not made for two at once. So start workers with ``--nthreads 1``, one a core.

What trust remains: the client of Dask itself unpickles messages of its scheduler, and workers unpickle what
their scheduler sends. Anyone who can speak as the scheduler can run code on both. Use an address that only
you can reach, or ``tls://`` with the certificates of Dask's configuration.
"""

from __future__ import annotations

import logging
import queue
import threading
import time
from collections.abc import Mapping
from importlib.util import find_spec
from pkgutil import resolve_name
from typing import Any, Final

from lampyris import __version__
from lampyris.errors import InputError, LampyrisError, UsageError
from lampyris.planning.registry import origin_of
from lampyris.study.design.study import RESULTS
from lampyris.study.execution.batches import Batch
from lampyris.study.execution.pool import BatchResult, Work, fault_text

ANSWERS_IN: Final = 10.0
"""Seconds in which a scheduler must answer, and in which its first worker must be there."""
GONE: Final = 30.0
"""Seconds without a scheduler, and :data:`EMPTY` without a single worker, end the study."""
EMPTY: Final = 300.0
LOOK: Final = 2.0
"""Seconds between two looks at who is there."""
RETRIES: Final = 2
"""Times that Dask asks again by itself after an error of its own."""
DEPTH: Final = 2
"""Batches a worker: one that is worked on, one that waits."""
OTHER: Final = b"other version: "
"""How an answer begins if the worker has another version of lampyris than the client."""


class Cluster:
    """The workers of a Dask cluster.

    Parameters
    ----------
    work : a function of a module that the workers have, too.
    address : of the scheduler.
    third_party : distribution and version of each planner that is not ours, by its name.

    Raises
    ------
    UsageError
        CLUSTER_MISSING: ``distributed`` is not installed.
    InputError
        CLUSTER_ADDRESS: no scheduler answers there; CLUSTER_EMPTY: there are no workers (any more);
        CLUSTER_GONE: the scheduler went away; WORKER_VERSION: a worker has another lampyris, or none.
    """

    def __init__(self, work: Work, address: str, third_party: Mapping[str, str]) -> None:
        self._work, self._address = work, address
        self._version = [__version__, RESULTS, dict(third_party)]
        self._ended: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._asked: dict[str, tuple[Batch, Any, float]] = {}
        self._number = 0
        self._there: frozenset[str] = frozenset()
        self._looked = self._seen = self._heard = 0.0
        self.died = 0
        distributed = _distributed()  # Before the hush: it sets the levels of its logs as it is imported.
        self._hush = _Hush()
        try:
            self._client = _client(distributed, address)
        except BaseException:
            self._hush.over()
            raise
        try:
            self._wait()
        except BaseException:
            self.stop(True)
            raise

    @property
    def workers(self) -> int:
        """Worker processes."""
        return len(self._there)

    def room(self, seconds: float) -> bool:
        """See :class:`lampyris.study.execution.pool.Executor`."""
        if self._client.status != "running":
            return False
        return len(self._asked) < max(DEPTH * self.workers, 1)

    def ask(self, batch: Batch, letter: bytes) -> None:
        """See :class:`lampyris.study.execution.pool.Executor`."""
        self._number += 1
        key = f"lampyris-{self._number}-{self._client.id}"
        future = self._client.submit(
            errand, self._work, self._version, letter, key=key, pure=False, retries=RETRIES
        )
        self._asked[key] = batch, future, time.perf_counter()
        future.add_done_callback(lambda future: self._ended.put(future.key))

    def answers(self, timeout: float) -> list[BatchResult]:
        """See :class:`lampyris.study.execution.pool.Executor`."""
        self._look()
        keys: list[str] = []
        try:
            keys.append(self._ended.get(timeout=timeout) if timeout else self._ended.get_nowait())
            while True:
                keys.append(self._ended.get_nowait())
        except queue.Empty:
            return [self._answer(*self._asked.pop(key)) for key in dict.fromkeys(keys) if key in self._asked]

    def stop(self, now: bool) -> None:
        """Leave. The scheduler drops what nobody waits for any more."""
        try:
            self._client.close(timeout=LOOK)
        finally:
            self._hush.over()

    def _answer(self, batch: Batch, future: Any, asked: float) -> BatchResult:
        """What became of one batch that ended."""
        from distributed.scheduler import KilledWorker

        status = future.status
        if status not in ("finished", "error"):
            return BatchResult(
                batch, "lost"
            )  # The connection to the scheduler broke: that cancels everything.
        try:
            answer = future.result(timeout=GONE)
        except KilledWorker:  # So many workers died of it as the scheduler allows, 3 by Dask's default.
            return BatchResult(batch, "died")
        except Exception as fault:
            if status == "error":
                return BatchResult(batch, "fault", words=fault_text(fault))
            return BatchResult(batch, "lost")  # The worker that held the answer is gone, and nobody redid it.
        if not isinstance(answer, bytes):
            return BatchResult(
                batch, "fault", words=f"an answer that is a {type(answer).__name__}, not bytes"
            )
        if answer.startswith(OTHER):
            text = answer[len(OTHER) :].decode("ascii", "replace")[:200]
            raise _other_version(self._address, text, repr(self._version))
        return BatchResult(batch, "back", answer, (time.perf_counter() - asked) / DEPTH)

    def _wait(self) -> None:
        """Wait for the first worker."""
        until = time.perf_counter() + ANSWERS_IN
        self._heard = self._seen = time.perf_counter()
        while True:
            self._looked = 0.0
            self._look()
            if self._there:
                return
            if time.perf_counter() >= until:
                raise _empty(self._address, ANSWERS_IN)
            time.sleep(0.1)

    def _look(self) -> None:
        """See who is there, and ask those that are new which version they have."""
        now = time.perf_counter()
        if now - self._looked < LOOK:
            return
        self._looked = now
        if self._client.status != "running":
            if self._client.status == "closed" or now - self._heard > GONE:
                raise _gone(self._address)
            return
        try:
            there = frozenset(self._client.nthreads())
        except Exception:  # The connection broke as it was used; the next look says so.
            return
        self._heard = now
        if new := sorted(there - self._there):
            self._check_versions(new)
        self.died += len(self._there - there)
        self._there = there
        if there:
            self._seen = now
        elif now - self._seen > EMPTY:
            raise _empty(self._address, EMPTY)

    def _check_versions(self, workers: list[str]) -> None:
        """Refuse a worker with another lampyris: the version is part of every key.

        It is asked through a function of Python's own: a worker without lampyris cannot even read a call of
        one of ours, and Dask's client then waits forever. :func:`errand` looks once more.
        """
        for name, own in (
            ("lampyris:__version__", __version__),
            ("lampyris.study.design.study:RESULTS", RESULTS),
        ):
            text = self._client.run(resolve_name, name, workers=workers, on_error="return")
            for worker, found in text.items():
                if isinstance(found, ImportError | AttributeError):
                    raise _other_version(worker, fault_text(found), repr(self._version))
                if isinstance(found, str | int) and found != own:
                    raise _other_version(worker, repr(found)[:100], repr(self._version))


_one_at_a_time = threading.Lock()


def errand(work: Work, expected: list[Any], letter: bytes) -> bytes:
    """The work, done on a worker if it has the versions of the client: ours, and those of third-party planners."""
    own = [__version__, RESULTS, {name: _origin(name) for name in expected[2]}]
    if own != expected:
        return OTHER + repr(own).encode("ascii", "replace")
    with _one_at_a_time:
        return work(letter)


def _distributed() -> Any:
    """The package."""
    if find_spec("distributed") is None:
        raise UsageError(
            "CLUSTER_MISSING",
            "studies on a cluster need the package distributed, which is not installed",
            where="dask",
            todo="pip install 'lampyris[dask]'",
        )
    import distributed

    return distributed


def _client(distributed: Any, address: str) -> Any:
    """A connection to a scheduler."""
    try:
        return distributed.Client(address, timeout=ANSWERS_IN, set_as_default=False, name="lampyris-study")
    except (OSError, ValueError, TypeError) as fault:
        raise InputError(
            "CLUSTER_ADDRESS",
            f"no Dask scheduler answers in {ANSWERS_IN:g} s ({fault_text(fault)})",
            where=address,
            todo="start one with `dask scheduler`, or correct the address",
        ) from None


class _Hush:
    """Dask logs what we say ourselves, in our own words; quiet until ``over``."""

    NAMES = ("client", "comm", "core", "utils", "utils_comm", "batched")

    def __init__(self) -> None:
        loggers = [logging.getLogger(f"distributed.{name}") for name in self.NAMES]
        self._levels = [(logger, logger.level) for logger in loggers]
        for logger in loggers:
            logger.setLevel(logging.CRITICAL + 1)

    def over(self) -> None:
        """Let them speak again."""
        for logger, level in self._levels:
            logger.setLevel(level)


def _empty(address: str, seconds: float) -> LampyrisError:
    return InputError(
        "CLUSTER_EMPTY",
        f"the cluster has had no worker for {seconds:g} s",
        where=address,
        todo="start workers with `dask worker`; what is stored stays, and the study goes on from there",
    )


def _gone(address: str) -> LampyrisError:
    return InputError(
        "CLUSTER_GONE",
        "the Dask scheduler went away",
        where=address,
        todo="start it again; what is stored stays, and the study goes on from there",
    )


def _origin(name: str) -> str:
    """Where a planner comes from here."""
    try:
        return origin_of(name)
    except UsageError:
        return "not installed"


def _other_version(where: str, found: str, allowed: str) -> LampyrisError:
    return InputError(
        "WORKER_VERSION",
        f"a worker has another lampyris, or other third-party planners: {found}",
        where=where,
        allowed=allowed,
        todo="install the same version everywhere; it is part of every key",
    )
