"""Ctrl-C while a library is imported, or machine code made: heard, and nothing is broken after it.

Ctrl-C during the first compiled plan left numba imported by half: every later plan of the process raised
AttributeError (25 of 40 moments), and sometimes another error came in place of KeyboardInterrupt.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from types import FrameType
from typing import Any

import pytest

from lampyris._core import cancellation
from lampyris._core.cancellation import uninterrupted
from sizes import some

CHILD = Path(__file__).with_name("interrupted_child.py")
posix = pytest.mark.skipif(not hasattr(os, "fork"), reason="children are forked")


def told(work: str, moments: int) -> list[dict[str, Any]]:
    done = subprocess.run(
        [sys.executable, str(CHILD), work, str(moments)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


def judge(work: str, moments: int) -> None:
    whole, *rest = told(work, moments)
    assert whole["first"] == whole["second"]
    assert len(rest) == moments
    wrong = [one for one in rest if one["second"] != whole["second"]]
    assert not wrong, f"broken after Ctrl-C: {wrong}"
    # The last moments may lie behind the last event of a run that took some fewer.
    first = [one["first"] for one in rest if one["events"] >= one["moment"]]
    assert first == ["KeyboardInterrupt"] * len(first)
    assert len(first) >= moments - 1


@pytest.mark.nightly
@posix
def test_ctrl_c_during_the_first_compiled_plan() -> None:
    judge("plan", 12)


@pytest.mark.nightly
@posix
@pytest.mark.parametrize("work", some(["yaml", "regions", "picture"]))
def test_ctrl_c_while_another_library_is_imported(work: str) -> None:
    judge(work, 5)


@posix
@pytest.mark.nightly
@pytest.mark.parametrize("work", ["plan", "regions", "yaml", "picture"])
def test_ctrl_c_at_hundreds_of_moments(work: str) -> None:
    judge(work, 200)


DEEP = """
import sys
import numpy as np, lampyris, lampyris.api
from lampyris.kernels import _jit
from lampyris.planning import registry
_jit.prefer_compiled(), registry.make("jps")
scene = lampyris.Scene(lampyris.Grid(np.zeros((9, 9), bool)), (0, 0), (8, 8))
def deep(calls):
    return deep(calls - 1) if calls else lampyris.plan(scene, "jps")
try:
    deep(sys.getrecursionlimit() - 100)
except RecursionError:
    print("too deep", lampyris.plan(scene, "jps").cost)
"""


@pytest.mark.nightly
def test_an_import_that_the_stack_has_no_room_for_is_begun_anew() -> None:
    done = subprocess.run([sys.executable, "-c", DEEP], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout[:12]) == (0, "too deep 11."), done.stderr


# ---- signals that wait --------------------


@pytest.fixture
def handled() -> Iterator[list[int]]:
    """Handlers of two signals that write down what comes; the first raises TimeoutError."""
    came: list[int] = []

    def raising(number: int, frame: FrameType | None) -> None:
        came.append(number)
        raise TimeoutError

    numbers = (signal.SIGUSR1, signal.SIGUSR2)
    before = [signal.getsignal(n) for n in numbers]
    signal.signal(signal.SIGUSR1, raising)
    signal.signal(signal.SIGUSR2, lambda number, frame: came.append(number))
    yield came
    for n, handler in zip(numbers, before, strict=True):
        signal.signal(n, handler)


@posix
def test_signals_wait_and_each_is_called_once(handled: list[int]) -> None:
    handlers = [signal.getsignal(n) for n in (signal.SIGUSR1, signal.SIGUSR2)]
    with pytest.raises(TimeoutError), uninterrupted():  # noqa: PT012 - the end raises
        for number in (signal.SIGUSR1, signal.SIGUSR2):
            signal.raise_signal(number)
            assert not handled
        with uninterrupted():
            signal.raise_signal(signal.SIGUSR2)
        assert not handled
    assert handled == [signal.SIGUSR1, signal.SIGUSR2, signal.SIGUSR2]
    assert [signal.getsignal(n) for n in (signal.SIGUSR1, signal.SIGUSR2)] == handlers


@posix
def test_what_the_work_raises_is_not_lost(handled: list[int]) -> None:
    with pytest.raises(TimeoutError) as caught, uninterrupted():  # noqa: PT012
        signal.raise_signal(signal.SIGUSR1)
        raise ImportError("of the work")
    assert str(caught.value.__context__) == "of the work"


@posix
def test_a_handler_set_meanwhile_stays(handled: list[int]) -> None:
    with uninterrupted():
        signal.signal(signal.SIGUSR2, signal.SIG_IGN)
    assert signal.getsignal(signal.SIGUSR2) is signal.SIG_IGN


def test_in_other_threads_nothing_changes() -> None:
    before, seen = signal.getsignal(signal.SIGINT), list[Any]()

    def work() -> None:
        with uninterrupted():
            seen.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [before]


def test_compiled_loops_of_other_threads_hear_of_ctrl_c_meanwhile() -> None:
    """The thread that listens asks whose signal it is; the answer is that of before."""
    handler = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        interrupt = cancellation._Interrupt()
        with uninterrupted():
            cancellation._on_interrupt(interrupt)
        assert interrupt.is_set
    finally:
        signal.signal(signal.SIGINT, handler)
