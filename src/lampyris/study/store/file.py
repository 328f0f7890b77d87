"""The file of a store: its tables, the checksum of each record, connections to it, and typed errors.

A store is an SQLite database with a write-ahead log and ``synchronous=FULL``: a transaction that was committed
is on the disk. Each record carries the SHA-256 of its other columns, because SQLite has no checksum of its
own in the main file: what changed there later is found record by record.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import shutil
import sqlite3
import stat
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Literal
from urllib.parse import quote
from weakref import WeakSet

from lampyris._core.system import sync_folder
from lampyris.errors import FileError, UsageError

APPLICATION = 0x6C616D70
"""SQLite's application_id: "lamp"."""
FORMAT = 2
"""SQLite's user_version: raised whenever the tables change."""
SCHEMA = {
    "meta": "CREATE TABLE meta (name TEXT, value TEXT, checksum TEXT)",
    "maps": "CREATE TABLE maps (hash TEXT, value TEXT, checksum TEXT)",
    "runs": "CREATE TABLE runs (n INTEGER PRIMARY KEY, key TEXT, ending TEXT, error TEXT, metrics TEXT,"
    " timing TEXT, checksum TEXT)",
    "runs_by_key": "CREATE UNIQUE INDEX runs_by_key ON runs (key)",
}
ADD_RUN = "INSERT INTO runs (key, ending, error, metrics, timing, checksum) VALUES (?, ?, ?, ?, ?, ?)"
RUNS = "SELECT n, key, ending, error, metrics, timing, checksum FROM runs"
MAX_VALUE = 1 << 28
"""Bytes of one value; a damaged length may claim more memory than there is."""
NEW = ".new"
"""Ending of the name under which a store is written before it gets its own."""

_DAMAGED = (
    sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_FORMAT, sqlite3.SQLITE_TOOBIG,
    sqlite3.SQLITE_ERROR,
)  # fmt: skip
"""SQLite's codes for a damaged file; SQLITE_ERROR is what it says of a table that lost a column."""
_BUSY = (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED, sqlite3.SQLITE_PROTOCOL)
_REFUSED = {
    sqlite3.SQLITE_FULL: "no space left",
    sqlite3.SQLITE_READONLY: "the file or its folder is read-only",
    sqlite3.SQLITE_CANTOPEN: "it cannot be opened, or not the files beside it",
    sqlite3.SQLITE_PERM: "no permission",
    sqlite3.SQLITE_AUTH: "no permission",
    sqlite3.SQLITE_NOMEM: "no memory left",
}
_MAGIC = b"SQLite format 3\x00"
_OURS = "a file that `lampyris study` made"


# ---- records --------------------


def checksum(table: str, *texts: str) -> str:
    """SHA-256, in hex, of the table's name and a record's texts, each preceded by its length."""
    joined = "".join(f"{len(t)}:{t}" for t in (table, *texts))
    return hashlib.sha256(joined.encode("utf-8", "surrogatepass")).hexdigest()


def is_sound(table: str, texts: tuple[Any, ...]) -> bool:
    """Whether a record, whose last column is its checksum, is as it was written."""
    return all(type(t) is str for t in texts) and checksum(table, *texts[:-1]) == texts[-1]


def damaged(path: Path, what: str) -> FileError:
    """STORE_DAMAGED."""
    todo = "`lampyris study repair` keeps every run that can be read; the study runs the others again"
    return FileError("STORE_DAMAGED", what, where=str(path), todo=todo)


def plain_of(connection: sqlite3.Connection, path: Path) -> dict[str, Any]:
    """The study as plain data.

    Raises
    ------
    FileError : STORE_DAMAGED.
    """
    records = connection.execute("SELECT name, value, checksum FROM meta").fetchall()
    if len(records) != 1 or not is_sound("meta", records[0]):
        raise damaged(path, "the study in it does not match its checksum")
    return dict(json_table(path, "the study", records[0][1]))


def maps_of(connection: sqlite3.Connection, path: Path) -> dict[str, str]:
    """The packed maps as JSON, by hash.

    Raises
    ------
    FileError : STORE_DAMAGED.
    """
    maps: dict[str, str] = {}
    for record in connection.execute("SELECT hash, value, checksum FROM maps ORDER BY rowid"):
        if not is_sound("maps", record):
            raise damaged(path, f"map {len(maps) + 1} does not match its checksum")
        maps[record[0]] = record[1]
    return maps


def json_table(path: Path, name: str, text: str) -> Mapping[str, Any]:
    """A JSON object whose checksum is right; the file may have been made by anyone.

    Raises
    ------
    FileError : STORE_DAMAGED: it is no JSON object, or has numbers that are not finite.
    """
    try:
        value = json.loads(text, parse_constant=_finite, parse_float=_finite)
    except (ValueError, RecursionError):
        value = None
    if not isinstance(value, dict):
        raise damaged(path, f"{name} is no table")
    return value


def _finite(text: str) -> float:
    """A number as JSON writes it; Python would also read NaN, and 1e999 as infinity."""
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(text)
    return value


# ---- the file --------------------


def sidecar(path: Path, ending: str) -> Path:
    """A file beside a store that belongs to it: ``-wal``, ``-shm``, ``.lock``."""
    return path.with_name(path.name + ending)


def real(path: str | os.PathLike[str]) -> Path:
    """The path with every link followed: one store, one name, one lock.

    Raises
    ------
    FileError : STORE_READ: a name that no file can have, or a folder that may not be looked into.
    """
    try:
        place = Path(os.path.realpath(path))
        place.exists()
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise FileError("STORE_READ", why, where=repr(os.fspath(path))[:200]) from None
    return place


def look(path: Path) -> None:
    """Refuse what cannot be a store before SQLite opens it; reads 100 bytes and waits at no pipe.

    A file that this process has open through SQLite is not opened a second time: closing any descriptor of a file
    releases every POSIX lock that the process holds on it, and another process would then delete the log in use.

    Raises
    ------
    FileError : STORE_READ, STORE_FORMAT, STORE_VERSION, STORE_DAMAGED.
    """
    try:
        found = os.stat(path)
        if not stat.S_ISREG(found.st_mode):
            what = "a folder" if path.is_dir() else "not a regular file"
            raise FileError("STORE_FORMAT", what, where=str(path), allowed=_OURS)
        with _CONNECTIONS_LOCK:
            if _is_listed(found):
                return
            with path.open("rb") as file:
                head = file.read(100)
    except FileNotFoundError:
        raise FileError("STORE_READ", "no such file", where=str(path)) from None
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise FileError("STORE_READ", why, where=str(path)) from None
    if not head:
        raise damaged(path, "the file is empty")
    if head[:16] != _MAGIC[: len(head[:16])]:
        what = f"not a store (starts with {head[:12]!r})"
        raise FileError("STORE_FORMAT", what, where=str(path), allowed=_OURS)
    if len(head) < 100:
        raise damaged(path, f"cut after {len(head)} bytes")
    application, version = (int.from_bytes(head[k : k + 4], "big") for k in (68, 60))
    if application != APPLICATION:
        what = f"an SQLite file of another program (application id {application})"
        raise FileError("STORE_FORMAT", what, where=str(path), allowed=_OURS)
    if version != FORMAT:
        raise FileError(
            "STORE_VERSION", f"a store of format {version}", where=str(path), allowed=f"format {FORMAT}",
            todo="read it with the release that made it",
        )  # fmt: skip


def log_size(path: Path) -> int | None:
    """Bytes in the write-ahead log of a store; None without one. A writer may remove it at any time."""
    try:
        return sidecar(path, "-wal").stat().st_size
    except FileNotFoundError:
        return None


def check_folder(path: Path) -> None:
    """Refuse a store where there is no folder to hold it.

    Raises
    ------
    FileError : STORE_WRITE.
    """
    if not path.parent.is_dir():
        what = "no such folder"
        raise FileError("STORE_WRITE", what, where=str(path), allowed="a folder that is there")


def write_new(
    place: Path,
    study: str,
    maps: Mapping[str, str],
    runs: Iterable[tuple[str, ...]] = (),
    *,
    before: Callable[[], object] | None = None,
) -> None:
    """Write a store under another name, sync it, and then give it its own: it is there whole or not at all.

    Parameters
    ----------
    place : where; what is there is replaced. The caller holds its lock.
    study : the study as canonical JSON.
    maps : packed maps as canonical JSON, by hash.
    runs : records of runs, each key once.
    before : called just before the store gets its name.

    Raises
    ------
    FileError : STORE_WRITE; STORE_DAMAGED: the log of a deleted store, which SQLite would take for this one's.
    """
    new = sidecar(place, NEW)
    with typed_errors(place, "write"):
        try:
            _remove(new)
            _fill(new, study, maps, runs)
            if before is not None:
                before()
            if log_size(place):
                raise FileError(
                    "STORE_DAMAGED", "the log of a store that is not there", where=str(sidecar(place, "-wal")),
                    todo="put its store back, or delete it",
                )  # fmt: skip
            os.replace(new, place)
        except BaseException:
            with suppress(OSError):  # the first error is the one to report
                _remove(new)
            raise
        sync_folder(place.parent)


def _fill(new: Path, study: str, maps: Mapping[str, str], runs: Iterable[tuple[str, ...]]) -> None:
    connection = connect(new, "rwc")
    try:
        connection.execute("PRAGMA journal_mode=OFF")  # a file that is not whole is never given its name
        connection.execute(f"PRAGMA application_id={APPLICATION}")
        connection.execute(f"PRAGMA user_version={FORMAT}")
        connection.execute("BEGIN EXCLUSIVE")
        for sql in SCHEMA.values():
            connection.execute(sql)
        add = "INSERT INTO {} VALUES (?, ?, ?)"
        connection.execute(add.format("meta"), ("study", study, checksum("meta", "study", study)))
        for key, value in maps.items():
            connection.execute(add.format("maps"), (key, value, checksum("maps", key, value)))
        connection.executemany(ADD_RUN, runs)
        connection.execute("COMMIT")
        _use_log(connection, new)
    finally:
        connection.close()


def _remove(new: Path) -> None:
    for ending in ("", "-journal", "-wal", "-shm"):
        sidecar(new, ending).unlink(missing_ok=True)


# ---- connections --------------------


class _Connection(sqlite3.Connection):
    """A connection that is listed, with the device and inode of its file, for as long as it is open."""

    file: tuple[int, int] | None = None

    def enlist(self, path: Path) -> None:
        """To be called before the first statement: until then SQLite holds no lock."""
        with _CONNECTIONS_LOCK:
            found = os.stat(path)
            self.file = (found.st_dev, found.st_ino)
            _CONNECTIONS.add(self)

    def close(self) -> None:
        super().close()
        with _CONNECTIONS_LOCK:
            _CONNECTIONS.discard(self)


_CONNECTIONS: WeakSet[_Connection] = WeakSet()
_CONNECTIONS_LOCK = threading.Lock()
"""Held while a store's file is opened without SQLite, and while the list of connections changes."""


def _is_listed(found: os.stat_result) -> bool:
    return any(one.file == (found.st_dev, found.st_ino) for one in _CONNECTIONS)


def copy(old: Path, new: Path) -> None:
    """Copy a file of a store without SQLite, and wait until it is on the disk.

    Raises
    ------
    FileError : STORE_BUSY: this process has it open; closing the copy's descriptor would release its locks.
    """
    with _CONNECTIONS_LOCK:
        if _is_listed(os.stat(old)):
            raise FileError("STORE_BUSY", "this process has it open", where=str(old), todo="close it first")
        with old.open("rb") as source, new.open("xb") as file:
            shutil.copyfileobj(source, file)
            file.flush()
            os.fsync(file.fileno())


def connect(
    path: Path, mode: Literal["ro", "rw", "rwc"], more: str = "", *, recover: bool = False
) -> sqlite3.Connection:
    """An SQLite connection without implicit transactions that runs nothing the file brings along."""
    name = f"file:{quote(str(path))}?mode={mode}{more}"
    # Not bound to one thread: a run may be watched by another. Store refuses a second call during one.
    connection = sqlite3.connect(
        name, uri=True, isolation_level=None, timeout=10.0, check_same_thread=False, factory=_Connection
    )
    try:
        connection.enlist(path)
        connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, MAX_VALUE)
        if recover:  # so SQLite reads a file that is shorter than its head says
            connection.execute("PRAGMA writable_schema=ON")
        for pragma in ("trusted_schema=OFF", "cell_size_check=ON", "mmap_size=0", "synchronous=FULL"):
            connection.execute(f"PRAGMA {pragma}")
    except BaseException:
        connection.close()
        raise
    return connection


def writer(path: Path) -> sqlite3.Connection:
    """The connection that writes.

    Raises
    ------
    sqlite3.Error : it cannot be opened for writing.
    FileError : STORE_DAMAGED; STORE_WRITE: no write-ahead log can be kept there.
    """
    connection = connect(path, "rw")
    try:
        _check_schema(connection, path)
        _use_log(connection, path)
        connection.execute("BEGIN IMMEDIATE")  # SQLite opens a read-only file without an error
        connection.execute("ROLLBACK")
    except BaseException:
        connection.close()
        raise
    return connection


def _use_log(connection: sqlite3.Connection, path: Path) -> None:
    """Turn a store to its write-ahead log. SQLite reports no error where it cannot (network disks)."""
    mode = connection.execute("PRAGMA journal_mode=WAL").fetchone()[0]
    if mode != "wal":
        what = "no write-ahead log can be kept there"
        raise FileError("STORE_WRITE", what, where=str(path), allowed="a disk of this machine")


@contextmanager
def transaction(connection: sqlite3.Connection) -> Iterator[None]:
    """One transaction, undone if anything at all goes wrong in it."""
    try:
        connection.execute("BEGIN IMMEDIATE")
        yield
        connection.execute("COMMIT")
    except BaseException:
        if connection.in_transaction:
            with suppress(sqlite3.Error):  # SQLite may have done so itself
                connection.execute("ROLLBACK")
        raise


@contextmanager
def snapshot(path: Path, *, recover: bool = False) -> Iterator[sqlite3.Connection]:
    """A connection that sees one state of the store and changes nothing; SQLite's errors become typed.

    With ``recover`` a file that is shorter than its head says is read as far as it goes.
    """
    with typed_errors(path, "read"):
        connection = _reader(path, recover)
        try:
            connection.execute("PRAGMA query_only=ON")
            _check_schema(connection, path)
            connection.execute("BEGIN")
            yield connection
        finally:
            connection.close()


def _reader(path: Path, recover: bool) -> sqlite3.Connection:
    """The connection that reads.

    With a log it is opened ``ro``, so that a log is never moved into a main file that may be damaged. Without
    one, ``ro`` would leave an empty log behind, and ``rw`` leaves nothing. Where the file or its folder may not be
    written to, SQLite can open neither, or leaves files that keep the owner out; without a log nobody is writing
    there, and ``immutable`` reads the file alone. With a log it must not be used: its runs would be missing.
    """
    size = log_size(path)
    if size:
        try:
            return _asked(path, recover, "ro")
        except sqlite3.OperationalError as error:
            if not _cannot_open(error) or os.access(path.parent, os.W_OK):
                raise
            raise FileError(
                "STORE_READ", "runs are in its log, which cannot be read in a read-only folder",
                where=str(path), todo=f"copy it and {sidecar(path, '-wal').name} to a folder you may write in",
            ) from None  # fmt: skip
    if size is None and not os.access(path, os.W_OK):
        return _asked(path, recover, "ro", "&immutable=1")
    try:
        return _asked(path, recover, "rw")
    except sqlite3.OperationalError as error:
        if not _cannot_open(error):
            raise
        return _asked(path, recover, "ro", "&immutable=1")


def _asked(path: Path, recover: bool, mode: Literal["ro", "rw"], more: str = "") -> sqlite3.Connection:
    """A connection that has read something: until then SQLite has read none of the file."""
    connection = connect(path, mode, more, recover=recover)
    try:
        connection.execute("SELECT count(*) FROM sqlite_schema").fetchone()
    except BaseException:
        connection.close()
        raise
    return connection


def _cannot_open(error: sqlite3.Error) -> bool:
    code = getattr(error, "sqlite_errorcode", 0) & 0xFF
    return code in (sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_READONLY)


def _check_schema(connection: sqlite3.Connection, path: Path) -> None:
    """Refuse a store whose tables are not exactly ours; a trigger or a view would run what is in the file."""
    found = connection.execute("SELECT name, sql FROM sqlite_schema ORDER BY rowid").fetchall()
    if found != list(SCHEMA.items()):
        raise damaged(path, "its tables are not those of a store")


def check_pages(connection: sqlite3.Connection, path: Path) -> None:
    """Refuse a store whose pages or index SQLite finds damaged.

    Raises
    ------
    FileError : STORE_DAMAGED.
    """
    found = connection.execute("PRAGMA integrity_check(1)").fetchone()[0]
    if found != "ok":
        raise damaged(path, " ".join(str(found).split()))


# ---- errors --------------------


@contextmanager
def typed_errors(
    path: Path, doing: Literal["read", "write"], kept: Callable[[], int | None] = lambda: None
) -> Iterator[None]:
    """What SQLite and the system refuse within becomes a typed error of one line.

    Parameters
    ----------
    path : of the store.
    doing : whether something was to be read or written.
    kept : how many runs are stored whatever happened; None where unknown.
    """
    try:
        yield
    except sqlite3.Error as error:
        raise _typed(error, path, doing, kept) from None
    except UnicodeError:
        raise damaged(path, "text that is not UTF-8") from None
    except OSError as error:
        raise _refused(path, doing, error.strerror or str(error), kept) from None


def _typed(
    error: sqlite3.Error, path: Path, doing: Literal["read", "write"], kept: Callable[[], int | None]
) -> FileError | UsageError:
    """The typed error for one of SQLite's."""
    extended = getattr(error, "sqlite_errorcode", None)
    if isinstance(error, sqlite3.ProgrammingError):
        return UsageError("STORE_CLOSED", "the store was closed", where=str(path))
    if extended is None:  # Python's own: text that is not UTF-8, a value of another type
        return damaged(path, str(error))
    code, name = extended & 0xFF, getattr(error, "sqlite_errorname", "")
    if code in _BUSY:
        what = "another process holds it"
        return FileError("STORE_BUSY", what, where=str(path), todo="wait for that one")
    if code in _DAMAGED:
        return damaged(path, str(error))
    if code == sqlite3.SQLITE_IOERR:
        return _refused(path, doing, f"the system reports an input/output error ({name})", kept)
    return _refused(path, doing, _REFUSED.get(code, f"{error} ({name})"), kept)


def _refused(path: Path, doing: str, what: str, kept: Callable[[], int | None]) -> FileError:
    if doing == "read":
        return FileError("STORE_READ", what, where=str(path))
    count = kept()
    safe = "what is stored stays"
    if count is not None:
        safe = f"{count:,} {'run is' if count == 1 else 'runs are'} safe"
    return FileError("STORE_WRITE", what, where=str(path), todo=safe)
