"""Requests without the token, by the thousand, keep the page's own requests from nothing (issue 24, C21)."""

from __future__ import annotations

import contextlib
import json
import logging
import multiprocessing
import socket
import time
from collections import deque
from collections.abc import Iterator
from typing import Any

import pytest
from app_server import asks, parsed, raw, rest, serving

from lampyris.app.server.run import _AtMost

HELD = 1500
"""Connections that a flood keeps open at a time."""
MOST = 20_000
"""Requests after which a flood ends by itself."""


def request(port: int, kind: str) -> bytes:
    """What a flood sends on each connection."""
    host = f"Host: 127.0.0.1:{port}\r\n"
    post = f"POST /api/plan HTTP/1.1\r\n{host}Content-Type: application/json\r\n"
    return {
        "without the token": f"GET /api/maps HTTP/1.1\r\n{host}\r\n",
        "a body that never comes": f"{post}Content-Length: 1000\r\n\r\n",
        "chunks that never come": f"{post}Transfer-Encoding: chunked\r\n\r\n",
        "half a head": "GET / HT",
        "files of the page, unread": f"GET /static/uplot.js HTTP/1.1\r\n{host}\r\n",
    }[kind].encode()


def flood(port: int, kind: str, rate: float, stop: Any, sent: Any) -> None:
    """Connect, send, never read, again; at so many a second, or as fast as it goes."""
    held: deque[socket.socket] = deque()
    data = request(port, kind)
    while not stop.is_set() and sent.value < MOST:
        with contextlib.suppress(OSError):
            wire = socket.create_connection(("127.0.0.1", port), 2)
            held.append(wire)
            wire.sendall(data)
            sent.value += 1
        if len(held) > HELD:
            held.popleft().close()
        if rate:
            time.sleep(1 / rate)


@contextlib.contextmanager
def flooded(port: int, kind: str, rate: float = 0.0) -> Iterator[None]:
    """While another process floods the server."""
    # Not a copy of this process, which runs a server: a new one that knows nothing of it.
    own = multiprocessing.get_context("spawn")
    stop, sent = own.Event(), own.Value("i", 0)
    process = own.Process(target=flood, args=(port, kind, rate, stop, sent), daemon=True)
    process.start()
    try:
        # More than were held at a time: what is to be exhausted is.
        while sent.value < 50 and process.is_alive():
            time.sleep(0.02)
        assert process.is_alive()
        yield
        assert process.is_alive()
    finally:
        stop.set()
        process.join(20)
        process.kill()


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("kind", "rate"),
    [
        ("without the token", 0),
        ("chunks that never come", 0),
        pytest.param("a body that never comes", 0, marks=pytest.mark.nightly),
        pytest.param("a body that never comes", 40, marks=pytest.mark.nightly),
        pytest.param("half a head", 0, marks=pytest.mark.nightly),
        pytest.param("files of the page, unread", 0, marks=pytest.mark.nightly),
    ],
)
def test_a_flood_without_the_token_refuses_no_request_of_the_page(kind: str, rate: float) -> None:
    logging.disable(logging.CRITICAL)
    try:
        with serving() as (port, _), flooded(port, kind, rate):
            answered = [asks(port)[0] for _ in range(30)]
    finally:
        logging.disable(logging.NOTSET)
    assert answered == [200] * 30


@pytest.mark.parametrize("declared", ["Content-Length: 1000000", "Transfer-Encoding: chunked"])
def test_without_the_token_no_body_is_waited_for(declared: str) -> None:
    with serving() as (port, world):
        sent = f"POST /api/maps HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n"
        sent += f"Content-Type: application/octet-stream\r\n{declared}\r\n\r\n"
        with socket.create_connection(("127.0.0.1", port), 5) as wire:
            wire.sendall(sent.encode())
            told = parsed(rest(wire))
        assert (told.status, told.error()["code"]) == (401, "TOKEN")
        assert told.error()["todo"]
        assert not world.library.changes


def test_what_is_refused_before_its_body_is_told_as_before() -> None:
    with serving() as (port, _):
        host = f"Host: 127.0.0.1:{port}\r\n"
        for sent, status, code in (
            (f"GET /api/maps HTTP/1.1\r\n{host}\r\n", 401, "TOKEN"),
            ("GET /api/maps HTTP/1.1\r\nHost: evil.example\r\n\r\n", 421, "HOST"),
            (f"GET / HTTP/1.1\r\n{host}Origin: http://evil.example\r\n\r\n", 403, "ORIGIN"),
        ):
            told = parsed(raw(port, sent.encode()))
            assert (told.status, told.error()["code"]) == (status, code)
            assert json.loads(told.body).keys() == {"error"}


def test_the_log_of_a_flood_is_short_and_says_what_it_leaves_out() -> None:
    lines = _AtMost()
    records = [
        logging.LogRecord("lampyris.app", logging.WARNING, "", 0, "%s refused", (k,), None)
        for k in range(2002)
    ]
    for k, record in enumerate(records):
        record.created = 1000.0 if k < 2000 else 1001.0
    written = [record.getMessage() for record in records if lines.filter(record)]
    assert len(written) == _AtMost.LINES + 2
    assert written[_AtMost.LINES :] == ["2000 refused (1,950 lines left out)", "2001 refused"]
