"""Calls in other processes that are stopped: the command line's by Ctrl-C, the app's by a cancellation."""

from __future__ import annotations

import json
import os
import signal
import struct
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from lampyris_selfcheck.checks.process.deadline_calls import FOR_MINUTES, SWARMS

MAPS = ("env-3", "caves-64", "hills-100", "street-256", "random-512")
PATIENCE_S = 120.0
"""After so many seconds a process that has not answered is killed."""
LONGER_S = 0.5
"""A call that was loading compiled code when it was stopped is made again, and stopped so much later."""
_SCENARIO: Mapping[str, Any] = {
    "version": 1, "start": None, "goal": None, "robot": {}, "preset": "robot", "moves": None, "law": None,
    "seed": 0, "obstacles": [], "edits": [], "simulate": {"ticks": None, "patience": None},
}  # fmt: skip
_LISTENED = """
import os, signal, sys, time
from lampyris.kernels._jit import Kernel
to, begun, real = int(sys.argv.pop(1)), [], Kernel._run
def loaded(self):
    return len(getattr(self._compiled, "overloads", ()))
def run(self, args):
    if not begun:
        begun.append(os.write(to, b"within\\n"))
    before, done = loaded(self), False
    try:
        result = real(self, args)
        done = True
        return result
    finally:
        broken_off = not (done or before) and "lampyris.kernels._machine" in sys.modules
        if loaded(self) != before or broken_off:
            os.write(to, b"loaded %.9f\\n" % time.perf_counter())
Kernel._run = run
"""
"""Words into a pipe: when the first kernel is called, and whenever one has been loaded."""
_COMMAND = f"""{_LISTENED}
signal.signal(signal.SIGINT, signal.default_int_handler)  # a job in the background ignores it
from lampyris.cli import main
main()
"""
_ENGINE = f"""{_LISTENED}
from lampyris.app.engine.engine import main
main()
"""


@dataclass(frozen=True)
class Long:
    """A call that is stopped long before its end.

    Parameters
    ----------
    map, planner : which.
    seconds : from when it is at work until it is stopped.
    """

    map: str
    planner: str
    seconds: float

    @property
    def later(self) -> Long:
        """The same, stopped later."""
        return replace(self, seconds=self.seconds + LONGER_S)

    @property
    def said(self) -> dict[str, Any]:
        """It, in words of JSON."""
        return {"map": self.map, "planner": self.planner, "seconds": self.seconds}


@dataclass(frozen=True)
class ProcessEnding:
    """How a process took it.

    Parameters
    ----------
    wall, cpu : seconds from when it was told to when it had answered; where the system does not tell the
        CPU time of another process, both are wall time.
    wrong : what is wrong with the answer; empty: nothing.
    loaded : whether compiled code was being loaded or made when it was told, or later.
    """

    wall: float
    cpu: float
    wrong: str
    loaded: bool = False


def long_of(rng: np.random.Generator) -> Long:
    """A drawn call."""
    where, who = MAPS[int(rng.integers(len(MAPS)))], SWARMS[int(rng.integers(len(SWARMS)))]
    return Long(where, who, float(2.0 ** rng.uniform(-7.0, 0.0)))


def interrupted(call: Long) -> ProcessEnding:
    """``lampyris plan`` in a process of its own, and Ctrl-C: until it is gone."""
    settings = [
        word for key, value in FOR_MINUTES.items() for word in ("--set", f"{key}={json.dumps(value)}")
    ]
    words = [sys.executable, "-P", "-c", _COMMAND, "1"]
    words += ["plan", call.map, "--planner", call.planner, *settings]
    before = _of_children()
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process, _given(process):
        assert process.stdout is not None
        assert process.stderr is not None
        if process.stdout.readline() != b"within\n":
            return ProcessEnding(0.0, 0.0, f"did not begin: {process.stderr.read().decode()[-500:]}")
        time.sleep(call.seconds)
        cpu, wall = _cpu(process.pid), time.perf_counter()
        process.send_signal(signal.SIGINT)
        process.wait()
        late = time.perf_counter() - wall
        told = (process.returncode, process.stderr.read().decode())
        loaded = _loaded_after(process.stdout.read(), wall)
    used = late if cpu is None else max(0.0, _of_children() - before - cpu)
    wrong = "" if told == (130, "interrupted\n") else f"exit code and words {told!r}"
    return ProcessEnding(late, min(late, used), wrong, loaded)


class AppEngine:
    """An engine of the app, spoken to through its pipes as its server does."""

    def __init__(self) -> None:
        self._told = tempfile.TemporaryFile()  # noqa: SIM115 - until the engine is closed
        words = (sys.executable, "-P", "-c", _ENGINE, "2")
        self._process = subprocess.Popen(
            words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._told
        )
        self._job = 0
        self._ready = False

    def cancelled(self, call: Long) -> ProcessEnding:
        """A plan that is asked for, and cancelled at its moment: until the answer has ended."""
        try:
            with _given(self._process):
                return self._cancelled(call)
        except BrokenPipeError:
            return ProcessEnding(0.0, 0.0, "the engine is gone")

    def _cancelled(self, call: Long) -> ProcessEnding:
        planner = {"name": call.planner, "settings": dict(FOR_MINUTES)}
        if not self._ready:
            self._start()
        self._job += 1
        self._say(job=self._job, verb="plan", scenario={**_SCENARIO, "map": call.map, "planner": planner})
        time.sleep(call.seconds)
        cpu, wall = _cpu(self._process.pid), time.perf_counter()
        self._say(cancel=self._job)
        answer = self._answer()
        late, after = time.perf_counter() - wall, _cpu(self._process.pid)
        used = late if cpu is None or after is None else after - cpu
        wrong = "" if answer == ["CANCELLED"] else f"answered {answer!r}"
        # Read where it stands: a seek would move where the engine writes, too.
        told = os.pread(self._told.fileno(), os.fstat(self._told.fileno()).st_size, 0)
        return ProcessEnding(late, min(late, used), wrong, _loaded_after(told, wall))

    def _start(self) -> None:
        """Wait until it has started: it answers a question that is soon answered."""
        self._job += 1
        self._say(job=self._job, verb="warm")
        self._answer()
        self._ready = True

    def _say(self, **said: Any) -> None:
        data = json.dumps(said).encode()
        assert self._process.stdin is not None
        self._process.stdin.write(struct.pack("<I", len(data)) + data)
        self._process.stdin.flush()

    def _answer(self) -> list[str]:
        """What the job's answer was, frame for frame; what is told beside it is left out."""
        told: list[str] = []
        assert self._process.stdout is not None
        while True:
            head = self._process.stdout.read(8)
            if len(head) < 8:
                return [*told, "the engine is gone"]
            size, job = struct.unpack("<II", head)
            piece = self._process.stdout.read(size)
            if job != self._job:
                told.append(f"job {job}")
            elif not size:
                return told
            elif piece[4:5] == b"X":
                told.append(str(json.loads(piece[5:])["code"]))
            elif piece[4:5] != b"P":
                told.append(piece[4:5].decode("ascii", "replace"))

    def close(self) -> None:
        """End it, whatever it is at."""
        self._process.kill()
        self._process.wait()
        for stream in (self._process.stdin, self._process.stdout):
            assert stream is not None
            with suppress(BrokenPipeError):
                stream.close()
        self._told.close()


def _loaded_after(told: bytes, moment: float) -> bool:
    """Whether a kernel was loaded at that moment or after, by the clock that all processes share."""
    lines = (line.split() for line in told.splitlines() if line.startswith(b"loaded "))
    return any(float(words[1]) >= moment for words in lines)


@contextmanager
def _given(process: subprocess.Popen[bytes]) -> Iterator[None]:
    """Kill it where it takes too long: anyone who waits for it reads an end then."""
    timer = threading.Timer(PATIENCE_S, process.kill)
    timer.daemon = True
    timer.start()
    try:
        yield
    except BaseException:
        process.kill()  # else anyone who leaves waits for the end of what takes minutes
        raise
    finally:
        timer.cancel()


def _cpu(pid: int) -> float | None:
    """CPU seconds that a process has used; None where the system does not tell."""
    if not sys.platform.startswith("linux"):
        return None
    try:
        return time.clock_gettime((~pid << 3) | 2)  # clock_getcpuclockid(3), as glibc and musl make it
    except OSError:
        return None


def _of_children() -> float:
    """CPU seconds of all processes that this one has started and that are over; 0 where nobody asks."""
    if not sys.platform.startswith("linux"):
        return 0.0
    import resource

    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
