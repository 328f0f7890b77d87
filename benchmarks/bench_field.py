"""The field (cost, parents, luciferin) beside what people use today, in one run.

    python -m benchmarks.bench_field [--quick] [--json FILE]

What is timed
-------------
* ours: the whole public call ``lampyris.field.solve.solve``, with allocation and Field, compiled code warm.
* scikit-image: ``MCP_Geometric(costs, fully_connected=True).find_costs([goal])``; 1 and sqrt 2, cuts corners.
* tcod: ``tcod.path.dijkstra2d``, int32, 10 and 14, cuts corners; its arrays are made outside the timing.
* scipy: ``scipy.sparse.csgraph.dijkstra`` from one node, on a graph *built outside the timing* that holds
  exactly our moves; its distances are checked against ours on every map.

The rivals give costs alone (predecessors would cost them more); ours gives parents and luciferin besides.
Rounds go through all contestants in turn, so that a busy neighbour on the machine hurts all alike; the middle
of the rounds is judged, and its quartiles and the least are reported. Cells count if the goal can be reached
from them.
"""

from __future__ import annotations

import argparse
import json
import platform
import statistics
import sys
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from lampyris.field.solve import solve
from lampyris.model.moves import MOVES, Moves

RIVALS = ("scikit-image", "tcod", "scipy")
RULES = {
    "scikit-image": "1 and sqrt 2, cuts corners, costs only",
    "tcod": "10 and 14, cuts corners, costs only",
    "scipy": "the same moves as ours, graph prebuilt, costs only",
}


def random_map(size: int, share: float) -> np.ndarray:
    """Free cells of a map with that share of them blocked, always the same."""
    return np.random.default_rng(size + int(1000 * share)).random((size, size)) >= share


def maze(size: int) -> np.ndarray:
    """A perfect maze with corridors one cell wide: depth first, seeded."""
    half = (size - 1) // 2
    rng = np.random.default_rng(size)
    free = np.zeros((size, size), dtype=np.bool_)
    seen = np.zeros((half, half), dtype=np.bool_)
    stack = [(half // 2, half // 2)]
    seen[stack[0]] = True
    free[2 * stack[0][0] + 1, 2 * stack[0][1] + 1] = True
    while stack:
        y, x = stack[-1]
        ways = [
            (y + dy, x + dx)
            for dy, dx in ((0, 1), (1, 0), (0, -1), (-1, 0))
            if 0 <= y + dy < half and 0 <= x + dx < half and not seen[y + dy, x + dx]
        ]
        if not ways:
            stack.pop()
            continue
        v, u = ways[int(rng.integers(len(ways)))]
        seen[v, u] = True
        free[y + v + 1, x + u + 1] = True
        free[2 * v + 1, 2 * u + 1] = True
        stack.append((v, u))
    return free


def middle(free: np.ndarray) -> tuple[int, int]:
    """The free cell nearest to the middle of the map."""
    ys, xs = np.nonzero(free)
    k = int(np.argmin((ys - free.shape[0] // 2) ** 2 + (xs - free.shape[1] // 2) ** 2))
    return int(xs[k]), int(ys[k])


def graph(free: np.ndarray, moves: Moves) -> tuple[csr_matrix, np.ndarray]:
    """Our moves as a sparse matrix, and the node of each cell."""
    height, width = free.shape
    node = np.full(free.shape, -1, dtype=np.int32)
    node[free] = np.arange(int(free.sum()), dtype=np.int32)
    rows, cols, lengths = [], [], []
    for (dx, dy), cost in zip(moves.offsets, moves.costs, strict=True):
        ys = slice(max(0, -dy), height - max(0, dy))
        xs = slice(max(0, -dx), width - max(0, dx))
        to_ys = slice(max(0, dy), height - max(0, -dy))
        to_xs = slice(max(0, dx), width - max(0, -dx))
        ok = free[ys, xs] & free[to_ys, to_xs]
        if dx and dy and not moves.corner_cutting:
            ok &= free[ys, to_xs] & free[to_ys, xs]
        rows.append(node[ys, xs][ok])
        cols.append(node[to_ys, to_xs][ok])
        lengths.append(np.full(rows[-1].size, moves.value(cost)))
    matrix = csr_matrix(
        (np.concatenate(lengths), (np.concatenate(rows), np.concatenate(cols))), shape=(int(free.sum()),) * 2
    )
    return matrix, node


def contestants(free: np.ndarray, moves: Moves, goal: tuple[int, int]) -> dict[str, Callable[[], Any]]:
    """Name and call of everybody on this map; everything but the call itself is prepared here."""
    import tcod.path
    from skimage.graph import MCP_Geometric

    matrix, node = graph(free, moves)
    source = int(node[goal[1], goal[0]])
    skimage_costs = np.where(free, 1.0, -1.0)
    tcod_costs = free.astype(np.int8)
    start = np.full(free.shape, np.iinfo(np.int32).max, dtype=np.int32)
    start[goal[1], goal[0]] = 0
    out = start.copy()

    def ours() -> Any:
        return solve(free, moves, goal)

    def skimage() -> Any:
        return MCP_Geometric(skimage_costs, fully_connected=True).find_costs([(goal[1], goal[0])])[0]

    def tcod_() -> Any:
        return tcod.path.dijkstra2d(start, tcod_costs, 10, 14, out=out)

    def scipy() -> Any:
        return dijkstra(matrix, directed=True, indices=source)

    return {"lampyris": ours, "scikit-image": skimage, "tcod": tcod_, "scipy": scipy}


def check(free: np.ndarray, moves: Moves, calls: dict[str, Callable[[], Any]]) -> int:
    """How many cells are reached. Our costs must be scipy's, and tcod's where the rules are the same."""
    field = calls["lampyris"]()
    cost = field.cost
    theirs = np.full(free.shape, np.inf)
    theirs[free] = calls["scipy"]()
    np.testing.assert_allclose(cost, theirs, rtol=1e-9)
    if moves.name == "dissertation":
        tcod_cost = calls["tcod"]().astype(np.int64)
        reached = field.exact >= 0
        np.testing.assert_array_equal(tcod_cost[reached], field.exact[reached])
    return int(field.expansions)


def measure(calls: dict[str, Callable[[], Any]], rounds: int, cells: int) -> dict[str, dict[str, float]]:
    """Nanoseconds a cell of each over the rounds: everybody once a round, ours three times."""
    times: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(rounds):
        for name, call in calls.items():
            for _ in range(3 if name == "lampyris" else 1):
                begin = time.perf_counter()
                call()
                times[name].append((time.perf_counter() - begin) * 1e9 / cells)
    rows = {}
    for name, ts in times.items():
        q1, q2, q3 = statistics.quantiles(ts, n=4) if len(ts) > 1 else (ts[0],) * 3
        rows[name] = {"median": q2, "q1": q1, "q3": q3, "least": min(ts), "rounds": len(ts)}
    return rows


def run(quick: bool) -> list[dict[str, Any]]:
    """Every map and both step sets; prints a line for each as it is done."""
    print(f"{'map':<22}{'moves':<14}{'ours ns/cell (quartiles)':<28}" + "".join(f"{r:<22}" for r in RIVALS))
    rows = []
    for size in (512,) if quick else (512, 1024):
        maps = {"open": random_map(size, 0.0), "maze, corridor 1": maze(size)}
        maps |= {
            f"random {share} %": random_map(size, share / 100) for share in ((30,) if quick else (10, 20, 30))
        }
        for name in ("open", *sorted(k for k in maps if k.startswith("random")), "maze, corridor 1"):
            free = maps[name]
            free.setflags(write=False)
            for kind in ("dissertation", "octile"):
                moves = MOVES[kind]
                calls = contestants(free, moves, middle(free))
                cells = check(free, moves, calls)
                times = measure(calls, 5 if quick or size > 512 else 9, cells)
                rows.append({"size": size, "map": name, "moves": kind, "cells": cells, "ns_per_cell": times})
                print(line(rows[-1]), flush=True)
    return rows


def line(row: dict[str, Any]) -> str:
    """One row for people."""
    t = row["ns_per_cell"]
    own = t["lampyris"]
    text = f"{row['size']:>4} {row['map']:<17}{row['moves']:<14}"
    text += f"{own['median']:6.1f} ({own['q1']:.1f} to {own['q3']:.1f})".ljust(28)
    return text + "".join(
        f"{t[r]['median']:6.0f} = {t[r]['median'] / own['median']:4.1f} x".ljust(22) for r in RIVALS
    )


def ratio(row: dict[str, Any], rivals: tuple[str, ...]) -> float:
    """The time of the quickest of these rivals as a multiple of ours, middle against middle."""
    t = row["ns_per_cell"]
    return float(min(t[r]["median"] for r in rivals) / t["lampyris"]["median"])


def verdicts(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The acceptance claims, one line each."""
    out = []
    for rivals, least in ((("scikit-image",), 20.0), (RIVALS, 12.0)):
        who = "scikit-image" if len(rivals) == 1 else "the best of the three"
        for kind in ("dissertation", "octile"):
            mine = [r for r in rows if r["moves"] == kind]
            good = [r for r in mine if ratio(r, rivals) >= least]
            short = [f"{r['size']} {r['map']} ({ratio(r, rivals):.1f})" for r in mine if r not in good]
            worst, best = (f(ratio(r, rivals) for r in mine) for f in (min, max))
            what = f"{kind}: at least {least:.0f} times as fast as {who} on {len(good)} of {len(mine)} maps"
            what += f" ({worst:.1f} to {best:.1f})" + (
                f"; short of it on {', '.join(short)}" if short else ""
            )
            out.append({"claim": f"{kind} {least:.0f}x {who}", "holds": not short, "text": what})
    for size in sorted({r["size"] for r in rows}):
        for kind in ("dissertation", "octile"):
            ns = [
                r["ns_per_cell"]["lampyris"]["median"]
                for r in rows
                if r["size"] == size and r["moves"] == kind and not r["map"].startswith("maze")
            ]
            spread = max(ns) / min(ns)
            what = f"{kind}, {size}: flat within {spread:.2f} times from open to 30 % (2 allowed)"
            out.append({"claim": f"{kind} flat {size}", "holds": spread <= 2, "text": what})
    return out


def machine() -> dict[str, str]:
    """What the numbers were measured with."""
    packages = ("numpy", "numba", "scipy", "scikit-image", "tcod")
    cpu = next(
        (
            text.split(":", 1)[1].strip()
            for text in (Path("/proc/cpuinfo").read_text().splitlines() if sys.platform == "linux" else [])
            if text.startswith("model name")
        ),
        platform.processor(),
    )
    return {"cpu": cpu, "python": platform.python_version(), **{p: version(p) for p in packages}}


def main() -> int:
    """Run, print, judge. The exit code is 0 whatever the verdicts: a benchmark informs, it does not gate."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="512 x 512 alone, fewer maps and rounds")
    parser.add_argument("--json", metavar="FILE", help="write everything there")
    args = parser.parse_args()
    about = machine()
    print(", ".join(f"{k} {v}" for k, v in about.items()))
    for rival, rule in RULES.items():
        print(f"  {rival}: {rule}")
    rows = run(args.quick)
    judged = verdicts(rows)
    for v in judged:
        print(("HOLDS  " if v["holds"] else "SHORT  ") + v["text"])
    if args.json:
        report = {"machine": about, "rows": rows, "verdicts": judged}
        Path(args.json).write_text(json.dumps(report, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
