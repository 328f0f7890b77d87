"""Repair: a new store with every run of a damaged one that SQLite can read; the damaged one is kept."""

from __future__ import annotations

import os
import sqlite3
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lampyris._core.system import sync_folder
from lampyris.errors import FileError, LampyrisError
from lampyris.study.design.serialize import differing, study_plain
from lampyris.study.design.study import Study, canonical
from lampyris.study.store.file import (
    RUNS,
    check_folder,
    copy,
    log_size,
    look,
    maps_of,
    plain_of,
    real,
    sidecar,
    snapshot,
    typed_errors,
    write_new,
)
from lampyris.study.store.lock import StoreLock
from lampyris.study.store.row_record import unpacked
from lampyris.study.store.store import Store, packed_maps

KEPT = ".damaged"
_NAMED = 5
"""Runs that a note names; the others are counted."""


@dataclass(frozen=True, slots=True)
class Repaired:
    """The outcome of a repair.

    Parameters
    ----------
    kept : runs that are in the new store.
    lost : runs that were stored and cannot be read, or are not as they were written; as far as it is known.
    notes : what else there is to report, a sentence each.
    lost_runs : the keys of the lost runs.
    """

    kept: int
    lost: int
    notes: tuple[str, ...] = ()
    lost_runs: tuple[str, ...] = ()


def repair(
    path: str | os.PathLike[str], out: str | os.PathLike[str] | None = None, *, study: Study | None = None
) -> Repaired:
    """Write a new store with all that can be read of a damaged one; running the study again adds the rest.

    Parameters
    ----------
    path : of the damaged store.
    out : where the new one goes; None: in its place, and the damaged one is kept beside it, its name followed
        by ``.damaged``.
    study : needed when the study in the store, or a map of it, is damaged itself.

    Raises
    ------
    FileError : STORE_READ: no such file; STORE_FORMAT: no store; STORE_VERSION; STORE_DAMAGED: SQLite can
        read nothing of it; STORE_EXISTS: something is at ``out``; STORE_BUSY; STORE_WRITE; STORE_STUDY: the
        study is damaged and none was given, or that one is another.
    """
    place = real(path)
    target = place if out is None else real(out)
    look(place)
    check_folder(target)
    with typed_errors(target, "write"), ExitStack() as locks:
        if out is not None and target.exists():
            raise FileError("STORE_EXISTS", "the file exists", where=str(target))
        try:
            locks.enter_context(StoreLock(place))
        except FileError as fault:
            if target == place or fault.code != "STORE_WRITE":
                raise  # else the folder is read-only: a snapshot is read, and nothing is written there
        sound = _count_if_sound(place)
        if out is None and sound is not None:
            return Repaired(sound, 0, ("nothing is damaged; nothing was changed",))
        with snapshot(place, recover=True) as connection:
            runs, lost, notes = _salvaged(connection)
            text, maps = _study(connection, place, study)
        if study is not None:
            jobs = {job.key for job in study.jobs()}
            others = [key for key in runs if key not in jobs]
            for key in others:
                del runs[key]
            if others:
                notes += (f"{len(others):,} runs are not of the study that was given; they were left out",)
        kept: list[Path] = []
        if target != place:
            locks.enter_context(StoreLock(target))
        before = None if target != place else lambda: kept.append(_set_aside(place))
        write_new(target, text, maps, runs.values(), before=before)
    notes += tuple(f"the damaged store is kept as {one.name}" for one in kept)
    return Repaired(len(runs), len(lost), notes, lost)


def _count_if_sound(place: Path) -> int | None:
    """The number of runs if nothing is damaged."""
    try:
        with Store.open(place, writable=False) as store:
            return store.verify()
    except LampyrisError:
        return None


def _salvaged(
    connection: sqlite3.Connection,
) -> tuple[dict[str, tuple[str, ...]], tuple[str, ...], tuple[str, ...]]:
    """Records of all runs whose checksums are right, by key; the runs that are lost; notes on them.

    The table is read from both ends up to what is damaged, and what lies between is asked for run by run by
    the numbers in the index, which also names the runs that cannot be read.
    """
    connection.text_factory = lambda raw: raw.decode("utf-8", "replace")
    found: dict[int, tuple[Any, ...]] = {}
    names: dict[int, str] = {}
    whole = True
    for order in ("ASC", "DESC"):
        index, whole_index = _until_damage(
            connection, f"SELECT n, key FROM runs INDEXED BY runs_by_key ORDER BY key {order}"
        )
        usable = {n: key for n, key in index if type(n) is int and _is_key(key)}
        whole &= whole_index and len(usable) == len(index)
        names |= usable
        table, _ = _until_damage(connection, f"{RUNS} ORDER BY n {order}")
        found |= {n: tuple(record) for n, *record in table}
    for n in names.keys() - found.keys():
        table, _ = _until_damage(connection, f"{RUNS} WHERE n = ?", n)
        found |= {n: tuple(record) for n, *record in table}
    sound = {n: record for n, record in sorted(found.items()) if not isinstance(unpacked(record), str)}
    runs: dict[str, tuple[str, ...]] = {}
    for record in sound.values():
        runs.setdefault(record[0], record)
    if not whole:
        names = {n: record[0] for n, record in found.items() if _is_key(record[0])} | names
    named = (key for n, key in sorted(names.items()) if n not in sound and key not in runs)
    lost = tuple(dict.fromkeys(named))
    notes: tuple[str, ...] = ()
    if lost:
        first = ", ".join(key[:12] for key in lost[:_NAMED]) + (", ..." if len(lost) > _NAMED else "")
        are = "run is" if len(lost) == 1 else "runs are"
        notes = (f"{len(lost):,} {are} lost ({first}); `lampyris study` runs what is missing",)
    if not whole:
        notes += ("how many runs there were cannot be read; there may have been more",)
    return runs, lost, notes


def _is_key(text: Any) -> bool:
    """Whether it can be the key of a job, a SHA-256 in hex; a damaged index holds anything."""
    return type(text) is str and len(text) == 64 and text.isalnum()


def _until_damage(
    connection: sqlite3.Connection, sql: str, *values: int
) -> tuple[list[tuple[Any, ...]], bool]:
    """The rows of a query, up to where SQLite can read no further; whether those are all."""
    rows: list[tuple[Any, ...]] = []
    try:
        rows.extend(connection.execute(sql, values))
    except sqlite3.Error:
        return rows, False
    return rows, True


def _study(connection: sqlite3.Connection, place: Path, study: Study | None) -> tuple[str, dict[str, str]]:
    """The study and its maps as JSON: those that are stored, or those of the study that was given.

    Raises
    ------
    FileError : STORE_STUDY.
    """
    plain: dict[str, Any] | None = None
    with suppress(LampyrisError, sqlite3.Error, LookupError, TypeError):
        plain = plain_of(connection, place)
        maps = maps_of(connection, place)
        return canonical(plain).decode("ascii"), {one["hash"]: maps[one["hash"]] for one in plain["maps"]}
    if study is None:
        what = "the study in it is damaged" if plain is None else "a map in it is damaged"
        raise FileError("STORE_STUDY", what, where=str(place), todo="give the study's file too")
    if plain is not None and (other := differing(plain, study_plain(study))):
        raise FileError("STORE_STUDY", f"made for another study, which differs in {other}", where=str(place))
    return canonical(study_plain(study)).decode("ascii"), packed_maps(study)


def _set_aside(place: Path) -> Path:
    """Keep the damaged store under another name, its log too; the log goes from its own place.

    A log that stayed would be read into the new store. Killed before that has its name, all that was there is
    under the other name, also after a power failure: the copy is on the disk before the log is removed.
    """
    k = 1
    while any(sidecar(place, f"{_numbered(k)}{e}").exists() for e in ("", "-wal")):
        k += 1
    kept, log = sidecar(place, _numbered(k)), sidecar(place, "-wal")
    both = [(place, kept)]
    if log_size(place):
        both.append((log, sidecar(kept, "-wal")))
    for old, new in both:
        try:
            new.hardlink_to(old)
        except OSError:  # not every file system has second names
            copy(old, new)
    sync_folder(place.parent)
    for ending in ("-wal", "-shm"):
        sidecar(place, ending).unlink(missing_ok=True)
    return kept


def _numbered(k: int) -> str:
    return KEPT if k == 1 else f"{KEPT}-{k}"
