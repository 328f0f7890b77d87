"""Clocks that stand still while machine code is loaded or compiled.

Importing numba takes a fifth of a second, a kernel that is compiled for the first time on a machine a second
or more, one that an earlier run left on disk about 5 ms. Each happens once, within whatever call needs it
first. So that the first plan of a process and the second take the same time, times of planning are
differences of :func:`wall` or :func:`cpu`, and :func:`seconds` says what was left out. Time limits do not count
it either.

Each thread has clocks of its own: what another one loads is not left out of this one's times.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from lampyris._core import cancellation
from lampyris._core.system import thread_seconds


class _Loaded(threading.local):
    """What this thread has spent."""

    depth = 0
    wall = 0.0
    cpu = 0.0


_loaded = _Loaded()


def wall() -> float:
    """Seconds as of ``time.perf_counter``, without what this thread has spent on loading and compiling."""
    return time.perf_counter() - _loaded.wall


def cpu() -> float:
    """Seconds as of ``time.thread_time``, without what this thread has spent on loading and compiling."""
    return thread_seconds() - _loaded.cpu


def seconds() -> float:
    """Seconds that this thread has spent on loading and compiling."""
    return _loaded.wall


@contextmanager
def loading() -> Iterator[None]:
    """Have both clocks stand still meanwhile. A kernel that needs another loads it within."""
    here = _loaded
    if here.depth:
        yield
        return
    with cancellation.paused():
        wall, cpu = time.perf_counter(), thread_seconds()
        try:
            here.depth = 1
            yield
        finally:
            here.depth = 0
            here.wall += time.perf_counter() - wall
            here.cpu += thread_seconds() - cpu
