"""``lampyris compare``: the same world for all, one table, one picture, and what does not go together."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import pytest

import lampyris
from bad_inputs.case import Outcome, inside, run
from lampyris.cli import text
from lampyris.cli.verbs.compare import picture, tables
from lampyris.report.pictures.compare_picture import DrawnPath
from lampyris.study.design.row import Row
from lampyris.study.design.study import Config
from sizes import some

GUIDE = ("guide", "--start", "0,9", "--goal", "7,0")


def compare(folder: Path, *words: str) -> Outcome:
    """``lampyris compare`` in this process, in a folder."""
    with inside(folder):
        return run("compare", *words)


def record(folder: Path, *words: str) -> dict[str, Any]:
    """What ``--json`` prints."""
    done = compare(folder, *words, "--json")
    assert done.err == ""
    told: dict[str, Any] = json.loads(done.out)
    return told


def test_the_planners_meet_the_same_world(tmp_path: Path) -> None:
    told = record(tmp_path, *GUIDE, "--no-timing")
    assert [row["planner"] for row in told["rows"]] == [
        "ad-gso", "astar", "dstar-lite", "theta-star", "dstar-lpso"
    ]  # fmt: skip
    assert (told["kind"], told["traffic"], told["timing"]) == ("plan", "none", {})
    best = lampyris.plan(lampyris.Scene(lampyris.load_grid("guide"), (0, 9), (7, 0)), "astar")
    assert best.cost is not None
    by = {row["planner"]: row for row in told["rows"]}
    assert by["astar"]["cost"] == pytest.approx(best.cost)
    assert by["astar"]["expansions"] == best.expansions
    assert by["astar"]["gap"] == 0.0
    assert all(row["found"] == row["runs"] == 1 for row in told["rows"])
    assert told == record(tmp_path, *GUIDE, "--no-timing")


def at_a_terminal(monkeypatch: pytest.MonkeyPatch, width: int) -> None:
    """As if standard output were a terminal of so many columns, without colour."""
    monkeypatch.setenv("COLUMNS", str(width))
    monkeypatch.setattr(text, "is_plain", lambda: False)


def test_the_table_is_for_people(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    at_a_terminal(monkeypatch, 120)
    done = compare(tmp_path, *GUIDE, "--planners", "astar, ad-gso:choice=exact:gates=ignore")
    assert (done.exit, done.err) == (0, "")
    lines = done.out.splitlines()
    assert lines[0].startswith("guide, (0, 9) to (7, 0), 10 x 10 cells of 1 m, octile moves, obstacles: none")
    words = next(line for line in lines if "planner" in line).split()
    assert words[:4] == ["planner", "found", "cost", "gap"]
    rows = [line.split() for line in lines if " found " in line][1:]
    assert [row[0] for row in rows] == ["astar", "ad-gso"]
    assert "ad-gso choice=exact gates=ignore" in done.out


def test_seeds_are_averaged_and_failures_stay_in_the_count(tmp_path: Path) -> None:
    words = (*GUIDE, "--obstacles", "9", "--seeds", "4", "--planners", "ad-gso,sipp")
    done = compare(tmp_path, *words, "--csv", "runs.csv")
    assert done.exit == 0, done.err
    assert " of 4" in done.out
    assert "of 4 worlds" in done.out
    with (tmp_path / "runs.csv").open() as file:
        rows = list(csv.DictReader(file))
    order = [(planner, str(seed)) for seed in range(4) for planner in ("ad-gso", "sipp")]
    assert [(r["planner"], r["seed"]) for r in rows] == order
    told = record(tmp_path, *words)
    for line in told["rows"]:
        mine = [r for r in rows if r["planner"] == line["planner"]]
        assert line["arrived"] == sum(r["arrived"] == "true" for r in mine)
        costs = [float(r["cost"]) for r in mine if r["cost"]]
        assert line["cost"] == pytest.approx(sum(costs) / len(costs))


@pytest.mark.parametrize("width", [72, 80, 100, 120])
def test_a_narrow_terminal_has_fewer_columns_and_whole_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, width: int
) -> None:
    at_a_terminal(monkeypatch, width)
    done = compare(tmp_path, *ENV_3)
    lines = done.out.splitlines()
    assert all(len(line.rstrip()) <= width for line in lines)
    (head,) = (line for line in lines if "planner" in line and "cost" in line)
    assert "gap (%)" in head
    assert "any-angle length" in head
    assert ("no room for CPU (s)" in " ".join(done.out.split())) == ("CPU (s)" not in head)


def test_means_of_counts_have_four_digits_that_count(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As the tables of studies have them: 3844 expansions, and not 3844.0."""
    at_a_terminal(monkeypatch, 120)
    words = ("env-3", "--start", "28,7", "--goal", "26,26", "--seeds", "2", "--planners", "astar,ad-gso")
    done, told = compare(tmp_path, *words), record(tmp_path, *words)["rows"]
    most = max(row["expansions"] for row in told)
    assert most >= 1000
    head = next(line for line in done.out.splitlines() if "planner" in line)
    end = head.index("expansions") + len("expansions")
    for row in told:
        line = next(line for line in done.out.splitlines() if line.strip().startswith(f"{row['planner']} "))
        assert line[:end].split()[-1] == f"{row['expansions']:.0f}"


ENV_3 = ("env-3", "--start", "28,7", "--goal", "26,26", "--planners", "astar,theta-star")


@pytest.mark.nightly
def test_an_any_angle_planner_is_told_of_by_its_lines(tmp_path: Path) -> None:
    """Shorter than the best way by steps; the cost beside it is the walk's, and the table says so."""
    astar, theta = record(tmp_path, *ENV_3)["rows"]
    scene = lampyris.Scene(lampyris.load_grid("env-3"), (28, 7), (26, 26))
    plan = lampyris.plan(scene, "theta-star")
    assert astar["length_any_angle"] is None
    assert theta["length_any_angle"] == plan.any_angle_length
    assert theta["length_any_angle"] < astar["cost"] < theta["cost"]
    assert plan.waypoints is not None
    assert theta["turns"] <= len(plan.waypoints) - 2
    done = compare(tmp_path, *ENV_3, "--picture", "ways.svg")
    assert "any-angle length and turns are of straight lines, all else of the walk by cells" in done.out
    assert "33.72" in done.out
    driven = compare(tmp_path, *ENV_3, "--obstacles", "3")
    assert "any-angle planners are driven by the walk by cells" in driven.out


def test_the_picture_tells_the_length_of_the_lines_it_shows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ways: list[DrawnPath] = []
    monkeypatch.setattr(picture, "draw_paths", lambda grid, start, goal, some, *_, **__: ways.extend(some))
    compare(tmp_path, *ENV_3, "--picture", "ways.png")
    told = {way.name: way.subtitle for way in ways}
    assert told["theta-star"].startswith("any-angle length 33.72, cost by cells 36.56")
    assert told["astar"].startswith("cost 35.97")


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("more", "size"),
    some(
        [
            (("--laws", "physical,rpp,dissertation", "--obstacles", "3"), 25_000),
            ((), 20_000),
            (("--laws", "physical"), 25_000),
        ]
    ),
)
def test_the_picture_is_the_same_bytes_twice(tmp_path: Path, more: tuple[str, ...], size: int) -> None:
    for name in ("a.png", "b.png"):
        done = compare(tmp_path, *GUIDE, *more, "--planners", "astar,theta-star,ad-gso", "--picture", name)
        assert done.exit == 0, done.err
        assert f"wrote {name}" in done.out
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert (tmp_path / "a.png").stat().st_size > size


def test_no_way_is_an_answer(tmp_path: Path) -> None:
    (tmp_path / "wall.txt").write_text("..#..\n..#..\n..#..\n")
    done = compare(tmp_path, "wall.txt", "--start", "0,0", "--goal", "4,0", "--picture", "wall.png")
    assert (done.exit, done.err) == (4, "")
    assert done.out.count("no-path") == 5
    assert (tmp_path / "wall.png").exists()


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("--planners", "astr"), ("error[PLANNER]: --planners: ", "astar")),
        (("--planners", "ad-gso:nope=1"), ("error[SETTING]: --planners: ", "nope")),
        (("--planners", "astar,astar"), ("error[OPTIONS]: --planners: ", "twice")),
        (("--planners", ","), ("error[OPTIONS]: --planners: ",)),
        (("--laws", "fast"), ("error[LAW]: --laws: ", "'fast'")),
        (("--laws", "physical:creep"), ("error[SET]: --laws: ", "KEY=VALUE")),
        (("--seeds", "0"), ("error[SEEDS]: --seeds: ", "1 to 2000")),
        (("--live",), ("--live without --obstacles",)),
        (("--rate", "0.5", "--obstacles", "3"), ("--rate without --live",)),
        (("--obstacles", "3", "--mobility", "walk"), ("error[MOBILITY]: --mobility: ",)),
        (("--obstacles", "-3"), ("error[TRAFFIC_COUNT]: --obstacles: -3",)),
        (("--picture", "a.jpg"), ("error[SUFFIX]",)),
    ],
)
def test_what_does_not_go_together(tmp_path: Path, words: tuple[str, ...], says: tuple[str, ...]) -> None:
    done = compare(tmp_path, *GUIDE, *words)
    assert done.exit == 2, done.err
    assert done.out == ""
    assert len(done.err.splitlines()) == 1
    for part in says:
        assert part in done.err
    assert not list(tmp_path.iterdir())


def test_what_every_planner_refuses_is_an_error_that_names_the_option(tmp_path: Path) -> None:
    """Exit code 3 without an error line was found by random option draws."""
    (tmp_path / "m.txt").write_text("......\n.##...\n......\n...#..\n......\n")
    words = ("--start", "0,0", "--goal", "5,4", "--obstacles", "7", "--obstacle-radius", "1")
    found = compare(tmp_path, "m.txt", *words)
    assert found.exit == 2
    assert "error[OBSTACLE_ROOM]: --obstacles: " in found.err
    assert "2 of 7 random walkers fit on the map" in found.out


WEAKENED = "min_clearance 3 was weakened to 0 cells: no path to the goal keeps more"


@pytest.mark.parametrize("crowd", [(), ("--obstacles", "3", "--seeds", "2")])
def test_what_a_planner_weakened_is_said(tmp_path: Path, crowd: tuple[str, ...]) -> None:
    words = ("env-1", "--planners", "ad-gso:min_clearance=3,astar", "--laws", "physical,dissertation", *crowd)
    done = compare(tmp_path, *words, "--csv", "a.csv")
    assert done.out.splitlines().count(f"ad-gso min_clearance=3: {WEAKENED}") == 1
    assert "astar:" not in done.out
    told = record(tmp_path, *words)
    assert [(row["planner"], row["notes"]) for row in told["rows"]] == [
        *[("ad-gso min_clearance=3", [WEAKENED])] * 2, *[("astar", [])] * 2
    ]  # fmt: skip
    with (tmp_path / "a.csv").open(encoding="utf-8", newline="") as file:
        found = {(line["planner"], line["notes"]) for line in csv.DictReader(file)}
    assert found == {("ad-gso min_clearance=3", WEAKENED), ("astar", "")}


def test_some_of_the_runs_are_counted_in_the_remark() -> None:
    notes = {"a": ["n", "", "n", ""], "b": ["", "", "", ""]}
    lines = [
        tables.CompareLine(Config(name, {}), Config(law, {}), tuple(_noted(note) for note in some))
        for name, all_notes in notes.items()
        for law, some in (("x", all_notes[:2]), ("y", all_notes[2:]))
    ]
    assert tables.notes_of(lines) == ("2 of 4 runs of a did otherwise than asked: n",)


def _noted(note: str) -> Row:
    return Row("key", "done", {"notes": note or None})


def test_the_picture_says_who_did_otherwise_than_asked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[DrawnPath] = []
    monkeypatch.setattr(picture, "draw_paths", lambda *given, **_: drawn.extend(given[3]))
    words = ("env-1", "--planners", "ad-gso:min_clearance=3,astar", "--picture", "a.png")
    assert compare(tmp_path, *words).exit == 0
    assert ["not as asked" in way.subtitle for way in drawn] == [True, False]
