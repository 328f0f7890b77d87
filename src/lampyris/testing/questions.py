"""One question to a planner, the answers that the contract allows, and the rules that an answer breaks."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace

from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.path import Path
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget, Planner, Session, Traits
from lampyris.planning.field.layers import free_cells, moves_for
from lampyris.referee import check_path
from lampyris.testing.search import cheapest
from lampyris.typing import Cell

PLENTY = 10**9
"""A budget that no small map uses up."""

_PARTICULARS = re.compile(r"'[^']*'|\[.*\]|\([^()]*\)|-?\d+(\.\d+)?")
_UNFINISHED = {Status.LIMIT, Status.ITERATION_LIMIT}


@dataclass(frozen=True, slots=True)
class Question:
    """A question: the map with all changes so far, the robot's cell and the obstacles."""

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

    def show(self, planner: str, plan: object, why: str) -> str:
        """A broken rule with the question as a map and the answer."""
        walls, terrain = self.grid.blocked, self.grid.terrain
        rows = [["#" if b else "." for b in row] for row in walls.tolist()]
        for x, y in self.obstacles:
            rows[y][x] = "o"
        (sx, sy), (gx, gy) = self.robot, self.scene.goal
        rows[gy][gx] = "g" if walls[gy, gx] else "G"
        rows[sy][sx] = "s" if walls[sy, sx] else "S"
        ends = f"from {self.robot} to {self.scene.goal}, {self.scene.moves.name} moves"
        settings = (
            f"radius {self.scene.robot.radius:g} m, obstacles {sorted(self.obstacles)}, budget {self.budget}"
        )
        lines = [f"{planner}: {why}", f"question: {self.label}; {ends}, {settings}"]
        lines += ["".join(row) for row in rows]
        if terrain is not None:
            lines.append(f"terrain: {terrain.tolist()}")
        return "\n".join([*lines, f"answer: {describe(plan)}"])


class Failures:
    """The rules that a planner breaks: an example of each, and how often it was broken.

    Parameters
    ----------
    planner : the planner's name.
    """

    def __init__(self, planner: str) -> None:
        self.planner = planner
        self._examples: dict[str, str] = {}
        self._counts: Counter[str] = Counter()

    def add(self, why: str, question: Question | None = None, plan: object = None) -> None:
        """Note a broken rule. What differs in figures, cells and quoted words alone is one rule."""
        rule = _PARTICULARS.sub("", why)
        self._counts[rule] += 1
        if rule not in self._examples:
            shown = f"{self.planner}: {why}" if question is None else question.show(self.planner, plan, why)
            self._examples[rule] = shown

    def report(self) -> str:
        """All rules that are broken, the first found first; empty if none is."""
        shown = []
        for rule, example in self._examples.items():
            more = self._counts[rule] - 1
            shown.append(example + (f"\n({more} more like it)" if more else ""))
        heading = (
            [f"{self.planner} breaks {len(shown)} rules of the planner contract:"] if len(shown) > 1 else []
        )
        return "\n\n".join([*heading, *shown])


def describe(plan: object) -> str:
    if not isinstance(plan, Plan):
        return repr(plan)
    cells = None if plan.cells is None else [tuple(c) for c in plan.cells.tolist()]
    return f"{plan.status}, cells {cells}, steps {plan.steps}, expansions {plan.expansions}"


def ask(
    planner: Planner, session: Session, q: Question, change: Change | None, failures: Failures
) -> Plan | None:
    """The answer to a question, after it was judged; None if there is no Plan to judge."""
    budget = None if q.budget is None else Budget(q.budget)
    try:
        plan = session.plan(change, budget)
    except Exception as error:
        failures.add(f"raises instead of answering ({type(error).__name__})", q, error)
        return None
    for why in broken_rules(planner, q, plan):
        failures.add(why, q, plan)
    return plan if isinstance(plan, Plan) else None


def broken_rules(planner: Planner, q: Question, plan: object) -> Iterator[str]:
    """Every rule that an answer breaks."""
    if not isinstance(plan, Plan):
        yield "the answer is not a Plan"
        return
    if plan.planner != planner.name:
        yield f"the plan says it is by {plan.planner!r}"
    if not plan.sentence:
        yield "no sentence for a person"
    if plan.iterations < 0 or plan.expansions < 0:
        yield "counts below zero"
    allowed, exact, static = _truth(q, planner.traits)
    if plan.status not in allowed:
        yield f"should be {' or '.join(sorted(allowed))}, is {plan.status}"
    elif plan.path is not None:
        yield from _broken_path_rules(q, plan, plan.path, exact, static)


def _broken_path_rules(q: Question, plan: Plan, path: Path, exact: int | None, static: int) -> Iterator[str]:
    broken = check_path(path, q.grid, q.scene.robot, q.scene.moves, q.robot, q.scene.goal)
    if broken is not None:
        yield f"the referee says: {broken}"
        return
    if path.cells.flags.writeable:
        yield "the path's cells can be written to"
    last = len(path.cells) - 1
    commit = last if plan.commit is None else plan.commit
    if not min(1, last) <= commit <= last:
        yield f"commit is {plan.commit} on a path of {last} steps"
        commit = last
    entered = {(int(x), int(y)) for x, y in path.cells[1 : commit + 1]} & q.obstacles
    if entered:
        yield f"drives into obstacles at {sorted(entered)}"
    best = moves_for(q.now).value(static if exact is None else exact)
    if path.exact < static:
        yield f"costs {plan.cost} cells, less than the least possible, {best}"
    elif exact is not None and path.exact != exact:
        yield f"costs {plan.cost} cells, the optimum is {best}"
    if plan.optimal_exact not in (None, static, exact):
        yield f"says the optimum is {plan.optimal_cost}, it is {best}"
    if q.budget is not None and plan.expansions > q.budget:
        yield f"found a path with {plan.expansions} expansions, more than its budget"


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
