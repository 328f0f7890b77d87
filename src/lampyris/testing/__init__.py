"""The contract test that every planner must pass, built in or your own.

In the test file of your planner::

    from lampyris.testing import check_planner

    def test_the_contract():
        check_planner(MyPlanner())

Paths are judged by the referee, costs by a plain search written for it; neither shares code with any planner.
"""

from __future__ import annotations

import random
from dataclasses import replace

import numpy as np

from lampyris.model.grid import MAX_TERRAIN, Grid
from lampyris.model.moves import MOVES, Moves
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning import registry
from lampyris.planning.base import Planner, Session, Traits
from lampyris.testing.overlap import check_overlap
from lampyris.testing.questions import Failures, Question, ask
from lampyris.testing.search import cheapest
from lampyris.testing.story import Story

__all__ = ["cheapest", "check_planner"]

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
    "19|9.",
    ".9.|...",
    "9.#|.1.",
)
"""Maps, rows split by ``|``, that reveal common faults: every pair of ends is tried, free or blocked. A digit is
terrain, 9 five times as costly as plain ground.
"""


def check_planner(planner: Planner | str, *, seed: int = 0, cases: int = 20) -> None:
    """Ask a planner many small questions and report every rule of the planner contract that it breaks.

    For each step set: tiny maps with every start and goal, then random ones with narrow and wide robots. On
    each: blocked ends, start = goal, goals out of reach; the robot elsewhere (``Change.robot``), obstacles
    for one call only (``Change.obstacles``), walls that stay (``Change.blocked``, ``freed``); budgets; the
    same answers in a second session, and with another generator unless the planner is stochastic. On some
    maps, and on all of them in the end (``Change.terrain``), cells have terrain.

    What must hold: a found path is legal, starts and ends where asked and is what it claims to cost; the part
    of it to be driven before asking again enters no obstacle; an optimal planner answers exactly as an
    exhaustive search does, any other never says ``no-path`` where there is one, nor ``hemmed-in`` without
    obstacles; a search that fails returns its status, a question that is wrong raises an ``InputError``; a
    call during another call of the same session, from another thread or from within, raises ``BusyError``.

    Parameters
    ----------
    planner : the planner, or the name under which it is registered.
    seed : root of every draw; the same seed asks the same questions.
    cases : random maps for each step set.

    Raises
    ------
    AssertionError : the contract is broken; for each broken rule the message has an example (the map, the
        question and the answer) and how often the rule was broken.

    Examples
    --------
    >>> from lampyris.planning.graph.astar import AStar
    >>> check_planner(AStar(), cases=1)
    """
    tested = registry.make(planner) if isinstance(planner, str) else planner
    _check_settings(tested)
    failures = Failures(tested.name)
    before = _global_random()
    for index, moves in enumerate(MOVES.values()):
        for rows in _CORNERS:
            _check_all_pairs(tested, rows, moves, failures)
        for case in range(cases):
            rng = np.random.default_rng([seed, index, case])
            scene = _random_scene(rng, moves)
            if case % 3 == 2:
                scene = _with_terrain(scene, np.random.default_rng([seed, index, case, 1]))
            Story(tested, scene, f"seed {seed}, {moves.name} moves, case {case}", rng, failures).run()
    check_overlap(tested, failures)
    if before != _global_random():
        failures.add("draws from the global random state, not from its rng")
    _demand(not failures.report(), failures.report())


def _check_all_pairs(planner: Planner, rows: str, moves: Moves, failures: Failures) -> None:
    letters = [list(row) for row in rows.split("|")]
    walls = np.array([[c == "#" for c in row] for row in letters])
    ground = np.array([[28 * int(c) if c.isdigit() else 0 for c in row] for row in letters])
    grid = Grid(walls, terrain=ground)
    cells = [(x, y) for y in range(grid.height) for x in range(grid.width)]
    for goal in cells:
        for start in cells:
            scene = Scene(grid, start, goal, moves)
            q = Question(scene, grid, start, label="a small map")
            ask(planner, planner.open(scene, np.random.default_rng(0)), q, None, failures)


def _random_scene(rng: np.random.Generator, moves: Moves) -> Scene:
    """A map of 2 to 14 cells a side, open to cluttered; ends anywhere, some equal; some robots wide."""
    height, width = (int(n) for n in rng.integers(2, 15, size=2))
    walls = rng.random((height, width)) < rng.choice([0.0, 0.15, 0.3, 0.45])
    start, goal = ((int(rng.integers(width)), int(rng.integers(height))) for _ in range(2))
    if rng.random() < 0.1:
        goal = start
    if rng.random() < 0.8:
        walls[start[1], start[0]] = walls[goal[1], goal[0]] = False
    radius = float(rng.choice([0.0, 0.0, 0.0, 0.8]))
    return Scene(Grid(walls), start, goal, moves, Robot(radius=radius))


def _with_terrain(scene: Scene, rng: np.random.Generator) -> Scene:
    """The same with terrain in few cells or in many."""
    shape = scene.grid.blocked.shape
    terrain = rng.integers(0, MAX_TERRAIN + 1, shape) * (rng.random(shape) < rng.random())
    return replace(scene, grid=replace(scene.grid, terrain=terrain.astype(np.uint8)))


# ---- the planner itself --------------------------------------------------------------------------------


def _check_settings(planner: Planner) -> None:
    _demand(isinstance(planner, Planner), f"{planner!r} lacks part of lampyris.planning.base.Planner")
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
