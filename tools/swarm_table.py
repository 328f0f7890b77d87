"""Every swarm planner without its seed on the thirty stored queries of env-1 to env-6.

``python tools/swarm_table.py [--seed N] [--seeded] [NAME ...]`` plans each query with the default settings, has the
referee re-check every path, and prints how many paths were found, how much longer they are than the optimum on average
and at most, and CPU seconds. ``--seeded`` begins with the exact path, which is then the answer: all gaps are 0.
"""

from __future__ import annotations

import argparse
import sys
import time
from typing import Any

import numpy as np

from lampyris.io.maps.library import load
from lampyris.model.scene import Scene
from lampyris.planning import registry
from lampyris.referee import certify

ROWS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("gso", {}),
    ("igso", {}),
    ("pso", {}),
    ("lpso", {}),
    ("apso", {}),
    ("ipso", {}),
    ("pso-apf", {}),
    ("diversity-pso", {}),
    ("ant-system", {}),
    ("ant-system", {"guide": "step"}),
    ("mmas-dstar", {}),
)
"""Planners and the settings that are not their defaults."""


def scenes() -> list[Scene]:
    """The thirty queries, by the dissertation's moves."""
    found = []
    for name in (f"env-{k}" for k in range(1, 7)):
        document = load(name)
        found += [Scene(document.grid, q.start, q.goal, "dissertation") for q in document.queries]
    return found


def row(name: str, settings: dict[str, Any], seed: int, seeded: bool) -> str:
    """One line of the table."""
    planner = registry.make(name, {**settings, "seeded": seeded})
    gaps, queries, began = [], scenes(), time.process_time()
    for scene in queries:
        plan = certify(planner.open(scene, np.random.default_rng(seed)).plan(), scene)
        if plan.path is not None:
            gaps.append(plan.gap or 0.0)
    took = time.process_time() - began
    words = " ".join((name, *(f"{key}={value}" for key, value in settings.items())))
    mean, most = (f"{100 * value:.1f}" for value in (np.mean(gaps), max(gaps))) if gaps else ("-", "-")
    start, found = "seeded" if seeded else "unseeded", f"{len(gaps)} of {len(queries)}"
    return f"{words:<22} {start:<9} {found:>9} {mean:>9} {most:>9} {took:>7.1f}"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help="planners (default: all)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--seeded", action="store_true")
    asked = parser.parse_args()
    print(f"{'planner':<22} {'start':<9} {'found':>9} {'mean gap%':>9} {'worst gap':>9} {'CPU s':>7}")
    for name, settings in ROWS:
        if not asked.names or name in asked.names:
            print(row(name, settings, asked.seed, asked.seeded), flush=True)


if __name__ == "__main__":
    sys.exit(main())
