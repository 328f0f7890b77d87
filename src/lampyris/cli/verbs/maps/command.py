"""``lampyris maps``: the bundled maps, map files, new maps from recipes, and from one format to another.

``lampyris maps`` lists, ``lampyris maps NAME`` shows one map, bundled or a file, and a first word that is an
action does that.
Heavy modules are imported when the verb runs, so that --help is instant.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from lampyris._core import defaults
from lampyris._core.limits import MAX_CELLS
from lampyris.cli import text
from lampyris.cli.option_errors import Command
from lampyris.cli.option_groups import with_groups
from lampyris.cli.outputs import check_outputs
from lampyris.cli.text import print_json, print_notes
from lampyris.cli.verbs.maps.segment import segment
from lampyris.errors import FileError, UsageError, did_you_mean

if TYPE_CHECKING:
    from lampyris.io.maps.convert import Conversion
    from lampyris.io.maps.formats.document import MapDocument
    from lampyris.io.maps.library import MapInfo
    from lampyris.io.maps.recipes.recipe import Recipe


class _NameOrAction(TyperGroup):
    """A first word that is no action is the name of a map, or a file."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """``maps NAME`` is ``maps show NAME``."""
        # Typer has its own click in new releases and the installed one in old ones: no type names both.
        if args and args[0] not in self.commands and not args[0].startswith("-"):
            args = ["show", *args]
        return super().resolve_command(ctx, args)


app = typer.Typer(
    cls=_NameOrAction,
    invoke_without_command=True,
    subcommand_metavar="[NAME | FILE | ACTION ...]",
    help="List the bundled maps, show a map, make new ones, convert files, make maps from photographs.",
)

Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]
Force = Annotated[bool, typer.Option("--force", help="Overwrite files that exist.")]
Resolution = Annotated[
    float | None,
    typer.Option(
        "--resolution", metavar="M", help="Metres per cell, for maps that do not state it (default 1)."
    ),
]
Values = Annotated[
    str,
    typer.Option(
        "--values",
        metavar="occupancy|costmap",
        help="What the map's grey samples and numbers are: occupancy or costmap.",
    ),
]
ToValues = Annotated[
    str | None,
    typer.Option(
        "--to-values",
        help="What the numbers of the new file mean: occupancy or costmap (default: occupancy, but costmap for a "
        ".csv of a map with terrain).",
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
MaxCells = Annotated[
    int | None,
    typer.Option(
        "--max-cells", metavar="N", min=1, max=MAX_CELLS, help="Refuse maps with more cells (default 2^24)."
    ),
]
AllowOutside = Annotated[
    bool, typer.Option("--allow-outside", help="Allow a ROS map to name an image outside its own folder.")
]
Strict = Annotated[
    bool, typer.Option("--strict", help="Refuse doubtful values in a ROS map instead of printing a note.")
]


@app.callback()
def _maps(context: typer.Context, json_: Json = False) -> None:
    if context.invoked_subcommand is None:
        _list(json_)
        raise typer.Exit
    context.obj = json_


app.command(cls=Command)(with_groups(segment))


def _list(as_json: bool) -> None:
    """List the bundled maps."""
    from lampyris.io.maps import library

    rows = [library.describe(name) for name in library.names()]
    if as_json:
        print_json({"maps": [asdict(row) for row in rows]})
    else:
        print_maps(rows)


def _show_bundled(name: str, as_json: bool) -> None:
    """Show a bundled map and its stored queries."""
    from lampyris.io.maps import library

    row = library.describe(name)
    if as_json:
        print_json(asdict(row))
    else:
        print_map(row)


@app.command(cls=Command)
def show(
    context: typer.Context,
    name: Annotated[
        str, typer.Argument(metavar="NAME", help="The name of a bundled map (./NAME for a file), or a file.")
    ],
    values: Values = defaults.VALUES,
    colour: Colour = defaults.COLOUR,
    resolution: Resolution = None,
    max_cells: MaxCells = None,
    allow_outside: AllowOutside = False,
    strict: Strict = False,
    json_: Json = False,
) -> None:
    """Show a bundled map and its stored queries, or the contents of a map file."""
    import os

    from lampyris.io.maps import library
    from lampyris.io.maps.load import load_map

    as_json = json_ or bool(context.obj)
    if name in library.names():
        _show_bundled(name, as_json)
        raise typer.Exit
    if not os.path.lexists(name):
        # A mistyped action ends here as well.
        raise FileError(
            "FILE_MISSING",
            "neither a file nor a bundled map",
            where=name if name.isprintable() and 0 < len(name) <= 200 else repr(name[:200]),
            allowed="a map file, or a name that `lampyris maps` lists",
            todo=did_you_mean(name, (*library.names(), "recipes", "make", "convert", "segment")),
        )
    document = load_map(
        Path(name),
        values=values,
        colour=colour,
        resolution=resolution,
        max_cells=MAX_CELLS if max_cells is None else max_cells,
        allow_outside=allow_outside,
        strict=strict,
    )
    _describe(name, document, as_json)


def _describe(name: str, document: MapDocument, as_json: bool) -> None:
    """Print what a map file holds."""
    import numpy as np

    from lampyris.io.maps.map_hash import map_hash

    grid = document.grid
    terrain = None
    if grid.terrain is not None:
        used = grid.terrain[grid.terrain > 0]
        terrain = {"cells": int(used.size), "lowest": int(used.min()), "highest": int(used.max())}
    record: dict[str, Any] = {
        "file": name,
        "format": document.format,
        "width": grid.width,
        "height": grid.height,
        "free": 1.0 - int(np.count_nonzero(grid.blocked)) / grid.blocked.size,
        "unknown": 0 if grid.unknown is None else int(np.count_nonzero(grid.unknown)),
        "terrain": terrain,
        "resolution": grid.resolution,
        "origin": list(grid.origin),
        "start": document.start,
        "goal": document.goal,
        "moving_obstacles": len(document.obstacle_cells),
        "hash": map_hash(grid),
        "notes": list(document.notes),
    }
    if as_json:
        print_json(record)
    else:
        _print_facts(record)


def _print_facts(record: dict[str, Any]) -> None:
    from lampyris.errors import plural

    width, height, metres = record["width"], record["height"], record["resolution"]
    x, y, yaw = record["origin"]
    rows = [
        ("format", record["format"]),
        ("size", f"{width} x {height} cells of {metres:g} m: {width * metres:g} m x {height * metres:g} m"),
        ("free", f"{record['free']:.1%}"),
        ("unknown", plural(record["unknown"], "cell") if record["unknown"] else "none"),
    ]
    if terrain := record["terrain"]:
        rows.append(
            ("terrain", f"{plural(terrain['cells'], 'cell')}, {terrain['lowest']} to {terrain['highest']}")
        )
    if (x, y, yaw) != (0, 0, 0):
        rows.append(("origin", f"({x:g}, {y:g}) m, turned by {yaw:g} rad"))
    rows += [(what, f"{record[what]}") for what in ("start", "goal") if record[what] is not None]
    if record["moving_obstacles"]:
        rows.append(("moving", f"{record['moving_obstacles']:,} obstacles drawn"))
    rows.append(("hash", record["hash"]))
    rows += [("note", note) for note in record["notes"]]
    text.facts(record["file"], rows)


@app.command(cls=Command)
def recipes(context: typer.Context, json_: Json = False) -> None:
    """List the recipes and their settings, with defaults and ranges."""
    from lampyris.io.maps.recipes.make import RECIPES

    if not (json_ or context.obj):
        print_recipes(list(RECIPES.values()))
        return
    print_json(
        {
            "recipes": [
                {
                    "name": r.name,
                    "summary": r.summary,
                    "connected": r.connected,
                    "settings": [
                        {"name": s.name, "default": s.default, "allowed": s.range, "what": s.what}
                        for s in r.table
                    ],
                }
                for r in RECIPES.values()
            ]
        }
    )


@app.command(cls=Command)
def make(
    context: typer.Context,
    recipe: Annotated[str, typer.Argument(metavar="RECIPE", help="See `lampyris maps recipes`.")],
    out: Annotated[
        Path, typer.Option("--out", "-o", metavar="FILE", help="The map (its extension selects the format).")
    ],
    size: Annotated[str, typer.Option("--size", metavar="W,H", help="Columns and rows.")] = "50,50",
    seed: Annotated[int, typer.Option("--seed", metavar="N", help="Same seed, same cells.")] = 0,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set", metavar="KEY=VALUE", help="A setting of the recipe; may be given several times."
        ),
    ] = None,
    resolution: Resolution = None,
    to_values: ToValues = None,
    force: Force = False,
    json_: Json = False,
) -> None:
    """Make a new map from a recipe and a seed."""
    from lampyris.io.maps.convert import files_of, write_and_compare
    from lampyris.io.maps.formats.document import MapDocument
    from lampyris.io.maps.recipes.make import make_ground, recipe_named
    from lampyris.model.grid import Grid

    row = recipe_named(recipe)
    given = {key: row.setting(key).read(value) for key, value in map(_key_value, settings or [])}
    width, height = _size(size)
    check_outputs(force, *files_of(out))
    made_of = make_ground(recipe, width, height, seed, **given)
    grid = Grid(
        made_of.blocked,
        resolution=1.0 if resolution is None else resolution,
        name=out.name,
        terrain=made_of.terrain,
    )
    made = write_and_compare(MapDocument(grid), out, values=to_values)
    _print_result(made, json_ or bool(context.obj), recipe=recipe, seed=seed, settings=row.complete(given))


@app.command(cls=Command)
def convert(
    context: typer.Context,
    source: Annotated[str, typer.Argument(metavar="IN", help="A map file, or the name of a bundled map.")],
    target: Annotated[
        Path, typer.Argument(metavar="OUT", help="The new file; its extension selects the format.")
    ],
    values: Values = defaults.VALUES,
    to_values: ToValues = None,
    colour: Colour = defaults.COLOUR,
    scen: Annotated[
        bool, typer.Option("--scen", help="Also write the map's stored queries next to a .map, as OUT.scen.")
    ] = False,
    resolution: Resolution = None,
    max_cells: MaxCells = None,
    allow_outside: AllowOutside = False,
    strict: Strict = False,
    force: Force = False,
    json_: Json = False,
) -> None:
    """Convert a map to another format, and report what that format cannot hold.

    --values says what the numbers of IN are, --to-values what those of OUT shall be. A costmap stays one with
    both: --values costmap --to-values costmap.
    """
    from lampyris.io.maps.convert import convert as convert_map
    from lampyris.io.maps.convert import files_of

    check_outputs(force, *files_of(target, scen=scen))
    made = convert_map(
        source,
        target,
        resolution=resolution,
        values=values,
        to_values=to_values,
        colour=colour,
        max_cells=MAX_CELLS if max_cells is None else max_cells,
        allow_outside=allow_outside,
        strict=strict,
        scen=scen,
    )
    _print_result(made, json_ or bool(context.obj))


def _print_result(made: Conversion, as_json: bool, **more: Any) -> None:
    """Print what was written, and what was not."""
    import numpy as np

    grid = made.document.grid
    free = 1.0 - int(np.count_nonzero(grid.blocked)) / grid.blocked.size
    if as_json:
        record = {
            "files": [str(f) for f in made.files],
            "format": made.document.format,
            "width": grid.width,
            "height": grid.height,
            "free": free,
            "hash": made.hash,
            "lost": list(made.lost),
            "notes": list(made.notes),
        }
        print_json({**more, **record})
        return
    print_notes(made.notes)
    print_notes(made.lost)
    files = ", ".join(str(f) for f in made.files)
    typer.echo(f"wrote {files}: {grid.width} x {grid.height} cells, {free:.1%} free, hash {made.hash[:16]}")


def _key_value(word: str) -> tuple[str, str]:
    key, equals, value = word.partition("=")
    if not equals or not key.strip():
        raise UsageError("SET", f"{word!r}", where="--set", allowed="KEY=VALUE")
    return key.strip().replace("-", "_"), value.strip()


def _size(word: str) -> tuple[int, int]:
    parts = word.lower().replace("x", ",").split(",")
    try:
        width, height = (int(p) for p in parts)
    except ValueError:
        raise UsageError("TYPE", f"{word!r}", where="--size", allowed="two whole numbers W,H") from None
    return width, height


def print_maps(rows: Sequence[MapInfo]) -> None:
    """Print the bundled maps, a line each."""
    columns = ("name", "size", "free", "terrain", "gates", "what it is")
    cells = [
        (r.name, f"{r.width} x {r.height}", f"{r.free:.0%}", _terrain(r)[0], str(r.gates), r.title)
        for r in rows
    ]
    text.table("bundled maps", columns, cells, right=columns[1:-1], whole=columns[:-1])
    text.line("lampyris maps NAME says more of one; lampyris maps make RECIPE makes others.")


def _terrain(row: MapInfo) -> tuple[str, str]:
    """A map's terrain in short and in full: its share of the free cells and its costs."""
    from lampyris.model.grid import TERRAIN_UNIT

    if row.terrain is None:
        return "", ""
    share = row.terrain.cells / (row.width * row.height * row.free)
    low, high = (
        f"{(TERRAIN_UNIT + c) / TERRAIN_UNIT:.2g}" for c in (row.terrain.lowest, row.terrain.highest)
    )
    full = f"{share:.1%} of the free cells, {low} to {high} times as costly as plain ground"
    return f"{share:.0%}, {high}x", full


def print_map(row: MapInfo) -> None:
    """Print one bundled map and its stored queries."""
    rows = [
        ("size", f"{row.width} x {row.height} cells"),
        ("free", f"{row.free:.1%}"),
        ("gates", str(row.gates)),
        ("what it is", f"{row.title}. {row.description}"),
        ("hash", row.hash),
    ]
    if row.recipe:
        rows.insert(-1, ("recipe", row.recipe))
    if row.terrain is not None:
        rows.insert(2, ("terrain", _terrain(row)[1]))
    text.facts(row.name, rows)
    columns = ("start", "goal", "best cost, octile", "gates on every optimal path")
    cells = []
    for q in row.queries:
        cost = "-" if q.cost is None else f"{q.cost:.2f}"
        cells.append((str(q.start), str(q.goal), cost, "-" if q.gates is None else str(q.gates)))
    text.table("stored queries", columns, cells, boxed=True)


def print_recipes(rows: Sequence[Recipe]) -> None:
    """Print the recipes and their settings."""
    for r in rows:
        cells = [(s.name, "none" if s.default == () else f"{s.default:g}", s.range, s.what) for s in r.table]
        columns = ("setting", "default", "allowed", "what it is")
        text.table(f"{r.name}: {r.summary}", columns, cells, right=("default",))
