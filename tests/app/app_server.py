"""For tests of the server: what stands in for engines and library, and ways in with and without sockets."""

from __future__ import annotations

import asyncio
import contextlib
import http.client
import json
import re
import socket
import threading
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

from starlette.routing import Mount, Route

from lampyris.app.engine.frames import frame, json_frame
from lampyris.app.server import listening
from lampyris.app.server.guard import CSP, NO_DOCUMENT, OPENER, SAFE, door
from lampyris.app.server.request_parsing import BYTES, JSON
from lampyris.app.server.server import Desk, Services, application
from lampyris.errors import FileError, UsageError

TOKEN = "5ec7e7" * 10 + "abcd"
PORT = 8123
HOST = f"127.0.0.1:{PORT}"


class Engines:
    """Engines that write down what they are asked."""

    def __init__(self) -> None:
        self.asked: list[dict[str, Any]] = []
        self.cancelled: list[int] = []
        self.closed = 0
        self.answer: Callable[[dict[str, Any]], AsyncIterator[bytes]] = self.usual

    async def ask(self, question: dict[str, Any]) -> AsyncIterator[bytes]:
        self.asked.append(question)
        try:
            async with contextlib.aclosing(self.answer(question)) as pieces:  # type: ignore[type-var]
                async for piece in pieces:
                    yield piece
        finally:
            self.closed += 1

    async def usual(self, question: dict[str, Any]) -> AsyncIterator[bytes]:
        yield json_frame("H", {"verb": question["verb"]})
        yield frame("B", b"file")
        yield json_frame("Z", {"outcome": "arrived"})

    async def cancel(self, job: int) -> None:
        self.cancelled.append(job)


class Library:
    """A library of one map."""

    def __init__(self) -> None:
        self.changes: list[Any] = []

    def listing(self) -> Any:
        return [{"id": "guide"}]

    def _known(self, id: str) -> None:
        if id != "guide":
            raise UsageError("MAP", "no such map")

    def ground(self, id: str) -> bytes:
        self._known(id)
        return b"ground"

    def thumb(self, id: str) -> bytes:
        self._known(id)
        return b"\x89PNG"

    def add(self, files: bytes) -> dict[str, Any]:
        if not files:
            raise FileError("MAP_EMPTY", "no file")
        self.changes.append(("add", len(files)))
        return {"id": "new"}

    def delete(self, id: str) -> None:
        self._known(id)
        self.changes.append(("delete", id))

    def bring_back(self, id: str) -> None:
        self._known(id)
        self.changes.append(("back", id))

    def packed(self, id: str) -> dict[str, Any]:
        self._known(id)
        return {"id": id}


class Studies:
    """Studies that are over before they begin."""

    def __init__(self) -> None:
        self.begun: list[Any] = []

    async def start(self, body: Any) -> str:
        self.begun.append(body)
        return "job1"

    def progress(self, job: str) -> dict[str, Any]:
        return {"job": job, "done": 1, "of": 1}

    async def cancel(self, job: str) -> None:
        self.begun.append(("cancel", job))

    def report(self, job: str) -> bytes:
        if job != "job1":
            raise UsageError("JOB", "no such study")
        return b"<!doctype html><p>report"


@dataclass
class Told:
    """An answer."""

    status: int
    headers: list[tuple[bytes, bytes]]
    body: bytes

    def header(self, name: str) -> str:
        found = [v for k, v in self.headers if k == name.encode()]
        assert len(found) == 1, (name, self.headers)
        return found[0].decode()

    def error(self) -> dict[str, Any]:
        error: dict[str, Any] = json.loads(self.body)["error"]
        return error


@dataclass
class World:
    """A server without sockets, and everything behind it."""

    engines: Engines = field(default_factory=Engines)
    library: Library = field(default_factory=Library)
    studies: Studies = field(default_factory=Studies)
    reached: int = 0

    def __post_init__(self) -> None:
        hello = {"version": "0", "planners": ["astar"] * 100}
        self.services = Services(self.engines, self.library, lambda: hello, self.studies)
        app = self.app = application(self.services, door(PORT, TOKEN))
        inner = app._app

        async def spy(scope: Any, receive: Any, send: Any) -> None:
            self.reached += 1
            await inner(scope, receive, send)

        app._app = spy

    async def ask(
        self, method: str, path: str, headers: list[tuple[str, str]], body: bytes | list[bytes] = b""
    ) -> Told:
        """One request, as a server would give it to the application."""
        parts = [body] if isinstance(body, bytes) else list(body)
        raw, _, query = path.encode().partition(b"?")
        scope = {
            "type": "http", "method": method, "path": raw.decode(), "raw_path": raw, "query_string": query,
            "headers": [(k.lower().encode(), v.encode("latin-1")) for k, v in headers], "http_version": "1.1",
            "root_path": "", "scheme": "http", "server": ("127.0.0.1", PORT), "client": ("127.0.0.1", 1),
            "asgi": {"version": "3.0", "spec_version": "2.3"},
        }  # fmt: skip
        told: list[Any] = []
        over = asyncio.Event()

        async def receive() -> Any:
            if parts:
                piece = parts.pop(0)
                return {"type": "http.request", "body": piece, "more_body": bool(parts)}
            await over.wait()
            return {"type": "http.disconnect"}

        async def send(message: Any) -> None:
            told.append(message)
            if message["type"] == "http.response.body" and not message.get("more_body", False):
                over.set()

        await self.app(scope, receive, send)
        if not told:
            return Told(0, [], b"")
        return Told(told[0]["status"], told[0]["headers"], b"".join(m.get("body", b"") for m in told[1:]))


def own(*more: tuple[str, str], host: str = HOST, json_: bool = False) -> list[tuple[str, str]]:
    """The headers of our own page."""
    kind = [("Content-Type", "application/json")] if json_ else []
    return [("Host", host), ("X-Lampyris-Token", TOKEN), *kind, *more]


@dataclass(frozen=True)
class Way:
    """A route: its method, and the type of what is sent."""

    path: str
    method: str
    takes: str | None


def _ways() -> Iterator[Way]:
    for route in Desk(World().services).routes():
        if isinstance(route, Mount):
            yield Way(f"{route.path}/{{name}}", "GET", None)
        elif isinstance(route, Route) and route.methods:
            post = "POST" in route.methods
            takes = BYTES if route.path == "/api/maps" else JSON
            yield Way(route.path, "POST" if post else "GET", takes if post else None)


def filled(way: Way) -> str:
    """A path of a way."""
    return (
        way.path.replace("{id}", "guide")
        .replace("{name}", "state.js")
        .replace("{job}", "job1")
        .replace("{ticket}", "none")
    )


WAYS = tuple(_ways())
"""Everything that may be asked."""
PATHS = sorted({filled(way) for way in WAYS})


def run(work: Awaitable[Any]) -> Any:
    """Run to the end."""

    async def whole() -> Any:
        return await work

    return asyncio.run(whole())


def check_safe(told: Told, policy: str = "") -> None:
    """Every answer has the headers of every answer, each once, and nothing that opens it to others."""
    document = told.header("content-type").startswith("text/html")
    policy = policy or (CSP if document else NO_DOCUMENT)
    opener = {"cross-origin-opener-policy": OPENER} if document else {}
    for name, value in {**SAFE, **opener, "content-security-policy": policy}.items():
        found = [v for k, v in told.headers if k.lower() == name.encode()]
        assert found == [value.encode()], (name, told.headers)
    names = {k.lower() for k, _ in told.headers}
    assert not any(name.startswith(b"access-control-") for name in names)
    assert not names & {b"set-cookie", b"server", b"etag", b"last-modified"}


@contextlib.contextmanager
def serving(world: World | None = None, head_seconds: float = 10.0) -> Iterator[tuple[int, World]]:
    """A real server in a thread; its port."""
    world = world or World()
    services = world.services
    sockets = listening.open_sockets(0)
    port = sockets[0].getsockname()[1]
    app = application(services, door(port, TOKEN))
    server = listening.server(app)
    usual = listening.Protocol.head_seconds
    listening.Protocol.head_seconds = head_seconds

    async def served() -> None:
        try:
            await server.serve(sockets=sockets)
        finally:
            # As the program does: an engine belongs to the loop that it was started in.
            await services.close()

    thread = threading.Thread(target=lambda: asyncio.run(served()), daemon=True)
    thread.start()
    while not server.started:
        time.sleep(0.01)
    world.server = server  # type: ignore[attr-defined]
    try:
        yield port, world
    finally:
        server.should_exit = True
        thread.join(10)
        listening.Protocol.head_seconds = usual
        assert not thread.is_alive()


def raw(port: int, data: bytes, *, seconds: float = 5.0) -> bytes:
    """Send bytes; everything that comes back until the other side closes."""
    with socket.create_connection(("127.0.0.1", port), seconds) as wire:
        with contextlib.suppress(BrokenPipeError, ConnectionResetError):
            wire.sendall(data)
        return rest(wire)


def rest(wire: socket.socket) -> bytes:
    """All that still comes."""
    got = b""
    with contextlib.suppress(ConnectionResetError):
        while piece := wire.recv(65536):
            got += piece
    return got


def parsed(got: bytes) -> Told:
    """An answer from its bytes."""
    head, _, body = got.partition(b"\r\n\r\n")
    first, *lines = head.split(b"\r\n")
    headers = [(k.lower(), v.strip()) for k, _, v in (line.partition(b":") for line in lines)]
    return Told(int(first.split()[1]), headers, body)


def answers(got: bytes) -> int:
    """How many answers these bytes hold."""
    return len(re.findall(rb"HTTP/1\.1 [0-9]{3} ", got))


def asks(
    port: int, method: str = "GET", path: str = "/api/maps", body: Any = None, **headers: str
) -> tuple[int, bytes]:
    """A sound request of our own page."""
    wire = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
    sent = {"X-Lampyris-Token": TOKEN, **headers}
    data = None
    if body is not None:
        data = body if isinstance(body, bytes) else json.dumps(body).encode()
        sent.setdefault("Content-Type", "application/json")
    try:
        wire.request(method, path, data, sent)
        answer = wire.getresponse()
        return answer.status, answer.read()
    finally:
        wire.close()


def head(port: int, method: str = "POST", path: str = "/api/maps", *more: str) -> bytes:
    """A head of our own page, with the lines given."""
    kind = ["Content-Type: application/octet-stream"] if method == "POST" else []
    lines = [
        f"{method} {path} HTTP/1.1",
        f"Host: 127.0.0.1:{port}",
        f"X-Lampyris-Token: {TOKEN}",
        *kind,
        *more,
    ]
    return "\r\n".join([*lines, "", ""]).encode("latin-1")


def alive(port: int) -> None:
    """The server answers a sound request."""
    assert asks(port)[0] == 200
