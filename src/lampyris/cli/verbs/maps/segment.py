"""``lampyris maps segment``: a map of a photograph.

Heavy modules are imported when the verb runs, so that --help is instant.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import typer

from lampyris._core.limits import MAX_CELLS
from lampyris._core.settings import settings_of
from lampyris.cli import text
from lampyris.cli.option_groups import group_of, settings_in
from lampyris.cli.options import Force, Json, MaxCells, NoTiming, Seed
from lampyris.cli.outputs import check_outputs, print_written
from lampyris.cli.text import print_json, print_notes
from lampyris.model.settings.photo import PhotoSettings

if TYPE_CHECKING:
    from lampyris.io.maps.convert import Conversion
    from lampyris.model.photos.segmented_photo import SegmentedPhoto

    PhotoOptions: TypeAlias = Any
else:
    PhotoOptions = group_of("PhotoOptions", PhotoSettings)

WITH_YAML = (".png", ".pgm")
"""Endings of pictures beside which a ROS map's YAML can be written."""


def segment(
    context: typer.Context,
    photo: Annotated[Path, typer.Argument(metavar="PHOTO", help="A JPEG, PNG, BMP or PGM file.")],
    out: Annotated[
        Path, typer.Option("--out", "-o", metavar="FILE", help="The map (its extension selects the format).")
    ],
    options: PhotoOptions,
    free: Annotated[
        str,
        typer.Option(
            "--free",
            metavar="bright|dark|CLASS,...",
            help="The classes that are free: the brightest, the darkest, or numbers, 0 the darkest.",
        ),
    ] = "bright",
    resolution: Annotated[
        float | None,
        typer.Option(
            "--resolution",
            metavar="M",
            help="Metres per cell; a ROS map's YAML is then written beside a .png or .pgm.",
        ),
    ] = None,
    seed: Seed = 0,
    max_cells: MaxCells = None,
    chart: Annotated[
        Path | None,
        typer.Option("--chart", metavar="FILE", help="Draw the histogram and thresholds (.png or .svg)."),
    ] = None,
    json_: Json = False,
    no_timing: NoTiming = False,
    force: Force = False,
) -> None:
    """Make a map from a photograph: thresholds divide its grey levels into classes, and some classes are free.

    A cell takes the state of more than half of its pixels; it is unknown if they tie, and where the photograph is
    transparent or ends. With --by gso, igso or pso a swarm searches for the thresholds; the gap to the optimum is printed.
    """
    from lampyris.io.maps.convert import files_of, write_and_compare, write_with_yaml
    from lampyris.io.maps.formats.document import MapDocument
    from lampyris.photos.segment import segment_photo

    beside = resolution is not None and out.suffix in WITH_YAML
    check_outputs(force, *((out, out.with_suffix(".yaml")) if beside else files_of(out)), chart=chart)
    made = segment_photo(
        photo,
        free=_classes(free),
        resolution=1.0 if resolution is None else resolution,
        seed=seed,
        max_cells=MAX_CELLS if max_cells is None else max_cells,
        **settings_in(options, PhotoSettings),
    )
    document = MapDocument(made.grid, notes=made.notes)
    written = (write_with_yaml if beside else write_and_compare)(document, out)
    if chart is not None:
        from lampyris.report.charts.histogram_chart import draw_histogram

        draw_histogram(made, chart)
    if json_ or bool(context.obj):
        record = _record(made, written, seed)
        print_json({**record, "timing": {}} if no_timing else record)
    else:
        _print(photo.name, made, written)
        print_written(*written.files, chart)


def _classes(word: str) -> str | tuple[int, ...]:
    """``2,3`` as numbers; anything else as it is, to be judged where it is used."""
    parts = [part.strip() for part in word.split(",")]
    whole = all(part.isascii() and part.isdigit() and len(part) <= 3 for part in parts)
    return tuple(map(int, parts)) if whole else word


def _record(made: SegmentedPhoto, written: Conversion, seed: int) -> dict[str, Any]:
    grid = made.grid
    return {
        "files": [str(f) for f in written.files],
        "thresholds": list(made.thresholds),
        "score": made.score,
        "optimum": made.optimum,
        "gap": made.gap,
        "classes": [
            {"class": c, "from": low, "to": high, "pixels": pixels, "free": c in made.free}
            for c, (low, high, pixels) in enumerate(made.ranges())
        ],
        "photo": {"width": made.width, "height": made.height, "pixels": int(made.histogram.sum())},
        "settings": {name: getattr(made.settings, name) for name in settings_of(PhotoSettings)},
        "seed": seed,
        "width": grid.width,
        "height": grid.height,
        "cells": cells_by_kind(made),
        "resolution": grid.resolution,
        "hash": written.hash,
        "lost": list(written.lost),
        "notes": list(made.notes),
        "timing": {"search_s": made.seconds},
    }


def cells_by_kind(made: SegmentedPhoto) -> dict[str, int]:
    """How many cells are free, blocked and unknown."""
    import numpy as np

    grid = made.grid
    unknown = 0 if grid.unknown is None else int(np.count_nonzero(grid.unknown))
    shut = int(np.count_nonzero(grid.blocked))
    return {"free": grid.blocked.size - shut, "blocked": shut - unknown, "unknown": unknown}


def _print(name: str, made: SegmentedPhoto, written: Conversion) -> None:
    print_notes(made.notes)
    print_notes(written.lost)
    wanted, cells = made.settings, cells_by_kind(made)
    total = max(int(made.histogram.sum()), 1)
    rows = [
        ("photo", f"{made.width} x {made.height} pixels, {wanted.channel}"),
        ("thresholds", f"{', '.join(map(str, made.thresholds))} by {wanted.criterion}, {wanted.by}"),
        ("score", f"{made.score:.6g} of {made.optimum:.6g}, gap {made.gap:.3%}"),
    ]
    rows += [
        (f"class {c}", f"levels {low} to {high}: {pixels / total:.1%} of the pixels, {'free' if c in made.free else 'not free'}")
        for c, (low, high, pixels) in enumerate(made.ranges())
    ]  # fmt: skip
    words = ", ".join(f"{count:,} {kind}" for kind, count in cells.items())
    rows.append(
        ("map", f"{made.grid.width} x {made.grid.height} cells of {made.grid.resolution:g} m: {words}")
    )
    rows.append(("search", f"{1e3 * made.seconds:.1f} ms"))
    text.facts(name, rows)
