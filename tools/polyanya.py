"""Polyanya beside Theta* on MovingAI maps, a table of docs/map_models.md; and jump point search after edits.

    python tools/polyanya.py FOLDER [--queries 100]

For every FILE.map of the folder with its FILE.map.scen: evenly chosen queries, octile moves, a point robot, compiled
code, CPU seconds. Then sessions of ``jps`` that take 1, 10 and 100 edits before each query, beside one opened anew.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from lampyris.io.maps.load import load_map
from lampyris.kernels._jit import prefer_compiled
from lampyris.kernels.graph.any_angle import TOUCH
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.scene import Scene
from lampyris.planning.graph.any_angle_search import AnyAngleSearch
from lampyris.planning.graph.jps import JumpPointSearch
from lampyris.planning.map_models.polyanya_search import Mesh, PolyanyaSearch
from lampyris.typing import BoolGrid, Cell

Query = tuple[Cell, Cell]


def queries_of(file: Path, many: int) -> list[Query]:
    """Evenly chosen queries of a scenario file."""
    rows = [line.split() for line in file.read_text().splitlines()[1:]]
    found = [((int(r[4]), int(r[5])), (int(r[6]), int(r[7]))) for r in rows if len(r) == 9]
    return found[:: max(1, len(found) // many)][:many]


def timed(call: Callable[[], Any]) -> tuple[float, Any]:
    began = time.process_time()
    made = call()
    return time.process_time() - began, made


def length(points: Any) -> float:
    d = np.diff(points.astype(np.float64), axis=0)
    return float(np.sqrt((d * d).sum(axis=1)).sum())


def polyanya_row(name: str, free: BoolGrid, queries: list[Query]) -> None:
    mine = PolyanyaSearch(free, MOVES["octile"], wide=False)
    theta = AnyAngleSearch(free, None, MOVES["octile"], wide=False, lazy=0)
    mesh = min(timed(lambda: Mesh(free, TOUCH))[0] for _ in range(5))
    for search in (mine, theta):
        search.find_path(*queries[-1])
    alone, whole, rival, excess, longer = [], [], [], [], 0
    for start, goal in queries:
        alone.append(timed(lambda s=start, g=goal: mine.turning_points(s, g))[0])
        took, answer = timed(lambda s=start, g=goal: mine.find_path(s, g))
        whole.append(took)
        took, other = timed(lambda s=start, g=goal: theta.find_path(s, g))
        rival.append(took)
        if answer.waypoints is None or other.waypoints is None:
            assert answer.waypoints is other.waypoints, (name, start, goal)
            continue
        a, b = length(answer.waypoints), length(other.waypoints)
        longer += a > b + 1e-9
        excess.append(b / a - 1.0 if a else 0.0)
    median = [f"{statistics.median(times) * 1e6:.0f}" for times in (alone, whole, rival)]
    print(
        f"| {name} | {len(mine.mesh.rects) // 4} | {mesh * 1e3:.1f} | {' | '.join(median)} | {np.mean(excess):.2%} | {longer} |"
    )


def edits_row(name: str, free: BoolGrid, queries: list[Query], many: int) -> None:
    rng = np.random.default_rng(many)
    nothing = np.random.default_rng(0)
    planner, walls = JumpPointSearch(), ~free
    session = planner.open(Scene(Grid(walls), *queries[0]), nothing)
    session.plan()
    repaired = anew = 0.0
    different = 0
    for _ in range(25):
        height, width = walls.shape
        cells = {
            (int(x), int(y))
            for x, y in zip(rng.integers(0, width, many), rng.integers(0, height, many), strict=True)
        }
        freed = tuple(sorted((x, y) for x, y in cells if walls[y, x]))
        change = Change(blocked=tuple(sorted(cells - set(freed))), freed=freed)
        took, mine = timed(lambda c=change: session.plan(c))
        repaired += took
        walls = walls.copy()
        for x, y in cells:
            walls[y, x] = not walls[y, x]
        took, other = timed(lambda w=walls: planner.open(Scene(Grid(w), *queries[0]), nothing).plan())
        anew += took
        different += mine != other
    print(
        f"| {name} | {many} | {repaired / 25 * 1e6:.0f} | {anew / 25 * 1e6:.0f} | {anew / repaired:.2f} | {different} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--queries", type=int, default=100)
    asked = parser.parse_args()
    prefer_compiled()
    maps = {file.stem: ~load_map(str(file)).grid.blocked for file in sorted(asked.folder.glob("*.map"))}
    queries = {name: queries_of(asked.folder / f"{name}.map.scen", asked.queries) for name in maps}
    print("| map | rectangles | mesh (ms) | search (us) | whole (us) | theta-star (us) | excess | longer |")
    for name, free in maps.items():
        polyanya_row(name, free, queries[name])
    print("\n| map | edits | repaired (us) | opened anew (us) | ratio | different |")
    for name, free in maps.items():
        for many in (1, 10, 100):
            edits_row(name, free, queries[name], many)


if __name__ == "__main__":
    main()
