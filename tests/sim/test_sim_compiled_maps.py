"""Compiled ticks of AD-GSO among random walkers on bundled maps: every trace is that of the loop in Python."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from sim_compared import by_tick, differ

from lampyris import RandomWalk, Scene, load_grid
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.trace import Outcome
from lampyris.motion.laws.dissertation import DissertationLaw
from lampyris.planning.adgso.ad_gso import AdGso
from lampyris.planning.base import SensedNow
from lampyris.referee import check_trace
from lampyris.sim.grid import loop
from lampyris.sim.world.cell_index import CellIndex
from reference.kernel_forms import use
from sizes import some


def scene_of(name: str, moves: str, crowd: RandomWalk, seed: int) -> Scene:
    """A scene between two random free cells."""
    grid = load_grid(name)
    rng = np.random.default_rng(seed)
    ys, xs = np.nonzero(~grid.blocked)
    i, j = rng.choice(len(xs), size=2, replace=False)
    start, goal = (int(xs[i]), int(ys[i])), (int(xs[j]), int(ys[j]))
    return Scene(grid, start, goal, moves=moves, traffic=(crowd,))  # type: ignore[arg-type]


CROWDS = (RandomWalk(5), RandomWalk(20), RandomWalk(120), RandomWalk(20, 1.0), RandomWalk(10, 0.1))
PLANNERS = (AdGso(), AdGso(choice="exact"), AdGso(gates="close"), AdGso(nt=3, mvr=2))
LAWS = ("dissertation", DissertationLaw(ring1="ahead", outside2=True, braking=30.0))


@pytest.mark.nightly
@pytest.mark.parametrize("moves", ["dissertation", "octile", "four-connected"])
@pytest.mark.parametrize("name", some(["env-1", "caves-64", "rooms-20", "env-3", "env-6"], 3))
def test_compiled_runs_are_those_of_the_loop(name: str, moves: str) -> None:
    for k, crowd in enumerate(CROWDS):
        if name == "rooms-20" and crowd.count > 20:
            continue
        scene, who = scene_of(name, moves, crowd, 7 * k + 1), PLANNERS[k % len(PLANNERS)]
        for seed in (0, 1):
            settings: dict[str, Any] = {"seed": seed, "law": LAWS[k % 2]}
            made = loop.run(scene, who, **settings)
            assert differ(by_tick(loop.Simulation(scene, who, **settings)), made) == [], (k, seed)
            assert check_trace(made) is None


@pytest.mark.nightly
@pytest.mark.parametrize("form", ["plain", "compiled"])
def test_both_forms_give_the_same_run(form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scene_of("rooms-20", "octile", RandomWalk(8), 3)
    known = by_tick(loop.Simulation(scene, AdGso(), seed=4, law="dissertation"))
    use(monkeypatch, form)
    assert differ(known, loop.run(scene, AdGso(), seed=4, law="dissertation")) == []


@pytest.mark.nightly
def test_limits_end_a_run_as_they_end_the_loop() -> None:
    ended = set()
    for seed in range(12):
        scene = scene_of("rooms-20", "octile", RandomWalk(60), seed)
        for ticks, patience in ((5, None), (None, 0), (None, 3)):
            settings: dict[str, Any] = {
                "seed": seed,
                "ticks": ticks,
                "patience": patience,
                "law": "dissertation",
            }
            known = by_tick(loop.Simulation(scene, AdGso(), **settings))
            assert differ(known, loop.run(scene, AdGso(), **settings)) == [], (seed, ticks, patience)
            ended.add(known.outcome)
    assert {Outcome.TIMEOUT, Outcome.BLOCKED} <= ended


@pytest.mark.parametrize("moves", ["octile", "four-connected"])
@pytest.mark.parametrize("planner", [AdGso(nt=3), AdGso(choice="exact", nt=3, mvr=2)], ids=str)
def test_next_steps_are_those_of_a_plan(moves: str, planner: AdGso) -> None:
    """Jumps are remembered where no obstacle is near. One session is asked often, and soon knows every jump.

    Where corners are not cut, an obstacle on a cell of higher luciferin can change a jump too: it closes a diagonal.
    """
    rng = np.random.default_rng(5)
    blocked = rng.random((30, 30)) < 0.15
    ys, xs = np.nonzero(~blocked)
    free = list(zip(xs.tolist(), ys.tolist(), strict=True))
    scene = Scene(Grid(blocked), free[0], free[-1], moves=moves)  # type: ignore[arg-type]
    space, wanted, draw = CellIndex(scene.grid), 4, np.random.default_rng(0)
    asked, plain = planner.open(scene, draw), planner.open(scene, draw)
    assert asked.plan().path == plain.plan().path  # the field is made by the first call
    compared = limited = 0
    nobody = np.zeros(1, dtype=np.int64)
    for k in range(180):
        robot = free[int(rng.integers(len(free) - 1))]
        closed = [free[n] for n in rng.choice(len(free), 60, replace=False).tolist() if free[n] != robot]
        numbers = np.array([space.number(c) for c in closed], dtype=np.int64)
        at = (space.number(robot), k, k, numbers, len(numbers), nobody, nobody, nobody, nobody, 0, True)
        known = plain.plan(Change(robot=robot, obstacles=frozenset(closed)))
        found = asked.next_steps(SensedNow(*at), wanted)  # type: ignore[attr-defined]
        if found is None or found.steps < 0:
            plain = planner.open(scene, draw)  # one that was hemmed in remembers it
            plain.plan()
            continue
        assert known.path is not None
        there = known.path.cells.tolist()
        assert (found.steps, found.commit, found.expansions) == (
            len(there) - 1,
            known.commit,
            known.expansions,
        )
        many = min(found.steps, found.commit + wanted) + 1
        assert [list(space.cell(n)) for n in found.path[:many].tolist()] == there[:many]
        compared += 1
        for less in (0, 1):
            more = SensedNow(*at, limit=found.expansions - less)
            limited += asked.next_steps(more, wanted) is None  # type: ignore[attr-defined]
    assert compared > 60
    assert limited == compared, "an answer within the limit, none beyond it"
