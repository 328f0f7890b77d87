"""What is no store, or a store of something else: refused by name, and left as it is."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from lampyris.errors import LampyrisError
from lampyris.io.maps.map_hash import map_hash
from lampyris.study.design.row import Row
from lampyris.study.design.study import Config, Study, StudyMap, StudyTraffic, canonical
from lampyris.study.store.file import seal
from lampyris.study.store.repair import repair
from lampyris.study.store.store import Store, open_for
from lampyris_selfcheck.check import Ask, Kind, Part, Tally
from lampyris_selfcheck.checks.studies.store_damage import MAIN, closed, opened
from lampyris_selfcheck.checks.studies.store_writers import processes, writers
from lampyris_selfcheck.checks.studies.stores import bytes_of, clear, filled, put, rows, study
from lampyris_selfcheck.reference.files.watching import Hangs, no_longer_than
from lampyris_selfcheck.scratch import folder

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
    reads, goes_on : the code that reading it, and going on with it, must be refused with; empty: neither is.
    repairs : the code that repair is refused with; empty: it is not.
    saves : the rows that the repaired store must have, by key, and no other: all whose records stand whole.
    """

    name: str
    make: Callable[[Path], object]
    reads: str
    goes_on: str
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


def _foreign() -> tuple[Foreign, ...]:
    """All of them."""
    log, lock = opened().files["-wal"], opened().files[".lock"]
    fmt, old = "STORE_FORMAT", "STORE_DAMAGED"
    all_, left = closed().keyed, opened().keyed
    main = {row.key: row for row in opened().right[:MAIN]}
    # Rows of one study: where both have one, the store's own is kept.
    both = {key: row for key, row in left.items() if key not in main} | all_
    return (
        Foreign("an empty file", _bytes(b""), old, old, fmt),
        Foreign("text", _bytes(b"nothing of the kind\n" * 50), fmt, fmt, fmt),
        Foreign("a picture", _bytes(b"\x89PNG\r\n\x1a\n" + bytes(500)), fmt, fmt, fmt),
        Foreign("zeros", _bytes(bytes(8192)), fmt, fmt, fmt),
        Foreign("a database of another program", _other_database, fmt, fmt, fmt),
        Foreign("one byte of a store", _bytes(b"S"), old, old, fmt),
        Foreign("half a head", _bytes(closed().files[""][:60]), old, old, fmt),
        Foreign("a head alone", _bytes(closed().files[""][:100]), old, old, fmt),
        Foreign("a newer format", _store(60, b"\0\0\0\2"), "STORE_VERSION", "STORE_VERSION", "", all_),
        Foreign("an older format", _store(60, b"\0\0\0\0"), "STORE_VERSION", "STORE_VERSION", "", all_),
        Foreign("the log of another store", _store(log=log), old, old, "", both),
        Foreign("the witness of another store", _store(lock=lock), old, old, "", all_),
        Foreign("a journal of nothing", _store(journal=b"not a journal" * 99), "", "", "", all_),
        Foreign("a log alone", _of_open("-wal", ".lock"), "STORE_READ", old, "", left),
        Foreign("a store without its log", _of_open("", ".lock"), old, old, "", main),
        Foreign("a store without its main page", _store(0, bytes(4096)), fmt, fmt, "", all_),
        Foreign("a folder", Path.mkdir, fmt, fmt, "STORE_READ"),
        Foreign("a pipe", lambda path: os.mkfifo(path), fmt, fmt, "STORE_READ"),
        Foreign("nothing", lambda path: None, "STORE_READ", "", "STORE_READ"),
        Foreign("a link to nothing", lambda path: path.symlink_to("no"), "STORE_READ", "", "STORE_READ"),
    )


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


def foreign(number: int, at: Path) -> tuple[str, str]:
    """One of them: its name, and what is wrong."""
    case, path = _foreign()[number], at / "a"
    wrong = []

    def seen() -> dict[str, bytes]:
        return {} if path.is_dir() or path.is_fifo() else bytes_of(path)

    def go_on() -> None:
        with open_for(path, study(7)):
            pass

    for code, do in (
        (case.reads, lambda: _read(path, writable=False)), (case.reads, lambda: _read(path, writable=True)),
        (case.goes_on, go_on),
    ):  # fmt: skip
        clear(at)
        case.make(path)
        before = seen()
        wrong.append(_is_refused(code, do))
        if code and {e: b for e, b in seen().items() if e in ("", "-wal")} != {
            e: b for e, b in before.items() if e in ("", "-wal")
        }:
            wrong.append("it was changed")
    clear(at)
    case.make(path)
    wrong.append(_is_refused(case.repairs, lambda: _repair(path, case.saves)))
    return case.name, "; ".join(w for w in wrong if w)


def _read(path: Path, *, writable: bool) -> None:
    with Store.open(path, writable=writable) as store:
        store.study(), store.rows()


def _repair(path: Path, saves: Mapping[str, Row]) -> None:
    """Repair, judge what is saved, and go on until every row is there."""
    told = repair(path, study=study(7))
    all_ = rows(study(7), words=5000)
    with open_for(path, study(7)) as store:
        kept = store.rows()
        if kept != saves or told.kept != len(saves):
            same = sum(saves.get(key) == row for key, row in kept.items())
            raise AssertionError(
                f"{same} of {len(saves)} rows are saved, {len(kept)} there, {told.kept} told"
            )
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
        "crowd": ("crowds.0.count", study_with(crowds=(StudyTraffic("random-walk", 4),))),
        "version of the code": ("version.0", lambda of: of),
        "version of results": ("version.1", lambda of: of),
    }


def resume(number: int, at: Path) -> tuple[str, str]:
    """A store of another study is refused, the field named, and nothing in it changed."""
    name, (field, other) = list(_others().items())[number]
    path = at / "a"
    clear(at)
    filled(path, study(7))
    if name.startswith("version"):
        _of_release(path, name)
    before = bytes_of(path)
    try:
        open_for(path, other(study(7))).close()
        return name, "it was not refused"
    except LampyrisError as error:
        if error.code != "STORE_OTHER" or f"differs in {field}" not in str(error):
            return name, f"STORE_OTHER with {field} was expected: {error}"
    except Exception as fault:
        return name, f"{type(fault).__name__}: {fault}"
    return name, "" if bytes_of(path) == before else "the store was changed"


def _of_release(path: Path, name: str) -> None:
    """The store as another release would have made it."""
    with Store.open(path, writable=False) as store:
        said = store.plain()
    version, results = said["version"]
    other = ["0.0.0", results] if name == "version of the code" else [version, results + 1]
    text = canonical({**said, "version": other}).decode()
    db = sqlite3.connect(path)
    db.execute("UPDATE meta SET seal = ?, value = ?", (seal("meta", "study", text), text))
    db.commit()
    db.close()


# ---- the kinds --------------------


def kinds() -> dict[str, Kind]:
    """Kinds of cases, and how many each has."""
    none, others = len(_foreign()), len(_others())
    return {
        "foreign": Kind(
            "what is no store, or not all of one: the right error, nothing changed, and repair saves all",
            none, none, none, none, none,
        ),
        "resume": Kind(
            "going on with the store of another study is refused, with the field that differs",
            others, others, others, others, others,
        ),
        "writers": Kind(
            "two writers and a reader in turn: one at a time, no row lost or doubled", 40, 6000, 50_000, 50
        ),
        "processes": Kind("two processes that want one store at once", 2, 60, 300, 2),
    }  # fmt: skip


def run(ask: Ask, part: Part) -> Tally:
    """The cases of a part."""
    tally = Tally(part)
    with folder() as at:
        for number in part.numbers:
            if part.kind in ("foreign", "resume"):
                name, wrong = (foreign if part.kind == "foreign" else resume)(number, at)
                tally.case()
            else:
                rng = ask.rng("store", part.kind, number)
                try:
                    seen, wrong = (writers if part.kind == "writers" else processes)(rng, at)
                except Exception as fault:
                    seen, wrong = [], f"{type(fault).__name__}: {fault!s:.300}"
                name = part.kind
                tally.case(*seen)
            if wrong:
                tally.fail(number, f"{name}: {wrong}")
    return tally
