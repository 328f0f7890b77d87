"""Maps in files: what is not said plainly is not free, and what is saved is read again as it was."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

import numpy as np

from lampyris.errors import InputError
from lampyris.io.maps.convert import convert, write_and_compare
from lampyris.io.maps.load import load_map
from lampyris.io.maps.map_hash import map_hash
from lampyris.model.grid import Grid
from lampyris.typing import BoolGrid
from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally
from lampyris_selfcheck.checks.files.maps_closed import SORTS, Sort, ros
from lampyris_selfcheck.checks.files.maps_drawn import HOLDS, drawn, facts
from lampyris_selfcheck.scratch import folder as scratch

KINDS = {
    "closed": Kind(
        "a small file of some sort, thresholds and ends of ranges on purpose: the cells are free that say so"
        " plainly, and no others",
        commit=300, nightly=190_000, release=1_900_000, chunk=950, least={"read": 0.6},
    ),
    "closed-ros": Kind(
        "a ROS map of any mode and thresholds, its picture grey and partly clear: free is what Nav2 calls 0",
        commit=200, nightly=20_000, release=200_000, chunk=500, least={"read": 0.9},
    ),
    "round-trip": Kind(
        "a random map written in some format and read again: the same map, and written again the same bytes",
        commit=100, nightly=120_000, release=600_000, chunk=600,
    ),
    "one-hash": Kind(
        "a random map written in all formats that can hold it: one hash",
        commit=40, nightly=10_000, release=100_000, chunk=100,
    ),
}  # fmt: skip


def run(ask: Ask, part: Part) -> Outcome:
    """Write and read the files of a part."""
    tally = Tally(part)
    case = {"closed": _closed, "closed-ros": _closed_ros, "round-trip": _round_trip, "one-hash": _one_hash}
    with scratch() as folder:
        for number in part.numbers:
            rng = ask.rng("maps", part.kind, number)
            try:
                case[part.kind](rng, number, folder, tally)
            except Exception as problem:
                what = f"{type(problem).__name__}: {problem}".replace(str(folder), "FOLDER")
                tally.fail(number, what)
    return tally.outcome()


# ---- fail closed --------------------


def _closed(rng: np.random.Generator, number: int, folder: Path, tally: Tally) -> None:
    name = list(SORTS)[number % len(SORTS)]
    sort = SORTS[name]
    width, height = (int(n) for n in rng.integers(1, 8, 2))
    data, may = sort.make(rng, width, height)
    path = folder / sort.file
    path.write_bytes(data)
    if sort.beside:
        path = folder / "m.yaml"
        path.write_text(sort.beside)
    _judge(path, data, may, sort, name, number, tally)


def _closed_ros(rng: np.random.Generator, number: int, folder: Path, tally: Tally) -> None:
    width, height = (int(n) for n in rng.integers(1, 8, 2))
    data, may, words = ros(rng, width, height)
    (folder / "m.pgm").write_bytes(data)
    path = folder / "m.yaml"
    path.write_text(words)
    _judge(path, data, may, Sort(lambda *_: (data, may), exact=False), "ROS", number, tally, words=words)


def _judge(
    path: Path, data: bytes, may: BoolGrid, sort: Sort, name: str, number: int, tally: Tally, **more: Any
) -> None:
    """Load it, and look for cells that are free and may not be."""
    try:
        grid = load_map(path, values=sort.values, colour=sort.colour).grid
    except InputError:
        tally.case(f"{name}: refused")
        return
    free = ~grid.blocked
    tally.case(f"{name}: read", "read")
    tally.count("free cells", int(free.sum()))
    tally.count("other cells", int((~free).sum()))
    told = {"file": base64.b64encode(data).decode(), "sort": name, **more}
    if free.shape != may.shape:
        tally.fail(number, f"{name}: {free.shape} cells, not {may.shape}", **told)
    elif (wrong := free & ~may).any():
        y, x = np.argwhere(wrong)[0]
        tally.fail(number, f"{name}: ({x}, {y}) is free", **told)
    elif sort.exact and not free[may].all():
        y, x = np.argwhere(may & ~free)[0]
        tally.fail(number, f"{name}: ({x}, {y}) is not free", **told)
    elif grid.unknown is not None and (free & grid.unknown).any():
        tally.fail(number, f"{name}: an unknown cell is free", **told)


# ---- there and back --------------------


def _round_trip(rng: np.random.Generator, number: int, folder: Path, tally: Tally) -> None:
    ending, values = list(HOLDS)[number % len(HOLDS)]
    before = drawn(rng, HOLDS[ending, values], shared=ending == ".yaml")
    path = folder / f"m{ending}"
    done = write_and_compare(before, path, values=values)
    tally.case(f"{ending} {values}")
    was = facts(before)
    told = {"map": was, "ending": ending, "values": values}
    found = facts(load_map(path, values=values))
    if other := [what for what in was if found[what] != was[what]]:
        tally.fail(number, f"{ending}, {values}: {', '.join(other)} came back otherwise", **told)
        return
    if done.lost or done.hash != map_hash(before.grid) or facts(done.document) != was:
        tally.fail(number, f"{ending}, {values}: it says that {done.lost or 'it is another map'}", **told)
    (folder / "again").mkdir(exist_ok=True)
    again = convert(path, folder / "again" / path.name, values=values, to_values=values)
    same = all(file.read_bytes() == (folder / file.name).read_bytes() for file in again.files)
    if again.lost or not same:
        tally.fail(number, f"{ending}, {values}: written again it is another file", **told)


def _one_hash(rng: np.random.Generator, number: int, folder: Path, tally: Tally) -> None:
    wanted = frozenset(what for what in ("unknown", "terrain") if rng.integers(0, 2))
    before = drawn(rng, wanted, shared=True)
    there = {what for what in wanted if facts(before)[what] is not None}
    ways = [way for way, holds in HOLDS.items() if there <= holds]
    hashes = {way: write_and_compare(before, folder / f"m{way[0]}", values=way[1]).hash for way in ways}
    tally.case("with " + " and ".join(sorted(there)) if there else "plain")
    tally.count("files", len(ways))
    own = map_hash(before.grid)
    if other := [" ".join(way) for way, found in hashes.items() if found != own]:
        tally.fail(number, f"another hash from {', '.join(other)}", map=facts(before))
    if _changed_hash(rng, before.grid) == own:
        tally.fail(number, "a map with one cell changed has the same hash", map=facts(before))


def _changed_hash(rng: np.random.Generator, grid: Grid) -> str:
    """The hash of the map with one cell turned."""
    blocked = grid.blocked.copy()
    y, x = (int(rng.integers(n)) for n in blocked.shape)
    blocked[y, x] ^= True
    unknown = None if grid.unknown is None else grid.unknown & blocked
    return map_hash(Grid(blocked, unknown, grid.resolution, grid.origin, terrain=grid.terrain))


CHECK = Check(
    "maps",
    ("G23", "G25"),
    "what a map does not say plainly is not free; what is saved is read again as it was, in every format",
    KINDS,
    run,
)
