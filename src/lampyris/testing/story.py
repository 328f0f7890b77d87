"""The questions of one map, as they come up while a robot drives and the map changes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lampyris.errors import InputError
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan
from lampyris.model.scene import Scene
from lampyris.planning.base import Planner, Session
from lampyris.testing.questions import PLENTY, Failures, Question, ask, describe
from lampyris.typing import Cell


class Story:
    """A sequence of questions on one map, put to a session, then to others, whose answers must be the same."""

    def __init__(
        self, planner: Planner, scene: Scene, label: str, rng: np.random.Generator, failures: Failures
    ) -> None:
        self._planner = planner
        self._scene = scene
        self._label = label
        self._rng = rng
        self._failures = failures
        self._seed = int(rng.integers(2**31))
        self._script: list[tuple[Change | None, Question]] = []

    def run(self) -> None:
        """Ask all questions."""
        answers = self._answers(self._open(self._seed))
        seeds = [self._seed] if self._planner.traits.stochastic else [self._seed, self._seed + 1]
        for seed in seeds:
            self._repeat(seed, answers)
        self._check_budgets()
        outside = (self._scene.grid.width, 0)
        try:
            self._open(self._seed).plan(Change(robot=outside))
        except InputError:
            return
        except Exception as error:
            self._failures.add(
                f"a robot outside the map raises {type(error).__name__}, which is no InputError"
            )
            return
        self._failures.add(f"a robot at {outside}, outside the map, raises no InputError")

    def _repeat(self, seed: int, answers: list[Plan | None]) -> None:
        """Put the same questions to a session with a generator of that seed."""
        session = self._open(seed)
        for (change, question), plan in zip(self._script, answers, strict=True):
            if plan is None:  # this question raised
                return
            try:
                other: object = session.plan(change)
            except Exception as error:
                other = error
            if not isinstance(other, Plan) or _essence(other) != _essence(plan):
                apart = f"generator {seed - self._seed} apart"
                why = f"a second session ({apart}) answers {describe(other)}"
                self._failures.add(why, question, plan)
                return

    def _open(self, seed: int) -> Session:
        return self._planner.open(self._scene, np.random.default_rng(seed))

    def _answers(self, session: Session) -> list[Plan | None]:
        scene, grid = self._scene, self._scene.grid
        answers: list[Plan | None] = []

        def put(what: str, change: Change | None, robot: Cell, grid: Grid = grid) -> Plan | None:
            obstacles = frozenset() if change is None else change.obstacles
            q = Question(scene, grid, robot, obstacles, label=f"{self._label}, {what}")
            self._script.append((change, q))
            answers.append(ask(self._planner, session, q, change, self._failures))
            return answers[-1]

        first = put("the first plan", None, scene.start)
        robot = self._somewhere(first)
        plan = put("the robot elsewhere", Change(robot=robot), robot)
        put("asked again without a change", None, robot)
        for count in (2, 12):
            put("with obstacles", Change(obstacles=self._obstacles(plan, robot, count)), robot)
        put("the obstacles gone", Change(), robot)
        wall = self._obstacles(plan, robot, 1)
        walls = grid.blocked.copy()
        for x, y in wall:
            walls[y, x] = True
        built = replace(grid, blocked=walls)
        put("a new wall", Change(blocked=tuple(wall)), robot, built)
        put("the wall still there", None, robot, built)
        # Where the wall stood the terrain is what it was before.
        put("the wall removed", Change(freed=tuple(wall)), robot)
        put("the robot back at the start", Change(robot=scene.start), scene.start)
        change, weighted = self._other_terrain(grid)
        put("other terrain", change, scene.start, weighted)
        put("the same terrain", None, scene.start, weighted)
        flat = tuple(((x, y), 0) for y in range(grid.height) for x in range(grid.width))
        put("no terrain", Change(terrain=flat), scene.start, replace(weighted, terrain=None))
        return answers

    def _other_terrain(self, grid: Grid) -> tuple[Change, Grid]:
        """New terrain values for about half of the cells, and the map with them."""
        values = np.zeros(grid.blocked.shape, int) if grid.terrain is None else grid.terrain.astype(int)
        given = []
        for y, x in np.argwhere(self._rng.random(values.shape) < 0.5).tolist():
            values[y, x] = self._rng.choice([0, 1, 63, 252])
            given.append(((x, y), int(values[y, x])))
        return Change(terrain=tuple(given)), replace(grid, terrain=values)

    def _somewhere(self, plan: Plan | None) -> Cell:
        """A cell on the path if there is one, else anywhere."""
        if plan is not None and plan.cells is not None:
            x, y = plan.cells[int(self._rng.integers(len(plan.cells)))]
        else:
            x, y = self._rng.integers(self._scene.grid.width), self._rng.integers(self._scene.grid.height)
        return int(x), int(y)

    def _obstacles(self, plan: Plan | None, robot: Cell, count: int) -> frozenset[Cell]:
        """Free cells, the path's own first, that are neither the robot's nor the goal."""
        free = np.argwhere(~self._scene.grid.blocked)[:, ::-1]
        where = [(int(x), int(y)) for x, y in self._rng.permutation(free)]
        if plan is not None and plan.cells is not None:
            path = [(int(x), int(y)) for x, y in self._rng.permutation(plan.cells)]
            where = path[: (count + 1) // 2] + where
        return frozenset([c for c in where if c not in (robot, self._scene.goal)][:count])

    def _check_budgets(self) -> None:
        whole = ask(self._planner, self._open(self._seed), self._question(None), None, self._failures)
        if whole is None:
            return
        for budget in (1, max(1, whole.expansions // 2), PLENTY):
            q = self._question(budget)
            plan = ask(self._planner, self._open(self._seed), q, None, self._failures)
            if budget == PLENTY and plan is not None and _essence(plan) != _essence(whole):
                self._failures.add(f"without a budget the answer is {describe(whole)}", q, plan)

    def _question(self, budget: int | None) -> Question:
        label = f"{self._label}, a budget"
        return Question(self._scene, self._scene.grid, self._scene.start, budget=budget, label=label)


def _essence(plan: Plan) -> tuple[object, ...]:
    """What must be the same every time: all but the timing."""
    cells = None if plan.cells is None else plan.cells.tolist()
    return plan.status, cells, plan.steps, plan.commit, plan.iterations, plan.expansions, plan.detail
