"""The recorded answers about the opening scene: what an engine answers, and in its place."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest
from app_server import World, own, run

from lampyris.app.server.opening import TIMES, recorded_answer, recorded_answers

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tools"))


@pytest.mark.source
@pytest.mark.parametrize("verb", ["layer", "plan", "drive"])
def test_what_is_recorded_is_what_is_answered_byte_for_byte(verb: str) -> None:
    from app_opening import VERBS, fresh_answer

    assert set(recorded_answers()) == set(VERBS)
    held = recorded_answers()[verb]
    assert fresh_answer(verb, held.question).frames == held.frames, "run python tools/app_opening.py"
    assert not any(f'"{key}":'.encode() in piece for piece in held.frames for key in TIMES)


@pytest.mark.parametrize("verb", ["layer", "plan", "drive"])
def test_its_question_is_answered_without_an_engine_and_any_other_by_one(verb: str) -> None:
    held = recorded_answers()[verb]
    world = World()

    def asked(question: dict[str, Any]) -> Any:
        body = json.dumps(question).encode()
        return run(world.ask("POST", f"/api/{verb}", own(json_=True), body))

    told = asked(held.question)
    assert (told.status, told.body) == (200, b"".join(held.frames))
    assert world.engines.asked == []
    for change in ({"seed": 1}, {"seed": False}, {"start": [36, 41]}, {"name": "x"}):
        asked({**held.question, "scenario": {**held.question["scenario"], **change}})
        assert world.engines.asked.pop()["scenario"] == {**held.question["scenario"], **change}
        assert recorded_answer(verb, {**held.question, "scenario": change}) is None
