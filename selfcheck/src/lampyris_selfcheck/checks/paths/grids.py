"""Every small grid, every start and goal: each answer is right, to the last step.

The reference is :mod:`lampyris_selfcheck.reference.paths.search`: repeated relaxation, costs as counts of
straights, diagonals and
knight's steps.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from lampyris.errors import SceneError
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES, moves_named
from lampyris.model.scene import Scene
from lampyris.planning.field.solve import solve, solve_field
from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally
from lampyris_selfcheck.checks.paths import grid_lists as lists
from lampyris_selfcheck.checks.paths.answers import Truth, asked, drawn, exact, planner, wrong
from lampyris_selfcheck.checks.paths.grid_lists import GridQuery
from lampyris_selfcheck.reference.paths.search import Cell, Counts, cost_of, distances, verdict

Rows = list[list[bool]]

ALL_PAIRS, CLASS_PAIRS, PARTED = 4_456_448, 582_464, 1_507_848
"""Ordered pairs of free cells on all 4x4 grids, on one grid of each class, and those of all with no way."""
CLASSES = 8_548
OUTSIDE = 512 * (25 * 25 - 9 * 9)
_STRIDE = 100_003
"""Prime to OUTSIDE: a few cases are spread over all."""
_SHARE = 50
"""Drawn 4x4 questions for each planner and step set, at commit size."""


@lru_cache(maxsize=64)
def _grid(width: int, height: int, bits: int) -> tuple[Grid, Rows]:
    free = [[bool(bits >> (y * width + x) & 1) for x in range(width)] for y in range(height)]
    return Grid(~np.array(free)), free


@lru_cache(maxsize=256)
def _known(width: int, height: int, bits: int, moves: str, goal: Cell) -> dict[Cell, Counts]:
    return distances(_grid(width, height, bits)[1], moves, goal)


def _truth(query: GridQuery) -> Truth:
    _, free = _grid(query.width, query.height, query.bits)
    (sx, sy), (gx, gy) = query.start, query.goal
    known: dict[Cell, Counts] = {}
    if free[sy][sx] and free[gy][gx]:
        known = _known(query.width, query.height, query.bits, query.moves, query.goal)
    word = verdict(free, query.start, known, query.goal)
    return Truth(free, word, cost_of(known[query.start], query.moves) if word == "found" else None)


def _judge(query: GridQuery) -> tuple[str, str]:
    """The right word, and what is wrong with the answer or with the field of the goal."""
    grid, _ = _grid(query.width, query.height, query.bits)
    truth = _truth(query)
    scene = Scene(grid, query.start, query.goal, moves_named(query.moves))
    fault = wrong(asked(query.planner, scene), scene, truth)
    if not fault and query.first:
        fault = _field_wrong(scene, query)
    return truth.word, fault


def _field_wrong(scene: Scene, query: GridQuery) -> str:
    """Every cell's cost to the goal in the field, against the reference's."""
    known = _known(query.width, query.height, query.bits, query.moves, query.goal)
    told = solve_field(scene).exact.tolist()
    moves = MOVES[query.moves]
    for y, row in enumerate(told):
        for x, cost in enumerate(row):
            right = moves.exact(known[x, y]) if (x, y) in known else -1
            if cost != right:
                return f"the field has {cost} at ({x}, {y}), should be {right}"
    return ""


def _judge_field(query: GridQuery) -> tuple[str, str]:
    grid, _ = _grid(query.width, query.height, query.bits)
    return "", _field_wrong(Scene(grid, query.start, query.goal, moves_named(query.moves)), query)


def _outside(number: int) -> GridQuery:
    """A 3x3 grid and two ends within one cell of it, one of them outside at least."""
    bits, k = divmod(number * _STRIDE % OUTSIDE, 25 * 25 - 9 * 9)
    ring = [(x, y) for y in range(-1, 4) for x in range(-1, 4)]
    pairs = [(s, g) for s in ring for g in ring if not (_inside(s) and _inside(g))]
    names = exact()
    start, goal = pairs[k]
    return GridQuery(3, 3, bits, start, goal, lists.MOVES[number % 4], names[number // 4 % len(names)])


def _inside(cell: Cell) -> bool:
    return 0 <= cell[0] < 3 and 0 <= cell[1] < 3


def _refused(act: Callable[[], object]) -> str:
    """The code of the SceneError that it raises; nothing if it raises none."""
    try:
        act()
    except SceneError as error:
        return error.code
    return ""


def _judge_outside(query: GridQuery) -> tuple[str, str]:
    """Ends outside are refused, by scene, session and field; a session asked so answers on as before."""
    grid, free = _grid(3, 3, query.bits)
    due = "GOAL_OUTSIDE" if _inside(query.start) else "START_OUTSIDE"
    code = _refused(lambda: Scene(grid, query.start, query.goal, moves_named(query.moves)))
    if code != due:
        return due, f"the scene says {code or 'nothing'}, should be {due}"
    if not _inside(query.goal):
        code = _refused(lambda: solve(~grid.blocked, moves_named(query.moves), query.goal))
        return due, "" if code == "GOAL_OUTSIDE" else f"the field says {code or 'nothing'}"
    scene = Scene(grid, query.goal, query.goal, moves_named(query.moves))
    session = planner(query.planner).open(scene, np.random.default_rng(0))
    code = _refused(lambda: session.plan(Change(robot=query.start)))
    if not code:
        return due, f"a session takes a robot at {query.start}"
    word = "found" if free[query.goal[1]][query.goal[0]] else "start-occupied"
    truth = Truth(free, word, (0, 0) if word == "found" else None)
    fault = wrong(session.plan(), scene, truth)
    return due, f"after a robot outside: {fault}" if fault else ""


def _drawn(ask: Ask, number: int) -> GridQuery:
    """A 4x4 grid of any density, any ends; planners and moves take turns by the number."""
    rng = ask.rng("grids", "4x4-drawn", number)
    walls = rng.random(16) < rng.random() * 0.7
    bits = sum(1 << k for k in range(16) if not walls[k])
    (sx, gx), (sy, gy) = rng.integers(4, size=(2, 2)).tolist()
    names, turn = exact(), number // 4
    return GridQuery(
        4, 4, bits, (sx, sy), (gx, gy), lists.MOVES[number % 4], names[turn % len(names)], turn % 8 == 0
    )


def _judge_counts(number: int) -> tuple[str, str]:
    """That the lists are whole: known totals, counted by other means than the cases are."""
    free = lists.free_cells_of()
    told = {
        "4x4 pairs": (lists.pairs(classes=False), ALL_PAIRS),
        "pairs, cell by cell": (int((free * free).sum()), ALL_PAIRS),
        "classes": (len(lists.class_heads(4)), CLASSES),
        "pairs of classes": (lists.pairs(classes=True), CLASS_PAIRS),
        "parted pairs": (lists.parted_pairs(), PARTED),
        "classes of 4x4, by symmetry": (lists.classes(4), CLASSES),
        "classes of 5x5, by symmetry": (lists.classes(5), lists.CLASSES_5X5),
    }
    off = [f"{what}: {have:,}, should be {due:,}" for what, (have, due) in told.items() if have != due]
    return "counts", "; ".join(off)


def _query(ask: Ask, kind: str, number: int) -> GridQuery:
    if kind in ("4x4", "4x4-classes"):
        return lists.pair(number, classes=kind == "4x4-classes")
    if kind == "4x4-drawn":
        return _drawn(ask, number)
    if kind == "5x5-classes":
        return lists.field(number)
    if kind == "outside":
        return _outside(number)
    if kind == "1xn":
        return lists.corridor(number)
    width, height = (int(n) for n in kind.split("x"))
    return lists.rectangle(width, height, number)


_JUDGES = {"outside": _judge_outside, "5x5-classes": _judge_field}


def _run(ask: Ask, part: Part) -> Outcome:
    tally = Tally(part)
    for number in part.numbers:
        if part.kind == "counts":
            word, fault = _judge_counts(number)
            tally.case(word)
            if fault:
                tally.fail(number, fault)
            continue
        query = _query(ask, part.kind, number)
        word = ""
        try:
            word, fault = _JUDGES.get(part.kind, _judge)(query)
        except Exception as error:
            fault = f"raises {type(error).__name__}: {error}"
        tally.case(*filter(None, (word, f"{query.moves} moves", f"by {query.planner}")))
        if query.first:
            tally.count("fields, every cell")
        if fault:
            rows = drawn(_grid(query.width, query.height, query.bits)[1])
            tally.fail(
                number,
                f"{query.planner}, {query.moves} moves, {query.start} to {query.goal} on {rows}: {fault}",
                rows=rows,
                start=query.start,
                goal=query.goal,
                moves=query.moves,
                planner=query.planner,
            )
    return tally.outcome()


def _exhaustive(what: str, queries: int, commit: int) -> Kind:
    """With every commit some queries, each once; nightly all of them for twelve rounds, for a release for all
    rounds: by each planner with all moves.
    """
    whole = queries * lists.rounds()
    return Kind(what, commit, queries * min(12, lists.rounds()), whole, chunk=4096, whole=whole)


def _kinds(ask: Ask) -> dict[str, Kind]:
    combos = lists.rounds()
    classes, every = lists.pairs(classes=True), lists.pairs(classes=False)
    ends = "blocked ends too"
    return {
        "3x3": _exhaustive(f"every start and goal of every 3x3 grid, {ends}", lists.rectangles(3, 3), 8_192),
        "2x4": _exhaustive(f"the same for 2 columns and 4 rows, {ends}", lists.rectangles(2, 4), 4_096),
        "4x2": _exhaustive(f"the same for 4 columns and 2 rows, {ends}", lists.rectangles(4, 2), 1_536),
        "1xn": _exhaustive(f"the same for corridors of 1 to 8 cells, {ends}", lists.corridors(), 4_096),
        "outside": Kind(
            "ends outside a 3x3 grid are refused and spoil nothing", 1_000, OUTSIDE, OUTSIDE, 4096, OUTSIDE
        ),
        "counts": Kind("the 4x4 lists hold what other means count", 1, 1, 1, 1, 1),
        "4x4-drawn": Kind(
            "drawn questions on 4x4 grids to each planner with each step set",
            commit=_SHARE * combos,
            nightly=40 * _SHARE * combos,
            release=400 * _SHARE * combos,
            chunk=4096,
        ),
        "4x4-classes": Kind(
            "every pair of free cells of each class of 4x4 grids under turning and mirroring; octile moves, "
            "for a release the others too",
            commit=0,
            nightly=classes,
            release=4 * classes,
            chunk=8192,
            whole=classes * combos,
        ),
        "4x4": Kind(
            "every pair of free cells of all 65,536 4x4 grids; octile moves first",
            commit=0,
            nightly=0,
            release=every,
            chunk=8192,
            whole=every * combos,
        ),
        "5x5-classes": Kind(
            "every cost in the field of each class of 5x5 grids, to one free cell; octile moves first",
            commit=0,
            nightly=0,
            release=lists.CLASSES_5X5,
            chunk=1 << 14,
            whole=lists.fields(),
        ),
    }


CHECK = Check(
    "grids",
    ("G1",),
    "every small grid, every start and goal: verdict, ends, steps, corners and exact cost are right",
    _kinds,
    _run,
)
