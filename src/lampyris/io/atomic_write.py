"""A file is written whole or not at all: beside its place first, then, on the disk, given its name."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from lampyris._core.system import sync_folder
from lampyris.errors import FileError


@contextmanager
def whole_file(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """A file open for writing that replaces what is at the path when the block ends without an error.

    What is there until then stays as it is; its permissions are kept, a link to it stays a link. What is not
    a regular file (a pipe, the terminal) is written to directly.

    Raises
    ------
    FileError : FILE_WRITE: the system refuses.
    """
    try:
        place = Path(os.path.realpath(path))
        old = place.stat() if place.exists() else None
        if old is not None and not stat.S_ISREG(old.st_mode):
            with place.open("wb") as file:
                yield file
            return
        beside = place.with_name(f".{place.name[:200]}.{os.getpid()}.part")
        try:
            with beside.open("wb") as file:
                yield file
                file.flush()
                if old is not None:
                    # By the open file where the system can: a name may have become another's.
                    of = file.fileno() if os.chmod in os.supports_fd else beside
                    os.chmod(of, stat.S_IMODE(old.st_mode))
                os.fsync(file.fileno())
            beside.replace(place)
        except BaseException:
            beside.unlink(missing_ok=True)
            raise
        sync_folder(place.parent)
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise FileError("FILE_WRITE", why, where=str(path), allowed="a file that can be written") from None
