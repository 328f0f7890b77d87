"""Paths and plans: ends, adjacency, walls, corners, the room a disc needs, and the exact cost."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lampyris._core.arrays import any_true, index_array
from lampyris.model.grid import Grid
from lampyris.model.moves import Moves
from lampyris.model.path import Path
from lampyris.model.plan import Plan, Status
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.referee.geometry.shapes import Ints, disc_cells, first_overlap, stands_free, swept_cells
from lampyris.referee.plans.any_angle import lines_violation
from lampyris.referee.plans.schedule import schedule_violation
from lampyris.referee.plans.via_points import via_violation
from lampyris.referee.pose_path import check_pose_path, exact_ends_violation
from lampyris.referee.verdict import Violation
from lampyris.typing import Cell

_COSTS = {"dissertation": (10, 14, 0), "four-connected": (1, 0, 0), "sixteen-connected": (10, 14, 22)}
"""Straight, diagonal and knight's step, written down a second time; ``octile`` is asked to be sqrt 2."""
_PLAIN_GROUND = 63
"""What a cell of terrain 0 weighs on a map with terrain; one of terrain c weighs c more."""


@dataclass(frozen=True, slots=True)
class _Steps:
    """A step set as the referee sees it: look-up tables over (dx + reach, dy + reach)."""

    reach: int
    kind: NDArray[np.int8]
    cost: Ints
    fault: str


@lru_cache(maxsize=64)
def _steps_of(moves: Moves) -> _Steps:
    reach = max(max(abs(dx), abs(dy)) for dx, dy in moves.offsets)
    side = 2 * reach + 1
    kind = np.full(side * side, -1, dtype=np.int8)
    cost = np.zeros(side * side, dtype=np.int64)
    fault = ""
    paid: dict[int, int] = {}
    for (dx, dy), c in zip(moves.offsets, moves.costs, strict=True):
        shape = tuple(sorted((abs(dx), abs(dy))))
        if shape not in ((0, 1), (1, 1), (1, 2)):
            fault = f"({dx}, {dy}) is no straight, diagonal or knight's step"
            continue
        which = abs(dx * dy)
        if paid.setdefault(which, c) != c or c <= 0:
            fault = f"({dx}, {dy}) costs {c}, others of its kind {paid[which]}"
        kind[(dx + reach) * side + dy + reach] = which
        cost[(dx + reach) * side + dy + reach] = c
    scale = moves.scale
    if scale not in (1, _PLAIN_GROUND) or any(c % scale for c in moves.costs):
        fault = fault or f"costs {paid} in units of 1/{scale}"
    elif moves.name in _COSTS:
        wrong = [k for k, c in paid.items() if c != scale * _COSTS[moves.name][k]]
        fault = fault or (f"{moves.name} steps cost {paid}" if wrong else "")
    elif moves.name == "octile" and abs(paid[1] ** 2 - 2 * paid[0] ** 2) != scale**2:
        # Straight q, diagonal p: p/q is a convergent of sqrt 2 exactly when this is 1.
        fault = fault or f"{paid[1]}/{paid[0]} is no convergent of sqrt 2"
    if paid.get(0, moves.unit) != moves.unit:
        fault = fault or f"the unit is {moves.unit}, a straight step costs {paid[0]}"
    return _Steps(reach, kind, cost, fault)


@dataclass(frozen=True, slots=True)
class _Fault:
    """A broken rule and the index of the cell, or of the step that leaves it."""

    rule: str
    index: int
    sentence: str


def walk_violation(
    cells: NDArray[np.int32], grid: Grid, robot: Robot, moves: Moves
) -> tuple[_Fault | None, Ints]:
    """The first broken rule of a walk from cell to cell, and the look-up code of each of its steps.

    A walk of one cell has no steps.
    """
    plain = _plainly_legal(cells, grid, robot, moves)
    if plain is not None:
        return None, plain
    none = np.zeros(0, dtype=np.int64)
    x = cells[:, 0].astype(np.int64)
    y = cells[:, 1].astype(np.int64)
    outside = (x < 0) | (x >= grid.width) | (y < 0) | (y >= grid.height)
    if outside.any():
        return _at("outside", cells, outside, f"is outside the map, {grid.width} x {grid.height}"), none
    wall = grid.blocked[y, x]
    if wall.any():
        return _at("wall", cells, wall, "is blocked"), none
    steps = _steps_of(moves)
    dx, dy = x[1:] - x[:-1], y[1:] - y[:-1]
    reach = steps.reach
    near = np.maximum(np.abs(dx), np.abs(dy)) <= reach
    code = np.where(near, (dx + reach) * (2 * reach + 1) + dy + reach, 0)
    kind = steps.kind[code]
    legal = near & (kind >= 0)
    if not legal.all():
        k = int(legal.argmin())
        return _step("step", cells, k, f"is no {moves.name} move"), none
    if robot.radius > 0:
        return _sweep(x, y, dx, dy, cells, grid, robot), code
    if not moves.corner_cutting:
        cut = _cut_corner(x, y, kind, grid)
        if cut is not None:
            return _step("corner", cells, cut, "cuts a blocked corner"), code
    if reach > 1:
        over = _knight_through(x, y, dx, dy, kind, grid)
        if over is not None:
            return _step("knight", cells, over, "passes over a blocked cell"), code
    return None, code


def _plainly_legal(cells: NDArray[np.int32], grid: Grid, robot: Robot, moves: Moves) -> Ints | None:
    """The look-up codes of a walk to neighbours of a robot of one cell that can be seen at once to break no rule; None says
    nothing."""
    steps = _steps_of(moves)
    if steps.reach > 1 or robot.radius > 0 or cells.dtype != np.int32 or not len(cells):
        return None
    wide = grid.width
    # As numbers without a sign those left of the map and above it are very large.
    x, y = np.array(cells.T, dtype=np.int64, order="C")
    if x.view(np.uint64).max() >= wide or y.view(np.uint64).max() >= grid.height:
        return None
    at = y * wide + x
    if grid.blocked.take(at).any():
        return None
    dx, dy = x[1:] - x[:-1] + 1, y[1:] - y[:-1] + 1
    if len(dx) and max(int(dx.view(np.uint64).max()), int(dy.view(np.uint64).max())) > 2:
        return None
    return plain_codes(at, dx, dy, grid, moves)


def plain_codes(at: Ints, dx: Ints, dy: Ints, grid: Grid, moves: Moves) -> Ints | None:
    """The look-up codes of steps to neighbours, where one check of all of them finds them legal; None: undecided.

    Parameters
    ----------
    at : numbers of the cells walked on, row by row of the map, all of them free; (n,).
    dx, dy : each step and 1, which is 0, 1 or 2; (n - 1,).
    moves : with steps to neighbours alone.
    """
    code: Ints = 3 * dx + dy
    if any_true(_steps_of(moves).kind.take(code) < 0):
        return None
    if not moves.corner_cutting:
        # Of a straight step these are its own two cells.
        beside = grid.blocked.take(at[:-1] + dx - 1) | grid.blocked.take(at[1:] - dx + 1)
        if any_true(beside):
            return None
    return code


def _at(rule: str, cells: NDArray[np.int32], bad: NDArray[np.bool_], what: str) -> _Fault:
    k = int(bad.argmax())
    return _Fault(rule, k, f"({cells[k, 0]}, {cells[k, 1]}) {what}")


def _step(rule: str, cells: NDArray[np.int32], k: int, what: str) -> _Fault:
    (x0, y0), (x1, y1) = cells[k].tolist(), cells[k + 1].tolist()
    return _Fault(rule, k, f"the step from ({x0}, {y0}) to ({x1}, {y1}) {what}")


def _cut_corner(x: Ints, y: Ints, kind: NDArray[np.int8], grid: Grid) -> int | None:
    """The first diagonal with a blocked side cell."""
    k = np.flatnonzero(kind == 1)
    if not len(k):
        return None
    cut = grid.blocked[y[k], x[k + 1]] | grid.blocked[y[k + 1], x[k]]
    return int(k[cut.argmax()]) if cut.any() else None


def _knight_through(x: Ints, y: Ints, dx: Ints, dy: Ints, kind: NDArray[np.int8], grid: Grid) -> int | None:
    """The first knight's step whose segment runs through a blocked cell.

    From (0, 0) to (2, 1) the segment leaves through the middle of the shared edge of (1, 0) and (1, 1):
    those two, and no others.
    """
    k = np.flatnonzero(kind == 2)
    if not len(k):
        return None
    sx, sy = np.sign(dx[k]), np.sign(dy[k])
    flat = np.abs(dx[k]) == 2
    straight = grid.blocked[y[k] + np.where(flat, 0, sy), x[k] + np.where(flat, sx, 0)]
    diagonal = grid.blocked[y[k] + sy, x[k] + sx]
    through = straight | diagonal
    return int(k[through.argmax()]) if through.any() else None


def _sweep(
    x: Ints, y: Ints, dx: Ints, dy: Ints, cells: NDArray[np.int32], grid: Grid, robot: Robot
) -> _Fault | None:
    """The first step on which the robot's disc overlaps a wall."""
    first = np.zeros(1, dtype=np.int64)
    hit = first_overlap(grid.blocked, x[first], y[first], disc_cells(robot.radius, grid.resolution))
    if hit is not None:
        what = f"on ({x[0]}, {y[0]}) a radius of {robot.radius:g} m overlaps the wall at ({hit[1]}, {hit[2]})"
        return _Fault("sweep", 0, what)
    worst: tuple[int, int, int] | None = None
    for sx, sy in sorted(set(zip(dx.tolist(), dy.tolist(), strict=True))):
        k = np.flatnonzero((dx == sx) & (dy == sy))
        hit = first_overlap(grid.blocked, x[k], y[k], swept_cells(sx, sy, robot.radius, grid.resolution))
        if hit is not None and (worst is None or int(k[hit[0]]) < worst[0]):
            worst = (int(k[hit[0]]), hit[1], hit[2])
    if worst is None:
        return None
    k0, wx, wy = worst
    what = f"takes a robot of radius {robot.radius:g} m into the wall at ({wx}, {wy})"
    return _step("sweep", cells, k0, what)


def check_path(
    path: Path, grid: Grid, robot: Robot, moves: Moves, start: Cell, goal: Cell
) -> Violation | None:
    """Whether a path is one that this robot may drive from start to goal at the cost it claims.

    Rules, in this order: ``empty``, ``start``, ``goal``, ``moves``, ``outside``, ``wall``, ``step``,
    ``corner``, ``knight``, ``sweep``, ``steps``, ``cost``. For a robot with a radius, corners and knight's
    steps are judged by the swept disc alone.

    Parameters
    ----------
    path : judged.
    grid, robot : walls, and the size of the robot.
    moves : the step set that was asked for; the path's own may be a part of it (a wide robot has no knight's
        steps), and counts in 63rds exactly where the map has terrain.
    start, goal : cells.
    """
    cells = path.cells
    if len(cells) == 0:
        return Violation("empty", "path", "a path has at least one cell")
    for rule, cell, end in (("start", cells[0], start), ("goal", cells[-1], goal)):
        if (int(cell[0]), int(cell[1])) != tuple(end):
            return Violation(rule, "path", f"ends at ({cell[0]}, {cell[1]}); the {rule} is {tuple(end)}")
    broken = moves_violation(path.moves, moves, grid)
    if broken is not None:
        return broken
    fault, code = walk_violation(cells, grid, robot, moves)
    if fault is not None:
        return Violation(fault.rule, f"node {fault.index}", fault.sentence)
    return cost_violation(path, moves, code, grid)


def _in_units(moves: Moves, unit: int) -> Moves:
    """The same moves with a plain step's cost times ``unit``."""
    if moves.scale == unit:
        return moves
    costs = tuple(c // moves.scale * unit for c in moves.costs)
    return replace(moves, costs=costs, unit=moves.unit // moves.scale * unit, scale=unit)


def moves_violation(claimed: Moves, asked: Moves, grid: Grid) -> Violation | None:
    """Whether a path was made with the moves that were asked for, in the costs of its map."""
    fault = _steps_of(asked).fault
    asked = _in_units(asked, 1 if grid.terrain is None else _PLAIN_GROUND)
    if not fault and claimed.scale != asked.scale:
        ground = "without" if grid.terrain is None else "with"
        fault = f"the path counts in units of 1/{claimed.scale} on a map {ground} terrain"
    if not fault and claimed is not asked and claimed != asked:
        paid = dict(zip(asked.offsets, asked.costs, strict=True))
        part = all(paid.get(o) == c for o, c in zip(claimed.offsets, claimed.costs, strict=True))
        if not part or claimed.unit != asked.unit or claimed.name != asked.name:
            fault = f"the path was made with {claimed.name} moves that are no part of {asked.name}"
    return Violation("moves", "path", fault) if fault else None


def cost_violation(path: Path, moves: Moves, code: Ints, grid: Grid) -> Violation | None:
    """Count the steps and add up their costs again, each times what the cell it enters weighs."""
    moves = _in_units(moves, 1)
    steps = _steps_of(moves)
    kind = steps.kind.take(code)
    counted = np.bincount(index_array(kind), minlength=3).tolist()
    stated = [*path.steps, 0, 0, 0][:3]
    if counted != stated or len(path.steps) > 3:
        return Violation(
            "steps",
            "path",
            f"claims {tuple(path.steps)} straights, diagonals and knight's steps; has {counted}",
        )
    ground, weighed = 1, counted
    if grid.terrain is None:
        exact = int(steps.cost.take(code).sum())
    else:
        entered = path.cells[1:]
        weight = _PLAIN_GROUND + grid.terrain[entered[:, 1], entered[:, 0]].astype(np.int64)
        ground, exact = _PLAIN_GROUND, int((steps.cost[code] * weight).sum())
        weighed = [int(weight[kind == k].sum()) for k in (0, 1)]
    if path.exact != exact:
        return Violation("cost", "path", f"claims the exact cost {path.exact}; its steps cost {exact}")
    if moves.name == "octile":
        n, m = weighed[:2]
        value = (n + math.sqrt(2 * m**2)) / ground
    else:
        value = exact / (moves.unit * ground)
    if not abs(path.cost - value) <= 1e-12 * value:
        return Violation("cost", "path", f"claims the cost {path.cost!r}; its steps cost {value!r}")
    return None


def check_plan(plan: Plan, scene: Scene, *, start: Cell | None = None) -> Violation | None:
    """Whether a plan's verdict, path and numbers fit together and fit the scene.

    Rules of its own, before those of :func:`check_path`: ``status`` (a path exactly when found; found, or no
    path, only between cells where the robot can stand; occupied only where it cannot), ``numbers`` (counts
    that are negative), and after them ``gap`` (better than the best), ``gates`` (a gate on the way that is
    not on it), and those of :func:`lampyris.referee.plans.via_points.via_violation`,
    :func:`lampyris.referee.plans.schedule.schedule_violation` and :func:`lampyris.referee.plans.any_angle.lines_violation`.

    Parameters
    ----------
    start : where the robot stood when it was asked; None: the scene's start. That an end is occupied is then
        not questioned: a moving obstacle may stand there.

    A plan with poses is judged by :func:`lampyris.referee.pose_path.check_pose_path` instead.

    A ``no-path`` is not searched again here; the tests compare it with an exhaustive reference.
    """
    if plan.pose_path is not None:
        return check_pose_path(plan, scene)
    broken = _status_violation(plan, scene, start)
    if broken is not None:
        return broken
    if plan.iterations < 0 or plan.expansions < 0:
        return Violation("numbers", "plan", f"{plan.iterations} iterations, {plan.expansions} expansions")
    if start is None:
        broken = via_violation(plan, scene)
        if broken is not None:
            return broken
    if plan.path is None:
        return lines_violation(plan, scene)
    begin = scene.start if start is None else start
    broken = check_path(plan.path, scene.grid, scene.robot, scene.moves, begin, scene.goal)
    if broken is not None:
        return broken
    broken = schedule_violation(plan, scene, from_the_start=start is None)
    if broken is not None:
        return broken
    best = plan.optimal_exact
    if best is not None and not 0 <= best <= plan.path.exact:
        return Violation("gap", "plan", f"costs {plan.path.exact}, less than the optimal cost {best}")
    if plan.gap is not None and not plan.gap >= 0:
        return Violation("gap", "plan", f"the gap is {plan.gap}")
    if plan.sum_cost_to_go is not None and not 0 <= plan.sum_cost_to_go < math.inf:
        return Violation("numbers", "plan", f"the sum of cost-to-go is {plan.sum_cost_to_go}")
    if plan.gates_on_path:
        on_path = set(map(tuple, plan.path.cells.tolist()))
        for gate in plan.gates_on_path:
            if gate.cell not in on_path:
                return Violation("gates", "plan", f"the gate {gate.cell} is not on the path")
    return lines_violation(plan, scene)


def _status_violation(plan: Plan, scene: Scene, start: Cell | None) -> Violation | None:
    if (plan.path is not None) != (plan.status is Status.FOUND):
        held = "no path" if plan.path is None else "a path"
        return Violation("status", "plan", f"{plan.status.value} with {held}")
    if start is not None or plan.status not in _ASKS_ENDS:
        return None
    if plan.path is None and (scene.start_pose is not None or scene.goal_pose is not None):
        return _pose_ends_violation(plan, scene)
    can = {
        "start": stands_free(scene.grid, scene.start, scene.robot.radius),
        "goal": stands_free(scene.grid, scene.goal, scene.robot.radius),
    }
    if plan.status is Status.START_OCCUPIED:
        wrong = can["start"]
    elif plan.status is Status.GOAL_OCCUPIED:
        wrong = can["goal"]
    else:
        wrong = not (can["start"] and can["goal"]) or (
            plan.status is Status.NO_PATH and scene.start == scene.goal and not scene.via
        )
    if not wrong:
        return None
    stated = " and ".join(
        f"the robot {'can' if ok else 'cannot'} stand on the {end}" for end, ok in can.items()
    )
    return Violation("status", "plan", f"{plan.status.value}, but {stated}")


def _pose_ends_violation(plan: Plan, scene: Scene) -> Violation | None:
    """What no planner may say of ends that are poses.

    Planners of the disc around the robot and of its footprint differ, and a lattice moves an end by up to a cell. So what is
    certain is judged: an end is not occupied where the disc and two cells more are free; and no path is sought from where the
    base's cell and all around it are walls. A planner whose paths end exactly where they are asked to
    (``attributes["end_error"]``) is held to the footprint at the pose; and nobody misses a goal whose tolerances the start is in.
    """
    strict = exact_ends_violation(plan, scene)
    if strict:
        return Violation("status", "plan", f"{plan.status.value}, but {strict}")
    occupied = {Status.START_OCCUPIED: ("start", scene.start), Status.GOAL_OCCUPIED: ("goal", scene.goal)}
    stated = ""
    if plan.status in occupied:
        end, cell = occupied[plan.status]
        if stands_free(scene.grid, cell, scene.robot.radius + 2.0 * scene.grid.resolution):
            stated = f"the robot can stand on the {end}"
    elif scene.start_pose == scene.goal_pose and not scene.via:
        stated = "the start is the goal"
    else:
        x, y = scene.start
        if scene.grid.blocked[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2].all():
            stated = "the robot cannot stand on the start"
    return Violation("status", "plan", f"{plan.status.value}, but {stated}") if stated else None


_ASKS_ENDS = (Status.FOUND, Status.NO_PATH, Status.START_OCCUPIED, Status.GOAL_OCCUPIED)
