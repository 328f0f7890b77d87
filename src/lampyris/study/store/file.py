"""The file of a store: its tables, the seal on every record, and what SQLite's refusals are called here.

Every table has the same first two columns, a number and a seal. The seal is the SHA-256 of the record's other
columns, so a record can be trusted wherever it is found: by SQLite, or by :mod:`lampyris.study.store.carve` in the
bytes of a file that SQLite refuses.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import sqlite3
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal
from urllib.parse import quote

from lampyris.errors import FileError, UsageError

APPLICATION = 0x6C616D70
"""SQLite's application_id: "lamp"."""
FORMAT = 1
"""SQLite's user_version: raised whenever a store is laid out otherwise."""
PAGE = 4096
"""Bytes of a page. Fixed, so that a file whose head is damaged can still be read page by page."""
TABLES = {
    "meta": "CREATE TABLE meta (n INTEGER PRIMARY KEY, seal TEXT, name TEXT, value TEXT)",
    "maps": "CREATE TABLE maps (n INTEGER PRIMARY KEY, seal TEXT, hash TEXT, value TEXT)",
    "runs": "CREATE TABLE runs (n INTEGER PRIMARY KEY, seal TEXT, key TEXT, ending TEXT, error TEXT,"
    " metrics TEXT, timing TEXT)",
    "tally": "CREATE TABLE tally (n INTEGER PRIMARY KEY, seal TEXT, count TEXT, head TEXT)",
}
WIDTHS = {"meta": 2, "maps": 2, "runs": 5, "tally": 2}
"""Columns of text after the seal, by table."""
HEAD = "0" * 64
"""Head of the chain of an empty store."""
MAX_VALUE = 1 << 28
"""Bytes of one value; a damaged length may claim more memory than there is."""

_ABOUT = "what is stored stays"
_DAMAGED = "`lampyris study repair` keeps every run whose seal holds"
_WRONG = frozenset(
    (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_FORMAT, sqlite3.SQLITE_TOOBIG,
     sqlite3.SQLITE_ERROR)
)  # fmt: skip
"""What SQLite says of a damaged file; an error of the language is that of a table that is not as it was."""
_MAGIC = b"SQLite format 3\x00"
_FIXED = ((16, b"\x10\x00\x02\x02\x00\x40\x20\x20"), (44, b"\x00\x00\x00\x04"), (56, b"\x00\x00\x00\x01"))
"""Bytes of SQLite's head that are the same in every store: page size, WAL, fractions; schema; UTF-8."""


def seal(table: str, *texts: str) -> str:
    """Seal of a record: SHA-256, in hex, over its table's name and its texts, each with its length."""
    said = "".join(f"{len(t)}:{t}" for t in (table, *texts))
    return hashlib.sha256(said.encode("utf-8", "surrogatepass")).hexdigest()


def chained(head: str, sealed: str) -> str:
    """Head of the chain of seals after one more run: which runs there are, in which order, none left out."""
    return hashlib.sha256((head + sealed).encode()).hexdigest()


def damaged(path: Path, what: str) -> FileError:
    """STORE_DAMAGED."""
    return FileError("STORE_DAMAGED", what, where=str(path), todo=_DAMAGED)


def sidecar(path: Path, ending: str) -> Path:
    """A file beside a store that belongs to it: ``-wal``, ``-shm``, ``.lock``."""
    return path.with_name(path.name + ending)


def look(path: Path) -> None:
    """Refuse what cannot be a store before SQLite is let at it; reads 100 bytes and follows no pipe.

    Raises
    ------
    FileError : STORE_READ, STORE_FORMAT, STORE_VERSION, STORE_DAMAGED.
    """
    try:
        if not stat.S_ISREG(os.stat(path).st_mode):
            what = "a folder" if path.is_dir() else "not a regular file"
            raise FileError(
                "STORE_FORMAT", what, where=str(path), allowed="a file that `lampyris study` made"
            )
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
        raise FileError(
            "STORE_FORMAT", f"not a store (starts with {head[:12]!r})", where=str(path),
            allowed="a file that `lampyris study` made",
        )  # fmt: skip
    if len(head) < 100:
        raise damaged(path, f"cut after {len(head)} bytes")
    application, version = (int.from_bytes(head[k : k + 4], "big") for k in (68, 60))
    if application != APPLICATION:
        what = f"an SQLite file of another program (application id {application})"
        raise FileError("STORE_FORMAT", what, where=str(path), allowed="a file that `lampyris study` made")
    if version != FORMAT:
        raise FileError(
            "STORE_VERSION", f"a store of format {version}", where=str(path), allowed=f"format {FORMAT}",
            todo="read it with the release that made it",
        )  # fmt: skip
    for at, said in _FIXED:
        if head[at : at + len(said)] != said:
            raise damaged(path, f"byte {at} and those after it are not a store's")


def connect(path: Path, mode: Literal["ro", "rw", "rwc"], more: str = "") -> sqlite3.Connection:
    """An SQLite connection without implicit transactions that believes nothing the file says of itself."""
    name = f"file:{quote(str(path))}?mode={mode}{more}"
    # Not bound to one thread: a run may be watched by another. Store refuses a second call during one.
    connection = sqlite3.connect(name, uri=True, isolation_level=None, timeout=10.0, check_same_thread=False)
    try:
        connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, MAX_VALUE)
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
        check_schema(connection, path)
        keep_log(connection, path)
        connection.execute("BEGIN IMMEDIATE")  # a file that may only be read is opened without a word
        connection.execute("ROLLBACK")
    except BaseException:
        connection.close()
        raise
    return connection


def keep_log(connection: sqlite3.Connection, path: Path) -> None:
    """Turn a store to its write-ahead log. SQLite itself says nothing where it cannot.

    Raises
    ------
    FileError : STORE_WRITE.
    """
    mode = connection.execute("PRAGMA journal_mode=WAL").fetchone()[0]
    if mode != "wal":
        what = "no write-ahead log can be kept there"
        raise FileError("STORE_WRITE", what, where=str(path), allowed="a disk of this machine")


@contextmanager
def snapshot(path: Path) -> Iterator[sqlite3.Connection]:
    """A connection for reading, closed at the end; what SQLite meets within becomes a typed error."""
    with speaking(path, "read"):
        connection = _reader(path)
        try:
            yield connection
        finally:
            connection.close()


def _reader(path: Path) -> sqlite3.Connection:
    """The connection that reads.

    While there is a log it is opened ``ro``, which never moves the log into the main file: of a damaged log
    all must stay that repair can use. Without one, ``ro`` would leave an empty log and its index behind, so
    it is opened ``rw`` and told to change nothing. Where no file can be made beside the store, nobody can
    write to it either, and it is read as it is.
    """
    log = sidecar(path, "-wal")
    tries: tuple[tuple[Literal["ro", "rw"], str], ...] = (("ro", ""),)
    if not (log.exists() and log.stat().st_size):
        tries = (("rw", ""), ("ro", "&immutable=1"))
    for mode, more in tries:
        try:
            return _asked(path, mode, more)
        except sqlite3.OperationalError as error:
            cannot = getattr(error, "sqlite_errorcode", 0) & 0xFF in (
                sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_READONLY
            )  # fmt: skip
            if (mode, more) == tries[-1] or not cannot:
                raise
    raise AssertionError("unreachable")  # pragma: no cover


def _asked(path: Path, mode: Literal["ro", "rw"], more: str) -> sqlite3.Connection:
    """A connection that changes nothing and has read the names of the tables."""
    connection = connect(path, mode, more)
    try:
        connection.execute("PRAGMA query_only=ON")
        check_schema(connection, path)
    except BaseException:
        connection.close()
        raise
    return connection


def plain_of(connection: sqlite3.Connection, path: Path) -> dict[str, Any]:
    """The study as plain data."""
    records = connection.execute("SELECT n, seal, name, value FROM meta ORDER BY n").fetchall()
    if len(records) != 1:
        raise damaged(path, f"meta: {len(records)} records, not 1")
    _, text = sealed(path, "meta", records[0], 1)
    return dict(loaded(path, "the study", text))


def maps_of(connection: sqlite3.Connection, path: Path) -> dict[str, str]:
    """The packed maps as JSON, by hash."""
    maps = {}
    records = connection.execute("SELECT n, seal, hash, value FROM maps ORDER BY n").fetchall()
    for n, record in enumerate(records, start=1):
        key, text = sealed(path, "maps", record, n)
        maps[key] = text
    return maps


def tally_of(connection: sqlite3.Connection, path: Path) -> tuple[int, str]:
    """Number of runs, and head of their chain, as the store says."""
    records = connection.execute("SELECT n, seal, count, head FROM tally").fetchall()
    if len(records) != 1:
        raise damaged(path, f"tally: {len(records)} records, not 1")
    said, head = sealed(path, "tally", records[0], 1)
    count = count_of(said)
    if count is None:
        raise damaged(path, "tally: no number of runs")
    return count, head


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


def check_schema(connection: sqlite3.Connection, path: Path) -> None:
    """Refuse a store whose tables are not exactly ours: a changed declaration would change what is stored."""
    found = connection.execute(
        "SELECT type, name, tbl_name, sql FROM sqlite_schema ORDER BY rowid"
    ).fetchall()
    if found != [("table", name, name, sql) for name, sql in TABLES.items()]:
        raise damaged(path, "its tables are not those of a store")


def sealed(path: Path, table: str, record: tuple[Any, ...], n: int) -> tuple[str, ...]:
    """The texts of a record ``(n, seal, *texts)`` whose number and seal hold, the seal left out.

    Raises
    ------
    FileError : STORE_DAMAGED, with the record's number.
    """
    number, said, *texts = record
    if number != n:
        raise damaged(path, f"{table}: record {n} is missing")
    if not all(type(t) is str for t in texts) or seal(table, *texts) != said:
        raise damaged(path, f"{table}: record {n} does not match its seal")
    return tuple(texts)


def check_pages(connection: sqlite3.Connection, path: Path) -> None:
    """Refuse a store whose pages do not fit together, though every record may be read: adding would hurt it.

    Raises
    ------
    FileError : STORE_DAMAGED.
    """
    said = connection.execute("PRAGMA quick_check(1)").fetchone()[0]
    if said != "ok":
        raise damaged(path, " ".join(str(said).split()))


@contextmanager
def speaking(path: Path, doing: Literal["read", "write"], kept: int | None = None) -> Iterator[None]:
    """What SQLite and the system refuse within becomes a typed error of one line.

    Parameters
    ----------
    path : of the store.
    doing : whether something was to be read or written.
    kept : runs that are stored whatever happened; None where unknown.
    """
    try:
        yield
    except sqlite3.Error as error:
        raise _told(error, path, doing, kept) from None
    except UnicodeError:
        raise damaged(path, "text that is not UTF-8") from None
    except OSError as error:
        code = "STORE_WRITE" if doing == "write" else "STORE_READ"
        raise FileError(
            code, error.strerror or str(error), where=str(path), todo=_safe(doing, kept)
        ) from None


def _told(
    error: sqlite3.Error, path: Path, doing: Literal["read", "write"], kept: int | None
) -> FileError | UsageError:
    """The typed error for one of SQLite's."""
    code = getattr(error, "sqlite_errorcode", None)
    where = str(path)
    if isinstance(error, sqlite3.ProgrammingError):
        return UsageError("STORE_CLOSED", "the store was closed", where=where)
    if code is None:  # Python's own: text that is not UTF-8, a value too large to be one of ours
        return damaged(path, str(error))
    name = getattr(error, "sqlite_errorname", "")
    what = {
        sqlite3.SQLITE_FULL: "no space left",
        sqlite3.SQLITE_READONLY: "the file or its folder is read-only",
        sqlite3.SQLITE_IOERR: f"the system reports an input/output error ({name})",
        sqlite3.SQLITE_CANTOPEN: "it cannot be opened, or not the files beside it",
        sqlite3.SQLITE_PERM: "no permission",
        sqlite3.SQLITE_AUTH: "no permission",
        sqlite3.SQLITE_NOMEM: "no memory left",
    }.get(code & 0xFF)
    if code & 0xFF in (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED, sqlite3.SQLITE_PROTOCOL):
        return FileError("STORE_BUSY", "another process holds it", where=where, todo="wait for that one")
    if what is None and code & 0xFF in _WRONG:
        return damaged(path, str(error))
    what = what or f"{error} ({name})"
    return FileError(
        "STORE_WRITE" if doing == "write" else "STORE_READ", what, where=where, todo=_safe(doing, kept)
    )


def _safe(doing: str, kept: int | None) -> str:
    if doing == "read":
        return ""
    return _ABOUT if kept is None else f"{kept:,} {'run is' if kept == 1 else 'runs are'} safe"


def loaded(path: Path, name: str, text: str) -> Mapping[str, Any]:
    """A table of JSON of which the seal held; anything else is damage all the same.

    Raises
    ------
    FileError : STORE_DAMAGED: it is no JSON, no table, or has numbers that are not finite.
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


def count_of(text: str) -> int | None:
    """The number of runs that a tally says; None if that is no number as we write it."""
    if not (text.isascii() and text.isdigit() and len(text) <= 18):
        return None
    return int(text) if str(int(text)) == text else None


def log_left(path: Path) -> bool:
    """Whether a store has a log that is not empty; where the system cannot say, that it has."""
    try:
        return sidecar(path, "-wal").stat().st_size > 0
    except FileNotFoundError:
        return False
    except OSError:
        return True
