"""The tree of verbs. Heavy modules are imported when a verb runs, so that --help is instant."""

from __future__ import annotations

from typing import Annotated

import typer

from lampyris import __version__
from lampyris.cli.installed_verbs import VerbGroup
from lampyris.cli.option_errors import Command
from lampyris.cli.option_groups import with_groups
from lampyris.cli.verbs import app as app_command
from lampyris.cli.verbs import (
    fleet,
    laws,
    maps,
    movingai,
    plan,
    planners,
    primitives,
    reproduce,
    run,
    schema,
    simulate,
    speed,
    warm,
)
from lampyris.cli.verbs.compare import command as compare
from lampyris.cli.verbs.drive import command as drive
from lampyris.cli.verbs.study import commands as study
from lampyris.cli.verbs.swarm import command as swarm

app = typer.Typer(
    name="lampyris",
    cls=VerbGroup,
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
    help="Plan paths on grid maps, compute velocity profiles, and simulate a robot among moving obstacles.",
    epilog="Exit codes: 0 done, 2 wrong arguments, 3 a bad file, 4 no path or not arrived, "
    "5 limit, 6 internal fault or violated guarantee, 130 Ctrl-C.",
)


app.add_typer(maps.app, name="maps")
app.add_typer(study.app, name="study")


def plain_help() -> dict[str, int]:
    """Have ``--help`` without colour, boxes and line breaks; what click's context takes for that."""
    for each in (app, maps.app, study.app):
        each.rich_markup_mode = None
    return {"terminal_width": 10_000}


def _version(value: bool) -> None:
    if value:
        typer.echo(f"lampyris {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    pass


for verb in (
    plan.plan, simulate.simulate, run.run, schema.schema, planners.planners, primitives.primitives, movingai.movingai,
    fleet.fleet, swarm.swarm, speed.speed, laws.laws, drive.drive, compare.compare, reproduce.reproduce, app_command.app,
    warm.warm,
):  # fmt: skip
    app.command(cls=Command)(with_groups(verb))
