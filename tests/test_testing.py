"""The contract test itself: it passes what is right and catches each way of being wrong, by name."""

from __future__ import annotations

import random
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from heapq import heappop, heappush
from typing import ClassVar

import numpy as np
import pytest

from lampyris._core.cancellation import CancelToken
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES, PELL_Q
from lampyris.model.path import path_of
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.planning import registry
from lampyris.planning.adgso.ad_gso import AdGso
from lampyris.planning.base import Budget, Planner, Session, SessionBase, Traits
from lampyris.planning.graph.astar import AStar
from lampyris.planning.search_planner import Problem, SearchPlanner
from lampyris.testing import cheapest, check_planner
from lampyris.typing import Cell
from lampyris_selfcheck.reference.paths import terrain as terrain_twin
from lampyris_selfcheck.reference.paths.search import distances
from sizes import sized, some


def small(name: str) -> Planner:
    """The planner, its swarm (if it has one) of a size that leaves the suite quick: in full size the swarms
    took 90 s of the 100 s of all planners."""
    known = registry.settings_of(registry.planner_class(name))
    return registry.make(name, {k: v for k, v in (("swarm", 5), ("iterations", 2)) if k in known})


ALIKE = ("igso", "lpso", "apso", "ipso", "pso-apf", "diversity-pso", "dstar16-lpso")
"""For the night: GSO, PSO and D*-LPSO with other numbers or one rule more."""
NAMES = sorted(registry.names(), key=ALIKE.__contains__)


@pytest.mark.commit(1)
@sized("cases", 1, 8)
@pytest.mark.parametrize("name", some(NAMES, len(NAMES) - len(ALIKE)))
def test_every_registered_planner_keeps_the_contract(name: str, cases: int) -> None:
    check_planner(small(name), cases=cases)


@pytest.mark.nightly
@pytest.mark.parametrize("choice", ["exact", "roulette"])
def test_other_choices_of_ad_gso_keep_it_too(choice: str) -> None:
    check_planner(AdGso(choice=choice), cases=3)


@pytest.mark.nightly
@pytest.mark.parametrize("name", registry.names())
def test_every_registered_planner_keeps_the_contract_on_many_maps(name: str) -> None:
    check_planner(small(name), seed=1, cases=200)


@pytest.mark.parametrize("name", sorted(MOVES))
def test_its_search_agrees_with_the_twin(name: str) -> None:
    rng = np.random.default_rng(3)
    for _ in range(15):
        free = rng.random((7, 8)) >= 0.3
        free[3, 3] = True
        known = distances(free.tolist(), name, (3, 3))
        for y, x in np.argwhere(free).tolist():
            cost = cheapest(free, MOVES[name], (x, y), (3, 3))
            assert (cost is None) == ((x, y) not in known)
            if cost is not None:
                assert cost == MOVES[name].exact(known[x, y])


@pytest.mark.parametrize("name", sorted(MOVES))
def test_its_search_over_terrain_agrees_with_the_twin(name: str) -> None:
    rng = np.random.default_rng(4)
    moves = MOVES[name].weighed()
    for _ in range(6):
        free = rng.random((7, 8)) >= 0.3
        free[3, 3] = True
        terrain = rng.integers(0, 253, (7, 8)).astype(np.uint8)
        known, _ = terrain_twin.field(free.tolist(), terrain.tolist(), name, (3, 3))
        for y, x in np.argwhere(free).tolist():
            cost = cheapest(free, moves, (x, y), (3, 3), terrain)
            assert (cost is None) == ((x, y) not in known)
            if cost is not None:
                assert moves.value(cost) == pytest.approx(float(known[x, y]), rel=1e-14)


# ---- wrong on purpose ------------------------------------------------------------------------------------

OPTIMAL, SLOPPY = Traits(optimal=True), Traits(optimal=False)
Answer = Callable[["Wrong", Session, Change | None, Budget | None], Plan]


@dataclass(frozen=True)
class Wrong:
    """A* with one defect, worked into every answer by ``answer``."""

    answer: Answer
    traits: Traits = OPTIMAL  # type: ignore[misc]
    name: ClassVar[str] = "astar"
    summary: ClassVar[str] = "Wrong on purpose."
    source: ClassVar[str] = "This test."

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> Session:
        return _WrongSession(self, scene, rng)


class _WrongSession(SessionBase):
    def __init__(self, planner: Wrong, scene: Scene, rng: np.random.Generator) -> None:
        self.planner, self.scene, self.rng = planner, scene, rng
        self.inner = AStar().open(scene, rng)
        self.calls = 0

    def plan(self, change: Change | None = None, budget: Budget | None = None) -> Plan:
        self.calls += 1
        return self.planner.answer(self, self.inner, change, budget)  # type: ignore[arg-type]


def says(**other: object) -> Answer:
    """Replaces parts of every path that was found."""

    def answer(_: object, inner: Session, change: Change | None, budget: Budget | None) -> Plan:
        plan = inner.plan(change, budget)
        return replace(plan, **other) if plan else plan  # type: ignore[arg-type]

    return answer


def deaf(**other: object) -> Answer:
    """Does not hear part of a change."""

    def answer(_: object, inner: Session, change: Change | None, budget: Budget | None) -> Plan:
        return inner.plan(None if change is None else replace(change, **other), budget)  # type: ignore[arg-type]

    return answer


def instead(status: Status, word: Status) -> Answer:
    """One status in the place of another."""

    def answer(_: object, inner: Session, change: Change | None, budget: Budget | None) -> Plan:
        plan = inner.plan(change, budget)
        return replace(plan, status=word) if plan.status is status else plan

    return answer


def of_a_map(edit: Callable[[Scene], Scene]) -> Answer:
    """Plans in another scene than the one asked about."""

    def answer(wrong: _WrongSession, _: Session, change: Change | None, budget: Budget | None) -> Plan:
        if wrong.calls == 1:
            wrong.inner = AStar().open(edit(wrong.scene), wrong.rng)
        return wrong.inner.plan(change, budget)

    return answer  # type: ignore[return-value]


def without_walls(scene: Scene) -> Scene:
    blocked = np.zeros_like(scene.grid.blocked)
    for x, y in (scene.start, scene.goal):
        blocked[y, x] = scene.grid.blocked[y, x]
    return replace(scene, grid=Grid(blocked))


def through_walls(wrong: _WrongSession, inner: Session, change: Change | None, budget: Budget | None) -> Plan:
    """A path where there is one, but not that one."""
    plan = inner.plan(change, budget)
    return AStar().open(without_walls(wrong.scene), wrong.rng).plan(change) if plan else plan


def cutting_corners(scene: Scene) -> Scene:
    return replace(scene, moves=replace(scene.moves, corner_cutting=True))


def thin(scene: Scene) -> Scene:
    return replace(scene, robot=replace(scene.robot, radius=0.0))


def only_straight(scene: Scene) -> Scene:
    m = scene.moves
    kept = [k for k, (dx, dy) in enumerate(m.offsets) if dx * dy == 0]
    few = replace(m, offsets=tuple(m.offsets[k] for k in kept), costs=tuple(m.costs[k] for k in kept))
    return replace(scene, moves=few)


def forgets_edits(wrong: _WrongSession, inner: Session, change: Change | None, budget: Budget | None) -> Plan:
    plan = inner.plan(change, budget)
    wrong.inner = AStar().open(replace(wrong.scene, start=wrong.inner._robot), wrong.rng)  # type: ignore[attr-defined]
    return plan


def forgets_walls(wrong: _WrongSession, inner: Session, change: Change | None, budget: Budget | None) -> Plan:
    plan = inner.plan(change, budget)
    if change is not None and change.blocked:
        forgets_edits(wrong, inner, None, budget)
    return plan


def on_plain_ground(scene: Scene) -> Scene:
    return replace(scene, grid=replace(scene.grid, terrain=None))


def pays_for_what_it_leaves(
    wrong: _WrongSession, inner: Session, change: Change | None, budget: Budget | None
) -> Plan:
    """What is cheapest if each step pays for the cell it leaves: the way from the goal, backwards."""
    plan = inner.plan(change, budget)
    if plan.path is None or (change and (change.obstacles or change.blocked or change.freed)):
        return plan
    ends = tuple(map(int, plan.path.cells[0])), tuple(map(int, plan.path.cells[-1]))
    scene = wrong.inner._scene  # type: ignore[attr-defined]
    back = AStar().open(replace(scene, start=ends[1], goal=ends[0]), wrong.rng).plan()
    assert back.path is not None
    path = path_of(back.path.cells[::-1], plan.path.moves, scene.grid.terrain)
    return replace(plan, path=path, optimal_exact=None)


def keeps_obstacles(
    wrong: _WrongSession, inner: Session, change: Change | None, budget: Budget | None
) -> Plan:
    wrong.seen = getattr(wrong, "seen", frozenset()) | (change.obstacles if change else frozenset())  # type: ignore[attr-defined]
    return inner.plan(replace(change or Change(), obstacles=wrong.seen), budget)  # type: ignore[attr-defined]


def ignores_the_budget(_: object, inner: Session, change: Change | None, budget: Budget | None) -> Plan:
    return inner.plan(change)


def raises_when_there_is_no_path(
    _: object, inner: Session, change: Change | None, budget: Budget | None
) -> Plan:
    plan = inner.plan(change, budget)
    if plan.status is Status.NO_PATH:
        raise ValueError("no path")
    return plan


def draws_elsewhere(_: object, inner: Session, change: Change | None, budget: Budget | None) -> Plan:
    random.random()
    return inner.plan(change, budget)


def counts_calls(wrong: _WrongSession, inner: Session, change: Change | None, budget: Budget | None) -> Plan:
    # State that outlives the session: every second session answers otherwise.
    global _sessions
    _sessions += wrong.calls == 1
    return replace(inner.plan(change, budget), iterations=_sessions)


_sessions = 0


def draws_although_not_stochastic(
    wrong: _WrongSession, inner: Session, change: Change | None, budget: Budget | None
) -> Plan:
    return replace(inner.plan(change, budget), iterations=int(wrong.rng.integers(1000)))


def wanders(_: object, inner: Session, change: Change | None, budget: Budget | None) -> Plan:
    """There and back again at the start: legal, and longer than it need be."""
    plan = inner.plan(change, budget)
    if plan.path is None or len(plan.path.cells) < 2:
        return plan
    cells = np.concatenate((plan.path.cells[:2], plan.path.cells))
    return replace(plan, path=path_of(cells, plan.path.moves), optimal_exact=None)


def jumps(_: object, inner: Session, change: Change | None, budget: Budget | None) -> Plan:
    plan = inner.plan(change, budget)
    if plan.path is None or len(plan.path.cells) < 3:
        return plan
    return replace(plan, path=path_of(plan.path.cells[[0, -1]], plan.path.moves), optimal_exact=None)


def swallows_outside(
    wrong: _WrongSession, inner: Session, change: Change | None, budget: Budget | None
) -> Plan:
    if change is not None and change.robot is not None and not wrong.scene.grid.contains(change.robot):
        change = replace(change, robot=None)
    return inner.plan(change, budget)


def answers_none(_: object, inner: Session, change: Change | None, budget: Budget | None) -> Plan:
    return None  # type: ignore[return-value]


DEFECTS = {
    "says it is by 'someone'": Wrong(says(planner="someone")),
    "says the optimum is 3.0, it is": Wrong(says(optimal_exact=3 * PELL_Q)),
    "commit is 9999": Wrong(says(commit=9999)),
    "counts below zero": Wrong(says(expansions=-1)),
    "from (": Wrong(deaf(robot=None)),
    "question: seed 0, octile moves, case 0, with obstacles": Wrong(deaf(obstacles=frozenset())),
    "a new wall": Wrong(deaf(blocked=()), SLOPPY),
    "case 0, the robot back at the start": Wrong(deaf(freed=())),
    "the wall still there": Wrong(forgets_walls),  # type: ignore[arg-type]
    "the same terrain": Wrong(forgets_edits),  # type: ignore[arg-type]
    "other terrain": Wrong(deaf(terrain=())),
    "units of 1/1 on a map with terrain": Wrong(of_a_map(on_plain_ground)),
    "terrain: [[": Wrong(pays_for_what_it_leaves),  # type: ignore[arg-type]
    "the obstacles gone": Wrong(keeps_obstacles),  # type: ignore[arg-type]
    "should be no-path, is goal-occupied": Wrong(instead(Status.NO_PATH, Status.GOAL_OCCUPIED)),
    "should be hemmed-in, is no-path": Wrong(instead(Status.HEMMED_IN, Status.NO_PATH)),
    "should be start-occupied, is no-path": Wrong(instead(Status.START_OCCUPIED, Status.NO_PATH)),
    "should be no-path, is limit": Wrong(instead(Status.NO_PATH, Status.LIMIT)),
    "limit or no-path, is found": Wrong(of_a_map(without_walls), SLOPPY),
    "the referee says: wall": Wrong(through_walls),  # type: ignore[arg-type]
    "should be no-path, is found": Wrong(of_a_map(cutting_corners)),
    "radius 0.8": Wrong(of_a_map(thin), SLOPPY),
    "the optimum is": Wrong(of_a_map(only_straight)),
    "found a path with": Wrong(ignores_the_budget),
    "raises instead of answering": Wrong(raises_when_there_is_no_path),
    "draws from the global random state": Wrong(draws_elsewhere),
    "a second session (generator 0 apart)": Wrong(counts_calls),  # type: ignore[arg-type]
    "a second session (generator 1 apart)": Wrong(draws_although_not_stochastic),  # type: ignore[arg-type]
    "costs 3.0 cells, the optimum is 1.0": Wrong(wanders),
    "is no octile move": Wrong(jumps),
    "raises no InputError": Wrong(swallows_outside),
    "the answer is not a Plan": Wrong(answers_none),
}


CASES = {"radius 0.8": 4}
"""Random maps that a defect needs, where one is not enough."""


@pytest.mark.commit(1)
@pytest.mark.parametrize(
    ("symptom", "planner"),
    some(DEFECTS.items(), 16),
    ids=[p.answer.__name__ + "-" + s for s, p in DEFECTS.items()],
)
def test_each_defect_is_caught_and_named(symptom: str, planner: Wrong) -> None:
    with pytest.raises(AssertionError) as caught:
        check_planner(planner, cases=CASES.get(symptom, 1))
    assert symptom in str(caught.value)


@pytest.mark.nightly
def test_the_message_shows_the_map_and_the_answer() -> None:
    with pytest.raises(AssertionError) as caught:
        check_planner(Wrong(says(optimal_exact=3 * PELL_Q)), cases=1)
    first, question, *rows, answer, more = str(caught.value).splitlines()
    assert first.startswith("astar: says the optimum is 3.0, it is 0.0")
    assert "moves, radius 0 m, obstacles [], budget None" in question
    assert {c for row in rows for c in row} <= set(".#oSsGg")
    assert answer.startswith("answer: found, cells [(")
    assert re.fullmatch(r"\(\d+ more like it\)", more)


def test_all_broken_rules_are_reported_at_once() -> None:
    @dataclass(frozen=True)
    class Straight(SearchPlanner):
        name: ClassVar[str] = "straight"
        traits: ClassVar[Traits] = OPTIMAL
        summary: ClassVar[str] = "Ignores walls, obstacles and terrain."
        source: ClassVar[str] = "This test."

        def search(self, problem: Problem) -> list[Cell] | None:
            cells = [problem.start]
            while cells[-1] != problem.goal:
                (x, y), (goal_x, goal_y) = cells[-1], problem.goal
                cells.append((x + (goal_x > x) - (goal_x < x), y + (goal_y > y) - (goal_y < y)))
            return cells

    with pytest.raises(AssertionError) as caught:
        check_planner(Straight(), cases=8)
    for part in (
        "straight breaks ", "should be no-path, is found", "the referee says: corner", "the referee says: wall",
        "the optimum is", "drives into obstacles", "should be hemmed-in, is found",
    ):  # fmt: skip
        assert part in str(caught.value)


@pytest.mark.nightly
@pytest.mark.parametrize("name", sorted(MOVES))
def test_a_search_planner_counts_keeps_to_its_budget_and_can_be_cancelled(name: str) -> None:
    @dataclass(frozen=True)
    class Plain(SearchPlanner):
        name: ClassVar[str] = "plain"
        traits: ClassVar[Traits] = OPTIMAL
        summary: ClassVar[str] = "Dijkstra without a stop at the goal."
        source: ClassVar[str] = "This test."

        def search(self, problem: Problem) -> list[Cell] | None:
            queue, parents = [(0, problem.start, problem.start)], {}
            while queue:
                cost, cell, parent = heappop(queue)
                if cell not in parents:
                    parents[cell] = parent
                    for there, step in problem.expand(cell):
                        heappush(queue, (cost + step, there, cell))
            return problem.path(parents) if problem.goal in parents else None

    check_planner(Plain(), cases=1)
    scene = Scene(Grid(np.zeros((9, 9), dtype=bool)), (0, 0), (8, 8), MOVES[name])
    session = Plain().open(scene, np.random.default_rng(0))
    assert session.plan().expansions == 81
    assert session.plan(None, Budget(80)).status is Status.LIMIT
    stop = CancelToken()
    stop.set()
    assert session.plan(None, Budget(stop=stop)).status is Status.CANCELLED
    assert session.plan(None, Budget(81)).status is Status.FOUND


def test_settings_must_be_frozen_and_named() -> None:
    @dataclass
    class Soft:
        name: ClassVar[str] = "soft"
        traits: ClassVar[Traits] = Traits(optimal=True)
        summary: ClassVar[str] = "Can be changed."
        source: ClassVar[str] = "This test."

        def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> Session:
            return AStar().open(scene, rng)

    with pytest.raises(AssertionError, match="not a frozen dataclass"):
        check_planner(Soft())

    @dataclass(frozen=True)
    class Nameless:
        name: ClassVar[str] = " "
        traits: ClassVar[Traits] = Traits(optimal=True)
        summary: ClassVar[str] = "Has no name."
        source: ClassVar[str] = "This test."

        def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> Session:
            return AStar().open(scene, rng)

    with pytest.raises(AssertionError, match="empty name"):
        check_planner(Nameless())
    with pytest.raises(AssertionError, match="lacks part"):
        check_planner(object())  # type: ignore[arg-type]
