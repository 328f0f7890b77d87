"""Drawn scenes, and what is asked of them, for relations between the answers to two questions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning.base import Planner
from lampyris.planning.field.solve import solve_field
from lampyris.referee import check_plan
from lampyris.typing import Cell
from lampyris_selfcheck.checks.paths import drawn_maps as maps
from lampyris_selfcheck.checks.paths.answers import exact, own, planner

PLAIN = 63
"""Costs are compared in 63rds: what plain ground weighs on a map with terrain."""
GIVES_UP = ("limit", "iteration-limit")

Ints = NDArray[np.int64]


@dataclass(frozen=True)
class SearchAnswer:
    """How a search ended, and the exact cost of the way in 63rds of the step set's unit; -1: no way."""

    word: str
    cost: int
    cells: tuple[Cell, ...] = ()


@dataclass(frozen=True)
class CaseResult:
    """What came of one case.

    Parameters
    ----------
    word : a property of the case, so that it shows how varied they were.
    wrong : what does not hold; nothing if all does.
    data : the case.
    """

    word: str
    wrong: str
    data: Mapping[str, Any]


Relation = Callable[[np.random.Generator, int], CaseResult]


def drawn(
    rng: np.random.Generator,
    *,
    most: int = 20,
    terrain: bool = True,
    wide: bool = True,
    moves: str = "",
) -> Scene:
    """A scene of 2 to ``most`` cells a side; one end in ten may be blocked."""
    height, width = (int(n) for n in rng.integers(2, most + 1, 2))
    blocked = maps.walls(rng, width, height)
    start, goal = ((int(rng.integers(width)), int(rng.integers(height))) for _ in range(2))
    for x, y in (start, goal):
        if rng.random() < 0.9:
            blocked[y, x] = False
    ground = maps.terrain(rng, blocked) if terrain and rng.random() < 0.4 else None
    radius = float(rng.choice([0.8, 1.3])) if wide and rng.random() < 0.15 else 0.0
    name = moves or str(rng.choice(list(MOVES)))
    return Scene(Grid(blocked, terrain=ground), start, goal, MOVES[name], Robot(radius=radius))


def on(scene: Scene, blocked: Any, terrain: Any, start: Cell, goal: Cell) -> Scene:
    """The same question on another map."""
    return replace(scene, grid=Grid(blocked, terrain=terrain), start=start, goal=goal)


def exact_name(number: int) -> str:
    """An exact planner; they take turns."""
    names = exact()
    return names[number % len(names)]


def loose_name(number: int) -> str:
    """One that is not exact, for one case in eight; else nothing."""
    names = own(False)
    return names[number // 8 % len(names)] if number % 8 == 0 else ""


def ask(name: str, scene: Scene) -> SearchAnswer:
    """The answer of our planner of that name, past the referee."""
    return ask_with(planner(name), scene)


def ask_with(chosen: Planner, scene: Scene) -> SearchAnswer:
    """The same of a planner.

    Raises
    ------
    AssertionError : the referee refuses it.
    """
    plan = chosen.open(scene, np.random.default_rng(0)).plan()
    broken = check_plan(plan, scene)
    if broken is not None:
        raise AssertionError(f"{chosen.name}: the referee says: {broken}")
    if plan.path is None:
        return SearchAnswer(plan.status.value, -1)
    cells = tuple((int(x), int(y)) for x, y in plan.path.cells.tolist())
    return SearchAnswer(plan.status.value, plan.path.exact * (PLAIN // plan.path.moves.scale), cells)


def field_of(scene: Scene) -> Ints:
    """Cost of every cell to the goal, in 63rds; -1 where there is no way."""
    field = solve_field(scene)
    costs = field.exact.astype(np.int64)
    scaled: Ints = np.where(costs < 0, -1, costs * (PLAIN // field.moves.scale))
    return scaled


def loosely(number: int, scene: Scene, best: SearchAnswer, label: str) -> str:
    """Whether a planner that is not exact agrees with the best there is: no better, and no other verdict."""
    name = loose_name(number)
    if not name:
        return ""
    told = ask(name, scene)
    if told.word != best.word and not (best.word == "found" and told.word in GIVES_UP):
        return f"{name}, {label}: {told.word}, should be {best.word}"
    if told.word == "found" and told.cost < best.cost:
        return f"{name}, {label}: costs {told.cost}, less than the least, {best.cost}"
    return ""


def differ(name: str, one: SearchAnswer, other: SearchAnswer) -> str:
    """What is not the same of two answers that should be."""
    if (one.word, one.cost) == (other.word, other.cost):
        return ""
    return f"{name}: {one.word} at {one.cost}, then {other.word} at {other.cost}"


def risen(name: str, less: SearchAnswer, more: SearchAnswer) -> str:
    """What is wrong where an answer should not be better than another: no way where there was none, no less
    cost."""
    if more.word == "found" and less.word != "found":
        return f"{name}: {less.word}, and with more in the way found at {more.cost}"
    if more.word == "found" and more.cost < less.cost:
        return f"{name}: costs {less.cost}, and with more in the way {more.cost}"
    return ""


def fields_risen(less: Ints, more: Ints) -> str:
    """The same of every cell of two fields."""
    bad = (more >= 0) & ((less < 0) | (more < less))
    return f"the field falls at {np.argwhere(bad)[0][::-1].tolist()}" if bad.any() else ""


def data(scene: Scene, **more: Any) -> dict[str, Any]:
    """A scene in words of JSON."""
    grid = scene.grid
    return {
        "rows": ["".join(".#"[int(b)] for b in row) for row in grid.blocked],
        "terrain": None if grid.terrain is None else grid.terrain.tolist(),
        "moves": scene.moves.name,
        "radius": scene.robot.radius,
        "ends": [scene.start, scene.goal],
        **more,
    }
