"""The Python of the pages on speed runs, block by block, and says what its comments say it does."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

PAGES = sorted((Path(__file__).resolve().parents[1] / "docs" / "speed").glob("*.md"))
BLOCK = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
WITH_BLOCKS = [page for page in PAGES if BLOCK.search(page.read_text(encoding="utf-8"))]

pytestmark = pytest.mark.source


def test_there_are_blocks() -> None:
    assert {"README.md", "curve.md", "driving.md", "profile.md"} <= {page.name for page in WITH_BLOCKS}


@pytest.mark.parametrize("page", WITH_BLOCKS, ids=lambda p: p.name)
def test_the_blocks_run(page: Path) -> None:
    names: dict[str, Any] = {}
    for block in BLOCK.findall(page.read_text(encoding="utf-8")):
        exec(compile(block, page.name, "exec"), names)
    if page.name == "README.md":
        said = re.search(r"profile\.why\((\d+)\)  # '(.+)'", page.read_text(encoding="utf-8"))
        assert said is not None
        assert names["profile"].why(int(said[1])) == said[2]
    if page.name == "driving.md":
        run = names["run"]
        text = page.read_text(encoding="utf-8")
        assert f"# {run.outcome}, {run.duration:.2f}, {run.optimum:.2f}" in text
        said = re.search(r"run\.why\((\d+)\)  # '(.+)'", text)
        assert said is not None
        assert run.why(int(said[1])) == said[2]
