"""The physical law on maps: distances to surfaces, its cap, obstacles, and the stranger's verdict."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from speed_courses import random_course

from lampyris import Grid, Robot, Scene
from lampyris.errors import SettingError
from lampyris.kernels.motion.nearest_wall import nearest_squares
from lampyris.model.moves import MOVES
from lampyris.model.path import Path, path_of
from lampyris.motion import caps
from lampyris.motion.laws import registry as laws
from lampyris.motion.laws.physical import PhysicalLaw, obstacle_squares, wall_squares
from lampyris.referee import check_profile
from lampyris_selfcheck.reference.motion import speed_laws
from sizes import sized

STEPS = MOVES["sixteen-connected"].offsets


def random_world(rng: np.random.Generator, robot: Robot | None = None) -> tuple[Path, Scene]:
    """A random walk, with the map random around it."""
    width, height = rng.integers(3, 40, 2).tolist()
    blocked = rng.random((height, width)) < rng.uniform(0, 0.5)
    way = [(int(rng.integers(width)), int(rng.integers(height)))]
    for _ in range(int(rng.integers(0, 60))):
        dx, dy = STEPS[int(rng.integers(len(STEPS)))]
        x, y = way[-1][0] + dx, way[-1][1] + dy
        if 0 <= x < width and 0 <= y < height:
            way.append((x, y))
    for x, y in way:
        blocked[y, x] = False
    if robot is None:
        robot = Robot(
            radius=float(rng.uniform(0, 0.3)),
            v_max=float(10.0 ** rng.uniform(-1, 0.7)),
            a_max=float(10.0 ** rng.uniform(-1, 0.5)),
            d_max=float(10.0 ** rng.uniform(-1, 0.5)),
        )
    grid = Grid(blocked, resolution=float(rng.choice([0.05, 0.1, 0.5, 1.0])))
    scene = Scene(grid, way[0], way[-1], moves="sixteen-connected", robot=robot)
    return path_of(np.array(way), MOVES["sixteen-connected"]), scene


def bodies(rng: np.random.Generator, scene: Scene, count: int) -> list[tuple[int, int]]:
    drawn = rng.integers((0, 0), (scene.grid.width, scene.grid.height), (count, 2)).tolist()
    return [(x, y) for x, y in drawn]


def squares_of(blocked: Any) -> list[tuple[int, int]]:
    ys, xs = np.nonzero(blocked)
    return list(zip(xs.tolist(), ys.tolist(), strict=True))


@pytest.mark.parametrize("rings", [0, 1, 3, 60])
def test_distance_to_walls_is_exact_within_the_rings(rings: int) -> None:
    rng = np.random.default_rng(rings)
    for _ in range(30):
        path, scene = random_world(rng)
        cells = path.cells.astype(np.int64)
        got = wall_squares(cells, scene.grid.blocked, rings)
        for i, (x, y) in enumerate(cells.tolist()):
            box = [c for c in squares_of(scene.grid.blocked) if max(abs(c[0] - x), abs(c[1] - y)) <= rings]
            want = speed_laws.surface_distance((x, y), box)
            d = math.inf if got is None or got[i] == 2**62 else math.sqrt(got[i]) / 2
            assert d == pytest.approx(want, rel=1e-15)


@pytest.mark.nightly
def test_both_forms_of_the_kernel_agree() -> None:
    rng = np.random.default_rng(5)
    for _ in range(20):
        height, width = rng.integers(1, 30, 2).tolist()
        wall = (rng.random(height * width) < rng.uniform(0, 0.3)).astype(np.bool_)
        xs, ys = rng.integers(0, width, 12), rng.integers(0, height, 12)
        plain, compiled = np.full(12, 2**62), np.full(12, 2**62)
        rings = int(rng.integers(0, 35))
        nearest_squares.run_plain(wall, width, height, xs, ys, rings, plain)
        nearest_squares.compiled()(wall, width, height, xs, ys, rings, compiled)
        assert plain.tolist() == compiled.tolist()


def test_distance_to_bodies_is_exact_however_many() -> None:
    rng = np.random.default_rng(6)
    cells = rng.integers(0, 30, (40, 2))
    others = rng.integers(0, 30, (50, 2))
    got = obstacle_squares(cells, others, 30)
    assert got is not None
    want = [speed_laws.surface_distance((x, y), others.tolist()) for x, y in cells.tolist()]
    np.testing.assert_allclose(np.sqrt(got) / 2, want, rtol=1e-15)
    many = np.repeat(others, 1000, axis=0)  # more than one block
    again = obstacle_squares(cells, many, 30)
    assert again is not None
    assert again.tolist() == got.tolist()
    assert obstacle_squares(cells, others + 100, 30) is None


def test_the_clearance_cap_lets_the_robot_stop_before_the_surface() -> None:
    distance = np.array([0.0, 0.2, 0.3, 0.7, 5.0, math.inf])
    v = caps.clearance(distance, radius=0.2, d_max=0.8, creep=0.1)
    assert v[:2].tolist() == [0.1, 0.1]
    np.testing.assert_allclose(v[2:5] ** 2 / (2 * 0.8), distance[2:5] - 0.2, rtol=1e-14)
    assert v[5] == math.inf


def corridor(width: int, resolution: float, robot: Robot) -> tuple[Path, Scene]:
    """A straight way along the middle of a corridor so many cells wide, 41 long."""
    blocked = np.ones((width + 2, 41), dtype=np.bool_)
    blocked[1:-1] = False
    row = 1 + width // 2
    scene = Scene(Grid(blocked, resolution=resolution), (0, row), (40, row), robot=robot)
    return path_of(np.array([(x, row) for x in range(41)]), MOVES["octile"]), scene


def test_a_narrow_corridor_slows_the_robot_as_the_equation_says() -> None:
    path, scene = corridor(3, 0.1, Robot(radius=0.05))
    made = laws.profile(path, scene)
    # 1.5 cells of 0.1 m to the wall, less the radius.
    assert made.v[20] == pytest.approx(math.sqrt(2 * 1.0 * (0.15 - 0.05)), rel=1e-14)
    assert made.cause[20] == "clearance"
    assert made.s[-1] == pytest.approx(4.0)
    tight = laws.profile(*corridor(1, 0.1, Robot(radius=0.05)))
    assert (tight.v[20], tight.cause[20]) == (0.1, "clearance")
    assert laws.profile(*corridor(1, 0.1, Robot(radius=0.05)), law=PhysicalLaw(creep=0.2)).v[20] == 0.2
    wide = laws.profile(*corridor(15, 0.1, Robot(radius=0.05)))
    assert (wide.v[20], wide.cause[20]) == (1.0, "limit")


def test_the_edge_of_the_map_is_not_a_wall() -> None:
    scene = Scene(Grid(np.zeros((1, 60), dtype=np.bool_), resolution=0.1), (0, 0), (59, 0))
    made = laws.profile(path_of(np.array([(x, 0) for x in range(60)]), MOVES["octile"]), scene)
    assert (made.v[30], made.cause[30]) == (1.0, "limit")


def test_a_moving_obstacle_is_named_and_slows_the_nodes_near_it() -> None:
    path, scene = corridor(15, 0.1, Robot())
    row = int(path.cells[0, 1])
    made = laws.profile(path, scene, obstacles={(20, row - 2)})
    assert (made.v[20], made.cause[20]) == (pytest.approx(math.sqrt(2 * 0.15), rel=1e-14), "obstacle")
    assert made.v[10] == laws.profile(path, scene).v[10]
    on_it = laws.profile(path, scene, obstacles={(20, row)})
    assert (on_it.v[20], on_it.cause[20]) == (0.1, "obstacle")


def test_at_a_metre_a_cell_only_an_obstacle_on_the_way_slows_the_default_robot() -> None:
    scene = Scene(Grid(np.zeros((3, 9), dtype=np.bool_)), (0, 1), (8, 1))
    path = path_of(np.array([(x, 1) for x in range(9)]), MOVES["octile"])
    free = laws.profile(path, scene)
    assert laws.profile(path, scene, obstacles=[(4, 0), (5, 2)]).v.tolist() == free.v.tolist()
    assert laws.profile(path, scene, obstacles=[(4, 1)]).cause[4] == "obstacle"


def test_the_stranger_passes_every_profile() -> None:
    rng = np.random.default_rng(12)
    for _ in range(150):
        path, scene = random_world(rng)
        found = bodies(rng, scene, 5) if rng.random() < 0.5 else []
        made = laws.profile(path, scene, obstacles=found)
        assert check_profile(made, path, scene) is None
        assert made.s.tolist() == (path.arc * scene.grid.resolution).tolist()
        assert (made.law, made.units) == ("physical", "m/s")


def test_adding_an_obstacle_never_raises_a_speed() -> None:
    rng = np.random.default_rng(13)
    for _ in range(100):
        path, scene = random_world(rng)
        some = bodies(rng, scene, 6)
        before = laws.profile(path, scene, obstacles=some[:3])
        after = laws.profile(path, scene, obstacles=some)
        assert (after.v <= before.v * (1 + 1e-15)).all()
        assert after.duration >= before.duration * (1 - 1e-14)


@pytest.mark.parametrize("name", ["v_max", "a_max", "d_max"])
def test_raising_a_limit_of_the_robot_never_lengthens_the_way(name: str) -> None:
    rng = np.random.default_rng(14)
    for _ in range(80):
        path, scene = random_world(rng)
        more = replace(scene.robot, **{name: getattr(scene.robot, name) * rng.uniform(1, 4)})
        quicker = laws.profile(path, replace(scene, robot=more))
        assert quicker.duration <= laws.profile(path, scene).duration * (1 + 1e-13)


def test_a_sudden_obstacle_is_braked_for_and_a_plan_into_it_refused() -> None:
    path, scene = corridor(15, 0.1, Robot())
    way = path_of(path.cells[20:], MOVES["octile"])
    row = int(path.cells[0, 1])
    with pytest.raises(SettingError, match=r"PROFILE_INFEASIBLE.*\(obstacle\)"):
        laws.profile(way, scene, v0=1.0, obstacles=[(22, row)])
    made = laws.profile(way, scene, v0=1.0, obstacles=[(22, row)], on_infeasible="brake")
    np.testing.assert_allclose(made.v[:4] ** 2, [1.0, 0.8, 0.6, 0.4], rtol=1e-14)
    assert made.cause[:4] == ("start", "braking", "braking", "braking")
    assert made.v[-1] == 0.0


def test_a_path_off_the_map_is_a_typed_error() -> None:
    scene = Scene(Grid(np.zeros((4, 4), dtype=np.bool_)), (0, 0), (3, 0))
    with pytest.raises(SettingError, match="PATH_OUTSIDE"):
        laws.profile(path_of(np.array([(3, 0), (4, 0)]), MOVES["octile"]), scene)


def test_one_cell_stands_still() -> None:
    scene = Scene(Grid(np.zeros((4, 4), dtype=np.bool_)), (0, 0), (0, 0))
    made = laws.profile(path_of(np.array([(0, 0)]), MOVES["octile"]), scene)
    assert (made.v.tolist(), made.t.tolist(), made.duration) == ([0.0], [0.0], 0.0)


@pytest.mark.parametrize("creep", [0.0, -0.1, 1.5, math.nan, True, "slow"])
def test_creep_is_a_share(creep: Any) -> None:
    with pytest.raises(SettingError, match=r"LAW_SETTING.*physical\.creep"):
        PhysicalLaw(creep=creep)


@pytest.mark.nightly
@sized("cases", 50, 250)
@pytest.mark.parametrize("name", ["v_max", "a_max", "d_max"])
def test_raising_a_limit_of_the_robot_never_slows_it_anywhere_on_a_course(name: str, cases: int) -> None:
    # A robot that brakes harder looks less far for walls; it was told less room then, and drove slower.
    rng = np.random.default_rng(3)
    slowed = 0
    for _ in range(cases):
        course, scene = random_course(rng)
        found = bodies(rng, scene, 5)
        before = laws.profile(course, scene, obstacles=found)
        factor = float(rng.uniform(1, 1.05) if rng.random() < 0.5 else rng.uniform(1, 4))
        more = replace(scene.robot, **{name: getattr(scene.robot, name) * factor})
        after = laws.profile(course, replace(scene, robot=more), obstacles=found)
        assert (after.v >= before.v * (1 - 1e-12)).all()
        assert after.duration <= before.duration * (1 + 1e-12)
        slowed += not {"clearance", "obstacle"}.isdisjoint(before.cause)
    assert slowed > 0.6 * cases
