"""The referee on paths and plans: lawful ones pass, every corruption is caught by the rule that names it."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from referee_builders import disc_free, find_path, nearest_wall, random_grid, random_query, square_distance

from lampyris.errors import InternalFault, UsageError
from lampyris.model.field import Gate
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES, Moves
from lampyris.model.path import Path, count_steps, path_of
from lampyris.model.plan import Plan, Status
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.referee import Violation, certify, check_path, check_plan, demand
from lampyris.referee.geometry.shapes import disc_cells, swept_cells, wall_distance
from sizes import sized

RADII = (0.3, 0.5, 0.8, 1.2)


def judge(path: Path, scene: Scene) -> str | None:
    verdict = check_path(path, scene.grid, scene.robot, scene.moves, scene.start, scene.goal)
    return None if verdict is None else verdict.rule


def at(scene: Scene, x: int, y: int, value: bool = True) -> Scene:
    """The same scene with one cell of the map changed."""
    blocked = scene.grid.blocked.copy()
    blocked[y, x] = value
    return replace(scene, grid=Grid(blocked, resolution=scene.grid.resolution))


@pytest.mark.commit(8)
@pytest.mark.parametrize("moves", list(MOVES))
@pytest.mark.parametrize("radius", [0.0, *RADII])
def test_lawful_paths_pass(moves: str, radius: float) -> None:
    rng = np.random.default_rng(1)
    for _ in range(60 if radius == 0 else 15):
        share = 0.4 if radius == 0 else 0.1
        scene, path = random_query(rng, moves, radius, least=1 + (radius == 0), share=share)
        assert judge(path, scene) is None


def test_a_path_may_be_one_cell() -> None:
    scene = Scene(Grid(np.zeros((1, 1), bool)), (0, 0), (0, 0))
    assert judge(path_of([[0, 0]], scene.moves), scene) is None


def test_a_part_of_the_moves_is_allowed() -> None:
    # A robot with a radius has no knight's steps and cuts no corners: its planner drops them.
    moves = MOVES["sixteen-connected"]
    part = replace(moves, offsets=moves.offsets[8:], costs=moves.costs[8:])
    scene = Scene(Grid(np.zeros((5, 5), bool)), (0, 0), (2, 1), moves, Robot(radius=0.4))
    cells = [[0, 0], [1, 1], [2, 1]]
    assert judge(path_of(cells, part), scene) is None


# ---- corruptions ----

Case = tuple[Path, Scene]
Corruption = Callable[[Path, Scene, np.random.Generator], Case | None]


def again(path: Path, cells: np.ndarray) -> Path:
    """A path of other cells whose counts are honest about them."""
    return Path(cells, path.moves, count_steps(cells, path.moves))


def empty(p: Path, s: Scene, rng: np.random.Generator) -> Case | None:
    return Path(np.zeros((0, 2)), p.moves, (0, 0)), s


def late_start(p: Path, s: Scene, rng: np.random.Generator) -> Case | None:
    return again(p, p.cells[1:]), s


def early_end(p: Path, s: Scene, rng: np.random.Generator) -> Case | None:
    return again(p, p.cells[:-1]), s


def backwards(p: Path, s: Scene, rng: np.random.Generator) -> Case | None:
    return again(p, p.cells[::-1]), s


def other_query(p: Path, s: Scene, rng: np.random.Generator) -> Case | None:
    return p, replace(s, goal=(int(p.cells[-2, 0]), int(p.cells[-2, 1])))


def teleport(p: Path, s: Scene, rng: np.random.Generator) -> Case | None:
    k = int(rng.integers(1, len(p.cells) - 1))
    d = p.cells[k + 1] - p.cells[k - 1]
    if (int(d[0]), int(d[1])) in s.moves.offsets:
        return None
    return again(p, np.delete(p.cells, k, axis=0)), s


def stands_still(p: Path, s: Scene, rng: np.random.Generator) -> Case | None:
    k = int(rng.integers(len(p.cells)))
    return again(p, np.insert(p.cells, k, p.cells[k], axis=0)), s


def off_the_map(p: Path, s: Scene, rng: np.random.Generator) -> Case | None:
    cells = p.cells.copy()
    k = int(rng.integers(1, len(cells) - 1))
    side = (s.grid.width, s.grid.height)
    axis = int(rng.integers(2))
    # -1 would read the far side of the map by Python's indexing; width and height would raise.
    cells[k, axis] = int(rng.choice([-1, -side[axis], side[axis], 2**31 - 1, -(2**31)]))
    return Path(cells, p.moves, p.steps), s


def into_a_wall(p: Path, s: Scene, rng: np.random.Generator) -> Case | None:
    walls = np.argwhere(s.grid.blocked)
    if not len(walls):
        return None
    cells = p.cells.copy()
    cells[int(rng.integers(1, len(cells) - 1))] = walls[int(rng.integers(len(walls)))][::-1]
    return again(p, cells), s


def wall_along(p: Path, s: Scene, rng: np.random.Generator) -> Case | None:
    x, y = p.cells[int(rng.integers(1, len(p.cells) - 1))].tolist()
    return p, at(s, x, y)


def cut_corner(p: Path, s: Scene, rng: np.random.Generator) -> Case | None:
    d = np.diff(p.cells, axis=0)
    diagonal = np.flatnonzero(np.abs(d[:, 0] * d[:, 1]) == 1)
    if not len(diagonal) or s.moves.corner_cutting:
        return None
    k = int(rng.choice(diagonal))
    sides = [(p.cells[k + 1, 0], p.cells[k, 1]), (p.cells[k, 0], p.cells[k + 1, 1])]
    x, y = sides[int(rng.integers(2))]
    if [x, y] in p.cells.tolist():
        return None
    return p, at(s, int(x), int(y))


def over_a_wall(p: Path, s: Scene, rng: np.random.Generator) -> Case | None:
    d = np.diff(p.cells, axis=0)
    long = np.flatnonzero(np.abs(d[:, 0] * d[:, 1]) == 2)
    if not len(long):
        return None
    k = int(rng.choice(long))
    (x, y), (dx, dy) = p.cells[k].tolist(), d[k].tolist()
    sx, sy = int(math.copysign(1, dx)), int(math.copysign(1, dy))
    straight = (x + sx, y) if abs(dx) == 2 else (x, y + sy)
    wall = (straight, (x + sx, y + sy))[int(rng.integers(2))]
    return p, at(s, *wall)


def wide_robot(p: Path, s: Scene, rng: np.random.Generator) -> Case | None:
    """A wall that the centre misses and the disc does not."""
    if s.moves.reach > 1:
        return None
    k = int(rng.integers(1, len(p.cells)))
    mid = (p.cells[k - 1] + p.cells[k]) / 2
    cells = set(map(tuple, p.cells.tolist()))
    radius = float(rng.choice([0.6, 0.9, 1.3, 2.0]))
    near = [
        (x, y)
        for x in range(s.grid.width)
        for y in range(s.grid.height)
        if (x, y) not in cells and square_distance(*mid, x, y) < radius - 1e-6
    ]
    if not near:
        return None
    x, y = near[int(rng.integers(len(near)))]
    return p, replace(at(s, x, y), robot=Robot(radius=radius))


def cheaper_by_one(p: Path, s: Scene, rng: np.random.Generator) -> Case | None:
    k = int(rng.integers(len(p.steps)))
    steps = list(p.steps)
    steps[k] += int(rng.choice([-1, 1]))
    return replace(p, steps=tuple(steps)), s


def confused_counts(p: Path, s: Scene, rng: np.random.Generator) -> Case | None:
    return None if p.steps[0] == p.steps[1] else (replace(p, steps=p.steps[1::-1]), s)


class Liar(Path):
    """A path whose exact cost is one less than its steps cost."""

    @property
    def exact(self) -> int:
        return self.moves.exact(self.steps) - 1


class Rounder(Path):
    """A path that is exact, and rounds what it shows."""

    @property
    def cost(self) -> float:
        return self.moves.value(self.exact) * (1 + 1e-9)


def false_exact(p: Path, s: Scene, rng: np.random.Generator) -> Case | None:
    return Liar(p.cells, p.moves, p.steps), s


def false_shown(p: Path, s: Scene, rng: np.random.Generator) -> Case | None:
    return Rounder(p.cells, p.moves, p.steps), s


def other_moves(p: Path, s: Scene, rng: np.random.Generator) -> Case | None:
    other = MOVES[str(rng.choice([m for m in MOVES if m != s.moves.name]))]
    return Path(p.cells, other, count_steps(p.cells, other)), s


def cheap_diagonals(p: Path, s: Scene, rng: np.random.Generator) -> Case | None:
    if not s.moves.diagonal:
        return None
    costs = tuple(
        c - 1 if abs(dx * dy) == 1 else c for (dx, dy), c in zip(s.moves.offsets, s.moves.costs, strict=True)
    )
    cheap = replace(s.moves, costs=costs)
    return Path(p.cells, cheap, p.steps), replace(s, moves=cheap)


CORRUPTIONS: list[tuple[Corruption, set[str]]] = [
    (empty, {"empty"}),
    (late_start, {"start"}),
    (early_end, {"goal"}),
    (backwards, {"start"}),
    (other_query, {"goal"}),
    (teleport, {"step"}),
    (stands_still, {"step"}),
    (off_the_map, {"outside"}),
    (into_a_wall, {"wall"}),
    (wall_along, {"wall"}),
    (cut_corner, {"corner"}),
    (over_a_wall, {"knight"}),
    (wide_robot, {"sweep"}),
    (cheaper_by_one, {"steps"}),
    (confused_counts, {"steps"}),
    (false_exact, {"cost"}),
    (false_shown, {"cost"}),
    (other_moves, {"moves"}),
    (cheap_diagonals, {"moves"}),
]


@pytest.mark.commit(8)
@sized("cases", 40, 160)
@pytest.mark.parametrize(("corrupt", "rules"), CORRUPTIONS, ids=lambda c: getattr(c, "__name__", ""))
def test_every_corruption_of_a_path_is_caught_by_its_rule(
    corrupt: Corruption, rules: set[str], cases: int
) -> None:
    rng = np.random.default_rng(27)
    met = 0
    for k in range(cases):
        scene, path = random_query(rng, list(MOVES)[k % 4], least=3, share=0.4)
        case = corrupt(path, scene, rng)
        if case is None:
            continue
        met += 1
        assert judge(*case) in rules, (path.cells.tolist(), case[0].cells.tolist(), scene.moves.name)
        assert judge(path, scene) is None
    assert met >= cases / 8


def test_corner_cutting_is_a_violation_only_where_it_is_forbidden() -> None:
    grid = Grid(np.array([[False, True], [True, False]]))
    verdicts = {
        name: judge(path_of([[0, 0], [1, 1]], MOVES[name]), Scene(grid, (0, 0), (1, 1), name))
        for name in MOVES
    }
    assert verdicts == {
        "dissertation": None,
        "octile": "corner",
        "sixteen-connected": "corner",
        "four-connected": "step",
    }


def test_a_disc_never_cuts_a_corner() -> None:
    grid = Grid(np.array([[False, True], [False, False]]))
    path = path_of([[0, 0], [1, 1]], MOVES["dissertation"])
    for radius, rule in ((0.0, None), (1e-6, "sweep"), (0.4, "sweep")):
        scene = Scene(grid, (0, 0), (1, 1), "dissertation", Robot(radius=radius))
        assert judge(path, scene) == rule


@pytest.mark.parametrize(
    ("radius", "resolution", "gap"), [(0.3, 0.2, 3), (0.35, 0.1, 7), (0.05, 0.1, 1), (1.5, 1.0, 3)]
)
def test_a_robot_exactly_as_wide_as_a_corridor_fits(radius: float, resolution: float, gap: int) -> None:
    blocked = np.zeros((gap + 2, 6), bool)
    blocked[0] = blocked[-1] = True
    mid = (gap + 1) // 2
    grid = Grid(blocked, resolution=resolution)
    path = path_of([[x, mid] for x in range(6)], MOVES["octile"])
    for r, rule in ((radius, None), (radius * (1 + 1e-6), "sweep")):
        assert judge(path, Scene(grid, (0, mid), (5, mid), robot=Robot(radius=r))) == rule


def test_holes_of_the_competition_validator_are_closed() -> None:
    """GPPC's validator never sees the ends: an empty path, or one between other cells, is valid to it."""
    scene = Scene(Grid(np.zeros((4, 4), bool)), (0, 0), (3, 3))
    octile = MOVES["octile"]
    assert judge(Path(np.zeros((0, 2)), octile, (0, 0)), scene) == "empty"
    assert judge(path_of([[1, 1], [2, 2]], octile), scene) == "start"
    assert judge(path_of([[0, 0]], octile), replace(scene, goal=(0, 0))) is None


# ---- geometry against plain sampling ----


@pytest.mark.parametrize("resolution", [1.0, 0.05])
def test_covered_cells_equal_their_definition(resolution: float) -> None:
    for share in (0.0, 0.2, 0.49, 0.51, 0.7, 0.71, 1.0, 1.4, 1.6, 2.55):
        radius = share * resolution
        want = {
            (x, y)
            for x in range(-4, 5)
            for y in range(-4, 5)
            if (x, y) == (0, 0) or square_distance(0, 0, x, y) * resolution < radius - 1e-9
        }
        assert set(map(tuple, disc_cells(radius, resolution).tolist())) == want


@pytest.mark.parametrize("step", [(1, 0), (0, -1), (1, 1), (-1, 1), (2, 1), (-1, -2)])
def test_swept_cells_equal_a_dense_sampling(step: tuple[int, int]) -> None:
    along = np.linspace(0.0, 1.0, 4001)
    radii = (0.05, 0.3, 0.6, 1.1, 1.9)
    got = {radius: set(map(tuple, swept_cells(*step, radius, 1.0).tolist())) for radius in radii}
    for x in range(-5, 6):
        for y in range(-5, 6):
            dx = np.maximum(np.abs(step[0] * along - x) - 0.5, 0.0)
            dy = np.maximum(np.abs(step[1] * along - y) - 0.5, 0.0)
            near = float(np.hypot(dx, dy).min())
            for radius in radii:
                if abs(near - radius) > 1e-3:
                    assert ((x, y) in got[radius]) == (near < radius), (step, radius, x, y, near)


def test_wall_distance_equals_the_nearest_square() -> None:
    rng = np.random.default_rng(8)
    for _ in range(60):
        grid = random_grid(rng, 3, 14, 0.5, resolution=float(rng.choice([1.0, 0.25])))
        x, y = rng.integers(0, grid.width, 12), rng.integers(0, grid.height, 12)
        beyond = float(rng.choice([0.3, 1.0, 2.5, 100.0]))
        got = wall_distance(grid, x, y, beyond)
        for k in range(12):
            want = nearest_wall(grid, int(x[k]), int(y[k])) * grid.resolution
            assert got[k] == (pytest.approx(want) if want <= beyond else math.inf)


# ---- plans ----


def verdict_of(plan: Plan, scene: Scene) -> str | None:
    verdict = check_plan(plan, scene)
    return None if verdict is None else verdict.rule


def test_lawful_plans_pass() -> None:
    rng = np.random.default_rng(3)
    seen: Counter[str] = Counter()
    for k in range(300):
        radius = 0.0 if k % 3 else 0.8
        grid = random_grid(rng, 4, 10, 0.7)
        ends = [(int(rng.integers(grid.width)), int(rng.integers(grid.height))) for _ in range(2)]
        scene = Scene(grid, ends[0], ends[1], list(MOVES)[k % 4], Robot(radius=radius))
        free = disc_free(grid, radius)
        path = find_path(grid, scene.moves, scene.start, scene.goal, radius)
        status = Status.FOUND if path else Status.NO_PATH
        for end, word in ((scene.goal, Status.GOAL_OCCUPIED), (scene.start, Status.START_OCCUPIED)):
            if not free[end[1], end[0]]:
                status = word
        best = None if path is None else path.exact
        plan = Plan(status, "reference", path, optimal_exact=best)
        seen[status] += 1
        assert verdict_of(plan, scene) is None
        wrong = {Status.START_OCCUPIED, Status.GOAL_OCCUPIED} - {status}
        if path is not None:
            for other in wrong:
                assert verdict_of(Plan(other, "reference"), scene) == "status"
        elif status is not Status.NO_PATH:
            assert verdict_of(Plan(Status.NO_PATH, "reference"), scene) == "status"
    assert (
        min(seen[s] for s in (Status.FOUND, Status.NO_PATH, Status.START_OCCUPIED, Status.GOAL_OCCUPIED)) > 10
    )


def test_no_path_to_where_one_stands_is_a_violation() -> None:
    scene = Scene(Grid(np.zeros((2, 2), bool)), (1, 1), (1, 1))
    assert verdict_of(Plan(Status.NO_PATH, "liar"), scene) == "status"


def test_numbers_that_cannot_be_are_caught() -> None:
    scene, path = random_query(np.random.default_rng(2), "octile")
    good = Plan(Status.FOUND, "reference", path, 1, 5, optimal_exact=path.exact, sum_cost_to_go=3.0)
    assert verdict_of(good, scene) is None
    x, y = 0, 0
    while [x, y] in path.cells.tolist():
        x += 1
    for change, rule in (
        ({"iterations": -1}, "numbers"),
        ({"expansions": -1}, "numbers"),
        ({"optimal_exact": path.exact + 1}, "gap"),
        ({"optimal_exact": -1}, "gap"),
        ({"sum_cost_to_go": math.nan}, "numbers"),
        ({"sum_cost_to_go": -1.0}, "numbers"),
        ({"gates_on_path": (Gate((x, y), "x", 1.0, False),)}, "gates"),
        ({"path": replace(path, steps=(0, 0))}, "steps"),
    ):
        assert verdict_of(replace(good, **change), scene) == rule
    bare = object.__new__(Plan)
    for name in Plan.__dataclass_fields__:
        object.__setattr__(bare, name, getattr(good, name))
    object.__setattr__(bare, "path", None)
    assert verdict_of(bare, scene) == "status"


def test_a_replan_is_judged_from_where_the_robot_stood() -> None:
    scene, path = random_query(np.random.default_rng(4), "octile", least=6)
    rest = path_of(path.cells[2:], path.moves)
    plan = Plan(Status.FOUND, "reference", rest)
    here = (int(path.cells[2, 0]), int(path.cells[2, 1]))
    assert check_plan(plan, scene, start=here) is None
    assert verdict_of(plan, scene) == "start"


# ---- what follows from a violation ----


def test_a_violation_stops_everything_and_names_itself() -> None:
    demand(None)
    with pytest.raises(InternalFault, match=r"REFEREE.*node 3.*corner: the step") as caught:
        demand(Violation("corner", "node 3", "the step from (0, 0) to (1, 1) cuts a blocked corner"))
    assert caught.value.exit_code == 6


def test_certify_hands_back_what_it_was_given() -> None:
    scene, path = random_query(np.random.default_rng(6), "octile")
    plan = Plan(Status.FOUND, "reference", path)
    assert certify(path, scene) is path
    assert certify(plan, scene) is plan
    with pytest.raises(InternalFault, match="wall"):
        certify(plan, at(scene, *path.cells[1].tolist()))
    with pytest.raises(UsageError, match="its scene"):
        certify(plan)


def test_moves_of_a_guest_are_judged_by_their_own_table() -> None:
    knight = Moves("chess", ((1, 2), (2, 1)), (3, 3), 1, False)
    grid = Grid(np.zeros((6, 6), bool))
    assert judge(path_of([[0, 0], [1, 2], [3, 3]], knight), Scene(grid, (0, 0), (3, 3), knight)) is None
    leap = Moves("leap", ((3, 0),), (3,), 1, False)
    assert judge(path_of([[0, 0], [3, 0]], leap), Scene(grid, (0, 0), (3, 0), leap)) == "moves"
