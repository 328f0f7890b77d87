"""Stores of studies written and changed without the product: its tables by name, its checksums by their rule.

A store is an SQLite file whose records have checksums: a turned bit is found by them. So most mutants are
changed record by record and given a right checksum; a reader must find what is wrong in the contents.
"""

from __future__ import annotations

import hashlib
import json
import sqlite3
from contextlib import closing
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeAlias

from lampyris_selfcheck.reference.files.mutator import BYTE_CHANGES, ODD, Corpus, Rng, pick
from lampyris_selfcheck.reference.files.trees import ODD_VALUES, changed_tree

Records: TypeAlias = dict[str, list[list[Any]]]
"""The records of each table, each a number, texts, and a checksum."""

_COLUMNS = {
    "meta": ("rowid", "name", "value", "checksum"),
    "maps": ("rowid", "hash", "value", "checksum"),
    "runs": ("n", "key", "ending", "error", "metrics", "timing", "checksum"),
}
_TREES = {"meta": (2,), "maps": (2,), "runs": (4, 5)}
"""Columns whose text is JSON."""
_WORDS = (
    *(
        "",
        "0",
        "1",
        "-1",
        "3",
        "1.5",
        "9" * 30,
        "9" * 5000,
        "nan",
        "NaN",
        "null",
        "[]",
        "{}",
        "{",
        "[[",
        '"a"',
    ),
    *(
        "study",
        "plan",
        "done",
        "refused",
        "timeout",
        "failed",
        "Done",
        "x" * 3000,
        "\0",
        "\x1b[31m",
        "\u2028",
    ),
    *('{"a": 1e999}', '{"a": NaN}', '{"a": [1]}', '{"a": {}}', '{"a": 1, "a": 2}', '{"a": "\\ud800"}'),
    *("[" * 100_000, "0" * 64, "f" * 64, '{"a": ' + "9" * 5000 + "}"),
)
_VALUES: tuple[Any, ...] = (None, 0, 1, -1, 2**62, 1.5, b"", b"x", b"\xff\xfe")
"""What a column may hold in SQLite besides text."""


def checksum(table: str, texts: list[str]) -> str:
    """The checksum of a record: SHA-256 over the lengths and texts, the table's name before them."""
    joined = "".join(f"{len(text)}:{text}" for text in (table, *texts))
    return hashlib.sha256(joined.encode("utf-8", "surrogatepass")).hexdigest()


def records_of(data: bytes) -> Records:
    """The records of a good store."""
    with closing(_opened(data)) as connection:
        return {
            name: [
                list(one) for one in connection.execute(f"SELECT {', '.join(columns)} FROM {name} ORDER BY 1")
            ]
            for name, columns in _COLUMNS.items()
        }


def with_records(data: bytes, records: Records) -> bytes:
    """A store like this one with other records, as they come."""
    with closing(_opened(data)) as connection:
        for name, columns in _COLUMNS.items():
            connection.execute(f"DELETE FROM {name}")
            marks = ", ".join("?" * len(columns))
            add = f"INSERT OR REPLACE INTO {name} ({', '.join(columns)}) VALUES ({marks})"
            connection.executemany(add, records[name])
        connection.commit()
        made = connection.serialize()
    # A store is kept with a log; in memory there is none, and the head says so.
    return made[:18] + b"\x02\x02" + made[20:]


def _opened(data: bytes) -> sqlite3.Connection:
    connection = sqlite3.connect(":memory:")
    connection.deserialize(data[:18] + b"\x01\x01" + data[20:])
    connection.execute("PRAGMA journal_mode=OFF")
    return connection


def checked(records: Records) -> Records:
    """Every checksum made right, where the other columns are texts."""
    return {
        name: [
            [*one[:-1], checksum(name, one[1:-1])]
            if all(isinstance(text, str) for text in one[1:-1])
            else one
            for one in rows
        ]
        for name, rows in records.items()
    }


@dataclass(frozen=True)
class StoreCorpus:
    """Good stores, as bytes; see :class:`lampyris_selfcheck.reference.files.mutator.Corpus`."""

    seeds: tuple[bytes, ...]

    @cached_property
    def _records(self) -> tuple[Records, ...]:
        return tuple(records_of(data) for data in self.seeds)

    def mutant(self, rng: Rng) -> bytes:
        """One mutant: of its bytes, or of its records, mostly with right checksums."""
        k = int(rng.integers(0, len(self.seeds)))
        if rng.random() < 0.3:
            data = self.seeds[k]
            for _ in range(int(rng.integers(1, 3))):
                data = pick(rng, BYTE_CHANGES)(rng, data, Corpus(self.seeds, text=False))
            return data
        records = self._records[k]
        for _ in range(int(pick(rng, (1, 1, 1, 2)))):
            records = self._changed(rng, records)
        if rng.random() < 0.85:
            records = checked(records)
        return with_records(self.seeds[k], records)

    def _changed(self, rng: Rng, records: Records) -> Records:
        name = pick(rng, ("meta", "meta", "maps", "runs", "runs"))
        rows = records[name]
        roll = rng.random()
        if roll < 0.6 and rows:
            return {**records, name: self._tree_changed(rng, name, rows)}
        if roll < 0.85 and rows:
            return {**records, name: _text_changed(rng, name, rows)}
        return {**records, name: _order_changed(rng, rows)}

    def _tree_changed(self, rng: Rng, name: str, rows: list[list[Any]]) -> list[list[Any]]:
        """One table of JSON in one record changed, and well formed still."""
        k = int(rng.integers(0, len(rows)))
        column = pick(rng, _TREES[name])
        try:
            tree = json.loads(rows[k][column])
        except (ValueError, TypeError, RecursionError):
            return _text_changed(rng, name, rows)
        others = tuple(_bytes(one[c]) for one in rows for c in _TREES[name])
        made = json.dumps(
            changed_tree(rng, tree, Corpus(others, (b"called", b"worlds", b"cost", b"blocked")))
        )
        return _put(rows, k, column, made)


def _bytes(text: Any) -> bytes:
    return text.encode("utf-8", "surrogatepass") if isinstance(text, str) else b"{}"


def _put(rows: list[list[Any]], k: int, column: int, value: Any) -> list[list[Any]]:
    if isinstance(value, str):
        value = value.encode("utf-8", "replace").decode()  # SQLite keeps nothing else
    return [*rows[:k], [*rows[k][:column], value, *rows[k][column + 1 :]], *rows[k + 1 :]]


def _text_changed(rng: Rng, name: str, rows: list[list[Any]]) -> list[list[Any]]:
    """One column of one record is another text, or no text at all; seldom its number is another."""
    if not rows:
        return rows
    k = int(rng.integers(0, len(rows)))
    column = int(rng.integers(1, len(rows[k]) - 1))
    roll = rng.random()
    if roll < 0.05:
        return _put(rows, k, 0, int(pick(rng, (0, -1, 2, 7, 2**40))))
    if roll < 0.15:
        return _put(rows, k, column, pick(rng, _VALUES))
    if roll < 0.6:
        return _put(rows, k, column, pick(rng, _WORDS))
    if roll < 0.75:
        value = pick(rng, ODD_VALUES)
        return _put(rows, k, column, json.dumps(value))
    was = _bytes(rows[k][column])
    change = pick(rng, BYTE_CHANGES if roll < 0.9 else (lambda r, d, c: d + pick(r, ODD),))
    return _put(rows, k, column, change(rng, was, Corpus((was,), text=False)).decode("utf-8", "replace"))


def _order_changed(rng: Rng, rows: list[list[Any]]) -> list[list[Any]]:
    """A record lost, given twice, or two that change places; their numbers go on from 1."""
    if not rows:
        return rows
    k = int(rng.integers(0, len(rows)))
    roll = rng.random()
    if roll < 0.4:
        rows = rows[:k] + rows[k + 1 :]
    elif roll < 0.7:
        rows = [*rows, rows[k]]
    else:
        rows = rows[:k] + rows[k : k + 2][::-1] + rows[k + 2 :]
    return [[n, *one[1:]] for n, one in enumerate(rows, start=1)]
