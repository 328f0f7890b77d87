"""Fixtures that every room's tests share."""

from __future__ import annotations

import asyncio
import gc
import os
import re
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from lampyris_selfcheck.reference.files.watching import Readings

ROOT = Path(__file__).resolve().parent.parent


def pytest_collection(session: pytest.Session) -> None:
    """Do not look for garbage while tests are collected: hardly anything of what is made then is garbage."""
    gc.disable()


def pytest_collection_finish(session: pytest.Session) -> None:
    """Modules and tests stay to the end: leave them out of every later search for garbage, and search seldom."""
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)
    gc.enable()


NIGHTLY_FILE = re.compile(r"^pytestmark = (\[[^\]]*)?pytest\.mark\.nightly", re.MULTILINE)


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Without the nightly tests, do not import a file of which all tests are nightly."""
    if config.option.markexpr != "not nightly" or not collection_path.name.startswith("test_"):
        return None
    nightly = collection_path.suffix == ".py" and NIGHTLY_FILE.search(collection_path.read_text("utf-8"))
    return True if nightly else None


def pytest_pycollect_makeitem(
    collector: pytest.Collector, name: str, obj: object
) -> list[pytest.Item] | None:
    """Without the nightly tests, do not make the cases of a test of which all are nightly."""
    if collector.config.option.markexpr != "not nightly":
        return None
    marks = getattr(obj, "pytestmark", ())
    nightly = name.startswith("test") and any(getattr(mark, "name", "") == "nightly" for mark in marks)
    return [] if nightly else None


def _spaced(count: int, kept: int) -> set[int]:
    """The numbers of ``kept`` evenly spaced ones of ``count`` cases."""
    return {round(k * (count - 1) / max(kept - 1, 1)) for k in range(kept)}


@pytest.hookimpl(trylast=True)
def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Without the nightly tests, do not make the cases that are nightly, by their mark or by ``commit(n)``.

    They are two thirds of all; making them and leaving them out took a fifth of the time of collecting.
    """
    every = metafunc._calls
    if metafunc.config.option.markexpr != "not nightly" or not every:
        return
    calls = [one for one in every if all(mark.name != "nightly" for mark in one.marks)]
    mark = metafunc.definition.get_closest_marker("commit")
    if mark is not None:
        chosen = _spaced(len(calls), *mark.args)
        calls = [one for k, one in enumerate(calls) if k in chosen]
    # Of no case at all pytest would make one without parameters; so the first stays, which its mark leaves out.
    every[:] = calls or every[:1]


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark as nightly what ``commit(n)`` leaves out: all but n evenly spaced cases of a test."""
    cases: dict[tuple[Path, str], list[pytest.Item]] = {}
    for item in items:
        if item.get_closest_marker("commit") and not item.get_closest_marker("nightly"):
            cases.setdefault((item.path, getattr(item, "originalname", item.name)), []).append(item)
    for same in cases.values():
        mark = same[0].get_closest_marker("commit")
        assert mark is not None
        chosen = _spaced(len(same), *mark.args)
        for k, item in enumerate(same):
            if k not in chosen:
                item.add_marker(pytest.mark.nightly)


@pytest.fixture(scope="session")
def movingai() -> Path:
    """The folder of MovingAI maps, which is not part of the project; its tests say so when it is absent."""
    shared = Path(os.environ.get("LAMPYRIS_SHARED") or ROOT.parent / "shared")
    folder = shared / "maps" / "movingai"
    if not folder.is_dir():
        pytest.skip(
            "the MovingAI maps are not here (set LAMPYRIS_SHARED to the folder that holds maps/movingai)"
        )
    return folder


@pytest.fixture(autouse=True)
def own_loop(request: pytest.FixtureRequest) -> Iterator[None]:
    """Where no loop runs, a test may run one: the shared browser leaves its own running in this thread."""
    running = None if "browser" in request.fixturenames else asyncio._get_running_loop()
    if running is not None:
        asyncio._set_running_loop(None)
    yield
    if running is not None:
        asyncio._set_running_loop(running)


@pytest.fixture
def timed() -> Callable[..., Any]:
    """Calls something, and sees that it takes less CPU time than so many seconds, returning or raising.

    Others at work make it longer: what took too long is called again, and the least counts. A test that asks for
    this judges by time, which is for the night.
    """
    readings = Readings()

    def taken(call: Callable[[], Any]) -> tuple[float, Any, Exception | None]:
        found, raised = None, None
        began = time.process_time()
        try:
            found = call()
        except Exception as problem:
            raised = problem
        return time.process_time() - began, found, raised

    def below(seconds: float, call: Callable[..., Any], *given: Any, **settings: Any) -> Any:
        took, found, raised = readings.least(
            lambda: taken(partial(call, *given, **settings)), lambda one: one[0], seconds
        )
        assert took < seconds, (call, given, settings)
        if raised is not None:
            raise raised
        return found

    return below


def untimed(seconds: float, call: Callable[..., Any], *given: Any, **settings: Any) -> Any:
    """Calls something, however long it takes."""
    return call(*given, **settings)


@pytest.fixture(params=["as it comes", pytest.param("by the clock", marks=pytest.mark.nightly)])
def timely(request: pytest.FixtureRequest) -> Callable[..., Any]:
    """With every commit :func:`untimed`; every night the same test is judged by :func:`timed`, too."""
    return untimed if request.param == "as it comes" else request.getfixturevalue("timed")
