"""``lampyris run``: plan, simulate or drive what a scenario file says.

Heavy modules are imported when the verb runs, so that --help is instant.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lampyris._core.limits import MAX_CELLS
from lampyris.cli.options import (
    AllowOutside,
    Explain,
    Film,
    Force,
    Json,
    MaxCells,
    NoTiming,
    Picture,
    Replay,
    Save,
)
from lampyris.cli.outputs import Outputs
from lampyris.cli.verbs import plan, simulate
from lampyris.cli.verbs.drive import command as drive
from lampyris.cli.verbs.fleet import FleetOutputs, run_scenario
from lampyris.errors import UsageError


def run(
    scenario: Annotated[Path, typer.Argument(metavar="SCENARIO", help="A scenario file (.yaml or .json).")],
    allow_outside: AllowOutside = False,
    max_cells: MaxCells = None,
    json_: Json = False,
    no_timing: NoTiming = False,
    explain: Explain = False,
    picture: Picture = None,
    layer: Annotated[
        str | None,
        typer.Option(
            "--layer",
            metavar="luciferin|cost|none",
            help="The layer drawn under the path: luciferin, cost or none.",
        ),
    ] = None,
    film: Film = None,
    replay: Replay = None,
    chart: Annotated[
        Path | None, typer.Option("--chart", metavar="FILE", help="Draw the speed over time, of a drive.")
    ] = None,
    csv: Annotated[
        Path | None,
        typer.Option("--csv", metavar="FILE", help="Write a row for every node, tick or segment."),
    ] = None,
    save: Save = None,
    force: Force = False,
) -> None:
    """Plan, simulate or drive the scenario in a file, of one robot or of a fleet."""
    out = Outputs(json_, not no_timing, csv, save, force, explain, picture, layer, film, chart, replay=replay)
    raise typer.Exit(run_file(scenario, allow_outside, max_cells, out))


def run_file(path: Path, allow_outside: bool, max_cells: int | None, out: Outputs) -> int:
    """Plan, simulate or drive what the file says. Returns the exit code."""
    from lampyris.io.fleet_scenario.scenario import FleetScenario
    from lampyris.scenarios import load_scenario

    out.check()
    limit = MAX_CELLS if max_cells is None else max_cells
    scenario = load_scenario(path, allow_outside=allow_outside, max_cells=limit)
    if isinstance(scenario, FleetScenario):
        for option, given in (
            ("--explain", out.explain),
            ("--layer", out.layer),
            ("--chart", out.chart),
            ("--csv", out.csv),
        ):
            if given:
                raise UsageError("OPTIONS", f"{option} with a scenario of a fleet", where=str(path))
        return run_scenario(
            scenario,
            FleetOutputs(out.json, not out.timing, out.picture, out.film, None, out.save, out.replay),
        )
    kind = "drives" if scenario.drive is not None else "simulates" if scenario.simulated else "plans"
    only = {
        "--explain": (out.explain, "plans"), "--picture": (out.picture, "plans"),
        "--layer": (out.layer, "plans"), "--film": (out.film, "simulates drives"),
        "--chart": (out.chart, "drives"), "--replay": (out.replay, "simulates drives"),
    }  # fmt: skip
    for option, (given, kinds) in only.items():
        if given and kind not in kinds:
            raise UsageError("OPTIONS", f"{option} with a scenario that {kind}", where=str(path))
    if kind == "drives":
        return drive.drive_scenario(scenario, out)
    if scenario.simulated:
        return simulate.simulate_scenario(scenario, out)
    return plan.plan_scenario(scenario, out)
