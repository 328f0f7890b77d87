"""The referee on profiles that are not one node a cell: nodes anywhere on a way, and waits."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lampyris.errors import InternalFault, UsageError
from lampyris.model.curve import Curve
from lampyris.model.grid import Grid
from lampyris.model.path import Path, path_of
from lampyris.model.profile import Profile
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.referee import certify, check_profile
from lampyris.referee.caps import _bend
from lampyris.referee.profile import wall_distance_of_points

RESOLUTION = 0.5


def street() -> tuple[Scene, Path]:
    """A row of 13 cells with one wall beside its middle."""
    blocked = np.zeros((7, 13), dtype=np.bool_)
    blocked[1, 6] = True
    robot = Robot(radius=0.1, v_max=1.0, a_max=0.5, d_max=0.5)
    scene = Scene(Grid(blocked, resolution=RESOLUTION), (0, 3), (12, 3), robot=robot)
    return scene, path_of(np.array([[x, 3] for x in range(13)]), scene.moves)


def driven(s: Any, v: Any, waits: Any = ()) -> dict[str, Any]:
    """Accelerations and times of speeds; ``waits`` (node, seconds) double a node at rest."""
    s, v = np.asarray(s, dtype=float), np.asarray(v, dtype=float)
    ds = np.diff(s)
    a = np.append(np.diff(v**2) / (2 * ds), 0.0)
    dt = 2 * ds / (v[:-1] + v[1:])
    for node, seconds in waits:
        dt = np.insert(dt, node, seconds)
        s, v, a = (np.insert(x, node, x[node]) for x in (s, v, a))
        a[node] = 0.0
    return {"s": s, "v": v, "a": a, "t": np.append(0.0, np.cumsum(dt))}


def profile(numbers: dict[str, Any], **more: Any) -> Profile:
    return Profile("physical", **numbers, cause=("limit",) * len(numbers["s"]), units="m/s", **more)


def judge(made: Profile, way: Path | None, scene: Scene, **more: Any) -> str | None:
    found = check_profile(made, way, scene, **more)
    assert "np." not in str(found)
    return None if found is None else found.rule


def test_nodes_anywhere_on_the_way() -> None:
    scene, path = street()
    xy = np.stack((np.linspace(0, 12, 31), np.full(31, 3.0)), axis=1)
    s = np.linspace(0, 6, 31)
    v = np.minimum(0.6, np.sqrt(0.9 * np.minimum(s, 6 - s)))
    good = profile(driven(s, v), xy=xy)
    assert judge(good, path, scene) is None
    assert judge(good, None, scene) is None
    assert certify(good, scene) is good
    assert certify(good, scene, path) is good
    assert judge(replace(good, xy=None), path, scene) == "nodes"
    assert judge(replace(good, xy=None), None, scene) == "nodes"
    assert judge(replace(good, xy=xy + np.array([1e-6, 0.0])), path, scene) == "nodes"
    assert judge(replace(good, xy=xy + np.array([1e-6, 0.0])), None, scene) is None
    assert judge(profile(driven(s * (1 - 1e-6), v), xy=xy), path, scene) == "s"
    assert judge(profile(driven(s * 2, v), xy=xy), path, scene) == "s"
    assert judge(profile(driven(s, v * 1.1), xy=xy), path, scene) == "acceleration"
    bare = replace(scene, grid=Grid(np.zeros((7, 13), dtype=np.bool_), resolution=RESOLUTION))
    faster = profile(driven(s, np.minimum(0.95, np.sqrt(0.99 * np.minimum(s, 6 - s)))), xy=xy)
    assert judge(faster, path, bare) is None
    # The wall's square is 1.5 cells, that is 0.75 m, from the way: sqrt(2 * 0.5 * 0.65) = 0.806 m/s.
    assert judge(faster, path, scene) == "clearance"
    with pytest.raises(InternalFault, match="clearance"):
        certify(faster, scene)
    with pytest.raises(UsageError):
        certify(replace(good, xy=None), scene)


def test_waits_among_the_cells_of_a_path() -> None:
    scene, path = street()
    s = np.arange(13) * RESOLUTION
    v = np.minimum(0.6, np.sqrt(0.9 * np.minimum(s, 6 - s)))
    v[5] = 0.0
    v[4] = v[6] = 0.6
    good = profile(driven(s, v, [(5, 7.5)]))
    assert len(good.s) == 14
    assert judge(good, path, scene) is None
    assert judge(profile(driven(s, v, [(0, 3.0), (6, 7.5)])), path, scene) is None
    short = path_of(path.cells[:-1], scene.moves)
    assert judge(good, short, scene) == "nodes"
    moving = profile(driven(s, np.where(np.arange(13) == 5, 0.1, v), [(5, 7.5)]))
    assert judge(moving, path, scene) == "s"
    assert judge(replace(good, law="dissertation"), path, scene) == "nodes"


def test_distances_of_points_to_walls() -> None:
    rng = np.random.default_rng(1)
    for _ in range(30):
        blocked = rng.random((9, 11)) < 0.15
        grid = Grid(blocked, resolution=float(rng.uniform(0.1, 3)))
        xy = rng.uniform(-0.5, 8.5, (12, 2))
        beyond = float(rng.uniform(0.5, 9)) * grid.resolution
        got = wall_distance_of_points(grid, xy, beyond)
        for (x, y), one in zip(xy.tolist(), got.tolist(), strict=True):
            away = [
                grid.resolution * float(np.hypot(max(abs(x - j) - 0.5, 0), max(abs(y - i) - 0.5, 0)))
                for i, j in np.argwhere(blocked).tolist()
            ]
            want = min(away, default=np.inf)
            assert one == (pytest.approx(want) if want <= beyond else np.inf)


def calls_made_by(work: Callable[[], object]) -> int:
    """How many functions are called: what is done place by place, or piece by piece, calls more."""
    made = [0]

    def seen(frame: object, event: str, arg: object) -> None:
        made[0] += event in ("call", "c_call")

    sys.setprofile(seen)
    try:
        work()
    finally:
        sys.setprofile(None)
    return made[0]


def test_curvature_at_a_place_does_not_look_at_all_pieces() -> None:
    """`speed --path` took quadratic time on a zigzag: each piece was held against every node."""
    made = []
    for n in (50, 500):
        x = np.arange(n, dtype=np.float64)
        heading = np.tile((1.0, 0.0), (n, 1))
        curve = Curve(np.stack((x, x * 0), axis=1), heading, np.ones(n), np.arange(n) % 3 / 4, (n, 0), 1.0)
        s = np.linspace(0.0, n, 4 * n + 1)
        made.append(calls_made_by(lambda s=s, curve=curve: _bend(curve, s)))
        piece = np.minimum(s.astype(int), n - 1)
        border = s == np.round(s)
        assert np.array_equal(_bend(curve, s), np.where(border, 0.0, piece % 3 / 4))
    assert made[0] == made[1]


def test_distance_to_walls_takes_few_calls_for_many_places_and_far_reaches() -> None:
    """It looked at all cells within reach of each place: 10 m/s on cells of 5 cm were millions a node."""
    rng = np.random.default_rng(4)
    grid = Grid(rng.random((300, 300)) < 1e-4)
    places = rng.uniform(0, 299, (2000, 2))
    few, many = (
        calls_made_by(lambda n=n: wall_distance_of_points(grid, places[:n], 8.0)) for n in (200, 2000)
    )
    far = calls_made_by(lambda: wall_distance_of_points(grid, places, 256.0))
    assert many == few
    assert far < 4 * many
