"""Tutorials and how-to pages: every command runs as printed, in the page's own folder, one after the other."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted([*(ROOT / "docs/tutorials").glob("*.md"), *(ROOT / "docs/howto").glob("*.md")])
BLOCK = re.compile(r"^```bash\n(.*?)^```$", re.MULTILINE | re.DOTALL)

pytestmark = [pytest.mark.source, pytest.mark.nightly]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_commands_run(page: Path, tmp_path: Path) -> None:
    shutil.copy(ROOT / "docs/img/photo.jpg", tmp_path / "floor.jpg")
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    for block in BLOCK.findall(page.read_text(encoding="utf-8")):
        done = subprocess.run(
            ["bash", "-euo", "pipefail", "-c", block],
            cwd=tmp_path, env={**os.environ, "PATH": path}, capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0, (block, done.returncode, done.stdout[-600:], done.stderr[-600:])
        missing = [
            name
            for name in re.findall(r"[\w-]+\.(?:png|webp|csv|html)\b", block)
            if not (tmp_path / name).exists()
        ]
        assert not missing, (block, missing)


def test_the_agent_of_the_tutorial_learns(tmp_path: Path) -> None:
    """The page's Python, as one program."""
    pytest.importorskip("gymnasium")
    page = (ROOT / "docs/tutorials/reinforcement_learning.md").read_text(encoding="utf-8")
    code = "".join(re.findall(r"^```python\n(.*?)^```$", page, re.MULTILINE | re.DOTALL))
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr[-600:]
    assert "True 0.0" in done.stdout
    assert done.stdout.splitlines()[2].endswith("after training 0.0")
