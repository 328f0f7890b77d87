"""What any way of a scene takes at the least, known before one is searched for.

Limits of use are asked with it first: a search whose every answer would be refused is not begun.
"""

from __future__ import annotations

import math

from lampyris.model.scene import Scene


def least_steps(scene: Scene) -> int:
    """Steps that every path from start to goal has; 0 where an end is blocked, which is the answer then."""
    dx, dy = _between(scene)
    return -(-max(dx, dy) // scene.moves.reach)


def least_metres(scene: Scene) -> float:
    """Metres that every way from start to goal has; 0 where an end is blocked."""
    dx, dy = _between(scene)
    return math.sqrt(dx * dx + dy * dy) * scene.grid.resolution


def _between(scene: Scene) -> tuple[int, int]:
    """Columns and rows from start to goal."""
    (x0, y0), (x1, y1), blocked = scene.start, scene.goal, scene.grid.blocked
    if blocked[y0, x0] or blocked[y1, x1]:
        return 0, 0
    return abs(x1 - x0), abs(y1 - y0)
