"""Engines: the processes that do the work, as the server has them.

At most so many questions are answered at a time, one by each engine; some more wait, and others are refused.
One engine more answers plans and layers alone, so that what follows the hand never waits for what takes long.
An engine that dies (it used up its processor time, or crashed) is restarted, and the client is ending so.
Nobody reads: nobody writes. What is not taken from an answer stays in the pipe, and the engine stands still.
"""

from __future__ import annotations

import asyncio
import json
import os
import struct
import sys
from collections import deque
from collections.abc import AsyncIterator, Mapping, Sequence
from contextlib import suppress
from itertools import count
from pathlib import Path
from typing import Any, Final, NamedTuple

from lampyris._core import system
from lampyris.app.engine.engine import MAX_QUESTION, MEMORY, SECONDS
from lampyris.app.engine.frames import error_frame
from lampyris.errors import InputError, InternalFault, LampyrisError, LimitError

WORKERS: Final = 2
QUICK: Final = 1
"""Engines for short questions alone. Keeping one of the two above would have runs wait for comparisons."""
SHORT: Final = ("plan", "layer")
QUEUE: Final = 8
LATER: Final = 3.0
"""Seconds after which the engines start that are not asked first."""
GRACE: Final = 0.5
"""Seconds that a cancelled job has to stop by itself."""
SILENCE: Final = 300.0
"""Seconds without a frame after which an engine is ended: five times what it may compute."""
MAX_FRAME: Final = 2**28
COMMAND: Final = (sys.executable, "-P", "-m", "lampyris.app.engine.engine")
"""-P: a file in the folder where the app is started must not stand in for a module."""


class Busy(LimitError):
    """All engines are at work, and as many questions wait as may."""

    def __init__(self, running: int, waiting: int) -> None:
        super().__init__(
            "BUSY",
            f"the app is busy: {running} jobs run and {waiting} wait",
            allowed=f"{running} running and {waiting} waiting",
            todo="try again in a moment, or stop what runs",
        )

    def __reduce__(self) -> tuple[object, ...]:
        return (Exception, (str(self),))


class _Turn(NamedTuple):
    """A waiting client."""

    job: int
    short: bool
    turn: asyncio.Future[_Engine | None]


class Engines:
    """Some engines and those who wait for one.

    Parameters
    ----------
    workers : engines for whatever is asked.
    queue : questions that may wait besides; as many short ones.
    quick : engines more, for short questions (:data:`SHORT`) alone.
    command : an engine; it is given its limits as two more words.
    seconds, memory : CPU seconds of a question, and bytes of memory beyond what the libraries take.
    silence : seconds that an engine may say nothing.
    folder : for temporary files, which an engine that is ended leaves behind; None: the system's.
    """

    def __init__(
        self,
        workers: int = WORKERS,
        queue: int = QUEUE,
        *,
        quick: int = QUICK,
        command: Sequence[str] = COMMAND,
        seconds: int = SECONDS,
        memory: int = MEMORY,
        folder: Path | None = None,
        silence: float = SILENCE,
    ) -> None:
        self._workers, self._queue = workers, queue
        self.silence = silence
        self._seconds = seconds
        self._command = (*command, str(seconds), str(memory))
        self._numbers = count(1)
        # The last is taken first: a short question goes where others of its kind have left their fields.
        self._idle: list[_Engine] = [
            _Engine(self._command, folder, k >= workers) for k in range(workers + quick)
        ]
        self._all = tuple(self._idle)
        self._running: dict[int, _Engine] = {}
        self._waiting: deque[_Turn] = deque()
        self._cancelled: set[int] = set()
        self._tasks: set[asyncio.Task[None]] = set()
        self._closed = False

    async def start(self) -> None:
        """Start them before the first question: loading compiled code takes two seconds of a processor each.

        The one that is asked first begins at once, the others :data:`LATER` seconds after it, or when they are asked: all at
        the same time would keep the first page waiting on a machine with two processors.
        """
        first, later = self._idle[-1:], self._idle[:-1]
        await asyncio.gather(*(engine.start() for engine in first))
        task = asyncio.ensure_future(self._start_later(later))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _start_later(self, engines: Sequence[_Engine]) -> None:
        await asyncio.sleep(LATER)
        for engine in engines:
            if not self._closed:
                await engine.start()

    async def ask(self, question: Mapping[str, Any]) -> AsyncIterator[bytes]:
        """The frames of the answer, each whole; the last is ``Z`` or ``X``. Closing it cancels the job.

        Raises
        ------
        Busy : too many jobs.
        LimitError : QUESTION_SIZE.
        """
        job = next(self._numbers)
        data = json.dumps({**question, "job": job}, separators=(",", ":")).encode()
        if len(data) > MAX_QUESTION:
            raise LimitError("QUESTION_SIZE", f"{len(data):,} bytes", allowed=f"at most {MAX_QUESTION:,}")
        engine = await self._free(job, question.get("verb") in SHORT)
        if engine is None:
            yield error_frame(_CANCELLED)
            return
        self._running[job] = engine
        whole = faulty = False
        before = system.killed_for_memory()
        try:
            await engine.tell(data)
            while True:
                piece = await engine.piece(job, self.silence)
                if piece is None:
                    whole = True
                    return
                if not piece:
                    break
                faulty = piece[4:5] == b"X"
                yield piece
            died = await engine.ended()
            whole = True
        finally:
            stopped = job in self._cancelled
            self._cancelled.discard(job)
            if whole:
                self._give_back(job, engine)
            else:
                # The asker has gone, and may not wait here for the job to end.
                task = asyncio.ensure_future(self._settle(job, engine))
                self._tasks.add(task)
                task.add_done_callback(self._tasks.discard)
        if not faulty:
            yield error_frame(_CANCELLED if stopped else self._why(died, engine, before))

    async def cancel(self, job: int) -> None:
        """Stop a job: it is asked to, and ended if it has not after half a second. Unknown jobs are none."""
        for number, _, turn in self._waiting:
            if number == job and not turn.done():
                turn.set_result(None)
                return
        engine = self._running.get(job)
        if engine is None:
            return
        self._cancelled.add(job)
        await engine.cancel(job)
        for _ in range(round(GRACE / 0.02)):
            await asyncio.sleep(0.02)
            if self._running.get(job) is not engine:
                return
        engine.kill()

    async def close(self) -> None:
        """End all of them."""
        self._closed = True
        for *_, turn in self._waiting:
            if not turn.done():
                turn.set_result(None)
        for task in tuple(self._tasks):
            task.cancel()
        await asyncio.gather(*(engine.close() for engine in self._all), return_exceptions=True)

    # ---- turns --------------------

    async def _free(self, job: int, short: bool) -> _Engine | None:
        """An engine that has nothing to do; None: cancelled while waiting."""
        if self._closed:
            return None
        for engine in reversed(self._idle):
            if short or not engine.quick:
                self._idle.remove(engine)
                return engine
        if sum(one.short == short for one in self._waiting) >= self._queue:
            raise Busy(self._workers, self._queue)
        mine = _Turn(job, short, asyncio.get_running_loop().create_future())
        self._waiting.append(mine)
        try:
            return await mine.turn
        except asyncio.CancelledError:
            if mine.turn.done() and not mine.turn.cancelled() and (given := mine.turn.result()) is not None:
                self._pass_on(given)
            raise
        finally:
            with suppress(ValueError):
                self._waiting.remove(mine)

    def _give_back(self, job: int, engine: _Engine) -> None:
        self._running.pop(job, None)
        self._pass_on(engine)

    def _pass_on(self, engine: _Engine) -> None:
        """To the next who waits for one of its kind."""
        for one in tuple(self._waiting):
            if one.turn.done() or (engine.quick and not one.short):
                continue
            self._waiting.remove(one)
            one.turn.set_result(engine)
            return
        self._idle.append(engine)
        self._idle.sort(key=lambda one: one.quick)

    async def _settle(self, job: int, engine: _Engine) -> None:
        """An answer that nobody reads: let it end, or end it."""
        try:
            await engine.cancel(job)
            async with asyncio.timeout(GRACE):
                while await engine.piece(job):
                    pass
        except TimeoutError:
            engine.kill()
            await engine.ended()
        finally:
            self._give_back(job, engine)

    def _why(self, code: int, engine: _Engine, before: int) -> LampyrisError:
        """Why an engine ended in the middle of a job; ``before``: :func:`system.killed_for_memory` at its beginning."""
        if engine.silent:
            return InternalFault("ENGINE", f"nothing came of this for {self.silence:g} seconds")
        if engine.nonsense:
            return InternalFault("ENGINE", "the process that worked on this sent something that is no answer")
        if system.ran_out_of_seconds(code):
            return LimitError(
                "CPU_LIMIT",
                f"this took more than {self._seconds} seconds of processor time",
                allowed=f"{self._seconds} seconds a job",
                todo="take a smaller map or fewer ticks, or use the command line, which has no such limit",
            )
        if system.was_killed(code) and system.killed_for_memory() > before:
            return LimitError(
                "MEMORY", "the system ended this job for want of memory",
                todo="end other programs, or take a smaller map",
            )  # fmt: skip
        ending = f"signal {-code}" if code < 0 else f"exit code {code}"
        fault = InternalFault("ENGINE", f"the process that worked on this ended unexpectedly ({ending})")
        fault.todo = "another one has been started; please report this"
        return fault


_TEMPORARY: Final = ("TMPDIR", "TEMP", "TMP")


_CANCELLED: Final = InputError("CANCELLED", "stopped")


class _Engine:
    """One process; started when it is needed, and again after its end."""

    def __init__(self, command: Sequence[str], folder: Path | None = None, quick: bool = False) -> None:
        self._command, self.quick = command, quick
        self._env = {**os.environ, **({} if folder is None else dict.fromkeys(_TEMPORARY, str(folder)))}
        self._process: asyncio.subprocess.Process | None = None
        self._starting = asyncio.Lock()
        self._killed = False
        self.silent = self.nonsense = False
        """Whether the present process, or the last, was ended for what it said."""

    async def start(self) -> asyncio.subprocess.Process:
        """The process, started if there is none."""
        async with self._starting:  # or a second question would start it again
            if self._process is not None and self._killed:
                # It may have said its last word in time, and is not buried yet.
                await self._process.wait()
            if self._process is None or self._process.returncode is not None:
                self.nonsense = self.silent = self._killed = False
                self._process = await asyncio.create_subprocess_exec(
                    *self._command,
                    stdin=asyncio.subprocess.PIPE,
                    stdout=asyncio.subprocess.PIPE,
                    stderr=None if os.environ.get("LAMPYRIS_DEBUG") else asyncio.subprocess.DEVNULL,
                    env=self._env,
                    # A group of its own: what it may have started ends with it.
                    start_new_session=True,
                    limit=2**20,
                )
            return self._process

    async def tell(self, data: bytes) -> None:
        """Send a message."""
        process = await self.start()
        assert process.stdin is not None
        with suppress(ConnectionError):
            process.stdin.write(struct.pack("<I", len(data)) + data)
            await process.stdin.drain()

    async def cancel(self, job: int) -> None:
        """Ask it to stop."""
        if self._process is not None and self._process.returncode is None:
            await self.tell(json.dumps({"cancel": job}).encode())

    async def piece(self, job: int, silence: float = SILENCE) -> bytes | None:
        """The next frame; None: that was all; empty: it has ended, or was for nonsense or for silence."""
        process = self._process
        assert process is not None
        assert process.stdout is not None
        try:
            async with asyncio.timeout(silence):
                head = await process.stdout.readexactly(8)
            size, of = struct.unpack("<II", head)
            if of != job or size > MAX_FRAME:
                self.nonsense = True
                self.kill()
                return b""
            return await process.stdout.readexactly(size) if size else None
        except TimeoutError:
            self.silent = True
            self.kill()
            return b""
        except (asyncio.IncompleteReadError, ConnectionError):
            return b""

    async def ended(self) -> int:
        """Wait for its end: its exit code."""
        process = self._process
        if process is None:
            return 0
        try:
            async with asyncio.timeout(GRACE):
                await process.wait()
        except TimeoutError:
            self.kill()
        finally:
            system.end_group(process.pid)
        return await process.wait()

    def kill(self) -> None:
        """End it now."""
        if self._process is not None:
            self._killed = True
            with suppress(ProcessLookupError):
                self._process.kill()
            system.end_group(self._process.pid)

    async def close(self) -> None:
        """End it: it does so by itself when nothing can be asked any more."""
        process = self._process
        if process is None or process.returncode is not None:
            return
        if process.stdin is not None:
            process.stdin.close()
        await self.ended()
