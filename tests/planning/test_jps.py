"""Jump point search: exact on every kind of map, its bits packed and repaired, both forms of its kernels."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from query_checks import NAMES, RNG, ask_at_random, turned, turned_cell

from lampyris.kernels._jit import highest, lowest
from lampyris.kernels.graph.bits import ahead, back, bit
from lampyris.kernels.graph.jps import EXHAUSTED, FOUND, LIMIT
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES, Moves
from lampyris.model.path import count_steps
from lampyris.model.plan import Status
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget
from lampyris.planning.graph import jps_search
from lampyris.planning.graph.astar import AStar
from lampyris.planning.graph.bidirectional_astar import BidirectionalAStar
from lampyris.planning.graph.grid_graph import GridSearch, SearchResult
from lampyris.planning.graph.jps import JumpPointSearch
from lampyris.planning.graph.jps_search import JumpSearch, PackedMap, can_jump, jump_search
from lampyris.planning.graph.session import GraphSession
from lampyris.referee import check_plan
from lampyris.testing import check_planner
from reference.kernel_forms import use
from sizes import sized

EIGHT = ("octile", "dissertation")
EXACT = [JumpPointSearch(), BidirectionalAStar()]


def told(answer: SearchResult) -> tuple[object, ...]:
    return answer.ending, answer.expansions, None if answer.cells is None else answer.cells.tolist()


def cost(answer: SearchResult, moves: Moves) -> int | None:
    return None if answer.cells is None else moves.exact(count_steps(answer.cells, moves))


def free_cell(rng: np.random.Generator, free: np.ndarray) -> tuple[int, int]:
    y, x = np.argwhere(free)[rng.integers(np.count_nonzero(free))]
    return int(x), int(y)


# ---- the planners ------------------------------------------------------------------------------


@pytest.mark.nightly
@sized("cases", 2, 6)
@pytest.mark.parametrize("planner", EXACT, ids=lambda p: p.name)
def test_the_contract(planner: JumpPointSearch | BidirectionalAStar, cases: int) -> None:
    check_planner(planner, cases=cases)


@pytest.mark.commit(1)
@sized("cases", 150, 500)
@pytest.mark.parametrize("name", NAMES)
def test_two_thousand_random_queries(name: str, cases: int) -> None:
    words = ask_at_random(EXACT, name, 41, cases)
    assert words.total() == cases
    assert words["found"] > 0.3 * cases
    assert len(words) == 4


def test_where_the_rules_hold() -> None:
    assert [
        can_jump(MOVES[name]) for name in ("octile", "dissertation", "four-connected", "sixteen-connected")
    ] == [
        True,
        True,
        False,
        False,
    ]
    octile = MOVES["octile"]
    assert not can_jump(octile.weighed())
    for costs in ((10,) * 4 + (10,) * 4, (20,) * 4 + (10,) * 4, (14, 14, 14, 15) + (10,) * 4):
        assert not can_jump(replace(octile, name="odd", costs=costs, unit=10)), costs
    assert can_jump(replace(octile, name="odd", costs=(19,) * 4 + (10,) * 4, unit=10))
    free = np.ones((4, 4), dtype=bool)
    assert isinstance(jump_search(free, None, octile), JumpSearch)
    assert isinstance(jump_search(free, None, MOVES["four-connected"]), GridSearch)


def test_odd_prices_are_exact_too() -> None:
    rng = np.random.default_rng(43)
    for cutting in (False, True):
        for straight, diagonal in ((10, 11), (10, 19), (1000, 1999), (5, 7)):
            moves = replace(
                MOVES["octile"],
                name="odd",
                costs=(diagonal,) * 4 + (straight,) * 4,
                unit=straight,
                corner_cutting=cutting,
            )
            for _ in range(15):
                free = rng.random((12, 15)) >= 0.3
                jumps, plain = JumpSearch(free, moves), GridSearch(free, moves, informed=True)
                for _ in range(5):
                    ends = free_cell(rng, free), free_cell(rng, free)
                    assert cost(jumps.find_path(*ends), moves) == cost(plain.find_path(*ends), moves)


def test_turned_and_mirrored_maps_cost_the_same() -> None:
    rng = np.random.default_rng(44)
    found = 0
    for name in EIGHT:
        for _ in range(12):
            free = rng.random(rng.integers(5, 80, 2)) >= rng.choice([0.1, 0.3])
            start, goal = free_cell(rng, free), free_cell(rng, free)
            costs = set()
            for k in range(8):
                ends = (turned_cell(end, free.shape, k) for end in (start, goal))
                costs.add(cost(JumpSearch(turned(free, k), MOVES[name]).find_path(*ends), MOVES[name]))
            assert len(costs) == 1
            found += None not in costs
    assert found > 15


@pytest.mark.commit(1)
@pytest.mark.parametrize("name", EIGHT)
def test_lengths_around_whole_words(name: str) -> None:
    """Widths and heights at which the border, or the last cell, is the first or last bit of a word."""
    rng = np.random.default_rng([45, EIGHT.index(name)])
    moves = MOVES[name]
    found = 0
    for width in (1, 2, 61, 62, 63, 64, 65, 126, 127, 128, 129):
        for height in (1, 2, 5, 62, 63, 64, 65):
            for crowd in (0.0, 0.03, 0.3):
                for free in ((a := rng.random((height, width)) >= crowd), a.T.copy()):
                    if not free.any():
                        continue
                    jumps, plain = JumpSearch(free, moves), GridSearch(free, moves, informed=True)
                    corner = tuple(int(v) for v in np.argwhere(free)[-1][::-1])
                    for ends in ((free_cell(rng, free), corner), (corner, free_cell(rng, free))):
                        mine = jumps.find_path(*ends)
                        assert cost(mine, moves) == cost(plain.find_path(*ends), moves), (free.shape, ends)
                        found += mine.cells is not None
    assert found > 600


def test_a_robot_with_a_size_and_edits_of_its_map() -> None:
    rng = np.random.default_rng(46)
    for name in EIGHT:
        for _ in range(6):
            walls = rng.random((30, 40)) < 0.03
            scene = Scene(
                Grid(walls), (0, 0), (39, 29), name, Robot(radius=float(rng.choice([0.0, 0.8, 1.6])))
            )
            sessions = [p.open(scene, RNG) for p in (*EXACT, AStar())]
            for _ in range(8):
                cells = [
                    (int(rng.integers(40)), int(rng.integers(30))) for _ in range(int(rng.integers(1, 4)))
                ]
                change = Change(blocked=tuple(cells)) if rng.random() < 0.6 else Change(freed=tuple(cells))
                for x, y in cells:
                    walls[y, x] = bool(change.blocked)
                plans = [s.plan(change) for s in sessions]
                assert len({(p.status, None if p.path is None else p.path.exact) for p in plans}) == 1
                for plan in plans:
                    assert check_plan(plan, replace(scene, grid=Grid(walls))) is None


@pytest.mark.parametrize("planner", EXACT, ids=lambda p: p.name)
def test_terrain_comes_changes_and_goes(planner: JumpPointSearch | BidirectionalAStar) -> None:
    rng = np.random.default_rng(47)
    for name in NAMES:
        blocked = rng.random((9, 12)) < 0.15
        blocked[0, 0] = blocked[8, 11] = False
        scene = Scene(Grid(blocked), (0, 0), (11, 8), name)
        session = planner.open(scene, RNG)
        ground = np.zeros(blocked.shape, int)
        for k in range(6):
            cells = [(int(c) % 12, int(c) // 12) for c in rng.integers(0, 108, 30)]
            if k == 5:
                cells = [(x, y) for y in range(9) for x in range(12)]
            values = [0 if k == 5 else int(v) for v in rng.integers(0, 253, len(cells))]
            for (x, y), value in zip(cells, values, strict=True):
                ground[y, x] = value
            plan = session.plan(Change(terrain=tuple(zip(cells, values, strict=True))))
            now = replace(scene, grid=Grid(blocked, terrain=ground))
            best = AStar().open(now, RNG).plan()
            assert plan.status == best.status
            assert check_plan(plan, now) is None
            if plan.path is not None and best.path is not None:
                assert plan.path.exact == best.path.exact == plan.optimal_exact


def test_a_plan_tells_packing_apart_and_packs_once() -> None:
    free = np.ones((60, 60), dtype=bool)
    scene = Scene(Grid(~free), (0, 0), (59, 20))
    session = JumpPointSearch().open(scene, RNG)
    plans = [session.plan(), session.plan(), session.plan(Change(blocked=((30, 30),)))]
    assert [set(p.timing) for p in plans] == [{"pack_s", "search_s"}] * 3
    assert [p.timing["pack_s"] > 0 for p in plans] == [True, False, True]
    assert set(JumpPointSearch().open(replace(scene, moves=MOVES["four-connected"]), RNG).plan().timing) == {
        "search_s"
    }


def test_jump_points_are_far_fewer_than_cells() -> None:
    free = np.ones((40, 90), dtype=bool)
    free[5:, 45] = False
    scene = Scene(Grid(~free), (0, 39), (89, 39))
    jumps, plain = (p.open(scene, RNG).plan() for p in (JumpPointSearch(), AStar()))
    assert jumps.cost == plain.cost
    assert jumps.expansions < 10 < 500 < plain.expansions


def test_no_way_is_told_in_cells_and_within_the_budget() -> None:
    rows = ["...#.", "..#..", ".####"]
    grid = Grid(np.array([[c == "#" for c in row] for row in rows]))
    for planner in EXACT:
        session = planner.open(Scene(grid, (0, 0), (4, 0)), RNG)
        plan = session.plan()
        assert plan.status is Status.NO_PATH
        assert "start region 6 cells, goal region 3 cells" in plan.sentence
        assert session.plan(None, Budget(plan.expansions)).status is Status.NO_PATH
        assert session.plan(None, Budget(1)).status is Status.LIMIT


def test_budgets_and_ends() -> None:
    rng = np.random.default_rng(48)
    free = rng.random((40, 40)) >= 0.25
    free[0, 0] = free[39, 39] = True
    one = JumpSearch(free, MOVES["octile"])
    whole = one.find_path((0, 0), (39, 39))
    assert whole.ending == FOUND
    assert whole.expansions > 10
    for budget in (1, whole.expansions - 1, whole.expansions, whole.expansions + 1):
        answer = one.find_path((0, 0), (39, 39), budget)
        assert answer.ending == (FOUND if budget >= whole.expansions else LIMIT)
        assert answer.expansions == min(budget, whole.expansions)
    here = one.find_path((0, 0), (0, 0))
    assert told(here) == (FOUND, 0, [[0, 0]])


# ---- bits --------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", ["plain", "compiled"])
def test_the_next_bit_and_the_one_before(form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    use(monkeypatch, form)
    rng = np.random.default_rng(49)
    for crowd in (0.5, 0.05, 0.005):
        bits = rng.random(64 * 12) < crowd
        bits[0] = bits[-1] = True
        words = np.packbits(bits, bitorder="little").view("<u8").astype(np.uint64)
        at = np.flatnonzero(bits).tolist()
        for k in (*range(1, 70), *rng.integers(1, len(bits) - 1, 60).tolist(), len(bits) - 2):
            assert bit(words, k) == bits[k]
            assert k + ahead(words, k) == min(v for v in at if v > k)
            assert k - back(words, k) == max(v for v in at if v < k)
    assert [lowest(1 << k) for k in (0, 1, 63)] == [highest((1 << k) | 1) for k in (0, 1, 63)]


def runs(free: np.ndarray, cutting: bool) -> list[np.ndarray]:
    """Where runs to the east, west, south and north have to stop, from the definition."""
    height, width = free.shape

    def shut(x: int, y: int) -> bool:
        return not (0 <= x < width and 0 <= y < height and free[y, x])

    found = []
    for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        stop = np.zeros(free.shape, dtype=bool)
        for y in range(height):
            for x in range(width):
                stop[y, x] = shut(x, y)
                for side in (1, -1):
                    sx, sy = (x, y + side) if dx else (x + side, y)
                    behind = shut(sx, sy) if cutting else shut(sx - dx, sy - dy)
                    onward = shut(sx + dx, sy + dy) if cutting else shut(sx, sy)
                    stop[y, x] |= behind and not onward
        found.append(stop)
    return found


def unpacked(packed: PackedMap, shape: tuple[int, int]) -> list[np.ndarray]:
    height, width = shape
    lines = []
    for at, line, across in (
        (packed.east, packed.stride, False),
        (packed.west, packed.stride, False),
        (packed.south, packed.rise, True),
        (packed.north, packed.rise, True),
    ):
        rows = (width if across else height) + 2
        words = packed.words[at // 64 : (at + rows * line) // 64]
        bits = np.unpackbits(words.astype("<u8").view(np.uint8), bitorder="little").reshape(rows, line)
        inner = bits[1:-1, 1 : (height if across else width) + 1].astype(bool)
        lines.append(inner.T if across else inner)
    return lines


@pytest.mark.commit(1)
@pytest.mark.parametrize("cutting", [False, True])
def test_stops_are_where_the_definition_says_packed_or_repaired(cutting: bool) -> None:
    rng = np.random.default_rng([50, cutting])
    for shape in ((1, 1), (1, 64), (3, 62), (62, 3), (9, 63), (5, 65), (11, 130)):
        free = rng.random(shape) >= 0.3
        packed = PackedMap(free, cutting)
        for _ in range(6):
            for mine, twin in zip(unpacked(packed, shape), runs(free, cutting), strict=True):
                assert np.array_equal(mine, twin)
            # Some in one and the same word, and on the edge.
            some = rng.random(shape) < 5 / free.size
            some[[0, -1], [0, -1]] = True
            free ^= some
            y, x = np.nonzero(some)
            packed.edit(x, y)


@sized("steps", 12, 2500)
@pytest.mark.parametrize("name", ["octile", "dissertation"])
def test_a_session_after_edits_answers_as_one_opened_anew(name: str, steps: int) -> None:
    """Random edits of 1 to 100 cells between queries; the bits are those of a map packed anew."""
    rng = np.random.default_rng([52, name == "octile"])
    walls = rng.random((40, 70)) < 0.25
    walls[0, 0] = walls[-1, -1] = False
    scene = Scene(Grid(walls), (0, 0), (69, 39), name)
    session = JumpPointSearch().open(scene, rng)
    session.plan()
    assert isinstance(session, GraphSession)
    for step in range(steps):
        many = int(rng.integers(1, 101))
        cells = {
            (int(x), int(y))
            for x, y in zip(rng.integers(0, 70, many), rng.integers(0, 40, many), strict=True)
        }
        cells -= {(0, 0), (69, 39)}
        blocked = frozenset(c for c in cells if rng.random() < 0.25)
        walls = walls.copy()
        for x, y in cells:
            walls[y, x] = (x, y) in blocked
        change = Change(blocked=tuple(sorted(blocked)), freed=tuple(sorted(cells - blocked)))
        start = (0, 0) if step % 2 else (69, 39)
        mine = session.plan(replace(change, robot=start))
        anew = JumpPointSearch().open(replace(scene, grid=Grid(walls), start=start), rng).plan()
        assert mine == anew
        packed = session.search.packed  # type: ignore[attr-defined]
        fresh = PackedMap(~walls, name == "dissertation")
        for repaired, whole in zip(unpacked(packed, walls.shape), unpacked(fresh, walls.shape), strict=True):
            assert np.array_equal(repaired, whole)
        assert np.array_equal(packed.sheets[0][0], fresh.sheets[0][0])
        assert np.array_equal(packed.sheets[1][0], fresh.sheets[1][0])


def test_many_changes_are_packed_anew_and_few_are_repaired(monkeypatch: pytest.MonkeyPatch) -> None:
    free = np.ones((20, 30), dtype=bool)
    one = JumpSearch(free, MOVES["octile"])
    packed = one.packed
    other = free.copy()
    other[3, 3:9] = False
    assert one.take(other, None)
    assert one.packed is packed
    assert one.take(np.zeros_like(free), None)
    assert one.packed is not packed
    assert not one.take(free, np.ones(free.shape, np.uint8))


def test_closed_cells_are_open_again_afterwards() -> None:
    rng = np.random.default_rng(51)
    for name in EIGHT:
        free = rng.random((20, 70)) >= 0.2
        start, goal = free_cell(rng, free), free_cell(rng, free)
        one = JumpSearch(free, MOVES[name])
        words = one.packed.words.copy()
        first = one.find_path(start, goal)
        closed = [free_cell(rng, free) for _ in range(12)]
        closed = [c for c in [*closed, *closed[:3], (0, 0), (69, 19)] if c not in (start, goal)]
        shut = free.copy()
        for x, y in closed:
            shut[y, x] = False
        mine = one.find_path(start, goal, closed=closed)
        assert cost(mine, MOVES[name]) == cost(
            JumpSearch(shut, MOVES[name]).find_path(start, goal), MOVES[name]
        )
        assert np.array_equal(one.packed.words[20:-20], words[20:-20])
        assert told(one.find_path(start, goal)) == told(first)


# ---- the search --------------------------------------------------------------------------------


@pytest.mark.parametrize("name", EIGHT)
def test_both_forms_write_the_same(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    answers: dict[str, list[object]] = {"plain": [], "compiled": []}
    for form in answers:
        rng = np.random.default_rng([52, EIGHT.index(name)])
        with monkeypatch.context() as patch:
            use(patch, form)
            for _ in range(12):
                free = rng.random(rng.integers(3, 75, 2)) >= rng.choice([0.05, 0.3, 0.45])
                one = JumpSearch(free, MOVES[name])
                for budget in (None, 9):
                    answers[form].append(
                        told(one.find_path(free_cell(rng, free), free_cell(rng, free), budget))
                    )
    assert answers["plain"] == answers["compiled"]


def test_nothing_is_cleared_between_searches_yet_nothing_is_remembered() -> None:
    rng = np.random.default_rng(53)
    free = rng.random((30, 40)) >= 0.3
    kept = JumpSearch(free, MOVES["octile"])
    kept._node.fill(0)  # Every cell says that it is node 0, and must not be believed.
    endings: Counter[int] = Counter()
    for _ in range(40):
        ends = free_cell(rng, free), free_cell(rng, free)
        again = kept.find_path(*ends)
        assert told(again) == told(JumpSearch(free, MOVES["octile"]).find_path(*ends))
        endings[again.ending] += 1
    assert endings[FOUND] > 10
    assert endings[EXHAUSTED] > 0


def test_room_for_jump_points_grows(monkeypatch: pytest.MonkeyPatch) -> None:
    free = np.random.default_rng(54).random((60, 60)) >= 0.25
    free[0, 0] = free[59, 59] = True
    roomy = JumpSearch(free, MOVES["octile"]).find_path((0, 0), (59, 59))
    assert roomy.ending == FOUND
    monkeypatch.setattr(jps_search, "FIRST_NODES", -470)
    tight = JumpSearch(free, MOVES["octile"])
    assert len(tight._nodes) == 6 * 10
    assert told(tight.find_path((0, 0), (59, 59))) == told(roomy)
    assert len(tight._nodes) > 6 * 100
