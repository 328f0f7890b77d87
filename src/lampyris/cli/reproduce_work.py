"""What ``lampyris reproduce`` does."""

from __future__ import annotations

from pathlib import Path

from lampyris.cli import study_work
from lampyris.errors import FileError, UsageError


def reproduce(out: Path, workers: int | None, quick: bool, as_json: bool, force: bool) -> int:
    """``lampyris reproduce``. Returns the exit code."""
    from lampyris.reproduce import reproduce as work

    _check(out, force)
    work(out, workers=study_work.cores() if workers is None else workers, quick=quick, progress=None)
    return 0


def _check(out: Path, force: bool) -> None:
    """Refuse at once what could not be written at the end."""
    if out.exists() and not out.is_dir():
        raise FileError("FILE_WRITE", "not a folder", where=str(out), allowed="a folder, or a new name")
    if out.is_dir() and any(out.iterdir()) and not force:
        raise UsageError(
            "EXISTS", "the folder is not empty", where=str(out), todo="give --force to write into it"
        )
