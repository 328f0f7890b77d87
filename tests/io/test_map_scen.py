"""``.scen`` files: which map, which grid, and writing them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from lampyris.errors import FileError, LampyrisError, SceneError, SettingError
from lampyris.io.maps.formats.document import MapQuery
from lampyris.io.maps.formats.movingai import (
    ScenQuery,
    check_query,
    grid_for,
    letter_at,
    read_scen,
    write_scen,
)
from lampyris.io.maps.load import load_map
from lampyris.io.maps.save import save_map
from lampyris.model.grid import Grid
from lampyris_selfcheck.reference.files.map_files import cells, load_bytes, put

HEAD = "type octile\nheight 3\nwidth 7\nmap\n"
LAKE = HEAD + ".G@OTSW\nWW....@\n.WWW.SS\n"


def lake(folder: Path) -> Path:
    """A map with every letter."""
    return put(folder, LAKE.encode(), "lake.map")


def query(**changes: object) -> ScenQuery:
    """A line about the lake."""
    facts: dict[str, object] = {
        "line": 2, "bucket": 0, "map": "lake.map", "width": 7, "height": 3,
        "start": (0, 0), "goal": (2, 1), "length": 2.5, "decimals": 8,
    }  # fmt: skip
    return ScenQuery(**{**facts, **changes})  # type: ignore[arg-type]


def test_what_a_cell_is_made_of_is_kept(tmp_path: Path) -> None:
    found = load_map(lake(tmp_path))
    assert cells(found) == ["..###.#", "##....#", ".###..."]
    assert "\n".join("".join(letter_at(found, (x, y)) for x in range(7)) for y in range(3)) == LAKE[-24:-1]
    assert found.surface is not None
    assert not found.surface.flags.writeable
    for ending in (".map", ".MAP"):
        save_map(found, tmp_path / f"again{ending}")
        assert (tmp_path / f"again{ending}").read_text() == LAKE
    plain = load_bytes(tmp_path, (HEAD + ".......\n" * 3).encode())
    assert plain.surface is None


def test_a_letter_never_says_other_than_the_grid(tmp_path: Path) -> None:
    from dataclasses import replace

    found = load_map(lake(tmp_path))
    turned = replace(found, grid=Grid(~found.grid.blocked))
    save_map(turned, tmp_path / "t.map")
    again = load_map(tmp_path / "t.map")
    assert (again.grid.blocked == ~found.grid.blocked).all()
    assert again.surface is None


def test_water_connects_to_water_alone(tmp_path: Path) -> None:
    found = load_map(lake(tmp_path))
    for start in ((0, 0), (5, 0), (4, 0), (2, 0), (7, 0), (-1, 0), (0, 3)):
        assert grid_for(found, start) is found.grid
    for start in ((6, 0), (0, 1), (3, 2)):
        water = grid_for(found, start)
        wet = [[c == "W" for c in row] for row in LAKE.split("\n")[4:7]]
        assert (~water.blocked).tolist() == wet
    dry = load_bytes(tmp_path, b"..\n")
    assert grid_for(dry, (0, 0)) is dry.grid


@pytest.mark.parametrize(
    ("changes", "code", "says"),
    [
        ({}, "", ""),
        ({"map": "maps\\lakes/lake.map"}, "", ""),
        ({"start": (6, 0), "goal": (0, 0)}, "", ""),
        ({"goal": (1, 2)}, "", ""),
        ({"width": 8}, "SCEN_SIZE", "line 2: 8 x 3; allowed: 7 x 3, the map's size"),
        ({"map": "sea.map"}, "SCEN_MAP", "'sea.map'; allowed: 'lake.map', the map's name"),
        ({"start": (4, 0)}, "START_OCCUPIED", "start (4,0) is 'T'"),
        ({"start": (2, 0)}, "START_OCCUPIED", "'@'"),
        ({"goal": (3, 0)}, "GOAL_OCCUPIED", "goal (3,0) is 'O'"),
    ],
)
def test_a_line_that_cannot_be_asked(
    tmp_path: Path, changes: dict[str, object], code: str, says: str
) -> None:
    document = load_map(lake(tmp_path))
    if not code:
        check_query(query(**changes), document, "q.scen")
        return
    with pytest.raises((FileError, SceneError)) as caught:
        check_query(query(**changes), document, "q.scen")
    assert caught.value.code == code
    assert says in str(caught.value)


def test_a_stored_map_of_another_kind_may_have_any_name(tmp_path: Path) -> None:
    document = load_bytes(tmp_path, b".......\n" * 3, "hall.txt")
    check_query(query(), document, "q.scen")


def test_written_queries_are_read_again(tmp_path: Path) -> None:
    rng = np.random.Generator(np.random.PCG64(3))
    grid = Grid(np.zeros((200, 300), dtype=bool))
    for n in (0, 1, 50):
        stored = [
            MapQuery(
                (int(x0), int(y0)),
                (int(x1), int(y1)),
                octile=(int(rng.integers(900)), int(rng.integers(900))),
            )
            for x0, y0, x1, y1 in rng.integers(0, 200, (n, 4))
        ]
        write_scen(tmp_path / "a.scen", stored, map_name="maps/a b.map", grid=grid)
        lines = read_scen(tmp_path / "a.scen")
        assert len(lines) == n
        for k, (line, was) in enumerate(zip(lines, stored, strict=True)):
            straight, diagonal = was.octile or (0, 0)
            length = straight + diagonal * math.sqrt(2)
            assert (line.line, line.map, line.width, line.height) == (k + 2, "maps/a b.map", 300, 200)
            assert (line.start, line.goal, line.decimals) == (was.start, was.goal, 8)
            assert abs(line.length - length) <= 0.5e-8
            assert line.bucket == math.floor(length / 4)
        write_scen(tmp_path / "b.scen", lines, map_name="maps/a b.map", grid=grid)
        assert (tmp_path / "b.scen").read_bytes() == (tmp_path / "a.scen").read_bytes()
        assert read_scen(tmp_path / "b.scen") == lines


def test_a_line_as_it_is_published(tmp_path: Path) -> None:
    grid = Grid(np.zeros((49, 50), dtype=bool))
    write_scen(tmp_path / "a", [MapQuery((1, 13), (4, 12), octile=(2, 1))], map_name="dao/a.map", grid=grid)
    expected = "version 1\n0\tdao/a.map\t50\t49\t1\t13\t4\t12\t3.41421356\n"
    assert (tmp_path / "a").read_text() == expected


@pytest.mark.parametrize(
    ("bad", "name", "code"),
    [
        (MapQuery((0, 0), (1, 0)), "a.map", "SCEN_LENGTH"),
        (query(length=1e15), "a.map", "SCEN_LENGTH"),
        (MapQuery((0, 0), (7, 0), octile=(7, 0)), "a.map", "SCEN_RANGE"),
        (MapQuery((-1, 0), (1, 0), octile=(2, 0)), "a.map", "SCEN_RANGE"),
        (query(), "", "SCEN_MAP"),
        (query(), "a\tb", "SCEN_MAP"),
        (query(), "a ", "SCEN_MAP"),
    ],
)
def test_what_cannot_be_written(tmp_path: Path, bad: MapQuery | ScenQuery, name: str, code: str) -> None:
    with pytest.raises(SettingError) as caught:
        write_scen(tmp_path / "a.scen", [bad], map_name=name, grid=Grid(np.zeros((3, 7), dtype=bool)))
    assert caught.value.code == code
    assert not (tmp_path / "a.scen").exists()


def test_too_many_lines(tmp_path: Path) -> None:
    with pytest.raises(LampyrisError, match="SCEN_LINES"):
        write_scen(tmp_path / "a", [query()] * 100_000, map_name="a", grid=Grid(np.zeros((3, 7), dtype=bool)))


@pytest.mark.nightly
def test_the_benchmark_is_about_its_maps(movingai: Path) -> None:
    for path in sorted(movingai.glob("*.scen")):
        queries = read_scen(path)
        document = load_map(path.with_suffix(""))
        for q in queries:
            check_query(q, document, path.name)


def test_the_benchmark_maps_are_written_as_they_are(movingai: Path, tmp_path: Path) -> None:
    for path in sorted(movingai.glob("*.map")):
        save_map(load_map(path), tmp_path / path.name)
        assert (tmp_path / path.name).read_bytes().strip() == path.read_bytes().replace(
            b"\r\n", b"\n"
        ).strip()
