"""The questions of one map, in the order of a robot's life on it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lampyris.errors import InputError
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget, Planner, Session
from lampyris.testing.questions import PLENTY, Question, ask, judge, tell
from lampyris.typing import Cell


class Story:
    """A robot's life on one map, told to a session, told again to another, and compared."""

    def __init__(self, planner: Planner, scene: Scene, label: str, rng: np.random.Generator) -> None:
        self._planner = planner
        self._scene = scene
        self._label = label
        self._rng = rng
        self._seed = int(rng.integers(2**31))
        self._script: list[tuple[Change | None, Question]] = []

    def run(self) -> None:
        """All of it."""
        session = self._open(self._seed)
        answers = self._live(session)
        seeds = [self._seed] if self._planner.traits.stochastic else [self._seed, self._seed + 1]
        for seed in seeds:
            again = self._open(seed)
            for (change, question), plan in zip(self._script, answers, strict=True):
                other = again.plan(change)
                if _essence(other) != _essence(plan):
                    first = f"a second session (generator {seed - self._seed} apart) answers {tell(other)}"
                    question.fail(self._planner.name, plan, first)
        self._check_budgets()
        outside = (self._scene.grid.width, 0)
        try:
            self._open(self._seed).plan(Change(robot=outside))
        except InputError:
            return
        raise AssertionError(
            f"{self._planner.name}: a robot at {outside}, outside the map, raises no InputError"
        )

    def _open(self, seed: int) -> Session:
        return self._planner.open(self._scene, np.random.default_rng(seed))

    def _live(self, session: Session) -> list[Plan]:
        scene, grid = self._scene, self._scene.grid
        answers: list[Plan] = []

        def put(what: str, change: Change | None, robot: Cell, grid: Grid = grid) -> Plan:
            seen = frozenset() if change is None else change.obstacles
            q = Question(scene, grid, robot, seen, label=f"{self._label}, {what}")
            self._script.append((change, q))
            answers.append(ask(self._planner, session, q, change))
            return answers[-1]

        first = put("the first plan", None, scene.start)
        robot = self._somewhere(first)
        plan = put("the robot elsewhere", Change(robot=robot), robot)
        put("asked again without a change", None, robot)
        for crowd in (2, 12):
            seen = self._obstacles(plan, robot, crowd)
            put("with obstacles", Change(obstacles=seen), robot)
        put("the obstacles gone", Change(), robot)
        wall = self._obstacles(plan, robot, 1)
        walls = grid.blocked.copy()
        for x, y in wall:
            walls[y, x] = True
        built = replace(grid, blocked=walls)
        put("a wall built", Change(blocked=tuple(wall)), robot, built)
        put("the wall still there", None, robot, built)
        # Where the wall stood the terrain is what it was before.
        put("the wall torn down", Change(freed=tuple(wall)), robot)
        put("the robot back at the start", Change(robot=scene.start), scene.start)
        change, turned = self._other_ground(grid)
        put("other ground", change, scene.start, turned)
        put("the ground as before", None, scene.start, turned)
        flat = tuple(((x, y), 0) for y in range(grid.height) for x in range(grid.width))
        put("all ground plain", Change(terrain=flat), scene.start, replace(turned, terrain=None))
        return answers

    def _other_ground(self, grid: Grid) -> tuple[Change, Grid]:
        """New terrain values for about half of the cells, and the map with them."""
        values = np.zeros(grid.blocked.shape, int) if grid.terrain is None else grid.terrain.astype(int)
        given = []
        for y, x in np.argwhere(self._rng.random(values.shape) < 0.5).tolist():
            values[y, x] = self._rng.choice([0, 1, 63, 252])
            given.append(((x, y), int(values[y, x])))
        return Change(terrain=tuple(given)), replace(grid, terrain=values)

    def _somewhere(self, plan: Plan) -> Cell:
        """A cell on the path if there is one, else anywhere."""
        if plan.cells is not None:
            x, y = plan.cells[int(self._rng.integers(len(plan.cells)))]
        else:
            x, y = self._rng.integers(self._scene.grid.width), self._rng.integers(self._scene.grid.height)
        return int(x), int(y)

    def _obstacles(self, plan: Plan, robot: Cell, count: int) -> frozenset[Cell]:
        """Free cells, the path's own first, that are neither the robot's nor the goal."""
        free = np.argwhere(~self._scene.grid.blocked)[:, ::-1]
        where = [(int(x), int(y)) for x, y in self._rng.permutation(free)]
        if plan.cells is not None:
            way = [(int(x), int(y)) for x, y in self._rng.permutation(plan.cells)]
            where = way[: (count + 1) // 2] + where
        return frozenset([c for c in where if c not in (robot, self._scene.goal)][:count])

    def _check_budgets(self) -> None:
        whole = self._open(self._seed).plan()
        for budget in (1, max(1, whole.expansions // 2), PLENTY):
            plan = self._open(self._seed).plan(None, Budget(budget))
            label = f"{self._label}, a budget"
            q = Question(self._scene, self._scene.grid, self._scene.start, budget=budget, label=label)
            judge(self._planner, q, plan)
            if budget == PLENTY and _essence(plan) != _essence(whole):
                q.fail(self._planner.name, plan, f"without a budget the answer is {tell(whole)}")


def _essence(plan: Plan) -> tuple[object, ...]:
    """What must be the same every time: all but the timing."""
    cells = None if plan.cells is None else plan.cells.tolist()
    return plan.status, cells, plan.steps, plan.commit, plan.iterations, plan.expansions, plan.detail
