"""Fleets that drive, have tasks without end, or have discs of several sizes: by the definitions, moment by moment."""

from __future__ import annotations

import math
from itertools import combinations, pairwise

import numpy as np

from lampyris.errors import InternalFault
from lampyris.fleet_drives import simulate_fleet
from lampyris.fleets import plan_fleet
from lampyris.lifelong import lifelong_fleet
from lampyris.model.fleet.delays import Delays
from lampyris.model.fleet.fleet import Agent, Fleet
from lampyris.model.fleet.fleet_trace import FleetTrace
from lampyris.model.fleet.lifelong import FleetTask
from lampyris.model.plan import Status
from lampyris.model.robot import Robot
from lampyris_selfcheck.checks.fleets.fleet_draws import DrawnFleet
from lampyris_selfcheck.reference.fleets.discs import closest, wall_gap
from lampyris_selfcheck.reference.fleets.fleet_rules import broken, cross

SPARE = 1e-6
"""Metres, or cells, by which rounding may bring two robots nearer than they may be."""
STEP = 0.05
"""Seconds between two moments at which places are compared."""
SLACK = 0.01
"""Seconds before its arrival in which a robot that brakes is nearer to its goal than :data:`SPARE`."""
TICKS = 40
RADII = (0.0, 0.3, 0.45, 0.7, 1.0)
"""Cells."""


def drive_wrong(rng: np.random.Generator, number: int, drawn: DrawnFleet) -> tuple[str, str]:
    """What is wrong with a drive of a plan under random delays, and how it ended."""
    fleet = drawn.fleet
    plan = plan_fleet(fleet, "pibt", seed=number, moves=drawn.moves, planner_settings={"ticks": 60})
    if not plan:
        return "", "no plan"
    delays = Delays(float(rng.choice([0.0, 0.2, 0.5])), duration=float(rng.uniform(0.5, 3.0)))
    try:
        trace = simulate_fleet(fleet, plan, delays=delays, seed=number)
    except InternalFault as error:
        return f"the referee: {error}", "refused"
    return _trace_wrong(trace, drawn), trace.status.value


def _trace_wrong(trace: FleetTrace, drawn: DrawnFleet) -> str:
    if trace.status is not Status.FOUND or not np.isfinite(trace.arrivals).all():
        return f"ends with {trace.status}, arrivals {trace.arrivals.tolist()}"
    times = np.arange(0.0, float(trace.arrivals.max()) + 1.0, STEP)
    xy = _places(trace, times)
    goals = trace.grid.to_metres(np.array(drawn.fleet.goals, dtype=np.float64))
    if np.abs(xy[-1] - goals).max() > SPARE:
        return "robots do not stand on their goals at the end"
    radii = [one.radius for one in trace.robots]
    for i, j in combinations(range(len(radii)), 2):
        gap = float(np.sqrt(np.square(xy[:, i] - xy[:, j]).sum(axis=1)).min())
        if gap < radii[i] + radii[j] - SPARE:
            return f"robots {i} and {j} come within {gap} m"
    for k, one in enumerate(trace.robots):
        far = np.sqrt(np.square(np.diff(xy[:, k], axis=0)).sum(axis=1))
        if far.max(initial=0.0) > one.v_max * STEP * (1 + 1e-9) + SPARE:
            return f"robot {k} drives {far.max() / STEP} m/s"
        before = np.flatnonzero(np.abs(xy[:, k] - goals[k]).max(axis=1) > SPARE)
        last = times[before[-1]] if len(before) else 0.0
        if not last - SLACK <= trace.arrivals[k] <= last + STEP + SLACK:
            return f"robot {k} arrives at {trace.arrivals[k]}, it is not there at {last}"
    return _order_wrong(trace)


def _places(trace: FleetTrace, times: np.ndarray) -> np.ndarray:
    """Where the robots are, (times, n, 2), phase by phase."""
    made = np.repeat(trace.grid.to_metres(trace.starts.astype(np.float64))[None], len(times), axis=0)
    for k in range(len(trace.robot)):
        after = times >= trace.t[k]
        past = np.minimum(times[after] - trace.t[k], trace.duration[k])
        far = trace.v[k] * past + trace.a[k] * past**2 / 2
        made[after, trace.robot[k], 0] = trace.x[k] + far * trace.dx[k]
        made[after, trace.robot[k], 1] = trace.y[k] + far * trace.dy[k]
    return made


def _order_wrong(trace: FleetTrace) -> str:
    """Speeds: phases follow each other, the robot stands before its first and after its last one."""
    for k in range(len(trace.robots)):
        own = np.flatnonzero(trace.robot == k)
        ends = trace.t[own] + trace.duration[own]
        speed = trace.v[own] + trace.a[own] * trace.duration[own]
        if len(own) and (trace.v[own[0]] > SPARE or abs(speed[-1]) > SPARE):
            return f"robot {k} does not begin and end at rest"
        for a, b in pairwise(range(len(own))):
            if trace.t[own[b]] < ends[a] - SPARE:
                return f"phases {a} and {b} of robot {k} overlap"
            if trace.t[own[b]] > ends[a] + SPARE and (speed[a] > SPARE or trace.v[own[b]] > SPARE):
                return f"robot {k} stands between phases {a} and {b}, which do not end and begin at rest"
    return ""


def lifelong_wrong(rng: np.random.Generator, number: int, drawn: DrawnFleet) -> tuple[str, str]:
    """What is wrong with a lifelong fleet: conflicts, tasks that are done where the robot is not."""
    fleet = drawn.fleet
    planner = ("pibt", "pibt", "lacam")[number % 3]
    cells = [one.start for one in fleet.robots] + [one.goal for one in fleet.robots]
    tasks = None
    if number % 2:
        some = rng.integers(len(cells), size=(6, 2)).tolist()
        tasks = [FleetTask((cells[a], cells[b]), int(rng.integers(0, TICKS // 2))) for a, b in some]
    try:
        trace = lifelong_fleet(fleet, TICKS, tasks=tasks, planner=planner, seed=number)
    except InternalFault as error:
        return f"the referee: {error}", "refused"
    paths = [[(int(x), int(y)) for x, y in row] for row in trace.xy.transpose(1, 0, 2).tolist()]
    faults = broken(drawn.rows, fleet.starts, fleet.goals, paths, whole=False)
    if faults:
        return f"{planner}: breaks {', '.join(sorted(faults))}", "broken"
    busy: dict[int, list[tuple[int, int]]] = {}
    for k, task in enumerate(trace.tasks):
        who, since, done = int(trace.robot[k]), int(trace.assigned[k]), int(trace.done[k])
        if who < 0:
            continue
        visits = trace.stop_ticks[k]
        if since < task.release or (done >= 0) != (len(visits) == len(task.stops)):
            return (
                f"{planner}: task {k} released at {task.release}, assigned {since}, done {done}, stops at {visits}",
                "wrong",
            )
        for stop, tick in zip(task.stops, visits, strict=False):
            if paths[who][tick] != stop or tick < since:
                return (
                    f"{planner}: robot {who} is at {paths[who][tick]} at tick {tick}, not at {stop}",
                    "wrong",
                )
        busy.setdefault(who, []).append((since, done if done >= 0 else TICKS + 1))
    for who, spans in busy.items():
        for (_, end), (begin, _) in pairwise(sorted(spans)):
            if begin < end:
                return f"{planner}: robot {who} has two tasks at tick {begin}", "wrong"
    return "", "tasks done" if trace.completed else "none done"


def _sized(rng: np.random.Generator, drawn: DrawnFleet) -> list[Agent]:
    """Some of the robots with radii, as large as they fit at both ends."""
    made: list[Agent] = []
    for one in drawn.fleet.robots[:6]:
        for radius in sorted(rng.choice(RADII, 2).tolist(), reverse=True):
            fits = all(
                math.dist(a, b) >= radius + (other.robot.radius if other.robot else 0.0)
                for other in made
                for a, b in ((one.start, other.start), (one.goal, other.goal))
            )
            middle = [(x + 0.5, y + 0.5) for x, y in (one.start, one.goal)]
            room = min(wall_gap(xy, xy, drawn.rows, 1.0) for xy in middle)
            if fits and (radius <= 0.5 or radius <= room):
                made.append(Agent(one.start, one.goal, Robot(radius=radius)))
                break
    return made


def discs_wrong(rng: np.random.Generator, number: int, drawn: DrawnFleet) -> tuple[str, str]:
    """What is wrong with a plan for discs of several sizes: contacts within a tick, with robots and walls."""
    planner = ("prioritised-sipp", "pibt")[number % 2]
    agents = _sized(rng, drawn)
    if not agents:
        return "", "no robot fits"
    fleet = Fleet(drawn.fleet.grid, agents)
    settings = {"ticks": 60} if planner == "pibt" else {}
    try:
        plan = plan_fleet(fleet, planner, seed=number, moves=drawn.moves, planner_settings=settings)
    except InternalFault as error:
        return f"the referee: {error}", "refused"
    if not plan.paths:
        return "", plan.status.value
    last = max(len(path) for path in plan.paths)
    paths = [[(int(x), int(y)) for x, y in path.tolist()] for path in plan.paths]
    paths = [path + [path[-1]] * (last - len(path)) for path in paths]
    if plan and any(path[-1] != one.goal for path, one in zip(paths, agents, strict=True)):
        return f"{planner}: found, and robots are not at their goals", "wrong"
    radii = [one.robot.radius if one.robot else 0.0 for one in agents]
    for i, j in combinations(range(len(paths)), 2):
        for t in range(1, last):
            gap = closest(paths[i][t - 1], paths[i][t], paths[j][t - 1], paths[j][t])
            crossing = drawn.octile and cross(paths[i][t - 1], paths[i][t], paths[j][t - 1], paths[j][t])
            if gap < radii[i] + radii[j] - SPARE or gap < SPARE or crossing:
                return (
                    f"{planner}: robots {i} and {j} of {radii[i]} and {radii[j]} come within {gap} at tick {t}",
                    "wrong",
                )
    for k, path in enumerate(paths):
        for (x, y), (u, v) in pairwise(path):
            gap = wall_gap((x + 0.5, y + 0.5), (u + 0.5, v + 0.5), drawn.rows, 1.0)
            if gap < radii[k] - SPARE and gap < 0.5 - SPARE:
                return f"{planner}: robot {k} of {radii[k]} comes within {gap} of a wall", "wrong"
    return "", plan.status.value
