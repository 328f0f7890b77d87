"""Verbs of other packages, found by the entry point group ``lampyris.verbs``.

An entry point names a function with typer's annotations, as the verbs of this package are written::

    [project.entry-points."lampyris.verbs"]
    weather = "lampyris_weather.command:weather"

The package that holds it is imported when its verb is asked for or listed; what the function needs besides
its options it imports itself when it runs.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

import typer.main
from typer.models import CommandInfo

from lampyris.cli.option_errors import Command
from lampyris.errors import InputError, UsageError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

GROUP = "lampyris.verbs"
KNOWN: Mapping[str, str] = {"selfcheck": "lampyris-selfcheck"}
"""Verbs of packages that this project makes: distribution by verb."""


def names() -> tuple[str, ...]:
    """Names of the verbs of other packages that are installed."""
    return tuple(_entries())


def command(name: str) -> Any:
    """The verb of that name; None if there is none.

    Raises
    ------
    UsageError : ``VERB_MISSING``: it is in a package that is not installed.
    InputError : ``VERB_BROKEN``: its package cannot be imported.
    """
    if name in _entries():
        return _command(name)
    if name in KNOWN:
        raise UsageError(
            "VERB_MISSING",
            f"the verb {name} is in a package that is not installed",
            todo=f"pip install {KNOWN[name]}",
        )
    return None


@cache
def _entries() -> Mapping[str, EntryPoint]:
    from importlib.metadata import entry_points  # imports the email package

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
