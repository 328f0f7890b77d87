"""The page on the Python interface: every block runs by itself."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import lampyris

PAGE = Path(__file__).resolve().parents[1] / "docs" / "python.md"
pytestmark = pytest.mark.source
BLOCK = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def test_the_blocks_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("MPLBACKEND", "Agg")
    monkeypatch.chdir(tmp_path)
    blocks = BLOCK.findall(PAGE.read_text(encoding="utf-8"))
    assert len(blocks) >= 8
    said = ""
    for block in blocks:
        exec(compile(block, PAGE.name, "exec"), {})
        out = capsys.readouterr().out
        assert out
        said += out
    assert (tmp_path / "plan.png").stat().st_size > 1000
    assert "error[SETTING_CLASH]: patience: " in said
    (shown,) = re.findall(r"print\(plan\)  # (<Plan .*>)", PAGE.read_text(encoding="utf-8"))
    assert shown in said.splitlines()


def test_every_public_function_is_in_the_table() -> None:
    rows = re.findall(r"^\| `(\w+)\(", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    assert len(rows) == 15
    for name in rows:
        assert callable(getattr(lampyris, name))
