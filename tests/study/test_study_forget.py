"""Runs taken out of a store so that they are run again: those, no others, and nothing on an interruption."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

import pytest
import store_samples as samples

from lampyris.errors import FileError, UsageError
from lampyris.study.design.row import ENDINGS, Row
from lampyris.study.store.store import Store


def forget(path: Path, endings: Collection[str]) -> int:
    with Store.open(path) as store:
        return store.forget(endings)


def stored(path: Path) -> dict[str, Row]:
    with Store.open(path, writable=False) as store:
        return store.rows()


@pytest.mark.parametrize("endings", [("failed",), ("timeout", "refused"), ENDINGS, ()])
def test_those_that_ended_so_are_gone_and_no_others(tmp_path: Path, endings: tuple[str, ...]) -> None:
    path = tmp_path / "s.db"
    rows = samples.filled(path, samples.study())
    kept = {row.key: row for row in rows if row.ending not in endings}
    assert {row.ending for row in rows} == set(ENDINGS)
    assert forget(path, endings) == len(rows) - len(kept)
    assert stored(path) == kept
    assert [f.name for f in tmp_path.iterdir()] == ["s.db"]


def test_they_can_be_stored_anew_with_other_results(tmp_path: Path) -> None:
    path, study = tmp_path / "s.db", samples.study()
    rows = samples.filled(path, study)
    bad = [row for row in rows if row.ending != "done"]
    good = [Row(row.key, "done", {"found": True}) for row in bad]
    forget(path, ("failed", "timeout", "refused"))
    with Store.open(path) as store:
        assert store.add(good) == len(bad)
        assert store.study().name == study.name
    assert stored(path) == {row.key: row for row in rows if row.ending == "done"} | {r.key: r for r in good}


def test_of_a_store_that_was_killed_everything_else_stays(tmp_path: Path) -> None:
    """Most of its runs are in its log."""
    path = tmp_path / "s.db"
    rows = samples.filled(path, samples.study(), given=samples.rows(samples.study())[:20])
    with Store.open(path) as store:
        store.add(samples.rows(samples.study())[20:])
        files = samples.bytes_of(path)
    assert len(files) > 1
    samples.put(path, files)
    rows = samples.rows(samples.study())
    forget(path, ("failed",))
    assert stored(path) == {row.key: row for row in rows if row.ending != "failed"}


def test_an_interruption_changes_nothing(tmp_path: Path) -> None:
    path = tmp_path / "s.db"
    rows = samples.filled(path, samples.study())
    killed = """
    import os
    from store_samples import *
    store = Store.open(sys.argv[1])
    store._writer.set_trace_callback(lambda sql: os.kill(os.getpid(), 9) if sql == "COMMIT" else None)
    store.forget(("failed", "timeout"))
    """
    assert samples.child(killed, path, check=False).returncode == -9
    assert stored(path) == {row.key: row for row in rows}


def test_what_is_no_ending_and_who_else_writes(tmp_path: Path) -> None:
    path = tmp_path / "s.db"
    samples.filled(path, samples.study())
    with pytest.raises(UsageError, match="'fialed'"):
        forget(path, ("fialed",))
    with Store.open(path), pytest.raises(FileError) as caught:
        forget(path, ("failed",))
    assert caught.value.code == "STORE_BUSY"
