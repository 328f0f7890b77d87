"""Expanded: the cells that a planner's search takes, in its own order, for who wants to see it.

The search is made once more in its plain form with a list in the place of one scratch array, which writes
down what is read of it: each expansion asks by which step its cell was entered. So neither form of the kernel
knows of it, and a search that nobody asks about costs what it did. A record kept by the kernel itself would
have put a branch into each expansion of every search.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from lampyris.model.scene import Scene
from lampyris.planning.base import Planner
from lampyris.planning.graph.grid_graph import GridSearch
from lampyris.planning.graph.session import GraphSession
from lampyris.planning.graph.terrain_graph import TerrainSearch
from lampyris.typing import Cells

MOST_CELLS: Final = 600_000
"""Cells of the largest map that is searched for this: a second or so in the plain form."""


def expanded(planner: Planner, scene: Scene) -> Cells | None:
    """The cells that a planner expands on its way from the scene's start to its goal, first come first;
    int32 (n, 2).

    None where it cannot be said: planners with another search than A*'s and Dijkstra's keep no record, and
    on maps of more than :data:`MOST_CELLS` it would take too long.
    """
    if scene.grid.blocked.size > MOST_CELLS:
        return None
    session = planner.open(scene, np.random.Generator(np.random.PCG64(0)))
    if not isinstance(session, GraphSession):
        return None
    search, free = session.search, session.free
    if not isinstance(search, GridSearch | TerrainSearch):
        return None
    if not all(free[y, x] for x, y in (scene.start, scene.goal)):
        return np.zeros((0, 2), dtype=np.int32)
    return search.order(scene.start, scene.goal)
