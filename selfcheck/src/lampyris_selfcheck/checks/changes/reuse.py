"""A session that has been through much answers as a fresh one, and its copies as itself."""

from __future__ import annotations

from functools import cache

from lampyris.planning import registry
from lampyris.planning.base import Planner
from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally
from lampyris_selfcheck.checks.changes.reuse_life import ALL, ARRIVAL, COST, NOTHING, SINCE, STEPS, Life
from lampyris_selfcheck.checks.changes.reuse_shared import CALLS, SESSIONS, sharing

KINDS = {
    "sessions": Kind(
        f"{STEPS} steps of load, edit, plan, plan again, cancel, clear, pickle and copy in one session; the"
        " planners take turns",
        commit=48,
        nightly=10_000,
        release=100_000,
        chunk=50,
    ),
    "shared": Kind(
        f"{SESSIONS} sessions that share a map, each compared with one that shares nothing, {CALLS} calls among edits",
        commit=20,
        nightly=5_000,
        release=50_000,
        chunk=100,
    ),
}

SMALL = {"swarm": 3, "iterations": 1, "waypoints": 2, "particles": 2, "rounds": 1}
"""A swarm's settings where it only matters that two answers are the same."""

VARIANTS: tuple[tuple[str, dict[str, object], str], ...] = (
    ("ad-gso", {"choice": "exact"}, SINCE),
    ("ad-gso", {"choice": "roulette"}, NOTHING),
    ("ad-gso", {"gates": "close"}, NOTHING),
    ("ad-gso", {"gates": "replan"}, NOTHING),
    ("ad-gso", {"obstacle_density_weight": 2.0, "traffic_density_weight": 1.0, "min_clearance": 1}, NOTHING),
    ("dstar-lpso", {"gates": "ignore"}, ALL),
    ("dstar16-lpso", {"gates": "ignore"}, ALL),
)
"""Roulette draws in blocks; gates that were found, heat and margins are remembered on purpose. Such sessions
are only told from those that were never copied."""


@cache
def who() -> tuple[tuple[Planner, str], ...]:
    """Our planners, and what of their answers must be a fresh session's."""
    out = []
    for name in registry.names():
        if registry.origin_of(name):
            continue
        known = registry.settings_of(registry.planner_class(name))
        if "forecast" in known:
            # With no margin a session leaves its way for any gain.
            out.append((registry.make(name, {"margin": 0}), ARRIVAL))
            continue
        gates = known.get("gates", "ignore") != "ignore"
        alike = {"ad-gso": SINCE, "fastest": COST}.get(name, ALL)
        alike = NOTHING if gates else alike
        out.append((_small(name, {}), alike))
    return (*out, *((_small(name, settings), alike) for name, settings, alike in VARIANTS))


def _small(name: str, settings: dict[str, object]) -> Planner:
    known = registry.settings_of(registry.planner_class(name))
    return registry.make(name, {**{k: v for k, v in SMALL.items() if k in known}, **settings})


def run(ask: Ask, part: Part) -> Outcome:
    """Judge some lives."""
    tally = Tally(part)
    if part.kind == "shared":
        return _shared(ask, part, tally)
    planners = who()
    for number in part.numbers:
        planner, alike = planners[number % len(planners)]
        tally.case(planner.name)
        life = None
        try:
            life = Life(planner, alike, ask.rng("reuse", part.kind, number))
            wrong = next((w for w in (life.step() for _ in range(STEPS)) if w), "")
        except Exception as error:
            wrong = f"{type(error).__name__}: {error}"
        if wrong:
            tally.fail(number, f"{planner}: {wrong}", life=life.told if life else [])
        for word, times in sorted(life.seen.items()) if life else ():
            tally.count(word, times)
    return tally.outcome()


def _shared(ask: Ask, part: Part, tally: Tally) -> Outcome:
    for number in part.numbers:
        try:
            wrong = sharing(number, ask.rng("reuse", part.kind, number), tally)
        except Exception as error:
            wrong = f"{type(error).__name__}: {error}"
        if wrong:
            tally.fail(number, wrong)
    return tally.outcome()


CHECK = Check(
    "reuse",
    ("G9",),
    "a session answers as a fresh one whatever it has been through, and a copy as its original",
    KINDS,
    run,
)
