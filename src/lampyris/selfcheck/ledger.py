"""Which parts are done, so that a long run can be stopped and gone on with.

A file of JSON lines, one for each part, written when the part is done and not before. A part counts only for
the same seed, check and code: what another version of the package did proves nothing about this one.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import lampyris
from lampyris.errors import FileError
from lampyris.selfcheck.check import Ask, Check, Failure, Outcome, Part

_NOT_JUDGED = ("app", "cli", "report", "reproduce")
"""Rooms whose files no check's verdict hangs on."""


@cache
def fingerprint() -> str:
    """Of all files of the package whose code the checks judge or are made of; sixteen digits."""
    root = Path(lampyris.__file__).parent
    digest = hashlib.sha256()
    for path in sorted(root.rglob("*.py")):
        name = path.relative_to(root)
        if name.parts[0] not in _NOT_JUDGED:
            digest.update(f"{name.as_posix()}\0".encode() + path.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


class Ledger:
    """The parts that are done, in memory and in a file.

    Parameters
    ----------
    path : the file; None keeps nothing.
    """

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self._done: dict[str, tuple[Outcome, float]] = {}
        for line in _lines(path):
            if line["code"] == fingerprint():
                self._done[line["part"]] = (_outcome(line["outcome"]), float(line["seconds"]))

    def done(self, check: Check, ask: Ask, part: Part) -> tuple[Outcome, float] | None:
        """What came of the part, and its seconds, if an earlier run did it."""
        return self._done.get(_key(check, ask, part))

    def add(self, check: Check, ask: Ask, part: Part, outcome: Outcome, seconds: float) -> None:
        """Keep what came of a part.

        Raises
        ------
        FileError : FILE_WRITE.
        """
        key = _key(check, ask, part)
        self._done[key] = (outcome, seconds)
        if self._path is None:
            return
        line = {"part": key, "code": fingerprint(), "seconds": round(seconds, 3), "outcome": _words(outcome)}
        append(self._path, line)


def append(path: Path, line: dict[str, Any]) -> None:
    """Put one line of JSON behind the others, whole or not at all, and on the disk.

    Raises
    ------
    FileError : FILE_WRITE.
    """
    text = json.dumps(line, separators=(", ", ": "), allow_nan=False)
    try:
        with path.open("ab+") as file:
            if file.tell():
                file.seek(-1, os.SEEK_END)
                if file.read(1) != b"\n":  # a run that was killed while it wrote
                    file.write(b"\n")
            file.write(f"{text}\n".encode())
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        raise FileError("FILE_WRITE", error.strerror or str(error), where=str(path)) from None


def _key(check: Check, ask: Ask, part: Part) -> str:
    folder = f" {ask.folder.resolve()}" if ask.folder else ""
    return f"{check.name} {part.kind} {part.first}+{part.cases} seed {ask.seed}{folder}"


def _lines(path: Path | None) -> Iterator[dict[str, Any]]:
    if path is None or not path.exists():
        return
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise FileError("FILE_READ", str(error), where=str(path)) from None
    for number, line in enumerate(text.splitlines(), 1):
        try:
            words = json.loads(line)
        except ValueError:
            continue  # half a line: that part is done again
        if not isinstance(words, dict) or {"part", "code", "seconds", "outcome"} - words.keys():
            raise FileError(
                "LEDGER",
                f"line {number} is no part of a selfcheck",
                where=str(path),
                todo="name another file",
            )
        yield words


def _words(outcome: Outcome) -> dict[str, Any]:
    return {
        "cases": outcome.cases,
        "failed": outcome.failed,
        "failures": [
            {"kind": f.kind, "number": f.number, "what": f.what, "data": dict(f.data)}
            for f in outcome.failures
        ],
        "counts": dict(outcome.counts),
        "spreads": {name: list(values) for name, values in outcome.spreads.items()},
    }


def _outcome(words: dict[str, Any]) -> Outcome:
    return Outcome(
        words["cases"],
        words["failed"],
        tuple(Failure(f["kind"], f["number"], f["what"], f["data"]) for f in words["failures"]),
        words["counts"],
        {name: tuple(values) for name, values in words["spreads"].items()},
    )
