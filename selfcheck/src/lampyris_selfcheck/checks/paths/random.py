"""Drawn maps and questions: each answer is right, exactly; so is every cell of the field.

The reference is SciPy's Dijkstra with whole numbers for costs (:mod:`.grid_costs`). Some questions share a
map; a question is drawn from its own number, its map from the number's group, so any part can be run alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from lampyris.planning.field.layers import moves_for
from lampyris.planning.field.solve import solve_field
from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally
from lampyris_selfcheck.checks.paths import worlds
from lampyris_selfcheck.checks.paths.answers import asked, drawn, exact, own, wrong
from lampyris_selfcheck.checks.paths.grid_costs import parts_of
from lampyris_selfcheck.checks.paths.worlds import SmallWorld
from lampyris_selfcheck.reference.paths.search import Cell

MOVES = ("octile", "dissertation", "four-connected", "sixteen-connected")
SMALLEST, SMALL, LARGE, OTHERS = 5, 64, 512, 32
"""Least side of a map; greatest of the small, of the large, and of those for planners that are not exact."""
OCTAVES = 3
"""Ranges of large maps' sides; each begins where it is twice as far: 65, 130, 260."""
SHARED = {"plain": 20, "rough": 20, "large": 40, "others": 20}
"""How many questions share a map."""
GOALS = {"plain": 4, "rough": 4, "large": 2, "others": 4}
SAME, START_BLOCKED, GOAL_BLOCKED = 0.02, 0.07, 0.12
"""Start = goal, of these one in ten on a blocked cell; then 10 % with one blocked end."""
SHOWN = 40 * 40
"""Cells of the largest map that a failure tells whole; others are known by their number."""


@lru_cache(maxsize=2)
def _world(ask: Ask, kind: str, group: int) -> SmallWorld:
    rng = ask.rng("random", f"{kind} map", group)
    width, height = _sides(rng, kind)
    rough = kind == "rough" or (kind != "plain" and group % 2 == 1)
    return worlds.made(rng, width, height, MOVES[group // 2 % 4], rough=rough, goals=GOALS[kind])


def _sides(rng: np.random.Generator, kind: str) -> tuple[int, int]:
    if kind == "large":
        # As many from 65 to 129 as from 130 to 259 and from there on: the largest take a hundred times as
        # long. By whole numbers only: the last bit of exp and log is the processor's.
        lows = (SMALL + 1) << rng.integers(OCTAVES, size=2)
        sides = rng.integers(lows, np.minimum(2 * lows, LARGE + 1))
    else:
        sides = rng.integers(SMALLEST, (OTHERS if kind == "others" else SMALL) + 1, size=2)
    return int(sides[0]), int(sides[1])


@dataclass(frozen=True)
class RandomQuestion:
    """Two ends, the goal's number in the world (-1: it is blocked), who is asked."""

    start: Cell
    goal: Cell
    index: int
    planner: str


def _question(ask: Ask, kind: str, number: int, world: SmallWorld) -> RandomQuestion:
    rng = ask.rng("random", kind, number)
    names = own(False) if kind == "others" else exact()
    group, member = divmod(number, SHARED[kind])
    planner = names[(group + member) % len(names)]
    free, draw = world.free, rng.random()
    if not world.goals:
        height, width = free.shape
        ends = [(int(rng.integers(width)), int(rng.integers(height))) for _ in range(2)]
        return RandomQuestion(ends[0], ends[1], -1, planner)
    index = member % len(world.goals)
    goal = world.goals[index]
    walled = not free.all()
    if draw < SAME:
        end = worlds.one(rng, ~free) if draw < SAME / 10 and walled else goal
        return RandomQuestion(end, end, index, planner)
    if draw < START_BLOCKED and walled:
        return RandomQuestion(worlds.one(rng, ~free), goal, index, planner)
    if draw < GOAL_BLOCKED and walled:
        return RandomQuestion(worlds.one(rng, free), worlds.one(rng, ~free), -1, planner)
    return RandomQuestion(worlds.one(rng, free), goal, index, planner)


def _field_wrong(world: SmallWorld, index: int) -> str:
    """Every cell's cost to a goal in the field, against the reference."""
    scene = worlds.scene_of(world, world.goals[index], world.goals[index])
    moves = moves_for(scene)
    n, m = parts_of(world.costs[index], moves.name)
    if moves.name == "octile":
        right = (n * moves.straight + m * moves.diagonal) // moves.scale
    else:
        # The reference counts tenths of a cell, four moves of ours whole ones.
        right = n * (moves.straight // moves.scale) // 10
    told = solve_field(scene).exact
    off = told != np.where(world.costs[index] < 0, -1, right)
    if not off.any():
        return ""
    y, x = np.argwhere(off)[0].tolist()
    return f"the field has {told[y, x]} at ({x}, {y}), should be {right[y, x]}"


def _judge(ask: Ask, kind: str, number: int) -> tuple[RandomQuestion, SmallWorld, str, str]:
    """The question, its world, the right word and what is wrong."""
    world = _world(ask, kind, number // SHARED[kind])
    question = _question(ask, kind, number, world)
    truth = worlds.truth(world, question.start, question.goal, question.index)
    scene = worlds.scene_of(world, question.start, question.goal)
    rng = ask.rng("random", f"{kind} planner", number) if kind == "others" else None
    try:
        plan = asked(question.planner, scene, rng)
        fault = wrong(plan, scene, truth, optimal=kind != "others")
        word = plan.status.value if kind == "others" and not fault else truth.word
        if not fault and number % SHARED[kind] < len(world.goals):
            fault = _field_wrong(world, number % SHARED[kind])
    except Exception as error:
        word, fault = truth.word, f"raises {type(error).__name__}: {error}"
    return question, world, word, fault


def _run(ask: Ask, part: Part) -> Outcome:
    tally = Tally(part)
    for number in part.numbers:
        question, world, word, fault = _judge(ask, part.kind, number)
        scene = world.scene
        tally.case(
            word,
            f"{scene.moves.name} moves",
            f"by {question.planner}",
            *(["rough ground"] if world.terrain is not None else []),
            *(["robot with a size"] if world.wide else []),
            *(["start = goal"] if question.start == question.goal else []),
        )
        if number % SHARED[part.kind] < len(world.goals):
            tally.count("fields, every cell")
        if fault:
            told = f"{question.planner}, {scene.moves.name} moves, {question.start} to {question.goal}, "
            size = f"{scene.grid.width} x {scene.grid.height} cells, radius {scene.robot.radius:g} m"
            tally.fail(number, f"{told}{size}: {fault}", **_data(question, world))
    return tally.outcome()


def _data(question: RandomQuestion, world: SmallWorld) -> dict[str, object]:
    grid = world.scene.grid
    small = grid.blocked.size <= SHOWN
    return {
        "start": question.start,
        "goal": question.goal,
        "planner": question.planner,
        "moves": world.scene.moves.name,
        "radius": world.scene.robot.radius,
        "resolution": grid.resolution,
        "rows": drawn((~grid.blocked).tolist()) if small else None,
        "terrain": grid.terrain.tolist() if small and grid.terrain is not None else None,
    }


def _kind(what: str, commit: int, nightly: int, chunk: int) -> Kind:
    return Kind(what, commit, nightly, 10 * nightly, chunk)


KINDS = {
    "plain": _kind("5 to 64 cells a side, plain ground: exact planners", 1_500, 462_500, 2_000),
    "rough": _kind("the same on ground that costs more", 300, 462_500, 2_000),
    "large": _kind("65 to 512 cells a side, plain and rough: exact planners", 200, 50_000, 200),
    "others": _kind("5 to 32 cells a side: planners that are not exact keep to the bounds", 200, 25_000, 200),
}
CHECK = Check(
    "random",
    ("G4",),
    "drawn maps and ends: verdict, ends, steps, corners and exact cost are right",
    KINDS,
    _run,
)
