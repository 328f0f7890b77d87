"""What AD-GSO's attributes buy on the bundled maps, as a Markdown table: length, clearance, speed.

    python tools/attributes_table.py > docs/attributes_table.md

Clearance is the mean over the way of the distance to the nearest wall, in cells; the speed is the mean of the
dissertation's law, which slows down for walls in the two nearest rings, in its velocity units. Every stored
query of every map up to 256 cells wide counts alike; each gain is against AD-GSO without attributes on the
same query.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lampyris import api
from lampyris.io.maps import library
from lampyris.io.maps.load import load_map
from lampyris.model.path import path_of
from lampyris.model.plan import Plan
from lampyris.model.scene import Scene
from lampyris.model.traffic import RandomWalk
from lampyris.planning.field.layers import clearance, moves_for

CASES: dict[str, dict[str, float]] = {
    "obstacle_density_weight=1": {"obstacle_density_weight": 1.0},
    "obstacle_density_weight=4": {"obstacle_density_weight": 4.0},
    "min_clearance=1": {"min_clearance": 1},
    "min_clearance=1 obstacle_density_weight=4": {"min_clearance": 1, "obstacle_density_weight": 4.0},
    "choice=exact": {"choice": "exact"},  # type: ignore[dict-item]
    "choice=exact min_clearance=1 obstacle_density_weight=4": {
        "choice": "exact",
        "min_clearance": 1,
        "obstacle_density_weight": 4.0,
    },  # type: ignore[dict-item]
}


def figures(plan: Plan, scene: Scene) -> tuple[float, float, float]:
    """Length, mean clearance, mean speed."""
    assert plan.path is not None
    cells = plan.path.cells
    near = clearance(scene.grid)[cells[:, 1], cells[:, 0]] / scene.grid.resolution
    speed = api.speed_profile(scene, plan, "dissertation").v
    return float(plan.path.arc[-1]), float(np.minimum(near, 10.0).mean()), float(speed[speed > 0].mean())


def terrain() -> None:
    """Terrain minded and not: what the ways cost on the ground as it is."""
    print("\n| map | length | cost on that ground |\n|---|---|---|")
    for name in library.names():
        document = load_map(name)
        ground = document.grid.terrain
        if ground is None or document.grid.width > 300:
            continue
        gains = []
        for query in document.queries:
            scene = Scene(document.grid, query.start, query.goal)
            blind = api.plan(replace(scene, grid=replace(document.grid, terrain=None)), choice="exact")
            minded = api.plan(scene, choice="exact")
            if blind.path is None or minded.path is None or len(blind.path.cells) < 2:
                continue
            cost = path_of(blind.path.cells, moves_for(scene), ground).cost
            gains.append((minded.path.arc[-1] / blind.path.arc[-1] - 1.0, minded.cost / cost - 1.0))
        mean = np.array(gains).mean(axis=0)
        print(f"| `{name}`, {len(gains)} queries | {mean[0]:+.1%} | {mean[1]:+.1%} |")


def traffic_density_weight() -> None:
    """Traffic minded and not, among 60 random walkers on three maps with eight seeds each."""
    print("\n| settings | ticks | waits | replans |\n|---|---|---|---|")
    for weight in (0.0, 1.0, 4.0):
        ticks = waits = replans = runs = 0
        for name in ("env-1", "env-3", "env-6"):
            document = load_map(name)
            for seed in range(8):
                query = document.queries[seed % len(document.queries)]
                scene = Scene(document.grid, query.start, query.goal)
                trace = api.simulate(
                    scene, traffic=RandomWalk(60), seed=seed, choice="exact", traffic_density_weight=weight
                )
                runs += 1
                ticks, waits, replans = ticks + trace.ticks, waits + trace.waits, replans + trace.replans
        told = " | ".join(f"{n / runs:.2f}" for n in (ticks, waits, replans))
        print(f"| `choice=exact traffic_density_weight={weight:g}` | {told} |")


def main() -> None:
    """Print the tables."""
    rows: dict[str, list[list[float]]] = {case: [] for case in CASES}
    for name in library.names():
        document = load_map(name)
        if document.grid.width > 256 or document.grid.terrain is not None:
            continue
        for query in document.queries:
            if query.start == query.goal:
                continue
            scene = Scene(document.grid, query.start, query.goal)
            plain = figures(api.plan(scene), scene)
            for case, settings in CASES.items():
                this = figures(api.plan(scene, **settings), scene)
                rows[case].append([b / a - 1.0 for a, b in zip(plain, this, strict=True)])
    print("| settings | length | mean clearance | mean speed | queries where the speed rose |")
    print("|---|---|---|---|---|")
    for case, gains in rows.items():
        g = np.array(gains)
        mean = g.mean(axis=0)
        rose = int((g[:, 2] > 1e-9).sum())
        print(f"| `{case}` | {mean[0]:+.1%} | {mean[1]:+.1%} | {mean[2]:+.1%} | {rose} of {len(g)} |")
    terrain()
    traffic_density_weight()


if __name__ == "__main__":
    main()
