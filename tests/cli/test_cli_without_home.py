"""A container's user: no HOME, and a number that no user of the system has."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from lampyris.app.server import library
from lampyris.errors import FileError
from sizes import some

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="homes of Linux")

NOBODY = """
import os, pwd
for name in ("HOME", "XDG_DATA_HOME", "XDG_CACHE_HOME", "XDG_CONFIG_HOME", "MPLCONFIGDIR"):
    os.environ.pop(name, None)
def unknown(uid):
    raise KeyError(f"getpwuid(): uid not found: {uid}")
pwd.getpwuid = unknown
from lampyris.cli import main
main()
"""


def started(folder: Path, *words: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", NOBODY, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        cwd=folder, env={**os.environ, "TMPDIR": str(folder)},
    )  # fmt: skip


@pytest.mark.nightly
def test_the_app_starts_and_keeps_uploads_among_temporary_files(tmp_path: Path) -> None:
    with started(tmp_path, "app", "--no-browser", "--port", "0") as running:
        assert running.stdout is not None
        first = running.stdout.readline()
        running.send_signal(signal.SIGINT)
        try:
            _, said = running.communicate(timeout=120)
        finally:
            running.kill()
    assert first.startswith("lampyris app: http://127.0.0.1:"), said
    assert running.returncode == 0, said
    folder = tmp_path / f"lampyris-{os.getuid()}"
    assert folder.stat().st_mode & 0o777 == 0o700


@pytest.mark.nightly
@pytest.mark.parametrize(
    "words",
    some(
        [
            ["plan", "guide", "--picture", "p.png", "--csv", "-"],
            ["simulate", "guide", "--obstacles", "1", "--film", "f.gif"],
            ["compare", "guide", "--planners", "astar"],
            ["maps", "make", "maze", "--out", "m.png"],
            ["planners"],
        ]
    ),
)
def test_other_verbs_need_no_home(tmp_path: Path, words: list[str]) -> None:
    with started(tmp_path, *words) as running:
        _, said = running.communicate(timeout=120)
    assert running.returncode == 0, said
    assert "Traceback" not in said


def test_a_folder_of_somebody_else_is_not_taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(library.tempfile, "gettempdir", lambda: str(tmp_path))
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / f"lampyris-{os.getuid()}").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(FileError, match="another user's"):
        library.temporary_spool()
