"""Text for people and for programs that read it, notes, and JSON.

At a terminal: tables that fit its width, in colour. Into a pipe or a file: a line for each fact
(``name: value``) and for each row of a table (cells apart by tabs), neither wrapped nor padded, so that
``| grep gap`` and ``| cut -f2`` find what is there.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:
    from rich.console import Console

SHOWN = 8
"""Items of a list that a fact shows; a comb map has a hundred thousand gates."""
TabCell: TypeAlias = str | tuple[str, str]
"""A cell of a table; two texts: the second stands below the first, and is less important."""


def is_plain() -> bool:
    """Whether the text goes somewhere else than to a terminal."""
    return not sys.stdout.isatty()


def console() -> Console:
    """The terminal."""
    from rich.console import Console

    return Console(highlight=False, soft_wrap=False)


def width() -> int | None:
    """Columns of the terminal; None: as many as a line needs."""
    return None if is_plain() else console().width


def line(text: str, style: str = "") -> None:
    """One sentence."""
    if is_plain():
        print(_one_line(text))
        return
    from rich.text import Text

    console().print(Text(text, style=style))


def facts(title: str, rows: Iterable[tuple[str, str]]) -> None:
    """Names and values; a value of several lines is as many facts of that name."""
    if is_plain():
        if title:
            print(_one_line(title))
        for key, value in rows:
            for part in value.splitlines() or ("",):
                print(f"{key}: {_one_line(part)}")
        return
    from rich.table import Table
    from rich.text import Text

    name = Text(title) if title else None
    table = Table(title=name, title_justify="left", show_header=False, box=None, pad_edge=False)
    table.add_column(style="dim", no_wrap=True)
    table.add_column(overflow="fold")
    for key, value in rows:
        table.add_row(key, Text(value))
    console().print(table)


def table(
    title: str,
    columns: Sequence[str],
    rows: Iterable[Sequence[TabCell]],
    *,
    right: Iterable[str] = (),
    whole: Iterable[str] = (),
    bold: int | None = None,
    red: str = "",
    boxed: bool = False,
) -> None:
    """A table.

    Parameters
    ----------
    title : above it; empty: none.
    columns : their names.
    rows : a text for each column.
    right : columns of numbers, whose last digits stand below one another.
    whole : columns that are not wrapped.
    bold : number of the row that counts.
    red : the column that is red where it says more than ``-``.
    boxed : with lines around it.
    """
    if is_plain():
        if title:
            print(_one_line(title))
        print("\t".join(columns))
        for row in rows:
            print("\t".join(_one_line(cell if isinstance(cell, str) else "; ".join(cell)) for cell in row))
        return
    from rich.box import HEAVY_HEAD, SIMPLE_HEAD
    from rich.table import Table
    from rich.text import Text

    right, whole = set(right), set(whole)
    made = Table(
        title=Text(title) if title else None,
        title_justify="left",
        box=HEAVY_HEAD if boxed else SIMPLE_HEAD,
        pad_edge=boxed,
    )
    for name in columns:
        made.add_column(
            name, justify="right" if name in right else "left", no_wrap=name in whole, overflow="fold"
        )
    for k, row in enumerate(rows):
        cells = [_text(cell, Text) for cell in row]
        if red and str(cells[columns.index(red)]) != "-":
            cells[columns.index(red)].stylize("red")
        made.add_row(*cells, style="bold" if k == bold else None)
    console().print(made)


def _text(cell: TabCell, kind: Any) -> Any:
    """A cell as rich takes it: nothing in it is markup."""
    return kind(cell) if isinstance(cell, str) else kind(f"{cell[0]}\n").append(cell[1], style="dim")


def _one_line(text: str) -> str:
    """Without what would begin another line or another cell."""
    return " ".join(text.split("\t")).replace("\r", " ").replace("\n", " ")


def first_few(items: Sequence[object], most: int = SHOWN) -> str:
    """The first few of a list, and how many more there are."""
    first = ", ".join(str(item) for item in items[:most])
    more = len(items) - most
    return f"{first} and {more:,} more (--json has all)" if more > 0 else first


def word_counts(words: Sequence[str]) -> str:
    """``goal x3, turn x1``: how often each word occurs, the most frequent first."""
    counts: dict[str, int] = {}
    for word in words:
        counts[word] = counts.get(word, 0) + 1
    return ", ".join(f"{word} x{n}" for word, n in sorted(counts.items(), key=lambda e: (-e[1], e[0])))


def plural(n: int, word: str) -> str:
    """``1 run``, ``2 runs``, ``3 queries``."""
    many = f"{word[:-1]}ies" if word.endswith("y") else f"{word}s"
    return f"{n:,} {word if n == 1 else many}"


def print_json(record: Any) -> None:
    """Write one line of JSON to standard output."""
    import json  # 1 ms, for this alone

    sys.stdout.write(json.dumps(record, allow_nan=False, separators=(",", ":")) + "\n")
    sys.stdout.flush()


def print_notes(notes: tuple[str, ...]) -> None:
    """Write sentences for a person to standard error."""
    for note in notes:
        print(f"note: {note}", file=sys.stderr)
