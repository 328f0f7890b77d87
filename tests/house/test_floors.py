"""The lowest versions that pyproject.toml allows: one for each dependency on each Python, tried by a tool."""

from __future__ import annotations

import importlib.util
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[2]
pytestmark = pytest.mark.source


@pytest.fixture(scope="module")
def tool() -> ModuleType:
    spec = importlib.util.spec_from_file_location("check_floors", ROOT / "tools" / "check_floors.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def numbers(version: str) -> tuple[int, ...]:
    return tuple(int(part) for part in version.split("."))


def test_every_dependency_has_one_floor_on_every_python(tool: ModuleType) -> None:
    to_run, to_build = tool.project()
    for version in tool.PYTHONS:
        found = tool.floors(to_run, version)
        assert {"numpy", "numba", "pyyaml", "typer", "pydantic"} <= set(found)
        assert set(tool.floors(to_build, version)) == {"hatchling"}


def test_the_pinned_versions_are_not_below_the_floors(tool: ModuleType) -> None:
    pins = tool.pins()
    for name, low in tool.floors(tool.project()[0], "3.11").items():
        assert numbers(pins[name]) >= numbers(low), name


@pytest.mark.parametrize(
    ("name", "python", "least", "why"),
    [
        ("typer", "3.11", "0.20", "with earlier ones `study` is an exit 6"),
        ("pyyaml", "3.12", "6.0.1", "6.0 has no wheel for it, and does not build"),
        ("pyyaml", "3.13", "6.0.2", "6.0.1 has no wheel for it"),
        ("numba", "3.13", "0.61", "0.60 has no wheel for it"),
        ("numpy", "3.13", "2.1", "2.0 has no wheel for it"),
        ("scipy", "3.13", "1.14.1", "1.14.0 has no wheel for it"),
        ("matplotlib", "3.13", "3.9.2", "3.9.1 has no wheel for it"),
        ("numba", "3.14", "0.63", "0.62 has no wheel for it"),
        ("numpy", "3.14", "2.3.2", "2.3.1 has no wheel for it"),
        ("scipy", "3.14", "1.16.1", "1.16.0 has no wheel for it"),
        ("matplotlib", "3.14", "3.10.5", "3.10.3 has no wheel for it"),
        ("joblib", "3.14", "1.5", "with earlier ones no worker starts"),
        ("pillow", "3.14", "11.3", "11.0 has no wheel for it"),
        ("pyyaml", "3.14", "6.0.3", "6.0.2 has no wheel for it"),
        ("pydantic", "3.14", "2.12", "the pydantic-core of 2.9 has no wheel for it"),
    ],
)
def test_floors_that_do_not_work_are_not_allowed(
    tool: ModuleType, name: str, python: str, least: str, why: str
) -> None:
    assert numbers(tool.floors(tool.project()[0], python)[name]) >= numbers(least), why


@pytest.mark.parametrize(
    "lines",
    [
        ["numpy"],
        ["numpy<3"],
        ["numpy>=1; python_version < '3.12'"],
        ["numpy>=1", "numpy>=2; python_version >= '3.12'"],
    ],
)
def test_a_dependency_without_one_floor_is_refused(tool: ModuleType, lines: list[str]) -> None:
    with pytest.raises(ValueError, match=r"numpy.*3\.12|3\.12.*numpy"):
        tool.floors(lines, "3.12")
    assert tool.floors(["a>=1.5,<2; python_version < '3.12'", "a>=2; python_version >= '3.12'"], "3.12") == {
        "a": "2"
    }


def test_the_floors_are_tried_with_every_nightly_check() -> None:
    lines = (
        (ROOT / "Makefile").read_text(encoding="utf-8").partition("\ncheck-nightly:")[2].partition("\n\n")[0]
    )
    assert "tools/check_floors.py" in lines


def test_pyarrow_is_tried_at_its_floor(tool: ModuleType) -> None:
    """Its later releases need NumPy 2 and do not say so: the suite at the floors of 3.11 failed with them."""
    asked = {
        version: [one for one in tool.suite_tools(version) if "pyarrow" in one] for version in tool.PYTHONS
    }
    assert asked == {
        "3.11": ["pyarrow==16"],
        "3.12": ["pyarrow==16"],
        "3.13": ["pyarrow==18"],
        "3.14": ["pyarrow==22"],
    }


@pytest.mark.nightly
def test_the_suite_is_collected_beside_a_wheel(tmp_path: Path) -> None:
    """`make test-wheel` and the suite at the floors run from a copy of tests/ alone."""
    for folder in ("tests", "examples"):
        shutil.copytree(ROOT / folder, tmp_path / folder, ignore=shutil.ignore_patterns("__pycache__"))
    for file in ("pyproject.toml", "README.md"):
        shutil.copy2(ROOT / file, tmp_path / file)
    command = [sys.executable, "-m", "pytest", "-q", "--collect-only", "-m", "not nightly and not source"]
    done = subprocess.run(
        [*command, "-p", "no:cacheprovider"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout[-2000:]
