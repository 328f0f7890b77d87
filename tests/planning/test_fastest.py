"""The planner that picks the search by the map: what it picks, and that the field's ways are as cheap."""

from __future__ import annotations

import numpy as np
import pytest
from query_checks import NAMES, RNG, ask_at_random

from lampyris.kernels.graph.search import EXHAUSTED, FOUND, LIMIT
from lampyris.model.change import Change
from lampyris.model.grid import Grid, frozen
from lampyris.model.moves import MOVES
from lampyris.model.path import count_steps
from lampyris.model.scene import Scene
from lampyris.planning.graph.fastest import Fastest
from lampyris.planning.graph.fastest_search import FieldSearch, stops, suited
from lampyris.planning.graph.grid_graph import GridSearch
from lampyris.planning.graph.jps_search import JumpSearch, PackedMap
from lampyris.planning.graph.terrain_graph import TerrainSearch
from lampyris.testing import check_planner
from reference.kernel_forms import use

EIGHT = ("octile", "dissertation")


def comb(size: int) -> np.ndarray:
    """Corridors one cell wide: along every second row, joined at alternating ends."""
    free = np.zeros((size, size), dtype=bool)
    free[1::2, 1:-1] = True
    free[2:-1:4, -2] = True
    free[4:-1:4, 1] = True
    free[1::2, 3::4] = True  # Side by side with dead ends, so that runs have somewhere to stop.
    free[2:-1:2, 3::4] |= np.arange(2, size - 1, 2)[:, None] % 8 == 2
    return free


def noise(size: int, share: float, seed: int = 0) -> np.ndarray:
    return np.random.default_rng([size, seed]).random((size, size)) >= share


def free_cell(rng: np.random.Generator, free: np.ndarray) -> tuple[int, int]:
    y, x = np.argwhere(free)[rng.integers(np.count_nonzero(free))]
    return int(x), int(y)


@pytest.mark.nightly
def test_the_contract() -> None:
    check_planner(Fastest(), cases=4)


@pytest.mark.commit(1)
@pytest.mark.parametrize("name", NAMES)
def test_random_queries(name: str) -> None:
    assert ask_at_random([Fastest()], name, 81, 300)["found"] > 80


def test_what_it_picks() -> None:
    terrain = np.full((64, 64), 5, np.uint8)
    for free, octile, dissertation in (
        (noise(64, 0.0), JumpSearch, JumpSearch),
        (noise(64, 0.02), JumpSearch, JumpSearch),
        (noise(64, 0.3), JumpSearch, GridSearch),
        (noise(200, 0.4), FieldSearch, GridSearch),
        (noise(200, 0.5), JumpSearch, FieldSearch),
        (comb(31), JumpSearch, FieldSearch),
        (np.zeros((9, 9), dtype=bool), JumpSearch, JumpSearch),
    ):
        assert type(suited(free, None, MOVES["octile"])) is octile
        assert type(suited(free, None, MOVES["dissertation"])) is dissertation
        assert type(suited(free, None, MOVES["four-connected"])) is GridSearch
        assert type(suited(free, None, MOVES["sixteen-connected"])) is GridSearch
    assert type(suited(noise(64, 0.0), terrain, MOVES["octile"].weighed())) is TerrainSearch


def test_stops_are_counted() -> None:
    for shape in ((1, 1), (7, 64), (64, 7), (20, 130)):
        for share in (0.0, 0.3, 0.9):
            free = np.random.default_rng(82).random(shape) >= share
            packed = PackedMap(free, False)
            count = 0
            for lines in packed.sheets:
                bits = [np.unpackbits(words.astype("<u8").view(np.uint8), axis=1) for words in lines]
                walls, onward, backward = (b[1:-1].astype(bool) for b in bits)
                count += np.count_nonzero((onward | backward) & ~walls)
            assert stops(packed) == count


@pytest.mark.nightly
@pytest.mark.parametrize("name", EIGHT)
def test_ways_read_off_the_field_are_as_cheap_as_any(name: str) -> None:
    rng = np.random.default_rng([83, EIGHT.index(name)])
    moves = MOVES[name]
    endings = {FOUND: 0, EXHAUSTED: 0}
    for free in (comb(31), noise(30, 0.42, 1), noise(40, 0.3, 2), noise(12, 0.0, 3)):
        one = FieldSearch(free, moves, JumpSearch(free, moves))
        plain = GridSearch(free, moves, informed=True)
        for k in range(12):
            start, goal = free_cell(rng, free), free_cell(rng, free)
            closed = [c for c in (free_cell(rng, free) for _ in range(4 * (k % 3))) if c not in (start, goal)]
            mine, theirs = (
                one.find_path(start, goal, closed=closed),
                plain.find_path(start, goal, closed=closed),
            )
            assert mine.ending == theirs.ending
            endings[mine.ending] += 1
            if mine.cells is not None and theirs.cells is not None:
                assert moves.exact(count_steps(mine.cells, moves)) == moves.exact(
                    count_steps(theirs.cells, moves)
                )
                assert mine.cells[0].tolist() == list(start)
                assert mine.cells[-1].tolist() == list(goal)
    assert endings[FOUND] > 20
    assert endings[EXHAUSTED] > 3


def test_a_small_budget_is_kept() -> None:
    free = frozen(comb(31))
    one = FieldSearch(free, MOVES["octile"], JumpSearch(free, MOVES["octile"]))
    whole = one.find_path((1, 1), (1, 29))
    assert whole.ending == FOUND
    cells = int(np.count_nonzero(free))
    assert one.find_path((1, 1), (1, 29), cells).expansions == whole.expansions
    short = one.find_path((1, 1), (1, 29), 5)
    assert (short.ending, short.expansions) == (LIMIT, 5)


def test_edits_reach_the_field() -> None:
    free = noise(60, 0.4)
    free[0, 0] = free[0, 1] = free[1, 0] = True
    goal = (1, 0)
    session = Fastest().open(Scene(Grid(~free), (0, 0), goal), RNG)
    assert type(session._search) is FieldSearch
    assert session.plan().steps == (1, 0)
    assert session.plan(Change(blocked=((1, 0),))).status == "goal-occupied"
    assert session.plan(Change(freed=((1, 0), (1, 1)))).steps == (1, 0)
    grown = session.plan(Change(terrain=(((1, 0), 63),)))
    assert type(session._search) is TerrainSearch
    assert grown.cost == 2.0
    assert session.plan(Change(terrain=(((1, 0), 0),))).cost == 1.0


@pytest.mark.nightly
def test_both_forms_write_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    answers: dict[str, list[object]] = {"plain": [], "compiled": []}
    for form in answers:
        with monkeypatch.context() as patch:
            use(patch, form)
            for name in EIGHT:
                free = comb(25)
                one = FieldSearch(free, MOVES[name], JumpSearch(free, MOVES[name]))
                for goal in ((1, 1), (1, 23), (23, 9)):
                    answer = one.find_path((5, 5), goal)
                    assert answer.cells is not None
                    answers[form].append((answer.expansions, answer.cells.tolist()))
    assert answers["plain"] == answers["compiled"]
