"""Planners that sample: paths by exact lines, never shorter than the optimum, never longer than stated; chains by polygons."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np

from lampyris import api, chains
from lampyris.errors import InternalFault
from lampyris.model.chain.chain import Chain
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan, Status
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget
from lampyris.planning.chain.rrt import PLANNERS as CHAIN_PLANNERS
from lampyris.planning.field.layers import free_cells
from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally, each
from lampyris_selfcheck.checks.paths import drawn_maps
from lampyris_selfcheck.reference.geometry.disc_lines import connected, disc_sees, enters, shared, squared_gap
from lampyris_selfcheck.reference.geometry.polygons import deepest, links_of, overlap, placed
from lampyris_selfcheck.reference.paths.any_angle import Cell, sees, shortest

FIRST = ("rrt", "rrt-connect")
IMPROVING = ("rrt-star", "informed-rrt-star", "bit-star")
POSES = {"poses": "pose-rrt-connect", "poses-star": "pose-rrt-star"}
"""Planners over poses, by the kind of their cases."""
DRIVES = ("ackermann", "differential", "omnidirectional")
WIDE = 0.8
"""Radius of discs, cells: no free cell beside or diagonally beside a wall."""
RADII = (0.0, 0.0, 0.3, 0.5, WIDE, 1.2, 1.5)
"""Radii of discs of paths that turn anywhere, cells; some just fit between two walls."""
FORGIVEN = Fraction(1, 10**9)
"""Share of a radius by which a disc may overlap a wall."""
DEEP = 1e-6
"""Metres by which rounding may put one polygon into another."""


@dataclass(frozen=True, eq=False)
class DrawnQuery:
    """A map, its free cells and two of them."""

    grid: Grid
    free: list[list[bool]]
    start: Cell
    goal: Cell
    moves: str
    radius: float

    @property
    def scene(self) -> Scene:
        """The query as a scene."""
        return Scene(self.grid, self.start, self.goal, self.moves, Robot(radius=self.radius))

    @property
    def cutting(self) -> bool:
        """Whether a point may touch corners."""
        return self.moves == "dissertation" and self.radius == 0.0

    def is_line(self, a: Cell, b: Cell) -> bool:
        """Whether the robot may go straight from one cell to another, by the definition."""
        if self.radius:
            return disc_sees(self.free, a, b)
        blocked = {(x, y) for y, row in enumerate(self.free) for x, one in enumerate(row) if not one}
        return sees(blocked, a, b, self.cutting)

    def is_hit(self, a: tuple[float, float], b: tuple[float, float]) -> bool:
        """Whether the robot meets a wall straight from one place to another, by the definition, in fractions."""
        begin, end = ((Fraction(x), Fraction(y)) for x, y in (a, b))
        radius = self.radius * (1 - FORGIVEN)
        for y, x in np.argwhere(self.grid.blocked).tolist():
            if self.cutting:
                if enters(begin, end, (x, y)):
                    return True
            elif squared_gap(begin, end, (x, y)) < radius * radius or (
                not radius and shared(begin, end, (x, y))
            ):
                return True
        return False

    @property
    def joined(self) -> bool:
        """Whether there is a path."""
        return self.goal in connected(self.free, self.start, corners=self.cutting)


def drawn_query(
    rng: np.random.Generator, low: int, high: int, radii: tuple[float, ...] = (0.0, 0.0, WIDE)
) -> DrawnQuery:
    """A random map with two free cells, sides of low to high - 1."""
    while True:
        width, height = (int(n) for n in rng.integers(low, high, 2))
        grid = Grid(drawn_maps.walls(rng, width, height))
        radius = float(rng.choice(radii))
        free = free_cells(grid, radius)
        cells = [(int(x), int(y)) for y, x in np.argwhere(free)]
        if len(cells) >= 2:
            a, b = (cells[int(k)] for k in rng.choice(len(cells), 2, replace=False))
            return DrawnQuery(grid, free.tolist(), a, b, str(rng.choice(["octile", "dissertation"])), radius)


def asked(scene: Scene, planner: str, seed: int, **settings: Any) -> Plan | str:
    """The plan, or what the referee said."""
    budget = settings.pop("budget", None)
    try:
        return api.plan(scene, planner, seed=seed, budget=budget, planner_settings=settings)
    except InternalFault as error:
        return f"the referee: {error}"


def path_wrong(plan: Plan, query: DrawnQuery) -> str:
    """What is wrong with a path of straight lines, and with what is said of it."""
    assert plan.waypoints is not None
    if plan.waypoints.dtype.kind == "f":
        turns = [(x, y) for x, y in plan.waypoints.tolist()]
        bad = [pair for pair in pairwise(turns) if query.is_hit(*pair)]
    else:
        turns = [(int(x), int(y)) for x, y in plan.waypoints.tolist()]
        bad = [pair for pair in pairwise(turns) if not query.is_line(*pair)]
    if (turns[0], turns[-1]) != (query.start, query.goal):
        return f"it leads from {turns[0]} to {turns[-1]}"
    if bad:
        return f"no free line: {bad}"
    length = math.fsum(math.dist(*pair) for pair in pairwise(turns))
    if plan.any_angle_length is None or abs(plan.any_angle_length - length) > 1e-9:
        return f"length {plan.any_angle_length}, it is {length}"
    stated = plan.best_by_iteration
    if any(b > a for a, b in pairwise(stated)):
        return f"the best length rises: {stated}"
    if stated and length > stated[-1] + 1e-9:
        return f"the path is {length} long, the best was {stated[-1]}"
    return ""


def _first(ask: Ask, number: int, tally: Tally) -> None:
    rng = ask.rng("sampling", "first", number)
    query, planner = drawn_query(rng, 4, 13), FIRST[number % 2]
    plan = asked(query.scene, planner, number, samples=4000)
    fault = plan if isinstance(plan, str) else _answer_wrong(plan, query, tally)
    _tell(tally, number, query, planner, fault)


def _answer_wrong(plan: Plan, query: DrawnQuery, tally: Tally) -> str:
    tally.count(plan.status.value)
    if plan.status is Status.ITERATION_LIMIT and query.joined:
        return ""
    if bool(plan) != query.joined:
        return f"answers {plan.status}; there is {'a' if query.joined else 'no'} path"
    if not plan and plan.status is not Status.NO_PATH:
        return f"answers {plan.status}; there is no path"
    return path_wrong(plan, query) if plan else ""


def _improving(ask: Ask, number: int, tally: Tally) -> None:
    rng = ask.rng("sampling", "improving", number)
    query, planner = drawn_query(rng, 3, 7), IMPROVING[number % 3]
    settings: dict[str, Any] = {
        "samples": 1500,
        "batch": 10,
        "shortcut": False,
        "ancestors": int(rng.choice([0, 0, 2])),
    }
    plan = asked(query.scene, planner, number, **settings)
    fault = plan if isinstance(plan, str) else _answer_wrong(plan, query, tally)
    if not fault and not isinstance(plan, str) and plan:
        free = {(x, y) for y, row in enumerate(query.free) for x, one in enumerate(row) if one}
        lines = {(a, b) for a in free for b in free if a < b and query.is_line(a, b)}
        least = shortest(free, lines | {(b, a) for a, b in lines}, query.start)[query.goal]
        length = plan.any_angle_length or 0.0
        tally.count("optimal", int(length < least + 1e-9))
        if length < least - 1e-9 or length > 1.001 * least:
            fault = f"{settings}: {length}, the shortest path is {least}"
    _tell(tally, number, query, planner, fault)


def _anywhere(ask: Ask, number: int, tally: Tally) -> None:
    """Paths that turn anywhere keep their distance, and are no longer than those that turn at cell centres."""
    rng = ask.rng("sampling", "anywhere", number)
    query, planner = drawn_query(rng, 4, 13, RADII), IMPROVING[number % 3]
    settings: dict[str, Any] = {"samples": 200, "batch": 50, "shortcut": bool(rng.integers(4))}
    plan = asked(query.scene, planner, number, **settings, turns="anywhere")
    other = asked(query.scene, planner, number, **settings)
    fault = next((one for one in (plan, other) if isinstance(one, str)), "")
    if not fault:
        assert isinstance(plan, Plan)
        assert isinstance(other, Plan)
        fault = _answer_wrong(plan, query, tally)
        if not fault and plan.status is not other.status:
            fault = f"answers {plan.status}, with turns at centres {other.status}"
        length, longer = plan.any_angle_length, other.any_angle_length
        if not fault and length is not None and longer is not None:
            tally.count("shorter", int(length < longer - 1e-6))
            model = None if query.radius else api.plan(query.scene, "visibility-graph").map_model
            least = 0.0 if model is None or model.bound is None else model.bound
            if not least - 1e-9 <= length <= longer + 1e-9:
                fault = f"{settings}: {length}, at centres {longer}, no path is shorter than {least}"
    _tell(tally, number, query, planner, fault)


def _interrupted(ask: Ask, number: int, tally: Tally) -> None:
    """A run of fewer samples is the beginning of a longer one, and a path is kept when the budget ends."""
    rng = ask.rng("sampling", "interrupted", number)
    query, planner = drawn_query(rng, 4, 11), (*FIRST, *IMPROVING)[number % 5]
    settings = {"samples": 300, "batch": 50}
    whole = asked(query.scene, planner, number, **settings)
    again = asked(query.scene, planner, number, **settings)
    limit = 50 * int(rng.integers(1, 6))
    part = asked(query.scene, planner, number, **settings, budget=Budget(expansions=limit))
    fault = next((one for one in (whole, again, part) if isinstance(one, str)), "")
    if not fault:
        assert isinstance(whole, Plan)
        assert isinstance(part, Plan)
        fault = _part_wrong(whole, part, limit, query, tally)
        if not fault and whole != again:
            fault = "the same seed gives another plan"
    _tell(tally, number, query, planner, fault)


def _part_wrong(whole: Plan, part: Plan, limit: int, query: DrawnQuery, tally: Tally) -> str:
    tally.count(part.status.value)
    if part.expansions > limit:
        return f"takes {part.expansions} of {limit} samples"
    rounds = len(part.best_by_iteration)
    if part and (part.best_by_iteration != whole.best_by_iteration[:rounds] or not whole):
        return f"the lengths {part.best_by_iteration} do not begin {whole.best_by_iteration}"
    if part and not whole.detail and whole.iterations > part.iterations and "budget" not in part.detail:
        return f"ends by the budget and says {part.detail!r}"
    known = [one for one in whole.best_by_iteration[: limit // 50] if one < math.inf]
    if known and not part:
        return f"no path ({part.status}), though {known[0]} is known within the budget"
    if part.status is Status.NO_PATH and query.joined:
        return "answers no-path; there is a path"
    return path_wrong(part, query) if part else ""


def _poses(ask: Ask, kind: str, number: int, tally: Tally) -> None:
    rng = ask.rng("sampling", "poses", number)
    drive, planner = DRIVES[number % 3], POSES[kind]
    settings: dict[str, Any] = {"samples": 250}
    if kind == "poses-star":
        settings = {"samples": 600, "rounds": 4, "seeded": number % 2 == 1}
    blocked = np.kron(rng.random((4, 5)) < 0.3, np.ones((4, 4), dtype=bool))
    outline = [(0.9, 0.35), (-0.4, 0.35), (-0.4, -0.35), (0.9, -0.35)]
    radius = 1.0 if drive == "ackermann" else 0.0
    robot = Robot(footprint=tuple(outline), drive=drive, turn_radius=radius)
    ends = [tuple(rng.uniform((1.0, 1.0, -3.0), (9.0, 7.0, 3.0)).tolist()) for _ in range(2)]
    scene = Scene(Grid(blocked, resolution=0.5), start_pose=ends[0], goal_pose=ends[1], robot=robot)
    plan = asked(scene, planner, number, **settings)
    fault = plan if isinstance(plan, str) else _poses_wrong(plan, scene, outline, radius, tally)
    if fault:
        tally.fail(number, f"{planner}, {drive}, {settings}: {fault}", blocked=blocked.tolist(), ends=ends)


def _poses_wrong(
    plan: Plan, scene: Scene, outline: list[tuple[float, float]], radius: float, tally: Tally
) -> str:
    rows, cell = scene.grid.blocked.tolist(), scene.grid.resolution
    tally.count(plan.status.value)
    deep = [
        deepest(placed(outline, *pose), rows, cell, edge=False)
        for pose in (scene.start_pose, scene.goal_pose)
        if pose
    ]
    for depth, status in zip(deep, (Status.START_OCCUPIED, Status.GOAL_OCCUPIED), strict=True):
        if plan.status is status and depth <= DEEP:
            return f"answers {status}; the footprint is free there"
    if plan.pose_path is None:
        return ""
    poses = plan.pose_path.poses.tolist()
    if max(deep) > DEEP:
        return "finds a path from or to a pose in a wall"
    for pose, end in ((poses[0], scene.start_pose), (poses[-1], scene.goal_pose)):
        assert end is not None
        if (
            math.dist(pose[:2], end[:2]) > 1e-3 * cell
            or abs(math.remainder(pose[2] - end[2], math.tau)) > 1e-3
        ):
            return f"has {pose} in place of {end}"
    high, wide = (n * cell for n in scene.grid.blocked.shape)
    if not all(-DEEP <= x <= wide + DEEP and -DEEP <= y <= high + DEEP for x, y, _ in poses):
        return "the base leaves the map"
    worst = max(deepest(placed(outline, *pose), rows, cell, edge=False) for pose in poses)
    if worst > DEEP:
        return f"the footprint is {worst} m deep in a wall"
    for a, b in pairwise(poses):
        far, turn = math.dist(a[:2], b[:2]), abs(math.remainder(b[2] - a[2], math.tau))
        # The chord of an arc of that radius.
        if turn > 1e-6 and radius and far < 2 * radius * math.sin(turn / 2) * (1 - 1e-6) - 1e-7:
            return f"turns by {turn} on {far} m"
    stated = plan.best_by_iteration
    if any(b > a for a, b in pairwise(stated)):
        return f"the best cost rises: {stated}"
    straight = math.dist(poses[0][:2], poses[-1][:2])
    length = math.fsum(math.dist(a[:2], b[:2]) for a, b in pairwise(poses))
    if (
        plan.pose_path.cost_m * 1.000001 < length
        or plan.pose_path.lower_bound_m > plan.pose_path.cost_m * 1.000001
    ):
        return f"costs {plan.pose_path.cost_m}, is {length} long, bound {plan.pose_path.lower_bound_m}"
    return "" if length >= straight - 1e-9 else "is shorter than a straight line"


def _chain(ask: Ask, number: int, tally: Tally) -> None:
    rng = ask.rng("sampling", "chain", number)
    planner, n = CHAIN_PLANNERS[number % 3], int(rng.integers(1, 6))
    blocked = rng.random((8, 8)) < 0.12
    blocked[3:5, 3:5] = False
    grid = Grid(blocked, resolution=0.5)
    lengths, widths = rng.uniform(0.3, 0.9, n).tolist(), rng.uniform(0.05, 0.2, n).tolist()
    arm = Chain((2.0, 2.0), lengths, widths, (-2.5, 2.5))
    most = (1.5, 2.4)[number // 3 % 2]
    start, goal = (rng.uniform(-most, most, n).tolist() for _ in range(2))
    try:
        plan = chains.plan_chain(grid, arm, start, goal, planner, seed=number, budget=Budget(expansions=150))
    except InternalFault as error:
        tally.fail(number, f"{planner}: the referee: {error}")
        return
    tally.count(plan.status.value)
    rows = blocked.tolist()
    ends = [_chain_depth(arm, q, rows) for q in (start, goal)]
    fault = ""
    if plan.status in (Status.START_OCCUPIED, Status.GOAL_OCCUPIED):
        fault = "" if max(ends) > -DEEP else f"answers {plan.status}; both ends are free"
    elif max(ends) > DEEP:
        fault = f"answers {plan.status}; an end is {max(ends)} m deep in a wall or a link"
    elif plan.configurations is not None:
        fault = _chain_wrong(arm, plan.configurations.tolist(), start, goal, rows)
        if not fault and planner != "rrt-adaptive" and plan.released != tuple(range(n)):
            fault = f"released {plan.released}"
        if not fault and len(set(plan.released)) != len(plan.released):
            fault = f"released {plan.released}"
    if fault:
        tally.fail(number, f"{planner}, {n} links: {fault}", blocked=rows, start=start, goal=goal)


def _chain_depth(arm: Chain, q: list[float], rows: list[list[bool]]) -> float:
    links = links_of(arm.base, arm.links, arm.widths, q)
    worst = max(deepest(link, rows, 0.5) for link in links)
    return max([worst, *(overlap(links[j], links[k]) for k in range(len(links)) for j in range(k - 1))])


def _chain_wrong(
    arm: Chain, found: list[list[float]], start: list[float], goal: list[float], rows: list[list[bool]]
) -> str:
    if found[0] != start or found[-1] != goal:
        return "does not lead from start to goal"
    for a, b in pairwise(found):
        steps = 2 + int(max(abs(v - u) for u, v in zip(a, b, strict=True)) / 0.1)
        for k in range(steps):
            q = [u + k / (steps - 1) * (v - u) for u, v in zip(a, b, strict=True)]
            if any(
                not low - 1e-12 <= one <= high + 1e-12
                for one, (low, high) in zip(q, arm.joint_limits, strict=True)
            ):
                return f"{q} is beyond the joints' limits"
            depth = _chain_depth(arm, q, rows)
            if depth > DEEP:
                return f"{q} is {depth} m deep in a wall or a link"
    return ""


def _tell(tally: Tally, number: int, query: DrawnQuery, planner: str, fault: str) -> None:
    if fault:
        tally.fail(
            number, f"{planner}, {query.moves}, radius {query.radius}: {fault}",
            free=query.free, start=query.start, goal=query.goal,
        )  # fmt: skip


JUDGES = {
    "first": _first,
    "improving": _improving,
    "anywhere": _anywhere,
    "interrupted": _interrupted,
    "chain": _chain,
}


def _run(ask: Ask, part: Part) -> Outcome:
    if part.kind in POSES:
        return each(part, lambda number, tally: _poses(ask, part.kind, number, tally))
    judge = JUDGES[part.kind]
    return each(part, lambda number, tally: judge(ask, number, tally))


KINDS = {
    "first": Kind(
        "rrt, rrt-connect: a path exactly where there is one, its lines by the definition", 60, 20_000, 200_000, 500,
        least={"found": 0.4},
    ),
    "improving": Kind(
        "rrt-star, informed-rrt-star, bit-star: the optimum of all pairs of cells on small maps", 36, 4_000, 40_000, 100,
        least={"found": 0.4, "optimal": 0.4},
    ),
    "anywhere": Kind(
        "the same: paths that turn anywhere keep their distance from walls, by fractions, and are no longer than at centres",
        40, 4_000, 40_000, 100, least={"found": 0.4, "shorter": 0.1},
    ),
    "interrupted": Kind(
        "fewer samples give the beginning of the same search, and a path is kept", 40, 10_000, 100_000, 250,
        least={"found": 0.3},
    ),
    "poses": Kind(
        "planners over poses: footprint, curvature and ends by polygons of the check's own", 30, 2_000, 20_000, 50,
        least={"found": 0.1},
    ),
    "poses-star": Kind(
        "pose-rrt-star: the same, and a cost that never rises", 30, 2_000, 20_000, 50, least={"found": 0.1}
    ),
    "chain": Kind(
        "chains: every configuration on the way free by polygons, ends refused only where they touch", 60, 10_000,
        100_000, 200, least={"found": 0.1},
    ),
}  # fmt: skip
CHECK = Check(
    "sampling",
    ("G40",),
    "planners that sample answer with paths that are free by the definition, and never with a longer one than before",
    KINDS,
    _run,
)
