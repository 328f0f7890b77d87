"""Visibility graph, Voronoi and quadtree beside A* and Theta* on the bundled maps: the tables of docs/map_models.md.

    python tools/map_models.py [MAP ...] [--queries 10]
    python tools/map_models.py --picture docs/img/map_models.png    # the three models on env-2, side by side, no tables

The first queries of each map, octile moves, a point robot, compiled code. Times are CPU seconds of one question to an
open session, in milliseconds, the median.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

import lampyris
from lampyris.io.maps.load import load_map
from lampyris.kernels._jit import prefer_compiled
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan
from lampyris.model.scene import Scene
from lampyris.planning import registry
from lampyris.planning.field.layers import clearance
from lampyris.report.pictures.plan_picture import draw_plan

MAPS = (
    "env-1", "env-2", "env-3", "env-4", "env-5", "env-6", "rooms-100", "office-120", "warehouse-200", "street-256",
    "caves-256", "maze-512", "random-512",
)  # fmt: skip
PICTURED = ("visibility-graph", "voronoi", "quadtree")
WIDE = 1860
"""Pixels of the picture."""
PLANNERS = ("astar", "theta-star", "visibility-graph", "quadtree", "voronoi")


def asked(
    grid: Grid, queries: Sequence[tuple[tuple[int, int], tuple[int, int]]], planner: str
) -> list[tuple[Plan, float]]:
    """The plan of each query and its CPU seconds; of a map with terrain its walls alone."""
    rng, found = np.random.default_rng(0), []
    for start, goal in queries:
        session = registry.make(planner).open(Scene(grid, start, goal, "octile"), rng)
        began = time.process_time()
        found.append((session.plan(), time.process_time() - began))
    return found


def length_of(plan: Plan) -> float:
    """Of the straight lines, or of the walk."""
    return plan.any_angle_length if plan.any_angle_length is not None else plan.cost


def draw(out: str) -> None:
    """Draw what each of the three models searched on env-2."""
    document = load_map("env-2")
    scene = Scene(document.grid, document.start, document.goal)
    parts = []
    with tempfile.TemporaryDirectory() as folder:
        for planner in PICTURED:
            file = Path(folder) / f"{planner}.png"
            draw_plan(scene.grid, lampyris.plan(scene, planner), scene=scene, layer="none", out=file)
            parts.append(Image.open(file).convert("RGB"))
    wide, high = sum(part.width for part in parts), max(part.height for part in parts)
    picture = Image.new("RGB", (wide, high), "white")
    left = 0
    for part in parts:
        picture.paste(part, (left, 0))
        left += part.width
    picture = picture.resize((WIDE, round(WIDE * high / wide)), Image.Resampling.LANCZOS)
    picture.quantize(256, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(out, optimize=True)


def main() -> None:
    """Print both tables, or draw the picture."""
    options = argparse.ArgumentParser()
    options.add_argument("maps", nargs="*", default=MAPS)
    options.add_argument("--queries", type=int, default=10)
    options.add_argument("--picture", metavar="FILE", help="draw the models instead")
    given = options.parse_args()
    if given.picture:
        draw(given.picture)
        return
    prefer_compiled()
    lengths: list[str] = []
    print("| map | queries | Theta*'s excess: mean, most | shortest found by Theta* | bound in the plane |")
    print("|---|---:|---:|---:|---:|")
    for name in given.maps:
        document = load_map(name)
        grid = Grid(document.grid.blocked, name=name)
        queries = [(q.start, q.goal) for q in document.queries][: given.queries]
        asked(grid, queries[:1], "astar")
        plans = {planner: asked(grid, queries, planner) for planner in PLANNERS}
        pairs = [
            (t, v) for (t, _), (v, _) in zip(plans["theta-star"], plans["visibility-graph"], strict=True) if v
        ]
        excess = [length_of(t) / length_of(v) - 1 for t, v in pairs]
        bounds = [
            v.map_model.bound / length_of(v) - 1
            for _, v in pairs
            if v.map_model and v.map_model.bound is not None
        ]
        same = sum(e < 1e-12 for e in excess)
        print(
            f"| {name} | {len(pairs)} | {statistics.mean(excess):.2%}, {max(excess):.2%} | {same} of {len(pairs)} "
            f"| {statistics.mean(bounds):.2%} |",
            flush=True,
        )
        room = clearance(grid)
        row = [name]
        for planner in PLANNERS:
            good = [(p, s) for p, s in plans[planner] if p.path is not None]
            least = statistics.mean(
                float(room[p.path.cells[:, 1], p.path.cells[:, 0]].min()) for p, _ in good if p.path
            )
            nodes = statistics.mean(
                len(p.waypoints) if p.waypoints is not None else len(p.path.cells) for p, _ in good if p.path
            )
            size = statistics.mean(length_of(p) for p, _ in good)
            row.append(
                f"{size:.1f}, {least:.2f}, {nodes:.0f}, {1000 * statistics.median(s for _, s in good):.1f}"
            )
        lengths.append("| " + " | ".join(row) + " |")
    print()
    print(f"| map | {' | '.join(PLANNERS)} |")
    print(f"|---|{'---:|' * len(PLANNERS)}")
    print("\n".join(lengths))


if __name__ == "__main__":
    main()
