"""Shuffled test runs: that a test which hangs on the order is found, and that nothing tries again."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import pytest

import lampyris
from lampyris.errors import UsageError
from lampyris_selfcheck import runner
from lampyris_selfcheck.check import Ask
from lampyris_selfcheck.checks.process import flake
from lampyris_selfcheck.runner import Range

pytestmark = pytest.mark.nightly  # minutes: it breaks the product in processes of its own

ROOT = Path(__file__).resolve().parents[2]
SOUND = """
import pytest
def test_a(): pass
@pytest.mark.parametrize("n", range(3))
def test_b(n): pass
@pytest.mark.skip(reason="always")
def test_c(): pass
"""
ON_THE_ORDER = """
seen = []
def test_a(): seen.append("a")
def test_b(): assert "a" in seen
"""


@pytest.fixture
def suite(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A checkout of its own, whose quick tests are those in ``tests``."""
    (tmp_path / "tests").mkdir()
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    monkeypatch.setattr(flake, "checkout", lambda: tmp_path)
    monkeypatch.setattr(flake, "WHAT", {"quick": ("tests",), "suite": ("tests",)})
    return tmp_path


def _holds(orders: int) -> runner.Result:
    return runner.run(flake.CHECK, Ask(), Range(only="quick", cases=orders))


def test_sound_tests_hold(suite: Path) -> None:
    (suite / "tests" / "test_one.py").write_text(SOUND)
    (suite / "tests" / "test_two.py").write_text(SOUND)
    assert _holds(2).holds


def test_a_test_that_needs_another_before_it_is_found(suite: Path) -> None:
    (suite / "tests" / "test_one.py").write_text(ON_THE_ORDER)
    result = _holds(4)
    assert result.outcome.failed
    assert "test_b" in result.outcome.failures[0].what


def test_orders_of_cases_differ(monkeypatch: pytest.MonkeyPatch) -> None:
    orders: list[int] = []
    monkeypatch.setattr(flake, "problem_of", lambda root, tests, order, *_: orders.append(order))
    assert _holds(5).holds
    assert len(set(orders)) == 5


@pytest.mark.parametrize("text", ["import nothing_of_that_name", ""])
def test_a_run_without_tests_proves_nothing(suite: Path, text: str) -> None:
    (suite / "tests" / "test_one.py").write_text(text)
    assert _holds(1).outcome.failed == 1


def test_a_hung_run_is_ended(suite: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(flake, "LONGEST", {"quick": 2.0})
    (suite / "tests" / "test_one.py").write_text("import time\ndef test_a(): time.sleep(60)")
    assert "no end" in _holds(1).outcome.failures[0].what


def test_orders_differ_and_each_is_always_the_same() -> None:
    items = [SimpleNamespace(nodeid=f"test_{f}.py::test_{k}") for f in range(5) for k in range(6)]
    orders = [[item.nodeid for item in flake.shuffled(items, number)] for number in (1, 1, 2)]
    assert orders[0] == orders[1] != orders[2]
    assert sorted(orders[0]) == sorted(orders[2]) == sorted(item.nodeid for item in items)
    files = [name.split("::")[0] for name in orders[0]]
    assert sum(a != b for a, b in pairwise(files)) == 4  # a file's tests stay together


def test_without_a_checkout_it_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    there = tmp_path / "site-packages" / "lampyris" / "__init__.py"
    monkeypatch.setattr(lampyris, "__file__", str(there))
    with pytest.raises(UsageError, match="CHECKOUT"):
        flake.checkout()


@pytest.mark.source
def test_the_quick_files_are_there() -> None:
    assert all((ROOT / name).exists() for name in flake.QUICK)


RETRY = re.compile(
    r"rerun[_-]?failures|\breruns?\b\s*=|--reruns|mark\.flaky|\bflaky\b|pytest[_-]retry|@retry"
)


@pytest.mark.source
def test_nothing_in_the_project_tries_a_test_again() -> None:
    kinds = {".py", ".toml", ".txt", ".in", ".sh", ".ini", ".cfg", ""}
    rooms = ("tests", "tools", "requirements", "benchmarks")
    paths = [path for name in rooms for path in (ROOT / name).rglob("*")]
    found = []
    for path in (*paths, ROOT / "pyproject.toml", ROOT / "Makefile"):
        if path.suffix in kinds and path.is_file() and path != Path(__file__):
            text = path.read_text(encoding="utf-8", errors="replace")
            found += [f"{path.relative_to(ROOT)}: {match[0]}" for match in RETRY.finditer(text)]
    assert found == []


def test_no_plugin_tries_again(pytestconfig: pytest.Config) -> None:
    loaded = {str(name).lower() for name, _ in pytestconfig.pluginmanager.list_name_plugin()}
    assert not [name for name in loaded if re.search(r"rerun|flaky|retry", name)]


def test_without_pytest_it_is_left_out_or_refused_with_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    found = flake.find_spec
    monkeypatch.setattr(flake, "find_spec", lambda name: None if name == "pytest" else found(name))
    with pytest.raises(UsageError, match=r"CHECKOUT.*pytest is not installed.*make test"):
        flake.checkout()
