"""Loading and compiling machine code is in no time of planning (issue 24, C18)."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from threading import Event, Thread
from typing import Any

import numpy as np
import pytest

from lampyris._core import cancellation
from lampyris.kernels import _jit, loading
from lampyris.kernels._jit import Kernel

COMPILING = 650.0
"""Seconds that compiling takes by the clock of these tests."""
RUNNING = 0.0013


class Clock:
    """Time that passes when it is told to."""

    def __init__(self) -> None:
        self.now = 0.0

    def perf_counter(self) -> float:
        return self.now

    thread_time = perf_counter


class Dispatcher:
    """What numba makes of a kernel: compiles at its first call."""

    def __init__(self, clock: Clock, inner: Dispatcher | None = None) -> None:
        self.clock, self.inner, self.ready = clock, inner, False

    def compile(self, types: Any) -> None:
        if self.inner is not None:
            self.inner.compile(types)
        self.clock.now += COMPILING
        self.ready = True

    def __call__(self, *given: Any) -> None:
        if not self.ready:
            self.compile(None)
        self.clock.now += RUNNING


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    made = Clock()
    monkeypatch.setattr(loading, "time", made)
    monkeypatch.setattr(loading, "thread_seconds", made.thread_time)
    monkeypatch.setattr(loading, "_loaded", loading._Loaded())
    return made


def kernel_of(make: Callable[[], Any], monkeypatch: pytest.MonkeyPatch) -> Kernel:
    """A kernel whose machine code is made by ``make``."""

    def nothing(numbers: Any) -> None: ...

    monkeypatch.setattr(_jit, "KERNELS", [])

    def compiled(k: Kernel) -> Any:
        made = make()
        _jit._time_loading(made)
        return made

    monkeypatch.setattr(_jit, "_compile", compiled)
    return Kernel(nothing, ())  # type: ignore[arg-type]


@pytest.mark.parametrize("nested", [False, True])
def test_the_first_call_takes_as_long_as_the_second(
    nested: bool, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    def make() -> Dispatcher:
        inner = Dispatcher(clock)
        _jit._time_loading(inner)
        return Dispatcher(clock, inner if nested else None)

    kernel = kernel_of(make, monkeypatch)
    taken = []
    with _jit.compiled_only():
        for _ in range(2):
            for now in (loading.wall, loading.cpu):
                began = now()
                kernel(np.zeros(3))
                taken.append(now() - began)
    assert taken == pytest.approx([RUNNING] * 4)
    assert loading.seconds() == COMPILING * (2 if nested else 1)
    assert clock.now == pytest.approx(loading.seconds() + 4 * RUNNING)


def test_limits_do_not_count_compiling(clock: Clock, monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = kernel_of(lambda: Dispatcher(clock), monkeypatch)
    monkeypatch.setattr(cancellation, "time", clock)
    with cancellation.watching(3 * RUNNING) as outer, cancellation.watching(2 * RUNNING) as own:
        assert outer is not None
        assert own is not None
        with _jit.compiled_only():
            kernel(np.zeros(3))
        assert clock.now == pytest.approx(COMPILING + RUNNING)
        assert (own.is_over, outer.is_over, int(own.word[0]), int(outer.word[0])) == (False, False, 0, 0)
        clock.now += 1.5 * RUNNING
        assert (own.is_over, outer.is_over) == (True, False)
        clock.now += RUNNING
        assert outer.is_over


def test_a_thread_that_looks_while_a_pause_ends_finds_no_limit_passed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Workers of a call share its limit; the pause was once over before the deadline was later."""

    seen: list[bool] = []

    class Looking(Clock):
        """Another thread looks at the limit when the clock is first read."""

        def perf_counter(self) -> float:
            if not seen:
                seen.append(True)
                seen[0] = scope.is_over
            return self.now

    clock, looking = Clock(), Looking()
    monkeypatch.setattr(cancellation, "time", clock)
    scope = cancellation.CancelScope(RUNNING, None, None)
    scope.pause()
    looking.now = COMPILING
    monkeypatch.setattr(cancellation, "time", looking)
    scope.resume()
    assert seen == [False]
    looking.now += RUNNING / 2
    assert not scope.is_over
    looking.now += RUNNING
    assert scope.is_over


def test_the_timer_of_a_limit_waits_while_code_is_loaded() -> None:
    scope = cancellation.CancelScope(1e-4, None, None)
    word = scope.word
    scope.pause()
    scope.pause()  # by another thread of the same call
    scope.begin()
    try:
        for _ in range(2):
            time.sleep(3 * cancellation.PAUSE_LOOK)
            assert int(word[0]) == 0
            scope.resume()
        until = time.monotonic() + 20.0
        while not int(word[0]) and time.monotonic() < until:
            time.sleep(1e-3)
        assert int(word[0]) == 1
    finally:
        scope.end()


def test_what_is_compared_runs_in_compiled_form_from_its_first_call(monkeypatch: pytest.MonkeyPatch) -> None:
    ran: list[str] = []

    def plain(numbers: Any) -> None:
        ran.append("plain")

    monkeypatch.setattr(_jit, "KERNELS", [])
    monkeypatch.delenv("NUMBA_DISABLE_JIT", raising=False)
    kernel = Kernel(plain, ())  # type: ignore[arg-type]
    kernel(np.zeros(3))
    monkeypatch.setattr(_jit, "_compile", lambda k: lambda *given: ran.append("compiled"))
    with _jit.compiled_only():
        kernel(np.zeros(3))
    assert ran == ["plain", "compiled"]


CODE = """
import json, sys
import lampyris
from lampyris.app.engine.work import answer
from lampyris.kernels import _jit

_jit.prefer_compiled()  # so that the first plan of a process compiles, however small its map is
question = {"verb": "plan", "scenario": {"version": 1, "map": "guide", "planner": "dstar-lite"}}
told = []
for _ in range(2):
    *_, last = answer(question, lambda: None)
    plan = json.loads(last[5:])
    told.append([plan["timing"], plan["seconds"], plan["loading_seconds"]])
print(json.dumps(told))
"""


@pytest.mark.nightly
def test_a_plan_that_compiles_says_how_long_that_took_and_plans_no_longer(tmp_path: Path) -> None:
    """Really compiled, in a process and a folder of its own."""
    env = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    env.pop("NUMBA_DISABLE_JIT", None)
    done = subprocess.run([sys.executable, "-c", CODE], env=env, capture_output=True, text=True, check=True)
    (first, seconds, loaded), (second, again, none) = json.loads(done.stdout)
    assert first["loading_s"] > 0
    assert loaded >= first["loading_s"]
    assert (second["loading_s"], none) == (0, 0)
    parts = sum(first[part] for part in ("plan_s", "assess_s", "referee_s"))
    assert first["total_s"] == pytest.approx(parts + first["loading_s"])
    # 1.5 s are compiled here, and 2 ms planned.
    assert first["plan_s"] < first["loading_s"]
    assert seconds < loaded
    assert again >= second["plan_s"]


def test_a_thread_that_runs_compiled_code_only_leaves_other_threads_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Two overlapping blocks once left the process without plain forms for good."""
    ran: list[str] = []
    monkeypatch.setattr(_jit, "KERNELS", [])
    monkeypatch.delenv("NUMBA_DISABLE_JIT", raising=False)

    def plain(numbers: Any) -> None:
        ran.append("plain")

    kernel = Kernel(plain, ())  # type: ignore[arg-type]
    monkeypatch.setattr(_jit, "_compile", lambda k: lambda *given: ran.append("compiled"))
    outer, inner = Event(), Event()

    def other() -> None:
        with _jit.compiled_only():
            outer.set()
            inner.wait(60)

    thread = Thread(target=other)
    thread.start()
    assert outer.wait(60)
    kernel(np.zeros(3))
    with _jit.compiled_only():
        inner.set()
        thread.join(60)
    kernel(np.zeros(3))
    assert ran == ["plain", "plain"]
