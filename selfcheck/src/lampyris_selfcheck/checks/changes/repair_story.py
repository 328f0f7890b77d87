"""Edits of a map, given to repairers and to incremental planners; each answer is judged."""

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


def repair_through(given: EditStory) -> FieldRepairer:
    """Make the edits of a story; after each the field is the one solved anew, to the last bit, and its costs are a
    plain Dijkstra's. The robot's size is of no account here.

    Raises
    ------
    AssertionError : it is not.
    """
    weighed = given.terrain is not None
    moves = MOVES[given.name].weighed() if weighed else MOVES[given.name]
    rho, gamma = (0.4, 0.6) if given.start[0] % 2 else (0.37, 0.7)
    repairer = FieldRepairer(~given.blocked, moves, given.goal, terrain=given.terrain, rho=rho, gamma=gamma)
    world = ChangingMap(given.blocked.tolist(), None if given.terrain is None else given.terrain.tolist())
    for number, edit in enumerate(given.edits):
        # Obstacles are cells like others here: blocked with the rest, and free again with the next edit.
        terrain = edit.terrain if weighed else ()
        world.change(edit.blocked, edit.freed, terrain)
        graded = [(cell, world.terrain[cell[1]][cell[0]]) for cell, _ in terrain]
        if weighed:
            graded += [((x, y), world.terrain[y][x]) for x, y in (*edit.blocked, *edit.freed)]
        field = repairer.repair(blocked=edit.blocked, freed=edit.freed, terrain=graded)
        free = ~np.array(world.blocked)
        weights = np.array(world.terrain, np.uint8) if weighed else None
        anew = solve(free, moves, given.goal, terrain=weights, rho=rho, gamma=gamma)
        where = f"{given.name} moves, edit {number}"
        for what in ARRAYS:
            same = np.array_equal(getattr(field, what), getattr(anew, what))
            demand(same, f"{where}: {what} is not that of the field solved anew")
        demand(field.revision == number + 1, f"{where}: revision {field.revision}")
        right = reference_costs(world, given.name, given.goal, moves)
        demand(np.array_equal(field.exact, right), f"{where}: costs are not the reference's")
    return repairer


def reference_costs(world: ChangingMap, name: str, goal: Cell, moves: Moves) -> np.ndarray:
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


def plan_through(given: EditStory, planners: Sequence[Planner], budget: Budget | None = None) -> Counter[str]:
    """Make the edits with every planner; each answer is that of a plain Dijkstra on the map as it is then.

    Returns how often which status was right.

    Raises
    ------
    AssertionError : an answer is wrong.
    """
    grid = Grid(given.blocked, terrain=given.terrain)
    scene = Scene(grid, given.start, given.goal, MOVES[given.name], Robot(radius=given.radius))
    world = ChangingMap(
        given.blocked.tolist(), None if given.terrain is None else given.terrain.tolist(), given.radius
    )
    sessions = [(p, p.open(scene, RNG)) for p in planners]
    robot = given.start
    seen: Counter[str] = Counter()
    for number, edit in enumerate(given.edits):
        world.change(edit.blocked, edit.freed, edit.terrain)
        robot = edit.robot or robot
        right = _right(given, edit, world, robot)
        terrain = np.array(world.terrain, np.uint8) if world.weighed else None
        now = replace(scene, grid=Grid(np.array(world.blocked), terrain=terrain))
        where = f"{given.name} moves, edit {number}"
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
    said = None if edit.obstacles else best
    demand(plan.optimal_exact == said, f"{whose}: says the optimum is {plan.optimal_exact}, it is {best}")
    return cells


def _right(given: EditStory, edit: StoryEdit, world: ChangingMap, robot: Cell) -> _Right:
    goal, wide = given.goal, given.radius > 0
    static = world.free()
    now = [row[:] for row in static]
    for x, y in edit.obstacles - {robot, goal}:
        now[y][x] = False
    if not static[robot[1]][robot[0]]:
        return "start-occupied", -1, now
    if not static[goal[1]][goal[0]]:
        return "goal-occupied", -1, now

    def cost(free: list[list[bool]]) -> int:
        known = costs(free, world.terrain, given.name, goal, wide)
        return exact(world, given.name, known[robot]) if robot in known else -1

    best = cost(now)
    if best >= 0:
        return "found", best, now
    return ("hemmed-in" if cost(static) >= 0 else "no-path"), -1, now


def data(given: EditStory, **more: object) -> dict[str, object]:
    """A story in words of JSON."""
    return {
        "moves": given.name,
        "rows": ["".join(".#"[int(b)] for b in row) for row in given.blocked],
        "terrain": None if given.terrain is None else given.terrain.tolist(),
        "radius": given.radius,
        "ends": [given.start, given.goal],
        "edits": [
            {
                "robot": e.robot,
                "blocked": e.blocked,
                "freed": e.freed,
                "terrain": e.terrain,
                "obstacles": sorted(e.obstacles),
            }
            for e in given.edits
        ],
        **more,
    }
