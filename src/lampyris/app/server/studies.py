"""Studies: those that run beside the page, one after the other, each in a process of its own."""

from __future__ import annotations

import asyncio
import json
import os
import secrets
import sys
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from lampyris.app.engine.study_process import REPORT
from lampyris.errors import FileError, LimitError

MOST: Final = 16
"""Studies that are remembered; the oldest that is over is forgotten first."""
MOST_WAITING: Final = 4
MAX_LINE: Final = 2**20
_COMMAND: Final = (sys.executable, "-P", "-m", "lampyris.app.engine.study_process")
_OVER: Final = ("done", "failed", "cancelled")


@dataclass(eq=False)
class _Job:
    """One study."""

    question: dict[str, Any]
    folder: Path
    status: dict[str, Any] = field(default_factory=lambda: {"state": "waiting", "done": 0, "total": 0})
    process: asyncio.subprocess.Process | None = None

    @property
    def over(self) -> bool:
        return self.status["state"] in _OVER


class Studies:
    """The studies of a server.

    Parameters
    ----------
    folder : where stores and reports are kept, for as long as the server runs.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder / "studies"
        self._jobs: dict[str, _Job] = {}
        self._turn = asyncio.Lock()
        self._tasks: set[asyncio.Task[None]] = set()

    async def start(self, body: Mapping[str, Any]) -> str:
        """Begin a study, or have it wait for its turn; its job.

        Parameters
        ----------
        body : ``scenario``, ``ground`` if its map is no bundled one, ``planners``, ``laws``, ``seeds`` and
            ``queries``: see :func:`lampyris.app.engine.study_process.study_data`.

        Raises
        ------
        LimitError : BUSY. FileError : no scenario.
        """
        if sum(not job.over for job in self._jobs.values()) > MOST_WAITING:
            raise LimitError(
                "BUSY", "too many studies wait", allowed=f"{MOST_WAITING}", todo="wait for one to end"
            )
        scenario = body.get("scenario")
        if not isinstance(scenario, dict):
            raise FileError("KEY", "no scenario", where="scenario", allowed="a table")
        number = f"s{secrets.token_hex(8)}"
        folder = self._folder / number
        folder.mkdir(mode=0o700, parents=True)
        self._jobs[number] = job = _Job(dict(body), folder)
        self._forget()
        task = asyncio.ensure_future(self._run(job))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return number

    def progress(self, job: str) -> dict[str, Any]:
        """How far it is: ``state`` (waiting, running, ..., done, failed, cancelled), ``done``, ``total``,
        ``left_s``, ``report``, ``error``, ``notes``.

        Raises
        ------
        FileError : JOB.
        """
        return dict(self._of(job).status)

    def report(self, job: str) -> bytes:
        """The report's page.

        Raises
        ------
        FileError : JOB: no such study, or it is not done.
        """
        found = self._of(job)
        if found.status["state"] != "done":
            raise FileError("JOB", f"this study is {found.status['state']}", todo="wait until it is done")
        return (found.folder / REPORT).read_bytes()

    async def cancel(self, job: str) -> None:
        """End a study; what it has is dropped with the server.

        Raises
        ------
        FileError : JOB.
        """
        found = self._of(job)
        if not found.over:
            found.status["state"] = "cancelled"
            _kill(found)

    async def close(self) -> None:
        """End all of them."""
        for job in self._jobs.values():
            if not job.over:
                job.status["state"] = "cancelled"
            _kill(job)
        await asyncio.gather(*self._tasks, return_exceptions=True)

    def _of(self, job: str) -> _Job:
        if job not in self._jobs:
            raise FileError("JOB", "there is no such study", where=ascii(job[:40])[1:-1])
        return self._jobs[job]

    def _forget(self) -> None:
        over = [number for number, job in self._jobs.items() if job.over]
        for number in over[: max(len(self._jobs) - MOST, 0)]:
            del self._jobs[number]

    async def _run(self, job: _Job) -> None:
        async with self._turn:
            if job.over:
                return
            job.process = process = await asyncio.create_subprocess_exec(
                *_COMMAND,
                str(job.folder),
                stdin=asyncio.subprocess.PIPE,
                stdout=asyncio.subprocess.PIPE,
                stderr=None if os.environ.get("LAMPYRIS_DEBUG") else asyncio.subprocess.DEVNULL,
                limit=MAX_LINE,
            )
            assert process.stdin is not None
            assert process.stdout is not None
            with suppress(ConnectionError):
                process.stdin.write(json.dumps(job.question, separators=(",", ":")).encode() + b"\n")
                await process.stdin.drain()
            with suppress(ValueError):  # a line longer than any of ours
                while line := await process.stdout.readline():
                    if not job.over:
                        job.status |= json.loads(line)
            _kill(job)
            await process.wait()
            if not job.over:
                what = {"code": "STUDY", "what": "the process of the study ended unexpectedly"}
                job.status |= {"state": "failed", "error": what}


def _kill(job: _Job) -> None:
    if job.process is not None:
        with suppress(ProcessLookupError):
            job.process.kill()
