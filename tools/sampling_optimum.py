"""How near planners that sample come to the shortest path: a Markdown table.

    python tools/sampling_optimum.py env-1 env-2 --seconds 2    # 10 seeds, the planners' default samples
    python tools/sampling_optimum.py --seconds 1 --samples 1000000    # all bundled maps, about 15 min of CPU time

For a point robot, octile moves and plain ground the planner ``visibility-graph`` gives the shortest path of straight lines
between cell centres. The limit is of processor time. Each path is checked by the
referee, as those of every call of ``lampyris.plan``.
"""

from __future__ import annotations

import argparse
import statistics
import time
from typing import Any
from unittest import mock

import lampyris
from lampyris.io.maps import library
from lampyris.io.maps.load import load_map

PLANNERS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("rrt-star", {}),
    ("informed-rrt-star", {}),
    ("bit-star", {}),
)


def main() -> None:
    """Print a row for each map and planner."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("maps", nargs="*", default=list(library.names()), help="default: all bundled maps")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--seconds", type=float, default=2.0, help="limit of a call, CPU time")
    parser.add_argument("--samples", type=int, help="samples of a call, at most (default: the planner's)")
    given = parser.parse_args()
    settings = {} if given.samples is None else {"samples": given.samples}
    print("| map | planner | shortest, cells | longer by: mean, most | CPU ms, median |")
    print("|---|---|---:|---:|---:|")
    for name in given.maps:
        document = load_map(name)
        query = document.queries[0] if document.queries else document
        scene = lampyris.Scene(lampyris.Grid(document.grid.blocked), query.start, query.goal)
        best = lampyris.plan(scene, "visibility-graph").any_angle_length
        assert best is not None
        for planner, more in PLANNERS:
            lampyris.plan(scene, planner, record=False, **more)  # machine code is loaded
            longer, spent, missed = [], [], 0
            for seed in range(given.seeds):
                began = time.process_time()
                with mock.patch.object(time, "perf_counter", time.process_time):  # the limit's seconds
                    plan = lampyris.plan(
                        scene,
                        planner,
                        seed=seed,
                        record=False,
                        budget=lampyris.Budget(seconds=given.seconds),
                        **(settings | more),
                    )
                spent.append(1e3 * (time.process_time() - began))
                if plan.any_angle_length is None:
                    missed += 1
                else:
                    longer.append(plan.any_angle_length / best - 1.0)
            most = f"{statistics.fmean(longer):.3%}, {max(longer):.3%}" if longer else ""
            most += f" (no path: {missed} of {given.seeds})" if missed else ""
            label = f"`{planner}`" + (", seeded" if more else "")
            print(f"| {name} | {label} | {best:.2f} | {most} | {statistics.median(spent):.0f} |", flush=True)


if __name__ == "__main__":
    main()
