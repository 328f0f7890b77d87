"""Make the bundled maps that are a recipe and a seed, and measure all: ``python tools/make_recipe_maps.py``.

Writes into ``src/lampyris/io/maps/data``: a PNG of one bit a cell, or of costmap values where there is terrain,
for each map of :data:`MAPS`; in ``index.json``, for every bundled map, its size, hash, gates and the cost of
the best way of each stored query; and every thumbnail. ``--sheet FILE`` draws all thumbnails on one sheet, to
be looked at.

Queries are drawn: a goal at random in the largest region, and of some dozens of random starts the one that is
farthest from it by octile moves. A map that has three or more keeps them.
"""

from __future__ import annotations

import argparse
import io
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw

from lampyris.io.maps.formats.costmap import costs_of
from lampyris.io.maps.formats.document import FileSource, document
from lampyris.io.maps.formats.plain_text import read_text
from lampyris.io.maps.map_hash import map_hash
from lampyris.io.maps.recipes.draw import Draw
from lampyris.io.maps.recipes.make import make_ground
from lampyris.io.maps.recipes.regions import keep_largest
from lampyris.io.maps.thumbnail import SIDE, thumbnail
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES, octile_pair
from lampyris.planning.field.layers import moves_on
from lampyris.planning.field.solve import solve
from make_library import DATA, compact, gate_mask

QUERIES = 4
LEAST_QUERIES = 3
STARTS = 48


@dataclass(frozen=True)
class Made:
    """One map to make."""

    title: str
    description: str
    recipe: str
    width: int
    height: int
    seed: int
    settings: dict[str, int | float] = field(default_factory=dict)


MAPS = {
    "rooms-20": Made(
        "Flat",
        "A small flat: a few rooms and doors one cell wide.",
        "rooms",
        20,
        20,
        3,
        {"room": 3, "hall": 8, "door": 1, "loops": 0.2},
    ),
    "maze-31": Made("Small maze", "A perfect maze: one way between any two places.", "maze", 31, 31, 7),
    "caves-64": Made(
        "Cave", "A cave with pillars, no straight wall anywhere.", "caves", 64, 64, 2, {"fill": 0.47}
    ),
    "hills-48": Made(
        "Meadow",
        "A pond, a road, and gentle rises of up to three times what plain ground costs.",
        "hills",
        48,
        32,
        3,
        {"dearest": 126, "plain": 0.45, "water": 0.08, "roads": 1},
    ),
    "rooms-100": Made("Many rooms", "Rooms of many sizes with doors two cells wide.", "rooms", 100, 100, 11),
    "maze-101": Made(
        "Maze with loops",
        "Narrow corridors; some walls are open, so there is a choice of ways.",
        "maze",
        101,
        101,
        5,
        {"loops": 0.06},
    ),
    "hills-100": Made(
        "Hills",
        "Steep hills in five steps, ponds, rocks and two roads.",
        "hills",
        100,
        100,
        5,
    ),
    "office-120": Made(
        "Office floor", "Three corridors with offices on both sides, desks, doors.", "office", 120, 80, 4
    ),
    "warehouse-200": Made(
        "Warehouse", "Racks in zones, aisles three cells wide, docks below.", "warehouse", 200, 120, 9
    ),
    "street-256": Made(
        "Town", "Bent streets, an avenue, a round street, yards and parks.", "street", 256, 256, 12
    ),
    "hills-256": Made(
        "Lake district",
        "Lakes between mountains; three roads, over the water on causeways.",
        "hills",
        256,
        256,
        1,
        {"pitch": 48, "levels": 8, "water": 0.2, "roads": 3},
    ),
    "caves-256": Made(
        "Caves", "Winding caves with many loops.", "caves", 256, 256, 6, {"fill": 0.48, "doublings": 1}
    ),
    "gates-256": Made(
        "Halls with gates",
        "Halls whose doors are often one cell wide: gates all over.",
        "gates",
        256,
        256,
        8,
        {"room": 14, "rooms": 140, "doors": 3, "narrow": 0.7, "clutter": 2500, "bulk": 7},
    ),
    "office-400": Made(
        "Office tower floor",
        "Nine corridors, some hundred offices, half of them furnished.",
        "office",
        400,
        240,
        21,
        {"wing": 90},
    ),
    "maze-512": Made(
        "Wide maze",
        "A perfect maze with corridors four cells wide and thick walls.",
        "maze",
        512,
        512,
        13,
        {"corridor": 4, "wall": 2},
    ),
    "random-512": Made(
        "Random cells",
        "A quarter of all cells blocked at random; some free cells are cut off.",
        "random",
        512,
        512,
        17,
        {"density": 0.25},
    ),
    "street-512": Made(
        "City",
        "Two avenues, two round streets, small blocks and many alleys.",
        "street",
        512,
        512,
        23,
        {"block": 22, "avenues": 2, "rings": 2},
    ),
    "caves-1024": Made(
        "Great caves",
        "Large halls and narrow passages.",
        "caves",
        1024,
        1024,
        19,
        {"fill": 0.48, "doublings": 3},
    ),
    "hills-1024": Made(
        "Mountains",
        "Ranges and valleys in twelve steps, with lakes and four roads.",
        "hills",
        1024,
        1024,
        2,
        {"pitch": 120, "levels": 12, "roads": 4, "road": 3, "rocks": 0.002},
    ),
    "warehouse-1024": Made(
        "Distribution centre",
        "A hall of a thousand cells: long racks, wide ways, a hundred docks.",
        "warehouse",
        1024,
        768,
        29,
        {"zone": 60, "aisle": 4, "cross": 6, "staging": 24},
    ),
    "street-1024": Made(
        "Metropolis",
        "Five avenues and three round streets through a thousand blocks.",
        "street",
        1024,
        1024,
        31,
        {"block": 28, "road": 5, "avenues": 5, "rings": 3},
    ),
    "rooms-2048": Made(
        "Endless rooms",
        "Thousands of rooms on four million cells.",
        "rooms",
        2048,
        2048,
        37,
        {"room": 8, "hall": 30, "door": 3, "loops": 0.25},
    ),
}


def png(grid: Grid) -> bytes:
    """The map as a PNG, as small as Pillow makes it: black and white, or with terrain its costmap values."""
    out = io.BytesIO()
    cells = ~grid.blocked if grid.terrain is None else costs_of(grid)
    Image.fromarray(cells).save(out, format="PNG", optimize=True)
    return out.getvalue()


def measured(entry: dict[str, Any], grid: Grid, name: str) -> dict[str, Any]:
    """The same entry with what is measured, and enough queries."""
    queries = [dict(q) for q in entry["queries"]]
    if len(queries) < LEAST_QUERIES:
        queries += drawn_queries(grid, Draw(sum(name.encode())), QUERIES - len(queries))
    for query in queries:
        exact = int(cost_to(grid, query["goal"])[tuple(query["start"])[::-1]])
        query["octile" if grid.terrain is None else "weighed"] = list(octile_pair(exact))
    facts: dict[str, Any] = {
        "width": grid.width,
        "height": grid.height,
        "blocked": int(np.count_nonzero(grid.blocked)),
        "hash": map_hash(grid),
        "gates": int(gate_mask(grid.blocked).sum()),
    }
    if grid.terrain is not None:
        used = grid.terrain[grid.terrain > 0]
        facts["terrain"] = {"cells": len(used), "lowest": int(used.min()), "highest": int(used.max())}
    head = {k: entry[k] for k in ("file", "title", "description")}
    return {**head, **facts, "recipe": entry["recipe"], "queries": queries}


def cost_to(grid: Grid, goal: list[int]) -> np.ndarray:
    """Exact octile cost of every cell to the goal, -1 where there is no way."""
    moves = moves_on(grid, MOVES["octile"])
    exact: np.ndarray = solve(~grid.blocked, moves, (goal[0], goal[1]), terrain=grid.terrain).exact
    return exact


def drawn_queries(grid: Grid, draw: Draw, count: int) -> list[dict[str, Any]]:
    """Far apart starts and goals in the largest region; no gates, where there is something else."""
    good = ~keep_largest(grid.blocked)
    if (good & ~gate_mask(grid.blocked)).sum() > good.sum() // 2:
        good &= ~gate_mask(grid.blocked)
    ys, xs = np.nonzero(good)
    made = []
    for _ in range(count):
        k = draw.below(len(xs))
        goal = [int(xs[k]), int(ys[k])]
        some = draw.belows(np.full(STARTS, len(xs)))
        far = some[np.argmax(cost_to(grid, goal)[ys[some], xs[some]])]
        made.append(
            {"start": [int(xs[far]), int(ys[far])], "goal": goal, "gates": None, "label": "drawn, far apart"}
        )
    return made


def kept_text(name: str) -> Grid:
    """A map kept as text."""
    source = FileSource((DATA / f"{name}.txt").read_bytes(), name)
    return document(read_text(source), source, name=name, format="text").grid


def sheet(thumbs: dict[str, bytes]) -> Image.Image:
    """All thumbnails with their names."""
    columns, pitch = 7, (SIDE + 12, SIDE + 24)
    picture = Image.new("RGB", (columns * pitch[0], -(-len(thumbs) // columns) * pitch[1]), (255, 255, 255))
    pen = ImageDraw.Draw(picture)
    for k, (name, data) in enumerate(thumbs.items()):
        x, y = k % columns * pitch[0] + 6, k // columns * pitch[1] + 16
        pen.text((x, y - 14), name, fill=(0, 0, 0))
        picture.paste(Image.open(io.BytesIO(data)).convert("RGB"), (x, y))
    return picture


def main() -> None:
    """Make, measure, write."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--sheet", type=Path, help="draw all thumbnails on this sheet")
    sheet_file = options.parse_args().sheet
    index = json.loads((DATA / "index.json").read_text())["maps"]
    kept = {name: {"file": f"{name}.txt", **e} for name, e in index.items() if name not in MAPS}
    (DATA / "thumbs").mkdir(exist_ok=True)
    new, thumbs = {}, {}
    for name in (*kept, *MAPS):
        if name in kept:
            entry, grid = kept[name], kept_text(name)
        else:
            m = MAPS[name]
            recipe = {
                "name": m.recipe,
                "width": m.width,
                "height": m.height,
                "seed": m.seed,
                "settings": m.settings,
                "edits": [],
            }
            entry = {
                "file": f"{name}.png",
                "title": m.title,
                "description": m.description,
                "recipe": recipe,
                "queries": [],
            }
            ground = make_ground(m.recipe, m.width, m.height, m.seed, **m.settings)
            grid = Grid(ground.blocked, terrain=ground.terrain)
            (DATA / f"{name}.png").write_bytes(png(grid))
        new[name] = measured(entry, grid, name)
        first = new[name]["queries"][0]
        thumbs[name] = thumbnail(grid, tuple(first["start"]), tuple(first["goal"]))
        (DATA / "thumbs" / f"{name}.png").write_bytes(thumbs[name])
        print(f"{name}: {1 - grid.blocked.mean():.0%} free, {new[name]['gates']} gates", flush=True)
    (DATA / "index.json").write_text(compact(json.dumps({"maps": new}, indent=1)) + "\n")
    if sheet_file is not None:
        sheet(thumbs).save(sheet_file)


if __name__ == "__main__":
    main()
