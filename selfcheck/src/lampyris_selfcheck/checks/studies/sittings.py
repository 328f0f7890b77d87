"""Sittings over one small study, each in a process of its own, and what must be left of it afterwards."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from lampyris._core.system import can_fork
from lampyris.errors import InternalFault, UsageError
from lampyris.study.design.study_file import load_study
from lampyris.study.store.store import Store
from lampyris_selfcheck.check import Outcome, Part, Tally
from lampyris_selfcheck.checks.studies.sitting_child import digest
from lampyris_selfcheck.scratch import folder

STUDY = """\
version: 1
name: killed
kind: plan
maps:
  - {rows: ['......', '.####.', '......'], name: small, queries: {random: 2}}
  - {rows: ['....#.', '....#.', '....#.'], name: cut, queries: [{start: [0, 0], goal: [5, 2]}]}
planners: [astar, dstar-lpso]
traffic: [none, {kind: random-walk, count: 2}, {kind: random-walk, count: 17}]
seeds: 1
"""
"""18 runs in some tenths of a second: plans, no way, and too many walkers, which is refused."""
NAME, STORE, CSV = "s.yaml", "s.db", "s.csv"
COMMAND = ("study", NAME, "--store", STORE, "--workers", "1", "--csv", CSV, "--force")
CHILD = ("-m", "lampyris_selfcheck.checks.studies.sitting_child")
SECONDS = 120.0
"""For one sitting, on whatever machine."""

Case: TypeAlias = "Callable[[Bench, int], tuple[list[str], str]]"


@dataclass(frozen=True)
class SittingEnding:
    """How a sitting ended.

    Parameters
    ----------
    code : its exit code; below zero, the signal that killed it.
    late : it was still running after :data:`SECONDS`.
    errors : what it wrote on standard error.
    seconds : how long it took.
    """

    code: int
    late: bool
    errors: str
    seconds: float


class Bench:
    """Where studies are sat over; made by :func:`bench`.

    Parameters
    ----------
    at : a folder of its own.
    process : that waits warm (:mod:`lampyris_selfcheck.checks.studies.sitting_child`).
    """

    def __init__(self, at: Path, process: subprocess.Popen[str]) -> None:
        self.at, self._process = at, process
        self.place, self.log = at / "place", at / "log"
        (at / NAME).write_text(STUDY)
        self._ask([str(at / NAME), str(at / "warm.csv")])
        self.study = load_study(at / NAME)
        self.fresh()
        self.whole = self.sit()
        if self.whole.code:
            raise InternalFault("SITTING", self.whole.errors[-300:], where="an undisturbed sitting")
        self.csv = (self.place / CSV).read_bytes()

    def fresh(self) -> None:
        """Nothing but the study's file, and nothing acknowledged."""
        self.place.mkdir(exist_ok=True)
        for one in self.place.iterdir():
            one.unlink()
        (self.place / NAME).write_text(STUDY)
        self.log.unlink(missing_ok=True)

    def sit(self, **more: Any) -> SittingEnding:
        """One sitting; see :func:`lampyris_selfcheck.checks.studies.sitting_child.sitting`."""
        given = {
            "argv": COMMAND, "folder": str(self.place), "log": str(self.log), "out": str(self.at / "out"),
            "err": str(self.at / "err"), "seconds": SECONDS, **more,
        }  # fmt: skip
        came = json.loads(self._ask(given))
        return SittingEnding(came["code"], came["late"], (self.at / "err").read_text(), came["seconds"])

    def _ask(self, what: Any) -> str:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(json.dumps(what) + "\n")
        self._process.stdin.flush()
        line = self._process.stdout.readline()
        if not line:
            raise InternalFault("SITTING", "the process that sits is gone", where="selfcheck")
        return line

    # ---- what must be left --------------------

    def kept(self) -> str:
        """What is wrong with the store as it lies there; empty if every acknowledged row is in it."""
        said, twice = acknowledged(self.log)
        if twice:
            return f"{twice} rows were acknowledged twice"
        path = self.place / STORE
        if not said and not path.exists():
            return ""
        with Store.open(path, writable=False) as store:
            rows = store.rows()
        lost = [key for key in said if key not in rows]
        if lost:
            return f"{len(lost)} of {len(said)} acknowledged rows are lost"
        changed = sum(digest(rows[key]) != was for key, was in said.items())
        return f"{changed} acknowledged rows are others now" if changed else ""

    def finish(self) -> str:
        """Let the study go on to its end; what is wrong then, empty if nothing is."""
        ended = self.sit()
        if ended.code:
            return f"the last sitting ended with {ended.code}: {ended.errors[-300:]}"
        wrong = self.kept()
        if wrong:
            return wrong
        if (self.place / CSV).read_bytes() != self.csv:
            return "its table is not that of the study run at once"
        said, _ = acknowledged(self.log)
        with Store.open(self.place / STORE, writable=False) as store:
            count = len(store)
        if count != len(self.study) or len(said) > count:
            return f"{count} rows, {len(said)} acknowledged, {len(self.study)} asked for"
        left = sorted({one.name for one in self.place.iterdir()} - {NAME, STORE, CSV})
        left = [name for name in left if not name.endswith(".part")]
        return f"left beside it: {', '.join(left)}" if left else ""


def judged(part: Part, case: Case) -> Outcome:
    """Each case of a part, in one bench: ``case`` returns its properties and what is wrong, or raises."""
    tally = Tally(part)
    with bench() as one:
        for number in part.numbers:
            one.fresh()
            try:
                properties, wrong = case(one, number)
                tally.case(*properties)
            except Exception as fault:
                wrong = f"{type(fault).__name__}: {fault!s:.300}"
            if wrong:
                tally.fail(number, wrong)
    return tally.outcome()


def forks_needed() -> None:
    """Refuse to kill processes where they cannot be forked and killed in groups.

    Raises
    ------
    UsageError : SYSTEM.
    """
    if not can_fork():
        raise UsageError("SYSTEM", "this check forks and kills processes", allowed="Linux and macOS")


@contextmanager
def bench() -> Iterator[Bench]:
    """A folder, and a process that waits warm; both are gone afterwards.

    Raises
    ------
    UsageError : SYSTEM: processes cannot be forked here.
    """
    forks_needed()
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
    with folder() as at:
        process = subprocess.Popen(
            [sys.executable, *CHILD], cwd=at, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, env={**os.environ, **threads, "COLUMNS": "100"},
        )  # fmt: skip
        try:
            yield Bench(at, process)
        finally:
            process.kill()
            process.communicate()


def acknowledged(log: Path) -> tuple[dict[str, str], int]:
    """What was logged by key, and how many keys were logged more than once."""
    found: dict[str, str] = {}
    twice = 0
    for line in log.read_text().split("\n") if log.exists() else ():
        words = line.split(" ")
        if len(words) == 3 and words[2] == ".":
            twice += words[0] in found
            found[words[0]] = words[1]
    return found, twice
