"""Store lock: one writer a store, by a lock on a small file beside it, which the system frees with its process."""

from __future__ import annotations

import os
import sqlite3
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Self

from lampyris.errors import FileError
from lampyris.study.store.file import connect, is_open_here, log_size, sidecar

LOCK = ".lock"
_WAIT_S = 0.2
"""How long a lock that is held is asked for again: a reader holds it for a moment to remove an empty log."""


class StoreLock:
    """The lock of one store, held from when it is made until :meth:`release` or the end of a ``with``.

    Parameters
    ----------
    path : of the store.
    wait_s : seconds to wait for another holder.

    Raises
    ------
    FileError : STORE_BUSY: another process holds it, or this one already does; STORE_WRITE.
    """

    def __init__(self, path: Path, *, wait_s: float = _WAIT_S) -> None:
        from filelock import FileLock, Timeout

        self.store = path
        self.path = sidecar(path, LOCK)
        # Shared by threads: a store may be closed by another thread than the one that opened it.
        self._lock = FileLock(self.path, timeout=wait_s, poll_interval=0.01, thread_local=False)
        try:
            self._lock.acquire()
        except Timeout:
            raise FileError(
                "STORE_BUSY", f"another process writes to it{_holder(self.path)}", where=str(path),
                todo="wait for that one, or give another store: store=FILE",
            ) from None  # fmt: skip
        except OSError as error:
            raise FileError(
                "STORE_WRITE", error.strerror or str(error), where=str(path),
                allowed="a folder you may write in",
            ) from None  # fmt: skip
        with suppress(OSError):  # for the message of others only
            self.path.write_text(f"pid {os.getpid()}\n", encoding="ascii")

    def release(self) -> None:
        """Free the lock and remove its file, and an empty log that readers left."""
        if self._lock.is_locked:
            with suppress(OSError, sqlite3.Error):
                _remove_empty_log(self.store)
            # While it is held: a lock on a file that has no name any more is none, and filelock tries again.
            with suppress(OSError):
                self.path.unlink(missing_ok=True)
            self._lock.release()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.release()


def _remove_empty_log(path: Path) -> None:
    """Remove ``-wal`` and ``-shm`` if nothing is in the log and nobody has the store open; the lock is held.

    A connection that only reads leaves them. One that may write has SQLite remove them when it is closed and no
    other is open. Who may not write to the file cannot ask for that; left there, they would keep its owner out.
    """
    if log_size(path) != 0:
        return
    if os.access(path, os.W_OK):
        connection = connect(path, "rw", recover=True)
        try:
            connection.execute("SELECT count(*) FROM sqlite_schema").fetchone()
        finally:
            connection.close()
    elif not is_open_here(os.stat(path)):
        for ending in ("-wal", "-shm"):
            sidecar(path, ending).unlink(missing_ok=True)


def _holder(path: Path) -> str:
    try:
        text = path.read_bytes()[:40].decode("ascii", "replace").strip()
    except OSError:
        return ""
    return f" ({text})" if text.startswith("pid ") and text.isprintable() else ""
