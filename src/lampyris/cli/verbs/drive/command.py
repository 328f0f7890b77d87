"""``lampyris drive``: among moving obstacles in continuous time.

Heavy modules are imported when the verb runs, so that --help is instant.
"""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lampyris.cli import outputs, text
from lampyris.cli.exit_codes import NO_ANSWER
from lampyris.cli.option_groups import (
    DriveOptions,
    EndOptions,
    LawOptions,
    MapOptions,
    PlannerOptions,
    RobotOptions,
    RuleOptions,
    TrafficOptions,
    ViaOptions,
    settings_in,
)
from lampyris.cli.options import Bag, Export, Film, Force, Json, NoTiming, PlanLimit, Replay, Save
from lampyris.cli.outputs import Outputs, print_written
from lampyris.cli.progress import counting, working
from lampyris.cli.text import print_json, print_notes

if TYPE_CHECKING:
    from lampyris.io.scenario.scenario import Scenario
    from lampyris.model.drive import Drive
    from lampyris.planning.base import Budget


def drive(
    map_options: MapOptions,
    ends: EndOptions,
    robot: RobotOptions,
    via: ViaOptions,
    rules: RuleOptions,
    planning: PlannerOptions,
    law_options: LawOptions,
    traffic: TrafficOptions,
    simulation: DriveOptions,
    json_: Json = False,
    no_timing: NoTiming = False,
    film: Film = None,
    replay: Replay = None,
    chart: Annotated[
        Path | None,
        typer.Option("--chart", metavar="FILE", help="Draw speed and distances over time (.png or .svg)."),
    ] = None,
    csv: Annotated[
        Path | None,
        typer.Option(
            "--csv", metavar="FILE", help="One row per segment: t_s, x_m, y_m, yaw, v, a, s, leg, cause, why."
        ),
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option(
            "--picture",
            metavar="FILE",
            help="Draw the driven path on the map, for one or several controllers (.png or .svg).",
        ),
    ] = None,
    export: Export = None,
    bag: Bag = None,
    save: Save = None,
    force: Force = False,
    plan_limit: PlanLimit = None,
) -> None:
    """Simulate a run among moving obstacles in continuous time, with bounded accelerations.

    Several controllers, such as --controller exact,rpp,mppi, are run one after the other: one table, one picture.
    """
    from lampyris.cli.request import Request, budget_of, parse_controllers, track_speed, traffic_of
    from lampyris.model.settings.drive import DriveSettings

    request = Request(map_options, ends, robot, rules, planning, law_options)
    out = Outputs(
        json_,
        not no_timing,
        csv,
        save,
        force,
        film=film,
        chart=chart,
        picture=picture,
        export=export,
        bag=bag,
        replay=replay,
    )
    out.check()
    budget = budget_of("--plan-limit", plan_limit)
    given = settings_in(simulation, DriveSettings)
    controllers = parse_controllers(
        [n.strip() for n in given["controller"].split(",")], simulation.set_controller or []
    )
    given["controller"], given["controller_settings"] = next(iter(controllers.items()))
    scenario, fastest = request.scenario(), track_speed(traffic)
    if given["obstacle_speed"] is None and fastest > scenario.scene.robot.v_max:
        given["obstacle_speed"] = fastest * (1.0 + 1e-6)
        print_notes(
            (f"obstacles move at up to {fastest:.4g} m/s a straight step, as the fastest track does",)
        )
    settings = DriveSettings(**given)
    scenario = request.through(scenario, via)
    moving = traffic_of(traffic, scenario.scene, request.seed, settings.obstacle_speed)
    scene = replace(scenario.scene, traffic=moving)
    scenario = replace(scenario, scene=scene, drive=asdict(settings))
    if len(controllers) > 1:
        from lampyris.cli.verbs.drive.controllers import compare_controllers

        raise typer.Exit(compare_controllers(scenario, controllers, out, budget))
    raise typer.Exit(drive_scenario(scenario, out, budget))


def drive_scenario(scenario: Scenario, out: Outputs, budget: Budget | None = None) -> int:
    """Drive what a scenario says, write and print the result. Returns the exit code."""
    from lampyris import scenarios
    from lampyris.cli.request import drive_notes
    from lampyris.report.data.serialize import drive_record

    print_notes(drive_notes(scenario))
    with counting("driving", "s", quiet=out.json) as second:
        done: Any = scenarios.run(scenario, progress=second, budget=budget)
    made: Drive = done
    print_notes(made.notes)
    if made.curves:
        _write_files(made, out)
    elif out.film or out.chart or out.csv or out.picture or out.replay:
        print_notes(("the robot never set off, so no film, picture, chart, replay or CSV was written",))
    out.write_ros(made)
    if out.save is not None:
        print_notes(scenarios.save_scenario(scenario, out.save))
    if out.json:
        print_json(out.without_timing(drive_record(made)))
    else:
        with outputs.text_beside(out.csv):
            print_drive(made, name=scenario.name)
            print_written(out.film, out.picture, out.chart, out.csv, out.export, out.bag, out.save)
    if out.replay is not None and made.curves:
        from lampyris.app.replay.streams import drive_replay

        with outputs.text_beside(out.csv):
            outputs.write_replay(out.replay, drive_replay(made, scenario.name), json=out.json)
    return 0 if made.arrived else NO_ANSWER


def _write_files(made: Drive, out: Outputs) -> None:
    """Write the film, the chart and the table."""
    if out.film is not None:
        from lampyris.report.film.drive_film import film_drive

        with counting("filming", "frames", quiet=out.json) as frame:
            film_drive(made, out.film, progress=frame)
    if out.picture is not None:
        from lampyris.report.pictures.trails_picture import draw_trails

        with working("drawing", quiet=out.json):
            draw_trails({made.controller: made}, out.picture)
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
    for obstacle in run.obstacle_specs:
        kinds[obstacle.kind] = kinds.get(obstacle.kind, 0) + 1
    counts = ", ".join(f"{kind} x{n}" for kind, n in kinds.items()) or "none"
    after = f"{run.outcome.value} after {run.duration:.2f} s"
    if run.optimum:
        after += f", {run.duration / run.optimum:.2f} times the optimum of the first path without obstacles"
    moments = [m.word for m in run.moments]
    hits = f"waits {moments.count('wait')}, hits {moments.count('hit')}, contacts {moments.count('contact')}"
    turns, poses = drive_corners(run), run.goal_tolerance is not None
    steps = f"{run.scene.robot.drive} drive" if poses else f"{run.scene.moves.name} moves"
    corners = (
        f"{turns['turns'] - turns['stops']} {'arcs' if poses else 'rounded'}, {turns['stops']} stops to turn"
    )
    moving = float(run.v.max(initial=0.0))
    rows = [("scenario", name)] if name else []
    rows += [
        ("map", f"{grid.name or '-'}, {grid.width} x {grid.height} cells of {grid.resolution:g} m"),
        ("from, to", f"{run.scene.start} to {run.scene.goal}"),
        ("planner", f"{run.planner}, {steps}, seed {run.seed}; {run.replans} replans"),
        ("obstacles", f"{len(run.obstacle_specs)} ({counts})"),
        ("outcome", after),
        ("corners", corners + " or to change direction" * poses),
        ("events", hits),
        ("speed", f"{run.law} law, greatest {moving:.3g} m/s, a decision every {run.period:g} s"),
        ("limited by", ", ".join(f"{c.cause} {c.time:.0%}" for c in worth_telling(drive_shares(run))) or "-"),
    ]
    if run.sensor is not None and run.seen is not None:
        seen = int((run.seen >= 0).sum())
        rows.append(("sensor", f"{run.sensor.range_m:g} m; {seen:,} of {run.seen.size:,} cells seen"))
    if run.via:
        rows.append(("via", f"{text.first_few(run.via)}; {len(run.via_times)} of {len(run.via)} reached"))
    if run.error > 0:
        rows.append(("off its path", f"at most {run.error:.3g} m from where it was commanded to be"))
    if poses:
        rows += _following(run)
    text.facts("", rows)


def _following(run: Drive) -> list[tuple[str, str]]:
    """How the robot followed its paths, as rows."""
    from lampyris.report.data.following import following

    if not run.paths:
        return [("controller", "exact: the path is followed exactly")]
    found = following(run)
    filtered = "filtered by the braking rule" if run.safety_filter == "braking" else "not filtered"
    rows = [("controller", f"{run.controller}, {filtered}")]
    if found["cross_track_max"] is not None:
        rows.append(
            (
                "off its path",
                (
                    f"{found['cross_track_max']:.3g} m at most, {found['cross_track_mean']:.3g} m on average; "
                    f"yaw {found['yaw_error_max']:.3g} and {found['yaw_error_mean']:.3g} rad"
                ),
            )
        )
        rows.append(
            (
                "smoothness",
                f"jerk {found['jerk_mean']:.3g} m/s3, yaw {found['yaw_acceleration_mean']:.3g} rad/s2",
            )
        )
    return rows
