"""Places in a trace: where its robot and bodies are, and the same trace with one of them elsewhere."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from lampyris.model.trace import Trace
from lampyris.typing import Cell
from lampyris_selfcheck.reference.motion.quick_monitor import footprint


def pick(rng: np.random.Generator, some: list[Any]) -> Any:
    """One of some, None of none."""
    return some[int(rng.integers(len(some)))] if some else None


def cell_of(row: Any) -> Cell:
    """A row of an array as a cell."""
    return int(row[0]), int(row[1])


def place(trace: Trace, k: int, t: int) -> Cell:
    """Where body k is at a tick, once it has appeared."""
    return cell_of(trace.tracks[k][t - trace.appears[k]])


def bodies_at(trace: Trace, before: int) -> list[int]:
    """Bodies that are on the map at a tick."""
    return [k for k, t0 in enumerate(trace.appears) if t0 <= before]


def taken(trace: Trace, t: int, but: int) -> set[Cell]:
    """Cells on which the robot and the other bodies stand at a tick."""
    return {place(trace, b, t) for b in bodies_at(trace, t) if b != but} | {cell_of(trace.robot[t])}


def drawn(trace: Trace, rng: np.random.Generator, but: int = -1) -> int | None:
    """Some body that is not recorded."""
    some = [k for k, body in enumerate(trace.obstacle_specs) if body.kind != "recorded" and k != but]
    k: int | None = pick(rng, some)
    return k


def moving_ticks(trace: Trace) -> list[int]:
    """Ticks at which the robot has just made a step."""
    return (np.flatnonzero((trace.robot[1:] != trace.robot[:-1]).any(axis=1)) + 1).tolist()


def short_steps(trace: Trace) -> list[int]:
    """Ticks at which the robot has just made a step to a neighbour, but for the last; nor was the one before
    it longer, for that would be over somebody who stands ahead.
    """
    long = np.append(0, np.abs(np.diff(trace.robot, axis=0)).max(axis=1, initial=0))
    return [t for t in moving_ticks(trace)[:-1] if long[t] == 1 and long[t - 1] <= 1]


def walker(trace: Trace, rng: np.random.Generator) -> tuple[int, int | None]:
    """A tick, and a body that has just made a step; a diagonal one if there is one."""
    if trace.ticks < 1:
        return 1, None
    t = int(rng.integers(1, trace.ticks + 1))
    there = bodies_at(trace, t - 1)
    steps = {k: np.abs(np.subtract(place(trace, k, t), place(trace, k, t - 1))).sum() for k in there}
    most = max(steps.values(), default=0)
    return t, pick(rng, [k for k, long in steps.items() if long == most > 0])


def reach(trace: Trace) -> int:
    """Cells that the robot covers beyond its own, at most."""
    return int(np.abs(footprint(trace.scene.robot.radius, trace.scene.grid.resolution)).max())


def body_reach(trace: Trace) -> int:
    """Cells that a body covers beyond its own, at most."""
    return max((max(map(abs, c)) for b in trace.obstacle_specs for c in b.footprint), default=0)


def is_small(trace: Trace) -> bool:
    """Whether the robot and all bodies cover a cell each."""
    return reach(trace) == 0 and body_reach(trace) == 0


def robot_put(trace: Trace, t: int, cell: Cell) -> Trace:
    """The robot at another cell at one tick."""
    robot = trace.robot.copy()
    robot[t] = cell
    return replace(trace, robot=robot)


def body_put(trace: Trace, k: int, t: int, cell: Cell) -> Trace:
    """Body k at another cell at one tick."""
    tracks = [track.copy() for track in trace.tracks]
    tracks[k][t - trace.appears[k]] = cell
    return replace(trace, tracks=tuple(tracks))


def appearing(trace: Trace, k: int | None, since: int, *cells: Cell) -> Trace | None:
    """Body k appears only at a tick, walks these cells from there on, and stands on the last of them.

    None where a judge could see something before: a body or a wall on one of the cells, a long step of the
    robot over one, or edits, whose cells turn or not as bodies stand on them.
    """
    last = since + len(cells) - 1
    if k is None or trace.obstacle_specs[k].kind == "recorded" or trace.scene.edits or last >= trace.ticks:
        return None
    others = [b for b in range(len(trace.tracks)) if b != k]
    if any(trace.appears[b] > since for b in others):
        return None
    grid = trace.scene.grid
    for t, cell in enumerate(cells, since):
        x, y = cell
        over = [(x + dx, y + dy) for dx, dy in trace.obstacle_specs[k].footprint]
        free = grid.contains(cell) and not any(grid.contains(c) and grid.blocked[c[1], c[0]] for c in over)
        if not free or (t < last and cell in taken(trace, t, k)) or _driven_over(trace, t, cell):
            return None
    order = [*others, k]
    walked = np.array([*cells, *[cells[-1]] * (trace.ticks - last)])
    return replace(
        trace,
        obstacle_specs=tuple(trace.obstacle_specs[b] for b in order),
        appears=(*(trace.appears[b] for b in others), since),
        tracks=(*(trace.tracks[b] for b in others), walked),
    )


def _driven_over(trace: Trace, t: int, cell: Cell) -> bool:
    """Whether the robot, coming or going at a tick, makes a long step in whose box the cell is, between."""
    for a, b in pairwise(trace.robot[max(t - 1, 0) : t + 2]):
        low, high = np.minimum(a, b), np.maximum(a, b)
        within = (low <= cell).all() and (cell <= high).all()
        if within and (high - low).max() > 1 and cell not in (cell_of(a), cell_of(b)):
            return True
    return False


def face_to_face(trace: Trace, k: int | None, t: int, old: Cell, new: Cell) -> Trace | None:
    """Body k goes from a cell to another in tick t, and both are free of all but whom it is to meet."""
    if k is None or new in taken(trace, t, k):
        return None
    return appearing(trace, k, t - 1, old, new)
