"""Drives in continuous time, as samples that the page can play."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np

from lampyris import scenarios
from lampyris.app.engine.frames import NOWHERE, drive_frame, json_frame, seen_frame
from lampyris.app.engine.parse import scenario_of_request
from lampyris.app.engine.progress import Share
from lampyris.app.engine.simulation import obstacle_record, outline_record, sensor_record
from lampyris.errors import UsageError
from lampyris.io.scenario.scenario import Scenario
from lampyris.model.curve import Curve, PoseCurve
from lampyris.model.drive import Drive
from lampyris.model.obstacles import Track
from lampyris.model.settings.drive import DriveSettings
from lampyris.motion.laws import registry as laws
from lampyris.report.data.following import following
from lampyris.report.data.gaps import gaps_between
from lampyris.report.data.metrics import drive_shares, worth_telling
from lampyris.report.data.serialize import drive_record, grid_record

STEP: Final = 0.05
"""Seconds between two samples of a drive, unless that makes more than :data:`MOST_PLACES`."""
MOST_PLACES: Final = 4_000_000
"""Samples times robots and obstacles: 32 MB."""
MOST_POSES: Final = 20_000
"""Poses of the paths of one drive."""
PIECE: Final = 2_000
"""Samples of one frame."""


def drive(question: Mapping[str, Any], look: Callable[[], None]) -> Iterator[bytes]:
    """A scenario's drive: ``H D* [U] E Z``. Each controller of a comparison is a question of its own, with its own limits.

    Raises
    ------
    UsageError : DRIVE: the scenario is not driven.
    LampyrisError : as :func:`lampyris.drive`.
    """
    scenario = scenario_of_request(question)
    if scenario.drive is None:
        raise UsageError(
            "DRIVE",
            "a scenario without `drive`",
            where="scenario: /drive",
            allowed="settings of a drive, or {}",
        )
    made = driven(scenario, look)
    head = {"job": question.get("job"), "controller": made.controller, "planner": scenario.planner}
    yield from frames_of(made, head, scenario.notes)


def driven(scenario: Scenario, look: Callable[[], None]) -> Drive:
    """The scenario's drive, verified by the referee; reports its progress.

    Raises
    ------
    LampyrisError : as :func:`lampyris.drive`.
    """
    share = Share(f"driving with {DriveSettings.of(scenario.drive or {}).controller}")

    def second(t: int) -> None:
        share(t)
        look()

    made: Any = scenarios.run(scenario, progress=second)
    return made  # type: ignore[no-any-return]


def frames_of(made: Drive, head: Mapping[str, Any], notes: Sequence[str] = ()) -> Iterator[bytes]:
    """A drive as frames: what it is, its samples, what its sensor saw, its events, its end."""
    step = step_of(made)
    causes = list(dict.fromkeys(made.cause))
    paths, omitted = paths_of(made)
    yield json_frame("H", {**head, **_header(made, notes, step, causes), "paths": paths})
    many = max(1, math.ceil(made.duration / step - 1e-9) + 1)
    times = np.minimum(np.arange(many) * step, made.duration)
    times[-1] = made.duration
    yaw = np.unwrap(made.poses(times)[:, 2] - made.scene.grid.origin[2]) if made.curves else np.zeros(many)
    for first in range(0, many, PIECE):
        yield _samples(made, times[first : first + PIECE], yaw[first : first + PIECE], first, causes)
    if (seen := _seen(made, step, many)) is not None:
        yield seen
    yield json_frame("E", [_event(moment, step, many) for moment in made.moments])
    end = ending(made)
    if omitted:
        end["notes"].append(
            f"{omitted} of the {omitted + len(paths)} paths that the robot was to follow are not drawn: together they have "
            f"more than {MOST_POSES:,} poses"
        )
    yield json_frame("Z", {**head, **end})


def _seen(made: Drive, step: float, many: int) -> bytes | None:
    """The sample from which on each cell had been seen; None without a sensor."""
    if made.seen is None:
        return None
    samples = np.ceil(made.seen * (made.period / step) - 1e-9)
    return seen_frame(
        np.where(made.seen < 0, -1, np.minimum(samples, many - 1)).astype(np.int32).ravel(), 0, many
    )


def step_of(made: Drive) -> float:
    """Seconds between two samples: a whole multiple of :data:`STEP`."""
    places = (made.duration / STEP + 1) * (len(made.tracks) + 1)
    return STEP * max(1, math.ceil(places / MOST_PLACES))


def ending(made: Drive) -> dict[str, Any]:
    """How a drive ended, and its measures: those that ``lampyris drive --controller`` prints."""
    words = [moment.word for moment in made.moments]
    return {
        "outcome": made.outcome.value,
        "arrived": made.arrived,
        "sentence": made.sentence,
        "duration": made.duration,
        "optimum": made.optimum,
        "replans": made.replans,
        "waits": words.count("wait"),
        "hits": words.count("hit"),
        "fastest": float(made.v.max(initial=0.0)),
        "limited_by": [[one.cause, one.time] for one in worth_telling(drive_shares(made))],
        "safety_filter": made.safety_filter if made.paths else None,
        "following": following(made) if made.goal_tolerance is not None else None,
        "notes": list(made.notes),
        "digest": digest(made),
        "timing": dict(made.timing),
    }


def digest(made: Drive) -> str:
    """SHA-256 of what ``lampyris run --json --no-timing`` prints of it, without the line's end."""
    text = json.dumps({**drive_record(made), "timing": {}}, allow_nan=False, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def _header(made: Drive, notes: Sequence[str], step: float, causes: list[str]) -> dict[str, Any]:
    return {
        "law": made.law,
        "units": laws.named(made.law).units if made.law in laws.LAWS else "m/s",
        "seed": made.seed,
        "map": grid_record(made.scene.grid),
        "start": list(made.scene.start),
        "goal": list(made.scene.goal),
        "causes": causes,
        "step": step,
        "sensor": sensor_record(made.sensor, made.scene.grid),
        "obstacle_specs": [
            {**obstacle_record(one), "radius": track.radius, **_outline(track, made.scene.grid.resolution)}
            for one, track in zip(made.obstacle_specs, made.tracks, strict=True)
        ],
        "notes": list(notes),
    }


def _outline(track: Track, resolution: float) -> dict[str, Any]:
    """Of a polygon its ``outline`` (cells, x ahead and y to the left) and its ``turns``: times, and its heading at each; between
    two it turns evenly.
    """
    if track.outline is None or track.yaw is None:
        return {}
    keep = np.ones(len(track.t), dtype=np.bool_)
    keep[1:-1] = (track.yaw[1:-1] != track.yaw[:-2]) | (track.yaw[1:-1] != track.yaw[2:])
    turns = np.round(np.column_stack((track.t, track.yaw))[keep], 4)
    return {"outline": outline_record(track.outline, resolution), "turns": turns.tolist()}


def paths_of(made: Drive) -> tuple[list[dict[str, Any]], int]:
    """The paths that the robot was to follow: since when (``t``, seconds), and their ``poses`` half a cell apart as the
    page draws them: x, y, yaw and gear as :func:`lampyris.app.engine.work.plan` gives those of plans; along cells x and y alone.
    And how many are left out, which together would have more than :data:`MOST_POSES` poses.
    """
    if made.paths:
        curves, since = made.paths, made.path_times
    else:
        curves = made.curves
        since = tuple(
            float(made.t[np.argmax(made.leg == k)]) if (made.leg == k).any() else math.inf
            for k in range(len(curves))
        )
    found: list[dict[str, Any]] = []
    left, omitted = MOST_POSES, 0
    for curve, t in zip(curves, since, strict=True):
        if not len(curve.lengths) or not math.isfinite(t):
            continue
        poses = _poses(curve)
        left -= len(poses)
        if left >= 0:
            found.append({"t": t, "poses": poses})
        else:
            omitted += 1
    return found, omitted


def _poses(curve: Curve) -> list[list[float]]:
    many = max(math.ceil(2 * curve.length / curve.resolution), 1) + 1
    s = np.union1d(np.linspace(0.0, curve.length, many), curve.begins)
    columns: list[Any] = [curve.at(s)[0]]
    if isinstance(curve, PoseCurve):
        columns += [curve.yaw_at(s)[:, None], curve.gears[curve.pieces_at(s)][:, None]]
    rows: list[list[float]] = np.round(np.hstack(columns), 4).tolist()
    return rows


def _samples(made: Drive, t: Any, yaw: Any, first: int, causes: list[str]) -> bytes:
    """A frame of the samples at some times."""
    if made.curves:
        xy, speed = made.at(t)
        k = np.clip(np.searchsorted(made.t, t, side="right") - 1, 0, len(made.t) - 1)
        numbers = np.array([causes.index(word) for word in made.cause], dtype=np.uint8)
        cause = numbers[k]
    else:
        xy = np.tile(np.array(made.scene.start, dtype=np.float64), (len(t), 1))
        speed, cause = np.zeros(len(t)), np.zeros(len(t), dtype=np.uint8)
    places = np.full((len(t), len(made.tracks), 2), float(NOWHERE))
    near = np.full(len(t), np.inf)
    for j, track in enumerate(made.tracks):
        there = t >= track.t[0]
        places[there, j] = track.at(t[there])
        if made.curves:
            near = np.minimum(near, gaps_between(made, track, t))
    return drive_frame(first, np.column_stack((xy, yaw)), speed, cause, places, np.maximum(near, 0.0))


def _event(moment: Any, step: float, many: int) -> dict[str, Any]:
    """A moment as the page lists it, at the first sample that is not before it."""
    tick = min(max(math.ceil(moment.t / step - 1e-9), 0), many - 1)
    cell = [round(float(c)) for c in moment.xy]
    return {"tick": tick, "word": moment.word, "cell": cell, "sentence": moment.sentence}
