"""The life of one session: loads, edits, plans, cancelled plans, copies; and what each answer must be."""

from __future__ import annotations

import copy
import pickle
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.plan import Plan, Status
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget, Planner, Session
from lampyris_selfcheck.reference.paths.changing_map import Cell, ChangingMap

STEPS = 50

COPIES: dict[str, Callable[[Session], Session]] = {
    "pickled": lambda one: pickle.loads(pickle.dumps(one)),
    "deep copy": copy.deepcopy,
    "copy": copy.copy,
}

ALL, SINCE, COST, ARRIVAL, NOTHING = "all", "since", "cost", "arrival", "nothing"
"""What of an answer must be a fresh session's: the way and what is said of it; the same, if the fresh one is
asked all that was asked since nobody was in the way; what it costs; when it arrives; nothing, where a session
is to remember more."""


@dataclass(frozen=True)
class PlanCall:
    """One call of ``plan``, and the state of the generator before it: how much a cancelled call draws depends
    on what was known before."""

    change: Change
    budget: Budget | None
    state: Mapping[str, Any]


@dataclass
class Window:
    """The scene as it was when a session had nothing to remember but the map, and the calls since."""

    scene: Scene
    calls: list[PlanCall] = field(default_factory=list)


class Life:
    """A session that is copied and cancelled, beside one that lives the same life and is never copied.

    Parameters
    ----------
    planner, alike : who plans, and what of its answers must be a fresh session's.
    rng : where the life is drawn from.
    """

    def __init__(self, planner: Planner, alike: str, rng: np.random.Generator) -> None:
        self._planner, self._alike, self._rng = planner, alike, rng
        self.seen: Counter[str] = Counter()
        self.told: list[str] = []
        self._load()

    def step(self) -> str:
        """One more thing happens; what is wrong then, or nothing."""
        draw = self._rng.random()
        if draw < 0.02:
            self._load()
        elif draw < 0.14:
            return self._copied()
        elif draw < 0.24:
            return self._plan(Change(robot=self._robot), Budget(int(self._rng.integers(1, 9))), "cancelled")
        elif draw < 0.27:
            return self._plan(self._cleared(), None, "cleared")
        elif draw < 0.37 and self._last is not None:
            return self._plan(self._last, None, "asked again")
        elif draw < 0.67:
            return self._plan(self._edit(), None, "edited")
        else:
            return self._plan(self._among(), None, "planned")
        return ""

    # ---- what happens --------------------

    def _load(self) -> None:
        rng = self._rng
        height, width = (int(n) for n in rng.integers(3, 13, 2))
        blocked = rng.random((height, width)) < rng.choice([0.0, 0.1, 0.3])
        # Once there is terrain a map hardly ever loses all of it: some never have any.
        self._rough = bool(rng.random() < 0.5)
        weights = rng.integers(0, 253, (height, width)) * (rng.random((height, width)) < 0.3)
        terrain = (weights * (self._rough and rng.random() < 0.7)).astype(np.uint8)
        start, goal = self._anywhere(width, height), self._anywhere(width, height)
        if rng.random() < 0.9:
            blocked[start[1], start[0]] = blocked[goal[1], goal[0]] = False
        terrain[blocked] = 0
        moves = MOVES[str(rng.choice(list(MOVES)))]
        robot = Robot(radius=float(rng.choice([0.0, 0.0, 0.0, 0.8])))
        grid = Grid(blocked, terrain=terrain if terrain.any() else None)
        self._scene = Scene(grid, start, goal, moves, robot)
        self._world = ChangingMap(blocked.tolist(), terrain.tolist())
        self._robot, self._tick = start, 0
        self._last: Change | None = None
        seed = int(rng.integers(2**32))
        self._draws = np.random.default_rng(seed)
        self._never = self._planner.open(self._scene, self._draws)
        self._session = self._planner.open(self._scene, np.random.default_rng(seed))
        self._window = Window(self._scene)
        self.seen["loads"] += 1
        self.told.append(f"load {width} x {height}, {start} to {goal}")

    def _copied(self) -> str:
        """A copy is made; one of the two goes on, the other is told what is not so."""
        how = str(self._rng.choice(list(COPIES)))
        other = COPIES[how](self._session)
        self.told.append(how)
        self.seen[how] += 1
        if self._rng.random() < 0.5:
            self._session, other = other, self._session
        blocked = tuple(self._somewhere() for _ in range(8))
        other.plan(Change(robot=self._somewhere(), blocked=blocked, obstacles=self._crowd()))
        return ""

    def _cleared(self) -> Change:
        walls = [(x, y) for y, row in enumerate(self._world.blocked) for x, shut in enumerate(row) if shut]
        return Change(robot=self._robot, freed=tuple(walls), tick=self._tick)

    def _edit(self) -> Change:
        """Some cells turn into what they are not; sometimes all around the robot, or the ground alone."""
        rng = self._rng
        cells = {self._somewhere() for _ in range(int(rng.choice([1, 1, 2, 5])))}
        if rng.random() < 0.15:
            cells |= self._around(self._robot)
        cells = {c for c in cells if c not in (self._robot, self._scene.goal) or rng.random() < 0.1}
        blocked = tuple(sorted(c for c in cells if not self._world.blocked[c[1]][c[0]]))
        freed = tuple(sorted(c for c in cells if self._world.blocked[c[1]][c[0]]))
        count = int(rng.choice([0, 0, 1, 4])) if self._rough else 0
        ground = [(self._somewhere(), int(rng.choice([0, 7, 252]))) for _ in range(count)]
        obstacles = self._crowd() if rng.random() < 0.2 else frozenset()
        robot = self._moved()
        terrain = tuple(dict(ground).items())
        return Change(robot, obstacles, blocked, freed, terrain, tick=self._tick)

    def _among(self) -> Change:
        return Change(robot=self._moved(), obstacles=self._crowd(), tick=self._tick)

    def _crowd(self) -> frozenset[Cell]:
        """Nobody, a few, half of all cells, or all around the robot."""
        draw = self._rng.random()
        cells = [(x, y) for y in range(self._world.height) for x in range(self._world.width)]
        if draw < 0.35:
            return frozenset()
        if draw < 0.6:
            return frozenset(self._somewhere() for _ in range(3)) - {self._robot}
        if draw < 0.8:
            return frozenset(self._around(self._robot))
        half = self._rng.random(len(cells)) < 0.5
        return frozenset(c for c, here in zip(cells, half.tolist(), strict=True) if here) - {self._robot}

    def _moved(self) -> Cell:
        self._tick += 1
        if self._rng.random() < 0.3:
            near = sorted(self._around(self._robot)) if self._rng.random() < 0.7 else [self._somewhere()]
            free = [(x, y) for x, y in near if not self._world.blocked[y][x]]
            self._robot = (free or near)[int(self._rng.integers(len(free or near)))]
        return self._robot

    def _around(self, cell: Cell) -> set[Cell]:
        (x, y), (height, width) = cell, (self._world.height, self._world.width)
        near = {(x + dx, y + dy) for dx in (-1, 0, 1) for dy in (-1, 0, 1)} - {cell}
        return {(u, v) for u, v in near if 0 <= u < width and 0 <= v < height} or {cell}

    def _anywhere(self, width: int, height: int) -> Cell:
        return int(self._rng.integers(width)), int(self._rng.integers(height))

    def _somewhere(self) -> Cell:
        return self._anywhere(self._world.width, self._world.height)

    # ---- what is answered --------------------

    def _plan(self, change: Change, budget: Budget | None, why: str) -> str:
        self._world.change(change.blocked, change.freed, change.terrain)
        self._last = change
        self.told.append(f"{why}: {change}, {budget}")
        # A session opened later has not seen what was under the walls it was opened with: it is told.
        ground = tuple(((x, y), self._world.terrain[y][x]) for x, y in change.freed)
        informed = replace(change, terrain=(*ground, *change.terrain))
        self._window.calls.append(PlanCall(informed, budget, self._draws.bit_generator.state))
        plan, other = (one.plan(change, budget) for one in (self._session, self._never))
        self.seen[why] += 1
        self.seen[f"answers: {plan.status.value}"] += 1
        if essence(plan) != essence(other):
            return f"answers {tell(plan)}; never copied it answers {tell(other)}"
        wrong = "" if budget is not None else self._unlike_fresh(plan)
        if not change.obstacles and plan.status in (Status.FOUND, Status.NO_PATH) and budget is None:
            self._window = Window(self._now())
        return wrong

    def _now(self) -> Scene:
        """The scene as it is, with the robot where it is."""
        terrain = np.array(self._world.terrain, np.uint8) if self._world.weighed else None
        grid = Grid(np.array(self._world.blocked), terrain=terrain)
        return Scene(grid, self._robot, self._scene.goal, self._scene.moves, self._scene.robot)

    def _unlike_fresh(self, plan: Plan) -> str:
        """What differs from a session opened when there was nothing to remember, and asked what was since."""
        if self._alike == NOTHING:
            return ""
        last = self._window.calls[-1]
        draws = np.random.default_rng(0)
        draws.bit_generator.state = last.state
        if self._alike == SINCE:
            # Who hemmed it in is remembered as long as they are seen.
            session = self._planner.open(self._window.scene, draws)
            for one in self._window.calls:
                fresh = session.plan(one.change, one.budget)
        else:
            bare = Change(obstacles=last.change.obstacles, tick=last.change.tick)
            fresh = self._planner.open(self._now(), draws).plan(bare)
        self.seen["fresh sessions"] += 1
        if told_of(plan, self._alike) != told_of(fresh, self._alike):
            return f"answers {tell(plan)}; a fresh session answers {tell(fresh)}"
        return ""


def told_of(plan: Plan, alike: str) -> tuple[object, ...]:
    """What must be the same of two answers."""
    if alike == ARRIVAL:
        return plan.status, None if plan.schedule is None else int(plan.schedule[-1])
    if alike == COST:
        return plan.status, None if plan.path is None else plan.path.exact, plan.optimal_exact
    return tuple(v for k, v in zip(_PARTS, essence(plan), strict=True) if k not in _EFFORT)


_PARTS = (
    "status", "cells", "exact", "schedule", "commit", "iterations", "expansions", "optimal", "to go",
    "repaired", "gates", "waypoints", "detail",
)  # fmt: skip
_EFFORT = ("iterations", "expansions")


def essence(plan: Plan) -> tuple[object, ...]:
    """All of an answer but how long it took."""
    arrays = (plan.cells, plan.schedule, plan.waypoints)
    cells, schedule, waypoints = (None if a is None else a.tolist() for a in arrays)
    exact = None if plan.path is None else (plan.path.exact, plan.path.moves.scale)
    told = plan.optimal_exact, plan.sum_cost_to_go, plan.repaired, plan.gates_met, waypoints, plan.detail
    return plan.status, cells, exact, schedule, plan.commit, plan.iterations, plan.expansions, *told


def tell(plan: Plan) -> str:
    """An answer in a line."""
    parts = zip(_PARTS, essence(plan), strict=True)
    return ", ".join(f"{k} {v}" for k, v in parts if v not in (None, (), "", False))
