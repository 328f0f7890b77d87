"""The field against a plain reference, and what holds of every field."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from lampyris.errors import SceneError, SettingError
from lampyris.model.field import Field
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES, PELL_P, PELL_Q, Moves
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning.field import waves
from lampyris.planning.field.solve import solve, solve_field
from lampyris_selfcheck.reference.paths import field as twin
from reference.kernel_forms import use


def _draw(rng: np.random.Generator, largest: int) -> tuple[np.ndarray, tuple[int, int]]:
    height, width = rng.integers(1, largest + 1, 2)
    free = rng.random((height, width)) >= 0.55 * rng.random()
    return free, (int(rng.integers(width)), int(rng.integers(height)))


def _exact(moves: Moves, cost: twin.Surd) -> int:
    if moves.name == "octile":
        assert cost.n.denominator == cost.m.denominator == 1
        return int(cost.n) * PELL_Q + int(cost.m) * PELL_P
    whole = cost.n * moves.unit
    assert whole.denominator == 1
    return int(whole)


def _agree(field: Field, free: np.ndarray, goal: tuple[int, int], rule: str | None = None) -> None:
    moves, name = field.moves, field.moves.name
    cost, parent = twin.field(free.tolist(), name, goal, rule)
    luciferin = twin.luciferin(cost, parent, name, field.rho, field.gamma)
    exact = np.full(free.shape, -1, dtype=np.int64)
    step = np.full(free.shape, -1)
    glow = np.full(free.shape, np.inf)
    for x, y in cost:
        exact[y, x] = _exact(moves, cost[x, y])
        step[y, x] = parent[x, y]
        glow[y, x] = luciferin[x, y]
    np.testing.assert_array_equal(field.exact, exact)
    np.testing.assert_array_equal(field.step, step)
    np.testing.assert_allclose(field.luciferin, glow, rtol=1e-12)
    assert field.expansions == len(cost)


@pytest.mark.commit(3)
@pytest.mark.parametrize("form", ["plain", "compiled"])
@pytest.mark.parametrize("name", MOVES)
def test_against_the_twin(name: str, form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    use(monkeypatch, form)
    rng = np.random.default_rng(11)
    for _ in range(60):
        free, goal = _draw(rng, 15)
        _agree(solve(free, MOVES[name], goal), free, goal)


@pytest.mark.parametrize("name", ["dissertation", "octile"])
def test_the_corner_rule_is_the_moves_own(name: str) -> None:
    """A robot with a size turns the dissertation's corner cutting off; octile moves may have it on."""
    rng = np.random.default_rng(12)
    cutting = not MOVES[name].corner_cutting
    for _ in range(40):
        free, goal = _draw(rng, 12)
        moves = replace(MOVES[name], corner_cutting=cutting)
        _agree(solve(free, moves, goal), free, goal, "cut" if cutting else "guard")


@pytest.mark.commit(2)
@pytest.mark.parametrize("name", MOVES)
def test_all_3x3_grids(name: str) -> None:
    for bits in range(512):
        free = np.array([bits >> k & 1 for k in range(9)], dtype=np.bool_).reshape(3, 3)
        goal = (bits % 3, bits // 3 % 3)
        _agree(solve(free, MOVES[name], goal), free, goal)


@pytest.mark.parametrize("name", MOVES)
def test_luciferin_falls_along_parents(name: str) -> None:
    free = np.random.default_rng(15).random((60, 70)) >= 0.25
    free[30, 35] = True
    field = solve(free, MOVES[name], (35, 30))
    luciferin, parent = field.luciferin.ravel(), field.parent.ravel()
    has = parent >= 0
    assert has.sum() == field.expansions - 1 > 1000
    assert (luciferin[parent[has]] < luciferin[has]).all()
    assert (luciferin[has] <= 0.6 / 0.4 * field.cost.ravel()[has] * (1 + 1e-12)).all()


@pytest.mark.parametrize("name", MOVES)
def test_stop(name: str) -> None:
    """With ``stop`` the field is the full one up to the cost of that cell, and holds nothing beyond."""
    rng = np.random.default_rng(16)
    stopped_early = 0
    for _ in range(60):
        free, goal = _draw(rng, 25)
        stop = (int(rng.integers(free.shape[1])), int(rng.integers(free.shape[0])))
        full = solve(free, MOVES[name], goal)
        part = solve(free, MOVES[name], goal, stop=stop)
        limit = full.exact[stop[1], stop[0]]
        kept = full.exact >= 0 if limit < 0 else (full.exact >= 0) & (full.exact <= limit)
        np.testing.assert_array_equal(part.exact, np.where(kept, full.exact, -1))
        np.testing.assert_array_equal(part.step, np.where(kept, full.step, -1))
        np.testing.assert_array_equal(part.luciferin, np.where(kept, full.luciferin, np.inf))
        assert part.expansions == kept.sum()
        stopped_early += part.expansions < full.expansions
    assert stopped_early > 20


@pytest.mark.nightly
def test_a_long_way_stays_exact() -> None:
    """A comb of corridors: thousands of steps, and the octile pair is still read back exactly."""
    free = np.ones((41, 400), dtype=np.bool_)
    free[1::4, :-1] = False
    free[3::4, 1:] = False
    field = solve(free, MOVES["octile"], (0, 0))
    far = int(field.exact.max())
    cost, _ = twin.field(free.tolist(), "octile", (0, 0))
    longest = max(cost.values())
    assert far == _exact(MOVES["octile"], longest)
    cost_there = field.cost[field.exact == far].max()
    assert cost_there == float(longest.n) + float(longest.m) * 2**0.5 > 4000


def test_arrays_are_read_only_and_our_own() -> None:
    free = np.ones((4, 5), dtype=np.bool_)
    field = solve(free, MOVES["octile"], (2, 2))
    free[:] = False
    assert field.free.all()
    for array in (field.free, field.exact, field.step, field.luciferin):
        assert array.shape == (4, 5)
        with pytest.raises(ValueError, match="read-only"):
            array[0, 0] = 0


def test_fields_do_not_share_memory() -> None:
    """Scratch is kept from call to call; results never are."""
    free = np.ones((6, 6), dtype=np.bool_)
    first = solve(free, MOVES["dissertation"], (0, 0))
    copies = first.exact.copy(), first.luciferin.copy(), first.step.copy()
    solve(free, MOVES["dissertation"], (5, 5))
    for array, copy in zip((first.exact, first.luciferin, first.step), copies, strict=True):
        np.testing.assert_array_equal(array, copy)


@pytest.mark.parametrize("name", MOVES)
def test_a_blocked_goal_has_no_field(name: str) -> None:
    free = np.ones((3, 4), dtype=np.bool_)
    free[1, 2] = False
    field = solve(free, MOVES[name], (2, 1))
    assert (field.exact == -1).all()
    assert (field.step == -1).all()
    assert np.isinf(field.luciferin).all()
    assert np.isinf(field.cost).all()
    assert field.expansions == 0


@pytest.mark.parametrize("name", MOVES)
def test_one_cell(name: str) -> None:
    field = solve(np.ones((1, 1), dtype=np.bool_), MOVES[name], (0, 0))
    assert (field.exact[0, 0], field.step[0, 0], field.luciferin[0, 0]) == (0, -1, 0.0)
    assert field.parent[0, 0] == -1


@pytest.mark.parametrize(
    ("settings", "word"),
    [
        ({"rho": 0.0}, "RHO"),
        ({"rho": 1.01}, "RHO"),
        ({"rho": float("nan")}, "RHO"),
        ({"rho": True}, "RHO"),
        ({"gamma": 0.0}, "GAMMA"),
        ({"gamma": float("inf")}, "GAMMA"),
        ({"gamma": "0.6"}, "GAMMA"),
        ({"gates": "shut"}, "GATES"),
    ],
)
def test_bad_settings(settings: dict[str, object], word: str) -> None:
    scene = Scene(Grid(np.zeros((2, 2), dtype=np.bool_)), (0, 0), (1, 1))
    with pytest.raises(SettingError, match=word):
        solve_field(scene, **settings)  # type: ignore[arg-type]


def test_bad_arrays_and_goals() -> None:
    with pytest.raises(SettingError, match="GRID_SHAPE"):
        solve(np.ones((2, 2), dtype=np.int8), MOVES["octile"], (0, 0))  # type: ignore[arg-type]
    with pytest.raises(SceneError, match="GOAL_OUTSIDE"):
        solve(np.ones((2, 2), dtype=np.bool_), MOVES["octile"], (2, 0))
    leap = Moves("leap", ((-1, 0), (1, 0)), (10, 30), 10, False)
    with pytest.raises(SettingError, match="MOVES"):
        solve(np.ones((2, 2), dtype=np.bool_), leap, (0, 0))
    for offsets, costs in ((((-1, 0), (1, 0)), (10, 12)), (((-1, 0), (1, 0), (0, 1)), (10, 10, 10))):
        with pytest.raises(SettingError, match="reverse"):
            solve(np.ones((2, 2), dtype=np.bool_), Moves("one way", offsets, costs, 10, False), (0, 0))


@pytest.mark.parametrize(
    ("name", "diagonal", "straight", "unit"),
    [
        ("dissertation", 14, 0, 10), ("dissertation", 14, 0, 0), ("dissertation", 14, -10, 10),
        ("dissertation", 40, 10, 10), ("dissertation", 14, 10, 0), ("octile", 14, 10, 0), ("four-connected", 0, 0, 1),
        ("four-connected", 0, -1, 1), ("four-connected", 0, 1, 0),
    ],
)  # fmt: skip
def test_bad_prices(name: str, diagonal: int, straight: int, unit: int) -> None:
    """Before they get to a kernel, also of step sets that have kernels of their own."""
    offsets = MOVES[name].offsets
    costs = tuple(diagonal if dx and dy else straight for dx, dy in offsets)
    own = Moves("own", offsets, costs, unit, MOVES[name].corner_cutting)
    with pytest.raises(SettingError, match="MOVES"):
        solve(np.ones((3, 4), dtype=np.bool_), own, (0, 0))


@pytest.mark.parametrize("diagonal", [11, 20, 21])
@pytest.mark.parametrize("cutting", [True, False])
def test_a_wall_is_nobodys_parent(diagonal: int, cutting: bool) -> None:
    """A cell that costs one less than a diagonal step: walls, and what is beyond the map, hold -1."""
    own = Moves("own", MOVES["octile"].offsets, (diagonal,) * 4 + (10,) * 4, 10, cutting)
    rng = np.random.default_rng(29)
    for k in range(30):
        free, goal = _draw(rng, 12)
        stop = (int(rng.integers(free.shape[1])), int(rng.integers(free.shape[0]))) if k % 2 else None
        field = solve(free, own, goal, stop=stop)
        known = np.argwhere(field.exact > 0)
        assert len(known) == field.expansions - (field.expansions > 0)
        for y, x in known:
            dx, dy = own.offsets[field.step[y, x]]
            assert field.exact[y, x] - field.exact[y + dy, x + dx] == (diagonal if dx and dy else 10)
            assert field.exact[y + dy, x + dx] >= 0


@pytest.mark.parametrize("name", MOVES)
@pytest.mark.parametrize("terrain", [False, True])
def test_stopping_at_the_goal(name: str, terrain: bool) -> None:
    """The goal costs nothing, and nothing else costs no more."""
    moves = MOVES[name].weighed() if terrain else MOVES[name]
    ground = np.full((6, 7), 9, dtype=np.uint8) if terrain else None
    field = solve(np.ones((6, 7), dtype=np.bool_), moves, (3, 2), terrain=ground, stop=(3, 2))
    assert (field.expansions, np.argwhere(field.exact >= 0).tolist()) == (1, [[2, 3]])
    assert np.argwhere(np.isfinite(field.luciferin)).tolist() == [[2, 3]]
    assert (field.step == -1).all()


def test_a_robot_with_a_size() -> None:
    """The field of a scene is solved where the robot fits, and without corner cutting."""
    blocked = np.zeros((5, 7), dtype=np.bool_)
    blocked[2, 3] = True
    scene = Scene(Grid(blocked), (0, 2), (6, 2), moves="dissertation", robot=Robot(radius=0.6))
    field = solve_field(scene)
    assert not field.moves.corner_cutting
    np.testing.assert_array_equal(np.argwhere(~field.free), [[1, 3], [2, 2], [2, 3], [2, 4], [3, 3]])


def test_small_work_needs_neither_numba_nor_scipy() -> None:
    code = """
import sys
import numpy as np
from lampyris.planning.field.solve import solve
from lampyris.model.moves import MOVES
solve(np.ones((50, 50), dtype=bool), MOVES["octile"], (3, 3))
sys.exit(any(m in sys.modules for m in ("numba", "scipy", "matplotlib")))
"""
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.commit(1)
@pytest.mark.parametrize("name", ["four-connected", "dissertation", "sixteen-connected"])
def test_heads_and_windows_agree(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Step sets of a caller's own go through windows; on those that have heads both give the same bytes."""
    rng = np.random.default_rng(23)
    for k in range(60):
        free, goal = _draw(rng, 40)
        stop = (int(rng.integers(free.shape[1])), int(rng.integers(free.shape[0]))) if k % 2 else None
        by_heads = solve(free, MOVES[name], goal, stop=stop)
        monkeypatch.setattr(waves, "_BY_HEADS", set())
        by_windows = solve(free, MOVES[name], goal, stop=stop)
        monkeypatch.undo()
        for what in ("exact", "step", "luciferin"):
            np.testing.assert_array_equal(getattr(by_heads, what), getattr(by_windows, what))
