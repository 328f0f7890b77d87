"""Planners of fleets compared with those of four libraries: time and costs; steps of PIBT, ORCA and swarms."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from benchmarks.about import versions
from benchmarks.figures import Figure, Section, Spread, Table, Verdict
from benchmarks.fleet_rivals import CuplanPibt, Pathplanning, PymapfLacam, Rvo2, Solved, W9Cbs
from benchmarks.maps import published_folder, random_map
from scipy.spatial import cKDTree

from lampyris.api import load_grid
from lampyris.fleets import load_fleet, random_fleet
from lampyris.kernels._jit import compiled_only
from lampyris.model.fleet.fleet import Fleet
from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.settings.fleet_drive import FleetDriveSettings
from lampyris.model.settings.swarm import SwarmSettings
from lampyris.planning.base import Budget
from lampyris.planning.fleet import registry
from lampyris.planning.fleet.distance_tables import tables_of
from lampyris.planning.fleet.pibt import PibtRun
from lampyris.referee import check_fleet_plan
from lampyris.sim.fleet.reactive import OrcaRun
from lampyris.sim.swarm.placing import draw_starts
from lampyris.sim.swarm.simulation import RobotSwarm
from lampyris.swarms import three_peaks

TITLE = "Fleets compared with pymapf, cuplan, pathplanning and w9-pathfinding"
HOW = """All planners get the same map, starts and goals; the first scenario of maps of the MovingAI MAPF benchmark if they are at
hand, else generated maps. Processor time of the thread, the middle of the rounds; each planner of ours plans once before. Ours:
from the map and the robots to the paths, distance tables included; every plan, ours and theirs, is judged by the referee, outside
of what is timed. pymapf (Python): `LaCAM().solve`, its first plan. cuplan: `PIBT(backend="cpu").solve`, NumPy; its other backend
is CUDA, which is not at hand here. pathplanning (C++): its EECBS, weight 1.1; its search alone counts, not the graph that it
makes before nor its own check of the paths, in Python both. w9-pathfinding (C++): its CBS with disjoint splitting and
`edge_collision`; its grid is made before. A rival's call may take 30 s of wall time, so on a busy machine it may end with less
processor time. An instance counts for a ratio if both solve it; what one of them does not solve is listed. `lacam` compared with
cuplan's PIBT is a complete search compared with an incomplete rule. PIBT: steps of 10,000 robots on a random map of 256 x 256
cells, 10 % blocked, the swap rule on, distance tables not counted. ORCA: 1,000 discs of radius 0.3 on 100 x 100 open cells
of 1 m, 60 s in steps of 0.1 s, ten neighbours, 2 s ahead; RVO2 by pyrvo (C++), if it is installed, is given each disc's preferred
velocity, straight to its goal, which ours works out in its step and which is not counted for theirs; pairs touch if they
overlap by more than a millionth of a metre at the end of a step. Swarm: iterations of robots that measure, broadcast, choose
and drive, the referee not counted; a small step is the part of an iteration in which robots are moved once."""

LIMIT_S = 30.0
"""Seconds of wall time of a rival's call."""
SECOND = 1.0
ASKED = {"pymapf LaCAM": 50.0, "cuplan PIBT": 20.0, "pathplanning eecbs": 20.0, "w9 CBS": 5.0}
MATCHES: tuple[tuple[str, dict[str, Any], Callable[[], Any], dict[str, tuple[int, ...]]], ...] = (
    ("lacam", {"improve": False}, PymapfLacam, {
        "random-32-32-20": (50, 100, 200), "empty-48-48": (100, 300), "room-64-64-8": (50, 100), "den312d": (100,),
    }),
    ("lacam", {"improve": False}, CuplanPibt, {
        "random-32-32-20": (50, 100), "empty-48-48": (100, 300), "den312d": (50, 100),
    }),
    ("eecbs", {"weight": 1.1}, lambda: Pathplanning("eecbs"), {
        "random-32-32-20": (20, 40, 60, 80), "empty-48-48": (50, 100, 200), "den312d": (20, 50),
    }),
    ("cbs", {}, W9Cbs, {"random-32-32-20": (10, 20), "empty-48-48": (20, 40), "den312d": (10, 20)}),
)  # fmt: skip
"""A planner of ours, its settings, a rival, and numbers of robots by map."""
STEP_MS, ORCA_MS, SWARM_MS = 3.0, 0.7, 1.0


def fleets(counts: dict[str, tuple[int, ...]], quick: bool) -> Iterator[tuple[str, Fleet]]:
    """The instances, by name."""
    folder = published_folder()
    there = folder.with_name("mapf") if folder else None
    for name, robots in counts.items():
        if there is not None and (there / f"{name}.map").is_file():
            grid = load_grid(there / f"{name}.map")
            for n in robots[:1] if quick else robots:
                yield f"{name}, {n} robots", load_fleet(there / f"{name}-random-1.scen", grid, n)
        elif name.startswith(("random", "empty")):
            size, share = (32, 0.2) if name.startswith("random") else (48, 0.0)
            grid = Grid(~random_map(size, share))
            for n in robots[:1] if quick else robots:
                yield f"generated {name}, {n} robots", random_fleet(grid, n, seed=1)


def ours(fleet: Fleet, planner: str, settings: dict[str, Any]) -> tuple[Solved, FleetPlan]:
    """A planner of ours on a fleet."""
    chosen = registry.make(planner, settings)
    # Small questions are answered without compiled code at first: their time would be that of another program.
    with compiled_only():
        begin = time.thread_time()
        plan = chosen.plan(fleet, 0)
        spent = time.thread_time() - begin
    verdict = check_fleet_plan(plan, fleet)
    assert verdict is None, verdict
    return Solved(spent, plan.sum_of_costs), plan


def matched(quick: bool) -> tuple[list[tuple[str, ...]], list[Figure], list[Verdict]]:
    """Every match: rows, figures and what is claimed of each rival."""
    rows, figures, verdicts = [], [], []
    for planner, settings, make, counts in MATCHES:
        rival, mine, factors = make(), [], []
        ours(random_fleet(Grid(~random_map(32, 0.1)), 10, seed=1), planner, settings)
        for task, fleet in fleets(counts, quick):
            times = [ours(fleet, planner, settings)[0] for _ in range(1 if quick else 5)]
            theirs = rival(fleet, LIMIT_S)
            name = f"{planner} {settings['weight']:g}" if "weight" in settings else planner
            rows.append((
                task, name, _ms(times[0].costs, [t.seconds for t in times]), str(times[0].costs or "no plan"),
                rival.name, _ms(theirs.costs, [theirs.seconds]), str(theirs.costs or "no plan"),
            ))  # fmt: skip
            print(rows[-1], flush=True)
            if times[0].costs is None or theirs.costs is None:
                continue
            spread, other = Spread.of([1e3 * t.seconds for t in times]), Spread.of([1e3 * theirs.seconds])
            figures.append(Figure(f"{task}, {name}", "ms", spread, rival.name, other))
            factors.append(other.middle / spread.middle)
            mine.append(times[0].costs / theirs.costs)
        if factors:
            mean, costs = statistics.geometric_mean(factors), statistics.geometric_mean(mine)
            asked = ASKED[rival.name]
            text = (
                f"{planner} compared with {rival.name}: at least {asked:g} times as fast in geometric mean: {mean:.3g} "
                f"({min(factors):.3g} to {max(factors):.3g}, {len(factors)} instances); costs {costs:.3f} of theirs"
            )
            verdicts.append(Verdict(mean >= asked, text))
    return rows, figures, verdicts


def costs_in_a_second(quick: bool) -> list[tuple[str, ...]]:
    """Sums of costs after a second of wall time: ours and LaCAM* of pathplanning, which has no first plan to time."""
    rows = []
    counts = {"random-32-32-20": (100,), "empty-48-48": (200,)}
    for task, fleet in fleets(counts, quick):
        row = [task]
        for planner in ("lacam", "lns"):
            plan = _within(fleet, planner)
            row.append(str(plan.sum_of_costs or "no plan"))
        theirs = Pathplanning("lacam_star")(fleet, SECOND)
        rows.append((*row, str(theirs.costs or "no plan")))
        print(rows[-1], flush=True)
    return rows


def _within(fleet: Fleet, planner: str) -> FleetPlan:
    from lampyris.fleets import plan_fleet

    return plan_fleet(fleet, planner, budget=Budget(seconds=SECOND))


def steps(quick: bool) -> list[Figure]:
    """Milliseconds of a step of PIBT and of an iteration of a swarm."""
    side, robots = (128, 1000) if quick else (256, 10_000)
    fleet = random_fleet(Grid(~random_map(side, 0.1)), robots, seed=1)
    run = PibtRun(tables_of(fleet), swap=True, seed=1)
    run.go_on(5)
    each = []
    while not run.solved and len(each) < (5 if quick else 40):
        since, begin = run.tick, time.thread_time()
        run.go_on(run.tick + 10)
        each.append(1e3 * (time.thread_time() - begin) / (run.tick - since))
    figures = [
        Figure(f"PIBT, {robots:,} robots, {side} x {side} cells, swap rule on", "ms a step", Spread.of(each))
    ]
    figures.append(orca(quick))
    robots = 200 if quick else 1000
    grid = load_grid("env-6")
    settings = SwarmSettings().on(grid)
    places = draw_starts(grid, robots, settings.radius or 0.0, 1e-6, np.random.default_rng(1))
    swarm = RobotSwarm(grid, (three_peaks(grid),), settings, places, 1)
    swarm.advance()
    each = []
    for _ in range(10 if quick else 100):
        begin = time.thread_time()
        swarm.advance()
        each.append(1e3 * (time.thread_time() - begin))
    name = f"swarm, {robots:,} robots on env-6"
    figures.append(Figure(name, "ms a small step", Spread.of([one / settings.steps for one in each])))
    figures.append(
        Figure(name + ", whole", f"ms an iteration of {settings.steps} small steps", Spread.of(each))
    )
    return figures


def orca(quick: bool) -> Figure:
    """Milliseconds of a step of ORCA, ours and RVO2's; prints arrivals and pairs that touched."""
    robots, last = (200, 50) if quick else (1000, 600)
    grid = Grid(np.zeros((100, 100), dtype=bool))
    fleet = random_fleet(grid, robots, seed=1)
    settings = FleetDriveSettings(policy="orca")
    own = Robot(radius=0.3)
    run = OrcaRun(fleet, [own] * robots, settings, tables_of(fleet), last)
    run.go_on(5)
    each = []
    while run.done < last:
        since, begin = run.done, time.thread_time()
        run.go_on(run.done + 10)
        each.append(1e3 * (time.thread_time() - begin) / max(1, run.done - since))
        if run.done == since:  # all have arrived
            break
    starts, goals = ((np.array(ends, dtype=np.float64) + 0.5) for ends in (fleet.starts, fleet.goals))
    told = [("lampyris", run.places())]
    other, beside = "", None
    try:
        rival = Rvo2(
            starts, goals, own.radius, own.v_max, settings.neighbours, settings.robot_horizon, settings.period
        )
    except ImportError:
        print("pyrvo is not installed: ORCA is not compared")
    else:
        theirs, track = [], [starts]
        for _ in range(last):
            theirs.append(1e3 * rival.step())
            track.append(rival.places)
        told.append((Rvo2.name, np.array(track)))
        other, beside = Rvo2.name, Spread.of(theirs)
    for name, track in told:
        touched = set()
        for places in track:
            touched.update(cKDTree(places).query_pairs(2.0 * own.radius - 1e-6))
        gap = track[-1] - goals
        home = int(np.count_nonzero((gap * gap).sum(axis=1) < 0.25))
        print(
            f"ORCA by {name}: {home} of {robots} at their goals after {last} steps, {len(touched)} pairs touched"
        )
    return Figure(f"ORCA, {robots:,} discs in the open", "ms a step", Spread.of(each), other, beside)


def _ms(costs: int | None, seconds: list[float]) -> str:
    text = f"{1e3 * statistics.median(seconds):.3g}"
    return text if costs is not None else f"{text}, not solved"


def bench(quick: bool) -> Section:
    """Every match, steps, and costs after a second."""
    with compiled_only():
        rows, figures, verdicts = matched(quick)
        anytime = costs_in_a_second(quick)
        made = steps(quick)
    for figure, most in zip(made[:3], (STEP_MS, ORCA_MS, SWARM_MS), strict=True):
        text = f"{figure.task}: at most {most:g} {figure.unit}: {figure.ours.middle:.2f}"
        verdicts.append(Verdict(figure.ours.middle <= most, text))
    heads = ("fleet", "planner", "ms", "costs", "rival", "ms", "costs")
    tables = (
        Table(heads, tuple(rows), "First plans"),
        Table(
            ("fleet", "lacam", "lns", "pathplanning LaCAM*"),
            tuple(anytime),
            "Sums of costs after a second of wall time",
        ),
        Table(
            ("what", "unit", "middle", "quartiles", "rival", "middle"),
            tuple(
                (
                    f.task,
                    f.unit,
                    f"{f.ours.middle:.2f}",
                    f"{f.ours.low:.2f} to {f.ours.high:.2f}",
                    f.rival or "",
                    f"{f.theirs.middle:.2f}" if f.theirs else "",
                )
                for f in made
            ),
            "Steps",
        ),
    )
    return Section(
        "fleets", TITLE, HOW, tables, (*figures, *made), tuple(verdicts),
        versions(("numpy", "numba", "pymapf", "cuplan", "pathplanning", "w9-pathfinding")),
    )  # fmt: skip
