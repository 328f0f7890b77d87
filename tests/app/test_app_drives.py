"""Drives as an engine answers them: the same as the command line, byte for byte, in samples that the page plays."""

from __future__ import annotations

import hashlib
import io
import json
import math
import struct
import sys
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import pytest
from PIL import Image
from test_app_work import ask, only, refusal

import lampyris
from lampyris import scenarios
from lampyris._core.cancellation import Cancelled
from lampyris.app.engine import driving, work
from lampyris.app.engine.frames import NOWHERE
from lampyris.app.engine.parse import scenario_of_request
from lampyris.cli import main
from lampyris.report.data.following import following

ROWS = ["." * 24 for _ in range(9)] + ["#" * 15 + "." * 9] + ["." * 24 for _ in range(8)]
CAR = {"rectangle": [0.9, 0.5], "drive": "ackermann", "turn_radius": 0.8}


def car(**more: Any) -> dict[str, Any]:
    """What the page says of a car among two walkers."""
    return {
        "version": 1, "map": {"rows": ROWS, "name": "yard", "resolution": 0.25}, "robot": CAR, "preset": "robot",
        "start": {"cell": [3, 4], "yaw": 0.0}, "goal": {"cell": [4, 14], "yaw": math.pi / 2}, "planner": "lattice",
        "obstacles": [{"kind": "random-walk", "count": 2}], "drive": {}, "seed": 4, **more,
    }  # fmt: skip


def samples(frames: list[tuple[str, Any]]) -> dict[str, np.ndarray]:
    """The columns of all frames ``D``."""
    parts: list[list[np.ndarray]] = []
    for kind, raw in frames:
        if kind != "D":
            continue
        first, n, bodies = struct.unpack_from("<IHH", raw)
        assert first == sum(len(part[0]) for part in parts)
        at, columns = 8, []
        for size, dtype in ((2, "<f4"), (1, "<f4"), (1, "<f4"), (1, "u1"), (2 * bodies, "<f4"), (1, "<f4")):
            columns.append(np.frombuffer(raw, dtype, n * size, at).reshape(n, -1))
            at += columns[-1].nbytes
        assert at == len(raw)
        parts.append(columns)
    names = ("xy", "yaw", "speed", "cause", "places", "near")
    return {name: np.vstack([part[k] for part in parts]) for k, name in enumerate(names)}


SMALL = {"samples": 60, "steps": 30, "hold": 3, "smooth": False}


@pytest.mark.nightly
@pytest.mark.parametrize("controller", ["exact", "rpp", "mppi"])
def test_a_drive_is_that_of_the_command_line_and_its_samples_are_where_it_was(
    controller: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    settings = {"controller_settings": SMALL} if controller == "mppi" else {}
    scenario = car(drive={"controller": controller, **settings})
    frames = ask("drive", scenario)
    assert [kind for kind, _ in frames] == ["H", "D", "E", "Z"]
    head, end, seen = only(frames, "H"), only(frames, "Z"), samples(frames)
    made: Any = scenarios.run(scenario_of_request({"scenario": scenario}))
    assert (head["controller"], end["outcome"], end["arrived"]) == (controller, "arrived", True)
    assert end["following"] == following(made)

    times = np.minimum(np.arange(len(seen["xy"])) * head["step"], made.duration)
    assert times[-1] == made.duration
    assert np.abs(seen["xy"] - made.at(times)[0]).max() < 1e-4
    turned = seen["yaw"][:, 0] - made.poses(times)[:, 2]
    assert np.abs(np.remainder(turned + math.pi, 2 * math.pi) - math.pi).max() < 1e-5
    assert np.abs(np.diff(seen["yaw"][:, 0])).max() < 1, "it goes on beyond a full turn"
    assert {head["causes"][k] for k in seen["cause"][:, 0]} <= set(made.cause)
    for k, track in enumerate(made.tracks):
        assert np.abs(seen["places"][:, 2 * k : 2 * k + 2] - track.at(times)).max() < 1e-4
    assert (seen["near"] >= 0).all()
    assert np.isfinite(seen["near"]).all()
    path = head["paths"][0]
    assert path["t"] == 0
    assert {pose[3] for pose in path["poses"]} <= {-1, 0, 1}
    assert np.hypot(*(np.array(path["poses"][-1][:2]) - (4, 14))) < 1

    whole = b"".join(value for kind, value in ask("export", scenario, what="scenario") if kind == "B")
    file = tmp_path / "car.yaml"
    file.write_bytes(whole)
    words = ["lampyris", "run", str(file), "--json", "--no-timing"]
    with mock.patch.object(sys, "argv", words), pytest.raises(SystemExit) as done:
        main()
    assert done.value.code == 0
    assert hashlib.sha256(capfd.readouterr().out.rstrip("\n").encode()).hexdigest() == end["digest"]


def test_a_drive_with_a_sensor_says_from_which_sample_on_each_cell_had_been_seen() -> None:
    rows = ["............", ".####.#####.", "............"]
    grid = {"rows": rows, "resolution": 1.0}
    scenario = {
        "version": 1, "map": grid, "start": [0, 0], "goal": [11, 2], "planner": "astar", "drive": {"sensor_range": 3},
    }  # fmt: skip
    frames = ask("drive", scenario)
    assert [kind for kind, _ in frames] == ["H", "D", "U", "E", "Z"]
    head, raw = only(frames, "H"), next(value for kind, value in frames if kind == "U")
    count = struct.unpack_from("<I", raw)[0]
    cells, first = np.frombuffer(raw, "<u4", 2 * count, 4).reshape(2, -1)
    made: Any = scenarios.run(scenario_of_request({"scenario": scenario}))
    assert head["sensor"] == [3.0, math.tau]
    assert set(cells.tolist()) == set(np.flatnonzero(made.seen.ravel() >= 0).tolist())
    last = len(samples(frames)["xy"]) - 1
    began = made.seen.ravel()[cells] * made.period
    assert (first * head["step"] >= began - 1e-6)[first < last].all()
    assert (first * head["step"] < began + head["step"] + 1e-6).all()
    assert 0 < (first == 0).sum() < count


def test_a_plan_says_which_steps_are_driven_in_reverse() -> None:
    into = car(goal={"cell": [4, 14], "yaw": 0.0})
    plan = only(ask("plan", into), "Z")
    gears = [pose[3] for pose in plan["pose_cells"]]
    scenario = scenario_of_request({"scenario": into})
    path = lampyris.plan(scenario.scene, "lattice", seed=scenario.seed).pose_path
    assert path is not None
    assert gears[:-1] == path.gears.tolist()
    assert -1 in gears
    assert len(plan["obstacle_specs"]) == 2, "they stand where the drive begins"


def test_paths_that_are_too_many_to_be_drawn_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = car(planner="astar", robot={"radius": 0.2}, obstacles=[])
    whole = ask("drive", scenario)
    (path,) = only(whole, "H")["paths"]
    notes = only(whole, "Z")["notes"]
    monkeypatch.setattr(driving, "MOST_POSES", len(path["poses"]))
    assert only(ask("drive", scenario), "H")["paths"] == [path]
    monkeypatch.setattr(driving, "MOST_POSES", len(path["poses"]) - 1)
    fewer = ask("drive", scenario)
    assert only(fewer, "H")["paths"] == []
    (said,) = [note for note in only(fewer, "Z")["notes"] if note not in notes]
    assert said.startswith("1 of the 1 paths that the robot was to follow are not drawn")


@pytest.mark.nightly
def test_obstacles_that_come_later_are_nowhere_before() -> None:
    later = car(obstacles=[{"kind": "random-walk", "count": 2, "rate": 0.2}])
    frames = ask("drive", later)
    seen = samples(frames)
    assert any(event["word"] == "appear" for event in only(frames, "E"))
    assert (seen["places"][0] == NOWHERE).any()
    assert (seen["places"] == NOWHERE).all(axis=1).sum() < len(seen["places"])


def test_a_drive_along_cells_has_no_measures_of_a_pose() -> None:
    frames = ask("drive", car(planner="astar", robot={"radius": 0.2}))
    assert only(frames, "Z")["following"] is None
    assert len(only(frames, "H")["paths"][0]["poses"][0]) == 2


def test_a_robot_that_cannot_set_off_has_one_sample() -> None:
    closed = [row if k != 9 else "#" * 24 for k, row in enumerate(ROWS)]
    frames = ask("drive", car(map={"rows": closed, "name": "yard", "resolution": 0.25}))
    assert only(frames, "Z")["outcome"] == "no-path"
    assert len(samples(frames)["xy"]) == 1


@pytest.mark.parametrize(
    ("more", "code", "where"),
    [
        ({"drive": {"controller": "nobody"}}, "DRIVE_SETTING", "/drive/controller"),
        ({"drive": {"period": -1}}, "", "/drive/period"),
        (
            {"drive": {"controller": "mppi", "controller_settings": {"sample": 9}}},
            "CONTROLLER_SETTING",
            "/drive",
        ),
        (
            {"drive": {"controller": "mppi", "controller_settings": {"samples": 9}}},
            "CONTROLLER_SETTING",
            "/drive",
        ),
        ({"drive": {"controller": "rpp", "tracking": "velocity"}}, "", ""),
        ({"drive": {"controller": "rpp"}, "planner": "astar", "robot": {}}, "", ""),
        ({"edits": [{"tick": 3, "blocked": [[1, 1]], "freed": []}]}, "EDITS", "/edits/0"),
    ],
)
def test_what_cannot_be_driven_is_refused_at_its_place(more: dict[str, Any], code: str, where: str) -> None:
    fault = refusal("drive", car(**more))
    assert fault.exit_code in (2, 3), fault
    assert where in fault.where
    assert fault.code == code or not code


def test_a_scenario_that_says_nothing_of_drives_is_not_driven() -> None:
    simulated = {key: value for key, value in car(planner="astar").items() if key != "drive"}
    assert refusal("drive", simulated | {"robot": {}}).code == "DRIVE"


@pytest.mark.nightly
def test_it_says_how_far_it_is_and_stops_when_nobody_waits() -> None:
    told: list[dict[str, Any]] = []
    with mock.patch.object(
        driving, "Share", lambda what: lambda done: told.append({"what": what, "done": done})
    ):
        ask("drive", car(drive={"controller": "rpp"}))
    assert told[0]["what"] == "driving with rpp"
    assert told[-1]["done"] > 3

    def look() -> None:
        if len(told) > many + 3:
            raise Cancelled

    many = len(told)
    with (
        mock.patch.object(
            driving, "Share", lambda what: lambda done: told.append({"what": what, "done": done})
        ),
        pytest.raises(Cancelled),
    ):
        list(work.answer({"verb": "drive", "job": 1, "scenario": car(drive={"controller": "rpp"})}, look))


@pytest.mark.nightly
def test_many_samples_are_farther_apart() -> None:
    made: Any = scenarios.run(scenario_of_request({"scenario": car()}))
    assert driving.step_of(made) == driving.STEP
    with mock.patch.object(driving, "MOST_PLACES", 100):
        assert driving.step_of(made) / driving.STEP == pytest.approx(
            math.ceil((made.duration / driving.STEP + 1) * 3 / 100)
        )
    with mock.patch.object(driving, "PIECE", 50):
        frames = [(chr(one[4]), one[5:]) for one in driving.frames_of(made, {})]
    assert len(samples(frames)["xy"]) == math.ceil(made.duration / driving.STEP - 1e-9) + 1


@pytest.mark.nightly
def test_films_moments_and_numbers_are_of_the_drive() -> None:
    scenario = car(obstacles=[])

    def whole(what: str, **more: Any) -> bytes:
        return b"".join(value for kind, value in ask("export", scenario, what=what, **more) if kind == "B")

    film = Image.open(io.BytesIO(whole("gif", settings={"scale": 8})))
    assert film.n_frames > 20
    first, later = (Image.open(io.BytesIO(whole("png", tick=tick))) for tick in (0, 60))
    assert first.size == later.size
    assert first.tobytes() != later.tobytes()
    assert whole("csv").startswith(b"t_s,x_m,y_m,yaw,v,a")
    assert refusal("export", scenario, what="report").code == "EXPORT"
    json.dumps(only(ask("plan", scenario), "Z"))


def test_obstacles_that_are_polygons_have_an_outline_and_turn() -> None:
    """In cells, with their heading at the corners of their tracks; a planner with times is driven, too."""
    track = {"kind": "recorded", "track": [[20, y] for y in range(2, 12)], "rectangle": [0.5, 0.25]}
    scenario = car(
        planner="lattice-sipp",
        obstacles=[track, {"kind": "random-walk", "count": 1}],
        drive={"time_limit": 4.0},
    )
    polygon, disc = only(ask("drive", scenario), "H")["obstacle_specs"]
    assert polygon["outline"] == [[-1.0, -0.5], [1.0, -0.5], [1.0, 0.5], [-1.0, 0.5]]
    assert "outline" not in disc
    times, yaws = zip(*polygon["turns"], strict=True)
    assert list(times) == sorted(times)
    assert set(yaws) == {-1.5708}, "it goes down the map"


def test_obstacles_that_are_polygons_stand_to_scale_before_anything_has_moved() -> None:
    """In plans and in simulations in ticks: outline in cells, and the heading with which they begin."""
    track = {"kind": "recorded", "track": [[20, y] for y in range(2, 12)], "rectangle": [0.5, 0.25]}
    walker = {"kind": "random-walk", "count": 1, "rectangle": [0.5, 0.25]}
    outline = [[-1.0, -0.5], [1.0, -0.5], [1.0, 0.5], [-1.0, 0.5]]
    scenario = car(obstacles=[track, walker])
    on_cells = {**scenario, "planner": "astar", "drive": None, "robot": {"rectangle": [0.5, 0.25]}}
    for bodies in (
        only(ask("plan", scenario), "Z")["obstacle_specs"],
        only(ask("simulate", {key: v for key, v in on_cells.items() if v is not None}), "H")[
            "obstacle_specs"
        ],
    ):
        assert [one["outline"] for one in bodies] == [outline, outline]
        assert sorted(one["yaw"] for one in bodies) == [-1.5708, 0.0]


def test_a_plan_of_pad_has_the_cells_of_its_rounds() -> None:
    plan = only(ask("plan", car(planner="pad")), "Z")
    assert plan["rounds"]
    for one in plan["rounds"]:
        assert (one["planned_m"] is None) == (not one["planned_cells"])
        assert (one["tracked_m"] is None) == (not one["tracked_cells"])
    assert plan["rounds"][0]["planned_cells"]
