"""Store lock: one writer a store, and a witness of what was acknowledged, in a small file beside it.

The system frees the lock when its process ends, however it ends. The witness is needed because SQLite takes a
write-ahead log whose end is missing for one that was never written: it forgets the last runs without a word.
The number of runs acknowledged, and the head of their chain, therefore stand in a second place, synced before
:meth:`lampyris.study.store.store.Store.add` returns. Emptying the log into the main file after every call would do
without it, but not while somebody reads; and it costs two syncs of the disk where the witness costs one.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from lampyris.errors import FileError, UsageError
from lampyris.io.atomic_write import sync_folder
from lampyris.study.store.file import HEAD, damaged, log_left, sidecar

LOCK = ".lock"
_LINE = 256
"""Bytes of each line: the process, then two lines for the witness, written in turn."""
_TRIES = 100
_LOOKS = 3


@dataclass(frozen=True, slots=True)
class Witness:
    """What was acknowledged: the number of runs, and the head of their chain."""

    count: int = 0
    head: str = HEAD


class StoreLock:
    """The lock of one store, held from when it is made until :meth:`release`.

    Parameters
    ----------
    path : of the store.

    Raises
    ------
    FileError : STORE_BUSY: another process holds it, or this one already does; STORE_WRITE.
    """

    def __init__(self, path: Path) -> None:
        self.path = sidecar(path, LOCK)
        self._fd = _locked(path, self.path)
        self._turn = 0
        try:
            self._says = os.fstat(self._fd).st_size > _LINE
            os.pwrite(self._fd, _padded(f"pid {os.getpid()}"), 0)
        except OSError as error:
            os.close(self._fd)
            raise _refused(path, error) from None

    def write(self, witness: Witness) -> None:
        """Keep what was acknowledged; it is on the disk when this returns.

        Raises
        ------
        OSError : the system refuses.
        """
        self._turn, self._says = 1 - self._turn, True
        os.pwrite(self._fd, _said(witness), _LINE * (1 + self._turn))
        getattr(os, "fdatasync", os.fsync)(self._fd)  # macOS has no fdatasync

    def start(self, witness: Witness) -> None:
        """As :meth:`write`, in both lines: from here on writing needs no new space on the disk.

        Raises
        ------
        OSError : the system refuses.
        """
        self.write(witness)
        self.write(witness)
        sync_folder(self.path.parent)  # or lost power takes the witness, and leaves the log without one

    def release(self, *, remove: bool) -> None:
        """Free the lock; its file goes first with ``remove``, or if it says nothing yet.

        Where the system refuses, the file stays: what it says is true, and the next writer begins with it.
        """
        if self._fd < 0:
            return
        fd, self._fd = self._fd, -1
        try:
            if remove or not self._says:
                with suppress(OSError):
                    if self._says:
                        self._settle()
                    self.path.unlink(missing_ok=True)
        finally:
            with suppress(OSError):  # the descriptor, and the lock with it, is gone all the same
                os.close(fd)

    def _settle(self) -> None:
        """Wait until it is certain that the log is gone, or empty: only then may what vouches for it go."""
        log = self.path.with_name(self.path.name.removesuffix(LOCK) + "-wal")
        with suppress(FileNotFoundError):
            fd = os.open(log, os.O_RDWR)
            try:
                os.fsync(fd)
            finally:
                os.close(fd)
        sync_folder(self.path.parent)


@contextmanager
def held(path: Path) -> Iterator[StoreLock]:
    """The lock of a store for as long as the block runs; what it witnesses stays."""
    hold = StoreLock(path)
    try:
        yield hold
    finally:
        hold.release(remove=False)


def witness_of(path: Path) -> Witness | None:
    """What was acknowledged of a store, as the file beside it says; None if there is none to say it.

    Raises
    ------
    FileError : STORE_DAMAGED: there is such a file, and neither of its lines holds; STORE_READ.
    """
    file = sidecar(path, LOCK)
    try:
        data = file.read_bytes()[: 3 * _LINE]
    except FileNotFoundError:
        return None
    except OSError as error:
        raise FileError("STORE_READ", error.strerror or str(error), where=str(file)) from None
    found = [w for k in (1, 2) if (w := _witness(data[k * _LINE : (k + 1) * _LINE])) is not None]
    if not found and len(data) <= _LINE:
        return None  # its writer has yet to say, or died before
    if not found:
        raise damaged(path, f"{file.name} does not say how many runs there were")
    return max(found, key=lambda w: w.count)


def vouched(path: Path) -> Witness:
    """What was acknowledged of a store, for who is about to read it; nothing if it was closed.

    A log is never there without what vouches for it, which is written first and goes last. So a log alone is
    that of another store, or of an earlier state, and SQLite would believe it.

    Raises
    ------
    FileError : STORE_DAMAGED; STORE_READ.
    """
    for _ in range(_LOOKS):  # Between two of our looks a writer may have closed it, or opened it.
        witness = witness_of(path)
        if witness is not None or not log_left(path):
            return witness or Witness()
    raise damaged(path, f"its log is there, and {path.name}{LOCK} does not vouch for it")


def _said(witness: Witness) -> bytes:
    text = f"{witness.count} {witness.head}"
    return _padded(f"{text} {hashlib.sha256(text.encode()).hexdigest()}")


def _witness(line: bytes) -> Witness | None:
    """What a line says, if every byte of it is right."""
    count, _, rest = line.partition(b" ")
    head = rest[:64]
    if not count.isdigit() or len(count) > 18 or not head.isalnum():
        return None
    witness = Witness(int(count), head.decode("ascii"))
    return witness if _said(witness) == line else None


def _padded(text: str) -> bytes:
    return text.encode().ljust(_LINE - 1) + b"\n"


def _locked(store: Path, path: Path) -> int:
    """An open descriptor of the lock's file, with the lock on it."""
    try:
        import fcntl
    except ImportError:  # pragma: no cover
        raise UsageError("STORE_SYSTEM", "this system has no flock", allowed="Linux, macOS") from None
    try:
        for _ in range(_TRIES):
            fd = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NONBLOCK, 0o666)
            try:
                # flock and not lockf: that one is lost when any descriptor of the file is closed, even one
                # that a reader in this process opened.
                fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
                mine = os.fstat(fd)
                # Anyone who held it may have removed the file between our two calls.
                if path.exists() and os.path.samestat(mine, path.stat()):
                    return fd
            except BaseException:
                os.close(fd)
                raise
            os.close(fd)
    except BlockingIOError:
        raise FileError(
            "STORE_BUSY", f"another process writes to it{_who(path)}", where=str(store),
            todo="wait for that one, or give another store: store=FILE",
        ) from None  # fmt: skip
    except OSError as error:
        raise _refused(store, error) from None
    raise FileError("STORE_BUSY", "other processes open and close it", where=str(store))  # pragma: no cover


def _who(path: Path) -> str:
    try:
        said = path.read_bytes()[:_LINE].decode("ascii", "replace").strip()
    except OSError:
        return ""
    return f" ({said})" if said.startswith("pid ") else ""


def _refused(path: Path, error: OSError) -> FileError:
    return FileError(
        "STORE_WRITE", error.strerror or str(error), where=str(path), allowed="a folder you may write in"
    )
