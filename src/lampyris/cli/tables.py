"""Tables of text that several verbs print: what fits the terminal, and the table itself."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lampyris.cli import text

if TYPE_CHECKING:
    from lampyris.report.html.table import Tab


def fits(tab: Tab) -> bool:
    """Whether a table's lines are short enough for where they go."""
    rows = (tab.header, *tab.texts())
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    room = text.width()
    return room is None or sum(widths) + 3 * (len(widths) - 1) + 2 <= room


def print_tab(tab: Tab) -> None:
    """Print a table."""
    text.line(tab.title, style="bold")
    right = [name for name, side in zip(tab.header, tab.align, strict=True) if side != "l"]
    text.table("", tab.header, tab.texts(), right=right, whole=tab.header[:1])
    if tab.note:
        text.line(tab.note, style="dim")
