"""Tab: a small table for people, before anyone decides whether it is drawn as HTML, LaTeX or text."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

from lampyris.errors import InternalFault

Value: TypeAlias = str | float | int | None
"""What a table holds; None where nothing is defined, shown as a dash."""

DASH = "-"
"""What is shown where nothing is defined; not an empty place, which reads like an oversight."""


@dataclass(frozen=True, slots=True)
class Tab:
    """A table with its title and note, of plain values.

    Parameters
    ----------
    name : word of small letters, digits and dashes: the anchor in a page, the label in LaTeX.
    title : one line, without a full stop at its end.
    header : the columns' names.
    rows : one tuple a row, as long as the header.
    note : what must be known to read it: sizes, unit of the statistics, seed. Stands beneath the table, and
        in LaTeX in the caption.
    align : one letter a column, ``l`` or ``r``; empty: a column of words is ``l``, any other ``r``.
    digits : digits after the point, a column each; None in it: as short as tells the number. Empty: all None.
    """

    name: str
    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[Value, ...], ...]
    note: str = ""
    align: str = ""
    digits: tuple[int | None, ...] = ()

    def __post_init__(self) -> None:
        n = len(self.header)
        if any(len(row) != n for row in self.rows):
            raise InternalFault("TAB", f"a row of another length than {n} columns", where=self.name)
        if self.align and (len(self.align) != n or set(self.align) - {"l", "r"}):
            raise InternalFault("TAB", f"align {self.align!r} for {n} columns", where=self.name)
        if self.digits and len(self.digits) != n:
            raise InternalFault("TAB", f"{len(self.digits)} digits for {n} columns", where=self.name)
        if not self.align:
            object.__setattr__(self, "align", "".join(self._side(k) for k in range(n)))
        if not self.digits:
            object.__setattr__(self, "digits", (None,) * n)

    def _side(self, k: int) -> str:
        """``l`` for a column that holds a word."""
        return "l" if not self.rows or any(isinstance(row[k], str) for row in self.rows) else "r"

    def texts(self) -> tuple[tuple[str, ...], ...]:
        """Every value as it is shown, row by row; the same in HTML, LaTeX and a terminal."""
        return tuple(
            tuple(shown(value, digits) for value, digits in zip(row, self.digits, strict=True))
            for row in self.rows
        )


def shown(value: Value, digits: int | None = None) -> str:
    """A value as a table shows it.

    Words as they are, yes and no, whole numbers with all digits, others with ``digits`` after the point
    (None: at most six that count), a dash for None and for what is not a number. A number that rounds to
    nothing has no minus sign.
    """
    if value is None:
        return DASH
    if isinstance(value, str):
        return value
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return str(value)
    if math.isnan(value):
        return DASH
    if math.isinf(value):
        return "inf" if value > 0 else "-inf"
    text = f"{value:.6g}" if digits is None else f"{value:.{digits}f}"
    return text.lstrip("-") if not float(text) else text
