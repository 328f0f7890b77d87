"""The check of maps: readers that take doubtful cells for free, and writers that lose some, are found."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lampyris.io.maps import convert
from lampyris.io.maps.formats import colours, pgm
from lampyris.io.maps.formats import csv as csv_file
from lampyris.io.maps.formats.document import BLOCKED, FREE, UNKNOWN, MapDocument
from lampyris.io.maps.load import load_map
from lampyris.io.maps.save import COST_WRITERS, WRITERS
from lampyris.model.grid import Grid
from lampyris_selfcheck.check import Ask, Outcome, Part
from lampyris_selfcheck.checks.files import maps
from lampyris_selfcheck.checks.files.maps_closed import SORTS
from lampyris_selfcheck.checks.files.maps_drawn import HOLDS


def ran(kind: str, cases: int) -> Outcome:
    return maps.run(Ask(), Part(kind, 0, cases))


def failed(outcome: Outcome) -> set[str]:
    """The sorts that failed."""
    return {f.what.split(":")[0] for f in outcome.failures}


@pytest.mark.nightly
def test_cases_are_varied() -> None:
    outcome = ran("closed", 40 * len(SORTS))
    assert not outcome.failed
    assert outcome.counts["free cells"] > 1000
    assert outcome.counts["other cells"] > 1000
    assert all(outcome.counts[f"{name}: read"] >= 10 for name in SORTS)
    always = {"PNG, grey", "PNG, grey and alpha", "PNG, interlaced", "luminance", "ROS, grey of any depth"}
    assert {name for name in SORTS if f"{name}: refused" not in outcome.counts} == always
    outcome = ran("round-trip", 24)
    assert all(outcome.counts[" ".join(way)] == 2 for way in HOLDS)
    assert len(ran("one-hash", 24).counts) == 1 + 4


def changed(change: Callable[[MapDocument], MapDocument], monkeypatch: pytest.MonkeyPatch) -> None:
    """A reader whose maps are changed."""
    monkeypatch.setattr(maps, "load_map", lambda *words, **how: change(load_map(*words, **how)))


@pytest.mark.nightly
def test_a_reader_that_opens_unknown_cells_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    def opened(found: MapDocument) -> MapDocument:
        grid = found.grid
        if grid.unknown is None:
            return found
        return replace(found, grid=Grid(grid.blocked & ~grid.unknown, terrain=None))

    changed(opened, monkeypatch)
    assert len(failed(ran("closed", 20 * len(SORTS)))) >= 5
    assert failed(ran("closed-ros", 50)) == {"ROS"}


def test_a_reader_that_shuts_everything_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    changed(lambda found: replace(found, grid=Grid(np.ones_like(found.grid.blocked))), monkeypatch)
    assert len(failed(ran("closed", len(SORTS)))) >= 8


@pytest.mark.nightly
def test_a_lighter_threshold_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """205 of 255, which map savers write for unknown, taken for free."""
    looked = colours.look_up

    def lighter(table: Any, samples: Any) -> Any:
        found = looked(table, samples)
        if len(table) != 256 or table[204] != UNKNOWN:
            return found
        return np.where((samples == 205) & (found == UNKNOWN), FREE, found).astype(found.dtype)

    monkeypatch.setattr(colours, "look_up", lighter)
    assert ran("closed", 20 * len(SORTS)).failed


@pytest.mark.nightly
def test_a_clipped_sample_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """A sample above the file's maxval taken for white, as common readers do."""
    pixels = pgm._raw

    def clipped(source: Any, header: Any) -> Any:
        return np.minimum(pixels(source, header), header.maxval)

    monkeypatch.setattr(pgm, "_raw", clipped)
    assert "PGM" in failed(ran("closed", 40 * len(SORTS)))


def test_an_unknown_number_taken_for_free_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(csv_file, "UNKNOWN", FREE)
    assert failed(ran("closed", 10 * len(SORTS))) == {"CSV"}


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("ending", "writers", "unknown", "wall"),
    [(".png", WRITERS, UNKNOWN, BLOCKED), (".npy", COST_WRITERS, 255, 254)],
)
def test_a_writer_that_loses_a_cell_is_found(
    ending: str, writers: dict[str, Any], unknown: int, wall: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of the unknown cells one becomes a wall: nothing else looks at that."""
    write = writers[ending]

    def loses(cells: np.ndarray) -> bytes:
        made = cells.copy()
        if (made == unknown).any():
            made[tuple(np.argwhere(made == unknown)[0])] = wall
        found: bytes = write(made)
        return found

    monkeypatch.setitem(writers, ending, loses)
    outcome = ran("round-trip", 48)
    assert outcome.failed
    assert {f.what.split(",")[0] for f in outcome.failures} == {ending}


def test_a_hash_that_does_not_look_at_all_cells_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(maps, "map_hash", lambda grid: f"{grid.blocked.shape}")
    monkeypatch.setattr(convert, "map_hash", lambda grid: f"{grid.blocked.shape}")
    assert ran("one-hash", 4).failed == 4


def test_a_reader_that_raises_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*words: Any, **how: Any) -> None:
        raise IndexError(f"in {words[0]}")

    monkeypatch.setattr(maps, "load_map", broken)
    outcome = ran("closed", 3)
    assert outcome.failed == 3
    assert outcome.failures[0].what == "IndexError: in FOLDER/m"
