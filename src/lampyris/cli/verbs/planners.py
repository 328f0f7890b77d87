"""``lampyris planners``: the planners, or one of them with its settings.

Heavy modules are imported when the verb runs, so that --help is instant.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lampyris.cli import text
from lampyris.cli.options import Json
from lampyris.cli.text import print_json

if TYPE_CHECKING:
    from lampyris.planning.registry import PlannerInfo


def planners(
    name: Annotated[
        str | None, typer.Argument(metavar="[NAME]", help="Describe this planner and all its settings.")
    ] = None,
    json_: Json = False,
) -> None:
    """List the planners: what each does and guarantees, and its source. With NAME: its settings and their meaning."""
    raise typer.Exit(show_planners(name, json_))


def show_planners(name: str | None, as_json: bool) -> int:
    """List the planners, or say all of one. Returns the exit code."""
    from lampyris.planning.registry import any_class, kind_of, list_planners, row_of

    if name is None:
        kinds: dict[str, Mapping[str, PlannerInfo[Any]]] = {
            "cells": list_planners(),
            "poses": list_planners("poses"),
            "fleets": list_planners("fleets"),
        }
        rows: list[PlannerInfo[Any]] = [row for found in kinds.values() for row in found.values()]
    else:
        rows = [row_of(name)]
    if as_json:
        records = [
            {
                "name": r.name,
                "kind": kind_of(r.name),
                "summary": r.summary,
                "source": r.source,
                "traits": asdict(r.traits),
                "settings": dict(r.settings),
            }
            for r in rows
        ]
        print_json({"planners": records} if name is None else records[0])
        return 0
    if name is None:
        for kind, found in kinds.items():
            print_planners(kind, list(found.values()))
        text.line("lampyris planners NAME says more of one: its settings, and what they mean.")
    else:
        print_planner(rows[0], _description(any_class(name)))
    return 0


def _description(kind: type) -> str:
    """The docstring of a planner's class, with the settings it inherits."""
    import inspect

    parts = [inspect.cleandoc(kind.__doc__ or "")]
    for base in kind.__mro__[1:]:
        doc = inspect.cleandoc(base.__dict__.get("__doc__") or "")
        settings = doc.partition("\nParameters\n----------\n")[2]
        if settings:
            parts.append(settings)
    # What follows the heading of errors is for readers of the code.
    own, *shared = (part.partition("\n\nRaises\n")[0] for part in parts)
    if not shared:
        return own
    return "\n".join((own, "\nSettings shared with others\n---------------------------", *shared))


_TITLES = {"cells": "planners", "poses": "planners of poses", "fleets": "planners of fleets"}


def print_planners(kind: str, rows: Sequence[PlannerInfo[Any]]) -> None:
    """Print the planners of a kind: a line or two each, with the source."""
    columns = ("name", "traits", "what it does, and its source")
    cells = [(r.name, ", ".join(_traits(r)) or "-", (r.summary, r.source)) for r in rows]
    text.table(_TITLES[kind], columns, cells, whole=("name",))


def print_planner(row: PlannerInfo[Any], description: str) -> None:
    """Print one planner: traits, settings with their defaults, and its own description."""
    settings = ", ".join(f"{k}={v}" for k, v in row.settings.items())
    rows = [
        ("traits", ", ".join(_traits(row)) or "none"),
        ("settings", settings or "none"),
        ("source", row.source),
    ]
    text.facts(row.name, rows)
    # ":class:`lampyris.planning.spacetime.sipp.Sipp`" is for readers of the code: here the name is enough.
    plain = re.sub(
        r":(?:(?:class|func|meth|attr):`(?:[\w.]*\.)?|mod:`)([\w.]+)`", r"\1", description.replace("``", "`")
    )
    print(plain)


def _traits(row: PlannerInfo[Any]) -> list[str]:
    """What a planner promises, in words."""
    words = [f.name.replace("_", " ") for f in fields(row.traits) if getattr(row.traits, f.name) is True]
    moves = getattr(row.traits, "moves", ())
    return words + [f"{name} moves" for name in moves if name != "four-connected"]
