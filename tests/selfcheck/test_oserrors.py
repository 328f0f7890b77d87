"""The check of what the system refuses sees each way of doing it wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lampyris_selfcheck import runner
from lampyris_selfcheck.check import Ask, Outcome
from lampyris_selfcheck.checks.studies import sittings
from lampyris_selfcheck.checks.studies.oserrors import CHECK
from lampyris_selfcheck.checks.studies.sitting_child import BACK_AFTER, clocks

pytestmark = pytest.mark.nightly  # minutes: it breaks the product in processes of its own

needs_fork = pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="needs fork")

UNTYPED = """
from contextlib import nullcontext
store.typed_errors = file.typed_errors = lambda *_: nullcontext()
"""
FORGETFUL = """
def add(self, rows, real=store.Store.add):
    try:
        return real(self, rows)
    except LampyrisError:
        return len(rows)
store.Store.add = add
"""


def broken(monkeypatch: pytest.MonkeyPatch, code: str) -> None:
    """The process that sits has a product with this change."""
    text = (
        "import runpy\n"
        "from lampyris.cli.verbs.study import running\n"
        "from lampyris.errors import LampyrisError\n"
        "from lampyris.study.store import file, store\n"
        f"{code}\n"
        "runpy.run_module('lampyris_selfcheck.checks.studies.sitting_child', run_name='__main__')\n"
    )
    monkeypatch.setattr(sittings, "CHILD", ("-c", text))


def ran(kind: str, cases: int, first: int = 0) -> Outcome:
    return runner.run(CHECK, Ask(), runner.Range(only=kind, cases=cases, first=first)).outcome


def said(outcome: Outcome) -> str:
    return " ".join(failure.what for failure in outcome.failures)


@needs_fork
def test_an_error_that_is_not_told_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    broken(monkeypatch, UNTYPED)
    assert "it ended with 6: " in said(ran("full", 8))


@needs_fork
def test_rows_that_are_acknowledged_on_a_full_disk_are_missed(monkeypatch: pytest.MonkeyPatch) -> None:
    broken(monkeypatch, FORGETFUL)
    assert "acknowledged rows are lost" in said(ran("full", 12))


@needs_fork
def test_a_study_that_lasts_for_ever_by_a_wrong_clock_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    broken(monkeypatch, "running.time = None")
    outcome = ran("clock", 1)
    assert outcome.failed
    assert "SITTING" in said(outcome)


def test_a_clock_that_is_set_back_goes_back_during_the_run() -> None:
    for how in ("steps", "back", "stands"):
        measured, of_the_day = clocks(how, iter(range(500)).__next__)
        read = [(measured(), of_the_day()) for _ in range(60)]
        for steps in zip(*((np.diff(one)) for one in zip(*read, strict=True)), strict=True):
            assert how == "back" or min(steps) >= 0
        back = [k for k in range(1, 60) if read[k][0] < read[k - 1][0] and read[k][1] < read[k - 1][1]]
        assert back == ([BACK_AFTER] if how == "back" else [])
