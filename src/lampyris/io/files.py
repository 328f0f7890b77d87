"""Regular files, read and written whole, with typed errors."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path

from lampyris._core.system import NONBLOCKING_READ
from lampyris.errors import FileError, LimitError


def read_regular(path: str | os.PathLike[str], limit: int) -> bytes:
    """All bytes of a regular file; directories, pipes and devices are refused without waiting for them.

    Parameters
    ----------
    path : the file.
    limit : most bytes.

    Raises
    ------
    FileError : missing, not readable, not a regular file.
    LimitError : more bytes than the limit.
    """
    name = os.fspath(path)
    try:
        # Asked twice. By name first: merely opening some devices does something. Of the open file then: it
        # may have been changed for another in between. O_NONBLOCK, because opening a pipe nobody writes to
        # would wait forever.
        _regular(os.stat(name).st_mode, name)
        handle = os.open(name, NONBLOCKING_READ)
        with os.fdopen(handle, "rb") as stream:
            info = os.fstat(handle)
            _regular(info.st_mode, name)
            # A read makes room for all it is asked for: first what is there, more only if the file has grown.
            data = b"" if info.st_size > limit else stream.read(info.st_size + 1)
            if len(data) > info.st_size:
                data += stream.read(limit + 1 - len(data))
            size = max(info.st_size, len(data))
    except (FileNotFoundError, NotADirectoryError, ValueError):
        raise FileError("FILE_MISSING", "no such file", where=repr(name)) from None
    except OSError as problem:
        why = problem.strerror or "cannot be read"
        missing = problem.errno in (errno.ENAMETOOLONG, errno.ELOOP)
        raise FileError("FILE_MISSING" if missing else "FILE_READ", why, where=repr(name[:200])) from None
    if size > limit:
        raise LimitError("FILE_TOO_LARGE", f"{size:,} bytes", where=name, allowed=f"at most {limit:,} bytes")
    return data


def write_file(path: str | os.PathLike[str], data: bytes) -> None:
    """Write a file, whole.

    Raises
    ------
    FileError : FILE_WRITE.
    """
    try:
        Path(path).write_bytes(data)
    except (OSError, ValueError) as problem:
        why = getattr(problem, "strerror", None) or "cannot be written"
        raise FileError("FILE_WRITE", why, where=str(path)) from None


def _regular(mode: int, name: str) -> None:
    if not stat.S_ISREG(mode):
        kinds = ((stat.S_ISDIR, "directory"), (stat.S_ISFIFO, "pipe"), (stat.S_ISSOCK, "socket"))
        kind = next((word for is_kind, word in kinds if is_kind(mode)), "device")
        raise FileError("FILE_KIND", f"not a regular file (a {kind})", where=name)
