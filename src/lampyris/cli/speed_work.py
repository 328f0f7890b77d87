"""What ``lampyris speed`` and ``lampyris laws`` do."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from lampyris import api
from lampyris.cli import speed_show, verbs
from lampyris.cli.request import Request, known
from lampyris.errors import SettingError, UsageError
from lampyris.maps.movers_file import read_movers
from lampyris.maps.way_file import UNITS, read_way
from lampyris.model.grid import Grid
from lampyris.model.movers import Movers
from lampyris.model.plan import Plan
from lampyris.model.profile import Profile
from lampyris.model.scene import Scene
from lampyris.motion import laws
from lampyris.motion.compare import Entry, entry_of
from lampyris.motion.course import Course
from lampyris.planners import registry
from lampyris.report.metrics import cause_shares
from lampyris.report.plain import grid_record, profile_record, robot_record, shares_record
from lampyris.report.style import suffix_of
from lampyris.typing import Points

PICTURES = (".png", ".svg")
COLOUR_BY = ("speed", "cause")
SMOOTH = ("arcs", "none")


@dataclass(frozen=True)
class Asked:
    """What was asked, as it was typed."""

    request: Request
    path: Path | None
    units: str | None
    laws: str
    v0: float
    smooth: str
    spacing: float | None
    movers: Path | None

    def check(self) -> tuple[str, ...]:
        """Refuse what does not go together; the laws to compare, the one that is looked at among them."""
        r = self.request
        known("SMOOTH", "--smooth", self.smooth, SMOOTH)
        if self.units is not None:
            known("UNITS", "--units", self.units, UNITS)
            if self.path is None:
                raise UsageError("OPTIONS", "--units without --path", allowed="a file whose units they are")
        ends = {"--start": r.start, "--goal": r.goal, "--start-m": r.start_m, "--goal-m": r.goal_m}
        both = [option for option, given in ends.items() if given is not None and self.path is not None]
        if both:
            raise UsageError("OPTIONS", f"--path and {both[0]}", allowed="one of them")
        names = [word.strip() for word in self.laws.split(",") if word.strip()]
        for name in (*names, r.law or ""):
            known("LAW", "--laws" if name in names else "--law", name, laws.LAWS)
        return tuple(dict.fromkeys((*names, r.law or "")))


@dataclass(frozen=True)
class SpeedOutputs:
    """What is to be printed and written."""

    json: bool
    timing: bool
    csv: Path | None
    picture: Path | None
    chart: Path | None
    colour_by: str
    force: bool
    explain: bool
    all_nodes: bool

    def check(self) -> None:
        """Refuse at once what could not be done at the end."""
        verbs.check_outputs(self.force, self.csv, self.picture, self.chart)
        known("COLOUR_BY", "--colour-by", self.colour_by, COLOUR_BY)
        for path in (self.picture, self.chart):
            if path is not None:
                suffix_of(path, PICTURES)


@dataclass(frozen=True, eq=False)
class Answer:
    """Everything that is told.

    Parameters
    ----------
    scene : map, zones, robot and ends.
    source : where the way is from: a file's name, or who planned it.
    given : the way as it was given, cells (n, 2).
    course : the curve with its nodes.
    entries : a row for each law that lets the robot drive.
    refused : the others, and why.
    chosen : which of them is looked at.
    movers : moving obstacles.
    timing : seconds.
    """

    scene: Scene
    source: str
    given: Points
    course: Course
    entries: tuple[Entry, ...]
    refused: dict[str, str]
    chosen: int
    movers: Movers | None
    timing: dict[str, float]

    @property
    def entry(self) -> Entry:
        """The law that is looked at."""
        return self.entries[self.chosen]


def speed(asked: Asked, out: SpeedOutputs) -> int:
    """``lampyris speed``. Returns the exit code."""
    names = asked.check()
    out.check()
    began = time.perf_counter()
    scene, source, way, notes = _way(asked)
    verbs.remarks(notes)
    if way is None:
        # Who planned has said why; there is nothing to drive on.
        if out.json:
            verbs.print_json({"map": grid_record(scene.grid), "sentence": source, "laws": [], "speed": None})
        else:
            speed_show.no_way(source)
        return verbs.NO_ANSWER
    movers = None if asked.movers is None else read_movers(asked.movers, scene.grid)
    course = api.course(way, scene, smooth=asked.smooth, spacing=asked.spacing)  # type: ignore[arg-type]
    planned = time.perf_counter()
    entries, refused = _entries(names, asked, course, scene, movers)
    chosen = next(k for k, e in enumerate(entries) if e.law == asked.request.law)
    timing = {"way_s": planned - began, "laws_s": time.perf_counter() - planned}
    answer = Answer(scene, source, way, course, entries, refused, chosen, movers, timing)
    _write(answer, out)
    if out.json:
        verbs.print_json(record_of(answer, out.timing))
    else:
        speed_show.answer(answer, explain=out.explain, all_nodes=out.all_nodes)
        speed_show.written(out.csv, out.picture, out.chart)
    return 0


def _way(asked: Asked) -> tuple[Scene, str, Points | None, tuple[str, ...]]:
    """The scene, where the way is from (or why there is none), its points in cells, and remarks."""
    from lampyris.motion.curve import polyline_of

    request = asked.request
    if asked.path is None:
        scenario = request.scenario()
        found: Plan = api.plan(scenario.scene, _planner(request), request.seed, record=False)
        if found.path is None:
            return scenario.scene, found.sentence, None, scenario.notes
        return scenario.scene, request.planner, polyline_of(found.path), scenario.notes
    document = request.load()
    grid, way = document.grid, read_way(asked.path, asked.units)
    points = way.on(grid)
    zones, notes = request.read_zones(grid)
    start, goal = (_cell_of(points[k], grid, str(asked.path), k) for k in (0, len(points) - 1))
    moves: Any = request.preset_of()[0]
    scene = Scene(grid, start, goal, moves, request.robot(), zones=zones)
    return scene, str(asked.path), points, (*document.notes, *notes, *way.notes)


def _planner(request: Request) -> Any:
    from lampyris.cli.request import parse_settings

    return registry.make(request.planner, parse_settings(request.planner, request.settings))


def _cell_of(point: Points, grid: Grid, name: str, k: int) -> tuple[int, int]:
    """The cell that an end of a way is in."""
    x, y = (int(v) for v in np.floor(point + 0.5))
    if not grid.contains((x, y)):
        raise SettingError(
            "PATH_OUTSIDE",
            f"point {k}, ({point[0]:g}, {point[1]:g}) in cells, is outside the map",
            where=name,
            allowed=f"x -0.5 to {grid.width - 0.5:g}, y -0.5 to {grid.height - 0.5:g}",
            todo="give --units cells if these are cells, or the map's own origin and resolution",
        )
    return x, y


def _entries(
    names: tuple[str, ...], asked: Asked, course: Course, scene: Scene, movers: Movers | None
) -> tuple[tuple[Entry, ...], dict[str, str]]:
    """A row for each law, each profile past the referee; and why other laws do not let the robot drive.

    Raises
    ------
    SettingError : PROFILE_BLOCKED: the law that is looked at does not.
    """
    from lampyris.cli.request import parse_law

    looked_at = asked.request.law or ""
    settings = parse_law(looked_at, asked.request.law_settings)
    # The optimum leaves moving obstacles aside: the others are measured against what no obstacle holds.
    best = api.profile(course, scene, "optimum", v0=asked.v0).duration
    entries, refused = [], {}
    for name in names:
        given = settings if name == looked_at else None
        try:
            made = api.profile(course, scene, name, v0=asked.v0, movers=movers, law_settings=given)
        except SettingError as fault:
            if name == looked_at or fault.code != "PROFILE_BLOCKED":
                raise
            refused[name] = fault.what
            continue
        entries.append(replace(entry_of(made, course, scene.robot, best), law=name))
    return tuple(entries), refused


def _write(answer: Answer, out: SpeedOutputs) -> None:
    profile, grid = answer.entry.profile, answer.scene.grid
    if out.csv is not None:
        from lampyris.report.csv_out import write_profile_csv

        write_profile_csv(out.csv, profile, answer.course.heading, grid)
    with verbs._working("drawing", quiet=out.json):
        if out.picture is not None:
            from lampyris.report.course_picture import draw_course

            draw_course(
                grid, profile, out.picture, by=out.colour_by, movers=answer.movers, given=answer.given,
                radius=answer.scene.robot.radius,
            )  # fmt: skip
        if out.chart is not None:
            from lampyris.report.speed_compare import draw_comparison

            draw_comparison([(e.law, e.profile) for e in answer.entries], answer.chosen, out.chart)


def record_of(answer: Answer, timing: bool) -> dict[str, Any]:
    """What ``--json`` prints; all of it but ``timing`` is decided by the files and the options."""
    scene, course, profile = answer.scene, answer.course, answer.entry.profile
    curve = course.curve
    metres = scene.grid.to_metres(course.xy)
    return {
        "map": grid_record(scene.grid),
        "robot": robot_record(scene),
        "way": {
            "from": answer.source,
            "points": len(answer.given),
            "nodes": len(course),
            "length_m": float(course.s[-1]),
            "arcs": 0 if curve is None else int(np.count_nonzero(curve.curvature)),
            "stops": int(np.count_nonzero(course.stop)),
        },
        "law": answer.entry.law,
        "laws": [entry_record(e) for e in answer.entries],
        "refused": [{"law": law, "sentence": why} for law, why in answer.refused.items()],
        "held": shares_record(cause_shares(profile)),
        "speed": {
            **profile_record(profile, caps=True),
            "x_m": metres[:, 0].tolist(),
            "y_m": metres[:, 1].tolist(),
        },
        "timing": answer.timing if timing else {},
    }


def entry_record(e: Entry) -> dict[str, Any]:
    """One law of a comparison."""
    return {
        "law": e.law,
        "duration_s": e.duration_s,
        "mean": e.mean,
        "ratio_to_optimum": e.ratio,
        "peak_acceleration": e.peak_accel,
        "peak_braking": e.peak_braking,
        "peak_lateral": e.peak_lateral,
        "broken": list(e.broken),
    }


def runs(profile: Profile, every: bool) -> list[tuple[int, int]]:
    """(first, last) node of each stretch held by one thing; every node alone if asked for."""
    cause, about = profile.cause, profile.about.tolist()
    n = len(cause)
    cuts = [k for k in range(1, n) if every or (cause[k], about[k]) != (cause[k - 1], about[k - 1])]
    return [(a, b - 1) for a, b in zip([0, *cuts], [*cuts, n], strict=True)]


def list_laws(name: str | None, as_json: bool) -> int:
    """``lampyris laws``. Returns the exit code."""
    if name is not None:
        known("LAW", "NAME", name, laws.LAWS)
    rows = [row for key, row in laws.LAWS.items() if name in (None, key)]
    records = [
        {
            "name": row.name,
            "units": row.units,
            "summary": row.summary,
            "source": row.source,
            "settings": laws.settings_of(row.name),
        }
        for row in rows
    ]
    if as_json:
        verbs.print_json({"laws": records} if name is None else records[0])
    else:
        speed_show.laws(records, alone=name is not None)
    return 0
