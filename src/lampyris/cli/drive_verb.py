"""``lampyris drive``: among moving obstacles in continuous time.

Work is imported when the verb runs, so that --help is instant.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lampyris._core.defaults import DRIVE_SPACING
from lampyris.cli.options import (
    AllowOutside,
    AMax,
    Colour,
    DMax,
    Film,
    Force,
    Goal,
    GoalM,
    Json,
    LatMax,
    Law,
    Map,
    MaxCells,
    Mobility,
    Moves,
    NoTiming,
    ObstacleRadius,
    Obstacles,
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


def drive(
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
    jerk_max: Annotated[
        float | None,
        typer.Option("--jerk-max", metavar="M/S3", help="Binds profiles, not drives: there it may jump."),
    ] = None,
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
    obstacle_speed: Annotated[
        float | None,
        typer.Option(
            "--obstacle-speed",
            metavar="M/S",
            help="Of a straight step (default: the robot's); at most 100 cells a decision.",
        ),
    ] = None,
    know: Annotated[
        str | None,
        typer.Option(
            "--know", help="Of obstacles the law is told positions (default), velocities or tracks."
        ),
    ] = None,
    tracking: Annotated[
        str | None,
        typer.Option(
            "--tracking", help="perfect (default), velocity or position: how commands are followed."
        ),
    ] = None,
    period: Annotated[
        float | None, typer.Option("--period", metavar="S", help="Seconds between two decisions (0.1).")
    ] = None,
    command_period: Annotated[
        float | None,
        typer.Option("--command-period", metavar="S", help="Seconds between commands (default: the period)."),
    ] = None,
    delay: Annotated[
        float | None, typer.Option("--delay", metavar="S", help="Seconds a command is late (0).")
    ] = None,
    lag: Annotated[
        float | None, typer.Option("--lag", metavar="S", help="Seconds by which the motors lag (0.1).")
    ] = None,
    noise: Annotated[
        float | None, typer.Option("--noise", metavar="M", help="Metres a told position may be off (0).")
    ] = None,
    time_limit: Annotated[
        float | None, typer.Option("--time-limit", metavar="S", help="When to stop (default: generous).")
    ] = None,
    patience: Annotated[
        float | None,
        typer.Option("--patience", metavar="S", help="Seconds it stands before it plans anew (5)."),
    ] = None,
    give_up: Annotated[
        float | None,
        typer.Option("--give-up", metavar="S", help="Seconds it stands before it gives up (60)."),
    ] = None,
    on_hit: Annotated[
        str | None,
        typer.Option("--on-hit", help="An obstacle runs into the standing robot: end (default) or go-on."),
    ] = None,
    smooth: Annotated[
        str | None,
        typer.Option(
            "--smooth",
            help="arcs (default): drawn taut, corners rounded; none: the planned cells as they are, each "
            "corner rounded within half a step, or a stop.",
        ),
    ] = None,
    spacing: Annotated[
        float | None,
        typer.Option(
            "--spacing",
            metavar="M",
            help=f"Metres between nodes of the way (default {DRIVE_SPACING:g} of a cell).",
        ),
    ] = None,
    hold: Annotated[
        float | None,
        typer.Option("--hold", metavar="S", help="It gives up after so many seconds without good data (2)."),
    ] = None,
    max_age: Annotated[
        float | None, typer.Option("--max-age", metavar="S", help="Older data are not trusted (0.5).")
    ] = None,
    json_: Json = False,
    no_timing: NoTiming = False,
    film: Film = None,
    chart: Annotated[
        Path | None,
        typer.Option("--chart", metavar="FILE", help="Draw speed and distances over time (.png or .svg)."),
    ] = None,
    csv: Annotated[
        Path | None,
        typer.Option(
            "--csv", metavar="FILE", help="A row a stretch: t_s, x_m, y_m, yaw, v, a, s, leg, cause, why."
        ),
    ] = None,
    save: Save = None,
    force: Force = False,
    plan_limit: PlanLimit = None,
) -> None:
    """Simulate a run among moving obstacles in continuous time, with real accelerations."""
    from lampyris.cli import drive_work
    from lampyris.cli.request import Request, TrafficRequest
    from lampyris.cli.verbs import Outputs

    request = Request(
        map_, start, goal, start_m, goal_m, planner, preset, moves, law, settings or [], seed, resolution,
        radius, v_max, a_max, d_max, values, colour, allow_outside, max_cells, lat_max, turn_radius, jerk_max,
        zones, set_law or [],
    )  # fmt: skip
    traffic = TrafficRequest(obstacles, mobility, rate, obstacle_radius, tuple(track or ()))
    how = {
        "obstacle_speed": obstacle_speed, "know": know, "tracking": tracking, "period": period,
        "command_period": command_period, "delay": delay, "lag": lag, "noise": noise, "hold": hold,
        "time_limit": time_limit, "patience": patience, "give_up": give_up, "on_hit": on_hit,
        "smooth": smooth, "spacing": spacing, "max_age": max_age,
    }  # fmt: skip
    given = {name: value for name, value in how.items() if value is not None}
    out = Outputs(json_, not no_timing, csv, save, force, film=film, chart=chart)
    raise typer.Exit(drive_work.drive(request, traffic, given, out, plan_limit))
