"""Damaged stores: cut, flipped, overwritten; and what must come of them.

Two stores are damaged: one that was closed, and one as a killed writer leaves it, with runs in its log. What
must be saved is known without the product's own way of finding records: a run whose bytes, its record's head
and all, stand whole in either file.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache
from math import gcd
from pathlib import Path
from typing import TypeVar

import numpy as np

from lampyris.errors import InternalFault, LampyrisError
from lampyris.study.design.row import Row
from lampyris.study.store.file import PAGE
from lampyris.study.store.repair import repair
from lampyris.study.store.row_record import packed
from lampyris.study.store.store import Store, open_for
from lampyris_selfcheck.check import Ask, Kind, Part, Tally
from lampyris_selfcheck.checks.studies.stores import Files, bytes_of, clear, filled, put, rows, study
from lampyris_selfcheck.scratch import folder

T = TypeVar("T")
SEEDS = 7
"""Of the study: 28 jobs."""
CLOSED, MAIN, CALL = 24, 8, 4
"""Rows of the closed store; rows of the open one that are in its main file; rows of a call."""
FRAME = PAGE + 24
"""Bytes of a page in the log with its head."""
READING = frozenset(
    ("STORE_DAMAGED", "STORE_FORMAT", "STORE_VERSION", "STUDY_PLAIN", "STUDY_MAP", "PACKED_MAP")
)
"""What reading a damaged store may say."""
REPAIRING = frozenset(("STORE_STUDY", "STORE_FORMAT"))
"""What repairing one without its study may say: its study is damaged; nothing of a store is in it."""


@dataclass(frozen=True)
class Sample:
    """A store that is whole.

    Parameters
    ----------
    files : its bytes by ending.
    right : its rows, in order.
    raw : the bytes of each row's record by key; those of rows longer than a page are in pieces, and are not
        among them.
    last : where in its growing file the last three rows, or calls, begin.
    """

    files: Files
    right: list[Row]
    raw: dict[str, bytes]
    last: int
    keyed: dict[str, Row] = field(default_factory=dict)


@cache
def closed() -> Sample:
    """A store of 24 rows that was closed; some are longer than a page."""
    with folder() as at:
        given = rows(study(SEEDS), words=5000)[:CLOSED]
        filled(at / "a", study(SEEDS), 7, given)
        files = bytes_of(at / "a")
    raw = _raw(files, given)
    last = min(files[""].index(packed(row)[0].encode()) for row in given[-3:])
    return Sample(files, given, raw, last, {row.key: row for row in given})


@cache
def opened() -> Sample:
    """A store as a killed writer leaves it: 8 rows in its main file, 20 in the log, four a call."""
    with folder() as at:
        path, given, sizes = at / "a", rows(study(SEEDS)), []
        filled(path, study(SEEDS), CALL, given[:MAIN])
        with Store.open(path) as store:
            for k in range(MAIN, len(given), CALL):
                sizes.append(len(bytes_of(path).get("-wal", b"")))
                store.add(given[k : k + CALL])
            files = bytes_of(path)
    del files["-shm"]  # The next to open it makes it anew, and it holds nothing.
    files[".lock"] = b"pid 1".ljust(255) + b"\n" + files[".lock"][256:]
    return Sample(files, given, _raw(files, given), sizes[-3], {row.key: row for row in given})


def _raw(files: Files, given: list[Row]) -> dict[str, bytes]:
    """The bytes of each row's record as they stand in either file, from its head to its end."""
    found = {}
    for row in given:
        body = "".join(packed(row)).encode()
        for data in (files[""], files.get("-wal", b"")):
            at = data.find(body)
            for head in range(5, 48) if at > 48 else ():
                if data[at - head] == head and data[at - head + 1 : at - head + 4] == b"\x00\x81\x0d":
                    found[row.key] = data[at - head : at + len(body)]
    return found


# ---- what must come of one --------------------


def judged(path: Path, files: Files, sample: Sample) -> tuple[list[str], list[str]]:
    """Read a damaged store, write to it and repair it: each time exactly the right rows, or a typed error.

    Parameters
    ----------
    path : where it is put.
    files : its bytes as they are now.
    sample : what it was.

    Returns
    -------
    What is wrong, in words; and what was seen of it.
    """
    wrong: list[str] = []
    put(path, files)
    reads = _does(wrong, "reading", READING, lambda: _read(path, sample))
    after = bytes_of(path)
    if any(after.get(ending) != files.get(ending) for ending in ("", "-wal")):
        wrong.append("reading changed it")
    put(path, files)
    writes = _does(wrong, "going on", READING, lambda: _write(path, sample))
    if writes and not reads:
        wrong.append("it could be written to, and not be read")
    repairs = _does(wrong, "repair", frozenset(), lambda: _repair(path, files, sample))
    seen = [
        "read whole" if reads else "refused",
        *(["read, and may not be added to"] if reads and not writes else []),
        *([] if repairs else ["not repaired"]),
    ]
    clear(path.parent)
    return wrong, seen


class _Wrong(Exception):
    """Something that must not be."""


def _does(wrong: list[str], doing: str, codes: frozenset[str], do: Callable[[], None]) -> bool:
    """Whether it was done; a refusal is all right if it is typed, of one line, and one of those."""
    try:
        do()
    except _Wrong as fault:
        wrong.append(f"{doing}: {fault}")
    except LampyrisError as error:
        if isinstance(error, InternalFault) or error.code not in codes or not str(error).isprintable():
            wrong.append(f"{doing}: {error!s:.300}")
    except Exception as fault:
        wrong.append(f"{doing}: {type(fault).__name__}: {fault!s:.300}")
    else:
        return True
    return False


def _read(path: Path, sample: Sample) -> None:
    with Store.open(path, writable=False) as store:
        found = list(store.rows().values())
        jobs = len(store.study())
    if found != sample.right:
        raise _Wrong(f"{len(found)} rows that are not the {len(sample.right)} that were stored")
    if jobs != 4 * SEEDS:
        raise _Wrong(f"its study has {jobs} jobs")


def _write(path: Path, sample: Sample) -> None:
    """Open it as a study that goes on does, add what is missing, and read it again."""
    all_ = rows(study(SEEDS), words=5000)
    more = [row for row in all_ if row.key not in sample.keyed]
    with open_for(path, study(SEEDS)) as store:
        if list(store.rows().values()) != sample.right:
            raise _Wrong("it was opened, and its rows are others")
        store.add(more)
    with Store.open(path, writable=False) as store:
        if list(store.rows().values()) != sample.right + more:
            raise _Wrong("what was added is not there, or not alone")


def _repair(path: Path, files: Files, sample: Sample) -> None:
    """Repair keeps right rows only, all that are whole, and counts the others; then the study can go on."""
    data = files.get("", b""), files.get("-wal", b"")
    whole = {key for key, raw in sample.raw.items() if raw in data[0] or raw in data[1]}
    put(path, files)
    try:
        told = repair(path, study=study(SEEDS))
    except LampyrisError as error:
        if error.code in REPAIRING and not whole:
            return
        raise
    with open_for(path, study(SEEDS)) as store:
        kept = store.rows()
        if any(sample.keyed.get(key) != row for key, row in kept.items()):
            raise _Wrong("a row that was never stored")
        if lost := whole - set(kept):
            raise _Wrong(f"{len(lost)} rows are lost that stand whole in its bytes")
        unknown = any("there may have been more" in note for note in told.notes)
        if told.kept != len(kept) or (told.kept + told.lost != len(sample.right) and not unknown):
            raise _Wrong(f"says {told.kept} kept, {told.lost} lost of {len(sample.right)}; {len(kept)} kept")
        store.add(sample.right)
        if store.rows() != sample.keyed:
            raise _Wrong("repaired and continued, it has not all rows")


# ---- the damage --------------------


def kinds() -> dict[str, Kind]:
    """Kinds of damage, and how many cases each has."""
    cuts, bits, pages = len(_cuts()), 8 * len(_record()), len(_pages())
    return {
        "cut": Kind(
            "a store cut at every byte of its last three records, its log at every byte of its last three "
            "calls: right rows or a typed error; repair keeps what is whole",
            100, cuts, cuts, 100, cuts,
        ),
        "bit": Kind("every bit of one record", 100, bits, bits, 100, bits),
        "page": Kind("every page of zeros, of ones, or of another page", 24, pages, pages, 50, pages),
        "noise": Kind(
            "one to three bits anywhere, of the main file, the log or the witness",
            150, 65_600, 1_000_000, 100,
        ),
    }  # fmt: skip


@cache
def _cuts() -> list[tuple[str, int]]:
    """File and size of every cut."""
    main, log = closed(), opened()
    return [
        *(("", size) for size in range(main.last, len(main.files[""]))),
        *(("-wal", size) for size in range(log.last, len(log.files["-wal"]))),
    ]


@cache
def _record() -> tuple[int, ...]:
    """Where the bytes of one record are in the closed store."""
    sample = closed()
    raw = sample.raw[sample.right[CLOSED // 2].key]
    at = sample.files[""].index(raw)
    return tuple(range(at, at + len(raw)))


@cache
def _pages() -> list[tuple[str, int, int]]:
    """File, place of the page, and what is put there: 0 zeros, 1 ones, 2 the page before."""
    log = opened().files["-wal"]
    places = [
        *(("", at) for at in range(0, len(closed().files[""]), PAGE)),
        *(("-wal", at + 24) for at in range(32, len(log), FRAME)),
    ]
    return [(ending, at, what) for ending, at in places for what in range(3)]


def damage(ask: Ask, part: Part, number: int) -> tuple[Sample, dict[str, bytes], str]:
    """The store of a case, damaged, and in words how."""
    if part.kind == "cut":
        ending, size = _spread(_cuts(), number)
        sample = opened() if ending else closed()
        return sample, {**sample.files, ending: sample.files[ending][:size]}, f"{ending} cut to {size} bytes"
    if part.kind == "bit":
        at, bit = divmod(_spread(range(8 * len(_record())), number), 8)
        return _flipped(closed(), "", [(_record()[at], bit)])
    if part.kind == "page":
        ending, at, what = _spread(_pages(), number)
        sample = opened() if ending else closed()
        data = bytearray(sample.files[ending])
        step = FRAME if ending else PAGE
        before = data[at - step : at - step + PAGE] if at > step else data[-PAGE:]
        data[at : at + PAGE] = (bytes(PAGE), b"\xff" * PAGE, before)[what]
        words = f"{ending} page at {at}: {('zeros', 'ones', 'another')[what]}"
        return sample, {**sample.files, ending: bytes(data)}, words
    return _noise(ask.rng("store", part.kind, number))


def _spread(items: Sequence[T], number: int) -> T:
    """The items in an order in which the first of them are from all over: by the golden section."""
    n = len(items)
    step = max(int((5**0.5 - 1) / 2 * n), 1)
    while gcd(step, n) > 1:
        step += 1
    return items[number * step % n]


def _noise(rng: np.random.Generator) -> tuple[Sample, dict[str, bytes], str]:
    """One to three bits; a third of them where one bit decides most: heads of the file, pages and frames."""
    ending = ("", "", "-wal", "-wal", ".lock")[int(rng.integers(5))]
    sample = opened() if ending or rng.integers(4) == 0 else closed()
    size, step = len(sample.files[ending]), FRAME if ending == "-wal" else PAGE
    places = rng.integers(0, size, int(rng.integers(1, 4)))
    if ending != ".lock" and rng.integers(3) == 0:
        places = rng.integers(0, size // step, 1) * step + rng.integers(0, 30 if rng.integers(2) else 110, 1)
    bits = rng.integers(0, 8, len(places))
    return _flipped(sample, ending, list(zip(places.tolist(), bits.tolist(), strict=True)))


def _flipped(
    sample: Sample, ending: str, flips: list[tuple[int, int]]
) -> tuple[Sample, dict[str, bytes], str]:
    data = bytearray(sample.files[ending])
    for at, bit in flips:
        data[at] ^= 1 << bit
    words = ", ".join(f"byte {at} bit {bit}" for at, bit in flips)
    return sample, {**sample.files, ending: bytes(data)}, f"{ending or 'main'}: {words}"


def run(ask: Ask, part: Part) -> Tally:
    """The cases of a part."""
    tally = Tally(part)
    with folder() as at:
        for number in part.numbers:
            sample, files, how = damage(ask, part, number)
            wrong, seen = judged(at / "a", files, sample)
            tally.case(*seen)
            if wrong:
                tally.fail(number, f"{how}: {'; '.join(wrong)}")
    return tally
