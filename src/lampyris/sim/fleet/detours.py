"""Where the robots of a fleet go when others have stopped permanently."""

from __future__ import annotations

from collections import deque
from collections.abc import Container, Mapping, Sequence

import numpy as np

from lampyris.typing import BoolGrid, Cell


def goals_around(
    blocked: BoolGrid, places: Mapping[int, Cell], goals: Sequence[Cell]
) -> tuple[dict[int, Cell], list[int]]:
    """A goal for each robot that it can reach: its own, or else the nearest free cell that is nobody's goal.

    Parameters
    ----------
    blocked : walls, and cells of robots that have stopped.
    places : cells of the other robots, which are free.
    goals : of all robots.

    Returns
    -------
    The goals by robot, and the robots that cannot come to their own.
    """
    from scipy import ndimage  # bits: labels, whole numbers

    labels = ndimage.label(~np.asarray(blocked))[0]
    made: dict[int, Cell] = {}
    lost = []
    for k, (x, y) in places.items():
        u, v = goals[k]
        if blocked[v, u] or labels[v, u] != labels[y, x]:
            lost.append(k)
        else:
            made[k] = goals[k]
    taken = set(made.values())
    for k in lost:
        made[k] = nearest_free(blocked, places[k], taken)
        taken.add(made[k])
    return made, lost


def nearest_free(blocked: BoolGrid, place: Cell, taken: Container[Cell]) -> Cell:
    """The nearest cell of the region of ``place`` that is not taken; ``place`` if all are."""
    queue, seen = deque([place]), {place}
    height, width = blocked.shape
    while queue:
        cell = queue.popleft()
        if cell not in taken:
            return cell
        for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            x, y = cell[0] + dx, cell[1] + dy
            if 0 <= x < width and 0 <= y < height and not blocked[y, x] and (x, y) not in seen:
                seen.add((x, y))
                queue.append((x, y))
    return place


def late_faults(faults: Sequence[tuple[int, float]], unit: str, end: float) -> str:
    """The note on faults that fall after the end of a drive.

    Parameters
    ----------
    faults : robots and times.
    unit : of the times.
    end : of the drive.
    """
    names = ", ".join(f"robot {k} at {when:.6g}" for k, when in faults[:8]) + (
        " and more" if faults[8:] else ""
    )
    return f"faults after the end of the drive ({end:.6g} {unit}) had no effect: {names} {unit}"
