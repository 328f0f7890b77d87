"""``lampyris uncertain``: what uncertain settings do to the time, the length or the energy of a planned drive.

Heavy modules are imported when the verb runs, so that --help is instant.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lampyris._core import defaults
from lampyris._core.defaults import OUTCOME, OUTCOMES, PROFILE_SMOOTH, SMOOTHING, UNCERTAINTY_METHODS
from lampyris.cli import options, outputs, text
from lampyris.cli.exit_codes import NO_ANSWER
from lampyris.cli.option_errors import check_choice
from lampyris.cli.option_groups import (
    EndOptions,
    LawOptions,
    MapOptions,
    PlannerOptions,
    RobotOptions,
    RuleOptions,
    TrafficOptions,
)
from lampyris.cli.options import Force, Json, Picture
from lampyris.cli.outputs import print_written
from lampyris.cli.progress import counting, working
from lampyris.cli.text import print_json, print_notes
from lampyris.errors import UsageError

if TYPE_CHECKING:
    from lampyris.cli.request import Request
    from lampyris.uncertainty.propagate import Propagation


def uncertain(
    map_options: MapOptions,
    ends: EndOptions,
    robot: RobotOptions,
    rules: RuleOptions,
    planning: PlannerOptions,
    law_options: LawOptions,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            "--vary",
            metavar="NAME=RANGE",
            help="A setting that is uncertain: v_max=0.8:1.2 (uniform) or radius=normal(0.15,0.02); repeatable.",
        ),
    ] = None,
    of: Annotated[
        str, typer.Option("--of", metavar="|".join(OUTCOMES), help="The outcome to analyse.")
    ] = OUTCOME,
    method: Annotated[
        str,
        typer.Option(
            "--method",
            metavar="|".join(UNCERTAINTY_METHODS),
            help="auto: polynomial chaos, and Monte Carlo where the outcome is not smooth.",
        ),
    ] = defaults.UNCERTAINTY_METHOD,
    tolerance: Annotated[
        float, typer.Option("--tolerance", metavar="SHARE", help="Share of the variance that may be missing.")
    ] = defaults.UNCERTAINTY_TOLERANCE,
    runs: Annotated[
        int,
        typer.Option(
            "--runs",
            metavar="N",
            help="Greatest number of runs for polynomial chaos, held-out runs included.",
        ),
    ] = defaults.EXPANSION_RUNS,
    monte_carlo_runs: Annotated[
        int, typer.Option("--monte-carlo-runs", metavar="N", help="Runs for Monte Carlo.")
    ] = defaults.MONTE_CARLO_RUNS,
    held_out: Annotated[
        int,
        typer.Option("--held-out", metavar="N", help="Random runs that the expansion is checked against."),
    ] = defaults.HELD_OUT_RUNS,
    workers: Annotated[
        int,
        typer.Option(
            "--workers",
            metavar="N",
            min=1,
            max=256,
            help="Worker processes; the result does not depend on it.",
        ),
    ] = 1,
    smooth: Annotated[
        str,
        typer.Option(
            "--smooth",
            metavar="|".join(SMOOTHING),
            help="How the path is smoothed, as in `lampyris speed`.",
        ),
    ] = PROFILE_SMOOTH,
    obstacles: options.Obstacles = 0,
    mobility: options.Mobility = defaults.MOBILITY,
    obstacle_radius: options.ObstacleRadius = 0.0,
    json_: Json = False,
    picture: Picture = None,
    force: Force = False,
) -> None:
    """Compute the distribution of the time, length or energy of a drive under uncertain settings, and the share of each."""
    from lampyris.cli.request import Request

    request = Request(map_options, ends, robot, rules, planning, law_options)
    check_choice("SMOOTH", "--smooth", smooth, tuple(SMOOTHING))
    if obstacles and smooth != PROFILE_SMOOTH:
        raise UsageError(
            "OPTIONS", "--smooth with --obstacles", allowed="drives, which smooth as `lampyris drive`"
        )
    moving = TrafficOptions(obstacles=obstacles, mobility=mobility, obstacle_radius=obstacle_radius)
    how = {
        "of": of, "method": method, "tolerance": tolerance, "runs": runs, "monte_carlo_runs": monte_carlo_runs,
        "held_out": held_out, "smooth": smooth, "workers": workers,
    }  # fmt: skip
    raise typer.Exit(
        propagate_and_print(
            request, vary_of(vary or []), moving, how, UncertainOutputs(json_, picture, force)
        )
    )


@dataclass(frozen=True)
class UncertainOutputs:
    """What ``uncertain`` prints and writes."""

    json: bool
    picture: Path | None
    force: bool


def vary_of(words: list[str]) -> dict[str, str]:
    """The ranges by setting.

    Raises
    ------
    UsageError : ``VARY``: no word, a word without ``=``, or a setting given twice.
    """
    found: dict[str, str] = {}
    for word in words:
        name, equals, value = (part.strip() for part in word.partition("="))
        name = name.replace("-", "_")
        if not equals or not name:
            allowed = "NAME=LOW:HIGH or NAME=normal(MEAN,SD)"
            raise UsageError("VARY", f"{word!r}", where="--vary", allowed=allowed)
        if name in found:
            raise UsageError("VARY", f"{name} is given twice", where="--vary", allowed="once each")
        found[name] = value
    if not found:
        raise UsageError("VARY", "nothing is uncertain", where="--vary", allowed="at least one NAME=RANGE")
    return found


def propagate_and_print(
    request: Request,
    vary: dict[str, str],
    traffic: TrafficOptions,
    how: dict[str, Any],
    out: UncertainOutputs,
) -> int:
    """Compute, write and print. Returns the exit code."""
    from lampyris.cli.request import traffic_of
    from lampyris.report.data.serialize import grid_record
    from lampyris.uncertainty.propagate import propagate

    outputs.check_outputs(out.force, json=out.json, picture=out.picture)
    scenario = request.scenario()
    print_notes(scenario.notes)
    drawn = traffic_of(
        traffic, scenario.scene, scenario.seed
    )  # which checks the options, without obstacles too
    moving = drawn if traffic.obstacles else None
    with counting("uncertain", "runs", quiet=out.json) as count:
        made = propagate(
            scenario.scene, vary, planner=scenario.planner, planner_settings=scenario.settings,
            law=scenario.law, law_settings=scenario.law_settings, energy=None, seed=scenario.seed, traffic=moving,
            progress=None if count is None else lambda done, most: count(done), **how,
        )  # fmt: skip
    if made.outcome is None:
        if out.json:
            print_json({"map": grid_record(scenario.scene.grid), **record_of(made, how["of"])})
        else:
            text.line(made.plan.sentence, style="bold red")
        return NO_ANSWER
    print_notes((made.outcome.note,) if made.outcome.note else ())
    if out.picture is not None:
        from lampyris.report.charts.uncertainty_chart import draw_uncertainty

        with working("drawing", quiet=out.json):
            shares = {
                name: (one.first, one.total, one.total_error) for name, one in made.outcome.sobol.items()
            }
            draw_uncertainty(
                made.outcome.sample, shares, made.outcome.of, made.outcome.unit, made.nominal, out.picture
            )
    if out.json:
        print_json({"map": grid_record(scenario.scene.grid), **record_of(made, how["of"])})
    else:
        print_outcome(made)
        print_written(out.picture)
    return 0


OF_OUTCOME = (
    "mean", "sd", "quantiles", "sobol", "runs", "method", "held_out", "held_out_error", "terms", "mean_error",
    "sd_error", "note",
)  # fmt: skip
"""Keys that are null where there is no path."""


def record_of(made: Propagation, of: str) -> dict[str, Any]:
    """The result as plain data, as docs/output.md has it."""
    one = made.outcome
    record: dict[str, Any] = dict.fromkeys(OF_OUTCOME)
    if one is not None:
        record = {key: getattr(one, key) for key in OF_OUTCOME}
        record["quantiles"] = {f"{share:g}": value for share, value in one.quantiles.items()}
        record["sobol"] = {name: asdict(each) for name, each in one.sobol.items()}
    return {
        "sentence": made.plan.sentence,
        "of": of,
        "unit": OUTCOMES[of],
        "nominal": made.nominal,
        **record,
        "vary": {name: described(given) for name, given in made.vary.items()},
    }


def described(given: Any) -> dict[str, Any]:
    """A distribution as plain data."""
    from lampyris.uncertainty.inputs import Normal

    if isinstance(given, Normal):
        return {"distribution": "normal", "mean": given.mean, "sd": given.sd}
    return {"distribution": "uniform", "low": given.low, "high": given.high}


def print_outcome(made: Propagation) -> None:
    """Print the distribution, then what carries it."""
    one = made.outcome
    assert one is not None
    unit = one.unit
    spread = ", ".join(f"{share:.0%} {value:.4g}" for share, value in one.quantiles.items())
    error = "" if one.mean_error is None else f" (standard error {one.mean_error:.2g})"
    sd_error = "" if one.sd_error is None else f" (standard error {one.sd_error:.2g})"
    text.line(f"{one.of}: {one.mean:.5g} {unit} +- {one.sd:.3g} {unit}", style="bold")
    checked = (
        "none"
        if one.held_out_error is None
        else f"{one.held_out_error:.2g} of the variance in {one.held_out} runs"
    )
    terms = f", {one.terms} terms" if one.terms else ""
    text.facts(
        "",
        [
            ("as set", f"{made.nominal:.5g} {unit}"),
            ("mean", f"{one.mean:.6g} {unit}{error}"),
            ("standard deviation", f"{one.sd:.4g} {unit}{sd_error}"),
            ("quantiles", spread),
            ("method", f"{one.method}, {one.runs} runs{terms}"),
            ("held-out error", checked),
        ],
    )
    rows = []
    for name, each in sorted(one.sobol.items(), key=lambda item: -item[1].total):
        errors = ["" if e is None else f" +- {e:.1%}" for e in (each.first_error, each.total_error)]
        rows.append((name, f"{each.first:.1%}{errors[0]}", f"{each.total:.1%}{errors[1]}"))
    columns = ("setting", "by itself", "with others")
    text.table("share of the variance", columns, rows, right=columns[1:])
