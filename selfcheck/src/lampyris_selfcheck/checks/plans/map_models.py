"""Planners on models of the map, the fastest path and the order of visits, each beside brute force on small maps."""

from __future__ import annotations

import heapq
import math
from itertools import pairwise, permutations

import numpy as np

from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.plan import Plan
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning.visiting_order import EXACT_VIA, best_order
from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally, each
from lampyris_selfcheck.checks.plans.sampling import DrawnQuery, asked, drawn_query, path_wrong
from lampyris_selfcheck.reference.geometry import plane
from lampyris_selfcheck.reference.motion.travel_time import Limits, least_time
from lampyris_selfcheck.reference.paths import search
from lampyris_selfcheck.reference.paths.any_angle import Cell, shortest

LIMITS = Limits(radius=0.1, v_max=1.3, a_max=0.6, d_max=0.9, a_lat_max=0.7, turn_radius=0.3)
"""Corners of 45 degrees are no limit, those of 90 are, and those of 135 are stops."""


def _line_plan(query: DrawnQuery, planner: str, number: int, tally: Tally) -> tuple[Plan | None, str]:
    plan = asked(query.scene, planner, number)
    if isinstance(plan, str):
        return None, plan
    tally.count(plan.status.value)
    if bool(plan) != query.joined:
        return None, f"answers {plan.status}; there is {'a' if query.joined else 'no'} path"
    return (plan, path_wrong(plan, query)) if plan else (None, "")


def _visibility(ask: Ask, number: int, tally: Tally) -> None:
    query = drawn_query(ask.rng("map-models", "visibility-graph", number), 3, 7)
    plan, fault = _line_plan(query, "visibility-graph", number, tally)
    if plan is not None and not fault:
        free = {(x, y) for y, row in enumerate(query.free) for x, one in enumerate(row) if one}
        lines = {(a, b) for a in free for b in free if a < b and query.is_line(a, b)}
        least = shortest(free, lines | {(b, a) for a, b in lines}, query.start)[query.goal]
        length, model = plan.any_angle_length or 0.0, plan.map_model
        bound = -1.0 if model is None or model.bound is None else model.bound
        if abs(length - least) > 1e-9:
            fault = f"is {length} long, the optimum is {least}"
        elif number % 4 == 0:
            ends = (query.start, query.goal)
            in_plane = (
                plane.disc_optimum(query.free, *ends)
                if query.radius
                else plane.point_optimum(query.free, *ends, query.cutting)
            )
            if abs(bound - in_plane) > 1e-9:
                fault = f"states the bound {bound}, the optimum in the plane is {in_plane}"
        if not fault and not 0.0 <= bound <= length + 1e-9:
            fault = f"states the bound {bound} of {length}"
    _tell(tally, number, query, fault)


def _quadtree(ask: Ask, number: int, tally: Tally) -> None:
    query = drawn_query(ask.rng("map-models", "quadtree", number), 3, 14)
    plan, fault = _line_plan(query, "quadtree", number, tally)
    if plan is not None and not fault:
        assert plan.map_model is not None
        covered = np.zeros_like(query.grid.blocked, dtype=np.int64)
        for x, y, side, free in plan.map_model.boxes.tolist():
            covered[y : y + side, x : x + side] += 1
            wanted = np.array(query.free)[y : y + side, x : x + side]
            if bool(free) != bool(wanted.all()) or wanted.any() != wanted.all():
                fault = f"leaf {(x, y, side)} is not all {'free' if free else 'blocked'}"
        if not fault and (covered != 1).any():
            fault = "leaves do not cover each cell once"
        whole = plan.map_model.counts["leaves"]
        if not fault and whole > _leaves(query):
            fault = f"{whole} leaves, {_leaves(query)} do"
    _tell(tally, number, query, fault)


def _leaves(query: DrawnQuery) -> int:
    """How many leaves the map has, by cutting squares into four."""
    free = np.array(query.free)
    side = 1
    while side < max(free.shape):
        side *= 2

    def count(x: int, y: int, size: int) -> int:
        if y >= free.shape[0] or x >= free.shape[1]:
            return 0
        part = free[y : y + size, x : x + size]
        whole = part.shape == (size, size)
        if (part.all() and whole) or not part.any():
            return 1
        half = size // 2
        return sum(count(x + u, y + v, half) for u in (0, half) for v in (0, half))

    return count(0, 0, side)


def _voronoi(ask: Ask, number: int, tally: Tally) -> None:
    rng = ask.rng("map-models", "voronoi", number)
    query, border = drawn_query(rng, 3, 13), bool(rng.integers(2))
    plan = asked(query.scene, "voronoi", number, border=border)
    fault = plan if isinstance(plan, str) else ""
    if isinstance(plan, Plan):
        tally.count(plan.status.value)
        rooms = _rooms(query, border)
        best = _widest(rooms, query)
        if bool(plan) != (best is not None):
            fault = f"answers {plan.status}"
        elif plan.path is not None and best is not None and plan.map_model is not None:
            cells = [(int(x), int(y)) for x, y in plan.path.cells.tolist()]
            least, stated = min(rooms[cell] for cell in cells), plan.map_model.clearance
            if (cells[0], cells[-1]) != (query.start, query.goal) or len(set(cells)) != len(cells):
                fault = f"goes {cells}"
            elif least < best - 1e-9:
                fault = f"has the clearance {least}, a path has {best}"
            elif (stated is None) != math.isinf(best) or (stated is not None and abs(stated - best) > 1e-9):
                fault = f"states the clearance {stated}, it is {best}"
    _tell(tally, number, query, fault)


def _rooms(query: DrawnQuery, border: bool) -> dict[Cell, float]:
    """The distance of each free cell to the nearest wall, cells."""
    blocked = np.argwhere(query.grid.blocked).tolist()
    high, wide = query.grid.blocked.shape
    rooms = {}
    for y, row in enumerate(query.free):
        for x, one in enumerate(row):
            if one:
                gaps = [math.hypot(max(abs(u - x) - 0.5, 0), max(abs(v - y) - 0.5, 0)) for v, u in blocked]
                edge = min(x, y, wide - 1 - x, high - 1 - y) + 0.5
                rooms[x, y] = min([*gaps, *([edge] if border else [])], default=math.inf)
    return rooms


def _widest(rooms: dict[Cell, float], query: DrawnQuery) -> float | None:
    """The greatest least room of a path; None: there is no path."""
    heap, done = [(-rooms[query.start], query.start)], set()
    while heap:
        worst, here = heapq.heappop(heap)
        if here == query.goal:
            return -worst
        if here in done:
            continue
        done.add(here)
        for dx, dy in ((i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if query.cutting or not i * j):
            there = (here[0] + dx, here[1] + dy)
            if there in rooms and there not in done:
                heapq.heappush(heap, (max(worst, -rooms[there]), there))
    return None


def _fastest(ask: Ask, number: int, tally: Tally) -> None:
    rng = ask.rng("map-models", "fastest-time", number)
    blocked = rng.random((4, 4)) < rng.choice([0.1, 0.2, 0.3])
    blocked[0, 0] = blocked[3, 3] = False
    zones = rng.choice([0.3, 0.6, 2.0], (4, 4)) if number % 2 else None
    moves = ("octile", "octile", "four-connected")[number % 3]
    robot = Robot(
        radius=LIMITS.radius, v_max=LIMITS.v_max, a_max=LIMITS.a_max, d_max=LIMITS.d_max, a_lat_max=LIMITS.a_lat_max,
        turn_radius=LIMITS.turn_radius,
    )  # fmt: skip
    scene = Scene(Grid(blocked), (0, 0), (3, 3), moves, robot, zones=zones)
    plan = asked(scene, "fastest-time", number)
    rows = None if zones is None else zones.tolist()
    least = least_time(blocked.tolist(), MOVES[moves].offsets, (0, 0), (3, 3), LIMITS, rows)
    fault = plan if isinstance(plan, str) else ""
    if isinstance(plan, Plan):
        tally.count(plan.status.value)
        found = plan.time_lower_bound
        if bool(plan) != math.isfinite(least):
            fault = f"answers {plan.status}, the least time is {least}"
        elif plan and (found is None or abs(found - least) > 1e-9 * least):
            fault = f"takes {found} s, the least time is {least}"
    if fault:
        tally.fail(number, f"{moves}: {fault}", blocked=blocked.tolist(), zones=rows)


def _visits(ask: Ask, number: int, tally: Tally) -> None:
    rng = ask.rng("map-models", "visits", number)
    if number % 4 == 3:
        fault = _order_beyond(rng)
    elif number % 2 == 0:
        fault = _order(rng)
    else:
        fault = _legs(rng, number, tally)
    if fault:
        tally.fail(number, fault)


def _order(rng: np.random.Generator) -> str:
    n = int(rng.integers(0, 7))
    costs = rng.integers(0, 40, (n + 1, n + 1))
    order, least = best_order(costs)
    best = min(_paid(costs, list(one)) for one in permutations(range(n)))
    if sorted(order) != list(range(n)) or _paid(costs, order) != best or least != best:
        return f"order {order} costs {least}, the best {best}: {costs.tolist()}"
    return ""


def _order_beyond(rng: np.random.Generator) -> str:
    """Points on a line: the shortest path visits them as they lie."""
    n = EXACT_VIA + 1 + int(rng.integers(0, 3))
    points = rng.permutation(n) + 1
    rows, columns = np.append(0, points), np.append(points, n + 1)
    costs = np.abs(rows[:, None] - columns[None])
    order, bound = best_order(costs)
    paid = _paid(costs, order)
    if sorted(order) != list(range(n)) or not bound <= n + 1 <= paid:
        return f"order {order} costs {paid}, bound {bound}, the best {n + 1}"
    shuffled = _paid(costs, list(range(n)))
    return "" if paid <= shuffled else f"order {order} costs {paid}, any other {shuffled}"


def _paid(costs: np.ndarray, order: list[int]) -> int:
    places = [-1, *order, len(order)]
    return sum(int(costs[a + 1, b]) for a, b in pairwise(places))


def _legs(rng: np.random.Generator, number: int, tally: Tally) -> str:
    blocked = rng.random((6, 7)) < 0.2
    cells = [(int(x), int(y)) for y, x in np.argwhere(~blocked)]
    some = [cells[int(k)] for k in rng.integers(len(cells), size=5)]
    start, goal, via = some[0], some[1], some[2:]
    free = (~blocked).tolist()
    order = ("best", "given")[number // 2 % 2]
    scene = Scene(Grid(blocked), start, goal, "four-connected").through(via, order)
    plan = asked(scene, "astar", number)
    if isinstance(plan, str):
        return plan
    tally.count(plan.status.value)
    known = {cell: search.distances(free, "four-connected", cell) for cell in {*via, goal}}

    def steps(cells_: list[Cell]) -> float:
        legs = [known[b].get(a) for a, b in pairwise(cells_)]
        return math.inf if None in legs else sum(one[0] for one in legs if one is not None)

    orders = permutations(via) if order == "best" else [tuple(via)]
    least = min(steps([start, *one, goal]) for one in orders)
    if bool(plan) != math.isfinite(least):
        return f"answers {plan.status}"
    if plan.path is None:
        return ""
    walk = [(int(x), int(y)) for x, y in plan.path.cells.tolist()]
    passed = [walk[k] for k in plan.via_at]
    if len(walk) - 1 != least or sorted(passed) != sorted(via) or (order == "given" and passed != via):
        return f"passes {passed} in {len(walk) - 1} steps, the best way has {least}; via {via}, {order}"
    return "" if list(plan.via_at) == sorted(plan.via_at) else f"visits at {plan.via_at}"


def _tell(tally: Tally, number: int, query: DrawnQuery, fault: str) -> None:
    if fault:
        tally.fail(
            number, f"{query.moves}, radius {query.radius}: {fault}",
            free=query.free, start=query.start, goal=query.goal,
        )  # fmt: skip


JUDGES = {
    "visibility-graph": _visibility,
    "voronoi": _voronoi,
    "quadtree": _quadtree,
    "fastest-time": _fastest,
    "visits": _visits,
}


def _run(ask: Ask, part: Part) -> Outcome:
    judge = JUDGES[part.kind]
    return each(part, lambda number, tally: judge(ask, number, tally))


KINDS = {
    "visibility-graph": Kind(
        "the shortest path of all pairs of cells, and the optimum in the plane as its bound", 40, 10_000, 100_000, 200,
        least={"found": 0.4},
    ),
    "voronoi": Kind("no path has more clearance where it is narrowest", 60, 20_000, 200_000, 500, least={"found": 0.4}),
    "quadtree": Kind(
        "a path exactly where there is one; leaves as large as can be, each cell in one", 60, 20_000, 200_000, 500,
        least={"found": 0.4},
    ),
    "fastest-time": Kind(
        "the least travel time on maps of 4 x 4, by a search of all pairs of steps", 50, 20_000, 200_000, 500,
        least={"found": 0.3},
    ),
    "visits": Kind("via points: the best of all orders; beyond, a bound that is one", 60, 20_000, 200_000, 500),
}  # fmt: skip
CHECK = Check(
    "map-models",
    ("G36",),
    "planners on models of the map, the fastest path and orders of visits keep what they promise, beside brute force",
    KINDS,
    _run,
)
