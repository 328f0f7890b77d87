"""Edits: which cells really turned, by the rule alone, and the map of each tick.

The rule is written down here a second time: at the beginning of a tick the cells of its edit turn, but for
cells that the robot or an obstacle covered at the tick before, and the goal, which never turn into walls.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import zip_longest

import numpy as np
from numpy.typing import NDArray

from lampyris.model.edit import Edit
from lampyris.model.grid import Grid
from lampyris.model.trace import Trace
from lampyris.referee.geometry.shapes import disc_cells
from lampyris.referee.verdict import Violation
from lampyris.typing import Cell

_NOTHING = Edit(0)


@dataclass(frozen=True, slots=True)
class Era:
    """Ticks with one map.

    Parameters
    ----------
    first, last : ticks, both among them. The step that ends at ``first`` is made on this map, too.
    turned : the cells that turned at ``first``; of the first era none.
    held : whether cells that were to turn into walls stayed free.
    """

    first: int
    last: int
    turned: Edit
    held: bool = False

    @property
    def since(self) -> int:
        """The tick at which its first step begins."""
        return max(self.first - 1, 0)


def eras_of(trace: Trace) -> list[Era]:
    """The times of a trace, in order: one, and one more for each edit that came to pass."""
    eras = [Era(0, trace.ticks, _NOTHING)]
    if not trace.scene.edits:
        return eras
    walls = trace.scene.grid.blocked.copy()
    for edit in trace.scene.edits:
        if edit.tick > trace.ticks:
            break
        kept = _covered(trace, edit.tick - 1)
        kept.add(trace.scene.goal)
        new = [c for c in edit.blocked if not walls[c[1], c[0]]]
        freed = tuple(c for c in edit.freed if walls[c[1], c[0]])
        turned = Edit(edit.tick, tuple(c for c in new if c not in kept), freed)
        _turn(walls, turned)
        eras[-1] = replace(eras[-1], last=edit.tick - 1)
        eras.append(Era(edit.tick, trace.ticks, turned, not kept.isdisjoint(new)))
    return eras


def with_maps(eras: list[Era], grid: Grid) -> Iterator[tuple[Era, Grid]]:
    """Each era with its map, from the map as given; one at a time, for there may be thousands."""
    yield eras[0], grid
    if len(eras) == 1:
        return
    walls = grid.blocked.copy()
    for era in eras[1:]:
        _turn(walls, era.turned)
        yield era, replace(grid, blocked=walls)


def _turn(walls: NDArray[np.bool_], turned: Edit) -> None:
    for cells, wall in ((turned.blocked, True), (turned.freed, False)):
        for x, y in cells:
            walls[y, x] = wall


def _covered(trace: Trace, tick: int) -> set[Cell]:
    """Every cell that the robot or an obstacle covers at a tick."""
    resolution = trace.scene.grid.resolution
    at = [(trace.robot[tick], trace.scene.robot.radius)]
    for track, since, obstacle in zip(trace.tracks, trace.appears, trace.obstacle_specs, strict=True):
        if since <= tick:
            at.append((track[tick - since], obstacle.radius))
    found: set[Cell] = set()
    for cell, radius in at:
        around = disc_cells(radius, resolution) + cell.astype(np.int64)
        found.update((x, y) for x, y in around.tolist())
    return found


def edits_violation(trace: Trace, eras: list[Era]) -> Violation | None:
    """Whether the trace tells of exactly the cells that turned, in its edits and in its events."""
    ours = [era.turned for era in eras if era.turned.blocked or era.turned.freed]
    for k, (mine, theirs) in enumerate(zip_longest(ours, trace.edits)):
        if mine is None or theirs is None or not _same(mine, theirs):
            what = f"tells of {_said(theirs)}; by the rule {_said(mine)}"
            return Violation("edits", f"edit {k} of the trace", what)
    due = []
    for era in eras:
        due += [(era.first, "wall")] * bool(era.turned.blocked or era.held)
        due += [(era.first, "opened")] * bool(era.turned.freed)
    reported = [(event.tick, event.word) for event in trace.events if event.word in ("wall", "opened")]
    for reported_edit, due_is in zip_longest(reported, due):
        if reported_edit != due_is:
            return Violation("edits", "events", f"the next is {reported_edit}; by the rule {due_is}")
    return None


def _same(a: Edit, b: Edit) -> bool:
    return (a.tick, sorted(a.blocked), sorted(a.freed)) == (b.tick, sorted(b.blocked), sorted(b.freed))


def _said(edit: Edit | None) -> str:
    if edit is None:
        return "none"
    return f"{len(edit.blocked)} walls and {len(edit.freed)} free cells at tick {edit.tick}"
