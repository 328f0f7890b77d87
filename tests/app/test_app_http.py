"""HTTP itself: limits (W13), rubbish (W18), and answers that end when nobody reads them."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import json
import logging
import os
import socket
import time
from collections.abc import AsyncIterator, Iterator
from typing import Any

import numpy as np
import pytest
from app_server import (
    WAYS,
    World,
    alive,
    answers,
    asks,
    check_safe,
    filled,
    head,
    own,
    parsed,
    raw,
    rest,
    run,
    serving,
)
from starlette.requests import ClientDisconnect

from lampyris.app.engine.frames import frame, json_frame
from lampyris.app.server import guard, listening
from lampyris.app.server.guard import MAX_BODY, Guard
from lampyris.app.server.request_parsing import JSON
from lampyris.errors import InputError, LampyrisError

MIB = 2**20


@pytest.fixture(scope="module")
def live() -> Iterator[tuple[int, World]]:
    with serving() as made:
        yield made


# -------------------------------------------------------------------------------------- limits (W13)


def test_a_body_of_the_limit_is_taken_and_one_byte_more_is_not(live: tuple[int, World]) -> None:
    port, world = live
    body = b"x" * MAX_BODY
    bytes_ = {"Content-Type": "application/octet-stream"}
    before = len(world.library.changes)
    assert asks(port, "POST", "/api/maps", body, **bytes_)[0] == 200
    assert world.library.changes[before:] == [("add", MAX_BODY)]
    status, told = asks(port, "POST", "/api/maps", body + b"x", **bytes_)
    assert (status, json.loads(told)["error"]["code"]) == (413, "BODY_SIZE")
    assert len(world.library.changes) == before + 1
    alive(port)


def test_chunks_without_an_end_are_cut_off(live: tuple[int, World]) -> None:
    port, world = live
    before = len(world.library.changes)
    chunk = b"10000\r\n" + b"x" * 0x10000 + b"\r\n"
    sent = 0
    with socket.create_connection(("127.0.0.1", port), 10) as wire:
        wire.sendall(head(port, "POST", "/api/maps", "Transfer-Encoding: chunked"))
        with contextlib.suppress(BrokenPipeError, ConnectionResetError):
            while sent < 1000 * MIB:
                wire.sendall(chunk)
                sent += len(chunk)
    assert MAX_BODY < sent < 1000 * MIB
    assert len(world.library.changes) == before
    alive(port)


def test_a_length_that_lies_is_found_out(live: tuple[int, World]) -> None:
    port, world = live
    before = len(world.library.changes)
    # Less comes than was said: nothing is done with it.
    with socket.create_connection(("127.0.0.1", port), 5) as wire:
        wire.sendall(head(port, "POST", "/api/maps", "Content-Length: 100") + b"x" * 50)
        wire.shutdown(socket.SHUT_WR)
        assert rest(wire) == b""
    # More comes than was said: the rest is not a request.
    got = raw(port, head(port, "POST", "/api/maps", "Content-Length: 5") + b"x" * 5 + head(port, "GET"))
    assert answers(got) == 1
    assert world.library.changes[before:] == [("add", 5)]
    for length in ("99999999999999999999", "-1", "+5", "0x5", "5 5", ""):
        got = parsed(raw(port, head(port, "POST", "/api/maps", f"Content-Length: {length}") + b"x" * 5))
        assert got.status in (400, 413), length
    alive(port)


def test_heads_that_are_too_long(live: tuple[int, World]) -> None:
    port, _ = live
    # A head without an end, as fast as it goes.
    with socket.create_connection(("127.0.0.1", port), 5) as wire:
        wire.sendall(b"GET / HTTP/1.1\r\n")
        with contextlib.suppress(BrokenPipeError, ConnectionResetError):
            for _ in range(1000):
                wire.sendall(b"X-A: " + b"a" * (listening.MAX_HEAD // 16) + b"\r\n")
        got = rest(wire)
    assert not got or parsed(got).status == 400
    alive(port)


def test_who_takes_too_long_for_a_head_is_let_go() -> None:
    with serving(head_seconds=0.3) as (port, _):
        slow = socket.create_connection(("127.0.0.1", port), 5)
        silent = socket.create_connection(("127.0.0.1", port), 5)
        with slow, silent:
            with contextlib.suppress(BrokenPipeError, ConnectionResetError):
                for byte in b"GET / HTTP/1.1\r\nHost: 127.0.0.1":
                    slow.sendall(bytes([byte]))
                    time.sleep(0.02)
            assert rest(slow) == b""
            assert rest(silent) == b""  # a browser's connection ahead of need is not told off
        alive(port)


def test_who_takes_too_long_for_a_body_is_let_go() -> None:
    world = World()
    world.app = Guard(world.app._app, world.app._door, seconds=0.1)

    async def drip() -> Any:
        await asyncio.sleep(0.03)
        return {"type": "http.request", "body": b"x", "more_body": True}

    said: list[Any] = []

    async def send(message: Any) -> None:
        said.append(message)

    scope = {
        "type": "http", "method": "POST", "path": "/api/maps", "raw_path": b"/api/maps", "query_string": b"",
        "headers": [
            (k.lower().encode(), v.encode()) for k, v in own(("Content-Type", "application/octet-stream"))
        ],
    }  # fmt: skip
    asyncio.run(world.app(scope, drip, send))
    assert said[0]["status"] == 408
    assert world.reached == 0


def test_a_body_that_says_it_is_too_long_is_not_read() -> None:
    world = World()
    headers = own(("Content-Type", "application/octet-stream"), ("Content-Length", str(MAX_BODY + 1)))
    told = run(world.ask("POST", "/api/maps", headers, [b"x", b"y"]))
    assert (told.status, told.error()["code"]) == (413, "BODY_SIZE")
    assert world.reached == 0


def test_hundreds_of_connections_do_not_lock_the_user_out(live: tuple[int, World]) -> None:
    port, _ = live
    held = [socket.create_connection(("127.0.0.1", port), 5) for _ in range(500)]
    try:
        for wire in held[::2]:
            with contextlib.suppress(BrokenPipeError, ConnectionResetError):
                wire.sendall(b"GET / HT")
        alive(port)  # while they are held
    finally:
        for wire in held:
            wire.close()
    alive(port)


def test_sixteen_streams_and_no_more() -> None:
    world = World()
    gate: list[asyncio.Event] = []

    async def held(question: dict[str, Any]) -> AsyncIterator[bytes]:
        yield json_frame("H", {})
        await gate[0].wait()
        yield json_frame("Z", {})

    world.engines.answer = held

    async def many() -> list[int]:
        gate.append(asyncio.Event())
        body = b'{"scenario": {"map": "guide"}}'
        asked = [
            asyncio.ensure_future(world.ask("POST", "/api/simulate", own(json_=True), body))
            for _ in range(20)
        ]
        while sum(task.done() for task in asked) < 4 or len(world.engines.asked) < 16:
            await asyncio.sleep(0.01)
        gate[0].set()
        return sorted([(await task).status for task in asked])

    assert run(many()) == [200] * 16 + [429] * 4
    assert world.services.streams == 0
    assert world.engines.closed == 16


@pytest.mark.parametrize(
    "chunks",
    [
        b"zz\r\nx\r\n0\r\n\r\n",
        b"-1\r\n\r\n",
        b"5\r\nxx\r\n0\r\n\r\n",
        b"1 \nx\r\n",
        b"fffffffffffffffffffff\r\nx",
    ],
)
def test_chunks_that_are_none_end_the_connection(live: tuple[int, World], chunks: bytes) -> None:
    port, world = live
    before = len(world.library.changes)
    got = raw(port, head(port, "POST", "/api/maps", "Transfer-Encoding: chunked") + chunks)
    assert not got or parsed(got).status == 400
    assert len(world.library.changes) == before


def test_heads_byte_by_byte_and_in_one_piece_are_the_same(live: tuple[int, World]) -> None:
    port, _ = live
    whole = head(port, "POST", "/api/maps", "Content-Length: 3") + b"abc"
    with socket.create_connection(("127.0.0.1", port), 5) as wire:
        wire.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        for byte in whole:
            wire.sendall(bytes([byte]))
        assert parsed(rest(wire)).status == 200


# --------------------------------------------------------------------------------------- rubbish (W18)


def mutants(port: int, count: int, seed: int) -> Iterator[bytes]:
    """Sound requests, damaged."""
    rng = np.random.default_rng(seed)
    sound = [
        *(head(port, "GET", filled(way)) for way in WAYS if way.method == "GET"),
        *(
            head(port, "POST", filled(way), "Content-Length: 15").replace(b"octet-stream", b"json")
            + b'{"scenario":{}}'
            for way in WAYS
            if way.takes == JSON
        ),
        head(port, "POST", "/api/maps", "Content-Length: 5") + b"abcde",
        head(port, "POST", "/api/maps", "Transfer-Encoding: chunked") + b"5\r\nabcde\r\n0\r\n\r\n",
        head(port, "POST", "/api/plan", "Content-Length: 29").replace(b"octet-stream", b"json")
        + b'{"scenario":{"map":"guide"} }',
    ]
    parts = [
        b"\r\n",
        b"\n",
        b"\0",
        b":",
        b" ",
        b"%",
        b"/",
        b"..",
        b"\xff",
        b"Host: x\r\n",
        b"9" * 30,
        b"{" * 2000,
    ]
    for _ in range(count):
        made = bytearray(sound[rng.integers(len(sound))])
        for _ in range(rng.integers(1, 5)):
            at = int(rng.integers(len(made) + 1))
            kind = rng.integers(4)
            if kind == 0:
                made[at : at + 1] = bytes([int(rng.integers(256))])
            elif kind == 1:
                made[at:at] = parts[rng.integers(len(parts))]
            elif kind == 2:
                del made[at : at + int(rng.integers(1, 40))]
            else:
                made[at:at] = made[max(0, at - int(rng.integers(1, 60))) : at]
        yield bytes(made)


def held() -> int:
    """Bytes of memory this process, and the server in it, hold now."""
    gc.collect()
    try:
        with open("/proc/self/statm") as told:
            return int(told.read().split()[1]) * os.sysconf("SC_PAGESIZE")
    except OSError:
        return 0


@pytest.fixture
def unheard() -> Iterator[None]:
    """Nobody keeps what is logged: pytest would, and that is no memory of the server's."""
    logging.disable(logging.CRITICAL)
    yield
    logging.disable(logging.NOTSET)


def rubbish(count: int, seed: int) -> None:
    """Send it; nothing but sound answers comes back, and the server is as well as before."""
    world = World()
    seen: set[int] = set()
    before = 0
    with serving(world, head_seconds=0.3) as (port, _):
        for number, data in enumerate(mutants(port, count, seed)):
            if number == 500:
                before = held()  # by now it has all that it keeps
            with socket.create_connection(("127.0.0.1", port), 10) as wire:
                with contextlib.suppress(BrokenPipeError, ConnectionResetError, OSError):
                    wire.sendall(data)
                    wire.shutdown(socket.SHUT_WR)
                got = rest(wire)
            assert answers(got) <= 1, data
            if got:
                told = parsed(got)
                seen.add(told.status)
                assert told.status < 500, data
                assert b"Traceback" not in got
                if told.status != 400:  # which uvicorn says in a line of plain text
                    check_safe(told)
        alive(port)
        state = world.server.server_state  # type: ignore[attr-defined]
        until = time.monotonic() + 60
        while (state.connections or state.tasks) and time.monotonic() < until:
            time.sleep(0.01)
        assert not state.connections
        assert not state.tasks
        # What a fake engine or library writes down is the test's.
        world.engines.asked.clear()
        world.library.changes.clear()
        grown = held() - before
        assert abs(grown) < 20 * MIB, f"{grown / MIB:.1f} MiB"
    assert {200, 400, 401, 421} <= seen
    assert world.services.streams == 0


@pytest.mark.nightly
@pytest.mark.usefixtures("unheard")
def test_damaged_requests_get_sound_answers() -> None:
    rubbish(1500, seed=7)


@pytest.mark.nightly
@pytest.mark.usefixtures("unheard")
def test_many_damaged_requests_get_sound_answers() -> None:
    rubbish(20_000, seed=8)


BAD_JSON = [
    (b"", "JSON_SYNTAX"),
    (b"{", "JSON_SYNTAX"),
    (b"[]", "JSON_SHAPE"),
    (b"3", "JSON_SHAPE"),
    (b"\xff\xfe{}", "JSON_SYNTAX"),
    (b'{"scenario": NaN}', "JSON_SYNTAX"),
    (b'{"scenario": 1e999}', "JSON_SYNTAX"),
    (b'{"scenario": ' + b"9" * 5000 + b"}", "JSON_SYNTAX"),
    (b'{"scenario": {}, "scenario": {}}', "JSON_SYNTAX"),
    (b'{"scenario": ' + b"[" * 100_000 + b"]" * 100_000 + b"}", "JSON_SYNTAX"),
    (b'{"scenario": {}, "verb": "export"}', "KEY"),
    (b'{"scenario": {}, "ground": {}}', "KEY"),
    (b'{"scenario": {}, "job": 1}', "KEY"),
    (b'{"scenario": []}', "TYPE"),
    (b"{}", "KEY"),
    (b'{"scenario": {"map": {"file": "/etc/passwd"}}}', "PATH_OUTSIDE"),
]


@pytest.mark.parametrize(("body", "code"), BAD_JSON, ids=range(len(BAD_JSON)))
def test_questions_that_are_none_reach_no_engine(body: bytes, code: str) -> None:
    world = World()
    told = run(world.ask("POST", "/api/simulate", own(json_=True), body))
    assert told.status == 400
    assert told.error()["code"] == code
    assert not world.engines.asked


def test_too_much_json_is_refused() -> None:
    world = World()
    body = b'{"scenario": "' + b"x" * (8 * MIB) + b'"}'
    told = run(world.ask("POST", "/api/simulate", own(json_=True), body))
    assert (told.status, told.error()["code"]) == (413, "JSON_SIZE")


# ------------------------------------------------------------------------------------------- answers

PLAIN = b'{"scenario": {"map": "guide"}}'


def test_frames_come_as_they_are_and_the_question_has_its_map() -> None:
    world = World()
    told = run(world.ask("POST", "/api/plan", own(json_=True), PLAIN))
    assert told.status == 200
    assert told.body == json_frame("H", {"verb": "plan"}) + frame("B", b"file") + json_frame(
        "Z", {"outcome": "arrived"}
    )
    assert world.engines.asked == [
        {"verb": "plan", "scenario": {"map": "guide"}, "ground": {"id": "guide"}},
    ]


def test_a_file_is_its_bytes_under_a_name_of_ours() -> None:
    world = World()
    body = b'{"scenario": {"map": "guide"}, "what": "svg"}'
    told = run(world.ask("POST", "/api/export", own(json_=True), body))
    assert told.body == b"file"
    assert told.header("content-type") == "image/svg+xml"
    assert told.header("content-disposition") == 'attachment; filename="lampyris.svg"'
    told = run(world.ask("POST", "/api/export", own(json_=True), body.replace(b"svg", b"exe")))
    assert (told.status, told.error()["code"]) == (400, "EXPORT")


@pytest.mark.parametrize(
    ("fault", "status"),
    [
        (InputError("START_OCCUPIED", "a wall"), 400),
        (InputError("BUSY", "too many"), 429),
        (LampyrisError("INTERNAL", "a bug"), 500),
        (InputError("ENGINE", "it died"), 503),
    ],
)
def test_an_error_before_the_first_frame_is_one_of_http(fault: LampyrisError, status: int) -> None:
    for raised in (True, False):
        world = World()

        async def wrong(question: Any, raised: bool = raised) -> AsyncIterator[bytes]:
            if raised:
                raise fault
            yield json_frame("X", {"code": fault.code, "what": fault.what})

        world.engines.answer = wrong
        told = run(world.ask("POST", "/api/plan", own(json_=True), PLAIN))
        assert (told.status, told.error()["code"]) == (status, fault.code)
        check_safe(told)


def test_an_error_behind_the_first_frame_is_a_frame_and_breaks_off_a_file() -> None:
    world = World()

    async def wrong(question: Any) -> AsyncIterator[bytes]:
        yield frame("B", b"half")
        raise InputError("LATE", "it went wrong")

    world.engines.answer = wrong
    told = run(world.ask("POST", "/api/plan", own(json_=True), PLAIN))
    assert told.status == 200
    assert b'X{"code":"LATE"' in told.body
    with serving(world) as (port, _):
        body = b'{"scenario": {}, "what": "png"}'
        sent = head(port, "POST", "/api/export", f"Content-Length: {len(body)}").replace(
            b"octet-stream", b"json"
        )
        got = raw(port, sent + body)
        assert b"half" in got
        assert not got.endswith(b"3\r\nabc\r\n0\r\n\r\n")  # it does not look whole


def test_when_the_page_leaves_its_job_ends() -> None:
    world = World()

    async def endless(question: Any) -> AsyncIterator[bytes]:
        while True:
            await asyncio.sleep(0.01)
            if question["scenario"].get("say", True):
                yield json_frame("P", {})

    world.engines.answer = endless
    with serving(world) as (port, _):
        for say in (True, False):
            closed = world.engines.closed
            body = json.dumps({"scenario": {"say": say}}).encode()
            sent = head(port, "POST", "/api/simulate", f"Content-Length: {len(body)}")
            with socket.create_connection(("127.0.0.1", port), 5) as wire:
                wire.sendall(sent.replace(b"octet-stream", b"json") + body)
                if say:
                    assert wire.recv(100).startswith(b"HTTP/1.1 200")
                while len(world.engines.asked) == closed:
                    time.sleep(0.01)
            until = time.monotonic() + 60
            while world.engines.closed == closed and time.monotonic() < until:
                time.sleep(0.01)
            assert world.engines.closed == closed + 1
    assert world.services.streams == 0


def test_who_does_not_read_holds_the_engine_back() -> None:
    world = World()
    made = [0]

    async def flood(question: Any) -> AsyncIterator[bytes]:
        while True:
            made[0] += 1
            yield frame("B", b"x" * 65536)

    world.engines.answer = flood
    with serving(world) as (port, _), socket.create_connection(("127.0.0.1", port), 5) as wire:
        sent = head(port, "POST", "/api/simulate", "Content-Length: 15").replace(b"octet-stream", b"json")
        wire.sendall(sent + b'{"scenario":{}}')
        last = -1
        while made[0] != last or not last:
            last = made[0]
            time.sleep(0.1)
        assert made[0] * 65536 < 64 * MIB
        alive(port)


def test_jobs_are_cancelled_by_number() -> None:
    world = World()
    assert run(world.ask("POST", "/api/cancel", own(json_=True), b'{"job": 7}')).status == 200
    assert world.engines.cancelled == [7]
    assert run(world.ask("POST", "/api/cancel", own(json_=True), b'{"job": "s1"}')).status == 200
    assert world.studies.begun == [("cancel", "s1")]
    for body in (b'{"job": true}', b"{}", b'{"job": 1.5}'):
        assert run(world.ask("POST", "/api/cancel", own(json_=True), body)).status == 400
    assert world.engines.cancelled == [7]


def test_a_client_that_leaves_in_the_middle_of_its_body_is_forgotten() -> None:
    world = World()

    async def gone() -> Any:
        return {"type": "http.disconnect"}

    with pytest.raises(ClientDisconnect):
        run(world.app._body(gone))
    assert guard.DRAIN_SECONDS <= 1.0
