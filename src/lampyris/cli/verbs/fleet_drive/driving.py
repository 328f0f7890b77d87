"""Run, draw and print fleets that drive."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lampyris.cli import text
from lampyris.cli.outputs import print_written
from lampyris.cli.progress import counting
from lampyris.cli.text import print_json, print_notes
from lampyris.errors import SettingError, plural
from lampyris.model.fleet.fleet_trace import FleetTrace
from lampyris.model.fleet.lifelong import LifelongTrace

if TYPE_CHECKING:
    from lampyris.io.fleet_scenario.scenario import FleetScenario
    from lampyris.model.fleet.fleet_plan import FleetPlan

_POLICIES = {
    "order": "order: the plan's order of visits at every cell",
    "orca": "orca: no plan, each avoids its neighbours",
}


def execute(
    scenario: FleetScenario, plan: FleetPlan | None, film: Path | None, *, json: bool, no_timing: bool
) -> FleetTrace:
    """Drive a plan, or without one, and say what came of it."""
    from lampyris.fleet_scenarios import run_fleet

    with counting(f"driving {plural(len(scenario.fleet.robots), 'robot')}", "", quiet=json) as tick:
        trace = run_fleet(scenario, plan=plan, progress=tick)
    assert isinstance(trace, FleetTrace)
    if film is not None:
        from lampyris.report.film.fleet_drive_film import fleet_drive_film

        with counting("filming", "frames", quiet=json) as frame:
            fleet_drive_film(trace, film, progress=frame)
    if json:
        from lampyris.report.data.fleets.drive_record import fleet_drive_record

        record = fleet_drive_record(trace)
        print_json({**record, "timing": {}} if no_timing else record)
    else:
        print_notes(trace.notes)
        _print_drive(trace)
        print_written(None, film)
    return trace


def lifelong(scenario: FleetScenario, film: Path | None, *, json: bool, no_timing: bool) -> LifelongTrace:
    """Drive a lifelong fleet and say what came of it."""
    from lampyris.fleet_scenarios import run_fleet

    for robot, tick in scenario.faults:
        if tick % 1:
            raise SettingError.of(
                "FAULTS", "faults", f"{robot}@{tick:g}", allowed="a whole tick with --lifelong"
            )
    with counting(f"driving {plural(len(scenario.fleet.robots), 'robot')}", "ticks", quiet=json) as tick_:
        trace = run_fleet(scenario, progress=tick_)
    assert isinstance(trace, LifelongTrace)
    if film is not None:
        from lampyris.report.film.fleet_drive_film import lifelong_film

        with counting("filming", "frames", quiet=json) as frame:
            lifelong_film(trace, film, progress=frame)
    print_notes(trace.notes)
    if json:
        from lampyris.report.data.fleets.drive_record import lifelong_record

        record = lifelong_record(trace)
        print_json({**record, "timing": {}} if no_timing else record)
    else:
        _print_lifelong(trace)
        print_written(None, film)
    return trace


def _print_drive(trace: FleetTrace) -> None:
    text.line(trace.sentence, style=f"bold {'green' if trace else 'red'}")
    grid, one, discs = trace.grid, trace.robots[0], plural(len(trace.robots), "disc")
    who = plural(trace.arrived, "robot")
    touched = f"{trace.contacts} pairs of robots, {trace.wall_contacts} with walls, as the referee measured"
    rows: list[Any] = [
        ("map", f"{grid.name or '-'}, {grid.width} x {grid.height} cells of {grid.resolution:g} m"),
        ("robots", f"{discs}, the first of radius {one.radius:g} m, {one.v_max:g} m/s; seed {trace.seed}"),
        ("policy", _POLICIES[trace.settings.policy]),
        ("contacts", touched),
        ("arrived", f"{who}, the last after {np.nanmax(trace.arrivals):.1f} s" if trace.arrived else "nobody"),
    ]  # fmt: skip
    late = trace.lateness[~np.isnan(trace.lateness)]
    if len(late):
        words = f"{late.mean():.1f} s on average, {late.max():.1f} s at the most, beside a tick of {trace.tick:.2g} s"
        rows.append(("lateness", words))
        spent = ", ".join(
            f"{cause} {seconds:.0f} s" for cause, seconds in trace.wait_totals().items() if seconds > 0
        )
        rows.append(
            (
                "waiting",
                f"{spent or 'none'}, all robots together; in motion {trace.utilisation:.0%} of the time",
            )
        )
    if trace.delays.probability:
        rows.append(("delays", f"{trace.delayed:,} moves, {trace.delays.duration:g} s on average"))
    if trace.rotations:
        rows.append(("rotations", f"{trace.rotations} rings of robots that exchanged their cells at once"))
    for robot, when in trace.faults:
        rows.append(("fault", f"robot {robot} stopped permanently at {when:g} s"))
    if trace.obstacles:
        met = (
            f"{trace.obstacle_contacts} touched robots that stood, {trace.moving_contacts} robots that drove"
        )
        rows.append(("obstacles", f"{len(trace.obstacles)}; {met}"))
    _timed(rows, trace.timing)
    text.facts("", rows)


def _print_lifelong(trace: LifelongTrace) -> None:
    text.line(trace.sentence, style=f"bold {'green' if trace else 'red'}")
    grid, service = trace.grid, trace.service_times
    rows: list[Any] = [
        ("map", f"{grid.name or '-'}, {grid.width} x {grid.height} cells of {grid.resolution:g} m"),
        ("robots", f"{trace.robots}, {plural(trace.ticks, 'tick')}, seed {trace.seed}"),
        ("planner", f"{trace.planner}, {plural(trace.windows, 'window')} of {plural(trace.window, 'tick')}"),
        (
            "tasks",
            f"{trace.completed:,} of {len(trace.tasks):,} done, throughput {trace.throughput:.3f} tasks a tick",
        ),
        ("utilisation", f"{trace.utilisation:.1%} of the time with a task, {trace.moving:.1%} in motion"),
    ]
    if len(service):
        words = (
            f"{service.mean():.1f} ticks on average from release to completion, {service.max()} at the most"
        )
        rows.append(("service", words))
    for robot, when in trace.faults:
        rows.append(("fault", f"robot {robot} stopped permanently at tick {when}"))
    _timed(rows, trace.timing)
    text.facts("", rows)


def _timed(rows: list[Any], timing: Any) -> None:
    total = timing.get("total_s")
    if total is not None:
        loaded = timing.get("loading_s", 0.0)
        once = f", loading compiled code {1000 * loaded:.1f} ms" if loaded >= 1e-4 else ""
        parts = f"driving {1000 * timing['simulate_s']:.1f} ms, referee {1000 * timing['referee_s']:.1f} ms"
        rows.append(("time", f"{1000 * total:.1f} ms: {parts}{once}"))
