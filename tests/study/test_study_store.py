"""Store: what was acknowledged is there; one writer at a time; whatever the system refuses is one clear line."""

from __future__ import annotations

import math
import os
import signal
import sqlite3
import threading
from pathlib import Path
from typing import Any

import pytest
from store_samples import bytes_of, child, filled, names, rows, study

from lampyris.errors import BusyError, InternalFault, LampyrisError, UsageError
from lampyris.study.design.row import Row
from lampyris.study.design.serialize import study_plain
from lampyris.study.design.study import Config, Study, StudyTraffic
from lampyris.study.store.lock import StoreLock
from lampyris.study.store.store import Store, open_for


def read_all(path: Path, *, writable: bool) -> None:
    """Open and read everything."""
    with Store.open(path, writable=writable) as store:
        store.study()
        store.rows()


def code_of(path: Path, code: str, *, writable: bool = True) -> str:
    """Opening and reading it all is refused with that code, in one line; the line."""
    with pytest.raises(LampyrisError) as caught:
        read_all(path, writable=writable)
    assert caught.value.code == code
    text = str(caught.value)
    assert text.isprintable()
    assert path.name in text
    return text


# ---- what is stored --------------------


@pytest.mark.parametrize("batch", [1, 7, 40])
def test_what_was_added_is_there_and_nothing_lies_beside(tmp_path: Path, batch: int) -> None:
    of = study()
    path = tmp_path / "a.study"
    given = filled(path, of, batch)
    assert names(tmp_path) == ["a.study"]
    with Store.open(path, writable=False) as store:
        found = store.rows()
        assert list(found.values()) == given
        assert list(found) == [r.key for r in given]
        assert store.keys() == {r.key for r in given}
        assert len(store) == len(given) == 40
        again = store.study()
        assert study_plain(again) == study_plain(of) == store.plain()
        assert [j.key for j in again.jobs()] == [j.key for j in of.jobs()]
    assert math.copysign(1, found[given[5].key].metrics["near_m"]) == -1
    metrics = found[given[1].key].metrics
    assert [type(metrics[k]) for k in given[1].metrics] == [bool, float, int, str, float]
    assert names(tmp_path) == ["a.study"]


def test_the_study_needs_no_other_file_and_the_bytes_know_no_clock(tmp_path: Path) -> None:
    of = study()
    for name in ("a", "b"):
        filled(tmp_path / name, of)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
    out = child(
        "from lampyris.study.store.store import Store\n"
        "study = Store.open(sys.argv[1], writable=False).study()\n"
        "print(study.worlds[1].ground.grid.blocked.sum(), len(study))",
        tmp_path / "a",
    )
    assert out.stdout == "1 40\n"


def test_a_commit_waits_for_the_disk_in_a_write_ahead_log(tmp_path: Path) -> None:
    """SQLite syncs its log at each commit with FULL (2), at checkpoints alone with NORMAL."""
    filled(tmp_path / "a", study())
    for make in (lambda: Store.create(tmp_path / "b", study()), lambda: Store.open(tmp_path / "a")):
        with make() as store:
            assert store._writer is not None
            pragmas = [
                store._writer.execute(f"PRAGMA {name}").fetchone()[0]
                for name in ("synchronous", "journal_mode")
            ]
            assert pragmas == [2, "wal"]


def test_rows_longer_than_a_page_and_words_of_every_sort(tmp_path: Path) -> None:
    of = study(3)
    given = rows(of, words=20000)
    given[0] = Row(given[0].key, "failed", {}, {}, "lone \udcff surrogate")
    filled(tmp_path / "a", of, 2, given)
    with Store.open(tmp_path / "a") as store:
        found = list(store.rows().values())
    assert found[1:] == given[1:]
    assert found[0].error == "lone \\udcff surrogate"


def test_adding_again_is_nothing_and_another_result_is_refused(tmp_path: Path) -> None:
    of = study()
    given = rows(of)
    with Store.create(tmp_path / "a", of) as store:
        assert store.add(given[:7]) == 7
        assert store.add(given[3:12]) == 5
        assert store.add([]) == 0
        assert store.add([given[12], given[12]]) == 1
        slower = Row(given[0].key, given[0].ending, given[0].metrics, {"cpu_s": 99.0}, "other words")
        assert store.add([slower]) == 0
        others = [
            (Row(given[1].key, "done", {**given[1].metrics, "cost": 7.0}), "cost is "),
            (
                Row(given[1].key, "done", {**given[1].metrics, "more": None}),
                "more is None in the store and None",
            ),
            (
                Row(given[1].key, "done", {**given[1].metrics, "expansions": 100.0}),
                "expansions is 100 in the st",
            ),
            (
                Row(given[1].key, "timeout", given[1].metrics),
                "ending is 'done' in the store and 'timeout' now",
            ),
        ]
        for other, words in others:
            with pytest.raises(LampyrisError, match=words) as caught:
                store.add([given[20], other])
            assert caught.value.code == "STORE_CONFLICT"
            assert given[1].key in str(caught.value)
        with pytest.raises(LampyrisError, match="cost is"):
            store.add([given[21], Row(given[21].key, "done", {**given[21].metrics, "cost": 1.0})])
        assert store.keys() == {r.key for r in given[:13]}
        store.add(given[13:])
    with Store.open(tmp_path / "a") as store:
        assert list(store.rows().values()) == given
        assert store.add(given) == 0


@pytest.mark.parametrize(
    "metrics",
    [{"cost": math.nan}, {"cost": math.inf}, {"cost": [1]}, {"cost": {"a": 1}}, {1: 2}, {"cost": b"1"}],
)
def test_what_is_not_plain_is_a_fault_of_ours_and_stores_nothing(tmp_path: Path, metrics: dict) -> None:
    of = study()
    with Store.create(tmp_path / "a", of) as store:
        with pytest.raises(InternalFault, match="STORE_ROW"):
            store.add([*rows(of)[:3], Row("k", "done", metrics)])
        assert store.rows() == {}


def test_a_closed_store_and_a_reader_say_so(tmp_path: Path) -> None:
    of = study()
    filled(tmp_path / "a", of)
    store = Store.open(tmp_path / "a")
    store.close()
    store.close()
    for ask in (store.rows, store.study, store.plain, store.maps, lambda: store.add([])):
        with pytest.raises(UsageError, match="STORE_CLOSED"):
            ask()
    with (
        Store.open(tmp_path / "a", writable=False) as reader,
        pytest.raises(UsageError, match="STORE_READER"),
    ):
        reader.add(rows(of))


# ---- whose it is --------------------


def test_open_for_makes_it_then_finds_it_again(tmp_path: Path) -> None:
    of = study()
    with open_for(tmp_path / "a", of) as store:
        store.add(rows(of)[:5])
    renamed = study(name="other words", about="the same question")
    with open_for(tmp_path / "a", renamed) as store:
        assert len(store) == 5


@pytest.mark.parametrize(
    ("more", "words"),
    [({"seeds": 2}, "seeds"), ({"traffic_cases": (StudyTraffic("random-walk", 4),)}, "traffic_cases.0.count: 3 and 4"),
     ({"laws": (Config("constant", {"speed": 1}),)}, "laws.0.settings.speed"), ({"worlds": study().worlds[:1]}, "maps")],
)  # fmt: skip
def test_another_study_is_refused_with_the_field_that_differs(tmp_path: Path, more: dict, words: str) -> None:
    """Every field is asked by ``lampyris selfcheck store --only resume``."""
    path = tmp_path / "a"
    with Store.create(path, study()) as store:
        store.add(rows(study())[:3])
    before = bytes_of(path)
    with pytest.raises(LampyrisError, match=words) as caught:
        open_for(path, study(**more))
    assert caught.value.code == "STORE_OTHER"
    assert "store=FILE" in str(caught.value)  # the command line says --store FILE
    assert bytes_of(path) == before


def test_a_store_of_another_release_is_refused_for_writing_by_version(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    filled(tmp_path / "a", study())
    monkeypatch.setattr("lampyris.study.design.serialize.__version__", "99.0")
    with pytest.raises(LampyrisError, match=r"STORE_OTHER.*version"):
        open_for(tmp_path / "a", study())
    with Store.open(tmp_path / "a", writable=False) as store:
        assert len(store.rows()) == 40
        with pytest.raises(LampyrisError, match="STUDY_VERSION"):
            store.study()


def test_one_writer_at_a_time_and_readers_meanwhile(tmp_path: Path) -> None:
    of = study()
    path = tmp_path / "a"
    given = rows(of)
    with Store.create(path, of) as store:
        for again in (lambda: Store.open(path), lambda: open_for(path, of)):
            with pytest.raises(LampyrisError, match=f"pid {os.getpid()}") as caught:
                again()
            assert caught.value.code == "STORE_BUSY"
        with pytest.raises(LampyrisError, match="STORE_EXISTS"):
            Store.create(path, of)
        with Store.open(path, writable=False) as reader:
            scan = None
            for k in range(0, 40, 10):
                store.add(given[k : k + 10])
                assert list(reader.rows().values()) == given[: k + 10]
                if scan is None:
                    scan = reader.scan()
                    next(scan)
            assert scan is not None
            assert len(list(scan)) == 9, "a scan sees what there was when it began"
    assert names(tmp_path) == ["a"]


def test_a_link_is_the_same_store(tmp_path: Path) -> None:
    (tmp_path / "b").symlink_to(tmp_path / "a")
    with Store.create(tmp_path / "a", study()), pytest.raises(LampyrisError, match="STORE_BUSY"):
        Store.open(tmp_path / "b")


def test_the_lock_goes_with_its_process_and_what_it_acknowledged_stays(tmp_path: Path) -> None:
    done = child(
        """
        import os
        from pathlib import Path
        from store_samples import *
        store = Store.create(Path(sys.argv[1]), study())
        for row in rows(study()):
            store.add([row])
            print(row.key, flush=True)
            if row.metrics["expansions"] == 2300:
                os.kill(os.getpid(), 9)
        """,
        tmp_path / "a",
        check=False,
    )
    assert done.returncode == -signal.SIGKILL
    acknowledged = done.stdout.split()
    assert len(acknowledged) == 24
    with Store.open(tmp_path / "a", writable=False) as store:
        assert list(store.rows().values()) == rows(study())[:24]
    with open_for(tmp_path / "a", study()) as store:
        assert store.keys() == set(acknowledged)
        store.add(rows(study()))
        assert list(store.rows().values()) == rows(study())
    assert names(tmp_path) == ["a"]


def test_the_locks_file_goes_with_the_lock_and_blocks_nobody_when_left(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.with_name("a.lock").write_text("pid 1\n")  # of a process that was killed
    with StoreLock(path) as lock:
        with pytest.raises(LampyrisError, match=f"STORE_BUSY.*pid {os.getpid()}"):
            StoreLock(path)
        lock.release()
        assert names(tmp_path) == []
        with StoreLock(path):
            lock.release()  # once more: it is another's now
            assert names(tmp_path) == ["a.lock"]


class Interrupting:
    """A connection to which Ctrl-C comes just before or after a statement."""

    def __init__(self, connection: object, word: str, *, after: bool = False) -> None:
        self._connection, self._word, self._after = connection, word, after

    def execute(self, sql: str, *more: object) -> object:
        if sql.startswith(self._word) and not self._after:
            raise KeyboardInterrupt
        came = self._connection.execute(sql, *more)  # type: ignore[attr-defined]
        if sql.startswith(self._word):
            raise KeyboardInterrupt
        return came

    @property
    def in_transaction(self) -> bool:
        return self._connection.in_transaction  # type: ignore[attr-defined,no-any-return]


def test_threads_that_want_one_store_at_once_are_refused_but_one(tmp_path: Path) -> None:
    filled(tmp_path / "a", study())
    ready, came = threading.Barrier(6), []

    def want() -> None:
        ready.wait(60)
        try:
            with Store.open(tmp_path / "a") as store:
                note(len(store))
                done.wait(60)
        except LampyrisError as error:
            note(error.code)

    def note(what: int | str) -> None:
        came.append(what)
        if len(came) == 6:  # the one who holds it may be the last to say so
            done.set()

    done = threading.Event()
    threads = [threading.Thread(target=want) for _ in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert sorted(came, key=str) == [40, *["STORE_BUSY"] * 5]


def test_an_interrupt_in_the_middle_leaves_all_or_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    of = study()
    given = rows(of)
    with Store.create(tmp_path / "a", of) as store:
        store.add(given[:5])
        with monkeypatch.context() as patch:
            patch.setattr(store, "_writer", Interrupting(store._writer, "COMMIT", after=True))
            with pytest.raises(KeyboardInterrupt):
                store.add(given[5:9])
        assert store.add(given[5:12]) == 3, "it was stored, though nobody was told"
        for word in ("BEGIN", "SELECT", "INSERT", "COMMIT"):
            with monkeypatch.context() as patch:
                patch.setattr(store, "_writer", Interrupting(store._writer, word))
                with pytest.raises(KeyboardInterrupt):
                    store.add(given[12:14])
            assert len(store) == 12
        store.add(given)
        assert list(store.rows().values()) == given


# ---- what cannot be a store --------------------


def test_what_is_not_a_store_is_named(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    code_of(tmp_path / "folder", "STORE_FORMAT")
    code_of(tmp_path / "nothing", "STORE_READ")
    (tmp_path / "empty").touch()
    assert "empty" in code_of(tmp_path / "empty", "STORE_DAMAGED")
    (tmp_path / "text").write_text("hello, this is no store\n" * 20)
    assert "hello" in code_of(tmp_path / "text", "STORE_FORMAT")
    os.mkfifo(tmp_path / "pipe")
    code_of(tmp_path / "pipe", "STORE_FORMAT")
    (tmp_path / "short").write_bytes(b"SQLite fo")
    code_of(tmp_path / "short", "STORE_DAMAGED")
    for path in ("/dev/zero", "/dev/null"):
        code_of(Path(path), "STORE_FORMAT")
    for word in ("\0", "x" * 300, "\udcff"):
        with pytest.raises(LampyrisError):
            Store.open(tmp_path / word)
        with pytest.raises(LampyrisError):
            Store.create(tmp_path / word / "a", study())
    assert sorted({"folder", "empty", "text", "pipe", "short"}) == names(tmp_path), "nothing was left beside"


def test_other_sqlite_files_and_other_formats_are_refused_unchanged(tmp_path: Path) -> None:
    other = tmp_path / "other.db"
    db = sqlite3.connect(other)
    db.execute("CREATE TABLE runs (n INTEGER PRIMARY KEY)")
    db.commit()
    db.close()
    before = other.read_bytes()
    assert "another program" in code_of(other, "STORE_FORMAT")
    with pytest.raises(LampyrisError, match="STORE_FORMAT"):
        open_for(other, study())
    assert other.read_bytes() == before
    path = tmp_path / "a"
    filled(path, study())
    db = sqlite3.connect(path)
    db.execute("PRAGMA user_version=3")
    db.close()
    assert "format 3" in code_of(path, "STORE_VERSION")
    db = sqlite3.connect(path)
    db.execute("PRAGMA user_version=2")
    db.execute("CREATE TRIGGER t AFTER INSERT ON runs BEGIN DELETE FROM runs; END")
    db.close()
    assert "tables" in code_of(path, "STORE_DAMAGED")


@pytest.mark.parametrize(("sql", "words"), [
    ("UPDATE runs SET metrics = '{}' WHERE n = 7", "run 7 "), ("UPDATE runs SET ending = 'refused' WHERE n = 2", "run 2 "),
    ("UPDATE runs SET metrics = NULL WHERE n = 7", "run 7 "), ("UPDATE runs SET key = x'00' WHERE n = 7", "run 7 "),
    ("INSERT INTO runs SELECT 41, key || '0', ending, error, metrics, timing, checksum FROM runs WHERE n = 1", "run 41 "),
    ("UPDATE runs SET timing = CAST(x'ff' AS TEXT) WHERE n = 1", "UTF-8"),
    ("UPDATE meta SET value = '{}'", "the study in it"), ("DELETE FROM meta", "the study in it"),
    ("INSERT INTO meta VALUES ('', '', '')", "the study in it"),
    ("UPDATE maps SET value = '{}' WHERE rowid = 2", "map 2 "),
    ("DROP INDEX runs_by_key", "tables"), ("ALTER TABLE runs ADD COLUMN more", "tables"),
])  # fmt: skip
def test_a_changed_record_is_named(tmp_path: Path, sql: str, words: str) -> None:
    path = tmp_path / "a"
    filled(path, study())
    db = sqlite3.connect(path)
    db.executescript(sql)
    db.close()
    assert words in code_of(path, "STORE_DAMAGED")
    assert words in code_of(path, "STORE_DAMAGED", writable=False)


def test_runs_deleted_by_hand_are_run_again(tmp_path: Path) -> None:
    path, given = tmp_path / "a", rows(study())
    filled(path, study())
    db = sqlite3.connect(path)
    db.executescript("DELETE FROM runs WHERE n IN (7, 40)")
    db.close()
    with open_for(path, study()) as store:
        assert store.keys() == {row.key for row in given} - {given[6].key, given[39].key}
        assert store.add(given) == 2
        assert store.rows() == {row.key: row for row in given}


def test_a_store_that_another_made_meanwhile_is_gone_on_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two processes began a study at once: the second was told that the file exists, and ended."""
    create = Store.create

    def late(path: Path, of: Study) -> Store:
        with create(path, of) as first:
            first.add(rows(of)[:4])
        return create(path, of)

    monkeypatch.setattr(Store, "create", late)
    with open_for(tmp_path / "a", study()) as store:
        assert len(store) == 4


def test_a_store_is_made_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a"
    with pytest.raises(LampyrisError, match=r"STORE_WRITE.*no such folder"):
        Store.create(tmp_path / "no" / "a", study())
    with monkeypatch.context() as patch:
        patch.setattr("lampyris.study.store.file.os.replace", _raise(OSError(28, "No space left on device")))
        with pytest.raises(LampyrisError, match=r"STORE_WRITE.*No space left"):
            Store.create(path, study())
    assert names(tmp_path) == []
    killed = "import os; from lampyris.study.store import file; from store_samples import *\n"
    killed += "file.os.replace = lambda a, b: os.kill(os.getpid(), 9)\nStore.create(sys.argv[1], study())"
    assert child(killed, path, check=False).returncode == -signal.SIGKILL
    assert "a" not in names(tmp_path)
    with Store.create(path, study()) as store:
        assert store.rows() == {}
    assert names(tmp_path) == ["a"]
    path.unlink()
    path.with_name("a-wal").write_bytes(b"a log of something")
    with pytest.raises(LampyrisError, match=r"STORE_DAMAGED.*a-wal: the log of a store that is not there"):
        Store.create(path, study())
    assert names(tmp_path) == ["a-wal"]


def _raise(error: BaseException):  # type: ignore[no-untyped-def]
    def do(*_: object) -> None:
        raise error

    return do


# ---- several threads --------------------


@pytest.mark.parametrize("second", ["add", "keys", "close"])
def test_a_second_call_while_one_is_at_work_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, second: str
) -> None:
    """From another thread, at the worst moment: within a transaction."""
    of = study()
    path, given = tmp_path / "a.study", rows(of)
    calls = {
        "add": lambda store: store.add(given[1:2]),
        "keys": lambda store: store.keys(),
        "close": lambda store: store.close(),
    }
    came: list[BaseException | None] = []

    def meanwhile() -> None:
        try:
            calls[second](store)
        except BusyError as error:
            came.append(error)
        else:
            came.append(None)

    def insert(self: Store, *args: Any) -> bool:
        thread = threading.Thread(target=meanwhile)
        thread.start()
        thread.join(60)
        return insert_one(self, *args)

    insert_one = Store._insert
    with Store.create(path, of) as store:
        with monkeypatch.context() as patch:
            patch.setattr(Store, "_insert", insert)
            assert store.add(given[:1]) == 1
        assert isinstance(came[0], BusyError)
        assert "one call at a time" in str(came[0])
        assert store.add(given[1:2]) == 1
    with Store.open(path, writable=False) as store:
        assert list(store.rows().values()) == given[:2]


def test_threads_that_take_turns_may_share_a_store(tmp_path: Path) -> None:
    of = study()
    path, given = tmp_path / "a.study", rows(of)
    store = Store.create(path, of)
    for call in (*(lambda r=r: store.add([r]) for r in given[:5]), store.close):
        thread = threading.Thread(target=call)
        thread.start()
        thread.join(60)
    assert names(tmp_path) == ["a.study"]
    with Store.open(path, writable=False) as found:
        assert list(found.rows().values()) == given[:5]
