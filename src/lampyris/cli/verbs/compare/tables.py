"""The result of ``lampyris compare`` as a table and as JSON."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from lampyris.cli.tables import fits, print_tab
from lampyris.report.data.serialize import grid_record
from lampyris.report.html.table import Tab
from lampyris.study.analysis.summary_tables import START, places_of
from lampyris.study.design.config import plans_poses
from lampyris.study.design.row import Row
from lampyris.study.design.study import Config, Study
from lampyris.study.design.traffic_labels import traffic_words
from lampyris.study.otherwise import remark

ANY_ANGLE = ("theta-star", "lazy-theta-star", "visibility-graph", "polyanya", "quadtree")

Column: TypeAlias = tuple[str, str, float, int | None]
COLUMNS: tuple[Column, ...] = (
    ("cost", "cost", 1.0, 2),
    ("gap", "gap (%)", 100.0, 2),
    ("length_any_angle", "any-angle length", 1.0, 2),
    ("cost_to_go", "cost-to-go", 1.0, 1),
    ("length_m", "length (m)", 1.0, 2),
    ("cost_m", "cost (m)", 1.0, 2),
    ("bound", "bound", 1.0, 3),
    ("reversals", "reversals", 1.0, None),
    ("turns", "turns", 1.0, None),
    ("ticks", "ticks", 1.0, None),
    ("time_s", "time (s)", 1.0, 1),
    ("speed_mean", "mean speed", 1.0, 3),
    ("replans", "replans", 1.0, None),
    ("expansions", "expansions", 1.0, None),
    ("cpu_s", "CPU (s)", 1.0, 3),
)
"""Name of a metric, heading, factor and digits of each column behind the first ones."""
OF_POSES = ("length_m", "cost_m", "bound", "reversals")
"""Columns of tables with a planner of poses; costs in cells and gaps are then left out."""
LESSER = ("cpu_s", "cost_to_go", "speed_mean", "turns", "replans", "expansions", "cost_m")
"""Columns that are left out where the terminal is narrow, in this order."""


@dataclass(frozen=True)
class CompareLine:
    """A line of the table: a planner under a law, its runs one after another."""

    planner: Config
    law: Config
    rows: tuple[Row, ...]

    @property
    def notes(self) -> list[str]:
        """Where each run departed from its settings; empty where it did not."""
        return [str(row.metrics.get("notes") or "") for row in self.rows]

    def good(self, metric: str) -> int:
        """Runs that found, or arrived."""
        return sum(bool(row.metrics.get(metric)) for row in self.rows)

    def mean(self, metric: str) -> float | None:
        """Of the runs that have it; None: none has."""
        some = [row.metrics.get(metric, row.timing.get(metric)) for row in self.rows]
        there = [float(v) for v in some if isinstance(v, int | float)]
        return math.fsum(there) / len(there) if there else None


def notes_of(lines: Sequence[CompareLine]) -> tuple[str, ...]:
    """A sentence for each planner whose runs departed from their settings."""
    by: dict[str, list[str]] = {}
    for line in lines:
        by.setdefault(line.planner.called, []).extend(line.notes)
    # Without obstacles laws do not change the plan: one run under each gives one note.
    some = {who: notes[:1] if len(set(notes)) == 1 else notes for who, notes in by.items()}
    return tuple(filter(None, (remark(who, notes) for who, notes in some.items())))


def _outcome(line: CompareLine, metric: str) -> str:
    """How it went: the outcome's word of one run, a count of several."""
    if len(line.rows) > 1:
        return f"{line.good(metric)} of {len(line.rows)}"
    row = line.rows[0]
    return str(row.metrics.get("outcome") or row.ending)


def _moving(study: Study) -> str:
    label = study.traffic_cases[0].label
    return label if label == "none" else traffic_words(label)


def movement_words(study: Study) -> str:
    """The moves of planners on cells; of those of poses, how the robot drives."""
    if not any(map(plans_poses, study.planners)):
        return f"{study.moves} moves"
    return f"{study.robot['drive']} robot"


def _values(line: CompareLine, columns: Sequence[Column]) -> list[float | None]:
    """A line's means as its columns show them."""
    means = [(line.mean(name), factor) for name, _, factor, _ in columns]
    return [None if mean is None else factor * mean for mean, factor in means]


def _digits(lines: Sequence[CompareLine], column: Column, several: bool) -> int | None:
    """Digits after the point: a column's own; of counts none, of means of counts as a study's tables have."""
    if column[3] is not None or not several:
        return column[3]
    return places_of(*(v for line in lines for v in _values(line, [column]) if v is not None))


def print_comparison(study: Study, lines: Sequence[CompareLine], metric: str) -> None:
    """Print the table, why runs have no result, and which runs departed from their settings."""
    hidden = "time_s" if study.kind == "simulate" else "ticks"
    learns = study.senses or study.worlds[0].goal_track is not None
    poses = any(map(plans_poses, study.planners))
    left_out = (
        hidden,
        "" if len(study.laws) > 1 else "speed_mean",
        "" if learns else "replans",
        *(("cost", "gap", "turns") if poses else OF_POSES),
    )
    columns = [
        c for c in COLUMNS if c[0] not in left_out and any(line.mean(c[0]) is not None for line in lines)
    ]
    tab = _tab(study, lines, metric, columns, ())
    gone: list[str] = []
    for name in LESSER:
        if fits(tab):
            break
        gone += [c[1] for c in columns if c[0] == name]
        columns = [c for c in columns if c[0] != name]
        tab = _tab(study, lines, metric, columns, gone)
    print_tab(tab)
    reasons: dict[str, list[str]] = {}
    for line in lines:
        for why in dict.fromkeys(row.error for row in line.rows if row.error):
            reasons.setdefault(why, []).append(line.planner.called)
    for why, whose in reasons.items():
        print(f"{', '.join(dict.fromkeys(whose))}: {why}")
    for note in notes_of(lines):
        print(note)


def _tab(
    study: Study, lines: Sequence[CompareLine], metric: str, columns: Sequence[Column], gone: Sequence[str]
) -> Tab:
    """The table of these columns; ``gone``: those that there is no room for."""
    world, several = study.worlds[0], len(study.seeds) > 1
    grid, by_law = world.ground.grid, len(study.laws) > 1
    rows = tuple(
        (
            line.planner.called,
            *([line.law.called] if by_law else []),
            _outcome(line, metric),
            *_values(line, columns),
        )
        for line in lines
    )
    notes = [
        f"means over the runs that have a value, of {len(study.seeds)} worlds; for intervals: a study"
    ] * several
    if any(name == "length_any_angle" for name, *_ in columns):
        notes.append(
            "any-angle length and turns are of straight lines, all else of the walk by cells along them"
        )
    elif any(line.planner.name in ANY_ANGLE for line in lines):
        notes.append("in ticks any-angle planners are driven by the walk by cells along their lines")
    exact = dict.fromkeys(line.planner.called for line in lines if line.planner.starts_exact)
    if exact:
        notes.append(f"{', '.join(exact)}: the swarm starts {START}")
    if any(name == "bound" for name, *_ in columns):
        notes.append("bound: no path costs less than cost (m) / bound; of lattices, no path in the lattice")
        if not all(map(plans_poses, study.planners)):
            notes.append("planners on cells plan for the disc around the robot, without headings")
    if gone:
        notes.append(f"no room for {', '.join(gone)}: --json, or a wider terminal")
    return Tab(
        "compare",
        f"{grid.name or 'map'}, {world.query}, {grid.width} x {grid.height} cells of {grid.resolution:g} m, "
        f"{movement_words(study)}, obstacles: {_moving(study)}"
        + ("" if by_law else f", {study.laws[0].called} law"),
        ("planner", *(["law"] if by_law else []), metric, *(c[1] for c in columns)),
        rows,
        "; ".join(notes),
        digits=(None,) * (2 + by_law) + tuple(_digits(lines, c, several) for c in columns),
    )


def record(
    study: Study, lines: Sequence[CompareLine], metric: str, timing: bool, seconds: float
) -> dict[str, Any]:
    """What ``--json`` prints; all of it but the timings is decided by the call."""
    world = study.worlds[0]
    return {
        "map": {**grid_record(world.ground.grid), "hash": world.ground.hash},
        "start": list(world.start),
        "goal": list(world.goal),
        "moves": study.moves,
        "kind": study.kind,
        "traffic": study.traffic_cases[0].label,
        "seeds": len(study.seeds),
        "seed": study.root,
        "rows": [
            {
                "planner": line.planner.called,
                "law": line.law.called,
                "runs": len(line.rows),
                metric: line.good(metric),
                **{name: line.mean(name) for name, *_ in COLUMNS if name != "cpu_s"},
                "errors": list(dict.fromkeys(row.error for row in line.rows if row.error)),
                "notes": list(dict.fromkeys(filter(None, line.notes))),
                "timing": {"cpu_s": line.mean("cpu_s")} if timing else {},
            }
            for line in lines
        ],
        "timing": {"total_s": seconds} if timing else {},
    }
