"""Damaged stores: what vouches for them, and what repair makes of them.

Cuts, flipped bits and lost pages in great numbers are the check ``store`` of :mod:`lampyris_selfcheck`.
"""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Collection
from pathlib import Path

import numpy as np
import pytest
from store_samples import bytes_of, filled, left_open, names, put, rows, study

from lampyris.errors import LampyrisError
from lampyris.study.design.row import Row
from lampyris.study.store import lock as store_lock
from lampyris.study.store import new_store
from lampyris.study.store import repair as repairing
from lampyris.study.store.carve import carved
from lampyris.study.store.file import PAGE
from lampyris.study.store.repair import Repaired, repair
from lampyris.study.store.store import Store, open_for

CODES = {"STORE_DAMAGED", "STORE_FORMAT", "STORE_VERSION", "STUDY_PLAIN", "STUDY_MAP", "PACKED_MAP"}
FRAME = PAGE + 24


def refused(error: LampyrisError, codes: Collection[str] = CODES) -> None:
    """A typed error of one line."""
    assert error.code in codes, error
    assert "\n" not in str(error)


def read(path: Path, right: list[Row]) -> bool:
    """Whether a store, opened for reading, gives exactly the right rows; if not, it must refuse."""
    try:
        with Store.open(path, writable=False) as store:
            found = list(store.rows().values())
            assert len(store.study()) == 4 * 12
    except LampyrisError as error:
        refused(error)
        return False
    assert found == right
    return True


def written(path: Path, right: list[Row], more: list[Row]) -> bool:
    """The same of one that is opened for writing, added to, and read again."""
    try:
        with open_for(path, study(12)) as store:
            assert list(store.rows().values()) == right
            store.add(more)
            assert list(store.rows().values()) == right + more
        with Store.open(path, writable=False) as store:
            assert list(store.rows().values()) == right + more
    except LampyrisError as error:
        refused(error)
        return False
    return True


def after_repair(path: Path, right: list[Row], least: int) -> Repaired:
    """Repair keeps only right rows, at least so many, and the rest can be added; both then are as new."""
    told = repair(path, study=study(12))
    with open_for(path, study(12)) as store:
        kept = store.rows()
        of_key = {row.key: row for row in right}
        assert all(of_key[key] == row for key, row in kept.items())
        assert len(kept) == told.kept >= least
        store.add(right)
        assert store.rows() == of_key
    assert "-wal" not in bytes_of(path)
    return told


def rows_of(path: Path) -> dict[str, Row]:
    """All rows; a repaired store has them in an order of its own."""
    with Store.open(path, writable=False) as store:
        return store.rows()


def clear(folder: Path) -> None:
    for name in names(folder):
        (folder / name).unlink()


@pytest.fixture(scope="module")
def closed(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, bytes], list[Row]]:
    """A store of 40 rows, closed, some longer than a page: its files, and the rows."""
    folder = tmp_path_factory.mktemp("closed")
    given = rows(study(12), words=2500)[:40]
    filled(folder / "a", study(12), 7, given)
    return bytes_of(folder / "a"), given


@pytest.fixture(scope="module")
def open_(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, bytes], list[Row]]:
    """A store as a killed writer leaves it: 20 rows in the main file, 28 in the log, five a call."""
    return left_open(tmp_path_factory.mktemp("open") / "a", study(12), 5, closed=20)


# ---- what vouches for it --------------------


def test_a_log_that_nothing_vouches_for_is_not_believed(
    tmp_path: Path, closed: tuple[dict[str, bytes], list[Row]], open_: tuple[dict[str, bytes], list[Row]]
) -> None:
    """SQLite reads any log with the right sums: that of another store, or of an earlier state of this one."""
    files, right = open_
    put(tmp_path / "a", {k: v for k, v in files.items() if k != ".lock"})
    assert not read(tmp_path / "a", right)
    assert not written(tmp_path / "a", right, [])
    put(tmp_path / "a", {"": closed[0][""], "-wal": files["-wal"]})
    assert not read(tmp_path / "a", closed[1])
    told = after_repair(tmp_path / "a", [*closed[1], *right[40:]], len(closed[1]))
    assert told.kept >= len(closed[1])
    put(tmp_path / "b", {k: v for k, v in files.items() if k in ("", "-wal")})
    assert repair(tmp_path / "b").kept == len(right)
    assert rows_of(tmp_path / "b") == {row.key: row for row in right}


def test_what_is_gone_with_its_witness_was_never_there(
    tmp_path: Path, open_: tuple[dict[str, bytes], list[Row]]
) -> None:
    """This is what the witness is for: with it the missing log is missed, without it nobody knows."""
    files, right = open_
    put(tmp_path / "a", {k: v for k, v in files.items() if k != "-wal"})
    assert not read(tmp_path / "a", right)
    put(tmp_path / "a", {"": files[""]})
    with Store.open(tmp_path / "a", writable=False) as store:
        assert list(store.rows().values()) == right[:20]


def test_a_store_that_is_not_the_one_witnessed_is_refused(
    tmp_path: Path, open_: tuple[dict[str, bytes], list[Row]]
) -> None:
    files, right = open_
    filled(tmp_path / "a", study(12), 5, right[::-1])
    other = bytes_of(tmp_path / "a")
    put(tmp_path / "a", {**other, ".lock": files[".lock"]})
    assert not read(tmp_path / "a", right[::-1])
    put(tmp_path / "a", other)
    assert read(tmp_path / "a", right[::-1])


def test_a_log_that_a_reader_kept_from_being_emptied_is_still_vouched_for(tmp_path: Path) -> None:
    path = tmp_path / "a"
    right = rows(study(12))
    store = Store.create(path, study(12))
    store.add(right[:10])
    with Store.open(path, writable=False) as reader:
        scan = reader.scan()
        next(scan)
        store.add(right[10:])
        store.close()
        assert len(list(scan)) == 9
    files = bytes_of(path)
    assert files["-wal"]
    assert ".lock" in files
    assert read(path, right)
    put(path, {**files, "-wal": files["-wal"][:-1]})
    assert not read(path, right)
    put(path, files)
    assert written(path, right, [])
    assert set(bytes_of(path)) == {""}


def test_a_head_that_says_another_journal_is_damage_and_not_a_file_that_may_only_be_read(
    tmp_path: Path, closed: tuple[dict[str, bytes], list[Row]]
) -> None:
    files, right = closed
    for at, value in ((16, 0x20), (18, 1), (18, 3), (19, 1), (21, 0x41), (47, 3), (59, 2)):
        data = bytearray(files[""])
        data[at] = value
        put(tmp_path / "a", {"": bytes(data)})
        for writable in (True, False):
            with pytest.raises(LampyrisError, match="STORE_DAMAGED"):
                Store.open(tmp_path / "a", writable=writable)
        assert after_repair(tmp_path / "a", right, len(right)).lost == 0
        clear(tmp_path)


def test_nothing_is_added_to_a_store_whose_map_is_damaged(
    tmp_path: Path, closed: tuple[dict[str, bytes], list[Row]]
) -> None:
    """Its runs are whole, so a study went on for days with what nobody could draw."""
    files, right = closed
    put(tmp_path / "a", {"": files[""].replace(b'"blocked"', b'"blOcked"', 1)})
    with pytest.raises(LampyrisError, match=r"STORE_DAMAGED.*maps: record 2"):
        open_for(tmp_path / "a", study(12))
    assert after_repair(tmp_path / "a", right, len(right)).lost == 0


def test_what_may_be_read_but_not_added_to_can_be_repaired(
    tmp_path: Path, closed: tuple[dict[str, bytes], list[Row]]
) -> None:
    files, right = closed
    data = bytearray(files[""])
    data[3 * PAGE + 2] ^= 1  # where the root page of the runs says that it has room
    put(tmp_path / "a", {"": bytes(data)})
    assert read(tmp_path / "a", right)
    with pytest.raises(LampyrisError, match="STORE_DAMAGED"):
        open_for(tmp_path / "a", study(12))
    told = after_repair(tmp_path / "a", right, len(right))
    assert told.lost == 0


# ---- repair --------------------


def test_repair_of_a_sound_store_changes_nothing(
    tmp_path: Path, closed: tuple[dict[str, bytes], list[Row]], open_: tuple[dict[str, bytes], list[Row]]
) -> None:
    for files, right in (closed, open_):
        put(tmp_path / "a", files)
        told = repair(tmp_path / "a")
        assert (told.kept, told.lost) == (len(right), 0)
        assert "nothing is damaged" in told.notes[0]
        after = bytes_of(tmp_path / "a")
        assert {k: v for k, v in after.items() if k in ("", "-wal")} == {
            k: v for k, v in files.items() if k in ("", "-wal")
        }
        assert read(tmp_path / "a", right)
        copied = repair(tmp_path / "a", tmp_path / "b")
        assert (copied.kept, copied.lost) == (len(right), 0)
        assert rows_of(tmp_path / "b") == {row.key: row for row in right}
        assert names(tmp_path) == sorted(["b", *(f"a{e}" for e in after)])
        clear(tmp_path)


def test_repair_keeps_the_damaged_store_and_says_what_is_lost(
    tmp_path: Path, open_: tuple[dict[str, bytes], list[Row]]
) -> None:
    files, right = open_
    path = tmp_path / "a"
    hurt = {**files, "-wal": files["-wal"][: -3 * FRAME]}
    put(path, hurt)
    told = repair(path)
    assert told.kept + told.lost == len(right)
    assert 0 < told.lost <= 5
    assert f"{told.lost} runs are lost" in told.notes[0]
    assert "a.damaged" in told.notes[-1]
    assert names(tmp_path) == ["a", "a.damaged", "a.damaged-wal"]
    assert (tmp_path / "a.damaged").read_bytes() == files[""]
    assert (tmp_path / "a.damaged-wal").read_bytes() == hurt["-wal"]
    with open_for(path, study(12)) as store:
        assert store.add(right) == told.lost
    # Once more, with what is kept of the first time in the way.
    path.write_bytes(path.read_bytes()[: -3 * PAGE])
    assert repair(path).kept < len(right)
    assert names(tmp_path) == ["a", "a.damaged", "a.damaged-2", "a.damaged-wal"]


def test_repair_elsewhere_leaves_the_damaged_store_alone(
    tmp_path: Path, closed: tuple[dict[str, bytes], list[Row]]
) -> None:
    files, right = closed
    path = tmp_path / "a"
    hurt = {"": files[""][: -2 * PAGE]}
    put(path, hurt)
    told = repair(path, tmp_path / "b")
    assert told.kept + told.lost == len(right)
    assert told.lost > 0
    assert bytes_of(path) == hurt
    assert names(tmp_path) == ["a", "b"]
    with pytest.raises(LampyrisError, match="STORE_EXISTS"):
        repair(path, tmp_path / "b")
    with pytest.raises(LampyrisError, match=r"STORE_WRITE.*no such folder"):
        repair(path, tmp_path / "no" / "b")


def test_repair_without_the_study_asks_for_it(
    tmp_path: Path, closed: tuple[dict[str, bytes], list[Row]]
) -> None:
    files, right = closed
    path = tmp_path / "a"
    for word in (b'"worlds"', b'"blocked"'):
        data = files[""].replace(word, word.upper(), 1)
        assert data != files[""]
        put(path, {"": data})
        with pytest.raises(LampyrisError, match=r"give the study's file too") as caught:
            repair(path)
        assert caught.value.code == "STORE_STUDY"
        assert bytes_of(path) == {"": data}
        if word == b'"blocked"':
            with pytest.raises(LampyrisError, match=r"STORE_STUDY.*seeds: 12 values and \[0, 1, 2\]"):
                repair(path, study=study(3))
        assert repair(path, study=study(12)).kept == len(right)
        assert rows_of(path) == {row.key: row for row in right}
        clear(tmp_path)


def test_repair_with_another_study_keeps_its_runs_only(
    tmp_path: Path, closed: tuple[dict[str, bytes], list[Row]]
) -> None:
    files, right = closed
    path = tmp_path / "a"
    put(path, {"": files[""].replace(b'"worlds"', b'"wOrlds"', 1)})
    told = repair(path, study=study(3))
    with Store.open(path) as store:
        assert store.keys() == {job.key for job in study(3).jobs()} & {row.key for row in right}
        assert len(store) == told.kept > 0
    assert any("not of the study that was given" in note for note in told.notes)


def test_repair_of_what_is_no_store(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "text").write_text("nothing of the kind")
    (tmp_path / "empty").touch()
    for name, code in (("no", "STORE_READ"), ("folder", "STORE_READ"), ("text", "STORE_FORMAT"),
                       ("empty", "STORE_FORMAT")):  # fmt: skip
        with pytest.raises(LampyrisError) as caught:
            repair(tmp_path / name)
        assert caught.value.code == code
    assert names(tmp_path) == ["empty", "folder", "text"]
    with Store.create(tmp_path / "a", study(12)), pytest.raises(LampyrisError, match="STORE_BUSY"):
        repair(tmp_path / "a")


def test_only_a_log_is_left(tmp_path: Path, open_: tuple[dict[str, bytes], list[Row]]) -> None:
    files, right = open_
    put(tmp_path / "a", {k: v for k, v in files.items() if k})
    told = repair(tmp_path / "a", study=study(12))
    assert 20 <= told.kept < len(right)
    assert told.kept + told.lost == len(right)


@pytest.mark.parametrize("point", range(4))
def test_a_repair_that_is_killed_loses_nothing(
    tmp_path: Path, point: int, open_: tuple[dict[str, bytes], list[Row]], monkeypatch: pytest.MonkeyPatch
) -> None:
    files, right = open_
    path = tmp_path / "a"
    put(path, {**files, "-wal": files["-wal"][:-1]})
    count = 0

    def counted(name: str, real):  # type: ignore[no-untyped-def]
        def do(*args: object, **more: object) -> object:
            nonlocal count
            count += 1
            if count == point + 1:
                raise Killed
            return real(*args, **more)

        monkeypatch.setattr(name, do)

    class Killed(BaseException):
        pass

    counted("lampyris.study.store.repair._set_aside", repairing._set_aside)
    counted("lampyris.study.store.new_store.os.replace", os.replace)
    counted(
        "lampyris.study.store.new_store.sync_folder",
        new_store.sync_folder,
    )
    counted(
        "lampyris.study.store.lock.StoreLock.start",
        store_lock.StoreLock.start,
    )
    with pytest.raises(Killed):
        repair(path)
    monkeypatch.undo()
    told = repair(path)
    assert told.kept == len(right), "only the frame that says how many there are was cut"
    with open_for(path, study(12)) as store:
        store.add(right)
        assert store.rows() == {row.key: row for row in right}


# ---- carving --------------------


def test_every_record_is_carved_once_from_a_closed_store(closed: tuple[dict[str, bytes], list[Row]]) -> None:
    files, right = closed
    found = list(carved(files[""], b""))
    assert [t for t, _ in found].count("meta") == 1
    assert [t for t, _ in found].count("maps") == 2
    assert sorted(texts[1] for table, texts in found if table == "runs") == sorted(r.key for r in right)


def test_records_are_found_without_any_head_of_file_or_page(
    closed: tuple[dict[str, bytes], list[Row]],
) -> None:
    files, right = closed
    data = bytearray(files[""])
    for at in range(0, len(data), PAGE):
        if data[at] in (5, 13) or at == 0:
            data[at : at + (100 if at == 0 else 8)] = bytes(100 if at == 0 else 8)
    keys = {texts[1] for table, texts in carved(bytes(data), b"") if table == "runs"}
    assert keys == {row.key for row in right}


def test_carving_agrees_with_sqlite_on_stores_of_any_page_count(tmp_path: Path) -> None:
    of = study(60)
    for count in (1, 3, 4, 5, 100, 240):
        path = tmp_path / f"{count}"
        given = [row for k, row in enumerate(rows(of, words=37 * count)) if k < count]
        filled(path, of, 50, given)
        db = sqlite3.connect(path)
        want = db.execute("SELECT seal, key, ending, error, metrics, timing FROM runs ORDER BY n").fetchall()
        db.close()
        found = [texts for table, texts in carved(path.read_bytes(), b"") if table == "runs"]
        assert sorted(found) == sorted(want)
        assert len(want) == count


def test_long_records_are_followed_wherever_they_go_on(tmp_path: Path) -> None:
    """Of many lengths up to four pages, in the log and in the main file."""
    of = study(40)
    given = [Row(job.key, "failed", {}, {}, "x" * (89 * job.index)) for job in of.jobs()]
    with Store.create(tmp_path / "a", of) as store:
        for k in range(0, len(given), 16):
            store.add(given[k : k + 16])
        files = bytes_of(tmp_path / "a")
        assert len(files["-wal"]) > 100 * FRAME
        inlog = [texts for table, texts in carved(b"", files["-wal"]) if table == "runs"]
    found = [texts for table, texts in carved((tmp_path / "a").read_bytes(), b"") if table == "runs"]
    for some in (inlog, found):
        assert {texts[1]: len(texts[3]) for texts in some} == {row.key: len(row.error) for row in given}


def test_noise_is_no_record() -> None:
    rng = np.random.Generator(np.random.PCG64(1))
    noise = rng.integers(0, 256, 200_000, dtype=np.uint8).tobytes()
    heads = b"".join(bytes([k]) + b"\x00\x81\x0d" + noise[k * 50 : k * 50 + 40] for k in range(5, 49))
    assert list(carved(noise + heads * 5, noise)) == []
    assert list(carved(b"", b"")) == []
    assert list(carved(b"\x06\x00\x81\x0d", b"\x06\x00\x81\x0d")) == []
