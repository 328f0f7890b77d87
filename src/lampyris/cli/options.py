"""The options that several verbs share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lampyris._core.defaults import VIA_ORDERS
from lampyris._core.limits import MAX_CELLS
from lampyris.errors import UsageError


def _read_robot_file(ctx: typer.Context, path: str | None) -> str | None:
    """Take the values of a robot file as defaults of the robot's options."""
    if path is not None and not ctx.resilient_parsing:
        if not path:
            raise UsageError("FILE", "''", where="--robot", allowed="the name of a file")
        from lampyris.io.scenario.robot_file import read_robot

        ctx.default_map = {**(ctx.default_map or {}), **read_robot(path)}
    return path


def moves_name(value: str | None) -> str | None:
    """The name of a step set; ``four`` and ``sixteen`` stand for ``four-connected`` and ``sixteen-connected``."""
    return f"{value}-connected" if value in ("four", "sixteen") else value


Map = Annotated[str, typer.Argument(metavar="MAP", help="A map file, or the name of a bundled map.")]
Start = Annotated[
    str | None, typer.Option("--start", metavar="X,Y", help="Start cell: column,row from the top left.")
]
Goal = Annotated[str | None, typer.Option("--goal", metavar="X,Y", help="Goal cell.")]
StartM = Annotated[
    str | None,
    typer.Option(
        "--start-m",
        metavar="X,Y[,YAW]",
        help="Start in metres of the map frame; yaw in radians, counterclockwise, for planners of poses.",
    ),
]
GoalM = Annotated[
    str | None,
    typer.Option("--goal-m", metavar="X,Y[,YAW]", help="Goal in metres of the map frame, and its yaw."),
]
Via = Annotated[
    list[str] | None,
    typer.Option(
        "--via", metavar="X,Y", help="A cell to pass on the way to the goal; may be given several times."
    ),
]
ViaM = Annotated[
    list[str] | None,
    typer.Option("--via-m", metavar="X,Y", help="The same as --via, in metres of the map frame."),
]
ViaOrder = Annotated[
    str,
    typer.Option(
        "--via-order",
        metavar="|".join(VIA_ORDERS),
        help="Order of the via points: as given, or the one with the shortest path (exact up to 12 points).",
    ),
]
Planner = Annotated[
    str, typer.Option("--planner", metavar="NAME", help="Name of the planner: see `lampyris planners`.")
]
Preset = Annotated[
    str,
    typer.Option(
        "--preset",
        metavar="robot|dissertation",
        help="robot: octile moves, SI units. dissertation: its moves and speed law.",
    ),
]
Moves = Annotated[
    str | None,
    typer.Option(
        "--moves",
        metavar="dissertation|octile|four-connected|sixteen-connected",
        help="dissertation, octile, four-connected or sixteen-connected (default: the preset's).",
        callback=moves_name,
    ),
]
Law = Annotated[
    str | None,
    typer.Option("--law", metavar="NAME", help="The speed law: see `lampyris laws` (default: the preset's)."),
]
Set = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="A setting of the planner; repeatable."),
]
Seed = Annotated[
    int, typer.Option("--seed", metavar="N", help="Seed of all random draws: same seed, same bytes.")
]
Resolution = Annotated[
    float | None,
    typer.Option(
        "--resolution", metavar="M", help="Metres per cell, for maps that do not state it (default 1)."
    ),
]
RobotFile = Annotated[
    str | None,
    typer.Option(
        "--robot",
        metavar="FILE",
        is_eager=True,
        callback=_read_robot_file,
        help="YAML or JSON: radius, rectangle or footprint, drive, turn_radius and the other limits; options override it.",
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]
Picture = Annotated[
    Path | None, typer.Option("--picture", metavar="FILE", help="Draw the result (.png or .svg).")
]
Layer = Annotated[
    str,
    typer.Option(
        "--layer",
        metavar="luciferin|cost|none",
        help="The layer drawn under the path: luciferin, cost or none.",
    ),
]
Csv = Annotated[
    Path | None,
    typer.Option(
        "--csv", metavar="FILE", help="One row per node: x_m, y_m, yaw, v, t_s, s, a, cause, x, y, why."
    ),
]
Force = Annotated[bool, typer.Option("--force", help="Overwrite files that exist.")]
NoTiming = Annotated[
    bool, typer.Option("--no-timing", help="Omit timings, so that repeated calls print identical JSON.")
]
Bag = Annotated[
    Path | None,
    typer.Option("--bag", metavar="FILE", help="Write a ROS 2 bag (.mcap, .db3, or a folder)."),
]
Export = Annotated[
    Path | None,
    typer.Option("--export", metavar="FILE", help="Write the path as nav_msgs/Path (.json or .yaml)."),
]
Film = Annotated[Path | None, typer.Option("--film", metavar="FILE", help="Film the run (.webp or .gif).")]
Replay = Annotated[
    Path | None,
    typer.Option(
        "--replay",
        metavar="FILE",
        help="Write the run as an interactive page (.html) that opens without lampyris.",
    ),
]
GoalTrack = Annotated[
    Path | None,
    typer.Option(
        "--goal-track",
        metavar="FILE",
        help="Moving goal: a CSV with columns x,y, the cell of the goal at each tick.",
    ),
]
Explain = Annotated[
    bool, typer.Option("--explain", help="Print each iteration, as the dissertation's Tables 4.3 to 4.6.")
]
Save = Annotated[
    Path | None,
    typer.Option(
        "--save-scenario",
        metavar="FILE",
        help="Save this call as a scenario for `lampyris run` (.yaml, .json).",
    ),
]
Values = Annotated[
    str,
    typer.Option(
        "--values",
        metavar="occupancy|costmap",
        help="How grey levels and numbers in the map are read: occupancy or costmap.",
    ),
]
Colour = Annotated[
    str,
    typer.Option(
        "--colour",
        metavar="legend|luminance",
        help="Colours outside the legend: legend refuses them, luminance reads every colour as grey.",
    ),
]
AllowOutside = Annotated[
    bool, typer.Option("--allow-outside", help="Allow file names that point outside the file's own folder.")
]
MaxCells = Annotated[
    int | None,
    typer.Option(
        "--max-cells", metavar="N", min=1, max=MAX_CELLS, help="Refuse maps with more cells (default 2^24)."
    ),
]
SetLaw = Annotated[
    list[str] | None,
    typer.Option(
        "--set-law", metavar="KEY=VALUE", help="A setting of the law, such as blind.reach=5; repeatable."
    ),
]
SetController = Annotated[
    list[str] | None,
    typer.Option(
        "--set-controller",
        metavar="KEY=VALUE",
        help="A setting of the controller, such as lookahead_min=0.4; of one of several, mppi.samples=500; repeatable.",
    ),
]
Zones = Annotated[
    Path | None,
    typer.Option(
        "--zones",
        metavar="FILE",
        help="Speed zones: a Nav2 speed mask (.yaml), or m/s per cell (.npy, .csv).",
    ),
]
Keepout = Annotated[
    Path | None,
    typer.Option(
        "--keepout", metavar="FILE", help="Areas that the robot must not enter: a Nav2 keepout mask (.yaml)."
    ),
]
ObstacleRadius = Annotated[
    float, typer.Option("--obstacle-radius", metavar="M", help="Radius of the obstacles (0: one cell).")
]
ObstacleRectangle = Annotated[
    str | None,
    typer.Option(
        "--obstacle-rectangle",
        metavar="LENGTH,WIDTH",
        help="Length and width of the obstacles in metres, in place of --obstacle-radius.",
    ),
]
Track = Annotated[
    list[Path] | None,
    typer.Option(
        "--track",
        metavar="FILE",
        help="A recorded obstacle: a CSV with columns x,y, one row per tick, or t,x_m,y_m[,radius_m] (seconds, metres).",
    ),
]
Obstacles = Annotated[
    int,
    typer.Option(
        "--obstacles", metavar="N", help="Number of moving obstacles, in addition to those drawn in the map."
    ),
]
Mobility = Annotated[
    str,
    typer.Option(
        "--mobility",
        metavar="random-walk|patrol|crossing|mixed",
        help="random-walk, patrol, crossing, or mixed (a third of each).",
    ),
]
PlanLimit = Annotated[
    float | None,
    typer.Option(
        "--plan-limit",
        metavar="S",
        help="Time limit of each planner call, seconds; after it the robot waits.",
    ),
]
Rate = Annotated[
    float | None,
    typer.Option(
        "--rate",
        metavar="P",
        help="Probability per tick that another random walker appears (1: the dissertation's; default: all are there "
        "from the start).",
    ),
]
