"""Measures: what a study tells of a run, in words for people, and which way is better."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

Better: TypeAlias = Literal["less", "more", ""]


@dataclass(frozen=True, slots=True)
class Measure:
    """A number of a run.

    Parameters
    ----------
    name : of the metric in a row.
    title : head of its column.
    better : which way; empty where neither is.
    about : what it is, for who has not seen the code.
    scale : what it is multiplied with to be shown.
    """

    name: str
    title: str
    better: Better
    about: str
    scale: float = 1.0


SAFETY = (
    Measure("collisions", "collisions", "less", "the robot's own fault"),
    Measure("hits", "hits", "less", "an obstacle ran into the standing robot"),
    Measure(
        "near_misses",
        "near misses",
        "less",
        "ticks with less than a cell of free room to an obstacle; "
        "of a drive, times that it came under half a cell",
    ),
    Measure("near_m", "nearest obstacle (m)", "more", "least free distance to an obstacle in the whole run"),
)
ON_FLEET = (
    Measure(
        "sum_of_costs", "sum of costs", "less",
        "ticks until each robot stays at its goal permanently, waiting included, summed over the robots",
    ),
    Measure(
        "ratio", "cost / shortest", "less", "the sum of costs over the sum of the robots' own shortest paths on the bare map, "
        "which no plan undercuts; the same for all planners, whatever more one of them has proved",
    ),
    Measure("makespan", "makespan (ticks)", "less", "the tick of the last arrival"),
)  # fmt: skip
ON_FLEET_DRIVE = (
    Measure("throughput", "throughput (tasks a tick)", "more", "of lifelong fleets: tasks done in a tick"),
    Measure("service_ticks", "service time (ticks)", "less", "of lifelong fleets: from release to completion of a task"),
    Measure("utilisation", "utilisation (%)", "more", "of lifelong fleets: share of robots and ticks with a task", 100.0),
    Measure("robots_arrived", "robots arrived (%)", "more", "of fleets that drive: share of the robots", 100.0),
    Measure("lateness_mean_s", "lateness (s)", "less", "of fleets that drive: mean seconds after the plan's time of arrival"),
    Measure("lateness_max_s", "greatest lateness (s)", "less", "of fleets that drive: the same of the latest robot"),
    Measure(
        "wait_order_s", "waiting for others (s)", "less",
        "of fleets that drive: mean seconds that a robot stood until another had left a cell",
    ),
    Measure("duration_s", "duration (s)", "less", "of fleets that drive: seconds until the last robot stood"),
    Measure("contacts", "contacts", "less", "of fleets that drive: pairs of robots that touched"),
    Measure("in_motion", "in motion (%)", "more", "of fleets: share of the time in which robots moved", 100.0),
)  # fmt: skip
ON_PATH = (
    *ON_FLEET,
    *ON_FLEET_DRIVE,
    Measure("cost", "cost (cells)", "less", "length of the path by the step costs of the study, in cells; "
            "of an any-angle planner that of its walk from cell to cell, which simulations in ticks drive"),
    Measure("gap", "gap (%)", "less", "by how much the cost exceeds that of the shortest path", 100.0),
    Measure(
        "path_ratio", "path / map known", "less", "of a robot with a sensor: the cost of its path over that of the same planner "
        "with the map known, in the same world, where both came to the goal",
    ),
    Measure(
        "cost_m", "cost (m)", "less", "of a plan of poses: what its planner minimises, length with its prices for reversing, for "
        "changes of gear and for turning in place; planners with other prices are compared by their lengths and times",
    ),
    Measure(
        "bound", "bound", "less", "of a plan of poses: no path costs less than its cost divided by this; of lattices that speaks "
        "of paths in the lattice, of hybrid-astar of any path of the robot",
    ),
    Measure("reversals", "reversals", "less", "of poses: changes between driving ahead and in reverse"),
    Measure(
        "length_any_angle", "any-angle length (cells)", "less",
        "length of the straight lines of an any-angle plan: it can be below the least cost by steps",
    ),
    Measure(
        "length_m", "length (m)", "less", "length of the path; of an any-angle plan that of its lines, of poses that of the base"
    ),
    Measure(
        "cost_to_go", "sum of cost-to-go", "", "the cost that remains, summed over the cells visited: "
        "what the dissertation prints as path cost of the methods it compares with; no length",
    ),
)  # fmt: skip
TIME = (
    Measure(
        "ticks",
        "ticks",
        "less",
        "ticks until arrival, of runs that arrived; of a plan, its steps with its waits",
    ),
    Measure("time_s", "arrival (s)", "less", "seconds until the robot arrived, by its speeds"),
    Measure("speed_mean", "mean speed moving", "more", "mean speed while under way"),
    Measure("speed_least", "least speed", "more", "least speed while under way"),
    Measure("waits", "waits", "less", "ticks on which the robot stood; of a drive, seconds"),
    Measure("turn_deg", "turning (deg)", "less", "sum of all changes of direction"),
    Measure(
        "clearance_least_m",
        "least clearance (m)",
        "more",
        "least distance to a wall, of the disc; of poses, of the footprint",
    ),
)
WORK = (
    Measure("iterations", "iterations", "less", "rounds of the planner, whatever it calls one"),
    Measure("expansions", "expansions", "less", "cells, or poses, that the planner looked at"),
    Measure(
        "expansions_ratio", "expansions / map known", "less",
        "of a robot with a sensor: its expansions over those of the same planner with the map known, in the same world, where "
        "both came to the goal",
    ),
    Measure("replans", "replans", "less", "number of replans on the way"),
    Measure(
        "path_switches", "path switches", "less", "times that a new plan left for another route than the last"
    ),
    Measure(
        "path_switches_per_100", "path switches in 100 ticks", "less", "of the whole run, arrived or not"
    ),
)  # fmt: skip
TIMING = (
    Measure("cpu_s", "CPU (s)", "less", "processor time of the run on the machine that ran it"),
    Measure("plan_s", "planning (s)", "less", "of it, in the planner"),
    Measure("memory_b", "memory (MB)", "less", "greatest memory that the planner took", 1e-6),
)
"""Depends on the machine: stands apart, and in no page that must be the same bytes twice."""

SHARES = ("found", "arrived")
"""Reported as shares of all runs: a run that failed did neither."""

AT_GOAL = frozenset(
    (
        "cost",
        "gap",
        "path_ratio",
        "length_cells",
        "length_any_angle",
        "length_m",
        "cost_m",
        "lower_bound_m",
        "bound",
        "reversals",
        "cost_to_go",
        "turns",
        "turn_deg",
        "smoothness",
        "ticks",
        "time_s",
        *(m.name for m in ON_FLEET),
        "first_cost",
    )
)
"""Reported of runs that came to the goal: half a path is shorter than a whole one, and no merit."""

WHOLE = ("arrived", "found", "collisions")
"""Compared over all runs; all else over those that both solved, for who gives up early has little work."""

PAIRED = (
    "arrived", "cost", "throughput", "lateness_mean_s", "time_s", "ticks", "collisions", "expansions", "iterations",
)  # fmt: skip
RANKED = ("cost", "throughput", "lateness_mean_s", "time_s", "expansions")
PROFILED = ("cost", "expansions")


def cost_of(kind: str, of_poses: bool) -> str:
    """What is compared as the cost: of poses, which have no cost in cells, lengths in metres; of fleets sums of costs."""
    return "sum_of_costs" if kind == "fleet" else "length_m" if of_poses else "cost"


def compared(names: tuple[str, ...], cost: str) -> tuple[str, ...]:
    """What is compared, with a study's own measure in place of the cost in cells."""
    return tuple(cost if name == "cost" else name for name in names)


def solved_name(kind: str) -> str:
    """The measure that says that a run of a kind of study was solved."""
    return "found" if kind in ("plan", "fleet") else "arrived"


ALL = {m.name: m for m in (*SAFETY, *ON_PATH, *TIME, *WORK, *TIMING)} | {
    "found": Measure("found", "found (%)", "more", "share of all runs with a path", 100.0),
    "arrived": Measure("arrived", "arrived (%)", "more", "share of all runs that came to the goal", 100.0),
}
"""Every measure by its name."""
