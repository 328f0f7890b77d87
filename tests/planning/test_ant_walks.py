"""Walks of ants by the kernel and by operations over all ants: the same walks, from the same draws."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from lampyris.kernels.swarm.ant_walks import ant_walks
from lampyris.model.moves import MOVES
from lampyris.planning.swarm import mmas_dstar, walks
from lampyris.planning.swarm.ant_system import AntSystem
from lampyris.planning.swarm.mmas_dstar import MmasDstar
from lampyris.planning.swarm.session import SwarmPlanner, Task
from lampyris.planning.swarm.session_memory import Memory
from planning.swarm_scenes import random_scene

PLANNERS: list[SwarmPlanner] = [
    MmasDstar(swarm=7), MmasDstar(swarm=5, guide="cost", beta=1), MmasDstar(swarm=3, beta=0),
    AntSystem(swarm=7), AntSystem(swarm=5, guide="step", alpha=2, beta=0), AntSystem(swarm=4, guide="rise", alpha=0),
]  # fmt: skip


def rounds(planner: SwarmPlanner, seed: int) -> list[Any]:
    """What four rounds of ants come to, and the next draw."""
    scene = random_scene(seed)
    ground = Memory(scene, planner.name).ground()
    exact = int(ground.exact[scene.start[1], scene.start[0]])
    if exact <= 0:
        return []
    path = ground.shortest_path(scene.start) if seed % 2 else None
    rng = np.random.default_rng(seed)
    swarm, _ = planner.begin(Task(ground, np.array(scene.start), path, exact), rng)
    told: list[Any] = []
    for _ in range(4):
        paths = swarm.ask()
        told += [paths.first.tolist(), paths.at.tolist(), paths.step.tolist(), paths.missing.tolist()]
        swarm.tell(-10.0 - np.arange(len(paths)) / 4)
        told += [swarm.tau.rest, swarm.tau.trails.tolist(), swarm.tau.values.tolist()]  # type: ignore[attr-defined]
    return [*told, rng.random()]


@pytest.mark.parametrize("planner", PLANNERS, ids=str)
def test_the_kernel_walks_as_all_ants_at_once(planner: SwarmPlanner, monkeypatch: pytest.MonkeyPatch) -> None:
    seeds = range(0, 84, 3)
    monkeypatch.setattr(ant_walks, "_compiled", None)
    monkeypatch.setattr(ant_walks, "pays", lambda *args: False)
    wanted = [rounds(planner, seed) for seed in seeds]
    assert sum(map(bool, wanted)) >= 8
    calls = []

    def plain(*args: Any) -> None:
        calls.append(args)
        ant_walks.run_plain(*args)

    monkeypatch.setattr(ant_walks, "pays", lambda *args: True)
    monkeypatch.setattr(ant_walks, "_run", lambda args: plain(*args))
    # One block of draws and one log for all of a round, and many.
    for draws, part in ((mmas_dstar.DRAWS, walks.PART), (8, 9)):
        monkeypatch.setattr(mmas_dstar, "DRAWS", draws)
        monkeypatch.setattr(mmas_dstar, "PART", part)
        assert [rounds(planner, seed) for seed in seeds] == wanted
    assert len(calls) > 8 * sum(map(bool, wanted))


@pytest.mark.parametrize("planner", PLANNERS, ids=str)
def test_a_small_map_is_walked_as_any(planner: SwarmPlanner, monkeypatch: pytest.MonkeyPatch) -> None:
    """With weights of all steps made once a round; all ants at once, one by one, and the last of them one by one."""
    monkeypatch.setattr(ant_walks, "pays", lambda *args: False)
    seeds = range(1, 60, 3)
    monkeypatch.setattr(mmas_dstar, "TABLE", 0)
    wanted = [rounds(planner, seed) for seed in seeds]
    assert sum(map(bool, wanted)) >= 6
    monkeypatch.undo()
    monkeypatch.setattr(ant_walks, "pays", lambda *args: False)
    monkeypatch.setattr(mmas_dstar.Ants, "_turns", None)
    for few, draws in ((mmas_dstar.FEW, mmas_dstar.DRAWS), (0, 8), (100, 8), (2, 50)):
        monkeypatch.setattr(mmas_dstar, "FEW", few)
        monkeypatch.setattr(mmas_dstar, "DRAWS", draws)
        assert [rounds(planner, seed) for seed in seeds] == wanted


class Ones:
    """Draws so near to 1 that their product with a sum is the sum."""

    bit_generator = SimpleNamespace(state=None)

    def random(self, n: int) -> Any:
        return np.ones(n)


def test_a_draw_that_rounds_to_the_sum_is_below_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ant_walks, "pays", lambda *args: False)
    scene = random_scene(4)
    ground = Memory(scene, "ant-system").ground()
    exact = int(ground.exact[scene.start[1], scene.start[0]])
    assert exact > 0
    made = []
    for table, few in ((0, 6), (mmas_dstar.TABLE, 0), (mmas_dstar.TABLE, 6)):
        monkeypatch.setattr(mmas_dstar, "TABLE", table)
        monkeypatch.setattr(mmas_dstar, "FEW", few)
        task = Task(ground, np.array(scene.start), None, exact)
        paths = AntSystem(swarm=3).begin(task, Ones())[0].ask()  # type: ignore[arg-type]
        made.append((paths.first.tolist(), paths.at.tolist(), paths.step.tolist(), paths.missing.tolist()))
    assert len(made[0][1]) > 0
    assert made == made[:1] * 3


@pytest.mark.parametrize("name", MOVES)
def test_the_compiled_kernel_walks_as_its_plain_form(name: str) -> None:
    """On each kind of steps, over terrain and without."""
    rng = np.random.default_rng(len(name))
    made: list[list[list[Any]]] = []
    calls: list[tuple[Any, ...]] = []

    def noted(args: tuple[Any, ...]) -> None:
        calls.append(tuple(_copy(a) for a in args))
        ant_walks.run_plain(*args)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ant_walks, "pays", lambda *args: True)
        patch.setattr(ant_walks, "_compiled", None)  # of another case; a call would run it
        patch.setattr(ant_walks, "_run", noted)
        for seed in (1, 2):
            scene = random_scene(seed + 10 * int(rng.integers(0, 9)))
            ground = Memory(type(scene)(scene.grid, scene.start, scene.goal, name), "mmas-dstar").ground()
            exact = int(ground.exact[scene.start[1], scene.start[0]])
            if exact > 0:
                task = Task(ground, np.array(scene.start), None, exact)
                MmasDstar(swarm=6).begin(task, np.random.default_rng(seed))[0].ask()
    assert calls
    for form in (ant_walks.run_plain, ant_walks.compiled()):
        made.append([])
        for args in calls:
            given = [_copy(a) for a in args]
            form(*given)
            made[-1].append([given[k].tolist() for k in (-8, -7, -6, -2)])
    assert made[0] == made[1]


def _copy(value: Any) -> Any:
    return value.copy() if isinstance(value, np.ndarray) else value
