"""Commands of README and docs: the program takes each; at night those of each page are run, one after the other."""

from __future__ import annotations

import itertools
import re
import shlex
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import pytest
import typer

from bad_inputs.case import inside, run
from lampyris.cli.app import app

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / "README.md", ROOT / "site" / "index.md", *sorted((ROOT / "docs").rglob("*.md"))]
RUN_ELSEWHERE = {"README.md", "docs/getting_started.md"}
"""Pages whose commands tests of their own run; test_docs_tutorials.py runs the fenced blocks."""
NOT_RUN = {
    "lampyris app": "it ends when it is told to",
    "lampyris ros": "it ends when it is told to, and needs a robot's topics",
    "lampyris study first.yaml --dask": "the address of a cluster",
    "lampyris study repair": "a damaged store",
    "lampyris study movingai --data FOLDER": "files of the reader's",
    "lampyris study dissertation": "minutes",
    "lampyris study unknown-maps": "minutes",
    "lampyris study fleets.yaml": "minutes; the file is tested by test_docs_studies.py",
    "lampyris study export": "an extra (--parquet)",
    "lampyris warm": "minutes; tested by test_warming.py",
    "lampyris reproduce": "minutes; `make check-nightly` runs it",
    "lampyris selfcheck": "hours; `make check-nightly` runs the checks",
    "lampyris tune": "an extra, and a study file of the reader's",
    "lampyris fleet den312d.map": "files of Moving AI Lab",
    "lampyris fleet random-64-64-10.map": "files of Moving AI Lab",
    "lampyris fleet floor.png --agents robots.yaml": "files of the reader's",
    "lampyris fleet floor.png --robots 20 --lifelong 500 --tasks": "files of the reader's",
    "lampyris plan floor.yaml --keepout mask.yaml": "a mask of the reader's",
    "lampyris simulate env-1 --planner sipp --goal-track": "a track of the reader's",
    "lampyris simulate env-1 --planner dstar-lite --goal-track": "a track of the reader's",
    "lampyris drive env-3 --obstacles 5 --bag": "an extra",
    "lampyris bag": "an extra",
}
"""Commands that are not run, by how they begin, and why."""
OMITTED = {"study": "run", "maps": "show"}
"""Verbs of verbs, and the one that may be omitted."""
WRITES = {"--picture", "--chart", "--film", "--csv", "-o", "--replay", "--report"}
PLACEHOLDER = re.compile(r"\[[A-Z-]")
"""What may be given is in brackets."""

pytestmark = pytest.mark.source


def printed(page: Path) -> list[str]:
    """The command lines of a page that stand by themselves, without comments."""
    text = re.sub(r"\\\n\s*", " ", page.read_text(encoding="utf-8"))
    fenced = "\n".join(re.findall(r"^```bash\n(.*?)^```$", text, re.MULTILINE | re.DOTALL))
    lines = re.findall(r"^    (?:\$ )?(lampyris .*)$", text, re.MULTILINE) + re.findall(
        r"^(lampyris .*)$", fenced, re.MULTILINE
    )
    return [re.split(r"\s+#\s", line)[0].strip() for line in lines]


def shown(page: Path) -> list[str]:
    """The commands under the pictures of a page and, of README, in the last column of its table of tasks."""
    text = page.read_text(encoding="utf-8")
    parts = re.findall(r"<sub>(.*?)</sub>", text, re.MULTILINE | re.DOTALL)
    if page.name == "README.md":
        parts += re.findall(r"^\| [^|]+ \| `[a-z]+` \| ([^|]+) \|$", text, re.MULTILINE)
    return [line for part in parts for line in re.findall(r"`(lampyris [^`]+)`", part)]


def words(line: str) -> list[str]:
    """Arguments of a command line, up to where the shell ends it."""
    found = shlex.split(line)[1:]
    return found[: next((k for k, word in enumerate(found) if word in {"|", ">", "&&", ";"}), None)]


def parse(command: Any, given: list[str], above: Any) -> None:
    """Have click read arguments, down to the verb's own, without running it.

    Raises
    ------
    click.UsageError : it would refuse them.
    """
    while hasattr(command, "get_command") and given and not given[0].startswith("-"):
        inner = command.get_command(above, given[0])
        if inner is None and command.name in OMITTED:
            word = OMITTED[command.name]
            inner, given = command.get_command(above, word), [word, *given]
        if inner is None:
            raise click.UsageError(f"no command {given[0]}")
        command, given = inner, given[1:]
    command.make_context(command.name or "lampyris", list(given), parent=above)


def lines() -> Iterator[tuple[str, str]]:
    for page in PAGES:
        yield from ((str(page.relative_to(ROOT)), line) for line in printed(page))


def test_the_program_takes_every_command_of_the_docs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("robot.yaml", "car.yaml"):
        Path(name).write_text("radius: 0.2\n", encoding="utf-8")
    root = typer.main.get_command(app)
    above = root.make_context("lampyris", [], resilient_parsing=True)
    refused, read = [], 0
    below = [(str(page.relative_to(ROOT)), line) for page in PAGES for line in shown(page)]
    assert len([page for page, _ in below if page == "README.md"]) > 20
    assert len({page for page, _ in below}) > 5
    for page, line in [*lines(), *below]:
        if PLACEHOLDER.search(line):
            continue
        try:
            read += 1
            parse(root, words(line), above)
        except Exception as ended:
            # Typer brings its own click, or uses the other one.
            if type(ended).__name__ != "Exit":  # --help
                refused.append(f"{page}: {line}: {ended}")
    assert refused == []
    assert read > 150
    with pytest.raises(Exception, match="no-such-option"):
        parse(root, ["plan", "env-1", "--no-such-option"], above)


def test_reasons_name_commands_of_the_docs() -> None:
    there = [line for _, line in lines()]
    assert [start for start in NOT_RUN if not any(line.startswith(start) for line in there)] == []


@pytest.mark.nightly
@pytest.mark.parametrize(
    "page",
    [
        page
        for page in PAGES
        if page.exists()  # beside a wheel there are no pages
        and re.search(r"^    lampyris ", page.read_text(encoding="utf-8"), re.MULTILINE)
        and str(page.relative_to(ROOT)) not in RUN_ELSEWHERE
    ],
    ids=lambda page: page.stem,
)
def test_the_commands_of_a_page_run(page: Path, tmp_path: Path) -> None:
    text = page.read_text(encoding="utf-8")
    if page.stem == "steering":
        # Its robot is that of the other page.
        text += "".join((ROOT / "docs/poses.md").read_text(encoding="utf-8").partition("`car.yaml`:")[1:])
    for name in ("floor.jpg", "photo.jpg"):
        shutil.copy(ROOT / "docs/img/photo.jpg", tmp_path / name)
    for name, block in re.findall(
        r"^(?:[^\n]*`([\w.]+)`:\n\n)?```yaml\n(.*?)^```$", text, re.MULTILINE | re.DOTALL
    ):
        named = name or "".join(re.findall(r"\A# (\S+\.yaml)", block))
        if named:
            (tmp_path / named).write_text(block, encoding="utf-8")
    failed = []
    with inside(tmp_path):
        if "maps convert" not in text:
            run("maps", "convert", "env-6", "floor.yaml", "--resolution", "0.5")
        for line in printed(page):
            if any(line.startswith(start) for start in NOT_RUN):
                continue
            done = run(*words(line))
            if done.exit:
                failed.append(f"{line}: exit {done.exit}: {done.err[-200:]}")
            asked = shlex.split(line)
            failed += [
                f"{line}: {name} was not written"
                for option, name in itertools.pairwise(asked)
                if option in WRITES and not (tmp_path / name).exists()
            ]
    assert failed == []
