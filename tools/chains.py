"""Chains of links by rrt-adaptive, rrt and rrt-connect: solved, joints released, checks; the table of docs/map_models.md.

python tools/chains.py [--seeds 10] [--scene gap]
"""

from __future__ import annotations

import argparse
import statistics
import time

import numpy as np

import lampyris
from lampyris.planning.chain.rrt import PLANNERS

Case = tuple[str, lampyris.Grid, lampyris.Chain, list[float], list[float], int]


def cases() -> list[Case]:
    """Scenes from easy to hard: name, map, chain, start, goal, samples."""
    made: list[Case] = []

    def grid(*walls: tuple[int, int, int, int]) -> lampyris.Grid:
        blocked = np.zeros((40, 40), dtype=bool)
        for top, low, left, right in walls:
            blocked[top:low, left:right] = True
        return lampyris.Grid(blocked, resolution=0.25)

    arm = lampyris.Chain((5.0, 5.0), [1.0] * 4, 0.2, (-2.6, 2.6))
    tip, post = grid((18, 22, 34, 36)), grid((18, 22, 28, 30))
    made.append(
        ("4 links, nothing between", grid((2, 4, 2, 4)), arm, [0.0, 0, 0, 0], [1.5, 0.4, 0.3, 0], 20_000)
    )
    made.append(("4 links, a post at the tip", tip, arm, [-0.9, 0, 0, 0], [0.9, 0, 0, 0], 20_000))
    made.append(("4 links, a post halfway", post, arm, [-0.9, 0, 0, 0], [0.9, 0, 0, 0], 20_000))
    eight = lampyris.Chain((5.0, 5.0), [0.5] * 8, 0.15, (-2.2, 2.2))
    made.append(("8 links, a post at the tip", tip, eight, [-0.9] + [0.0] * 7, [0.9] + [0.0] * 7, 20_000))
    made.append(("8 links, a post halfway", post, eight, [-0.9] + [0.0] * 7, [0.9] + [0.0] * 7, 20_000))
    twenty = lampyris.Chain((5.0, 5.0), [0.2] * 20, 0.1, (-1.6, 1.6))
    made.append(("20 links, a post at the tip", tip, twenty, [-0.9] + [0.0] * 19, [0.9] + [0.0] * 19, 5_000))
    gap = grid((0, 16, 28, 30), (21, 40, 28, 30))
    into = [0.2, 0.0, 0.0, -0.2, 0.0, 0.0, 0.0, 0.0]
    eight = lampyris.Chain((5.0, 5.0), [0.5] * 8, 0.15, [(-3.1, 3.1)] + [(-2.2, 2.2)] * 7)
    made.append(("8 links into a gap", gap, eight, [2.6] + [0.15] * 7, into, 20_000))
    return made


def main() -> None:
    """Print the table."""
    options = argparse.ArgumentParser()
    options.add_argument("--seeds", type=int, default=10)
    options.add_argument("--scene", default="", help="only scenes whose name holds this")
    asked = options.parse_args()
    seeds = asked.seeds
    print("| scene | planner | solved | joints released | samples | nodes | checks | CPU (s) |")
    print("|---|---|---:|---:|---:|---:|---:|---:|")
    for name, grid, chain, start, goal, samples in (one for one in cases() if asked.scene in one[0]):
        for planner in PLANNERS:
            found, seconds = [], []
            for seed in range(seeds):
                began = time.process_time()
                plan = lampyris.plan_chain(
                    grid, chain, start, goal, planner, seed=seed, budget=lampyris.Budget(expansions=samples)
                )
                seconds.append(time.process_time() - began)
                if plan.status in ("start-occupied", "goal-occupied"):
                    raise SystemExit(f"{name}: {plan.status}")
                found.append(plan)
            solved = [plan for plan in found if plan]
            some = solved or found
            released = statistics.mean(len(plan.released) for plan in some)
            row = [
                statistics.median(getattr(plan, key) for plan in found)
                for key in ("samples", "nodes", "checks")
            ]
            print(
                f"| {name} | {planner} | {len(solved)} of {seeds} | {released:.1f} of {chain.joints} "
                f"| {row[0]:.0f} | {row[1]:.0f} | {row[2]:.0f} | {statistics.median(seconds):.2f} |"
            )


if __name__ == "__main__":
    main()
