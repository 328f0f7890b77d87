"""``lampyris fleet``: paths for many robots that never collide.

Heavy modules are imported when the verb runs, so that --help is instant.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lampyris.cli import outputs, text
from lampyris.cli.exit_codes import NO_ANSWER
from lampyris.cli.options import (
    AllowOutside,
    Colour,
    Film,
    Force,
    Json,
    Map,
    MaxCells,
    NoTiming,
    Picture,
    Replay,
    Resolution,
    Save,
    Seed,
    Values,
    moves_name,
)
from lampyris.cli.outputs import print_written
from lampyris.cli.progress import counting, working
from lampyris.cli.text import print_json, print_notes
from lampyris.cli.verbs.fleet_drive.options import (
    FleetDriveOptions,
    check_options,
    execution_of,
    faults_of,
    lifelong_of,
    robot_of,
    tasks_of,
)
from lampyris.errors import plural

if TYPE_CHECKING:
    from lampyris.io.fleet_files import FleetFile
    from lampyris.io.fleet_scenario.scenario import FleetScenario
    from lampyris.io.maps.formats.document import MapDocument
    from lampyris.io.scenario.scenario import MapSource
    from lampyris.model.fleet.fleet import Fleet
    from lampyris.model.fleet.fleet_plan import FleetPlan
    from lampyris.model.grid import Grid


def fleet(
    map_: Map,
    driving: FleetDriveOptions,
    scen: Annotated[
        Path | None,
        typer.Option("--scen", metavar="FILE", help="Starts and goals: the first lines of a MovingAI .scen."),
    ] = None,
    agents: Annotated[
        Path | None,
        typer.Option(
            "--agents",
            metavar="FILE",
            help="Starts and goals: a list (.yaml, .json, .csv), or a League of Robot Runners problem (.json).",
        ),
    ] = None,
    robots: Annotated[
        int | None,
        typer.Option(
            "--robots",
            metavar="N",
            help="Number of robots (default: all of the file); without a file, drawn at random with the seed.",
        ),
    ] = None,
    planner: Annotated[
        str | None,
        typer.Option(
            "--planner",
            metavar="lacam|lns|pibt|prioritised-sipp|cbs|eecbs",
            help="lacam, lns, pibt, prioritised-sipp, cbs (least sum of costs) or eecbs (bounded) (default: lacam).",
        ),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="A setting of the planner; repeatable."),
    ] = None,
    moves: Annotated[
        str,
        typer.Option(
            "--moves",
            metavar="four-connected|octile",
            help="A step to one of four or eight neighbours, or a wait; each takes a tick.",
            callback=moves_name,
        ),
    ] = "four-connected",
    seconds: Annotated[
        float | None,
        typer.Option(
            "--seconds",
            metavar="S",
            help="Time limit; lacam and lns improve the plan until then, the others end (default: lacam's first plan).",
        ),
    ] = None,
    iterations: Annotated[
        int | None,
        typer.Option(
            "--iterations",
            metavar="N",
            help="Limit of the planner's iterations: as --seconds, but with the same bytes every time.",
        ),
    ] = None,
    seed: Seed = 0,
    cell: Annotated[
        float | None,
        typer.Option(
            "--cell",
            metavar="M",
            help="Plan in larger cells of M metres, for maps whose own are smaller than the robots "
            "(default: the map's own).",
        ),
    ] = None,
    robot_file: Annotated[
        Path | None,
        typer.Option(
            "--robot",
            metavar="FILE",
            help="YAML or JSON: radius (of the disc around a footprint), drive and the other limits; options override it.",
        ),
    ] = None,
    resolution: Resolution = None,
    values: Values = "occupancy",
    colour: Colour = "legend",
    allow_outside: AllowOutside = False,
    max_cells: MaxCells = None,
    picture: Picture = None,
    film: Film = None,
    replay: Replay = None,
    export: Annotated[
        Path | None,
        typer.Option(
            "--export",
            metavar="FILE",
            help="Write the robots as .scen or as a League problem (.json and three more files), or the plan as .txt.",
        ),
    ] = None,
    save: Save = None,
    json_: Json = False,
    no_timing: NoTiming = False,
    force: Force = False,
) -> None:
    """Plan paths for many robots that never collide.

    The robots are those of a file, or drawn at random (`--robots N`). A robot fits in a cell; each tick it steps to a
    neighbouring cell or waits. With --execute they drive the plan in continuous time, with --lifelong they get new tasks
    continually. Exit code 4: not solved, or not all arrived.
    """
    from lampyris.cli.option_groups import MapOptions
    from lampyris.cli.request import budget_of, load_document, parse_settings
    from lampyris.io.fleet_export import export_paths
    from lampyris.io.fleet_scenario.build import with_robot, without_goals
    from lampyris.io.fleet_scenario.scenario import LIFELONG_PLANNER, PLANNER, FleetScenario
    from lampyris.io.maps.coarse import coarse_grid
    from lampyris.planning.fleet import registry

    out = FleetOutputs(json_, no_timing, picture, film, export, save, replay)
    exported = () if export is None else export_paths(export)
    outputs.check_outputs(
        force, *exported, json=json_, picture=picture, film=film, replay=replay, scenario=save
    )
    check_options(driving, robot_file)
    lifelong = driving.lifelong is not None
    chosen = (LIFELONG_PLANNER if lifelong else PLANNER) if planner is None else planner
    given = parse_settings(chosen, settings or [], registry)
    limits = budget_of("--seconds", seconds)
    document = load_document(
        MapOptions(
            map_,
            resolution=resolution,
            values=values,
            colour=colour,
            allow_outside=allow_outside,
            max_cells=max_cells,
        )
    )
    coarse = document.grid if cell is None else coarse_grid(document.grid, cell)
    one = robot_of(driving, robot_file, coarse.resolution, moves)
    radius = 0.0 if one is None else one.radius
    asked, ground = _fleet(document, scen, agents, robots, seed, coarse, lifelong, radius)
    tasks = tasks_of(driving, document.grid, asked.fleet.grid)
    tasks = asked.tasks if tasks is None else tasks
    drawn = agents is None and scen is None
    fleet_ = with_robot(asked.fleet, one)
    if lifelong and tasks is not None and (asked.tasks is not None or drawn):
        fleet_ = without_goals(fleet_)  # goals that were drawn, or put in for tasks, would be tasks, too
    scenario = FleetScenario(
        fleet_, chosen, given, moves, seed, _checked(iterations), None if limits is None else limits.seconds,
        execution_of(driving), lifelong_of(driving, tasks), tuple(faults_of(driving)), map=_source(map_, values, colour),
        ground=ground, notes=(*document.notes, *asked.notes),
    )  # fmt: skip
    if lifelong or scenario.reactive:
        _without_plan(scenario, {"--set": given}, "planner settings")
    if scenario.reactive:
        needs = {
            "--planner": planner,
            "--seconds": limits,
            "--iterations": iterations,
            "--moves": moves != "four-connected",
        }
        _without_plan(scenario, needs, "a planner")
    if lifelong:
        _without_plan(
            scenario, {"--moves": moves != "four-connected", "--iterations": iterations}, "a whole plan"
        )
    raise typer.Exit(run_scenario(scenario, out))


@dataclass(frozen=True, slots=True)
class FleetOutputs:
    """What a run of a fleet writes and prints."""

    json: bool = False
    no_timing: bool = False
    picture: Path | None = None
    film: Path | None = None
    export: Path | None = None
    save: Path | None = None
    replay: Path | None = None


def run_scenario(scenario: FleetScenario, out: FleetOutputs) -> int:
    """Plan or drive the fleet of a scenario, write and print what came of it. Returns the exit code."""
    from lampyris import fleet_scenarios, fleets, scenarios
    from lampyris.cli.verbs.fleet_drive import driving as drives
    from lampyris.planning.fleet import registry

    print_notes(scenario.notes)
    if scenario.lifelong is not None or scenario.reactive:
        unused = {"--picture": out.picture, "--export": out.export, "--replay": out.replay}
        _without_plan(scenario, unused, "a whole plan")
        if out.save is not None:
            print_notes(scenarios.save_scenario(scenario, out.save))
        trace: Any
        if scenario.lifelong is not None:
            trace = drives.lifelong(scenario, out.film, json=out.json, no_timing=out.no_timing)
        else:
            trace = drives.execute(scenario, None, out.film, json=out.json, no_timing=out.no_timing)
        return _saved(out, 0 if trace else NO_ANSWER)
    fleet_ = scenario.fleet
    if scenario.execution is not None:
        if out.replay is not None:
            from lampyris.errors import UsageError

            raise UsageError("OPTIONS", "--replay with --execute", allowed="--film, or --replay of the plan")
        from lampyris.fleet_drives import robots_of

        with fleet_scenarios.named_in(scenario):
            robots_of(fleet_, None, scenario.moves)  # before anything is planned or written
    else:
        with fleet_scenarios.named_in(scenario):
            fleets.check_known(registry.make(scenario.planner, scenario.settings), fleet_, scenario.moves)
    if out.save is not None:
        print_notes(scenarios.save_scenario(scenario, out.save))
    if scenario.seconds is not None:
        _load_kernels(scenario.planner, scenario.moves, quiet=out.json)
    with counting(f"planning {plural(len(fleet_.robots), 'robot')}", "", quiet=out.json) as tick:
        made = fleet_scenarios.plan_of(scenario, tick)
    exported: tuple[Path, ...] = ()
    if scenario.execution is not None and made:
        _draw(made, fleet_, out.picture, None, quiet=out.json)
        if out.export is not None:
            fleets.export_fleet(made, fleet_, out.export)
        trace = drives.execute(scenario, made, out.film, json=out.json, no_timing=out.no_timing)
        return _saved(out, 0 if trace else NO_ANSWER)
    _draw(made, fleet_, out.picture, out.film, quiet=out.json)
    if out.export is not None:
        exported = fleets.export_fleet(made, fleet_, out.export)
    if out.json:
        from lampyris.report.data.fleets.record import fleet_record

        record = fleet_record(made, fleet_)
        print_json({**record, "timing": {}} if out.no_timing else record)
    else:
        _print(made, fleet_)
        print_written(out.picture, out.film, *exported, out.save)
    if out.replay is not None:
        if not made.paths:
            print_notes(("no paths, so no replay was written",))
        else:
            from lampyris.app.replay.streams import fleet_replay

            outputs.write_replay(out.replay, fleet_replay(made, fleet_), json=out.json)
    return 0 if made else NO_ANSWER


def _without_plan(scenario: FleetScenario, unused: Mapping[str, object], what: str) -> None:
    """Refuse options that need what such a drive does not have."""
    from lampyris.errors import UsageError

    why = "lifelong fleets plan window by window" if scenario.lifelong else "the policy orca makes no plan"
    for option in (option for option, given in unused.items() if given):
        raise UsageError("OPTIONS", f"{option} needs {what}; {why}", allowed=f"without {option}")


def _saved(out: FleetOutputs, code: int) -> int:
    if not out.json:
        print_written(out.save)
    return code


def _load_kernels(planner: str, moves: str, *, quiet: bool) -> None:
    """Load or compile what a planner runs: the seconds are for planning."""
    from lampyris import fleets
    from lampyris.kernels import _jit
    from lampyris.model.fleet.fleet import Agent, Fleet
    from lampyris.model.grid import Grid

    if _jit.jit_disabled():
        return
    small = Fleet(Grid([[False] * 3] * 2), [Agent((0, 0), (2, 1)), Agent((2, 0), (0, 1))])
    with working("loading compiled code", quiet=quiet), _jit.compiled_only():
        fleets.plan_fleet(small, planner, moves=moves)


def _checked(iterations: int | None) -> int | None:
    from lampyris.errors import SettingError

    if iterations is not None and iterations < 1:
        raise SettingError.of("BUDGET", "iterations", f"{iterations}", allowed="a whole number >= 1")
    return iterations


def _source(map_: str, values: str, colour: str) -> MapSource:
    """Where the map comes from."""
    from lampyris.io.maps import library
    from lampyris.io.scenario.scenario import Bundled, MapFile

    return Bundled(map_) if map_ in library.names() else MapFile(map_, values, colour)


def _fleet(
    document: MapDocument, scen: Path | None, agents: Path | None, robots: int | None, seed: int, coarse: Grid,
    lifelong: bool, radius: float,
) -> tuple[FleetFile, Grid | None]:  # fmt: skip
    """The fleet of the file that is given, or a random one; and the map before its cells were made larger, or None."""
    from lampyris import fleets
    from lampyris.errors import SettingError, UsageError
    from lampyris.io.fleet_files import FleetFile, read_agents, read_scen_fleet
    from lampyris.io.maps.coarse import coarse_fleet, coarse_note, coarse_tasks

    if scen is not None and agents is not None:
        raise UsageError("OPTIONS", "--scen and --agents both given", allowed="one of them")
    if robots is not None and robots < 1:
        raise SettingError.of("ROBOTS", "robots", f"{robots}", allowed="a whole number >= 1")
    grid = document.grid
    if scen is not None:
        read = read_scen_fleet(scen, document, robots)
    elif agents is not None:
        read = read_agents(agents, grid, robots, lifelong=lifelong)
    elif robots is not None:
        read = FleetFile(fleets.bare_fleet(coarse, robots, seed, radius))
    else:
        todo = "give --robots N for random robots, --scen FILE or --agents FILE"
        raise UsageError("OPTIONS", "no robots", todo=todo)
    if coarse is grid:
        return read, None
    fleet_ = read.fleet if scen is None and agents is None else coarse_fleet(read.fleet, coarse)
    tasks = None if read.tasks is None else coarse_tasks(read.tasks, grid, coarse)
    return FleetFile(fleet_, (coarse_note(grid, coarse), *read.notes), tasks), grid


def _draw(made: FleetPlan, asked: Fleet, picture: Path | None, film: Path | None, *, quiet: bool) -> None:
    if picture is not None:
        from lampyris.report.pictures.fleet_picture import draw_fleet

        with working("drawing", quiet=quiet):
            draw_fleet(made, asked, picture)
    if film is not None and not made.paths:
        print_notes(("no paths, so no film was made",))
    elif film is not None:
        from lampyris.report.film.fleet_film import fleet_film

        with counting("filming", "frames", quiet=quiet) as frame:
            fleet_film(made, asked, film, progress=frame)


def _print(made: FleetPlan, asked: Fleet) -> None:
    """Print a plan: the verdict first, then the numbers."""
    text.line(made.sentence, style=f"bold {'green' if made else 'red'}")
    grid = asked.grid
    rows: list[Any] = [
        ("map", f"{grid.name or '-'}, {grid.width} x {grid.height} cells of {grid.resolution:g} m"),
        ("robots", f"{len(asked.robots)}{_sized(asked)}, {made.moves} moves, seed {made.seed}"),
        ("planner", made.planner),
    ]
    if made.sum_of_costs is not None:
        rows.append(("makespan", f"{made.makespan} ticks"))
        gap = "" if made.gap is None else f"; at least {made.lower_bound:,}, gap {made.gap:.2%}"
        rows.append(("sum of costs", f"{made.sum_of_costs:,} ticks until each robot stays at its goal{gap}"))
    if len(made.improvements) > 1:
        first = made.improvements[0][1]
        rows.append(("improved", f"{len(made.improvements) - 1} times, from {first:,}"))
    rows.append(("iterations", f"{made.iterations:,}; {made.expansions:,} states"))
    rows += [("note", note) for note in made.notes]
    seconds = made.timing.get("total_s")
    if seconds is not None:
        loaded = made.timing.get("loading_s", 0.0)
        once = f", loading compiled code {1000 * loaded:.1f} ms" if loaded >= 1e-4 else ""
        plan = f"planning {1000 * made.timing['plan_s']:.1f} ms, referee {1000 * made.timing['referee_s']:.1f} ms"
        rows.append(("time", f"{1000 * seconds:.1f} ms, of which {plan}{once}"))
    text.facts("", rows)


def _sized(asked: Fleet) -> str:
    """The radii of robots that have any."""
    radii = sorted({0.0 if one.robot is None else one.robot.radius for one in asked.robots})
    if radii[-1] == 0.0:
        return ""
    return f" of radius {radii[0]:g} m" if len(radii) == 1 else f" of radius {radii[0]:g} to {radii[-1]:g} m"
