"""Lower bounds on every path of a scene, known before a path is searched for.

Limits of use are compared with them first, so that a search whose every path would be refused is not begun.
Where there is no path at all, that is the answer, whatever the limits.
"""

from __future__ import annotations

import math

from lampyris._core.limits import Limit
from lampyris.model.scene import Scene
from lampyris.planning.field.layers import free_space, moves_for
from lampyris.planning.field.solve import exact_costs


def least_steps(scene: Scene) -> int:
    """Steps that every path from start to goal has; 0 where an end is blocked, which is the answer then."""
    dx, dy = _between(scene)
    return -(-max(dx, dy) // scene.moves.reach)


def demand_at_least(limit: Limit, scene: Scene, needed: float, what: str, *, instead: str = "") -> None:
    """Refuse a scene each of whose paths needs more than a limit allows.

    Parameters
    ----------
    limit : what is asked.
    scene : with its ends.
    needed : a lower bound for every path, in the limit's unit.
    what, instead : as for :meth:`lampyris._core.limits.Limit.demand`.

    Raises
    ------
    LimitError : it is more than is allowed, and there is a path.
    """
    if needed > limit.allowed and _connected(scene):
        limit.demand(int(min(needed, 1e15)), what, instead=instead, least=True)


def _connected(scene: Scene) -> bool:
    """Whether walls leave a path from start to goal for this robot; obstacles are not asked."""
    free = free_space(scene)
    (x0, y0), goal = scene.start, scene.goal
    if not (free[y0, x0] and free[goal[1], goal[0]]):
        return False
    return bool(exact_costs(free, moves_for(scene), goal)[0][y0, x0] >= 0)


def least_metres(scene: Scene) -> float:
    """Metres that every path from start to goal has; 0 where an end is blocked."""
    dx, dy = _between(scene)
    return math.sqrt(dx * dx + dy * dy) * scene.grid.resolution


def _between(scene: Scene) -> tuple[int, int]:
    """Columns and rows from start to goal."""
    (x0, y0), (x1, y1), blocked = scene.start, scene.goal, scene.grid.blocked
    if blocked[y0, x0] or blocked[y1, x1]:
        return 0, 0
    return abs(x1 - x0), abs(y1 - y0)
