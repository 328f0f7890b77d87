"""``lampyris fleet``: what it prints and writes, and its exit codes."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest
from PIL import Image

import lampyris
from in_process import call
from lampyris.report.film.fleet_film import FleetRenderer
from lampyris.report.film.simulation_film import moments
from lampyris.report.style import FLEET

ROOT = Path(__file__).resolve().parents[2]
SHARED = Path(os.environ.get("LAMPYRIS_SHARED") or ROOT.parent / "shared") / "maps" / "mapf"


def test_json_has_the_keys_that_were_promised() -> None:
    said = call("fleet", "guide", "--robots", "6", "--seed", "3", "--json")
    assert said.returncode == 0
    record = json.loads(said.stdout)
    fleet = lampyris.random_fleet(lampyris.load_grid("guide"), 6, seed=3)
    plan = lampyris.plan_fleet(fleet, seed=3)
    assert record["status"] == "found"
    assert record["planner"] == "lacam"
    assert record["paths"] == [path.tolist() for path in plan.paths]
    assert record["makespan"] == plan.makespan == max(len(path) - 1 for path in record["paths"])
    assert record["sum_of_costs"] == plan.sum_of_costs == sum(len(path) - 1 for path in record["paths"])
    assert record["lower_bound"] == plan.lower_bound
    assert [path[0] for path in record["paths"]] == record["starts"]
    assert [path[-1] for path in record["paths"]] == record["goals"]
    assert {"plan_s", "referee_s", "total_s", "loading_s"} == record["timing"].keys()


def test_repeated_calls_print_the_same() -> None:
    words = ("fleet", "guide", "--robots", "20", "--iterations", "2000", "--json", "--no-timing")
    first, again = call(*words), call(*words)
    assert first.stdout == again.stdout
    assert json.loads(first.stdout)["timing"] == {}


def test_text_says_what_was_found() -> None:
    said = call("fleet", "rooms-20", "--robots", "30", "--seconds", "0.3")
    assert said.returncode == 0
    for words in ("All robots reach their goals", "makespan", "sum of costs", "at least", "gap"):
        assert words in said.stdout


def test_not_solved_is_exit_4_with_what_was_found() -> None:
    words = ("fleet", "rooms-20", "--robots", "30", "--planner", "pibt", "--set", "ticks=3")
    said = call(*words, "--json")
    record = json.loads(said.stdout)
    assert (said.returncode, record["status"], record["sum_of_costs"]) == (4, "iteration-limit", None)
    assert len(record["paths"]) == 30
    assert "robots stand on their goals" in call(*words).stdout
    said = call("fleet", "rooms-20", "--robots", "30", "--seconds", "1e-9")
    assert (said.returncode, "Stopped at the budget" in said.stdout) == (4, True)


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (("guide",), 2, "no robots"),
        (("guide", "--robots", "0"), 2, "--robots"),
        (("guide", "--robots", "79"), 2, "1 to 78"),
        (("guide", "--robots", "3", "--planner", "pibbt"), 2, "did you mean pibt"),
        (("guide", "--robots", "3", "--moves", "dissertation"), 2, "four-connected, octile"),
        (("guide", "--robots", "3", "--set", "samples=0"), 2, "samples"),
        (("guide", "--robots", "3", "--set", "sample=1"), 2, "did you mean samples"),
        (("guide", "--robots", "3", "--seconds", "0"), 2, "--seconds"),
        (("guide", "--robots", "3", "--iterations", "0"), 2, "--iterations"),
        (("guide", "--robots", "3", "--film", "a.mov"), 2, ".webp"),
        (("guide", "--scen", "none.scen"), 3, "none.scen"),
        (("guide", "--scen", "a.scen", "--agents", "a.csv"), 2, "one of them"),
        (("nowhere", "--robots", "3"), 3, "nowhere"),
    ],
)
def test_exit_codes(words: tuple[str, ...], code: int, message: str) -> None:
    said = call("fleet", *words)
    assert (said.returncode, said.stdout) == (code, "")
    assert message in said.stderr


def test_tables_beyond_the_limit_are_exit_5(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LAMPYRIS_MAX_MEMORY", "1")
    said = call("fleet", "warehouse-200", "--robots", "100")
    assert said.returncode == 5
    assert "the distance table of 100 robots" in said.stderr
    assert "LAMPYRIS_MAX_MEMORY" in said.stderr


def test_agents_file(tmp_path: Path) -> None:
    file = tmp_path / "agents.yaml"
    file.write_text("agents:\n  - {start: [0, 9], goal: [7, 0]}\n  - {start: [7, 0], goal: [0, 9]}\n")
    record = json.loads(call("fleet", "guide", "--agents", str(file), "--json").stdout)
    assert (record["robots"], record["starts"]) == (2, [[0, 9], [7, 0]])
    file.write_text("agents:\n  - {start: [0, 9], goal: [99, 0]}\n")
    said = call("fleet", "guide", "--agents", str(file))
    assert said.returncode == 3
    assert "agents.yaml:2:5" in said.stderr


@pytest.mark.nightly
def test_picture_and_film(tmp_path: Path) -> None:
    picture, film = tmp_path / "a.png", tmp_path / "a.webp"
    words = ("fleet", "guide", "--robots", "6", "--picture", str(picture), "--film", str(film))
    said = call(*words)
    assert said.returncode == 0
    with Image.open(picture) as drawn:
        assert drawn.size[0] > 400
    plan = lampyris.plan_fleet(lampyris.random_fleet(lampyris.load_grid("guide"), 6))
    with Image.open(film) as made:
        assert made.n_frames >= plan.makespan
    assert call(*words).returncode == 2, "files that exist are kept"
    before = film.read_bytes()
    assert call(*words, "--force").returncode == 0
    assert film.read_bytes() == before


def test_a_frame_shows_every_robot_where_it_is() -> None:
    fleet = lampyris.random_fleet(lampyris.load_grid("guide"), 6)
    plan = lampyris.plan_fleet(fleet)
    renderer = FleetRenderer(plan, fleet, 20, moments(plan.makespan, 16))
    for tick in (0, plan.makespan // 2, plan.makespan):
        frame = renderer.frame(float(tick))
        left = (frame.shape[1] - 20 * fleet.grid.width) // 2
        for k, (x, y) in enumerate(plan.at(tick).tolist()):
            pixel = frame[8 + 20 * y + 10, left + 20 * x + 10]
            assert tuple(pixel.tolist()) == FLEET[k]


@pytest.mark.skipif(not SHARED.is_dir(), reason="the benchmark's maps are not here")
@pytest.mark.parametrize(("name", "robots"), [("den312d", 300), ("room-32-32-4", 200), ("maze-32-32-2", 250)])
def test_instances_of_the_benchmark(name: str, robots: int) -> None:
    """Maps that need the swap rule."""
    scen = SHARED / f"{name}-random-1.scen"
    words = ("fleet", str(SHARED / f"{name}.map"), "--scen", str(scen), "--robots", str(robots), "--json")
    said = call(*words)
    record = json.loads(said.stdout)
    assert (said.returncode, record["status"], record["robots"]) == (0, "found", robots)
