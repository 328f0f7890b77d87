"""``lampyris maps``: the bundled maps, new maps from recipes, and from one format to another.

``lampyris maps`` lists, ``lampyris maps NAME`` shows one map, and a first word that is an action does that.
Work is imported when a verb runs, so that --help is instant.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from lampyris.errors import FileError, UsageError, did_you_mean

if TYPE_CHECKING:
    from lampyris.maps.convert import Conversion


class _NameOrAction(TyperGroup):
    """A first word that is no action is the name of a map."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """``maps NAME`` is ``maps show NAME``."""
        # Typer has its own click in new releases and the installed one in old ones: no type names both.
        if args and args[0] not in self.commands and not args[0].startswith("-"):
            args = ["show", *args]
        return super().resolve_command(ctx, args)


app = typer.Typer(
    cls=_NameOrAction,
    invoke_without_command=True,
    subcommand_metavar="[NAME | ACTION ...]",
    help="List the bundled maps, show one of them, make new ones, convert files.",
)

Json = Annotated[bool, typer.Option("--json", help="Print JSON for machines.")]
Force = Annotated[bool, typer.Option("--force", help="Overwrite files that exist.")]
Resolution = Annotated[
    float | None, typer.Option("--resolution", metavar="M", help="Metres a cell, for maps that do not say.")
]


@app.callback()
def _maps(context: typer.Context, json_: Json = False) -> None:
    if context.invoked_subcommand is None:
        from lampyris.cli import verbs

        raise typer.Exit(verbs.maps(None, json_))
    context.obj = json_


@app.command()
def show(
    context: typer.Context,
    name: Annotated[str, typer.Argument(metavar="NAME", help="The name of a bundled map.")],
    json_: Json = False,
) -> None:
    """Show a bundled map and its stored queries."""
    from lampyris.cli import verbs
    from lampyris.maps import library

    if name not in library.names():
        # Whoever mistypes an action ends here as well.
        raise FileError(
            "FILE_MISSING",
            "no bundled map of that name",
            where=name,
            allowed=", ".join(library.names()),
            todo=did_you_mean(name, (*library.names(), "recipes", "make", "convert")),
        )
    raise typer.Exit(verbs.maps(name, json_ or bool(context.obj)))


@app.command()
def recipes(context: typer.Context, json_: Json = False) -> None:
    """List the recipes and their settings, with defaults and ranges."""
    from lampyris.cli import show as tables
    from lampyris.cli.verbs import print_json
    from lampyris.maps.make import RECIPES

    if not (json_ or context.obj):
        tables.recipes(list(RECIPES.values()))
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


@app.command()
def make(
    context: typer.Context,
    recipe: Annotated[str, typer.Argument(metavar="RECIPE", help="See `lampyris maps recipes`.")],
    out: Annotated[
        Path, typer.Option("--out", "-o", metavar="FILE", help="The map (its ending names the format).")
    ],
    size: Annotated[str, typer.Option("--size", metavar="W,H", help="Columns and rows.")] = "50,50",
    seed: Annotated[int, typer.Option("--seed", help="Same seed, same cells.")] = 0,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set", metavar="KEY=VALUE", help="A setting of the recipe; may be given several times."
        ),
    ] = None,
    resolution: Resolution = None,
    force: Force = False,
    json_: Json = False,
) -> None:
    """Make a new map from a recipe and a seed."""
    from lampyris.cli.verbs import check_outputs
    from lampyris.maps.convert import files_of, write_and_compare
    from lampyris.maps.document import MapDocument
    from lampyris.maps.make import make_ground, recipe_named
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
    made = write_and_compare(MapDocument(grid), out)
    _say(made, json_ or bool(context.obj), recipe=recipe, seed=seed, settings=row.complete(given))


@app.command()
def convert(
    context: typer.Context,
    source: Annotated[str, typer.Argument(metavar="IN", help="A map file, or the name of a bundled map.")],
    target: Annotated[Path, typer.Argument(metavar="OUT", help="The new file; its ending names the format.")],
    resolution: Resolution = None,
    force: Force = False,
    json_: Json = False,
) -> None:
    """Write a map in another format, and say what that format cannot hold."""
    from lampyris.cli.verbs import check_outputs
    from lampyris.maps.convert import convert as convert_map
    from lampyris.maps.convert import files_of

    check_outputs(force, *files_of(target))
    _say(convert_map(source, target, resolution=resolution), json_ or bool(context.obj))


def _say(made: Conversion, as_json: bool, **more: Any) -> None:
    """What was written, and what was not."""
    import numpy as np

    from lampyris.cli.verbs import print_json, remarks

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
        }
        print_json({**more, **record})
        return
    remarks(made.lost)
    files = ", ".join(str(f) for f in made.files)
    typer.echo(f"wrote {files}: {grid.width} x {grid.height} cells, {free:.1%} free, hash {made.hash[:16]}")


def _key_value(word: str) -> tuple[str, str]:
    key, equals, value = word.partition("=")
    if not equals or not key.strip():
        raise UsageError("SET", f"{word!r}", where="--set", allowed="KEY=VALUE")
    return key.strip().replace("-", "_"), value.strip()


def _size(text: str) -> tuple[int, int]:
    parts = text.lower().replace("x", ",").split(",")
    try:
        width, height = (int(p) for p in parts)
    except ValueError:
        raise UsageError("TYPE", f"{text!r}", where="--size", allowed="two whole numbers W,H") from None
    return width, height
