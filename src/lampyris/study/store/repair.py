"""Repair: a new store with every run of a damaged one whose seal holds; the damaged one is kept."""

from __future__ import annotations

import mmap
import os
import shutil
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lampyris.errors import FileError, LampyrisError
from lampyris.study.design.serialize import differing, study_plain
from lampyris.study.design.study import Study, canonical
from lampyris.study.design.study_map import pack
from lampyris.study.store.carve import carved
from lampyris.study.store.file import check_pages, count_of, loaded, real, sidecar, snapshot, speaking
from lampyris.study.store.lock import Witness, held, witness_of
from lampyris.study.store.new_store import check_folder, write_new
from lampyris.study.store.row_record import unpacked
from lampyris.study.store.store import Store

KEPT = ".damaged"


@dataclass(frozen=True, slots=True)
class Repaired:
    """What came of a repair.

    Parameters
    ----------
    kept : runs that are in the new store.
    lost : runs that were stored and are not; as many as are known of.
    notes : what else there is to say, a sentence each.
    """

    kept: int
    lost: int
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class _Salvage:
    """What was found: the study and its maps as JSON, runs by key, and how many it says there were."""

    study: str | None
    maps: Mapping[str, str]
    runs: Mapping[str, tuple[str, ...]]
    count: int | None


def repair(
    path: str | os.PathLike[str], out: str | os.PathLike[str] | None = None, *, study: Study | None = None
) -> Repaired:
    """Write a new store with all that can be saved of a damaged one; what is lost can then be run again.

    Parameters
    ----------
    path : of the damaged store.
    out : where the new one goes; None: in its place, and the damaged one is kept beside it, its name followed
        by ``.damaged``.
    study : needed when the study in the store, or a map of it, is damaged itself.

    Raises
    ------
    FileError : STORE_READ: no such file; STORE_EXISTS: something is at ``out``; STORE_BUSY; STORE_WRITE;
        STORE_STUDY: the study is damaged and none was given, or that one is another; STORE_FORMAT: nothing
        of a store is in it.
    """
    place = real(path)
    target = place if out is None else real(out)
    with speaking(target, "write"):
        return _repaired(place, target, out is None, study)


def _repaired(place: Path, target: Path, here: bool, study: Study | None) -> Repaired:
    if not here and target.exists():
        raise FileError("STORE_EXISTS", "the file exists", where=str(target))
    log = sidecar(place, "-wal")
    if not (place.is_file() or log.is_file()):
        what = "not a regular file" if place.exists() else "no such file"
        raise FileError("STORE_READ", what, where=str(place))
    check_folder(target)
    with ExitStack() as holds:
        hold = holds.enter_context(held(place))
        found = _salvaged(place, log)
        if found == _Salvage(None, {}, {}, None):
            raise FileError("STORE_FORMAT", "nothing of a store is in it", where=str(place))
        stored, notes = _expected(place, found)
        if here and not notes and _is_sound(place, found):
            return Repaired(len(found.runs), 0, ("nothing is damaged; nothing was changed",))
        text, maps = _study(place, found, study)
        keep, more = _of_study(found, study)
        if target != place:
            hold = holds.enter_context(held(target))
        kept: list[Path] = []
        with speaking(target, "write"):
            before = None if target != place else lambda: kept.append(_set_aside(place, log))
            tally = write_new(target, text, maps, keep, before=before)
            if target == place:
                log.unlink(missing_ok=True)
            hold.start(tally)
            hold.release(remove=True)
    aside = tuple(f"the damaged store is kept as {one.name}" for one in kept)
    return Repaired(tally.count, stored - len(found.runs), notes + more + aside)


def _salvaged(place: Path, log: Path) -> _Salvage:
    """All records in both files whose seals hold; of runs with one key, the first."""
    study: str | None = None
    maps: dict[str, str] = {}
    runs: dict[str, tuple[str, ...]] = {}
    counts: list[int] = []
    with speaking(place, "read"), _bytes_of(place) as main, _bytes_of(log) as more:
        for table, texts in carved(main, more):
            if table == "runs":
                if not isinstance(unpacked(texts[1:]), str):
                    runs.setdefault(texts[1], texts)
            elif table == "maps":
                maps[texts[1]] = texts[2]
            elif table == "tally":
                counts += [count for count in (count_of(texts[1]),) if count is not None]
            elif texts[1] == "study":
                study = texts[2]
    return _Salvage(study, maps, runs, max(counts, default=None))


@contextmanager
def _bytes_of(path: Path) -> Iterator[bytes]:
    """The bytes of a file, not all in memory at once; none if it is not there, or empty."""
    if not path.is_file() or not path.stat().st_size:
        yield b""
        return
    with path.open("rb") as file:
        data = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        try:
            yield data  # type: ignore[misc]  # all that is asked of it, it does as bytes do
        finally:
            with suppress(BufferError):  # an error on its way holds on to it
                data.close()


def _expected(place: Path, found: _Salvage) -> tuple[int, tuple[str, ...]]:
    """How many runs there were, and what to say if that is not known, or more than were found."""
    said = [] if found.count is None else [found.count]
    with suppress(LampyrisError):
        said.append((witness_of(place) or Witness()).count)
    stored = max([*said, len(found.runs)])
    notes: tuple[str, ...] = ()
    if stored > len(found.runs):
        notes = (f"{stored - len(found.runs):,} runs are lost; `lampyris study` runs them again",)
    elif found.count is None:
        notes = ("how many runs there were cannot be read; there may have been more",)
    return stored, notes


def _is_sound(place: Path, found: _Salvage) -> bool:
    """Whether SQLite reads the same runs, and the study, without a fault."""
    try:
        with snapshot(place) as connection:
            check_pages(connection, place)
        with Store.open(place, writable=False) as store:
            text, maps = _study(place, found, None)
            return (
                canonical(store.plain()).decode() == text
                and store.maps() == maps
                and store.keys() == {*found.runs}
            )
    except LampyrisError:
        return False


def _study(place: Path, found: _Salvage, study: Study | None) -> tuple[str, Mapping[str, str]]:
    """The study and its maps as JSON: those found, or those of the study that was given.

    Raises
    ------
    FileError : STORE_STUDY.
    """
    plain = _table(place, found.study)
    asked = None if plain is None else _asked_maps(plain)
    if asked is None:
        plain = None
    elif found.study is not None and all(key in found.maps for key in asked):
        return found.study, {key: found.maps[key] for key in asked}
    if study is None:
        what = "the study in it is damaged" if plain is None else "a map in it is damaged"
        raise FileError("STORE_STUDY", what, where=str(place), todo="give the study's file too")
    if plain is not None and (other := differing(plain, study_plain(study))):
        raise FileError("STORE_STUDY", f"made for another study, which differs in {other}", where=str(place))
    maps = {key: canonical(pack(ground.grid)).decode("ascii") for key, ground in study.grounds.items()}
    return canonical(study_plain(study)).decode("ascii"), maps


def _table(place: Path, text: str | None) -> Mapping[str, Any] | None:
    """The study found, if it is a table: a seal alone does not make it one."""
    if text is not None:
        with suppress(LampyrisError):
            return loaded(place, "the study", text)
    return None


def _asked_maps(plain: Mapping[str, Any]) -> list[str] | None:
    """Hashes of the maps that a study names; None if it does not say."""
    maps = plain.get("maps")
    if not isinstance(maps, list) or not maps:
        return None
    hashes = [one["hash"] for one in maps if isinstance(one, dict) and isinstance(one.get("hash"), str)]
    return hashes if len(hashes) == len(maps) else None


def _of_study(found: _Salvage, study: Study | None) -> tuple[list[tuple[str, ...]], tuple[str, ...]]:
    """The runs to be kept. Of a study that was given, those of its jobs: it may be another than it was."""
    if study is None or found.study is not None:
        return list(found.runs.values()), ()
    jobs = {job.key for job in study.jobs()}
    keep = [texts for key, texts in found.runs.items() if key in jobs]
    others = len(found.runs) - len(keep)
    notes = (f"{others:,} runs are not of the study that was given; they were left out",) if others else ()
    return keep, notes


def _set_aside(place: Path, log: Path) -> Path:
    """Give the damaged files second names; the name of the main one.

    The first names stay until the new store takes the main one's, and the log goes last. Killed before that,
    nothing has changed; killed between, the new store stands beside the old log, which is damage that another
    repair finds, and nothing is lost.
    """
    k = 1
    while any(sidecar(place, f"{_numbered(k)}{e}").exists() for e in ("", "-wal")):
        k += 1
    kept = sidecar(place, _numbered(k))
    for old, new in ((place, kept), (log, sidecar(kept, "-wal"))):
        if old.exists():
            try:
                new.hardlink_to(old)
            except OSError:  # not every file system has second names
                shutil.copyfile(old, new)
    return kept


def _numbered(k: int) -> str:
    return KEPT if k == 1 else f"{KEPT}-{k}"
