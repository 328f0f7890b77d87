"""The figures that the dissertation prints, as data: the page and the tests read the same files.

Facts only: numbers, with where they stand (``sources.json``). Cells are written ``(x,y)``. An empty
place is one where the table prints nothing; the word ``blank`` one where a figure belongs and is missing.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from types import MappingProxyType
from typing import Any

import numpy as np

from lampyris.errors import InternalFault
from lampyris.model.grid import Grid
from lampyris.typing import Cell

BLANK = "blank"
"""Stands where a figure belongs and none is printed."""

VELOCITY_TABLES = ("4.12", "4.13", "4.14", "4.15", "4.16", "4.17")


@dataclass(frozen=True, slots=True)
class Figure:
    """One printed figure.

    Parameters
    ----------
    table : its number.
    row : the whole row that it stands in, by column.
    index : number of the row in the file, from 0.
    column : its column.
    where : its row and column, for people; unique in its table.
    printed : as printed.
    """

    table: str
    row: Mapping[str, str]
    index: int
    column: str
    where: str
    printed: str


def tables() -> tuple[str, ...]:
    """Every printed table that is carried, in the order of the dissertation; ``text`` last."""
    return tuple(source()["tables"])


@cache
def source() -> Mapping[str, Any]:
    """Where the figures come from: ``sources.json``."""
    return MappingProxyType(json.loads(_text("sources.json")))


def about(table: str) -> Mapping[str, Any]:
    """What ``sources.json`` says of a table."""
    known = source()["tables"]
    if table not in known:
        raise InternalFault("TABLE", f"no table {table!r}", where="reproduce", allowed=", ".join(known))
    return known[table]  # type: ignore[no-any-return]


def rows(table: str) -> tuple[Mapping[str, str], ...]:
    """The rows of a printed table by column, as text."""
    return read(about(table)["file"])


@cache
def read(name: str) -> tuple[Mapping[str, str], ...]:
    """The rows of a file of this folder."""
    return tuple(MappingProxyType(row) for row in csv.DictReader(_text(name).splitlines()))


def figures(table: str) -> Iterator[Figure]:
    """Every printed figure of a table, row by row: each needs a verdict."""
    info = about(table)
    for index, row in enumerate(rows(table)):
        label = ", ".join(_label(info, key, row[key]) for key in info["keys"] if row[key] != "")
        for column in info["figures"]:
            if row[column] != "":
                name = info["names"].get(column, column.replace("_", " "))
                where = f"{label}: {name}" if name else label
                yield Figure(table, row, index, column, where, row[column])


def _label(info: Mapping[str, Any], key: str, value: str) -> str:
    word = info["labels"].get(key, "")
    return f"{word} {value}".strip()


def cell(text: str) -> Cell:
    """``(x,y)`` as a cell."""
    x, _, y = text.strip("()").partition(",")
    return int(x), int(y)


def spelled(at: Cell) -> str:
    """A cell as the files write it."""
    return f"({at[0]},{at[1]})"


def guide_grid(free: tuple[Cell, ...] = ()) -> Grid:
    """The 10x10 map of the guide example, read off Table 4.2: what prints 10000 is blocked, save ``free``."""
    blocked = np.zeros((10, 10), dtype=np.bool_)
    for row in rows("4.2"):
        x, y = cell(row["cell"])
        blocked[y, x] = row["luciferin"] == "10000" and (x, y) not in free
    return Grid(blocked, name="guide")


def field_rule() -> Mapping[Cell, Mapping[str, str]]:
    """Cost, luciferin and back pointer of Table 4.2's free cells, as worked out apart from this program."""
    return MappingProxyType({cell(row["cell"]): row for row in read("table_4_2_rule.csv")})


def accepted(table: str) -> dict[Cell, float]:
    """Accepted cells and their printed probabilities, of Tables 4.3 to 4.6."""
    at: dict[str, Cell] = {}
    chance: dict[str, float] = {}
    for row in rows(table):
        if row["part"] == "accepted":
            if row["name"] == "cell":
                at[row["index"]] = cell(row["printed"])
            else:
                chance[row["index"]] = float(row["printed"])
    return {at[k]: chance[k] for k in at}


def velocity_rows(table: str) -> list[dict[str, str]]:
    """A table of velocities, each row with what the rule says of it, as worked out apart from this program.

    ``interior_angle`` is that of the printed cells, ``rule_velocity`` and ``rule_cause`` what the law gives
    on the printed cells and counts.
    """
    rule = {row["row"]: row for row in read("velocity_rule.csv") if row["table"] == table}
    out = []
    for row in rows(table):
        x, y = cell(row["node"])
        more = rule[row["row"]]
        out.append(
            dict(row)
            | {"x": str(x), "y": str(y), "interior_angle": more["interior_angle"]}
            | {"rule_velocity": more["velocity"], "rule_cause": more["cause"]}
        )
    return out


def _text(name: str) -> str:
    return files("lampyris.reproduce").joinpath("data", name).read_text(encoding="utf-8")
