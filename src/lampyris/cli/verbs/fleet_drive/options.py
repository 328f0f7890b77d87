"""The options of ``lampyris fleet`` that have a fleet drive."""

from __future__ import annotations

from dataclasses import field, fields, make_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import typer

from lampyris._core.settings import defaults_of, meanings_of, settings_of
from lampyris.cli.option_groups import option_of
from lampyris.errors import UsageError
from lampyris.model.fleet.delays import Delays
from lampyris.model.robot import Robot, disc
from lampyris.model.settings.fleet_drive import FleetDriveSettings
from lampyris.model.settings.simulation import MAX_TICKS

_ROBOT = ("radius", "v_max", "a_max", "d_max", "drive", "yaw_rate_max")
_DRIVE = ("policy", "obstacles", "obstacle_radius", "obstacle_speed", "obstacle_info", "drive_limit")
_WORDS = {"drive": "differential turns in place at corners, omnidirectional need not"}


def _declared(kind: type, names: tuple[str, ...], default: str) -> list[tuple[str, Any, Any]]:
    """Options for settings; None where they are not given."""
    meanings, settings, values = meanings_of(kind), settings_of(kind), defaults_of(kind)
    made = []
    for name in names:
        option = option_of(name, settings[name], _WORDS.get(name, meanings[name]))
        kind_of, typed = option.__origin__, option.__metadata__[0]
        usual = settings[name].none or f"{values[name]}"
        if default or "(default" not in typed.help:
            typed.help = (
                f"{typed.help.partition(' (default')[0].removesuffix('.')} (default: {default or usual})."
            )
        made.append((name, Annotated[kind_of | None, typed], field(default=None)))
    return made


_OWN: list[tuple[str, Any, Any]] = [
    (
        "execute",
        Annotated[
            bool,
            typer.Option(
                "--execute", help="Drive the plan in continuous time: robots keep its order of visits, and never touch."
            ),
        ],
        field(default=False),
    ),
    (
        "delays",
        Annotated[
            float | None,
            typer.Option("--delays", metavar="P", help="Probability that a move is delayed: the robot brakes and stands."),
        ],
        field(default=None),
    ),
    (
        "delay_duration",
        Annotated[
            float | None,
            typer.Option("--delay-duration", metavar="S", help="Mean duration of a delay (default: 3.0)."),
        ],
        field(default=None),
    ),
    (
        "fault",
        Annotated[
            list[str] | None,
            typer.Option(
                "--fault", metavar="ROBOT@TIME",
                help="Robot (from 0) that fails at a second, or at a tick of --lifelong; repeatable.",
            ),
        ],
        field(default=None),
    ),
    (
        "lifelong",
        Annotated[
            int | None,
            typer.Option(
                "--lifelong", metavar="TICKS", min=1, max=MAX_TICKS,
                help="Robots that have arrived get new tasks, for so many ticks (planners pibt, the default, and lacam).",
            ),
        ],
        field(default=None),
    ),
    (
        "window",
        Annotated[
            int | None,
            typer.Option(
                "--window", metavar="TICKS",
                help="Ticks driven before planning again (default: 1 with pibt, 5 with lacam).",
            ),
        ],
        field(default=None),
    ),
    (
        "tasks",
        Annotated[
            Path | None,
            typer.Option(
                "--tasks", metavar="FILE",
                help="Tasks of --lifelong (.csv): release, x, y, or release and pickup_x, pickup_y, delivery_x, delivery_y; "
                "default: random cells.",
            ),
        ],
        field(default=None),
    ),
]  # fmt: skip

if TYPE_CHECKING:
    from lampyris.io.fleet_scenario.scenario import FleetExecution, Lifelong
    from lampyris.model.fleet.lifelong import FleetTask
    from lampyris.model.grid import Grid

    FleetDriveOptions: TypeAlias = Any
else:
    FleetDriveOptions = make_dataclass(
        "FleetDriveOptions",
        [
            *_OWN,
            *_declared(FleetDriveSettings, _DRIVE, ""),
            *_declared(
                Robot, _ROBOT[:1], "fits in a cell; with --execute 0.35 of a cell, 0.22 for octile plans"
            ),
            *_declared(Robot, _ROBOT[1:], ""),
        ],
        frozen=True,
    )

_TASKS = ("window", "tasks")
_BOTH = ("fault",)


def check_options(given: FleetDriveOptions, robot_file: Path | None = None) -> None:
    """Refuse options that do not go together.

    Parameters
    ----------
    robot_file : of ``--robot``.

    Raises
    ------
    UsageError : ``OPTIONS``.
    """
    if given.execute and given.lifelong is not None:
        raise UsageError("OPTIONS", "--execute and --lifelong both given", allowed="one of them")
    for name in (
        "delays",
        "delay_duration",
        "fault",
        "obstacles",
        "obstacle_radius",
        "obstacle_speed",
        "obstacle_info",
    ):
        if given.policy == "orca" and getattr(given, name) not in (None, []):
            what = f"--{name.replace('_', '-')} with --policy orca"
            raise UsageError("OPTIONS", what, allowed="with --policy order")
    for name in ("obstacle_radius", "obstacle_speed", "obstacle_info"):
        if getattr(given, name) is not None and not given.obstacles and given.execute:
            raise UsageError(
                "OPTIONS", f"--{name.replace('_', '-')} without --obstacles", allowed="with --obstacles"
            )
    for option, there in (("--radius", given.radius is not None), ("--robot", robot_file is not None)):
        if there and given.lifelong is not None:
            what = f"{option} with --lifelong: its robots fit in their cells"
            raise UsageError("OPTIONS", what, allowed=f"without {option}")
    for one in fields(given):
        name = one.name
        if name in ("execute", "lifelong", "radius") or getattr(given, name) in (None, []):
            continue
        wanted = "--lifelong" if name in _TASKS else "--execute"
        there = given.lifelong is not None if name in _TASKS else given.execute
        if name in _BOTH:
            there, wanted = given.execute or given.lifelong is not None, "--execute or --lifelong"
        if not there:
            raise UsageError(
                "OPTIONS", f"--{name.replace('_', '-')} without {wanted}", allowed=f"with {wanted}"
            )


def drive_settings(given: FleetDriveOptions) -> dict[str, Any]:
    """The settings of the drive that were given, by name."""
    return {name: getattr(given, name) for name in _DRIVE if getattr(given, name) is not None}


def robot_of(
    given: FleetDriveOptions, robot_file: Path | None, resolution: float, moves: str
) -> Robot | None:
    """The robot that was described, for a plan with these moves; None: none was.

    Raises
    ------
    FileError : what is wrong with the file of ``--robot``.
    """
    own: dict[str, Any] = {}
    if robot_file is not None:
        from lampyris.io.scenario.robot_file import read_robot

        own |= read_robot(robot_file)
    own |= {name: getattr(given, name) for name in _ROBOT if getattr(given, name) is not None}
    if given.radius is not None:
        own.pop("footprint", None)
    if not own:
        return None
    if given.execute and "footprint" not in own:
        from lampyris.fleet_drives import RADIUS

        own = {"radius": RADIUS[moves] * resolution, **own}
    made = Robot(**own)
    return disc(made, made.radius)


def execution_of(given: FleetDriveOptions) -> FleetExecution | None:
    """How the robots drive in continuous time; None: they do not."""
    from lampyris.io.fleet_scenario.scenario import FleetExecution

    return FleetExecution(drive_settings(given), delays_of(given)) if given.execute else None


def lifelong_of(given: FleetDriveOptions, tasks: tuple[FleetTask, ...] | None) -> Lifelong | None:
    """That the robots get new tasks; None: they do not."""
    from lampyris.io.fleet_scenario.scenario import Lifelong

    return None if given.lifelong is None else Lifelong(given.lifelong, given.window, tasks)


def tasks_of(given: FleetDriveOptions, grid: Grid, coarse: Grid) -> tuple[FleetTask, ...] | None:
    """The tasks of ``--tasks`` on the fleet's map, which may have larger cells; None: there is no such file."""
    if given.tasks is None:
        return None
    from lampyris.io.maps.coarse import coarse_tasks
    from lampyris.lifelong import load_tasks

    listed = load_tasks(given.tasks, grid)
    return listed if coarse is grid else coarse_tasks(listed, grid, coarse)


def delays_of(given: FleetDriveOptions) -> Delays:
    """The delays that were described."""
    own = {"probability": given.delays, "duration": given.delay_duration}
    if given.delays is None and given.delay_duration is not None:
        raise UsageError("OPTIONS", "--delay-duration without --delays", allowed="with --delays")
    return Delays(**{name: value for name, value in own.items() if value is not None})


def faults_of(given: FleetDriveOptions) -> list[tuple[int, float]]:
    """Robots that stop permanently, and when.

    Raises
    ------
    UsageError : ``FAULTS``: no ROBOT@TIME.
    """
    found = []
    for text in given.fault or ():
        robot, _, time = text.partition("@")
        try:
            found.append((int(robot), float(time)))
        except ValueError:
            raise UsageError(
                "FAULTS", repr(text)[:40], where="--fault", allowed="ROBOT@TIME, such as 3@20"
            ) from None
    return found
