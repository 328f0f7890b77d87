"""Every planner on one map with one query, in one picture: docs/img/planners.png, for the README.

    python tools/gallery.py [MAP] [OUT]

Planners that see traffic are shown on the bare map like the others. Each panel says what the path costs beside
the best one, and what it took.
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.colors import ListedColormap

from lampyris import api
from lampyris.io.maps.load import load_map
from lampyris.model.scene import Scene
from lampyris.planning import registry
from lampyris.report import style

matplotlib.use("Agg")
from matplotlib import pyplot as plt

ANY_ANGLE = ("theta-star", "lazy-theta-star")
FAMILIES = (
    ("the dissertation's", "#c0392b", ("ad-gso", "dstar-lpso", "dstar16-lpso")),
    ("one query", "#2c5f8a", ("astar", "dijkstra", "jps", "bidirectional-astar", "fastest", "fastest-time", *ANY_ANGLE)),
    ("sampling", "#7d6608", ("rrt", "rrt-connect", "rrt-star", "informed-rrt-star", "bit-star")),
    ("models of the map", "#5d6d7e", ("visibility-graph", "polyanya", "voronoi", "quadtree")),
    ("incremental", "#1f7a5c", ("dstar", "focussed-dstar", "lpa-star", "dstar-lite")),
    ("sees traffic", "#8e5ea2", ("sipp", "space-time-astar")),
    ("swarms", "#b9770e", (
        "gso", "igso", "pso", "lpso", "apso", "ipso", "pso-apf", "diversity-pso", "ant-system", "mmas-dstar",
    )),
)  # fmt: skip


def main() -> None:
    """Draw it."""
    name = sys.argv[1] if len(sys.argv) > 1 else "env-1"
    out = Path(sys.argv[2] if len(sys.argv) > 2 else "docs/img/planners.png")
    document = load_map(name)
    query = document.queries[0]
    scene = Scene(document.grid, query.start, query.goal)
    panels = [(kind, colour, p) for kind, colour, names in FAMILIES for p in names]
    missing = set(registry.names()) - {p for _, _, p in panels}
    if missing:
        raise SystemExit(f"not in the picture: {sorted(missing)}")
    columns = 6
    rows = -(-len(panels) // columns)
    figure, axes = plt.subplots(
        rows, columns, figsize=(columns * 2.1, rows * 2.65), dpi=110, layout="constrained"
    )
    for axis in axes.flat:
        axis.set_axis_off()
    for axis, (kind, colour, planner) in zip(axes.flat, panels, strict=False):
        axis.set_axis_on()
        axis.set_xticks([])
        axis.set_yticks([])
        axis.imshow(scene.grid.blocked, cmap=ListedColormap(["#f7f7f4", "#2b2d33"]), interpolation="nearest")
        plan = api.plan(scene, planner)
        label = plan.status.value
        if plan.path is not None:
            line = plan.path.cells if plan.waypoints is None else plan.waypoints
            axis.plot(line[:, 0], line[:, 1], color=colour, linewidth=1.8)
            gap = "best" if not plan.gap else f"+{plan.gap:.1%}"
            label = f"{plan.cost:.1f} cells, {gap}"
            if plan.waypoints is not None:
                legs = np.diff(plan.waypoints.astype(float), axis=0)
                label = f"{np.hypot(legs[:, 0], legs[:, 1]).sum():.1f} cells in lines"
        axis.plot(*query.start, "o", color=style.START, markersize=4)
        axis.plot(
            *query.goal, "*", color=style.GOAL, markersize=8, markeredgecolor="black", markeredgewidth=0.5
        )
        axis.set_title(planner, fontsize=8.5, color=colour, fontweight="bold", pad=3)
        axis.set_xlabel(f"{label}\n{plan.expansions:,} expansions", fontsize=6.5, labelpad=2)
        for side in axis.spines.values():
            side.set_color("#cccccc")
        print(f"{kind:18s} {planner:22s} {label}, {plan.expansions} expansions")
    figure.suptitle(f"Every planner of lampyris on {name}, from {query.start} to {query.goal}", fontsize=11)
    figure.savefig(out, metadata={"Software": ""})


if __name__ == "__main__":
    main()
