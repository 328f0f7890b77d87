"""Files are written whole or not at all, by one writer, anyone who writes."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path

import pytest

from lampyris.errors import FileError
from lampyris.io.atomic_write import whole_file


def test_a_file_is_whole_or_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "t"
    path.write_text("old")
    path.chmod(0o640)
    with pytest.raises(ZeroDivisionError), whole_file(path) as file:
        file.write(b"half" * (1 // 0))
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["t"]
    with whole_file(path) as file:
        file.write(b"new")
        file.flush()
        assert path.read_text() == "old"
    assert path.read_text() == "new"
    assert path.stat().st_mode & 0o777 == 0o640
    (tmp_path / "link").symlink_to(path)
    with whole_file(tmp_path / "link") as file:
        file.write(b"through the link")
    assert path.read_text() == "through the link"
    assert (tmp_path / "link").is_symlink()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["link", "t"]


def test_what_the_system_refuses_is_told_with_the_place(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="FILE_WRITE") as told, whole_file(tmp_path / "no" / "t"):
        pass
    assert str(tmp_path / "no" / "t") in str(told.value)


@pytest.mark.parametrize("number", [errno.EINVAL, errno.ENOTSUP, errno.ENOSYS])
def test_a_file_system_that_knows_no_waiting_for_folders_is_none_the_worse(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    """A file was then told to be unwritten, though it was there under its name."""
    _folders_answer(monkeypatch, number)
    with whole_file(tmp_path / "t") as file:
        file.write(b"new")
    assert (tmp_path / "t").read_bytes() == b"new"


def test_a_folder_that_the_disk_fails_to_write_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _folders_answer(monkeypatch, errno.EIO)
    with pytest.raises(FileError, match="FILE_WRITE"), whole_file(tmp_path / "t") as file:
        file.write(b"new")


def test_permissions_are_kept_where_open_files_have_none_to_set(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Windows has no fchmod: every second writing of a file ended in a fault of ours."""
    monkeypatch.delattr(os, "fchmod")
    monkeypatch.setattr(os, "supports_fd", os.supports_fd - {os.chmod})
    path = tmp_path / "t"
    path.write_text("old")
    path.chmod(0o640)
    with whole_file(path) as file:
        file.write(b"new")
    assert (path.read_bytes(), path.stat().st_mode & 0o777) == (b"new", 0o640)


def _folders_answer(monkeypatch: pytest.MonkeyPatch, number: int) -> None:
    """Waiting for a folder is refused with that error; for a file it is not."""
    sync = os.fsync

    def refusing(fd: int) -> None:
        if stat.S_ISDIR(os.fstat(fd).st_mode):
            raise OSError(number, os.strerror(number))
        sync(fd)

    monkeypatch.setattr(os, "fsync", refusing)
