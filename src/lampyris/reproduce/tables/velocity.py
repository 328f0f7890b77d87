"""Tables 4.12 to 4.17: the speed law, node by node.

The maps are lost, so the cells of the paths and most counts of obstacles are taken as printed; every other
column follows from them, or does not.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import cache, partial
from types import MappingProxyType

import numpy as np

from lampyris.motion.laws.dissertation import DissertationLaw, dissertation_speeds
from lampyris.motion.laws.rings import ring_counts
from lampyris.reproduce.tables import printed_data
from lampyris.reproduce.tables.printed_data import Figure
from lampyris.reproduce.tables.verdict import (
    EXACT,
    GIVEN,
    IMPOSSIBLE,
    MISPRINT,
    NOT_REPRODUCIBLE,
    Verdict,
    same,
    short,
)
from lampyris.typing import Cell

CORRECTED: Mapping[tuple[str, int, str], tuple[str, str]] = MappingProxyType(
    {
        ("4.17", 1, "node"): (
            "(35,13)",
            (
                "by (35,13) the first velocity is 28, the angle at (35,14) 180 and the mean 74.08, all as "
                "printed; by (34,13) they are 20, 135 and 73.74"
            ),
        ),
        ("4.16", 15, "ring2"): (
            "1",
            "the row's velocities, 71, are 80 - 6 - 3, and the printed mean 65.36 contains 71, not 68",
        ),
    }
)
"""Cells of the tables without which figures beside them, and the means, come out: (corrected, why)."""

SHARP = ("4.16", 19)
"""Where the printed cells turn by 90 degrees and the printed velocities go on as if by 45."""

_LAW = DissertationLaw()
_BY_ANGLE = {"180": _LAW.v_180, "135": _LAW.v_135, "90": _LAW.v_90}


@cache
def corrected(table: str) -> tuple[Mapping[str, str], ...]:
    """The rows of a table with :data:`CORRECTED` put in."""
    out = []
    for k, row in enumerate(printed_data.rows(table)):
        new = {c: v[0] for (t, i, c), v in CORRECTED.items() if (t, i) == (table, k)}
        out.append(MappingProxyType(dict(row) | new))
    return tuple(out)


@cache
def cells(table: str) -> tuple[Cell, ...]:
    """The nodes of a table's path, corrected."""
    return tuple(printed_data.cell(r["node"]) for r in corrected(table))


@cache
def rule(table: str) -> tuple[float, ...]:
    """Our velocity at each node, on the corrected cells and counts."""
    rows = corrected(table)
    speeds = dissertation_speeds(cells(table), [r["ring1"] for r in rows], [r["ring2"] for r in rows])
    return tuple(float(v) for v in speeds)


@cache
def angles(table: str) -> tuple[str, ...]:
    """Interior angle at each node in degrees, by the corrected cells; empty at both ends."""
    path = cells(table)
    out = [""]
    for a, b, c in zip(path, path[1:], path[2:], strict=False):
        turn = math.atan2(c[1] - b[1], c[0] - b[0]) - math.atan2(b[1] - a[1], b[0] - a[0])
        out.append(str(180 - abs(round(math.degrees(math.remainder(turn, 2 * math.pi))))))
    return (*out, "")


def velocity(table: str) -> Iterator[Verdict]:
    """A verdict on each figure of one of the six tables."""
    check = {
        "iteration": _iteration,
        "node": _node,
        "robot_velocity": _robot,
        "ring1": _count,
        "ring2": _count,
        "obstacle_velocity": _obstacle,
        "angle": _angle,
        "angle_velocity": _angle_velocity,
        "adaptive_velocity": _adaptive,
        "average_velocity": _average,
    }
    for f in printed_data.figures(table):
        yield check[f.column](f, partial(Verdict, f.table, f.where, f.printed))


def _node(f: Figure, say: partial[Verdict]) -> Verdict:
    fix = CORRECTED.get((f.table, f.index, f.column))
    if fix is not None:
        return say(fix[0], MISPRINT, fix[1])
    return say("", GIVEN, "a cell of a path on a lost map; it joins its neighbours by single steps")


def _iteration(f: Figure, say: partial[Verdict]) -> Verdict:
    why = "its map is lost; it is not that of Table 4.2, where this path costs 14.2 and the optimum 12.4"
    if f.index == len(printed_data.rows(f.table)) - 1:
        reach = "(6,0) is 4 rows from (2,4), where iteration 2 ends, and a jump reaches 3"
        return say("at least 4", IMPOSSIBLE, reach)
    return say("", NOT_REPRODUCIBLE, why)


def _count(f: Figure, say: partial[Verdict]) -> Verdict:
    """Obstacles around a node: the map is lost; for the guide example that of Table 4.2 does not fit."""
    fix = CORRECTED.get((f.table, f.index, f.column))
    if fix is not None:
        return say(fix[0], MISPRINT, fix[1])
    most = 8 if f.column == "ring1" else 5
    if int(f.printed) > most:
        return say(f"at most {most}", IMPOSSIBLE, f"there are {most} such cells")
    if f.table in ("4.12", "4.13"):
        both = ring_counts(list(cells(f.table)), printed_data.guide_grid().blocked)
        mine = int(both[0 if f.column == "ring1" else 1][f.index])
        why = "its map is lost; the counts of all nodes together do not fit the map of Table 4.2"
        return say(f"{mine} on Table 4.2's map", NOT_REPRODUCIBLE, why)
    return say("", NOT_REPRODUCIBLE, f"its map is lost; possible, as there are {most} such cells")


def _obstacle(f: Figure, say: partial[Verdict]) -> Verdict:
    r = corrected(f.table)[f.index]
    n1, n2 = int(r["ring1"]), int(r["ring2"])
    ours = max(_LAW.v_min, _LAW.v_max - _LAW.ring1_drop * n1 - _LAW.ring2_drop * n2)
    kind = EXACT if same(f.printed, ours) else MISPRINT
    why = f"80 - 6 x {n1} - 3 x {n2}"
    if int(f.printed) % 3 != 2:
        why += f"; no counts give {f.printed}, which is not 80 less a multiple of 3"
    if (f.table, f.index, "ring2") in CORRECTED:
        why += ", with the count at level 2 corrected"
    return say(short(ours), kind, why)


def _angle(f: Figure, say: partial[Verdict]) -> Verdict:
    ours = angles(f.table)[f.index]
    a, b, c = (printed_data.spelled(v) for v in cells(f.table)[f.index - 1 : f.index + 2])
    if ours == f.printed:
        return say(ours, EXACT, f"between {a}, {b} and {c}")
    if (f.table, f.index) == SHARP:
        why = f"the angle between {a}, {b} and {c} is {ours}; which of cells and angle is wrong cannot be determined"
        return say(ours, IMPOSSIBLE, why)
    why = f"the angle between {a}, {b} and {c}"
    if f.table == "4.16":
        why += "; the printed mean contains the velocity of that angle"
    return say(ours, MISPRINT, why)


def _angle_velocity(f: Figure, say: partial[Verdict]) -> Verdict:
    angle = angles(f.table)[f.index]
    ours = _BY_ANGLE[angle]
    if same(f.printed, ours):
        return say(short(ours), EXACT, f"the limit at {angle} degrees, Table 3.1")
    if (f.table, f.index) == SHARP:
        return say(
            short(ours), IMPOSSIBLE, f"the limit at {angle} degrees, the angle of its cells, Table 3.1"
        )
    printed = f.row["angle"]
    why = f"the limit at {angle} degrees, Table 3.1"
    if printed != angle:
        why += f"; {f.printed} is that at {printed}, which is misprinted"
    return say(short(ours), MISPRINT, why)


def _step(table: str, k: int) -> tuple[float, str]:
    """What a node's step adds, and in words."""
    (x, y), (u, v) = cells(table)[k - 1 : k + 1]
    straight = x == u or y == v
    gain = _LAW.a_straight if straight else _LAW.a_diagonal
    return gain, f"{gain:g} for a {'straight' if straight else 'diagonal'} step"


def _robot(f: Figure, say: partial[Verdict]) -> Verdict:
    """The cumulative velocity: three readings of the column, tried in order.

    Table 4.12 adds up accelerations and ignores all other limits; the others print the velocity that the robot
    comes with, one row late against Table 4.12. Equation 3.1 itself gives the third.
    """
    k = f.index
    rows = printed_data.rows(f.table)
    if k == 0:
        return say("0", EXACT, "the robot stands at the start")
    before = float(rows[k - 1]["adaptive_velocity"])
    gain, words = _step(f.table, k)
    alone = min(_LAW.v_max, float(rows[k - 1]["robot_velocity"]) + gain)
    readings = {
        "alone": (alone, f"the one before and {words}, 80 at most, other limits ignored"),
        "comes": (before, "the adaptive velocity of the node before: one row late against Table 4.12"),
        "equation": (
            min(_LAW.v_max, before + gain),
            f"the one before, {before:g}, and {words}: Equation 3.1",
        ),
    }
    order = ("alone", "equation") if f.table == "4.12" else ("comes", "equation")
    for name in order:
        value, why = readings[name]
        if same(f.printed, value):
            return say(short(value), EXACT, why)
    if k == len(rows) - 1 and f.printed == "0":
        return say("0", EXACT, "the robot stands at the end")
    value, why = readings[order[0]]
    return say(short(value), MISPRINT, why)


def _adaptive(f: Figure, say: partial[Verdict]) -> Verdict:
    ours = rule(f.table)[f.index]
    if same(f.printed, ours):
        return say(short(ours), EXACT, "the least of the four limits, and braking from the end")
    t, k = SHARP
    if f.table == t and k <= f.index <= k + 2:
        why = f"at most {ours:g}: the cells of row {k} turn by 90 degrees, limit 20, and then +20 a step"
        return say(short(ours), IMPOSSIBLE, why)
    r = f.row
    why = f"its limits are {r['obstacle_velocity']} by obstacles and {r['angle_velocity']} by angle"
    if f.table in ("4.12", "4.13") and f.index == 10:
        why += (
            "; the next row goes on from 50, which one more obstacle at level 2 would give: "
            "if 50 is right, its count and its obstacle velocity are not"
        )
    elif f.table == "4.13":
        why += ", and the text says 53 as well"
    elif f.table == "4.16":
        why += " as printed; 60 by the angle of its cells, and so in the printed mean"
    elif f.table == "4.17":
        why += "; +20 from the row before, or the limit; so in the printed mean"
    return say(short(ours), MISPRINT, why)


@cache
def means(table: str) -> tuple[float, float]:
    """Mean adaptive velocity over nodes that move: as printed, and with the misprinted cells corrected."""
    printed = [float(r["adaptive_velocity"]) for r in printed_data.rows(table)]
    fixed = []
    for k, (was, ours) in enumerate(zip(printed, rule(table), strict=True)):
        keep = table == SHARP[0] and SHARP[1] <= k <= SHARP[1] + 2
        fixed.append(was if keep else ours)
    return _mean(printed), _mean(fixed)


def _mean(values: list[float]) -> float:
    moving = [v for v in values if v > 0]
    return float(np.sum(moving)) / len(moving)


def _average(f: Figure, say: partial[Verdict]) -> Verdict:
    as_printed, fixed = means(f.table)
    what = "the mean of the column over the nodes that move"
    if same(f.printed, as_printed):
        return say(short(as_printed), EXACT, what)
    if same(f.printed, fixed):
        kept = (
            "; rows 19 to 21, which break the limit at 90 degrees, as printed" if f.table == SHARP[0] else ""
        )
        why = f"{what}, its misprints corrected{kept} (with all as printed: {short(as_printed)})"
        return say(short(fixed), EXACT, why)
    extra = "" if abs(fixed - as_printed) < 1e-9 else f"; with its misprints corrected {short(fixed)}"
    return say(short(as_printed), MISPRINT, f"{what}{extra}")
