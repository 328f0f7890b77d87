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

SAVED = re.compile(r"^```python\n# (\w+\.py)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
"""Blocks that the page has the reader save, under the name in their first line."""

pytestmark = [pytest.mark.source, pytest.mark.nightly]


def installing(site: Path) -> dict[str, str]:
    """Have `pip install .` of a page write to a folder of the test's, where Python finds it, and ask nobody."""
    paths = [str(site), *filter(None, [os.environ.get("PYTHONPATH")])]
    return {
        "PYTHONPATH": os.pathsep.join(paths),
        "PIP_TARGET": str(site),
        "PIP_NO_DEPS": "1",
        "PIP_NO_INDEX": "1",
        "PIP_NO_BUILD_ISOLATION": "0",  # pip reads it as the value of build isolation
        "PIP_DISABLE_PIP_VERSION_CHECK": "1",
    }


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_commands_run(page: Path, tmp_path: Path) -> None:
    shutil.copy(ROOT / "docs/img/photo.jpg", tmp_path / "floor.jpg")
    text = page.read_text(encoding="utf-8")
    for name, block in SAVED.findall(text):
        (tmp_path / name).write_text(block, encoding="utf-8")
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    environment = {**os.environ, "PATH": path, **installing(tmp_path / "site")}
    for block in BLOCK.findall(text):
        done = subprocess.run(
            ["bash", "-euo", "pipefail", "-c", block],
            cwd=tmp_path, env=environment, capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0, (block, done.returncode, done.stdout[-600:], done.stderr[-600:])
        missing = [
            name
            for name in re.findall(r"[\w-]+\.(?:png|webp|csv|html|json)\b", block)
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
