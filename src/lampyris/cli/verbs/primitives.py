"""``lampyris primitives``: motion primitives of a robot into a file, or what a file of them holds.

Heavy modules are imported when the verb runs, so that --help is instant.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lampyris.cli import text
from lampyris.cli.option_groups import RobotOptions, settings_in
from lampyris.cli.options import Force, Json
from lampyris.cli.outputs import check_outputs, print_written
from lampyris.cli.text import print_json
from lampyris.errors import FileError, UsageError

if TYPE_CHECKING:
    from lampyris.model.lattice.motion_primitives import MotionPrimitives


def primitives(
    robot_options: RobotOptions,
    file: Annotated[
        str | None,
        typer.Argument(metavar="[FILE]", help="Show this file of primitives, or convert it with --out."),
    ] = None,
    resolution: Annotated[
        float | None, typer.Option("--resolution", metavar="M", help="Metres per cell of the map.")
    ] = None,
    headings: Annotated[int, typer.Option("--headings", metavar="16|32", help="Number of headings.")] = 16,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            metavar="FILE",
            help=".json: as Nav2's Smac planner reads it; .mprim: as SBPL does.",
        ),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option("--picture", metavar="FILE", help="Draw all motions (.png, .svg).")
    ] = None,
    json_: Json = False,
    force: Force = False,
) -> None:
    """Write the motion primitives of the planner `lattice` for a robot; or show, check and convert a file of them."""
    check_outputs(force, picture=picture, primitives=out)
    from lampyris.model.robot import Robot

    robot = Robot(**settings_in(robot_options, Robot))
    if file is None:
        if resolution is None:
            raise UsageError("OPTIONS", "no --resolution", allowed="metres per cell of the map")
        from lampyris.planning.lattice.generate import motion_primitives

        # SBPL lists motions in reverse; Nav2 derives them from the others.
        reverse = out is not None and out.suffix.lower() == ".mprim" and robot.drive != "omnidirectional"
        made = motion_primitives(robot, resolution, headings=headings, reverse=reverse)
    else:
        from lampyris.io.primitives.load import load_primitives

        made = load_primitives(file)
    if out is not None:
        from lampyris.io.primitives.write import save_primitives

        save_primitives(made, out, drive=robot.drive)
    if picture is not None:
        from lampyris.report.charts.primitives_chart import draw_primitives

        draw_primitives(made, picture)
    record = _record(made, file)
    if json_:
        print_json(record)
        return
    _print(record)
    print_written(out, picture)


def _record(made: MotionPrimitives, file: str | None) -> dict[str, Any]:
    from lampyris.model.robot import DRIVES
    from lampyris.planning.lattice.sampled import sampled

    drives: dict[str, str | None] = {}
    for drive in DRIVES:
        try:
            list(sampled(made, drive, made.turn_radius / made.resolution, True))
            drives[drive] = None
        except FileError as fault:
            drives[drive] = f"{fault.where.rpartition(': ')[2]}: {fault.what}"
    counts = [sum(one.start == k for one in made.motions) for k in range(len(made.headings))]
    return {
        "file": file,
        "resolution": made.resolution,
        "headings": list(made.headings),
        "primitives": len(made.motions),
        "primitives_per_heading": counts,
        "turn_radius": made.turn_radius,
        "reverse_from_opposite_heading": made.opposite,
        "drives": drives,
    }


def _print(record: dict[str, Any]) -> None:
    counts = record["primitives_per_heading"]
    spread = f"{min(counts)} to {max(counts)}" if min(counts) != max(counts) else f"{counts[0]}"
    radius = f"{record['turn_radius']:g} m" if record["turn_radius"] else "not stated"
    rows = [
        ("resolution", f"{record['resolution']:g} m a cell"),
        ("primitives", f"{record['primitives']}, {spread} at each of {len(counts)} headings"),
        ("turning radius", radius),
        (
            "in reverse",
            "each motion, from the opposite heading"
            if record["reverse_from_opposite_heading"]
            else "as listed",
        ),
    ]
    rows += [
        (drive, "can drive all" if why is None else f"no: {why}") for drive, why in record["drives"].items()
    ]
    text.facts(record["file"] or "motion primitives", rows)
