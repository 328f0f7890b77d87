"""The earliest arrival of one robot, layer by layer of ticks: among others whose paths are given, and under constraints."""

from __future__ import annotations

from collections.abc import Sequence

from lampyris_selfcheck.reference.fleets.fleet_rules import Cell, Rows, cross, neighbours


def earliest_arrival(
    blocked: Rows,
    start: Cell,
    goal: Cell,
    others: Sequence[Sequence[Cell]],
    *,
    last: int,
    octile: bool = False,
) -> int | None:
    """The first tick from which the robot can stay at its goal; None: later than ``last``, or never.

    As prioritised planning by SIPP asks for it, the robot does not enter its goal before the last of the others that pass
    there has left it.

    Parameters
    ----------
    others : their cells tick by tick; each stays at the end of its path.
    last : ticks that are looked at.
    """
    span = max((len(path) for path in others), default=1)
    at = [[path[min(t, len(path) - 1)] for path in others] for t in range(span + 1)]
    passed = max((t for t in range(span + 1) if goal in at[t]), default=-1)
    layer = {start}
    for t in range(last + 1):
        if goal in layer and t > passed:
            return t
        now, then = at[min(t, span)], at[min(t + 1, span)]
        layer = {
            v
            for u in layer
            for v in (u, *neighbours(blocked, u, octile=octile))
            if v not in then
            and not (v == goal and t + 1 <= passed)
            and not any((a == v and b == u) or cross(u, v, a, b) for a, b in zip(now, then, strict=True))
        }
    return None


def earliest_allowed(
    blocked: Rows,
    start: Cell,
    goal: Cell,
    constraints: Sequence[tuple[str, Cell, Cell, int]],
    *,
    last: int,
    octile: bool = False,
) -> int | None:
    """The first tick from which the robot can stay at its goal and keeps to constraints; None: later than ``last``, or never.

    Parameters
    ----------
    constraints : kind, cell, cell that a step leads to, tick. ``not at`` and ``must be at`` a cell at a tick, ``not step`` to
        the second cell, arriving at the tick, ``later`` and ``by``: arrive after the tick, or at it at the latest, ``not
        from``: not on the cell from the tick on.
    """

    def allowed(u: Cell, v: Cell, t: int) -> bool:
        for kind, cell, then, tick in constraints:
            if kind == "not at" and (v, t) == (cell, tick):
                return False
            if kind == "must be at" and t == tick and v != cell:
                return False
            if kind == "not step" and (u, v, t) == (cell, then, tick):
                return False
            if kind == "not from" and v == cell and t >= tick:
                return False
        return True

    earliest = max((tick + 1 for kind, _, _, tick in constraints if kind == "later"), default=0)
    latest = min((tick for kind, _, _, tick in constraints if kind == "by"), default=last)
    span = max((tick for *_, tick in constraints), default=0)
    layer = {start} if allowed(start, start, 0) else set()
    for t in range(min(last, latest) + 1):
        if goal in layer and t >= earliest and all(allowed(goal, goal, s) for s in range(t + 1, span + 2)):
            return t
        layer = {
            v for u in layer for v in (u, *neighbours(blocked, u, octile=octile)) if allowed(u, v, t + 1)
        }
    return None
