"""The page of promises is what was recorded, and every check serves a goal."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from types import ModuleType

import pytest

from lampyris.selfcheck import registry

ROOT = Path(__file__).resolve().parents[2]
pytestmark = pytest.mark.source


@pytest.fixture(scope="module")
def tool() -> ModuleType:
    spec = importlib.util.spec_from_file_location("promises", ROOT / "tools" / "promises.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_page_is_made_of_the_records(tool: ModuleType) -> None:
    assert (ROOT / "docs" / "promises.md").read_text(encoding="utf-8") == tool.page(), (
        "python tools/promises.py page"
    )


def test_every_goal_is_there_once(tool: ModuleType) -> None:
    assert [goal["id"] for goal in tool.goals()] == [f"G{n}" for n in range(1, 31)]


def test_every_check_serves_the_goal_that_names_it(tool: ModuleType) -> None:
    serves = [(goal["check"], goal["id"]) for goal in tool.goals() if "check" in goal]
    assert {name for name, _ in serves} == set(registry.NAMES)
    for name, goal in serves:
        assert goal in registry.check(name).goals


def test_every_test_that_a_goal_names_is_there(tool: ModuleType) -> None:
    for goal in tool.goals():
        for word in re.findall(r"(?:tests|tools)/\S+", goal["command"]):
            assert (ROOT / word).exists(), f"{goal['id']}: {word}"


def test_what_was_recorded_as_broken_is_told(tool: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    broken = {"goal": "G21", "cases": 100, "failures": 2, "seconds": 3.0, "date": "2026-11-22"}
    monkeypatch.setattr(tool, "records", lambda: [broken])
    assert "**2 failures**" in tool.page()
