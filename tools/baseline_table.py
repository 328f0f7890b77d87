"""The two baselines beside AD-GSO on env-1 to env-6, in the form of the dissertation's Table 4.11.

``python tools/baseline_table.py [--csv FILE] [--seed N]`` plans all 30 start and goal pairs with each method,
has the referee re-check every path, and prints both things that the dissertation calls path cost: the length
of the path, and the sum of cost-to-go over its cells, which the referee works out a second time. For the
improved baseline, which moves two cells at a time, the sum over every second cell stands beside it: that is
what the dissertation prints for it. The maps are our own (its maps are lost): only the kind can be compared.
"""

from __future__ import annotations

import argparse
import csv
import sys
from dataclasses import astuple, dataclass, fields
from pathlib import Path

import numpy as np

from lampyris.io.maps.library import load
from lampyris.model.scene import Scene
from lampyris.planning.adgso.ad_gso import AdGso
from lampyris.planning.base import Planner
from lampyris.planning.swarm.dstar_lpso import Dstar16Lpso, DstarLpso
from lampyris.referee import certify, sum_cost_to_go

METHODS: tuple[tuple[str, Planner, int], ...] = (
    ("mixed", DstarLpso(), 1),
    ("improved", Dstar16Lpso(), 2),
    ("ad-gso", AdGso(gates="replan"), 1),
    ("ad-gso*", AdGso(gates="close"), 1),
)
"""What to call a method, its planner, and each how many cells the dissertation counts. The fourth is AD-GSO
on the terms of the improved baseline: gates closed beforehand."""


@dataclass(frozen=True, slots=True)
class Row:
    """One line of the table. ``printed`` is what the dissertation would print as path cost."""

    map: str
    start: str
    goal: str
    method: str
    status: str
    gates_met: int
    iterations: int
    length: float
    optimum: float
    sum_to_go: float
    printed: float


def rows(seed: int) -> list[Row]:
    """Every query of the six maps with every method."""
    out = []
    for name in (f"env-{k}" for k in range(1, 7)):
        document = load(name)
        for query in document.queries:
            scene = Scene(document.grid, query.start, query.goal, "dissertation")
            for method, planner, every in METHODS:
                out.append(_row(name, scene, method, planner, every, seed))
    return out


def _row(name: str, scene: Scene, method: str, planner: Planner, every: int, seed: int) -> Row:
    plan = certify(planner.open(scene, np.random.default_rng(seed)).plan(), scene)
    ends = (f"{scene.start[0]},{scene.start[1]}", f"{scene.goal[0]},{scene.goal[1]}")
    met = len(plan.gates_met)
    if plan.path is None:
        nothing = float("nan")
        return Row(name, *ends, method, plan.status.value, met, plan.iterations, *([nothing] * 4))
    total = sum_cost_to_go(plan.path, scene)
    if plan.sum_cost_to_go is None or abs(plan.sum_cost_to_go - total) > 1e-9 * total:
        raise SystemExit(f"{name} {ends} {method}: says {plan.sum_cost_to_go}, the referee finds {total}")
    printed = total if every == 1 else sum_cost_to_go(plan.path, scene, every=every)
    if method.startswith("ad-gso"):
        printed = plan.cost  # the dissertation prints its own method's length here, beside the others' sums
    best = plan.optimal_cost or 0.0
    numbers = (round(v, 2) for v in (plan.cost, best, total, printed))
    return Row(name, *ends, method, plan.status.value, met, plan.iterations, *numbers)


def show(table: list[Row]) -> None:
    """Print the table and each method's means over the rows that every method solved."""
    names = [f.name for f in fields(Row)]
    texts = [[f"{v:.1f}" if isinstance(v, float) else str(v) for v in astuple(row)] for row in table]
    widths = [max(len(line[k]) for line in [names, *texts]) for k in range(len(names))]
    for line in [names, *texts]:
        print("  ".join(word.rjust(w) for word, w in zip(line, widths, strict=True)))
    lost = {(r.map, r.start, r.goal) for r in table if r.status != "found"}
    print(f"\nmeans over the {len(table) // len(METHODS) - len(lost)} pairs that every method solved")
    for method, _, _ in METHODS:
        mine = [r for r in table if r.method == method and (r.map, r.start, r.goal) not in lost]
        mean = {n: float(np.mean([getattr(r, n) for r in mine])) for n in names[5:]}
        print(f"  {method:>9}: " + ", ".join(f"{n} {v:.2f}" for n, v in mean.items()))


def main() -> None:
    """Print the table; write it, if asked."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--csv", type=Path, help="also write the rows to this file")
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    table = rows(asked.seed)
    show(table)
    if asked.csv is not None:
        with asked.csv.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow([f.name for f in fields(Row)])
            writer.writerows(astuple(row) for row in table)


if __name__ == "__main__":
    sys.exit(main())
