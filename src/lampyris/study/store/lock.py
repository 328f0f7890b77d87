"""Store lock: one writer a store, by a lock on a small file beside it, which the system frees with its process."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Self

from lampyris.errors import FileError
from lampyris.study.store.file import sidecar

LOCK = ".lock"


class StoreLock:
    """The lock of one store, held from when it is made until :meth:`release` or the end of a ``with``.

    Parameters
    ----------
    path : of the store.

    Raises
    ------
    FileError : STORE_BUSY: another process holds it, or this one already does; STORE_WRITE.
    """

    def __init__(self, path: Path) -> None:
        from filelock import FileLock, Timeout

        self.path = sidecar(path, LOCK)
        # Shared by threads: a store may be closed by another thread than the one that opened it.
        self._lock = FileLock(self.path, timeout=0, thread_local=False)
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
        """Free the lock and remove its file."""
        if self._lock.is_locked:
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


def _holder(path: Path) -> str:
    try:
        text = path.read_bytes()[:40].decode("ascii", "replace").strip()
    except OSError:
        return ""
    return f" ({text})" if text.startswith("pid ") and text.isprintable() else ""
