"""Docstrings of public names: their sections, and examples that give what they say. See tools/docstrings.py."""

from __future__ import annotations

import ast
import builtins
import doctest
import inspect
import sys
from pathlib import Path
from typing import Any

import pytest

pytestmark = pytest.mark.source
QUICK = ("plan", "load_grid", "speed_profile", "Change", "Edit", "Grid", "Moves", "Path", "Scene", "Status")
"""Examples that are run at each commit; all are at night, and by `make docs`."""


@pytest.fixture
def tool(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(Path(__file__).resolve().parents[2] / "tools"))
    import docstrings

    return docstrings


def test_every_public_name_has_a_short_example(tool: Any) -> None:
    for name, found in tool.public():
        lines = (inspect.getdoc(found) or "").splitlines()
        assert "Examples" in lines, name
        assert 0 < sum(line.startswith((">>> ", "... ")) for line in lines) <= tool.LONGEST, name


def test_names_in_examples_are_known(tool: Any) -> None:
    for name, found in tool.public():
        known = set(vars(sys.modules[found.__module__])) | set(vars(builtins))
        code = "".join(
            example.source for example in doctest.DocTestParser().get_examples(inspect.getdoc(found) or "")
        )
        nodes = list(ast.walk(ast.parse(code)))
        known |= {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
        known |= {node.arg for node in nodes if isinstance(node, ast.arg)}
        known |= {
            node.name or ""
            for node in nodes
            if isinstance(node, ast.ClassDef | ast.FunctionDef | ast.ExceptHandler)
        }
        for node in nodes:
            if isinstance(node, ast.Import | ast.ImportFrom):
                known |= {(each.asname or each.name).split(".")[0] for each in node.names}
        used = {node.id for node in nodes if isinstance(node, ast.Name)}
        assert used <= known, f"{name}: {used - known}"


def test_some_examples_give_what_they_say(tool: Any) -> None:
    assert tool.failed(QUICK) == []


@pytest.mark.nightly
def test_all_examples_give_what_they_say(tool: Any) -> None:
    assert tool.failed() == []


@pytest.mark.nightly
def test_numpydoc_finds_no_fault(tool: Any) -> None:
    pytest.importorskip("numpydoc")
    assert tool.faults() == []
