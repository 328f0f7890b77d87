"""Solve: from free cells and a goal to the field (method.md section 2)."""

from __future__ import annotations

import heapq
import math

import numpy as np

from lampyris.errors import SceneError, SettingError
from lampyris.field.gates import gate_mask
from lampyris.field.layers import free_space, moves_for
from lampyris.model.field import Field
from lampyris.model.grid import frozen
from lampyris.model.moves import Moves
from lampyris.model.scene import Scene
from lampyris.typing import BoolGrid, Cell


def solve_field(scene: Scene, *, rho: float = 0.4, gamma: float = 0.6, gates: str = "ignore") -> Field:
    """The field of a scene: cost-to-goal, parents and luciferin of every cell.

    Parameters
    ----------
    rho, gamma : luciferin decay, 0 < rho <= 1, and enhancement, > 0.
    gates : ``ignore``, or ``close`` to seal openings too narrow for the robot (never the start or the goal).

    Raises
    ------
    SettingError : a setting out of its range.
    """
    if gates not in ("ignore", "close"):
        raise SettingError("GATES", f"gates {gates!r}", allowed="ignore, close")
    free = free_space(scene)
    if gates == "close":
        closed = gate_mask(scene.grid, scene.robot).copy()
        for x, y in (scene.start, scene.goal):
            closed[y, x] = False
        free = frozen(free & ~closed)
    return solve(free, moves_for(scene), scene.goal, rho=rho, gamma=gamma)


def solve(
    free: BoolGrid,
    moves: Moves,
    goal: Cell,
    *,
    rho: float = 0.4,
    gamma: float = 0.6,
    stop: Cell | None = None,
    revision: int = 0,
) -> Field:
    """The field over free cells."""
    if not (isinstance(rho, int | float) and 0 < rho <= 1):
        raise SettingError("RHO", f"rho {rho!r}", allowed="0 < rho <= 1")
    if not (isinstance(gamma, int | float) and math.isfinite(gamma) and gamma > 0):
        raise SettingError("GAMMA", f"gamma {gamma!r}", allowed="a finite number > 0")
    free = np.asarray(free, dtype=np.bool_)
    h, w = free.shape
    gx, gy = goal
    if not (0 <= gx < w and 0 <= gy < h):
        raise SceneError("GOAL_OUTSIDE", f"goal {goal} is outside the map", allowed=f"{w} x {h} cells")
    ok = free.tolist()
    exact = np.full((h, w), -1, dtype=np.int64)
    step = np.full((h, w), -1, dtype=np.int8)
    luc = np.full((h, w), np.inf)
    order: list[tuple[int, int]] = []

    def fr(x: int, y: int) -> bool:
        return 0 <= x < w and 0 <= y < h and ok[y][x]

    def legal(x: int, y: int, dx: int, dy: int) -> bool:
        if not fr(x + dx, y + dy):
            return False
        if abs(dx) == 2:
            return fr(x + dx // 2, y) and fr(x + dx // 2, y + dy)
        if abs(dy) == 2:
            return fr(x, y + dy // 2) and fr(x + dx, y + dy // 2)
        if dx and dy and not moves.corner_cutting:
            return fr(x + dx, y) and fr(x, y + dy)
        return True

    cost = {}
    heap = [(0, gx, gy)] if ok[gy][gx] else []
    best = {(gx, gy): 0}
    limit = None
    while heap:
        d, x, y = heapq.heappop(heap)
        if (x, y) in cost:
            continue
        if limit is not None and d > limit:
            break
        cost[x, y] = d
        order.append((x, y))
        if stop is not None and (x, y) == tuple(stop):
            limit = d
        for (dx, dy), c in zip(moves.offsets, moves.costs, strict=True):
            n = (x + dx, y + dy)
            if n not in cost and d + c < best.get(n, 1 << 62) and legal(x, y, dx, dy):
                best[n] = d + c
                heapq.heappush(heap, (d + c, *n))
    keep = 1.0 - rho
    for x, y in order:
        d = cost[x, y]
        exact[y, x] = d
        if (x, y) == (gx, gy):
            luc[y, x] = 0.0
            continue
        for k, ((dx, dy), c) in enumerate(zip(moves.offsets, moves.costs, strict=True)):
            p = (x + dx, y + dy)
            if p in cost and cost[p] + c == d and legal(x, y, dx, dy):
                step[y, x] = k
                luc[y, x] = keep * luc[p[1], p[0]] + gamma * (d / moves.unit)
                break
    return Field(
        frozen(free.copy()), frozen(exact), frozen(step), frozen(luc), (gx, gy), moves, rho, gamma, revision, len(order)
    )
