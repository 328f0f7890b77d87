"""The earliest arrival of one robot among others whose paths are given, layer by layer of ticks."""

from __future__ import annotations

from collections.abc import Sequence

from lampyris_selfcheck.reference.fleets.fleet_rules import Cell, Rows, neighbours


def earliest_arrival(
    blocked: Rows, start: Cell, goal: Cell, others: Sequence[Sequence[Cell]], *, last: int
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
            for v in (u, *neighbours(blocked, u))
            if v not in then
            and not (v == goal and t + 1 <= passed)
            and not any(a == v and b == u for a, b in zip(now, then, strict=True))
        }
    return None
