"""The exact companions: kernel, step rules and session, against plain references and against each other."""

from __future__ import annotations

import pickle
from dataclasses import replace
from functools import partial
from itertools import product

import numpy as np
import pytest

from lampyris.errors import LimitError, SceneError
from lampyris.kernels.graph.search import EXHAUSTED, FOUND, LIMIT, SPAN, search
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES, PELL_Q
from lampyris.model.path import count_steps
from lampyris.model.plan import Plan, Status
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget, Planner, Session
from lampyris.planning.graph.astar import AStar
from lampyris.planning.graph.dijkstra import Dijkstra
from lampyris.planning.graph.grid_graph import GridSearch, following_of, metric_of, raises_of, rules_of
from lampyris.referee import check_path
from lampyris_selfcheck.reference.paths.search import cost_of, distances, verdict
from reference.kernel_forms import run_compiled

PLANNERS = [AStar(), Dijkstra()]
NAMES = sorted(MOVES)
RNG = np.random.default_rng(0)  # Never drawn from: these planners are deterministic.

CORRIDOR = [".....", ".###.", "...#.", "##.#."]


def grid_of(rows: list[str]) -> Grid:
    return Grid(np.array([[c == "#" for c in row] for row in rows]))


def session(planner: Planner, scene: Scene) -> Session:
    return planner.open(scene, RNG)


def random_free(rng: np.random.Generator, low: int = 3, high: int = 20) -> np.ndarray:
    height, width = rng.integers(low, high, size=2)
    return rng.random((height, width)) >= rng.choice([0.0, 0.1, 0.25, 0.4, 0.5])


# ---- step rules ------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_the_heuristic_is_the_exact_distance_on_an_open_plane(name: str) -> None:
    # Room on all sides of the measured corner, so that no cheapest way is cut off by the edge.
    known = distances([[True] * 16 for _ in range(16)], name, (2, 2))
    m0, n0, m1, n1 = metric_of(MOVES[name])
    for (x, y), counts in known.items():
        if 2 <= x < 14 and 2 <= y < 14:
            a, b = max(x - 2, y - 2), min(x - 2, y - 2)
            assert max(m0 * a + n0 * b, m1 * a + n1 * b) == MOVES[name].exact(counts)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("informed", [False, True])
def test_every_raise_of_f_has_its_own_queue(name: str, informed: bool) -> None:
    moves = MOVES[name]
    slope = metric_of(moves) if informed else (0, 0, 0, 0)
    everywhere = raises_of(moves, slope, around=20)
    assert raises_of(moves, slope) == everywhere, "a raise occurs only farther from the goal than was looked"
    assert everywhere[0] == 0, "a step that lowers f: the heuristic is not consistent"
    r = rules_of(moves, informed)
    assert [r.slot[e >> r.shift] for e in everywhere] == list(range(r.queues))


def test_octile_moves_need_six_queues_and_five_follow_ups() -> None:
    assert rules_of(MOVES["octile"], True).queues == 6
    assert [len(row) for row in following_of(MOVES["octile"])] == [5] * 8 + [8]
    assert [len(row) for row in following_of(MOVES["dissertation"])] == [5] * 4 + [3] * 4 + [8]


def test_step_costs_that_break_the_metric_are_searched_without_it() -> None:
    odd = replace(MOVES["octile"], name="odd", costs=(1,) * 4 + (10,) * 4, unit=10)
    assert not rules_of(odd, True).slope.any()
    free = np.ones((5, 5), dtype=bool)
    for informed in (False, True):
        answer = GridSearch(free, odd, informed=informed).find_path((0, 0), (4, 2))
        assert answer.cells is not None
        assert odd.exact(count_steps(answer.cells, odd)) == 4
    # A knight's step costlier than the straight and the diagonal it could replace must not replace them.
    dear = replace(
        MOVES["sixteen-connected"], name="dear", costs=(50,) * 8 + MOVES["sixteen-connected"].costs[8:]
    )
    for informed in (False, True):
        answer = GridSearch(free, dear, informed=informed).find_path((0, 0), (4, 2))
        assert answer.cells is not None
        assert dear.exact(count_steps(answer.cells, dear)) == 2 * 10 + 2 * 14


# ---- kernel ------------------------------------------------------------


@pytest.mark.commit(2)
@pytest.mark.parametrize("name", NAMES)
def test_random_grids_give_the_twins_verdict_and_exact_cost(name: str) -> None:
    rng = np.random.default_rng([7, NAMES.index(name)])
    words = set()
    for _ in range(60):
        free = random_free(rng)
        height, width = free.shape
        rows = free.tolist()
        goal = (int(rng.integers(width)), int(rng.integers(height)))
        known = distances(rows, name, goal)
        grid = Grid(~free)
        for _ in range(4):
            start = (int(rng.integers(width)), int(rng.integers(height)))
            scene = Scene(grid, start, goal, name)
            for planner in PLANNERS:
                plan = session(planner, scene).plan()
                assert plan.status == verdict(rows, start, known, goal)
                words.add(plan.status)
                if plan.path is not None:
                    assert cost_of(plan.path.steps, name) == cost_of(known[start], name)
                    assert check_path(plan.path, grid, scene.robot, scene.moves, start, goal) is None
                    assert plan.optimal_exact == plan.path.exact
    assert words == {"found", "no-path", "start-occupied", "goal-occupied"}


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("informed", [False, True])
def test_both_forms_of_the_kernel_write_the_same(
    name: str, informed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng([8, NAMES.index(name)])
    for _ in range(12):
        free = random_free(rng, 5, 40)
        height, width = free.shape
        free[0, 0] = free[height - 1, width - 1] = True
        answers = []
        for form in (search.run_plain, partial(run_compiled, search)):
            monkeypatch.setattr("lampyris.planning.graph.grid_graph.search", _Form(form))
            one = GridSearch(free, MOVES[name], informed=informed)
            for budget in (None, 7):
                a = one.find_path((0, 0), (width - 1, height - 1), budget)
                answers.append((a.ending, a.expansions, None if a.cells is None else a.cells.tolist()))
            answers.append(one.region((0, 0)).expansions)
        assert answers[:3] == answers[3:]


class _Form:
    """One form of the kernel in the kernel's place."""

    def __init__(self, call: object) -> None:
        self._call = call

    def __call__(self, *args: object) -> None:
        self._call(*args)  # type: ignore[operator]

    def compiled(self) -> None:
        """The session may ask for it; the form under test stays."""


def test_nothing_is_cleared_between_searches_yet_nothing_is_remembered() -> None:
    rng = np.random.default_rng(9)
    free = rng.random((12, 15)) >= 0.3
    kept = GridSearch(free, MOVES["octile"], informed=True)
    cells = [(int(x), int(y)) for y, x in np.argwhere(free)]
    for _ in range(40):
        start, goal = cells[rng.integers(len(cells))], cells[rng.integers(len(cells))]
        kept.region(start)
        again, new = (
            kept.find_path(start, goal),
            GridSearch(free, MOVES["octile"], informed=True).find_path(start, goal),
        )
        assert (again.ending, again.expansions) == (new.ending, new.expansions)
        assert np.array_equal(again.cells, new.cells) if new.cells is not None else again.cells is None


def test_the_base_starts_again_before_it_runs_out_of_bits() -> None:
    one = GridSearch(np.ones((6, 6), dtype=bool), MOVES["octile"], informed=True)
    first = one.find_path((0, 0), (5, 3))
    one._base = -(2**63) + 3 * SPAN
    bases = []
    for _ in range(4):
        again = one.find_path((0, 0), (5, 3))
        assert np.array_equal(first.cells, again.cells)
        assert again.expansions == first.expansions
        bases.append(one._base)
    assert bases == [-(2**63) + 2 * SPAN, -(2**63) + SPAN, -SPAN, -2 * SPAN]


def test_a_cell_is_expanded_once_and_a_heuristic_saves_some() -> None:
    rng = np.random.default_rng(10)
    saved = 0
    for name in NAMES:
        free = rng.random((30, 30)) >= 0.2
        free[0, 0] = free[29, 20] = True
        led, blind = (
            GridSearch(free, MOVES[name], informed=informed).find_path((0, 0), (20, 29))
            for informed in (True, False)
        )
        assert led.ending == blind.ending == FOUND
        assert led.expansions <= blind.expansions <= np.count_nonzero(free)
        saved += blind.expansions - led.expansions
    assert saved > 500


def test_a_straight_way_expands_only_itself() -> None:
    one = GridSearch(np.ones((9, 40), dtype=bool), MOVES["octile"], informed=True)
    assert one.find_path((2, 4), (35, 4)).expansions == 33
    # All cells of the parallelogram between these two have the same f; the newest first is the deepest first.
    assert one.find_path((2, 1), (35, 8)).expansions == 33


def test_endings_of_the_kernel() -> None:
    free = np.array([[True, True, False, True]])
    one = GridSearch(free, MOVES["four-connected"], informed=True)
    assert one.find_path((0, 0), (1, 0)).ending == FOUND
    assert one.find_path((0, 0), (3, 0)).ending == EXHAUSTED
    assert one.find_path((0, 0), (3, 0), 1).ending == LIMIT
    assert one.region((0, 0)).expansions == 2
    assert one.region((3, 0)).expansions == 1


def test_closed_cells_are_open_again_afterwards_even_if_named_twice() -> None:
    one = GridSearch(np.ones((1, 3), dtype=bool), MOVES["four-connected"], informed=True)
    assert one.find_path((0, 0), (2, 0), closed=[(1, 0), (1, 0)]).ending == EXHAUSTED
    assert one.find_path((0, 0), (2, 0)).ending == FOUND


def test_a_map_too_large_for_exact_costs_is_refused() -> None:
    class Huge(np.ndarray):  # type: ignore[type-arg]
        """A small array that says it is large: the refusal must come before any memory is asked for."""

        size = 2**24 + 1

    with pytest.raises(LimitError, match="LIMIT"):
        GridSearch(np.ones((2, 2), dtype=bool).view(Huge), MOVES["octile"], informed=True)
    dear = replace(MOVES["octile"], costs=tuple(c * 100 for c in MOVES["octile"].costs), unit=100 * PELL_Q)
    with pytest.raises(LimitError, match="steps of"):
        GridSearch(np.ones((2, 2), dtype=bool), dear, informed=True)


# ---- session ------------------------------------------------------------


@pytest.mark.parametrize("planner", PLANNERS, ids=lambda p: p.name)
def test_planners_are_values(planner: Planner) -> None:
    assert isinstance(planner, Planner)
    assert planner == type(planner)() == pickle.loads(pickle.dumps(planner))
    assert planner.traits.optimal
    assert not planner.traits.stochastic


@pytest.mark.parametrize("planner", PLANNERS, ids=lambda p: p.name)
def test_a_plan_says_what_it_did(planner: Planner) -> None:
    grid = grid_of(CORRIDOR)
    plan = session(planner, Scene(grid, (0, 2), (4, 3))).plan()
    assert plan.status is Status.FOUND
    assert plan.planner == planner.name
    assert plan.cells.tolist()[0] == [0, 2]
    assert plan.cells.tolist()[-1] == [4, 3]
    assert plan.steps == (9, 0)
    assert (plan.iterations, plan.commit, plan.gap) == (1, None, 0.0)
    assert plan.expansions >= 9
    assert set(plan.timing) == {"search_s"}
    assert plan.path.cells.flags.writeable is False


@pytest.mark.parametrize("planner", PLANNERS, ids=lambda p: p.name)
def test_ends_that_are_not_free_are_statuses_and_the_start_is_looked_at_first(planner: Planner) -> None:
    grid = grid_of(["#.#", "..."])
    cases = [((0, 0), (2, 0), "start-occupied"), ((0, 0), (1, 1), "start-occupied")]
    cases += [((1, 1), (2, 0), "goal-occupied"), ((0, 0), (0, 0), "start-occupied")]
    for start, goal, word in cases:
        plan = session(planner, Scene(grid, start, goal)).plan()
        assert (plan.status, plan.path, plan.expansions) == (word, None, 0)


@pytest.mark.parametrize("planner", PLANNERS, ids=lambda p: p.name)
def test_start_equals_goal_is_one_cell_at_no_cost(planner: Planner) -> None:
    for name, cell in product(NAMES, [(0, 0), (2, 1)]):
        plan = session(planner, Scene(grid_of(["...", "..."]), cell, cell, name)).plan()
        assert plan.cells.tolist() == [list(cell)]
        assert (plan.cost, plan.expansions, plan.gap, plan.optimal_exact) == (0.0, 0, 0.0, 0)


@pytest.mark.parametrize("planner", PLANNERS, ids=lambda p: p.name)
def test_no_path_tells_the_sizes_of_both_regions(planner: Planner) -> None:
    plan = session(
        planner, Scene(grid_of(["...#.", "..#..", ".####"]), (0, 0), (4, 0), "four-connected")
    ).plan()
    assert plan.status is Status.NO_PATH
    assert "start region 6 cells, goal region 3 cells" in plan.sentence
    assert plan.expansions == 9


@pytest.mark.parametrize("planner", PLANNERS, ids=lambda p: p.name)
def test_the_budget_counts_every_expansion_of_a_call(planner: Planner) -> None:
    scene = Scene(grid_of(CORRIDOR), (0, 2), (4, 3))
    needed = session(planner, scene).plan().expansions
    assert session(planner, scene).plan(None, Budget(needed)).status is Status.FOUND
    short = session(planner, scene).plan(None, Budget(needed - 1))
    assert (short.status, short.expansions) == (Status.LIMIT, needed - 1)

    shut = Scene(grid_of(["...#..."]), (0, 0), (6, 0), "four-connected")
    for budget, word, sizes in [
        (2, "limit", None),
        (3, "no-path", "goal region over 0"),
        (5, "no-path", "goal region over 2"),
        (6, "no-path", "goal region 3 cells"),
    ]:
        plan = session(planner, shut).plan(None, Budget(budget))
        assert plan.status == word
        assert plan.expansions == min(budget, 6)
        assert sizes is None or sizes in plan.sentence

    # Three with the obstacle, six more to see that walls are not to blame.
    crowded = Scene(grid_of(["......."]), (0, 0), (6, 0), "four-connected")
    change = Change(obstacles=frozenset({(3, 0)}))
    for budget, word, spent in [(2, "limit", 2), (8, "limit", 8), (9, "hemmed-in", 9), (90, "hemmed-in", 9)]:
        plan = session(planner, crowded).plan(change, Budget(budget))
        assert (plan.status, plan.expansions) == (word, spent)


@pytest.mark.parametrize("planner", PLANNERS, ids=lambda p: p.name)
def test_obstacles_count_for_one_call(planner: Planner) -> None:
    one = session(planner, Scene(grid_of(["...", "...", "..."]), (0, 1), (2, 1)))
    assert one.plan().steps == (2, 0)
    around = one.plan(Change(obstacles=frozenset({(1, 1)})))
    assert around.steps == (4, 0)
    assert around.optimal_exact is None
    assert [1, 1] not in around.cells.tolist()
    assert one.plan().steps == (2, 0)
    wall = frozenset({(1, 0), (1, 1), (1, 2)})
    shut = one.plan(Change(obstacles=wall))
    assert shut.status is Status.HEMMED_IN
    assert "moving obstacles close it" in shut.sentence
    assert one.plan(Change(obstacles=wall - {(1, 2)})).status is Status.FOUND


@pytest.mark.parametrize("planner", PLANNERS, ids=lambda p: p.name)
def test_obstacles_on_robot_goal_walls_or_outside_change_nothing(planner: Planner) -> None:
    one = session(planner, Scene(grid_of(["...", ".#.", "..."]), (0, 1), (2, 1)))
    plan = one.plan(Change(obstacles=frozenset({(0, 1), (2, 1), (1, 1), (-1, 0), (3, 9)})))
    assert plan.steps == (4, 0)
    walled = session(planner, Scene(grid_of([".#."]), (0, 0), (2, 0)))
    assert walled.plan(Change(obstacles=frozenset({(1, 0), (2, 0)}))).status is Status.NO_PATH
    assert walled.plan(Change(freed=((1, 0),))).status is Status.FOUND, (
        "an obstacle on a wall must not open it"
    )


@pytest.mark.parametrize("planner", PLANNERS, ids=lambda p: p.name)
def test_walls_and_the_robots_place_stay_until_told_otherwise(planner: Planner) -> None:
    scene = Scene(grid_of(["....", ".##.", "...."]), (0, 0), (3, 0))
    one = session(planner, scene)
    assert one.plan(Change(blocked=((2, 0),))).steps == (7, 0)
    assert one.plan().steps == (7, 0)
    assert one.plan(Change(robot=(0, 2))).steps == (5, 0)
    assert one.plan().cells.tolist()[0] == [0, 2]
    assert one.plan(Change(blocked=((0, 1),), robot=(0, 0))).status is Status.NO_PATH
    assert one.plan(Change(freed=((2, 0), (0, 1)))).steps == (3, 0)
    assert one.plan(Change(blocked=((1, 0),), freed=((1, 0),))).steps == (7, 0), "a cell in both is blocked"
    assert one.plan(Change(blocked=((0, 0),))).status is Status.START_OCCUPIED
    assert one.plan(Change(freed=((0, 0),), blocked=((3, 0),))).status is Status.GOAL_OCCUPIED
    assert not scene.grid.blocked[0, 1], "the scene itself is never touched"


@pytest.mark.parametrize("planner", PLANNERS, ids=lambda p: p.name)
@pytest.mark.parametrize(
    "change",
    [Change(robot=(3, 0)), Change(robot=(-1, 0)), Change(blocked=((0, 1),)), Change(freed=((0, -1),))],
)
def test_a_change_outside_the_map_is_a_mistake(planner: Planner, change: Change) -> None:
    with pytest.raises(SceneError, match="CHANGE_OUTSIDE"):
        session(planner, Scene(grid_of(["..."]), (0, 0), (2, 0))).plan(change)


@pytest.mark.parametrize("planner", PLANNERS, ids=lambda p: p.name)
@pytest.mark.parametrize("name", NAMES)
def test_a_wide_robot_keeps_its_distance_before_and_after_an_edit(planner: Planner, name: str) -> None:
    grid = Grid(np.zeros((9, 9), dtype=bool))
    one = session(planner, Scene(grid, (0, 4), (8, 4), name, Robot(radius=1.2)))
    assert one.plan().steps[0] == 8
    walls = np.zeros((9, 9), dtype=bool)
    walls[4, 4] = True
    plan: Plan = one.plan(Change(blocked=((4, 4),)))
    assert plan.path is not None
    assert check_path(plan.path, Grid(walls), Robot(radius=1.2), MOVES[name], (0, 4), (8, 4)) is None
    assert int(plan.cells[:, 1].min()) == 2 or int(plan.cells[:, 1].max()) == 6
    assert one.plan(Change(robot=(3, 4))).status is Status.START_OCCUPIED
