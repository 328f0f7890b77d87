"""Solve the scenarios of the MovingAI MAPF benchmark in a folder, and print a table by map.

    python tools/fleet_benchmark.py FOLDER [--planner lacam] [--every 50] [--most 1000] [--robots 100,400,1000]
                                    [--scenarios 1,2] [--maps den312d,...] [--limit 30] [--within 1.0] [--seconds S]
                                    [--record FILE]

FOLDER holds NAME.map and NAME-random-K.scen. Each scenario is asked with every number of robots, up to the lines that it
has. What is measured is the CPU time of the planner on this thread's core up to its first plan, distance tables included,
map reading, compilation and the referee left out; the referee judges every plan (vertex and swap conflicts, steps,
walls, ends, costs) and a rejection ends the run. With ``--seconds`` lacam and lns go on until the process has used so many
seconds of CPU time for the instance, tables and first plan included, and the costs are those at the end.

With ``--record`` each answer is appended to FILE (JSON lines), and instances that FILE has with the same planner, seed,
seconds, limit and version of lampyris are not planned again: an interrupted run is resumed, and several runs together make
one table.
"""

from __future__ import annotations

import argparse
import json
import math
import re
import statistics
import sys
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import lampyris
from lampyris import referee
from lampyris._core import cancellation
from lampyris._core.cancellation import Cancelled
from lampyris.io.fleet_files import read_scen_fleet
from lampyris.io.maps.load import load_map
from lampyris.kernels import _jit, loading
from lampyris.model.fleet.fleet import Fleet
from lampyris.planning.fleet import registry


@dataclass(frozen=True)
class Asked:
    """One instance and its answer."""

    map: str
    scenario: int
    robots: int
    cpu_s: float
    solved: bool
    ratio: float | None
    """Sum of costs over the lower bound; None: not solved."""


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
    settings = {"improve": False} if given.planner == "lacam" and given.seconds is None else None
    planner = registry.make(given.planner, settings)
    began, loaded = time.process_time(), loading.seconds()

    def spent() -> float:
        """Seconds of CPU time since the planner began."""
        return time.process_time() - began - (loading.seconds() - loaded)

    def progress(_: int, costs: int | None) -> None:
        """End the planner when its CPU time is used, once it has a plan."""
        if given.seconds is not None and costs is not None and spent() >= given.seconds:
            raise Cancelled

    limit = given.limit if given.seconds is None else 100.0 * given.seconds
    try:
        with cancellation.watching(limit):
            plan = planner.plan(fleet, given.seed, None, progress)
    except Cancelled:
        return Asked(name, number, len(fleet), spent(), False, None)
    cpu = spent()
    referee.demand(referee.check_fleet_plan(plan, fleet, every=False))
    ratio = plan.sum_of_costs / plan.lower_bound if plan else None
    return Asked(name, number, len(fleet), cpu, bool(plan), ratio)


def answers(given: argparse.Namespace) -> Iterator[Asked]:
    """The answers to all instances, those of the record first read from there."""
    setup = {
        "planner": given.planner, "seed": given.seed, "seconds": given.seconds, "limit": given.limit,
        "version": lampyris.__version__,
    }  # fmt: skip
    known: dict[tuple[str, int, int], Asked] = {}
    if given.record is not None and given.record.exists():
        for line in given.record.read_text().splitlines():
            row = json.loads(line)
            if {key: row.pop(key, None) for key in setup} == setup:
                known[row["map"], row["scenario"], row["robots"]] = Asked(**row)
    for name, number, fleet in instances(given):
        one = known.get((name, number, len(fleet)))
        if one is None:
            one = ask(name, number, fleet, given)
            if given.record is not None:
                with given.record.open("a") as file:
                    file.write(json.dumps({**setup, **asdict(one)}) + "\n")
        yield one


def row(name: str, of: list[Asked], within: float) -> str:
    """One line of the table."""
    solved = [one for one in of if one.solved]
    times = sorted(one.cpu_s for one in of)
    quick = sum(one.solved and one.cpu_s <= within for one in of)
    ratio = (
        math.exp(statistics.fmean(math.log(one.ratio) for one in solved if one.ratio)) if solved else math.nan
    )
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
    parser.add_argument("--seconds", type=float, default=None, help="of CPU time, to improve each plan")
    parser.add_argument(
        "--record", type=Path, default=None, help="file of answers, read first and appended to"
    )
    given = parser.parse_args()
    _jit.prefer_compiled()
    lampyris.plan_fleet(lampyris.random_fleet(lampyris.load_grid("guide"), 5), given.planner)
    found = list(answers(given))
    if not found:
        print(f"no scenario in {given.folder}", file=sys.stderr)
        return 2
    if given.seconds is not None:
        given.within = math.inf
    within = f"in {given.within:g} s" if given.seconds is None else "in time"
    what = "the first plan" if given.seconds is None else f"a plan that is improved for {given.seconds:g}"
    print(f"planner {given.planner}, seed {given.seed}, CPU seconds of {what}")
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
