"""Every call by which a process opens, reads, writes and syncs the files of a folder, SQLite's among them.

Anyone who listens is asked before each call and told after it: so a process can be killed at any of them, any of
them can be made to fail, and what was written when can be recorded. The product knows nothing of it: Python's
own functions are replaced while it listens, and SQLite is given a virtual file system that passes everything
on to its own (https://www.sqlite.org/vfs.html). Only for a process that was made for this and then ends.
"""

from __future__ import annotations

import builtins
import ctypes
import errno
import io
import os
import stat
from collections.abc import Callable
from ctypes import CFUNCTYPE, POINTER, c_char_p, c_int, c_int64, c_void_p
from dataclasses import dataclass
from functools import wraps
from typing import Any, Protocol

from lampyris.errors import UsageError


@dataclass(frozen=True)
class OsCall:
    """One call.

    Parameters
    ----------
    op : ``open``, ``create``, ``look``, ``read``, ``write``, ``sync``, ``truncate``, ``rename``, ``link``,
        ``unlink``, ``folder`` (a sync of a folder).
    path : of the file; of a folder that is synced.
    at : place of a write; size after a truncation.
    data : what is written; the other name of a rename or link.
    """

    op: str
    path: str
    at: int = 0
    data: bytes = b""


class Listener(Protocol):
    """Who is asked and told."""

    def before(self, call: OsCall) -> int:
        """The error number that the call is to fail with; 0: it is made."""

    def after(self, call: OsCall) -> None:
        """The call was made."""


CHANGES = frozenset(("create", "write", "sync", "truncate", "rename", "link", "unlink", "folder"))
"""Calls that change what is on the disk, or wait for it."""

_CODES = {
    "open": 14, "create": 14, "read": 10 | 1 << 8, "write": 10 | 3 << 8, "sync": 10 | 4 << 8,
    "truncate": 10 | 6 << 8, "unlink": 10 | 10 << 8, "folder": 10 | 5 << 8,
}  # fmt: skip
"""What SQLite's file system makes of an error: CANTOPEN; IOERR_READ, _WRITE, _FSYNC and so on."""
_FULL, _OPEN_CREATE, _OPEN_JOURNAL = 13, 0x4, 0x800 | 0x80000

_OPEN = CFUNCTYPE(c_int, c_void_p, c_void_p, c_void_p, c_int, c_void_p)
_DELETE = CFUNCTYPE(c_int, c_void_p, c_char_p, c_int)
_MOVE = CFUNCTYPE(c_int, c_void_p, c_void_p, c_int, c_int64)
_ONE = CFUNCTYPE(c_int, c_void_p, c_int)
_SIZED = CFUNCTYPE(c_int, c_void_p, c_int64)


class _Vfs(ctypes.Structure):
    """``sqlite3_vfs``, version 3."""

    _fields_ = (
        ("version", c_int), ("file_size", c_int), ("longest", c_int), ("next", c_void_p), ("name", c_char_p),
        ("data", c_void_p), ("open", c_void_p), ("delete", c_void_p), ("rest", c_void_p * 14),
    )  # fmt: skip


class _Methods(ctypes.Structure):
    """``sqlite3_io_methods``, version 3."""

    _fields_ = (
        ("version", c_int), ("close", c_void_p), ("read", c_void_p), ("write", c_void_p),
        ("truncate", c_void_p), ("sync", c_void_p), ("rest", c_void_p * 13),
    )  # fmt: skip


class Listening:
    """All calls of this process that concern files below a folder, from now on.

    Parameters
    ----------
    folder : which.
    listener : who is asked and told.

    Raises
    ------
    UsageError : SQLITE_CALLS: the SQLite of this Python cannot be reached.
    """

    def __init__(self, folder: str, listener: Listener) -> None:
        self._folder = os.path.realpath(folder) + os.sep
        self._listener = listener
        self._names: dict[int, str] = {}
        self._kept: list[Any] = []
        self._methods: dict[int, _Methods] = {}
        self._new: set[int] = set()
        self._sqlite()
        self._python()

    def _mine(self, path: Any) -> str:
        """The path as it is told; empty for one that is none of ours."""
        try:
            name = os.path.abspath(os.fsdecode(path))
        except (TypeError, ValueError):
            return ""
        return name if (name + os.sep).startswith(self._folder) else ""

    # ---- Python --------------------

    def _python(self) -> None:
        self._python_open()
        for name, op in (("replace", "rename"), ("rename", "rename"), ("link", "link")):
            self._two(name, op)
        for name in ("unlink", "remove"):
            self._wrap(name, lambda path, *_: ("unlink", self._mine(path)))
        self._wrap("stat", lambda path, *_: ("look", "" if isinstance(path, int) else self._mine(path)))
        for name in ("fsync", "fdatasync"):
            self._wrap(name, self._synced)
        self._wrap("ftruncate", lambda fd, size: ("truncate", self._names.get(fd, ""), size))
        self._wrap("pwrite", lambda fd, data, at: ("write", self._names.get(fd, ""), at, bytes(data)))

    def _synced(self, fd: int) -> tuple[str, str]:
        name = self._names.get(fd, "")
        return ("folder" if stat.S_ISDIR(os.fstat(fd).st_mode) else "sync", name)

    def _wrap(self, name: str, told: Callable[..., tuple[Any, ...]]) -> None:
        """Ask and tell of a function of ``os``."""
        real = getattr(os, name, None)
        if real is None:
            return

        @wraps(real)
        def do(*given: Any, **more: Any) -> Any:
            op, path, *rest = told(*given)
            return self._asked(OsCall(op, path, *rest), lambda: real(*given, **more))

        setattr(os, name, do)

    def _two(self, name: str, op: str) -> None:
        def told(old: Any, new: Any, *_: Any) -> tuple[str, str, int, bytes]:
            return op, self._mine(old), 0, os.fsencode(os.path.abspath(new))

        self._wrap(name, told)

    def _asked(self, call: OsCall, do: Callable[[], Any]) -> Any:
        if not call.path:
            return do()
        number = self._listener.before(call)
        if number:
            raise OSError(number, os.strerror(number), call.path)
        came = do()
        self._listener.after(call)
        return came

    def _python_open(self) -> None:
        real, real_io, close = os.open, io.open, os.close

        def open_(path: Any, flags: int, *more: Any, **named: Any) -> int:
            name = self._mine(path)
            made = flags & os.O_CREAT and not os.path.lexists(name)
            call = OsCall("create" if made else "open", name)
            fd: int = self._asked(call, lambda: real(path, flags, *more, **named))
            self._names[fd] = name
            return fd

        def close_(fd: int) -> None:
            self._names.pop(fd, None)
            close(fd)

        def io_open(file: Any, mode: str = "r", *more: Any, **named: Any) -> Any:
            name = "" if isinstance(file, int) else self._mine(file)
            if not name:
                return real_io(file, mode, *more, **named)
            writes = any(letter in mode for letter in "wxa+")
            call = OsCall("create" if writes else "open", name)
            opened = self._asked(call, lambda: real_io(file, mode, *more, **named))
            if writes:
                self._names[opened.fileno()] = name
                return _File(opened, self, name)
            return opened

        os.open, os.close = open_, close_
        io.open = builtins.open = io_open

    # ---- SQLite --------------------

    def _sqlite(self) -> None:
        """Register a file system that is SQLite's own but for what we want to hear of."""
        try:
            import _sqlite3

            library = ctypes.CDLL(_sqlite3.__file__)
            find, register = library.sqlite3_vfs_find, library.sqlite3_vfs_register
        except (ImportError, OSError, AttributeError):
            raise UsageError(
                "SQLITE_CALLS", "the SQLite of this Python cannot be reached", where="selfcheck",
                allowed="a Python whose sqlite3 module uses a shared library",
            ) from None  # fmt: skip
        find.restype, register.argtypes = c_void_p, (c_void_p, c_int)
        own = find(None)
        mine = _Vfs.from_buffer_copy(ctypes.string_at(own, ctypes.sizeof(_Vfs)))
        real_open, real_delete = _OPEN(mine.open), _DELETE(mine.delete)

        def open_(vfs: int, name: int, file: int, flags: int, out: int) -> int:
            path = self._mine(ctypes.string_at(name)) if name else ""
            made = bool(path) and bool(flags & _OPEN_CREATE) and not os.path.lexists(path)
            code = self._sql(
                OsCall("create" if made else "open", path), lambda: real_open(own, name, file, flags, out)
            )
            if code == 0 and path:
                if made and flags & _OPEN_JOURNAL:
                    self._new.add(file)
                self._listen(file, path)
            elif code:
                ctypes.cast(file, POINTER(c_void_p))[0] = None
            return code

        def delete(vfs: int, name: bytes, sync: int) -> int:
            path = self._mine(name)
            code = self._sql(OsCall("unlink", path), lambda: real_delete(own, name, sync))
            if code == 0 and sync and path:
                return self._sql(OsCall("folder", os.path.dirname(path)), lambda: 0)
            return code

        self._kept = [_OPEN(open_), _DELETE(delete), mine, real_open, real_delete]
        mine.open, mine.delete = (ctypes.cast(f, c_void_p).value for f in self._kept[:2])
        mine.name, mine.next = b"lampyris-listening", None
        if register(ctypes.byref(mine), 1):
            raise UsageError("SQLITE_CALLS", "SQLite takes no file system", where="selfcheck")

    def _sql(self, call: OsCall, do: Callable[[], int]) -> int:
        """As :meth:`_asked`, in SQLite's codes."""
        if not call.path:
            return do()
        number = self._listener.before(call)
        if number:
            return _FULL if call.op == "write" and number == errno.ENOSPC else _CODES[call.op]
        code = do()
        if code == 0:
            self._listener.after(call)
        return code

    def _listen(self, file: int, path: str) -> None:
        """Put methods of ours before those of an open file."""
        slot = ctypes.cast(file, POINTER(c_void_p))
        own = slot[0]
        assert own is not None
        real = _Methods.from_buffer_copy(ctypes.string_at(own, ctypes.sizeof(_Methods)))
        read, write = _MOVE(real.read), _MOVE(real.write)
        truncate, sync = _SIZED(real.truncate), _ONE(real.sync)

        def write_(f: int, data: int, size: int, at: int) -> int:
            call = OsCall("write", path, at, ctypes.string_at(data, size))
            return self._sql(call, lambda: write(f, data, size, at))

        def sync_(f: int, flags: int) -> int:
            code = self._sql(OsCall("sync", path), lambda: sync(f, flags))
            if code == 0 and f in self._new:  # SQLite syncs the folder with the first sync of a new journal
                self._new.discard(f)
                return self._sql(OsCall("folder", os.path.dirname(path)), lambda: 0)
            return code

        ours = (
            _MOVE(lambda f, to, size, at: self._sql(OsCall("read", path), lambda: read(f, to, size, at))),
            _MOVE(write_),
            _SIZED(lambda f, size: self._sql(OsCall("truncate", path, size), lambda: truncate(f, size))),
            _ONE(sync_),
        )
        real.read, real.write, real.truncate, real.sync = (ctypes.cast(f, c_void_p).value for f in ours)
        self._kept.append((real, ours))
        slot[0] = ctypes.addressof(real)


class _File:
    """A file that is written through Python's buffers: what they hold is written when they are flushed."""

    def __init__(self, file: Any, of: Listening, name: str) -> None:
        self._file, self._of, self._name = file, of, name

    def write(self, data: Any) -> Any:
        """Write, at once: so each call is one."""
        raw = data if isinstance(data, bytes | bytearray | memoryview) else str(data).encode()

        def do() -> Any:
            count = self._file.write(data)
            self._file.flush()
            return count

        return self._of._asked(OsCall("write", self._name, self._file.tell(), bytes(raw)), do)

    def __enter__(self) -> _File:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)
