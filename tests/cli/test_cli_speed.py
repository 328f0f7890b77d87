"""``lampyris speed`` and ``lampyris laws``: ways from every kind of file, laws side by side, and why."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from bad_inputs.case import inside, run

MAP = ("room.txt", "--resolution", "0.25")
ROWS = [
    "#" * 24,
    *["#" + "." * 22 + "#"] * 5,
    "#" + "." * 11 + "#" * 12,
    *["#" + "." * 22 + "#"] * 6,
    "#" * 24,
]
ENDS = ("--start", "2,2", "--goal", "21,10")
TAUT = (*ENDS, "--smooth", "straight")


@pytest.fixture(autouse=True)
def _room(tmp_path: Path) -> Iterator[None]:
    """A room with a wall in it, to work in."""
    (tmp_path / "room.txt").write_text("\n".join(ROWS) + "\n")
    with inside(tmp_path):
        yield


def told(*words: str, exit: int = 0) -> dict[str, Any]:
    done = run("speed", *words, "--json", "--no-timing")
    assert done.exit == exit, done.err
    out = json.loads(done.out)
    assert isinstance(out, dict)
    return out


def test_laws_side_by_side_and_what_holds_ours() -> None:
    r = told(*MAP, *ENDS, "--radius", "0.1")
    assert set(r) == {"map", "robot", "path", "law", "laws", "refused", "limited_by", "speed", "timing"}
    assert [e["law"] for e in r["laws"]] == ["constant", "dissertation", "rpp", "physical", "optimum"]
    by = {e["law"]: e for e in r["laws"]}
    assert by["optimum"]["ratio_to_optimum"] == 1
    assert by["physical"]["broken"] == by["optimum"]["broken"] == []
    assert by["physical"]["ratio_to_optimum"] >= 1
    assert by["physical"]["duration_s"] < by["constant"]["duration_s"]
    assert r["law"] == r["speed"]["law"] == "physical"
    assert r["speed"]["duration"] == by["physical"]["duration_s"]
    for what in ("distance", "time"):
        assert sum(h[what] for h in r["limited_by"]) == pytest.approx(1)
    assert {h["cause"] for h in r["limited_by"]} == set(r["speed"]["cause"])
    n = r["path"]["nodes"]
    assert {
        len(r["speed"][k]) for k in ("s", "v", "a", "t", "cause", "cause_index", "why", "xy", "x_m", "y_m")
    } == {n}
    assert {len(c["v"]) for c in r["speed"]["caps"]} == {n}
    assert r["path"]["from"] == "ad-gso"
    assert r["path"]["length_m"] == r["speed"]["s"][-1]
    # The start in metres: the centre of cell (2, 2) of 14 rows.
    assert (r["speed"]["x_m"][0], r["speed"]["y_m"][0]) == pytest.approx((2.5 * 0.25, 11.5 * 0.25))
    braking = r["speed"]["cause"].index("braking")
    assert re.fullmatch(r"braking for node \d+ \(.+\)", r["speed"]["why"][braking])


def test_a_way_may_come_from_anywhere() -> None:
    assert run("plan", *MAP, *ENDS, "--csv", "p.csv").exit == 0
    planned = run("plan", *MAP, *ENDS, "--json").out
    Path("p.json").write_text(planned)
    with open("p.csv") as file:
        rows = list(csv.DictReader(file))
    poses = [{"pose": {"position": {"x": float(r["x_m"]), "y": float(r["y_m"])}}} for r in rows]
    Path("ros.json").write_text(json.dumps({"header": {"frame_id": "map"}, "poses": poses}))
    Path("cells.csv").write_text("\n".join(f"{r['x']},{r['y']}" for r in rows))
    records = [told(*MAP, *ENDS, "--smooth", "arcs")]
    for words in (
        ("p.csv",),
        ("p.json",),
        ("ros.json",),
        ("cells.csv", "--units", "cells"),
        ("p.csv", "--units", "cells"),
    ):
        records.append(told(*MAP, "--path", *words))
        assert records[-1]["path"].pop("from") == words[0]
    assert records[0]["path"].pop("from") == "ad-gso"
    assert all(r == records[0] for r in records)


def test_its_own_csv_is_a_way_again() -> None:
    assert run("speed", *MAP, *TAUT, "--csv", "s.csv").exit == 0
    with open("s.csv") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["x_m", "y_m", "yaw", "v", "t_s", "s", "a", "cause", "why"]
    r = told(*MAP, *TAUT)
    for name in ("x_m", "y_m", "v", "t", "s", "a"):
        column = "t_s" if name == "t" else name
        assert [float(row[column]) for row in rows] == r["speed"][name]
    assert [row["why"] for row in rows] == r["speed"]["why"]
    yaw = np.unwrap([float(row["yaw"]) for row in rows])
    ahead = np.arctan2(np.diff(r["speed"]["y_m"]), np.diff(r["speed"]["x_m"]))
    # A chord between two nodes lies between the headings at both.
    assert np.abs(np.angle(np.exp(1j * (ahead - (yaw[1:] + yaw[:-1]) / 2)))).max() < 0.3
    again = told(*MAP, "--path", "s.csv", "--smooth", "none")
    assert again["path"]["points"] == len(rows)
    assert again["path"]["length_m"] == pytest.approx(again["path"]["given_m"], rel=1e-2)
    assert again["path"]["deviation_m"] < 0.01, "corners are rounded within half a step"
    rounded = told(*MAP, "--path", "s.csv")
    assert rounded["path"]["length_m"] == pytest.approx(r["path"]["length_m"], rel=1e-6)
    assert rounded["speed"]["duration"] == pytest.approx(r["speed"]["duration"], rel=0.01)
    assert rounded["path"]["deviation_m"] < 0.01
    assert r["path"]["smooth"] == "straight"
    assert rounded["path"]["smooth"] == "arcs"
    assert "m given; driven" in run("speed", *MAP, *ENDS).out


def test_a_loop_is_measured_as_it_is_given() -> None:
    """Drawn taut, its start being its goal, it would be nothing."""
    angle = np.linspace(0, 2 * np.pi, 401)
    rows = "".join(f"{3 + np.cos(a):.15f},{2.6 + np.sin(a):.15f}\n" for a in angle)
    Path("ring.csv").write_text("x,y\n" + rows)
    Path("ring.txt").write_text(("." * 24 + "\n") * 20)
    words = ("ring.txt", "--resolution", "0.25", "--path", "ring.csv", "--a-lat-max", "0.2")
    ring = told(*words)
    assert ring["path"]["length_m"] == pytest.approx(2 * np.pi, rel=1e-3)
    assert ring["path"]["given_m"] == pytest.approx(2 * np.pi, rel=1e-3)
    assert max(ring["speed"]["v"]) == pytest.approx(np.sqrt(0.2), rel=0.02)
    assert "curvature" in ring["speed"]["cause"]
    lines = told(*words, "--smooth", "none")
    assert max(lines["speed"]["v"]) == pytest.approx(np.sqrt(0.2), rel=0.02), "its corners have arcs, too"
    assert lines["path"]["arcs"] == 399
    taut = told(*words, "--smooth", "straight")["path"]
    assert taut["length_m"] < 0.01
    assert taut["deviation_m"] == pytest.approx(2, rel=0.01)


def test_zones_movers_and_settings_of_the_law_are_minded() -> None:
    plain = told(*MAP, *TAUT)
    zones = np.full((len(ROWS), 24), np.inf)
    zones[:, 8:16] = 0.3
    np.save("z.npy", zones)
    slow = told(*MAP, *TAUT, "--zones", "z.npy")
    assert "zone" in slow["speed"]["cause"]
    inside_ = [v for v, (x, _) in zip(slow["speed"]["v"], slow["speed"]["xy"], strict=True) if 8 < x < 15]
    assert max(inside_) <= 0.3 + 1e-9
    Path("m.csv").write_text("x_m,y_m,radius,top_speed\n5.5,3,0.1,0.1\n3.5,1.2,0.05,0.3\n")
    movers = told(*MAP, *TAUT, "--obstacle-states", "m.csv")
    assert movers["speed"]["duration"] > plain["speed"]["duration"]
    assert {k for k, c in enumerate(movers["speed"]["cause"]) if c == "moving obstacle"}
    assert "moving obstacle 1" in movers["speed"]["why"]
    Path("m.csv").write_text("x_m,y_m,radius,top_speed\n2.5,1.9,0.2,1.0\n")
    done = run("speed", *MAP, *TAUT, "--obstacle-states", "m.csv")
    assert done.exit == 3
    assert "PROFILE_BLOCKED" in done.err
    assert "moving obstacle 0" in done.err
    others = told(*MAP, *TAUT, "--obstacle-states", "m.csv", "--law", "optimum")
    assert "moving obstacle 0" in {r["law"]: r["sentence"] for r in others["refused"]}["physical"]
    assert "physical" not in [e["law"] for e in others["laws"]]
    fast = told(*MAP, *TAUT, "--set-law", "clearance=false")
    assert fast["speed"]["duration"] < plain["speed"]["duration"]
    assert "clearance" not in fast["speed"]["cause"]
    other = {e["law"]: e["duration_s"] for e in fast["laws"]}
    assert other["constant"] == {e["law"]: e["duration_s"] for e in plain["laws"]}["constant"]
    hurried = told(*MAP, *TAUT, "--v0", "0.2", "--laws", "optimum")
    assert [e["law"] for e in hurried["laws"]] == ["optimum", "physical"]
    assert hurried["speed"]["v"][0] == 0.2


def test_known_tracks_are_let_pass_or_passed_first() -> None:
    plain = told(*MAP, *TAUT)
    # It stands in the gap beside the wall for a while, then leaves to the left.
    Path("t.csv").write_text("x,y\n" + "10,7\n" * 16 + "".join(f"{x},7\n" for x in range(9, 2, -1)))
    r = told(*MAP, *TAUT, "--track", "t.csv", "--tick", "0.5")
    assert r["speed"]["duration"] > plain["speed"]["duration"] + 1
    assert "moving obstacle 0" in r["speed"]["why"]
    assert {"clearance", "limit"} <= set(r["speed"]["cause"]), "caps keep their names"
    xy, t = np.array(r["speed"]["xy"]), np.array(r["speed"]["t"])
    assert np.diff(r["speed"]["s"]).max() <= 0.25 / 4 * (1 + 1e-9), "the course's nodes are there, too"
    for n, word in enumerate(r["speed"]["cause"]):
        if word == "braking":
            assert r["speed"]["cause_index"][n] > n
    there = t < 7.5
    assert np.hypot(*(xy[there] - (10, 7)).T).min() * 0.25 >= 0.125 - 1e-6, "rims do not overlap"
    rest = [e["duration_s"] for e in r["laws"] if e["law"] != "physical"]
    assert rest == [e["duration_s"] for e in plain["laws"] if e["law"] != "physical"]
    # Long gone when the robot comes by.
    early = told(*MAP, *TAUT, "--track", "t.csv", "--tick", "0.01")
    assert early["speed"] == plain["speed"]
    assert run("speed", *MAP, *TAUT, "--track", "t.csv", "--law", "rpp").exit == 2
    assert run("speed", *MAP, *TAUT, "--tick", "1").exit == 2
    assert run("speed", *MAP, *TAUT, "--track", "t.csv", "--tick", "0").exit == 2
    assert run("speed", *MAP, *TAUT, "--track", "t.csv", "--csv", "out.csv").exit == 0


def test_the_reasons_are_told_by_stretches_or_by_nodes() -> None:
    n = told(*MAP, *ENDS)["path"]["nodes"]
    folded = run("speed", *MAP, *ENDS, "--explain").out
    assert "what limits physical" in folded
    nodes = [
        k
        for a, b in re.findall(r"^(\d+)(?:-(\d+))?\t\d", folded, re.MULTILINE)
        for k in (int(a), int(b or a))
    ]
    assert nodes[0] == 0
    assert nodes[-1] == n - 1
    assert all(b == a + 1 for a, b in zip(nodes[1::2], nodes[2::2], strict=False)), "stretches join"
    every = run("speed", *MAP, *ENDS, "--all").out
    assert len(re.findall(r"^\d+\t\d", every, re.MULTILINE)) == n
    assert "braking for node" in every
    assert "why" not in run("speed", *MAP, *ENDS).out.split()


@pytest.mark.nightly
def test_pictures_are_drawn_and_nothing_is_overwritten() -> None:
    words = ("speed", *MAP, *ENDS, "--picture", "a.png", "--colour-by", "cause", "--chart", "b.svg")
    done = run(*words)
    assert done.exit == 0, done.err
    assert "wrote a.png" in done.out
    with Image.open("a.png") as picture:
        assert picture.size[0] > 600
    assert "<svg" in Path("b.svg").read_text()
    first = Path("b.svg").read_bytes()
    again = run(*words)
    assert (again.exit, again.out) == (2, "")
    assert "EXISTS" in again.err
    assert run(*words, "--force").exit == 0
    assert Path("b.svg").read_bytes() == first


def test_same_call_same_bytes() -> None:
    words = ("speed", "guide", "--radius", "0.2", "--law", "blind", "--json", "--no-timing")
    assert run(*words).out == run(*words).out
    assert json.loads(run(*words[:-1]).out)["timing"].keys() == {"path_s", "laws_s", "loading_s"}


def test_without_a_path_there_is_no_speed() -> None:
    Path("wall.txt").write_text(".#.\n.#.\n")
    words = ("wall.txt", "--start", "0,0", "--goal", "2,0")
    r = told(*words, exit=4)
    assert (r["speed"], r["laws"]) == (None, [])
    assert "region" in r["sentence"]
    done = run("speed", *words)
    assert (done.exit, done.err) == (4, "")


@pytest.mark.parametrize(
    ("words", "exit", "says"),
    [
        (("--path", "no.csv"), 3, "FILE_MISSING"),
        (("--path", "out.csv"), 3, "PATH_OUTSIDE.*out.csv: point 1, .*give --units cells"),
        (("--path", "wall.csv"), 3, "PATH_BLOCKED"),
        (("--path", "p.csv", "--goal", "1,1"), 2, "OPTIONS.*--path and --goal"),
        (("--units", "cells"), 2, "OPTIONS.*--units without --path"),
        (("--path", "p.csv", "--units", "miles"), 2, "UNITS.*metres, cells"),
        ((*ENDS, "--laws", "physicl"), 2, "LAW.*--laws.*did you mean physical"),
        ((*ENDS, "--law", "rp"), 2, "LAW.*--law.*did you mean rpp"),
        ((*ENDS, "--set-law", "creep"), 2, "SET.*--set-law.*KEY=VALUE"),
        ((*ENDS, "--set-law", "crep=1"), 2, "LAW_SETTING.*did you mean creep"),
        ((*ENDS, "--set-law", "creep=7"), 2, "LAW_SETTING.*--set-law creep: 7"),
        ((*ENDS, "--smooth", "arc"), 2, "SMOOTH.*did you mean arcs"),
        ((*TAUT, "--spacing", "0"), 2, "SPACING.*--spacing: 0"),
        ((*ENDS, "--spacing", "0.1"), 2, "OPTIONS.*--spacing: the nodes are the planned cells.*straight"),
        ((*ENDS, "--v0", "9"), 2, "PROFILE_INFEASIBLE.*--v0: 9"),
        ((*ENDS, "--colour-by", "colour"), 2, "COLOUR_BY.*speed, cause"),
        ((*ENDS, "--picture", "a.gif"), 2, "SUFFIX.*.png or .svg"),
        ((*ENDS, "--a-lat-max", "0"), 2, "ROBOT_LIMIT.*--a-lat-max"),
        ((*ENDS, "--turn-radius", "-1"), 2, "ROBOT_LIMIT.*--turn-radius"),
        ((*ENDS, "--jerk-max", "nan"), 2, "ROBOT_LIMIT.*--jerk-max"),
        ((*ENDS, "--obstacle-states", "p.csv"), 3, "OBSTACLE_STATES_FILE.*p.csv:1: no column radius"),
        ((*ENDS, "--zones", "room.txt"), 2, "SUFFIX.*'.txt'"),
    ],
)  # fmt: skip
def test_mistakes_are_named(words: tuple[str, ...], exit: int, says: str) -> None:
    Path("p.csv").write_text("x_m,y_m\n1,1\n1.5,1\n")
    Path("out.csv").write_text("x_m,y_m\n1,1\n40,1\n")
    Path("wall.csv").write_text("x,y\n3.875,2.875\n3.875,0.875\n")
    done = run("speed", *MAP, *words)
    assert done.exit == exit, done.err
    assert re.search(says, done.err), done.err
    assert done.out == ""


def test_all_laws_at_once_and_obstacles_that_are_elsewhere() -> None:
    from lampyris.motion.laws.registry import LAWS

    r = told(*MAP, *ENDS, "--laws", "all")
    assert [e["law"] for e in r["laws"]] == list(LAWS)
    Path("far.csv").write_text("x_m,y_m,radius,top_speed\n2.5,-900,0.2,1\n5,900,0.2,1\n3,3,0.1,0.1\n")
    done = run("speed", *MAP, *ENDS, "--obstacle-states", "far.csv")
    assert "moving obstacle 0 at (2.5, -900) m and 1 more: off the map" in done.err
    Path("near.csv").write_text("x_m,y_m,radius,top_speed\n2.5,-0.5,0.2,1\n")
    assert "off the map" not in run("speed", *MAP, *ENDS, "--obstacle-states", "near.csv").err


def test_a_rule_is_switched_on_by_a_word() -> None:
    on = [told(*MAP, *ENDS, "--set-law", f"approach={word}")["speed"] for word in ("on", "true")]
    assert on[0] == on[1]
    assert "approach" in on[0]["cause"]
    done = run("speed", *MAP, *ENDS, "--set-law", "approach=1")
    assert done.exit == 2
    assert "approach.distance, approach.speed" in done.err
    assert re.search(r"approach = off; .*approach\.distance = ", run("laws", "physical").out)


def test_laws_are_listed_with_their_settings() -> None:
    rows = json.loads(run("laws", "--json").out)["laws"]
    assert {"physical", "dissertation", "rpp", "constant", "optimum", "blind"} <= {r["name"] for r in rows}
    for row in rows:
        assert row["summary"]
        assert row["source"]
        one = json.loads(run("laws", row["name"], "--json").out)
        assert one == row
    assert "creep = 0.1" in run("laws", "physical").out
    assert "rpp" in run("laws").out
    assert run("laws", "fast").exit == 2


@pytest.mark.source
def test_the_page_names_every_key_and_column() -> None:
    from lampyris.report.data.csv import DRIVE_COLUMNS, PROFILE_COLUMNS

    page = (Path(__file__).resolve().parents[2] / "docs" / "speed" / "files.md").read_text(encoding="utf-8")
    speeds, drives = (page[page.index(f"## `{verb} --json`") :] for verb in ("speed", "drive"))
    r = told(*MAP, *ENDS)
    keys = [*r, *r["path"], *r["laws"][0], *r["limited_by"][0], *r["speed"], *r["speed"]["caps"][0]]
    assert not [key for key in keys if f"`{key}`" not in speeds]
    r = json.loads(run("drive", "guide", "--obstacles", "1", "--json").out)
    keys = [*r, *r["curves"][0], *r["obstacle_specs"][0], *r["moments"][0]]
    assert not [key for key in keys if f"`{key}`" not in drives]
    for columns in (PROFILE_COLUMNS, DRIVE_COLUMNS):
        assert f"`{', '.join(columns)}`" in page


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("--obstacle-states", "none.csv"), "none.csv"),
        (("--track", "none.csv"), "none.csv"),
        (("--track", "room.txt", "--law", "rpp"), "OPTIONS"),
        (("--spacing", "0"), "--spacing"),
        (("--spacing", "0.0003"), "NODES"),
        (("--csv", "no/where.csv"), "FILE_WRITE"),
    ],
)
def test_files_and_limits_are_looked_at_before_anything_is_planned(
    monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], says: str
) -> None:
    monkeypatch.setattr("lampyris.api.plan", lambda *args, **given: pytest.fail("it was planned"))
    monkeypatch.setenv("LAMPYRIS_MAX_NODES", "9999")
    done = run("speed", *MAP, *TAUT, *words)
    assert done.exit in (2, 3, 5), done.err
    assert says in done.err
