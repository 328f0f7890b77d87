"""Tests that read what no wheel holds carry the mark `source`: `make test-wheel` fails without it."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

TESTS = Path(__file__).resolve().parents[1]
# Beside the repository's root, and not copied by `make test-wheel`.
NOT_IN_A_WHEEL = {"docs", "tools", "benchmarks", "requirements", "src", "Makefile", ".ci"}
NOT_IN_A_WHEEL |= {"CHANGELOG.md", "CONTRIBUTING.md"}


def _reads_the_checkout(node: ast.AST) -> bool:
    """Whether it has an expression such as ``ROOT / "docs"`` (``tmp_path / "docs"`` does not count)."""
    for part in ast.walk(node):
        if not isinstance(part, ast.BinOp) or not isinstance(part.op, ast.Div):
            continue
        left, right = part.left, part.right
        if not (isinstance(right, ast.Constant) and str(right.value).partition("/")[0] in NOT_IN_A_WHEEL):
            continue
        if (isinstance(left, ast.Name) and left.id == "ROOT") or "parents" in ast.dump(left):
            return True
    return False


def _names(node: ast.AST) -> set[str]:
    return {part.id for part in ast.walk(node) if isinstance(part, ast.Name)} | {
        part.arg for part in ast.walk(node) if isinstance(part, ast.arg)
    }


def _marked(node: ast.AST) -> bool:
    return "'source'" in ast.dump(node)


def unmarked(text: str) -> list[str]:
    """The tests of a module that need the checkout, directly or by what they name, and have no mark."""
    module = ast.parse(text)
    if any(
        isinstance(one, ast.Assign) and "pytestmark" in _names(one) and _marked(one) for one in module.body
    ):
        return []
    holds: dict[str, ast.AST] = {}
    for one in module.body:
        if isinstance(one, ast.FunctionDef):
            holds[one.name] = one
        elif isinstance(one, ast.Assign | ast.AnnAssign) and one.value is not None:
            targets = one.targets if isinstance(one, ast.Assign) else [one.target]
            holds |= {name: one.value for target in targets for name in _names(target)}
    needs = {name for name, node in holds.items() if _reads_the_checkout(node)}
    while more := {name for name, node in holds.items() if name not in needs and needs & _names(node)}:
        needs |= more
    tests = (node for name, node in holds.items() if name.startswith("test_") and name in needs)
    return [
        node.name
        for node in tests
        if isinstance(node, ast.FunctionDef) and not any(_marked(mark) for mark in node.decorator_list)
    ]


@pytest.mark.nightly
@pytest.mark.parametrize("path", sorted(TESTS.rglob("test_*.py")), ids=lambda path: path.name)
def test_tests_that_need_the_checkout_say_so(path: Path) -> None:
    assert not unmarked(path.read_text(encoding="utf-8"))


BARE = """
ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "app.md"

def words():
    return PAGE.read_text()

{mark}
def test_it():
    assert words()

def test_other(tmp_path):
    assert (tmp_path / "docs").is_dir()
"""


def test_a_missing_mark_is_seen() -> None:
    assert unmarked(BARE.format(mark="")) == ["test_it"]
    assert not unmarked(BARE.format(mark="@pytest.mark.source"))
    assert not unmarked("pytestmark = pytest.mark.source\n" + BARE.format(mark=""))
