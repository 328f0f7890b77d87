"""Results as replays: traces and drives of one robot, and plans of fleets."""

from __future__ import annotations

import hashlib
import json
import struct
from dataclasses import asdict
from typing import Any, Final

import numpy as np

from lampyris.app.engine import driving, simulation
from lampyris.app.engine.fleets.fleet import ending as fleet_ending
from lampyris.app.engine.frames import frame, json_frame, paths_frame
from lampyris.app.replay.page import RunPage
from lampyris.errors import InternalFault
from lampyris.io.maps.formats.document import grid_codes
from lampyris.io.maps.map_hash import map_hash
from lampyris.model.drive import Drive
from lampyris.model.fleet.fleet import Fleet
from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.model.grid import Grid
from lampyris.model.scene import Scene
from lampyris.model.trace import Trace
from lampyris.planning import registry
from lampyris.report.data.fleets.record import fleet_record

GRAIN: Final = 2.0**-10
"""Cells, radians, metres, m/s: what samples of a drive are rounded to in a file."""
FAR: Final = 2**24
"""Grains that stand for no obstacle at all; what is farther is that, too."""


def trace_replay(trace: Trace, name: str = "", stream: bytes | None = None, layer: bytes = b"") -> RunPage:
    """A simulation.

    Parameters
    ----------
    trace : what was simulated.
    name : what it is called; empty: planner and map.
    stream : the frames of its run; None: made of the trace, without what each rule alone allows.
    layer : a frame of a layer beneath the path.
    """
    made = untimed(simulation.trace_frames(trace) if stream is None else stream)
    digest = simulation.digest(trace)
    facts = [
        *_facts(trace.scene, trace.planner, trace.law, trace.seed),
        ("outcome", trace.outcome.value.replace("_", " ")),
    ]
    more = {**_more(trace.scene, poses=False), "edits": [asdict(edit) for edit in trace.edits]}
    called = name or _called(trace.planner, trace.scene.grid)
    return RunPage("run", called, digest, facts, _ground(trace.scene.grid), made, layer, more)


def drive_replay(drive: Drive, name: str = "") -> RunPage:
    """A drive in continuous time."""
    head = {"controller": drive.controller, "planner": drive.planner}
    made = untimed(b"".join(map(compact, driving.frames_of(drive, head))))
    facts = [*_facts(drive.scene, drive.planner, drive.law, drive.seed), ("controller", drive.controller)]
    facts.append(("outcome", drive.outcome.value.replace("_", " ")))
    more = {**_more(drive.scene, poses=drive.goal_tolerance is not None), "edits": []}
    called = name or _called(drive.planner, drive.scene.grid)
    return RunPage("run", called, driving.digest(drive), facts, _ground(drive.scene.grid), made, more=more)


def untimed(stream: bytes) -> bytes:
    """Frames without the measured times in the last one, ``Z``: the same run gives the same file."""
    at = last = 0
    while at < len(stream):
        last, at = at, at + 4 + int(struct.unpack_from("<I", stream, at)[0])
    if stream[last + 4 : last + 5] != b"Z":
        raise InternalFault("REPLAY", "the stream of a run does not end with its times")
    return stream[:last] + json_frame("Z", {**json.loads(stream[last + 5 :]), "timing": {}})


def compact(sent: bytes) -> bytes:
    """A frame of samples (``D``) as one that compresses to a fifth (``K``); any other as it is.

    The payload of ``D`` with its head and causes as they are, and in place of floats i32: second differences from sample to
    sample of the numbers in grains, number by number. What moves evenly is zeros.
    """
    kind, payload = chr(sent[4]), sent[5:]
    if kind != "D":
        return sent
    _, n, obstacles = struct.unpack_from("<IHH", payload)
    out, at = [payload[:8]], 8
    for wide in (2, 1, 1, 0, 2 * obstacles, 1):
        if not wide:
            out.append(payload[at : at + n])
            at += n
            continue
        numbers = np.frombuffer(payload, dtype="<f4", count=n * wide, offset=at).astype(np.float64)
        at += 4 * n * wide
        grains = np.clip(np.nan_to_num(np.round(numbers / GRAIN), posinf=FAR), -(2**26), FAR).astype(np.int64)
        table = grains.reshape(n, wide).T
        steps = np.diff(np.diff(table, axis=1, prepend=0), axis=1, prepend=0)
        out.append(steps.astype("<i4").tobytes())
    return frame("K", b"".join(out))


def fleet_replay(plan: FleetPlan, fleet: Fleet, name: str = "") -> RunPage:
    """The paths of a fleet."""
    end = {**fleet_ending(plan), "alone": None, "timing": {}}
    made = paths_frame(plan.paths, fleet.goals, plan.shortest) + json_frame("Z", end)
    facts = [
        ("planner", named(plan.planner)),
        ("moves", plan.moves),
        ("seed", str(plan.seed)),
        ("map", _sized(fleet.grid)),
        ("robots", f"{len(fleet):,}"),
    ]
    called = name or _called(plan.planner, fleet.grid)
    return RunPage("fleet", called, fleet_digest(plan, fleet), facts, _ground(fleet.grid), made)


def fleet_digest(plan: FleetPlan, fleet: Fleet) -> str:
    """SHA-256 of what ``lampyris fleet --json --no-timing`` prints of it, without the line's end."""
    text = json.dumps({**fleet_record(plan, fleet), "timing": {}}, allow_nan=False, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def _called(planner: str, grid: Grid) -> str:
    return f"{registry.title_of(planner)} on {grid.name or 'a map'}"


def named(planner: str) -> str:
    """A planner's title, and the name of a command line where that is another."""
    title = registry.title_of(planner)
    return title if title == planner else f"{title} ({planner})"


def _sized(grid: Grid) -> str:
    return f"{grid.name or '-'}, {grid.width} x {grid.height} cells of {grid.resolution:g} m"


def _facts(scene: Scene, planner: str, law: str, seed: int) -> list[tuple[str, str]]:
    return [
        ("planner", named(planner)),
        ("speed law", law),
        ("seed", str(seed)),
        ("map", _sized(scene.grid)),
        ("robot", f"radius {scene.robot.radius:.3g} m, up to {scene.robot.v_max:g} m/s"),
    ]


def _more(scene: Scene, *, poses: bool) -> dict[str, Any]:
    robot = scene.robot
    shape = {} if robot.footprint is None else {"footprint": [list(vertex) for vertex in robot.footprint]}
    return {
        "start": list(scene.start),
        "goal": list(scene.goal),
        "robot": {"radius": robot.radius, "v_max": robot.v_max, **shape},
        "poses": poses,
    }


def _ground(grid: Grid) -> bytes:
    head = {
        "id": "", "name": grid.name or "map", "width": grid.width, "height": grid.height,
        "resolution": grid.resolution, "origin": list(grid.origin), "hash": map_hash(grid),
    }  # fmt: skip
    parts = [json_frame("H", head), frame("B", np.ascontiguousarray(grid_codes(grid)).tobytes())]
    if grid.terrain is not None:
        parts.append(frame("B", grid.terrain.tobytes()))
    return b"".join(parts)
