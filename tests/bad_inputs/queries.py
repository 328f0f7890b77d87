"""Rows 61 to 67: queries of MovingAI ``.scen`` files."""

from __future__ import annotations

from bad_inputs.case import Case

MAP = b"type octile\nheight 4\nwidth 5\nmap\n.....\n.@...\n.....\n.....\n"
RIGHT = "0\tm.map\t5\t4\t0\t0\t4\t0\t4.00000000\n"
LINE = "one or more lines"


def _scen(
    row: int,
    name: str,
    text: str,
    code: str = "",
    *says: str,
    words: tuple[str, ...] = (),
    prints: tuple[str, ...] = (),
    exit: int | None = None,
) -> Case:
    where = ("m.scen",) if code else ()
    return Case(
        row,
        name,
        ("movingai", "m.scen", *words),
        {"m.scen": text.encode(), "m.map": MAP},
        code,
        exit if exit is not None else 3 if code else 0,
        (*where, *says),
        prints=prints,
        silent=not code,
    )


def _query(old: str, new: str) -> str:
    assert RIGHT.count(old) == 1
    return "version 1\n" + RIGHT.replace(old, new)


WRONG = _query("4.00000000", "9.5") + RIGHT * 2

CASES: list[Case] = [
    _scen(61, "no version", RIGHT, prints=("0 of 1 disagree",)),
    _scen(61, "version 1.0", "version 1.0\n" + RIGHT, prints=("0 of 1 disagree",)),
    _scen(61, "version 7", "version 7\n" + RIGHT, "SCEN_VERSION", "line 1", "'version 7'", "1 or 1.0"),
    _scen(
        62, "8 columns", "version 1\n\n" + _query("\t4.00000000", "")[10:], "SCEN_LINE", "line 3", "8 fields"
    ),
    _scen(62, "nan", _query("4.00000000", "nan"), "SCEN_LINE", "line 2", "'nan'", "number >= 0"),
    _scen(
        63, "x = 99", _query("\t4\t0\t4.0", "\t99\t0\t4.0"), "SCEN_RANGE", "line 2", "goal x 99", "width is 5"
    ),
    _scen(63, "y = -1", _query("\t0\t0\t", "\t0\t-1\t"), "SCEN_LINE", "line 2", "'-1'"),
    _scen(
        64, "start", _query("\t0\t0\t", "\t1\t1\t"), "START_OCCUPIED", "line 2", "(1,1) is '@'", "passable"
    ),
    _scen(64, "goal", _query("\t4\t0\t4.0", "\t1\t1\t4.0"), "GOAL_OCCUPIED", "line 2", "(1,1) is '@'"),
    _scen(65, "size", _query("\t5\t4\t", "\t512\t512\t"), "SCEN_SIZE", "line 2", "512 x 512", "5 x 4"),
    _scen(
        66, "two maps", RIGHT + RIGHT.replace("m.map", "b.map"), "SCEN_MAP", "line 2", "'b.map'", "one map"
    ),
    _scen(66, "another map", _query("m.map", "b.map"), "SCEN_MAP", "line 2", "'b.map'", "'m.map'"),
    Case(
        66,
        "no such map",
        ("movingai", "alone.scen"),
        {"alone.scen": RIGHT.encode()},
        "FILE_MISSING",
        3,
        ("alone.scen: line 1", "'m.map'", "--map FILE"),
    ),
    _scen(66, "outside", _query("m.map", "../m.map"), "PATH_OUTSIDE", "line 2", "'../m.map'", "--map FILE"),
    _scen(66, "no query", "version 1\n", "SCEN_EMPTY", "no query", LINE),
    _scen(67, "length", WRONG, prints=("1 of 3 disagree", "9.5")),
    _scen(67, "length, strict", WRONG, prints=("1 of 3 disagree", "9.5"), words=("--strict",), exit=3),
    _scen(67, "strict, right", RIGHT, prints=("0 of 1 disagree",), words=("--strict",)),
]
