"""AD-GSO's record as tables, after Tables 4.3 to 4.6: what was accepted, what chosen, and the path to it."""

from __future__ import annotations

from dataclasses import dataclass

from lampyris.model.plan import Jump, Plan
from lampyris.typing import Cell

COLUMNS = ("ring", "accepted", "luciferin", "probability", "chosen")


@dataclass(frozen=True, slots=True)
class JumpTable:
    """One iteration of the walk.

    Parameters
    ----------
    title : its number, counted from 1, and where the robot stood.
    rows : one tuple of texts for each accepted cell, ring by ring, in the order of :data:`COLUMNS`.
    chosen : index of the chosen row; None if it is not among them.
    note : the sub-path, and how it was found.
    """

    title: str
    rows: tuple[tuple[str, ...], ...]
    chosen: int | None
    note: str


def jump_tables(plan: Plan) -> tuple[JumpTable, ...]:
    """A table for each jump; none if the plan kept no record."""
    return tuple(_table(number, jump) for number, jump in enumerate(plan.jumps, start=1))


def _table(number: int, jump: Jump) -> JumpTable:
    # Stable: within a ring the planner's own order stays.
    candidates = sorted(jump.candidates, key=lambda c: c.ring)
    chosen = next((k for k, c in enumerate(candidates) if c.cell == jump.chosen), None)
    rows = tuple(
        (
            str(c.ring),
            _cell(c.cell),
            f"{c.luciferin:.3f}",
            f"{c.probability:.4f}",
            "<- next" if k == chosen else "",
        )
        for k, c in enumerate(candidates)
    )
    how = "along the parents" if jump.by_parents else "the cheapest path inside the accepted cells"
    title = (
        f"Iteration {number}: at {_cell(jump.at)}, luciferin {jump.luciferin:.3f}; "
        f"{len(rows)} accepted in {jump.rings} ring{'' if jump.rings == 1 else 's'}"
    )
    note = f"Sub-path to {_cell(jump.chosen)}, {how}: " + " ".join(map(_cell, jump.subpath))
    return JumpTable(title, rows, chosen, note)


def _cell(cell: Cell) -> str:
    return f"({cell[0]},{cell[1]})"


def text(table: JumpTable) -> str:
    """A table as plain text, columns aligned, for a terminal or a log."""
    lines = [COLUMNS, *table.rows]
    widths = [max(len(row[k]) for row in lines) for k in range(len(COLUMNS))]
    out = [table.title]
    for row in lines:
        cells = [
            row[k].rjust(widths[k]) if k in (0, 2, 3) else row[k].ljust(widths[k]) for k in range(len(row))
        ]
        out.append("  " + "  ".join(cells).rstrip())
    return "\n".join([*out, table.note])
