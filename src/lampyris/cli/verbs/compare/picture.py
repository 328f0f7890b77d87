"""The picture of ``lampyris compare``: every planner's path in the first world, and speeds along them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from lampyris.cli.verbs.compare.tables import CompareLine, movement_words
from lampyris.errors import LampyrisError
from lampyris.model.drive import Drive
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan
from lampyris.model.profile import Profile
from lampyris.model.robot import Robot
from lampyris.model.trace import Trace
from lampyris.report.charts.speed_chart import line_of
from lampyris.report.pictures.compare_picture import DrawnPath, Speeds, draw_paths
from lampyris.report.pictures.footprints import outlines_along
from lampyris.study.design.config import plans_poses
from lampyris.study.design.study import Job, Study
from lampyris.study.design.traffic_labels import traffic_words
from lampyris.study.execution.worker import TimeUp, run_job
from lampyris.typing import Floats, Points

NOTHING: Points = np.zeros((0, 2))
_SAMPLES = 800
"""Points of the trail of a drive."""


class _Drawn(NamedTuple):
    """What one run adds to the picture: its path and its robot along it (cells), its speeds, where obstacles went."""

    xy: Points = NOTHING
    speeds: Speeds | None = None
    tracks: tuple[Points, ...] = ()
    outlines: tuple[Points, ...] = ()


def draw(study: Study, lines: Sequence[CompareLine], out: Path, *, speeds: bool) -> None:
    """Run the first world once more, for its paths, and draw them.

    With one law ``speeds`` draws each planner's; with several the laws of the first planner that found a path.
    """
    first = replace(study, seeds=study.seeds[:1])
    jobs = list(first.jobs())
    world, many = study.worlds[0], len(study.laws)
    grid = world.ground.grid
    found = [_run_again(job, grid) for job in jobs[::many]]
    paths = [
        DrawnPath(config.called, _result_words(line), one.xy, one.outlines)
        for config, line, one in zip(study.planners, lines[::many], found, strict=True)
    ]
    tracks = next((one.tracks for one in found if one.tracks), ())
    shown: list[Speeds] = []
    title = ""
    if speeds and many == 1:
        title = f"speed along each path, {study.laws[0].called} law"
        shown = [
            replace(one.speeds, name=config.called, path=k)
            for k, (config, one) in enumerate(zip(study.planners, found, strict=True))
            if one.speeds is not None
        ]
    elif speeds:
        k = next((k for k, one in enumerate(found) if one.speeds is not None), None)
        if k is not None:
            title = f"speed along the path of {study.planners[k].called}, by law"
            some = [_run_again(job, grid).speeds for job in jobs[k * many : (k + 1) * many]]
            shown = [
                replace(line, name=law.called)
                for law, line in zip(study.laws, some, strict=True)
                if line is not None
            ]
    traffic = study.traffic_cases[0]
    what = "nothing moves" if traffic.label == "none" else f"obstacles: {traffic_words(traffic.label)}"
    words = f"{world.query}  ·  {movement_words(study)}  ·  {what}"
    if len(study.seeds) > 1:
        words += f"  ·  the first of {len(study.seeds)} worlds; the numbers are of this one"
    names = "drives" if study.senses else "planner" if len(paths) == 1 else "planners"
    draw_paths(
        grid, world.start, world.goal, paths, out, title=f"{len(paths)} {names} on {grid.name or 'a map'}",
        subtitle=words, speeds=shown, speeds_title=title, tracks=tracks,
    )  # fmt: skip


def _result_words(line: CompareLine) -> str:
    """Length, cost and gap of the first run, or how it ended, and whether it departed from its settings."""
    row = line.rows[0]
    cost, gap = row.metrics.get("cost"), row.metrics.get("gap")
    poses = plans_poses(line.planner)
    metres, bound = row.metrics.get("length_m"), row.metrics.get("bound")
    if poses:
        cost = gap = None  # of the cells that a path of poses passes through
    good = row.metrics.get("arrived", row.metrics.get("found"))
    words = [] if good else [str(row.metrics.get("outcome") or row.ending)]
    lines = row.metrics.get("length_any_angle")
    # What is drawn of such a plan are its lines; its cost is that of another path, the walk by cells.
    words += [f"any-angle length {lines:.2f}"] if isinstance(lines, int | float) else []
    by = " by cells" if isinstance(lines, int | float) else ""
    words += [f"cost{by} {cost:.2f}"] if isinstance(cost, int | float) else []
    words += [f"gap {gap:.1%}"] if isinstance(gap, int | float) else []
    if isinstance(bound, int | float):
        words += [f"{metres:.2f} m, bound {bound:.3f}"]
    elif poses and good and isinstance(metres, int | float):
        words += [f"{metres:.2f} m"]
    # Lattices begin and end at their nearest poses: the table says how near.
    words += ["not as asked"] if row.metrics.get("notes") and not poses else []
    return ", ".join(words)


def _run_again(job: Job, grid: Any) -> _Drawn:
    """A run once more."""
    try:
        made = run_job(job.plain, grid)
    except (LampyrisError, TimeUp):
        return _Drawn()  # the table says why
    result, profile = made.noun, made.profile
    if isinstance(result, Trace):
        tracks = tuple(np.asarray(t, dtype=np.float64) for t in result.tracks)
        return _Drawn(result.robot.astype(np.float64), _driven(result), tracks)
    if isinstance(result, Drive):
        return _trail(result)
    assert isinstance(result, Plan)
    speeds = None if profile is None else _planned(profile)
    if result.path is None:
        return _Drawn()
    if result.pose_path is not None:
        poses = result.pose_path.poses
        outlines = _outlines(poses, grid, Robot(**job.plain["robot"]))
        return _Drawn(grid.frame.to_points(poses[:, 0], poses[:, 1]), speeds, outlines=outlines)
    xy = result.path.cells if result.waypoints is None else result.waypoints
    return _Drawn(np.asarray(xy, dtype=np.float64), speeds)


def _trail(drive: Drive) -> _Drawn:
    """What a drive in continuous time adds to the picture."""
    times = np.linspace(0.0, drive.duration, _SAMPLES)
    poses, (xy, v) = drive.poses(times), drive.at(times)
    step = np.diff(poses[:, :2], axis=0)
    s: Floats = np.concatenate(([0.0], np.cumsum(np.sqrt((step * step).sum(axis=1)))))
    tracks = tuple(np.asarray(track.xy, dtype=np.float64) for track in drive.tracks)
    outlines = _outlines(poses, drive.scene.grid, drive.scene.robot)
    return _Drawn(xy, Speeds("", f"{drive.duration:.4g} s", s, v, "m/s"), tracks, outlines)


def _outlines(poses: Floats, grid: Grid, robot: Robot) -> tuple[Points, ...]:
    """The robot along some poses, cells."""
    return tuple(grid.frame.to_points(one[:, 0], one[:, 1]) for one in outlines_along(poses, robot))


def _planned(profile: Profile) -> Speeds:
    s, v = line_of(profile)
    unit = "s" if profile.metric else "transfers"
    return Speeds("", f"{profile.duration:.4g} {unit}", s, v, profile.units)


def _driven(trace: Trace) -> Speeds | None:
    """Speed over the path that was really driven, waits at one place."""
    if len(trace.robot) < 2:
        return None
    step = np.diff(trace.robot.astype(np.float64), axis=0)
    s: Floats = np.concatenate(([0.0], np.cumsum(np.sqrt((step * step).sum(axis=1)))))
    if trace.units == "m/s":
        s = s * trace.scene.grid.resolution
    return Speeds("", f"{trace.ticks} ticks", s, trace.speed, trace.units)
