"""One question to a planner, what may be answered to it, and the judgement of an answer."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NoReturn

from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget, Planner, Session, Traits
from lampyris.planning.field.layers import free_cells, moves_for
from lampyris.referee import check_path
from lampyris.testing.search import cheapest
from lampyris.typing import Cell

PLENTY = 10**9
"""A budget that no small map uses up."""

_UNFINISHED = {Status.LIMIT, Status.ITERATION_LIMIT}


@dataclass(frozen=True, slots=True)
class Question:
    """What was asked: the map as it should be by now, where the robot is, what stands in the way."""

    scene: Scene
    grid: Grid
    robot: Cell
    obstacles: frozenset[Cell] = frozenset()
    budget: int | None = None
    label: str = ""

    @property
    def now(self) -> Scene:
        """The scene with that map."""
        return replace(self.scene, grid=self.grid)

    def fail(self, planner: str, plan: object, why: str) -> NoReturn:
        walls, terrain = self.grid.blocked, self.grid.terrain
        rows = [["#" if b else "." for b in row] for row in walls.tolist()]
        for x, y in self.obstacles:
            rows[y][x] = "o"
        (sx, sy), (gx, gy) = self.robot, self.scene.goal
        rows[gy][gx] = "g" if walls[gy, gx] else "G"
        rows[sy][sx] = "s" if walls[sy, sx] else "S"
        ends = f"from {self.robot} to {self.scene.goal}, {self.scene.moves.name} moves"
        with_what = (
            f"radius {self.scene.robot.radius:g} m, obstacles {sorted(self.obstacles)}, budget {self.budget}"
        )
        picture = ["".join(row) for row in rows]
        asked = f"asked: {self.label}; {ends}, {with_what}"
        ground = [] if terrain is None else [f"terrain: {terrain.tolist()}"]
        answered = f"answered: {tell(plan)}"
        raise AssertionError("\n".join([f"{planner}: {why}", asked, *picture, *ground, answered]))


def tell(plan: object) -> str:
    if not isinstance(plan, Plan):
        return repr(plan)
    cells = None if plan.cells is None else [tuple(c) for c in plan.cells.tolist()]
    return f"{plan.status}, cells {cells}, steps {plan.steps}, expansions {plan.expansions}"


def ask(planner: Planner, session: Session, q: Question, change: Change | None = None) -> Plan:
    """The answer to a question, judged."""
    budget = None if q.budget is None else Budget(q.budget)
    try:
        plan = session.plan(change, budget)
    except Exception as error:
        q.fail(planner.name, error, "raises instead of answering")
    judge(planner, q, plan)
    return plan


def judge(planner: Planner, q: Question, plan: Plan) -> None:
    """Everything one answer must be."""

    def demand(holds: object, why: str) -> None:
        if not holds:
            q.fail(planner.name, plan, why)

    demand(isinstance(plan, Plan), "the answer is not a Plan")
    demand(plan.planner == planner.name, f"the plan says it is by {plan.planner!r}")
    demand(plan.sentence, "no sentence for a person")
    demand(plan.iterations >= 0 and plan.expansions >= 0, "counts below zero")
    allowed, exact, static = _truth(q, planner.traits)
    demand(plan.status in allowed, f"should be {' or '.join(sorted(allowed))}, is {plan.status}")
    if plan.path is None:
        return
    broken = check_path(plan.path, q.grid, q.scene.robot, q.scene.moves, q.robot, q.scene.goal)
    demand(broken is None, f"the referee says: {broken}")
    demand(not plan.path.cells.flags.writeable, "the path's cells can be written to")
    last = len(plan.path.cells) - 1
    commit = last if plan.commit is None else plan.commit
    demand(min(1, last) <= commit <= last, f"commit is {plan.commit} on a path of {last} steps")
    driven = {(int(x), int(y)) for x, y in plan.path.cells[1 : commit + 1]}
    demand(not driven & q.obstacles, f"drives into obstacles at {sorted(driven & q.obstacles)}")
    best = moves_for(q.now).value(static if exact is None else exact)
    demand(plan.path.exact >= static, f"costs {plan.cost} cells, less than the least possible, {best}")
    demand(exact is None or plan.path.exact == exact, f"costs {plan.cost} cells, the optimum is {best}")
    demand(
        plan.optimal_exact in (None, static, exact), f"says the optimum is {plan.optimal_cost}, it is {best}"
    )
    within = q.budget is None or plan.expansions <= q.budget
    demand(within, f"found a path with {plan.expansions} expansions")


def _truth(q: Question, traits: Traits) -> tuple[set[Status], int | None, int]:
    """The statuses allowed, the exact cost demanded (None: any legal one), and the static optimum (or 0)."""
    free = free_cells(q.grid, q.scene.robot.radius)
    (sx, sy), (gx, gy) = q.robot, q.scene.goal
    if not free[sy, sx]:
        return {Status.START_OCCUPIED}, None, 0
    if not free[gy, gx]:
        return {Status.GOAL_OCCUPIED}, None, 0
    moves, terrain = moves_for(q.now), q.grid.terrain
    static = cheapest(free, moves, q.robot, q.scene.goal, terrain)
    open_now = free.copy()
    for x, y in q.obstacles:
        open_now[y, x] = False
    now = static if not q.obstacles else cheapest(open_now, moves, q.robot, q.scene.goal, terrain)
    short = q.budget is not None and q.budget < PLENTY
    late = _UNFINISHED if short or not traits.optimal else set()
    exact = traits.optimal and not (q.obstacles and traits.sees_traffic)
    hemmed = {Status.HEMMED_IN} if q.obstacles and not exact else set()
    if static is None:
        return {Status.NO_PATH} | late | hemmed, None, 0
    if exact:
        return {Status.HEMMED_IN if now is None else Status.FOUND} | late, now, static
    return {Status.FOUND} | late | hemmed, None, static
