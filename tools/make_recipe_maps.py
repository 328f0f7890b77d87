"""Make the bundled maps that are a recipe and a seed, and measure all: ``python tools/make_recipe_maps.py``.

Writes into ``src/lampyris/maps/data``: a PNG of one bit a cell for each map of :data:`MAPS`; in
``index.json``, for every bundled map, its size, hash, gates and the length of the shortest way of each stored
query; and every thumbnail. ``--sheet FILE`` draws all thumbnails on one sheet, to be looked at.

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

from lampyris.field.solve import solve
from lampyris.maps.document import Source, document
from lampyris.maps.draw import Draw
from lampyris.maps.make import make
from lampyris.maps.map_hash import map_hash
from lampyris.maps.recipes.regions import keep_largest
from lampyris.maps.text import read_text
from lampyris.maps.thumbnail import SIDE, thumbnail
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES, octile_pair
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
    "office-120": Made(
        "Office floor", "Three corridors with offices on both sides, desks, doors.", "office", 120, 80, 4
    ),
    "warehouse-200": Made(
        "Warehouse", "Racks in zones, aisles three cells wide, docks below.", "warehouse", 200, 120, 9
    ),
    "street-256": Made(
        "Town", "Bent streets, an avenue, a round street, yards and parks.", "street", 256, 256, 12
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


def one_bit_png(blocked: np.ndarray) -> bytes:
    """The map as a black and white PNG, as small as Pillow makes it."""
    out = io.BytesIO()
    Image.fromarray(~blocked).save(out, format="PNG", optimize=True)
    return out.getvalue()


def measured(entry: dict[str, Any], blocked: np.ndarray, name: str) -> dict[str, Any]:
    """The same entry with what is measured, and enough queries."""
    grid = Grid(blocked)
    queries = [dict(q) for q in entry["queries"]]
    if len(queries) < LEAST_QUERIES:
        queries += drawn_queries(blocked, Draw(sum(name.encode())), QUERIES - len(queries))
    for query in queries:
        query["octile"] = list(octile_pair(int(cost_to(blocked, query["goal"])[tuple(query["start"])[::-1]])))
    facts = {
        "width": grid.width,
        "height": grid.height,
        "blocked": int(np.count_nonzero(blocked)),
        "hash": map_hash(grid),
        "gates": int(gate_mask(blocked).sum()),
    }
    head = {k: entry[k] for k in ("file", "title", "description")}
    return {**head, **facts, "recipe": entry["recipe"], "queries": queries}


def cost_to(blocked: np.ndarray, goal: list[int]) -> np.ndarray:
    """Exact octile cost of every cell to the goal, -1 where there is no way."""
    exact: np.ndarray = solve(~blocked, MOVES["octile"], (goal[0], goal[1])).exact
    return exact


def drawn_queries(blocked: np.ndarray, draw: Draw, count: int) -> list[dict[str, Any]]:
    """Far apart starts and goals in the largest region; no gates, where there is something else."""
    good = ~keep_largest(blocked)
    if (good & ~gate_mask(blocked)).sum() > good.sum() // 2:
        good &= ~gate_mask(blocked)
    ys, xs = np.nonzero(good)
    made = []
    for _ in range(count):
        k = draw.below(len(xs))
        goal = [int(xs[k]), int(ys[k])]
        some = draw.belows(np.full(STARTS, len(xs)))
        far = some[np.argmax(cost_to(blocked, goal)[ys[some], xs[some]])]
        made.append(
            {"start": [int(xs[far]), int(ys[far])], "goal": goal, "gates": None, "label": "drawn, far apart"}
        )
    return made


def kept_text(name: str) -> np.ndarray:
    """The blocked cells of a map kept as text."""
    source = Source((DATA / f"{name}.txt").read_bytes(), name)
    return document(read_text(source), source, name=name, format="text").grid.blocked


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
            entry, blocked = kept[name], kept_text(name)
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
            blocked = make(m.recipe, m.width, m.height, m.seed, **m.settings)
            (DATA / f"{name}.png").write_bytes(one_bit_png(blocked))
        new[name] = measured(entry, blocked, name)
        first = new[name]["queries"][0]
        thumbs[name] = thumbnail(Grid(blocked), tuple(first["start"]), tuple(first["goal"]))
        (DATA / "thumbs" / f"{name}.png").write_bytes(thumbs[name])
        print(f"{name}: {1 - blocked.mean():.0%} free, {new[name]['gates']} gates", flush=True)
    (DATA / "index.json").write_text(compact(json.dumps({"maps": new}, indent=1)) + "\n")
    if sheet_file is not None:
        sheet(thumbs).save(sheet_file)


if __name__ == "__main__":
    main()
