"""Slow reference of the cap of blind areas, from docs/speed/blind_area.md: its distance used up, corner by corner.

Bounds from both sides. A corner that beyond doubt hides something (clearly in sight, clearly ahead, clearly
with room behind it) must be minded; the nearest corner of all, seen or not, asks for no more than is kept.
Places are those of cells: cell (x, y) is the square of side 1 around (x, y).
"""

from __future__ import annotations

import math

import numpy as np

CLEAR = 0.02
"""Cells by which something must be so to be beyond doubt; the product puts the eye on a lattice."""

NEAREST = 12
"""Corners about a node that are asked whether they hide something."""


def spent(v: float, *, a: float, p: float, reaction: float, hidden_speed: float) -> float:
    """Metres that a robot of speed v and a mover come nearer by until the robot stands.

    The robot accelerates with a for the reaction time, then brakes with p; the mover comes the other way.
    """
    fastest = v + a * reaction
    own = (v + fastest) / 2 * reaction + fastest * fastest / (2 * p)
    return own + hidden_speed * (reaction + fastest / p)


def corners(blocked: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners that stick out of the walls, (n, 2), and the middle of the square that each belongs to."""
    found, owner = [], []
    height, width = blocked.shape
    for y, x in zip(*np.nonzero(blocked), strict=True):
        for dx, dy in ((-1, -1), (1, -1), (-1, 1), (1, 1)):
            beside = ((x + dx, y), (x, y + dy), (x + dx, y + dy))
            if not any(0 <= u < width and 0 <= v < height and blocked[v, u] for u, v in beside):
                found.append((x + dx / 2, y + dy / 2))
                owner.append((x, y))
    return np.array(found, dtype=float).reshape(-1, 2), np.array(owner, dtype=float).reshape(-1, 2)


def to_edge(points: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Distance of points to the straight line from a to b, (n,)."""
    along = b - a
    size = float(along @ along)
    share = np.clip((points - a) @ along / size, 0.0, 1.0) if size else np.zeros(len(points))
    return np.hypot(*(points - a - share[:, None] * along).T)


def hides(
    eye: np.ndarray,
    corner: np.ndarray,
    owner: np.ndarray,
    walls: np.ndarray,
    rho: float,
    size: tuple[int, int],
) -> bool:
    """Whether the corner beyond doubt hides a disc of radius ``rho`` from the eye.

    The sight touches the corner and goes on in free space, and on it, behind the corner, the disc has room.
    ``walls``: the middles of all blocked squares, (m, 2). ``size``: columns and rows of the map, whose edge
    hides nobody.
    """
    ray = corner - eye
    away = math.hypot(*ray)
    side = np.sign(owner - corner)  # towards the wall
    # It passes the wall on one side: against it in one direction, past it in the other.
    if away < 0.5 or (np.abs(ray) < CLEAR * away).any() or np.prod(np.sign(ray) * side) >= 0:
        return False
    others = walls[(walls != owner).any(axis=1)]
    for t in rho + np.linspace(CLEAR, 1.0, 5):
        centre = corner + ray / away * t
        if (centre < CLEAR - 0.5).any() or (centre > np.array(size) - 0.5 - CLEAR).any():
            return False
        gap = np.hypot(*np.maximum(np.abs(walls - centre) - 0.5, 0.0).T)
        if gap.min() >= rho + CLEAR:
            return not _meets(eye, centre, others)
    return False


def _meets(a: np.ndarray, b: np.ndarray, squares: np.ndarray) -> bool:
    """Whether the line from a to b comes near to one of the squares."""
    d = b - a  # neither is 0
    first = (squares - 0.5 - CLEAR - a) / d
    second = (squares + 0.5 + CLEAR - a) / d
    low = np.minimum(first, second).max(axis=1)
    high = np.maximum(first, second).min(axis=1)
    return bool(((low <= high) & (high >= 0.0) & (low <= 1.0)).any())
