"""Change: the one small value that flows back, from what was sensed to what was planned."""

from __future__ import annotations

from dataclasses import dataclass

from lampyris.typing import Cell


@dataclass(frozen=True, slots=True)
class Change:
    """What is new since the planner was last asked.

    Parameters
    ----------
    robot : the cell the robot stands on now; None: where it was.
    obstacles : every cell that a moving obstacle is seen to cover now (the whole picture, not a difference).
    blocked, freed : cells of the map that turned blocked or free for good (a wall was found, a gate proved
        too narrow).
    terrain : cells whose terrain value changed, with the new value, 0 to 252
        (:attr:`lampyris.model.grid.Grid.terrain`). Those that are blocked are passed over.
    """

    robot: Cell | None = None
    obstacles: frozenset[Cell] = frozenset()
    blocked: tuple[Cell, ...] = ()
    freed: tuple[Cell, ...] = ()
    terrain: tuple[tuple[Cell, int], ...] = ()
