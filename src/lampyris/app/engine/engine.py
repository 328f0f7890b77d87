"""An engine: a process that answers questions from its standard input on its standard output.

A question is a length (u32, little endian) and JSON ``{"job", "verb", ...}``; its answer is a length, and the
job's number and a frame; the end of an answer is a frame of length 0. Nothing else is ever written there, and
nothing is pickled. A question ``{"cancel": job}`` stops that job wherever it is, also within a compiled loop
(:mod:`lampyris._core.cancellation`), and says nothing to any other.

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
from collections.abc import Iterator
from functools import partial
from io import RawIOBase
from typing import Any, BinaryIO, NamedTuple, NoReturn, cast

from lampyris._core import cancellation
from lampyris._core.system import leave, limit_memory, limit_seconds

MEMORY = 2 * 2**30
"""Bytes of address space beyond what the libraries map."""
SECONDS = 60
"""CPU seconds a question may take."""
MAX_QUESTION = 2**26


class EngineJob(NamedTuple):
    """A question that was asked.

    Parameters
    ----------
    number : the server's; it gives each to one job alone.
    question : what was asked.
    stop : set once nobody waits for the answer any more. A job has its own, so that a cancellation that
        comes too late stops nobody.
    """

    number: int
    question: dict[str, Any]
    stop: cancellation.CancelToken


class JobReader:
    """Jobs from a stream, read by a thread of their own so that a cancellation is heard at any moment."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream
        self._jobs: queue.Queue[EngineJob] = queue.Queue()
        self._stops: dict[int, cancellation.CancelToken] = {}
        threading.Thread(target=self._read, daemon=True).start()

    def next(self) -> EngineJob:
        """The next job. Where there will be no more, the process ends instead."""
        return self._jobs.get()

    def done(self, job: EngineJob) -> None:
        """It is answered, and cannot be cancelled any more."""
        if self._stops.get(job.number) is job.stop:
            del self._stops[job.number]

    @property
    def first(self) -> int | None:
        """The number of the job that waits longest; None: none waits."""
        with self._jobs.mutex:
            return self._jobs.queue[0].number if self._jobs.queue else None

    @property
    def waiting(self) -> bool:
        """Whether there is a job that nobody has taken."""
        return not self._jobs.empty()

    def _read(self) -> None:
        while True:
            head = self._stream.read(4)
            size = struct.unpack("<I", head)[0] if len(head) == 4 else 0
            body = self._stream.read(size) if 0 < size <= MAX_QUESTION else b""
            if len(body) != size or not size:
                # The server is gone, or speaks another language: whatever is running is for nobody.
                leave()
            try:
                message = json.loads(body)
                cancels = message.get("cancel") is not None
                number = int(message["cancel"] if cancels else message.get("job", 0))
            except (ValueError, RecursionError, AttributeError, TypeError, OverflowError):
                os._exit(2)
            if not cancels:
                job = EngineJob(number, message, cancellation.CancelToken())
                self._stops[number] = job.stop
                self._jobs.put(job)
            elif (stop := self._stops.get(number)) is not None:
                stop.set()


def main() -> NoReturn:
    """Answer until the standard input ends. ``sys.argv``: CPU seconds of a question, bytes of memory."""
    from lampyris.app.engine import work
    from lampyris.app.engine.progress import heard, tell
    from lampyris.kernels._jit import on_compile

    seconds, memory = map(int, sys.argv[1:3]) if len(sys.argv) > 2 else (SECONDS, MEMORY)
    limit_memory(memory)
    out = cast(RawIOBase, os.fdopen(os.dup(1), "wb", buffering=0))
    # Whatever else prints, prints to stderr.
    os.dup2(2, 1)
    sys.stdout = sys.stderr
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # of a Ctrl-C the server decides
    asked = JobReader(sys.stdin.buffer)
    on_compile(lambda on: tell("compiling" if on else "working"))
    with heard(lambda piece: _beside(out, asked.first, piece)):
        _warm(asked)
    while True:
        job = asked.next()
        limit_seconds(seconds)
        with heard(partial(_beside, out, job.number)), cancellation.watching(stop=job.stop):
            for piece in _answered(work.answer(job.question, cancellation.checkpoint)):
                _write(out, struct.pack("<II", len(piece), job.number) + piece)
        asked.done(job)
        _write(out, struct.pack("<II", 0, job.number))


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
        leave()


def _warm(asked: JobReader) -> None:
    """Have the compiled code available, unless a request is already waiting."""
    from lampyris.app.engine import work

    for _ in _answered(work.warm({}, lambda: None)):
        if asked.waiting:
            return


def _answered(frames: Iterator[bytes]) -> Iterator[bytes]:
    """The frames; whatever goes wrong is the last of them."""
    from lampyris.app.engine.frames import error_frame, json_frame
    from lampyris.errors import InternalFault, LampyrisError, LimitError

    try:
        cancellation.checkpoint()  # it may have been cancelled while it waited
        yield from frames
    except cancellation.Cancelled:
        yield json_frame("X", {"code": "CANCELLED", "what": "stopped"})
    except LampyrisError as fault:
        yield error_frame(fault)
    except MemoryError:
        yield error_frame(LimitError("MEMORY", "this needs more memory than a job of the app may have"))
    except Exception as fault:
        yield error_frame(InternalFault("INTERNAL", f"{type(fault).__name__}: {fault}"[:500]))


if __name__ == "__main__":
    main()
