"""What an engine can be asked, each as a stream of frames. The scenario is the one noun that comes in."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from lampyris import api
from lampyris.app.frames import NOWHERE, json_frame, layer_frame, ticks_frame
from lampyris.app.said import said_scenario
from lampyris.errors import UsageError
from lampyris.maps.scenario import Scenario
from lampyris.model.trace import Trace
from lampyris.planners import registry
from lampyris.referee import check_trace, demand
from lampyris.report.measure import near_by_tick
from lampyris.report.plain import plan_record, trace_record
from lampyris.scenarios import speed_law
from lampyris.sim.endings import why
from lampyris.sim.loop import Simulation

Look = Callable[[], None]
"""Raises when nobody waits for the answer any more."""

CHUNK_S = 0.03
"""Seconds of work between two frames of ticks."""


def answer(question: Mapping[str, Any], look: Look) -> Iterator[bytes]:
    """The frames of the answer to a question."""
    verb = VERBS.get(question["verb"])
    if verb is None:
        raise UsageError("VERB", f"{question['verb']!r}", where="verb", allowed=", ".join(VERBS))
    yield from verb(question, look)


def plan(question: Mapping[str, Any], look: Look) -> Iterator[bytes]:
    """A plan with its speeds."""
    scenario = said_scenario(question)
    began = time.perf_counter()
    planner = registry.make(scenario.planner, scenario.settings)
    found = api.plan(scenario.scene, planner, scenario.seed, record=bool(question.get("record")))
    law: Any = speed_law(scenario.law, scenario.law_settings)
    profile = api.profile(found, scenario.scene, law) if found else None
    record = plan_record(found, scenario.scene, profile, seed=scenario.seed)
    record["seconds"] = time.perf_counter() - began
    yield json_frame("Z", record)


def simulate(question: Mapping[str, Any], look: Look) -> Iterator[bytes]:
    """A simulation, tick by tick."""
    scenario = said_scenario(question)
    run = Simulation(
        scenario.scene,
        registry.make(scenario.planner, scenario.settings),
        seed=scenario.seed,
        ticks=scenario.ticks,
        law=speed_law(scenario.law, scenario.law_settings),
        patience=scenario.patience,
    )
    yield json_frame("H", {"planner": scenario.planner, "law": scenario.law, "map": scenario.scene.grid.name})
    told = 0
    last = time.perf_counter()
    while run.outcome is None:
        run.tick()
        look()
        if time.perf_counter() - last > CHUNK_S:
            trace = run.trace()
            yield from _ticks(trace, told)
            told = trace.ticks + 1
            last = time.perf_counter()
    trace = run.trace()
    demand(check_trace(trace))
    yield from _ticks(trace, told)
    yield json_frame("Z", _ending(trace, scenario))
