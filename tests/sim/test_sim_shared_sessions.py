"""Sessions that share what a map comes to: their answers are those of sessions that do not, and none changes another's."""

from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest

import lampyris
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.scene import Scene
from lampyris.model.traffic import RandomWalk
from lampyris.planning import registry
from lampyris.planning.adgso.session import AdGsoSession
from lampyris.planning.base import Budget
from lampyris.planning.field import repair
from lampyris.planning.spacetime.session import TimedSession
from lampyris.sim.grid.loop import Simulation, run


def scene_of(seed: int) -> Scene:
    """A random map with walkers."""
    rng = np.random.default_rng(seed)
    blocked = rng.random((14, 17)) < 0.2
    blocked[0, :3] = blocked[-1, -3:] = False
    return Scene(Grid(blocked), (1, 0), (15, 13), traffic=(RandomWalk(int(rng.integers(1, 12))),))


@pytest.mark.parametrize(("planner", "kind"), [("ad-gso", AdGsoSession), ("sipp", TimedSession)])
def test_same_answers(planner: str, kind: type, monkeypatch: pytest.MonkeyPatch) -> None:
    for seed in range(4):
        scene, one = scene_of(seed), registry.make(planner)
        shared = [Simulation(scene, one, seed=seed) for _ in range(2)]
        with monkeypatch.context() as patch:
            patch.setattr(kind, "share_map", lambda self: None)
            alone = Simulation(scene, one, seed=seed)
        for simulation in shared:
            assert replace(simulation.plan, timing={}) == replace(alone.plan, timing={})
            simulation.finish()
        while alone.outcome is None:
            alone.tick()
        assert shared[0].trace() == shared[1].trace() == alone.trace()


@pytest.mark.parametrize("most", [1, 20, 1000])
def test_sipp_under_a_limit(most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    budget = Budget(expansions=most)
    for seed in range(3):
        scene, one = scene_of(seed), registry.make("sipp")
        quick = Simulation(scene, one, seed=seed, budget=budget)
        quick.finish()
        with monkeypatch.context() as patch:
            patch.setattr(TimedSession, "share_map", lambda self: None)
            slow = Simulation(scene, one, seed=seed, budget=budget)
        while slow.outcome is None:
            slow.tick()
        assert quick.trace() == slow.trace()


@pytest.mark.parametrize("planner", ["ad-gso", "sipp"])
def test_a_kernel_answers_the_first_question(planner: str) -> None:
    for seed in range(4):
        scene, one = scene_of(seed), registry.make(planner)
        late, first = (Simulation(scene, one, seed=seed, plan_first=at_once) for at_once in (False, True))
        assert late.state.plan is None
        assert late.state.last_tick == first.state.last_tick
        assert late.state.expansions == first.state.expansions
        same = {"timing": {}, "expansions": 0}
        assert replace(late.plan, **same) == replace(first.plan, **same)
        for simulation in (late, first):
            while simulation.outcome is None:
                simulation.tick()
        assert late.trace() == first.trace()


@pytest.mark.parametrize("planner", ["ad-gso", "sipp"])
@pytest.mark.parametrize("most", [None, 1, 20, 300])
def test_where_the_kernel_has_no_first_answer_a_plan_is_made(planner: str, most: int | None) -> None:
    budget, one = None if most is None else Budget(expansions=most), registry.make(planner)
    blocked = np.zeros((14, 17), dtype=bool)
    blocked[5, 1:] = True
    cut = blocked.copy()
    cut[5, 0] = True
    around = tuple((x, y) for y in range(3) for x in range(3) if (x, y) != (1, 1))
    hemmed = (RandomWalk(len(around), starts=around),)
    crowd = (RandomWalk(40),)
    scenes = [
        Scene(Grid(blocked), (1, 1), (15, 13), traffic=hemmed),
        Scene(Grid(blocked), (1, 1), (15, 13), traffic=crowd),
        Scene(Grid(cut), (1, 1), (15, 13), traffic=crowd),
        Scene(Grid(blocked), (1, 1), (15, 13)),
    ]
    for scene in scenes:
        known = Simulation(scene, one, seed=3, budget=budget)
        while known.outcome is None:
            known.tick()
        assert run(scene, one, seed=3, budget=budget) == known.trace()


def test_a_repaired_field_is_its_own() -> None:
    grid = lampyris.load_grid("guide")
    scene, one = Scene(grid, (1, 8), (8, 2)), registry.make("ad-gso")
    sessions = [one.open(scene, np.random.default_rng(0)) for _ in range(3)]
    for session in sessions:
        session.share_map()
    before = sessions[0].plan(Change(robot=(1, 8)))
    sessions[1].plan(Change(robot=(1, 8)))
    x, y = before.path.cells[len(before.path.cells) // 2].tolist()
    changed = sessions[1].plan(Change(robot=(1, 8), blocked=((x, y),)))
    assert [x, y] not in changed.path.cells.tolist()
    for session in (sessions[0], sessions[2]):
        again = session.plan(Change(robot=(1, 8)))
        assert np.array_equal(again.path.cells, before.path.cells)
        assert again.optimal_exact == before.optimal_exact


def test_a_session_can_be_copied_while_another_repairs_its_field(monkeypatch: pytest.MonkeyPatch) -> None:
    """What both have in common is no call of either: neither finds it busy."""
    scene, one = Scene(lampyris.load_grid("guide"), (1, 8), (8, 2)), registry.make("ad-gso")
    repairing, other = (one.open(scene, np.random.default_rng(0)) for _ in range(2))
    for session in (repairing, other):
        session.share_map()
    expected = other.plan(Change(robot=(1, 8)))
    copies: list[AdGsoSession] = []
    monkeypatch.setattr(repair, "checkpoint", lambda: copies.append(deepcopy(other)))
    x, y = expected.path.cells[len(expected.path.cells) // 2].tolist()
    repairing.plan(Change(robot=(1, 8)))
    repairing.plan(Change(robot=(1, 8), blocked=((x, y),)))
    assert copies
    for copied in copies:
        assert np.array_equal(copied.plan(Change(robot=(1, 8))).path.cells, expected.path.cells)
