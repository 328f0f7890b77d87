"""Copies of sessions: whole, and independent of their original."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from lampyris.errors import LampyrisError
from lampyris.kernels import _jit
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan
from lampyris.model.scene import Scene
from lampyris.planning import registry
from lampyris.planning.adgso.ad_gso import AdGso
from lampyris.planning.base import Budget, Planner, Session
from sizes import some

WAYS: dict[str, Callable[[Any], Any]] = {
    "pickled": lambda one: pickle.loads(pickle.dumps(one)),
    "deepcopy": copy.deepcopy,
    "copy": copy.copy,
}

LIFE = (
    Change(),
    Change(blocked=((5, 5), (5, 6))),
    Change(robot=(2, 2), obstacles=frozenset({(3, 3), (2, 3), (3, 2)})),
)
LATER = (
    Change(blocked=tuple((10, y) for y in range(18)), robot=(2, 3)),
    Change(freed=((10, 10),), obstacles=frozenset({(9, 9), (9, 10), (9, 11)})),
    Change(freed=((5, 5),), terrain=(((10, 10), 200), ((3, 3), 9))),
    Change(robot=(11, 11)),
)


def small(name: str) -> Planner:
    known = registry.settings_of(registry.planner_class(name))
    return registry.make(name, {k: v for k, v in (("swarm", 5), ("iterations", 2)) if k in known})


PLANNERS = [*map(small, registry.names()), AdGso(choice="roulette"), AdGso(gates="replan")]


def opened(planner: Planner) -> Session:
    blocked = np.random.default_rng(3).random((20, 20)) < 0.1
    blocked[1, 1] = blocked[18, 18] = False
    scene = Scene(Grid(blocked), (1, 1), (18, 18))
    session = planner.open(scene, np.random.default_rng(7))
    for change in LIFE:
        session.plan(change)
    session.plan(None, Budget(3))
    return session


def told(plan: Plan) -> tuple[object, ...]:
    cells = None if plan.cells is None else plan.cells.tolist()
    schedule = None if plan.schedule is None else plan.schedule.tolist()
    ends = plan.optimal_exact, plan.sum_cost_to_go, plan.repaired, plan.detail
    return plan.status, cells, schedule, plan.commit, plan.iterations, plan.expansions, *ends


def goes_on(session: Session) -> list[tuple[object, ...]]:
    return [told(session.plan(change)) for change in LATER]


@pytest.mark.commit(3)
@pytest.mark.parametrize("way", some(["deepcopy", "pickled", "copy"]))
@pytest.mark.parametrize("planner", PLANNERS, ids=lambda p: p.name)
def test_a_copy_answers_as_its_original_and_apart_from_it(planner: Planner, way: str) -> None:
    """The copies of four planners planned on the map as it was, or on what the other one was told.

    With every commit the others are asked by the test below, one after the other.
    """
    never_copied = goes_on(opened(planner))
    for copy_first in (True, False):
        original = opened(planner)
        other = WAYS[way](original)
        pair = (other, original) if copy_first else (original, other)
        assert [goes_on(one) for one in pair] == [never_copied, never_copied]


@pytest.mark.commit(2)
@pytest.mark.parametrize("planner", PLANNERS, ids=lambda p: p.name)
def test_a_copy_of_a_copy_and_turns(planner: Planner) -> None:
    never_copied = goes_on(opened(planner))
    sessions = [opened(planner)]
    for way in WAYS.values():
        sessions.append(way(sessions[-1]))
    seen = [[told(one.plan(change)) for one in sessions] for change in LATER]
    assert seen == [[answer] * len(sessions) for answer in never_copied]


@pytest.mark.commit(20)
@pytest.mark.parametrize("weighed", [False, True], ids=["plain ground", "terrain"])
@pytest.mark.parametrize("planner", PLANNERS, ids=lambda one: one.name)
def test_copies_call_no_kernel_with_other_types(planner: Planner, weighed: bool) -> None:
    """NumPy makes arrays of copies writable; for those of other types every kernel would be compiled once more."""
    ground = np.full((12, 12), 3, dtype=np.uint8) if weighed else None
    scene = Scene(Grid(np.zeros((12, 12), dtype=bool), terrain=ground), (1, 1), (9, 10))
    if "samples" in registry.settings_of(
        type(planner)
    ):  # plain kernels are slow, and the types of a few calls tell
        planner = registry.make(planner.name, {"samples": 150})
    changes = (Change(), Change(blocked=((5, 5),)), Change(robot=(2, 2), obstacles=frozenset({(4, 4)})))

    def asked(make: Callable[[Any], Any]) -> set[Any]:
        with _jit.recorded() as found:
            session = make(planner.open(scene, np.random.default_rng(7)))
            for change in changes:
                session = make(session)
                session.plan(change)
        return set(found)

    try:
        alone = asked(lambda session: session)
    except LampyrisError:  # a planner that does not serve terrain
        return
    assert alone
    for way in WAYS.values():
        assert asked(way) <= alone
