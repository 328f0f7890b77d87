"""The contract test that every planner must pass, built in or brought along.

In the test file of a planner of your own::

    from lampyris.testing import check_planner

    def test_the_contract():
        check_planner(MyPlanner())

Paths are judged by the referee, costs by a plain search written here; neither shares code with any planner.
"""

from __future__ import annotations

import heapq
import random
from dataclasses import dataclass, replace
from typing import NoReturn

import numpy as np

from lampyris.errors import InputError
from lampyris.field.layers import free_cells, moves_for
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES, Moves
from lampyris.model.plan import Plan, Status
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planners import registry
from lampyris.planners.base import Budget, Planner, Session, Traits
from lampyris.referee import check_path
from lampyris.typing import BoolGrid, Cell

PLENTY = 10**9
"""A budget that no small map uses up."""

_UNFINISHED = {Status.LIMIT, Status.ITERATION_LIMIT}
_CORNERS = (
    ".",
    "#",
    "..",
    "#.",
    ".#.",
    "..|..",
    ".#|#.",
    ".##|#.#|##.",
    "...|##.|...",
    ".#.|.#.|...",
    ".|.|#|.",
)
"""Maps, rows split by ``|``, on which planners tend to slip: every free or blocked pair of ends is asked."""


def check_planner(planner: Planner | str, *, seed: int = 0, cases: int = 20) -> None:
    """Ask a planner many small questions and fail on the first answer that breaks the contract.

    For each step set: tiny maps with every start and goal, then random ones with narrow and wide robots. On
    each: blocked ends, start = goal, goals out of reach; the robot elsewhere (``Change.robot``), obstacles
    for one call only (``Change.obstacles``), walls that stay (``Change.blocked``, ``freed``); budgets; the
    same answers in a second session, and with another generator unless the planner is stochastic.

    What must hold: a found path is legal, starts and ends where asked and is what it claims to cost; the part
    of it to be driven before asking again enters no obstacle; an optimal planner answers exactly as an
    exhaustive search does, any other never says ``no-path`` where there is one, nor ``hemmed-in`` without
    obstacles; a search that fails returns its status, a question that is wrong raises an ``InputError``.

    Parameters
    ----------
    planner : the planner, or the name under which it is registered.
    seed : root of every draw; the same seed asks the same questions.
    cases : random maps for each step set.

    Raises
    ------
    AssertionError : the contract is broken; the message shows the map, the question and the answer.
    """
    asked = registry.make(planner) if isinstance(planner, str) else planner
    _check_settings(asked)
    before = _global_random()
    for index, moves in enumerate(MOVES.values()):
        for rows in _CORNERS:
            _check_all_pairs(asked, rows, moves)
        for case in range(cases):
            rng = np.random.default_rng([seed, index, case])
            scene = _random_scene(rng, moves)
            _Story(asked, scene, f"seed {seed}, {moves.name} moves, case {case}", rng).run()
    _demand(before == _global_random(), f"{asked.name} draws from the global random state, not from its rng")


def cheapest(free: BoolGrid, moves: Moves, start: Cell, goal: Cell) -> int | None:
    """Exact cost of a cheapest way between two free cells, by a plain heap search; None if there is none."""
    height, width = free.shape

    def is_free(x: int, y: int) -> bool:
        return 0 <= x < width and 0 <= y < height and bool(free[y, x])

    best = {start: 0}
    heap = [(0, start)]
    while heap:
        paid, (x, y) = heapq.heappop(heap)
        if (x, y) == goal:
            return paid
        if paid > best[x, y]:
            continue
        for (dx, dy), cost in zip(moves.offsets, moves.costs, strict=True):
            there = (x + dx, y + dy)
            if paid + cost >= best.get(there, PLENTY**2) or not is_free(*there):
                continue
            if all(is_free(x + a, y + b) for a, b in _between(dx, dy, moves.corner_cutting)):
                best[there] = paid + cost
                heapq.heappush(heap, (paid + cost, there))
    return None


def _between(dx: int, dy: int, corner_cutting: bool) -> list[Cell]:
    """Cells that a step needs free besides its end (see Moves)."""
    sx, sy = int(np.sign(dx)), int(np.sign(dy))
    if abs(dx) == abs(dy) == 1:
        return [] if corner_cutting else [(dx, 0), (0, dy)]
    if abs(dx * dy) == 2:
        return [(sx, sy), (sx, 0) if abs(dx) == 2 else (0, sy)]
    return []


# ---- questions and answers -----------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Question:
    """What was asked: the map as it should be by now, where the robot is, what stands in the way."""

    scene: Scene
    walls: BoolGrid
    robot: Cell
    obstacles: frozenset[Cell] = frozenset()
    budget: int | None = None
    label: str = ""

    @property
    def grid(self) -> Grid:
        return replace(self.scene.grid, blocked=self.walls)

    def fail(self, planner: str, plan: object, why: str) -> NoReturn:
        rows = [["#" if b else "." for b in row] for row in self.walls.tolist()]
        for x, y in self.obstacles:
            rows[y][x] = "o"
        (sx, sy), (gx, gy) = self.robot, self.scene.goal
        rows[gy][gx] = "g" if self.walls[gy, gx] else "G"
        rows[sy][sx] = "s" if self.walls[sy, sx] else "S"
        ends = f"from {self.robot} to {self.scene.goal}, {self.scene.moves.name} moves"
        with_what = (
            f"radius {self.scene.robot.radius:g} m, obstacles {sorted(self.obstacles)}, budget {self.budget}"
        )
        picture = ["".join(row) for row in rows]
        asked = f"asked: {self.label}; {ends}, {with_what}"
        raise AssertionError("\n".join([f"{planner}: {why}", asked, *picture, f"answered: {_tell(plan)}"]))


def _tell(plan: object) -> str:
    if not isinstance(plan, Plan):
        return repr(plan)
    cells = None if plan.cells is None else [tuple(c) for c in plan.cells.tolist()]
    return f"{plan.status}, cells {cells}, steps {plan.steps}, expansions {plan.expansions}"


def _ask(planner: Planner, session: Session, q: _Question, change: Change | None = None) -> Plan:
    """The answer to a question, judged."""
    budget = None if q.budget is None else Budget(q.budget)
    try:
        plan = session.plan(change, budget)
    except Exception as error:
        q.fail(planner.name, error, "raises instead of answering")
    _judge(planner, q, plan)
    return plan


def _judge(planner: Planner, q: _Question, plan: Plan) -> None:
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
    best = q.scene.moves.value(static if exact is None else exact)
    demand(plan.path.exact >= static, f"costs {plan.cost} cells, less than the least possible, {best}")
    demand(exact is None or plan.path.exact == exact, f"costs {plan.cost} cells, the optimum is {best}")
    demand(
        plan.optimal_exact in (None, static, exact), f"says the optimum is {plan.optimal_cost}, it is {best}"
    )
    within = q.budget is None or plan.expansions <= q.budget
    demand(within, f"found a path with {plan.expansions} expansions")


def _truth(q: _Question, traits: Traits) -> tuple[set[Status], int | None, int]:
    """The statuses allowed, the exact cost demanded (None: any legal one), and the static optimum (or 0)."""
    free = free_cells(q.grid, q.scene.robot.radius)
    (sx, sy), (gx, gy) = q.robot, q.scene.goal
    if not free[sy, sx]:
        return {Status.START_OCCUPIED}, None, 0
    if not free[gy, gx]:
        return {Status.GOAL_OCCUPIED}, None, 0
    moves = moves_for(q.scene)
    static = cheapest(free, moves, q.robot, q.scene.goal)
    open_now = free.copy()
    for x, y in q.obstacles:
        open_now[y, x] = False
    now = static if not q.obstacles else cheapest(open_now, moves, q.robot, q.scene.goal)
    short = q.budget is not None and q.budget < PLENTY
    late = _UNFINISHED if short or not traits.optimal else set()
    exact = traits.optimal and not (q.obstacles and traits.sees_traffic)
    hemmed = {Status.HEMMED_IN} if q.obstacles and not exact else set()
    if static is None:
        return {Status.NO_PATH} | late | hemmed, None, 0
    if exact:
        return {Status.HEMMED_IN if now is None else Status.FOUND} | late, now, static
    return {Status.FOUND} | late | hemmed, None, static


# ---- the questions of one map ----------------------------------------------------------------------------


class _Story:
    """A robot's life on one map, told to a session, told again to another, and compared."""

    def __init__(self, planner: Planner, scene: Scene, label: str, rng: np.random.Generator) -> None:
        self._planner = planner
        self._scene = scene
        self._label = label
        self._rng = rng
        self._seed = int(rng.integers(2**31))
        self._script: list[tuple[Change | None, _Question]] = []

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
                    first = f"a second session (generator {seed - self._seed} apart) answers {_tell(other)}"
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
        scene, walls = self._scene, self._scene.grid.blocked
        answers: list[Plan] = []

        def ask(what: str, change: Change | None, robot: Cell, built: BoolGrid = walls) -> Plan:
            seen = frozenset() if change is None else change.obstacles
            q = _Question(scene, built, robot, seen, label=f"{self._label}, {what}")
            self._script.append((change, q))
            answers.append(_ask(self._planner, session, q, change))
            return answers[-1]

        first = ask("the first plan", None, scene.start)
        robot = self._somewhere(first)
        plan = ask("the robot elsewhere", Change(robot=robot), robot)
        ask("asked again without a change", None, robot)
        for crowd in (2, 12):
            seen = self._obstacles(plan, robot, crowd)
            ask("with obstacles", Change(obstacles=seen), robot)
        ask("the obstacles gone", Change(), robot)
        wall = self._obstacles(plan, robot, 1)
        built = walls.copy()
        for x, y in wall:
            built[y, x] = True
        ask("a wall built", Change(blocked=tuple(wall)), robot, built)
        ask("the wall still there", None, robot, built)
        ask("the wall torn down", Change(freed=tuple(wall)), robot)
        ask("the robot back at the start", Change(robot=scene.start), scene.start)
        return answers

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
            q = _Question(
                self._scene, self._scene.grid.blocked, self._scene.start, budget=budget, label=label
            )
            _judge(self._planner, q, plan)
            if budget == PLENTY and _essence(plan) != _essence(whole):
                q.fail(self._planner.name, plan, f"without a budget the answer is {_tell(whole)}")


def _essence(plan: Plan) -> tuple[object, ...]:
    """What must be the same every time: all but the timing."""
    cells = None if plan.cells is None else plan.cells.tolist()
    return plan.status, cells, plan.steps, plan.commit, plan.iterations, plan.expansions, plan.detail


def _check_all_pairs(planner: Planner, rows: str, moves: Moves) -> None:
    walls = np.array([[c == "#" for c in row] for row in rows.split("|")])
    height, width = walls.shape
    cells = [(x, y) for y in range(height) for x in range(width)]
    for goal in cells:
        for start in cells:
            scene = Scene(Grid(walls), start, goal, moves)
            q = _Question(scene, walls, start, label="a small map")
            _ask(planner, planner.open(scene, np.random.default_rng(0)), q)


def _random_scene(rng: np.random.Generator, moves: Moves) -> Scene:
    """A map of 2 to 14 cells a side, open to crowded; ends anywhere, some the same; some robots wide."""
    height, width = (int(n) for n in rng.integers(2, 15, size=2))
    walls = rng.random((height, width)) < rng.choice([0.0, 0.15, 0.3, 0.45])
    start, goal = ((int(rng.integers(width)), int(rng.integers(height))) for _ in range(2))
    if rng.random() < 0.1:
        goal = start
    if rng.random() < 0.8:
        walls[start[1], start[0]] = walls[goal[1], goal[0]] = False
    radius = float(rng.choice([0.0, 0.0, 0.0, 0.8]))
    return Scene(Grid(walls), start, goal, moves, Robot(radius=radius))


# ---- the planner itself --------------------------------------------------------------------------------


def _check_settings(planner: Planner) -> None:
    _demand(isinstance(planner, Planner), f"{planner!r} lacks part of lampyris.planners.base.Planner")
    kind = type(planner)
    frozen = getattr(getattr(kind, "__dataclass_params__", None), "frozen", False)
    _demand(frozen, f"{kind.__name__} is not a frozen dataclass: its fields are its settings")
    for word in (planner.name, planner.summary, planner.source):
        _demand(isinstance(word, str) and word.strip(), f"{kind.__name__}: an empty name, summary or source")
    _demand(isinstance(planner.traits, Traits), f"{kind.__name__}.traits is not a Traits")
    session = planner.open(
        Scene(Grid(np.zeros((1, 1), dtype=bool)), (0, 0), (0, 0)), np.random.default_rng(0)
    )
    _demand(isinstance(session, Session), f"{kind.__name__}.open returns {session!r}, which cannot plan")


def _global_random() -> tuple[object, ...]:
    kind, keys, *rest = np.random.get_state(legacy=True)  # noqa: NPY002
    return random.getstate(), kind, np.asarray(keys).tobytes(), rest


def _demand(holds: object, why: str) -> None:
    if not holds:
        raise AssertionError(why)
