"""``lampyris speed``: how fast along a path, and why, by which law.

Heavy modules are imported when the verb runs, so that --help is instant.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lampyris._core.defaults import POINTS_SMOOTH, PROFILE_SMOOTH, SAMPLE_SPACING, SMOOTHING
from lampyris.cli import outputs, text
from lampyris.cli.exit_codes import NO_ANSWER
from lampyris.cli.option_errors import check_choice
from lampyris.cli.option_groups import (
    EndOptions,
    LawOptions,
    MapOptions,
    PlannerOptions,
    RobotOptions,
    RuleOptions,
)
from lampyris.cli.options import Force, Json, NoTiming, ObstacleRadius, Picture, SetLaw, Track, Zones
from lampyris.cli.outputs import print_written
from lampyris.cli.progress import working
from lampyris.cli.text import plural, print_json

if TYPE_CHECKING:
    from lampyris.cli.verbs.speed_laws import SpeedComparison, SpeedRequest
    from lampyris.model.profile import Profile

DEFAULT = "constant,dissertation,rpp,physical,optimum"
COLOUR_BY = ("speed", "cause")


def speed(
    map_options: MapOptions,
    ends: EndOptions,
    robot: RobotOptions,
    rules: RuleOptions,
    planning: PlannerOptions,
    path: Annotated[
        Path | None,
        typer.Option("--path", metavar="FILE", help="A path from a file: CSV, a ROS Path, a plan's JSON."),
    ] = None,
    units: Annotated[
        str | None,
        typer.Option(
            "--units", metavar="metres|cells", help="Unit of a CSV's columns x,y: metres (default) or cells."
        ),
    ] = None,
    laws_: Annotated[
        str,
        typer.Option("--laws", metavar="NAME,...", help="The laws to compare, or all: see `lampyris laws`."),
    ] = DEFAULT,
    law: Annotated[
        str,
        typer.Option(
            "--law", metavar="NAME", help="The law that is reported in detail and written to files."
        ),
    ] = "physical",
    set_law: SetLaw = None,
    zones: Zones = None,
    v0: Annotated[float, typer.Option("--v0", metavar="M/S", help="Speed at the start.")] = 0.0,
    smooth: Annotated[
        str | None,
        typer.Option(
            "--smooth",
            metavar="|".join(SMOOTHING),
            help="How the path becomes a curve. "
            + "; ".join(f"{word}: {meaning}" for word, meaning in SMOOTHING.items())
            + f". Default: {PROFILE_SMOOTH} for a plan, as in `lampyris plan`; {POINTS_SMOOTH} with --path.",
        ),
    ] = None,
    spacing: Annotated[
        float | None,
        typer.Option(
            "--spacing",
            metavar="M",
            help=f"Maximum distance between two nodes of a curve, metres (default {SAMPLE_SPACING:g} of a cell).",
        ),
    ] = None,
    obstacle_states: Annotated[
        Path | None,
        typer.Option(
            "--obstacle-states",
            metavar="FILE",
            help="Moving obstacles: CSV x_m,y_m,radius,top_speed[,vx,vy].",
        ),
    ] = None,
    track: Track = None,
    tick: Annotated[
        float | None,
        typer.Option(
            "--tick", metavar="S", help="Seconds per row of --track (default: one cell at --v-max)."
        ),
    ] = None,
    obstacle_radius: ObstacleRadius = 0.0,
    explain: Annotated[
        bool, typer.Option("--explain", help="Print what limits the speed on each segment of the path.")
    ] = False,
    all_: Annotated[bool, typer.Option("--all", help="With --explain: a row for every node.")] = False,
    json_: Json = False,
    no_timing: NoTiming = False,
    csv: Annotated[
        Path | None,
        typer.Option(
            "--csv", metavar="FILE", help="One row per node: x_m, y_m, yaw, v, t_s, s, a, cause, why."
        ),
    ] = None,
    picture: Picture = None,
    colour_by: Annotated[
        str,
        typer.Option(
            "--colour-by",
            metavar="speed|cause",
            help="What the colour of the curve shows: speed or cause.",
        ),
    ] = "speed",
    chart: Annotated[
        Path | None,
        typer.Option(
            "--chart", metavar="FILE", help="Draw the speed of all laws along the path (.png or .svg)."
        ),
    ] = None,
    force: Force = False,
) -> None:
    """Compute how fast to drive a path, and why; compare speed laws on it."""
    from lampyris.cli.request import Request
    from lampyris.cli.verbs.speed_laws import SpeedRequest, TracksRequest

    request = Request(map_options, ends, robot, rules, planning, LawOptions(law, set_law, zones))
    tracks = TracksRequest(tuple(track or ()), tick, obstacle_radius)
    speed_request = SpeedRequest(request, path, units, laws_, v0, smooth, spacing, obstacle_states, tracks)
    out = SpeedOutputs(json_, not no_timing, csv, picture, chart, colour_by, force, explain or all_, all_)
    raise typer.Exit(compare_on_path(speed_request, out))


@dataclass(frozen=True)
class SpeedOutputs:
    """What ``speed`` prints and writes."""

    json: bool
    timing: bool
    csv: Path | None
    picture: Path | None
    chart: Path | None
    colour_by: str
    force: bool
    explain: bool
    all_nodes: bool

    def check(self) -> None:
        """Reject before any work what could not be written at the end."""
        outputs.check_outputs(
            self.force, json=self.json, csv=self.csv, picture=self.picture, chart=self.chart
        )
        check_choice("COLOUR_BY", "--colour-by", self.colour_by, COLOUR_BY)


def compare_on_path(request: SpeedRequest, out: SpeedOutputs) -> int:
    """Compare laws on a path, write and print the result. Returns the exit code."""
    from lampyris.cli.verbs.speed_laws import NoPath, compare_laws, record_of
    from lampyris.report.data.serialize import grid_record

    names = request.check()
    out.check()
    made = compare_laws(request, names)
    if isinstance(made, NoPath):
        if out.json:
            print_json({"map": grid_record(made.grid), "sentence": made.sentence, "laws": [], "speed": None})
        else:
            text.line(made.sentence, style="bold red")
        return NO_ANSWER
    _write_files(made, out)
    if out.json:
        print_json(record_of(made, out.timing))
    else:
        with outputs.text_beside(out.csv):
            print_comparison(made, explain=out.explain, all_nodes=out.all_nodes)
            print_written(out.csv, out.picture, out.chart)
    return 0


def _write_files(comparison: SpeedComparison, out: SpeedOutputs) -> None:

    from lampyris.cli.verbs.speed_laws import samples_at

    profile, grid = comparison.entry.profile, comparison.scene.grid
    poses, robot = comparison.poses, comparison.scene.robot
    if out.csv is not None:
        from lampyris.report.data.csv import write_profile_csv

        with outputs.place(out.csv) as place:
            write_profile_csv(place, profile, samples_at(profile, comparison.samples).heading, grid)
    with working("drawing", quiet=out.json):
        if out.picture is not None:
            from lampyris.report.pictures.path_picture import draw_sampled_path

            draw_sampled_path(
                grid, profile, out.picture, by=out.colour_by, obstacle_states=comparison.obstacle_states,
                given=None if poses is not None else comparison.given,
                radius=0.0 if poses is not None else robot.radius,
                poses=None if poses is None else poses.poses, robot=robot,
            )  # fmt: skip
        if out.chart is not None:
            from lampyris.report.charts.speed_compare import draw_comparison

            draw_comparison([(e.law, e.profile) for e in comparison.entries], comparison.chosen, out.chart)


def print_comparison(comparison: SpeedComparison, *, explain: bool, all_nodes: bool) -> None:
    """Print the laws side by side, then what limits the one that is examined."""
    from lampyris.report.data.metrics import cause_shares

    profile = comparison.entry.profile
    grid, samples = comparison.scene.grid, comparison.samples
    length = float(samples.s[-1])
    text.line(f"{length:.4g} m in {profile.duration:.4g} s by the {comparison.entry.law} law", style="bold")
    stops = f"{int(samples.stop.sum())} stops to turn"
    shape = f"{len(comparison.given)} points made {comparison.arcs} arcs and {stops}"
    corners = (
        [("corners", f"{comparison.arcs} rounded within half a step, {stops}")]
        if comparison.smooth == "none"
        else []
    )
    lengths = (
        f"{comparison.given_m:.6g} m given; driven {length:.6g} m ({comparison.smooth}), "
        f"at most {comparison.deviation_m:.3g} m from it"
    )
    rows = [
        ("map", f"{grid.name or '-'}, {grid.width} x {grid.height} cells of {grid.resolution:g} m"),
        ("path", f"from {comparison.source}: {shape}; {len(samples)} nodes"),
        ("length", lengths),
        *corners,
    ]
    if (poses := comparison.poses) is not None:
        counts = f"{plural(poses.reversals, 'reversal')}, {plural(comparison.arcs, 'arc')}"
        words = f"from {comparison.source}: {counts}; {len(poses.poses)} poses, {len(samples)} nodes"
        bound = f"{poses.cost_m:.6g} m; at most {poses.bound:.4g} times the lower bound"
        rows[1:] = [("path", words), ("cost", bound)]
    text.facts("", rows)
    _print_laws(comparison)
    for law, why in comparison.refused.items():
        text.line(f"{law} does not let the robot drive: {why}", style="red")
    columns = ("cause", "of the path", "of the time")
    shares = [(share.cause, f"{share.distance:.1%}", f"{share.time:.1%}") for share in cause_shares(profile)]
    text.table(f"what limits {comparison.entry.law}", columns, shares, right=columns[1:])
    if explain:
        _print_reasons(profile, all_nodes)


def _print_laws(comparison: SpeedComparison) -> None:
    columns = ("law", "time s", "mean m/s", "x optimum", "lateral m/s2", "breaks")
    rows = []
    for e in comparison.entries:
        numbers = (f"{e.duration_s:.2f}", f"{e.mean:.3f}", f"{e.ratio:.3f}", f"{e.peak_lateral:.3f}")
        rows.append((e.law, *numbers, ", ".join(e.broken) or "-"))
    text.table("laws on this path", columns, rows, right=columns[1:-1], bold=comparison.chosen, red="breaks")


def _print_reasons(profile: Profile, all_nodes: bool) -> None:
    """Print a row for each stretch that one cause limits, or for each node."""
    from lampyris.cli.verbs.speed_laws import runs

    columns = ("node", "s (m)", "v (m/s)", "t (s)", "limited by")
    rows = []
    for a, b in runs(profile, all_nodes):
        node = str(a) if a == b else f"{a}-{b}"
        numbers = (
            f"{x[a]:.3f}" if a == b else f"{x[a]:.3f} - {x[b]:.3f}" for x in (profile.s, profile.v, profile.t)
        )
        rows.append((node, *numbers, profile.why(a)))
    text.table("why", columns, rows, right=columns[:-1], whole=columns[:-1])
