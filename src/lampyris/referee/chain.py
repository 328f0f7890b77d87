"""Plans of chains: limits, ends, and that no link meets a wall or another link at any moment.

Motions are judged without a step length: if every link is farther from all else at the middle of a stretch than any
point moves from there to its ends, the stretch is free; else it is halved.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lampyris.model.chain.chain import Chain
from lampyris.model.chain.chain_plan import ChainPlan
from lampyris.model.grid import Grid
from lampyris.model.plan import Status
from lampyris.referee.verdict import Violation
from lampyris.typing import Floats

_LEAST = 1e-10
"""Metres: a stretch on which nothing moves farther is a moment."""


def check_chain_plan(plan: ChainPlan) -> Violation | None:
    """The first broken rule of a chain's plan.

    Rules, in this order: ``status`` (configurations exactly when found), ``ends``, ``limits``, ``released``, ``link``
    (it meets a wall, another link but its neighbours, or leaves the map).
    """
    rows = plan.configurations
    if (rows is None) != (plan.status is not Status.FOUND):
        return Violation(
            "status", "plan", f"{plan.status.value} with {'no ' if rows is None else ''}configurations"
        )
    known = range(plan.chain.joints)
    if len(set(plan.released)) != len(plan.released) or not set(plan.released) <= set(known):
        return Violation("released", "plan", f"joints {plan.released} of {plan.chain.joints}")
    if rows is None:
        return None
    if len(rows) == 0 or (rows[0] != plan.start).any() or (rows[-1] != plan.goal).any():
        return Violation("ends", "plan", "the first or last configuration is not the one asked for")
    low, high = np.array(plan.chain.joint_limits).T
    outside = ((rows < low) | (rows > high)).any(axis=1)
    if outside.any():
        return Violation("limits", f"configuration {int(outside.argmax())}", "a joint is beyond its limits")
    walls = _Walls(plan.grid)
    for k in range(max(1, len(rows) - 1)):
        what = _motion_fault(plan.chain, walls, rows[k], rows[min(k + 1, len(rows) - 1)])
        if what:
            return Violation("link", f"motion {k}", what)
    return None


class _Walls:
    """Blocked cells in metres of a frame whose axes are the grid's, from the lower left corner of the map."""

    def __init__(self, grid: Grid) -> None:
        y, x = np.nonzero(grid.blocked)
        self.half = grid.resolution / 2.0
        self.size = np.array([grid.width, grid.height]) * grid.resolution
        self.centres = np.stack((x + 0.5, grid.height - y - 0.5), axis=1) * grid.resolution
        self.origin = grid.origin

    def own(self, chain: Chain) -> tuple[Floats, float]:
        """The base in that frame, and what to take off headings."""
        x, y, yaw = self.origin
        dx, dy = chain.base[0] - x, chain.base[1] - y
        c, s = math.cos(yaw), math.sin(yaw)
        return np.array([c * dx + s * dy, c * dy - s * dx]), yaw


def _polygons(chain: Chain, walls: _Walls, q: Floats) -> NDArray[np.float64]:
    """The corners of every link, (links, 4, 2)."""
    at, yaw = walls.own(chain)
    heading = -yaw
    made = []
    for length, width, angle in zip(chain.links, chain.widths, q.tolist(), strict=True):
        heading += angle
        along = np.array([math.cos(heading), math.sin(heading)])
        aside = np.array([-along[1], along[0]]) * (width / 2.0)
        tip = at + length * along
        made.append([at - aside, tip - aside, tip + aside, at + aside])
        at = tip
    return np.array(made)


def _gap(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    """At most the distance between two convex polygons, (k, 2) each; not above 0 if they overlap."""
    best = -math.inf
    for polygon in (one, other):
        edges = np.roll(polygon, -1, axis=0) - polygon
        normals = np.stack((edges[:, 1], -edges[:, 0]), axis=1)
        normals = normals / np.sqrt((normals**2).sum(axis=1, keepdims=True))
        a, b = one @ normals.T, other @ normals.T
        apart = np.maximum(b.min(axis=0) - a.max(axis=0), a.min(axis=0) - b.max(axis=0))
        best = max(best, float(apart.max()))
    return best


def _wall_gap(polygon: NDArray[np.float64], centres: NDArray[np.float64], half: float) -> float:
    """The least :func:`_gap` between a rectangle and squares of that half side; infinity without squares."""
    if not len(centres):
        return math.inf
    along = polygon[1] - polygon[0]
    along = along / math.sqrt(float(along @ along))
    axes = np.array([[1.0, 0.0], [0.0, 1.0], along, [-along[1], along[0]]])
    shadow, places = polygon @ axes.T, centres @ axes.T
    reach = half * np.abs(axes).sum(axis=1)
    apart = np.maximum(places - reach - shadow.max(axis=0), shadow.min(axis=0) - places - reach)
    return float(apart.max(axis=1).min())


def _room(polygons: NDArray[np.float64], walls: _Walls, most: float) -> tuple[float, str]:
    """How far all links are from what they must not meet, at most ``most``, and what is nearest.

    Links count half: both may move.
    """
    room, nearest = most, ""
    middles = polygons.mean(axis=1)
    radii = np.sqrt(((polygons - middles[:, None]) ** 2).sum(axis=2)).max(axis=1)
    for k, polygon in enumerate(polygons):
        low, high = polygon.min(axis=0), polygon.max(axis=0)
        inside = float(min(low.min(), (walls.size - high).min()))
        if inside < room:
            room, nearest = inside, f"link {k} leaves the map"
        reach = walls.half + most
        near = ((walls.centres > low - reach) & (walls.centres < high + reach)).all(axis=1)
        gap = _wall_gap(polygon, walls.centres[near], walls.half)
        if gap < room:
            room, nearest = gap, f"link {k} meets a wall"
        apart = (
            np.sqrt(((middles[: max(0, k - 1)] - middles[k]) ** 2).sum(axis=1))
            - radii[: max(0, k - 1)]
            - radii[k]
        )
        for j in np.flatnonzero(apart < 2.0 * room).tolist():
            gap = _gap(polygons[j], polygon) / 2.0
            if gap < room:
                room, nearest = gap, f"links {j} and {k} meet"
    return room, nearest


def _motion_fault(chain: Chain, walls: _Walls, a: Floats, b: Floats) -> str:
    """What is wrong with the straight motion between two configurations; empty: nothing."""
    lengths, half = np.array(chain.links), max(chain.widths) / 2.0
    lever = np.array([float(lengths[k:].sum()) + half for k in range(chain.joints)])
    whole = float((np.abs(b - a) * lever).sum())
    left = [(0.0, 1.0)]
    while left:
        begin, end = left.pop()
        middle = (begin + end) / 2.0
        moves = whole * (end - begin) / 2.0
        room, nearest = _room(_polygons(chain, walls, a + middle * (b - a)), walls, max(2.0 * moves, _LEAST))
        if room < -_LEAST:
            return nearest
        if room >= moves:
            continue
        if 2.0 * moves < _LEAST:
            return nearest
        left += [(begin, middle), (middle, end)]
    return ""
