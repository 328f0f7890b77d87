"""Robots that learn their map, and via points: what planners answer on what is known, and what the referee says of the runs."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np

from lampyris import referee
from lampyris.model.change import Change
from lampyris.model.drive import Drive
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.settings.sensor import FULL_TURN, Sensor
from lampyris.model.trace import Outcome as Ending
from lampyris.planning import registry
from lampyris.planning.base import Budget, Planner
from lampyris.sim.continuous import drive as driving
from lampyris.sim.grid import loop
from lampyris.typing import Cell
from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally
from lampyris_selfcheck.reference.paths import terrain as reference

KINDS = {
    "simulate": Kind(
        "a random map of up to 9 x 9 cells, with terrain or not, a sensor, unseen cells free or at a higher price; D* Lite, "
        "AD-GSO's repaired field and A* in turn: every answer costs what a plain search finds on what is known, the robot "
        "arrives exactly if it can, and the referee accepts the run",
        commit=20, nightly=3_000, release=30_000, chunk=20, least={"arrived": 0.3, "asked again": 0.2},
    ),
    "drive": Kind(
        "the same in continuous time, robots that need several cells to stop: the referee accepts the drive",
        commit=10, nightly=1_000, release=10_000, chunk=10, least={"arrived": 0.3, "limited by sight": 0.1},
    ),
    "via": Kind(
        "a random map and up to four via points: all are visited at the cost of the shortest paths between them, or none "
        "that can be is left out",
        commit=20, nightly=3_000, release=30_000, chunk=20, least={"arrived": 0.3},
    ),
}  # fmt: skip
PLANNERS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("dstar-lite", {}),
    ("ad-gso", {"choice": "exact"}),
    ("astar", {}),
)
STEPS = ("octile", "four-connected", "dissertation")


def _scene(rng: np.random.Generator, most: int) -> Scene:
    """Ends on free cells of a random map; a third of the maps has terrain."""
    walls = rng.random(tuple(rng.integers(2, most + 1, 2))) < rng.choice([0.1, 0.25, 0.4])
    walls.flat[rng.choice(walls.size, 2, replace=False)] = False
    ground = rng.integers(0, 253, walls.shape).astype(np.uint8) if rng.random() < 1 / 3 else None
    (y, x), (v, u) = rng.permutation(np.argwhere(~walls))[:2].tolist()
    return Scene(Grid(walls, terrain=ground), (x, y), (u, v), moves=STEPS[int(rng.integers(3))])


def _sensor(rng: np.random.Generator) -> Sensor:
    view = float(rng.choice([FULL_TURN, math.pi, 0.7]))
    return Sensor(float(rng.choice([1.0, 2.5, 5.0])), view, float(rng.choice([1.0, 1.0, 1.3, 3.0])))


def _costs(blocked: Any, ground: Any, moves: str, goal: Cell) -> dict[Cell, float]:
    """The least cost from each cell to a goal, cells, by the definition."""
    search: Any = reference.field
    found, _ = search((~blocked).tolist(), ground.tolist(), moves, goal)
    return {cell: float(cost.n) + float(cost.m) * math.sqrt(2.0) for cell, cost in found.items()}


@dataclass
class _Watched:
    """A planner whose every answer is compared with a plain search on the map as it has been reported."""

    inner: Planner
    asked: int = 0
    wrong: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.name, self.traits = self.inner.name, self.inner.traits

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> _Watched:
        """Keep what is known at first."""
        grid = scene.grid
        self._scene, self._walls = scene, grid.blocked.copy()
        given = np.zeros(grid.blocked.shape, np.uint8) if grid.terrain is None else grid.terrain
        self._ground = given.astype(np.int64)
        self._session = self.inner.open(scene, rng, record=record)
        return self

    def plan(self, change: Change | None = None, budget: Budget | None = None) -> Plan:
        """Ask, and compare."""
        change = change or Change(robot=self._scene.start)
        for x, y in change.blocked:
            self._walls[y, x] = True
        for (x, y), value in change.terrain:
            self._ground[y, x] = value
        made = self._session.plan(change, budget)
        self.asked += 1
        robot, goal = change.robot or self._scene.start, self._scene.goal
        best = None if self._walls[goal[1], goal[0]] else _costs(
            self._walls, self._ground, self._scene.moves.name, goal
        ).get(robot)  # fmt: skip
        got = None if made.path is None else made.optimal_cost
        if (best is None) != (got is None) or (
            best is not None and got is not None and abs(best - got) > 1e-9 * (1.0 + best)
        ):
            self.wrong.append(f"call {self.asked} from {robot}: {got}; on what is known {best}")
        return made


def _simulate(ask: Ask, part: Part, tally: Tally, number: int) -> None:
    rng = ask.rng("unknown-maps", part.kind, number)
    scene, sensor = _scene(rng, 9), _sensor(rng)
    watched: Any = _Watched(registry.make(*PLANNERS[number % 3]))
    trace = loop.run(scene, watched, law="dissertation", sensor=sensor)
    ground = np.zeros(scene.grid.blocked.shape) if scene.grid.terrain is None else scene.grid.terrain
    can = scene.start in _costs(scene.grid.blocked, ground, scene.moves.name, scene.goal)
    fault = referee.check_trace(trace)
    for what in (*watched.wrong, *([str(fault)] if fault else [])):
        tally.fail(number, what)
    if trace.arrived != can:
        tally.fail(number, f"{trace.outcome.value}, and a path there is: {can}")
    tally.case(*["arrived"] * trace.arrived, *["asked again"] * (watched.asked > 1))


def _drive(ask: Ask, part: Part, tally: Tally, number: int) -> None:
    rng = ask.rng("unknown-maps", part.kind, number)
    robot = Robot(radius=float(rng.choice([0.0, 0.3, 0.5])), v_max=float(rng.choice([1.0, 4.0])), a_max=2.0)
    scene, sensor = replace(_scene(rng, 16), robot=robot), _sensor(rng)
    law = ("physical", "optimum", "blind", "constant")[number % 4]
    made: Drive = driving.drive(
        scene, registry.make("dstar-lite", {}), law=law, sensor_range=sensor.range_m,
        field_of_view=math.degrees(sensor.field_of_view), unseen_cost=sensor.unseen_cost,
        period=float(rng.choice([0.1, 0.3])),
    )  # fmt: skip
    if (fault := referee.check_drive(made)) is not None:
        tally.fail(number, str(fault))
    if made.outcome is Ending.COLLISION:
        tally.fail(number, "a collision")
    tally.case(*["arrived"] * made.arrived, *["limited by sight"] * ("blind area" in made.cause))


def _via(ask: Ask, part: Part, tally: Tally, number: int) -> None:
    rng = ask.rng("unknown-maps", part.kind, number)
    scene = _scene(rng, 12)
    free = np.argwhere(~scene.grid.blocked)
    via = [(int(x), int(y)) for y, x in free[rng.integers(0, len(free), int(rng.integers(1, 5)))]]
    scene = scene.through(via, order="best" if number % 2 else "given")
    trace = loop.run(scene, registry.make(*PLANNERS[number % 3]), law="dissertation")
    if (fault := referee.check_trace(trace)) is not None:
        tally.fail(number, str(fault))
    grid, cells = scene.grid, (scene.start, *trace.via, scene.goal)
    ground = np.zeros(grid.blocked.shape) if grid.terrain is None else grid.terrain
    legs = [_costs(grid.blocked, ground, scene.moves.name, b).get(a) for a, b in pairwise(cells)]
    can = None not in legs
    if trace.arrived != can:
        tally.fail(number, f"{trace.outcome.value}; paths between the points there are: {can}")
    expected = math.fsum(leg for leg in legs if leg is not None)
    if trace.arrived and abs(trace.cost - expected) > 1e-9 * (1.0 + expected):
        tally.fail(number, f"cost {trace.cost}; the legs come to {expected}")
    tally.case(*["arrived"] * trace.arrived)


_RUNS = {"simulate": _simulate, "drive": _drive, "via": _via}


def run(ask: Ask, part: Part) -> Outcome:
    """Run some cases and judge each."""
    tally = Tally(part)
    for number in part.numbers:
        _RUNS[part.kind](ask, part, tally, number)
    return tally.outcome()


CHECK = Check(
    "unknown-maps",
    ("G35",),
    "on a map that it learns on the way a robot touches no wall and relies on nothing unseen, incremental planners answer as a "
    "new search does on what is known, and via points are visited at the cost of their legs",
    KINDS,
    run,
)
