"""The group of all verbs: each is imported and built when it is asked for.

A call needs one verb. Importing and building the others took a fifth of the time of a small plan.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from pkgutil import resolve_name
from typing import Any

import typer
import typer.main
from typer.core import TyperCommand, TyperGroup
from typer.models import CommandInfo, TyperInfo

from lampyris.cli import installed_verbs
from lampyris.cli.option_errors import Command
from lampyris.cli.option_groups import with_groups
from lampyris.errors import InputError

VERBS: Mapping[str, str] = {
    "plan": "plan:plan",
    "simulate": "simulate:simulate",
    "run": "run:run",
    "schema": "schema:schema",
    "planners": "planners:planners",
    "primitives": "primitives:primitives",
    "movingai": "movingai:movingai",
    "fleet": "fleet:fleet",
    "swarm": "swarm.command:swarm",
    "chain": "chain.command:chain",
    "speed": "speed:speed",
    "laws": "laws:laws",
    "uncertain": "uncertain.command:uncertain",
    "drive": "drive.command:drive",
    "compare": "compare.command:compare",
    "reproduce": "reproduce:reproduce",
    "app": "app:app",
    "warm": "warm:warm",
    "maps": "maps.command:app",
    "bag": "ros.bag:bag",
    "ros": "ros.node:ros",
    "study": "study.commands:app",
    "tune": "tune:tune",
}
"""Module of ``lampyris.cli.verbs`` and the function or the Typer in it, by verb, in the order of ``--help``."""


class VerbGroup(TyperGroup):
    """The verbs of this package, and those of other packages after them."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self.commands: Any = _Verbs(self.rich_markup_mode)

    def list_commands(self, ctx: Any) -> list[str]:
        """Names in the order of ``--help``; of a verb that cannot be used a note says why."""
        usable = []
        for name in installed_verbs.names():
            try:
                if name not in VERBS and installed_verbs.command(name):
                    usable.append(name)
            except InputError as problem:
                print(f"note: {problem}", file=sys.stderr)
        return [*VERBS, *usable]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The verb of that name; None if there is none.

        Raises
        ------
        UsageError : ``VERB_MISSING``: it is in a package that is not installed.
        InputError : ``VERB_BROKEN``: its package cannot be imported.
        """
        return self.commands.get(cmd_name) or installed_verbs.command(cmd_name)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write names and summaries; the options of the verbs are not built for that."""
        names = self.list_commands(ctx)
        commands = {
            name: TyperCommand(name, help=_summary(name)) if name in VERBS else self.get_command(ctx, name)
            for name in names
        }
        TyperGroup(name=self.name, commands=commands).format_commands(ctx, formatter)


class _Verbs(Mapping[str, Any]):
    """The verbs of this package by name, built when they are read."""

    def __init__(self, rich_markup_mode: Any) -> None:
        self._markup = rich_markup_mode
        self._built: dict[str, Any] = {}

    def __getitem__(self, name: str) -> Any:
        if name not in self._built:
            self._built[name] = self._build(name)
        return self._built[name]

    def __iter__(self) -> Iterator[str]:
        return iter(VERBS)

    def __len__(self) -> int:
        return len(VERBS)

    def __contains__(self, name: object) -> bool:
        return name in VERBS

    def _build(self, name: str) -> Any:
        verb = _verb(name)
        if isinstance(verb, typer.Typer):
            return typer.main.get_group_from_info(
                TyperInfo(verb, name=name),
                pretty_exceptions_short=True,
                suggest_commands=True,
                rich_markup_mode=self._markup,
            )
        info = CommandInfo(name=name, cls=Command, callback=with_groups(verb))
        return typer.main.get_command_from_info(
            info, pretty_exceptions_short=True, rich_markup_mode=self._markup
        )


def _verb(name: str) -> Any:
    """The function of a verb, or its Typer."""
    return resolve_name(f"lampyris.cli.verbs.{VERBS[name]}")


def _summary(name: str) -> str:
    verb = _verb(name)
    return str(verb.info.help if isinstance(verb, typer.Typer) else verb.__doc__)
