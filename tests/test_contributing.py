"""CONTRIBUTING is short, its map is the tree, and its planner passes the contract as printed."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from types import ModuleType

import pytest

import lampyris
from lampyris.testing import check_planner

PAGE = Path(__file__).resolve().parents[1] / "CONTRIBUTING.md"
pytestmark = pytest.mark.source
MAX_LINES = 120
ELSEWHERE = {"selfcheck"}
"""Folders that the map leaves out: the checks have a page of their own."""


def text() -> str:
    return PAGE.read_text(encoding="utf-8")


def test_it_is_short() -> None:
    assert len(text().splitlines()) <= MAX_LINES


def test_the_map_is_the_tree() -> None:
    rows = re.findall(r"^\| `(\w+)` \|", text(), re.MULTILINE)
    package = Path(lampyris.__file__).parent
    folders = {path.parent.name for path in package.glob("*/__init__.py")}
    assert set(rows) == folders - ELSEWHERE
    named = re.findall(r"`((?:io|motion|sim|planning)/[\w/.]+)`", text())
    assert len(named) > 5
    assert [one for one in named if not (package / one).exists() and "my_planner" not in one] == []


def test_the_planner_passes_the_contract_as_printed(monkeypatch: pytest.MonkeyPatch) -> None:
    (block,) = re.findall(r"```python\n(.*?)```", text(), re.DOTALL)
    module = ModuleType("planner_of_contributing")
    monkeypatch.setitem(sys.modules, module.__name__, module)  # dataclasses look there for their module
    exec(compile(block, PAGE.name, "exec"), module.__dict__)
    check_planner(module.MyPlanner())
