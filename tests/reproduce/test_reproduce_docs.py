"""The page about it says what is so."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from lampyris.reproduce import data, printed
from lampyris.reproduce.verdict import count

PAGE = Path(__file__).parents[2] / "docs" / "reproduce.md"


@pytest.mark.source
def test_its_counts_are_those_of_the_verdicts() -> None:
    words = PAGE.read_text(encoding="utf-8")
    found = count(v for table in data.tables() for v in printed.verdicts(table))
    for kind, many in found.items():
        assert re.search(rf"^\| {kind} \|.*\| {many} \|$", words, re.MULTILINE), kind
    assert f"{sum(found.values()):,} figures" in words


@pytest.mark.source
def test_its_python_runs(capsys: pytest.CaptureFixture[str]) -> None:
    (block,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    exec(compile(block, str(PAGE), "exec"), {})
    assert "'65.64'" in capsys.readouterr().out
