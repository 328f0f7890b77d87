"""What is no store, or a store of something else: refused by name, and left as it is."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

from lampyris.errors import LampyrisError
from lampyris.io.maps.map_hash import map_hash
from lampyris.study.design.row import Row
from lampyris.study.design.study import Config, Study, StudyMap, StudyTraffic, canonical
from lampyris.study.store.file import checksum
from lampyris.study.store.repair import repair
from lampyris.study.store.store import Store, open_for
from lampyris_selfcheck.check import Ask
from lampyris_selfcheck.checks.studies.store_damage import MAIN, SEEDS, closed, opened
from lampyris_selfcheck.checks.studies.stores import bytes_of, clear, filled, put, rows, study
from lampyris_selfcheck.reference.files.watching import Hangs, no_longer_than

PATIENCE_S = 60.0
"""After so many seconds a store that does not answer hangs."""

# ---- what is no store --------------------


@dataclass(frozen=True)
class Foreign:
    """Something where a store should be.

    Parameters
    ----------
    name : of the case.
    make : puts it at a path.
    reads, resumes : the code that reading it, and resuming a study there, must be refused with; empty:
        neither is.
    repairs : the code that repair is refused with; empty: it is not.
    saves : the rows that the repaired store must have, by key, and no other.
    """

    name: str
    make: Callable[[Path], object]
    reads: str
    resumes: str
    repairs: str
    saves: Mapping[str, Row] = field(default_factory=dict)


def _bytes(data: bytes) -> Callable[[Path], object]:
    return lambda path: path.write_bytes(data)


def _store(at: int = 0, data: bytes = b"", **beside: bytes) -> Callable[[Path], object]:
    """The closed store with some bytes others, and files beside it (``log``, ``lock``, ``journal``)."""
    names = {"log": "-wal", "lock": ".lock", "journal": "-journal"}

    def make(path: Path) -> None:
        whole = bytearray(closed().files[""])
        whole[at : at + len(data)] = data
        path.write_bytes(bytes(whole))
        for name, value in beside.items():
            path.with_name(path.name + names[name]).write_bytes(value)

    return make


def _of_open(*endings: str) -> Callable[[Path], object]:
    """These files of the store that a killed writer left."""
    return lambda path: put(path, {e: opened().files[e] for e in endings})


def _other_database(path: Path) -> None:
    db = sqlite3.connect(path)
    db.execute("CREATE TABLE runs (n, seal, key)")
    db.commit()
    db.close()


@cache
def _foreign() -> tuple[Foreign, ...]:
    fmt, bad, version = "STORE_FORMAT", "STORE_DAMAGED", "STORE_VERSION"
    all_, left = closed().by_key, opened().by_key
    main = {row.key: row for row in opened().right[:MAIN]}
    return (
        Foreign("an empty file", _bytes(b""), bad, bad, bad),
        Foreign("text", _bytes(b"nothing of the kind\n" * 50), fmt, fmt, fmt),
        Foreign("a picture", _bytes(b"\x89PNG\r\n\x1a\n" + bytes(500)), fmt, fmt, fmt),
        Foreign("zeros", _bytes(bytes(8192)), fmt, fmt, fmt),
        Foreign("a database of another program", _other_database, fmt, fmt, fmt),
        Foreign("one byte of a store", _bytes(b"S"), bad, bad, bad),
        Foreign("half a head", _bytes(closed().files[""][:60]), bad, bad, bad),
        Foreign("a head alone", _bytes(closed().files[""][:100]), bad, bad, bad),
        Foreign("a newer format", _store(60, b"\0\0\0\x09"), version, version, version),
        Foreign("an older format", _store(60, b"\0\0\0\x01"), version, version, version),
        Foreign("a log that is none", _store(log=b"not a log" * 99), "", "", "", all_),
        Foreign("a lock that nobody holds", _store(lock=b"pid 1\n"), "", "", "", all_),
        Foreign("a journal of nothing", _store(journal=b"not a journal" * 99), "", "", "", all_),
        Foreign("a killed writer's", _of_open("", "-wal"), "", "", "", left),
        Foreign("a log alone", _of_open("-wal"), "STORE_READ", bad, "STORE_READ"),
        Foreign("a store without its log", _of_open(""), "", "", "", main),
        Foreign("a store without its main page", _store(0, bytes(4096)), fmt, fmt, fmt),
        Foreign("a folder", Path.mkdir, fmt, fmt, fmt),
        Foreign("a pipe", lambda path: os.mkfifo(path), fmt, fmt, fmt),
        Foreign("nothing", lambda path: None, "STORE_READ", "", "STORE_READ"),
        Foreign("a link to nothing", lambda path: path.symlink_to("no"), "STORE_READ", "", "STORE_READ"),
    )


def foreign_cases() -> int:
    """Cases of the kind ``foreign``."""
    return len(_foreign())


def _is_refused(code: str, do: Callable[[], object]) -> str:
    """What is wrong with how it was refused; empty if nothing is."""
    try:
        with no_longer_than(PATIENCE_S, wall=True):  # who opens a pipe to read it waits for who writes
            do()
    except LampyrisError as error:
        good = error.code == code and str(error).isprintable()
        return "" if good else f"{code or 'no error'} was expected, and it was {error!s:.200}"
    except (Exception, Hangs) as fault:
        return f"{code or 'no error'} was expected, and it was {type(fault).__name__}: {fault!s:.200}"
    return f"{code} was expected, and nothing was refused" if code else ""


def foreign(ask: Ask, kind: str, number: int, at: Path) -> tuple[list[str], str]:
    """One of them: nothing to count, and what is wrong."""
    case, path = _foreign()[number], at / "a"
    wrong = []

    def seen() -> dict[str, bytes]:
        files = {} if path.is_dir() or path.is_fifo() else bytes_of(path)
        return {ending: data for ending, data in files.items() if ending in ("", "-wal")}

    def resumed() -> None:
        with open_for(path, study(SEEDS)):
            pass

    for code, do in (
        (case.reads, lambda: _read(path, writable=False)), (case.reads, lambda: _read(path, writable=True)),
        (case.resumes, resumed),
    ):  # fmt: skip
        clear(at)
        case.make(path)
        before = seen()
        wrong.append(_is_refused(code, do))
        if code and seen() != before:
            wrong.append("it was changed")
    clear(at)
    case.make(path)
    wrong.append(_is_refused(case.repairs, lambda: _repair(path, case.saves)))
    clear(at)
    words = "; ".join(w for w in wrong if w)
    return [], f"{case.name}: {words}" if words else ""


def _read(path: Path, *, writable: bool) -> None:
    with Store.open(path, writable=writable) as store:
        store.study(), store.rows()


def _repair(path: Path, saves: Mapping[str, Row]) -> None:
    """Repair, judge what is saved, and resume until every row is there."""
    came = repair(path, study=study(SEEDS))
    with open_for(path, study(SEEDS)) as store:
        kept = store.rows()
        if kept != saves or came.kept != len(saves):
            same = sum(saves.get(key) == row for key, row in kept.items())
            raise AssertionError(
                f"{same} of {len(saves)} rows are saved, {len(kept)} there, {came.kept} reported"
            )
        all_ = rows(study(SEEDS), words=5000)
        store.add([row for row in all_ if row.key not in kept])
        if len(store.rows()) != len(all_):
            raise AssertionError(f"{len(store)} rows of {len(all_)}")


# ---- a store of another study --------------------


def _others() -> Mapping[str, tuple[str, Callable[[Study], Study]]]:
    """Name of the field, what the message must hold, and how the other study is made."""

    def ground(**change: Any) -> Callable[[Study], Study]:
        def make(of: Study) -> Study:
            first = of.worlds[0].ground
            blocked = first.grid.blocked.copy()
            blocked[5, 0] = True
            cells = {"blocked": blocked} if "blocked" in change else change
            grid = replace(first.grid, **cells)
            one = StudyMap(first.name, grid, map_hash(grid))
            return replace(of, worlds=(replace(of.worlds[0], ground=one), *of.worlds[1:]))

        return make

    def world(**change: Any) -> Callable[[Study], Study]:
        return lambda of: replace(of, worlds=(replace(of.worlds[0], **change), *of.worlds[1:]))

    def study_with(**change: Any) -> Callable[[Study], Study]:
        return lambda of: replace(of, **change)

    planner = (Config("astar", {"weight": 1.5}), Config("ad-gso", {"swarm": 8}, "glowworms, 8"))
    return {
        "kind": ("kind", study_with(kind="simulate")),
        "moves": ("moves", study_with(moves="four-connected")),
        "robot": ("robot", study_with(robot={"radius": 0.25})),
        "expansions": ("expansions", study_with(expansions=99)),
        "seconds": ("seconds", study_with(seconds=1.5)),
        "ticks": ("ticks", study_with(ticks=7)),
        "patience": ("patience", study_with(patience=7)),
        "drive": ("drive", study_with(drive={"period": 0.1})),
        "root seed": ("root", study_with(root=1)),
        "seeds": ("seeds", study_with(seeds=(1, 0, 2, 3, 4, 5, 6))),
        "memory": ("memory", study_with(memory=True)),
        "map's cells": ("maps.0.hash", ground(blocked=True)),
        "map's resolution": ("maps.0.resolution", ground(resolution=0.25)),
        "start": ("worlds.0.start", world(start=(1, 0))),
        "goal": ("worlds.0.goal", world(goal=(6, 5))),
        "published length": ("worlds.0.published", world(published=9.5)),
        "planner's settings": ("planners.0.settings.weight", study_with(planners=planner)),
        "planners": ("planners", study_with(planners=planner[1:])),
        "law": ("laws.0.settings.speed", study_with(laws=(Config("constant", {"speed": 2.0}),))),
        "traffic": ("crowds.0.count", study_with(crowds=(StudyTraffic("random-walk", 4),))),
        "version of the code": ("version.0", lambda of: of),
        "version of results": ("version.1", lambda of: of),
    }


def other_studies() -> int:
    """Cases of the kind ``resume``."""
    return len(_others())


def resume(ask: Ask, kind: str, number: int, at: Path) -> tuple[list[str], str]:
    """A store of another study is refused, the field named, and nothing in it changed."""
    name, (field_name, other) = list(_others().items())[number]
    path = at / "a"
    clear(at)
    filled(path, study(7))
    if name.startswith("version"):
        _of_release(path, name)
    before = bytes_of(path)
    try:
        open_for(path, other(study(7))).close()
        return [], f"{name}: it was not refused"
    except LampyrisError as error:
        if error.code != "STORE_OTHER" or f"differs in {field_name}" not in str(error):
            return [], f"{name}: STORE_OTHER with {field_name} was expected: {error}"
    return [], "" if bytes_of(path) == before else f"{name}: the store was changed"


def _of_release(path: Path, name: str) -> None:
    """The store as another release would have made it."""
    with Store.open(path, writable=False) as store:
        plain = store.plain()
    version, results = plain["version"]
    other = ["0.0.0", results] if name == "version of the code" else [version, results + 1]
    text = canonical({**plain, "version": other}).decode()
    db = sqlite3.connect(path)
    db.execute("UPDATE meta SET checksum = ?, value = ?", (checksum("meta", "study", text), text))
    db.commit()
    db.close()
