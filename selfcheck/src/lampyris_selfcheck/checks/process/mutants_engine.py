"""One defect at a time into a copy of the package, and the check that must see it, run on the copy.

The copy's kernels run in their plain form (``NUMBA_DISABLE_JIT``), so nothing is compiled; both forms are
made of the same source.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import threading
import time
import tomllib
import weakref
from dataclasses import dataclass
from pathlib import Path
from queue import Empty, SimpleQueue
from tempfile import mkdtemp
from typing import Any

import lampyris_selfcheck
from lampyris.errors import FileError

CHECKS = Path(lampyris_selfcheck.__file__).parents[1]
"""Where the checks are imported from: those that run here judge the copies."""
SEED = "1"
"""The ranges of cases are made for this seed: a defect is not seen by every case."""
LONGEST = 120.0
"""Seconds a check may take on a sound copy; many times what any range needs."""
PATIENCE = 10.0
"""A mutated copy has so many times as long as the sound one, and some seconds more."""
MORE = 30.0
TOLD = 600
"""Characters of a child's output that are told."""
FIELDS = {
    "id": str, "file": str, "find": str, "replace": str, "why": str,
    "check": str, "kind": str, "cases": int, "first": int, "blind": bool, "equivalent": str,
}  # fmt: skip
OPTIONAL = {"first", "blind", "equivalent"}


@dataclass(frozen=True)
class Defect:
    """A mistake that a person might make in one place.

    Parameters
    ----------
    id : its name, one of a kind.
    file : of the package, relative to it.
    find, replace : text that is there exactly once, and what the mistake makes of it.
    why : what is wrong with it, in a line.
    check, kind, first, cases : the cases that must see it: enough of them and no more.
    blind : whether the referee cannot see it: every path is legal all the same.
    equivalent : why no case can ever see it; empty if one must.
    """

    id: str
    file: str
    find: str
    replace: str
    why: str
    check: str
    kind: str
    cases: int
    first: int = 0
    blind: bool = False
    equivalent: str = ""

    @property
    def judge(self) -> tuple[str, str, int, int]:
        """Which cases see it."""
        return self.check, self.kind, self.first, self.cases


def load(path: Path) -> tuple[Defect, ...]:
    """The defects of a file, in its order.

    Raises
    ------
    FileError : DEFECTS: it is not TOML, or a defect lacks a field or has one too many, or of another type.
    """
    try:
        words = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise FileError("DEFECTS", str(error), where=str(path)) from None
    return tuple(_defect(path, number, given) for number, given in enumerate(words.get("defect", ()), 1))


def _defect(path: Path, number: int, given: dict[str, Any]) -> Defect:
    where = f"{path}, defect {number}"
    wrong = [name for name, value in given.items() if not isinstance(value, FIELDS.get(name, ()))]
    lacking = sorted(FIELDS.keys() - OPTIONAL - given.keys())
    if wrong or lacking:
        said = ", ".join([*(f"{name} wrong" for name in wrong), *(f"{name} lacking" for name in lacking)])
        allowed = ", ".join(f"{name} ({kind.__name__})" for name, kind in FIELDS.items())
        raise FileError("DEFECTS", said, where=where, allowed=allowed)
    return Defect(**given)


def times_found(source: Path, defect: Defect) -> int:
    """How often the text is there that a defect replaces; 0 where there is no such file."""
    path = source / defect.file
    return path.read_text(encoding="utf-8").count(defect.find) if path.is_file() else 0


@dataclass(frozen=True)
class MutantRun:
    """What a run of a check on a copy came to.

    Parameters
    ----------
    verdict : ``holds``, ``fails`` (cases were tried and some failed), ``broken`` (the check itself did not
        run to its end: that proves nothing), ``endless``.
    said : the end of what it printed, or its first failing case.
    seconds : wall time.
    """

    verdict: str
    said: str
    seconds: float


class Tree:
    """A copy of the package in a folder of its own.

    Modules are copied, everything else is linked. What Python keeps of a module it finds by the file's date,
    so each text of a file has a date of its own.

    Parameters
    ----------
    source : the package.
    """

    def __init__(self, source: Path) -> None:
        self.root = Path(mkdtemp(prefix="lampyris-mutants-"))
        weakref.finalize(self, shutil.rmtree, self.root, ignore_errors=True)  # at the latest at exit
        self._package = self.root / source.name
        self._dates = 0
        (self.root / "empty").mkdir()
        for folder, names, files in os.walk(source):
            names[:] = sorted(set(names) - {"__pycache__"})
            there = self._package / Path(folder).relative_to(source)
            there.mkdir()
            for name in files:
                _copy(Path(folder, name), there / name)

    def run(self, defect: Defect, longest: float, *, sound: bool = False) -> MutantRun:
        """The defect's check on the copy with the defect in it; or, sound, on the copy as it is."""
        if sound:
            return self._run(defect, longest)
        path = self._package / defect.file
        text, kept = path.read_text(encoding="utf-8"), path.stat()
        self._dates += 1
        path.write_text(text.replace(defect.find, defect.replace), encoding="utf-8")
        os.utime(path, (self._dates, self._dates))
        try:
            return self._run(defect, longest)
        finally:
            path.write_text(text, encoding="utf-8")
            os.utime(path, ns=(kept.st_atime_ns, kept.st_mtime_ns))

    def _run(self, defect: Defect, longest: float) -> MutantRun:
        words = ["selfcheck", defect.check, "--only", defect.kind, "--first", str(defect.first)]
        words += ["--cases", str(defect.cases), "--seed", SEED, "--workers", "1", "--json"]
        began = time.perf_counter()
        try:
            child = subprocess.run(
                [sys.executable, "-m", self._package.name, *words],
                cwd=self.root / "empty",  # the current folder comes before PYTHONPATH
                env=self._environment(),
                stdin=subprocess.DEVNULL,
                capture_output=True,
                text=True,
                encoding="utf-8",
                errors="replace",
                timeout=longest,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return MutantRun("endless", f"no end within {longest:.0f} s", longest)
        return _judged(child, time.perf_counter() - began)

    def _environment(self) -> dict[str, str]:
        own = {k: v for k, v in os.environ.items() if k not in ("PYTHONDONTWRITEBYTECODE", "PYTHONSAFEPATH")}
        return own | {
            "PYTHONPATH": os.pathsep.join((str(self.root), str(CHECKS))),
            "PYTHONHASHSEED": "0",
            "PYTHONIOENCODING": "utf-8",
            "NUMBA_DISABLE_JIT": "1",
        }


def _copy(original: Path, path: Path) -> None:
    if original.suffix != ".py":
        try:
            path.symlink_to(original)
        except OSError:  # a system where links are not for everybody
            pass
        else:
            return
    shutil.copy2(original, path)


def _judged(child: subprocess.CompletedProcess[str], seconds: float) -> MutantRun:
    try:
        record = json.loads(child.stdout.strip().splitlines()[-1])
        cases, failures = int(record["cases"]), int(record["failures"])
        failed, unfinished = record["failed"], int(record["unfinished"])
    except (IndexError, KeyError, TypeError, ValueError):
        said = (child.stdout + child.stderr).strip()[-TOLD:]
        return MutantRun("broken", f"exit {child.returncode}: {said}", seconds)
    if child.returncode == 0 and cases and not failures:
        return MutantRun("holds", f"{cases} cases, 0 failures", seconds)
    if child.returncode and cases and failures and not unfinished:
        first = f": {failed[0]['what']}" if failed else ""
        return MutantRun("fails", f"{failures} of {cases} cases{first}"[:TOLD], seconds)
    said = f"exit {child.returncode}, {cases} cases, {failures} failures, {unfinished} parts not finished"
    return MutantRun("broken", said, seconds)


class MutationEngine:
    """Judges defects, several at a time if asked; what a sound copy comes to is found once for each range.

    Parameters
    ----------
    source : the package.
    """

    def __init__(self, source: Path) -> None:
        self._source = source
        self._trees: SimpleQueue[Tree] = SimpleQueue()
        self._sound: dict[tuple[str, str, int, int], MutantRun] = {}
        self._locks: dict[tuple[str, str, int, int], threading.Lock] = {}
        self._lock = threading.Lock()

    def judge(self, defect: Defect) -> tuple[str, MutantRun]:
        """What became of a defect: ``killed``, ``survived``, or why that cannot be told.

        The others: ``misplaced`` (its text is not there exactly once), ``unsound`` (the check fails, or does
        not run, without it), ``broken``, ``endless``; see :class:`MutantRun`.
        """
        times = times_found(self._source, defect)
        if times != 1:
            return "misplaced", MutantRun("", f"its text is {times} times in {defect.file}", 0.0)
        if defect.find == defect.replace:
            return "misplaced", MutantRun("", "it replaces a text by itself", 0.0)
        tree = self._tree()
        try:
            sound = self._on_sound(tree, defect)
            if sound.verdict != "holds":
                return "unsound", sound
            seen = tree.run(defect, PATIENCE * sound.seconds + MORE)
        finally:
            self._trees.put(tree)
        return {"fails": "killed", "holds": "survived"}.get(seen.verdict, seen.verdict), seen

    def _tree(self) -> Tree:
        try:
            return self._trees.get_nowait()
        except Empty:
            return Tree(self._source)

    def _on_sound(self, tree: Tree, defect: Defect) -> MutantRun:
        with self._lock:
            lock = self._locks.setdefault(defect.judge, threading.Lock())
        with lock:
            if defect.judge not in self._sound:
                self._sound[defect.judge] = tree.run(defect, LONGEST, sound=True)
            return self._sound[defect.judge]
