"""``lampyris compare``: a few planners and laws in the same world, at once, without a study file.

It is a study of one world in memory. Heavy modules are imported when the verb runs, so that --help is instant.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lampyris._core import defaults
from lampyris.cli import outputs
from lampyris.cli.exit_codes import BAD_INPUT, INTERNAL_FAULT, NO_ANSWER
from lampyris.cli.option_errors import check_choice
from lampyris.cli.option_groups import (
    SENSOR,
    EndOptions,
    LawOptions,
    MapOptions,
    PlannerOptions,
    RobotOptions,
    RuleOptions,
    SensorOptions,
    Ticks,
)
from lampyris.cli.options import Force, GoalTrack, Json, Mobility, NoTiming, ObstacleRadius, Picture, Rate
from lampyris.cli.progress import counting, working
from lampyris.cli.text import print_json, print_notes
from lampyris.errors import InputError, SettingError, UsageError

if TYPE_CHECKING:
    from lampyris.cli.request import Request
    from lampyris.cli.verbs.compare.tables import CompareLine
    from lampyris.io.scenario.scenario import Scenario
    from lampyris.model.settings.sensor import Sensor
    from lampyris.study.design.row import Row
    from lampyris.study.design.study import Config, Study, StudyTraffic
    from lampyris.typing import Cell

PLANNERS = "ad-gso,astar,dstar-lite,theta-star,dstar-lpso"
AMONG_OBSTACLES = f"{PLANNERS},sipp"
MAX_RUNS = 10_000
"""More than that is a study."""


def compare(
    map_options: MapOptions,
    ends: EndOptions,
    robot: RobotOptions,
    rules: RuleOptions,
    sensor: SensorOptions,
    planners: Annotated[
        str | None,
        typer.Option(
            "--planners",
            metavar="NAME,...",
            help="The planners, with settings after colons: ad-gso,ad-gso:choice=exact; of poses too, such as lattice "
            "(default: ad-gso, astar, dstar-lite, theta-star, dstar-lpso; among obstacles sipp too).",
        ),
    ] = None,
    laws: Annotated[
        str | None,
        typer.Option(
            "--laws",
            metavar="NAME,...",
            help="The speed laws, with settings after colons (default: the preset's); the picture then "
            "shows speeds.",
        ),
    ] = None,
    obstacles: Annotated[
        int, typer.Option("--obstacles", metavar="N", help="Number of moving obstacles (0: plans only).")
    ] = 0,
    mobility: Mobility = defaults.MOBILITY,
    rate: Rate = None,
    obstacle_radius: ObstacleRadius = 0.0,
    live: Annotated[
        bool,
        typer.Option(
            "--live",
            help="Obstacles react to the robot; without this option all runs have the same recorded tracks.",
        ),
    ] = False,
    ticks: Ticks = None,
    seeds: Annotated[
        int, typer.Option("--seeds", metavar="N", help="Number of worlds: the table shows means over N runs.")
    ] = 1,
    workers: Annotated[int, typer.Option("--workers", metavar="N", min=1, help="Processes.")] = 1,
    picture: Picture = None,
    csv: Annotated[
        Path | None, typer.Option("--csv", metavar="FILE", help="Write a row for every run.")
    ] = None,
    json_: Json = False,
    no_timing: NoTiming = False,
    force: Force = False,
    goal_track: GoalTrack = None,
    film: Annotated[
        Path | None,
        typer.Option(
            "--film",
            metavar="FILE",
            help="Film the planners' search as a race, then the drive (.webp or .gif).",
        ),
    ] = None,
) -> None:
    """Compare planners and speed laws in the same world: one table, one picture.

    With --sensor-range each planner is run twice: with the map known, and with the sensor instead of the map.
    """
    from lampyris.cli.request import Request, file_errors, read_goal_track, with_goal

    track = None if goal_track is None else read_goal_track(goal_track)
    ends, codes = with_goal(ends, track)
    request = Request(map_options, ends, robot, rules, PlannerOptions("astar"), LawOptions())
    traffic = CompareTraffic(obstacles, mobility, rate, obstacle_radius, live, ticks)
    given = {name: getattr(sensor, name) for name in SENSOR}
    compare_request = CompareRequest(request, planners, laws, traffic, seeds, workers, given, track)
    out = CompareOutputs(json_, not no_timing, picture, csv, force, film)
    with file_errors(goal_track, codes):
        code = run_comparison(compare_request, out)
    raise typer.Exit(code)


@dataclass(frozen=True)
class CompareTraffic:
    """The options of moving obstacles, as they were typed."""

    count: int
    mobility: str
    rate: float | None
    radius: float
    live: bool
    ticks: int | None

    def traffic(self, driven: bool) -> StudyTraffic:
        """The traffic as a study declares it.

        Parameters
        ----------
        driven : whether the robot drives without obstacles, too.

        Raises
        ------
        UsageError : no such mobility; traffic options without traffic.
        SettingError : a number is out of its range.
        """
        from lampyris.model.settings.simulation import SimulationSettings
        from lampyris.model.traffic import RandomWalk
        from lampyris.sim.traffic.mobility import MOBILITIES
        from lampyris.study.design.study import StudyTraffic

        check_choice("MOBILITY", "--mobility", self.mobility, MOBILITIES)
        if self.rate is not None and self.mobility not in ("random-walk", "mixed"):
            raise UsageError("OPTIONS", f"--rate with --mobility {self.mobility}", allowed="random walkers")
        if self.rate is not None and self.count and not self.live:
            raise UsageError(
                "OPTIONS",
                "--rate without --live",
                allowed="--live: a track that is replayed begins at tick 0",
            )
        RandomWalk(self.count, self.rate, self.radius)  # refuses numbers out of range
        SimulationSettings(ticks=self.ticks)
        if self.count:
            tracks: Any = "live" if self.live else "replayed"
            return StudyTraffic(self.mobility, self.count, self.rate, self.radius, tracks)
        alone = {"--rate": self.rate is not None, "--live": self.live}
        alone |= {"--ticks": self.ticks is not None and not driven}
        for option in (option for option, given in alone.items() if given):
            raise UsageError("OPTIONS", f"{option} without --obstacles", allowed="--obstacles N")
        return StudyTraffic()


@dataclass(frozen=True)
class CompareRequest:
    """The options of ``compare``, as they were typed."""

    base: Request
    planners: str | None
    laws: str | None
    traffic: CompareTraffic
    seeds: int
    workers: int
    sensor: Mapping[str, Any]
    goal_track: tuple[Cell, ...] | None

    def study(self, scenario: Scenario) -> Study:
        """A study of one world.

        Raises
        ------
        UsageError : an unknown name or setting; the same planner or law twice.
        SettingError : SEEDS: out of range.
        """
        from lampyris.io.maps.map_hash import map_hash
        from lampyris.sim.grid.pursuit import checked_track
        from lampyris.study.design.config import plans_poses
        from lampyris.study.design.study import Study, StudyMap, World

        scene, sensor = scenario.scene, self._sensor(scenario)
        driven = sensor is not None or self.goal_track is not None
        traffic = self.traffic.traffic(driven)
        track = None if self.goal_track is None else checked_track(scene, self.goal_track)
        names = self.planners or (AMONG_OBSTACLES if traffic.count else PLANNERS)
        planners = _entries("--planners", names, _planner)
        if sensor is not None:
            planners = tuple(replace(p, sensor=one) for p in planners for one in (None, sensor))
        drives = bool(traffic.count) and any(map(plans_poses, planners))
        by = _entries("--laws", self.laws or scenario.law, _law)
        most = MAX_RUNS // (len(planners) * len(by))
        if not 1 <= self.seeds <= most:
            raise SettingError(
                "SEEDS", f"{self.seeds}", where="--seeds", allowed=f"1 to {most}", todo="more is a study"
            )
        ground = StudyMap(scene.grid.name or "map", scene.grid, map_hash(scene.grid))
        return Study(
            name="compare",
            kind="drive" if drives else "simulate" if traffic.count or driven else "plan",
            worlds=(
                World(
                    ground, scene.start, scene.goal, None, scene.start_pose, scene.goal_pose, goal_track=track
                ),
            ),
            planners=planners,
            laws=by,
            traffic_cases=(traffic,),
            seeds=tuple(range(self.seeds)),
            moves=scene.moves.name,
            robot=asdict(scene.robot),
            ticks=self.traffic.ticks,
            drive=self._drive(planners) if drives else {},
            root=self.base.seed,
        )

    def _sensor(self, scenario: Scenario) -> Sensor | None:
        """The sensor of the runs that have one; None: the map is known.

        Raises
        ------
        SettingError : as :func:`lampyris.scenarios.sensor_of`.
        """
        from lampyris.model.settings.simulation import SimulationSettings
        from lampyris.scenarios import sensor_of

        SimulationSettings(**self.sensor)
        return sensor_of(replace(scenario, **self.sensor))

    def _drive(self, planners: tuple[Config, ...]) -> dict[str, Any]:
        """Settings of the drives among obstacles that planners of poses are compared in.

        Raises
        ------
        UsageError : an option of simulations in ticks; a planner that these drives do not follow.
        """
        from lampyris.model.settings.drive import DriveSettings
        from lampyris.planning.registry import planner_class

        if self.traffic.ticks is not None:
            what = "--ticks with a planner of poses: it drives in continuous time"
            raise UsageError("OPTIONS", what, allowed="planners on cells")
        for planner in planners:
            traits = planner_class(planner.name).traits
            if traits.plans_headings and traits.sees_traffic:
                raise UsageError(
                    "PLANNER",
                    f"{planner.name} plans poses with times; the drives of a comparison do not follow these",
                    where="--planners",
                    allowed="planners without times, such as lattice; without --obstacles any",
                )
        return asdict(DriveSettings())


@dataclass(frozen=True)
class CompareOutputs:
    """What ``compare`` prints and writes."""

    json: bool
    timing: bool
    picture: Path | None
    csv: Path | None
    force: bool
    film: Path | None = None

    def check(self) -> None:
        """Reject before any work what could not be written at the end."""
        outputs.check_outputs(self.force, json=self.json, picture=self.picture, csv=self.csv, film=self.film)


def _entries(option: str, text: str, make: Callable[[str, list[str]], Config]) -> tuple[Config, ...]:
    """``NAME[:KEY=VALUE...],...`` as planners or laws, in the order given."""
    made: list[Config] = []
    for word in filter(None, (part.strip() for part in text.split(","))):
        name, *settings = word.split(":")
        try:
            one = make(name, settings)
        except (UsageError, SettingError) as fault:
            named = isinstance(fault, SettingError) or fault.code == "TYPE"
            what = f"{word}: {fault.what}" if named else fault.what
            raise UsageError(fault.code, what, where=option, allowed=fault.allowed, todo=fault.todo) from None
        if any(one.name == other.name and one.settings == other.settings for other in made):
            raise UsageError("OPTIONS", f"{word} twice", where=option, allowed="each once")
        made.append(one)
    if not made:
        raise UsageError("OPTIONS", repr(text), where=option, allowed="NAME[:KEY=VALUE...],...")
    return tuple(made)


def _planner(name: str, words: list[str]) -> Config:
    """A planner with all its settings."""
    from lampyris.cli.request import parse_settings
    from lampyris.study.design.config import planner_config

    return planner_config(name, parse_settings(name, words), label_of(name, words))


def _law(name: str, words: list[str]) -> Config:
    """A law with all its settings."""
    from lampyris.cli.request import parse_law
    from lampyris.motion.laws import registry as laws
    from lampyris.study.design.config import law_config

    check_choice("LAW", "--laws", name, laws.LAWS)
    return law_config(name, parse_law(name, words), label_of(name, words))


def label_of(name: str, words: list[str]) -> str:
    """What a table calls it: ``ad-gso choice=exact``."""
    return " ".join((name, *words))


def run_comparison(request: CompareRequest, out: CompareOutputs) -> int:
    """Compare, write and print the result. Returns the exit code."""
    from lampyris.cli.request import scene_notes
    from lampyris.cli.verbs.compare import tables
    from lampyris.model.traffic import RandomWalk
    from lampyris.study.design.config import plans_poses
    from lampyris.study.execution import run as running
    from lampyris.study.execution.execution import Execution

    out.check()
    scenario = request.base.scenario()
    study = request.study(scenario)
    drawn = sum(len(one.starts) for one in scenario.scene.traffic if isinstance(one, RandomWalk))
    left = (f"the {drawn} moving obstacles drawn in the map are left aside: a comparison draws its own",)
    on_cells = not all(map(plans_poses, study.planners))
    moved = scene_notes(scenario.scene) if on_cells else ()
    print_notes((*scenario.notes, *moved, *(left if drawn else ())))
    began = time.perf_counter()
    rows: dict[str, Row] = {}

    def keep(some: Sequence[Row]) -> None:
        rows.update((row.key, row) for row in some)

    with counting("comparing", f"of {len(study)}", quiet=out.json) as tick:
        running.run(
            study,
            keep,
            where=Execution(workers=request.workers),
            progress=None if tick is None else lambda p: tick(p.done),
        )
    lines = _lines(study, rows)
    if out.csv is not None:
        from lampyris.study.analysis.export import write_csv
        from lampyris.study.analysis.table import table_of

        with outputs.place(out.csv) as place:
            write_csv(place, table_of(study, rows))
    if out.picture is not None:
        from lampyris.cli.verbs.compare.picture import draw

        with working("drawing", quiet=out.json):
            draw(study, lines, out.picture, speeds=request.laws is not None)
    if out.film is not None:
        with working("filming", quiet=out.json):
            _film(scenario, study, out.film)
    metric = "found" if study.kind == "plan" else "arrived"
    if out.json:
        print_json(tables.record(study, lines, metric, out.timing, time.perf_counter() - began))
    else:
        with outputs.text_beside(out.csv):
            tables.print_comparison(study, lines, metric)
            outputs.print_written(out.picture, out.csv, out.film)
    code = _exit_code(lines, metric)
    if code == BAD_INPUT:
        code_of, _, what = lines[0].rows[0].error.partition(": ")
        # A row holds the code and the words of an error, not the setting.
        raise InputError(code_of, what, setting="traffic.count" if code_of == "OBSTACLE_ROOM" else "")
    return code


def _film(scenario: Scenario, study: Study, film: Path) -> None:
    """The planners' search as a race, then their drive by the first law; obstacles are left aside."""
    from lampyris.planning.registry import make
    from lampyris.races.race import race
    from lampyris.report.film.race_film import race_film
    from lampyris.scenarios import speed_law

    law = study.laws[0]
    planners = [(one.called, make(one.name, one.settings)) for one in study.planners]
    made = race(scenario.scene, planners, speed_law(law.name, law.settings), seed=study.root)
    with outputs.place(film) as place:
        race_film(made, place)


def _exit_code(lines: Sequence[CompareLine], metric: str) -> int:
    """0: some run found a path or arrived. Else by what all runs have in common: refused, or a fault."""
    if any(line.good(metric) for line in lines):
        return 0
    for ending, code in (("refused", BAD_INPUT), ("failed", INTERNAL_FAULT)):
        if all(row.ending == ending for line in lines for row in line.rows):
            return code
    return NO_ANSWER


def _lines(study: Study, rows: Mapping[str, Row]) -> list[CompareLine]:
    """The table: planners in the order given, each under all laws."""
    from lampyris.cli.verbs.compare.tables import CompareLine

    found: dict[tuple[str, str], list[Row]] = {}
    for job in study.jobs():
        found.setdefault((job.labels["planner"], job.labels["law"]), []).append(rows[job.key])
    return [
        CompareLine(planner, law, tuple(found[planner.called, law.called]))
        for planner in study.planners
        for law in study.laws
    ]
