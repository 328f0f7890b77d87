"""``lampyris compare``: a few planners and laws in the same world, at once, without a study file.

Work is imported when the verb runs, so that --help is instant.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

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
    Mobility,
    Moves,
    NoTiming,
    ObstacleRadius,
    Picture,
    Preset,
    Radius,
    Rate,
    Resolution,
    Seed,
    Start,
    StartM,
    TurnRadius,
    Values,
    VMax,
)  # fmt: skip


def compare(
    map_: Map,
    start: Start = None,
    goal: Goal = None,
    start_m: StartM = None,
    goal_m: GoalM = None,
    planners: Annotated[
        str | None,
        typer.Option(
            "--planners",
            metavar="NAME,...",
            help="Who plans, settings behind colons: ad-gso,ad-gso:choice=exact "
            "(default: ad-gso, astar, dstar-lite, theta-star, dstar-lpso; among obstacles sipp too).",
        ),
    ] = None,
    laws: Annotated[
        str | None,
        typer.Option(
            "--laws",
            metavar="NAME,...",
            help="By which speed laws, settings behind colons (default: the preset's); with it the picture "
            "shows speeds.",
        ),
    ] = None,
    preset: Preset = "robot",
    moves: Moves = None,
    obstacles: Annotated[
        int, typer.Option("--obstacles", metavar="N", help="How many moving obstacles (0: plans only).")
    ] = 0,
    mobility: Mobility = "random-walk",
    rate: Rate = None,
    obstacle_radius: ObstacleRadius = 0.0,
    live: Annotated[
        bool,
        typer.Option(
            "--live", help="Obstacles wait for the robot; else everyone meets the very same tracks."
        ),
    ] = False,
    ticks: Annotated[int | None, typer.Option("--ticks", metavar="N", min=1, help="When to stop.")] = None,
    seeds: Annotated[
        int, typer.Option("--seeds", metavar="N", help="How many worlds: means of N runs each.")
    ] = 1,
    seed: Seed = 0,
    workers: Annotated[int, typer.Option("--workers", metavar="N", min=1, help="Processes.")] = 1,
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
    picture: Picture = None,
    csv: Annotated[
        Path | None, typer.Option("--csv", metavar="FILE", help="Write a row for every run.")
    ] = None,
    json_: Json = False,
    no_timing: NoTiming = False,
    force: Force = False,
) -> None:
    """Compare a few planners and speed laws in the same world: one table, one picture."""
    from lampyris.cli import compare_work as work
    from lampyris.cli.request import Request

    request = Request(
        map_, start, goal, start_m, goal_m, "astar", preset, moves, None, [], seed, resolution, radius,
        v_max, a_max, d_max, values, colour, allow_outside, max_cells, lat_max, turn_radius, jerk_max,
    )  # fmt: skip
    crowd = work.CrowdAsked(obstacles, mobility, rate, obstacle_radius, live, ticks)
    asked = work.Asked(request, planners, laws, crowd, seeds, workers)
    out = work.Outputs(json_, not no_timing, picture, csv, force)
    raise typer.Exit(work.compare(asked, out))
