"""Watched: a simulation that is looked at while it runs, in pieces that the page can draw."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from time import perf_counter
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from lampyris import api
from lampyris.app.engine.cache import place_facts
from lampyris.app.engine.frames import NOWHERE, caps_frame, json_frame, seen_frame, ticks_frame
from lampyris.errors import UsageError
from lampyris.io.scenario.scenario import Scenario
from lampyris.model.grid import Grid
from lampyris.model.robot import Polygon
from lampyris.model.scene import Scene
from lampyris.model.settings.sensor import Sensor
from lampyris.model.trace import Event, Outcome, Trace
from lampyris.model.traffic import Obstacle, Patrol
from lampyris.planning import registry
from lampyris.referee import check_trace, demand
from lampyris.report.data.measures import near_by_tick, trace_metrics
from lampyris.report.data.serialize import grid_record, trace_record
from lampyris.report.style import CAUSES
from lampyris.scenarios import sensor_of, speed_law
from lampyris.sim.grid.loop import Simulation
from lampyris.sim.grid.steps_since import events_since, since
from lampyris.sim.traffic.headings import first_headings
from lampyris.sim.traffic.traffic import Shuttle, Traffic, open_traffic
from lampyris.sim.world.cell_index import CellIndex, robot_shape
from lampyris.sim.world.endings import ending_sentence
from lampyris.sim.world.world import Occupancy
from lampyris.typing import Cell

CHUNK_S: Final = 0.03
"""Seconds of work between two frames of ticks."""
MOST_TICKS: Final = 60_000
"""Ticks of one frame: their number has 16 bits."""
MOST_PATH: Final = 20_000
"""Cells of patrols that are sent with a plan, in all."""
WORDS: Final = (*CAUSES, "other")
"""What can bind a speed, as a frame of ticks counts them."""
_CODES: Final = {word: k for k, word in enumerate(WORDS)}


def begin(scenario: Scenario) -> Simulation:
    """A scenario's simulation, before its first tick; the same that ``lampyris run`` makes.

    Raises
    ------
    UsageError : DRIVE: it is driven in continuous time.
    LampyrisError : as :func:`lampyris.simulate`.
    """
    if scenario.drive is not None:
        raise UsageError(
            "DRIVE", "a drive in continuous time", where="scenario: /drive", allowed="a simulation in ticks",
            todo="drive it, or take `drive` out",
        )  # fmt: skip
    return Simulation(
        api.among(scenario.scene, None),
        registry.make(scenario.planner, scenario.settings),
        seed=scenario.seed,
        ticks=scenario.ticks,
        law=speed_law(scenario.law, scenario.law_settings),
        patience=scenario.patience,
        sensor=sensor_of(scenario),
        goal_track=scenario.goal_track,
    )


def standing(scenario: Scenario) -> list[tuple[Obstacle, Cell]]:
    """The moving obstacles and the cells where they begin: those of :func:`begin`, without the plan it makes.

    Raises
    ------
    LampyrisError : as :func:`begin`, for obstacles that have no place.
    """
    traffic = _traffic(scenario)
    cells = map(traffic.world.space.cell, traffic.world.where)
    return list(zip(traffic.obstacles, cells, strict=True))


def standing_records(scenario: Scenario) -> list[dict[str, Any]]:
    """What :func:`standing` says as plain data. A patrol has its ``waypoints`` and, as far as all patrols
    together take no more than :data:`MOST_PATH` cells, its ``path``: the cells it drives along between them.

    Raises
    ------
    LampyrisError : as :func:`begin`, for obstacles that have no place.
    """
    traffic = _traffic(scenario)
    cell, grid = traffic.world.space.cell, scenario.scene.grid
    records = [
        {**record, "at": list(cell(number))}
        for record, number in zip(_records(traffic, grid), traffic.world.where, strict=True)
    ]
    patrols = iter([one for one in scenario.scene.traffic if isinstance(one, Patrol)])
    left = MOST_PATH
    for drive in traffic.drivers:
        if not isinstance(drive, Shuttle) or traffic.obstacles[drive.obstacle].kind != "patrol":
            continue
        record = records[drive.obstacle]
        record["waypoints"] = [list(one) for one in next(patrols).waypoints]
        left -= len(drive.route)
        if left >= 0:
            record["path"] = [list(cell(number)) for number in drive.route]
    return records


def _traffic(scenario: Scenario) -> Traffic:
    scene = api.among(scenario.scene, None, poses=scenario.planner in registry.pose_names())
    space = CellIndex(scene.grid)
    world = Occupancy(space, robot_shape(scene, space), space.number(scene.start))
    return open_traffic(scene, world, scenario.seed)


def watch(run: Simulation, look: Callable[[], None]) -> Iterator[bytes]:
    """Run it to its end, and hand out events and ticks as they come, each with what bounds the speed."""
    ticks, events, obstacles, last = 0, 0, len(run.traffic.obstacles), perf_counter()
    caps: list[tuple[tuple[str, float], ...]] = [()]
    while True:
        over = run.outcome is not None
        if over or perf_counter() - last > CHUNK_S or run.now - ticks >= MOST_TICKS:
            news = events_since(run, events)
            if news:
                yield _events(news, run.traffic.obstacles[obstacles:], run.scene.grid)
            part = since(run, ticks)
            if (
                run.walls.seen is not None
                and (fresh := seen_frame(run.walls.seen.seen, ticks, run.now)) is not None
            ):
                yield fresh
            yield _ticks(part, ticks)
            if (allowed := caps_frame(ticks, caps[: part.ticks + 1])) is not None:
                yield allowed
            caps = []
            ticks, events, obstacles, last = (
                run.now + 1,
                events + len(news),
                len(run.traffic.obstacles),
                perf_counter(),
            )
        look()
        if over:
            return
        run.tick()
        caps.append(() if run.outcome is Outcome.ARRIVED else run.tick_speed.caps())


def _events(news: list[Event], obstacles: Sequence[Obstacle], grid: Grid) -> bytes:
    """Events; those of obstacles that appeared say what these are."""
    rows, came = [], iter(obstacles)
    for event in news:
        one: dict[str, Any] = {
            "tick": event.tick, "word": event.word, "cell": list(event.cell), "sentence": event.sentence
        }  # fmt: skip
        if event.word == "appear":
            there = next(came)
            one["obstacle"] = {**obstacle_record(there), **_shape(there, grid, 0.0)}
        rows.append(one)
    return json_frame("E", rows)


def _ticks(part: Trace, first: int) -> bytes:
    """The ticks of a part of a trace that begins at ``first``."""
    n = part.ticks + 1
    places = np.full((n, len(part.obstacle_specs), 2), NOWHERE, dtype=np.int16)
    for k, (track, came) in enumerate(zip(part.tracks, part.appears, strict=True)):
        places[came:, k] = track
    other = _CODES["other"]
    cause: NDArray[np.uint8] = np.array([_CODES.get(word, other) for word in part.cause], dtype=np.uint8)
    return ticks_frame(first, part.robot, part.speed, cause, places, near_by_tick(part))


def trace_frames(trace: Trace) -> bytes:
    """A whole trace as the frames that :func:`watch` gives while it runs, without what each rule alone allows.

    Obstacles that are polygons begin along the rows: a trace does not say with which heading.
    """
    grid = trace.scene.grid
    there = sum(came == 0 for came in trace.appears)  # bits: a count of obstacles
    specs = [{**obstacle_record(one), **_shape(one, grid, 0.0)} for one in trace.obstacle_specs]
    head = {
        "planner": trace.planner,
        "law": trace.law,
        "units": trace.units,
        "tick_s": tick_seconds(trace.scene, trace.units),
        "seed": trace.seed,
        "map": grid_record(grid),
        "start": list(trace.scene.start),
        "goal": list(trace.scene.goal),
        "causes": list(WORDS),
        "obstacle_specs": specs[:there],
        "last_tick": trace.last_tick,
        "sensor": sensor_record(trace.sensor, grid),
        "goal_track": None if trace.goal_track is None else trace.goal_track.tolist(),
        "notes": [],
    }
    parts = [json_frame("H", head)]
    if trace.events:
        parts.append(_events(list(trace.events), trace.obstacle_specs[there:], grid))
    if trace.seen is not None and (seen := seen_frame(trace.seen.reshape(-1), 0, trace.ticks)) is not None:
        parts.append(seen)
    parts += [_ticks(trace, 0), json_frame("Z", ending(trace, {}))]
    return b"".join(parts)


def tick_seconds(scene: Scene, units: str) -> float | None:
    """Seconds that a tick stands for: what the robot needs for a cell at its greatest speed. None: speeds are not in m/s."""
    return scene.grid.resolution / scene.robot.v_max if units.startswith("m/s") else None


def finish(run: Simulation) -> Trace:
    """The whole trace, past the referee, with its sentence: what :func:`lampyris.simulate` gives.

    Raises
    ------
    InternalFault : the referee refused it; a fault of lampyris.
    """
    trace = run.trace()
    demand(check_trace(trace))
    return replace(trace, detail=ending_sentence(trace, run.scene))


def sensor_record(sensor: Sensor | None, grid: Grid) -> list[float] | None:
    """How many cells a robot's sensor reaches, and its field of view in radians; None: it knows the map."""
    return None if sensor is None else [sensor.range_m / grid.resolution, sensor.field_of_view]


def obstacle_record(obstacle: Obstacle) -> dict[str, Any]:
    """What a moving obstacle is."""
    return {"kind": obstacle.kind, "radius": obstacle.radius, "yields": obstacle.yields}


def _records(traffic: Traffic, grid: Grid) -> list[dict[str, Any]]:
    """What the obstacles are; of polygons also ``outline`` (cells) and ``yaw``, the heading with which they begin."""
    polygons = any(one.outline is not None for one in traffic.obstacles)
    yaws = first_headings(traffic, grid) if polygons else {}
    return [
        {**obstacle_record(one), **_shape(one, grid, yaws.get(k, 0.0))}
        for k, one in enumerate(traffic.obstacles)
    ]


def _shape(obstacle: Obstacle, grid: Grid, yaw: float) -> dict[str, Any]:
    if obstacle.outline is None:
        return {}
    return {"outline": outline_record(obstacle.outline, grid.resolution), "yaw": round(yaw, 4)}


def outline_record(outline: Polygon, resolution: float) -> list[list[float]]:
    """Vertices of an obstacle in cells, x ahead and y to the left of its centre."""
    return [[round(x / resolution, 4), round(y / resolution, 4)] for x, y in outline]


def header(run: Simulation, scenario: Scenario) -> dict[str, Any]:
    """What is to come: who, by which law, where.

    ``tick_s``: see :func:`tick_seconds`.
    ``obstacle_specs``: those that are there from the start; ``sensor``: see :func:`sensor_record`; ``goal_track``: the goal's
    cell at each tick, null where it stands still.
    """
    return {
        "planner": scenario.planner,
        "law": run.tick_speed.name,
        "units": run.tick_speed.units,
        "tick_s": tick_seconds(scenario.scene, run.tick_speed.units),
        "seed": scenario.seed,
        "map": grid_record(scenario.scene.grid),
        "start": list(scenario.scene.start),
        "goal": list(scenario.scene.goal),
        "causes": list(WORDS),
        "obstacle_specs": _records(run.traffic, scenario.scene.grid),
        "last_tick": run.state.last_tick,
        "sensor": sensor_record(run.sensor, scenario.scene.grid),
        "goal_track": None if run.pursuit is None else [list(cell) for cell in run.pursuit.cells],
        "notes": list(scenario.notes),
    }


def ending(trace: Trace, head: Mapping[str, Any]) -> dict[str, Any]:
    """How a simulation ended, with the measures of studies."""
    return {
        **head,
        "outcome": trace.outcome.value,
        "sentence": trace.sentence,
        "ticks": trace.ticks,
        "last_tick": trace.last_tick,
        "metrics": trace_metrics(trace, place_facts(trace.scene)),
        "notes": list(trace.notes),
        "obstacle_specs": [obstacle_record(obstacle) for obstacle in trace.obstacle_specs],
        "digest": digest(trace),
        "timing": dict(trace.timing),
    }


def digest(trace: Trace) -> str:
    """SHA-256 of what ``lampyris run --json --no-timing`` prints of it, without the line's end."""
    record = {**trace_record(trace), "timing": {}}
    text = json.dumps(record, allow_nan=False, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()
