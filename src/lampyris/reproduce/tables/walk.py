"""Tables 4.3 to 4.6: the four iterations of the guide example."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import partial

import numpy as np

from lampyris.model.change import Change
from lampyris.model.plan import Jump, Plan
from lampyris.planning.adgso.ad_gso import AdGso
from lampyris.reproduce.tables import printed_data
from lampyris.reproduce.tables.field import START, guide_field, guide_scene
from lampyris.reproduce.tables.printed_data import Figure
from lampyris.reproduce.tables.verdict import (
    EXACT,
    IMPOSSIBLE,
    MISPRINT,
    NOT_REPRODUCIBLE,
    ROUNDED,
    Verdict,
    same,
    short,
)
from lampyris.typing import Cell

TABLES = ("4.3", "4.4", "4.5", "4.6")
SLACK = 0.001
"""Probabilities are printed with three or four digits, from luciferin cut off at the third."""


def guide_plan(start: Cell = START) -> Plan:
    """AD-GSO on the guide map, with the record of its iterations."""
    scene = guide_scene(start)
    return AdGso().open(scene, np.random.default_rng(0), record=True).plan()


def avoiding() -> float:
    """Cost of the guide example's path if an obstacle comes to stand on (7,1) once the robot is on (7,2)."""
    session = AdGso().open(guide_scene(), np.random.default_rng(0))
    first = session.plan()
    here = (7, 2)
    rest = session.plan(Change(robot=here, obstacles=frozenset({(7, 1)})))
    if first.path is None or rest.path is None or list(here) not in first.path.cells.tolist():
        return math.inf
    driven = first.path.exact - int(guide_field().exact[here[1], here[0]])
    return first.path.moves.value(driven + rest.path.exact)


def jumps() -> Mapping[str, Jump]:
    """Our iteration for each table; for Table 4.6 worked out from (7,2), where ours never stands."""
    walk = guide_plan().jumps
    return dict(zip(TABLES[:3], walk[:3], strict=True)) | {"4.6": guide_plan((7, 2)).jumps[0]}


def walk(table: str) -> Iterator[Verdict]:
    """A verdict on each figure of one of the four tables."""
    plan, jump = guide_plan(), jumps()
    for f in printed_data.figures(table):
        part = f.row["part"]
        if part == "header":
            yield _header(f, plan, jump)
        elif part == "path":
            yield _path(f, plan)
        elif part == "accepted":
            yield _accepted(f, jump[table])
        else:
            yield _neighbour(f)


def _header(f: Figure, plan: Plan, jump: Mapping[str, Jump]) -> Verdict:
    k = TABLES.index(f.table)
    say = partial(Verdict, f.table, f.where, f.printed)
    name = f.row["name"]
    if name == "iteration":
        return say(str(k), EXACT, "counted from 0, one jump an iteration")
    if name in ("current", "next"):
        at = plan.jumps[k].at if name == "current" else plan.jumps[k].chosen
        if printed_data.spelled(at) == f.printed:
            return say(f.printed, EXACT, "ours stands there" if name == "current" else "ours chooses it")
        why = (
            "Table 4.5 has 7 accepted cells, fewer than nt = 10, so Algorithm 3.5 opens ring 3, "
            f"where (7,1) has the lowest luciferin, {_luciferin((7, 1))}, of all"
        )
        return say(printed_data.spelled(at), MISPRINT, why)
    return _best(f, say, k if name == "best probability" else k - 1, jump)


def _best(f: Figure, say: partial[Verdict], k: int, jump: Mapping[str, Jump]) -> Verdict:
    """The best probability of iteration k, at its own table or carried to the next."""
    if k < 0:
        return say("0", EXACT, "nothing was chosen before the start")
    best = max(c.probability for c in jump[TABLES[k]].candidates)
    if same(f.printed, best):
        return say(short(best, 6), EXACT, "the greatest of our probabilities")
    if TABLES[k] == "4.6":
        return say(short(best), MISPRINT, "copied from Table 4.5; the greatest of its own column is 0.173")
    return say(short(best), MISPRINT, _DEFECT["4.5"])


_DEFECT = {
    "4.5": (
        "its seven shares add up to 0.30: each is its difference over 46.864 = 14.209 + 7 x 4.665, so seven "
        "cells were taken into the sum with luciferin 0 and never into the choice; ours has 14 accepted cells"
    ),
    "4.6": (
        "its eight shares add up to 0.65: each is its difference over 9.00 = 5.88 + 2 x 1.56, so two cells "
        "were taken into the sum with luciferin 0; ours is worked out from (7,2) on the map of Table 4.2"
    ),
}


def _path(f: Figure, plan: Plan) -> Verdict:
    cells = [] if plan.cells is None else [printed_data.spelled((x, y)) for x, y in plan.cells.tolist()]
    at = cells[int(f.row["index"]) + 1]
    if at == f.printed:
        return Verdict(f.table, f.where, f.printed, at, EXACT, "the path so far, cell by cell")
    return Verdict(f.table, f.where, f.printed, at, NOT_REPRODUCIBLE, "our path goes elsewhere")


def _accepted(f: Figure, jump: Jump) -> Verdict:
    cells = {
        r["index"]: printed_data.cell(r["printed"]) for r in _accepted_rows(f.table) if r["name"] == "cell"
    }
    at = cells[f.row["index"]]
    ours = {c.cell: c.probability for c in jump.candidates}
    say = partial(Verdict, f.table, f.where, f.printed)
    if at not in ours:
        if at == (8, 1):
            return say("not accepted", IMPOSSIBLE, "blocked in Table 4.2, and nothing blocked is accepted")
        why = f"luciferin {_luciferin(at)} equals that of the robot's cell; Algorithm 3.5 wants it lower"
        return say("not accepted", MISPRINT, why)
    if f.row["name"] == "cell":
        return say(printed_data.spelled(at), EXACT, "accepted by ours as well")
    p = ours[at]
    if same(f.printed, p):
        return say(short(p, 6), EXACT, "its share of the differences in luciferin")
    if abs(float(f.printed) - p) < SLACK:
        return say(short(p), ROUNDED, "its share of the differences, of luciferin cut off at three digits")
    if f.table in _DEFECT:
        return say(short(p), MISPRINT, _DEFECT[f.table])
    total = math.fsum(printed_data.accepted(f.table).values())
    why = (
        f"the other {len(ours) - 1} of this table come out, and share one sum of differences; as printed the "
        f"column adds up to {short(total)}, with {short(p)} to {short(total - float(f.printed) + p)} "
        "(digits cut off)"
    )
    return say(short(p), MISPRINT, why)


def _accepted_rows(table: str) -> list[Mapping[str, str]]:
    """The accepted cells of a table."""
    return [r for r in printed_data.rows(table) if r["part"] == "accepted"]


def _luciferin(at: Cell) -> str:
    return short(float(guide_field().luciferin[at[1], at[0]]))


def _neighbour(f: Figure) -> Verdict:
    """A cell of the three rings around (0,9), or the luciferin that is printed beside it."""
    index = int(f.row["index"])
    ring = 1 if index < 8 else 2 if index < 24 else 3
    x, y = next(
        printed_data.cell(r["printed"])
        for r in printed_data.rows(f.table)
        if (r["part"], r["index"], r["name"]) == ("neighbour", f.row["index"], "cell")
    )
    say = partial(Verdict, f.table, f.where, f.printed)
    away = max(abs(x - START[0]), abs(y - START[1]))
    if f.row["name"] == "cell":
        if away == ring:
            return say(printed_data.spelled((x, y)), EXACT, f"in ring {ring}; the three rings have 48 cells")
        return say("", MISPRINT, f"in ring {away}, listed in ring {ring}")
    if not (0 <= x < 10 and 0 <= y < 10):
        if f.printed == "10000.0":
            return say("outside", EXACT, "outside the map, marked as such")
        return say("outside", IMPOSSIBLE, "a luciferin of a cell that is outside the 10x10 map")
    blocked = not guide_field().free[y, x]
    if blocked:
        return say("blocked", EXACT if f.printed == "10000.0" else MISPRINT, "blocked in Table 4.2")
    ours = float(guide_field().luciferin[y, x])
    if f.printed == printed_data.BLANK:
        return say(short(ours), NOT_REPRODUCIBLE, "nothing is printed; Table 4.2 has the value")
    if same(f.printed, ours):
        return say(short(ours), EXACT, "as in Table 4.2")
    why = "its column belongs to another map, which is lost"
    if f.printed == "10000.0":
        why += ", or marks what was accepted"
    why += "; Table 4.2 prints ours, and the probabilities beside it come of ours"
    return say(short(ours), NOT_REPRODUCIBLE, why)
