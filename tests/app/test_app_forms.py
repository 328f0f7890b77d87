"""No JSON value at any place of any request, sent with the token, is a fault of ours (issue 24, C21).

Sound requests, one for each key of each form, with one place replaced by a wrong value: every answer is 2xx,
or 4xx with a sentence. Engines are the real ones, in this process.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Iterator, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from app_server import WAYS, Told, World, own

from lampyris._core import cancellation
from lampyris.app.engine import work
from lampyris.app.engine.frames import error_frame
from lampyris.app.engine.study_process import study_of_question
from lampyris.app.server.library import Library
from lampyris.app.server.request_parsing import JSON
from lampyris.app.server.server import ASKED, OTHERS
from lampyris.app.server.studies import Studies
from lampyris.errors import InternalFault, LampyrisError
from lampyris.motion.laws import registry as laws
from lampyris.planning import registry
from sizes import some

HUGE = "@huge@"
"""Stands for a number of 400 digits: json.dumps writes none that long."""
WRONG: tuple[Any, ...] = (
    None, True, False, 0, 1, -1, 2, 1.5, -0.5, 1e308, -1e308, 5e-324, 2**31, 2**63, 2**64, -(2**64), HUGE,
    f"-{HUGE}", f"{HUGE}.5", f"1e{HUGE}", "", "x", "guide", "\ud800", "\x00", "é" * 70, "x" * 5000, [], {},
    [1], [[]], [[1, 2]], {"a": 1}, [None], [{}], {"name": 1}, [HUGE], [1.5, 2], [1, 2], [-1, 0], [0, 0, 0],
    [True, False], ["a", "b"], {"name": [], "settings": 3}, "a: .inf", "a: .nan", '{"a": 1e999}',
)  # fmt: skip

SCENARIO: dict[str, Any] = {
    "version": 1, "$schema": "x", "name": "n", "map": "guide", "map_hash": None,
    "start": [0, 9], "goal": [7, 0],
    "moves": "dissertation", "preset": "robot", "zones": None, "seed": 1,
    "robot": {
        "radius": 0.0, "v_max": 1.0, "a_max": 1.0, "d_max": 1.0, "a_lat_max": 1.0, "turn_radius": 0.0,
        "jerk_max": None,
    },
    "planner": {"name": "ad-gso", "settings": {}}, "law": {"name": "physical", "settings": {}},
    "obstacles": [
        {"kind": "random-walk", "count": 1, "rate": 0.4, "radius": 0.1},
        {"kind": "patrol", "waypoints": [[1, 9], [2, 9]], "radius": 0.1},
        {"kind": "crossing", "count": 1, "radius": 0.1},
    ],
    "edits": [], "simulate": {"ticks": 5, "patience": 4},
}  # fmt: skip
MADE = {"recipe": "rooms", "size": [20, 20], "seed": 1, "settings": {"room": 5}, "resolution": 1.0}
OTHER: tuple[dict[str, Any], ...] = (
    {"map": MADE, "start": [1, 1], "goal": [3, 3], "obstacles": []},
    {"map": {"rows": ["....", "..#.", "...."], "name": "n", "resolution": 1.0, "origin": [0.0, 0.0, 0.0]},
     "start": {"m": [0.5, 0.5]}, "goal": [3, 2], "obstacles": []},
    {"obstacles": [{"kind": "recorded", "track": [[3, 9], [3, 8]], "radius": 0.0}],
     "edits": [{"tick": 0, "blocked": [[5, 5]], "freed": [[0, 0]]}]},
    {"drive": {"period": 0.1}, "obstacles": []},
)  # fmt: skip
WHO = {"name": "astar", "settings": {}, "label": "a"}
LAW = {"name": "physical", "settings": {}, "label": "b"}
BODIES: tuple[tuple[str, dict[str, Any]], ...] = (
    ("plan", {"scenario": SCENARIO, "record": False, "layers": ["gates"]}),
    ("simulate", {"scenario": SCENARIO}),
    ("drive", {"scenario": {key: value for key, value in SCENARIO.items() if key not in ("simulate", "edits")} | {"drive": {}}}),
    ("layer", {"scenario": SCENARIO, "layer": "cost", "obstacle_cells": [[1, 1]], "tick": 0}),
    ("layer", {"scenario": SCENARIO, "layer": "reach", "obstacle_cells": [[1, 1]], "tick": 1}),
    ("compare", {"scenario": SCENARIO, "planners": [WHO], "laws": [LAW], "seeds": [1]}),
    ("race", {"scenario": SCENARIO, "planners": [WHO]}),
    ("export", {"scenario": SCENARIO, "what": "csv", "settings": {}, "progress": False}),
    ("export", {"scenario": SCENARIO, "what": "png", "settings": {"layer": "cost"}, "tick": 1,
                "progress": True}),
    ("export", {"scenario": SCENARIO, "what": "gif", "settings": {"fps": 10, "scale": 4, "layer": "cost"}}),
    ("export", {"scenario": SCENARIO, "what": "report",
                "settings": {"planners": [WHO], "laws": [LAW], "seeds": 1}}),
    ("fleet", {"scenario": {"map": MADE}, "robots": 3, "planner": "pibt", "settings": {"swap": True}, "seed": 1,
               "seconds": 1.5}),
    ("fleet", {"scenario": {"map": "env-3", "edits": []}, "agents": [1, 1, 3, 1]}),
    ("swarm", {"scenario": {"map": "env-6"}, "robots": 3, "seed": 1, "sources": "drawn",
               "settings": {"iterations": 2, "method": "gso", "noise": 0.1, "line_of_sight": True}}),
    ("make", {"map": MADE}),
    ("scenario", {"name": "a.yaml", "text": "version: 1"}),
    ("scenario", {"name": "a.json", "text": "{}"}),
    ("study", {"scenario": SCENARIO, "planners": [WHO], "laws": [LAW], "seeds": 1, "queries": 2}),
    ("ticket", {"job": "x"}),
    ("cancel", {"job": 1}),
    ("cancel", {"job": "s1"}),
    ("maps/up-1/delete", {"back": True}),
)  # fmt: skip


class Engines:
    """The answers of an engine, made here; what an engine would call a fault of ours is kept."""

    def __init__(self) -> None:
        self.faults: list[str] = []

    async def ask(self, question: Mapping[str, Any]) -> AsyncIterator[bytes]:
        looks = 0

        def look() -> None:
            nonlocal looks
            looks += 1
            if looks > 200:  # long enough: what is asked, and not what comes of it, is tried
                raise cancellation.Cancelled

        try:
            for piece in work.answer({**json.loads(json.dumps(question)), "job": 1}, look):
                yield piece
        except cancellation.Cancelled:
            return
        except LampyrisError as fault:
            if isinstance(fault, InternalFault):
                self.faults.append(str(fault))
            yield error_frame(fault)
        except Exception as fault:
            self.faults.append(f"{type(fault).__name__}: {fault}")
            yield error_frame(InternalFault("INTERNAL", "a fault"))

    async def cancel(self, job: int) -> None:
        """There is none."""


class Unrun(Studies):
    """Studies that are read and not run."""

    async def _run(self, job: Any) -> None:
        """Nothing."""

    async def start(self, body: Mapping[str, Any]) -> str:
        """Begin, having read it here."""
        study_of_question(json.loads(json.dumps(body)))
        return await super().start(body)


def plain(settings: Any) -> dict[str, Any]:
    """Settings as a page may say them."""
    table = (
        dict(settings)
        if isinstance(settings, Mapping)
        else {f.name: getattr(settings, f.name) for f in fields(settings)}
    )
    return {k: v if v is None or isinstance(v, int | float | str) else str(v) for k, v in table.items()}


def places(value: Any, at: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Every place of some plain data."""
    yield at
    parts = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, part in parts:
        yield from places(part, (*at, key))


def replaced(value: Any, at: tuple[Any, ...], by: Any) -> Any:
    """Plain data with another value at a place."""
    if not at:
        return by
    new = dict(value) if isinstance(value, dict) else list(value)
    new[at[0]] = replaced(value[at[0]], at[1:], by)
    return new


def written(body: Any) -> bytes:
    """JSON, with numbers that nobody else writes."""
    text = json.dumps(body)
    for word in (f'"-{HUGE}"', f'"{HUGE}.5"', f'"1e{HUGE}"', f'"{HUGE}"'):
        text = text.replace(word, word.strip('"').replace(HUGE, "9" * 400))
    return text.encode()


def requests(count: int, seed: int) -> Iterator[tuple[str, tuple[Any, ...], bytes]]:
    """Damaged requests: verb, place, body."""
    rng = np.random.default_rng(seed)

    def one(of: Any) -> Any:
        return of[int(rng.integers(len(of)))]

    for _ in range(count):
        verb, body = one(BODIES)
        if "scenario" in body:
            scenario = {**body["scenario"], **(one(OTHER) if rng.random() < 0.3 else {})}
            if rng.random() < 0.5:
                planner, law = one(registry.names()), one(laws.names())
                scenario["planner"] = {
                    "name": planner, "settings": plain(registry.settings_of(registry.planner_class(planner)))
                }  # fmt: skip
                scenario["law"] = {"name": law, "settings": plain(laws.settings_named(law))}
            body = {**body, "scenario": scenario}
        at = one(list(places(body)))
        yield verb, at, written(replaced(body, at, one(WRONG)))


def told_of(world: World, verb: str, body: bytes) -> Told:
    async def ask() -> Told:
        return await world.ask("POST", f"/api/{verb}", own(json_=True), body)

    return asyncio.run(ask())


@pytest.fixture
def world(tmp_path: Path) -> World:
    made = World()
    made.services.engines = Engines()  # type: ignore[assignment]
    made.services.library = Library(None, tmp_path / "spool")
    made.services.studies = Unrun(tmp_path)
    return made


def faults(world: World, verb: str, body: bytes) -> str:
    """What is wrong with the answer to a request; empty: nothing."""
    engines: Any = world.services.engines
    engines.faults.clear()
    told = told_of(world, verb, body)
    if engines.faults:
        return f"{told.status} {engines.faults[0]}"
    if 200 <= told.status < 300:
        return ""
    if not 400 <= told.status < 500:
        return f"{told.status}"
    return "" if told.error()["what"] and told.error()["code"] else f"{told.status} without a sentence"


def test_every_key_of_every_form_is_tried() -> None:
    known = {**ASKED, **OTHERS}
    tried: dict[str, set[str]] = {}
    for verb, body in BODIES:
        tried.setdefault(verb.rpartition("/")[2], set()).update(body)
    assert {verb: set(form) for verb, form in known.items()} == tried
    taking = {way.path.rpartition("/")[2] for way in WAYS if way.takes == JSON}
    assert taking == set(known), "a way that takes JSON and has no form"


def test_sound_requests_are_answered(world: World) -> None:
    codes = {
        (verb, told.status, told.error()["code"] if told.status != 200 else "")
        for verb, body in BODIES
        for told in [told_of(world, verb, written(body))]
    }
    refused = {one for one in codes if one[1] != 200}
    assert refused == {("ticket", 404, "JOB"), ("cancel", 404, "JOB"), ("maps/up-1/delete", 404, "MAP")}


@pytest.mark.nightly
@pytest.mark.parametrize("seed", some(range(4)))
def test_no_wrong_value_at_any_place_is_a_fault_of_ours(world: World, seed: int) -> None:
    wrong = [
        (verb, at, body[:200], what)
        for verb, at, body in requests(500, seed)
        if (what := faults(world, verb, body))
    ]
    assert not wrong


@pytest.mark.parametrize(
    ("verb", "key", "value", "code"),
    [
        ("plan", "layers", 1, "TYPE"),
        ("plan", "layers", True, "TYPE"),
        ("plan", "record", "yes", "TYPE"),
        ("layer", "tick", HUGE, "JSON_SYNTAX"),
        ("layer", "tick", 1.5, "TYPE"),
        ("export", "settings", {"fps": "x"}, "FPS"),
        ("export", "settings", {"fps": 0}, "FPS"),
        ("export", "settings", {"scale": [1]}, "SCALE"),
        ("ticket", "job", [], "TYPE"),
        ("scenario", "text", "a: .inf", "YAML_NUMBER"),
        ("scenario", "text", "a: {b: [.nan]}", "YAML_NUMBER"),
    ],
)
def test_a_wrong_value_is_told_with_its_place(
    world: World, verb: str, key: str, value: Any, code: str
) -> None:
    body = next(dict(body) for name, body in BODIES if name == verb)
    if verb == "export":
        body["what"] = "gif"
    told = told_of(world, verb, written({**body, key: value}))
    assert (told.status, told.error()["code"]) == (400, code)
    assert told.error()["allowed"]


@pytest.mark.parametrize("place", ["rho", "gamma"])
def test_a_number_of_400_digits_in_a_setting_is_refused(world: World, place: str) -> None:
    scenario = {**SCENARIO, "planner": {"name": "ad-gso", "settings": {place: HUGE}}}
    told = told_of(world, "plan", written({"scenario": scenario}))
    assert (told.status, told.error()["code"]) == (400, "JSON_SYNTAX")
    assert "too great" in told.error()["what"]
