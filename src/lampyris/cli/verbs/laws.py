"""``lampyris laws``: the speed laws, or one of them with its settings.

Heavy modules are imported when the verb runs, so that --help is instant.
"""

from __future__ import annotations

from typing import Annotated, Any

import typer

from lampyris.cli import text
from lampyris.cli.option_errors import check_choice
from lampyris.cli.options import Json
from lampyris.cli.text import print_json


def laws(
    name: Annotated[
        str | None, typer.Argument(metavar="[NAME]", help="Describe this law and all its settings.")
    ] = None,
    json_: Json = False,
) -> None:
    """List the speed laws: what each does, and its source. With NAME: its settings."""
    raise typer.Exit(show_laws(name, json_))


def show_laws(name: str | None, as_json: bool) -> int:
    """List the laws, or say all of one. Returns the exit code."""
    from lampyris.motion.laws import registry

    if name is not None:
        check_choice("LAW", "NAME", name, registry.LAWS)
    rows = [row for key, row in registry.LAWS.items() if name in (None, key)]
    records = [
        {
            "name": row.name,
            "units": row.units,
            "summary": row.summary,
            "source": row.source,
            "settings": registry.settings_of(row.name),
            "rules": registry.rules_of(row.name),
        }
        for row in rows
    ]
    if as_json:
        print_json({"laws": records} if name is None else records[0])
    else:
        print_laws(records, alone=name is not None)
    return 0


def print_laws(records: list[dict[str, Any]], *, alone: bool) -> None:
    """Print the speed laws; one alone with its settings."""
    if alone:
        row = records[0]
        lines = [_setting(row, key, value) for key, value in row["settings"].items()]
        settings = "\n".join(lines) or "none"
        facts = [("what it does", row["summary"]), ("source", row["source"]), ("units", row["units"])]
        text.facts(row["name"], [*facts, ("settings", settings)])
        return
    rows = [(row["name"], (row["summary"], row["source"])) for row in records]
    text.table("speed laws", ("name", "what it does, and its source"), rows, whole=("name",))
    text.line("lampyris laws NAME shows the settings of one; --set-law KEY=VALUE changes them.")


def _setting(row: dict[str, Any], key: str, value: object) -> str:
    """A setting and its value; a rule that is off with the names that turn it on."""
    rule = row["rules"].get(key)
    if rule is None or value is not None:
        return f"{key} = {value}"
    own = ", ".join(f"{name} = {default}" for name, default in rule.items())
    return f"{key} = off; on, or any of: {own}"
