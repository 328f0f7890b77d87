"""Sampled paths that turn anywhere: never longer than at cell centres, free by the referee, as short as the plane allows."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from lampyris.kernels.graph.any_angle import CUT, TOUCH, WIDE
from lampyris.kernels.sampling.sweep import UNITS, clear
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.path import path_of
from lampyris.model.plan import Plan, Status
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning import registry
from lampyris.planning.field.layers import free_space, largest_region, moves_for
from lampyris.planning.sampling.ground import Lines
from lampyris.planning.sampling.turns import NEAR, Walls
from lampyris.referee import check_plan
from lampyris.referee.plans.any_angle import line_meets
from lampyris.typing import BoolGrid, Cells
from reference.kernel_forms import use

STARS = ("rrt-star", "informed-rrt-star", "bit-star")
RADII = (0.0, 0.3, 0.5, 0.75, 1.0, 1.2, 1.5, 2.5)
"""Of discs, cells; some just fit between two walls."""


def drawn(rng: np.random.Generator, low: int = 8, high: int = 26) -> Scene | None:
    """A random map with two free cells: single walls, blocks of them, or long thin ones."""
    height, width = (int(n) for n in rng.integers(low, high, 2))
    kind = int(rng.integers(3))
    if kind == 0:
        walls = rng.random((height, width)) < rng.choice([0.03, 0.1, 0.2])
    elif kind == 1:
        walls = np.kron(rng.random((height // 4 + 1, width // 4 + 1)) < 0.3, np.ones((4, 4), dtype=bool))
        walls = walls[:height, :width]
    else:
        walls = np.zeros((height, width), dtype=bool)
        for x, y, long in zip(*rng.integers(2, [[width], [height], [24]], (3, 5)), strict=True):
            walls[(y, slice(x, x + long)) if long % 2 else (slice(y, y + long), x)] = True
    cell, radius = float(rng.choice([1.0, 0.25])), float(rng.choice((0.0, 0.0, 0.0, 0.0, *RADII)))
    moves = str(rng.choice(["octile", "dissertation", "four-connected"]))
    blank = Scene(Grid(walls, resolution=cell), (0, 0), (0, 0), moves, Robot(radius=radius * cell))
    cells = largest_region(free_space(blank))
    if len(cells) < 2:
        return None
    (ax, ay), (bx, by) = cells[rng.integers(len(cells), size=2)].tolist()
    return replace(blank, start=(ax, ay), goal=(bx, by))


ANYWHERE = {"turns": "anywhere"}


def plan_of(name: str, scene: Scene, seed: int = 0, **settings: object) -> Plan:
    plan = registry.make(name, settings).open(scene, np.random.default_rng(seed)).plan()
    assert check_plan(plan, scene) is None
    return plan


def compared(cases: int, seed: int) -> list[tuple[Scene, Plan, Plan]]:
    """Random queries with their plans that turn anywhere and at centres, all else alike."""
    rng = np.random.default_rng([284, seed])
    made = []
    for case in range(cases):
        scene = drawn(rng)
        if scene is None:
            continue
        settings = {"samples": 150, "shortcut": bool(rng.integers(4))}
        plans = [
            plan_of(STARS[case % 3], scene, case, **settings, turns=turns)
            for turns in ("anywhere", "centres")
        ]
        if plans[1]:
            made.append((scene, plans[0], plans[1]))
    return made


def judged(made: list[tuple[Scene, Plan, Plan]]) -> tuple[int, int]:
    """How many points and discs have shorter paths; none has a longer one, or one shorter than the shortest."""
    shorter = [0, 0]
    for scene, plan, centres in made:
        length, longer = plan.any_angle_length, centres.any_angle_length
        assert length is not None
        assert longer is not None
        assert length <= longer + 1e-9
        assert centres.waypoints is not None
        assert centres.waypoints.dtype == np.int32
        shorter[scene.robot.radius > 0] += length < longer - 1e-6
        if scene.robot.radius == 0:
            model = plan_of("visibility-graph", scene).map_model
            assert model is not None
            assert model.bound is not None
            assert length >= model.bound - 1e-9
        else:
            off = max(
                min(max(abs(x - cx), abs(y - cy)) for cx, cy in plan.cells.tolist())
                for x, y in plan.waypoints.tolist()
            )
            assert off <= NEAR
    return shorter[0], shorter[1]


def test_paths_are_shorter_and_free() -> None:
    points, discs = judged(compared(24, 0))
    assert points >= 3
    assert discs >= 3


@pytest.mark.nightly
def test_many_paths_are_shorter_and_free() -> None:
    points, discs = judged(compared(3000, 1))
    assert points >= 300
    assert discs >= 300


def test_a_point_has_the_shortest_path_in_the_plane() -> None:
    """Where the lines between centres pass the walls on the same sides as the shortest path."""
    rng = np.random.default_rng(285)
    same = 0
    for case in range(12):
        scene = drawn(rng, 8, 20)
        if scene is None:
            continue
        scene = replace(scene, robot=Robot(), moves="octile" if case % 2 else "dissertation")
        plan, exact = (
            plan_of(name, scene, **more)
            for name, more in (("bit-star", {"samples": 2000} | ANYWHERE), ("polyanya", {}))
        )
        assert exact.map_model is not None
        assert plan.any_angle_length is not None
        assert plan.any_angle_length >= exact.map_model.bound - 1e-9
        same += plan.any_angle_length <= exact.map_model.bound * 1.00001
    assert same >= 9


@pytest.mark.parametrize("name", STARS)
def test_a_disc_goes_round_a_corner_along_its_arc(name: str) -> None:
    """One wall between the ends: two tangents and the arc between them, all but for the sides of the polygon."""
    walls = np.zeros((24, 31), dtype=bool)
    walls[:15, 15] = True
    radius = 1.2
    scene = Scene(Grid(walls), (5, 4), (25, 6), robot=Robot(radius=radius))
    plan = plan_of(name, scene, **ANYWHERE)
    corners = ((14.5, 14.5), (15.5, 14.5))
    exact, angle = 1.0, 0.0  # between the corners, and the turns at either
    for (x, y), (cx, cy) in zip((scene.start, scene.goal), corners, strict=True):
        far = math.dist((x, y), (cx, cy))
        exact += math.sqrt(far * far - radius * radius)
        steep = math.atan2(cy - y, abs(cx - x)) + math.asin(radius / far)
        angle += steep
    exact += radius * angle
    assert plan.any_angle_length is not None
    assert exact <= plan.any_angle_length <= exact + 0.015
    assert plan_of(name, scene).any_angle_length > exact + 0.3


@pytest.mark.parametrize("radius", [0.5, 1.5])
def test_a_disc_that_just_fits_turns_in_a_corridor(radius: float) -> None:
    """The disc has its radius on either side, so lines along the corridor cannot move, but the corner is cut by an arc."""
    wide, size = round(2 * radius), 24
    walls = np.ones((size, size), dtype=bool)
    walls[4 : 4 + wide, 2:20] = walls[4:20, 20 - wide : 20] = False
    middle = wide // 2
    scene = Scene(
        Grid(walls), (3 + middle, 4 + middle), (19 - middle, 18 - middle), robot=Robot(radius=radius)
    )
    plan = plan_of("bit-star", scene, **ANYWHERE)
    legs = abs(scene.goal[0] - scene.start[0]) + abs(scene.goal[1] - scene.start[1])
    arc = legs - 2 * radius + math.pi / 2 * radius
    assert plan.any_angle_length is not None
    assert arc <= plan.any_angle_length <= arc + 0.01 * radius


def turned(lines: Lines, walls: BoolGrid, k: int) -> tuple[Lines, BoolGrid]:
    """The same lines and walls, mirrored, upside down or with x and y exchanged."""
    made = []
    for points in (lines.turns, lines.walk):
        x, y = points.T
        if k & 1:
            x = walls.shape[1] - 1 - x
        if k & 2:
            y = walls.shape[0] - 1 - y
        made.append(np.stack((y, x) if k & 4 else (x, y), axis=1))
    walls = walls[:: -1 if k & 2 else 1, :: -1 if k & 1 else 1]
    return Lines(*made), np.ascontiguousarray(walls.T if k & 4 else walls)


def test_mirrored_and_transposed_maps_have_paths_of_the_same_length() -> None:
    rng = np.random.default_rng(286)
    judged = 0
    for _ in range(14):
        scene = drawn(rng)
        if scene is None:
            continue
        plan = plan_of("visibility-graph", scene)
        if not plan or len(plan.waypoints) < 3:
            continue
        rule = WIDE if scene.robot.radius else CUT if scene.moves.corner_cutting else TOUCH
        lengths = []
        for k in range(8):
            lines, walls = turned(Lines(plan.waypoints, plan.cells), scene.grid.blocked, k)
            made = Walls(walls, scene.robot.radius / scene.grid.resolution, rule, 1 if rule else 2)
            places = made.shortened(lines, (), lambda _: None).turns
            lengths.append(sum(math.dist(a, b) for a, b in pairwise(places.tolist())))
        assert max(lengths) - min(lengths) < 1e-4  # places are whole steps of 2^-16 of a cell
        judged += 1
    assert judged >= 5


def test_lines_anywhere_are_those_of_the_referee() -> None:
    """Discs: its distances are floats. Lines that differ within rounding of the radius are left out."""
    rng = np.random.default_rng(287)
    seen = [0, 0]
    for _ in range(40):
        walls = rng.random((9, 12)) < 0.1
        framed = np.pad(walls, 1).astype(np.uint8).ravel()
        radius = float(rng.choice([0.3, 0.7, 1.2]))
        scene = Scene(Grid(walls), (0, 0), (0, 0), robot=Robot(radius=radius))
        for _ in range(20):
            ax, ay, bx, by = (int(v) for v in (rng.random(4) * (11, 8, 11, 8) * UNITS).astype(int))
            places = (ax / UNITS, ay / UNITS), (bx / UNITS, by / UNITS)
            wall = line_meets(walls, *places, scene)
            assert clear(framed, 14, ax, ay, bx, by, radius * UNITS, WIDE) == (wall is None)
            seen[wall is None] += 1
    assert min(seen) > 100


@pytest.mark.parametrize("name", STARS)
def test_both_forms_agree_and_so_does_the_same_seed(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    walls = np.random.default_rng(6).random((16, 16)) < 0.15
    walls[0, 0] = walls[-1, -1] = False
    scene = Scene(Grid(walls), (0, 0), (15, 15))
    plans = []
    for form in ("plain", "compiled", "compiled"):
        use(monkeypatch, form)
        plans.append(plan_of(name, scene, samples=400, **ANYWHERE))
    assert plans[0] == plans[1] == plans[2]
    assert plans[0].waypoints is not None
    assert plans[0].waypoints.dtype == np.float64


def test_obstacles_are_walls() -> None:
    """A path round an obstacle keeps its distance, and the next one does not."""
    scene = Scene(Grid(np.zeros((21, 21), dtype=bool)), (1, 10), (19, 10), robot=Robot(radius=1.2))
    session = registry.make("bit-star", {"samples": 3000} | ANYWHERE).open(scene, np.random.default_rng(0))
    seen = [(10, y) for y in range(6, 13)]
    plan = session.plan(Change(obstacles=frozenset(seen)))
    blocked = np.zeros((21, 21), dtype=bool)
    blocked[6:13, 10] = True
    assert check_plan(plan, scene) is None
    assert plan.waypoints is not None
    with_walls = plan_of("bit-star", replace(scene, grid=Grid(blocked)), samples=3000, **ANYWHERE)
    assert with_walls.any_angle_length is not None
    assert plan.any_angle_length is not None
    assert 18.5 < plan.any_angle_length <= with_walls.any_angle_length + 2.0
    again = session.plan(Change())
    assert again.waypoints is not None
    assert again.waypoints.tolist() == [[1, 10], [19, 10]]


# ---- the walk, and maps too large ---------------------------------------------------------------


def around_a_wall() -> tuple[Scene, Lines]:
    """A disc, and lines far around a wall with a walk along them."""
    walls = np.zeros((40, 31), dtype=bool)
    walls[:9, 15] = True
    scene = Scene(Grid(walls), (5, 4), (25, 4), robot=Robot(radius=1.2))
    walk = (
        [(5, y) for y in range(4, 36)] + [(x, 35) for x in range(6, 26)] + [(25, y) for y in range(34, 3, -1)]
    )
    return scene, Lines(
        np.array([(5, 4), (5, 35), (25, 35), (25, 4)], dtype=np.int32), np.array(walk, dtype=np.int32)
    )


def test_lines_that_leave_their_walk_have_another() -> None:
    scene, lines = around_a_wall()
    asked: list[BoolGrid] = []

    def walking(among: BoolGrid) -> Cells | None:
        asked.append(among)
        shut = replace(scene, grid=Grid(scene.grid.blocked | ~among), robot=Robot())
        return registry.make("astar", {}).open(shut, np.random.default_rng(0)).plan().cells

    walls = Walls(scene.grid.blocked, 1.2, WIDE, 1)
    made = walls.shortened(lines, (), walking)
    assert len(asked) == 1
    plan = Plan(Status.FOUND, "bit-star", path_of(made.walk, moves_for(scene)), waypoints=made.turns)
    assert plan.any_angle_length is not None
    assert plan.any_angle_length < 26.0
    assert check_plan(plan, replace(scene, robot=Robot(radius=0.4))) is None
    assert walls.shortened(lines, (), lambda _: None) is lines  # there is no walk: the lines stay
    assert walls.shortened(lines, (), lambda _: lines.walk) is lines  # it is far away


def test_lines_on_maps_too_long_for_whole_numbers_stay() -> None:
    walls = Walls(np.zeros((2, 8200), dtype=bool), 0.0, TOUCH, 1)
    lines = Lines(np.array([(0, 0), (9, 1), (8199, 0)], dtype=np.int32), np.zeros((1, 2), dtype=np.int32))
    assert walls.shortened(lines, (), lambda _: None) is lines
    assert (
        len(
            Walls(np.zeros((2, 80), dtype=bool), 0.0, TOUCH, 1)
            .shortened(lines_of_80(), (), lambda _: None)
            .turns
        )
        == 2
    )


def test_a_note_says_that_a_map_is_too_large() -> None:
    walls = np.zeros((3, 8200), dtype=bool)
    walls[:2, 4100] = True
    scene = Scene(Grid(walls), (4095, 0), (4105, 0))
    plan = plan_of("bit-star", scene, samples=2000, seeded=True, **ANYWHERE)
    assert plan.waypoints is not None
    assert plan.waypoints.dtype == np.int32
    assert any("turns stay at cell centres" in note for note in plan.notes)


def lines_of_80() -> Lines:
    return Lines(np.array([(0, 0), (9, 1), (79, 0)], dtype=np.int32), np.zeros((1, 2), dtype=np.int32))


# ---- the referee --------------------------------------------------------------------------------


def test_the_referee_refuses_a_disc_too_near_a_wall() -> None:
    walls = np.zeros((24, 31), dtype=bool)
    walls[:15, 15] = True
    scene = Scene(Grid(walls), (5, 4), (25, 6), robot=Robot(radius=1.2))
    plan = plan_of("bit-star", scene, **ANYWHERE)
    assert plan.waypoints is not None
    near = plan.waypoints.copy()
    k = int(near[:, 1].argmax())
    near[k, 1] -= 2.0**-7
    broken = check_plan(replace(plan, waypoints=near), scene)
    assert broken is not None
    assert broken.rule == "line"
    assert check_plan(plan, replace(scene, robot=Robot(radius=1.199))) is None


@pytest.mark.parametrize(
    ("place", "rule"),
    [
        ((15.0, 23.5), ""),
        ((15.0, 23.75), "line"),
        ((15.0, 21.0), "waypoints"),
        ((15.0 + 2.0**-17, 18.0), "waypoints"),
    ],
)
def test_the_referee_knows_where_a_disc_may_turn(place: tuple[float, float], rule: str) -> None:
    """On the map, near to the walk, and in whole steps of 2^-16 of a cell."""
    walls = np.zeros((24, 31), dtype=bool)
    walls[:15, 15] = True
    low = 23 if place[1] > 22 else 18
    cells = [(5, y) for y in range(4, low + 1)] + [(x, low) for x in range(6, 26)]
    cells += [(25, y) for y in range(low - 1, 5, -1)]
    scene = Scene(Grid(walls), (5, 4), (25, 6), robot=Robot(radius=1.2))
    lines = np.array([(5.0, 4.0), (14.0, float(low)), place, (25.0, float(low)), (25.0, 6.0)])
    path = path_of(np.array(cells, dtype=np.int32), moves_for(scene))
    broken = check_plan(Plan(Status.FOUND, "bit-star", path, waypoints=lines), scene)
    assert ("" if broken is None else broken.rule) == rule
