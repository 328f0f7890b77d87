"""The command line as its users meet it: output and exit codes, in real processes where that matters."""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from in_process import call


def process(*words: str | Path, **env: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", "from lampyris.cli import main; main()", *map(str, words)],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, **env},
        timeout=120,
    )


def run(*words: str | Path, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    return call(*words, cwd=cwd)


def record(*words: str | Path, code: int = 0, **env: str) -> dict[str, Any]:
    done = process(*words, "--json", **env) if env else run(*words, "--json")
    assert done.returncode == code, done.stderr
    assert done.stderr == ""
    out = json.loads(done.stdout)
    assert isinstance(out, dict)
    return out


def test_plan_on_the_guide_gives_the_worked_example() -> None:
    r = record("plan", "guide", "--preset", "dissertation")
    assert (r["status"], r["planner"], r["cost"], r["iterations"]) == ("found", "ad-gso", 12.4, 4)
    assert r["cells"] == [
        [0, 9], [1, 8], [2, 7], [3, 7], [4, 6], [5, 5], [5, 4], [6, 3], [7, 2], [7, 1], [7, 0],
    ]  # fmt: skip
    assert (r["optimal_cost"], r["gap"]) == (12.4, 0.0)
    assert [g["cell"] for g in r["gates"]["in_map"]] == [[7, 5]]
    assert r["speed"]["law"] == "dissertation"
    assert len(r["speed"]["v"]) == len(r["speed"]["cause"]) == 11
    assert set(r["timing"])


@pytest.mark.parametrize("planner", ["ad-gso", "astar", "dijkstra"])
def test_every_planner_plans_with_the_default_preset(planner: str) -> None:
    r = record("plan", "env-2", "--planner", planner)
    assert r["status"] == "found"
    assert r["moves"] == "octile"
    assert r["speed"]["law"] == "physical"
    assert r["cost"] >= r["optimal_cost"]
    assert r["speed"]["v"][-1] == 0


@pytest.mark.parametrize(
    "words",
    [
        ("simulate", "env-1", "--obstacles", "12", "--mobility", "mixed"),
        pytest.param(("plan", "env-1"), marks=pytest.mark.nightly),
    ],
)
def test_same_seed_same_bytes_in_two_processes_and_without_numba(words: tuple[str, ...]) -> None:
    def without_timing(**env: str) -> str:
        r = record(*words, "--seed", "5", code=0, **env)
        r.pop("timing")
        return json.dumps(r)

    first = without_timing(PYTHONHASHSEED="1")
    assert without_timing(PYTHONHASHSEED="2") == first
    assert without_timing(NUMBA_DISABLE_JIT="1") == first


def test_simulate_tells_every_tick() -> None:
    r = record("simulate", "env-4", "--obstacles", "15", "--seed", "2")
    assert r["outcome"] == "arrived"
    assert len(r["robot"]) == len(r["obstacles"]) == len(r["speed"]) == r["ticks"] + 1
    assert r["collisions"] == 0
    assert r["robot"][0] == r["start"]
    assert r["robot"][-1] == r["goal"]
    assert all(len(o) == 15 for o in r["obstacles"])


def test_no_path_and_blocked_ends_are_answers_with_exit_4(tmp_path: Path) -> None:
    (tmp_path / "wall.txt").write_text(".#.\n.#.\n", encoding="utf-8")
    r = record("plan", tmp_path / "wall.txt", "--start", "0,0", "--goal", "2,1", code=4)
    assert (r["status"], r["cells"], r["cost"], r["speed"]) == ("no-path", None, None, None)
    assert (
        record("plan", tmp_path / "wall.txt", "--start", "1,0", "--goal", "2,1", code=4)["status"]
        == "start-occupied"
    )
    assert (
        record("plan", tmp_path / "wall.txt", "--start", "0,0", "--goal", "1,1", code=4)["status"]
        == "goal-occupied"
    )
    r = record(
        "simulate", tmp_path / "wall.txt", "--start", "0,0", "--goal", "2,1", "--obstacles", "0", code=4
    )
    assert r["outcome"] == "no-path"


@pytest.mark.parametrize(
    ("words", "code", "says"),
    [
        (("plan", "no-such-map"), 3, "no-such-map"),
        (("plan", "gide"), 3, "guide"),
        (("plan", "guide", "--start", "99,0"), 2, "START_OUTSIDE]: --start: (99, 0)"),
        (("plan", "guide", "--start", "a,b"), 2, "--start"),
        (("plan", "guide", "--start", "1,1", "--start-m", "1,1"), 2, "both given"),
        (("plan", "guide", "--planner", "astra"), 2, "astar"),
        (("plan", "guide", "--moves", "octil"), 2, "did you mean octile"),
        (("plan", "guide", "--preset", "x"), 2, "robot, dissertation"),
        (("plan", "guide", "--set", "nt=ten"), 2, "a whole number"),
        (("plan", "guide", "--set", "nq=3"), 2, "did you mean"),
        (("plan", "guide", "--set", "choice=best"), 2, "--set choice: 'best'; allowed: greedy"),
        (("plan", "guide", "--radius", "-1"), 2, "--radius: -1.0"),
        (("plan", "guide", "--seed", "-1"), 2, "--seed: -1"),
        (("plan", "guide", "--nonsense"), 2, "--nonsense"),
        (("plan", "guide", "--law", "fast"), 2, "physical"),
        (("simulate", "guide", "--obstacles", "100000"), 5, "10000"),
        (("simulate", "guide", "--obstacles", "900"), 2, "--obstacles: "),
        (("simulate", "guide", "--mobility", "flying"), 2, "patrol"),
        (("plan", "guide", "--picture", "/nowhere/x.png"), 3, "cannot write"),
        (("plan", "guide", "--picture", "x.xyz"), 2, ".svg"),
        (("plan", "guide", "--picture", "x.png", "--csv", "x.png"), 2, "two outputs"),
        (("plan", "guide", "--radius", "1e5"), 5, "250 cells"),
        (("plan", "guide", "--radius", "1e300"), 2, "--radius: 1e+300"),
        (("plan", "guide", "--v-max", "1e300"), 2, "--v-max: 1e+300"),
        (("simulate", "guide", "--obstacle-radius", "1e5"), 5, "250 cells"),
    ],
)
def test_mistakes_are_named_in_one_line(words: tuple[str, ...], code: int, says: str, tmp_path: Path) -> None:
    done = run(*words, cwd=tmp_path)
    assert done.returncode == code, (done.returncode, done.stderr)
    assert says in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == ""


@pytest.mark.nightly
def test_pictures_films_and_tables_are_written_once(tmp_path: Path) -> None:
    done = run(
        "plan",
        "guide",
        "--picture",
        tmp_path / "a.png",
        "--csv",
        tmp_path / "a.csv",
        "--explain",
        "--preset",
        "dissertation",
    )
    assert done.returncode == 0, done.stderr
    assert "12.4" in done.stdout
    assert "Iteration 4: at (7,1)" in done.stdout
    assert "0.0569" in done.stdout
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.size[0] > 300
    rows = list(csv.DictReader((tmp_path / "a.csv").read_text(encoding="utf-8").splitlines()))
    assert len(rows) == 11
    assert [k for k in rows[0] if k in ("x_m", "y_m", "yaw", "v", "t_transfers")] == [
        "x_m",
        "y_m",
        "yaw",
        "v",
        "t_transfers",
    ]
    assert (float(rows[0]["x_m"]), float(rows[0]["y_m"])) == (0.5, 0.5)
    again = run("plan", "guide", "--picture", tmp_path / "a.png")
    assert again.returncode == 2
    assert "--force" in again.stderr
    film = run(
        "simulate", "guide", "--obstacles", "3", "--film", tmp_path / "a.webp", "--csv", tmp_path / "t.csv"
    )
    assert film.returncode in (0, 4), film.stderr
    with Image.open(tmp_path / "a.webp") as image:
        assert getattr(image, "n_frames", 1) > 5


def test_ends_in_metres(tmp_path: Path) -> None:
    np.save(tmp_path / "m.npy", np.zeros((10, 20), bool))
    r = record(
        "plan", tmp_path / "m.npy", "--resolution", "0.5", "--start-m", "0.1,0.1", "--goal-m", "9.9,4.9"
    )
    assert (r["start"], r["goal"]) == ([0, 9], [19, 0])


def test_lists_of_maps_and_planners() -> None:
    names = {m["name"] for m in record("maps")["maps"]}
    assert {"guide", *(f"env-{k}" for k in range(1, 7))} <= names
    assert len(record("maps", "env-1")["queries"]) == 5
    assert {p["name"] for p in record("planners")["planners"]} >= {"ad-gso", "astar", "dijkstra"}
    one = record("planners", "sipp")
    assert (one["name"], one["traits"]["sees_traffic"]) == ("sipp", True)
    for verb in ("maps", "planners"):
        done = run(verb)
        assert done.returncode == 0
        assert "ad-gso" in done.stdout or "guide" in done.stdout


def test_one_planner_tells_what_all_its_settings_mean() -> None:
    for name, words in {
        "sipp": ("forecast :", "horizon :", "margin :", "tracks :"),
        "lpso": ("ring :", "inertia :", "waypoints :", "swarm :", "slack :"),
        "dstar16-lpso": ("particles :", "gates :"),
        "astar": (),
    }.items():
        done = run("planners", name)
        assert done.returncode == 0
        assert all(word in done.stdout for word in words), done.stdout
        assert ":class:" not in done.stdout
        assert "Raises" not in done.stdout


def test_a_plan_that_waits_says_what_its_duration_leaves_out(tmp_path: Path) -> None:
    np.save(tmp_path / "m.npy", np.zeros((1, 12), bool))
    (tmp_path / "s.yaml").write_text(
        "version: 1\nmap: {file: m.npy}\nstart: [0, 0]\ngoal: [8, 0]\nplanner: {name: sipp}\n"
        "obstacles: [{kind: recorded, track: [[4, 0], [4, 0], [4, 0], [4, 0], [4, 0], [5, 0], [6, 0], "
        "[7, 0], [8, 0], [9, 0], [10, 0]]}]\n"
    )
    done = run("run", str(tmp_path / "s.yaml"))
    assert done.returncode == 0, done.stderr
    told = " ".join(done.stdout.split())
    assert "ticks of waiting" in told
    assert " 0 ticks of waiting" not in told
    assert "without the waiting" in told
    assert "recorded ones by planners that see traffic" in done.stderr


def test_words_for_settings_of_planners_get_a_suggestion() -> None:
    for planner, setting, meant in (
        ("sipp", "forecast=velocty", "velocity"),
        ("dstar-lpso", "gates=replann", "replan"),
        ("mmas-dstar", "guide=rize", "rise"),
        ("gso", "choice=roulete", "roulette"),
    ):
        done = run("plan", "guide", "--planner", planner, "--set", setting)
        assert done.returncode == 2
        assert f"did you mean {meant}?" in done.stderr


def test_a_closed_pipe_is_no_error() -> None:
    done = subprocess.run(
        f"{sys.executable} -c 'from lampyris.cli import main; main()' plan env-1 --json | head -c 10",
        shell=True,
        capture_output=True,
        text=True,
        check=False,
    )
    assert "Traceback" not in done.stderr
    assert "BrokenPipe" not in done.stderr


def test_a_full_disk_is_told_as_such() -> None:
    if not Path("/dev/full").exists():
        pytest.skip("no /dev/full here")
    with open("/dev/full", "w", encoding="utf-8") as full:
        code = "from lampyris.cli import main; main()"
        done = subprocess.run(
            [sys.executable, "-c", code, "plan", "guide", "--json"],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert done.returncode == 3
    assert "FILE_WRITE" in done.stderr


def test_the_picture_shows_the_field_that_was_walked_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from typer.testing import CliRunner

    from lampyris.cli.app import app
    from lampyris.report.pictures import plan_picture as picture

    drawn = {}
    monkeypatch.setattr(picture, "draw_plan", lambda grid, plan, **given: drawn.update(given, plan=plan))
    words = ["plan", "guide", "--preset", "dissertation", "--set", "rho=0.9", "--set", "gamma=2"]
    done = CliRunner().invoke(app, [*words, "--picture", str(tmp_path / "a.png")])
    assert done.exit_code == 0, done.output
    assert drawn["field"].luciferin[9, 0] == drawn["plan"].jumps[0].luciferin


def test_an_internal_fault_is_exit_6_and_names_itself() -> None:
    code = (
        "import lampyris.cli.app as a, lampyris.cli as c\n"
        "def app(**k): raise RuntimeError('boom')\n"
        "a.app = app\nc.main()\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 6
    assert "boom" in done.stderr
    assert "Traceback" not in done.stderr
