"""Formats by drawn values: what is written is read again; whatever is read is an object or a typed refusal.

Hypothesis looks for the smallest example that breaks a law. The draws are the same at each run.
"""

from __future__ import annotations

import json
import math
import string
from contextlib import suppress
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import lampyris
from lampyris import io
from lampyris.errors import LampyrisError
from lampyris.io.maps.formats.document import MapDocument
from lampyris.io.maps.formats.movingai import ScenQuery, read_scen, write_scen
from lampyris.io.maps.load import load_map
from lampyris.io.maps.save import save_map
from lampyris.io.paths import read_path_points
from lampyris.io.scenario.save import json_of, yaml_of
from lampyris.io.text.strict_json import read_json
from lampyris.io.text.strict_yaml import read_yaml
from lampyris.model.grid import MAX_TERRAIN, Grid
from lampyris.scenarios import completed

pytestmark = pytest.mark.usefixtures("_here")
FIXED = settings(derandomize=True, database=None, deadline=None, max_examples=60)
"""The same draws everywhere, none remembered; the machine's pace decides nothing."""
READERS = Path(io.__file__).parent

# Hypothesis also draws the constants that it finds in the source of all modules that happen to be imported: the draws
# depended on which tests had run before, and each worker parsed a thousand files, 4.4 s of CPU time. Now those of all readers.
for module in walk_packages(io.__path__, f"{io.__name__}."):
    import_module(module.name)
with suppress(ImportError, AttributeError):  # versions of Hypothesis that draw no such constants
    from hypothesis.internal.conjecture import providers

    providers.is_local_module_file  # noqa: B018
    providers.is_local_module_file = lambda path: READERS in Path(path).parents


@pytest.fixture(scope="module")
def _here(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """A folder for all examples of this file: each writes its own over the last."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("formats"))
        yield


# ---- written, then read --------------------


@st.composite
def grids(draw: st.DrawFn, *, unknown: bool = False, terrain: bool = False) -> Grid:
    """A grid of up to 9 x 9 cells."""
    height, width = draw(st.integers(1, 9)), draw(st.integers(1, 9))

    def cells(of: st.SearchStrategy[int]) -> Any:
        size = height * width
        return np.array(draw(st.lists(of, min_size=size, max_size=size))).reshape(height, width)

    kind = cells(st.integers(0, 2 if unknown else 1))
    rough = cells(st.integers(0, MAX_TERRAIN)) if terrain else None
    hidden = kind == 2
    return Grid(kind > 0, unknown=hidden, terrain=rough)


def same(found: MapDocument, grid: Grid) -> None:
    assert np.array_equal(found.grid.blocked, grid.blocked)
    for was, now in ((grid.unknown, found.grid.unknown), (grid.terrain, found.grid.terrain)):
        nothing = np.zeros_like(grid.blocked)
        assert np.array_equal(nothing if was is None else was, nothing if now is None else now)


@pytest.mark.nightly
@pytest.mark.parametrize("ending", [".txt", ".csv", ".npy", ".pgm", ".png"])
@FIXED
@given(data=st.data())
def test_unknown_cells_are_read_as_they_were_written(ending: str, data: st.DataObject) -> None:
    grid = data.draw(grids(unknown=True))
    save_map(grid, f"m{ending}")
    same(load_map(f"m{ending}"), grid)


@pytest.mark.nightly
@FIXED
@given(grid=grids())
def test_a_map_of_movingai_is_read_as_it_was_written(grid: Grid) -> None:
    save_map(grid, "m.map")
    same(load_map("m.map"), grid)


@FIXED
@given(grid=grids(terrain=True))
def test_terrain_is_read_as_it_was_written(grid: Grid) -> None:
    save_map(grid, "t.csv")
    bare = None if grid.terrain is None else np.where(grid.blocked, 0, grid.terrain)  # a wall has no ground
    same(load_map("t.csv"), replace(grid, terrain=bare))


@FIXED
@given(data=st.data(), grid=grids())
def test_lines_of_a_scen_are_read_as_they_were_written(data: st.DataObject, grid: Grid) -> None:
    cell = st.tuples(st.integers(0, grid.width - 1), st.integers(0, grid.height - 1))
    # Eight decimals are written: of whole hundred-millionths nothing is lost.
    length = st.integers(0, 10**10).map(lambda n: n / 10**8)
    line = st.builds(
        ScenQuery, line=st.just(2), bucket=st.just(0), map=st.just(""), width=st.just(1), height=st.just(1),
        start=cell, goal=cell, length=length, decimals=st.just(8),
    )  # fmt: skip
    asked = data.draw(st.lists(line, max_size=8))
    write_scen("m.scen", asked, map_name="m.map", grid=grid)
    found = read_scen("m.scen")
    assert [(q.start, q.goal, q.length) for q in found] == [(q.start, q.goal, q.length) for q in asked]
    assert all((q.map, q.width, q.height) == ("m.map", grid.width, grid.height) for q in found)


KEYS = st.text(string.ascii_letters, min_size=1, max_size=6)
LEAVES = (
    st.none()
    | st.booleans()
    | st.integers(-(10**18), 10**18)
    | st.floats(allow_nan=False, allow_infinity=False, width=64)
    | st.text(st.characters(codec="utf-8", exclude_categories=("Cc", "Cs")), max_size=12)
)
TABLES = st.dictionaries(
    KEYS,
    st.recursive(LEAVES, lambda part: st.lists(part, max_size=3) | st.dictionaries(KEYS, part, max_size=3)),
    max_size=5,
)


@pytest.mark.nightly
@FIXED
@given(table=TABLES)
def test_json_is_read_as_any_writer_writes_it(table: dict[str, Any]) -> None:
    for text in (json.dumps(table), json.dumps(table, ensure_ascii=False, indent=1)):
        found = read_json(text.encode(), "m").data
        assert found == table
        assert json.dumps(found) == json.dumps(table)  # 1, 1.0 and True are not the same


NUMBERS = st.from_regex(r"-?[1-9][0-9]{0,3}(\.[0-9]{1,3})?[eE][+-]?[0-9]{1,3}", fullmatch=True)


@pytest.mark.nightly
@settings(FIXED, max_examples=300)
@given(number=NUMBERS)
def test_a_number_of_json_is_the_nearest_double_or_refused_if_there_is_none(number: str) -> None:
    text = b'{"a": %s}' % number.encode()
    if math.isinf(float(number)):
        with pytest.raises(LampyrisError, match="JSON_NUMBER"):
            read_json(text, "m")
    else:
        assert read_json(text, "m").data["a"] == float(number)


@st.composite
def scenarios(draw: st.DrawFn) -> lampyris.Scenario:
    """A scenario on rows of its own, any ends, any robot, one of two planners."""
    grid = draw(grids(unknown=True))
    cell = st.tuples(st.integers(0, grid.width - 1), st.integers(0, grid.height - 1))
    positive = st.floats(1e-6, 1e6)
    robot = lampyris.Robot(0.0, draw(positive), draw(positive), draw(positive))
    label = st.text(st.characters(codec="utf-8", exclude_categories=("C", "Z")), max_size=20)
    grid = replace(grid, resolution=draw(st.floats(1e-3, 1e3)), name="room")
    moves = draw(st.sampled_from(["octile", "dissertation", "four-connected", "sixteen-connected"]))
    scene = lampyris.Scene(grid, draw(cell), draw(cell), moves=moves, robot=robot)
    who: dict[str, Any] = {"planner": "astar", "settings": {}}
    if draw(st.booleans()):
        rho = draw(st.floats(1e-9, 1, exclude_max=True))
        who = {"planner": "ad-gso", "settings": {"nt": draw(st.integers(1, 99)), "rho": rho}}
    return lampyris.Scenario(scene, **who, seed=draw(st.integers(0, 2**63 - 1)), name=draw(label))


@pytest.mark.nightly
@pytest.mark.parametrize("ending", [".json", ".yaml"])
@FIXED
@given(scenario=scenarios())
def test_a_scenario_is_read_as_it_was_written(ending: str, scenario: lampyris.Scenario) -> None:
    lampyris.save_scenario(scenario, f"s{ending}")
    assert lampyris.load_scenario(f"s{ending}") == completed(scenario)


@FIXED
@given(text=st.text(st.characters(codec="utf-8", exclude_categories=("Cc", "Cs", "Zl", "Zp")), max_size=30))
def test_a_text_within_a_scenario_is_itself_again(text: str) -> None:
    assert read_json(json_of({"name": text}).encode(), "s").data == {"name": text}
    assert read_yaml(yaml_of({"name": text}).encode(), "s").data == {"name": text}


# ---- read, whatever it is --------------------


def bits_of(*words: str) -> st.SearchStrategy[bytes]:
    """Pieces of a format among any bytes: a reader is past its first look with some of them."""
    piece = st.sampled_from([word.encode("latin-1") for word in words]) | st.binary(max_size=4)
    return st.lists(piece, max_size=24).map(b"".join) | st.binary(max_size=200)


ROWS = (
    ".",
    "#",
    "?",
    "S",
    "G",
    "@",
    "\n",
    "\r\n",
    "...\n...\n",
    "#.#\n",
    "\ufeff".encode().decode("latin-1"),
)
MAPS: dict[str, tuple[str, ...]] = {
    ".txt": ROWS,
    ".csv": ("0", "1", "-1", ",", "\n", "0,1\n", '"', "1e3", " ", "254"),
    ".map": ("type octile\n", "height 2\n", "width 2\n", "map\n", "..\n", "@T\n", "height ", "9" * 12),
    ".pgm": ("P5", "P2", " ", "\n", "1", "2", "255", "65535", "# c\n", "P5 1 1 255\n", "\xff"),
    ".png": ("\x89PNG\r\n\x1a\n", "\0\0\0\rIHDR", "\0\0\0\1", "IDAT", "IEND", "\x08\0\0\0\0"),
    ".npy": (
        "\x93NUMPY\1\0",
        "v\0",
        "{'descr': '|b1', ",
        "'fortran_order': False, ",
        "'shape': (1, 1), }",
        "\n",
    ),
    ".yaml": ("image: m.pgm\n", "resolution: 1\n", "origin: [0, 0, 0]\n", "negate: 0\n", "a: ", "- ", "|"),
}
SAID = ("version: 1\n", "map: guide\n", '{"version": 1', ', "map": ', '"guide"', "}", "[", "]",
        "start: [0, 9]\n", "goal: [7, 0]\n", "seed: ", "1e999", "&a ", "*a", "\\ud800", "'", ":",
        "\t")  # fmt: skip


@pytest.mark.commit(1)
@pytest.mark.parametrize("ending", MAPS)
@FIXED
@given(data=st.data())
def test_any_bytes_are_a_map_or_a_refusal(ending: str, data: st.DataObject) -> None:
    path = Path(f"any{ending}")
    path.write_bytes(data.draw(bits_of(*MAPS[ending])))
    try:
        found = load_map(path, max_cells=4096)
    except LampyrisError:
        return  # nothing else may come out of it
    assert found.grid.blocked.dtype == bool
    assert 0 < found.grid.blocked.size <= 4096
    if found.grid.unknown is not None:  # what is not known is not free
        assert not (found.grid.unknown & ~found.grid.blocked).any()


@pytest.mark.parametrize("ending", [".json", ".yaml"])
@FIXED
@given(data=st.data())
def test_any_text_is_a_scenario_or_a_refusal(ending: str, data: st.DataObject) -> None:
    path = Path(f"any-said{ending}")
    path.write_bytes(
        data.draw(bits_of(*SAID) | st.text(max_size=80).map(lambda t: t.encode("utf-8", "replace")))
    )
    try:
        found = lampyris.load_scenario(path, max_cells=4096)
    except LampyrisError:
        return  # nothing else may come out of it
    assert found.scene.grid.blocked.size <= 4096


@pytest.mark.commit(1)
@pytest.mark.parametrize("ending", [".scen", ".csv", ".json"])
@FIXED
@given(data=st.data())
def test_any_lines_are_queries_or_a_way_or_a_refusal(ending: str, data: st.DataObject) -> None:
    path = Path(f"any-lines{ending}")
    words = (
        "version 1\n",
        "0\tm.map\t3\t3\t0\t0\t1\t1\t1.41421356\n",
        "x,y\n",
        "0,0\n",
        "1.5,2\n",
        "nan",
        "\t",
        "-1",
    )
    path.write_bytes(data.draw(bits_of(*words, '{"cells": [[0, 0], [1, 0]]', "}")))
    try:
        found: Any = read_scen(path) if ending == ".scen" else read_path_points(path)
    except LampyrisError:
        return  # nothing else may come out of it
    assert found is not None
