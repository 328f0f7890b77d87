"""AD-GSO: the walk against its reference, the three choices, gates, obstacles, and what a plan reports."""

from __future__ import annotations

import functools
import math
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from lampyris.errors import SceneError, SettingError
from lampyris.kernels.adgso import walk as window
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.plan import Plan, Status
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning.adgso import walk as ad_gso_walk
from lampyris.planning.adgso.ad_gso import AdGso
from lampyris.planning.base import Budget, Planner, Session
from lampyris.planning.field.solve import solve
from lampyris_selfcheck.reference.paths import adgso_walk as twin
from reference.kernel_forms import run_compiled


def scene_of(text: str, moves: str = "octile") -> Scene:
    """A scene drawn with ``#`` blocked, S start, G goal."""
    rows = text.split()
    at = {c: (row.index(c), y) for y, row in enumerate(rows) for c in "SG" if c in row}
    return Scene(Grid(np.array([[c == "#" for c in row] for row in rows])), at["S"], at["G"], moves)  # type: ignore[arg-type]


def open_(scene: Scene, seed: int = 0, *, record: bool = False, **settings: Any) -> Session:
    return AdGso(**settings).open(scene, np.random.default_rng(seed), record=record)


def cells(plan: Plan) -> list[tuple[int, int]]:
    assert plan.cells is not None, plan.sentence
    return [(int(x), int(y)) for x, y in plan.cells]


def random_case(
    seed: int, *, side: int = 16, most_blocked: float = 0.4
) -> tuple[Scene, frozenset[tuple[int, int]], Any]:
    """A random scene whose ends are free, some obstacles beside them, and the generator that made them."""
    rng = np.random.default_rng(seed)
    height, width = (int(v) for v in rng.integers(2, side, 2))
    blocked = rng.random((height, width)) < rng.random() * most_blocked
    free = np.argwhere(~blocked)
    if len(free) < 2:
        blocked[:] = False
        free = np.argwhere(~blocked)
    a, b = rng.choice(len(free), 2, replace=False)
    start, goal = (int(free[a][1]), int(free[a][0])), (int(free[b][1]), int(free[b][0]))
    moves = ("octile", "dissertation", "four-connected", "sixteen-connected")[seed % 4]
    near = np.argwhere(~blocked & (rng.random((height, width)) < rng.choice((0.0, 0.1, 0.3))))
    bodies = frozenset((int(x), int(y)) for y, x in near) - {start, goal}
    return Scene(Grid(blocked), start, goal, moves), bodies, rng  # type: ignore[arg-type]


# --- against the reference --------------------------------------------------------------------------------


@pytest.mark.commit(4)
@pytest.mark.parametrize("block", range(8))
def test_the_walk_equals_its_slow_twin(block: int) -> None:
    kinds = {"found": 0, "hemmed": 0, "inside": 0, "empty rings": 0}
    for seed in range(1000 + 60 * block, 1060 + 60 * block):
        scene, bodies, rng = random_case(seed)
        nt, mvr = int(rng.integers(1, 21)), int(rng.integers(1, 6))
        choice = ("greedy", "exact", "roulette")[seed % 3]
        session = open_(scene, seed, record=True, choice=choice, nt=nt, mvr=mvr)
        plan = session.plan(Change(obstacles=bodies))
        field = solve(~scene.grid.blocked, scene.moves, scene.goal)
        if plan.status is Status.NO_PATH:
            assert field.exact[scene.start[1], scene.start[0]] < 0
            continue
        draws = np.random.default_rng(seed).random(4000).tolist()
        judge = twin.twin_of(field, nt=nt, mvr=mvr, choice=choice, draws=draws)
        jumps = judge.walk(scene.start, set(bodies))
        if jumps is None:
            assert plan.status is Status.HEMMED_IN
            kinds["hemmed"] += 1
            continue
        assert plan.status is Status.FOUND
        assert plan.iterations == len(jumps)
        assert plan.commit == len(jumps[0].subpath) - 1
        kinds["found"] += 1
        for made, want in zip(plan.jumps, jumps, strict=True):
            assert made.at == want.at
            assert [c.cell for c in made.candidates] == want.accepted
            assert made.chosen == want.chosen
            assert list(made.subpath) == want.subpath
            assert made.by_parents == want.by_parents
            assert made.rings == want.rings
            kinds["empty rings"] += made.rings > max(c.ring for c in made.candidates)
            kinds["inside"] += not want.by_parents
    assert kinds["found"] > 30
    assert kinds["inside"] > 10
    assert kinds["empty rings"] > 10


def test_plain_and_compiled_forms_are_equal(monkeypatch: pytest.MonkeyPatch) -> None:
    both = {"plain": window.walk.run_plain, "compiled": partial(run_compiled, window.walk)}
    for seed in range(3000, 3060):
        scene, bodies, _ = random_case(seed)
        choice = ("greedy", "exact", "roulette")[seed % 3]
        got = []
        for form in both.values():
            monkeypatch.setattr(window, "walk", form)
            plan = open_(scene, seed, record=True, choice=choice).plan(Change(obstacles=bodies))
            got.append((plan.status, plan.jumps, plan.expansions, None if not plan else cells(plan)))
        assert got[0] == got[1]


# --- the three choices -------------------------------------------------------------------------------


@pytest.mark.nightly
def test_exact_is_optimal_and_greedy_arrives_wherever_a_path_exists() -> None:
    found = 0
    for seed in range(5000, 5200):
        scene, _, rng = random_case(seed, side=30)
        nt, mvr = int(rng.integers(1, 21)), int(rng.integers(1, 6))
        field = solve(~scene.grid.blocked, scene.moves, scene.goal)
        reachable = field.exact[scene.start[1], scene.start[0]] >= 0
        for choice in ("exact", "greedy", "roulette"):
            plan = open_(scene, seed, choice=choice, nt=nt, mvr=mvr).plan()
            assert bool(plan) == reachable
            if plan:
                assert plan.gap is not None
                assert plan.gap >= 0.0
                assert choice != "exact" or plan.gap == 0.0
                assert plan.iterations <= plan.path.cells.shape[0] - 1  # type: ignore[union-attr]
        found += reachable
    assert found > 100


@pytest.mark.nightly
def test_roulette_draws_by_the_probabilities() -> None:
    scene = scene_of("......\n......\nS....G\n......\n......")
    session = open_(scene, 7, record=True, choice="roulette", iter_max=1)
    share = {c.cell: c.probability for c in session.plan().jumps[0].candidates}
    assert len(share) > 5
    count = dict.fromkeys(share, 0)
    n = 6000
    for _ in range(n):
        plan = session.plan()
        assert plan.status is Status.ITERATION_LIMIT
        count[plan.jumps[0].chosen] += 1
    chi = sum((count[c] - n * p) ** 2 / (n * p) for c, p in share.items())
    dof = len(share) - 1
    assert chi < dof + 5 * (2 * dof) ** 0.5, (chi, dof)
    even = sum((count[c] - n / len(share)) ** 2 * len(share) / n for c in share)
    assert even > 10 * dof, "an even draw would pass too: this test could not fail"


def test_one_draw_a_jump_and_the_same_seed_the_same_plan() -> None:
    scene = Scene(Grid(np.zeros((40, 40), bool)), (0, 0), (39, 30))
    ways = {tuple(cells(open_(scene, seed, choice="roulette").plan())) for seed in range(6)}
    assert len(ways) > 1
    again = open_(scene, 3, choice="roulette")
    first, second = again.plan(), again.plan()
    assert cells(first) == cells(open_(scene, 3, choice="roulette").plan())
    used = np.random.default_rng(3)
    used.random(first.iterations)
    assert cells(second) == cells(AdGso(choice="roulette").open(scene, used).plan())
    quiet = np.random.default_rng(3)
    AdGso().open(scene, quiet).plan()
    assert quiet.random() == np.random.default_rng(3).random(), "greedy draws nothing"


def test_ties_go_to_the_least_row_then_the_least_column() -> None:
    # Straight above the goal two mirror cells share cost and luciferin; nt = 1 keeps the window at ring 1.
    blocked = np.ones((5, 5), bool)
    blocked[[0, 1, 1, 2, 2, 3], [2, 1, 3, 1, 3, 2]] = False
    scene = Scene(Grid(blocked), (2, 0), (2, 3), "dissertation")  # type: ignore[arg-type]
    assert cells(open_(scene, nt=1, mvr=1).plan()) == [(2, 0), (1, 1), (1, 2), (2, 3)]


# --- the record --------------------------------------------------------------------------------------


@pytest.mark.parametrize("choice", ["greedy", "roulette", "exact"])
def test_the_record_tells_what_was_driven(choice: str) -> None:
    for seed in range(7000, 7040):
        scene, bodies, _ = random_case(seed, side=24)
        change = Change(obstacles=bodies)
        silent = open_(scene, seed, choice=choice).plan(change)
        told = open_(scene, seed, choice=choice, record=True).plan(change)
        assert silent.jumps == ()
        assert told.status is silent.status
        assert told.expansions == silent.expansions
        if not told:
            continue
        assert cells(told) == cells(silent)
        assert len(told.jumps) == told.iterations
        joined = [told.jumps[0].at] if told.jumps else [scene.start]
        for jump in told.jumps:
            assert jump.subpath[0] == jump.at == joined[-1]
            assert jump.subpath[-1] == jump.chosen
            assert jump.chosen in {c.cell for c in jump.candidates}
            assert abs(sum(c.probability for c in jump.candidates) - 1.0) < 1e-9
            for c in jump.candidates:
                assert c.luciferin < jump.luciferin
                assert c.ring == max(abs(c.cell[0] - jump.at[0]), abs(c.cell[1] - jump.at[1]))
            joined += jump.subpath[1:]
        assert joined == cells(told)


# --- endings -----------------------------------------------------------------------------------------


def test_blocked_ends_are_answers_and_the_start_comes_first() -> None:
    grid = Grid(np.array([[True, False, True]]))
    for start, goal, want in [
        ((0, 0), (1, 0), Status.START_OCCUPIED),
        ((1, 0), (2, 0), Status.GOAL_OCCUPIED),
        ((0, 0), (2, 0), Status.START_OCCUPIED),
        ((0, 0), (0, 0), Status.START_OCCUPIED),
    ]:
        assert open_(Scene(grid, start, goal)).plan().status is want


def test_start_is_goal() -> None:
    plan = open_(Scene(Grid(np.zeros((3, 3), bool)), (1, 1), (1, 1))).plan()
    assert cells(plan) == [(1, 1)]
    assert (plan.iterations, plan.cost, plan.gap, plan.sum_cost_to_go) == (0, 0.0, 0.0, 0.0)


def test_no_path_says_why() -> None:
    plan = open_(scene_of("S#G\n.#.\n.#.")).plan()
    assert plan.status is Status.NO_PATH
    assert plan.sentence == "No path: walls separate (0, 0) from (2, 0)."
    assert plan.optimal_exact is None


def test_limits() -> None:
    scene = Scene(Grid(np.zeros((20, 20), bool)), (0, 0), (19, 19))
    assert open_(scene, iter_max=2).plan().status is Status.ITERATION_LIMIT
    whole = open_(scene).plan()
    assert open_(scene, iter_max=whole.iterations).plan().status is Status.FOUND
    assert open_(scene).plan(None, Budget(399)).status is Status.LIMIT  # the field alone takes 400
    assert open_(scene).plan(None, Budget(410)).status is Status.LIMIT  # and a window more than 10
    assert open_(scene).plan(None, Budget(whole.expansions)).status is Status.FOUND
    assert whole.expansions > 400


def test_long_walks_outgrow_the_first_room() -> None:
    # A corridor that winds through the whole map: far more cells than its sides suggest.
    blocked = np.zeros((81, 81), bool)
    blocked[1::4, :-1] = True
    blocked[3::4, 1:] = True
    scene = Scene(Grid(blocked), (0, 0), (80, 80))
    plan = open_(scene, record=True).plan()
    assert plan.path is not None
    assert len(plan.path.cells) > 3000
    assert plan.optimal_exact == plan.path.exact
    assert len(plan.jumps) == plan.iterations


def test_settings_are_checked() -> None:
    wrong: list[dict[str, Any]] = [
        {"choice": "best"},
        {"choice": 3},
        {"nt": 0},
        {"nt": 2.5},
        {"nt": True},
        {"mvr": 0},
        {"mvr": 51},
        {"rho": 0},
        {"rho": 1.1},
        {"rho": float("nan")},
        {"rho": "much"},
        {"gamma": 0.0},
        {"gamma": float("inf")},
        {"gates": "open"},
        {"iter_max": 0},
        {"iter_max": "auto"},
    ]
    for settings in wrong:
        with pytest.raises(SettingError, match=r"error\[[A-Z_]+\]: ad-gso: "):
            AdGso(**settings)
    assert isinstance(AdGso(), Planner)


def test_cells_outside_the_map_are_a_mistake_but_obstacles_there_are_not() -> None:
    session = open_(Scene(Grid(np.zeros((4, 4), bool)), (0, 0), (3, 3)))
    for change in (Change(robot=(4, 0)), Change(blocked=((0, -1),)), Change(freed=((9, 9),))):
        with pytest.raises(SceneError):
            session.plan(change)
    assert session.plan(Change(obstacles=frozenset({(-1, 0), (4, 4)})))


def test_sixteen_moves_see_their_parent_even_in_a_window_of_one() -> None:
    scene = Scene(Grid(np.zeros((12, 12), bool)), (0, 0), (11, 6), "sixteen-connected")  # type: ignore[arg-type]
    plan = open_(scene, record=True, nt=1, mvr=1, choice="exact").plan()
    assert plan.gap == 0.0
    assert max(c.ring for c in plan.jumps[0].candidates) == 2


def test_a_robot_with_a_radius_keeps_off_the_walls() -> None:
    blocked = np.zeros((12, 12), bool)
    blocked[5, 0:9] = True
    scene = Scene(Grid(blocked), (2, 2), (2, 9), "octile", Robot(radius=1.2))  # type: ignore[arg-type]
    plan = open_(scene).plan()
    for x, y in cells(plan):
        assert not blocked[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2].any()


# --- gates -------------------------------------------------------------------------------------------

TWO_WAYS = """
.....G...
.###.####
.........
..S......
"""
# The gate is (4, 1). The opening at the edge, (0, 1), is none: outside the map counts as not blocked.


def two_ways() -> Scene:
    return scene_of(TWO_WAYS)


def test_ignored_gates_are_driven_through() -> None:
    plan = open_(two_ways()).plan()
    assert (4, 1) in cells(plan)
    assert plan.gap == 0.0


def test_closed_gates_are_avoided_and_the_gap_tells_the_price() -> None:
    plan = open_(two_ways(), gates="close", choice="exact").plan()
    assert (4, 1) not in cells(plan)
    assert (0, 1) in cells(plan)
    assert plan.gates_met == ()
    assert plan.optimal_exact == open_(two_ways()).plan().optimal_exact
    assert plan.gap is not None
    assert plan.gap > 0.5


def test_replan_finds_the_gate_when_it_stands_before_it() -> None:
    plan = open_(two_ways(), gates="replan", record=True).plan()
    way = cells(plan)
    assert plan.gates_met == ((4, 1),)
    assert (4, 1) not in way
    assert (4, 2) in way  # it drove up to the gate, and back
    assert way[-1] == (5, 0)
    assert plan.iterations == len(plan.jumps)
    cut = [j for j in plan.jumps if j.subpath[-1] != j.chosen]
    assert len(cut) == 1
    assert plan.commit == len(next(j.subpath for j in plan.jumps if len(j.subpath) > 1)) - 1
    closed = open_(two_ways(), gates="close").plan()
    assert plan.path is not None
    assert closed.path is not None
    assert plan.path.exact > closed.path.exact


def test_a_discovered_gate_stays_sealed_only_once_the_robot_stood_there() -> None:
    session = open_(two_ways(), gates="replan")
    assert session.plan().gates_met == ((4, 1),)
    assert session.plan().gates_met == ((4, 1),), "the preview alone must not seal it for good"
    assert session.plan(Change(robot=(4, 2))).gates_met == ((4, 1),)
    later = session.plan(Change(robot=(2, 3)))
    assert later.gates_met == ()
    assert (4, 1) not in cells(later)


@pytest.mark.parametrize("gates", ["close", "replan"])
def test_no_way_but_through_a_gate(gates: str) -> None:
    scene = scene_of("....G....\n####.####\n....S....")
    assert open_(scene).plan()
    plan = open_(scene, gates=gates).plan()
    assert plan.status is Status.NO_PATH
    assert "gate" in plan.detail
    assert plan.gates_met == (() if gates == "close" else ((4, 1),))


@pytest.mark.parametrize("gates", ["close", "replan"])
def test_ends_that_are_gates_are_never_sealed(gates: str) -> None:
    scene = scene_of(".....\n##S##\n.....\n##G##\n.....")
    plan = open_(scene, gates=gates).plan()
    assert cells(plan) == [(2, 1), (2, 2), (2, 3)]


# --- moving obstacles --------------------------------------------------------------------------------

LOOP = """
.......
.#####.
S.....G
"""


def test_the_first_sub_path_respects_obstacles_and_corners() -> None:
    for seed in range(9000, 9200):
        scene, bodies, _ = random_case(seed, most_blocked=0.2)
        plan = open_(scene, seed).plan(Change(obstacles=bodies))
        if not plan:
            continue
        way = cells(plan)[: (plan.commit or 0) + 1]
        for (x0, y0), (x1, y1) in pairwise(way):
            assert (x1, y1) not in bodies
            if abs(x1 - x0) == abs(y1 - y0) == 1 and not MOVES[scene.moves.name].corner_cutting:
                assert (x0, y1) not in bodies
                assert (x1, y0) not in bodies


def test_hemmed_in_wait_repair_keep_release() -> None:
    scene = scene_of(LOOP, "four-connected")
    session = open_(scene)
    straight = cells(session.plan())
    assert straight == [(x, 2) for x in range(7)]
    seen = frozenset({(3, 2)})
    at = (2, 2)
    first = session.plan(Change(robot=at, obstacles=seen))
    assert first.status is Status.HEMMED_IN
    assert not first.detail
    second = session.plan(Change(robot=at, obstacles=seen))
    assert cells(second)[:4] == [(2, 2), (1, 2), (0, 2), (0, 1)]
    assert cells(second)[-1] == (6, 2)
    # On its way back it must not turn round at the next jump while the obstacle stands there.
    third = session.plan(Change(robot=(1, 2), obstacles=seen))
    assert cells(third)[1] == (0, 2)
    # The obstacle has gone: exactly the old way.
    assert cells(session.plan(Change(robot=(0, 2)))) == straight


def test_one_obstacle_leaves_another_stays_walled_in() -> None:
    scene = scene_of(LOOP, "four-connected")
    session = open_(scene)
    both = frozenset({(3, 2), (5, 2)})
    session.plan(Change(robot=(2, 2), obstacles=both))
    assert session.plan(Change(robot=(2, 2), obstacles=both))
    still = session.plan(Change(robot=(1, 2), obstacles=frozenset({(5, 2), (3, 0)})))
    assert cells(still)[1] == (0, 2), "(5, 2) is still walled in, so the lower way stays closed"


def test_hemmed_in_for_good_says_so_and_waits_for_a_gap() -> None:
    session = open_(scene_of("S....G"))
    wall = frozenset({(1, 0)})
    assert session.plan(Change(obstacles=wall)).status is Status.HEMMED_IN
    for _ in range(3):
        plan = session.plan(Change(obstacles=wall))
        assert plan.status is Status.HEMMED_IN
        assert "close every path" in plan.detail
    assert session.plan(Change()).status is Status.FOUND


def test_an_obstacle_on_the_goal_is_waited_for_beside_it() -> None:
    session = open_(scene_of("S....G"))
    on_goal = frozenset({(5, 0)})
    far = session.plan(Change(obstacles=on_goal))
    assert far  # from afar it is a preview: it will have moved
    assert (far.commit or 0) < 5
    for _ in range(2):
        near = session.plan(Change(robot=(4, 0), obstacles=on_goal))
        assert near.status is Status.HEMMED_IN
    assert "on the goal" in near.detail
    assert session.plan(Change(robot=(4, 0)))


def test_moving_on_forgets_the_waiting() -> None:
    session = open_(scene_of(LOOP, "four-connected"))
    seen = frozenset({(3, 2)})
    assert session.plan(Change(robot=(2, 2), obstacles=seen)).status is Status.HEMMED_IN
    assert session.plan(Change(robot=(1, 2)))
    assert session.plan(Change(robot=(2, 2), obstacles=seen)).status is Status.HEMMED_IN


def test_obstacles_cost_no_new_field() -> None:
    scene = Scene(Grid(np.zeros((20, 20), bool)), (0, 0), (19, 19))
    session = open_(scene)
    assert session.plan().expansions > 400
    again = session.plan(Change(obstacles=frozenset({(3, 3)})))
    assert again.expansions < 400
    assert (3, 3) not in cells(again)


def test_walls_found_and_taken_away_are_kept() -> None:
    session = open_(scene_of(LOOP, "four-connected"))
    assert (0, 1) in cells(session.plan(Change(blocked=((3, 2),))))
    assert (0, 1) in cells(session.plan())
    assert session.plan(Change(blocked=((3, 0),))).status is Status.NO_PATH
    assert cells(session.plan(Change(freed=((3, 2),)))) == [(x, 2) for x in range(7)]
    assert session.plan(Change(blocked=((0, 2),))).status is Status.START_OCCUPIED


def test_the_chances_are_the_same_numbers_in_every_python(monkeypatch: pytest.MonkeyPatch) -> None:
    """From 3.12 on ``sum`` of floats carries what rounding loses; a sum one after the other does not."""
    scene = Scene(Grid(np.zeros((40, 40), dtype=bool)), (1, 3), (37, 38), MOVES["sixteen-connected"])
    jumps = open_(scene, record=True, choice="roulette").plan().jumps
    monkeypatch.setattr(ad_gso_walk, "sum", math.fsum, raising=False)
    assert open_(scene, record=True, choice="roulette").plan().jumps == jumps
    sinks = [[jump.luciferin - c.luciferin for c in jump.candidates] for jump in jumps]
    carried = [math.fsum(each) for each in sinks]
    assert carried != [functools.reduce(float.__add__, each, 0.0) for each in sinks], "no case in point"
