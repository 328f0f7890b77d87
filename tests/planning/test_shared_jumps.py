"""Simulations on one map share the jumps that AD-GSO makes where no obstacle is near: nothing else is other for it."""

from __future__ import annotations

import gc
import threading
import weakref

import numpy as np
import pytest

from lampyris.kernels import _jit
from lampyris.model.grid import Grid
from lampyris.model.scene import Scene
from lampyris.model.trace import Trace
from lampyris.model.traffic import RandomWalk
from lampyris.planning import field_cache
from lampyris.planning.adgso import next_steps
from lampyris.planning.adgso.ad_gso import AdGso
from lampyris.sim.grid.loop import Simulation, run

BLOCKED = np.random.default_rng(5).random((30, 30)) < 0.2
BLOCKED[:2, :2] = BLOCKED[-2:, -2:] = False


@pytest.fixture(autouse=True)
def nothing_left() -> None:
    if _jit.jit_disabled():
        pytest.skip("NUMBA_DISABLE_JIT is set")
    field_cache._solved.cache_clear()
    field_cache._spare.cache_clear()


def scene(walkers: int = 12) -> Scene:
    return Scene(Grid(BLOCKED), (0, 0), (29, 29), traffic=(RandomWalk(walkers),))


def fresh(seed: int, planner: AdGso) -> Trace:
    """A simulation on a map without cached tables."""
    return run(scene(), planner, seed=seed)


@pytest.mark.parametrize("planner", [AdGso(), AdGso(choice="exact", nt=6)], ids=["greedy", "exact"])
def test_traces_are_those_of_first_simulations(planner: AdGso) -> None:
    shared = scene()
    for seed in range(12):
        assert run(shared, planner, seed=seed) == fresh(seed, planner)


@pytest.mark.parametrize("places", [1, 8, 64])
def test_cells_that_share_a_place_take_turns(places: int, monkeypatch: pytest.MonkeyPatch) -> None:
    known = [fresh(seed, AdGso()) for seed in range(4)]
    field_cache._spare.cache_clear()
    monkeypatch.setattr(next_steps, "MOST_KNOWN", places)
    assert [fresh(seed, AdGso()) for seed in range(4)] == known


def test_settings_do_not_mix() -> None:
    shared = scene()
    for seed in range(4):
        for planner in (AdGso(), AdGso(mvr=2), AdGso(nt=4)):
            assert run(shared, planner, seed=seed) == fresh(seed, planner)


def test_simulations_that_take_turns_do_not_share_room() -> None:
    shared = scene()
    run(shared, AdGso(), seed=0)
    both = [Simulation(shared, AdGso(), seed=seed) for seed in (1, 2)]
    while any(one.outcome is None for one in both):
        for one in both:
            if one.outcome is None:
                one.advance(3)
    assert [one.trace() for one in both] == [fresh(seed, AdGso()) for seed in (1, 2)]


def test_threads_do_not_share_room() -> None:
    shared, found = scene(), {}

    def some(first: int) -> None:
        for seed in range(first, first + 8):
            found[seed] = run(shared, AdGso(), seed=seed)

    threads = [threading.Thread(target=some, args=(first,)) for first in (0, 8)]
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    assert all(found[seed] == fresh(seed, AdGso()) for seed in range(16))


def test_what_is_left_is_used_by_one_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    taken: list[object] = []
    right = next_steps._left_in
    monkeypatch.setattr(next_steps, "_left_in", lambda spare: taken.append(right(spare)) or taken[-1])
    shared = scene()
    run(shared, AdGso(), seed=0)
    run(shared, AdGso(), seed=1)
    assert taken[0] is None
    assert taken[1] is not None
    taken.clear()
    first = Simulation(shared, AdGso(), seed=2)
    second = Simulation(shared, AdGso(), seed=3)
    for one in (first, second):
        one.advance(2)
    assert taken[0] is not None
    assert taken[1] is not taken[0]


def test_a_kernel_that_was_stopped_leaves_nothing() -> None:
    shared = scene()
    simulation = Simulation(shared, AdGso(), seed=0)
    simulation.advance(2)
    finder = simulation.session._finder[2]  # type: ignore[attr-defined]
    spare = finder._spare
    finder.answers(-1, -1, 8)  # and never came back
    del finder, simulation
    assert spare == []


def test_work_of_many_settings_is_let_go_of() -> None:
    shared = scene()
    kept = []
    for nt in range(2, 2 + 4 * field_cache.SHARED):
        simulation = Simulation(shared, AdGso(nt=nt), seed=0)
        simulation.advance(2)
        finder = simulation.session._finder[2]  # type: ignore[attr-defined]
        kept.append(weakref.ref(finder._left[0][0]))
        del simulation, finder
    gc.collect()
    assert sum(one() is not None for one in kept) <= 2 * field_cache.SHARED
