"""Calls in other processes that are stopped: the command line's by Ctrl-C, the app's by a cancellation."""

from __future__ import annotations

import json
import signal
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from lampyris_selfcheck.checks.process.deadline_calls import FOR_MINUTES, SWARMS

MAPS = ("env-3", "caves-64", "hills-100", "street-256", "random-512")
PATIENCE_S = 120.0
"""After so many seconds a process that has not answered is killed."""
_SCENARIO: Mapping[str, Any] = {
    "version": 1, "start": None, "goal": None, "robot": {}, "preset": "robot", "moves": None, "law": None,
    "seed": 0, "obstacles": [], "edits": [], "simulate": {"ticks": None, "patience": None},
}  # fmt: skip
COMMAND = """
import os, signal
from lampyris.kernels._jit import Kernel
run = Kernel._run
def first(self, args):
    Kernel._run = run
    os.write(1, b"within\\n")  # the first kernel is called: it is at work
    return run(self, args)
Kernel._run = first
signal.signal(signal.SIGINT, signal.default_int_handler)  # a job in the background ignores it
from lampyris.cli import main
main()
"""
ENGINE = "from lampyris.app.engine.engine import main; main()"


@dataclass(frozen=True)
class ProcessCall:
    """A call that is stopped long before its end.

    Parameters
    ----------
    map, planner : which.
    seconds : from when it is at work until it is stopped.
    """

    map: str
    planner: str
    seconds: float

    def later(self, seconds: float) -> ProcessCall:
        """The same, stopped later."""
        return replace(self, seconds=self.seconds + seconds)

    @property
    def said(self) -> dict[str, Any]:
        """It, in words of JSON."""
        return asdict(self)


@dataclass(frozen=True)
class ProcessEnding:
    """How a process took it.

    Parameters
    ----------
    late : seconds from when it was stopped to when it had answered.
    wrong : what is wrong with the answer; empty: nothing.
    """

    late: float
    wrong: str = ""


def process_call_of(rng: np.random.Generator) -> ProcessCall:
    """A drawn call."""
    where, who = MAPS[int(rng.integers(len(MAPS)))], SWARMS[int(rng.integers(len(SWARMS)))]
    return ProcessCall(where, who, float(2.0 ** rng.uniform(-7.0, 0.0)))


def interrupted(call: ProcessCall) -> ProcessEnding:
    """``lampyris plan`` in a process of its own, and Ctrl-C: until it is gone."""
    settings = [
        word for key, value in FOR_MINUTES.items() for word in ("--set", f"{key}={json.dumps(value)}")
    ]
    words = [sys.executable, "-P", "-c", COMMAND, "plan", call.map, "--planner", call.planner, *settings]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process, _given(process):
        assert process.stdout is not None
        assert process.stderr is not None
        if process.stdout.readline() != b"within\n":
            return ProcessEnding(0.0, f"did not begin: {process.stderr.read().decode()[-500:]}")
        time.sleep(call.seconds)
        began = time.perf_counter()
        process.send_signal(signal.SIGINT)
        process.wait()
        late = time.perf_counter() - began
        ending = (process.returncode, process.stderr.read().decode())
    return ProcessEnding(late, "" if ending == (130, "interrupted\n") else f"exit code and words {ending!r}")


class AppEngine:
    """An engine of the app, spoken to through its pipes as its server does."""

    def __init__(self) -> None:
        words = (sys.executable, "-P", "-c", ENGINE)
        quiet = subprocess.DEVNULL
        self._process = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=quiet)
        self._job = 0

    def cancelled(self, call: ProcessCall) -> ProcessEnding:
        """A plan that is asked for, and cancelled at its moment: until the answer has ended."""
        planner = {"name": call.planner, "settings": dict(FOR_MINUTES)}
        try:
            with _given(self._process):
                if not self._job:
                    self._ask(verb="warm")  # until it has started
                    self._answer()
                self._ask(verb="plan", scenario={**_SCENARIO, "map": call.map, "planner": planner})
                time.sleep(call.seconds)
                began = time.perf_counter()
                self._send(cancel=self._job)
                answer = self._answer()
                late = time.perf_counter() - began
        except BrokenPipeError:
            return ProcessEnding(0.0, "the engine is gone")
        return ProcessEnding(late, "" if answer == ["CANCELLED"] else f"answered {answer!r}")

    def _ask(self, **words: Any) -> None:
        self._job += 1
        self._send(job=self._job, **words)

    def _send(self, **words: Any) -> None:
        data = json.dumps(words).encode()
        assert self._process.stdin is not None
        self._process.stdin.write(struct.pack("<I", len(data)) + data)
        self._process.stdin.flush()

    def _answer(self) -> list[str]:
        """The frames of the job's answer, progress left out."""
        frames: list[str] = []
        assert self._process.stdout is not None
        while True:
            head = self._process.stdout.read(8)
            if len(head) < 8:
                return [*frames, "the engine is gone"]
            size, job = struct.unpack("<II", head)
            piece = self._process.stdout.read(size)
            if job != self._job:
                frames.append(f"job {job}")
            elif not size:
                return frames
            elif piece[4:5] == b"X":
                frames.append(str(json.loads(piece[5:])["code"]))
            elif piece[4:5] != b"P":
                frames.append(piece[4:5].decode("ascii", "replace"))

    def close(self) -> None:
        """End it, whatever it is at."""
        self._process.kill()
        self._process.wait()
        for stream in (self._process.stdin, self._process.stdout):
            assert stream is not None
            with suppress(BrokenPipeError):
                stream.close()


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
