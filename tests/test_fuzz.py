"""Mutated files for every parser: a valid object or a named error, at once, and nothing done but reading.

``pytest -m nightly -s tests/test_fuzz.py`` runs 20,000 for each and prints what came of them. A case is known
by its target, the seed and its number: ``mutant(target, seed, number)`` makes its bytes again. Cases that
went wrong once are kept in ``tests/data/fuzz`` as ``TARGET--WHAT``.
"""

from __future__ import annotations

import math
import time
import warnings
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lampyris
from lampyris import scen
from lampyris.errors import LampyrisError
from lampyris.maps import dob, json_text, yaml_text
from lampyris.maps.document import MapDocument
from lampyris.maps.json_text import read_json
from lampyris.maps.load import load_map
from lampyris.maps.movers_file import read_movers
from lampyris.maps.scenario import Scenario
from lampyris.maps.tracks import read_track
from lampyris.maps.way_file import Way, read_way
from lampyris.maps.yaml_text import read_yaml
from lampyris.maps.zones import read_zones
from lampyris.model.grid import Grid
from lampyris.model.movers import Movers
from lampyris.scenarios import completed, load_scenario, run, save_scenario
from lampyris.selfcheck.twins import corpora
from lampyris.selfcheck.twins.mutator import Corpus
from lampyris.selfcheck.twins.watching import memory, no_longer_than, watched
from lampyris.typing import Cell

BUNDLED = Path(lampyris.__file__).parent / "maps" / "data"
KEPT = Path(__file__).parent / "data" / "fuzz"
CPU_S = 1.0
NOISE = 4
"""In the everyday suite a case may take so many times its CPU time: other processes share the caches."""
MEMORY = 256 * 2**20
SEED = 20260
MAX_CELLS = 2**24


@dataclass(frozen=True)
class Target:
    """A parser: what its mutants are made from, how to call it, what its result must be like.

    Parameters
    ----------
    corpus : good files.
    file : what a mutant is called in its folder.
    call : given the file and a number from 0 on (to vary options by), reads it.
    check : asserts that a result is a valid object.
    beside : other files of the folder.
    codes : how many kinds of errors there are at least: a table of numbers has one.
    """

    corpus: Corpus
    file: str
    call: Callable[[Path, int], Any]
    check: Callable[[Any], None]
    beside: Mapping[str, bytes] = field(default_factory=dict)
    codes: int = 2


def read_map(path: Path, k: int) -> MapDocument:
    """A map, with each choice of options in turn; always as a stranger's."""
    numbers = path.suffix not in (".map", ".txt")
    values = "costmap" if k % (5 if numbers else 50) == 0 else "occupancy"
    return load_map(path, strict=True, values=values, colour="luminance" if k % 7 == 0 else "legend")


def read_ros_picture(path: Path, k: int) -> MapDocument:
    """The map whose picture the file is."""
    return read_map(path.with_suffix(".yaml"), k)


def check_map(found: MapDocument) -> None:
    check_grid(found.grid)
    grid = found.grid
    if found.occupancy is not None:
        assert -1 <= found.occupancy.min() <= found.occupancy.max() <= 100
        assert not grid.blocked[found.occupancy == 0].any()
        assert grid.terrain is not None or grid.blocked[found.occupancy != 0].all()
    for cell in (found.start, found.goal, *found.bodies):
        if cell is not None:
            assert grid.contains(cell)
            assert not grid.blocked[cell[1], cell[0]]
    for note in found.notes:
        check_words(note)


def check_grid(grid: Grid) -> None:
    assert grid.blocked.dtype == np.bool_
    assert grid.blocked.ndim == 2
    assert 0 < grid.blocked.size <= MAX_CELLS
    assert not grid.blocked.flags.writeable
    if grid.unknown is not None:
        assert (grid.blocked | ~grid.unknown).all(), "unknown counts as blocked"
    if grid.terrain is not None:
        assert grid.terrain.max() <= 252
        assert not grid.terrain[grid.blocked].any()
    assert 1e-6 <= grid.resolution <= 1000
    assert all(map(math.isfinite, grid.origin))


def check_scen(found: scen.Benchmark) -> None:
    check_map(found.document)
    assert found.queries
    for q in found.queries:
        assert found.document.grid.contains(q.start)
        assert found.document.grid.contains(q.goal)
        assert 0 <= q.length < 1e115
        assert q.bucket >= 0


def check_data(found: yaml_text.YamlDocument | json_text.JsonDocument) -> None:
    """Plain data, finite where it is JSON, and every value's place can be told."""
    left: list[tuple[tuple[str | int, ...], Any]] = [((), found.data)]
    n = 0
    while left:
        way, value = left.pop()
        n += 1
        if n < 100:
            check_words(found.at(*way))
        if isinstance(value, dict):
            assert all(isinstance(k, str) for k in value)
            left += [((*way, k), v) for k, v in value.items()]
        elif isinstance(value, list):
            left += [((*way, k), v) for k, v in enumerate(value)]
        else:
            assert value is None or type(value) in (bool, int, float, str)
            if isinstance(value, float) and isinstance(found, json_text.JsonDocument):
                assert math.isfinite(value)
    assert n <= yaml_text.MAX_VALUES


def check_track(found: tuple[Cell, ...]) -> None:
    assert found
    assert all(type(x) is int and type(y) is int for x, y in found)


PLAIN = Grid(np.zeros((6, 7), dtype=bool))
SMALL = Grid(np.zeros((2, 3), dtype=bool))


def read_way_file(path: Path, k: int) -> Way:
    """A way, in each unit; on a map."""
    way = read_way(path, (None, "metres", "cells")[k % 3])
    way.on(PLAIN)
    return way


def check_way(found: Way) -> None:
    assert found.points.ndim == 2
    assert found.points.shape[0] >= 1
    assert np.isfinite(found.points).all()
    assert np.abs(found.points).max() <= 1e9
    assert found.frame in ("metres", "cells")
    for note in found.notes:
        check_words(note)
    if found.map is None:
        assert np.isfinite(found.on(PLAIN)).all()


def check_movers(found: Movers) -> None:
    assert np.isfinite(found.xy).all()
    assert (found.radius >= 0).all()
    assert (found.top_speed >= 0).all()


def check_zones(found: tuple[Any, tuple[str, ...]]) -> None:
    zones, notes = found
    assert zones.shape == SMALL.blocked.shape
    assert (zones > 0).all()
    for note in notes:
        check_words(note)


def read_obstacles(path: Path, k: int) -> list[Any]:
    """The obstacles of a ``.dob``, and their tracks on some grid."""
    grid = Grid(np.zeros((6, 7), dtype=bool))
    made: list[Any] = []
    for number, one in enumerate(dob.read_dob(path.read_bytes(), path.name)):
        body, notes = dob.recorded(one, number, grid, 0.5 + k % 3, path.name)
        for note in notes:
            check_words(note)
        made.append(body)
    return made


def check_obstacles(found: list[Any]) -> None:
    assert all(b.track and 0 <= b.radius <= 1e6 for b in found)


def read_scenario(path: Path, k: int) -> Scenario:
    return load_scenario(path, max_cells=4096)


def check_scenario(found: Scenario) -> None:
    scene = found.scene
    check_grid(scene.grid)
    assert scene.grid.contains(scene.start)
    assert scene.grid.contains(scene.goal)
    assert 0 <= found.seed < 2**63
    for note in found.notes:
        check_words(note)


def check_words(words: str) -> None:
    """A sentence for a terminal: one line, nothing that a terminal obeys."""
    assert words.isprintable(), repr(words)
    assert len(words) < 1500, words


BESIDE = corpora.SCENARIO_BESIDE
TARGETS = {
    "png": Target(corpora.PNG, "m.png", read_map, check_map),
    "bmp": Target(corpora.BMP, "m.bmp", read_map, check_map),
    "pgm": Target(corpora.PGM, "m.pgm", read_map, check_map),
    "npy": Target(corpora.NPY, "m.npy", read_map, check_map),
    "csv": Target(corpora.CSV, "m.csv", read_map, check_map),
    "map": Target(corpora.MAP, "m.map", read_map, check_map),
    "text": Target(corpora.TEXT, "m.txt", read_map, check_map),
    "ros": Target(corpora.ROS, "m.yaml", read_map, check_map, {"m.pgm": corpora.ROS_PICTURE}),
    "ros-picture": Target(
        corpora.ROS_PICTURES, "m.pgm", read_ros_picture, check_map, {"m.yaml": corpora.ROS_YAML}
    ),
    "scen": Target(
        corpora.SCEN, "m.scen", lambda p, k: scen.load(p), check_scen, {"a.map": corpora.SCEN_MAP}
    ),
    "yaml": Target(corpora.YAML, "m.yaml", lambda p, k: read_yaml(p.read_bytes(), "m.yaml"), check_data),
    "json": Target(corpora.JSON, "m.json", lambda p, k: read_json(p.read_bytes(), "m.json"), check_data),
    "scenario-yaml": Target(corpora.SCENARIO_YAML, "s.yaml", read_scenario, check_scenario, BESIDE),
    "scenario-json": Target(corpora.SCENARIO_JSON, "s.json", read_scenario, check_scenario, BESIDE),
    "track": Target(corpora.TRACK, "t.csv", lambda p, k: read_track(p), check_track),
    "way": Target(corpora.WAY, "w.csv", read_way_file, check_way, codes=1),
    "way-json": Target(corpora.WAY_JSON, "w.json", read_way_file, check_way),
    "way-yaml": Target(corpora.WAY_YAML, "w.yaml", read_way_file, check_way),
    "movers": Target(corpora.MOVERS, "m.csv", lambda p, k: read_movers(p, PLAIN), check_movers, codes=1),
    "zones": Target(corpora.ZONES, "z.csv", lambda p, k: read_zones(p, SMALL, 1.0), check_zones),
    "zones-npy": Target(corpora.ZONES_NPY, "z.npy", lambda p, k: read_zones(p, SMALL, 1.0), check_zones),
    "dob": Target(corpora.DOB, "t.dob", read_obstacles, check_obstacles),
}


@dataclass
class Tally:
    """What came of a run."""

    name: str
    cases: int = 0
    read: int = 0
    refused: Counter[str] = field(default_factory=Counter)
    slowest: tuple[float, int] = (0.0, -1)
    grown: tuple[int, int] = (0, -1)
    cpu_s: float = 0.0

    def __str__(self) -> str:
        codes = ", ".join(f"{code} {n}" for code, n in self.refused.most_common())
        return (
            f"{self.name}: {self.cases:,} mutants, {self.read:,} read, {self.refused.total():,} refused; "
            f"slowest {self.slowest[0]:.3f} s (number {self.slowest[1]}), most memory "
            f"{self.grown[0] / 2**20:.1f} MiB (number {self.grown[1]}); {self.cpu_s:.0f} s in all; {codes}"
        )


def mutant(name: str, seed: int, number: int) -> bytes:
    """The bytes of one case."""
    rng = np.random.Generator(np.random.PCG64([*name.encode(), seed, number]))
    return TARGETS[name].corpus.mutant(rng)


def one(name: str, data: bytes, folder: Path, number: int, cpu_s: float) -> tuple[str, float, int]:
    """Read one file: the code of the error, or nothing if it was read; CPU time and memory it took."""
    target = TARGETS[name]
    path = folder / target.file
    path.write_bytes(data)
    found, problem = None, None
    with memory() as grown, warnings.catch_warnings(record=True) as warned, no_longer_than(10 * cpu_s):
        warnings.simplefilter("always")
        began = time.process_time()
        with watched(folder, BUNDLED) as seen:
            try:
                found = target.call(path, number)
            except LampyrisError as raised:
                problem = raised
        took = time.process_time() - began
    assert seen == []
    assert [str(w.message) for w in warned] == []
    if problem is None:
        target.check(found)
    else:
        assert problem.exit_code in (3, 5), problem
        assert str(problem).startswith(f"error[{problem.code}]: ")
        for words in (str(problem), *getattr(problem, "__notes__", ())):
            check_words(words)
    assert took < cpu_s
    assert grown[0] < MEMORY
    return problem.code if problem else "", took, grown[0]


def prepare(name: str, folder: Path) -> None:
    """Write what lies beside a mutant, and read good files, so that what is imported, is."""
    target = TARGETS[name]
    for file, data in target.beside.items():
        (folder / file).write_bytes(data)
    for number, data in enumerate((*target.corpus.seeds, b"", b"\0") * 2):
        (folder / target.file).write_bytes(data)
        try:
            target.call(folder / target.file, number)
        except LampyrisError:
            continue


def fuzz(name: str, folder: Path, cases: int, seed: int, cpu_s: float) -> Tally:
    """Read so many mutants."""
    prepare(name, folder)
    tally = Tally(name)
    began = time.process_time()
    for number in range(cases):
        data = mutant(name, seed, number)
        try:
            code, took, grown = one(name, data, folder, number, cpu_s)
        except BaseException as problem:
            problem.add_note(f"mutant({name!r}, {seed}, {number}) is {data[:2000]!r}")
            raise
        tally.cases += 1
        tally.read += not code
        tally.refused.update([code] * bool(code))
        tally.slowest = max(tally.slowest, (took, number))
        tally.grown = max(tally.grown, (grown, number))
    tally.cpu_s = time.process_time() - began
    return tally


def judge(tally: Tally) -> None:
    assert tally.read > tally.cases // 30, f"the mutations are too rough to tell anything: {tally}"
    assert tally.refused.total() > tally.cases // 10, str(tally)
    assert len(tally.refused) >= TARGETS[tally.name].codes, str(tally)


@pytest.mark.parametrize("name", TARGETS)
def test_mutants(tmp_path: Path, name: str) -> None:
    judge(fuzz(name, tmp_path, 300, SEED, NOISE * CPU_S))


@pytest.mark.nightly
@pytest.mark.parametrize("name", TARGETS)
def test_mutants_by_the_thousand(tmp_path: Path, name: str) -> None:
    tally = fuzz(name, tmp_path, 20_000, SEED + 1, CPU_S)
    print(f"\n{tally}")
    judge(tally)


@pytest.mark.parametrize("name", ["scenario-yaml", "scenario-json"])
def test_a_mutant_that_is_read_can_be_run_and_written(tmp_path: Path, name: str) -> None:
    prepare(name, tmp_path)
    path = tmp_path / TARGETS[name].file
    again = tmp_path / f"again{path.suffix}"
    done = Counter[str]()
    for number in range(500):
        path.write_bytes(mutant(name, SEED + 2, number))
        try:
            scenario = load_scenario(path, max_cells=4096)
        except LampyrisError:
            continue
        save_scenario(scenario, again)
        assert load_scenario(again, max_cells=4096) == completed(scenario)
        if scenario.simulated:
            scenario = replace(scenario, ticks=min(scenario.ticks or 20, 20))
        if scenario.drive is not None:
            # A period may be a millionth of a second.
            scenario = replace(scenario, drive={**scenario.drive, "time_limit": 3.0, "period": 0.2})
        try:
            run(scenario)  # with the referee
        except LampyrisError as raised:
            problem = raised
            assert problem.exit_code in (3, 5), problem
            check_words(str(problem))
            done[problem.code] += 1
        else:
            done["run"] += 1
    assert done["run"] > 20, done


@pytest.mark.parametrize("name", TARGETS)
def test_good_files_are_read(tmp_path: Path, name: str) -> None:
    prepare(name, tmp_path)
    refused = ("VALUES", "IMG_FORMAT", "IMG_DEPTH", "IMG_COLOUR", "IMG_ALPHA", "CSV_CELL", "NPY_VALUE")
    for data in TARGETS[name].corpus.seeds:
        code, _, _ = one(name, data, tmp_path, 1, NOISE * CPU_S)
        assert not code or code in refused, (code, data)


@pytest.mark.parametrize("path", sorted(KEPT.glob("*--*")), ids=lambda p: p.name)
def test_what_went_wrong_once(tmp_path: Path, path: Path) -> None:
    name = path.name.split("--")[0]
    prepare(name, tmp_path)
    for number in range(35):  # with each choice of options
        one(name, path.read_bytes(), tmp_path, number, NOISE * CPU_S)


def test_a_mutant_can_be_made_again() -> None:
    for name in TARGETS:
        made = [mutant(name, 1, k) for k in range(20)]
        assert made == [mutant(name, 1, k) for k in range(20)]
        assert len(set(made)) > 15
