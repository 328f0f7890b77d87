"""Damaged stores: bits turned, pages overwritten, files cut; and what must come of them.

Two stores are damaged: one that was closed, and one as a killed writer leaves it, with runs in its log.
Whatever is read must be what was stored. Of the main file nothing may be missed; a log whose end is damaged
ends earlier for SQLite, so that its last calls are run again.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from math import gcd
from pathlib import Path
from typing import TypeVar

from lampyris.errors import InternalFault, LampyrisError
from lampyris.study.design.row import Row
from lampyris.study.store.repair import repair
from lampyris.study.store.row_record import packed
from lampyris.study.store.store import Store, open_for
from lampyris_selfcheck.check import Ask
from lampyris_selfcheck.checks.studies.stores import (
    Files,
    bytes_of,
    clear,
    filled,
    left_open,
    put,
    rows,
    study,
)
from lampyris_selfcheck.scratch import folder

T = TypeVar("T")
SEEDS = 7
"""Of the study: 28 jobs."""
CLOSED, MAIN, CALL = 24, 8, 4
"""Rows of the closed store; rows of the open one that are in its main file; rows of a call."""
PAGE = 4096
FRAME = PAGE + 24
"""Bytes of a page in the log with its head."""
REFUSED = frozenset((
    "STORE_DAMAGED", "STORE_FORMAT", "STORE_VERSION", "STORE_READ", "STORE_WRITE",
    "STUDY_PLAIN", "STUDY_MAP", "PACKED_MAP",
))  # fmt: skip
"""What using a damaged store may report. STORE_WRITE: of a version that its SQLite may read and not write."""


@dataclass(frozen=True)
class Sample:
    """A store that is whole: its bytes by ending, its rows in order, and the row that is damaged bit by bit."""

    files: Files
    right: list[Row]
    row: Row | None = None

    @property
    def by_key(self) -> dict[str, Row]:
        """The rows by key."""
        return {row.key: row for row in self.right}


@cache
def closed() -> Sample:
    """A store of 24 rows that was closed; some are longer than a page."""
    with folder() as at:
        given = rows(study(SEEDS), words=5000)[:CLOSED]
        filled(at / "a", study(SEEDS), 7, given)
        files = bytes_of(at / "a")
    return Sample(files, given, next(row for row in given[5:] if not row.error))


@cache
def opened() -> Sample:
    """A store as a killed writer leaves it: 8 rows in its main file, 20 in the log, four a call."""
    with folder() as at:
        files, given = left_open(at / "a", study(SEEDS), CALL, closed=MAIN)
    files.pop(".lock")  # it may be there, and says nothing
    return Sample(files, given)


# ---- what must come of one --------------------


class _Wrong(Exception):
    """Something that must not be."""


def judged(path: Path, files: Files, sample: Sample, lost: Row | None = None) -> tuple[list[str], list[str]]:
    """Read a damaged store, write to it and repair it: each time right rows, or a typed error.

    Parameters
    ----------
    path : where it is put.
    files : its bytes as they are now.
    sample : what it was.
    lost : the only row that may be lost, where that is known.

    Returns
    -------
    What is wrong, in words; and what was seen of it.
    """
    wrong: list[str] = []
    in_log = files.get("-wal") != sample.files.get("-wal")
    put(path, files)
    reads = _does(wrong, "reading", lambda: _read(path, sample, in_log))
    after = bytes_of(path)
    if any(after.get(ending) != files.get(ending) for ending in ("", "-wal")):
        wrong.append("reading changed it")
    put(path, files)
    writes = _does(wrong, "resuming", lambda: _resume(path, sample, in_log))
    if writes and not reads:
        wrong.append("it could be written to, and not be read")
    if reads and lost is not None:
        wrong.append("a damaged run was read")
    put(path, files)
    repairs = _does(wrong, "repair", lambda: _repair(path, sample, in_log, lost))
    if not repairs and lost is not None:
        wrong.append("repair was refused")
    clear(path.parent)
    return wrong, [
        "read whole" if reads else "refused",
        *(["read, and may not be added to"] if reads and not writes else []),
        *([] if repairs else ["not repaired"]),
    ]


def _does(wrong: list[str], doing: str, do: Callable[[], None]) -> bool:
    """Whether it was done; a refusal must be typed, of one line, and one of those."""
    try:
        do()
    except _Wrong as fault:
        wrong.append(f"{doing}: {fault}")
    except LampyrisError as error:
        if isinstance(error, InternalFault) or error.code not in REFUSED or not str(error).isprintable():
            wrong.append(f"{doing}: {error!s:.300}")
    except Exception as fault:
        wrong.append(f"{doing}: {type(fault).__name__}: {fault!s:.300}")
    else:
        return True
    return False


def _check_rows(found: list[Row], sample: Sample, in_log: bool) -> None:
    """All rows in order; where the log is damaged, those of the first calls."""
    right = sample.right[: len(found)] if in_log and len(found) % CALL == 0 else sample.right
    if found != right or (in_log and len(found) < MAIN):
        raise _Wrong(f"{len(found)} rows that are not the {len(sample.right)} that were stored")


def _read(path: Path, sample: Sample, in_log: bool) -> None:
    with Store.open(path, writable=False) as store:
        _check_rows(list(store.rows().values()), sample, in_log)
        if len(store.study()) != 4 * SEEDS:
            raise _Wrong(f"its study has {len(store.study())} jobs")


def _resume(path: Path, sample: Sample, in_log: bool) -> None:
    """Open it as a study that is resumed does, add what is missing, and read it again."""
    all_ = rows(study(SEEDS), words=0 if in_log or "-wal" in sample.files else 5000)
    with open_for(path, study(SEEDS)) as store:
        found = store.rows()
        _check_rows(list(found.values()), sample, in_log)
        more = [row for row in all_ if row.key not in found]
        store.add(more)
    with Store.open(path, writable=False) as store:
        if list(store.rows().values()) != [*found.values(), *more]:
            raise _Wrong("what was added is not there, or not alone")


def _repair(path: Path, sample: Sample, in_log: bool, lost: Row | None) -> None:
    """Repair keeps right rows only and names the others; then the study can be resumed."""
    came = repair(path, study=study(SEEDS))
    with open_for(path, study(SEEDS)) as store:
        kept = store.rows()
        if any(sample.by_key.get(key) != row for key, row in kept.items()):
            raise _Wrong("a row that was never stored")
        known = not in_log and not any("there may have been more" in note for note in came.notes)
        if came.kept != len(kept) or (known and came.kept + came.lost != len(sample.right)):
            raise _Wrong(f"says {came.kept} kept, {came.lost} lost of {len(sample.right)}; {len(kept)} kept")
        if lost is not None and came.lost_runs != (lost.key,):
            raise _Wrong(f"lost {came.lost_runs}, not run {lost.key}")
        store.add(sample.right)
        if store.rows() != sample.by_key:
            raise _Wrong("repaired and resumed, it has not all rows")


# ---- the damage --------------------


def bits() -> int:
    """Cases of the kind ``bit``."""
    return 8 * len(_record())


def pages() -> int:
    """Cases of the kind ``page``."""
    return len(_pages())


def damage(ask: Ask, kind: str, number: int, at: Path) -> tuple[list[str], str]:
    """A damaged store: what was seen of it, and what is wrong."""
    sample, files, how, lost = _DAMAGE[kind](ask, number)
    wrong, seen = judged(at / "a", files, sample, lost)
    return seen, f"{how}: {'; '.join(wrong)}" if wrong else ""


_Case = tuple[Sample, dict[str, bytes], str, Row | None]


@cache
def _record() -> tuple[int, ...]:
    """Where the texts of one record are in the closed store, its checksum too."""
    sample = closed()
    assert sample.row is not None
    texts = "".join(packed(sample.row)).encode()
    at = sample.files[""].index(texts)
    return tuple(range(at, at + len(texts)))


_CHANGES = ("zeros", "ones", "another page", "one record fewer")
"""What is done to a page."""


@cache
def _pages() -> tuple[tuple[str, int, int], ...]:
    """File, place of the page, and what is done to it: see :data:`_CHANGES`."""
    places = [
        *(("", at) for at in range(0, len(closed().files[""]), PAGE)),
        *(("-wal", at + 24) for at in range(32, len(opened().files["-wal"]), FRAME)),
    ]
    return tuple((ending, at, what) for ending, at in places for what in range(len(_CHANGES)))


def _bit(ask: Ask, number: int) -> _Case:
    at, bit = divmod(_spread(range(bits()), number), 8)
    return *_flipped(closed(), "", [(_record()[at], bit)]), closed().row


def _page(ask: Ask, number: int) -> _Case:
    ending, at, what = _spread(_pages(), number)
    sample = opened() if ending else closed()
    data = bytearray(sample.files[ending])
    step = FRAME if ending else PAGE
    before = data[at - step : at - step + PAGE] if at > step else data[-PAGE:]
    count = at + 4 + 100 * (not ending and at == 0)
    fewer = data[at:count] + bytes([max(data[count] - 1, 0)]) + data[count + 1 : at + PAGE]
    data[at : at + PAGE] = (bytes(PAGE), b"\xff" * PAGE, before, fewer)[what]
    words = f"{ending} page at {at}: {_CHANGES[what]}"
    return sample, {**sample.files, ending: bytes(data)}, words, None


def _cut(ask: Ask, number: int) -> _Case:
    rng = ask.rng("store", "cut", number)
    ending = ("", "-wal")[number % 2]
    sample = opened() if ending else closed()
    size = int(rng.integers(len(sample.files[ending])))
    return (
        sample,
        {**sample.files, ending: sample.files[ending][:size]},
        f"{ending} cut to {size} bytes",
        None,
    )


def _noise(ask: Ask, number: int) -> _Case:
    """One to three bits; a third of them where one bit decides most: heads of the file, pages and frames."""
    rng = ask.rng("store", "noise", number)
    ending = ("", "", "-wal")[int(rng.integers(3))]
    sample = opened() if ending or rng.integers(4) == 0 else closed()
    size, step = len(sample.files[ending]), FRAME if ending == "-wal" else PAGE
    places = rng.integers(0, size, int(rng.integers(1, 4)))
    if rng.integers(3) == 0:
        places = rng.integers(0, size // step, 1) * step + rng.integers(0, 30 if rng.integers(2) else 110, 1)
    turned = rng.integers(0, 8, len(places))
    return *_flipped(sample, ending, list(zip(places.tolist(), turned.tolist(), strict=True))), None


_DAMAGE = {"bit": _bit, "page": _page, "cut": _cut, "noise": _noise}


def _spread(items: Sequence[T], number: int) -> T:
    """The items in an order in which the first of them are from all over: by the golden section."""
    n = len(items)
    step = max(int((5**0.5 - 1) / 2 * n), 1)
    while gcd(step, n) > 1:
        step += 1
    return items[number * step % n]


def _flipped(
    sample: Sample, ending: str, turned: list[tuple[int, int]]
) -> tuple[Sample, dict[str, bytes], str]:
    data = bytearray(sample.files[ending])
    for at, bit in turned:
        data[at] ^= 1 << bit
    words = ", ".join(f"byte {at} bit {bit}" for at, bit in turned)
    return sample, {**sample.files, ending: bytes(data)}, f"{ending or 'main'}: {words}"
