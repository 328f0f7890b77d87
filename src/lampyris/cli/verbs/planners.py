"""``lampyris planners``: the planners, or one of them with its settings.

Heavy modules are imported when the verb runs, so that --help is instant.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

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
    from lampyris.planning.registry import list_planners, planner_class, row_of

    if name is None:
        rows = [*list_planners().values(), *list_planners(poses=True).values()]
    else:
        rows = [row_of(name)]
    if as_json:
        records = [
            {
                "name": r.name,
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
        print_planners(rows)
    else:
        print_planner(rows[0], _description(planner_class(name)))
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


def print_planners(rows: Sequence[PlannerInfo]) -> None:
    """Print the planners: a line or two each, with the source."""
    columns = ("name", "traits", "what it does, and its source")
    cells = [(r.name, ", ".join(_traits(r)) or "-", (r.summary, r.source)) for r in rows]
    text.table("planners", columns, cells, whole=("name",))
    text.line("lampyris planners NAME says more of one: its settings, and what they mean.")


def print_planner(row: PlannerInfo, description: str) -> None:
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


def _traits(row: PlannerInfo) -> list[str]:
    words = ("optimal", "incremental", "stochastic", "sees_traffic", "plans_headings")
    return [word.replace("_", " ") for word in words if getattr(row.traits, word)]
