"""Check: a damaged store is a typed error and can be repaired; another study's is refused; one writer at a time.

A store is an SQLite file whose rows have checksums. Its bytes are changed, and it is read, resumed and repaired:
each time right rows, or a typed error. What a killed writer leaves is the check ``kill``.
"""

from __future__ import annotations

import sqlite3
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import replace
from functools import cache, partial
from math import gcd
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from lampyris.errors import InternalFault, LampyrisError
from lampyris.io.maps.map_hash import map_hash
from lampyris.study.design.row import Row
from lampyris.study.design.study import Config, Study, StudyMap, StudyTraffic, canonical
from lampyris.study.store.file import checksum
from lampyris.study.store.repair import repair
from lampyris.study.store.row_record import packed
from lampyris.study.store.store import Store, open_for
from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally
from lampyris_selfcheck.checks.studies.stores import BESIDE, bytes_of, clear, filled, put, rows, study
from lampyris_selfcheck.scratch import folder

T = TypeVar("T")
SEEDS, ROWS = 7, 24
"""Of the damaged store's study, which has 28 jobs; rows in it, some longer than a page."""
PAGE = 4096
REFUSED = frozenset((
    "STORE_DAMAGED", "STORE_FORMAT", "STORE_VERSION", "STORE_READ", "STORE_WRITE",
    "STUDY_PLAIN", "STUDY_MAP", "PACKED_MAP",
))  # fmt: skip
"""What using a damaged store may report. STORE_WRITE: of a version that its SQLite may read and not write."""
PATIENCE_S = 120
"""Seconds that two processes may take for one small store."""


class Wrong(Exception):
    """Something that must not be."""


def must(holds: object, what: str) -> None:
    """Raise :class:`Wrong` unless it holds."""
    if not holds:
        raise Wrong(what)


# ---- damaged stores --------------------


@cache
def sound() -> tuple[bytes, dict[str, Row], Row]:
    """The bytes of a store that was closed, its rows by key, and the row that is damaged bit by bit."""
    given = rows(study(SEEDS), words=5000)[:ROWS]
    with folder() as at:
        filled(at / "a", study(SEEDS), 7, given)
        data = (at / "a").read_bytes()
    return data, {row.key: row for row in given}, next(row for row in given[5:] if not row.error)


@cache
def record() -> range:
    """Where the texts of that row are, its checksum too."""
    texts = "".join(packed(sound()[2])).encode()
    at = sound()[0].index(texts)
    return range(at, at + len(texts))


CHANGES = ("zeros", "ones", "another page", "one record fewer")
"""What is done to a page."""


def pages() -> int:
    """Cases of the kind ``page``."""
    return len(sound()[0]) // PAGE * len(CHANGES)


def spread(items: Sequence[T], number: int) -> T:
    """The items in an order in which the first of them are from all over: by the golden section."""
    n = len(items)
    step = max(int((5**0.5 - 1) / 2 * n), 1)
    while gcd(step, n) > 1:
        step += 1
    return items[number * step % n]


def damaged(ask: Ask, kind: str, number: int) -> tuple[bytes, str]:
    """The bytes of a case, and what was done to them."""
    data = bytearray(sound()[0])
    if kind == "bit":
        at, bit = divmod(spread(range(8 * len(record())), number), 8)
        data[record()[at]] ^= 1 << bit
        return bytes(data), f"byte {record()[at]} bit {bit}"
    if kind == "page":
        page, what = divmod(spread(range(pages()), number), len(CHANGES))
        at = page * PAGE
        before = data[at - PAGE : at] if at else data[-PAGE:]
        count = at + 4 + 100 * (not at)
        fewer = data[at:count] + bytes([max(data[count] - 1, 0)]) + data[count + 1 : at + PAGE]
        data[at : at + PAGE] = (bytes(PAGE), b"\xff" * PAGE, before, fewer)[what]
        return bytes(data), f"page {page}: {CHANGES[what]}"
    rng = ask.rng("store", kind, number)
    if number % 4 == 0:
        size = int(rng.integers(len(data)))
        return bytes(data[:size]), f"cut to {size} bytes"
    places = rng.integers(0, len(data), int(rng.integers(1, 4))).tolist()
    if number % 4 == 1:  # in the head of the file or of a page, where one bit decides most
        places = [int(rng.integers(0, len(data) // PAGE)) * PAGE + int(rng.integers(0, 110))]
    for at in places:
        data[at] ^= 1 << int(rng.integers(0, 8))
    return bytes(data), f"bits of bytes {places}"


def damage(ask: Ask, kind: str, number: int, at: Path) -> list[str]:
    """A damaged store is read, resumed and repaired; what was seen of it."""
    data, how = damaged(ask, kind, number)
    try:
        return judged(at / "a", data, sound()[2] if kind == "bit" else None)
    except Wrong as wrong:
        raise Wrong(f"{how}: {wrong}") from None


def judged(path: Path, data: bytes, lost: Row | None = None) -> list[str]:
    """What is seen of a damaged store.

    Parameters
    ----------
    path : where it is put.
    data : its bytes as they are now.
    lost : the only row that may be lost, where that is known.
    """
    put(path, {"": data})
    reads = _does("reading", partial(_read, path))
    must(path.read_bytes() == data, "reading changed it")
    put(path, {"": data})
    writes = _does("resuming", partial(_resume, path))
    must(reads or not writes, "it could be written to, and not be read")
    must(lost is None or not reads, "a damaged run was read")
    put(path, {"": data})
    repairs = _does("repair", partial(_repair, path, lost))
    must(repairs or lost is None, "repair was refused")
    return [
        "read whole" if reads else "refused",
        *(["read, and may not be added to"] if reads and not writes else []),
        *([] if repairs else ["not repaired"]),
    ]


def _does(doing: str, do: Callable[[], None]) -> bool:
    """Whether it was done; a refusal must be typed, of one line, and one of those."""
    try:
        do()
    except LampyrisError as error:
        typed = error.code in REFUSED and not isinstance(error, InternalFault)
        must(typed and str(error).isprintable(), f"{doing}: {error!s:.300}")
        return False
    except Exception as fault:
        kind = "" if isinstance(fault, Wrong) else f"{type(fault).__name__}: "
        raise Wrong(f"{doing}: {kind}{fault!s:.300}") from None
    return True


def _read(path: Path) -> None:
    with Store.open(path, writable=False) as store:
        found = list(store.rows().values())
        must(
            found == list(sound()[1].values()), f"{len(found)} rows that are not the {ROWS} that were stored"
        )
        must(len(store.study()) == 4 * SEEDS, f"its study has {len(store.study())} jobs")


def _resume(path: Path) -> None:
    """Open it as a study that is resumed does, add what is missing, and read it again."""
    with open_for(path, study(SEEDS)) as store:
        found = store.rows()
        must(found == sound()[1], f"{len(found)} rows that are not the {ROWS} that were stored")
        more = [row for row in rows(study(SEEDS), words=5000) if row.key not in found]
        store.add(more)
    with Store.open(path, writable=False) as store:
        same = list(store.rows().values()) == [*found.values(), *more]
        must(same, "what was added is not there, or not alone")


def _repair(path: Path, lost: Row | None) -> None:
    """Repair keeps right rows only and names the others; then the study can be resumed."""
    stored = sound()[1]
    came = repair(path, study=study(SEEDS))
    with open_for(path, study(SEEDS)) as store:
        kept = store.rows()
        must(all(stored.get(key) == row for key, row in kept.items()), "a row that was never stored")
        more = any("there may have been more" in note for note in came.notes)
        must(
            came.kept == len(kept) and (more or came.kept + came.lost == ROWS),
            f"says {came.kept} kept, {came.lost} lost of {ROWS}; {len(kept)} kept",
        )
        must(lost is None or came.lost_runs == (lost.key,), f"lost {came.lost_runs}, not that run")
        store.add(list(stored.values()))
        must(store.rows() == stored, "repaired and resumed, it has not all rows")


# ---- a store of another study --------------------


def _with(**change: Any) -> Callable[[Study], Study]:
    return lambda of: replace(of, **change)


def _world(**change: Any) -> Callable[[Study], Study]:
    return lambda of: replace(of, worlds=(replace(of.worlds[0], **change), *of.worlds[1:]))


def _ground(**change: Any) -> Callable[[Study], Study]:
    """Another first map; ``blocked``: one more cell of it."""

    def make(of: Study) -> Study:
        first = of.worlds[0].ground
        blocked = first.grid.blocked.copy()
        blocked[5, 0] = True
        grid = replace(first.grid, **({"blocked": blocked} if "blocked" in change else change))
        return _world(ground=StudyMap(first.name, grid, map_hash(grid)))(of)

    return make


_PLANNERS = (Config("astar", {"weight": 1.5}), Config("ad-gso", {"swarm": 8}, "glowworms, 8"))
OTHERS: Mapping[str, Callable[[Study], Study]] = {
    "kind": _with(kind="simulate"),
    "moves": _with(moves="four-connected"),
    "robot": _with(robot={"radius": 0.25}),
    "expansions": _with(expansions=99),
    "seconds": _with(seconds=1.5),
    "ticks": _with(ticks=7),
    "patience": _with(patience=7),
    "drive": _with(drive={"period": 0.1}),
    "root": _with(root=1),
    "seeds": _with(seeds=(1, 0, 2, 3, 4, 5, 6)),
    "memory": _with(memory=True),
    "maps.0.hash": _ground(blocked=True),
    "maps.0.resolution": _ground(resolution=0.25),
    "worlds.0.start": _world(start=(1, 0)),
    "worlds.0.goal": _world(goal=(6, 5)),
    "worlds.0.published": _world(published=9.5),
    "planners.0.settings.weight": _with(planners=_PLANNERS),
    "planners": _with(planners=_PLANNERS[1:]),
    "laws.0.settings.speed": _with(laws=(Config("constant", {"speed": 2.0}),)),
    "traffic_cases.0.count": _with(traffic_cases=(StudyTraffic("random-walk", 4),)),
    "version.0": lambda of: of,
    "version.1": lambda of: of,
}
"""How another study is made, by the field in which it differs."""


def resume(ask: Ask, kind: str, number: int, at: Path) -> list[str]:
    """A store of another study is refused, the field named, and nothing in it changed."""
    name, other = list(OTHERS.items())[number]
    path = at / "a"
    filled(path, study(SEEDS))
    if name.startswith("version"):
        _as_another_release(path, int(name[-1]))
    before = bytes_of(path)
    try:
        open_for(path, other(study(SEEDS))).close()
    except LampyrisError as error:
        named = error.code == "STORE_OTHER" and f"differs in {name}" in str(error)
        must(named, f"STORE_OTHER with {name} was expected: {error}")
    else:
        raise Wrong(f"{name}: it was not refused")
    must(bytes_of(path) == before, f"{name}: the store was changed")
    return []


def _as_another_release(path: Path, which: int) -> None:
    """The store as another release would have made it: of another version of the code (0) or of results (1)."""
    with Store.open(path, writable=False) as store:
        plain = store.plain()
    version, results = plain["version"]
    text = canonical({**plain, "version": [version, results + 1] if which else ["0.0.0", results]}).decode()
    with closing(sqlite3.connect(path)) as db:
        db.execute("UPDATE meta SET checksum = ?, value = ?", (checksum("meta", "study", text), text))
        db.commit()


# ---- two writers --------------------


def writers(ask: Ask, kind: str, number: int, at: Path) -> list[str]:
    """Two writers and a reader in turn, as drawn: the second is refused, and no row is lost or doubled."""
    hands: list[Store | None] = [None, None]
    try:
        return _in_turn(ask.rng("store", kind, number), at / "a", hands)
    finally:
        for hand in hands:
            if hand is not None:
                hand.close()


def _in_turn(rng: np.random.Generator, path: Path, hands: list[Store | None]) -> list[str]:
    of = study(5)
    given = rows(of)
    acknowledged: dict[str, Row] = {}
    seen: set[str] = set()
    for _ in range(int(rng.integers(8, 25))):
        who, what = int(rng.integers(2)), int(rng.integers(4))
        mine, theirs = hands[who], hands[1 - who]
        if mine is None:
            try:
                mine = hands[who] = open_for(path, of)
            except LampyrisError as error:
                must(error.code == "STORE_BUSY" and theirs is not None, f"opening: {error}")
                seen.add("busy")
                continue
            must(theirs is None, "two were let in at once")
            must(mine.rows() == acknowledged, f"{len(mine)} rows were found of {len(acknowledged)}")
        elif what == 0:
            mine.close()
            hands[who] = None
        elif what == 3:
            seen.add("read meanwhile")
            _demand_rows(path, acknowledged)
        else:
            some = [given[int(k)] for k in rng.integers(0, len(given), 5)]
            new = {row.key: row for row in some if row.key not in acknowledged}
            must(mine.add(some) == len(new), "the number of new rows is not right")
            acknowledged |= new
    if path.exists():
        _demand_rows(path, acknowledged)
    return sorted(seen)


def _demand_rows(path: Path, right: Mapping[str, Row]) -> None:
    with Store.open(path, writable=False) as reader:
        must(reader.rows() == right, f"a reader found {len(reader)} rows, and not the {len(right)}")


RACE = """
import random, sys, time
from lampyris.errors import LampyrisError
from lampyris_selfcheck.checks.studies.stores import rows, study
from lampyris.study.store.store import open_for
of, rng = study(15), random.Random(int(sys.argv[2]))
given, busy = rows(of), 0
rng.shuffle(given)
while given:
    try:
        with open_for(sys.argv[1], of) as store:
            for _ in range(rng.randrange(1, 5)):
                some, given = given[:3], given[3:]
                store.add(some)
    except LampyrisError as error:
        if error.code != "STORE_BUSY":
            raise SystemExit(str(error))
        busy += 1
    time.sleep(rng.random() * 0.004)
print(busy)
"""


def processes(ask: Ask, kind: str, number: int, at: Path) -> list[str]:
    """Two processes want the same store again and again: every row is in it once, and nothing lies beside."""
    path, of = at / "a", study(15)
    seeds = ask.rng("store", kind, number).integers(0, 2**31, 2).tolist()
    with _running([[sys.executable, "-c", RACE, str(path), str(seed)] for seed in seeds]) as both:
        said = [one.communicate(timeout=PATIENCE_S) for one in both]
    for one, (_, errors) in zip(both, said, strict=True):
        must(not one.returncode, f"ended with {one.returncode}: {errors[-300:]}")
    _demand_rows(path, {row.key: row for row in rows(of)})
    left = [ending for ending in BESIDE[1:] if path.with_name(path.name + ending).exists()]
    must(not left, f"left beside it: {left}")
    return ["in each other's way"] if any(int(out) for out, _ in said) else []


@contextmanager
def _running(commands: list[list[str]]) -> Any:
    pipe = subprocess.PIPE
    started = [subprocess.Popen(words, stdout=pipe, stderr=pipe, text=True) for words in commands]
    try:
        yield started
    finally:
        for one in started:
            one.kill()
            one.wait()


# ---- the check --------------------


def _whole(what: str, cases: int, commit: int | None = None) -> Kind:
    """A kind that is exhaustive."""
    few = cases if commit is None else min(commit, cases)
    return Kind(what, few, cases, cases, min(100, cases), cases)


def _kinds(ask: Ask) -> Mapping[str, Kind]:
    bits = 8 * len(record())
    return {
        "bit": _whole(
            "every bit of one run's record: that run is named and lost, repair keeps all others", bits, 100
        ),
        "page": _whole(
            "every page of zeros, of ones, of another page, or with one record fewer", pages(), 48
        ),
        "noise": Kind(
            "one to three bits anywhere, or a store cut at a drawn size", 150, 10_000, 100_000, 100
        ),
        "resume": _whole(
            "resuming in the store of another study is refused, with the field that differs", len(OTHERS)
        ),
        "writers": Kind(
            "two writers and a reader in turn: one at a time, no row lost or doubled", 40, 6000, 50_000, 50
        ),
        "processes": Kind("two processes that want one store at once", 2, 60, 300, 2),
    }


_CASES = {"resume": resume, "writers": writers, "processes": processes}


def _run(ask: Ask, part: Part) -> Outcome:
    tally = Tally(part)
    case = _CASES.get(part.kind, damage)
    with folder() as at:
        for number in part.numbers:
            clear(at)
            try:
                tally.case(*case(ask, part.kind, number, at))
            except Wrong as wrong:
                tally.fail(number, str(wrong))
            except Exception as fault:
                tally.fail(number, f"{type(fault).__name__}: {fault!s:.300}")
    return tally.outcome()


CHECK = Check(
    "store",
    ("G17", "G19"),
    "a damaged store is a typed error and can be repaired; another study's is refused",
    _kinds,
    _run,
)
