"""Any format to any other: the same cells, the same hash, and a sentence for all that is lost."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np
import pytest

from lampyris.errors import FileError, InternalFault, UsageError
from lampyris.io.maps import convert as module
from lampyris.io.maps.convert import convert, files_of, losses, write_and_compare
from lampyris.io.maps.formats.document import MapDocument
from lampyris.io.maps.load import load_map
from lampyris.io.maps.map_hash import map_hash
from lampyris.io.maps.save import save_map
from lampyris.model.grid import Grid

ENDINGS = (".png", ".txt", ".pgm", ".npy", ".map", ".yaml")
# What each format holds besides blocked cells; by the formats' own definitions.
HOLDS = {
    ".png": {"unknown", "marks"},
    ".txt": {"unknown", "marks"},
    ".pgm": {"unknown"},
    ".npy": {"unknown"},
    ".map": set(),
    ".yaml": {"unknown", "frame"},
}


def made(seed: int, width: int = 23, height: int = 17, unknown: bool = True) -> MapDocument:
    """A map with everything in it."""
    rng = np.random.Generator(np.random.PCG64(seed))
    kind = rng.choice(3 if unknown else 2, (height, width))
    kind.flat[:4] = 0
    grid = Grid(kind > 0, unknown=kind == 2 if unknown else None, resolution=0.05, origin=(-3.25, 4.0, 0.5))
    return MapDocument(grid, start=(0, 0), goal=(2, 0), obstacle_cells=((1, 0), (3, 0)))


def facts(document: MapDocument) -> dict[str, object]:
    """A document as plain values."""
    grid = document.grid
    unknown = grid.unknown if grid.unknown is not None else np.zeros_like(grid.blocked)
    return {
        "blocked": grid.blocked.tolist(),
        "unknown": unknown.tolist(),
        "marks": (document.start, document.goal, document.obstacle_cells),
        "frame": (grid.resolution, grid.origin),
    }


NOTHING = {"unknown": [[False] * 23] * 17, "marks": (None, None, ()), "frame": (1.0, (0.0, 0.0, 0.0))}


@pytest.mark.commit(12)
@pytest.mark.parametrize(("first", "second"), list(product(ENDINGS, ENDINGS)))
def test_every_pair_of_formats(tmp_path: Path, first: str, second: str) -> None:
    for seed in range(3):
        original = made(seed)
        save_map(original, tmp_path / f"a{first}")
        done = convert(tmp_path / f"a{first}", tmp_path / f"b{second}")
        after = load_map(tmp_path / f"b{second}")
        expected = {"blocked": facts(original)["blocked"]}
        for what in ("unknown", "marks", "frame"):
            through = what in HOLDS[first] & HOLDS[second]
            expected[what] = facts(original)[what] if through else NOTHING[what]
        assert facts(after) == facts(done.document) == expected
        assert done.hash == map_hash(after.grid)
        lost = " ".join(done.lost)
        assert ("unknown" in lost) == ("unknown" in HOLDS[first] - HOLDS[second])
        for word in ("start", "goal", "moving obstacle"):
            assert (word in lost) == ("marks" in HOLDS[first] - HOLDS[second])
        for word in ("resolution", "origin"):
            assert (word in lost) == ("frame" in HOLDS[first] - HOLDS[second])


@pytest.mark.parametrize("ending", ENDINGS)
def test_save_then_load_then_save_is_the_same_file(tmp_path: Path, ending: str) -> None:
    for seed in range(3):
        save_map(made(seed), tmp_path / f"a{ending}")
        (tmp_path / "again").mkdir(exist_ok=True)
        done = convert(tmp_path / f"a{ending}", tmp_path / "again" / f"a{ending}")
        assert done.lost == ()
        for file in done.files:
            assert file.read_bytes() == (tmp_path / file.name).read_bytes()


@pytest.mark.parametrize("unknown", [False, True])
def test_all_formats_of_one_map_give_one_hash(tmp_path: Path, unknown: bool) -> None:
    original = made(7, unknown=unknown)
    hashes = {}
    for ending in ENDINGS:
        hashes[ending] = write_and_compare(original, tmp_path / f"m{ending}").hash
    if unknown:  # MovingAI has no word for it, and says so
        assert hashes.pop(".map") != map_hash(original.grid)
    assert set(hashes.values()) == {map_hash(original.grid)}


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_bundled_map(tmp_path: Path, ending: str) -> None:
    done = convert("env-3", tmp_path / f"m{ending}")
    assert done.hash == map_hash(load_map("env-3").grid)
    assert "5 stored queries left out" in done.lost
    assert len(done.lost) == (1 if "marks" in HOLDS[ending] else 3)


def test_a_resolution_that_was_given_is_missed_where_it_is_left_out(tmp_path: Path) -> None:
    save_map(Grid([[True, False]]), tmp_path / "a.npy")
    done = convert(tmp_path / "a.npy", tmp_path / "b.png", resolution=0.05)
    assert done.lost == ("the resolution, 0.05 m a cell, was left out",)
    assert convert(tmp_path / "a.npy", tmp_path / "c.yaml", resolution=0.05).lost == ()
    assert load_map(tmp_path / "c.yaml").grid.resolution == 0.05


def test_cells_between_free_and_occupied_are_counted() -> None:
    grid = Grid([[True, True, False, True]], unknown=[[False, False, False, True]])
    before = MapDocument(grid, occupancy=np.array([[50, 100, 0, -1]], dtype=np.int8))
    assert losses(before, before) == ()
    assert losses(before, MapDocument(grid)) == ("1 cell of an occupancy of 1 to 99 became blocked",)


def test_which_files_are_written(tmp_path: Path) -> None:
    assert files_of("x/m.png") == (Path("x/m.png"),)
    for ending in (".yaml", ".yml"):
        done = write_and_compare(made(1), tmp_path / f"r{ending}")
        assert done.files == files_of(tmp_path / f"r{ending}")
        assert all(f.is_file() for f in done.files)
    assert {f.name for f in tmp_path.iterdir()} == {"r.yaml", "r.yml", "r.pgm"}


def test_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="MAP_ENDING"):
        convert("guide", tmp_path / "m.gif")
    with pytest.raises(FileError, match="FILE_MISSING"):
        convert(tmp_path / "none.png", tmp_path / "m.png")
    with pytest.raises(FileError, match="FILE_WRITE"):
        convert("guide", tmp_path / "no" / "m.png")
    assert list(tmp_path.iterdir()) == []


def test_a_writer_that_moves_a_wall_is_found_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def wrong(what: MapDocument, path: Path, values: str) -> None:
        save_map(Grid(~what.grid.blocked), path)

    monkeypatch.setattr(module, "save_map", wrong)
    with pytest.raises(InternalFault, match="MAP_CHANGED"):
        convert("guide", tmp_path / "m.png")
