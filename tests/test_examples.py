"""Every example runs, without a warning, and says something."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[1] / "examples"
EXAMPLES = sorted(FOLDER.glob("*.py"), key=lambda path: (path.name != "plan_and_simulate.py", path.name))
"""The first runs with every commit: two others take ten times as long."""

NEEDS = {"irsim_navigation.py": "irsim", "train_policy.py": "gymnasium"}
"""Packages of extras that an example imports."""


def test_there_are_examples() -> None:
    assert EXAMPLES


@pytest.mark.commit(1)
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.name)
def test_example_runs(path: Path) -> None:
    if path.name in NEEDS:
        pytest.importorskip(NEEDS[path.name])
    done = subprocess.run(
        [sys.executable, "-W", "error", str(path)], capture_output=True, text=True, check=False, timeout=120
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout
