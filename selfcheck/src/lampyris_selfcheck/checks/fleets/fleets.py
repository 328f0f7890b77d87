"""Fleets and swarms of robots: no conflict by the referee and by the definitions; what planners promise, beside brute force.

Case n is the same fleet for ``lacam``, ``lns``, ``pibt`` and ``prioritised-sipp``, and another one for ``cbs`` and ``eecbs``.
Robots have four-connected moves, in kinds that begin with ``octile`` octile ones.
Of tiny fleets (up to three robots on seven cells) all is known from the space of all configurations: whether there is a
plan, the least sum of costs, the least sum of loss. Of others the rules, the planners' bounds and each other's answers are
compared.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally
from lampyris_selfcheck.checks.fleets import fleet_answers as answers
from lampyris_selfcheck.checks.fleets.fleet_draws import STYLES, TREE_STYLES, DrawnFleet, biconnected, draw
from lampyris_selfcheck.checks.fleets.fleet_driven import discs_wrong, drive_wrong, lifelong_wrong
from lampyris_selfcheck.checks.fleets.fleet_related import RELATIONS, related_wrong
from lampyris_selfcheck.checks.fleets.fleet_spoiled import figures_wrong, paths_wrong
from lampyris_selfcheck.checks.fleets.swarm_cases import motion_wrong, swarm_wrong, trace_wrong

WEIGHTS = (1.0, 1.05, 1.1, 1.3, 2.0)
REACH_TICKS = 2_000
"""Ticks in which every robot must have been on its goal."""
REACH_SIDES = (4, 6, 12, 18)
"""Greatest sides of biconnected maps, in turn."""
REACH_ROBOTS = 200
OCTILE = ("lacam", "lns", "pibt", "prioritised-sipp", "cbs", "eecbs", "exhausted")
"""With octile moves: of case n the kind at n % 7, and that kind's case n // 7."""

JUDGED = {
    "lacam": ({}, 100),
    "lns": ({"rounds": 10}, 120),
    "pibt": ({"ticks": 100}, None),
    "prioritised-sipp": ({"restarts": 0}, None),
    "cbs": ({}, 30),
    "eecbs": ({}, 30),
}
"""Planners in turn, with settings and budgets that end soon: conflicts alone are looked for, and only one time in four octile."""

DRIVEN = {
    "drives": (drive_wrong, ("few", "bay", "walls", "tiny")),
    "lifelong": (lifelong_wrong, ("few", "walls", "tiny")),
    "discs": (discs_wrong, ("walls", "open", "few")),
}
"""Kinds of fleets in motion: the judge of a case, and how its fleets look."""


@lru_cache(maxsize=8)
def drawn_fleet(ask: Ask, number: int, styles: tuple[str, ...]) -> DrawnFleet:
    """The fleet of case ``number`` of every planner with these styles."""
    return draw(ask.rng("fleets", "fleet", number), styles[number % len(styles)])


def styles_of(planner: str) -> tuple[str, ...]:
    """``cbs`` and ``eecbs`` get fleets that they can solve."""
    return TREE_STYLES if planner in ("cbs", "eecbs") else STYLES


def settings_of(planner: str, number: int, drawn: DrawnFleet) -> tuple[dict[str, Any], int | None, float]:
    """Settings, a budget of iterations, and the factor that is promised."""
    rng = np.random.default_rng(number)
    if planner == "pibt":
        return {"ticks": 200, "swap": bool(rng.random() < 0.8)}, None, 1.0
    if planner == "prioritised-sipp":
        return {"restarts": int(rng.choice([0, 0, 3]))}, None, 1.0
    if planner == "lacam":
        budget = None if drawn.is_tiny and rng.random() < 0.5 else 1000
        return {"swap": bool(rng.random() < 0.7), "samples": int(rng.choice([1, 1, 3]))}, budget, 1.0
    if planner == "lns":
        sizes = {"neighbourhood": int(rng.integers(1, 9)), "rounds": 30}
        return sizes, None if drawn.is_tiny else 600, 1.0
    switches = {"disjoint": bool(rng.integers(2)), "bypass": bool(rng.integers(2))}
    if planner == "cbs":
        return switches, 200, 1.0
    weight = float(rng.choice(WEIGHTS))
    return switches | {"weight": weight}, 200, weight


def _planned_wrong(planner: str, number: int, drawn: DrawnFleet, tally: Tally) -> str:
    truth = answers.FleetTruth(drawn)
    settings, budget, weight = settings_of(planner, number, drawn)
    plan = answers.asked(drawn.fleet, planner, number, budget, settings, drawn.moves)
    tally.count(drawn.style)
    if not isinstance(plan, FleetPlan):
        return f"{settings}: {plan}"
    tally.count(plan.status.value)
    fault = answers.plan_wrong(plan, drawn, truth)
    if not fault and planner in ("lacam", "lns") and (budget is None or planner == "lns"):
        fault = answers.complete_wrong(plan, drawn, truth)
    if not fault and planner == "lns":
        fault = answers.improved_wrong(plan, drawn, number)
    if not fault and planner in ("cbs", "eecbs"):
        fault = answers.bound_wrong(plan, drawn, truth, weight)
    if not fault and planner == "prioritised-sipp" and settings["restarts"] == 0:
        fault = answers.order_wrong(plan, drawn, truth)
    if not fault and planner == "pibt" and drawn.style == "bay" and settings["swap"] and not plan:
        fault = f"two robots do not change places in a corridor with a bay: {plan.sentence}"
    return f"{settings}, budget {budget}: {fault}" if fault else ""


def _judged_wrong(rng: np.random.Generator, number: int, tally: Tally) -> tuple[DrawnFleet, str]:
    """A plan past the referee, and past the definitions of conflicts; nothing else is compared."""
    planner = tuple(JUDGED)[number % len(JUDGED)]
    turn = number // len(JUDGED)
    styles = styles_of(planner)
    drawn = replace(draw(rng, styles[turn % len(styles)]), octile=turn // len(styles) % 4 == 3)
    settings, budget = JUDGED[planner]
    plan = answers.asked(drawn.fleet, planner, number, budget, settings, drawn.moves)
    if not isinstance(plan, FleetPlan):
        return drawn, f"{planner}, {drawn.moves}: {plan}"
    tally.count(f"{planner} {plan.status.value}")
    if plan:
        tally.count("found")
    fault = answers.conflicts_of(plan, drawn)
    return drawn, f"{planner}, {drawn.moves}: {fault}" if fault else ""


def _tell(tally: Tally, number: int, drawn: DrawnFleet, fault: str) -> None:
    if fault:
        fleet = drawn.fleet
        tally.fail(number, f"{drawn.style}: {fault}", rows=drawn.rows, starts=fleet.starts, goals=fleet.goals)


def _run(ask: Ask, part: Part) -> Outcome:
    tally = Tally(part)
    for number in part.numbers:
        tally.case()
        try:
            _case(ask, part.kind, number, tally)
        except Exception as error:
            tally.fail(number, f"{type(error).__name__}: {error}")
    return tally.outcome()


def _case(ask: Ask, kind: str, number: int, tally: Tally) -> None:
    rng = ask.rng("fleets", kind, number)
    if kind in ("referee", "octile-referee"):
        octile = kind == "octile-referee"
        fault, word, case = (
            paths_wrong(rng, octile=octile) if number % 2 == 0 else figures_wrong(rng, number, octile=octile)
        )
        tally.count(word)
        if fault:
            tally.fail(number, fault, **case)
    elif kind == "swarm-robots":
        fault, word = swarm_wrong(rng, number)
        tally.count(word)
        if fault:
            tally.fail(number, fault)
    elif kind == "swarm-referee":
        fault, word = motion_wrong(rng) if number % 2 == 0 else trace_wrong(rng, number)
        tally.count(word)
        if fault:
            tally.fail(number, fault)
    elif kind in DRIVEN:
        judge, styles = DRIVEN[kind]
        drawn = replace(
            draw(rng, styles[number % len(styles)]), octile=kind != "lifelong" and number % 3 == 2
        )
        fault, word = judge(rng, number, drawn)
        tally.count(word)
        _tell(tally, number, drawn, fault)
    elif kind == "reaches":
        side = REACH_SIDES[number % len(REACH_SIDES)]
        fleet = biconnected(rng, side, REACH_ROBOTS, dense=number % 8 >= 4)
        fault, ticks = answers.reaches_wrong(fleet, number, REACH_TICKS)
        _tell(tally, number, DrawnFleet(fleet, kind), fault)
        tally.measure("ticks until each has been on its goal", ticks)
        tally.measure("robots", len(fleet))
    elif kind == "judged":
        drawn, fault = _judged_wrong(rng, number, tally)
        _tell(tally, number, drawn, fault)
    elif kind == "related":
        drawn = draw(rng, ("tiny", "few")[number // len(RELATIONS) % 2])
        relation = RELATIONS[number % len(RELATIONS)]
        fault, known = related_wrong(drawn, relation, rng)
        tally.count(relation)
        tally.count("both known", int(known))
        _tell(tally, number, drawn, fault)
    elif kind == "octile-constrained":
        _searched(ask, "constrained", number, tally, rng, octile=True)
    elif kind == "octile":
        kind = OCTILE[number % len(OCTILE)]
        _searched(ask, kind, number, tally, rng, own=number // len(OCTILE), octile=True)
    else:
        _searched(ask, kind, number, tally, rng, octile=False)


def _searched(
    ask: Ask,
    kind: str,
    number: int,
    tally: Tally,
    rng: np.random.Generator,
    *,
    octile: bool,
    own: int | None = None,
) -> None:
    """A case of a planner or of a search, with one step set or the other; ``own``: its number among those of this kind."""
    own = number if own is None else own
    if kind == "exhausted":
        drawn = draw(rng, "tiny")
        while len(drawn.fleet) > 2:
            drawn = draw(rng, "tiny")
    elif kind == "constrained":
        drawn = draw(rng, ("tiny", "few", "few")[own % 3])
    else:
        drawn = drawn_fleet(ask, own, styles_of(kind))
    drawn = replace(drawn, octile=octile)
    if kind == "exhausted":
        fault = answers.exhausted_wrong(drawn, own)
    elif kind == "constrained":
        fault, word = answers.constrained_wrong(rng, drawn)
        tally.count(word)
    else:
        fault = _planned_wrong(kind, own, drawn, tally)
    _tell(tally, number, drawn, f"{kind}, {drawn.moves}: {fault}" if fault and octile else fault)


def _kind(what: str, commit: int, nightly: int, chunk: int, **least: float) -> Kind:
    return Kind(what, commit, nightly, 10 * nightly, chunk, least=least)


KINDS = {
    "lacam": _kind(
        "lacam: no conflict; a plan of a tiny fleet exactly if there is one", 30, 20_000, 500, found=0.5
    ),
    "lns": _kind(
        "lns: no conflict; never costs more or takes longer than the plan it begins with",
        16,
        20_000,
        500,
        found=0.5,
    ),
    "pibt": _kind("pibt: no conflict, also in plans that are not finished", 40, 20_000, 500, found=0.4),
    "prioritised-sipp": _kind(
        "prioritised-sipp: no conflict; in one order each robot arrives as early as can be",
        60,
        20_000,
        500,
        found=0.3,
    ),
    "cbs": _kind("cbs: the least sum of costs, by two independent searches", 100, 15_000, 200, found=0.3),
    "eecbs": _kind("eecbs: within its factor of a bound that is one", 100, 15_000, 200, found=0.4),
    "judged": _kind(
        "all planners in turn: no conflict, by the referee and by the definitions",
        12,
        100_000,
        1_000,
        found=0.4,
    ),
    "exhausted": _kind("lacam to its end: the least sum of loss", 40, 4_000, 100),
    "reaches": _kind(
        "pibt without the swap rule, biconnected maps, up to 200 robots: each has been on its goal",
        8,
        1_000,
        20,
    ),
    "constrained": _kind(
        "the low level of cbs: one robot's shortest path under constraints", 200, 100_000, 2_000
    ),
    "related": _kind(
        "cbs on maps that are turned, robots in another order, a robot less, a wall more", 40, 5_000, 200
    ),
    "referee": _kind(
        "the referee's verdict on right and spoiled plans is that of the definitions", 400, 100_000, 5_000
    ),
    "octile": _kind(
        "octile moves: every planner and search beside brute force, each one case in seven",
        160,
        40_000,
        400,
        found=0.3,
    ),
    "octile-constrained": _kind(
        "octile moves: one robot's shortest path under constraints", 200, 50_000, 2_000
    ),
    "octile-referee": _kind(
        "octile moves: the referee's verdict is that of the definitions", 400, 50_000, 5_000
    ),
    "drives": _kind(
        "plans that are driven with delays: no contact at any moment, all arrive when the trace says",
        16,
        3_000,
        100,
        found=0.4,
    ),
    "lifelong": _kind(
        "tasks without end: no conflict, each task done where and when it is said to be", 16, 5_000, 200
    ),
    "discs": _kind(
        "discs of several sizes: no contact within a tick, with robots or walls", 30, 1_000, 50, found=0.2
    ),
    "swarm-robots": _kind(
        "robots of a swarm: the same bytes again, no contact at any moment, by the referee and the definition",
        8,
        3_000,
        100,
    ),
    "swarm-referee": _kind(
        "the referee of swarms: contacts as by the definition; spoiled traces are refused", 60, 20_000, 500
    ),
}
CHECK = Check(
    "fleets",
    ("G34",),
    "plans of fleets have no conflict, by the referee and by the definitions, and planners keep their promises",
    KINDS,
    _run,
)
