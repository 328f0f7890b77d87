"""Tables 4.8 and 4.9: what nt does. The maps are lost: cells are compared with bounds, means against cells."""

from __future__ import annotations

import math
from collections.abc import Iterator

from lampyris.reproduce.tables import bounds, printed_data
from lampyris.reproduce.tables.printed_data import Figure
from lampyris.reproduce.tables.verdict import (
    EXACT,
    GIVEN,
    IMPOSSIBLE,
    MISPRINT,
    NOT_REPRODUCIBLE,
    Verdict,
    same,
    short,
)
from lampyris.typing import Cell

REACH = 3
"""Cells that an AD-GSO jump reaches: MVR."""

LOST = "its map is lost: the figures that show the maps hold no data"


def pairs() -> dict[str, tuple[Cell, Cell]]:
    """Start and goal of each path of Table 4.8."""
    return {
        r["path"]: (printed_data.cell(r["start"]), printed_data.cell(r["goal"]))
        for r in printed_data.rows("4.8")
        if r["start"]
    }


def sweep() -> Iterator[Verdict]:
    """A verdict on each figure of Table 4.8."""
    ends = pairs()
    for f in printed_data.figures("4.8"):
        start, goal = ends[f.row["path"]]
        if f.column in ("start", "goal", "nt"):
            yield Verdict(f.table, f.where, f.printed, "", GIVEN, "what was asked; inside a 50x50 map")
        elif f.column == "iterations":
            yield iterations(f, start, goal, REACH)
        else:
            yield length(f, start, goal, int(f.row["iterations"]), LOST)


def iterations(f: Figure, start: Cell, goal: Cell, reach: int, note: str = "") -> Verdict:
    """A printed number of iterations against the fewest that can lead from start to goal."""
    least = bounds.fewest(start, goal, reach)
    far = max(bounds.apart(start, goal))
    if int(f.printed) < least:
        why = f"{far} columns or rows at {reach} an iteration need {least}{note}"
        return Verdict(f.table, f.where, f.printed, f"at least {least}", IMPOSSIBLE, why)
    why = f"{LOST}; possible, as {far} columns or rows at {reach} an iteration need {least}"
    return Verdict(f.table, f.where, f.printed, f"at least {least}", NOT_REPRODUCIBLE, why)


def length(f: Figure, start: Cell, goal: Cell, jumps: int, lost: str) -> Verdict:
    """A printed path length against what any map allows."""
    cost = bounds.tenths(f.printed)
    least = bounds.octile(start, goal) / 10
    ours = f"at least {least:g}"
    wrong = "not a whole number of tenths" if cost is None else bounds.why_not(start, goal, cost)
    if wrong or cost is None:
        return Verdict(f.table, f.where, f.printed, ours, IMPOSSIBLE, wrong)
    steps = min(a + b for a, b in bounds.mixes(start, goal, cost))
    why = f"{lost}; possible: at least {least:g} on an empty map"
    if steps > REACH * jumps:
        why += (
            f"; it takes {steps} steps or more, and {jumps} jumps straight out reach {REACH * jumps}, "
            "so at least one jump must wind"
        )
    return Verdict(f.table, f.where, f.printed, ours, NOT_REPRODUCIBLE, why)


def means() -> Iterator[Verdict]:
    """A verdict on each figure of Table 4.9: the means of Table 4.8."""
    for f in printed_data.figures("4.9"):
        if f.column == "nt":
            yield Verdict(f.table, f.where, f.printed, "", GIVEN, "what was asked")
            continue
        values = [float(r[f.column]) for r in printed_data.rows("4.8") if r["nt"] == f.row["nt"]]
        mean = math.fsum(values) / len(values)
        why = f"the mean of the {len(values)} figures of Table 4.8 for nt = {f.row['nt']}"
        kind = EXACT if same(f.printed, mean) else MISPRINT
        yield Verdict(f.table, f.where, f.printed, short(mean), kind, why)
