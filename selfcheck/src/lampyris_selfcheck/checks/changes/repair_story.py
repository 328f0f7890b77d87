"""Lives of a map that changes, told to repairers and to incremental planners; each answer is judged."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES, Moves
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget, Planner, Session
from lampyris.planning.field.repair import FieldRepairer
from lampyris.planning.field.solve import solve
from lampyris.referee import check_path
from lampyris_selfcheck.reference.paths.changing_map import Cell, ChangingMap, Counts, costs
from lampyris_selfcheck.reference.paths.edit_stories import EditStory, StoryEdit

ARRAYS = ("exact", "step", "luciferin", "free")
RNG = np.random.default_rng(0)
"""Never drawn from: these planners are deterministic."""


def demand(holds: object, why: str) -> None:
    """Refuse an answer.

    Raises
    ------
    AssertionError : it does not hold.
    """
    if not holds:
        raise AssertionError(why)


# ---- the field --------------------------------------------------------------------------------------------


def repair_through(told: EditStory, judged: int = 1) -> FieldRepairer:
    """Live a story; after every edit the field is the one solved anew, to the last bit, and a plain
    Dijkstra's after every ``judged`` th. The robot's size is of no account here.

    Raises
    ------
    AssertionError : it is not.
    """
    weighed = told.terrain is not None
    moves = MOVES[told.name].weighed() if weighed else MOVES[told.name]
    rho, gamma = (0.4, 0.6) if told.start[0] % 2 else (0.37, 0.7)
    repairer = FieldRepairer(~told.blocked, moves, told.goal, terrain=told.terrain, rho=rho, gamma=gamma)
    world = ChangingMap(told.blocked.tolist(), None if told.terrain is None else told.terrain.tolist())
    for number, edit in enumerate(told.edits):
        # Obstacles are cells like others here: blocked with the rest, and free again with the next edit.
        terrain = edit.terrain if weighed else ()
        world.change(edit.blocked, edit.freed, terrain)
        graded = [(cell, world.terrain[cell[1]][cell[0]]) for cell, _ in terrain]
        if weighed:
            graded += [((x, y), world.terrain[y][x]) for x, y in (*edit.blocked, *edit.freed)]
        field = repairer.repair(blocked=edit.blocked, freed=edit.freed, terrain=graded)
        free = ~np.array(world.blocked)
        weights = np.array(world.terrain, np.uint8) if weighed else None
        anew = solve(free, moves, told.goal, terrain=weights, rho=rho, gamma=gamma)
        where = f"{told.name} moves, edit {number}"
        for what in ARRAYS:
            same = np.array_equal(getattr(field, what), getattr(anew, what))
            demand(same, f"{where}: {what} is not that of the field solved anew")
        demand(field.revision == number + 1, f"{where}: revision {field.revision}")
        if number % judged == 0:
            right = by_the_twin(world, told.name, told.goal, moves)
            demand(np.array_equal(field.exact, right), f"{where}: costs are not the reference's")
    return repairer


def by_the_twin(world: ChangingMap, name: str, goal: Cell, moves: Moves) -> np.ndarray:
    """Exact costs of every cell by a plain Dijkstra; -1 where there is no way."""
    ground = moves.scale
    prices = np.array([moves.straight, moves.diagonal, moves.knight], dtype=object) // ground
    right = np.full((world.height, world.width), -1, dtype=np.int64)
    free = [[not b for b in row] for row in world.blocked]
    for (x, y), counts in costs(free, world.terrain, name, goal, False).items():
        right[y, x] = sum(n * p for n, p in zip(counts, prices, strict=True)) // (63 // ground)
    return right


# ---- the planners -----------------------------------------------------------------------------------------


def exact(world: ChangingMap, name: str, counts: Counts) -> int:
    """Weighed counts as lampyris tells the cost of such a way."""
    moves = MOVES[name]
    cost = counts[0] * moves.straight + counts[1] * moves.diagonal + counts[2] * moves.knight
    return cost if world.weighed else cost // 63


def plan_through(
    told: EditStory, planners: Sequence[Planner], budget: Budget | None = None, judged: int = 1
) -> Counter[str]:
    """Live a story with every planner; each answer is that of a plain Dijkstra on the map as it is then.

    With ``judged`` only every so many answers are; the others are those of a field solved from scratch.
    Returns how often which status was right.

    Raises
    ------
    AssertionError : an answer is wrong.
    """
    grid = Grid(told.blocked, terrain=told.terrain)
    scene = Scene(grid, told.start, told.goal, MOVES[told.name], Robot(radius=told.radius))
    world = ChangingMap(
        told.blocked.tolist(), None if told.terrain is None else told.terrain.tolist(), told.radius
    )
    sessions = [(p, p.open(scene, RNG)) for p in planners]
    robot = told.start
    seen: Counter[str] = Counter()
    for number, edit in enumerate(told.edits):
        world.change(edit.blocked, edit.freed, edit.terrain)
        robot = edit.robot or robot
        right = _right(told, edit, world, robot, by_twin=number % judged == 0)
        terrain = np.array(world.terrain, np.uint8) if world.weighed else None
        now = replace(scene, grid=Grid(np.array(world.blocked), terrain=terrain))
        where = f"{told.name} moves, edit {number}"
        ways = {_answer(*one, edit, now, robot, right, budget, where) for one in sessions}
        demand(len(ways) == 1, f"{where}: the planners differ in their ways")
        seen[right[0]] += 1
    return seen


_Right = tuple[str, int, list[list[bool]]]
"""The right status and cost, and where the robot may be now."""


def _answer(
    planner: Planner,
    session: Session,
    edit: StoryEdit,
    now: Scene,
    robot: Cell,
    right: _Right,
    budget: Budget | None,
    where: str,
) -> tuple[Cell, ...]:
    """The way that one planner answers to one edit, judged."""
    word, best, free = right
    change = Change(edit.robot, edit.obstacles, edit.blocked, edit.freed, edit.terrain)
    plan = session.plan(change, budget)
    whose = f"{planner.name}, {where}"
    demand(plan.status == word, f"{whose}: {plan.status}, should be {word}")
    if plan.path is None:
        return ()
    demand(plan.path.exact == best, f"{whose}: costs {plan.path.exact}, should be {best}")
    broken = check_path(plan.path, now.grid, now.robot, now.moves, robot, now.goal)
    demand(broken is None, f"{whose}: {broken}")
    cells = tuple((int(x), int(y)) for x, y in plan.path.cells.tolist())
    demand(all(free[y][x] for x, y in cells), f"{whose}: drives through an obstacle")
    told = None if edit.obstacles else best
    demand(plan.optimal_exact == told, f"{whose}: says the optimum is {plan.optimal_exact}, it is {best}")
    return cells


def _right(told: EditStory, edit: StoryEdit, world: ChangingMap, robot: Cell, *, by_twin: bool) -> _Right:
    goal, wide = told.goal, told.radius > 0
    static = world.free()
    now = [row[:] for row in static]
    for x, y in edit.obstacles - {robot, goal}:
        now[y][x] = False
    if not static[robot[1]][robot[0]]:
        return "start-occupied", -1, now
    if not static[goal[1]][goal[0]]:
        return "goal-occupied", -1, now

    def cost(free: list[list[bool]]) -> int:
        if by_twin or wide:
            known = costs(free, world.terrain, told.name, goal, wide)
            return exact(world, told.name, known[robot]) if robot in known else -1
        terrain = np.array(world.terrain, np.uint8) if world.weighed else None
        moves = MOVES[told.name].weighed() if world.weighed else MOVES[told.name]
        return int(solve(np.array(free), moves, goal, terrain=terrain).exact[robot[1], robot[0]])

    best = cost(now)
    if best >= 0:
        return "found", best, now
    return ("hemmed-in" if cost(static) >= 0 else "no-path"), -1, now


def data(told: EditStory, **more: object) -> dict[str, object]:
    """A story in words of JSON."""
    return {
        "moves": told.name,
        "rows": ["".join(".#"[int(b)] for b in row) for row in told.blocked],
        "terrain": None if told.terrain is None else told.terrain.tolist(),
        "radius": told.radius,
        "ends": [told.start, told.goal],
        "edits": [
            {
                "robot": e.robot,
                "blocked": e.blocked,
                "freed": e.freed,
                "terrain": e.terrain,
                "obstacles": sorted(e.obstacles),
            }
            for e in told.edits
        ],
        **more,
    }
