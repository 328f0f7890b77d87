"""Verbs of other packages, found by the entry point group ``lampyris.verbs``.

An entry point names a function with typer's annotations, as the verbs of this package are written::

    [project.entry-points."lampyris.verbs"]
    weather = "lampyris_weather.command:weather"

The package that holds it is imported when its verb is asked for or listed; what the function needs besides
its options it imports itself when it runs.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any

import typer.main
from typer.core import TyperGroup
from typer.models import CommandInfo

from lampyris.cli.option_errors import Command
from lampyris.errors import InputError, UsageError

GROUP = "lampyris.verbs"
KNOWN: Mapping[str, str] = {"selfcheck": "lampyris-selfcheck"}
"""Verbs of packages that this project makes: distribution by verb."""


class VerbGroup(TyperGroup):
    """The verbs of this package, and those of other packages after them."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Names in the order of ``--help``; of a verb that cannot be used a note says why."""
        own = super().list_commands(ctx)
        usable = []
        for name in _entries():
            try:
                if name not in own and _command(name):
                    usable.append(name)
            except InputError as problem:
                print(f"note: {problem}", file=sys.stderr)
        return [*own, *usable]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The verb of that name; None if there is none.

        Raises
        ------
        UsageError : ``VERB_MISSING``: it is in a package that is not installed.
        InputError : ``VERB_BROKEN``: its package cannot be imported.
        """
        own = super().get_command(ctx, cmd_name)
        if own is not None or cmd_name in _entries():
            return own or _command(cmd_name)
        if cmd_name in KNOWN:
            raise UsageError(
                "VERB_MISSING",
                f"the verb {cmd_name} is in a package that is not installed",
                todo=f"pip install {KNOWN[cmd_name]}",
            )
        return None


@cache
def _entries() -> Mapping[str, EntryPoint]:
    return {e.name: e for e in sorted(entry_points(group=GROUP), key=lambda e: e.name)}


@cache
def _command(name: str) -> Any:
    entry = _entries()[name]
    try:
        function = entry.load()
        info = CommandInfo(name=name, cls=Command, callback=function)
        return typer.main.get_command_from_info(info, pretty_exceptions_short=True, rich_markup_mode=None)
    except Exception as fault:
        package = entry.dist.name if entry.dist is not None else entry.value
        raise InputError(
            "VERB_BROKEN",
            f"it cannot be used: {type(fault).__name__}: {fault}",
            where=f"verb {name} of the installed package {package}",
            todo="repair or uninstall that package",
        ) from fault
