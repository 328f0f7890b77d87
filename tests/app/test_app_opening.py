"""The recorded answers about the opening scene: what an engine answers, and in its place."""

from __future__ import annotations

import gzip
import json
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from app_server import World, own, run

from lampyris.app.engine.frames import json_frame
from lampyris.app.server import opening
from lampyris.app.server.opening import RECORD, TIMES, recorded_answer, recorded_answers

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

    def asked(question: dict[str, Any], *more: tuple[str, str]) -> Any:
        body = json.dumps(question).encode()
        return run(world.ask("POST", f"/api/{verb}", (*own(json_=True), *more), body))

    told = asked(held.question)
    assert (told.status, told.body) == (200, b"".join(held.frames))
    packed = asked(held.question, ("Accept-Encoding", "gzip, br"))
    assert (packed.status, gzip.decompress(packed.body)) == (200, told.body)
    assert (b"content-encoding", b"gzip") in packed.headers
    assert len(packed.body) < len(told.body) / 2
    assert world.engines.asked == []
    for change in ({"seed": 1}, {"seed": False}, {"start": [36, 41]}, {"name": "x"}):
        asked({**held.question, "scenario": {**held.question["scenario"], **change}})
        assert world.engines.asked.pop()["scenario"] == {**held.question["scenario"], **change}
        assert recorded_answer(verb, {**held.question, "scenario": change}) is None


@pytest.fixture
def record(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A copy of the record, which the app reads in its place."""
    file = tmp_path.joinpath(*RECORD)
    file.parent.mkdir(parents=True)
    file.write_bytes(opening.files("lampyris.app").joinpath(*RECORD).read_bytes())
    monkeypatch.setattr(opening, "files", lambda package: tmp_path)
    recorded_answers.cache_clear()
    yield file
    recorded_answers.cache_clear()


DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda data: b"",
    "cut": lambda data: data[: len(data) // 2],
    "a bit": lambda data: data[:-9] + bytes([data[-9] ^ 1]) + data[-8:],
    "a byte within": lambda data: data[:2000] + bytes([data[2000] ^ 255]) + data[2001:],
    "not compressed": lambda data: gzip.decompress(data),
    "no frames": lambda data: gzip.compress(b"\x01\x00"),
    "no JSON": lambda data: gzip.compress(b"\x02\x00\x00\x00Q{"),
    "not an object": lambda data: gzip.compress(b"\x02\x00\x00\x00Q1"),
    "no question": lambda data: gzip.compress(json_frame("Q", {"verb": "plan"})),
    "no verb": lambda data: gzip.compress(json_frame("Z", {})),
}


@pytest.mark.parametrize("damage", ["missing", *DAMAGES])
def test_without_a_record_that_can_be_read_the_app_starts_and_engines_are_asked(
    record: Path, damage: str
) -> None:
    held = recorded_answers()["plan"]
    recorded_answers.cache_clear()
    if damage == "missing":
        record.unlink()
    else:
        record.write_bytes(DAMAGES[damage](record.read_bytes()))
    world = World()
    run(world.services.start())
    told = run(world.ask("POST", "/api/plan", own(json_=True), json.dumps(held.question).encode()))
    assert told.status == 200
    assert [one["verb"] for one in world.engines.asked] == ["plan"]
    assert recorded_answers() == {}
