"""``lampyris maps`` as its users meet it: listing, showing, making, converting."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from in_process import call
from lampyris.io.maps.load import load_map
from lampyris.io.maps.map_hash import map_hash
from lampyris.io.maps.recipes.make import RECIPES, make
from lampyris.model.grid import Grid


def run(*words: str | Path, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    return call("maps", *words, cwd=cwd)


def record(*words: str | Path) -> dict[str, Any]:
    done = run(*words, "--json")
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    out = json.loads(done.stdout)
    assert isinstance(out, dict)
    return out


def test_the_list_has_a_line_for_each_map() -> None:
    done = run()
    assert done.returncode == 0
    names = [m["name"] for m in record()["maps"]]
    assert len(names) >= 20
    lines = done.stdout.splitlines()
    assert len(lines) <= len(names) + 6
    assert max(map(len, lines)) <= 80
    for name in names:
        assert sum(line.split()[:1] == [name] for line in lines) == 1


def test_a_name_is_shown_with_or_without_the_word() -> None:
    plain = run("caves-64")
    assert plain.returncode == 0
    assert "caves, seed 2" in plain.stdout
    assert run("show", "caves-64").stdout == plain.stdout
    one = record("caves-64")
    assert record("show", "caves-64") == one
    assert json.loads(run("--json", "caves-64").stdout) == one
    assert one["hash"] == map_hash(load_map("caves-64").grid)
    assert len(one["queries"][0]["octile"]) == 2


def test_terrain_is_told() -> None:
    line = next(line for line in run().stdout.splitlines() if line.startswith("hills-100\t"))
    assert "62%, 5x" in line
    plain = run("hills-100").stdout
    assert "62.2% of the free cells, 1.8 to 5 times as costly as plain ground" in plain
    one = record("hills-100")
    assert one["terrain"] == {"cells": 5623, "lowest": 50, "highest": 252}
    straights, diagonals = one["queries"][0]["weighed"]
    assert f"\t{(straights + diagonals * 2**0.5) / 63:.2f}\t" in plain
    assert record("guide")["terrain"] is None


def test_recipes_are_listed_with_ranges() -> None:
    listed = {r["name"]: r for r in record("recipes")["recipes"]}
    assert set(listed) == set(RECIPES)
    settings = {s["name"]: s for s in listed["maze"]["settings"]}
    assert settings["corridor"]["allowed"] == "a whole number, 1 to 256"
    done = run("recipes")
    assert done.returncode == 0
    assert "corridor" in done.stdout


def test_make_writes_the_recipe_s_map(tmp_path: Path) -> None:
    out = tmp_path / "m.png"
    words = ("make", "maze", "--size", "41,31", "--seed", "3", "--set", "corridor=2", "--set", "loops=0.1")
    made = record(*words, "-o", out)
    cells = make("maze", 41, 31, 3, corridor=2, loops=0.1)
    assert (load_map(out).grid.blocked == cells).all()
    assert made["hash"] == map_hash(Grid(cells))
    assert made["settings"] == {"corridor": 2, "wall": 1, "loops": 0.1}
    assert (made["width"], made["height"], made["seed"], made["lost"]) == (41, 31, 3, [])
    first = out.read_bytes()
    assert run(*words, "-o", out).returncode == 2
    again = run(*words, "-o", out, "--force")
    assert again.returncode == 0
    assert "wrote" in again.stdout
    assert out.read_bytes() == first


def test_convert_says_what_is_lost(tmp_path: Path) -> None:
    done = run("convert", "guide", tmp_path / "g.map")
    assert done.returncode == 0
    assert "note: the start (0, 9) was left out" in done.stderr
    text = record("convert", "guide", tmp_path / "g.txt")
    assert text["hash"] == record("guide")["hash"]
    assert text["lost"] == ["4 stored queries left out"]
    refused = run("convert", "guide", tmp_path / "g.txt")
    assert refused.returncode == 2
    assert "--force" in refused.stderr
    (tmp_path / "r.pgm").write_bytes(b"keep me")
    refused = run("convert", "guide", tmp_path / "r.yaml")
    assert refused.returncode == 2
    assert (tmp_path / "r.pgm").read_bytes() == b"keep me"


@pytest.mark.parametrize(
    ("words", "code", "says"),
    [
        (("gide",), 3, "did you mean guide?"),
        (("mkae", "maze"), 2, "maze"),
        (("mkae",), 3, "did you mean make?"),
        (("make", "maz", "-o", "m.png"), 2, "did you mean maze?"),
        (("make", "maze"), 2, "--out"),
        (("make", "maze", "--set", "coridor=2", "-o", "m.png"), 2, "did you mean corridor?"),
        (
            ("make", "maze", "--set", "corridor=0", "-o", "m.png"),
            2,
            "--set corridor: 0; allowed: a whole number, 1 to 256",
        ),
        (("make", "maze", "--set", "corridor", "-o", "m.png"), 2, "KEY=VALUE"),
        (("make", "maze", "--size", "10", "-o", "m.png"), 2, "W,H"),
        (("make", "maze", "--size", "9000,9000", "-o", "m.png"), 5, "at most 16,777,216 cells"),
        (("make", "maze", "--seed", "-1", "-o", "m.png"), 2, "--seed: -1"),
        (("make", "maze", "-o", "m.gif"), 2, ".png"),
        (("make", "maze", "--resolution", "0", "-o", "m.png"), 2, "MAP_RESOLUTION]: --resolution: "),
        (("make", "warehouse", "--size", "10,10", "-o", "m.png"), 2, "--size: "),
        (("convert", "guide", "m.gif"), 2, ".png"),
        (("convert", "none.png", "m.png"), 3, "FILE_MISSING"),
        (("convert", "guide", "no/such/m.png"), 3, "FILE_WRITE"),
    ],
)
def test_mistakes_are_named_in_one_line(words: tuple[str, ...], code: int, says: str, tmp_path: Path) -> None:
    done = run(*words, cwd=tmp_path)
    assert done.returncode == code, (done.returncode, done.stderr)
    assert says in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == ""
    assert list(tmp_path.iterdir()) == []


def test_help_imports_nothing_heavy() -> None:
    code = (
        "import sys; sys.argv = ['lampyris', 'maps', 'make', '--help']\n"
        "from lampyris.cli import main\n"
        "try:\n    main()\nexcept SystemExit as e:\n    assert not e.code, e.code\n"
        "heavy = set('numpy numba scipy matplotlib PIL'.split()) & set(sys.modules)\n"
        "assert not heavy, heavy\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def plan(*words: str | Path) -> subprocess.CompletedProcess[str]:
    return call("plan", *words)


def test_metres_off_the_map_are_told_in_metres(tmp_path: Path) -> None:
    (tmp_path / "m.pgm").write_bytes(b"P5\n8 4\n255\n" + b"\xff" * 32)
    (tmp_path / "m.yaml").write_text(
        "image: m.pgm\nresolution: 0.5\norigin: [-1, 2, 0]\nnegate: 0\noccupied_thresh: 0.65\n"
        "free_thresh: 0.196\n"
    )
    done = plan(tmp_path / "m.yaml", "--start-m", "-17,0", "--goal-m", "0,3")
    assert done.returncode == 2
    assert "error[START_OUTSIDE]: --start-m: (-17, 0) metres is outside the map" in done.stderr
    assert "x -0.75 to 2.75, y 2.25 to 3.75" in done.stderr


def test_a_misspelt_file_is_told_from_those_beside_it(tmp_path: Path) -> None:
    (tmp_path / "floor.txt").write_text("..\n..\n")
    done = plan(tmp_path / "flor.txt")
    assert done.returncode == 3
    assert "did you mean floor.txt?" in done.stderr
