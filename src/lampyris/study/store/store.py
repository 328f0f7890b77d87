"""Store: the rows of one study in one SQLite file, each on the disk before :meth:`Store.add` returns.

A store holds its study too, maps and all: nothing else is needed to read, count and draw what is in it. It
is written by one process at a time and may be read by others meanwhile. Closed, it is one file.

Every row is checked against its checksum when it is read, and the number of rows against the index of their
keys. What is damaged is refused (``STORE_DAMAGED``); :func:`lampyris.study.store.repair.repair` keeps the rows
that can be read and names the others, which the study then runs again: the same job gives the same row.
"""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Collection, Iterator, Sequence
from contextlib import AbstractContextManager, suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from lampyris._core.exclusive import Exclusive, one_call
from lampyris.errors import FileError, LampyrisError, UsageError
from lampyris.study.design.row import ENDINGS, Row
from lampyris.study.design.serialize import demand_same, study_of, study_plain
from lampyris.study.design.study import Study, canonical
from lampyris.study.design.study_map import pack, unpack
from lampyris.study.store.file import (
    ADD_RUN,
    RUNS,
    check_folder,
    check_pages,
    damaged,
    json_table,
    look,
    maps_of,
    plain_of,
    real,
    snapshot,
    transaction,
    typed_errors,
    write_new,
    writer,
)
from lampyris.study.store.lock import StoreLock
from lampyris.study.store.row_record import packed, row_of

_PATIENCE_MS = 200
"""How long closing waits for readers; the log may stay."""


class Store(Exclusive):
    """An open store; use :meth:`create`, :meth:`open` or :func:`open_for`.

    :meth:`add`, :meth:`keys` and :meth:`close` serve one call at a time (:mod:`lampyris._core.exclusive`): a second
    one, from any thread, is refused with ``BusyError`` and changes nothing. What else reads has a connection
    of its own and may run beside them. Not to be used across a fork. Leaving a ``with`` closes it.
    """

    def __init__(self, path: Path, lock: StoreLock | None) -> None:
        self.path = path
        self._lock = lock
        self._writer: sqlite3.Connection | None = None
        self._closed = False

    @classmethod
    def create(cls, path: str | os.PathLike[str], study: Study) -> Self:
        """A new store, open for writing. It is made under another name: it is there whole, or not at all.

        Raises
        ------
        FileError : STORE_EXISTS; STORE_BUSY; STORE_WRITE; STORE_DAMAGED: the log of another is in the way.
        """
        place = real(path)
        with typed_errors(place, "write"):
            _check_free(place)
            check_folder(place)
            store = cls(place, StoreLock(place))
            try:
                _check_free(place)  # or made by the previous holder of the lock
                write_new(place, canonical(study_plain(study)).decode("ascii"), packed_maps(study))
                store._writer = writer(place)
            except BaseException:
                store.close()
                raise
        return store

    @classmethod
    def open(cls, path: str | os.PathLike[str], *, writable: bool = True) -> Self:
        """A store that is there. One that is to be written to is read whole and checked first.

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
            count = store.verify()
            with typed_errors(place, "write", lambda: count):
                store._writer = writer(place)
        except BaseException:
            store.close()
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
        grounds = {key: unpack(json_table(path, f"map {key[:12]}", text), key) for key, text in maps.items()}
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
        if self._writer is None:
            return frozenset(row.key for row in self.scan())
        with typed_errors(self.path, "read"):  # all rows were checked when it was opened
            return frozenset(key for (key,) in self._writer.execute("SELECT key FROM runs"))

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
        path, found, last = self.path, 0, 0
        with self._snapshot() as connection:
            (count,) = connection.execute("SELECT count(*) FROM runs INDEXED BY runs_by_key").fetchone()
            for n, *record in connection.execute(f"{RUNS} ORDER BY n"):
                if n <= last:
                    raise damaged(path, f"run {n} is there twice")
                found, last = found + 1, n
                yield row_of(path, n, tuple(record))
        if found != count:
            raise damaged(path, f"{found:,} runs can be read, and its index has {count:,}")

    def verify(self) -> int:
        """Read and check everything; returns the number of runs.

        Raises
        ------
        FileError : STORE_READ, STORE_DAMAGED; UsageError : STORE_CLOSED.
        """
        with self._snapshot() as connection:
            check_pages(connection, self.path)
        self.plain(), self.maps()
        count = 0
        for _ in self.scan():
            count += 1
        return count

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
        connection = self._for_writing()
        with typed_errors(self.path, "write", self._count), transaction(connection):
            return [self._insert(connection, row) for row in rows].count(True)

    @one_call
    def forget(self, endings: Collection[str]) -> int:
        """Delete every run that ended so, in one transaction; returns how many.

        Raises
        ------
        UsageError : ENDING: no such ending; STORE_CLOSED, STORE_READER.
        FileError : STORE_WRITE.
        """
        for word in endings:
            if word not in ENDINGS:
                raise UsageError("ENDING", f"{word!r}", where="endings", allowed=", ".join(ENDINGS))
        connection, gone = self._for_writing(), 0
        with typed_errors(self.path, "write", self._count), transaction(connection):
            for word in endings:
                gone += connection.execute("DELETE FROM runs WHERE ending = ?", (word,)).rowcount
        return gone

    @one_call
    def close(self) -> None:
        """Close it; what is in the log goes into the main file, as far as the system lets it."""
        self._closed = True
        if self._writer is not None:
            with suppress(sqlite3.Error):  # all runs are in the log then, until the next writer tries again
                self._writer.execute(f"PRAGMA busy_timeout={_PATIENCE_MS}")
                self._writer.execute("PRAGMA wal_checkpoint(TRUNCATE)")
            with suppress(sqlite3.Error):
                self._writer.close()
        self._writer = None
        if self._lock is not None:
            self._lock.release()

    def _for_writing(self) -> sqlite3.Connection:
        if self._writer is None:
            code = "STORE_CLOSED" if self._closed else "STORE_READER"
            raise UsageError(code, "not open for writing", where=str(self.path))
        return self._writer

    def _insert(self, connection: sqlite3.Connection, row: Row) -> bool:
        """Add one row within a transaction; whether it is new."""
        record = packed(row)
        found = connection.execute(f"{RUNS} WHERE key = ?", (row.key,)).fetchone()
        if found is None:
            connection.execute(ADD_RUN, record)
            return True
        n, _, ending, _, metrics, *_ = found
        if (ending, metrics) != (record[1], record[3]):
            raise _conflict(self.path, row_of(self.path, n, found[1:]), row)
        return False

    def _count(self) -> int | None:
        """How many runs are stored, for the message of an error; None if not even that can be read."""
        with suppress(sqlite3.Error):
            if self._writer is not None:
                return int(self._writer.execute("SELECT count(*) FROM runs").fetchone()[0])
        return None

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
    with typed_errors(place, "read"):
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


def packed_maps(study: Study) -> dict[str, str]:
    """The maps of a study as canonical JSON, by hash."""
    return {key: canonical(pack(ground.grid)).decode("ascii") for key, ground in study.grounds.items()}


def _check_free(place: Path) -> None:
    if place.exists():
        raise FileError("STORE_EXISTS", "the file exists", where=str(place))


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
