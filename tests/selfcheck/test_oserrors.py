"""The check of what the system refuses sees each way of doing it wrong; and lost power loses what it may."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lampyris_selfcheck import runner
from lampyris_selfcheck.check import Ask, Outcome
from lampyris_selfcheck.checks.studies import sittings
from lampyris_selfcheck.checks.studies.oserrors import CHECK
from lampyris_selfcheck.checks.studies.power import Disk, FileChange
from lampyris_selfcheck.checks.studies.sitting_child import BACK_AFTER, clocks

pytestmark = pytest.mark.nightly  # minutes: it breaks the product in processes of its own

needs_fork = pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="needs fork")

UNTYPED = """
store_file.speaking.__wrapped__
from contextlib import nullcontext
store.speaking = store_new.speaking = lambda *_: nullcontext()
"""
UNSYNCED = """
real = store_file.writer
def writer(path):
    one = real(path)
    one.execute("PRAGMA synchronous=OFF")
    return one
store.writer = writer
"""
NAMELESS = "store_new.sync_folder = store_lock.sync_folder = lambda folder: None"
BY_THE_CLOCK = """
import time
from lampyris.study.analysis import table
table.table_of = running.table_of = lambda study, rows, real=table.table_of: real(
    study, list(rows)[: 18 if time.perf_counter() > 500 + time.perf_counter() - 500.0001 else 3]
)
"""


def broken(monkeypatch: pytest.MonkeyPatch, code: str) -> None:
    """The process that sits has a product with this change."""
    text = (
        "import runpy\n"
        "from lampyris.cli.verbs.study import running\n"
        "from lampyris.study.store import store, file as store_file, lock as store_lock, new_store as store_new\n"
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
    assert "it ended with 6: " in said(ran("faults", 12))


@needs_fork
def test_rows_that_were_not_synced_are_missed(monkeypatch: pytest.MonkeyPatch) -> None:
    broken(monkeypatch, UNSYNCED)
    assert "STORE_DAMAGED" in said(ran("power", 20))


@needs_fork
def test_names_that_were_not_synced_are_missed(monkeypatch: pytest.MonkeyPatch) -> None:
    """So a store was lost whole: its file was there, under no name."""
    broken(monkeypatch, NAMELESS)
    outcome = ran("power", 60)
    assert outcome.failed


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


# ---- the disk that loses power --------------------


def lost(*changes: FileChange, seeds: int = 60) -> set[tuple[tuple[str, bytes], ...]]:
    """All that may be there after these, and no more."""
    found = set()
    for seed in range(seeds):
        disk = Disk(np.random.Generator(np.random.PCG64(seed)))
        for change in changes:
            disk.do(change)
        found.add(tuple(sorted(disk.after_power_failed().items())))
    return found


def change(op: str, path: str = "/a", at: int = 0, data: bytes = b"") -> FileChange:
    return FileChange(op, path, at, data, 0)


MADE = (change("create"), change("folder", "/"))


def test_what_was_synced_stays() -> None:
    whole = (*MADE, change("write", data=b"one"), change("sync"))
    assert lost(*whole) == {(("/a", b"one"),)}
    more = lost(*whole, change("write", at=3, data=b"two"), change("write", at=6, data=b"six"))
    assert more == {
        (("/a", b"one"),), (("/a", b"onetwo"),), (("/a", b"onetwosix"),), (("/a", b"one\0\0\0six"),)
    }  # fmt: skip


def test_a_name_is_certain_once_its_folder_is() -> None:
    assert lost(change("create"), change("write", data=b"x"), change("sync")) == {(), (("/a", b"x"),)}
    renamed = (*MADE, change("write", data=b"x"), change("sync"), change("rename", data=b"/b"))
    assert lost(*renamed) == {(("/a", b"x"),), (("/b", b"x"),)}
    assert lost(*renamed, change("folder", "/")) == {(("/b", b"x"),)}
    assert lost(*MADE, change("sync"), change("unlink")) == {(), (("/a", b""),)}


def test_a_write_may_be_torn_between_sectors() -> None:
    torn = lost(*MADE, change("sync"), change("write", data=b"x" * 512 + b"y" * 512), seeds=200)
    assert (("/a", b"x" * 512),) in torn
    assert (("/a", bytes(512) + b"y" * 512),) in torn
    assert len(torn) == 4


def test_a_truncation_is_certain_only_when_synced() -> None:
    cut = (*MADE, change("write", data=b"long"), change("sync"), change("truncate", at=1))
    assert lost(*cut) == {(("/a", b"l"),), (("/a", b"long"),)}
    assert lost(*cut, change("sync")) == {(("/a", b"l"),)}
