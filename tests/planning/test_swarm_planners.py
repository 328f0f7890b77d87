"""Swarm planners that judge whole ways: the contract, honesty where nothing is found, seeds.

``lampyris selfcheck swarm`` proves their bounds on drawn maps.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lampyris.errors import SettingError
from lampyris.io.maps.library import load
from lampyris.model.change import Change
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget
from lampyris.planning.swarm import mmas_dstar, pheromone, walks
from lampyris.planning.swarm.ant_system import AntSystem
from lampyris.planning.swarm.gso import Gso, Igso
from lampyris.planning.swarm.mmas_dstar import MmasDstar
from lampyris.planning.swarm.pheromone import Pheromone
from lampyris.planning.swarm.pso import APso, DiversityPso, IPso, LPso, Pso, PsoApf
from lampyris.planning.swarm.session import SwarmPlanner
from lampyris.referee import check_plan
from lampyris.testing import check_planner
from planning.swarm_scenes import scene_of
from sizes import some

KINDS: list[type[SwarmPlanner]] = [
    Gso,
    Igso,
    Pso,
    LPso,
    APso,
    IPso,
    PsoApf,
    DiversityPso,
    AntSystem,
    MmasDstar,
]
SMALL: dict[str, Any] = {"swarm": 8, "iterations": 5}


def planned(planner: SwarmPlanner, scene: Scene, seed: int = 0, *, record: bool = True) -> Plan:
    return planner.open(scene, np.random.default_rng(seed), record=record).plan()


def essence(plan: Plan) -> tuple[object, ...]:
    cells = None if plan.cells is None else plan.cells.tolist()
    return plan.status, cells, plan.iterations, plan.expansions, plan.best_by_iteration, plan.detail


@pytest.mark.nightly
@pytest.mark.parametrize("kind", some([MmasDstar, Pso]))
@pytest.mark.parametrize("repair", some([True, False]))
def test_the_contract_without_a_seed(kind: type[SwarmPlanner], repair: bool) -> None:
    check_planner(kind(swarm=5, iterations=2, seeded=False, repair=repair), seed=1, cases=3)


@pytest.mark.nightly
@pytest.mark.parametrize("kind", KINDS)
def test_the_contract_at_full_size(kind: type[SwarmPlanner]) -> None:
    check_planner(kind(), cases=10)


@pytest.mark.parametrize("kind", KINDS)
def test_the_seed_alone_decides(kind: type[SwarmPlanner]) -> None:
    document = load("env-6")
    scene = Scene(document.grid, document.start, document.goal)
    settings = kind(swarm=10, iterations=8, seeded=False)
    one, two, other = (planned(settings, scene, seed) for seed in (3, 3, 4))
    assert essence(one) == essence(two)
    assert essence(one) != essence(other), "nothing was drawn"
    silent = planned(settings, scene, 3, record=False)
    assert silent.best_by_iteration == ()
    assert essence(replace(silent, best_by_iteration=one.best_by_iteration)) == essence(one)


@pytest.mark.commit(3)
@pytest.mark.parametrize("kind", KINDS)
def test_swarms_make_something_better_of_what_they_began_with(kind: type[SwarmPlanner]) -> None:
    document = load("env-6")
    scene = Scene(document.grid, document.start, document.goal)
    begun, ended = [], []
    for seed in range(3):
        trace = planned(kind(swarm=25, iterations=25, seeded=False, turns=0.5), scene, seed).best_by_iteration
        begun.append(min(trace[0], 1e6))
        ended.append(min(trace[-1], 1e6))
    assert sum(ended) < sum(begun)


def test_slack_buys_clearance_and_is_never_overdrawn() -> None:
    scene = scene_of(["#" * 21, "S...................G", *["." * 21] * 6], "octile")
    near = planned(LPso(clearance=3.0, iterations=60), scene)
    far = planned(LPso(clearance=3.0, iterations=60, slack=0.3), scene)
    assert near.gap == 0.0
    assert far.gap is not None
    assert far.gap <= 0.3
    assert far.best_by_iteration[-1] < near.best_by_iteration[-1]
    assert far.gap > 0


def test_without_a_seed_a_maze_is_not_solved_and_not_called_impossible() -> None:
    rows = ["S#...#...", ".#.#.#.#.", ".#.#.#.#.", ".#.#.#.#.", "...#...#G"]
    scene = scene_of(rows)
    for kind in KINDS[:-2]:  # ants follow corridors
        settings: dict[str, Any] = {"swarm": 4, "iterations": 2, "seeded": False}
        plan = planned(kind(**settings), scene)
        assert plan.status is Status.ITERATION_LIMIT
        assert "There is one" in plan.sentence
        repaired = planned(kind(**settings, repair=True), scene)
        assert repaired.status is Status.FOUND
        assert "replacing" in repaired.sentence
        assert check_plan(repaired, scene) is None
        assert planned(kind(**{**settings, "seeded": True}), scene).gap == 0.0


def test_regions_that_are_apart_are_no_path_at_once() -> None:
    scene = scene_of(["S.#..", "..#..", "..#.G"])
    for kind in KINDS:
        plan = planned(kind(seeded=False), scene)
        assert plan.status is Status.NO_PATH
        assert plan.iterations == 0


def test_obstacles_close_the_way_for_one_call() -> None:
    scene = scene_of(["S....", "..#..", "....G"], "four-connected")
    gap = frozenset({(2, 0), (2, 2)})
    for kind in KINDS:
        session = kind(**SMALL).open(scene, np.random.default_rng(0))
        assert session.plan(Change(obstacles=gap)).status is Status.HEMMED_IN
        one = session.plan(Change(obstacles=frozenset({(2, 0)})))
        assert one.path is not None
        assert (2, 0) not in set(map(tuple, one.path.cells.tolist()))
        assert session.plan().optimal_exact == 6


@pytest.mark.parametrize("kind", KINDS)
def test_the_budget_ends_the_search_between_two_rounds(kind: type[SwarmPlanner]) -> None:
    document = load("env-6")
    scene = Scene(document.grid, document.start, document.goal)
    whole = planned(kind(swarm=10, iterations=6), scene)
    open_cells = int((~scene.grid.blocked).sum())
    rounds = []
    for budget in (10, open_cells + 1, (open_cells + whole.expansions) // 2, whole.expansions):
        session = kind(swarm=10, iterations=6).open(scene, np.random.default_rng(0))
        plan = session.plan(None, Budget(budget))
        assert plan.status is (Status.FOUND if plan.iterations else Status.LIMIT)
        if plan:
            assert plan.expansions <= budget
        rounds.append(plan.iterations)
    assert rounds[0] == rounds[1] == 0
    assert 0 < rounds[2] < rounds[3] == whole.iterations


def test_nothing_is_searched_once_nothing_better_can_be_found() -> None:
    scene = scene_of(["S..........G"])
    assert planned(Pso(), scene).iterations == 1
    assert planned(Pso(seeded=False, iterations=9), scene).iterations == 9


def test_ants_never_return_to_a_cell_and_pheromone_keeps_its_limits() -> None:
    document = load("env-6")
    scene = Scene(document.grid, document.start, document.goal)
    settings = MmasDstar(seeded=False, swarm=12, spread=20.0, patience=3)
    session = settings.open(scene, np.random.default_rng(0))
    memory = session._memory
    memory.begin(Change(), None)
    ground = memory.ground()
    from lampyris.planning.swarm.session import FitnessEvaluator, Task
    from lampyris.planning.swarm.walks import walk_of

    task = Task(ground, np.array(scene.start), None, int(ground.to_go[ground.flat(np.array(scene.start))]))
    ants, decode = settings.begin(task, np.random.default_rng(1))
    judge = FitnessEvaluator(settings, task, memory, decode)
    for _ in range(12):
        ways = ants.ask()
        assert len(ways) == 12
        for k in range(12):
            cells = list(map(tuple, walk_of(ground, ways[k]).tolist()))
            assert len(set(cells)) == len(cells)
            assert cells[0] == scene.start
            assert (cells[-1] == scene.goal) == (ways.missing[k] == 0)
        assert not ants._seen.any()
        ants.tell(-judge(ways))
        if ants._best is not None:
            most = 1.0 / (settings.rho * ants._best[0])
            every = [*ants.tau.values.tolist(), ants.tau.rest]
            assert most / 20.0 * (1 - 1e-12) <= min(every) <= max(every) <= most * (1 + 1e-12)
    assert ants._best is not None


@pytest.mark.nightly
@pytest.mark.parametrize("part", [30, 500])
def test_however_often_ants_look_they_find_the_same(part: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """What they log, gather, sort and renew is done in parts: with half a million steps it took 0.3 s."""
    document = load("env-6")
    scene = Scene(document.grid, document.start, document.goal)
    looks: list[str] = []
    for settings in (MmasDstar(swarm=40, iterations=4), MmasDstar(swarm=30, iterations=4, seeded=False)):
        whole = planned(settings, scene)
        looks.clear()
        with monkeypatch.context() as patch:
            for module in (mmas_dstar, pheromone, walks):
                patch.setattr(module, "PART", part)
                patch.setattr(module, "checkpoint", lambda name=module.__name__: looks.append(name))
            assert essence(planned(settings, scene)) == essence(whole)
        # Each round gathers and judges every step, and counts the cells twice to have the best way in order.
        assert (
            looks.count("lampyris.planning.swarm.walks")
            > whole.iterations * 2 * document.grid.blocked.size / part
        )
        assert looks.count("lampyris.planning.swarm.pheromone") > 30 * whole.iterations / part


@pytest.mark.parametrize("part", [1, 2, 5, 1 << 16])
def test_pheromone_is_what_a_full_table_would_hold(part: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pheromone, "PART", part)
    rng = np.random.default_rng(0)
    tau, table = Pheromone(0.7), np.full(50, 0.7)
    for _ in range(40):
        trails = np.sort(rng.permutation(50)[:6].astype(np.int64))
        tau.renew(0.2, trails, 0.15, 0.1, 0.8)
        table = table * 0.8
        table[trails] += 0.15
        table = np.minimum(np.maximum(table, 0.1), 0.8)
        assert tau.at(np.arange(50)).tolist() == table.tolist()
        assert (np.diff(tau.trails) > 0).all()
    assert tau.at(np.arange(6).reshape(2, 3)).shape == (2, 3)


@pytest.mark.parametrize(
    ("kind", "wrong"),
    [
        (Gso, {"swarm": 0}),
        (Gso, {"choice": "best"}),
        (Gso, {"sensor": 0.0}),
        (Igso, {"least": 0.5}),
        (Pso, {"iterations": 2.0}),
        (Pso, {"seeded": 1}),
        (Pso, {"blocked": 0.0}),
        (Pso, {"slack": -0.1}),
        (LPso, {"ring": 0}),
        (APso, {"low": 1.5}),
        (IPso, {"waypoints": 0}),
        (PsoApf, {"reach": float("nan")}),
        (MmasDstar, {"rho": 0.0}),
        (MmasDstar, {"guide": "luck"}),
    ],
)
def test_settings_out_of_range_are_named(kind: type[SwarmPlanner], wrong: dict[str, Any]) -> None:
    with pytest.raises(SettingError) as caught:
        kind(**wrong)
    assert next(iter(wrong)) in str(caught.value)
    assert kind.name in str(caught.value)
