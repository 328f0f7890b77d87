"""What a disk holds after the power failed: all that was synced, and of the rest whatever it likes.

A file's writes are certain once it was synced, a name once its folder was. Of what came after, each write may
be there or not, whole or in sectors, in whatever order; of the names each change, too.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

import numpy as np

T = TypeVar("T")
SECTOR = 512


@dataclass
class FileChange:
    """A call of :mod:`lampyris_selfcheck.checks.studies.os_calls`, and how much was acknowledged before it."""

    op: str
    path: str
    at: int
    data: bytes
    acknowledged: int


@dataclass
class _Inode:
    """A file: what is certain of it, and what came after (place and bytes; size alone for a truncation)."""

    certain: bytearray = field(default_factory=bytearray)
    pending: list[tuple[int, bytes | None]] = field(default_factory=list)


def changes_of(record: Path) -> list[FileChange]:
    """The changes that a sitting recorded."""
    data, at, found = record.read_bytes(), 0, []
    while at < len(data):
        end = data.index(b"\n", at)
        op, path, place, size, acknowledged = json.loads(data[at:end])
        found.append(FileChange(op, path, place, data[end + 1 : end + 1 + size], acknowledged))
        at = end + size + 2
    return found


class Disk:
    """One folder on a disk that may lose its power.

    Parameters
    ----------
    rng : decides what becomes of what is not certain.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._now: dict[str, _Inode] = {}
        self._certain: dict[str, _Inode] = {}
        self._names: list[tuple[str, str, str, _Inode | None]] = []

    def do(self, change: FileChange) -> None:
        """One change more."""
        path = change.path
        if change.op == "create":
            if path in self._now:
                self._now[path].pending.append((0, None))
            else:
                self._name("create", path, "", _Inode())
        elif change.op in ("rename", "link"):
            self._name(change.op, path, change.data.decode(), self._now.get(path))
        elif change.op == "unlink":
            self._name("unlink", path, "", None)
        elif change.op == "folder":
            for one in self._names:
                _named(self._certain, one)
            self._names.clear()
        elif (inode := self._now.get(path)) is not None:
            if change.op == "sync":
                inode.certain = _written(inode.certain, inode.pending)
                inode.pending.clear()
            else:
                inode.pending.append((change.at, change.data if change.op == "write" else None))

    def _name(self, *change: str | _Inode | None) -> None:
        self._names.append(change)  # type: ignore[arg-type]
        _named(self._now, change)  # type: ignore[arg-type]

    def after_power_failed(self) -> dict[str, bytes]:
        """Names and bytes that are there when it comes back."""
        names = dict(self._certain)
        for change in self._kept(self._names):
            _named(names, change)
        return {path: bytes(self._survived(inode)) for path, inode in names.items()}

    def _survived(self, inode: _Inode) -> bytearray:
        """What is left of a file."""
        kept: list[tuple[int, bytes | None]] = []
        for at, data in self._kept(inode.pending):
            if data is None or self._rng.random() < 0.7:
                kept.append((at, data))
                continue
            # In sectors, each there or not.
            sectors = [(at + k, data[k : k + SECTOR]) for k in range(0, len(data), SECTOR)]
            kept += [one for one in sectors if self._rng.random() < 0.5]
        if len(kept) > 1 and self._rng.random() < 0.5:  # the order on the disk is not that of the calls
            lost = int(self._rng.integers(len(kept)))
            kept = kept[:lost] + kept[lost + 1 :]
        return _written(inode.certain, kept)

    def _kept(self, changes: list[T]) -> list[T]:
        """Of changes that are not certain: none, all, the first of them, or any."""
        how = int(self._rng.integers(4))
        if how < 2:
            return list(changes) if how else []
        if how == 2:
            return changes[: int(self._rng.integers(len(changes) + 1))]
        return [one for one in changes if self._rng.random() < 0.5]


def _named(names: dict[str, _Inode], change: tuple[str, str, str, _Inode | None]) -> None:
    """A change of names, as far as it can be made."""
    op, path, other, inode = change
    if op == "unlink":
        names.pop(path, None)
    elif inode is not None:
        names[other or path] = inode
        if op == "rename":
            names.pop(path, None)


def _written(data: bytearray, changes: list[tuple[int, bytes | None]]) -> bytearray:
    """Bytes after some writes and truncations."""
    made = bytearray(data)
    for at, written in changes:
        size = at if written is None else at + len(written)
        if len(made) < size:
            made.extend(bytes(size - len(made)))
        if written is None:
            del made[at:]
        else:
            made[at:size] = written
    return made
