"""Table 4.18, and the figures that abstract, text and conclusion claim: each worked out from the tables."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache, partial
from types import MappingProxyType

from lampyris.planning.field.gates import find_gates
from lampyris.reproduce.tables import bounds, printed_data
from lampyris.reproduce.tables.comparison import MACHINE, METHODS, seconds
from lampyris.reproduce.tables.field import GOAL, START, guide_field
from lampyris.reproduce.tables.printed_data import Figure
from lampyris.reproduce.tables.velocity import means
from lampyris.reproduce.tables.verdict import (
    EXACT,
    GIVEN,
    IMPOSSIBLE,
    MISPRINT,
    NOT_REPRODUCIBLE,
    ROUNDED,
    Verdict,
    same,
    short,
)
from lampyris.reproduce.tables.walk import avoiding, guide_plan

PATHS: Mapping[str, str] = MappingProxyType({"1": "4.14", "2": "4.15", "3": "4.16", "4": "4.17"})
"""Which table each of the four paths of Table 4.18 stands in."""


def summary() -> Iterator[Verdict]:
    """A verdict on each figure of Table 4.18."""
    for f in printed_data.figures("4.18"):
        say = partial(Verdict, f.table, f.where, f.printed)
        path, row = f.row["path"], f.row
        if path == "the other approach":
            if f.column == "percentage":
                yield say(short(100 * float(row["adaptive_velocity"]) / float(row["lowest_velocity"])), EXACT,
                          "the ratio of its row: three times is 200 per cent more")  # fmt: skip
            else:
                yield say("", GIVEN, "quoted from another paper, in metres a second")
        elif path == "mean":
            shares = [float(r["percentage"]) for r in printed_data.rows("4.18") if r["path"] in PATHS]
            mean = math.fsum(shares) / len(shares)
            right = math.fsum(_mean_of(p) for p in PATHS) / 4 / 20 * 100
            why = (
                f"the mean of the four above ({short(right, 1)} with their misprints corrected); a ratio: an "
                f"increase of {mean - 100:.1f} per cent, not of 300"
            )
            yield say(short(mean), ROUNDED, why)
        elif f.column == "lowest_velocity":
            yield say("20", GIVEN, "Table 3.1: the author's own constant")
        elif f.column == "adaptive_velocity":
            yield _path_mean(f, path)
        else:
            yield _share(f, path)


def _path_mean(f: Figure, path: str) -> Verdict:
    mean = _mean_of(path)
    say = partial(Verdict, f.table, f.where, f.printed)
    if same(f.printed, mean):
        return say(short(mean), EXACT, f"the mean of Table {PATHS[path]}")
    table = PATHS[path]
    printed = next(r["average_velocity"] for r in printed_data.rows(table) if r["average_velocity"])
    loose = means(table)[0]
    why = f"the mean of Table {table}, which prints {printed}"
    if abs(loose - mean) > 1e-9:
        why += f"; {short(loose)} with its misprinted cells as they stand"
    return say(short(mean), MISPRINT, why)


def _mean_of(path: str) -> float:
    """A path's mean velocity, misprinted cells corrected."""
    return means(PATHS[path])[1]


def _share(f: Figure, path: str) -> Verdict:
    """A percentage: its own row's arithmetic, and what it should be."""
    row = float(f.row["adaptive_velocity"]) / float(f.row["lowest_velocity"]) * 100
    ours = _mean_of(path) / 20 * 100
    arithmetic = "as its row has it" if same(f.printed, row) else f"its own row gives {short(row)}"
    why = f"{short(_mean_of(path), 2)} over 20; {arithmetic}, whose velocity is not its table's mean"
    return Verdict(f.table, f.where, f.printed, short(ours, 2), MISPRINT, why)


@dataclass(frozen=True, slots=True)
class Said:
    """What is to be said of one claim."""

    ours: str
    verdict: str
    why: str


def text() -> Iterator[Verdict]:
    """A verdict on each claim of ``claims.csv``, but for storage and best nt, which take runs."""
    known = claims()
    for f in printed_data.figures("text"):
        said = known.get(f.row["id"])
        if said is None:
            said = _measured(f.row["id"])
        yield Verdict("text", f.where, f.printed, said.ours, said.verdict, said.why)


def _measured(name: str) -> Said:
    """Claims that runs of ours answer: the page puts their results in."""
    if name == "storage":
        return Said("", NOT_REPRODUCIBLE, "no storage was measured; measured here, below")
    if name == "best-nt":
        return Said("", NOT_REPRODUCIBLE, "ten paths on lost maps, and no test; asked again here, below")
    raise KeyError(name)


@cache
def claims() -> Mapping[str, Said]:
    """What is to be said of each claim, by its name."""
    printed = {r["id"]: r["printed"] for r in printed_data.rows("text")}
    out: dict[str, Said] = {}
    for part in (_comparison, _guide, _ranges, _moving, _velocities):
        for name, make in part().items():
            out[name] = make(printed[name])
    return MappingProxyType(out)


Make = Callable[[str], Said]


def number(ours: float, why: str, wrong: str = "") -> Make:
    """A claim that should be ``ours``."""

    def make(printed: str) -> Said:
        if same(printed, ours):
            return Said(short(ours), EXACT, why)
        return Said(short(ours), MISPRINT, wrong or why)

    return make


def words(ours: str, why: str, wrong: str = "") -> Make:
    """A claim that should be ``ours`` to the letter."""

    def make(printed: str) -> Said:
        return Said(ours, EXACT if printed == ours else MISPRINT, why if printed == ours else wrong or why)

    return make


def always(ours: str, verdict: str, why: str) -> Make:
    """A claim with one answer, whatever is printed."""
    return lambda printed: Said(ours, verdict, why)


def column(method: str, name: str) -> list[float]:
    """A column of Table 4.11 for one method; blank times left out."""
    texts = [r[name] for r in printed_data.rows("4.11") if r["method"] == method]
    if name != "time":
        return [float(t) for t in texts]
    return [s for t in texts if (s := seconds(t)) is not None]


def average(method: str, name: str) -> float:
    """Its mean."""
    values = column(method, name)
    return math.fsum(values) / len(values)


def less(old: float, new: float) -> float:
    """By how many per cent ``new`` is less than ``old``."""
    return 100 * (old - new) / old


def _comparison() -> dict[str, Make]:
    out: dict[str, Make] = {}
    for m in METHODS:
        steps, n = average(m, "iterations"), len(column(m, "time"))
        out[f"iterations-{m}"] = number(steps, "the mean of its 30 figures in Table 4.11")
        what = "length" if m == "ad-gso" else "sum of cost-to-go"
        why = (
            f"the mean of its 30 path costs (a {what}); {steps:.2f}, the mean of its iterations, was printed"
        )
        out[f"cost-{m}"] = number(average(m, "path_cost"), why)
        why = "the mean of its 30 times in Table 4.11"
        if n < 30:
            why = f"the mean of its {n} times that Table 4.11 prints"
            missing = 23.10 * 30 - math.fsum(column(m, "time"))
            why += f"; for 23.10 the two that are not would add up to {missing:.1f} s"
        out[f"time-{m}"] = number(average(m, "time"), why)
    names = {"iterations": "iterations", "cost": "path_cost", "time": "time"}
    for name, col in names.items():
        for m in METHODS[:2]:
            out[f"less-{name}-{m}"] = _less(name, col, m)
    out["environments-text"] = number(6, "Table 4.11 has six")
    out["environments-figure"] = number(6, "Table 4.11 has six")
    return out


def _less(name: str, col: str, method: str) -> Make:
    """A reduction in per cent: (a - b) / a; the dissertation's figures are (a - b) / (a + b)."""
    old, new = average(method, col), average("ad-gso", col)
    right = less(old, new)
    was = {r["id"]: float(r["printed"]) for r in printed_data.rows("text") if r["id"].startswith(f"{name}-")}
    a, b = was[f"{name}-{method}"], was[f"{name}-ad-gso"]
    why = (
        f"(a - b) / a of the means recomputed, {old:.2f} and {new:.2f}; "
        f"(a - b) / (a + b) of the printed means is {100 * (a - b) / (a + b):.2f}"
    )
    if name == "cost":
        why += "; but one is a sum of cost-to-go and the other a length, so neither means anything"
        return always(f"none ({right:.2f} of unlike things)", IMPOSSIBLE, why)
    why += f", and (a - b) / a of them, {a:g} and {b:g}, is {less(a, b):.2f}"
    return number(right, why)


def _guide() -> dict[str, Make]:
    plan = guide_plan()
    iterations, cost = plan.iterations, plan.cost
    gates = len(find_gates(printed_data.guide_grid()))
    swapped = "printed as (row, column)"
    not_134 = (
        "6 diagonals and 4 straights, which is also what the luciferin of (0,9) encodes; "
        f"{bounds.why_not(START, GOAL, 134)} 13.4"
    ).replace("costs it 13.4", "costs 13.4")
    detour = (
        "the robot stands on (7,2) and goes by (6,1) or (8,1): 2.8 in place of 2 and 12.4 + 0.8; "
        "(8,1) is blocked, so by (6,1)"
    )
    luc = guide_field().luciferin
    clear = (
        "the text, Table 4.6 and the back pointer of (9,2) want it free, its luciferin in Table 4.2 and the "
        "text's example of an obstacle blocked; nothing else changes with it"
    )
    lost = "this map is lost: that of Table 4.2 has one gate, not two"
    return {
        "guide-goal": words(printed_data.spelled(GOAL), "where the luciferin of Table 4.2 is 0"),
        "guide-start": words(printed_data.spelled(START), "as in Tables 4.3 and 4.10"),
        "guide-obstacle": words("(8,1)", f"{swapped}: (8,1) is blocked in Table 4.2, (1,8) is free"),
        "guide-clear": always("blocked or free", NOT_REPRODUCIBLE, clear),
        "guide-next": words(printed_data.spelled(plan.jumps[0].chosen), "", f"{swapped}: Table 4.3 has (3,7)"),
        "guide-gates": number(gates, "the cell (7,5), a dead end"),
        "guide-iterations": number(iterations, "four jumps"),
        "guide-cost": number(cost, not_134),
        "guide-time": always("", NOT_REPRODUCIBLE, MACHINE),
        "guide-avoid-cost": number(avoiding(), detour),
        "part1-gates": always(str(gates), NOT_REPRODUCIBLE, lost),
        "part1-iterations": always(str(iterations), NOT_REPRODUCIBLE, f"{lost}; there ours are {iterations}"),
        "part1-cost": always(short(cost), NOT_REPRODUCIBLE, f"{lost}; there the cost is {short(cost)}, as "
                             f"luciferin {luc[START[1], START[0]]:.3f} at the start encodes"),
        "part1-time": always("", NOT_REPRODUCIBLE, MACHINE),
        "part1-time-again": words("0.5098", "Table 4.10 and two lines before: a digit lost"),
    }  # fmt: skip


def _column(table: str, name: str) -> list[int]:
    """A column of a table of velocities as printed."""
    return [int(r[name]) for r in printed_data.rows(table) if r[name] != ""]


def _around(table: str) -> list[int]:
    """Obstacles of both levels, node by node."""
    return [a + b for a, b in zip(_column(table, "ring1"), _column(table, "ring2"), strict=True)]


def _ranges() -> dict[str, Make]:
    """Least and greatest of columns."""
    spans = {
        "guide-robot": _column("4.12", "robot_velocity"),
        "guide-count": _around("4.12"),
        "guide-obstacle": _column("4.12", "obstacle_velocity"),
        "guide-angle": _column("4.12", "angle_velocity"),
        "guide-adaptive": _column("4.12", "adaptive_velocity"),
        "path1-count": _around("4.14"),
        "path2-obstacle": _column("4.15", "obstacle_velocity"),
        "path2-adaptive": [v for v in _column("4.15", "adaptive_velocity") if v > 0],
        "path3-obstacle": _column("4.16", "obstacle_velocity"),
        "path3-angle": _column("4.16", "angle_velocity"),
    }
    out: dict[str, Make] = {}
    for name, values in spans.items():
        out[f"{name}-low"] = number(min(values), "the least of its column")
        out[f"{name}-high"] = number(max(values), "the greatest of its column")
    out["path1-obstacle-high"] = number(
        max(_column("4.14", "obstacle_velocity")), "the greatest of its column"
    )
    low = [v for v in spans["path3-angle"] if v > 0]
    out["path3-angle-low"] = number(min(low), "the least of its column, but for a misprinted 0")
    return out


def _at(table: str, node: str, name: str) -> int:
    return next(int(r[name]) for r in printed_data.rows(table) if r["node"] == node)


def _moving() -> dict[str, Make]:
    """What an obstacle changes: Table 4.12 before, Table 4.13 after."""
    out: dict[str, Make] = {}
    for table, when in (("4.12", "before"), ("4.13", "after")):
        why = f"Table {table}"
        out[f"dynamic-ring2-{when}"] = number(_at(table, "(0,6)", "ring2"), why)
        out[f"dynamic-ring1-{when}"] = number(_at(table, "(2,4)", "ring1"), why)
        out[f"dynamic-06-{when}"] = number(_at(table, "(0,6)", "adaptive_velocity"), why)
        velocity = _at(table, "(2,4)", "obstacle_velocity")
        more = f"{why}, the least of its limits"
        more += "; its adaptive velocity still prints 59" if when == "after" else ""
        out[f"dynamic-24-{when}"] = number(velocity, more)
    for name, table in (("guide-mean", "4.12"), ("dynamic-mean", "4.13")):
        as_printed, fixed = means(table)
        why = f"the mean of Table {table} over the nodes that move; its misprints corrected, {short(fixed)}"
        out[name] = number(as_printed, why)
    return out


def _velocities() -> dict[str, Make]:
    out: dict[str, Make] = {}
    for path in ("1", "2", "4"):
        for end, k in (("start", 0), ("goal", -1)):
            node = printed_data.rows(PATHS[path])[k]["node"]
            why = f"the {'first' if k == 0 else 'last'} node of Table {PATHS[path]}"
            out[f"path{path}-{end}"] = words(node, why)
            if path == "4":
                out[f"path4-{end}-again"] = words(node, why, f"{why}; printed (row, column)")
    for path, table in PATHS.items():
        why = f"the mean of Table {table}"
        out[f"summary-path{path}"] = number(_mean_of(path), why)
        if path != "4":
            out[f"path{path}-mean"] = number(_mean_of(path), why)
    out["conclusion-dense"] = number(_mean_of("1"), "path 1: the mean of Table 4.14")
    out["conclusion-semi"] = number(_mean_of("3"), "path 3: the mean of Table 4.16; 60.22 is in no table")
    out["conclusion-free"] = number(_mean_of("4"), "path 4: the mean of Table 4.17")
    more = _mean_of("1") - 20
    out["summary-path1-more"] = number(more, f"{more + 20:.2f} - 20; 45.3 - 20 is 25.3, but 45.3 is wrong")
    out["summary-lowest"] = always("20", GIVEN, "Table 3.1: the author's own constant")
    said = [float(r["adaptive_velocity"]) for r in printed_data.rows("4.18") if r["path"] in PATHS]
    mean, right = math.fsum(said) / 4, math.fsum(_mean_of(p) for p in PATHS) / 4
    why = f"the mean of the four in Table 4.18 is {short(mean, 3)}; of the tables' means {short(right)}"
    out["summary-mean"] = always(short(right), ROUNDED, why)
    out["summary-times"] = always(short(right / 20), ROUNDED, f"{short(right)} / 20")
    rise = 100 * (right - 20) / 20
    why = (
        f"{short(right)} against 20 is {short(right / 20, 2)} times, an increase of {rise:.1f} per cent; and "
        "20 is the author's constant: it compares nothing"
    )
    out["increase"] = always(f"{rise:.1f}", MISPRINT, why)
    return out
