"""Damaged and forged stores: what is wrong is named, repair keeps the rest, and the study runs the lost runs again.

Cuts, turned bits and lost pages in great numbers are the check ``store`` of :mod:`lampyris_selfcheck`.
"""

from __future__ import annotations

import json
import os
import sqlite3
from pathlib import Path

import pytest
from store_samples import bytes_of, filled, left_open, names, put, rows, study

from lampyris.errors import InternalFault, LampyrisError
from lampyris.study.design.row import Row
from lampyris.study.store import file as store_file
from lampyris.study.store import repair as repairing
from lampyris.study.store.file import checksum
from lampyris.study.store.repair import repair
from lampyris.study.store.store import Store, open_for

PAGE = 4096
Sample = tuple[dict[str, bytes], list[Row]]


@pytest.fixture(scope="module")
def closed(tmp_path_factory: pytest.TempPathFactory) -> Sample:
    """A store of 40 rows, closed, some longer than a page: its files, and the rows."""
    folder = tmp_path_factory.mktemp("closed")
    given = rows(study(12), words=2500)[:40]
    filled(folder / "a", study(12), 7, given)
    return bytes_of(folder / "a"), given


@pytest.fixture(scope="module")
def open_(tmp_path_factory: pytest.TempPathFactory) -> Sample:
    """A store as a killed writer leaves it: 20 rows in the main file, 28 in the log, five a call."""
    return left_open(tmp_path_factory.mktemp("open") / "a", study(12), 5, closed=20)


def refused(path: Path, code: str, word: str = "error") -> None:
    """Reading, writing and resuming are refused in one line each, and nothing is changed."""
    before = bytes_of(path)[""]
    for writable in (False, True):
        with pytest.raises(LampyrisError, match=word) as caught, Store.open(path, writable=writable) as store:
            store.study(), store.rows()
        assert caught.value.code == code
        assert str(caught.value).isprintable()
    with pytest.raises(LampyrisError) as caught, open_for(path, study()):
        pass
    assert caught.value.code in (code, "STORE_OTHER")
    assert bytes_of(path)[""] == before


def completed(path: Path, right: list[Row]) -> int:
    """Resume the study: how many rows were not there, with which all are."""
    with open_for(path, study(12)) as store:
        new = store.add(right)
        assert store.rows() == {row.key: row for row in right}
    assert set(bytes_of(path)) == {""}
    return new


def stored(path: Path) -> dict[str, Row]:
    with Store.open(path, writable=False) as store:
        return store.rows()


# ---- what is damaged --------------------


def test_one_turned_bit_costs_one_run(tmp_path: Path, closed: Sample) -> None:
    files, right = closed
    path = tmp_path / "a"
    for row in (right[3], right[17], right[39]):
        data = bytearray(files[""])
        data[data.rindex(row.key.encode()) + 66] ^= 4
        put(path, {"": bytes(data)})
        with pytest.raises(
            LampyrisError, match=rf"STORE_DAMAGED.*run {right.index(row) + 1} \({row.key[:12]}\)"
        ):
            open_for(path, study(12))
        came = repair(path)
        assert (came.kept, came.lost, came.lost_runs) == (39, 1, (row.key,))
        assert came.notes[0] == f"1 run is lost ({row.key[:12]}); `lampyris study` runs what is missing"
        assert completed(path, right) == 1
        for name in names(tmp_path):
            (tmp_path / name).unlink()


def test_rows_that_a_damaged_page_hides_are_missed(tmp_path: Path, closed: Sample) -> None:
    """SQLite reads on without an error where a page says that it holds fewer rows."""
    files, right = closed
    path, seen = tmp_path / "a", 0
    for at in range(PAGE, len(files[""]), PAGE):
        if files[""][at] != 13 or files[""][at + 4] < 2:
            continue
        data = bytearray(files[""])
        data[at + 4] -= 1
        put(path, {"": bytes(data)})
        if not _is_sound(path):
            with pytest.raises(LampyrisError, match="STORE_DAMAGED") as caught:
                stored(path)
            seen += "runs can be read, and its index has 40" in str(caught.value)
        else:
            assert list(stored(path).values()) == right
    assert seen >= 2


def test_what_can_be_read_but_not_added_to_can_be_repaired(tmp_path: Path, closed: Sample) -> None:
    """Written to, such a store would lose rows."""
    files, right = closed
    data = bytearray(files[""])
    leaf = next(at for at in range(2 * PAGE, len(data), PAGE) if data[at] == 13)
    data[leaf + 2] ^= 1  # where a page of runs says that it has room
    put(tmp_path / "a", {"": bytes(data)})
    assert list(stored(tmp_path / "a").values()) == right
    with pytest.raises(LampyrisError, match="STORE_DAMAGED"):
        open_for(tmp_path / "a", study(12))
    assert repair(tmp_path / "a").lost == 0
    assert completed(tmp_path / "a", right) == 0


def test_a_cut_store_gives_back_what_is_left(tmp_path: Path, closed: Sample) -> None:
    files, right = closed
    path, kept = tmp_path / "a", []
    for pages in range(2, len(files[""]) // PAGE):
        put(path, {"": files[""][: pages * PAGE]})
        with pytest.raises(LampyrisError, match=r"STORE_DAMAGED.*lampyris study repair"):
            stored(path)
        came = repair(path, study=study(12))
        kept.append(came.kept)
        assert came.kept + came.lost == 40 or "there may have been more" in " ".join(came.notes)
        assert completed(path, right) == 40 - came.kept
    assert max(kept) >= 25
    assert kept == sorted(kept)


def test_a_log_that_a_reader_kept_from_being_emptied_is_read(tmp_path: Path) -> None:
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
    assert bytes_of(path)["-wal"]
    assert list(stored(path).values()) == right
    assert completed(path, right) == 0


# ---- repair --------------------


def test_repair_of_a_sound_store_changes_nothing(tmp_path: Path, closed: Sample, open_: Sample) -> None:
    for files, right in (closed, open_):
        put(tmp_path / "a", files)
        before = bytes_of(tmp_path / "a")
        came = repair(tmp_path / "a")
        assert (came.kept, came.lost, came.lost_runs) == (len(right), 0, ())
        assert "nothing is damaged" in came.notes[0]
        after = bytes_of(tmp_path / "a")
        assert all(after.get(k) == before.get(k) for k in ("", "-wal"))
        copied = repair(tmp_path / "a", tmp_path / "b")
        assert (copied.kept, copied.lost) == (len(right), 0)
        assert stored(tmp_path / "b") == {row.key: row for row in right}
        assert names(tmp_path) == sorted(["b", *(f"a{e}" for e in after)])
        for name in names(tmp_path):
            (tmp_path / name).unlink()


def test_repair_keeps_the_damaged_store_and_its_log(tmp_path: Path, open_: Sample) -> None:
    """The log of the damaged store must not be read into the new one."""
    files, right = open_
    path = tmp_path / "a"
    main = bytearray(files[""])
    main[main.rindex(right[2].key.encode()) + 66] ^= 4
    log = bytearray(files["-wal"])
    log[-1] ^= 1  # the last call is not read
    put(path, {"": bytes(main), "-wal": bytes(log)})
    came = repair(path)
    assert came.lost_runs == (right[2].key,)
    assert "a.damaged" in came.notes[-1]
    assert names(tmp_path) == ["a", "a.damaged", "a.damaged-wal"]
    assert (tmp_path / "a.damaged").read_bytes() == main
    assert (tmp_path / "a.damaged-wal").read_bytes() == log
    assert completed(path, right) == len(right) - came.kept
    # Once more, with what is kept of the first time in the way.
    path.write_bytes(path.read_bytes()[: -3 * PAGE])
    assert repair(path).kept < len(right)
    assert names(tmp_path) == ["a", "a.damaged", "a.damaged-2", "a.damaged-wal"]


@pytest.mark.skipif(not os.path.isdir("/proc/self/fd"), reason="names of open files")
@pytest.mark.parametrize("links", [True, False])
def test_what_repair_keeps_is_on_the_disk_before_the_log_goes(
    tmp_path: Path, open_: Sample, links: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A copy is waited for, the folder too, and only then does the log lose its name."""
    path, calls = tmp_path / "a", []
    put(path, {e: open_[0][e] for e in ("", "-wal")})

    def noted(module: object, name: str) -> None:
        call = getattr(module, name)

        def do(one: object, *args: object, **more: object) -> object:
            file = os.readlink(f"/proc/self/fd/{one}") if isinstance(one, int) else str(one)
            calls.append((name, Path(file).name))
            return call(one, *args, **more)

        monkeypatch.setattr(module, name, do)

    def refused(self: Path, target: Path) -> None:
        raise PermissionError(1, "Operation not permitted")

    if not links:
        monkeypatch.setattr(Path, "hardlink_to", refused)
    for module, name in ((os, "fsync"), (Path, "unlink")):
        noted(module, name)
    repairing._set_aside(path)
    copied = [] if links else [("fsync", "a.damaged"), ("fsync", "a.damaged-wal")]
    assert calls == [*copied, ("fsync", tmp_path.name), ("unlink", "a-wal"), ("unlink", "a-shm")]
    assert bytes_of(tmp_path / "a.damaged") == {e: open_[0][e] for e in ("", "-wal")}


def test_repair_elsewhere_leaves_the_damaged_store_alone(tmp_path: Path, closed: Sample) -> None:
    files, right = closed
    path = tmp_path / "a"
    hurt = {"": files[""][: -2 * PAGE]}
    put(path, hurt)
    came = repair(path, tmp_path / "b")
    assert came.kept + came.lost == len(right)
    assert came.lost > 0
    assert bytes_of(path) == hurt
    assert names(tmp_path) == ["a", "b"]
    with pytest.raises(LampyrisError, match="STORE_EXISTS"):
        repair(path, tmp_path / "b")
    with pytest.raises(LampyrisError, match=r"STORE_WRITE.*no such folder"):
        repair(path, tmp_path / "no" / "b")


def test_repair_without_the_study_asks_for_it(tmp_path: Path, closed: Sample) -> None:
    files, right = closed
    path = tmp_path / "a"
    for word in (b'"worlds"', b'"blocked"'):
        data = files[""].replace(word, word.upper(), 1)
        assert data != files[""]
        put(path, {"": data})
        with pytest.raises(LampyrisError, match=r"STORE_DAMAGED.*(study in it|map \d)"):
            open_for(path, study(12))
        with pytest.raises(LampyrisError, match=r"give the study's file too") as caught:
            repair(path)
        assert caught.value.code == "STORE_STUDY"
        assert bytes_of(path) == {"": data}
        if word == b'"blocked"':
            with pytest.raises(LampyrisError, match=r"STORE_STUDY.*seeds: 12 values and \[0, 1, 2\]"):
                repair(path, study=study(3))
        assert repair(path, study=study(12)).kept == len(right)
        assert stored(path) == {row.key: row for row in right}


def test_repair_with_another_study_keeps_its_runs_only(tmp_path: Path, closed: Sample) -> None:
    files, right = closed
    path = tmp_path / "a"
    put(path, {"": files[""].replace(b'"worlds"', b'"wOrlds"', 1)})
    came = repair(path, study=study(3))
    with Store.open(path) as store:
        assert store.keys() == {job.key for job in study(3).jobs()} & {row.key for row in right}
        assert len(store) == came.kept > 0
    assert any("not of the study that was given" in note for note in came.notes)


def test_repair_of_what_is_no_store(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "text").write_text("nothing of the kind")
    (tmp_path / "empty").touch()
    for name, code in (("no", "STORE_READ"), ("folder", "STORE_FORMAT"), ("text", "STORE_FORMAT"),
                       ("empty", "STORE_DAMAGED")):  # fmt: skip
        with pytest.raises(LampyrisError) as caught:
            repair(tmp_path / name)
        assert caught.value.code == code
    assert names(tmp_path) == ["empty", "folder", "text"]
    with Store.create(tmp_path / "a", study(12)), pytest.raises(LampyrisError, match="STORE_BUSY"):
        repair(tmp_path / "a")


@pytest.mark.parametrize("point", range(6))
def test_a_repair_that_is_killed_loses_nothing(
    tmp_path: Path, point: int, open_: Sample, monkeypatch: pytest.MonkeyPatch
) -> None:
    files, right = open_
    path, calls = tmp_path / "a", 0
    main = bytearray(files[""])
    main[main.rindex(right[2].key.encode()) + 66] ^= 4
    put(path, {"": bytes(main), "-wal": files["-wal"]})

    class Killed(BaseException):
        pass

    def counted(module: object, name: str) -> None:
        real = getattr(module, name)

        def do(*args: object, **more: object) -> object:
            nonlocal calls
            calls += 1
            if calls == point + 1:
                raise Killed
            return real(*args, **more)

        monkeypatch.setattr(module, name, do)

    for module, name in (
        (repairing, "_set_aside"), (Path, "hardlink_to"), (os, "replace"), (store_file, "sync_folder"),
    ):  # fmt: skip
        counted(module, name)
    if point < 5:
        with pytest.raises(Killed):
            repair(path)
    else:
        repair(path)
    monkeypatch.undo()
    kept = {len(stored(tmp_path / name)) for name in names(tmp_path) if _is_sound(tmp_path / name)}
    again = [tmp_path / name for name in names(tmp_path) if name in ("a", "a.damaged", "a.damaged-2")]
    saved = max([*kept, *(repair(one, tmp_path / f"{one.name}-out").kept for one in again)])
    assert saved == len(right) - 1
    repair(path)
    completed(path, right)


def _is_sound(path: Path) -> bool:
    try:
        stored(path)
    except LampyrisError:
        return False
    return True


# ---- forged: the checksums are right, and what was written is not ours --------------------


def forge(path: Path, table: str, n: int, **columns: str) -> None:
    """Change columns of a record, its checksum too."""
    db = sqlite3.connect(path)
    for name, value in columns.items():
        db.execute(f"UPDATE {table} SET {name} = ? WHERE rowid = ?", (value, n))
    found = db.execute(f"SELECT * FROM {table} WHERE rowid = ?", (n,)).fetchone()
    texts = found[1:-1] if table == "runs" else found[:-1]
    db.execute(f"UPDATE {table} SET checksum = ? WHERE rowid = ?", (checksum(table, *texts), n))
    db.commit()
    db.close()


@pytest.mark.parametrize(("columns", "word"), [
    ({"ending": "won"}, "ended 'won'"),
    ({"ending": ""}, "ended ''"),
    ({"metrics": "no JSON"}, "metrics that are no JSON"),
    ({"timing": ""}, "timing that are no JSON"),
    ({"metrics": "[" * 5000}, "metrics that are no JSON"),
    ({"metrics": "[]"}, "metrics that are no table"),
    ({"timing": "7"}, "timing that are no table"),
    ({"metrics": '{"cost":NaN}'}, "metrics.cost that is neither"),
    ({"metrics": '{"cost":-Infinity}'}, "metrics.cost that is neither"),
    ({"metrics": '{"cost":1e999}'}, "metrics.cost that is neither"),
    ({"timing": '{"cpu_s":NaN}'}, "timing.cpu_s that is neither"),
    ({"metrics": '{"cost":[1]}'}, "metrics.cost that is neither"),
    ({"metrics": '{"cost":1' + 40 * "0" + "}"}, "metrics.cost that is neither"),
    ({"metrics": '{"cost":1' + 9000 * "0" + "}"}, "metrics that are no JSON"),
])  # fmt: skip
def test_a_forged_run_that_is_no_row_is_damage(tmp_path: Path, columns: dict[str, str], word: str) -> None:
    path = tmp_path / "a"
    given = filled(path, study())
    forge(path, "runs", 8, **columns)
    refused(path, "STORE_DAMAGED", rf"run 8 \({given[7].key[:12]}\) .*{word}")
    came = repair(path)
    assert (came.kept, came.lost_runs) == (len(given) - 1, (given[7].key,))
    with open_for(path, study()) as store:
        assert store.add(given) == 1
        assert store.rows() == {row.key: row for row in given}


@pytest.mark.parametrize("text", ["", "[]", "no JSON", '{"seeds":NaN}', '{"seeds":1e999}', "[" * 5000])
def test_a_forged_study_that_is_no_table_is_damage(tmp_path: Path, text: str) -> None:
    path = tmp_path / "a"
    given = filled(path, study())
    forge(path, "meta", 1, value=text)
    refused(path, "STORE_DAMAGED", "the study is no table")
    with pytest.raises(LampyrisError, match="STORE_STUDY"):
        repair(path, path.with_name("b"))
    assert repair(path, path.with_name("b"), study=study()).kept == len(given)


@pytest.mark.parametrize("maps", [None, 7, [], [7], [{"hash": 7}], {"a": "b"}])
def test_a_forged_study_with_maps_of_another_form_is_refused(tmp_path: Path, maps: object) -> None:
    path = tmp_path / "a"
    filled(path, study())
    with Store.open(path, writable=False) as store:
        plain = store.plain()
    forge(path, "meta", 1, value=json.dumps({**plain, "maps": maps}))
    refused(path, "STUDY_MAP" if maps == [{"hash": 7}] else "STUDY_PLAIN")


@pytest.mark.parametrize("what", ["worlds", "planners", "laws", "traffic_cases", "seeds"])
def test_a_forged_study_of_no_runs_is_no_study(tmp_path: Path, what: str) -> None:
    path = tmp_path / "a"
    filled(path, study())
    with Store.open(path, writable=False) as store:
        plain = store.plain()
    called = {**plain["called"], what: []} if what in plain["called"] else plain["called"]
    forge(path, "meta", 1, value=json.dumps({**plain, what: [], "called": called}))
    refused(path, "STUDY_PLAIN", f"no {what}")


def test_a_forged_map_that_is_none_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a"
    filled(path, study())
    for text in ("", "[]", '{"blocked":7}', "{}"):
        forge(path, "maps", 1, value=text)
        with pytest.raises(LampyrisError) as caught, Store.open(path, writable=False) as store:
            store.study()
        assert caught.value.code in ("STORE_DAMAGED", "PACKED_MAP")


def test_a_view_or_a_trigger_in_the_file_is_never_run(tmp_path: Path) -> None:
    path = tmp_path / "a"
    filled(path, study())
    db = sqlite3.connect(path)
    db.executescript(
        "ALTER TABLE runs RENAME TO hidden; CREATE VIEW runs AS WITH RECURSIVE n(n) AS"
        " (SELECT 1 UNION ALL SELECT n + 1 FROM n) SELECT n, '' key FROM n"
    )
    db.close()
    refused(path, "STORE_DAMAGED", "tables are not those of a store")
    with pytest.raises(LampyrisError, match="tables are not those of a store"):
        repair(path)


@pytest.mark.parametrize("row", [
    Row("k", "won"), Row("k", "done", {"cost": 2**63}), Row("k", "done", {"cost": float("nan")}),  # type: ignore[arg-type]
    Row("k", "done", {"cost": [1]}), Row("k", "done", {}, {"cpu_s": float("inf")}),
])  # fmt: skip
def test_what_could_not_be_read_again_is_not_stored(tmp_path: Path, row: Row) -> None:
    with Store.create(tmp_path / "a", study()) as store:
        with pytest.raises(InternalFault, match="STORE_ROW"):
            store.add([rows(study())[0], row])
        assert store.rows() == {}
        assert store.add(rows(study())) == 40
