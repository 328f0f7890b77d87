"""What an engine can be asked, each as a stream of frames. The scenario is the one noun that comes in."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Any, TypeAlias, cast

import numpy as np

from lampyris import api
from lampyris.app.engine.comparison import ComparisonResults, comparison
from lampyris.app.engine.comparison import compare as compared
from lampyris.app.engine.frames import frame, json_frame, layer_frame
from lampyris.app.engine.layers import layer_of, own_order, scene_at
from lampyris.app.engine.parse import scenario_of_request
from lampyris.app.engine.simulation import begin, ending, finish, header, standing_records, watch
from lampyris.errors import FileError, LampyrisError, UsageError
from lampyris.io.maps.formats.document import grid_codes
from lampyris.io.maps.map_hash import map_hash
from lampyris.io.maps.recipes.regions import keep_largest
from lampyris.io.scenario.scenario import Made, Scenario
from lampyris.kernels import loading
from lampyris.model.grid import Grid
from lampyris.model.path import PosePath
from lampyris.motion.laws.node_table import nodes_of
from lampyris.planning import registry
from lampyris.report.data.serialize import plan_record, profile_record
from lampyris.scenarios import speed_law, without_effect
from lampyris.typing import Cell

PIECE = 2**18
"""Bytes of a file in one frame."""
Look: TypeAlias = Callable[[], None]
"""Raises when nobody waits for the answer any more."""


def answer(question: Mapping[str, Any], look: Look) -> Iterator[bytes]:
    """The frames of the answer to a question.

    Raises
    ------
    UsageError : VERB.
    LampyrisError : what is wrong with the question.
    """
    verb = _VERBS.get(str(question.get("verb")))
    if verb is None:
        allowed = ", ".join(_VERBS)
        raise UsageError("VERB", f"{question.get('verb')!r:.60}", where="verb", allowed=allowed)
    yield from verb(question, look)


def plan(question: Mapping[str, Any], look: Look) -> Iterator[bytes]:
    """A plan with its speeds: one frame ``Z``."""
    loaded = loading.seconds()
    scenario = scenario_of_request(question)
    planner = registry.make(scenario.planner, scenario.settings)
    found = api.plan(scenario.scene, planner, seed=scenario.seed, record=bool(question.get("record")))
    law: Any = speed_law(scenario.law, scenario.law_settings)
    profile = api.speed_profile(scenario.scene, found, law) if found else None
    # A map of scattered cells has ten thousand gates: a megabyte and a half for each step of a drag.
    gates = "gates" in (question.get("layers") or ())
    record = plan_record(
        found, scenario.scene, profile, seed=scenario.seed, gates=gates, nodes=nodes_of(scenario.scene, found)
    )
    if profile is not None:
        record["speed"] = profile_record(profile, caps=True)
    if found.pose_path is not None:
        record["pose_cells"] = _pose_cells(found.pose_path, scenario.scene.grid)
    for one, row in zip(found.rounds, record.get("rounds", ()), strict=True):
        row["planned_cells"], row["tracked_cells"] = (
            [list(c) for c in one.planned],
            [list(c) for c in one.tracked],
        )
    if scenario.scene.traffic:
        with suppress(LampyrisError):  # the run says why
            record["obstacle_specs"] = standing_records(scenario)
    record["notes"] = [
        *scenario.notes,
        *found.notes,
        *without_effect(replace(scenario, simulated=False, drive=None)),
    ]
    # What the page shows beside the sentence: the others are of the scenario, and stand there always.
    record["weakened"] = list(found.notes)
    record["seconds"] = found.timing["plan_s"]
    record["loading_seconds"] = loading.seconds() - loaded
    yield json_frame("Z", record)


def _pose_cells(path: PosePath, grid: Grid) -> list[list[float]]:
    """Poses as the page draws them: x and y in cells, y down, the yaw from the rows to their right, and how the step to
    the next pose is driven: 1 ahead, -1 in reverse, 0 turned in place (the last as the one before)."""
    points = grid.frame.to_points(path.poses[:, 0], path.poses[:, 1])
    gears = np.concatenate((path.gears, path.gears[-1:] if len(path.gears) else np.ones(1)))
    table = np.column_stack((points, path.poses[:, 2] - grid.origin[2], gears))
    return cast(list[list[float]], np.round(table, 4).tolist())


def simulate(question: Mapping[str, Any], look: Look) -> Iterator[bytes]:
    """A simulation, tick by tick: ``H``, ``E`` and ``T`` as they come, ``Z``."""
    scenario = scenario_of_request(question)
    yield from simulated(scenario, look, {"job": question.get("job"), "label": scenario.planner})


def simulated(scenario: Scenario, look: Look, head: Mapping[str, Any]) -> Iterator[bytes]:
    """The frames of one simulation; ``head``: what its header says besides."""
    run = begin(scenario)
    yield json_frame("H", {**head, **header(run, scenario)})
    yield from watch(run, look)
    yield json_frame("Z", ending(finish(run), head))


def drive(question: Mapping[str, Any], look: Look) -> Iterator[bytes]:
    """Drives in continuous time: see :func:`lampyris.app.engine.driving.drive`. What drives is loaded when it is asked for."""
    from lampyris.app.engine.driving import drive as driven

    yield from driven(question, look)


def fleet(question: Mapping[str, Any], look: Look) -> Iterator[bytes]:
    """Paths of a fleet: see :func:`lampyris.app.engine.fleets.fleet.fleet`. What plans is loaded when it is asked for."""
    from lampyris.app.engine.fleets.fleet import fleet as planned

    yield from planned(question, look)


def swarm(question: Mapping[str, Any], look: Look) -> Iterator[bytes]:
    """A swarm of robots that look for sources: see :func:`lampyris.app.engine.fleets.swarm.swarm`."""
    from lampyris.app.engine.fleets.swarm import swarm as simulated_swarm

    yield from simulated_swarm(question, look)


def layer(question: Mapping[str, Any], look: Look) -> Iterator[bytes]:
    """One layer: a frame ``L``; before ``expanded``, ``H`` says whether the order is the planner's own."""
    tick = question.get("tick") or 0
    if type(tick) is not int or tick < 0:
        raise UsageError("TICK", f"{tick!r:.40}", where="tick", allowed="a whole number >= 0")
    name = str(question.get("layer"))
    scenario = scenario_of_request(question)
    made = layer_of(name, scenario, tick, question.get("obstacle_cells"))
    if name == "expanded":
        own = own_order(scene_at(scenario.scene, tick), scenario) is not None
        yield json_frame("H", {"layer": name, "planner": scenario.planner, "own": own})
    yield layer_frame(name, made)


def compare(question: Mapping[str, Any], look: Look) -> Iterator[bytes]:
    """Several planners and laws: see :func:`lampyris.app.engine.comparison.compare`."""
    found = comparison(scenario_of_request(question), question)
    yield from compared(found, look, question.get("job"), ComparisonResults(found))


def race(question: Mapping[str, Any], look: Look) -> Iterator[bytes]:
    """Planners that explore the same map: see :func:`lampyris.app.engine.race.race.raced`. It is loaded when it is asked for."""
    from lampyris.app.engine.race.race import raced

    yield from raced(question, scenario_of_request(question), look)


def export(question: Mapping[str, Any], look: Look) -> Iterator[bytes]:
    """A file: see :func:`lampyris.app.engine.export.export`. What draws is loaded when it is asked for."""
    settings = question.get("settings")
    if isinstance(settings, Mapping) and settings.get("fleet") is not None:
        from lampyris.app.engine.fleets.export import fleet_file

        data = fleet_file(question, look)
        for at in range(0, len(data), PIECE):
            look()
            yield frame("B", data[at : at + PIECE])
        yield json_frame("Z", {"bytes": len(data)})
        return
    if question.get("what") == "replay":
        data = _replay(scenario_of_request(question), settings or {}, look)
        for at in range(0, len(data), PIECE):
            look()
            yield frame("B", data[at : at + PIECE])
        yield json_frame("Z", {"bytes": len(data)})
        return
    from lampyris.app.engine.export import export as exported

    yield from exported(question, scenario_of_request(question), look)


def _replay(scenario: Scenario, settings: Mapping[str, Any], look: Look) -> bytes:
    """The scenario's run as an interactive page; with ``settings.layer`` beneath it as it is at the beginning."""
    from lampyris.app.replay.page import replay_page
    from lampyris.app.replay.streams import drive_replay, trace_replay

    if scenario.drive is not None:
        from lampyris.app.engine.driving import driven

        return replay_page(drive_replay(driven(scenario, look), scenario.name)).encode()
    run = begin(scenario)
    sent = [json_frame("H", header(run, scenario)), *watch(run, look)]
    trace = finish(run)
    sent.append(json_frame("Z", ending(trace, {})))
    name = str(settings.get("layer") or "none")
    below = b"" if name == "none" else layer_frame(name, layer_of(name, scenario, 0, None))
    return replay_page(trace_replay(trace, scenario.name, b"".join(sent), below)).encode()


def warm(question: Mapping[str, Any], look: Look) -> Iterator[bytes]:
    """Have the code of plans and simulations ready, which takes seconds the first time."""
    for name in ("guide", "random-512"):
        data = {"version": 1, "map": name, "obstacles": [{"kind": "random-walk", "count": 2}]}
        for planner in ("astar", "ad-gso"):
            yield from plan({"scenario": {**data, "planner": planner}}, look)
        for _ in simulate({"scenario": {**data, "simulate": {"ticks": 20}}}, look):
            look()
    yield json_frame("Z", {})


def make(question: Mapping[str, Any], look: Look) -> Iterator[bytes]:
    """A map as the library gives one: ``H``, ``B`` of its cells, with terrain one more; then ``Z``.

    Parameters
    ----------
    question : ``map``: {recipe, size, seed, settings, resolution}, as a scenario says it.

    Raises
    ------
    LampyrisError : what is wrong with it, at its place in a scenario.
    """
    spec = question.get("map")
    if not isinstance(spec, dict) or "recipe" not in spec:
        raise FileError("MAP", f"{spec!r:.60}", where="map", allowed="{recipe, size, seed, settings}")
    # Ends anywhere: what is looked at is the map.
    scenario = scenario_of_request({"scenario": {"version": 1, "map": spec, "start": [0, 0], "goal": [1, 1]}})
    grid, source = scenario.scene.grid, scenario.map
    assert isinstance(source, Made)
    start, goal = far_ends(grid)
    look()
    yield json_frame("H", {
        "id": "", "name": f"{source.recipe}, seed {source.seed}", "kind": "recipe", "width": grid.width,
        "height": grid.height, "resolution": grid.resolution, "origin": list(grid.origin),
        "hash": map_hash(grid), "start": start, "goal": goal, "notes": list(scenario.notes),
        "free": 1.0 - float(np.count_nonzero(grid.blocked)) / grid.blocked.size,
    })  # fmt: skip
    yield frame("B", np.ascontiguousarray(grid_codes(grid)).tobytes())
    if grid.terrain is not None:
        yield frame("B", grid.terrain.tobytes())
    yield json_frame("Z", {})


def far_ends(grid: Grid) -> tuple[Cell, Cell]:
    """A start and a goal that can reach each other, so that there is something to see at once: the cells of
    the largest free region that are nearest to the upper left and to the lower right corner."""
    y, x = np.nonzero(~keep_largest(grid.blocked))
    first, last = int(np.argmin(x + y)), int(np.argmax(x + y))
    return (int(x[first]), int(y[first])), (int(x[last]), int(y[last]))


_VERBS: Mapping[str, Callable[[Mapping[str, Any], Look], Iterator[bytes]]] = {
    "plan": plan,
    "simulate": simulate,
    "drive": drive,
    "fleet": fleet,
    "swarm": swarm,
    "layer": layer,
    "compare": compare,
    "race": race,
    "export": export,
    "make": make,
    "warm": warm,
}
