"""The dissertation's baselines: closed forms on empty maps, gates, and a sum the referee works out again."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from lampyris.errors import SettingError, UsageError
from lampyris.io.maps.library import load
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget
from lampyris.planning.swarm.dstar_lpso import Dstar16Lpso, DstarLpso
from lampyris.planning.swarm.step_session import StepPlanner, fan_of
from lampyris.referee import check_plan, sum_cost_to_go
from lampyris.testing import check_planner
from planning.swarm_scenes import NAMES, random_scene, scene_of
from sizes import some

BOTH: list[type[StepPlanner]] = [DstarLpso, Dstar16Lpso]

GATED = [
    "S....#....",
    ".....#....",
    "..........",
    ".....#....",
    ".....#....",
    ".....#....",
    ".....#....",
    "..........",
    "..........",
    "G.........",
]
ONE_WAY = ["S..#..", "......", "...#.G"]


def planned(planner: StepPlanner, scene: Scene, seed: int = 0) -> Plan:
    return planner.open(scene, np.random.default_rng(seed)).plan()


@pytest.mark.nightly
@pytest.mark.parametrize(
    "planner",
    some(
        [
            DstarLpso(particles=3, rounds=2, gates="close"),
            Dstar16Lpso(particles=5, rounds=2, gates="replan"),
            DstarLpso(rounds=1),
            Dstar16Lpso(rounds=1),
        ],
        2,
    ),
)
def test_the_contract(planner: StepPlanner) -> None:
    check_planner(planner, cases=3)


@pytest.mark.nightly
@pytest.mark.parametrize("kind", BOTH)
def test_the_contract_at_full_size(kind: type[StepPlanner]) -> None:
    check_planner(kind(), cases=10)


def closed_form(name: str, dx: int, dy: int) -> float:
    """Sum of cost-to-go over a way that takes its diagonals first, then its straights."""
    a, b = max(dx, dy), min(dx, dy)
    if name == "four-connected":
        return (a + b) * (a + b + 1) / 2
    s, d = 1.0, MOVES[name].diagonal / MOVES[name].straight
    return b * (a - b) * s + d * b * (b + 1) / 2 + s * (a - b) * (a - b + 1) / 2


@pytest.mark.commit(1)
@pytest.mark.parametrize("name", ["dissertation", "octile", "four-connected"])
def test_on_an_empty_map_the_sum_of_cost_to_go_has_a_closed_form(name: str) -> None:
    rng = np.random.default_rng(4)
    grid = Grid(np.zeros((20, 30), dtype=bool))
    for seed in range(25):
        start, goal = ((int(rng.integers(30)), int(rng.integers(20))) for _ in range(2))
        if start == goal:
            continue
        dx, dy = abs(start[0] - goal[0]), abs(start[1] - goal[1])
        scene = Scene(grid, start, goal, name)
        plan = planned(DstarLpso(), scene, seed)
        assert plan.sum_cost_to_go == pytest.approx(closed_form(name, dx, dy), rel=1e-12)
        assert plan.path is not None
        assert sum_cost_to_go(plan.path, scene) == pytest.approx(plan.sum_cost_to_go, rel=1e-12)
        assert plan.gap == 0.0
        assert plan.iterations == len(plan.path.cells) - 1
        two = planned(Dstar16Lpso(), scene, seed)
        assert two.path is not None
        assert two.gap == 0.0
        assert two.iterations >= (len(two.path.cells)) // 2
        if name != "four-connected":
            assert two.iterations == (max(dx, dy) + 1) // 2


def test_the_dissertations_environment_6_in_kind() -> None:
    # Table 4.11: (48, 49) to (1, 49) is printed as 1131 and 578; without obstacles it is 1128 and 576.
    scene = Scene(Grid(np.zeros((50, 50), dtype=bool)), (48, 49), (1, 49), "dissertation")
    mixed, improved = planned(DstarLpso(), scene), planned(Dstar16Lpso(), scene)
    assert mixed.sum_cost_to_go == 1128
    assert mixed.iterations == 47
    assert improved.path is not None
    assert improved.iterations == 24
    assert sum_cost_to_go(improved.path, scene, every=2) == 576


@pytest.mark.parametrize(
    ("start", "goal", "mixed", "improved"),
    [((48, 49), (1, 49), 1132.0, 578.4), ((0, 49), (0, 3), 1081.0, 552.0)],
)
def test_the_bundled_environment_6(
    start: tuple[int, int], goal: tuple[int, int], mixed: float, improved: float
) -> None:
    # Its obstacles are few: the dissertation prints 1131 and 578, and 1082.2 and 554, for its own lost map.
    scene = Scene(load("env-6").grid, start, goal, "dissertation")
    for planner, every, expected in ((DstarLpso(), 1, mixed), (Dstar16Lpso(), 2, improved)):
        path = planned(planner, scene).path
        assert path is not None
        assert sum_cost_to_go(path, scene, every=every) == pytest.approx(expected, rel=1e-12)


@pytest.mark.nightly
def test_every_move_is_nearer_to_the_goal_and_the_referee_finds_the_same_sum() -> None:
    found = 0
    for case in range(80):
        scene = random_scene(case)
        for planner in (
            DstarLpso(rounds=1, gates="ignore"),
            DstarLpso(particles=2, rounds=1),
            Dstar16Lpso(rounds=1),
            Dstar16Lpso(particles=3, gates="replan"),
        ):
            plan = planned(planner, scene, case)
            assert check_plan(plan, scene) is None
            if plan.path is None:
                assert plan.status in (Status.NO_PATH, Status.START_OCCUPIED, Status.GOAL_OCCUPIED)
                continue
            found += 1
            assert plan.sum_cost_to_go == pytest.approx(sum_cost_to_go(plan.path, scene), rel=1e-12, abs=1e-9)
            steps = len(plan.path.cells) - 1
            assert steps <= plan.iterations * planner.reach
            assert plan.iterations <= steps + len(plan.gates_met)
            if planner.gates == "ignore":
                to_go = [
                    sum_cost_to_go(type(plan.path)(plan.path.cells[k : k + 1], plan.path.moves, ()), scene)
                    for k in range(steps + 1)
                ]
                assert all(a > b for a, b in pairwise(to_go))
    assert found > 150


def test_gates_are_met_closed_or_ignored() -> None:
    scene = scene_of(GATED)
    # The goal is where the gate at (5, 2) does not help; one beyond it does.
    scene = Scene(scene.grid, (0, 2), (9, 2), "dissertation")
    ignoring = planned(DstarLpso(gates="ignore"), scene)
    assert ignoring.gap == 0.0
    assert [5, 2] in ignoring.cells.tolist()  # type: ignore[union-attr]
    closing = planned(DstarLpso(gates="close"), scene)
    meeting = planned(DstarLpso(), scene)
    for plan in (closing, meeting):
        assert plan.path is not None
        assert [5, 2] not in plan.path.cells.tolist()
        assert plan.gap is not None
        assert plan.gap > 0
    assert closing.gates_met == ()
    assert meeting.gates_met == ((5, 2),)
    # It ran up to the gate, and the iteration that met it moved nobody.
    assert [4, 2] in meeting.cells.tolist()  # type: ignore[union-attr]
    assert meeting.iterations == len(meeting.path.cells)  # type: ignore[union-attr]
    assert closing.iterations < meeting.iterations


def test_where_every_way_leads_through_a_gate_it_is_passed_and_said() -> None:
    scene = scene_of(ONE_WAY)
    for planner in (DstarLpso(), Dstar16Lpso(), DstarLpso(gates="close"), Dstar16Lpso(gates="replan")):
        plan = planned(planner, scene)
        assert plan.status is Status.FOUND
        assert [3, 1] in plan.cells.tolist()  # type: ignore[union-attr]
        assert "gate" in plan.sentence
    assert "gate" not in planned(DstarLpso(gates="ignore"), scene).sentence


def test_a_gate_stays_closed_once_the_robot_stood_before_it_until_it_is_freed() -> None:
    scene = Scene(scene_of(GATED).grid, (0, 2), (9, 2), "dissertation")
    session = DstarLpso().open(scene, np.random.default_rng(0))
    assert session.plan().gates_met == ((5, 2),)
    assert session.plan(Change(robot=(3, 2))).gates_met == ((5, 2),), "a preview must not close it for good"
    assert session.plan(Change(robot=(4, 2))).gates_met == ((5, 2),)
    again = session.plan(Change(robot=(3, 2)))
    assert again.gates_met == ()
    assert [5, 2] not in again.cells.tolist()  # type: ignore[union-attr]
    freed = session.plan(Change(freed=((5, 2),)))
    assert [5, 2] in freed.cells.tolist()  # type: ignore[union-attr]


def test_the_first_move_is_the_commitment() -> None:
    scene = scene_of(["S........G", ".........."])
    assert planned(DstarLpso(), scene).commit == 1
    assert planned(Dstar16Lpso(), scene).commit == 2
    short = scene_of(["SG"])
    assert planned(Dstar16Lpso(), short).commit == 1


def test_obstacles_and_budgets() -> None:
    scene = scene_of(["S....", "..#..", "....G"], "four-connected")
    for kind in BOTH:
        session = kind().open(scene, np.random.default_rng(0))
        assert session.plan(Change(obstacles=frozenset({(2, 0), (2, 2)}))).status is Status.HEMMED_IN
        around = session.plan(Change(obstacles=frozenset({(2, 0)})))
        assert around.path is not None
        assert [2, 0] not in around.path.cells.tolist()
        spent = session.plan().expansions
        assert session.plan(None, Budget(spent)).status is Status.FOUND
        assert session.plan(None, Budget(spent - 1)).status is Status.LIMIT


@pytest.mark.nightly
def test_few_particles_lose_their_way_a_little_and_many_do_not() -> None:
    gaps = {2: 0.0, 8: 0.0}
    for case in range(40):
        scene = random_scene(4 * case + 1, low=12)
        for particles in gaps:
            plan = planned(DstarLpso(particles=particles, rounds=2, obstacles=0.0, gates="ignore"), scene)
            gaps[particles] += plan.gap or 0.0
    assert gaps[2] > gaps[8]


@pytest.mark.parametrize("name", NAMES)
def test_fans_hold_the_ring_in_compass_order(name: str) -> None:
    one, two = fan_of(MOVES[name], 1), fan_of(MOVES[name], 2)
    assert set(map(tuple, one.offsets.tolist())) == set(MOVES[name].offsets)
    assert len(two.offsets) == (4 if name == "four-connected" else 16)
    assert (np.abs(two.offsets).max(axis=1) == 2).all()
    for fan in (one, two):
        angles = np.arctan2(fan.offsets[:, 1], fan.offsets[:, 0]) % (2 * np.pi)
        assert (np.diff(angles) > 0).all() or (np.diff(angles) < 0).all() or _turns_once(angles)
        for target, (k, j) in zip(fan.target.tolist(), fan.steps.tolist(), strict=True):
            end = np.array(MOVES[name].offsets[k]) + (0 if j < 0 else np.array(MOVES[name].offsets[j]))
            assert end.tolist() == fan.offsets[target].tolist()


def _turns_once(angles: np.ndarray) -> bool:
    step = np.diff(np.concatenate((angles, angles[:1]))) % (2 * np.pi)
    back = (2 * np.pi - step) % (2 * np.pi)
    return bool(np.isclose(min(step.sum(), back.sum()), 2 * np.pi))


@pytest.mark.parametrize("wrong", [{"particles": 0}, {"rounds": True}, {"obstacles": -1}, {"gates": "open"}])
def test_settings_out_of_range(wrong: dict[str, object]) -> None:
    for kind in BOTH:
        with pytest.raises(SettingError):
            kind(**wrong)  # type: ignore[arg-type]


def test_the_referee_refuses_what_has_no_sum() -> None:
    scene = scene_of(["S.#.G"])
    path = planned(DstarLpso(), scene_of(["S...G"])).path
    assert path is not None
    with pytest.raises(UsageError):
        sum_cost_to_go(path, scene)
    with pytest.raises(UsageError):
        sum_cost_to_go(path, scene_of(["S...G"]), every=0)
