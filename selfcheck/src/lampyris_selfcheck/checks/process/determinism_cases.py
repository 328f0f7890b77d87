"""The corpus: small work of every kind, each case drawn from its number alone and hashed with every bit.

A case never changes with seed or size: its hash is kept in ``golden.json`` and compared on every machine.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label

from lampyris import api
from lampyris._core import elementary
from lampyris.errors import InternalFault, LampyrisError
from lampyris.io.maps.recipes.draw import Draw
from lampyris.io.maps.recipes.make import make_ground
from lampyris.model.drive import Drive
from lampyris.model.edit import Edit
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.obstacles import ObstacleStates
from lampyris.model.plan import Plan
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.trace import Trace
from lampyris.model.traffic import Recorded
from lampyris.planning import registry
from lampyris.planning.field.layers import clearance, free_cells, free_space
from lampyris.planning.field.solve import solve_field
from lampyris.planning.swarm.optimisers.functions import FUNCTIONS
from lampyris.planning.swarm.optimisers.glowworm import GSO, igso
from lampyris.planning.swarm.optimisers.loop import Optimiser, StoppingRule, maximise
from lampyris.planning.swarm.optimisers.particle import PSO, apso
from lampyris.sim.traffic.adversary import Adversary
from lampyris.sim.traffic.mobility import drawn_traffic
from lampyris_selfcheck.checks.process.canonical import digest
from lampyris_selfcheck.checks.studies.small_studies import small

ROOT = 14
"""First word of every draw; another makes another corpus."""

PLANNERS = (
    "ad-gso", "apso", "astar", "bidirectional-astar", "dijkstra", "dstar", "dstar-lite", "dstar-lpso",
    "dstar16-lpso", "fastest", "focussed-dstar", "gso", "igso", "ipso", "jps", "lazy-theta-star", "lpa-star",
    "lpso", "mmas-dstar", "pso", "pso-apf", "sipp", "space-time-astar", "theta-star",
)  # fmt: skip
LATER = (
    "ant-system", "bit-star", "diversity-pso", "fastest-time", "informed-rrt-star", "quadtree", "rrt", "rrt-connect",
    "rrt-star", "visibility-graph", "voronoi",
)  # fmt: skip
"""Planners that came after the first 500 cases were kept: their plans are the cases from there on."""
LAWS = (
    "physical", "dissertation", "uncertainty", "blind", "three-speed", "cloud", "rpp", "constant", "optimum",
)  # fmt: skip
MINDFUL = ("cloud", "three-speed", "blind")
"""Laws that say little where nothing moves."""
RECIPES = ("caves", "gates", "hills", "maze", "office", "random", "rooms", "street", "warehouse")
FEW = {"swarm": 8, "iterations": 5, "particles": 6, "rounds": 3, "samples": 300}
"""A swarm that is soon done; each of its steps is as many numbers as a long one's."""

ROUND = (
    "plan", "profile", "plan", "field", "numbers", "simulation", "plan", "profile", "plan", "drive",
    "plan", "profile", "plan", "field", "plan", "simulation", "plan", "recipe", "plan", "study",
)  # fmt: skip
"""Kinds of work, case by case, again and again."""
FIRST = 500
"""Cases that are drawn so; each planner of ``LATER`` has one after the other, in turns."""

Case = tuple[str, Any]
"""What it was, and its result."""


def case(number: int) -> tuple[str, str]:
    """What case ``number`` is, and the SHA-256 of its result; of a refusal, of its code and words."""
    kind = ROUND[number % len(ROUND)]
    turn = number // len(ROUND) * ROUND.count(kind) + ROUND[: number % len(ROUND)].count(kind)
    if number >= FIRST:
        kind, turn = "later plan", number - FIRST
    rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence((ROOT, number))))
    name = ""
    try:
        name, work = _KINDS[kind](rng, turn)
        result = work()
    except InternalFault:
        raise
    except LampyrisError as refused:
        return " ".join(filter(None, (kind, name, "refused"))), digest([refused.code, str(refused)])
    return " ".join((kind, name, *_ended(result))), digest(result)


def _ended(result: Any) -> list[str]:
    """In a word how it ended, where it has an end."""
    one = result[0] if isinstance(result, tuple) else result
    if isinstance(one, Plan):
        return [str(one.status)]
    return [str(one.outcome)] if isinstance(one, Trace | Drive) else []


Work = tuple[str, Callable[[], Any]]


def _grid(rng: np.random.Generator, *, plain: bool = False, least: int = 8, most: int = 32) -> Grid:
    """Noise or a recipe's; rough ground on every third map unless ``plain``."""
    width, height = (int(n) for n in rng.integers(least, most + 1, 2))
    if rng.integers(3):
        blocked = rng.random((height, width)) < 0.05 + 0.25 * float(rng.random())
    else:
        recipe = ("random", "maze", "rooms", "caves")[int(rng.integers(4))]
        blocked = make_ground(recipe, max(width, 12), max(height, 12), int(rng.integers(2**31))).blocked
    blocked = np.where(blocked.all(), False, blocked)
    terrain: NDArray[np.uint8] | None = None
    if not plain and rng.integers(3) == 0:
        terrain = np.where(blocked, 0, rng.integers(0, 253, blocked.shape)).astype(np.uint8)
    resolution = (1.0, 0.05, 0.37, 0.1)[int(rng.integers(4))]
    yaw = (0.0, 0.3, -2.1)[int(rng.integers(3))]
    return Grid(blocked, terrain=terrain, resolution=resolution, origin=(-1.5, 0.25, yaw))


def _scene(rng: np.random.Generator, grid: Grid, **more: Any) -> Scene:
    """Two cells, mostly with a way from one to the other for the robot; it has a size in half of them."""
    wide = (0.0, 0.0, 0.4, 0.8)[int(rng.integers(4))] * grid.resolution
    moves = MOVES[
        ("octile", "octile", "dissertation", "four-connected", "sixteen-connected")[int(rng.integers(5))]
    ]
    said: dict[str, Any] = {"moves": moves, "robot": Robot(radius=wide)} | more
    free = free_cells(grid, said["robot"].radius)
    if not free.any() or rng.integers(12) == 0:
        free = ~grid.blocked
    region, _ = label(free)
    at = np.argwhere(region)
    sy, sx = at[rng.integers(len(at))].tolist()
    if rng.integers(4):
        at = np.argwhere(region == region[sy, sx])
    gy, gx = at[rng.integers(len(at))].tolist()
    return Scene(grid, (sx, sy), (gx, gy), **said)


def _few(planner: str) -> dict[str, Any]:
    known = registry.settings_of(registry.planner_class(planner))
    return {name: value for name, value in FEW.items() if name in known}


def _plan(rng: np.random.Generator, turn: int) -> Work:
    return _plan_by(PLANNERS[turn % len(PLANNERS)], rng)


def _later_plan(rng: np.random.Generator, turn: int) -> Work:
    return _plan_by(LATER[turn % len(LATER)], rng)


def _plan_by(planner: str, rng: np.random.Generator) -> Work:
    scene = _scene(rng, _grid(rng))
    settings = _few(planner)
    if planner == "ad-gso":
        settings["choice"] = ("greedy", "roulette", "exact")[int(rng.integers(3))]
    seed = int(rng.integers(2**31))

    def work() -> Any:
        found = api.plan(scene, planner, seed=seed, **settings)
        if found.path is None:
            return found
        return found, found.path.arc, found.path.heading, scene.grid.to_metres(found.path.cells)

    return f"{planner} {scene.moves.name}", work


def _field(rng: np.random.Generator, turn: int) -> Work:
    scene = _scene(rng, _grid(rng, most=40))
    if turn % 2:
        return "clearance", lambda: clearance(scene.grid)
    return f"{scene.moves.name}", lambda: (solve_field(scene), free_space(scene))


def _movers(rng: np.random.Generator, grid: Grid) -> ObstacleStates:
    count = int(rng.integers(1, 4))
    xy = rng.random((count, 2)) * [grid.width, grid.height]
    return ObstacleStates(
        xy, np.full(count, 0.3 * grid.resolution), 0.2 + rng.random(count), rng.random((count, 2)) - 0.5
    )


def _profile(rng: np.random.Generator, turn: int) -> Work:
    law = LAWS[turn % len(LAWS)]
    grid = _grid(rng, plain=True, most=24)
    zones = 0.2 + rng.random(grid.blocked.shape) if rng.integers(3) == 0 else None
    robot = Robot(radius=0.3 * grid.resolution, jerk_max=2.0 if rng.integers(4) == 0 else None)
    scene = _scene(rng, grid, zones=zones, robot=robot)
    smooth = ("none", "straight", "arcs")[int(rng.integers(3))]
    movers = _movers(rng, grid) if law in MINDFUL or rng.integers(2) else None

    def work() -> Any:
        found = api.plan(scene, "astar")
        if found.path is None:
            return found
        way = found.path if smooth == "none" else api.smooth(scene, found, method=smooth)  # type: ignore[arg-type]
        return way, api.speed_profile(scene, way, law, obstacle_states=movers)

    return f"{law} {smooth}", work


def _among(rng: np.random.Generator, most: int) -> Scene:
    """A scene with moving obstacles of some kind."""
    grid = _grid(rng, plain=True, least=12, most=most)
    scene = _scene(rng, grid, robot=Robot(), moves=MOVES[("octile", "dissertation")[int(rng.integers(2))]])
    kind = ("random-walk", "patrol", "crossing", "mixed")[int(rng.integers(4))]
    traffic = drawn_traffic(kind, int(rng.integers(1, 6)), grid, int(rng.integers(2**31)), fit=scene)
    return replace(scene, traffic=traffic)


def _simulation(rng: np.random.Generator, turn: int) -> Work:
    scene = _among(rng, 24)
    planner = ("ad-gso", "astar", "sipp", "dstar-lite", "space-time-astar", "mmas-dstar")[turn % 6]
    cells = np.argwhere(~scene.grid.blocked)
    x, y = cells[rng.integers(len(cells))].tolist()[::-1]
    if rng.integers(2) and (x, y) not in (scene.start, scene.goal):
        scene = replace(scene, edits=(Edit(3, blocked=((x, y),)), Edit(9, freed=((x, y),))))
    seed = int(rng.integers(2**31))
    law = ("physical", "dissertation", "three-speed")[int(rng.integers(3))]
    return f"{planner} {law}", lambda: api.simulate(
        scene, planner, seed=seed, ticks=40, law=law, **_few(planner)
    )


def _drive(rng: np.random.Generator, turn: int) -> Work:
    law = LAWS[turn % len(LAWS)]
    scene = _among(rng, 16)
    if rng.integers(3) == 0:
        row = np.argwhere(~scene.grid.blocked)[:1].tolist()[0]
        scene = replace(scene, traffic=(Recorded(((row[1], row[0]),) * 2),))
    sources = (Adversary(0.5),) if rng.integers(3) == 0 else ()
    seed = int(rng.integers(2**31))
    noise: dict[str, Any] = {"noise": 0.1 * scene.grid.resolution} if rng.integers(2) else {}
    limit = 12.0 * scene.grid.resolution

    def work() -> Any:
        return api.drive(
            scene, "ad-gso", seed=seed, law=law, sources=sources, time_limit=max(limit, 4.0), **noise
        )

    return law, work


def _recipe(rng: np.random.Generator, turn: int) -> Work:
    name = RECIPES[turn % len(RECIPES)]
    width, height, seed = (int(n) for n in rng.integers((64, 64, 0), (128, 128, 2**62)))
    return name, lambda: make_ground(name, width, height, seed)


def _numbers(rng: np.random.Generator, turn: int) -> Work:
    """What all else is made of: elementary functions, sums, orders, roots, draws."""
    x, y = rng.random((2, 1000)) * 10 ** (turn % 3)

    def work() -> Any:
        of_one = [f(x - y) for f in (elementary.exp, elementary.sin, elementary.cos)]
        of_two = [f(x, y) for f in (elementary.atan2, elementary.hypot)]
        line = elementary.interp(x, np.sort(y), np.cumsum(x))
        orders = np.argsort(np.floor(x), kind="stable"), np.lexsort((y, np.floor(x)))
        sums = x.sum(), (x * y).reshape(20, 50).sum(axis=0), (x * y).reshape(20, 50).sum(axis=1), x.mean()
        swarms = [_swarm(optimiser, turn) for optimiser in (GSO(20), igso(20), PSO(20), apso(20))]
        drawn = Draw(turn).units(10, 10), rng.permutation(100), rng.integers(0, 1000, 100)
        return of_one, of_two, elementary.log(x), np.sqrt(x), line, orders, sums, swarms, drawn

    return "", work


def _swarm(optimiser: Optimiser, turn: int) -> Any:
    """The best places that a swarm finds on a test function, and what they are worth."""
    function = tuple(FUNCTIONS.values())[turn % len(FUNCTIONS)]
    rng = np.random.Generator(np.random.PCG64(turn))
    return maximise(optimiser.start(function.box, rng), function, StoppingRule(10))


def _study(rng: np.random.Generator, turn: int) -> Work:
    kind = ("plan", "simulate", "drive")[turn % 3]
    seed = int(rng.integers(2**31))
    return kind, lambda: small(kind, seed)


_KINDS: dict[str, Callable[[np.random.Generator, int], Work]] = {
    "plan": _plan,
    "later plan": _later_plan,
    "field": _field,
    "profile": _profile,
    "simulation": _simulation,
    "drive": _drive,
    "recipe": _recipe,
    "numbers": _numbers,
    "study": _study,
}
