"""The check of stores sees what is wrong: each time a part of the product is broken, and it must fail."""

from __future__ import annotations

from contextlib import nullcontext
from typing import Any

import pytest

from lampyris.study.store import file, repair, row_record, store
from lampyris_selfcheck import runner
from lampyris_selfcheck.check import Ask, Outcome
from lampyris_selfcheck.checks.studies import store as checked
from lampyris_selfcheck.checks.studies.store import CHECK


def ran(kind: str, cases: int, first: int = 0) -> Outcome:
    return runner.run(CHECK, Ask(), runner.Range(only=kind, cases=cases, first=first)).outcome


def fails(kind: str, cases: int, word: str) -> None:
    outcome = ran(kind, cases)
    assert outcome.failed
    assert word in " ".join(failure.what for failure in outcome.failures)


@pytest.fixture(autouse=True)
def _samples() -> None:
    """Made before anything is broken."""
    checked.sound(), CHECK.kinds_for(Ask())


@pytest.mark.nightly
def test_a_checksum_that_is_not_compared_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(row_record, "is_sound", lambda table, texts: True)
    fails("bit", 40, "reading: ")


@pytest.mark.nightly
def test_rows_that_are_missed_by_nobody_are_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """A damaged page of runs may hold fewer of them, and SQLite reads on."""

    def scan(self: Any) -> Any:
        with self._snapshot() as connection:
            for n, *record in connection.execute(f"{file.RUNS} ORDER BY n"):
                yield row_record.row_of(self.path, n, tuple(record))

    monkeypatch.setattr(store.Store, "scan", scan)
    fails("page", 72, "rows that are not the 24 that were stored")


def test_a_repair_that_leaves_rows_behind_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    salvaged = repair._salvaged

    def fewer(connection: Any) -> Any:
        runs, lost, notes = salvaged(connection)
        return dict(list(runs.items())[:-1]), lost, notes

    monkeypatch.setattr(repair, "_salvaged", fewer)
    fails("bit", 5, "says 22 kept, 1 lost of 24; 22 kept")


@pytest.mark.nightly
def test_pages_that_do_not_fit_together_are_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Written to, such a store loses rows."""
    monkeypatch.setattr(store, "check_pages", lambda connection, path: None)
    outcome = ran("noise", 150)
    assert outcome.counts.get("read, and may not be added to", 0) == 0


def test_an_untyped_error_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    def raises(*_: object) -> None:
        raise ValueError("broken")

    monkeypatch.setattr(store, "row_of", raises)
    fails("bit", 5, "ValueError: broken")


@pytest.mark.nightly
@pytest.mark.parametrize("lost", [1, 100])
def test_rows_that_repair_does_not_save_are_seen(lost: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The check itself added what was missing, and then counted."""
    whole = repair.write_new

    def lossy(place: Any, study: Any, maps: Any, runs: Any, **more: Any) -> None:
        whole(place, study, maps, list(runs)[lost:], **more)

    monkeypatch.setattr(repair, "write_new", lossy)
    fails("page", 30, "kept, ")


@pytest.mark.nightly
def test_another_study_must_be_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store, "demand_same", lambda *_: None)
    outcome = ran("resume", 22)
    assert outcome.failed == outcome.cases == 22


def test_two_writers_are_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    class NoLock(nullcontext):  # type: ignore[type-arg]
        def release(self) -> None:
            pass

    monkeypatch.setattr(store, "StoreLock", NoLock)
    fails("writers", 10, "two were let in at once")


def test_rows_stored_twice_are_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    insert = store.Store._insert
    monkeypatch.setattr(store.Store, "_insert", lambda *given: insert(*given) or True)
    fails("writers", 10, "number of new rows")


def test_a_process_that_ends_otherwise_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(checked, "RACE", "raise SystemExit('broken')")
    fails("processes", 1, "ended with 1: broken")


def test_a_whole_store_is_read_written_and_repaired(tmp_path: Any) -> None:
    """Nothing of the check takes a good store for a bad one."""
    assert checked.judged(tmp_path / "a", checked.sound()[0]) == ["read whole"]


def test_a_store_is_damaged_everywhere() -> None:
    """The first cases of a kind that is run whole at last are from all over."""
    bits = 8 * len(checked.record())
    places = sorted(checked.spread(range(bits), k) // 8 for k in range(300))
    assert places[0] < 5
    assert places[-1] > len(checked.record()) - 5
    assert {checked.spread(range(bits), k) for k in range(bits)} == set(range(bits))
    assert checked.sound()[0][16:18] == checked.PAGE.to_bytes(2, "big")
