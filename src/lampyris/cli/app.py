"""The command line as a tree of verbs; a verb is imported when it is called, and what it needs when it runs."""

from __future__ import annotations

from typing import Annotated

import typer

from lampyris import __version__
from lampyris.cli.verb_group import VerbGroup

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


def plain_help() -> dict[str, int]:
    """Have ``--help`` without colour, boxes and line breaks; what click's context takes for that."""
    app.rich_markup_mode = None
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
