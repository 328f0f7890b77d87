"""The README says what the program prints: its examples are run, and compared line by line."""

from __future__ import annotations

import re
import shlex
import tomllib
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest

import lampyris
from bad_inputs.case import inside, run

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
BUNDLED = {"env-1", "env-3", "env-6", "guide"}
NO_FILE = {"planners", "laws", "maps"}
NAMED = ["maps make", "maps convert", "maps segment"]  # named in a sentence, without their arguments
LONG = {"compare", "study", "reproduce", "selfcheck", "app", "warm"}
MAX_LINES = 150


def commands(text: str) -> list[str]:
    """Every command of a page that needs no file of the reader's, without what makes a film."""
    lines = re.findall(r"^    lampyris (.*)$|`lampyris ([^`]*)`", text, re.MULTILINE)
    shown = [(a or b).partition("#")[0].split(" ...")[0].strip() for a, b in lines]
    words = [shlex.split(re.sub(r" --film \S+", "", one)) for one in shown if one and "COMMAND" not in one]
    found = [
        shlex.join(one)
        for one in words
        if one[0] not in LONG
        and "FILE" not in one
        and (one[0] in NO_FILE or one[1:] == ["run.yaml"] or BUNDLED & set(one[1:2]))
    ]
    return [one for one in dict.fromkeys(found) if one not in NAMED]


def do(command: str, folder: Path) -> None:
    """Run a command of a page; what it writes must be there afterwards."""
    words = shlex.split(command)
    options = ("--picture", "--csv", "--chart", "--save-scenario")
    written = [folder / after for option, after in pairwise(words) if option in options]
    for path in written:
        path.unlink(missing_ok=True)  # two commands may write the same file
    done = run(*words)
    assert done.exit == 0, done.err
    assert done.out
    assert all(path.stat().st_size > 100 for path in written)


def columns(text: str) -> list[str]:
    """Lines without the width of their columns: a terminal shows columns, anything else `name: value`."""
    return [" ".join(line.replace(": ", " ", 1).split()) for line in text.splitlines()]


def missing(shown: str, printed: str) -> list[str]:
    """The lines of a block that the program does not print; `...` stands for left-out lines."""
    there = columns(printed)
    assert columns(shown)
    return [line for line in columns(shown) if line != "..." and line not in there]


COMMANDS = commands(README)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """One folder for all commands: a later one reads what an earlier one wrote."""
    where = tmp_path_factory.mktemp("readme")
    robot, name = re.findall(r"^    printf '(.*)' > (\S+)$", README, re.MULTILINE)[0]
    (where / name).write_text(robot.replace("\\n", "\n"), encoding="utf-8")
    with inside(where):
        yield where


def test_it_is_short() -> None:
    assert len(README.splitlines()) <= MAX_LINES


def test_there_are_commands() -> None:
    assert len(COMMANDS) > 10
    assert {one.split()[0] for one in COMMANDS} >= {"plan", "simulate", "run", "speed", "drive", "maps"}


def test_every_command_is_in_the_table() -> None:
    table = re.findall(r"^\| [^|]+ \| `([a-z]+)` \| `lampyris", README, re.MULTILINE)
    verbs = re.findall(r"^  ([a-z]+) ", run("--help").out.partition("Commands:")[2], re.MULTILINE)
    assert len(verbs) > 10
    # `schema` is for machines (docs/scenarios.md); the checks may not be installed.
    assert {*table} - {"selfcheck"} == {*verbs} - {"schema", "selfcheck"}


@pytest.mark.parametrize(
    "command", [pytest.param(one, marks=pytest.mark.nightly if "--robot" in one else ()) for one in COMMANDS]
)
def test_a_command_of_the_readme_does_its_work(command: str, folder: Path) -> None:
    do(command, folder)


def test_what_the_readme_shows_is_what_is_printed(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    (block,) = re.findall(r"```text\n(.*?)```", README, re.DOTALL)
    assert missing(block, run("plan", "env-1").out) == []


def test_the_python_of_the_readme_runs(capsys: pytest.CaptureFixture[str]) -> None:
    (block,) = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    exec(compile(block, "README.md", "exec"), {})
    assert capsys.readouterr().out.startswith("found ")


def test_one_sentence_says_what_it_is() -> None:
    """The package's summary, its docstring and the first line of ``--help`` are the same sentence."""
    about = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["description"]
    assert (lampyris.__doc__ or "").partition("\n")[0] == about
    assert about in " ".join(run("--help").out.split())
