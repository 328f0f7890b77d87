"""The check of stores sees what is wrong: each time a part of the product is broken, and it must fail."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import pytest

from lampyris.study.store import file as store_file
from lampyris.study.store import lock as store_lock
from lampyris.study.store import repair, store
from lampyris.study.store.lock import Witness
from lampyris_selfcheck import runner
from lampyris_selfcheck.check import Ask, Outcome
from lampyris_selfcheck.checks.studies import store_damage as damage
from lampyris_selfcheck.checks.studies import store_other as other
from lampyris_selfcheck.checks.studies import store_writers as several
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
    damage.closed(), damage.opened(), CHECK.kinds_for(Ask())


def test_unsealed_records_are_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store, "sealed", lambda path, table, record, n: tuple(record[2:]))
    fails("bit", 40, "reading: ")


def test_a_log_that_nobody_vouches_for_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store, "vouched", lambda path: Witness())
    fails("cut", 10, "rows that are not the 28 that were stored")


def test_a_repair_that_leaves_rows_behind_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    carved = repair.carved
    monkeypatch.setattr(repair, "carved", lambda main, log: list(carved(main, log))[:-1])
    fails("page", 20, "rows are lost that stand whole in its bytes")


def test_a_repair_that_counts_wrongly_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    expected = repair._expected

    def fewer(*given: Any) -> tuple[int, tuple[str, ...]]:
        return len(given[1].runs), ()

    monkeypatch.setattr(repair, "_expected", fewer)
    fails("page", 72, "kept, 0 lost of")
    assert expected is not fewer


def test_pages_that_do_not_fit_together_are_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Written to, such a store loses rows."""
    monkeypatch.setattr(store, "check_pages", lambda connection, path: None)
    outcome = ran("noise", 150)
    assert outcome.counts.get("read, and may not be added to", 0) == 0


def test_an_untyped_error_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    def raises(*_: object) -> None:
        raise ValueError("broken")

    monkeypatch.setattr(store, "tally_of", raises)
    fails("bit", 5, "ValueError: broken")


def test_what_is_no_store_must_be_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store, "look", lambda path: None)
    fails("foreign", 20, "STORE_FORMAT was expected")


def test_a_log_of_another_store_must_be_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store, "vouched", lambda path: store_lock.witness_of(path) or Witness())
    fails("foreign", 20, "the log of another store: STORE_DAMAGED was expected, and nothing was refused")


@pytest.mark.parametrize("lost", [1, 100])
def test_rows_that_repair_does_not_save_are_seen(lost: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The check itself added what was missing, and then counted."""
    honest = repair._of_study

    def lossy(*given: Any) -> Any:
        keep, notes = honest(*given)
        return keep[lost:], notes

    monkeypatch.setattr(repair, "_of_study", lossy)
    outcome = ran("foreign", 20)
    assert outcome.failed == 7, outcome.failures  # all that is to be repaired, but what is not damaged


def test_another_study_must_be_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store, "demand_same", lambda *_: None)
    outcome = ran("resume", 22)
    assert outcome.failed == outcome.cases == 22


def test_two_writers_are_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    fcntl = pytest.importorskip("fcntl")
    monkeypatch.setattr(fcntl, "flock", lambda *_: None)
    fails("writers", 10, "two were let in at once")


def test_rows_stored_twice_are_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store.Store, "_fresh", lambda self, rows: {r.key: store.packed(r) for r in rows})
    fails("writers", 10, "number of new rows")


def test_a_process_that_ends_otherwise_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(several, "_RACE", "raise SystemExit('broken')")
    fails("processes", 1, "ended with 1: broken")


def test_whole_stores_are_read_written_and_repaired(tmp_path: Any) -> None:
    """Nothing of the check takes a good store for a bad one."""
    for sample in (damage.closed(), damage.opened()):
        assert damage.judged(tmp_path / "a", sample.files, sample) == ([], ["read whole"])
        assert len(sample.raw) >= 20


def test_samples_are_damaged_everywhere() -> None:
    """The first cases of a kind that is run whole at last are from all over."""
    cuts = damage._cuts()
    sizes = sorted(damage._spread(cuts, k)[1] for k in range(500))
    assert len(set(sizes)) > 490
    assert max(b - a for a, b in pairwise(sizes) if a > 30_000) < 300
    assert {damage._spread(cuts, k) for k in range(len(cuts))} == set(cuts)
    assert store_file.PAGE == 4096


def test_who_waits_at_a_pipe_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    names = [case.name for case in other._foreign()]
    monkeypatch.setattr(other, "PATIENCE_S", 0.2)
    monkeypatch.setattr(store, "look", lambda path: path.read_bytes())  # without a look at what it is
    outcome = ran("foreign", 1, names.index("a pipe"))
    assert "Hangs: more than 0.2 s" in outcome.failures[0].what
