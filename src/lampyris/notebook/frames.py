"""A simulation or a drive as frames that a page can show: plain lists of numbers and words."""

from __future__ import annotations

from typing import Any

import numpy as np

from lampyris.errors import SettingError
from lampyris.model.drive import Drive
from lampyris.model.trace import Trace

MOST_FRAMES = 1200
"""Frames of a widget; a longer run is shown at moments farther apart."""


def frames_of(run: Trace | Drive) -> dict[str, Any]:
    """What a widget shows.

    Parameters
    ----------
    run : a simulation in ticks or a drive.

    Returns
    -------
    ``t`` of each frame and its ``unit``; ``x``, ``y`` of the robot, cells; its ``speed`` (``speed_unit``) and the ``cause`` that
    limits it; ``obstacles``: of each its ``radius`` (cells) and ``x``, ``y`` by frame, None before it appears; ``goal``,
    ``radius`` of the robot, and the ``outcome`` in words.

    Raises
    ------
    SettingError : ``TYPE``.
    """
    if isinstance(run, Trace):
        return _of_trace(run)
    if isinstance(run, Drive):
        return _of_drive(run)
    raise SettingError("TYPE", f"a {type(run).__name__}", where="run", allowed="a Trace or a Drive")


def _of_trace(run: Trace) -> dict[str, Any]:
    ticks = np.unique(np.linspace(0, run.ticks, min(run.ticks + 1, MOST_FRAMES)).round().astype(np.int64))
    cell = run.scene.grid.resolution
    obstacles = []
    for track, first, spec in zip(run.tracks, run.appears, run.obstacle_specs, strict=True):
        at = [
            track[min(tick - first, len(track) - 1)].tolist() if tick >= first else [None, None]
            for tick in ticks
        ]
        obstacles.append(
            {"radius": max(spec.radius / cell, 0.4), "x": [x for x, _ in at], "y": [y for _, y in at]}
        )
    robot = run.robot[ticks]
    return {
        "t": ticks.tolist(), "unit": "tick", "x": robot[:, 0].tolist(), "y": robot[:, 1].tolist(),
        "speed": run.speed[ticks].round(6).tolist(), "speed_unit": run.units, "cause": [run.cause[k] for k in ticks],
        "obstacles": obstacles, **_ends(run),
    }  # fmt: skip


def _of_drive(run: Drive) -> dict[str, Any]:
    count = max(min(int(run.duration / 0.05) + 1, MOST_FRAMES), 2)
    t = np.linspace(0.0, run.duration, count)
    points, speeds = run.at(t)
    segment = np.clip(np.searchsorted(run.t, t, side="right") - 1, 0, len(run.t) - 1)
    cell = run.scene.grid.resolution
    obstacles = []
    for track in run.tracks:
        at = track.at(t)
        there = t >= track.t[0]
        obstacles.append(
            {
                "radius": max(track.radius / cell, 0.4),
                "x": [round(x, 4) if ok else None for x, ok in zip(at[:, 0].tolist(), there, strict=True)],
                "y": [round(y, 4) if ok else None for y, ok in zip(at[:, 1].tolist(), there, strict=True)],
            }
        )
    return {
        "t": t.round(3).tolist(), "unit": "s", "x": points[:, 0].round(4).tolist(), "y": points[:, 1].round(4).tolist(),
        "speed": speeds.round(4).tolist(), "speed_unit": "m/s", "cause": [run.cause[k] for k in segment],
        "obstacles": obstacles, **_ends(run),
    }  # fmt: skip


def _ends(run: Trace | Drive) -> dict[str, Any]:
    scene = run.scene
    radius = max(scene.robot.radius / scene.grid.resolution, 0.4)
    return {
        "start": list(scene.start),
        "goal": list(scene.goal),
        "radius": radius,
        "outcome": str(run.outcome),
    }
