"""``lampyris fleet``: paths for many robots that never collide.

Heavy modules are imported when the verb runs, so that --help is instant.
"""

from __future__ import annotations

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
    Resolution,
    Seed,
    Values,
    moves_name,
)
from lampyris.cli.outputs import print_written
from lampyris.cli.progress import counting, working
from lampyris.cli.text import print_json, print_notes
from lampyris.cli.verbs.fleet_drive.options import FleetDriveOptions, check_options

if TYPE_CHECKING:
    from lampyris.io.fleet_files import FleetFile
    from lampyris.io.maps.formats.document import MapDocument
    from lampyris.model.fleet.fleet import Fleet
    from lampyris.model.fleet.fleet_plan import FleetPlan


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
            help="How many robots (default: all of the file); without a file, drawn at random with the seed.",
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
    resolution: Resolution = None,
    values: Values = "occupancy",
    colour: Colour = "legend",
    allow_outside: AllowOutside = False,
    max_cells: MaxCells = None,
    picture: Picture = None,
    film: Film = None,
    export: Annotated[
        Path | None,
        typer.Option(
            "--export",
            metavar="FILE",
            help="Write the robots as .scen or as a League problem (.json and three beside it), or the plan as .txt.",
        ),
    ] = None,
    json_: Json = False,
    no_timing: NoTiming = False,
    force: Force = False,
) -> None:
    """Plan paths for many robots that never collide.

    The robots are those of a file, or drawn at random (`--robots N`). A robot fits in a cell; each tick it steps to a
    neighbouring cell or waits. With --execute they drive the plan in continuous time, with --lifelong they get new tasks
    without end. Exit code 4: not solved, or not all arrived.
    """
    from lampyris import fleets
    from lampyris.cli.option_groups import MapOptions
    from lampyris.cli.request import budget_of, load_document, parse_settings
    from lampyris.errors import UsageError
    from lampyris.io.fleet_export import export_paths
    from lampyris.planning.base import Budget
    from lampyris.planning.fleet import registry

    exported = () if export is None else export_paths(export)
    outputs.check_outputs(force, *exported, json=json_, picture=picture, film=film)
    check_options(driving)
    asked_planner, planner = planner, fleets.PLANNER if planner is None else planner
    given = parse_settings(planner, settings or [], registry)
    budget = budget_of("--seconds", seconds) or Budget()
    budget = Budget(_checked(iterations), budget.seconds)
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
    asked = _fleet(document, scen, agents, robots, seed)
    if seconds is not None:
        _load_kernels(planner, moves, quiet=json_)
    print_notes((*document.notes, *asked.notes))
    if driving.lifelong is not None or driving.policy == "orca":
        from lampyris.cli.verbs.fleet_drive import driving as drives

        if settings or picture is not None or export is not None:
            what = "--set" if settings else "--picture" if picture is not None else "--export"
            raise UsageError("OPTIONS", f"{what} where nothing is planned to the end", allowed="without it")
        more = {"json": json_, "no_timing": no_timing}
        trace: Any
        if driving.lifelong is not None:
            fleet_ = asked.fleet
            if driving.tasks is not None and agents is None and scen is None:
                fleet_ = drives.without_goals(fleet_)  # the drawn ones would be tasks that nobody gave
            trace = drives.lifelong(fleet_, asked_planner, driving, seed, budget, film, **more)
        else:
            trace = drives.execute(asked.fleet, None, planner, driving, seed, film, **more)
        raise typer.Exit(0 if trace else NO_ANSWER)
    with counting(f"planning {len(asked.fleet.robots)} robots", "", quiet=json_) as tick:
        show = None if tick is None else (lambda done, _cost: tick(done))
        made = fleets.plan_fleet(
            asked.fleet, planner, moves=moves, seed=seed, budget=budget, progress=show, planner_settings=given
        )
    if driving.execute and made:
        from lampyris.cli.verbs.fleet_drive import driving as drives

        _draw(made, asked.fleet, picture, None, quiet=json_)
        if export is not None:
            fleets.export_fleet(made, asked.fleet, export)
        trace = drives.execute(
            asked.fleet, made, planner, driving, seed, film, json=json_, no_timing=no_timing
        )
        raise typer.Exit(0 if trace else NO_ANSWER)
    _draw(made, asked.fleet, picture, film, quiet=json_)
    if export is not None:
        fleets.export_fleet(made, asked.fleet, export)
    if json_:
        from lampyris.report.data.fleet_record import fleet_record

        record = fleet_record(made, asked.fleet)
        print_json({**record, "timing": {}} if no_timing else record)
    else:
        _print(made, asked.fleet)
        print_written(picture, film, *exported)
    raise typer.Exit(0 if made else NO_ANSWER)


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


def _fleet(
    document: MapDocument, scen: Path | None, agents: Path | None, robots: int | None, seed: int
) -> FleetFile:
    """The fleet of the file that is given, or a random one."""
    from lampyris import fleets
    from lampyris.errors import SettingError, UsageError
    from lampyris.io.fleet_files import FleetFile, read_agents, read_scen_fleet

    if scen is not None and agents is not None:
        raise UsageError("OPTIONS", "--scen and --agents both given", allowed="one of them")
    if robots is not None and robots < 1:
        raise SettingError.of("ROBOTS", "robots", f"{robots}", allowed="a whole number >= 1")
    if scen is not None:
        return read_scen_fleet(scen, document, robots)
    if agents is not None:
        return read_agents(agents, document.grid, robots)
    if robots is None:
        todo = "give --robots N for random robots, --scen FILE or --agents FILE"
        raise UsageError("OPTIONS", "no robots", todo=todo)
    return FleetFile(fleets.random_fleet(document.grid, robots, seed=seed))


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
        ("robots", f"{len(asked.robots)}, {made.moves} moves, seed {made.seed}"),
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
