"""Row and record: a right checksum says that a record is as it was written, not that it is a row."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from lampyris.errors import InternalFault
from lampyris.study.design.row import ENDINGS, Row
from lampyris.study.design.study import canonical
from lampyris.study.store.file import checksum, damaged, is_sound

MOST = 2**63
"""Whole numbers are below it: what reads a store elsewhere has no longer ones."""


def packed(row: Row) -> tuple[str, str, str, str, str, str]:
    """A row as the columns of its record, the checksum last.

    Raises
    ------
    InternalFault : STORE_ROW: something in it that is not a finite number, a word, yes or no, or nothing; an
        ending that is none.
    """
    if row.ending not in ENDINGS:
        raise _not_plain(row, "ending", row.ending)
    for kind, values in (("metrics", row.metrics), ("timing", row.timing)):
        for name, value in values.items():
            if not isinstance(name, str) or not _plain(value):
                raise _not_plain(row, f"{kind}.{name}", value)
    try:
        metrics, timing = (canonical(v).decode("ascii") for v in (row.metrics, row.timing))
    except (TypeError, ValueError) as fault:
        raise _not_plain(row, "metrics or timing", fault) from None
    # An error may quote a file's name, and those need not be Unicode: SQLite holds nothing else.
    error = row.error.encode("utf-8", "backslashreplace").decode()
    texts = (row.key, row.ending, error, metrics, timing)
    return (*texts, checksum("runs", *texts))


def row_of(path: Path, n: int, record: tuple[Any, ...]) -> Row:
    """The row of record ``n``.

    Parameters
    ----------
    path : of the store.
    n : number of the record, for the message.
    record : its columns, the checksum last.

    Raises
    ------
    FileError : STORE_DAMAGED: it is not as it was written, or no row.
    """
    found = unpacked(record)
    if isinstance(found, str):
        raise damaged(path, f"run {n} ({str(record[0])[:12]}) {found}")
    return found


def unpacked(record: tuple[Any, ...]) -> Row | str:
    """The row of a record; in words what is wrong if it is none."""
    if not is_sound("runs", record):
        return "does not match its checksum"
    key, ending, error, metrics, timing, _ = record
    if ending not in ENDINGS:
        return f"ended {ending[:40]!r}"
    tables: list[dict[str, Any]] = []
    for kind, text in (("metrics", metrics), ("timing", timing)):
        try:
            values = json.loads(text)
        except (ValueError, RecursionError):
            return f"has {kind} that are no JSON"
        if type(values) is not dict:
            return f"has {kind} that are no table"
        for name, value in values.items():
            if not _plain(value):
                return f"has a {kind}.{name[:40]} that is neither a finite number nor a word"
        tables.append(values)
    return Row(key, ending, tables[0], tables[1], error)


def _plain(value: object) -> bool:
    """Whether a row may have that value."""
    if isinstance(value, float):
        return math.isfinite(value)
    if isinstance(value, int):
        return -MOST < value < MOST
    return value is None or isinstance(value, str)


def _not_plain(row: Row, where: str, value: object) -> InternalFault:
    return InternalFault(
        "STORE_ROW", str(value), where=f"run {row.key[:12]}: {where}",
        allowed="finite numbers, words, true, false, None",
    )  # fmt: skip
