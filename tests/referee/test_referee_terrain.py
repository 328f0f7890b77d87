"""The referee over terrain: what is paid is counted again, cell by cell, and every false sum is caught."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from referee_builders import random_query, random_trace

from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES, PELL_P, PELL_Q, Moves
from lampyris.model.path import Path, count_steps, path_of
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.referee import check_path, check_plan, check_trace

TENTHS = {
    "dissertation": (10, 14, 0),
    "sixteen-connected": (10, 14, 22),
    "four-connected": (1, 0, 0),
    "octile": (PELL_Q, PELL_P, 0),
}


def paid_for(cells: np.ndarray, terrain: np.ndarray, name: str) -> int:
    """The exact cost of a walk, added up as a person would."""
    total = 0
    for (x0, y0), (x, y) in zip(cells[:-1].tolist(), cells[1:].tolist(), strict=True):
        total += TENTHS[name][abs((x - x0) * (y - y0))] * (63 + int(terrain[y, x]))
    return total


def rough_query(
    rng: np.random.Generator, name: str, radius: float = 0.0, least: int = 3
) -> tuple[Path, Scene]:
    """A scene with terrain under its start and elsewhere, and a lawful path through it."""
    scene, path = random_query(rng, name, radius, least=least, share=0.4 if radius == 0 else 0.1)
    terrain = rng.integers(0, 253, scene.grid.blocked.shape)
    terrain[scene.start[1], scene.start[0]] = 100
    terrain[scene.goal[1], scene.goal[0]] = 7
    grid = replace(scene.grid, terrain=terrain)
    assert grid.terrain is not None
    moves = MOVES[name].weighed()
    told = Path(path.cells, moves, path.steps, paid_for(path.cells, grid.terrain, name))
    return told, replace(scene, grid=grid)


def judge(path: Path, scene: Scene) -> str | None:
    verdict = check_path(path, scene.grid, scene.robot, scene.moves, scene.start, scene.goal)
    return None if verdict is None else verdict.rule


@pytest.mark.parametrize("name", list(MOVES))
@pytest.mark.parametrize("radius", [0.0, 0.8])
def test_lawful_paths_pass(name: str, radius: float) -> None:
    rng = np.random.default_rng(61)
    for _ in range(25 if radius == 0 else 8):
        path, scene = rough_query(rng, name, radius, least=1)
        assert judge(path, scene) is None
        assert judge(path, replace(scene, moves=scene.moves.weighed())) is None
        assert path_of(path.cells, path.moves, scene.grid.terrain).paid == path.paid
        assert check_plan(Plan(Status.FOUND, "p", path, optimal_exact=path.exact), scene) is None


def test_a_long_way_over_the_heaviest_ground_is_told_to_the_last_digits() -> None:
    """More 63rds than one octile integer can tell apart as a pair: the value still is right."""
    width = 140_000
    blocked = np.zeros((2, width), bool)
    zigzag = np.stack((np.arange(width), np.arange(width) % 2), axis=1)
    grid = Grid(blocked, terrain=np.full((2, width), 252))
    path = path_of(zigzag, MOVES["octile"].weighed(), grid.terrain)
    scene = Scene(grid, (0, 0), (width - 1, 1), "octile")
    assert 315 * (width - 1) > PELL_Q
    assert judge(path, scene) is None
    assert path.cost == pytest.approx(5 * (width - 1) * 2**0.5, rel=1e-15)


Corruption = Callable[[Path, Scene, np.random.Generator], tuple[Path, Scene] | None]


def one_more(p: Path, s: Scene, rng: np.random.Generator) -> tuple[Path, Scene]:
    return replace(p, paid=p.exact + int(rng.choice([-1, 1]))), s


def not_paid(p: Path, s: Scene, rng: np.random.Generator) -> tuple[Path, Scene] | None:
    return replace(p, paid=None), s


def plain_price(p: Path, s: Scene, rng: np.random.Generator) -> tuple[Path, Scene]:
    """What the steps cost over plain ground."""
    return replace(p, paid=p.moves.exact(p.steps)), s


def pays_for_the_start(p: Path, s: Scene, rng: np.random.Generator) -> tuple[Path, Scene] | None:
    """Each step pays for the cell it leaves."""
    assert s.grid.terrain is not None
    other = paid_for(p.cells[::-1], s.grid.terrain, s.moves.name)
    return None if other == p.paid else (replace(p, paid=other), s)


def heavier_ground(p: Path, s: Scene, rng: np.random.Generator) -> tuple[Path, Scene]:
    """One cell of the way weighs more than was paid."""
    assert s.grid.terrain is not None
    terrain = s.grid.terrain.astype(int)
    x, y = p.cells[int(rng.integers(1, len(p.cells)))]
    terrain[y, x] += 1 if terrain[y, x] < 252 else -1
    return p, replace(s, grid=replace(s.grid, terrain=terrain))


def goal_not_paid(p: Path, s: Scene, rng: np.random.Generator) -> tuple[Path, Scene]:
    assert s.grid.terrain is not None
    terrain = s.grid.terrain.copy()
    terrain[s.goal[1], s.goal[0]] = 0
    return replace(p, paid=paid_for(p.cells, terrain, s.moves.name)), s


def plain_moves(p: Path, s: Scene, rng: np.random.Generator) -> tuple[Path, Scene]:
    assert p.paid is not None
    return Path(p.cells, s.moves, p.steps, p.paid // 63), s


def no_terrain(p: Path, s: Scene, rng: np.random.Generator) -> tuple[Path, Scene]:
    return p, replace(s, grid=replace(s.grid, terrain=None))


def other_unit(p: Path, s: Scene, rng: np.random.Generator) -> tuple[Path, Scene]:
    moves = replace(p.moves, scale=21)
    return replace(p, moves=moves), s


def other_costs(p: Path, s: Scene, rng: np.random.Generator) -> tuple[Path, Scene]:
    moves = replace(p.moves, costs=tuple(64 * (c // 63) for c in p.moves.costs))
    return replace(p, moves=moves), s


class Rounder(Path):
    """A path that is exact, and rounds what it shows."""

    @property
    def cost(self) -> float:
        return self.moves.value(self.exact) * (1 + 1e-9)


def false_shown(p: Path, s: Scene, rng: np.random.Generator) -> tuple[Path, Scene]:
    return Rounder(p.cells, p.moves, p.steps, p.paid), s


def confused_counts(p: Path, s: Scene, rng: np.random.Generator) -> tuple[Path, Scene] | None:
    return None if p.steps[0] == p.steps[1] else (replace(p, steps=p.steps[1::-1]), s)


CORRUPTIONS: list[tuple[Corruption, str]] = [
    (one_more, "cost"),
    (not_paid, "cost"),
    (plain_price, "cost"),
    (pays_for_the_start, "cost"),
    (heavier_ground, "cost"),
    (goal_not_paid, "cost"),
    (plain_moves, "moves"),
    (no_terrain, "moves"),
    (other_unit, "moves"),
    (other_costs, "moves"),
    (false_shown, "cost"),
    (confused_counts, "steps"),
]


@pytest.mark.commit(4)
@pytest.mark.parametrize(("corrupt", "rule"), CORRUPTIONS, ids=lambda c: getattr(c, "__name__", ""))
def test_every_false_sum_is_caught_by_its_rule(corrupt: Corruption, rule: str) -> None:
    rng = np.random.default_rng(62)
    met = 0
    for k in range(60):
        path, scene = rough_query(rng, list(MOVES)[k % 4])
        case = corrupt(path, scene, rng)
        if case is None:
            continue
        met += 1
        assert judge(*case) == rule
        assert judge(path, scene) is None
    assert met > 25


def test_ground_beside_the_way_and_under_the_start_does_not_count() -> None:
    rng = np.random.default_rng(63)
    for k in range(30):
        path, scene = rough_query(rng, list(MOVES)[k % 4])
        assert scene.grid.terrain is not None
        other = rng.integers(0, 253, scene.grid.blocked.shape)
        for x, y in path.cells[1:]:
            other[y, x] = scene.grid.terrain[y, x]
        assert judge(path, replace(scene, grid=replace(scene.grid, terrain=other))) is None


def test_weighed_moves_asked_for_on_plain_ground_are_taken_as_plain_ones() -> None:
    rng = np.random.default_rng(64)
    for name in MOVES:
        scene, path = random_query(rng, name, least=3, share=0.3)
        asked = replace(scene, moves=scene.moves.weighed())
        assert judge(path, asked) is None
        weighed = Path(path.cells, asked.moves, path.steps)
        assert judge(weighed, asked) == judge(weighed, scene) == "moves"
        assert judge(replace(path, paid=path.exact), scene) is None
        assert judge(replace(path, paid=path.exact + 1), scene) == "cost"


def test_wrong_step_costs_are_found_in_either_unit() -> None:
    grid = Grid(np.zeros((3, 3), bool), terrain=np.full((3, 3), 3))
    cells = np.array([[0, 0], [1, 1]])
    for name in ("dissertation", "octile"):
        good = MOVES[name].weighed()
        bad = replace(good, costs=tuple(c - 63 if c == good.diagonal else c for c in good.costs))
        for moves, rule in ((good, None), (bad, "moves")):
            paid = moves.diagonal // 63 * 66
            path = Path(cells, moves, count_steps(cells, moves), paid)
            assert judge(path, Scene(grid, (0, 0), (1, 1), moves)) == rule


def test_traces_pay_for_the_ground_they_drove_over() -> None:
    rng = np.random.default_rng(65)
    for k in range(12):
        name = list(MOVES)[k % 4]
        trace = random_trace(rng, name)
        terrain = rng.integers(1, 253, trace.scene.grid.blocked.shape)
        rough = replace(trace.scene, grid=replace(trace.scene.grid, terrain=terrain))
        assert trace.path is not None
        assert rough.grid.terrain is not None
        assert check_trace(trace) is None
        way = path_of(trace.path.cells, MOVES[name].weighed(), rough.grid.terrain)
        lawful = replace(trace, scene=rough, path=way)
        assert check_trace(lawful) is None
        free_ride = check_trace(replace(trace, scene=rough))
        assert free_ride is not None
        assert free_ride.rule == "moves"
        short = check_trace(replace(lawful, path=replace(way, paid=way.exact - 1)))
        assert short is not None
        assert short.rule == "cost"


def test_moves_of_a_guest_are_weighed_by_their_own_table() -> None:
    """Prices of somebody's own: each times the weight of the cell entered."""
    guest = Moves("guest", ((-1, 0), (1, 0), (0, -1), (0, 1)), (4,) * 4, 4, False)
    grid = Grid(np.zeros((1, 3), bool), terrain=[[0, 10, 20]])
    path = Path(np.array([[0, 0], [1, 0], [2, 0]]), guest.weighed(), (2, 0), 4 * (73 + 83))
    scene = Scene(grid, (0, 0), (2, 0), guest)
    assert judge(path, scene) is None
    assert path.cost == pytest.approx(float(Fraction(73 + 83, 63)), rel=1e-15)
    assert judge(replace(path, paid=4 * (73 + 83) + 4), scene) == "cost"
