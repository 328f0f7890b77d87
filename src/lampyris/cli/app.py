"""The verbs and their options. Work is imported when a verb runs, so that --help is instant."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lampyris import __version__
from lampyris.cli import maps_verbs, scen_verb

app = typer.Typer(
    name="lampyris",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    help="From a map to a safe, timed path among moving obstacles.",
    epilog="Exit codes: 0 done, 2 usage, 3 bad input, 4 no path or not arrived, 5 limit, 6 internal fault.",
)


app.add_typer(maps_verbs.app, name="maps")


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


Map = Annotated[str, typer.Argument(metavar="MAP", help="A map file, or the name of a bundled map.")]
Start = Annotated[
    str | None, typer.Option("--start", metavar="X,Y", help="Start cell: column,row from the top left.")
]
Goal = Annotated[str | None, typer.Option("--goal", metavar="X,Y", help="Goal cell.")]
StartM = Annotated[
    str | None, typer.Option("--start-m", metavar="X,Y", help="Start in metres of the map frame.")
]
GoalM = Annotated[
    str | None, typer.Option("--goal-m", metavar="X,Y", help="Goal in metres of the map frame.")
]
Planner = Annotated[str, typer.Option("--planner", help="Who plans: see `lampyris planners`.")]
Preset = Annotated[
    str,
    typer.Option("--preset", help="robot: octile moves, SI units. dissertation: its moves and speed law."),
]
Moves = Annotated[
    str | None, typer.Option("--moves", help="dissertation, octile, four or sixteen (default: the preset's).")
]
Law = Annotated[str | None, typer.Option("--law", help="physical or dissertation (default: the preset's).")]
Set = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="A setting of the planner; may be given several times."),
]
Seed = Annotated[int, typer.Option("--seed", help="Root of every draw: same seed, same bytes.")]
Resolution = Annotated[
    float | None,
    typer.Option("--resolution", metavar="M", help="Metres a cell, for maps that do not say (default 1)."),
]
Radius = Annotated[float, typer.Option("--radius", metavar="M", help="Radius of the robot.")]
VMax = Annotated[float, typer.Option("--v-max", metavar="M/S", help="Greatest speed of the robot.")]
AMax = Annotated[float, typer.Option("--a-max", metavar="M/S2", help="Greatest acceleration.")]
DMax = Annotated[float, typer.Option("--d-max", metavar="M/S2", help="Greatest braking.")]
Json = Annotated[bool, typer.Option("--json", help="Print JSON for machines.")]
Picture = Annotated[
    Path | None, typer.Option("--picture", metavar="FILE", help="Draw the result (.png or .svg).")
]
Layer = Annotated[
    str, typer.Option("--layer", help="What lies under the path in the picture: luciferin, cost or none.")
]
Csv = Annotated[
    Path | None,
    typer.Option("--csv", metavar="FILE", help="Write x_m, y_m, yaw, v, t, s, a and cause a node."),
]
Force = Annotated[bool, typer.Option("--force", help="Overwrite files that exist.")]
NoTiming = Annotated[
    bool, typer.Option("--no-timing", help="Leave the seconds out of the JSON: same call, same bytes.")
]
Film = Annotated[Path | None, typer.Option("--film", metavar="FILE", help="Film the run (.webp or .gif).")]
Explain = Annotated[
    bool, typer.Option("--explain", help="Print each iteration, as the dissertation's Tables 4.3 to 4.6.")
]
Save = Annotated[
    Path | None,
    typer.Option(
        "--save-scenario", metavar="FILE", help="Write all of it to a file for `lampyris run` (.yaml, .json)."
    ),
]
Values = Annotated[
    str, typer.Option("--values", help="What grey and numbers of the map mean: occupancy or costmap.")
]
Colour = Annotated[
    str, typer.Option("--colour", help="Colours out of the legend: legend refuses, luminance reads as grey.")
]
AllowOutside = Annotated[
    bool, typer.Option("--allow-outside", help="Follow file names that lead out of the file's own folder.")
]
MaxCells = Annotated[
    int | None, typer.Option("--max-cells", metavar="N", help="Refuse maps of more cells (default 2^24).")
]


@app.command()
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
    settings: Set = None,
    seed: Seed = 0,
    resolution: Resolution = None,
    radius: Radius = 0.0,
    v_max: VMax = 1.0,
    a_max: AMax = 0.5,
    d_max: DMax = 1.0,
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
) -> None:
    """Plan a path and a speed for every node of it."""
    from lampyris.cli import verbs
    from lampyris.cli.request import Request

    request = Request(
        map_, start, goal, start_m, goal_m, planner, preset, moves, law, settings or [], seed, resolution,
        radius, v_max, a_max, d_max, values, colour, allow_outside, max_cells,
    )  # fmt: skip
    out = verbs.Outputs(json_, not no_timing, csv, save, force, explain, picture, layer)
    raise typer.Exit(verbs.plan(request, out))


@app.command()
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
    settings: Set = None,
    seed: Seed = 0,
    resolution: Resolution = None,
    radius: Radius = 0.0,
    v_max: VMax = 1.0,
    a_max: AMax = 0.5,
    d_max: DMax = 1.0,
    values: Values = "occupancy",
    colour: Colour = "legend",
    allow_outside: AllowOutside = False,
    max_cells: MaxCells = None,
    obstacles: Annotated[
        int, typer.Option("--obstacles", metavar="N", help="How many moving obstacles.")
    ] = 10,
    mobility: Annotated[
        str, typer.Option("--mobility", help="random-walk, patrol, crossing, or mixed (a third of each).")
    ] = "random-walk",
    rate: Annotated[
        float | None,
        typer.Option("--rate", help="Random walkers appear with this chance a tick (1: the dissertation's)."),
    ] = None,
    obstacle_radius: Annotated[
        float, typer.Option("--obstacle-radius", metavar="M", help="Radius of the obstacles (0: one cell).")
    ] = 0.0,
    track: Annotated[
        list[Path] | None,
        typer.Option(
            "--track", metavar="FILE", help="A recorded obstacle: a CSV with columns x,y, a row a tick."
        ),
    ] = None,
    ticks: Annotated[int | None, typer.Option("--ticks", metavar="N", help="When to stop.")] = None,
    patience: Annotated[
        int | None,
        typer.Option("--patience", metavar="N", help="Ticks in a row the robot waits before it gives up."),
    ] = None,
    json_: Json = False,
    no_timing: NoTiming = False,
    film: Film = None,
    csv: Annotated[
        Path | None,
        typer.Option("--csv", metavar="FILE", help="Write x_m, y_m, yaw, v, t, cause, event for every tick."),
    ] = None,
    save: Save = None,
    force: Force = False,
) -> None:
    """Drive among moving obstacles and watch what happens."""
    from lampyris.cli import verbs
    from lampyris.cli.request import Request, TrafficRequest

    request = Request(
        map_, start, goal, start_m, goal_m, planner, preset, moves, law, settings or [], seed, resolution,
        radius, v_max, a_max, d_max, values, colour, allow_outside, max_cells,
    )  # fmt: skip
    traffic = TrafficRequest(obstacles, mobility, rate, obstacle_radius, tuple(track or ()))
    out = verbs.Outputs(json_, not no_timing, csv, save, force, film=film)
    raise typer.Exit(verbs.simulate(request, traffic, ticks, patience, out))


@app.command()
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
    csv: Annotated[
        Path | None, typer.Option("--csv", metavar="FILE", help="Write a row for every node or tick.")
    ] = None,
    save: Save = None,
    force: Force = False,
) -> None:
    """Plan or simulate what a scenario file says."""
    from lampyris.cli import verbs

    out = verbs.Outputs(json_, not no_timing, csv, save, force, explain, picture, layer, film)
    raise typer.Exit(verbs.run(scenario, allow_outside, max_cells, out))


@app.command()
def schema() -> None:
    """Print the JSON Schema of scenario files."""
    from lampyris.cli import verbs

    raise typer.Exit(verbs.schema())


@app.command()
def planners(
    name: Annotated[
        str | None, typer.Argument(metavar="[NAME]", help="Say all there is of this one.")
    ] = None,
    json_: Json = False,
) -> None:
    """List the planners: what each does and guarantees, its source; NAME: its settings and what they mean."""
    from lampyris.cli import verbs

    raise typer.Exit(verbs.planners(name, json_))


app.command()(scen_verb.scen)
