"""Ant System by its equations, and particles that are driven apart."""

from __future__ import annotations

import math

import numpy as np
import pytest

import lampyris
from lampyris.errors import SettingError
from lampyris.planning.swarm.ant_system import AntSystem
from lampyris.planning.swarm.optimisers.box import Box
from lampyris.planning.swarm.optimisers.particle import PSO, DiversityRule, FixedInertia
from lampyris.planning.swarm.pso import DiversityPso
from lampyris.planning.swarm.session import Task
from lampyris.planning.swarm.session_memory import Memory


def task(seeded: bool = False) -> Task:
    grid = lampyris.load_grid("guide")
    memory = Memory(lampyris.Scene(grid, (0, 9), (7, 0), "dissertation"), "ant-system")
    ground = memory.ground()
    seed = ground.shortest_path((0, 9)) if seeded else None
    return Task(ground, np.array([0, 9]), seed, int(ground.exact[9, 0]))


def test_pheromone_changes_as_equations_5_to_7_say() -> None:
    where = task()
    settings = AntSystem(swarm=12, rho=0.25)
    swarm, _ = settings.begin(where, np.random.default_rng(5))
    first = swarm.tau.rest  # type: ignore[attr-defined]
    expected: dict[tuple[int, int], float] = {}
    for _ in range(3):
        paths = swarm.ask()
        cost = 10.0 + np.arange(len(paths)) / 4
        before = dict(expected)
        first *= 1 - settings.rho
        expected = {edge: (1 - settings.rho) * tau for edge, tau in expected.items()}
        arrived = [k for k in range(len(paths)) if paths.missing[k] == 0]
        assert arrived, "no ant arrives, so that nothing is tested"
        for k in arrived:
            for edge in zip(paths[k].at.tolist(), paths[k].step.tolist(), strict=True):
                expected[edge] = expected.get(edge, first) + 1.0 / cost[k]
        swarm.tell(-cost)
        assert len(before) <= len(expected)
        tau = swarm.tau  # type: ignore[attr-defined]
        assert tau.rest == pytest.approx(first)
        steps = len(where.ground.jump)
        for (at, step), value in expected.items():
            assert tau.at(np.array([at * steps + step]))[0] == pytest.approx(value)


@pytest.mark.parametrize("guide", ["line", "step", "rise"])
def test_steps_are_taken_in_proportion_to_equation_4(guide: str) -> None:
    where, ground = task(), task().ground
    settings = AntSystem(swarm=2000, alpha=2, beta=1, guide=guide)
    swarm, _ = settings.begin(where, np.random.default_rng(1))
    start = int(ground.flat(where.start))
    # One step has twice the pheromone of the others.
    steps = len(ground.jump)
    legal = [k for k in range(steps) if ground.legal(np.array([start]), np.array([k]))[0]]
    swarm.tau.renew(1e-9, np.array([start * steps + legal[0]]), swarm.tau.rest, 0.0, math.inf)  # type: ignore[attr-defined]
    weights = {}
    for k in legal:
        dx, dy = ground.moves.offsets[k]
        length = ground.price[k] / ground.moves.unit
        x, y = where.start[0] + dx - 7, where.start[1] + dy - 0
        end = int(start + ground.jump[k])
        rise = (ground.to_go[end] + ground.price[k] - ground.to_go[start]) / ground.moves.unit
        eta = {"line": 1 / (1 + math.hypot(x, y)), "step": 1 / length, "rise": 1 / (1 + rise)}[guide]
        weights[k] = (2.0 if k == legal[0] else 1.0) ** 2 * eta
    paths = swarm.ask()
    taken = np.bincount(paths.step[paths.first[:-1]], minlength=steps)
    for k in legal:
        share = weights[k] / sum(weights.values())
        assert taken[k] / 2000 == pytest.approx(share, abs=5 * math.sqrt(share * (1 - share) / 2000) + 1e-9)


def test_a_seeded_colony_answers_with_the_exact_path_and_finds_its_own_without() -> None:
    grid = lampyris.load_grid("guide")
    scene = lampyris.Scene(grid, (0, 9), (7, 0))
    for kind in ("ant-system", "diversity-pso"):
        assert lampyris.plan(scene, kind, planner_settings={"iterations": 2}).gap == 0.0
    alone = lampyris.plan(scene, "ant-system", seeded=False)
    assert alone.status == lampyris.Status.FOUND


def test_groups_that_are_close_together_are_driven_apart() -> None:
    box = Box(np.zeros(2), np.ones(2))
    near = np.array([[0.5, 0.5], [0.501, 0.5], [0.1, 0.1], [0.9, 0.9]])
    rule = DiversityRule(0.05, 0.2, groups=2)
    swarm = PSO(n=4, inertia=FixedInertia(0.0), own=0.0, others=1.0, diversity=rule).start(
        box, np.random.default_rng(0), near
    )
    centre = near.reshape(2, 2, 2).mean(axis=1, keepdims=True)
    spread = np.sqrt(((near.reshape(2, 2, 2) - centre) ** 2).sum(axis=2)).mean(axis=1) / math.sqrt(2)
    assert swarm.diversity() == pytest.approx(spread)
    swarm.tell(np.array([2.0, 1.0, 4.0, 3.0]))
    assert swarm.apart.tolist() == [True, False]
    # The best of each group is its first particle: the second goes away from it, the fourth goes towards it.
    assert swarm.speeds[1, 0] > 0.0
    assert (swarm.speeds[3] < 0.0).all()
    assert (swarm.speeds[[0, 2]] == 0.0).all()
    assert (swarm.guides() == [0, 0, 2, 2]).all()


def test_a_group_comes_together_again_when_it_is_spread_enough() -> None:
    box = Box(np.zeros(1), np.ones(1))
    rule = DiversityRule(0.1, 0.3)
    swarm = PSO(n=2, diversity=rule).start(box, np.random.default_rng(0), np.array([[0.5], [0.5]]))
    for gap, apart in ((0.1, True), (0.4, True), (0.7, False), (0.3, False), (0.1, True)):
        swarm.positions = np.array([[0.5 - gap / 2], [0.5 + gap / 2]])
        swarm.tell(np.zeros(2))
        assert bool(swarm.apart[0]) is apart, gap


def test_wrong_diversities_are_refused() -> None:
    with pytest.raises(SettingError, match="low <= high"):
        DiversityRule(0.5, 0.1)
    with pytest.raises(SettingError, match="at most high"):
        DiversityPso(low=0.5, high=0.1)
    with pytest.raises(SettingError, match="groups"):
        DiversityRule(groups=0)
