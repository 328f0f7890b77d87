"""Stores of studies written and changed without the product: its tables by name, its seals by their rule.

A store is an SQLite file whose records are sealed, and whose runs are chained: what turns a bit is found by
the seal. So most mutants are changed record by record and sealed anew; a reader must find what is wrong in
what is said, not in the bytes.
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
"""The records of each table, each a number, a seal, and texts."""

TABLES = ("meta", "maps", "runs", "tally")
_TREES = {"meta": (3,), "maps": (3,), "runs": (5, 6), "tally": ()}
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


def seal(table: str, texts: list[str]) -> str:
    """The seal of a record: SHA-256 over the lengths and texts, the table's name before them."""
    said = "".join(f"{len(text)}:{text}" for text in (table, *texts))
    return hashlib.sha256(said.encode("utf-8", "surrogatepass")).hexdigest()


def records_of(data: bytes) -> Records:
    """The records of a good store."""
    with closing(_opened(data)) as connection:
        return {
            name: [list(one) for one in connection.execute(f"SELECT * FROM {name} ORDER BY n")]
            for name in TABLES
        }


def with_records(data: bytes, records: Records) -> bytes:
    """A store like this one with other records, sealed as they come."""
    with closing(_opened(data)) as connection:
        for name in TABLES:
            connection.execute(f"DELETE FROM {name}")
            for one in records[name]:
                marks = ", ".join("?" * len(one))
                connection.execute(f"INSERT OR REPLACE INTO {name} VALUES ({marks})", one)
        connection.commit()
        made = connection.serialize()
    # A store is kept with a log; in memory there is none, and the head says so.
    return made[:18] + b"\x02\x02" + made[20:]


def _opened(data: bytes) -> sqlite3.Connection:
    connection = sqlite3.connect(":memory:")
    connection.deserialize(data[:18] + b"\x01\x01" + data[20:])
    connection.execute("PRAGMA journal_mode=OFF")
    return connection


def sealed(records: Records) -> Records:
    """Every seal, the chain of the runs and their number made right, as far as they are texts."""
    done: Records = {}
    head = "0" * 64
    for name in ("meta", "maps", "runs"):
        done[name] = []
        for one in records[name]:
            texts = one[2:]
            if all(isinstance(text, str) for text in texts):
                one = [one[0], seal(name, texts), *texts]
            done[name].append(one)
            if name == "runs":
                head = hashlib.sha256(f"{head}{one[1]}".encode()).hexdigest()
    said = [str(len(records["runs"])), head]
    done["tally"] = [[1, seal("tally", said), *said]]
    return done


@dataclass(frozen=True)
class StoreCorpus:
    """Good stores, as bytes; see :class:`lampyris_selfcheck.reference.files.mutator.Corpus`."""

    seeds: tuple[bytes, ...]

    @cached_property
    def _records(self) -> tuple[Records, ...]:
        return tuple(records_of(data) for data in self.seeds)

    def mutant(self, rng: Rng) -> bytes:
        """One mutant: of its bytes, or of its records, mostly sealed anew."""
        k = int(rng.integers(0, len(self.seeds)))
        if rng.random() < 0.3:
            data = self.seeds[k]
            for _ in range(int(rng.integers(1, 3))):
                data = pick(rng, BYTE_CHANGES)(rng, data, Corpus(self.seeds, text=False))
            return data
        records = self._records[k]
        for _ in range(int(pick(rng, (1, 1, 1, 2)))):
            records = self._changed(rng, records)
        roll = rng.random()
        if roll < 0.85:
            records = sealed(records)
        if roll < 0.1:
            records = {**records, "tally": _text_changed(rng, "tally", records["tally"])}
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
    column = int(rng.integers(2, len(rows[k])))
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
