"""Files are written whole or not at all, by one writer, whoever writes."""

from __future__ import annotations

from pathlib import Path

import pytest

from lampyris.errors import FileError
from lampyris.report import html
from lampyris.report.whole_file import whole_file


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


def test_there_is_no_other_writer() -> None:
    assert not hasattr(html, "write")
