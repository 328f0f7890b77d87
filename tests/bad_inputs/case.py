"""One case of the table of bad inputs: files to write, a command line, and what must come of it."""

from __future__ import annotations

import io
import os
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any, TypeAlias
from unittest import mock

import typer.main

from lampyris.cli import main
from lampyris.cli.app import app, plain_help
from lampyris_selfcheck.reference.files.watching import memory

Content: TypeAlias = bytes | Callable[[], bytes]
"""A file's bytes; a function where they are large, so that they are made only when asked for."""

PLAN_ENDS = ("--start", "0,0", "--goal", "0,0")
GET_COMMAND = typer.main.get_command


@dataclass(frozen=True)
class Case:
    """A command line with its files, and the answer it must have.

    Parameters
    ----------
    row : number in the table.
    name : what is wrong, in a word or two.
    words : the command line, ``lampyris`` left out; it runs in a folder that holds the files.
    files : what to write there beforehand.
    code : of the error; empty where the input is accepted.
    exit : the exit code.
    says : what the error's line must hold: file, place, value, what is allowed, what to do. For an accepted
        input, what the notes must hold.
    prints : what standard output must hold.
    cells : for an accepted map, what it must be read as: ``#`` blocked, ``.`` free, ``?`` unknown.
    silent : for an accepted input, that there is no note at all.
    setup : what else to do in the folder beforehand; only where the system has such files.
    strict : code of the error when the same map is read as a stranger's file; empty where that changes
        nothing.
    """

    row: int
    name: str
    words: tuple[str, ...]
    files: Mapping[str, Content] = field(default_factory=dict)
    code: str = ""
    exit: int = 0
    says: tuple[str, ...] = ()
    prints: tuple[str, ...] = ()
    cells: tuple[str, ...] = ()
    silent: bool = False
    setup: Callable[[Path], None] | None = None
    strict: str = ""

    @property
    def id(self) -> str:
        """The test's name."""
        return f"{self.row:03}-{self.name.replace(' ', '-')}"

    def prepare(self, folder: Path) -> None:
        """Write the files."""
        for name, content in self.files.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content() if callable(content) else content)
        if self.setup is not None:
            self.setup(folder)


def bad_map(
    row: int,
    name: str,
    file: str,
    content: Content | None,
    code: str,
    *says: str,
    exit: int = 3,
    files: Mapping[str, Content] | None = None,
    setup: Callable[[Path], None] | None = None,
) -> Case:
    """A map that must be refused, given to ``lampyris plan``."""
    written = {**(files or {}), **({} if content is None else {file: content})}
    return Case(row, name, ("plan", file, *PLAN_ENDS), written, code, exit, (file, *says), setup=setup)


def good_map(
    row: int,
    name: str,
    file: str,
    content: Content,
    cells: tuple[str, ...],
    *notes: str,
    files: Mapping[str, Content] | None = None,
    strict: str = "",
) -> Case:
    """A map that must be read as these cells, with these notes and, if none are given, without any.

    It is planned on from its first free cell to itself.
    """
    y, x = next((y, row_.index(".")) for y, row_ in enumerate(cells) if "." in row_)
    words = ("plan", file, "--start", f"{x},{y}", "--goal", f"{x},{y}")
    written = {**(files or {}), file: content}
    return Case(row, name, words, written, says=notes, cells=cells, silent=not notes, strict=strict)


@dataclass(frozen=True)
class Outcome:
    """What a run of the command line did."""

    exit: int
    out: str
    err: str
    cpu_s: float
    grown: int
    """Bytes of memory that were in use at the most, above what was before; -1 where that cannot be told."""


@cache
def tree() -> Any:
    """The tree of verbs and options. Typer makes it anew at each call, which takes five sixths of a short one."""
    plain_help()
    return GET_COMMAND(app)


def run(*words: str) -> Outcome:
    """Run the real command line's ``main`` in this process and folder."""
    # Real files: what goes wrong with standard output is repaired by its number.
    with NamedTemporaryFile("w", encoding="utf-8") as out, io.StringIO() as err:
        once = mock.patch.object(
            typer.main, "get_command", lambda asked: tree() if asked is app else GET_COMMAND(asked)
        )
        with once, mock.patch.object(sys, "argv", ["lampyris", *words]), memory() as grown:
            began = time.process_time()
            with redirect_stdout(out), redirect_stderr(err):
                try:
                    main()
                except SystemExit as done:
                    code = done.code
                else:
                    code = 0
            cpu = time.process_time() - began
        out.flush()
        code = code if isinstance(code, int) else 0 if code is None else 1
        return Outcome(code, Path(out.name).read_text(encoding="utf-8"), err.getvalue(), cpu, grown[0])


@cache
def warm() -> None:
    """Import what a first call imports, so that no case pays for it."""
    for words in (("plan", "guide", "--json"), ("plan", "guide", "--start", "x", "--goal", "0,0")):
        run(*words)


@contextmanager
def inside(folder: Path) -> Iterator[None]:
    """Work in a folder for a while."""
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


LAUNCHER = """
import json, os, resource, subprocess, sys
for line in sys.stdin:
    job = json.loads(line)
    out, err = (open(os.path.join(job["folder"], "..", name), "w+b") for name in ("out", "err"))
    limits = lambda: resource.setrlimit(resource.RLIMIT_AS, (job["address_space"],) * 2)
    child = subprocess.Popen(
        job["words"], stdout=out, stderr=err, stdin=subprocess.DEVNULL, cwd=job["folder"], preexec_fn=limits
    )
    _, status, used = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    said = []
    for stream in (out, err):
        stream.seek(0)
        said.append(stream.read().decode("utf-8", "replace"))
        stream.close()
    cpu, peak = used.ru_utime + used.ru_stime, used.ru_maxrss * 1024
    print(json.dumps([child.returncode, *said, cpu, peak]), flush=True)
"""
"""Runs commands as processes and tells what each used.

A process of its own, and a small one: the peak of a process's memory begins with that of who started it.
"""
