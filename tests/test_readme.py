"""The README says what the program prints: its examples are run, and compared line by line."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest

from bad_inputs.case import inside, run

README = (Path(__file__).resolve().parents[1] / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```text\n(.*?)```", README, re.DOTALL)
BUNDLED = {"env-1", "env-3", "guide"}
LONG = {"compare", "study", "reproduce", "selfcheck", "app", "warm"}


def commands() -> list[str]:
    """Every command of the README that needs no file of the reader's, without what makes a film."""
    lines = re.findall(r"^    lampyris (.*)$|`lampyris ([^`]*--[^`]*)`", README, re.MULTILINE)
    said = [(a or b).partition("#")[0].split(" ...")[0].strip() for a, b in lines]
    words = [shlex.split(re.sub(r" --film \S+", "", one)) for one in said]
    return [
        shlex.join(one)
        for one in words
        if one[0] not in LONG and (one[1:2] == [] or one[1] in BUNDLED or one[1:] == ["run.yaml"])
    ]


COMMANDS = list(dict.fromkeys(commands()))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """One folder for all commands: a later one reads what an earlier one wrote."""
    where = tmp_path_factory.mktemp("readme")
    with inside(where):
        yield where


def test_there_are_commands() -> None:
    assert len(COMMANDS) > 15
    assert {one.split()[0] for one in COMMANDS} >= {"plan", "simulate", "run", "speed", "drive", "maps"}
    assert len(BLOCKS) == 2


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_of_the_readme_does_its_work(command: str, folder: Path) -> None:
    words = shlex.split(command)
    options = ("--picture", "--csv", "--chart", "--save-scenario")
    written = [folder / after for option, after in pairwise(words) if option in options]
    for path in written:
        path.unlink(missing_ok=True)  # two commands write env-1.png
    done = run(*words)
    assert done.exit == 0, done.err
    assert done.out
    assert all(path.stat().st_size > 100 for path in written)


@pytest.mark.parametrize(
    ("block", "words"),
    [
        (0, ("plan", "env-1")),
        (1, ("speed", "env-3", "--resolution", "0.25", "--radius", "0.15", "--smooth", "taut", "--explain")),
    ],
    ids=["plan", "speed"],
)
def test_what_the_readme_shows_is_what_is_printed(
    block: int, words: tuple[str, ...], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    # A terminal is shown columns; what is not one gets `name: value`.
    printed = [" ".join(line.replace(": ", " ", 1).split()) for line in run(*words).out.splitlines()]
    shown = [" ".join(line.replace(": ", " ", 1).split()) for line in BLOCKS[block].splitlines()]
    assert shown
    assert [line for line in shown if line != "..." and line not in printed] == []


def test_the_error_that_the_readme_shows_is_printed(folder: Path) -> None:
    (shown,) = re.findall(r"`(error\[MAP_TRUNCATED\][^`]*)`", README)
    (folder / "arena.map").write_text("type octile\nheight 3\nwidth 4\nmap\n....\n..\n....\n")
    done = run("plan", "arena.map")
    assert (done.exit, done.err.strip()) == (3, shown)


def test_the_python_of_the_readme_runs(capsys: pytest.CaptureFixture[str]) -> None:
    (block,) = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    exec(compile(block, "README.md", "exec"), {})
    assert capsys.readouterr().out.startswith("found ")
