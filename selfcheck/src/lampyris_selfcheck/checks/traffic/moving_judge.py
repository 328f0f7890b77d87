"""The judgement of one plan among moving obstacles: when it arrives, and whom it meets."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from lampyris.model.plan import Plan, Status
from lampyris_selfcheck.reference.paths.timed import Body, Cell, clash, legal, nearest2

POINT: tuple[Cell, ...] = ((0, 0),)


@dataclass(frozen=True, slots=True)
class Judged:
    """A plan, and what it was asked.

    Parameters
    ----------
    free, steps, cutting : the map, the steps and whether they cut corners, as the reference takes them.
    start, goal, tick : from where, when, and to where.
    bodies, own : the moving obstacles, and the robot's footprint.
    """

    plan: Plan
    free: Sequence[Sequence[bool]]
    steps: Sequence[Cell]
    cutting: bool
    start: Cell
    goal: Cell
    bodies: Sequence[Body]
    own: Sequence[Cell] = POINT
    tick: int = 0


def fault(asked: Judged, want: int | None) -> tuple[str, float | None]:
    """What is wrong with a plan (nothing: an empty string), and the least distance of two centres, cells.

    ``want`` is the earliest arrival; None if there is none.
    """
    plan = asked.plan
    if want is None:
        ended = plan.status in (Status.HEMMED_IN, Status.NO_PATH)
        return ("" if ended else f"{plan.status} where the goal is never to be had"), None
    if plan.status is not Status.FOUND or plan.path is None or plan.schedule is None:
        return f"{plan.status}, should arrive at tick {want}", None
    cells = [(int(x), int(y)) for x, y in plan.path.cells.tolist()]
    ticks = [int(t) for t in plan.schedule.tolist()]
    wrong = _times(asked, cells, ticks)
    if wrong:
        return wrong, None
    if ticks[-1] != want:
        return f"arrives at tick {ticks[-1]}, should at {want}", None
    places = {ticks[0]: cells[0]}
    for cell, now, then in zip(cells, ticks, [*ticks[1:], ticks[-1] + 1], strict=True):
        places |= dict.fromkeys(range(now, then), cell)
    return _meetings(asked, places)


def _times(asked: Judged, cells: list[Cell], ticks: list[int]) -> str:
    """Whether the schedule is one: a tick for each cell, rising from the tick that was asked about."""
    if len(ticks) != len(cells):
        return f"{len(ticks)} ticks for {len(cells)} cells"
    if ticks[0] != asked.tick or any(b <= a for a, b in pairwise(ticks)):
        return f"the ticks {ticks} do not rise from {asked.tick}"
    if (cells[0], cells[-1]) != (asked.start, asked.goal):
        return f"from {cells[0]} to {cells[-1]}"
    for a, b in pairwise(cells):
        if (b[0] - a[0], b[1] - a[1]) not in asked.steps or not legal(asked.free, a, b, asked.cutting):
            return f"{a} to {b} is no step"
    return ""


def _meetings(asked: Judged, places: dict[int, Cell]) -> tuple[str, float | None]:
    """The four kinds: on one cell, a swap, two diagonals of a block, and centres that meet between ticks."""
    least = None
    for t in sorted(places)[1:]:
        a0, a1 = places[t - 1], places[t]
        for k, body in enumerate(asked.bodies):
            rule = clash(a0, a1, asked.own, body, t)
            if rule:
                return f"{rule} with obstacle {k} at tick {t}", None
            b0, b1 = body[0](t - 1), body[0](t)
            if a0 == b0:
                continue  # asked with an obstacle on the robot: it has driven out from under it
            near = nearest2(a0, a1, b0, b1)
            least = near if least is None else min(least, near)
            if near == 0:
                return f"meets the centre of obstacle {k} before tick {t}", None
    return "", None if least is None else math.sqrt(least)
