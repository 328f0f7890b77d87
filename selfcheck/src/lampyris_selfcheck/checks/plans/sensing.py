"""Maps that a robot learns as it drives, and goals that move, beside plain searches and the definition of sight."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from lampyris import api
from lampyris.errors import InternalFault
from lampyris.model.grid import Grid
from lampyris.model.scene import Scene
from lampyris.model.settings.sensor import Sensor
from lampyris.model.trace import Trace
from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally, each
from lampyris_selfcheck.reference.fleets.fleet_rules import distances, neighbours
from lampyris_selfcheck.reference.motion.sight import sees

Cell = tuple[int, int]
LEARNING = ("dstar-lite", "astar", "ad-gso")
KNOWING, REACTING = ("sipp", "space-time-astar"), ("dstar-lite", "astar")
RANGES = (0.4, 1.0, 2.0, 3.5)
VIEWS = (2 * math.pi, math.pi, math.pi / 2)
MOST_TICKS = 500


def _simulated(scene: Scene, planner: str, **more: object) -> Trace | str:
    try:
        return api.simulate(scene, planner, law="dissertation", **more)  # type: ignore[arg-type]
    except InternalFault as error:
        return f"the referee: {error}"


def _drawn(rng: np.random.Generator, most: int) -> Scene:
    """A random map with two free cells."""
    while True:
        height, width = (int(n) for n in rng.integers(3, most + 1, 2))
        walls = rng.random((height, width)) < rng.choice([0.1, 0.25, 0.4])
        free = np.argwhere(~walls)
        if len(free) >= 2:
            (y, x), (v, u) = free[rng.choice(len(free), 2, replace=False)].tolist()
            return Scene(Grid(walls), (x, y), (u, v), str(rng.choice(["octile", "four-connected"])))


def _sensing(ask: Ask, number: int, tally: Tally) -> None:
    rng = ask.rng("unknown-maps", "sensing", number)
    scene, planner = _drawn(rng, 7), LEARNING[number % 3]
    sensor = Sensor(float(rng.choice(RANGES)), float(rng.choice(VIEWS)))
    trace = _simulated(scene, planner, sensor=sensor)
    fault = trace if isinstance(trace, str) else _seen_wrong(trace, scene, sensor)
    if isinstance(trace, Trace):
        tally.count(trace.outcome.value)
        octile = scene.moves.name == "octile"
        rows = scene.grid.blocked.tolist()
        reachable = scene.start in distances(rows, scene.goal, octile=octile)
        if not fault and trace.arrived != reachable:
            fault = f"ends with {trace.outcome}; there is {'a' if reachable else 'no'} path"
    if fault:
        tally.fail(
            number,
            f"{planner}, {sensor}: {fault}",
            walls=scene.grid.blocked.tolist(),
            start=scene.start,
            goal=scene.goal,
        )


def _seen_wrong(trace: Trace, scene: Scene, sensor: Sensor) -> str:
    """Whether each cell was first seen when it was, by the definition of the sensor."""
    walls = scene.grid.blocked
    high, wide = walls.shape
    line = lru_cache(maxsize=None)(
        lambda a, b: sees(walls, 2 * a[0] + 1, 2 * a[1] + 1, 2 * b[0] + 1, 2 * b[1] + 1, 2)
    )
    robot = [(int(x), int(y)) for x, y in trace.robot.tolist()]
    first = np.full((high, wide), -1)
    for tick, at in enumerate(robot):
        move = (0, 0) if tick == 0 else (at[0] - robot[tick - 1][0], at[1] - robot[tick - 1][1])
        if tick and move == (0, 0):
            continue
        for y, x in np.argwhere(first < 0).tolist():
            if _is_seen(walls, at, move, (x, y), sensor, line):
                first[y, x] = tick
    assert trace.seen is not None
    if (first != trace.seen).any():
        y, x = np.argwhere(first != trace.seen)[0].tolist()
        return f"cell {(x, y)} is first seen at tick {trace.seen[y, x]}, by the definition at {first[y, x]}"
    return ""


def _is_seen(walls: np.ndarray, at: Cell, move: Cell, cell: Cell, sensor: Sensor, line: object) -> bool:
    dx, dy = cell[0] - at[0], cell[1] - at[1]
    if max(abs(dx), abs(dy)) <= 1:
        return True
    far = math.hypot(dx, dy)
    if far > sensor.range_m * (1 + 1e-9):
        return False
    if move != (0, 0) and sensor.field_of_view < 2 * math.pi:
        turn = abs(math.remainder(math.atan2(dy, dx) - math.atan2(move[1], move[0]), math.tau))
        if turn > sensor.field_of_view / 2 + 1e-9:
            return False
    if not walls[cell[1], cell[0]]:
        return bool(line(at, cell))  # type: ignore[operator]
    sides = [(cell[0] - (dx > 0) + (dx < 0), cell[1])] if dx else []
    sides += [(cell[0], cell[1] - (dy > 0) + (dy < 0))] if dy else []
    return any(not walls[v, u] and bool(line(at, (u, v))) for u, v in sides)  # type: ignore[operator]


def _pursuit(ask: Ask, number: int, tally: Tally) -> None:
    rng = ask.rng("unknown-maps", "pursuit", number)
    scene = _drawn(rng, 8)
    rows, octile = scene.grid.blocked.tolist(), scene.moves.name == "octile"
    knows = number % 2 == 0
    planner = (KNOWING if knows else REACTING)[number // 2 % 2]
    track, at = [], scene.goal
    for _ in range(int(rng.integers(1, 20))):
        track += [at] * (1 if knows else 2)  # a goal whose track is not known is slower than the robot
        options = [at, *neighbours(rows, at, octile=octile)]
        at = options[int(rng.integers(len(options)))]
    best = _earliest(scene, track, octile)
    trace = _simulated(scene, planner, goal_track=track)
    fault = trace if isinstance(trace, str) else ""
    if isinstance(trace, Trace):
        tally.count(trace.outcome.value)
        met = trace.ticks if trace.arrived else None
        if (
            (met is None) != (best is None)
            or (met is not None and best is not None and met < best)
            or (knows and met != best)
        ):
            fault = f"meets the goal at {met}, the earliest is {best}"
    if fault:
        tally.fail(number, f"{planner}: {fault}", walls=rows, start=scene.start, track=track)


def _earliest(scene: Scene, track: list[Cell], octile: bool) -> int | None:
    """The first tick at which a robot can be where the goal is; None: never."""
    rows, now = scene.grid.blocked.tolist(), {scene.start}
    for tick in range(1, MOST_TICKS):
        then = now.union(*(neighbours(rows, cell, octile=octile) for cell in now))
        if track[min(tick, len(track) - 1)] in then:
            return tick
        if then == now and tick >= len(track):
            return None
        now = then
    raise AssertionError("the search does not end")


JUDGES = {"sensing": _sensing, "pursuit": _pursuit}


def _run(ask: Ask, part: Part) -> Outcome:
    judge = JUDGES[part.kind]
    return each(part, lambda number, tally: judge(ask, number, tally))


KINDS = {
    "sensing": Kind(
        "robots with a sensor: each cell first seen when the definition says, and the goal reached if it can be", 40, 5_000,
        50_000, 100, least={"arrived": 0.3},
    ),
    "pursuit": Kind(
        "goals that move: met at the earliest tick where the track is known, caught where it is not", 40, 10_000, 100_000, 200,
        least={"arrived": 0.3},
    ),
}  # fmt: skip
CHECK = Check(
    "sensing",
    ("G39",),
    "robots that learn the map see what the definition says and reach the goal if they can; moving goals are met",
    KINDS,
    _run,
)
