"""Films show the layer that is on, and plans say the cells that patrols take (issue 24, C19 and C20)."""

from __future__ import annotations

import io
import json
import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from PIL import Image

from lampyris import scenarios
from lampyris.app.engine import export as kept
from lampyris.app.engine import work
from lampyris.app.engine.frames import json_frame
from lampyris.app.engine.parse import scenario_of_request
from lampyris.errors import UsageError
from lampyris.report.film import sprites
from lampyris.report.style import FREE, landscape_colours
from sizes import some

ROWS = [
    "S.......",
    "...##...",
    "...##...",
    ".......G",
]
SCENARIO: dict[str, Any] = {
    "version": 1, "map": {"rows": ROWS}, "planner": "astar", "simulate": {"ticks": 12},
    "obstacles": [{"kind": "recorded", "track": [[7, 0], [6, 0], [5, 0]]}],
    "edits": [{"tick": 2, "blocked": [[0, 3]], "freed": []}],
}  # fmt: skip


def film(what: str = "webp", scenario: dict[str, Any] | None = None, **settings: Any) -> list[np.ndarray]:
    """The frames of a film."""
    question = {"verb": "export", "scenario": scenario or SCENARIO, "what": what, "settings": settings}
    pieces = list(work.answer(question, lambda: None))
    data = b"".join(piece[5:] for piece in pieces if piece[4:5] == b"B")
    assert pieces[-1] == json_frame("Z", {"bytes": len(data)})
    image = Image.open(io.BytesIO(data))
    frames = []
    for k in range(image.n_frames):
        image.seek(k)
        frames.append(np.asarray(image.convert("RGB")).astype(int))
    return frames


def ground(frame: np.ndarray, x: int, y: int) -> np.ndarray:
    """Colour of a cell near its corner, where nobody stands. Cells are 70 pixels wide."""
    return np.asarray(frame[10 + 70 * y + 5, 10 + 70 * x + 5])


@pytest.mark.nightly
@pytest.mark.parametrize("what", some(["webp", "gif"]))
@pytest.mark.parametrize("layer", some(["luciferin", "reach", "cost", "clearance", "expanded"], 2))
def test_a_film_has_the_layer_that_is_on(layer: str, what: str) -> None:
    bare, shown = film(what), film(what, layer=layer)
    assert len(bare) == len(shown)
    assert np.abs(ground(bare[0], 1, 0) - FREE).max() <= 4
    away = np.abs(landscape_colours().astype(int) - ground(shown[0], 1, 0)).max(axis=1).min()
    assert away <= 12, "the ground has a colour of the landscape"
    assert np.abs(ground(shown[0], 1, 0) - FREE).max() > 20
    # Whatever the layer takes of the palette, robot and goal have their own colours.
    for colour in (sprites.ROBOT, sprites.GOAL):
        assert (np.abs(shown[0] - colour).max(axis=2) <= 3).sum() > 100
    # The wall that comes at tick 2 is seen, with the layer as it is then.
    assert ground(shown[-1], 0, 3).max() < 60 < ground(shown[0], 0, 3).max()


@pytest.mark.nightly
def test_reach_moves_with_the_obstacles_and_cost_does_not() -> None:
    reach, cost = film(layer="reach"), film(layer="cost")
    # The frames of ticks 0 and 1: two a tick.
    assert np.abs(ground(reach[0], 4, 3) - ground(reach[2], 4, 3)).max() > 2
    assert np.abs(ground(cost[0], 4, 3) - ground(cost[2], 4, 3)).max() == 0


def test_a_moment_has_the_layer_too() -> None:
    scenario = scenario_of_request({"scenario": SCENARIO})
    pictures = []
    for layer in ("none", "cost"):
        question = {"what": "png", "settings": {"layer": layer}, "tick": 1}
        pieces = list(kept.export(question, scenario, lambda: None))
        data = b"".join(piece[5:] for piece in pieces if piece[4:5] == b"B")
        pictures.append(np.asarray(Image.open(io.BytesIO(data)).convert("RGB")).astype(int))
    assert np.abs(ground(pictures[0], 2, 3) - ground(pictures[1], 2, 3)).max() > 20


def test_a_layer_that_there_is_not_is_refused() -> None:
    scenario = scenario_of_request({"scenario": SCENARIO})
    with pytest.raises(UsageError) as told:
        list(kept.export({"what": "gif", "settings": {"layer": "noise"}}, scenario, lambda: None))
    assert told.value.code == "LAYER"


def test_a_plan_says_the_cells_that_a_patrol_takes() -> None:
    """The page drew a straight line between waypoints, through whatever wall is there."""
    scenario = {
        **SCENARIO,
        "edits": [],
        "obstacles": [
            {"kind": "random-walk", "count": 1},
            {"kind": "patrol", "waypoints": [[2, 1], [5, 1], [5, 2]]},
            {"kind": "patrol", "waypoints": [[1, 3]]},
        ],
    }
    *_, last = work.answer({"verb": "plan", "scenario": scenario}, lambda: None)
    bodies = json.loads(last[5:])["obstacle_specs"]
    assert [body["kind"] for body in bodies] == ["random-walk", "patrol", "patrol"]
    assert "path" not in bodies[0]
    path = bodies[1]["path"]
    assert bodies[1]["waypoints"] == [[2, 1], [5, 1], [5, 2]]
    assert [one for one in path if one in bodies[1]["waypoints"]] == bodies[1]["waypoints"]
    assert all(ROWS[y][x] != "#" for x, y in path)
    assert all(max(abs(a[0] - b[0]), abs(a[1] - b[1])) == 1 for a, b in pairwise(path))
    assert len(path) > 6, "the way round the wall is longer than the straight one"
    assert bodies[2]["path"] == [[1, 3]]


CAR: dict[str, Any] = {
    "version": 1, "map": {"rows": ["." * 24] * 18, "resolution": 0.25}, "preset": "robot", "seed": 4,
    "start": {"cell": [4, 4], "yaw": 0.0}, "goal": {"cell": [4, 14], "yaw": math.pi}, "planner": "lattice",
    "robot": {"rectangle": [1.5, 0.75], "drive": "ackermann", "turn_radius": 0.75}, "drive": {}, "edits": [],
    "obstacles": [],
}  # fmt: skip


@pytest.mark.nightly
@pytest.mark.parametrize("what", some(["webp", "gif"]))
def test_a_film_draws_the_footprint_to_scale_where_the_drive_says(what: str) -> None:
    """The robot's pixels in each frame have the area, the centre and the direction of the rectangle that was driven."""
    made: Any = scenarios.run(scenario_of_request({"scenario": CAR}))
    frames = film(what, CAR)
    length, width = 1.5, 0.75
    share = (frames[0].shape[1] - 20) / (24 * 0.25)
    # Below the map the caption has a robot, too.
    high = round(10 + 18 * 0.25 * share)
    turned = set()
    for k in range(0, len(frames), max(1, len(frames) // 12)):
        y, x = np.nonzero(np.abs(frames[k][:high] - sprites.ROBOT).max(axis=2) <= 30)
        # A dark rim of two pixels is no part of it, nor are the line ahead and what is drawn beside it.
        inside = (length * share - 2) * (width * share - 2)
        assert 0.85 * inside < len(x) < 1.05 * length * width * share * share
        spread = np.linalg.eigh(np.cov(x, y))
        sides = np.sqrt(12 * spread.eigenvalues) / share
        assert sides == pytest.approx([width, length], abs=0.12)
        along = spread.eigenvectors[:, 1]
        times = np.linspace(0.0, made.duration, 400)
        poses = made.poses(times)
        middle = np.array([x.mean() - 10, high - y.mean()]) / share
        near = int(np.hypot(*(poses[:, :2] - middle).T).argmin())
        assert np.hypot(*(poses[near, :2] - middle)) < 0.1
        yaw = float(poses[near, 2])
        assert abs(along[0] * math.sin(yaw) + along[1] * math.cos(yaw)) < 0.12
        turned.add(round(math.degrees(yaw) / 45) % 8)
    assert len(turned) >= 3, "it turned"


@pytest.mark.nightly
@pytest.mark.parametrize("drives", [False, True])
def test_a_film_shows_the_sector_that_a_narrow_sensor_sees(drives: bool) -> None:
    """All around before the first move; then a quarter of a circle and its two sides, ahead of the robot."""
    rows = ["S" + "." * 14] + ["." * 15] * 13 + ["." * 14 + "G"]
    frames = []
    for angle in (360.0, 90.0):
        sees = {"sensor_range": 4.0, "field_of_view": angle}
        scenario = {
            "version": 1, "map": {"rows": rows}, "planner": "dstar-lite", "edits": [], "obstacles": [],
            **({"drive": sees} if drives else {"simulate": sees}),
        }  # fmt: skip
        frames.append(film("webp", scenario))
    whole, narrow = ([(frame != frame[:1, :1]).any(axis=2) for frame in some_] for some_ in frames)
    assert (whole[0] == narrow[0]).all(), "before it moves it sees all around"
    scale = (frames[1][0].shape[1] - 20) / 15
    middle = len(frames[1]) // 2
    ring, rim = (np.abs(some_[middle] - sprites.ROBOT).max(axis=2) <= 60 for some_ in frames)
    # Of the circle three quarters are gone, 19 cells long, and two radii have come, 8 cells long, their edges pale.
    assert (ring & ~rim).sum() > 8 * scale
    assert (rim & ~ring).sum() > 2 * scale
    y, x = np.nonzero(ring & ~rim)
    y_, x_ = np.nonzero(rim & ~ring)
    # It drives down and to the right: what is gone lies behind what has come.
    assert x.mean() + y.mean() < x_.mean() + y_.mean() - scale
