"""Plans and paths that are right or spoiled, for the referee of fleets: its verdict beside the definitions."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from lampyris.model.fleet.fleet import Agent, Fleet
from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.model.grid import Grid
from lampyris.model.plan import Status
from lampyris.referee import check_fleet_plan
from lampyris_selfcheck.reference.fleets.fleet_rules import Cell, broken, distances, neighbours

SPOILED = ("paths", "figures")
"""Of case n: paths that go anywhere, or right paths with figures that are wrong, at n % 2."""
FIGURES = ("shortest more", "shortest less", "bound", "rising", "last", "factor", "none")


def drawn_paths(rng: np.random.Generator, *, octile: bool = False) -> tuple[Fleet, list[list[Cell]]]:
    """Two to four robots that walk at random on a small map, mostly without a conflict, and sometimes break a rule."""
    width, height = (int(n) for n in rng.integers(2, 6, size=2))
    blocked = rng.random((height, width)) < 0.15
    flat = rng.permutation(width * height)
    blocked.flat[flat[:4]] = False
    rows = blocked.tolist()
    free = [(x, y) for y, x in np.argwhere(~blocked).tolist()]
    robots = int(rng.integers(1, min(4, len(free)) + 1))
    careful = rng.random() < 0.6
    while True:
        paths: list[list[Cell]] = [[free[k]] for k in rng.permutation(len(free))[:robots].tolist()]
        for path in paths:
            for _ in range(int(rng.integers(0, 7))):
                ways = [path[-1], *neighbours(rows, path[-1], octile=octile)]
                if octile and not careful:
                    ways += _past_corners(rows, path[-1])
                path.append(ways[int(rng.integers(len(ways)))])
            while len(path) > 1 and path[-1] == path[-2]:
                path.pop()
        facing = robots > 1 and not careful and rng.random() < 0.5
        if facing:
            # The two meet, in a cell or between two.
            paths[1] = _across(rows, paths[0]) if octile and rng.random() < 0.5 else paths[0][::-1]
        starts, goals = [path[0] for path in paths], [path[-1] for path in paths]
        if (
            len(set(starts)) == robots
            and len(set(goals)) == robots
            and not (careful and broken(rows, starts, goals, paths, octile=octile))
        ):
            break
    fleet = Fleet(Grid(blocked), [Agent(a, b) for a, b in zip(starts, goals, strict=True)])
    return fleet, _spoiled(rng, rows, paths)


def _past_corners(rows: list[list[bool]], cell: Cell) -> list[Cell]:
    """Free cells that lie diagonally, past a blocked one."""
    x, y = cell
    allowed = neighbours(rows, cell, octile=True)
    return [
        (u, v)
        for u in (x - 1, x + 1)
        for v in (y - 1, y + 1)
        if 0 <= u < len(rows[0]) and 0 <= v < len(rows) and not rows[v][u] and (u, v) not in allowed
    ]


def _across(rows: list[list[bool]], path: list[Cell]) -> list[Cell]:
    """A path that crosses the first diagonal step of another one, either way; that one's reverse if it has none."""
    for t, ((x, y), (u, v)) in enumerate(pairwise(path)):
        if x != u and y != v and not (rows[v][x] or rows[y][u]):
            return [*[(x, v)] * (t + 1), (u, y)] if t % 2 == 0 else [*[(u, y)] * (t + 1), (x, v)]
    return path[::-1]


def _spoiled(rng: np.random.Generator, rows: list[list[bool]], paths: list[list[Cell]]) -> list[list[Cell]]:
    """The paths, half of the time with a change somewhere."""
    kind = int(rng.integers(12))
    k = int(rng.integers(len(paths)))
    path = paths[k]
    t = int(rng.integers(len(path)))
    if kind == 0:
        path[t] = (int(rng.integers(len(rows[0]))), int(rng.integers(len(rows))))
    elif kind == 1:
        path.append(path[-1])
    elif kind == 2 and len(path) > 1:
        del path[t]
    elif kind == 3:
        other = int(rng.integers(len(paths)))
        paths[k], paths[other] = paths[other], paths[k]
    elif kind == 4:
        path[t] = (path[t][0] + int(rng.integers(-1, 2)), path[t][1] + int(rng.integers(-1, 2)))
    elif kind == 5:
        paths.pop()
        if not paths:
            paths.append(path)
    return paths


def plan_of(
    fleet: Fleet, paths: list[list[Cell]], status: Status = Status.FOUND, *, octile: bool = False
) -> FleetPlan:
    """A plan by hand, its figures those of its paths."""
    rows = fleet.grid.blocked.tolist()
    shortest = [distances(rows, one.goal, octile=octile).get(one.start, 0) for one in fleet.robots]
    moves = "octile" if octile else "four-connected"
    return FleetPlan(
        status, "by hand", tuple(np.array(path) for path in paths), np.array(shortest), moves=moves
    )


def paths_wrong(rng: np.random.Generator, *, octile: bool = False) -> tuple[str, str, dict[str, object]]:
    """What of the referee's verdict on drawn paths is wrong; what they are, and the case."""
    fleet, paths = drawn_paths(rng, octile=octile)
    whole = rng.random() < 0.8
    plan = plan_of(fleet, paths, Status.FOUND if whole else Status.ITERATION_LIMIT, octile=octile)
    rules = broken(fleet.grid.blocked.tolist(), fleet.starts, fleet.goals, paths, whole=whole, octile=octile)
    verdict = check_fleet_plan(plan, fleet, every=bool(rng.integers(2)))
    case = {"rows": fleet.grid.blocked.tolist(), "starts": fleet.starts, "goals": fleet.goals, "paths": paths}
    word = "judged right" if not rules else "judged wrong"
    if verdict is None:
        return (
            (f"the referee passes paths that break {', '.join(sorted(rules))}" if rules else ""),
            word,
            case,
        )
    # Paths that jump, or end elsewhere, are shorter than the shortest path as well.
    if verdict.rule not in rules:
        return f"the referee says {verdict}; broken are {', '.join(sorted(rules)) or 'no rules'}", word, case
    return "", word, case


def figures_wrong(
    rng: np.random.Generator, number: int, *, octile: bool = False
) -> tuple[str, str, dict[str, object]]:
    """What of the referee's verdict is wrong on right paths with a figure that is wrong."""
    while True:
        fleet, paths = drawn_paths(rng, octile=octile)
        if not broken(fleet.grid.blocked.tolist(), fleet.starts, fleet.goals, paths, octile=octile):
            break
    plan = plan_of(fleet, paths, octile=octile)
    costs = plan.sum_of_costs
    assert costs is not None
    assert plan.shortest is not None
    kind = FIGURES[number // 2 % len(FIGURES)]
    k = int(rng.integers(len(paths)))
    shortest, rule, factor = plan.shortest.copy(), "bound", None
    if kind == "shortest more":
        shortest[k] += 1
        plan = replace(plan, shortest=shortest)
    elif kind == "shortest less":
        shortest[k] -= 1
        if shortest[k] < 0:
            kind = "none"
        else:
            plan = replace(plan, shortest=shortest)
    elif kind == "bound":
        plan = replace(plan, bound=costs + 1)
    elif kind == "rising":
        plan, rule = replace(plan, improvements=((1, max(0, costs - 1)), (2, costs))), "improvements"
        if costs == 0:
            kind, plan = "none", replace(plan, improvements=())
    elif kind == "last":
        plan, rule = replace(plan, improvements=((1, costs + 1),)), "improvements"
    elif kind == "factor":
        bound = plan.lower_bound or 0
        factor = costs / bound - 0.01 if bound else 1.0
        kind = kind if costs else "none"
    verdict = check_fleet_plan(plan, fleet, every=True, factor=factor)
    case = {"rows": fleet.grid.blocked.tolist(), "starts": fleet.starts, "goals": fleet.goals, "paths": paths}
    told = "nothing" if verdict is None else str(verdict)
    if (verdict is None) == (kind != "none") or (verdict is not None and verdict.rule != rule):
        return f"the referee says {told}; wrong is: {kind}", "figures", case
    return "", "figures", case
