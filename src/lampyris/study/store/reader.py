"""Reader: a connection that sees one state of a store, whether or not another process is writing to it."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from lampyris.errors import FileError
from lampyris.study.store.file import check_schema, connect, log_size, sidecar, typed_errors
from lampyris.study.store.lock import StoreLock


@contextmanager
def snapshot(path: Path, *, recover: bool = False) -> Iterator[sqlite3.Connection]:
    """A connection that sees one state of the store and changes nothing; SQLite's errors become typed.

    With ``recover`` a file that is shorter than its head says is read as far as it goes.
    """
    with typed_errors(path, "read"):
        connection = _reader(path, recover)
        try:
            connection.execute("PRAGMA query_only=ON")
            check_schema(connection, path)
            connection.execute("BEGIN")
            yield connection
        finally:
            connection.close()
            if log_size(path) == 0:
                with suppress(FileError):  # it is being written to, or nothing may be removed there
                    StoreLock(path, wait_s=0.0).release()


def _reader(path: Path, recover: bool) -> sqlite3.Connection:
    """The connection that reads, ``ro`` always: such a one cannot delete a log, nor move it into the main file.

    A connection that may write does both when it is closed, if it finds no lock of another. In a folder that
    may not be written to, SQLite cannot open ``ro``; without a log nobody is writing there, and ``immutable``
    reads the file alone. With a log it must not be used: the runs in the log would be missing.
    """
    try:
        return _asked(path, recover)
    except sqlite3.OperationalError as error:
        if not _cannot_open(error):
            raise
        if not log_size(path):
            return _asked(path, recover, "&immutable=1")
        if os.access(path.parent, os.W_OK):
            raise
        log = sidecar(path, "-wal").name
        raise FileError(
            "STORE_READ", "runs are in its log, which cannot be read in a read-only folder",
            where=str(path), todo=f"copy it and {log} to a folder you may write in",
        ) from None  # fmt: skip


def _asked(path: Path, recover: bool, more: str = "") -> sqlite3.Connection:
    """A connection that has read something: until then SQLite opens no file."""
    connection = connect(path, "ro", more, recover=recover)
    try:
        connection.execute("SELECT count(*) FROM sqlite_schema").fetchone()
    except BaseException:
        connection.close()
        raise
    return connection


def _cannot_open(error: sqlite3.Error) -> bool:
    code = getattr(error, "sqlite_errorcode", 0) & 0xFF
    return code in (sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_READONLY)
