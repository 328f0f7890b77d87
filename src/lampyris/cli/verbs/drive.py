"""``lampyris drive``: among moving obstacles in continuous time.

Heavy modules are imported when the verb runs, so that --help is instant.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lampyris._core.defaults import DRIVE_SPACING
from lampyris.cli import outputs, text
from lampyris.cli.exit_codes import NO_ANSWER
from lampyris.cli.options import (
    ALatMax,
    AllowOutside,
    AMax,
    Colour,
    DMax,
    Film,
    Force,
    Goal,
    GoalM,
    Json,
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
    RobotFile,
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
from lampyris.cli.outputs import Outputs, print_written
from lampyris.cli.progress import counting, working
from lampyris.cli.text import print_json, print_notes
from lampyris.errors import SettingError, UsageError, did_you_mean

if TYPE_CHECKING:
    from lampyris.io.scenario.scenario import Scenario
    from lampyris.model.drive import Drive
    from lampyris.planning.base import Budget
    from lampyris.sim.continuous.settings import Settings


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
    robot_file: RobotFile = None,
    radius: Radius = 0.0,
    v_max: VMax = 1.0,
    a_max: AMax = 0.5,
    d_max: DMax = 1.0,
    a_lat_max: ALatMax = 1.0,
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
    obstacle_info: Annotated[
        str | None,
        typer.Option(
            "--obstacle-info",
            metavar="positions|velocities|tracks",
            help="Of obstacles the law is told positions (default), velocities or tracks.",
        ),
    ] = None,
    tracking: Annotated[
        str | None,
        typer.Option(
            "--tracking",
            metavar="perfect|velocity|position",
            help="perfect (default), velocity or position: how commands are followed.",
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
        typer.Option(
            "--on-hit",
            metavar="end|go-on",
            help="An obstacle runs into the standing robot: end (default) or go-on.",
        ),
    ] = None,
    smooth: Annotated[
        str | None,
        typer.Option(
            "--smooth",
            metavar="taut|arcs|none",
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
    data_timeout: Annotated[
        float | None,
        typer.Option(
            "--data-timeout", metavar="S", help="It gives up after so many seconds without good data (2)."
        ),
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
    from lampyris.cli.request import Request, TrafficRequest, budget_of

    request = Request(
        map_, start, goal, start_m, goal_m, planner, preset, moves, law, settings or [], seed, resolution,
        radius, v_max, a_max, d_max, values, colour, allow_outside, max_cells, a_lat_max, turn_radius, jerk_max,
        zones, set_law or [],
    )  # fmt: skip
    traffic = TrafficRequest(obstacles, mobility, rate, obstacle_radius, tuple(track or ()))
    how = {
        "obstacle_speed": obstacle_speed, "obstacle_info": obstacle_info, "tracking": tracking, "period": period,
        "command_period": command_period, "delay": delay, "lag": lag, "noise": noise, "data_timeout": data_timeout,
        "time_limit": time_limit, "patience": patience, "give_up": give_up, "on_hit": on_hit,
        "smooth": smooth, "spacing": spacing, "max_age": max_age,
    }  # fmt: skip
    given = {name: value for name, value in how.items() if value is not None}
    out = Outputs(json_, not no_timing, csv, save, force, film=film, chart=chart)
    out.check()
    budget = budget_of("--plan-limit", plan_limit)
    simulation = _settings(given)
    scenario = request.scenario()
    scene = replace(scenario.scene, traffic=traffic.traffic(scenario.scene, request.seed))
    scenario = replace(scenario, scene=scene, drive=asdict(simulation))
    raise typer.Exit(drive_scenario(scenario, out, budget))


def _settings(how: Mapping[str, Any]) -> Settings:
    """Settings of a drive from the words of a call.

    Raises
    ------
    UsageError : a word that an option does not know.
    SettingError : a number out of its range.
    """
    from lampyris.sim.continuous.settings import Settings

    try:
        return Settings.of(how)
    except SettingError as fault:
        option = f"--{fault.where.replace('_', '-')}"
        word = how.get(fault.where)
        kind = UsageError if isinstance(word, str) else SettingError
        todo = did_you_mean(word, fault.allowed.split(", ")) if kind is UsageError else fault.todo
        raise kind(fault.code, fault.what, where=option, allowed=fault.allowed, todo=todo) from None


def drive_scenario(scenario: Scenario, out: Outputs, budget: Budget | None = None) -> int:
    """Drive what a scenario says, write and print the result. Returns the exit code."""
    from lampyris import scenarios
    from lampyris.cli.request import scene_notes
    from lampyris.report.data.serialize import drive_record

    print_notes((*scenario.notes, *scene_notes(scenario.scene), *scenarios.without_effect(scenario)))
    with counting("driving", "s", quiet=out.json) as second:
        done: Any = scenarios.run(scenario, progress=second, budget=budget)
    made: Drive = done
    print_notes(made.notes)
    if made.curves:
        _write_files(made, out)
    elif out.film or out.chart or out.csv:
        print_notes(("the robot never set off, so no film, chart or CSV was written",))
    if out.save is not None:
        print_notes(scenarios.save_scenario(scenario, out.save))
    if out.json:
        print_json(out.without_timing(drive_record(made)))
    else:
        with outputs.text_beside(out.csv):
            print_drive(made, name=scenario.name)
            print_written(out.film, out.chart, out.csv, out.save)
    return 0 if made.arrived else NO_ANSWER


def _write_files(made: Drive, out: Outputs) -> None:
    """Write the film, the chart and the table."""
    if out.film is not None:
        from lampyris.report.film.drive_film import film_drive

        with counting("filming", "frames", quiet=out.json) as frame:
            film_drive(made, out.film, progress=frame)
    if out.chart is not None:
        from lampyris.report.charts.drive_chart import draw_drive

        with working("drawing", quiet=out.json):
            draw_drive(made, out.chart)
    if out.csv is not None:
        from lampyris.report.data.csv import write_drive_csv

        with outputs.place(out.csv) as place:
            write_drive_csv(place, made)


def print_drive(run: Drive, *, name: str = "") -> None:
    """Print a drive in continuous time."""
    from lampyris.report.data.metrics import drive_shares, worth_telling
    from lampyris.report.data.serialize import drive_corners

    grid = run.scene.grid
    text.line(run.sentence, style=f"bold {'green' if run.arrived else 'red'}")
    kinds: dict[str, int] = {}
    for body in run.obstacle_specs:
        kinds[body.kind] = kinds.get(body.kind, 0) + 1
    counts = ", ".join(f"{kind} x{n}" for kind, n in kinds.items()) or "none"
    after = f"{run.outcome.value} after {run.duration:.2f} s"
    if run.optimum:
        after += f", {run.duration / run.optimum:.2f} times the optimum of the first way without obstacles"
    moments = [m.word for m in run.moments]
    hits = f"waits {moments.count('wait')}, hits {moments.count('hit')}, contacts {moments.count('contact')}"
    turns = drive_corners(run)
    moving = float(run.v.max(initial=0.0))
    rows = [("scenario", name)] if name else []
    rows += [
        ("map", f"{grid.name or '-'}, {grid.width} x {grid.height} cells of {grid.resolution:g} m"),
        ("from, to", f"{run.scene.start} to {run.scene.goal}"),
        ("planner", f"{run.planner}, {run.scene.moves.name} moves, seed {run.seed}; {run.replans} replans"),
        ("obstacles", f"{len(run.obstacle_specs)} ({counts})"),
        ("outcome", after),
        ("corners", f"{turns['turns'] - turns['stops']} rounded, {turns['stops']} stops to turn"),
        ("met", hits),
        ("speed", f"{run.law} law, greatest {moving:.3g} m/s, a decision every {run.period:g} s"),
        ("limited by", ", ".join(f"{c.cause} {c.time:.0%}" for c in worth_telling(drive_shares(run))) or "-"),
    ]
    if run.error > 0:
        rows.append(("off its way", f"at most {run.error:.3g} m from where it was commanded to be"))
    text.facts("", rows)
