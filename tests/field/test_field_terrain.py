"""The field over terrain: against a plain reference, against SciPy, and what holds of every such field."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from lampyris.errors import LimitError, SettingError
from lampyris.kernels.field import weighted_wavefront
from lampyris.model.change import Change
from lampyris.model.field import Field
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES, PELL_P, PELL_Q, Moves
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning.edits import edited
from lampyris.planning.field import solve as solve_module
from lampyris.planning.field import waves
from lampyris.planning.field.frame import BorderedMap
from lampyris.planning.field.layers import moves_for, moves_on
from lampyris.planning.field.solve import solve, solve_field
from lampyris_selfcheck.reference.paths import field as field_twin
from lampyris_selfcheck.reference.paths import terrain as terrain_twin
from reference.kernel_forms import use

Cell = tuple[int, int]


def draw(rng: np.random.Generator, largest: int) -> tuple[np.ndarray, np.ndarray, Cell]:
    """Free cells up to half blocked, terrain of one of five kinds, and a goal that may be blocked."""
    height, width = rng.integers(1, largest + 1, 2)
    free = rng.random((height, width)) >= 0.5 * rng.random()
    shape = (height, width)
    terrain = (
        lambda: np.zeros(shape),
        lambda: rng.integers(0, 253, shape),
        lambda: rng.integers(0, 253, shape) * (rng.random(shape) < 0.1),
        lambda: 252 * (rng.random(shape) < 0.5),
        lambda: rng.integers(0, 4, shape),
    )[rng.integers(5)]()
    return free, terrain.astype(np.uint8), (int(rng.integers(width)), int(rng.integers(height)))


def exact_of(moves: Moves, cost: field_twin.Surd) -> int:
    """A cost of the reference in the integers of weighed moves."""
    n, m = 63 * cost.n, 63 * cost.m
    if moves.name == "octile":
        assert n.denominator == m.denominator == 1
        return int(n) * PELL_Q + int(m) * PELL_P
    whole = n * (moves.unit // 63)
    assert whole.denominator == 1
    return int(whole)


def agree(field: Field, free: np.ndarray, terrain: np.ndarray, rule: str | None = None) -> None:
    moves, name = field.moves, field.moves.name
    cost, parent = terrain_twin.field(free.tolist(), terrain.tolist(), name, field.goal, rule)
    luciferin = field_twin.luciferin(cost, parent, name, field.rho, field.gamma)
    exact = np.full(free.shape, -1, dtype=np.int64)
    step = np.full(free.shape, -1)
    glow = np.full(free.shape, np.inf)
    for x, y in cost:
        exact[y, x] = exact_of(moves, cost[x, y])
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
    rng = np.random.default_rng([31, sorted(MOVES).index(name)])
    for largest in [14] * 30 + [40] * 2:
        free, terrain, goal = draw(rng, largest)
        agree(solve(free, MOVES[name].weighed(), goal, terrain=terrain), free, terrain)


@pytest.mark.nightly
@pytest.mark.parametrize("name", MOVES)
def test_against_the_twin_on_many_maps(name: str) -> None:
    rng = np.random.default_rng([32, sorted(MOVES).index(name)])
    for _ in range(400):
        free, terrain, goal = draw(rng, 40)
        agree(solve(free, MOVES[name].weighed(), goal, terrain=terrain), free, terrain)


@pytest.mark.parametrize("name", ["dissertation", "octile"])
def test_the_corner_rule_is_the_moves_own(name: str) -> None:
    rng = np.random.default_rng(33)
    cutting = not MOVES[name].corner_cutting
    for _ in range(25):
        free, terrain, goal = draw(rng, 12)
        moves = replace(MOVES[name].weighed(), corner_cutting=cutting)
        agree(solve(free, moves, goal, terrain=terrain), free, terrain, "cut" if cutting else "guard")


@pytest.mark.commit(1)
@pytest.mark.parametrize("name", MOVES)
def test_3x3_grids_with_two_kinds_of_ground(name: str) -> None:
    """A seeded sample of all 3^9 maps of walls, plain ground and ground twice to five times as dear."""
    rng = np.random.default_rng([34, sorted(MOVES).index(name)])
    every = list(product((0, 1, 2), repeat=9))
    for k in rng.choice(len(every), 250, replace=False):
        cells = np.array(every[k]).reshape(3, 3)
        free = cells > 0
        terrain = ((cells == 2) * rng.choice([1, 26, 63, 252])).astype(np.uint8)
        goal = (int(rng.integers(3)), int(rng.integers(3)))
        agree(solve(free, MOVES[name].weighed(), goal, terrain=terrain), free, terrain)


@pytest.mark.parametrize("name", MOVES)
def test_stop(name: str) -> None:
    """With ``stop`` the field is the full one up to the cost of that cell, and holds nothing beyond."""
    rng = np.random.default_rng(35)
    moves = MOVES[name].weighed()
    stopped_early = 0
    for _ in range(60):
        free, terrain, goal = draw(rng, 25)
        stop = (int(rng.integers(free.shape[1])), int(rng.integers(free.shape[0])))
        full = solve(free, moves, goal, terrain=terrain)
        part = solve(free, moves, goal, terrain=terrain, stop=stop)
        limit = full.exact[stop[1], stop[0]]
        kept = full.exact >= 0 if limit < 0 else (full.exact >= 0) & (full.exact <= limit)
        np.testing.assert_array_equal(part.exact, np.where(kept, full.exact, -1))
        np.testing.assert_array_equal(part.step, np.where(kept, full.step, -1))
        np.testing.assert_array_equal(part.luciferin, np.where(kept, full.luciferin, np.inf))
        assert part.expansions == kept.sum()
        stopped_early += part.expansions < full.expansions
    assert stopped_early > 20


@pytest.mark.parametrize("name", MOVES)
@pytest.mark.parametrize("value", [0, 1, 63, 252])
def test_the_same_ground_everywhere_is_plain_ground_times_its_weight(name: str, value: int) -> None:
    rng = np.random.default_rng(36)
    for _ in range(12):
        free, terrain, goal = draw(rng, 25)
        plain = solve(free, MOVES[name], goal)
        even = solve(free, MOVES[name].weighed(), goal, terrain=np.full_like(terrain, value))
        costs = np.asarray(plain.exact, dtype=np.int64)
        np.testing.assert_array_equal(even.exact, np.where(costs < 0, -1, costs * (63 + value)))
        np.testing.assert_array_equal(even.step, plain.step)
        np.testing.assert_allclose(even.luciferin, plain.luciferin * ((63 + value) / 63), rtol=1e-12)


@pytest.mark.parametrize("name", MOVES)
def test_dearer_ground_never_helps(name: str) -> None:
    rng = np.random.default_rng(37)
    for _ in range(25):
        free, terrain, goal = draw(rng, 25)
        more = np.minimum(terrain + rng.integers(0, 90, free.shape) * (rng.random(free.shape) < 0.3), 252)
        before = solve(free, MOVES[name].weighed(), goal, terrain=terrain).exact
        after = solve(free, MOVES[name].weighed(), goal, terrain=more.astype(np.uint8)).exact
        assert ((after < 0) == (before < 0)).all()
        assert (after >= before).all()


def test_the_goal_is_paid_for_and_the_start_is_not() -> None:
    field = solve(
        np.ones((1, 3), bool),
        MOVES["four-connected"].weighed(),
        (2, 0),
        terrain=np.array([[9, 5, 2]], np.uint8),
    )
    assert field.exact.tolist() == [[(63 + 5) + (63 + 2), 63 + 2, 0]]
    assert field.cost.tolist() == [[133 / 63, 65 / 63, 0.0]]


def test_terrain_under_walls_is_not_looked_at() -> None:
    rng = np.random.default_rng(39)
    free, terrain, goal = draw(rng, 30)
    for name in MOVES:
        one = solve(free, MOVES[name].weighed(), goal, terrain=terrain)
        other = solve(
            free, MOVES[name].weighed(), goal, terrain=np.where(free, terrain, 251).astype(np.uint8)
        )
        np.testing.assert_array_equal(one.exact, other.exact)
        np.testing.assert_array_equal(one.step, other.step)


@pytest.mark.parametrize("name", ["dissertation", "octile"])
def test_against_scipy(name: str) -> None:
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import dijkstra

    rng = np.random.default_rng(40)
    size = 60
    free = rng.random((size, size)) >= 0.25
    free[30, 30] = True
    terrain = rng.integers(0, 253, (size, size)).astype(np.uint8)
    moves = MOVES[name].weighed()
    rows, cols, costs = [], [], []
    for (x, y), ((dx, dy), cost) in product(
        product(range(size), repeat=2), zip(moves.offsets, moves.costs, strict=True)
    ):
        if field_twin.free_at(free, x, y) and field_twin.legal(name, free, x, y, dx, dy):
            rows.append((y + dy) * size + x + dx)  # from the goal outwards: every step turned round
            cols.append(y * size + x)
            costs.append(moves.value(cost) * (63 + float(terrain[y + dy, x + dx])) / 63)
    graph = csr_matrix((costs, (rows, cols)), shape=(size * size,) * 2)
    far = dijkstra(graph, indices=30 * size + 30).reshape(size, size)
    field = solve(free, moves, (30, 30), terrain=terrain)
    far[~free] = np.inf
    np.testing.assert_allclose(field.cost, far, rtol=1e-12)
    assert field.expansions > 2000


def test_any_step_set_of_positive_costs_is_served() -> None:
    """One that the plain wavefronts refuse: three prices, far apart, and up is not down."""
    odd = Moves("odd", ((1, 0), (-1, 0), (0, -1), (0, 1)), (7, 7, 5, 14), 7, False).weighed()
    rng = np.random.default_rng(41)
    for _ in range(10):
        free, terrain, goal = draw(rng, 10)
        field = solve(free, odd, goal, terrain=terrain)
        best = {goal: 0} if free[goal[1], goal[0]] else {}
        changed = True
        while changed:
            changed = False
            for (x, y), ((dx, dy), cost) in product(list(best), zip(odd.offsets, odd.costs, strict=True)):
                a, b = x - dx, y - dy
                paid = best[x, y] + cost // 63 * (63 + int(terrain[y, x]))
                if field_twin.free_at(free, a, b) and paid < best.get((a, b), 10**9):
                    best[a, b] = paid
                    changed = True
        assert {(int(x), int(y)): int(field.exact[y, x]) for y, x in np.argwhere(field.exact >= 0)} == best


def test_costs_that_outgrow_32_bits_are_found_again_in_64(monkeypatch: pytest.MonkeyPatch) -> None:
    """A frame made narrow by force: the kernel notices before a cost is wrong, and the answer is the same."""
    rng = np.random.default_rng(42)
    room = 0

    class Tight(BorderedMap):
        def __init__(self, free: np.ndarray, moves: Moves, **words: bool) -> None:
            super().__init__(free, moves, **words)
            if self.dtype is np.int32:
                self.never = room

    for name in ("dissertation", "four-connected", "sixteen-connected"):
        free, terrain = rng.random((40, 40)) >= 0.1, rng.integers(0, 253, (40, 40)).astype(np.uint8)
        free[0, 0] = True
        moves = MOVES[name].weighed()
        whole = solve(free, moves, (0, 0), terrain=terrain)
        assert whole.exact.dtype == np.int32
        most = int(whole.exact.max())
        for share in (0.1, 0.5, 0.9, 0.99, 1.0, 1.5):
            room = int(share * most)
            with monkeypatch.context() as patch:
                patch.setattr(solve_module, "BorderedMap", Tight)
                again = solve(free, moves, (0, 0), terrain=terrain)
            assert again.exact.dtype == (np.int64 if share <= 1 else np.int32)
            np.testing.assert_array_equal(whole.exact, again.exact)
            np.testing.assert_array_equal(whole.step, again.step)


def test_bad_terrain() -> None:
    free, good = np.ones((2, 3), bool), np.zeros((2, 3), np.uint8)
    moves = MOVES["octile"].weighed()
    for bad in (good[:1], good.astype(np.int64), good.astype(np.float32)):
        with pytest.raises(SettingError, match="GRID_SHAPE"):
            solve(free, moves, (0, 0), terrain=bad)  # type: ignore[arg-type]
    with pytest.raises(SettingError, match=r"GRID_TERRAIN.*253 at \(2, 1\)"):
        solve(free, moves, (0, 0), terrain=good + np.array([[0] * 3, [0, 0, 253]], np.uint8))
    with pytest.raises(SettingError, match="MOVES"):
        solve(free, MOVES["octile"], (0, 0), terrain=good)
    for costs in ((63, 63 * 3), (-63, 63), (0, 63)):
        with pytest.raises(SettingError, match="MOVES"):
            solve(free, Moves("far", ((-1, 0), (1, 0)), costs, 63, False, 63), (0, 0), terrain=good)
    with pytest.raises(LimitError, match="LIMIT"):
        solve(free, Moves("huge", ((-1, 0),), (63 * 2**55,), 63 * 2**55, False, 63), (0, 0), terrain=good)


def test_moves_are_weighed_exactly_where_there_is_terrain() -> None:
    plain = Grid(np.zeros((3, 4), bool))
    rough = replace(plain, terrain=np.full((3, 4), 7))
    for moves in MOVES.values():
        for radius in (0.0, 0.7):
            for given in (moves, moves.weighed()):
                scene = Scene(plain, (0, 0), (3, 2), given, Robot(radius=radius))
                assert moves_for(scene) == moves_for(replace(scene, moves=moves))
                assert moves_for(scene).scale == 1
                over = moves_for(replace(scene, grid=rough))
                assert over == moves_for(scene).weighed()
        assert moves_on(plain, moves) is moves
        assert moves_on(rough, moves) == moves.weighed()


@pytest.mark.parametrize("name", MOVES)
def test_a_scene_with_terrain(name: str) -> None:
    rng = np.random.default_rng(44)
    grid = Grid(rng.random((12, 15)) < 0.2, terrain=rng.integers(0, 253, (12, 15)))
    blocked = grid.blocked.copy()
    blocked[3, 4] = False
    grid = replace(grid, blocked=blocked)
    assert grid.terrain is not None
    agree(solve_field(Scene(grid, (0, 0), (4, 3), name)), ~grid.blocked, grid.terrain)
    wide = solve_field(Scene(grid, (0, 0), (4, 3), name, Robot(radius=0.8)))
    if name != "sixteen-connected":  # without its knight's steps it is no step set that the reference knows
        agree(wide, np.asarray(wide.free), grid.terrain, None if name == "four-connected" else "guard")


def test_a_change_of_terrain_is_solved_as_the_new_map() -> None:
    rng = np.random.default_rng(45)
    for name in MOVES:
        for start in (None, rng.integers(0, 253, (9, 11))):
            walls = rng.random((9, 11)) < 0.2
            walls[4, 5] = False
            scene = Scene(Grid(walls, terrain=start), (0, 0), (5, 4), name)
            cells = [(int(k) % 11, int(k) // 11) for k in rng.integers(0, 99, 20)]
            values = rng.integers(0, 253, 20).tolist()
            changed = edited(scene, Change(terrain=tuple(zip(cells, values, strict=True))))
            ground = np.zeros((9, 11), int) if start is None else start.copy()
            for (x, y), value in zip(cells, values, strict=True):
                ground[y, x] = value
            free, terrain = ~walls, ground.astype(np.uint8)
            agree(solve_field(changed), free, terrain)
    flat = edited(changed, Change(terrain=tuple(((x, y), 0) for x in range(11) for y in range(9))))
    assert flat.grid.terrain is None
    assert moves_for(flat).scale == 1


def test_no_bucket_is_wider_than_the_least_step() -> None:
    """The ring must hold the dearest departure, or it would land in a bucket that is being emptied."""
    seen = []
    real = weighted_wavefront.any_steps

    class Spy:
        def __call__(self, *args: object) -> object:
            *_, price, _, _, shift, mask, _ = args
            seen.append((list(price), shift, mask))  # type: ignore[call-overload]
            return real(*args)

    for costs in ((63, 63), (63, 2 * 63), (127 * 63, 380 * 63), (63 * 5, 63 * 4)):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(weighted_wavefront, "any_steps", Spy())
            solve(
                np.ones((1, 40), bool),
                Moves("two", ((-1, 0), (1, 0)), costs, costs[0], False, 63),
                (20, 0),
                terrain=np.full((1, 40), 252, np.uint8),
            )
    for price, shift, mask in seen:
        assert 1 << shift <= 63 * price[0]
        assert (315 * price[-1] >> shift) + 2 <= mask + 1
    assert len(seen) == 4


@pytest.mark.commit(1)
@pytest.mark.parametrize("name", MOVES)
def test_unrolled_loops_and_the_table_of_steps_agree(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Step sets of a caller's own go by a table; on ours both give the same bytes."""
    rng = np.random.default_rng(29)
    moves = MOVES[name].weighed()
    for k in range(40):
        free, terrain, goal = draw(rng, 30)
        stop = (int(rng.integers(free.shape[1])), int(rng.integers(free.shape[0]))) if k % 2 else None
        unrolled = solve(free, moves, goal, terrain=terrain, stop=stop)
        monkeypatch.setattr(waves, "_UNROLLED", set())
        by_table = solve(free, moves, goal, terrain=terrain, stop=stop)
        monkeypatch.undo()
        for what in ("exact", "step", "luciferin"):
            np.testing.assert_array_equal(getattr(unrolled, what), getattr(by_table, what))
