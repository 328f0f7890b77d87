"""lampyris run and --save-scenario: what was done once is done again, byte for byte."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bad_inputs.case import run

MAIN = "from lampyris.cli import main; main()"
ENDS = ("--start", "0,0", "--goal", "0,0")
ROS = "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.1\n"


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def call(*words: str) -> tuple[int, str, str]:
    """The command line in this process: exit code, stdout, stderr."""
    done = run(*words)
    return done.exit, done.out, done.err


def same_again(
    *words: str, code: int = 0, ending: str = ".yaml", run: tuple[str, ...] = ()
) -> dict[str, Any]:
    """Do it, save it, run it: the same exit code and the same bytes; and what was saved."""
    plain = (*words, "--json", "--no-timing")
    first = call(*plain)
    assert first[0] == code, first[2]
    saved = call(*plain, "--save-scenario", f"saved{ending}", "--force")
    assert saved[:2] == first[:2], "saving changes nothing"
    again = call("run", f"saved{ending}", "--json", "--no-timing", *run)
    assert again[0] == code, again[2]
    assert again[1] == first[1]
    # And once more, from what running it saves.
    twice = call(
        "run", f"saved{ending}", "--json", "--no-timing", "--save-scenario", f"more{ending}", "--force", *run
    )
    assert twice[1] == first[1]
    assert Path(f"more{ending}").read_bytes() == Path(f"saved{ending}").read_bytes()
    record = json.loads(first[1])
    assert record["timing"] == {}
    assert isinstance(record, dict)
    return record


# ---- the same bytes --------------------


@pytest.mark.parametrize("ending", [".yaml", ".json"])
@pytest.mark.parametrize(
    "line",
    [
        "guide --preset dissertation --explain",
        "env-2 --planner astar --moves sixteen-connected",
        "rooms-20 --planner dijkstra --moves four-connected --law dissertation",
        "env-1 --set choice=roulette --seed 7 --set nt=4",
        "env-2 --radius 0.1 --resolution 0.25 --v-max 0.7 --d-max 2.5",
        "hills-48 --planner astar",
    ],
)
def test_a_plan(line: str, ending: str) -> None:
    explain = ("--explain",) if "--explain" in line else ()
    assert same_again("plan", *line.split(), ending=ending, run=explain)["status"] == "found"


@pytest.mark.commit(4)
@pytest.mark.parametrize("ending", [".yaml", ".json"])
@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("guide --preset dissertation --obstacles 6 --rate 0.5", 0),
        ("env-2 --obstacles 9 --mobility mixed --seed 3 --planner astar", 0),
        ("rooms-20 --obstacles 4 --mobility patrol --seed 5", 0),
        ("env-3 --obstacles 5 --mobility crossing --obstacle-radius 0.7 --radius 0.3", 0),
        ("env-3 --obstacles 4 --mobility mixed --obstacle-rectangle 1.5,0.6 --seed 2", 0),
        ("env-5 --obstacles 3 --ticks 4 --patience 2", 4),
        ("guide --obstacles 3 --track t.csv --set choice=exact", 0),
    ],
)
def test_a_simulation(line: str, code: int, ending: str) -> None:
    Path("t.csv").write_text("x,y,tick\n9,9,0\n9,8,5\n8,8,6\n")
    record = same_again("simulate", *line.split(), code=code, ending=ending)
    assert record["obstacle_specs"]
    assert record["obstacles"][-1]


def test_patrols_drawn_at_random_are_saved_as_they_were_drawn() -> None:
    call(*["simulate", "rooms-20", "--mobility", "patrol", "--obstacles", "4", "--save-scenario", "s.json"])
    said = json.loads(Path("s.json").read_text())["obstacles"]
    assert [one["kind"] for one in said] == ["patrol"] * 4
    assert all(len(one["waypoints"]) == 2 for one in said)


def test_answers_that_are_no_path_come_again_too() -> None:
    Path("wall.txt").write_text("..#..\n..#..\n..#..\n")
    ends = ("--start", "0,0", "--goal", "4,2")
    assert same_again("plan", "wall.txt", *ends, code=4)["status"] == "no-path"
    assert same_again("simulate", "wall.txt", *ends, "--obstacles", "2", code=4)["outcome"] == "no-path"
    blocked = same_again("plan", "wall.txt", "--start", "2,0", "--goal", "0,0", code=4)
    assert blocked["status"] == "start-occupied"
    tight = ("--start", "1,1", "--goal", "0,0", "--radius", "0.75")
    record = same_again("plan", "wall.txt", *tight, code=4)
    assert record["status"] == "start-occupied"
    assert "(1, 1) is free, but 0.5 m from a wall; the robot's radius is 0.75 m" in record["sentence"]
    record = same_again("simulate", "wall.txt", *tight, "--obstacles", "1", code=4)
    assert "0.5 m from a wall" in record["sentence"]


def test_maps_of_every_kind_of_file() -> None:
    Path("maps").mkdir()
    Path("maps/a.txt").write_text("S...\n.##.\n...G\n")
    assert same_again("plan", "maps/a.txt", "--resolution", "0.5")["map"]["name"] == "a.txt"
    np.save("maps/b.npy", np.zeros((6, 9), bool))
    metres = ("--start-m", "0.1,0.1", "--goal-m", "0.85,0.55", "--resolution", "0.1")
    record = same_again("plan", "maps/b.npy", *metres)
    assert (record["start"], record["goal"]) == ([1, 4], [8, 0])
    Path("maps/c.pgm").write_bytes(b"P5\n5 4\n255\n" + b"\xff" * 18 + b"\x00\xcd")
    Path("maps/c.yaml").write_text("image: c.pgm\nresolution: 0.05\norigin: [1, 2, 0.5]\n" + ROS)
    record = same_again("plan", "maps/c.yaml", "--start", "0,0", "--goal", "4,0")
    assert record["map"]["origin"] == [1.0, 2.0, 0.5]
    Path("costs.pgm").write_bytes(b"P5\n4 2\n255\n" + bytes([0, 100, 252, 0, 0, 0, 0, 254]))
    record = same_again("plan", "costs.pgm", "--values", "costmap", "--start", "0,0", "--goal", "3,0")
    assert record["cost"] > 3
    # A ROS map's own resolution is held to.
    Path("maps/c.yaml").write_text(Path("maps/c.yaml").read_text().replace("0.05", "0.1"))
    same_again("plan", "maps/c.yaml", "--start", "0,0", "--goal", "4,0")
    Path("maps/c.yaml").write_text(Path("maps/c.yaml").read_text().replace("0.1", "0.2"))
    assert "MAP_RESOLUTION" in call("run", "saved.yaml")[2]


def test_recipes_rows_and_dobs_are_decided_when_saved() -> None:
    made = "map: {recipe: maze, size: [21, 21], seed: 3, resolution: 0.5}\nstart: [1, 1]\ngoal: [19, 19]\n"
    Path("a.yaml").write_text(f"version: 1\npreset: dissertation\n{made}planner: astar\n")
    same_again("run", "a.yaml")
    said = Path("saved.yaml").read_text()
    assert "settings: {corridor: 1, wall: 1, loops: 0.0}" in said
    assert "preset" not in said
    assert "moves: dissertation" in said
    Path("d.dob").write_text(
        "NumberOfDynamicObstacles: 1 DynamicObstacleID: 0 ObstacleRadius: 0.0 NumberOfTrajectories: 1 "
        "TrajectoryID: 0 TrajectoryProbability: 1 NumberOfPoints: 2 3.5 0.5 0 0 3.5 3.5 3 0 "
        "ObstacleExistsAfterTrajectory: 0"
    )
    Path("b.yaml").write_text(
        "version: 1\nmap: {rows: [S...., ....., ....., '....G'], origin: [0, 0, 0]}\nsimulate: {}\n"
        "obstacles:\n  - {kind: recorded, file: d.dob}\n"
    )
    record = same_again("run", "b.yaml")
    assert record["obstacles"][3] == [[3, 0]]
    assert "track: [[3, 3], [3, 2], [3, 1], [3, 0]]" in Path("saved.yaml").read_text()
    assert "vanishes at its end" in call("run", "b.yaml")[2]


@pytest.mark.nightly
def test_in_another_process_and_another_folder(tmp_path: Path) -> None:
    (tmp_path / "maps").mkdir()
    (tmp_path / "away").mkdir()
    Path("maps/a.txt").write_text("S...\n.##.\n...G\n")
    words = ["simulate", "maps/a.txt", "--obstacles", "1", "--json", "--no-timing"]
    first = call(*words, "--save-scenario", "maps/s.yaml")
    done = subprocess.run(
        [sys.executable, "-c", MAIN, "run", "../maps/s.yaml", "--json", "--no-timing"],
        cwd=tmp_path / "away", capture_output=True, text=True, check=False,
        env={**os.environ, "PYTHONHASHSEED": "7"},
    )  # fmt: skip
    assert (done.returncode, done.stdout) == first[:2]


# ---- options --------------------


@pytest.mark.nightly
def test_run_writes_what_plan_and_simulate_write() -> None:
    call("plan", "guide", "--save-scenario", "p.yaml")
    call("simulate", "guide", "--obstacles", "2", "--save-scenario", "s.yaml")
    code, out, err = call(
        "run", "p.yaml", "--picture", "p.png", "--csv", "p.csv", "--explain", "--layer", "cost"
    )
    assert (code, err) == (0, "")
    assert "Iteration 1" in out
    assert "wrote p.png" in out
    call("plan", "guide", "--csv", "q.csv", "--picture", "q.png", "--layer", "cost")
    assert Path("p.csv").read_bytes() == Path("q.csv").read_bytes()
    assert Path("p.png").read_bytes() == Path("q.png").read_bytes()
    code, out, _ = call("run", "s.yaml", "--film", "s.webp", "--csv", "s.csv")
    assert code == 0
    assert Path("s.webp").exists()
    call("simulate", "guide", "--obstacles", "2", "--csv", "t.csv")
    assert Path("s.csv").read_bytes() == Path("t.csv").read_bytes()


def test_the_name_of_a_scenario_is_shown() -> None:
    for more in ("", "simulate: {}\n"):
        Path("s.yaml").write_text(f"version: 1\nname: the small one\nmap: guide\n{more}")
        assert "the small one" in call("run", "s.yaml")[1]


def test_timing_is_there_unless_it_is_not_wanted() -> None:
    assert set(json.loads(call("plan", "guide", "--json")[1])["timing"]) >= {"plan_s", "total_s"}
    assert json.loads(call("plan", "guide", "--json", "--no-timing")[1])["timing"] == {}
    assert (
        call("plan", "guide", "--json", "--no-timing")[1] == call("plan", "guide", "--json", "--no-timing")[1]
    )


def test_a_film_is_not_of_a_plan() -> None:
    call("plan", "guide", "--save-scenario", "p.yaml")
    call("simulate", "guide", "--obstacles", "2", "--save-scenario", "s.yaml")
    cases = [
        ("p", "--film", "x.webp"),
        ("s", "--picture", "x.png"),
        ("s", "--explain", ""),
        ("s", "--layer", "cost"),
    ]
    for name, option, value in cases:
        code, out, err = call("run", f"{name}.yaml", *(w for w in (option, value) if w))
        assert (code, out) == (2, "")
        assert f"{option} with a scenario that {'plans' if name == 'p' else 'simulates'}" in err
    assert not Path("x.webp").exists()


@pytest.mark.parametrize(
    ("words", "code", "says"),
    [
        (("plan", "guide", "--save-scenario", "p.txt"), 2, ".yaml, .yml, .json"),
        (("plan", "guide", "--save-scenario", "there.yaml"), 2, "--force"),
        (("plan", "guide", "--save-scenario", "none/p.yaml"), 3, "cannot write"),
        (("plan", "guide", "--save-scenario", "a.json", "--csv", "a.json"), 2, "two outputs"),
        (("plan", "guide", "--layer", "luciferine"), 2, "did you mean luciferin?"),
        (("plan", "guide", "--preset", "robt"), 2, "did you mean robot?"),
        (("plan", "guide", "--moves", "octil"), 2, "did you mean octile?"),
        (("plan", "guide", "--planner", "astra"), 2, "did you mean astar?"),
        (("plan", "guide", "--law", "phisical"), 2, "did you mean physical?"),
        (("plan", "guide", "--set", "choise=exact"), 2, "did you mean choice?"),
        (("plan", "guide", "--values", "ocupancy"), 2, "did you mean occupancy?"),
        (("plan", "guide", "--colour", "luminence"), 2, "did you mean luminance?"),
        (("plan", "guide", "--max-cells", "99"), 5, "100 cells"),
        (("plan", "guide", "--max-cells", "0"), 2, "error[TYPE]: --max-cells: 0; allowed: a whole"),
        (("plan", "guide", "--seed", "-1"), 2, "SEED]: --seed: -1"),
        (("simulate", "guide", "--mobility", "patrol", "--seed", "-1"), 2, "SEED]: --seed: -1"),
        (("simulate", "guide", "--mobility", "patroll"), 2, "did you mean patrol?"),
        (("simulate", "full.txt", *ENDS, "--mobility", "patrol"), 3, "0 of 10 patrols fit"),
        (("simulate", "guide", "--track", "bad.csv"), 3, "bad.csv:3: x is 'no'"),
        (("run", "none.yaml"), 3, "FILE_MISSING"),
        (("run", "bad.yaml"), 3, "error[SEED]: bad.yaml:3:7: /seed: -1"),
        (("run", "bad.yaml"), 3, "error[MOVES]: bad.yaml:4:8: /moves: 'octil'"),
        (("run", "many.yaml"), 5, "error[LIMIT]"),
        (("run", "out.yaml"), 3, "PATH_OUTSIDE"),
        (("run", "crash.yaml"), 3, "error[OBSTACLE_START]: crash.yaml: obstacle 1 is on the robot at t = 0"),
        (("run", "meet.yaml"), 3, "error[OBSTACLE_OVERLAP]: meet.yaml: obstacles 1 and 2 are in one cell"),
        (("run", "wall.yaml"), 3, "error[OBSTACLE_TRACK]: wall.yaml: obstacle 0 meets a wall at (0, 0), t"),
        (("run", "there.yaml", "--max-cells", "99"), 5, "100 cells"),
    ],
)  # fmt: skip
def test_mistakes(words: tuple[str, ...], code: int, says: str) -> None:
    head = "version: 1\nmap: guide\n"
    bodies = f"{head}simulate: {{}}\nobstacles:\n"
    rest = "  - {kind: patrol, waypoints: [[5, 5]]}\n"
    files = {
        "there.yaml": head,
        "bad.yaml": f"{head}seed: -1\nmoves: octil\n",
        "many.yaml": f"{bodies}  - {{kind: crossing, count: 10001}}\n",
        "out.yaml": "version: 1\nmap: {file: ../m.txt}\n",
        "crash.yaml": f"{bodies}{rest}  - {{kind: recorded, track: [[0, 9]]}}\n",
        "meet.yaml": f"{bodies}  - {{kind: crossing, count: 0}}\n{rest}{rest}",
        "wall.yaml": f"{bodies}  - {{kind: recorded, track: [[4, 0], [3, 0], [2, 0], [1, 0], [0, 0]]}}\n",
        "bad.csv": "x,y\n1,1\nno,1\n",
        "full.txt": "##\n##\n",
    }
    for name, text in files.items():
        Path(name).write_text(text)
    got, out, err = call(*words)
    assert got == code, err
    assert says in err, err
    assert out == ""
    assert "Traceback" not in err


def test_allow_outside_on_the_command_line(tmp_path: Path) -> None:
    (tmp_path / "runs").mkdir()
    Path("m.txt").write_text("S.G\n")
    _, first, err = call("plan", "m.txt", "--save-scenario", "runs/s.yaml", "--json", "--no-timing")
    assert "(--allow-outside)" in err
    assert call("run", "runs/s.yaml")[0] == 3
    assert call("run", "runs/s.yaml", "--allow-outside", "--json", "--no-timing")[1] == first
    (tmp_path / "maps").mkdir()
    Path("p.pgm").write_bytes(b"P5\n2 1\n255\n\xff\xff")
    Path("maps/m.yaml").write_text("image: ../p.pgm\nresolution: 1\norigin: [0, 0, 0]\n" + ROS)
    ends = ("--start", "0,0", "--goal", "1,0")
    assert "PATH_OUTSIDE" in call("plan", "maps/m.yaml", *ends)[2]
    assert call("plan", "maps/m.yaml", *ends, "--allow-outside")[0] == 0


def test_schema_prints_the_schema() -> None:
    from lampyris.io.scenario.schema import json_schema

    code, out, _ = call("schema")
    assert (code, json.loads(out)) == (0, json_schema())


def test_the_library_says_the_same() -> None:
    import lampyris

    _, out, _ = call("plan", "guide", "--planner", "astar", "--save-scenario", "s.yaml", "--json")
    scenario = lampyris.load_scenario("s.yaml")
    done = lampyris.run(scenario)
    assert not isinstance(done, lampyris.Trace)
    assert done.plan.cells is not None
    assert done.plan.cells.tolist() == json.loads(out)["cells"]
    assert done.profile is not None
    assert done.profile.v.tolist() == json.loads(out)["speed"]["v"]


# ---- ways out --------------------


@pytest.mark.commit(1)
@pytest.mark.parametrize(
    "words",
    [
        ("plan", "env-1", "--json"), ("--help",),
        *(
            pytest.param(words, marks=pytest.mark.nightly)
            for words in (
                ("plan", "guide", "--preset", "dissertation", "--explain"), ("maps",), ("schema",),
                ("plan", "wall.txt", "--start", "0,0", "--goal", "2,0"),
            )
        ),
    ],
)  # fmt: skip
def test_a_reader_that_has_left_is_exit_0_and_silence(words: tuple[str, ...]) -> None:
    Path("wall.txt").write_text(".#.\n")
    code = "import sys; sys.stdin.readline()\n" + MAIN
    with subprocess.Popen(
        [sys.executable, "-c", code, *words],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        process.stdin.write(b"go\n")
        process.stdin.close()
        err = process.stderr.read().decode()
        assert (process.wait(60), err) == (0, "")


@pytest.mark.parametrize("words", [("run", "--help"), ("plan", "guide", "--json")])
def test_the_models_are_made_for_scenario_files_only(words: tuple[str, ...]) -> None:
    # pydantic itself may be there: some releases of typer use it.
    code = (
        f"import sys; sys.argv = ['lampyris', *{words!r}]\n"
        "from lampyris.cli import main\n"
        "try:\n    main()\nexcept SystemExit as done:\n    assert not done.code\n"
        "assert 'lampyris.io.scenario.schema' not in sys.modules\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_an_interrupt_is_exit_130_without_a_traceback() -> None:
    code = (
        "import signal, time, lampyris.cli.verbs.planners as verb\n"
        # A suite in the background hands down that it is ignored.
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "def slow(name, as_json):\n    print('ready', flush=True)\n    time.sleep(60)\n"
        f"verb.show_planners = slow\n{MAIN}"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code, "planners"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        assert process.stdout.readline() == "ready\n"
        process.send_signal(signal.SIGINT)
        err = process.stderr.read()
        assert (process.wait(30), err) == (130, "interrupted\n")


def test_an_interrupt_does_not_wait_for_the_interpreter_to_be_taken_down() -> None:
    """SciPy imports multiprocessing for itself; that alone is no reason to stay."""
    code = (
        "import atexit, multiprocessing.pool\n"
        "import lampyris.cli.verbs.planners as verb\n"
        "atexit.register(print, 'taken down')\n"
        f"def slow(name, as_json):\n    raise KeyboardInterrupt\nverb.show_planners = slow\n{MAIN}"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, "planners"], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "interrupted\n")


def test_an_interrupt_within_code_from_a_string_is_exit_130_too() -> None:
    """Python would end itself by the signal, anyone who has caught the exception."""
    code = (
        "import lampyris.cli.verbs.planners as verb\n"
        "def slow(name, as_json):\n    exec('raise KeyboardInterrupt')\n"
        f"verb.show_planners = slow\n{MAIN}"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, "planners"], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "interrupted\n")


def test_an_interrupt_where_python_cannot_raise_it_is_heard_at_the_next_look() -> None:
    """In a function that C calls, as LLVM does while code is loaded: it was printed with a traceback."""
    code = (
        "import ctypes, signal, lampyris.cli.verbs.planners as verb\n"
        "from lampyris._core import cancellation as halting\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "@ctypes.CFUNCTYPE(None)\n"
        "def called():\n    signal.raise_signal(signal.SIGINT)\n"
        "@ctypes.CFUNCTYPE(None)\n"
        "def wrong():\n    raise ValueError('said as ever')\n"
        "def slow(name, as_json):\n"
        "    wrong()\n    called()\n    print('went on', flush=True)\n"
        "    while True:\n        halting.checkpoint()\n"
        f"verb.show_planners = slow\n{MAIN}"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, "planners"], capture_output=True, text=True, check=False, timeout=120
    )
    assert (done.returncode, done.stdout) == (130, "went on\n")
    assert "ValueError: said as ever" in done.stderr
    assert "KeyboardInterrupt" not in done.stderr
    assert done.stderr.endswith("\ninterrupted\n")


def test_a_time_limit_is_exit_5_and_says_so() -> None:
    words = ["plan", "env-1", "--planner", "gso", "--set", "iterations=100000", "--set", "swarm=500"]
    call = [sys.executable, "-c", MAIN, *words, "--set", "seeded=false", "--time-limit", "0.05", "--json"]
    done = subprocess.run(call, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 5, done.stderr
    told = json.loads(done.stdout)
    assert told["status"] == "limit"
    refused = subprocess.run([*call[:-2], "0"], capture_output=True, text=True, check=False)
    assert refused.returncode == 2
    assert "--time-limit" in refused.stderr
    assert "error[BUDGET]" in refused.stderr


@pytest.mark.nightly
def test_a_robot_whose_planner_runs_out_of_time_waits_and_says_so() -> None:
    words = ["simulate", "env-1", "--planner", "gso", "--set", "iterations=100000", "--set", "swarm=500"]
    more = ["--set", "seeded=false", "--plan-limit", "0.02", "--patience", "2", "--obstacles", "2", "--json"]
    done = subprocess.run(
        [sys.executable, "-c", MAIN, *words, *more], capture_output=True, text=True, check=False, timeout=120
    )
    assert done.returncode == 4, done.stderr
    told = json.loads(done.stdout)
    assert told["outcome"] == "blocked"
    assert any("Stopped after 0.02 s, its limit" in event["sentence"] for event in told["events"])


def test_edits_run_again_to_the_same_bytes() -> None:
    """What an app would save after somebody painted while it played."""
    bodies = [{"kind": "random-walk", "count": 9}, {"kind": "crossing", "count": 2}]
    painted = [{"tick": 0, "freed": [[9, 9]]}, {"tick": 6, "blocked": [[x, 20] for x in range(44)]}]
    given = {"version": 1, "map": "env-3", "start": [2, 2], "goal": [45, 45], "seed": 4, "simulate": {}}
    Path("a.json").write_text(json.dumps(given | {"obstacles": bodies, "edits": painted}))
    code, first, _ = call("run", "a.json", "--json", "--no-timing", "--save-scenario", "b.yaml")
    said = json.loads(first)
    assert code in (0, 4)
    assert [e["tick"] for e in said["edits"]] == [6]
    assert {"wall", "replan"} <= {e["word"] for e in said["events"]}
    for again in ("a.json", "b.yaml"):
        assert call("run", again, "--json", "--no-timing")[:2] == (code, first)
    _, told, _ = call("run", "b.yaml")
    assert "cells turned into walls, 0 free" in told
    Path("plan.yaml").write_text("version: 1\nmap: guide\nedits: [{tick: 3, blocked: [[1, 1]]}]\n")
    assert "edits after tick 0 are left aside" in call("run", "plan.yaml")[2]
    Path("drive.yaml").write_text(Path("plan.yaml").read_text() + "drive: {}\n")
    code, _, said_ = call("run", "drive.yaml")
    assert (code, "error[EDITS]: drive.yaml:3:9" in said_) == (3, True)
