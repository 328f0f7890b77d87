"""Tables 4.10 and 4.11: three methods. Cells are compared with bounds, pairs against pairs.

What is printed as path cost is the length for AD-GSO, and for the two others the sum of cost-to-go over the
cells where an iteration ends: (48,49) to (1,49) prints 1131, and 1 + 2 + ... + 47 = 1128.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial

from lampyris.reproduce.tables import bounds, printed_data
from lampyris.reproduce.tables.field import GOAL, START
from lampyris.reproduce.tables.printed_data import Figure
from lampyris.reproduce.tables.sweep import LOST, iterations, length
from lampyris.reproduce.tables.verdict import GIVEN, IMPOSSIBLE, MISPRINT, NOT_REPRODUCIBLE, Verdict
from lampyris.typing import Cell

METHODS = ("mixed", "improved", "ad-gso")
REACH: Mapping[str, int] = {"mixed": 1, "improved": 2, "ad-gso": 3}
"""Cells an iteration of each method moves: one for mixed and two for improved by its sums of cost-to-go."""

MACHINE = "a time of another machine and program (C#)"


def seconds(printed: str) -> float | None:
    """A printed time in seconds: ``2.34.76`` is read as 154.76, ``8,13`` as 8.13; None if blank."""
    if printed == printed_data.BLANK:
        return None
    parts = printed.replace(",", ".").split(".")
    if len(parts) == 3:
        return 60 * int(parts[0]) + int(parts[1]) + int(parts[2]) / 100
    return float(".".join(parts))


def part_one() -> Iterator[Verdict]:
    """A verdict on each figure of Table 4.10."""
    for f in printed_data.figures("4.10"):
        say = partial(Verdict, f.table, f.where, f.printed)
        method = f.row["method"]
        if f.column in ("size", "start"):
            yield say("", GIVEN, "what was asked: the size and start of the guide example")
        elif f.column == "goal":
            why = "printed as (row, column): the text has (7,0), where the luciferin of Table 4.2 is 0"
            yield say("(7,0)", MISPRINT, why)
        elif f.column == "time":
            yield say("", NOT_REPRODUCIBLE, MACHINE)
        elif f.column == "iterations":
            note = ", as method and cells of Table 4.11 have it" if method != "ad-gso" else ""
            found_verdict = iterations(f, START, GOAL, REACH[method], note)
            yield (
                found_verdict
                if method == "ad-gso"
                else replace(found_verdict, why=f"{found_verdict.why}; {_swapped()}")
            )
        elif method == "ad-gso":
            lost = "this map, with two gates, is lost; on that of Table 4.2 AD-GSO and the optimum are 12.4"
            yield length(f, START, GOAL, int(f.row["iterations"]), lost)
        else:
            yield _sum(f, START, GOAL, method)


def _swapped() -> str:
    """What tells for, and what against, the iterations of the two hybrids in Table 4.10 being swapped."""
    rows = {r["method"]: r for r in printed_data.rows("4.10")}
    mixed, improved = rows["mixed"], rows["improved"]
    here, there = int(mixed["iterations"]), int(improved["iterations"])
    low, high = (v / 10 for v in bounds.sum_range(START, GOAL, there, REACH["mixed"]))
    most = bounds.sum_range(START, GOAL, here, REACH["improved"])[1] / 10
    need = bounds.fewest(START, GOAL, REACH["improved"])
    return (
        f"the {here} of mixed and the {there} of improved are probably swapped: {there} iterations of "
        f"mixed can add up to its {mixed['path_cost']} ({low:g} to {high:g}); but improved needs {need} and "
        f"not {here}, which leave {most:g} of its {improved['path_cost']} at most, so the swap alone does "
        "not repair the table"
    )


def part_two(ours: Mapping[tuple[str, str, str, str, str], str] | None = None) -> Iterator[Verdict]:
    """A verdict on each figure of Table 4.11.

    Parameters
    ----------
    ours : by environment, start, goal, method and column: what we get for that pair on our map of that
        number; None: runs were not made.
    """
    known = ours or {}
    by_pair: dict[tuple[str, str, str], dict[str, str]] = {}
    for r in printed_data.rows("4.11"):
        by_pair.setdefault((r["environment"], r["start"], r["goal"]), {})[r["method"]] = r["gates"]
    for f in printed_data.figures("4.11"):
        r = f.row
        verdict = _cell(f, by_pair[r["environment"], r["start"], r["goal"]])
        mine = known.get((r["environment"], r["start"], r["goal"], r["method"], f.column), "")
        if mine:
            text = f"{mine} on our env-{r['environment']}"
            verdict = Verdict(
                f.table, f.where, f.printed, f"{verdict.ours}; {text}".removeprefix("; "), verdict.verdict,
                verdict.why,
            )  # fmt: skip
        yield verdict


def _cell(f: Figure, gates: Mapping[str, str]) -> Verdict:
    say = partial(Verdict, f.table, f.where, f.printed)
    start, goal, method = printed_data.cell(f.row["start"]), printed_data.cell(f.row["goal"]), f.row["method"]
    if f.column in ("start", "goal"):
        return say("", GIVEN, "what was asked; the same five pairs for all three methods of an environment")
    if f.column == "gates":
        if len(set(gates.values())) > 1:
            gate_words = ", ".join(gates[m] for m in METHODS)
            return say(
                "", NOT_REPRODUCIBLE, f"{LOST}; one pair, and the three methods have {gate_words} gates"
            )
        return say("", NOT_REPRODUCIBLE, f"{LOST}; the same for all three methods")
    if f.column == "iterations":
        note = (
            "; one too few, as for each pair that is so near the bound: its last move is not counted"
            if method != "ad-gso"
            else ""
        )
        return iterations(f, start, goal, REACH[method], note)
    if f.column == "time":
        return _time(f)
    if method == "ad-gso":
        return length(f, start, goal, int(f.row["iterations"]), LOST)
    return _sum(f, start, goal, method)


def _sum(f: Figure, start: Cell, goal: Cell, method: str) -> Verdict:
    """A printed sum of cost-to-go."""
    say = partial(Verdict, f.table, f.where, f.printed)
    n = int(f.row["iterations"])
    least, most = bounds.sum_range(start, goal, n, REACH[method])
    ours = f"{least / 10:g} to {most / 10:g}" if least <= most else f"no sum has {n} iterations"
    cost = bounds.tenths(f.printed)
    if cost is None or cost % 2:
        why = "a sum of cost-to-go; each is a sum of 1 and 1.4, so all are even tenths and so is their sum"
        return say(ours, IMPOSSIBLE, why)
    if not least <= cost <= most:
        why = (
            f"a sum of cost-to-go; {n} iterations of {REACH[method]} at 1.4 a cell leave "
            f"{most / 10:g} at most (with one uncounted)"
        )
        if f.printed == "8484":
            why += "; 2484 would fit its 66 iterations"
        if f.table == "4.10":
            why += "; 98.2 needs 11 or more: the 12 of improved, if the two are swapped, would do"
        return say(ours, IMPOSSIBLE, why)
    why = f"{LOST}; a sum of cost-to-go, not a length, and within what {n} iterations can add up to"
    return say(ours, NOT_REPRODUCIBLE, why)


def _time(f: Figure) -> Verdict:
    say = partial(Verdict, f.table, f.where, f.printed)
    if f.printed == printed_data.BLANK:
        return say("", NOT_REPRODUCIBLE, "nothing is printed where a time belongs")
    if "," in f.printed:
        why = "a comma for the point: with 8.13 the mean of the column is 10.616, as printed in the text"
        return say("8.13", MISPRINT, why)
    if f.printed.count(".") == 2:
        return say("", NOT_REPRODUCIBLE, f"{MACHINE}; read as {seconds(f.printed):.2f} s")
    return say("", NOT_REPRODUCIBLE, MACHINE)
