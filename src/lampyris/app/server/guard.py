"""The guard: who may ask, before anything is routed. Everything is refused that is not on a list.

A web page in the same browser can send requests to this machine, and through a name of its own that points
here (DNS rebinding) it can even read the answers. So the Host must be one of a few exact words, the Origin
must be that of the same Host, and everything but the page itself needs a token that only the page knows.
Rejected: comparing Origin with Host alone, as DNS rebinding controls both.

Order of refusal: 431/414 too long, 421 Host, 403 Origin or Sec-Fetch-Site, 400 upgrade, 401 token, 404 no
such path, 405 method, 400 query, 415 type, 413/408 body. No cookie, no CORS header, no WebSocket.
"""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import json
import logging
import re
import time
from collections.abc import Awaitable, Callable, Iterable, Mapping, MutableMapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

Scope = MutableMapping[str, Any]
Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]
Headers = Sequence[tuple[bytes, bytes]]

MAX_HEADERS: Final = 100
MAX_HEAD: Final = 16 * 1024
MAX_URL: Final = 2 * 1024
MAX_BODY: Final = 16 * 2**20
BODY_SECONDS: Final = 30.0
LARGE: Final = 2**20
LARGE_AT_ONCE: Final = 2
"""Bodies of more than so many bytes that are held at a time, each until its answer begins; others wait."""
DRAIN_SECONDS: Final = 1.0
MAX_DRAIN: Final = 64 * 2**20
"""What is still read of a refused body: who is cut off in the middle never sees the answer."""

TOKEN: Final = b"x-lampyris-token"
JSON: Final = "application/json"
BYTES: Final = "application/octet-stream"

CSP: Final = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self';"
    " base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
SAFE: Final[Mapping[bytes, bytes]] = {
    b"content-security-policy": CSP.encode(),
    b"x-content-type-options": b"nosniff",
    b"referrer-policy": b"no-referrer",
    b"cross-origin-opener-policy": b"same-origin",
    b"cross-origin-resource-policy": b"same-origin",
    b"cache-control": b"no-store",
    # A connection carries one request: there is no second one for a smuggler to hide in the first.
    b"connection": b"close",
}
"""Headers of every answer. A route may tell its own content-security-policy, and nothing else."""

_OWN_SITE: Final = (b"same-origin", b"none")
_ARRIVES: Final = ([b"navigate"], [b"document"])
_PLAIN_PATH: Final = re.compile(r"(/[A-Za-z0-9._-]{0,128})+", re.ASCII)

log = logging.getLogger("lampyris.app")


@dataclass(frozen=True, slots=True)
class Door:
    """Who may come in.

    Parameters
    ----------
    hosts : the exact words that Host may be, with the port.
    token : what the page sends along.
    """

    hosts: frozenset[str]
    token: str = field(repr=False)


def door(port: int, token: str, hostname: str | None = None) -> Door:
    """The door of a server on this port, under this machine's own names; ``hostname``: under that one too."""
    names = ["127.0.0.1", "localhost", "[::1]", *([hostname] if hostname else [])]
    hosts = {f"{name}:{port}" for name in names}
    # Browsers leave the port out when it is http's own.
    return Door(frozenset(hosts | set(names) if port == 80 else hosts), token)


@dataclass(frozen=True, slots=True)
class Route:
    """A path that is served, and how it may be asked.

    Parameters
    ----------
    path : with ``{name}`` for one segment.
    method : the only one it has.
    takes : content type of what is sent; None: nothing is.
    open : whether it is answered without a token.
    entrance : whether a browser may be sent here by a link elsewhere. The page alone: it says nothing secret,
        the token is in the fragment of the link, and no other page can look into it.
    """

    path: str
    method: str = "GET"
    takes: str | None = None
    open: bool = False
    entrance: bool = False

    def leads(self, segments: Sequence[str]) -> bool:
        """Whether these are the segments of a path of this way."""
        own = self.path.split("/")
        return len(own) == len(segments) and all(
            a == b or (a.startswith("{") and b != "") for a, b in zip(own, segments, strict=True)
        )


class Refused(Exception):
    """An answer that is no."""

    def __init__(
        self, status: int, code: str, what: str, allowed: str = "", todo: str = "", where: str = ""
    ) -> None:
        super().__init__(status, code)
        self.status = status
        self.error = {"code": code, "what": what, "where": where, "allowed": allowed, "todo": todo}


class Left(Exception):
    """The client is gone: nobody reads an answer."""


class Guard:
    """ASGI middleware around everything: see the module.

    Parameters
    ----------
    app : what answers those that may ask.
    door : who may ask.
    ways : what may be asked; anything else is refused before ``app`` hears of it.
    seconds : how long a body may take to arrive.
    """

    def __init__(self, app: App, door: Door, ways: Iterable[Route], seconds: float = BODY_SECONDS) -> None:
        self._app, self._door, self._ways, self._seconds = app, door, tuple(ways), seconds
        self._hosts = frozenset(host.encode("ascii") for host in door.hosts)
        self._token = door.token.encode("ascii")
        self._large = asyncio.Semaphore(LARGE_AT_ONCE)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        if scope["type"] != "http":
            await send({"type": "websocket.close", "code": 1008})
            return
        reply = Reply(send)
        began = time.perf_counter()
        try:
            self.check(scope)
            if _is_large(scope["headers"]):
                await self._large.acquire()
                reply.at_first = self._large.release
            await self._app(scope, await self._body(scope, receive), reply)
        except Refused as no:
            await reply.refuse(no, receive)
        except Left:
            return
        except Exception as fault:
            # What it says may hold a path or a value: that is for the log, not for the client.
            log.error(
                "a fault of lampyris: %s", type(fault).__name__, exc_info=log.isEnabledFor(logging.DEBUG)
            )
            await reply.refuse(
                Refused(500, "INTERNAL", "a fault of lampyris", todo="please report it"), receive
            )
        finally:
            reply.begin()
            self._tell(scope, reply.status, time.perf_counter() - began)

    def at_door(self, method: str, target: bytes, headers: Headers) -> bool:
        """Whether a request bears the token, by its head alone. One that does not, and may not be answered
        without, is refused here: before its body is read, and before it takes the place of another.

        Parameters
        ----------
        target : path and query as they were sent.
        headers : their names in small letters.

        Raises
        ------
        Refused : it may not be answered, and does not bear the token.
        """
        path, _, query = target.partition(b"?")
        scope = {"method": method, "path": "", "raw_path": path, "query_string": query, "headers": headers}
        bears = self._bears(headers)
        try:
            self.check(scope)
        except Refused as no:
            if not bears:
                self._tell(scope, no.status, 0.0)
                raise
        return bears

    def check(self, scope: Scope) -> Route:
        """The way a request takes, by its head alone.

        Raises
        ------
        Refused : it may not.
        """
        headers: Headers = scope["headers"]
        path = scope.get("raw_path") or scope["path"].encode("utf-8", "surrogatepass")
        self._size(headers, path, scope.get("query_string", b""))
        way, others = self._way(scope["method"], path)
        self._whence(headers, way)
        if not (way and way.open):
            self._known(headers)
        if way is None:
            if others:
                allowed = ", ".join(sorted({other.method for other in others}))
                raise Refused(405, "METHOD", "no such method here", allowed)
            raise Refused(404, "NOT_FOUND", "there is nothing here")
        if scope.get("query_string"):
            raise Refused(400, "QUERY", "a query in the address", "none: everything is in the body")
        self._kind(headers, way)
        return way

    def _size(self, headers: Headers, path: bytes, query: bytes) -> None:
        if len(headers) > MAX_HEADERS or sum(len(k) + len(v) + 4 for k, v in headers) > MAX_HEAD:
            raise Refused(431, "HEADERS", "too many headers, or too long ones")
        if len(path) + len(query) + 1 > MAX_URL:
            raise Refused(414, "URL", "the address is too long", f"at most {MAX_URL} characters")

    def _whence(self, headers: Headers, way: Route | None) -> None:
        hosts = _all(headers, b"host")
        if len(hosts) != 1 or hosts[0] not in self._hosts:
            raise Refused(421, "HOST", "not a name of this server", "the address it printed when it started")
        origins = _all(headers, b"origin")
        if len(origins) > 1 or any(origin != b"http://" + hosts[0] for origin in origins):
            raise Refused(403, "ORIGIN", "asked by a page that is not of this server")
        sites = _all(headers, b"sec-fetch-site")
        arrives = (_all(headers, b"sec-fetch-mode"), _all(headers, b"sec-fetch-dest")) == _ARRIVES
        own = sites[0] in _OWN_SITE if len(sites) == 1 else not sites
        if not own and not (arrives and way and way.entrance and len(sites) == 1):
            raise Refused(403, "ORIGIN", "asked by a page that is not of this server")
        words = b",".join(_all(headers, b"connection")).lower().split(b",")
        if _all(headers, b"upgrade") or b"upgrade" in (word.strip() for word in words):
            raise Refused(400, "UPGRADE", "this server speaks HTTP/1.1 only")

    def _known(self, headers: Headers) -> None:
        if not self._bears(headers):
            raise Refused(
                401, "TOKEN", "this needs the token of the session", todo="open the address it printed"
            )

    def _bears(self, headers: Headers) -> bool:
        tokens = _all(headers, TOKEN)
        return len(tokens) == 1 and hmac.compare_digest(tokens[0], self._token)

    def _way(self, method: str, path: bytes) -> tuple[Route | None, list[Route]]:
        """The way of a request, and all those of its path."""
        # Whatever is escaped, empty, backward or beyond ASCII is no path of ours: nothing is ever unescaped.
        text = path.decode("latin-1")
        if not _PLAIN_PATH.fullmatch(text):
            return None, []
        segments = text.split("/")
        ways = [way for way in self._ways if way.leads(segments)]
        return next((way for way in ways if way.method == method), None), ways

    def _kind(self, headers: Headers, way: Route) -> None:
        if way.takes is None:
            lengths = _all(headers, b"content-length")
            if _all(headers, b"transfer-encoding") or any(length != b"0" for length in lengths):
                raise Refused(400, "BODY", "nothing is to be sent here")
            return
        kinds = _all(headers, b"content-type")
        plain = [kind.decode("latin-1").lower().replace(" ", "") for kind in kinds]
        if plain not in ([way.takes], [way.takes + ";charset=utf-8"]) or _all(headers, b"content-encoding"):
            raise Refused(415, "CONTENT_TYPE", "sent as another type", way.takes)
        for length in _all(headers, b"content-length"):
            if not length.isdigit() or len(length) > 18 or int(length) > MAX_BODY:
                raise _too_large()

    async def _body(self, scope: Scope, receive: Receive) -> Receive:
        """What gives the whole body in one message, and after it whatever comes (the client leaves)."""
        gathered = bytearray()
        try:
            async with asyncio.timeout(self._seconds):
                more = True
                while more:
                    message = await receive()
                    if message["type"] != "http.request":
                        raise Left
                    gathered += message.get("body", b"")
                    if len(gathered) > MAX_BODY:
                        raise _too_large()
                    more = message.get("more_body", False)
        except TimeoutError:
            raise Refused(
                408, "SLOW", "the body did not arrive in time", f"{self._seconds:g} seconds"
            ) from None
        whole: list[Message] = [{"type": "http.request", "body": bytes(gathered), "more_body": False}]

        async def again() -> Message:
            return whole.pop() if whole else await receive()

        return again

    def _tell(self, scope: Scope, status: int, seconds: float) -> None:
        """One line a request: never the query, never the token, nothing a terminal would obey."""
        path = scope.get("raw_path") or scope["path"].encode("utf-8", "surrogatepass")
        text = ascii(path.replace(self._token, b"***")[:200].decode("latin-1"))[1:-1]
        method = ascii(scope["method"][:16])[1:-1]
        level = logging.INFO if status < 400 else logging.WARNING
        log.log(level, "%s %s %s %.0f ms", method, text, status or "left", 1e3 * seconds)


class Reply:
    """``send`` with the headers of every answer."""

    def __init__(self, send: Send) -> None:
        self._send = send
        self._complete = False
        self.status = 0
        self.at_first: Callable[[], None] | None = None

    def begin(self) -> None:
        """Do once what is to be done when the answer begins, or when there is to be none."""
        first, self.at_first = self.at_first, None
        if first is not None:
            first()

    async def __call__(self, message: Message) -> None:
        """Send on."""
        if message["type"] == "http.response.start":
            self.begin()
            self.status = message["status"]
            message = {**message, "headers": safe(message.get("headers", ()))}
        self._complete = message["type"] == "http.response.body" and not message.get("more_body", False)
        await self._send(message)

    async def refuse(self, no: Refused, receive: Receive) -> None:
        """Say no; an answer that has begun is broken off instead."""
        if self.status:
            return
        body = error_body(no.error)
        headers = [(b"content-type", JSON.encode()), (b"content-length", str(len(body)).encode())]
        if no.status == 405:
            headers.append((b"allow", no.error["allowed"].encode()))
        await self({"type": "http.response.start", "status": no.status, "headers": headers})
        await self({"type": "http.response.body", "body": body, "more_body": True})
        drained, more = 0, True
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(DRAIN_SECONDS):
                while more and drained < MAX_DRAIN:
                    message = await receive()
                    drained += len(message.get("body", b""))
                    more = message["type"] == "http.request" and message.get("more_body", False)
        await self({"type": "http.response.body", "body": b"", "more_body": False})


def error_body(error: Mapping[str, Any]) -> bytes:
    """An error as the page reads it."""
    return json.dumps({"error": error}, separators=(",", ":")).encode()


def safe(headers: Iterable[tuple[bytes, bytes]]) -> list[tuple[bytes, bytes]]:
    """Headers with those of every answer; of these, a route's own policy is the one that stays."""
    given = [(name.lower(), value) for name, value in headers]
    policy = dict(given).get(b"content-security-policy", SAFE[b"content-security-policy"])
    kept = [(name, value) for name, value in given if name not in SAFE]
    return [*kept, *{**SAFE, b"content-security-policy": policy}.items()]


def _is_large(headers: Headers) -> bool:
    """Whether a body may be large: by its length, or because nobody says how long it is."""
    lengths = _all(headers, b"content-length")
    return any(int(length) > LARGE for length in lengths) or bool(_all(headers, b"transfer-encoding"))


def _all(headers: Headers, name: bytes) -> list[bytes]:
    return [value for key, value in headers if key.lower() == name]


def _too_large() -> Refused:
    return Refused(413, "BODY_SIZE", "more than is taken at once", f"at most {MAX_BODY:,} bytes")
