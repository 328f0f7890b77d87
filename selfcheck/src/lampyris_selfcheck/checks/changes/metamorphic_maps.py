"""Relations between a map and the same map turned, moved, padded, scaled, or with a wall more."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from lampyris.model.grid import MAX_TERRAIN
from lampyris.model.scene import Scene
from lampyris.typing import Cell
from lampyris_selfcheck.checks.changes.metamorphic_draw import (
    PLAIN,
    CaseResult,
    ask,
    data,
    differ,
    drawn,
    exact_name,
    field_of,
    fields_risen,
    loosely,
    on,
    risen,
)

Turn = Callable[[Any], Any]
_MIRRORS: dict[str, Turn] = {"x": np.fliplr, "y": np.flipud, "diagonal": np.transpose}


def _turned(rng: np.random.Generator, number: int, turn: Turn, word: str) -> CaseResult:
    """Costs are those of the map before, turned."""
    scene = drawn(rng)
    grid = scene.grid
    ends = []
    for x, y in (scene.start, scene.goal):
        mark = np.zeros(grid.blocked.shape, dtype=np.bool_)
        mark[y, x] = True
        v, u = np.argwhere(turn(mark))[0].tolist()
        ends.append((u, v))
    terrain = None if grid.terrain is None else turn(grid.terrain)
    other = on(scene, turn(grid.blocked), terrain, *ends)
    name = exact_name(number)
    one, two = ask(name, scene), ask(name, other)
    wrong = differ(name, one, two) or loosely(number, other, one, "turned")
    if not wrong and not np.array_equal(turn(field_of(scene)), field_of(other)):
        wrong = "the field of the turned map is not the turned field"
    return CaseResult(one.word, wrong, data(scene, turn=word))


def rotate(rng: np.random.Generator, number: int) -> CaseResult:
    """Turned by 90, 180 or 270 degrees."""
    quarters = 1 + int(rng.integers(3))
    return _turned(rng, number, lambda a: np.rot90(a, quarters), f"{90 * quarters} degrees")


def reflect(rng: np.random.Generator, number: int) -> CaseResult:
    """Mirrored along x, y or the diagonal."""
    word = str(rng.choice(list(_MIRRORS)))
    return _turned(rng, number, _MIRRORS[word], word)


def swap(rng: np.random.Generator, number: int) -> CaseResult:
    """On plain ground the way back costs what the way does."""
    scene = drawn(rng, terrain=False)
    back = replace(scene, start=scene.goal, goal=scene.start)
    name = exact_name(number)
    one, two = ask(name, scene), ask(name, back)
    occupied = ("start-occupied", "goal-occupied")
    if one.word in occupied:
        # With both ends occupied it is the start that is named, either way.
        wrong = "" if two.word in occupied else f"{name}: {one.word}, back {two.word}"
    else:
        wrong = differ(name, one, two) or loosely(number, back, one, "back")
    (sx, sy), (gx, gy) = scene.start, scene.goal
    there, home = int(field_of(scene)[sy, sx]), int(field_of(back)[gy, gx])
    # Of blocked ends only the goal is asked of a field.
    if not wrong and one.word not in occupied and there != home:
        wrong = f"in the field it costs {there}, back {home}"
    return CaseResult(one.word, wrong, data(scene))


def _framed(scene: Scene, at: Cell, size: Cell, *, shut: bool) -> Scene:
    """The map in the middle of a larger one, the rest of it blocked, or free and plain."""
    (x, y), (width, height), grid = at, size, scene.grid
    blocked = np.full((height, width), shut, dtype=np.bool_)
    blocked[y : y + grid.height, x : x + grid.width] = grid.blocked
    terrain = None
    if grid.terrain is not None:
        terrain = np.zeros((height, width), dtype=np.uint8)
        terrain[y : y + grid.height, x : x + grid.width] = grid.terrain
    (sx, sy), (gx, gy) = scene.start, scene.goal
    return on(scene, blocked, terrain, (sx + x, sy + y), (gx + x, gy + y))


def _room(rng: np.random.Generator, scene: Scene) -> tuple[Cell, Cell, Cell]:
    """A larger map's size, and two places in it."""
    dx, dy = (int(n) for n in rng.integers(1, 9, 2))
    size = (scene.grid.width + dx, scene.grid.height + dy)
    first = (int(rng.integers(dx + 1)), int(rng.integers(dy + 1)))
    second = (int(rng.integers(dx + 1)), int(rng.integers(dy + 1)))
    return size, first, second


def _inside(scene: Scene, costs: Any, at: Cell) -> Any:
    (x, y), grid = at, scene.grid
    return costs[y : y + grid.height, x : x + grid.width]


def pad_blocked(rng: np.random.Generator, number: int) -> CaseResult:
    """In a border of walls, where there was the map's edge."""
    scene = drawn(rng, wide=False)
    size, at, _ = _room(rng, scene)
    other = _framed(scene, at, size, shut=True)
    name = exact_name(number)
    one, two = ask(name, scene), ask(name, other)
    wrong = differ(name, one, two) or loosely(number, other, one, "in a border of walls")
    costs = field_of(other)
    if not wrong and not np.array_equal(field_of(scene), _inside(scene, costs, at)):
        wrong = "the field is not the same in a border of walls"
    if not wrong and int((costs >= 0).sum()) != int((field_of(scene) >= 0).sum()):
        wrong = "the field goes into the border"
    return CaseResult(one.word, wrong, data(scene, size=size, place=at))


def _one_wall(rng: np.random.Generator, *, free: bool) -> tuple[Scene, Scene, Cell | None]:
    """A scene, the same with a wall more (or fewer), and where; the ends are left alone."""
    scene = drawn(rng)
    blocked = scene.grid.blocked.copy()
    cells = [(int(x), int(y)) for y, x in np.argwhere(blocked == (not free))]
    cells = [c for c in cells if c not in (scene.start, scene.goal)]
    if rng.random() < 0.7:
        # Where it matters: between the ends, or on the way itself.
        (sx, sy), (gx, gy) = scene.start, scene.goal
        between = {(x, y) for x, y in cells if (x - sx) * (x - gx) <= 0 and (y - sy) * (y - gy) <= 0}
        way = set(ask("astar", scene).cells) & set(cells)
        cells = sorted(way or between) or cells
    if not cells:
        return scene, scene, None
    x, y = cells[int(rng.integers(len(cells)))]
    blocked[y, x] = free
    return scene, replace(scene, grid=replace(scene.grid, blocked=blocked)), (x, y)


def _compared(number: int, fewer: Scene, more: Scene, cell: Cell | None) -> CaseResult:
    name = exact_name(number)
    less, worse = ask(name, fewer), ask(name, more)
    wrong = risen(name, less, worse) or loosely(number, more, worse, "with a wall more")
    wrong = wrong or fields_risen(field_of(fewer), field_of(more))
    word = "costlier" if worse.cost > less.cost >= 0 else "cut off" if less.word != worse.word else "the same"
    return CaseResult(word, wrong, data(fewer, wall=cell))


def wall_more(rng: np.random.Generator, number: int) -> CaseResult:
    """A wall more: nothing costs less, and nothing can be reached that could not."""
    scene, other, cell = _one_wall(rng, free=True)
    return _compared(number, scene, other, cell)


def wall_less(rng: np.random.Generator, number: int) -> CaseResult:
    """A wall fewer: nothing costs more, and nothing is cut off that was not."""
    scene, other, cell = _one_wall(rng, free=False)
    return _compared(number, other, scene, cell)


def scale(rng: np.random.Generator, number: int) -> CaseResult:
    """Every cell costs 2 or 4 times as much to enter: so do all ways, exactly."""
    scene = drawn(rng)
    times = int(rng.choice([2, 4]))
    most = (MAX_TERRAIN + PLAIN) // times - PLAIN
    given = np.zeros(scene.grid.blocked.shape, np.int64) if scene.grid.terrain is None else scene.grid.terrain
    terrain = np.minimum(given, most).astype(np.int64)
    scaled = np.where(scene.grid.blocked, 0, times * (PLAIN + terrain) - PLAIN).astype(np.uint8)
    ends = scene.start, scene.goal
    one, two = (on(scene, scene.grid.blocked, t, *ends) for t in (terrain.astype(np.uint8), scaled))
    name = exact_name(number)
    cheap, dear = ask(name, one), ask(name, two)
    due = replace(cheap, cost=times * cheap.cost if cheap.cost >= 0 else -1)
    wrong = differ(name, due, dear) or loosely(number, two, due, "scaled")
    costs = field_of(one)
    if not wrong and not np.array_equal(np.where(costs < 0, -1, times * costs), field_of(two)):
        wrong = f"the field is not {times} times the field"
    return CaseResult(cheap.word, wrong, data(scene, times=times))
