"""Evidence of drives: see :mod:`lampyris.study.execution.evidence`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris.model.curve import Curve
from lampyris.model.drive import Drive, Moment
from lampyris.model.obstacles import Track
from lampyris.model.robot import Polygon
from lampyris.model.scene import Scene
from lampyris.model.trace import Outcome
from lampyris.model.traffic import Obstacle
from lampyris.study.execution import evidence as e
from lampyris.study.execution.pose_evidence import curves_evidence, curves_of

_FORM = dict.fromkeys("tsva", ("<f8", 1)) | {
    "leg": ("<i4", 1), "cause_index": ("<i4", 1), "cause": ("<i2", 1), "pieces": ("<f8", 2), "ends": ("<f8", 2),
    "piece_counts": ("<i4", 1), "stops": ("<i4", 1), "stop_counts": ("<i4", 1), "corners": ("<f8", 2),
    "corner_counts": ("<i4", 1), "discs": ("<f8", 2), "kinds": ("<i2", 1), "moments": ("<f8", 2),
    "moment_obstacles": ("<i4", 1), "moment_words": ("<i2", 1),
}  # fmt: skip

_HEADINGS = {"yaw": ("<f8", 1)}
"""Of polygons: heading at each corner of their tracks, one track after another."""


def drive_evidence(drive: Drive) -> dict[str, Any]:
    """A drive as plain data."""
    words, cause = e.words(drive.cause)
    event_words, moment_words = e.words([m.word for m in drive.moments])
    kinds, kind = e.words([obstacle.kind for obstacle in drive.obstacle_specs])
    tracks = drive.tracks
    posed = drive.goal_tolerance is not None
    curves = () if posed else drive.curves
    pieces = [np.column_stack((c.xy, c.heading, c.lengths, c.curvature)) for c in curves]
    corners = [np.column_stack((one.t, one.xy)) for one in tracks]
    discs = [(t.radius, t.top_speed, b.radius) for t, b in zip(tracks, drive.obstacle_specs, strict=True)]
    arrays: dict[str, NDArray[Any]] = {name: getattr(drive, name) for name in ("t", "s", "v", "a", "leg")}
    arrays |= {
        "cause_index": drive.cause_index,
        "cause": cause,
        "pieces": e.rows(pieces, 6),
        "piece_counts": e.counts(pieces),
        "ends": e.rows([np.array([c.end]) for c in curves], 2),
        "stops": np.concatenate([np.zeros(0, dtype=np.int64), *(c.stops for c in curves)]),
        "stop_counts": e.counts([c.stops for c in curves]),
        "corners": e.rows(corners, 3),
        "corner_counts": e.counts(corners),
        "discs": np.array(discs, dtype=np.float64).reshape(-1, 3),
        "kinds": kind,
        "moments": np.array([(m.t, *m.xy) for m in drive.moments], dtype=np.float64).reshape(-1, 3),
        "moment_obstacles": np.array([m.obstacle for m in drive.moments], dtype=np.int32),
        "moment_words": moment_words,
    }
    with_headings: dict[str, Any] = {
        "curves": curves_evidence(drive.curves),
        "paths": curves_evidence(drive.paths),
        "path_times": list(drive.path_times),
    }
    yaws = [one.yaw for one in tracks if one.yaw is not None]
    if yaws:  # then all are polygons: a world has obstacles of one shape
        with_headings["headings"] = e.pack_arrays({"yaw": np.concatenate(yaws)}, _HEADINGS)
    kept = with_headings if posed else {k: v for k, v in with_headings.items() if k == "headings"}
    return {
        **kept,
        "kind": "drive",
        "outcome": drive.outcome.value,
        "words": words,
        "event_words": event_words,
        "kinds": kinds,
        "period": float(drive.period),
        "optimum": None if drive.optimum is None else float(drive.optimum),
        "counts": [int(drive.replans), int(drive.expansions)],
        "error": float(drive.error),
        "notes": list(drive.notes),
        "arrays": e.pack_arrays(arrays, _FORM),
    }


def drive_of(
    plain: Any,
    scene: Scene,
    *,
    planner: str,
    law: str,
    seed: int,
    shapes: Mapping[float, tuple[Any, Polygon | None]],
    goal_tolerance: tuple[float, float] | None = None,
    steered: tuple[str, str] | None = None,
) -> Drive:
    """The drive that is claimed.

    Parameters
    ----------
    scene : where it was.
    planner, law, seed : of the job.
    shapes : the cells and the outlines of the obstacles of this world, by radius.
    goal_tolerance : metres and radians, of a planner of poses; None: the planner is one of cells.
    steered : controller that steers, and safety filter; None: the path is followed exactly.

    Raises
    ------
    FileError : ``EVIDENCE``. LimitError : ``EVIDENCE_SIZE``.
    """

    def read(plain: Mapping[str, Any]) -> Drive:
        got = e.unpack_arrays(plain["arrays"], _FORM)
        kinds = e.words_at(plain, got["kinds"], "kinds")
        corners = e.split(got["corners"], got["corner_counts"])
        discs = got["discs"].tolist()
        event_words = e.words_at(plain, got["moment_words"], "event_words")
        moments = zip(got["moments"].tolist(), event_words, got["moment_obstacles"].tolist(), strict=True)
        replans, expansions = (e.whole(n, "counts") for n in plain["counts"])
        posed, curves = _posed(plain, scene, steered), _curves(got, scene.grid.resolution)
        if goal_tolerance is not None:
            # A robot that could not start has no curve; the referee asks for one of every other.
            curves = curves_of(plain["curves"], scene.grid, scene.robot) if "curves" in plain else ()
            posed["goal_tolerance"] = goal_tolerance
        return Drive(
            **posed,
            scene=scene, planner=planner, law=law, seed=seed, outcome=Outcome(plain["outcome"]),
            curves=curves, t=got["t"], s=got["s"], v=got["v"], a=got["a"],
            leg=got["leg"], cause=e.words_at(plain, got["cause"]), cause_index=got["cause_index"],
            tracks=tuple(
                Track(table[:, 0], table[:, 1:], radius, top, *headed)
                for table, (radius, top, _), headed in zip(corners, discs, _headed(plain, corners, discs, shapes), strict=True)
            ),
            obstacle_specs=tuple(
                Obstacle(kind, own, kind in ("random-walk", "patrol"), *shapes.get(own, (((0, 0),), None)))
                for kind, (_, _, own) in zip(kinds, discs, strict=True)
            ),
            moments=tuple(Moment(t, word, (x, y), "", obstacle) for (t, x, y), word, obstacle in moments),
            period=e.number(plain["period"], "period"),
            optimum=None if plain["optimum"] is None else e.number(plain["optimum"], "optimum"),
            replans=replans, expansions=expansions, error=e.number(plain["error"], "error"),
            notes=e.notes_of(plain),
        )  # fmt: skip

    return e.reading("drive", plain, read)


def _headed(
    plain: Mapping[str, Any],
    corners: list[NDArray[Any]],
    discs: list[list[float]],
    shapes: Mapping[float, tuple[Any, Polygon | None]],
) -> list[tuple[Any, Any]]:
    """The outline of each track and its headings; neither of discs."""
    if "headings" not in plain:
        return [(None, None)] * len(corners)
    yaw = e.unpack_arrays(plain["headings"], _HEADINGS)["yaw"]
    rows = e.split(yaw, np.array([len(table) for table in corners]))
    return [(shapes[own][1], row) for (_, _, own), row in zip(discs, rows, strict=True)]


def _posed(plain: Mapping[str, Any], scene: Scene, steered: tuple[str, str] | None) -> dict[str, Any]:
    """Controller and planned paths of a drive that was steered; empty of one that was not."""
    if steered is None or "curves" not in plain:
        return {}
    paths, times = curves_of(plain["paths"], scene.grid, scene.robot), plain["path_times"]
    if len(paths) != len(times):
        raise e.wrong(f"{len(times)} times of {len(paths)} paths", "one of each")
    when = tuple(e.number(t, "path_times") for t in times)
    return {"controller": steered[0], "safety_filter": steered[1], "paths": paths, "path_times": when}


def _curves(got: Mapping[str, NDArray[Any]], resolution: float) -> tuple[Curve, ...]:
    parts = zip(
        e.split(got["pieces"], got["piece_counts"]),
        got["ends"].tolist(),
        e.split(got["stops"], got["stop_counts"]),
        strict=True,
    )
    return tuple(
        Curve(p[:, 0:2], p[:, 2:4], p[:, 4], p[:, 5], (end[0], end[1]), resolution, stops)
        for p, end, stops in parts
    )
