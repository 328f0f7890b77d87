"""Table 4.2: the field of the guide map, cell by cell."""

from __future__ import annotations

from collections.abc import Iterator

from lampyris.model.field import Field
from lampyris.model.moves import moves_named
from lampyris.model.scene import Scene
from lampyris.planning.field.solve import solve_field
from lampyris.reproduce.tables import printed_data
from lampyris.reproduce.tables.printed_data import Figure
from lampyris.reproduce.tables.verdict import (
    EXACT,
    GIVEN,
    IMPOSSIBLE,
    MISPRINT,
    NOT_REPRODUCIBLE,
    ROUNDED,
    Verdict,
    same,
    short,
)
from lampyris.typing import Cell

START, GOAL = (0, 9), (7, 0)


def guide_scene(start: Cell = START) -> Scene:
    """The guide example, or from another cell."""
    return Scene(printed_data.guide_grid(), start, GOAL, moves_named("dissertation"))


def guide_field() -> Field:
    """The field of the guide example."""
    return solve_field(guide_scene())


def field() -> Iterator[Verdict]:
    """A verdict on each luciferin and each back pointer."""
    ours = guide_field()
    printed = {printed_data.cell(r["cell"]): r["luciferin"] for r in printed_data.rows("4.2")}
    for f in printed_data.figures("4.2"):
        at = printed_data.cell(f.row["cell"])
        blocked = f.row["luciferin"] == "10000"
        if f.column == "luciferin":
            yield _mark(f) if blocked else _luciferin(f, at, ours, printed)
        else:
            yield (_pointer_of_wall if blocked else _pointer)(f, at, ours)


def _mark(f: Figure) -> Verdict:
    why = "marks a blocked cell; the map is read off this column"
    if printed_data.cell(f.row["cell"]) == (8, 1):
        why += ", though the text calls (8,1) clear and Table 4.6 prices it as if it were"
    return Verdict("4.2", f.where, f.printed, "blocked", GIVEN, why)


def _luciferin(f: Figure, at: Cell, field: Field, printed: dict[Cell, str]) -> Verdict:
    x, y = at
    ours = float(field.luciferin[y, x])
    text = short(ours, 6)
    if same(f.printed, ours):
        why = "0.6 times the parent's luciferin and 0.6 times the cost" if at != GOAL else "the goal's own"
        return Verdict("4.2", f.where, f.printed, text, EXACT, why)
    parent = _parent(field, at)
    if parent is None:
        return Verdict("4.2", f.where, f.printed, text, NOT_REPRODUCIBLE, "ours differs and has no parent")
    cost = field.exact[y, x] / 10
    again = 0.6 * float(printed[parent]) + 0.6 * cost
    if same(f.printed, again):
        why = "0.6 times the parent's luciferin as printed, which is cut off, and 0.6 times the cost"
        return Verdict("4.2", f.where, f.printed, text, ROUNDED, why)
    why = (
        f"0.6 x {printed[parent]} (its parent {printed_data.spelled(parent)} as printed) + 0.6 x {cost:g} "
        f"(its cost) = {short(again, 4)}"
    )
    return Verdict("4.2", f.where, f.printed, text, MISPRINT, why)


def _parent(field: Field, at: Cell) -> Cell | None:
    index = int(field.parent[at[1], at[0]])
    return None if index < 0 else (index % 10, index // 10)


def _pointer(f: Figure, at: Cell, field: Field) -> Verdict:
    parent = _parent(field, at)
    printed_parent = printed_data.cell(f.printed)
    ours = "" if parent is None else printed_data.spelled(parent)
    if parent == printed_parent:
        return Verdict("4.2", f.where, f.printed, ours, EXACT, "the cheapest neighbour by the order of ties")
    if parent == printed_parent[::-1]:
        why = f"printed as (row, column), as nine in rows 0 and 1 are; {f.printed} does not touch the cell"
        return Verdict("4.2", f.where, f.printed, ours, MISPRINT, why)
    return Verdict("4.2", f.where, f.printed, ours, NOT_REPRODUCIBLE, "another neighbour is cheapest")


def _pointer_of_wall(f: Figure, at: Cell, field: Field) -> Verdict:
    """A blocked cell points to the cell that was expanded first beside it: the least cost; ties are open."""
    x, y = at
    costs = {
        (i, j): int(field.exact[j, i])
        for j in range(max(y - 1, 0), min(y + 2, 10))
        for i in range(max(x - 1, 0), min(x + 2, 10))
        if field.exact[j, i] >= 0
    }
    first = [c for c in costs if costs[c] == min(costs.values())]
    ours = " or ".join(printed_data.spelled(c) for c in first)
    printed_parent = printed_data.cell(f.printed)
    if printed_parent in first:
        why = "its neighbour of least cost, which is expanded first" + (" (a tie)" if first[1:] else "")
        return Verdict("4.2", f.where, f.printed, ours, EXACT, why)
    if printed_parent[::-1] in first:
        why = "printed as (row, column), as nine in rows 0 and 1 are"
        return Verdict("4.2", f.where, f.printed, ours, MISPRINT, why)
    i, j = printed_parent
    if not field.free[j, i]:
        why = f"{f.printed} is itself blocked in this table, and a blocked cell is never expanded"
        if printed_parent == (8, 1):
            why += "; it holds if (8,1) is free, as the text and Table 4.6 have it"
        return Verdict("4.2", f.where, f.printed, ours, IMPOSSIBLE, why)
    return Verdict("4.2", f.where, f.printed, ours, NOT_REPRODUCIBLE, "another neighbour costs less")
