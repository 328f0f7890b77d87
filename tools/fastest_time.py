"""Travel time of the fastest path beside that of the shortest, on bundled maps: a Markdown table.

    python tools/fastest_time.py --law physical --widest 1024
    python tools/fastest_time.py --law blind --widest 256
    python tools/fastest_time.py --picture docs/img/fastest-time.png

Both paths are profiled under the same law with limits of acceleration, on their cells and (to 256 cells
a side) pulled straight and rounded. Every stored query counts alike. ``bound`` is the fastest path's time over the
least travel time under the static caps, which no path of the lattice undercuts. Terrain is left out: speed laws know
none.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

import lampyris
from lampyris.io.maps import library
from lampyris.io.maps.load import load_map
from lampyris.model.plan import Plan
from lampyris.model.profile import Profile
from lampyris.report import style
from lampyris.report.style import speed_map

ROBOT = lampyris.Robot(radius=0.3)
STRAIGHT = 256
"""Widest map of which paths are pulled straight, too."""


def driven(
    scene: lampyris.Scene, planner: str, law: str, **settings: Any
) -> tuple[Plan, list[Profile], float]:
    """A plan, its profiles on the cells and pulled straight, and the CPU seconds of planning."""
    began = time.process_time()
    plan = lampyris.plan(scene, planner, record=False, **settings)
    took = time.process_time() - began
    if plan.path is None:
        return plan, [], took
    smooth = ("none", "straight") if max(scene.grid.blocked.shape) <= STRAIGHT else ("none",)
    return plan, [lampyris.speed_profile(scene, plan, law, smooth=way) for way in smooth], took


def row(name: str, law: str, most: int) -> str | None:
    """The row of a map; None if nothing was found."""
    document = load_map(name)
    queries = document.queries[:most] or ([document] if document.start is not None else [])
    blind = {"blind": True} if law == "blind" else {}
    rows = []
    grid = replace(document.grid, terrain=None)
    for query in queries:
        scene = lampyris.Scene(grid, query.start, query.goal, robot=ROBOT)
        short = driven(scene, "astar", law)
        if not short[1]:
            continue
        fast = driven(scene, "fastest-time", law, **blind)
        bound = fast[0].time_lower_bound
        assert bound is not None
        times = [one.duration for one in (*short[1], *fast[1])]
        lengths = [float(one[1][0].s[-1]) for one in (short, fast)]
        assert bound <= min(times[0], times[len(fast[1])]) * (1 + 1e-9), name
        straight = (times[1], times[3]) if len(times) == 4 else (np.nan, np.nan)
        rows.append(
            (short[1][0].duration, fast[1][0].duration, *lengths, bound, *straight, short[2], fast[2])
        )
    if not rows:
        return None
    a = np.array(rows)
    m = a.mean(axis=0)
    count = len(rows)
    faster = int((a[:, 1] < a[:, 0] - 1e-9).sum())
    pulled = f"{m[5]:.2f} | {m[6]:.2f} | {m[6] / m[5] - 1:+.1%}" if np.isfinite(m[5]) else " | | "
    return (
        f"| `{name}`, {count} | {m[0]:.2f} | {m[1]:.2f} | {m[1] / m[0] - 1:+.1%} | {faster} of {count} | "
        f"{m[3] / m[2] - 1:+.1%} | {(a[:, 1] / a[:, 4]).mean():.3f} | {pulled} | {m[7]:.2f} | {m[8]:.2f} |"
    )


def table(law: str, widest: int, most: int) -> None:
    """Print the table of a law."""
    print(
        "| map, queries | shortest, s | fastest-time, s | | faster | length | time / bound | pulled straight: shortest, s | "
        "fastest-time, s | | CPU s, shortest | CPU s, fastest-time |"
    )
    print("|" + "---|" * 12)
    for name in library.names():
        if max(load_map(name).grid.blocked.shape) > widest:
            continue
        line = row(name, law, most)
        if line is not None:
            print(line, flush=True)


def picture(out: Path, name: str, law: str) -> None:
    """Draw the two paths side by side, coloured by speed."""
    document = load_map(name)
    query = document.queries[0] if document.queries else document
    grid = replace(document.grid, terrain=None)
    scene = lampyris.Scene(grid, query.start, query.goal, robot=ROBOT)
    short = driven(scene, "astar", law)
    fast = driven(scene, "fastest-time", law, **({"blind": True} if law == "blind" else {}))
    tall = grid.height / grid.width
    figure = Figure(figsize=(10.0, 4.5 * tall + 0.75), dpi=120, facecolor="white")
    top = max(float(one[1][0].v.max()) for one in (short, fast))
    lines = None
    for k, (word, (plan, profiles, _)) in enumerate(
        (("shortest path", short), ("path of fastest-time", fast))
    ):
        axes = figure.add_axes((0.01 + 0.46 * k, 0.02, 0.45, 4.5 * tall / (4.5 * tall + 0.75)))
        axes.imshow(grid.blocked, cmap=ListedColormap(["#faf9f5", "#20242c"]), interpolation="nearest")
        assert plan.cells is not None
        profile, xy = profiles[0], plan.cells.astype(float)
        lines = LineCollection(list(np.stack((xy[:-1], xy[1:]), axis=1)), cmap=speed_map(), linewidths=2.6)
        lines.set_array(0.5 * (profile.v[:-1] + profile.v[1:]))
        lines.set_clim(0.0, top)
        axes.plot(xy[:, 0], xy[:, 1], color="#20242c", linewidth=4.2, zorder=1.5)
        axes.add_collection(lines)
        axes.plot(*xy[0], "o", color=style.START, markeredgecolor="white", markersize=8, zorder=5)
        axes.plot(*xy[-1], "o", color=style.GOAL, markeredgecolor="white", markersize=8, zorder=5)
        axes.set_title(f"{word}: {profile.s[-1]:.4g} m in {profile.duration:.4g} s", fontsize=10)
        axes.set_xticks([])
        axes.set_yticks([])
    figure.text(0.01, 0.985, f"{name}, law {law}", fontsize=12, fontweight="bold", va="top")
    assert lines is not None
    bar = figure.colorbar(lines, cax=figure.add_axes((0.935, 0.08, 0.014, 0.7)))
    bar.set_label("speed (m/s)", fontsize=9)
    figure.savefig(out, metadata={"Software": None})


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--law", default="physical", choices=("physical", "blind"))
    parser.add_argument("--widest", type=int, default=1024, help="greatest side of a map, cells")
    parser.add_argument("--most", type=int, default=3, help="queries of a map")
    parser.add_argument("--picture", type=Path)
    parser.add_argument("--map", default="office-120")
    given = parser.parse_args()
    if given.picture is not None:
        picture(given.picture, given.map, given.law)
    else:
        table(given.law, given.widest, given.most)
