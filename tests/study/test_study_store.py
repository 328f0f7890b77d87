"""Store: what was acknowledged is there; one writer; whatever the system refuses is one clear line."""

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
from lampyris.study.store.lock import StoreLock, Witness, witness_of
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
    [
        ({"seeds": 2}, "seeds"), ({"root": 1}, "root: 0 and 1"), ({"moves": "four-connected"}, "moves"),
        ({"seconds": 1.0}, "seconds"), ({"expansions": 5}, "expansions"), ({"robot": {"r": 1.0}}, "robot"),
        ({"crowds": (StudyTraffic("random-walk", 4),)}, "crowds.0.count: 3 and 4"), ({"kind": "simulate"}, "kind"),
        ({"planners": (Config("astar", {"weight": 2.0}), Config("ad-gso", {"swarm": 8}))}, "weight: 1.0 and 2.0"),
        ({"laws": (Config("constant", {"speed": 1}),)}, "laws.0.settings.speed"), ({"ticks": 9}, "ticks"),
        ({"memory": True}, "memory"), ({"worlds": study().worlds[:1]}, "maps"),
    ],
)  # fmt: skip
def test_another_study_is_refused_with_the_field_that_differs(tmp_path: Path, more: dict, words: str) -> None:
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
    assert witness_of(tmp_path / "a") is not None
    with Store.open(tmp_path / "a", writable=False) as store:
        assert list(store.rows().values()) == rows(study())[:24]
    with open_for(tmp_path / "a", study()) as store:
        assert store.keys() == set(acknowledged)
        store.add(rows(study()))
        assert list(store.rows().values()) == rows(study())
    assert names(tmp_path) == ["a"]


def test_the_locks_file_may_go_and_come_while_others_ask_for_it(tmp_path: Path) -> None:
    path = tmp_path / "a"
    first = StoreLock(path)
    first.write(Witness(3, "f" * 64))
    with pytest.raises(LampyrisError, match="STORE_BUSY"):
        StoreLock(path)
    first.release(remove=False)
    assert witness_of(path) == Witness(3, "f" * 64)
    second = StoreLock(path)
    assert witness_of(path) == Witness(3, "f" * 64)
    second.write(Witness(4, "e" * 64))
    second.write(Witness(5, "d" * 64))
    assert witness_of(path) == Witness(5, "d" * 64)
    second.write(Witness(6, "c" * 64))
    assert witness_of(path) == Witness(6, "c" * 64), "whichever line it stands in"
    second.release(remove=True)
    assert names(tmp_path) == []
    assert witness_of(path) is None


class Interrupting:
    """A connection to which Ctrl-C comes just before a statement."""

    def __init__(self, connection: object, word: str) -> None:
        self._connection, self._word = connection, word

    def execute(self, sql: str, *more: object) -> object:
        if sql.startswith(self._word):
            raise KeyboardInterrupt
        return self._connection.execute(sql, *more)  # type: ignore[attr-defined]

    def executemany(self, sql: str, *more: object) -> object:
        if sql.startswith(self._word):
            raise KeyboardInterrupt
        return self._connection.executemany(sql, *more)  # type: ignore[attr-defined]

    @property
    def in_transaction(self) -> bool:
        return self._connection.in_transaction  # type: ignore[attr-defined,no-any-return]


def test_a_lock_on_a_file_that_was_just_removed_is_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Anyone who held it removes it between our opening and our locking: the next to come would lock another."""
    import fcntl

    path, real, calls = tmp_path / "a", fcntl.flock, []

    def late(fd: int, how: int) -> None:
        calls.append(fd)
        if len(calls) == 1:
            path.with_name("a.lock").unlink()
        if len(calls) == 2:
            path.with_name("a.lock").unlink()
            path.with_name("a.lock").touch()
        real(fd, how)

    monkeypatch.setattr("fcntl.flock", late)
    hold = StoreLock(path)
    assert len(calls) == 3
    with pytest.raises(LampyrisError, match="STORE_BUSY"):
        StoreLock(path)
    hold.release(remove=True)


def test_an_interrupt_in_the_middle_leaves_all_or_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    of = study()
    given = rows(of)
    with Store.create(tmp_path / "a", of) as store:
        store.add(given[:5])
        real = StoreLock.write

        def interrupted(self: StoreLock, witness: Witness) -> None:
            real(self, witness)
            raise KeyboardInterrupt

        with monkeypatch.context() as patch:
            patch.setattr(StoreLock, "write", interrupted)
            with pytest.raises(KeyboardInterrupt):
                store.add(given[5:9])
        assert store.add(given[5:12]) == 3
        for word in ("BEGIN", "INSERT", "UPDATE", "COMMIT"):
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
    db.execute("PRAGMA user_version=2")
    db.close()
    assert "format 2" in code_of(path, "STORE_VERSION")
    db = sqlite3.connect(path)
    db.execute("PRAGMA user_version=1")
    db.execute("CREATE TRIGGER t AFTER INSERT ON runs BEGIN DELETE FROM runs; END")
    db.close()
    assert "tables" in code_of(path, "STORE_DAMAGED")


@pytest.mark.parametrize("sql", [
    "DELETE FROM runs WHERE n = 7", "DELETE FROM runs WHERE n = 40", "DELETE FROM runs",
    "UPDATE runs SET metrics = '{}' WHERE n = 7", "UPDATE runs SET ending = 'refused' WHERE n = 2",
    "UPDATE runs SET metrics = NULL WHERE n = 7", "UPDATE runs SET key = x'00' WHERE n = 7",
    "INSERT INTO runs SELECT 41, seal, key, ending, error, metrics, timing FROM runs WHERE n = 1",
    "UPDATE runs SET n = 100 WHERE n = 40", "UPDATE runs SET timing = CAST(x'ff' AS TEXT) WHERE n = 1",
    "UPDATE tally SET count = '39'", "UPDATE tally SET count = '041'", "UPDATE tally SET head = ''",
    "DELETE FROM tally", "INSERT INTO tally VALUES (2, '', 40, '')", "UPDATE meta SET value = '{}'",
    "DELETE FROM meta", "INSERT INTO meta VALUES (2, '', '', '')", "UPDATE maps SET value = '{}' WHERE n = 2",
    "UPDATE maps SET n = 9 WHERE n = 1",
    "DELETE FROM runs WHERE n = 40; UPDATE tally SET count = '39'",
])  # fmt: skip
def test_a_meddled_store_is_seen(tmp_path: Path, sql: str) -> None:
    path = tmp_path / "a"
    filled(path, study())
    db = sqlite3.connect(path)
    db.executescript(sql)
    db.close()
    code_of(path, "STORE_DAMAGED")
    code_of(path, "STORE_DAMAGED", writable=False)


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
        patch.setattr(
            "lampyris.study.store.new_store.os.replace", _raise(OSError(28, "No space left on device"))
        )
        with pytest.raises(LampyrisError, match=r"STORE_WRITE.*No space left"):
            Store.create(path, study())
    assert names(tmp_path) == []
    killed = (
        "import os; from lampyris.study.store import new_store as store_new; from store_samples import *\n"
    )
    killed += (
        "store_new.os.replace = lambda a, b: os.kill(os.getpid(), 9)\nStore.create(sys.argv[1], study())"
    )
    assert child(killed, path, check=False).returncode == -signal.SIGKILL
    assert "a" not in names(tmp_path)
    with Store.create(path, study()) as store:
        assert store.rows() == {}
    assert names(tmp_path) == ["a"]
    path.unlink()
    path.with_name("a-wal").write_bytes(b"a log of something")
    with pytest.raises(LampyrisError, match="STORE_DAMAGED"):
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

    def insert(self: Store, *args: Any) -> None:
        thread = threading.Thread(target=meanwhile)
        thread.start()
        thread.join(60)
        insert_all(self, *args)

    insert_all = Store._insert
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
