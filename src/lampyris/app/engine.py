"""An engine: a process that answers questions from its standard input on its standard output.

A question is a length (u32, little endian) and JSON ``{"job", "verb", ...}``; its answer is a length, and the
job's number and a frame; the end of an answer is a frame of length 0. Nothing else is ever written there, and
nothing is pickled. A question ``{"cancel": job}`` that comes while another is answered stops that one at its
next tick.

Limits are set by the engine on itself before it reads anything: memory once, CPU seconds for each question.
"""

from __future__ import annotations

import json
import os
import queue
import signal
import struct
import sys
import threading
from collections.abc import Callable, Iterator
from functools import partial
from io import RawIOBase
from typing import Any, BinaryIO, NoReturn, cast

MEMORY = 2 * 2**30
"""Bytes of address space beyond what the libraries map."""
SECONDS = 60
"""CPU seconds a question may take."""
MAX_QUESTION = 2**26


class Cancelled(Exception):
    """Nobody waits for the answer any more."""


class Asked:
    """Questions from a stream, read by a thread of their own so that a cancellation is seen in time."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream
        self._questions: queue.Queue[dict[str, Any]] = queue.Queue()
        self._cancelled: set[int] = set()
        threading.Thread(target=self._read, daemon=True).start()

    def next(self) -> dict[str, Any]:
        """The next question. Where there will be no more, the process ends instead."""
        return self._questions.get()

    @property
    def first(self) -> int | None:
        """The job that waits longest; None: none waits."""
        with self._questions.mutex:
            said = self._questions.queue[0] if self._questions.queue else None
        return None if said is None else int(said.get("job", 0))

    @property
    def waiting(self) -> bool:
        """Whether there is a question that nobody has taken."""
        return not self._questions.empty()

    def look(self, job: int) -> Callable[[], None]:
        """A function that raises :class:`Cancelled` once the job is cancelled."""

        def check() -> None:
            if job in self._cancelled:
                raise Cancelled

        return check

    def _read(self) -> None:
        while True:
            head = self._stream.read(4)
            size = struct.unpack("<I", head)[0] if len(head) == 4 else 0
            body = self._stream.read(size) if 0 < size <= MAX_QUESTION else b""
            if len(body) != size or not size:
                # The server is gone, or speaks another language: whatever is running is for nobody.
                _leave()
            try:
                said = json.loads(body)
                cancelled, job = said.get("cancel"), int(said.get("job", 0))
            except (ValueError, RecursionError, AttributeError, TypeError):
                os._exit(2)
            if cancelled is None:
                self._cancelled.discard(job)
                self._questions.put(said)
            else:
                self._cancelled.add(cancelled)


def _leave() -> NoReturn:
    """End now, and with us whatever a job has started, if we lead a group of our own."""
    if hasattr(os, "killpg") and os.getpgrp() == os.getpid():
        os.killpg(0, signal.SIGKILL)
    os._exit(0)


def main() -> NoReturn:
    """Answer until the standard input ends. ``sys.argv``: CPU seconds of a question, bytes of memory."""
    from lampyris.app import work
    from lampyris.app.telling import heard, tell
    from lampyris.kernels._jit import on_compile

    seconds, memory = map(int, sys.argv[1:3]) if len(sys.argv) > 2 else (SECONDS, MEMORY)
    limit_memory(memory)
    out = cast(RawIOBase, os.fdopen(os.dup(1), "wb", buffering=0))
    # Whatever else prints, prints to stderr.
    os.dup2(2, 1)
    sys.stdout = sys.stderr
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # of a Ctrl-C the server decides
    asked = Asked(sys.stdin.buffer)
    on_compile(lambda on: tell("compiling" if on else "working"))
    with heard(lambda piece: _beside(out, asked.first, piece)):
        _warm(asked)
    while True:
        question = asked.next()
        job = int(question["job"])
        limit_seconds(seconds)
        with heard(partial(_beside, out, job)):
            for piece in _answered(work.answer(question, asked.look(job))):
                _write(out, struct.pack("<II", len(piece), job) + piece)
        _write(out, struct.pack("<II", 0, job))


def _beside(out: RawIOBase, job: int | None, piece: bytes) -> None:
    """Tell a job something that is not its answer."""
    if job is not None:
        _write(out, struct.pack("<II", len(piece), job) + piece)


def _write(out: RawIOBase, data: bytes) -> None:
    """All of it: a pipe takes what it has room for."""
    rest = memoryview(data)
    try:
        while rest:
            rest = rest[out.write(rest) or 0 :]
    except BrokenPipeError:
        # The server is gone, and this was noticed before the questions ended.
        _leave()


def _warm(asked: Asked) -> None:
    """Have the compiled code at hand, unless somebody is already waiting."""
    from lampyris.app import work

    for _ in _answered(work.warm({}, lambda: None)):
        if asked.waiting:
            return


def _answered(frames: Iterator[bytes]) -> Iterator[bytes]:
    """The frames; whatever goes wrong is the last of them."""
    from lampyris.app.frames import error_frame, json_frame
    from lampyris.errors import InternalFault, LampyrisError, LimitError

    try:
        yield from frames
    except Cancelled:
        yield json_frame("X", {"code": "CANCELLED", "what": "stopped"})
    except LampyrisError as fault:
        yield error_frame(fault)
    except MemoryError:
        yield error_frame(LimitError("MEMORY", "this needs more memory than a job of the app may have"))
    except Exception as fault:
        yield error_frame(InternalFault("INTERNAL", f"{type(fault).__name__}: {fault}"[:500]))


def limit_memory(more: int) -> None:
    """Let this process map so many bytes more than it does now; systems that know no such limit keep none."""
    try:
        import resource

        with open("/proc/self/statm") as told:
            now = int(told.read().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (now + more, now + more))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    except (ImportError, OSError, ValueError):
        pass


def limit_seconds(more: int) -> None:
    """Let this process use so many CPU seconds more; then the system ends it."""
    try:
        import resource

        used = sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
        hard = resource.getrlimit(resource.RLIMIT_CPU)[1]
        resource.setrlimit(resource.RLIMIT_CPU, (int(used) + more + 1, hard))
    except (ImportError, OSError, ValueError):
        pass


if __name__ == "__main__":
    main()
