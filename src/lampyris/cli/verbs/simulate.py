"""``lampyris simulate``: a run among moving obstacles, tick by tick.

Heavy modules are imported when the verb runs, so that --help is instant.
"""

from __future__ import annotations

from dataclasses import replace
from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lampyris.cli import outputs, text
from lampyris.cli.exit_codes import NO_ANSWER
from lampyris.cli.option_groups import (
    EndOptions,
    LawOptions,
    MapOptions,
    PlannerOptions,
    RobotOptions,
    RuleOptions,
    SimulationOptions,
    TrafficOptions,
    ViaOptions,
    settings_in,
)
from lampyris.cli.options import (
    Bag,
    Export,
    Film,
    Force,
    GoalTrack,
    Json,
    NoTiming,
    PlanLimit,
    Replay,
    Save,
)
from lampyris.cli.outputs import Outputs, print_written
from lampyris.cli.progress import counting
from lampyris.cli.text import print_json, print_notes, word_counts
from lampyris.model.settings.sensor import FULL_TURN
from lampyris.model.settings.simulation import SimulationSettings

if TYPE_CHECKING:
    from lampyris.io.scenario.scenario import Scenario
    from lampyris.model.trace import Trace
    from lampyris.planning.base import Budget


def simulate(
    map_options: MapOptions,
    ends: EndOptions,
    robot: RobotOptions,
    via: ViaOptions,
    rules: RuleOptions,
    planning: PlannerOptions,
    law_options: LawOptions,
    traffic: TrafficOptions,
    simulation: SimulationOptions,
    json_: Json = False,
    no_timing: NoTiming = False,
    film: Film = None,
    replay: Replay = None,
    csv: Annotated[
        Path | None,
        typer.Option(
            "--csv", metavar="FILE", help="One row per tick: x_m, y_m, yaw, v, tick, cause, x, y, event."
        ),
    ] = None,
    export: Export = None,
    bag: Bag = None,
    save: Save = None,
    force: Force = False,
    plan_limit: PlanLimit = None,
    goal_track: GoalTrack = None,
) -> None:
    """Simulate a run among moving obstacles, cell by cell and tick by tick."""
    from lampyris.cli.request import Request, budget_of, file_errors, read_goal_track, traffic_of, with_goal

    moving = None if goal_track is None else read_goal_track(goal_track)
    ends, codes = with_goal(ends, moving)
    request = Request(map_options, ends, robot, rules, planning, law_options)
    out = Outputs(json_, not no_timing, csv, save, force, film=film, export=export, bag=bag, replay=replay)
    out.check()
    budget = budget_of("--plan-limit", plan_limit)
    with file_errors(goal_track, codes):
        scenario = request.through(request.scenario(), via)
    scene = replace(scenario.scene, traffic=traffic_of(traffic, scenario.scene, request.seed))
    scenario = replace(
        scenario,
        scene=scene,
        simulated=True,
        **settings_in(simulation, SimulationSettings),
        goal_track=moving,
    )
    with file_errors(goal_track, codes):
        code = simulate_scenario(scenario, out, budget)
    raise typer.Exit(code)


def simulate_scenario(scenario: Scenario, out: Outputs, budget: Budget | None = None) -> int:
    """Simulate what a scenario says, write and print the result. Returns the exit code."""
    from lampyris import scenarios
    from lampyris.cli.request import scene_notes
    from lampyris.report.data.serialize import trace_record

    print_notes((*scenario.notes, *scene_notes(scenario.scene), *scenarios.without_effect(scenario)))
    with counting("simulating", "ticks", quiet=out.json) as tick:
        done: Any = scenarios.run(scenario, progress=tick, budget=budget)
    trace: Trace = done
    print_notes(trace.notes)
    if out.film is not None:
        from lampyris.report.film.simulation_film import film as make_film

        with counting("filming", "frames", quiet=out.json) as frame:
            make_film(trace, out.film, progress=frame)
    if out.csv is not None:
        from lampyris.report.data.csv import write_trace_csv

        with outputs.place(out.csv) as place:
            write_trace_csv(place, trace)
    out.write_ros(trace)
    if out.save is not None:
        print_notes(scenarios.save_scenario(scenarios.completed(scenario, trace), out.save))
    if out.json:
        print_json(out.without_timing(trace_record(trace)))
    else:
        with outputs.text_beside(out.csv):
            print_trace(trace, name=scenario.name)
            print_written(out.film, out.csv, out.export, out.bag, out.save)
    if out.replay is not None:
        from lampyris.app.replay.streams import trace_replay

        with outputs.text_beside(out.csv):
            outputs.write_replay(out.replay, trace_replay(trace, scenario.name), json=out.json)
    return 0 if trace.arrived else NO_ANSWER


def print_trace(run: Trace, *, name: str = "") -> None:
    """Print a simulation."""
    text.line(run.sentence, style=f"bold {'green' if run.arrived else 'red'}")
    grid = run.scene.grid
    kinds = word_counts([b.kind for b in run.obstacle_specs]) or "none"
    moving = run.speed[run.speed > 0]
    mean = f"{moving.mean():.4g}" if len(moving) else "0"
    counts = f"{run.replans} replans, {run.waits} waits, {run.path_switches} path switches"
    rows = [("scenario", name)] if name else []
    rows += [
        ("map", f"{grid.name or '-'}, {grid.width} x {grid.height} cells of {grid.resolution:g} m"),
        ("from, to", f"{run.scene.start} to {run.scene.goal}"),
        ("planner", f"{run.planner}, {run.scene.moves.name} moves, seed {run.seed}"),
        ("obstacles", f"{len(run.obstacle_specs)} ({kinds})"),
        (
            "outcome",
            f"{run.outcome.value} after {run.ticks} ticks; collisions {run.collisions}, hits {run.hits}",
        ),
        ("cost", f"{run.cost:.6g} cells driven; {counts}"),
        ("iterations", f"{run.iterations}; {run.expansions} expansions"),
        ("speed", f"mean {mean} {run.units} while moving ({run.law} law)"),
        ("limited by", word_counts(run.cause)),
    ]
    if run.sensor is not None and run.seen is not None:
        seen = int((run.seen >= 0).sum())
        angle = (
            "all around"
            if run.sensor.field_of_view >= FULL_TURN
            else f"{degrees(run.sensor.field_of_view):.4g} degrees"
        )
        share = f"{seen:,} of {run.seen.size:,} cells seen"
        cost = "" if run.sensor.unseen_cost == 1.0 else f"; unseen cells cost {run.sensor.unseen_cost:g}"
        rows.insert(-4, ("sensor", f"{run.sensor.range_m:g} m, {angle}; {share}{cost}"))
    if run.via:
        reached = f"{len(run.via_ticks)} of {len(run.via)} reached"
        rows.insert(3, ("via", f"{text.first_few(run.via)}; {reached}"))
    if run.goal_track is not None:
        rows.insert(3, ("goal", f"moves; at {run.goal_at(run.ticks)} at the end"))
    if run.edits:
        walls, freed = (sum(len(getattr(e, what)) for e in run.edits) for what in ("blocked", "freed"))
        times = f"{len(run.edits)} time" + "s" * (len(run.edits) > 1)
        rows.insert(-4, ("edits", f"{times}: {walls} cells turned into walls, {freed} free"))
    text.facts("", rows)
