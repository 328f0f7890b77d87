"""What ``lampyris compare`` does: a study of one world in memory, one table and one picture of it."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, TypeAlias

from lampyris.cli import BAD_INPUT, INTERNAL_FAULT, outputs, show, study_show, verbs
from lampyris.cli.request import Request, about, known, parse_law, parse_settings
from lampyris.errors import InputError, SettingError, UsageError
from lampyris.io.maps.map_hash import map_hash
from lampyris.io.scenario.scenario import Scenario
from lampyris.model.traffic import RandomWalk
from lampyris.motion.laws import registry as laws
from lampyris.report.data.serialize import grid_record
from lampyris.report.html.table import Tab
from lampyris.sim.traffic.mobility import MOBILITIES
from lampyris.study.analysis.summary_tables import START, places_of
from lampyris.study.design.config import law_who, planner_who
from lampyris.study.design.row import Row
from lampyris.study.design.study import Config, Study, StudyMap, StudyTraffic, World
from lampyris.study.design.traffic_labels import crowd_words
from lampyris.study.otherwise import remark

PLANNERS = "ad-gso,astar,dstar-lite,theta-star,dstar-lpso"
AMONG_OBSTACLES = f"{PLANNERS},sipp"
ANY_ANGLE = ("theta-star", "lazy-theta-star")
MAX_RUNS = 10_000
"""More than that is a study."""

Column: TypeAlias = tuple[str, str, float, int | None]
COLUMNS: tuple[Column, ...] = (
    ("cost", "cost", 1.0, 2),
    ("gap", "gap (%)", 100.0, 2),
    ("length_any_angle", "any-angle length", 1.0, 2),
    ("cost_to_go", "cost-to-go", 1.0, 1),
    ("turns", "turns", 1.0, None),
    ("ticks", "ticks", 1.0, None),
    ("time_s", "time (s)", 1.0, 1),
    ("speed_mean", "mean speed", 1.0, 3),
    ("expansions", "expansions", 1.0, None),
    ("cpu_s", "CPU (s)", 1.0, 3),
)
"""Name of a metric, heading, factor and digits of each column behind the first ones."""
LESSER = ("cpu_s", "cost_to_go", "speed_mean", "turns", "expansions")
"""Columns that are left out where the terminal is narrow, in this order."""


@dataclass(frozen=True)
class CrowdAsked:
    """What moves besides the robot, as it was typed."""

    count: int
    mobility: str
    rate: float | None
    radius: float
    live: bool
    ticks: int | None

    def crowd(self) -> StudyTraffic:
        """As a study has it.

        Raises
        ------
        UsageError : no such mobility; options of a crowd where there is none.
        """
        known("MOBILITY", "--mobility", self.mobility, MOBILITIES)
        if self.rate is not None and self.mobility not in ("random-walk", "mixed"):
            raise UsageError("OPTIONS", f"--rate with --mobility {self.mobility}", allowed="random walkers")
        if self.rate is not None and self.count and not self.live:
            raise UsageError(
                "OPTIONS",
                "--rate without --live",
                allowed="--live: a track that is replayed begins at tick 0",
            )
        RandomWalk(self.count, self.rate, self.radius)  # refuses numbers out of range
        if self.count:
            tracks: Any = "live" if self.live else "replayed"
            return StudyTraffic(self.mobility, self.count, self.rate, self.radius, tracks)
        alone = {"--rate": self.rate is not None, "--live": self.live, "--ticks": self.ticks is not None}
        for option in (option for option, given in alone.items() if given):
            raise UsageError("OPTIONS", f"{option} without --obstacles", allowed="--obstacles N")
        return StudyTraffic()


@dataclass(frozen=True)
class Asked:
    """What was asked, as it was typed."""

    request: Request
    planners: str | None
    laws: str | None
    crowd: CrowdAsked
    seeds: int
    workers: int

    def study(self, scenario: Scenario) -> Study:
        """One world, and who meets in it.

        Raises
        ------
        UsageError : an unknown name or setting; the same planner or law twice.
        SettingError : SEEDS: out of range.
        """
        crowd, scene = self.crowd.crowd(), scenario.scene
        names = self.planners or (AMONG_OBSTACLES if crowd.count else PLANNERS)
        planners = _entries("--planners", names, _planner)
        by = _entries("--laws", self.laws or scenario.law, _law)
        most = MAX_RUNS // (len(planners) * len(by))
        if not 1 <= self.seeds <= most:
            raise SettingError(
                "SEEDS", f"{self.seeds}", where="--seeds", allowed=f"1 to {most}", todo="more is a study"
            )
        ground = StudyMap(scene.grid.name or "map", scene.grid, map_hash(scene.grid))
        return Study(
            name="compare",
            kind="simulate" if crowd.count else "plan",
            worlds=(World(ground, scene.start, scene.goal),),
            planners=planners,
            laws=by,
            crowds=(crowd,),
            seeds=tuple(range(self.seeds)),
            moves=scene.moves.name,
            robot=asdict(scene.robot),
            ticks=self.crowd.ticks,
            root=self.request.seed,
        )


@dataclass(frozen=True)
class Outputs:
    """What is to be printed and written."""

    json: bool
    timing: bool
    picture: Path | None
    csv: Path | None
    force: bool

    def check(self) -> None:
        """Refuse at once what could not be done at the end."""
        outputs.check_outputs(self.force, json=self.json, picture=self.picture, csv=self.csv)


@dataclass(frozen=True)
class Line:
    """A line of the table: a planner under a law, its runs one after another."""

    planner: Config
    law: Config
    rows: tuple[Row, ...]

    @property
    def notes(self) -> list[str]:
        """What was done otherwise than asked in each run; empty where nothing was."""
        return [str(row.metrics.get("notes") or "") for row in self.rows]

    def good(self, metric: str) -> int:
        """Runs that found, or arrived."""
        return sum(bool(row.metrics.get(metric)) for row in self.rows)

    def mean(self, metric: str) -> float | None:
        """Of the runs that have it; None: none has."""
        some = [row.metrics.get(metric, row.timing.get(metric)) for row in self.rows]
        there = [float(v) for v in some if isinstance(v, int | float)]
        return math.fsum(there) / len(there) if there else None


def _notes(lines: Sequence[Line]) -> tuple[str, ...]:
    """What was done otherwise than asked, a sentence for each planner in whose runs something was."""
    by: dict[str, list[str]] = {}
    for line in lines:
        by.setdefault(line.planner.called, []).extend(line.notes)
    # Laws do not change what is planned for nobody: one run under each is one remark.
    some = {who: notes[:1] if len(set(notes)) == 1 else notes for who, notes in by.items()}
    return tuple(filter(None, (remark(who, notes) for who, notes in some.items())))


def _entries(option: str, text: str, make: Callable[[str, list[str]], Config]) -> tuple[Config, ...]:
    """``NAME[:KEY=VALUE...],...`` as who plans or which law, in the order given."""
    made: list[Config] = []
    for word in filter(None, (part.strip() for part in text.split(","))):
        name, *settings = word.split(":")
        try:
            one = make(name, settings)
        except (UsageError, SettingError) as fault:
            what = f"{word}: {fault.what}" if isinstance(fault, SettingError) else fault.what
            raise UsageError(fault.code, what, where=option, allowed=fault.allowed, todo=fault.todo) from None
        if any(one.name == other.name and one.settings == other.settings for other in made):
            raise UsageError("OPTIONS", f"{word} twice", where=option, allowed="each once")
        made.append(one)
    if not made:
        raise UsageError("OPTIONS", repr(text), where=option, allowed="NAME[:KEY=VALUE...],...")
    return tuple(made)


def _planner(name: str, words: list[str]) -> Config:
    """A planner with all its settings."""
    return planner_who(name, parse_settings(name, words), label_of(name, words))


def _law(name: str, words: list[str]) -> Config:
    """A law with all its settings."""
    known("LAW", "--laws", name, laws.LAWS)
    return law_who(name, parse_law(name, words), label_of(name, words))


def label_of(name: str, words: list[str]) -> str:
    """What a table calls it: ``ad-gso choice=exact``."""
    return " ".join((name, *words))


def compare(asked: Asked, out: Outputs) -> int:
    """``lampyris compare``. Returns the exit code."""
    from lampyris.study.execution import run as running
    from lampyris.study.execution.execution import Execution

    out.check()
    scenario = asked.request.scenario()
    study = asked.study(scenario)
    drawn = sum(len(one.starts) for one in scenario.scene.traffic if isinstance(one, RandomWalk))
    left = (f"the {drawn} moving obstacles drawn in the map are left aside: a comparison draws its own",)
    verbs.remarks((*scenario.notes, *about(scenario.scene), *(left if drawn else ())))
    began = time.perf_counter()
    rows: dict[str, Row] = {}

    def keep(some: Sequence[Row]) -> None:
        rows.update((row.key, row) for row in some)

    with verbs._counting("comparing", f"of {len(study)}", quiet=out.json) as tick:
        running.run(
            study,
            keep,
            where=Execution(workers=asked.workers),
            progress=None if tick is None else lambda p: tick(p.done),
        )
    lines = _lines(study, rows)
    if out.csv is not None:
        from lampyris.study.analysis.export import write_csv
        from lampyris.study.analysis.table import table_of

        with outputs.place(out.csv) as place:
            write_csv(place, table_of(study, rows))
    if out.picture is not None:
        from lampyris.cli.compare_draw import draw

        with verbs._working("drawing", quiet=out.json):
            draw(study, lines, out.picture, speeds=asked.laws is not None)
    metric = "found" if study.kind == "plan" else "arrived"
    if out.json:
        verbs.print_json(_record(study, lines, metric, out.timing, time.perf_counter() - began))
    else:
        with outputs.text_beside(out.csv):
            _show(study, lines, metric, out)
    code = _exit_code(lines, metric)
    if code == BAD_INPUT:
        code_of, _, what = lines[0].rows[0].error.partition(": ")
        # A row holds the code and the words of an error, not the setting.
        raise InputError(code_of, what, setting="traffic.count" if code_of == "OBSTACLE_ROOM" else "")
    return code


def _exit_code(lines: Sequence[Line], metric: str) -> int:
    """0: somebody found or arrived. Else by what all runs have in common: refused, or a fault."""
    if any(line.good(metric) for line in lines):
        return 0
    for ending, code in (("refused", BAD_INPUT), ("failed", INTERNAL_FAULT)):
        if all(row.ending == ending for line in lines for row in line.rows):
            return code
    return verbs.NO_ANSWER


def _lines(study: Study, rows: Mapping[str, Row]) -> list[Line]:
    """The table: planners in the order given, each under all laws."""
    found: dict[tuple[str, str], list[Row]] = {}
    for job in study.jobs():
        found.setdefault((job.labels["planner"], job.labels["law"]), []).append(rows[job.key])
    return [
        Line(planner, law, tuple(found[planner.called, law.called]))
        for planner in study.planners
        for law in study.laws
    ]


def _outcome(line: Line, metric: str) -> str:
    """How it went: the outcome's word of one run, a count of several."""
    if len(line.rows) > 1:
        return f"{line.good(metric)} of {len(line.rows)}"
    row = line.rows[0]
    return str(row.metrics.get("outcome") or row.ending)


def _moving(study: Study) -> str:
    label = study.crowds[0].label
    return label if label == "none" else crowd_words(label)


def _values(line: Line, columns: Sequence[Column]) -> list[float | None]:
    """A line's means as its columns show them."""
    means = [(line.mean(name), factor) for name, _, factor, _ in columns]
    return [None if mean is None else factor * mean for mean, factor in means]


def _digits(lines: Sequence[Line], column: Column, several: bool) -> int | None:
    """Digits after the point: a column's own; of counts none, of means of counts as a study's tables have."""
    if column[3] is not None or not several:
        return column[3]
    return places_of(*(v for line in lines for v in _values(line, [column]) if v is not None))


def _show(study: Study, lines: Sequence[Line], metric: str, out: Outputs) -> None:
    """The table, what it is of, why runs have no result, and what was not done as asked."""
    hidden = "ticks" if study.kind == "plan" else "time_s"
    left_out = (hidden, "" if len(study.laws) > 1 else "speed_mean")
    columns = [
        c for c in COLUMNS if c[0] not in left_out and any(line.mean(c[0]) is not None for line in lines)
    ]
    tab = _tab(study, lines, metric, columns, ())
    gone: list[str] = []
    for name in LESSER:
        if study_show.fits(tab):
            break
        gone += [c[1] for c in columns if c[0] == name]
        columns = [c for c in columns if c[0] != name]
        tab = _tab(study, lines, metric, columns, gone)
    study_show.tab(tab)
    reasons: dict[str, list[str]] = {}
    for line in lines:
        for why in dict.fromkeys(row.error for row in line.rows if row.error):
            reasons.setdefault(why, []).append(line.planner.called)
    for why, whose in reasons.items():
        print(f"{', '.join(dict.fromkeys(whose))}: {why}")
    for note in _notes(lines):
        print(note)
    show.written(out.picture, out.csv)


def _tab(
    study: Study, lines: Sequence[Line], metric: str, columns: Sequence[Column], gone: Sequence[str]
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
    if gone:
        notes.append(f"no room for {', '.join(gone)}: --json, or a wider terminal")
    return Tab(
        "compare",
        f"{grid.name or 'map'}, {world.query}, {grid.width} x {grid.height} cells of {grid.resolution:g} m, "
        f"{study.moves} moves, obstacles: {_moving(study)}"
        + ("" if by_law else f", {study.laws[0].called} law"),
        ("planner", *(["law"] if by_law else []), metric, *(c[1] for c in columns)),
        rows,
        "; ".join(notes),
        digits=(None,) * (2 + by_law) + tuple(_digits(lines, c, several) for c in columns),
    )


def _record(study: Study, lines: Sequence[Line], metric: str, timing: bool, seconds: float) -> dict[str, Any]:
    """What ``--json`` prints; all of it but the timings is decided by the call."""
    world = study.worlds[0]
    return {
        "map": {**grid_record(world.ground.grid), "hash": world.ground.hash},
        "start": list(world.start),
        "goal": list(world.goal),
        "moves": study.moves,
        "kind": study.kind,
        "crowd": study.crowds[0].label,
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
