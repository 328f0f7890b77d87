"""A new store, written under another name and then given its own: nobody ever meets half of one."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from pathlib import Path

from lampyris.errors import FileError
from lampyris.io.atomic_write import sync_folder
from lampyris.study.store.file import (
    APPLICATION,
    FORMAT,
    HEAD,
    PAGE,
    TABLES,
    chained,
    connect,
    damaged,
    keep_log,
    seal,
    sidecar,
    speaking,
)
from lampyris.study.store.lock import Witness

ADD = "INSERT INTO runs VALUES (?, ?, ?, ?, ?, ?, ?)"
NEW = ".new"


def check_folder(path: Path) -> None:
    """Refuse a store where there is no folder to hold it.

    Raises
    ------
    FileError : STORE_WRITE.
    """
    if not path.parent.is_dir():
        raise FileError(
            "STORE_WRITE", "no such folder", where=str(path), allowed="a folder that is there",
        )  # fmt: skip


def write_new(
    place: Path,
    study: str,
    maps: Mapping[str, str],
    runs: Iterable[tuple[str, ...]] = (),
    *,
    before: Callable[[], object] | None = None,
) -> Witness:
    """Write a store; returns its tally. It is on the disk, under its name, when this returns.

    Parameters
    ----------
    place : where; what is there is replaced. The caller holds its lock.
    study : the study as canonical JSON.
    maps : packed maps as canonical JSON, by hash.
    runs : records of runs, the seal first, each key once.
    before : called when the store is written and is about to be given its name; None: nobody takes care of
        what is there.

    Raises
    ------
    FileError : STORE_WRITE; STORE_DAMAGED: a log that SQLite would take for this store's.
    """
    new = sidecar(place, NEW)
    with speaking(place, "write"):
        for ending in ("-wal", "-journal") if before is None else ():
            if sidecar(place, ending).exists() and sidecar(place, ending).stat().st_size:
                raise damaged(sidecar(place, ending), "the log of a store that is not there")
        try:
            _remove(new)
            tally = _fill(new, study, maps, runs)
            # Or its journal, deleted just now, may be there again after power was lost, beside the store.
            sync_folder(place.parent)
            if before is not None:
                before()
            os.replace(new, place)
        except BaseException:
            with suppress(OSError):  # what went wrong first is what there is to tell
                _remove(new)
            raise
        sync_folder(place.parent)
    return tally


def _fill(new: Path, study: str, maps: Mapping[str, str], runs: Iterable[tuple[str, ...]]) -> Witness:
    count, head = 0, HEAD
    connection = connect(new, "rwc")
    try:
        connection.execute(f"PRAGMA page_size={PAGE}")
        connection.execute("PRAGMA encoding='UTF-8'")
        connection.execute(f"PRAGMA application_id={APPLICATION}")
        connection.execute(f"PRAGMA user_version={FORMAT}")
        connection.execute("BEGIN EXCLUSIVE")
        for sql in TABLES.values():
            connection.execute(sql)
        connection.execute(
            "INSERT INTO meta VALUES (1, ?, ?, ?)", (seal("meta", "study", study), "study", study)
        )
        for n, (key, value) in enumerate(maps.items(), start=1):
            connection.execute(
                "INSERT INTO maps VALUES (?, ?, ?, ?)", (n, seal("maps", key, value), key, value)
            )
        for record in runs:
            count += 1
            head = chained(head, record[0])
            connection.execute(ADD, (count, *record))
        said = (str(count), head)
        connection.execute("INSERT INTO tally VALUES (1, ?, ?, ?)", (seal("tally", *said), *said))
        connection.execute("COMMIT")
        keep_log(connection, new)
    finally:
        connection.close()
    return Witness(count, head)


def _remove(new: Path) -> None:
    for ending in ("", "-journal", "-wal", "-shm"):
        sidecar(new, ending).unlink(missing_ok=True)
