"""The verbs and their options. Work is imported when a verb runs, so that --help is instant."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lampyris import __version__
from lampyris._core.defaults import SIMULATION_PATIENCE
from lampyris.cli import (
    app_verb,
    compare_verb,
    drive_verb,
    maps_verbs,
    reproduce_verb,
    scen_verb,
    selfcheck_verb,
    speed_verb,
    study_verb,
    warm_verb,
)
from lampyris.cli.option_errors import Command
from lampyris.cli.options import (
    AllowOutside,
    AMax,
    Colour,
    Csv,
    DMax,
    Explain,
    Film,
    Force,
    Goal,
    GoalM,
    JerkMax,
    Json,
    LatMax,
    Law,
    Layer,
    Map,
    MaxCells,
    Mobility,
    Moves,
    NoTiming,
    ObstacleRadius,
    Obstacles,
    Picture,
    PlanLimit,
    Planner,
    Preset,
    Radius,
    Rate,
    Resolution,
    Save,
    Seed,
    Set,
    SetLaw,
    Start,
    StartM,
    Track,
    TurnRadius,
    Values,
    VMax,
    Zones,
)  # fmt: skip

app = typer.Typer(
    name="lampyris",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    help="From a map to a safe, timed path among moving obstacles.",
    epilog="Exit codes: 0 done, 2 bad words or values of the call, 3 a bad file, 4 no path or not arrived, "
    "5 limit, 6 internal fault or broken promise, 130 Ctrl-C.",
)


app.add_typer(maps_verbs.app, name="maps")
app.add_typer(study_verb.app, name="study")


def plain_help() -> dict[str, int]:
    """Have ``--help`` without colour, boxes and line breaks; what click's context takes for that."""
    for each in (app, maps_verbs.app, study_verb.app):
        each.rich_markup_mode = None
    return {"terminal_width": 10_000}


def _version(value: bool) -> None:
    if value:
        typer.echo(f"lampyris {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    pass


@app.command(cls=Command)
def plan(
    map_: Map,
    start: Start = None,
    goal: Goal = None,
    start_m: StartM = None,
    goal_m: GoalM = None,
    planner: Planner = "ad-gso",
    preset: Preset = "robot",
    moves: Moves = None,
    law: Law = None,
    set_law: SetLaw = None,
    settings: Set = None,
    seed: Seed = 0,
    resolution: Resolution = None,
    radius: Radius = 0.0,
    v_max: VMax = 1.0,
    a_max: AMax = 0.5,
    d_max: DMax = 1.0,
    lat_max: LatMax = 1.0,
    turn_radius: TurnRadius = 0.0,
    jerk_max: JerkMax = None,
    zones: Zones = None,
    values: Values = "occupancy",
    colour: Colour = "legend",
    allow_outside: AllowOutside = False,
    max_cells: MaxCells = None,
    explain: Explain = False,
    json_: Json = False,
    no_timing: NoTiming = False,
    picture: Picture = None,
    layer: Layer = "luciferin",
    csv: Csv = None,
    save: Save = None,
    force: Force = False,
    time_limit: Annotated[
        float | None,
        typer.Option("--time-limit", metavar="S", help="Seconds of planning; then it stops, exit code 5."),
    ] = None,
) -> None:
    """Plan a path and a speed for every cell of it: corners are rounded within half a step, or stops."""
    from lampyris.cli import verbs
    from lampyris.cli.request import Request

    request = Request(
        map_, start, goal, start_m, goal_m, planner, preset, moves, law, settings or [], seed, resolution,
        radius, v_max, a_max, d_max, values, colour, allow_outside, max_cells, lat_max, turn_radius, jerk_max,
        zones, set_law or [],
    )  # fmt: skip
    out = verbs.Outputs(json_, not no_timing, csv, save, force, explain, picture, layer)
    raise typer.Exit(verbs.plan(request, out, time_limit))


@app.command(cls=Command)
def simulate(
    map_: Map,
    start: Start = None,
    goal: Goal = None,
    start_m: StartM = None,
    goal_m: GoalM = None,
    planner: Planner = "ad-gso",
    preset: Preset = "robot",
    moves: Moves = None,
    law: Law = None,
    set_law: SetLaw = None,
    settings: Set = None,
    seed: Seed = 0,
    resolution: Resolution = None,
    radius: Radius = 0.0,
    v_max: VMax = 1.0,
    a_max: AMax = 0.5,
    d_max: DMax = 1.0,
    lat_max: LatMax = 1.0,
    turn_radius: TurnRadius = 0.0,
    jerk_max: JerkMax = None,
    zones: Zones = None,
    values: Values = "occupancy",
    colour: Colour = "legend",
    allow_outside: AllowOutside = False,
    max_cells: MaxCells = None,
    obstacles: Obstacles = 10,
    mobility: Mobility = "random-walk",
    rate: Rate = None,
    obstacle_radius: ObstacleRadius = 0.0,
    track: Track = None,
    ticks: Annotated[int | None, typer.Option("--ticks", metavar="N", help="When to stop.")] = None,
    patience: Annotated[
        int | None,
        typer.Option(
            "--patience",
            metavar="N",
            help=f"Ticks in a row the robot waits before it gives up (default {SIMULATION_PATIENCE}).",
        ),
    ] = None,
    json_: Json = False,
    no_timing: NoTiming = False,
    film: Film = None,
    csv: Annotated[
        Path | None,
        typer.Option(
            "--csv", metavar="FILE", help="A row a tick: x_m, y_m, yaw, v, tick, cause, x, y, event."
        ),
    ] = None,
    save: Save = None,
    force: Force = False,
    plan_limit: PlanLimit = None,
) -> None:
    """Simulate a run among moving obstacles, cell by cell and tick by tick."""
    from lampyris.cli import verbs
    from lampyris.cli.request import Request, TrafficRequest

    request = Request(
        map_, start, goal, start_m, goal_m, planner, preset, moves, law, settings or [], seed, resolution,
        radius, v_max, a_max, d_max, values, colour, allow_outside, max_cells, lat_max, turn_radius, jerk_max,
        zones, set_law or [],
    )  # fmt: skip
    traffic = TrafficRequest(obstacles, mobility, rate, obstacle_radius, tuple(track or ()))
    out = verbs.Outputs(json_, not no_timing, csv, save, force, film=film)
    raise typer.Exit(verbs.simulate(request, traffic, ticks, patience, out, plan_limit))


@app.command(cls=Command)
def run(
    scenario: Annotated[Path, typer.Argument(metavar="SCENARIO", help="A scenario file (.yaml or .json).")],
    allow_outside: AllowOutside = False,
    max_cells: MaxCells = None,
    json_: Json = False,
    no_timing: NoTiming = False,
    explain: Explain = False,
    picture: Picture = None,
    layer: Annotated[
        str | None, typer.Option("--layer", help="Under the path in the picture: luciferin, cost or none.")
    ] = None,
    film: Film = None,
    chart: Annotated[
        Path | None, typer.Option("--chart", metavar="FILE", help="Of a drive: draw speed over time.")
    ] = None,
    csv: Annotated[
        Path | None,
        typer.Option("--csv", metavar="FILE", help="Write a row for every node, tick or stretch."),
    ] = None,
    save: Save = None,
    force: Force = False,
) -> None:
    """Plan, simulate or drive what a scenario file says."""
    from lampyris.cli import verbs

    out = verbs.Outputs(json_, not no_timing, csv, save, force, explain, picture, layer, film, chart)
    raise typer.Exit(verbs.run(scenario, allow_outside, max_cells, out))


@app.command(cls=Command)
def schema() -> None:
    """Print the JSON Schema of scenario files."""
    from lampyris.cli import verbs

    raise typer.Exit(verbs.schema())


@app.command(cls=Command)
def planners(
    name: Annotated[
        str | None, typer.Argument(metavar="[NAME]", help="Say all there is of this one.")
    ] = None,
    json_: Json = False,
) -> None:
    """List the planners: what each does and guarantees, its source; NAME: its settings and what they mean."""
    from lampyris.cli import verbs

    raise typer.Exit(verbs.planners(name, json_))


app.command(cls=Command)(scen_verb.scen)
app.command(cls=Command)(speed_verb.speed)
app.command(cls=Command)(speed_verb.laws)
app.command(cls=Command)(drive_verb.drive)
app.command(cls=Command)(compare_verb.compare)
app.command(cls=Command)(reproduce_verb.reproduce)
app.command(cls=Command)(app_verb.app)
app.command(cls=Command)(warm_verb.warm)
app.command(cls=Command)(selfcheck_verb.selfcheck)
