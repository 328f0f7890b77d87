"""Solve the scenarios of the MovingAI MAPF benchmark in a folder, and print a table by map.

    python tools/fleet_benchmark.py FOLDER [--planner lacam] [--every 50] [--most 1000] [--robots 100,400,1000]
                                    [--scenarios 1,2] [--maps den312d,...] [--limit 30] [--within 1.0] [--seconds S]

FOLDER holds NAME.map and NAME-random-K.scen. Each scenario is asked with every number of robots, up to the lines that it
has. What is measured is the CPU time of the planner on this thread's core up to its first plan, distance tables included,
map reading, compilation and the referee left out; the referee judges every plan (vertex and swap conflicts, steps,
walls, ends, costs) and a rejection ends the run. With ``--seconds`` lacam goes on for so long, and the costs are those at
the end.
"""

from __future__ import annotations

import argparse
import math
import re
import statistics
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import lampyris
from lampyris import referee
from lampyris.io.fleet_files import read_scen_fleet
from lampyris.io.maps.load import load_map
from lampyris.kernels import _jit, loading
from lampyris.model.fleet.fleet import Fleet


@dataclass(frozen=True)
class Asked:
    """One instance and its answer."""

    map: str
    scenario: int
    robots: int
    cpu_s: float
    solved: bool
    ratio: float


def instances(given: argparse.Namespace) -> Iterator[tuple[str, int, Fleet]]:
    """Every instance that is asked for, by map and scenario."""
    for file in sorted(given.folder.glob("*.map")):
        name = file.stem
        if given.maps and name not in given.maps.split(","):
            continue
        document = load_map(file)
        for scen in sorted(given.folder.glob(f"{name}-random-*.scen")):
            number = int(re.search(r"-random-(\d+)\.scen$", scen.name)[1])
            if given.scenarios and str(number) not in given.scenarios.split(","):
                continue
            whole = read_scen_fleet(scen, document).fleet
            counts = range(given.every, given.most + 1, given.every)
            if given.robots:
                counts = [int(n) for n in given.robots.split(",")]
            for robots in counts:
                if robots <= len(whole.robots):
                    yield name, number, Fleet(whole.grid, whole.robots[:robots])


def ask(name: str, number: int, fleet: Fleet, given: argparse.Namespace) -> Asked:
    """Plan one instance, have the plan judged, and measure."""
    from lampyris.planning.fleet import registry

    planner = registry.make(given.planner, {"improve": False} if given.planner == "lacam" else None)
    from lampyris._core import cancellation
    from lampyris._core.cancellation import Cancelled

    began, loaded = time.process_time(), loading.seconds()
    try:
        with cancellation.watching(given.limit):
            plan = planner.plan(fleet, given.seed)
    except Cancelled:
        return Asked(name, number, len(fleet), time.process_time() - began, False, math.nan)
    cpu = time.process_time() - began - (loading.seconds() - loaded)
    if given.seconds is not None and given.planner == "lacam":
        plan = lampyris.plan_fleet(fleet, seed=given.seed, budget=lampyris.Budget(seconds=given.seconds))
    referee.demand(referee.check_fleet_plan(plan, fleet, every=False))
    ratio = plan.sum_of_costs / plan.lower_bound if plan else math.nan
    return Asked(name, number, len(fleet), cpu, bool(plan), ratio)


def row(name: str, of: list[Asked], within: float) -> str:
    """One line of the table."""
    solved = [one for one in of if one.solved]
    times = sorted(one.cpu_s for one in of)
    quick = sum(one.solved and one.cpu_s <= within for one in of)
    ratio = math.exp(statistics.fmean(math.log(one.ratio) for one in solved)) if solved else math.nan
    return (
        f"{name:<24} {len(of):>9} {len(solved) / len(of):>8.2%} {quick / len(of):>9.2%} "
        f"{statistics.median(times):>9.3f} {times[-1]:>9.3f} {ratio:>7.3f}"
    )


def main() -> int:
    """Print the table; 1 if fewer than 99 % were solved in time."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--planner", default="lacam")
    parser.add_argument("--every", type=int, default=50)
    parser.add_argument("--most", type=int, default=1000)
    parser.add_argument("--robots", default="", help="these numbers instead of --every and --most")
    parser.add_argument("--scenarios", default="")
    parser.add_argument("--maps", default="")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--limit", type=float, default=30.0, help="seconds of wall time for each instance")
    parser.add_argument("--within", type=float, default=1.0, help="seconds of CPU time that count as quick")
    parser.add_argument("--seconds", type=float, default=None)
    given = parser.parse_args()
    _jit.prefer_compiled()
    lampyris.plan_fleet(lampyris.random_fleet(lampyris.load_grid("guide"), 5), given.planner)
    found = [ask(*instance, given) for instance in instances(given)]
    if not found:
        print(f"no scenario in {given.folder}", file=sys.stderr)
        return 2
    within = f"in {given.within:g} s"
    print(f"planner {given.planner}, seed {given.seed}, CPU seconds of the first plan")
    print(
        f"{'map':<24} {'instances':>9} {'solved':>8} {within:>9} {'median s':>9} {'most s':>9} {'costs':>7}"
    )
    for name in dict.fromkeys(one.map for one in found):
        print(row(name, [one for one in found if one.map == name], given.within))
    print(row("all", found, given.within))
    late = [one for one in found if not one.solved or one.cpu_s > given.within]
    for one in late:
        what = f"{one.cpu_s:.2f} s" if one.solved else "not solved"
        print(f"  {one.map}-random-{one.scenario}, {one.robots} robots: {what}")
    return 0 if len(late) <= len(found) / 100 else 1


if __name__ == "__main__":
    sys.exit(main())
