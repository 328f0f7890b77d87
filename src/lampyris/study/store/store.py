"""Store: the rows of one study in one SQLite file, each on the disk before anyone is told that it is done.

A store holds its study too, maps and all: nothing else is needed to read, count and draw what is in it. It
is written by one process at a time and may be read by others meanwhile. Three things make it certain that
what is read is what was written: every record has a seal (:func:`lampyris.study.store.file.seal`), the seals
of the runs form a chain whose length and head are written in the same transaction, and length and head stand
once more beside the store before a run counts as acknowledged (:mod:`lampyris.study.store.lock`).

Runs are only ever added, at the end. There is no index by key: the writer holds the keys in memory (192 MB
for a million), because an index, keys being hashes, has a page written for nearly every run, and is one more
thing that can be damaged.
"""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from lampyris._core.exclusive import Exclusive, one_call
from lampyris.errors import FileError, LampyrisError, UsageError
from lampyris.study.design.row import Ending, Row
from lampyris.study.design.serialize import demand_same, study_of, study_plain
from lampyris.study.design.study import Study, canonical
from lampyris.study.design.study_map import pack, unpack
from lampyris.study.store.file import (
    HEAD,
    chained,
    check_pages,
    damaged,
    loaded,
    log_left,
    look,
    maps_of,
    plain_of,
    real,
    seal,
    sealed,
    snapshot,
    speaking,
    tally_of,
    writer,
)
from lampyris.study.store.lock import StoreLock, Witness, vouched
from lampyris.study.store.new_store import ADD, check_folder, write_new
from lampyris.study.store.row_record import packed, row_of

_PATIENCE_MS = 200
"""How long closing waits for readers; the log may stay."""
_RUNS = "SELECT n, seal, key, ending, error, metrics, timing FROM runs ORDER BY n"


class Store(Exclusive):
    """An open store; use :meth:`create`, :meth:`open` or :func:`open_for`.

    :meth:`add`, :meth:`keys` and :meth:`close` serve one call at a time (:mod:`lampyris._core.exclusive`): a second
    one, from any thread, is refused with ``BusyError`` and changes nothing. What else reads has a connection
    of its own and may run beside them. Not to be used across a fork. Leaving a ``with`` closes it.
    """

    def __init__(self, path: Path, hold: StoreLock | None) -> None:
        self.path = path
        self._hold = hold
        self._writer: sqlite3.Connection | None = None
        self._at: dict[str, int] | None = None
        self._tally = Witness()
        self._sound = False
        self._closed = False

    @classmethod
    def create(cls, path: str | os.PathLike[str], study: Study) -> Self:
        """A new store, open for writing. It is made under another name: it is there whole, or not at all.

        Raises
        ------
        FileError : STORE_EXISTS; STORE_BUSY; STORE_WRITE; STORE_DAMAGED: the log of another is in the way.
        """
        place = real(path)
        with speaking(place, "write"):
            return cls._create(place, study)

    @classmethod
    def _create(cls, place: Path, study: Study) -> Self:
        if place.exists():
            raise FileError("STORE_EXISTS", "the file exists", where=str(place))
        check_folder(place)
        hold = StoreLock(place)
        try:
            if place.exists():  # made by the previous holder of the lock
                raise FileError("STORE_EXISTS", "the file exists", where=str(place))
            maps = {
                key: canonical(pack(ground.grid)).decode("ascii") for key, ground in study.grounds.items()
            }
            write_new(place, canonical(study_plain(study)).decode("ascii"), maps)
            store = cls(place, hold)
            hold.start(Witness())
            store._writer = writer(place)
        except BaseException:
            hold.release(remove=not log_left(place))
            raise
        store._at, store._sound = {}, True
        return store

    @classmethod
    def open(cls, path: str | os.PathLike[str], *, writable: bool = True) -> Self:
        """A store that is there.

        Raises
        ------
        FileError : STORE_READ, STORE_FORMAT, STORE_VERSION, STORE_DAMAGED; when writable STORE_BUSY,
            STORE_WRITE.
        """
        place = real(path)
        look(place)
        store = cls(place, StoreLock(place) if writable else None)
        try:
            if not writable:
                with snapshot(place):
                    return store
            if not os.access(place, os.W_OK):
                raise FileError("STORE_WRITE", "the file is read-only", where=str(place))
            store.plain(), store.maps()  # Nothing is added to a store that could not be read afterwards.
            at, tally = store._read_all()
            with speaking(place, "write", tally.count):
                store._writer = writer(place)
                check_pages(store._writer, place)
                assert store._hold is not None
                store._hold.start(tally)
            store._at, store._tally, store._sound = at, tally, True
        except BaseException:
            store._abandon()
            raise
        return store

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def plain(self) -> dict[str, Any]:
        """The study as plain data (:func:`lampyris.study.design.serialize.study_plain`), whichever release made it.

        Raises
        ------
        FileError : STORE_READ, STORE_DAMAGED; UsageError : STORE_CLOSED.
        """
        with self._snapshot() as connection:
            return plain_of(connection, self.path)

    def study(self) -> Study:
        """The study, with its maps; no file is needed but the store.

        Raises
        ------
        FileError : as :meth:`plain`; STUDY_VERSION: another release made it, whose jobs have other keys.
        """
        path = self.path
        with self._snapshot() as connection:
            maps, plain = maps_of(connection, path), plain_of(connection, path)
        grounds = {key: unpack(loaded(path, f"map {key[:12]}", text), key) for key, text in maps.items()}
        return study_of(plain, grounds)

    def maps(self) -> dict[str, str]:
        """The packed maps (:mod:`lampyris.study.design.study_map`) as JSON, by hash.

        Raises
        ------
        FileError : STORE_READ, STORE_DAMAGED; UsageError : STORE_CLOSED.
        """
        with self._snapshot() as connection:
            return maps_of(connection, self.path)

    @one_call
    def keys(self) -> frozenset[str]:
        """Keys of all runs that are stored.

        Raises
        ------
        FileError : STORE_READ, STORE_DAMAGED; UsageError : STORE_CLOSED.
        """
        return frozenset(self._read_all()[0] if self._at is None else self._at)

    def __len__(self) -> int:
        return len(self.keys())

    def rows(self) -> dict[str, Row]:
        """Every row by key, in the order in which they were stored.

        Raises
        ------
        FileError : STORE_READ, STORE_DAMAGED; UsageError : STORE_CLOSED.
        """
        return {row.key: row for row in self.scan()}

    def scan(self) -> Iterator[Row]:
        """Every row, one by one, in the order in which they were stored; as they were when it began.

        Only when the last was given is it known that none is missing: what is made of them must wait for it.

        Raises
        ------
        FileError : STORE_READ, STORE_DAMAGED; UsageError : STORE_CLOSED.
        """
        for row, _ in self._records():
            yield row

    def records(self) -> Iterator[tuple[Ending, tuple[str, ...]]]:
        """Every run as it is stored, its seal first, with its ending; otherwise as :meth:`scan`."""
        for row, texts in self._records():
            yield row.ending, texts

    @one_call
    def add(self, rows: Sequence[Row]) -> int:
        """Store rows, all or none; returns how many of them are new, and then they are on the disk.

        A key that is there, or comes twice, with the same ending and metrics is nothing new.

        Raises
        ------
        FileError : STORE_CONFLICT: a key that is there with another ending or metric; STORE_WRITE: no space,
            read-only, input/output; STORE_DAMAGED. What was stored before stays.
        UsageError : STORE_CLOSED, STORE_READER.
        BusyError : another call is at work.
        InternalFault : STORE_ROW: a row that is not plain data.
        """
        if self._closed or self._hold is None or self._writer is None:
            code = "STORE_CLOSED" if self._closed else "STORE_READER"
            raise UsageError(code, "not open for writing", where=str(self.path))
        if self._at is None:  # what the last call left is not known
            self._at, self._tally = self._read_all()
        fresh = self._fresh(rows)
        if not fresh:
            return 0
        n, head = self._tally.count, self._tally.head
        for texts in fresh.values():
            head = chained(head, texts[0])
        try:
            with speaking(self.path, "write", n):
                self._insert(self._writer, n, head, fresh)
                tally = Witness(n + len(fresh), head)
                self._hold.write(tally)
        except BaseException:
            self._at = None
            raise
        self._at.update((key, k) for k, key in enumerate(fresh, start=n + 1))
        self._tally = tally
        return len(fresh)

    @one_call
    def close(self) -> None:
        """Close it; what is in the log goes into the main file, as far as the system lets it."""
        if self._closed:
            return
        if self._writer is not None:
            with suppress(sqlite3.Error):  # All runs are in the log then, until the next writer tries again.
                self._writer.execute(f"PRAGMA busy_timeout={_PATIENCE_MS}")
                self._writer.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        self._abandon()

    def _abandon(self) -> None:
        """Close it as it is. The witness goes only when there is no log left that it must vouch for."""
        self._closed = True
        if self._writer is not None:
            with suppress(sqlite3.Error):
                self._writer.close()
        self._writer = None
        if self._hold is not None:
            self._hold.release(remove=self._sound and not log_left(self.path))

    def _insert(
        self, connection: sqlite3.Connection, n: int, head: str, fresh: dict[str, tuple[str, ...]]
    ) -> None:
        """One transaction; undone if anything at all goes wrong."""
        try:
            connection.execute("BEGIN IMMEDIATE")
            connection.executemany(ADD, ((k, *texts) for k, texts in enumerate(fresh.values(), start=n + 1)))
            said = (str(n + len(fresh)), head)
            connection.execute(
                "UPDATE tally SET seal = ?, count = ?, head = ?", (seal("tally", *said), *said)
            )
            connection.execute("COMMIT")
        except BaseException:
            if connection.in_transaction:
                with suppress(sqlite3.Error):  # SQLite may have done so itself.
                    connection.execute("ROLLBACK")
            raise

    def _fresh(self, rows: Sequence[Row]) -> dict[str, tuple[str, ...]]:
        """Records of the rows that are new, by key."""
        assert self._at is not None
        fresh: dict[str, tuple[str, ...]] = {}
        for row in rows:
            texts = packed(row)
            old = fresh.get(row.key)
            if old is None and (n := self._at.get(row.key)) is not None:
                old = self._record(n)
            if old is None:
                fresh[row.key] = texts
            elif (old[2], old[4]) != (texts[2], texts[4]):
                raise _conflict(self.path, row_of(self.path, self._at.get(row.key, 0), old[1:]), row)
        return fresh

    def _record(self, n: int) -> tuple[str, ...]:
        """The record of a run that is there, the seal first."""
        assert self._writer is not None
        with speaking(self.path, "read"):
            record = self._writer.execute(_RUNS.replace("ORDER BY", "WHERE") + " = ?", (n,)).fetchone()
        texts = sealed(self.path, "runs", record or (None, None), n)
        return (record[1], *texts)

    def _read_all(self) -> tuple[dict[str, int], Witness]:
        """Number of each run by key, and the tally, every run read and checked."""
        at: dict[str, int] = {}
        head = HEAD
        for n, (_, texts) in enumerate(self._records(), start=1):
            at[texts[1]] = n
            head = chained(head, texts[0])
            if len(at) < n:
                raise damaged(self.path, f"runs: record {n} repeats an earlier one")
        return at, Witness(len(at), head)

    def _records(self) -> Iterator[tuple[Row, tuple[str, ...]]]:
        """Every run, and as its seal and texts, each checked; all of them together are after the last."""
        path, n, head = self.path, 0, HEAD
        with self._snapshot() as connection:
            # The witness is read first: the tally is never behind it, but may be ahead.
            witness = vouched(path)
            connection.execute("BEGIN")
            count, said = tally_of(connection, path)
            if count < witness.count:
                raise damaged(path, f"{witness.count:,} runs were stored, {count:,} are left")
            for record in connection.execute(_RUNS):
                n += 1
                texts = sealed(path, "runs", record, n)
                head = chained(head, record[1])
                if n == witness.count and head != witness.head:
                    raise damaged(path, f"runs: up to record {n} they are not those that were stored")
                yield row_of(path, n, texts), (record[1], *texts)
            if (n, head) != (count, said):
                raise damaged(path, f"runs: {n:,} are there, {count:,} were stored; or in another order")

    def _snapshot(self) -> AbstractContextManager[sqlite3.Connection]:
        """A connection that sees one state of the store."""
        if self._closed:
            raise UsageError("STORE_CLOSED", "the store was closed", where=str(self.path))
        return snapshot(self.path)


def open_for(path: str | os.PathLike[str], study: Study) -> Store:
    """The store of a study, open for writing: the one that is there, if it is this study's, or a new one.

    Names and labels may differ: they decide nothing, and the store keeps those it was made with.

    Raises
    ------
    FileError : STORE_OTHER: it was made for another study, and the first field that differs; what
        :meth:`Store.create` and :meth:`Store.open` raise.
    """
    place = real(path)
    with speaking(place, "read"):
        there = place.exists()
    if not there:
        try:
            return Store.create(place, study)
        except FileError as fault:
            if fault.code != "STORE_EXISTS":  # another process has made it since we looked
                raise
    store = Store.open(place)
    try:
        demand_same(store.plain(), study, str(place))
    except BaseException:
        store.close()
        raise
    return store


def _conflict(path: Path, old: Row, new: Row) -> LampyrisError:
    """STORE_CONFLICT, with the first thing that differs."""
    names = sorted(sorted({*old.metrics, *new.metrics}), key=lambda k: k not in old.metrics)
    pairs = [
        ("ending", old.ending, new.ending),
        *((k, old.metrics.get(k), new.metrics.get(k)) for k in names),
    ]
    name, was, now = next(
        p for p in pairs if repr(p[1]) != repr(p[2]) or p[0] in {*old.metrics} ^ {*new.metrics}
    )
    return FileError(
        "STORE_CONFLICT", f"{name} is {was!r} in the store and {now!r} now", where=f"{path}: run {new.key}",
        allowed="equal results for equal keys", todo="report it: a run that is not reproducible",
    )  # fmt: skip
