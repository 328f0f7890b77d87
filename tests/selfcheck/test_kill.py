"""The check of kills sees what is lost, doubled or torn: the product is broken in the process it kills."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from lampyris_selfcheck import runner
from lampyris_selfcheck.check import Ask, Outcome
from lampyris_selfcheck.checks.studies import kill, sittings
from lampyris_selfcheck.checks.studies.kill import CHECK

pytestmark = [
    pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="needs fork and /proc"),
    pytest.mark.nightly,
]

LATER = """
def add(self, rows, real=Store.add):
    kept = self.__dict__.setdefault("kept", [])
    kept.extend(rows)
    return len(rows) if len(kept) < 9 else real(self, kept)
Store.add = add
"""
IN_PLACE = """
file.sidecar = lambda path, ending, real=file.sidecar: path if ending == file.NEW else real(path, ending)
file._fill = lambda *given, real=file._fill: (given[0].write_bytes(b"SQLite form"), sleep(0.3), real(*given))
file._remove = lambda path, real=file._remove: None
"""
FORGETFUL = "Store.keys = lambda self: frozenset()"
AS_THEY_CAME = """
def lines(self, *, timing=False, real=ResultTable.lines):
    return iter(sorted(real(self, timing=timing), key=lambda line: hash(line[1] + str(os.getpid()))))
ResultTable.lines = lines
"""


def broken(monkeypatch: pytest.MonkeyPatch, code: str) -> None:
    """The process that sits has a product with this change."""
    text = (
        "import os, runpy, sys\n"
        "from time import sleep\n"
        "from lampyris.study.store import file, store\n"
        "from lampyris.study.store.store import Store\n"
        "from lampyris.study.analysis.table import ResultTable\n"
        f"{code}\n"
        "runpy.run_module('lampyris_selfcheck.checks.studies.sitting_child', run_name='__main__')\n"
    )
    monkeypatch.setattr(sittings, "CHILD", ("-c", text))


def ran(kind: str, cases: int, first: int = 0) -> Outcome:
    return runner.run(CHECK, Ask(), runner.Range(only=kind, cases=cases, first=first)).outcome


def said(outcome: Outcome) -> str:
    return " ".join(failure.what for failure in outcome.failures)


def test_rows_acknowledged_before_they_are_stored_are_missed(monkeypatch: pytest.MonkeyPatch) -> None:
    broken(monkeypatch, LATER)
    assert "acknowledged rows are lost" in said(ran("random", 8))


def test_a_store_made_in_its_place_is_found_torn(monkeypatch: pytest.MonkeyPatch) -> None:
    broken(monkeypatch, IN_PLACE)
    assert "STORE_DAMAGED" in said(ran("random", 8))


def test_runs_done_twice_are_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    broken(monkeypatch, FORGETFUL)
    assert "acknowledged twice" in said(ran("random", 4))


def test_a_table_of_other_bytes_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    broken(monkeypatch, AS_THEY_CAME)
    assert "not that of the study run at once" in said(ran("random", 2))


def test_a_command_that_does_not_start_is_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kill, "COMMAND", (sys.executable, "-m", "no_such_module"))
    assert "it ended with 1" in said(ran("study", 1))


def test_rows_that_change_after_they_were_read_are_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each reading of the store says something else of each row."""
    readings = iter(range(1_000_000))
    monkeypatch.setattr(kill, "digest", lambda row: str(next(readings)))
    assert "rows lost or changed" in said(ran("study", 1))
