"""Save, then load: the identity for every format that can hold the map, and one hash from all of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lampyris.errors import InternalFault, LampyrisError, UsageError
from lampyris.io.maps import convert as module
from lampyris.io.maps.convert import Conversion, convert, files_of, write_and_compare
from lampyris.io.maps.formats.costmap import FROM_OCCUPANCY, TO_OCCUPANCY
from lampyris.io.maps.formats.document import MapDocument, MapQuery
from lampyris.io.maps.formats.movingai import read_scen
from lampyris.io.maps.load import load_map
from lampyris.io.maps.map_hash import map_hash
from lampyris.io.maps.save import COST_WRITERS, WRITERS, save_map
from lampyris.model.grid import Grid

# What each format holds besides size and blocked cells; by the formats' own definitions, not by the code.
HOLDS = {
    (".png", "occupancy"): {"unknown", "marks"},
    (".txt", "occupancy"): {"unknown", "marks"},
    (".pgm", "occupancy"): {"unknown"},
    (".npy", "occupancy"): {"unknown"},
    (".csv", "occupancy"): {"unknown"},
    (".map", "occupancy"): {"surface"},
    (".yaml", "occupancy"): {"unknown", "frame"},
    (".png", "costmap"): {"unknown", "terrain"},
    (".pgm", "costmap"): {"unknown", "terrain"},
    (".npy", "costmap"): {"unknown", "terrain"},
    (".csv", "costmap"): {"unknown", "terrain"},
    (".yaml", "costmap"): {"unknown", "terrain", "frame"},
}
NOTHING = {"unknown": None, "marks": (None, None, ()), "frame": (1.0, (0.0, 0.0, 0.0)), "terrain": None}
SHAPES = ((1, 1), (1, 7), (6, 1), (2, 2), (5, 9), (16, 11))
# Of the two or three values that share an occupancy, the one that comes back.
EXACT = sorted({int(FROM_OCCUPANCY[v]) for v in range(1, 99)})


def facts(document: MapDocument) -> dict[str, object]:
    """A document as plain values."""
    grid = document.grid
    unknown = None if grid.unknown is None or not grid.unknown.any() else grid.unknown.tolist()
    return {
        "blocked": grid.blocked.tolist(),
        "unknown": unknown,
        "marks": (document.start, document.goal, document.obstacle_cells),
        "frame": (grid.resolution, grid.origin),
        "terrain": None if grid.terrain is None else grid.terrain.tolist(),
    }


def documents(seed: int, wanted: set[str], terrain: list[int]) -> Iterator[MapDocument]:
    """Maps of every shape with the wanted things in them."""
    rng = np.random.Generator(np.random.PCG64(seed))
    for height, width in SHAPES:
        kind = rng.choice(3 if "unknown" in wanted else 2, (height, width), p=None)
        marks: dict[str, object] = {}
        if "marks" in wanted:
            places = rng.permutation(height * width)[: int(rng.integers(1, 7))]
            spots = [(int(k % width), int(k // width)) for k in places]
            for x, y in spots:
                kind[y, x] = 0
            bodies = tuple(sorted(spots[2:], key=lambda c: (c[1], c[0])))
            marks = {
                "start": spots[0],
                "goal": spots[1] if len(spots) > 1 else None,
                "obstacle_cells": bodies,
            }
        grid = Grid(
            kind > 0,
            unknown=kind == 2,
            terrain=rng.choice([0, *terrain], (height, width)) if "terrain" in wanted else None,
            resolution=0.05 if "frame" in wanted else 1.0,
            origin=(-3.25, 4.0, 0.5) if "frame" in wanted else (0.0, 0.0, 0.0),
        )
        yield MapDocument(grid, **marks)  # type: ignore[arg-type]


@pytest.mark.parametrize(("ending", "values"), HOLDS)
def test_what_is_not_held_is_said_and_the_rest_is_kept(tmp_path: Path, ending: str, values: str) -> None:
    holds = HOLDS[ending, values]
    words = {
        "unknown": "unknown cell", "marks": "the start", "frame": "the resolution", "terrain": "the terrain",
    }  # fmt: skip
    for k, before in enumerate(documents(9, set(words), EXACT)):
        done = write_and_compare(before, tmp_path / f"{k}{ending}", values=values)
        was, now = facts(before), facts(done.document)
        lost = " ".join(done.lost)
        assert now["blocked"] == was["blocked"]
        for what, word in words.items():
            assert now[what] == (was[what] if what in holds else NOTHING[what])
            missing = what not in holds and was[what] != NOTHING[what]
            assert (word in lost) == missing, (what, done.lost)
        could = was["terrain"] is not None and values == "occupancy" and ending not in (".txt", ".map")
        assert ("--to-values costmap" in lost) == could


def test_the_hash_tells_terrain_apart() -> None:
    blocked = [[False, True, False]]
    grids = [Grid(blocked, terrain=t) for t in (None, [[1, 9, 0]], [[0, 0, 1]], [[2, 0, 0]], [[1, 0, 1]])]
    assert len({map_hash(g) for g in grids}) == 5
    # What stands in a wall, and terrain that is 0 everywhere, is no difference.
    assert map_hash(Grid(blocked, terrain=[[0, 9, 0]])) == map_hash(Grid(blocked))


def test_a_ros_map_rounds_terrain_as_nav2_does(tmp_path: Path) -> None:
    terrain = np.arange(253).reshape(11, 23)
    before = MapDocument(Grid(np.zeros(terrain.shape, dtype=bool), terrain=terrain))
    done = write_and_compare(before, tmp_path / "m.yaml", values="costmap")
    assert done.document.grid.terrain is not None
    now = done.document.grid.terrain.astype(int)
    assert (TO_OCCUPANCY[now] == TO_OCCUPANCY[terrain]).all()
    changed = int((now != terrain).sum())
    assert changed == 252 - 98
    assert done.lost == (f"the terrain of {changed} cells was rounded, by 2 of 252 at most",)
    # What came back once comes back the same.
    once = convert(tmp_path / "m.yaml", tmp_path / "n.yaml", values="costmap", to_values="costmap")
    assert once.lost == ()
    # Read as occupancy, what costs is blocked; as occupancy written, it is plain.
    assert load_map(tmp_path / "m.yaml").grid.blocked.sum() == 252
    plain = write_and_compare(before, tmp_path / "p.yaml")
    assert plain.document.occupancy is not None
    assert not plain.document.occupancy.any()


def test_occupancies_of_walls_do_not_become_terrain(tmp_path: Path) -> None:
    grid = Grid([[True, True, True, False, True]], unknown=[[False, False, False, False, True]])
    before = MapDocument(grid, occupancy=np.array([[50, 99, 100, 0, -1]], dtype=np.int8))
    done = write_and_compare(before, tmp_path / "m.yaml", values="costmap")
    assert done.document.occupancy is not None
    assert done.document.occupancy.tolist() == [[100, 99, 100, 0, -1]]
    assert done.lost == ("2 cells of an occupancy of 1 to 99 became blocked",)
    same = write_and_compare(before, tmp_path / "n.yaml")
    assert same.document.occupancy is not None
    assert same.document.occupancy.tolist() == [[50, 99, 100, 0, -1]]
    assert same.lost == ()


def test_a_csv_chooses_by_itself(tmp_path: Path) -> None:
    plain, rough = Grid([[False, True]]), Grid([[False, True]], terrain=[[7, 0]])
    save_map(plain, tmp_path / "a.csv")
    save_map(rough, tmp_path / "b.csv")
    save_map(rough, tmp_path / "c.csv", values="occupancy")
    save_map(plain, tmp_path / "d.csv", values="costmap")
    assert (tmp_path / "a.csv").read_text() == (tmp_path / "c.csv").read_text() == "0,1\n"
    assert (tmp_path / "b.csv").read_text() == "# lampyris costmap\n7,254\n"
    assert (tmp_path / "d.csv").read_text() == "# lampyris costmap\n0,254\n"
    assert write_and_compare(MapDocument(rough), tmp_path / "b.csv").lost == ()


def test_source_and_target_are_asked_apart(tmp_path: Path) -> None:
    rough = Grid([[False, False, True]], terrain=[[7, 0, 0]])
    save_map(rough, tmp_path / "a.png", values="costmap")

    def through(target: str, **options: str) -> Conversion:
        return convert(tmp_path / "a.png", tmp_path / target, **options)  # type: ignore[arg-type]

    assert through("b.npy", values="costmap", to_values="costmap").hash == map_hash(rough)
    assert through("b.csv", values="costmap").hash == map_hash(rough)
    left = through("c.npy", values="costmap")
    assert left.hash == map_hash(Grid([[False, False, True]]))
    assert left.lost[0] == "the terrain of 1 cell (all 7) was left out"
    assert left.notes == ("read as costmap values: 1 cell of terrain, all 7, 1 blocked, 0 unknown",)
    # The other way about: an ordinary picture is not read as costs because the target has them. 0 is black.
    drawn = through("d.npy", to_values="costmap")
    assert drawn.document.grid.blocked.tolist() == [[True, True, False]]
    assert np.load(tmp_path / "d.npy").tolist() == [[254, 254, 0]]


@pytest.mark.parametrize("ending", [".txt", ".map"])
def test_formats_without_numbers(tmp_path: Path, ending: str) -> None:
    with pytest.raises(UsageError, match=r"VALUES.*has no costmap values.*\.png"):
        write_and_compare(MapDocument(Grid([[False]])), tmp_path / f"m{ending}", values="costmap")
    with pytest.raises(UsageError, match="VALUES"):
        save_map(Grid([[False]]), tmp_path / "m.png", values="costs")
    assert list(tmp_path.iterdir()) == []


def test_the_table_of_formats_is_whole() -> None:
    assert {e for e, v in HOLDS if v == "occupancy"} == {*WRITERS, ".yaml"}
    assert {e for e, v in HOLDS if v == "costmap"} == {*COST_WRITERS, ".yaml"}


def test_strangers_read_the_costs(tmp_path: Path) -> None:
    from PIL import Image

    grid = Grid([[False, True, True]], unknown=[[False, False, True]], terrain=[[9, 0, 0]])
    for ending in (".png", ".pgm"):
        save_map(grid, tmp_path / f"m{ending}", values="costmap")
        with Image.open(tmp_path / f"m{ending}") as picture:
            assert picture.mode == "L"
            assert np.asarray(picture).tolist() == [[9, 254, 255]]
    save_map(grid, tmp_path / "m.npy", values="costmap")
    array = np.load(tmp_path / "m.npy")
    assert (array.dtype, array.tolist()) == (np.dtype(np.uint8), [[9, 254, 255]])


def test_letters_of_a_movingai_map(tmp_path: Path) -> None:
    rng = np.random.Generator(np.random.PCG64(4))
    for height, width in SHAPES:
        lines = ["".join(rng.choice(list(".@STWOG"), width)) for _ in range(height)]
        text = f"type octile\nheight {height}\nwidth {width}\nmap\n" + "\n".join(lines) + "\n"
        (tmp_path / "a.map").write_text(text)
        done = convert(tmp_path / "a.map", tmp_path / "b.map")
        assert (tmp_path / "b.map").read_text() == text
        assert done.lost == ()
        lost = convert(tmp_path / "a.map", tmp_path / "b.txt").lost
        counts = {letter: "".join(lines).count(letter) for letter in "SWT"}
        expected = [
            f"{counts[letter]} cell{'s' if counts[letter] > 1 else ''} of {what}"
            for letter, what in (
                ("S", "swamp became plain ground"),
                ("W", "water became plain walls"),
                ("T", "trees became plain walls"),
            )
            if counts[letter]
        ]
        assert list(lost) == expected


def test_stored_queries_go_beside_a_map(tmp_path: Path) -> None:
    done = convert("env-3", tmp_path / "e.map", scen=True)
    assert (
        done.files == files_of(tmp_path / "e.map", scen=True) == (tmp_path / "e.map", tmp_path / "e.map.scen")
    )
    assert not any("quer" in sentence for sentence in done.lost)
    stored = load_map("env-3").queries
    written = read_scen(tmp_path / "e.map.scen")
    assert [(q.start, q.goal, q.map) for q in written] == [(q.start, q.goal, "e.map") for q in stored]
    for q, was in zip(written, stored, strict=True):
        assert was.octile is not None
        assert q.length == pytest.approx(was.octile[0] + was.octile[1] * 2**0.5, abs=1e-8)
    document = load_map("env-3")
    half = replace(document, queries=(MapQuery((0, 0), (1, 1)), *document.queries))
    lost = write_and_compare(half, tmp_path / "h.map", scen=True).lost
    assert [s for s in lost if "quer" in s] == ["1 stored query left out"]
    with pytest.raises(UsageError, match="OPTIONS"):
        convert("env-3", tmp_path / "e.png", scen=True)
    assert not (tmp_path / "e.png").exists()


def test_terrain_that_is_written_wrongly_is_found_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def wrong(what: MapDocument, path: Path, values: str) -> None:
        save_map(Grid(what.grid.blocked, terrain=[[8]]), path, values=values)

    monkeypatch.setattr(module, "save_map", wrong)
    for ending in (".npy", ".yaml"):
        with pytest.raises(InternalFault, match=r"MAP_CHANGED.*terrain"):
            write_and_compare(
                MapDocument(Grid([[False]], terrain=[[17]])), tmp_path / f"m{ending}", values="costmap"
            )


def test_limits_and_rules_of_the_source_are_passed_on(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("..\n..\n")
    with pytest.raises(LampyrisError, match="MAP_TOO_LARGE"):
        convert(tmp_path / "a.txt", tmp_path / "b.png", max_cells=3)
    (tmp_path / "maps").mkdir()
    (tmp_path / "p.pgm").write_bytes(b"P5 1 1 255\n\xfe")
    (tmp_path / "maps" / "m.yaml").write_text(
        "image: ../p.pgm\nresolution: 1\norigin: [0, 0, 0]\nnegate: 2\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    with pytest.raises(LampyrisError, match="PATH_OUTSIDE"):
        convert(tmp_path / "maps" / "m.yaml", tmp_path / "b.png")
    convert(tmp_path / "maps" / "m.yaml", tmp_path / "b.png", allow_outside=True)
    with pytest.raises(LampyrisError, match="MAP_NEGATE"):
        convert(tmp_path / "maps" / "m.yaml", tmp_path / "b.png", allow_outside=True, strict=True)
    (tmp_path / "c.ppm").write_bytes(b"P6 1 1 255\n\xff\xff\0")
    with pytest.raises(LampyrisError, match=r"IMG_COLOUR.*colour=\"luminance\""):
        convert(tmp_path / "c.ppm", tmp_path / "d.png")
    assert convert(tmp_path / "c.ppm", tmp_path / "d.png", colour="luminance").notes == (
        "a colour picture: its brightness decides (Rec. 601), not the legend of drawings",
    )
