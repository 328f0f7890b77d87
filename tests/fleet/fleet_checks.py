"""What the tests of fleets share: random maps, conflicts counted from the definition, optima by brute force."""

from __future__ import annotations

import heapq
from itertools import pairwise, product

import numpy as np
from scipy import ndimage

import lampyris
from lampyris.typing import BoolGrid, Cell


def random_map(seed: int, width: int, height: int, share: float) -> lampyris.Grid:
    """A map with random walls; its largest region is what fleets are drawn in."""
    rng = np.random.default_rng(seed)
    blocked = rng.random((height, width)) < share
    blocked[height // 2, width // 2] = blocked[height // 2, width // 2 - 1] = False
    return lampyris.Grid(blocked)


def conflicts(plan: lampyris.FleetPlan, fleet: lampyris.Fleet) -> list[str]:
    """Every rule that a plan breaks, a few lines from the definitions and nothing of the referee's."""
    found = []
    cells = [[tuple(c) for c in path.tolist()] for path in plan.paths]
    last = max(map(len, cells))
    cells = [path + path[-1:] * (last - len(path)) for path in cells]
    for k, (path, agent) in enumerate(zip(cells, fleet.robots, strict=True)):
        if path[0] != agent.start or path[-1] != agent.goal:
            found.append(f"ends of {k}")
        for (x, y), (u, v) in pairwise(path):
            if (u, v) not in neighbours(fleet.grid.blocked, (x, y), plan.moves):
                found.append(f"step of {k}")
    for t in range(last):
        now = [path[t] for path in cells]
        if len(set(now)) < len(now):
            found.append(f"vertex at {t}")
        if t:
            steps = {(path[t - 1], path[t]) for path in cells if path[t - 1] != path[t]}
            found += [f"swap at {t}" for a, b in steps if (b, a) in steps]
            found += [f"crossing at {t}" for a, b in steps for c, d in steps if crossing(a, b, c, d)]
    return found


def crossing(a: Cell, b: Cell, c: Cell, d: Cell) -> bool:
    """Whether steps a - b and c - d are the two diagonals of one block of four cells."""
    if a[0] == b[0] or a[1] == b[1]:
        return False
    return {c, d} == {(a[0], b[1]), (b[0], a[1])}


def contacts(plan: lampyris.FleetPlan, fleet: lampyris.Fleet, parts: int = 240) -> list[str]:
    """Pairs of robots whose discs overlap at one of so many instants of a tick, and robots whose discs reach into walls."""
    unit = fleet.grid.resolution
    radii = np.array([0.0 if one.robot is None else one.robot.radius / unit for one in fleet.robots])
    walls = np.argwhere(fleet.grid.blocked)[:, ::-1]
    last = max(map(len, plan.paths))
    at = np.stack([p[np.minimum(np.arange(last), len(p) - 1)] for p in plan.paths]).astype(float)
    found = []
    for share in np.arange(parts) / parts:
        now = at[:, :-1] + share * np.diff(at, axis=1) if last > 1 else at
        gap = np.sqrt(((now[:, None] - now[None]) ** 2).sum(axis=-1))
        need = radii[:, None] + radii[None]
        near = (gap < need[..., None] - 1e-6) & ~np.eye(len(radii), dtype=bool)[..., None]
        found += [f"discs {i} and {j} at {t + share}" for i, j, t in np.argwhere(near) if i < j]
        if len(walls):
            out = np.maximum(np.abs(now[:, :, None] - walls) - 0.5, 0.0)
            deep = np.sqrt((out**2).sum(axis=-1)).min(axis=-1) < radii[:, None] - 1e-6
            found += [f"disc {i} in a wall at {t + share}" for i, t in np.argwhere(deep)]
    return found


def neighbours(blocked: BoolGrid, cell: Cell, moves: str = "four-connected") -> list[Cell]:
    x, y = cell
    height, width = blocked.shape

    def free(u: int, v: int) -> bool:
        return 0 <= u < width and 0 <= v < height and not blocked[v, u]

    near = [(x, y), (x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1)]
    found = [(u, v) for u, v in near if free(u, v)]
    if moves == "octile":
        found += [
            (x + dx, y + dy)
            for dx in (-1, 1)
            for dy in (-1, 1)
            if free(x + dx, y) and free(x, y + dy) and free(x + dx, y + dy)
        ]
    return found


def joint_optimum(fleet: lampyris.Fleet, moves: str = "four-connected") -> int | None:
    """The least sum of costs, by Dijkstra over all robots' cells and which of them have stopped for good; None: no plan.

    A robot that is on its goal may stop at any tick; it then costs nothing and never moves again.
    """
    blocked, goals = fleet.grid.blocked, fleet.goals
    robots = len(goals)
    start = (fleet.starts, (False,) * robots)
    best, queue = {start: 0}, [(0, start)]
    while queue:
        cost, state = heapq.heappop(queue)
        if cost > best[state]:
            continue
        cells, stopped = state
        if all(stopped):
            return cost
        for k in range(robots):  # stopping costs nothing and takes no time
            if cells[k] == goals[k] and not stopped[k]:
                then = (cells, (*stopped[:k], True, *stopped[k + 1 :]))
                if cost < best.get(then, cost + 1):
                    best[then] = cost
                    heapq.heappush(queue, (cost, then))
        ways = [
            [cell] if done else neighbours(blocked, cell, moves)
            for cell, done in zip(cells, stopped, strict=True)
        ]
        for new in product(*ways):
            if len(set(new)) < robots:
                continue
            if any(
                (new[i] == cells[j] and new[j] == cells[i] and new[i] != cells[i])
                or crossing(cells[i], new[i], cells[j], new[j])
                for i in range(robots)
                for j in range(i)
            ):
                continue
            then, paid = (new, stopped), cost + robots - sum(stopped)
            if paid < best.get(then, paid + 1):
                best[then] = paid
                heapq.heappush(queue, (paid, then))
    return None


def is_biconnected(blocked: BoolGrid) -> bool:
    """Whether the free cells are connected, and are still without any one of them."""
    cells = np.argwhere(~blocked)
    if len(cells) < 3 or ndimage.label(~blocked)[1] != 1:
        return False
    for y, x in cells.tolist():
        free = ~blocked
        free[y, x] = False
        if ndimage.label(free)[1] != 1:
            return False
    return True
