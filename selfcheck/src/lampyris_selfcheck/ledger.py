"""Which parts are done, so that a long run can be stopped and continued.

A file of JSON lines, one for each part, written when the part is done and not before. A part counts only for
the same seed, check, code and input: what another version of the package did proves nothing about this one.
A run that is killed while it writes leaves half a line at most: that part is done again.
"""

from __future__ import annotations

import hashlib
import json
import os
import sys
from collections.abc import Iterable, Iterator
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import lampyris
from lampyris.errors import FileError
from lampyris_selfcheck.check import Ask, Check, Failure, Outcome, Part
from lampyris_selfcheck.serialize import text

_CACHES = (".pyc", ".nbi", ".nbc")
_LIBRARIES = ("numpy", "numba", "scipy")
"""Whose arithmetic results hang on."""


def versions() -> dict[str, str]:
    """Of Python (major and minor) and of the libraries that compute; ``none``: it is not there."""
    found = {"python": f"{sys.version_info.major}.{sys.version_info.minor}"}
    for name in _LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "none"
    return found


def hash_of(files: Iterable[Path], root: Path, *words: str) -> str:
    """Of the files' bytes and their names below ``root``, and of words; sixteen digits."""
    digest = hashlib.sha256("\0".join(words).encode())
    for path in sorted(files):
        digest.update(f"{path.relative_to(root).as_posix()}\0".encode())
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()[:16]


def files_of(root: Path) -> Iterator[Path]:
    """All files below a folder that are not caches."""
    for path in root.rglob("*"):
        parts = path.relative_to(root).parts
        if path.is_file() and "__pycache__" not in parts and path.suffix not in _CACHES:
            yield path


@cache
def fingerprint(root: Path = Path(lampyris.__file__).parent, checks: Path = Path(__file__).parent) -> str:
    """Of all files of both packages but caches, and of :func:`versions`.

    Some rooms are judged by one check alone (``app`` by deadline, ``report`` by flake): leaving them out for
    the others was tried, and let a ledger vouch for an engine that had changed.
    """
    said = [f"{name} {number}" for name, number in versions().items()]
    return hash_of(files_of(root), root, hash_of(files_of(checks), checks), *said)


def key(check: Check, ask: Ask, part: Part, inputs: str = "") -> str:
    """What the outcome of a part hangs on beside the code."""
    return f"{check.name} {part.kind} {part.first}+{part.cases} seed {ask.seed} {inputs}".rstrip()


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

    def done(self, key: str) -> tuple[Outcome, float] | None:
        """What came of the part with this :func:`key`, and its seconds, if an earlier run did it."""
        return self._done.get(key)

    def add(self, key: str, outcome: Outcome, seconds: float) -> None:
        """Keep what came of a part.

        Raises
        ------
        FileError : FILE_WRITE.
        """
        self._done[key] = (outcome, seconds)
        if self._path is None:
            return
        line = {"part": key, "code": fingerprint(), "seconds": round(seconds, 3), "outcome": _words(outcome)}
        append(self._path, line)


def append(path: Path, line: dict[str, Any]) -> None:
    """Put one line of JSON behind the others; it is on the disk when this returns.

    Who is killed meanwhile may leave half a line: the next one begins a line of its own, and who reads has to
    pass over the half.

    Raises
    ------
    FileError : FILE_WRITE.
    """
    try:
        with path.open("ab+") as file:
            if file.tell():
                file.seek(-1, os.SEEK_END)
                if file.read(1) != b"\n":
                    file.write(b"\n")
            file.write(f"{text(line)}\n".encode())
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        raise FileError("FILE_WRITE", error.strerror or str(error), where=str(path)) from None


_BEGINS = '{"part": '
"""Each line."""


def _lines(path: Path | None) -> Iterator[dict[str, Any]]:
    if path is None or not path.exists():
        return
    if not path.is_file():  # reading a pipe would wait for ever
        raise FileError("FILE_KIND", "it is no regular file", where=str(path), todo="name another file")
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise FileError("FILE_READ", str(error), where=str(path)) from None
    for number, line in enumerate(lines, 1):
        words = None
        try:
            words = json.loads(line)
        except ValueError:
            if line[: len(_BEGINS)] == _BEGINS[: len(line)]:
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
            {"kind": f.kind, "number": f.number, "what": f.what, "data": dict(f.data), "cases": f.cases}
            for f in outcome.failures
        ],
        "counts": dict(outcome.counts),
        "spreads": {name: list(values) for name, values in outcome.spreads.items()},
    }


def _outcome(words: dict[str, Any]) -> Outcome:
    return Outcome(
        words["cases"],
        words["failed"],
        tuple(
            Failure(f["kind"], f["number"], f["what"], f["data"], f.get("cases", 1))
            for f in words["failures"]
        ),
        words["counts"],
        {name: tuple(float(value) for value in values) for name, values in words["spreads"].items()},
    )
