"""Verbs of other packages: found, listed, run; missing or broken ones are named and hide nothing."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

GUEST = '''
"""A verb of another package."""
from typing import Annotated
import typer


def weather(seed: Annotated[int, typer.Option("--seed", help="Root of every draw.")] = 0) -> None:
    """Say the weather."""
    print(f"fair {seed}")
'''
MAIN = "from lampyris.cli import main; main()"
WITHOUT = """
import importlib.metadata as metadata
real = metadata.entry_points
metadata.entry_points = lambda **how: [e for e in real(**how) if e.name != "selfcheck"]
"""


def call(home: Path, code: str, *words: str) -> subprocess.CompletedProcess[str]:
    paths = [str(home), *sys.path]
    return subprocess.run(
        [sys.executable, "-c", code, *words],
        env=dict(os.environ, PYTHONPATH=os.pathsep.join(path for path in paths if path)),
        capture_output=True, text=True, check=False,
    )  # fmt: skip


def install(home: Path, value: str) -> None:
    (home / "guest_verbs.py").write_text(GUEST)
    info = home / "guest_verbs-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: guest-verbs\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[lampyris.verbs]\nweather = {value}\n")


def test_a_verb_of_another_package_is_listed_and_run(tmp_path: Path) -> None:
    install(tmp_path, "guest_verbs:weather")
    listed = call(tmp_path, MAIN, "--help")
    assert "Say the weather." in listed.stdout
    assert "Plan a path" in listed.stdout
    assert call(tmp_path, MAIN, "weather", "--seed", "3").stdout == "fair 3\n"
    bad = call(tmp_path, MAIN, "weather", "--seed", "x")
    assert bad.returncode == 2
    assert "--seed" in bad.stderr


@pytest.mark.nightly
def test_a_broken_verb_is_named_and_hides_no_other(tmp_path: Path) -> None:
    install(tmp_path, "guest_verbs:rain")
    listed = call(tmp_path, MAIN, "--help")
    assert listed.returncode == 0, listed.stderr
    assert "Plan a path" in listed.stdout
    assert "verb weather of the installed package guest-verbs" in listed.stderr
    asked = call(tmp_path, MAIN, "weather")
    assert asked.returncode == 3
    assert "verb weather of the installed package guest-verbs" in asked.stderr
    assert call(tmp_path, MAIN, "maps", "--help").stderr == ""


@pytest.mark.nightly
def test_a_built_in_verb_cannot_be_replaced(tmp_path: Path) -> None:
    install(tmp_path, "guest_verbs:weather")
    entry = tmp_path / "guest_verbs-1.0.dist-info" / "entry_points.txt"
    entry.write_text("[lampyris.verbs]\nplanners = guest_verbs:weather\n")
    assert (
        call(tmp_path, MAIN, "planners").stdout.startswith("ad-gso")
        or "ad-gso" in call(tmp_path, MAIN, "planners").stdout
    )


def test_selfcheck_that_is_not_installed_says_what_to_install(tmp_path: Path) -> None:
    done = call(tmp_path, WITHOUT + MAIN, "selfcheck", "grids")
    assert done.returncode == 2
    assert "pip install lampyris-selfcheck" in done.stderr
    assert "selfcheck" not in call(tmp_path, WITHOUT + MAIN, "--help").stdout
