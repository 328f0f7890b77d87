"""The page for beginners: its commands run, and what it shows is what is printed."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from bad_inputs.case import inside, run
from test_readme import commands, do, missing

PAGE = Path(__file__).resolve().parents[1] / "docs" / "getting_started.md"
pytestmark = pytest.mark.source


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """One folder for all commands: a later one reads what an earlier one wrote."""
    where = tmp_path_factory.mktemp("getting_started")
    with inside(where):
        yield where


def text() -> str:
    return PAGE.read_text(encoding="utf-8")


@pytest.mark.nightly
def test_every_command_does_its_work(folder: Path) -> None:
    found = commands(text())
    assert len(found) > 10
    for line in re.findall(r"^    (printf .* > robot\.yaml)$", text(), re.MULTILINE):
        subprocess.run(["sh", "-c", line], cwd=folder, check=True)
    for command in found:
        do(command, folder)


def test_the_causes_are_those_that_are_printed(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    (block,) = re.findall(r"```text\n(.*?)```", text(), re.DOTALL)
    words = (
        "speed",
        "env-3",
        "--resolution",
        "0.25",
        "--radius",
        "0.15",
        "--smooth",
        "straight",
        "--explain",
    )
    assert missing(block, run(*words).out) == []


def test_the_error_that_is_quoted_is_printed(folder: Path) -> None:
    (shown,) = re.findall(r"`(error\[MAP_TRUNCATED\][^`]*)`", text())
    (folder / "arena.map").write_text("type octile\nheight 3\nwidth 4\nmap\n....\n..\n....\n")
    done = run("plan", "arena.map")
    assert (done.exit, done.err.strip()) == (3, shown)
