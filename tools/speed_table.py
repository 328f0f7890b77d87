"""How long each speed law takes against the time optimum, on bundled maps and MovingAI's: a Markdown table.

    python tools/speed_table.py

Every stored query counts alike; of a MovingAI map, some of its published queries spread over all lengths. The
way is A*'s, drawn taut and rounded. The maps of MovingAI are looked for in the folder that LAMPYRIS_SHARED
names, or in a folder "shared" beside the project; without them their rows are left out.

The last column compares `physical` with the time optimum of the same caps, found by other means: the caps taken at
points eight times as close, as they are there and not as bounds around them, and two plain passes.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path as File

import numpy as np

from lampyris import api
from lampyris.io.maps.formats.movingai import read_scen
from lampyris.io.maps.load import load_map
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.motion.geometry.clearance import wall_distance
from lampyris.motion.geometry.sampled_path import SampledPath, sample_curve
from lampyris.motion.laws.compare import compare
from lampyris.motion.laws.physical import PhysicalLaw
from lampyris.motion.laws.registry import SpeedLaw
from lampyris.motion.laws.rpp import Rpp
from lampyris.typing import Cell

MAPS = [f"env-{k}" for k in range(1, 7)] + ["office-120", "office-400", "warehouse-200", "warehouse-1024"]
ROBOT = Robot(radius=0.3)
QUERIES = 8
"""Queries of each MovingAI map."""

COLUMNS: dict[str, SpeedLaw] = {
    "physical": "physical",
    "physical, creep 0.3": PhysicalLaw(creep=0.3),
    "dissertation": "dissertation",
    "rpp": "rpp",
    "rpp, desired v_max": Rpp(desired=ROBOT.v_max),
    "constant": "constant",
    "uncertainty": "uncertainty",
    "blind": "blind",
    "three-speed": "three-speed",
    "cloud": "cloud",
}


def optimum_of_same_caps(course: SampledPath, scene: Scene, creep: float = 0.1, finer: int = 8) -> float:
    """Seconds of the quickest drive under the caps of `physical` at points so many times as close."""
    assert course.curve is not None
    robot, curve = scene.robot, course.curve
    fine = sample_curve(curve, float(np.diff(course.s).max()) / finer)
    away = wall_distance(fine.xy, scene.grid, robot.radius + robot.v_max**2 / (2 * robot.d_max))
    stopping = np.sqrt(2 * robot.d_max * np.maximum(away - robot.radius, 0.0))
    cap = np.minimum(robot.v_max, np.maximum(creep * robot.v_max, stopping))
    x = np.minimum(cap**2, robot.a_lat_max / np.maximum(fine.curvature, 1e-12))
    x[0] = x[-1] = 0.0
    x[fine.stop] = 0.0
    ds = np.diff(fine.s)
    for k in range(len(ds)):
        x[k + 1] = min(x[k + 1], x[k] + 2 * robot.a_max * ds[k])
    for k in range(len(ds) - 1, -1, -1):
        x[k] = min(x[k], x[k + 1] + 2 * robot.d_max * ds[k])
    v = np.sqrt(x)
    return float((2 * ds / (v[1:] + v[:-1])).sum())


def queries() -> Iterator[tuple[str, Grid, list[tuple[Cell, Cell]]]]:
    """Name, grid and ends of every map that is here."""
    for name in MAPS:
        document = load_map(name)
        yield name, document.grid, [(q.start, q.goal) for q in document.queries]
    shared = File(os.environ.get("LAMPYRIS_SHARED") or File(__file__).resolve().parents[2] / "shared")
    for file in sorted((shared / "maps" / "movingai").glob("*.map")):
        document = load_map(file)
        found = read_scen(file.with_name(file.name + ".scen"))
        chosen = found[:: max(1, len(found) // QUERIES)][:QUERIES]
        yield file.stem, document.grid, [(q.start, q.goal) for q in chosen]


def main() -> None:
    """Print the table."""
    print(f"| map, queries | {' | '.join(COLUMNS)} | physical / optimum of its caps, mean and worst |")
    print(f"|---|{'---|' * (len(COLUMNS) + 1)}")
    broken: dict[str, set[str]] = {name: set() for name in COLUMNS}
    for name, grid, ends in queries():
        ratios, same = [], []
        for start, goal in ends:
            scene = Scene(grid, start, goal, robot=ROBOT)
            plan = api.plan(scene, "astar")
            if plan.path is None or len(plan.path.cells) < 2:
                continue
            course = api.smooth(scene, plan)
            found = compare(course, scene, list(COLUMNS.values()))
            ratios.append([e.ratio for e in found])
            for column, e in zip(COLUMNS, found, strict=True):
                broken[column] |= set(e.broken)
            same.append(found[0].duration_s / optimum_of_same_caps(course, scene))
        told = " | ".join(f"{r:.2f}" for r in np.mean(ratios, axis=0))
        print(f"| `{name}`, {len(ratios)} | {told} | {np.mean(same):.3f}, {max(same):.3f} |", flush=True)
    told = " | ".join(", ".join(sorted(b)) or "none" for b in broken.values())
    print(f"| limits broken somewhere | {told} | |")


if __name__ == "__main__":
    sys.exit(main())
