"""``lampyris maps FILE`` and the options of ``lampyris maps convert``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from lampyris.cli.verbs.maps.command import app
from lampyris.errors import LampyrisError
from lampyris.io.maps.formats.movingai import read_scen
from lampyris.io.maps.load import load_map
from lampyris.io.maps.map_hash import map_hash


def run(*words: str | Path) -> Any:
    """What was printed; errors of lampyris come out as exceptions."""
    done = CliRunner(env={"COLUMNS": "80"}).invoke(app, [str(w) for w in words], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done


def record(*words: str | Path) -> dict[str, Any]:
    out = json.loads(run(*words, "--json").stdout)
    assert isinstance(out, dict)
    return out


def costs(folder: Path) -> Path:
    path = folder / "costs.pgm"
    path.write_bytes(b"P5 5 1 255\n\x00\x07\xfc\xfe\xff")
    return path


def test_a_file_is_shown(tmp_path: Path) -> None:
    path = costs(tmp_path)
    shown = record(path, "--values", "costmap", "--resolution", "0.1")
    assert shown == {
        "file": str(path),
        "format": "pgm",
        "width": 5,
        "height": 1,
        "free": 0.6,
        "unknown": 1,
        "terrain": {"cells": 2, "lowest": 7, "highest": 252},
        "resolution": 0.1,
        "origin": [0.0, 0.0, 0.0],
        "start": None,
        "goal": None,
        "moving_obstacles": 0,
        "hash": map_hash(load_map(path, values="costmap").grid),
        "notes": ["read as costmap values: 2 cells of terrain, 7 to 252, 1 blocked, 1 unknown"],
    }
    assert record("show", path)["terrain"] is None
    text = run(path, "--values", "costmap", "--resolution", "0.1").stdout
    for said in (
        "5 x 1 cells of 0.1 m",
        "60.0%",
        "1 cell",
        "2 cells, 7 to 252",
        shown["hash"],
        "read as costmap",
    ):
        assert said in text
    assert max(map(len, text.splitlines())) <= 80


def test_marks_and_a_turned_origin_are_shown(tmp_path: Path) -> None:
    (tmp_path / "m.txt").write_text("S.oG\n")
    shown = record(tmp_path / "m.txt")
    assert (shown["start"], shown["goal"], shown["moving_obstacles"]) == ([0, 0], [3, 0], 1)
    (tmp_path / "m.pgm").write_bytes(b"P5 1 1 255\n\xfe")
    (tmp_path / "m.yaml").write_text(
        "image: m.pgm\nresolution: 0.05\norigin: [-1, 2, 0.5]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    text = run(tmp_path / "m.yaml").stdout
    assert "(-1, 2) m, turned by 0.5 rad" in text
    assert "unknown: none" in text


def test_a_bundled_name_wins_over_a_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "guide").write_text("..\n")
    assert "queries" in record("guide")
    assert record("./guide")["width"] == 2


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("none.png",), r"FILE_MISSING.*`lampyris maps` lists"),
        (("gide",), "did you mean guide"),
        (("x\0y",), "FILE_MISSING"),
        ((".",), "FILE_KIND"),
        (("costs.pgm", "--values", "cost"), "VALUES"),
        (("costs.pgm", "--colour", "grey"), "COLOUR"),
        (("costs.pgm", "--max-cells", "4"), "IMG_TOO_LARGE"),
        (("convert", "costs.pgm", "o.txt", "--to-values", "costmap"), "VALUES"),
        (("convert", "costs.pgm", "o.png", "--to-values", "cost"), "VALUES"),
        (("convert", "guide", "o.png", "--values", "costmap"), "VALUES"),
        (("convert", "costs.pgm", "o.png", "--scen"), "OPTIONS"),
        (("convert", "costs.pgm", "o.png", "--max-cells", "4"), "IMG_TOO_LARGE"),
    ],
)
def test_mistakes(words: tuple[str, ...], says: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    costs(tmp_path)
    with pytest.raises(LampyrisError, match=says) as caught:
        run(*words)
    assert len(str(caught.value)) < 300
    assert [f.name for f in tmp_path.iterdir()] == ["costs.pgm"]


def test_convert_takes_costs_through(tmp_path: Path) -> None:
    path = costs(tmp_path)
    options = ("--values", "costmap", "--to-values", "costmap")
    hashes = {record("convert", path, tmp_path / f"o{e}", *options)["hash"] for e in (".png", ".npy", ".csv")}
    assert hashes == {map_hash(load_map(path, values="costmap").grid)}
    left = run("convert", path, tmp_path / "p.png", "--values", "costmap")
    for said in ("note: read as costmap values", "(7 to 252) was left out", "--to-values costmap"):
        assert said in left.stderr
    assert "wrote" in left.stdout


def test_convert_reads_colours_as_grey(tmp_path: Path) -> None:
    (tmp_path / "c.ppm").write_bytes(b"P6 2 1 255\n\xff\xff\x00\x00\x00\xff")
    made = record("convert", tmp_path / "c.ppm", tmp_path / "c.txt", "--colour", "luminance")
    assert (tmp_path / "c.txt").read_text() == ".#\n"
    assert made["notes"][0].startswith("a colour picture")


def test_convert_writes_stored_queries(tmp_path: Path) -> None:
    made = record("convert", "env-3", tmp_path / "e.map", "--scen")
    assert made["files"] == [str(tmp_path / "e.map"), str(tmp_path / "e.map.scen")]
    assert len(read_scen(tmp_path / "e.map.scen")) == len(record("env-3")["queries"])
    with pytest.raises(LampyrisError, match="EXISTS"):
        run("convert", "env-3", tmp_path / "e.map", "--scen")


def test_make_writes_terrain_where_it_can(tmp_path: Path) -> None:
    made = record("make", "hills", "--size", "20,20", "-o", tmp_path / "h.png", "--to-values", "costmap")
    assert made["lost"] == []
    assert record(tmp_path / "h.png", "--values", "costmap")["terrain"]["cells"] > 0
    plain = record("make", "hills", "--size", "20,20", "-o", tmp_path / "i.png")
    assert "--to-values costmap" in plain["lost"][-1]
