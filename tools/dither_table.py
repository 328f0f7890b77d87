"""Changes of mind, waits and ticks among obstacles whose ways nobody knows: a Markdown table.

    python tools/dither_table.py

Three bundled maps, eight seeds each, octile moves; 40 random walkers, then 15 crossing obstacles that do not
wait for the robot. A change of mind is a new plan that leaves the old one's way although its next step could
be made.
"""

from __future__ import annotations

from typing import Any

from lampyris import api
from lampyris.io.maps.load import load_map
from lampyris.model.scene import Scene
from lampyris.model.traffic import Crossing, ObstacleSpec, RandomWalk

MAPS = ("env-1", "env-3", "env-6")
SEEDS = range(8)
CASES: tuple[tuple[str, dict[str, Any]], ...] = (
    ("ad-gso", {"choice": "exact"}),
    ("dstar-lite", {}),
    ("sipp", {"margin": 0}),
    ("sipp", {"margin": 1}),
    ("sipp", {"margin": 3}),
    ("sipp", {"horizon": 1}),
    ("sipp", {"horizon": 4}),
    ("sipp", {"horizon": 8}),
    ("sipp", {"forecast": "still"}),
    ("sipp", {"forecast": "reach", "horizon": 1}),
)


def row(planner: str, settings: dict[str, Any], traffic: ObstacleSpec) -> str:
    """One line of the table."""
    arrived = ticks = path_switches = waits = runs = 0
    for name in MAPS:
        document = load_map(name)
        for seed in SEEDS:
            query = document.queries[seed % len(document.queries)]
            scene = Scene(document.grid, query.start, query.goal)
            trace = api.simulate(scene, planner, traffic=traffic, seed=seed, **settings)
            runs += 1
            arrived += trace.arrived
            ticks, path_switches, waits = (
                ticks + trace.ticks,
                path_switches + trace.path_switches,
                waits + trace.waits,
            )
    told = ", ".join(f"{k}={v}" for k, v in settings.items())
    return (
        f"| `{planner}` {told} | {arrived} of {runs} | {ticks / runs:.1f} | {waits / runs:.2f} "
        f"| {100 * path_switches / ticks:.2f} |"
    )


def main() -> None:
    """Print it."""
    for title, traffic in (("40 random walkers", RandomWalk(40)), ("15 crossing obstacles", Crossing(15))):
        print(f"\n{title}:\n")
        print("| planner | arrived | ticks | waits a run | changes of mind in 100 ticks |")
        print("|---|---|---|---|---|")
        for planner, settings in CASES:
            print(row(planner, settings, traffic), flush=True)


if __name__ == "__main__":
    main()
