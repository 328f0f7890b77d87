"""``lampyris speed``: how fast along a way, and why, by which law; ``lampyris laws``: which there are.

Work is imported when a verb runs, so that --help is instant.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lampyris._core.defaults import COURSE_SPACING, POINTS_SMOOTH, PROFILE_SMOOTH
from lampyris.cli.options import (
    AllowOutside,
    AMax,
    Colour,
    DMax,
    Force,
    Goal,
    GoalM,
    JerkMax,
    Json,
    LatMax,
    Map,
    MaxCells,
    Moves,
    NoTiming,
    ObstacleRadius,
    Picture,
    Planner,
    Preset,
    Radius,
    Resolution,
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

DEFAULT = "constant,dissertation,rpp,physical,optimum"


def speed(
    map_: Map,
    path: Annotated[
        Path | None,
        typer.Option("--path", metavar="FILE", help="A way from a file: CSV, a ROS Path, a plan's JSON."),
    ] = None,
    units: Annotated[
        str | None, typer.Option("--units", help="Of a CSV's columns x,y: metres (default) or cells.")
    ] = None,
    start: Start = None,
    goal: Goal = None,
    start_m: StartM = None,
    goal_m: GoalM = None,
    planner: Planner = "ad-gso",
    settings: Set = None,
    preset: Preset = "robot",
    moves: Moves = None,
    laws_: Annotated[
        str,
        typer.Option(
            "--laws", metavar="NAME,...", help="Which laws to compare, or all: see `lampyris laws`."
        ),
    ] = DEFAULT,
    law: Annotated[
        str, typer.Option("--law", help="The law that is looked at: what holds it where, and its file.")
    ] = "physical",
    set_law: SetLaw = None,
    v0: Annotated[float, typer.Option("--v0", metavar="M/S", help="Speed at the start.")] = 0.0,
    smooth: Annotated[
        str | None,
        typer.Option(
            "--smooth",
            help=f"{PROFILE_SMOOTH} (default for a plan, as in `lampyris plan`): the cells or points as they "
            f"are, each corner rounded within half a step, or a stop; {POINTS_SMOOTH} (default with --path): "
            "corners rounded as widely as there is room; taut: drawn straight where there is room, rounded.",
        ),
    ] = None,
    spacing: Annotated[
        float | None,
        typer.Option(
            "--spacing",
            metavar="M",
            help=f"Metres between nodes of a curve, at most (default {COURSE_SPACING:g} of a cell).",
        ),
    ] = None,
    movers: Annotated[
        Path | None,
        typer.Option(
            "--movers", metavar="FILE", help="Moving obstacles: CSV x_m,y_m,radius,top_speed[,vx,vy]."
        ),
    ] = None,
    track: Track = None,
    tick: Annotated[
        float | None,
        typer.Option("--tick", metavar="S", help="Seconds of a row of --track (default: a cell at --v-max)."),
    ] = None,
    obstacle_radius: ObstacleRadius = 0.0,
    zones: Zones = None,
    seed: Seed = 0,
    resolution: Resolution = None,
    radius: Radius = 0.0,
    v_max: VMax = 1.0,
    a_max: AMax = 0.5,
    d_max: DMax = 1.0,
    lat_max: LatMax = 1.0,
    turn_radius: TurnRadius = 0.0,
    jerk_max: JerkMax = None,
    values: Values = "occupancy",
    colour: Colour = "legend",
    allow_outside: AllowOutside = False,
    max_cells: MaxCells = None,
    explain: Annotated[
        bool, typer.Option("--explain", help="Print what holds the speed where: stretches of one cause.")
    ] = False,
    all_: Annotated[bool, typer.Option("--all", help="With --explain: a row for every node.")] = False,
    json_: Json = False,
    no_timing: NoTiming = False,
    csv: Annotated[
        Path | None,
        typer.Option("--csv", metavar="FILE", help="A row a node: x_m, y_m, yaw, v, t_s, s, a, cause, why."),
    ] = None,
    picture: Picture = None,
    colour_by: Annotated[
        str, typer.Option("--colour-by", help="What the curve's colours in the picture are: speed or cause.")
    ] = "speed",
    chart: Annotated[
        Path | None,
        typer.Option("--chart", metavar="FILE", help="Draw all laws over the way's length (.png or .svg)."),
    ] = None,
    force: Force = False,
) -> None:
    """Say how fast to drive a way, and why; compare speed laws on it."""
    from lampyris.cli import speed_work as work
    from lampyris.cli.request import Request

    request = Request(
        map_, start, goal, start_m, goal_m, planner, preset, moves, law, settings or [], seed, resolution,
        radius, v_max, a_max, d_max, values, colour, allow_outside, max_cells, lat_max, turn_radius, jerk_max,
        zones, set_law or [],
    )  # fmt: skip
    tracks = work.TracksAsked(tuple(track or ()), tick, obstacle_radius)
    asked = work.Asked(request, path, units, laws_, v0, smooth, spacing, movers, tracks)
    out = work.SpeedOutputs(
        json_, not no_timing, csv, picture, chart, colour_by, force, explain or all_, all_
    )
    raise typer.Exit(work.speed(asked, out))


def laws(
    name: Annotated[
        str | None, typer.Argument(metavar="[NAME]", help="Say all there is of this one.")
    ] = None,
    json_: Json = False,
) -> None:
    """List the speed laws: what each does, its source; NAME: its settings."""
    from lampyris.cli import speed_work

    raise typer.Exit(speed_work.list_laws(name, json_))
