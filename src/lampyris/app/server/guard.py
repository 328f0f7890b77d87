"""The guard: who may ask, before anything is routed.

A web page in the same browser can send requests to this machine, and through a name of its own that points
here (DNS rebinding) it can even read the answers. So the Host must be one of a few exact words, the Origin
must be that of the same Host, and everything but the page itself needs a token that only the page knows.
Rejected: comparing Origin with Host alone, as DNS rebinding controls both; Starlette's TrustedHostMiddleware,
which leaves out the port and knows no IPv6 address.

Order of refusal: 421 Host, 403 Origin or Sec-Fetch-Site, 401 token, 413/408 body; then what Starlette and the
routes refuse. No cookie, no CORS header, no WebSocket.
"""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import json
import logging
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import ClientDisconnect
from starlette.responses import JSONResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

MAX_BODY: Final = 16 * 2**20
BODY_SECONDS: Final = 30.0
LARGE: Final = 2**20
LARGE_AT_ONCE: Final = 2
"""Bodies of more than so many bytes that are held at a time, each until its answer begins; others wait."""
DRAIN_SECONDS: Final = 1.0
MAX_DRAIN: Final = 64 * 2**20
"""What is still read of a refused body: who is cut off in the middle never sees the answer."""

TOKEN: Final = "x-lampyris-token"
OPEN: Final = ("/static/", "/view/")
"""Beside the page itself, what is answered without a token."""

CSP: Final = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self';"
    " base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
NO_DOCUMENT: Final = "default-src 'none'; frame-ancestors 'none'"
"""Of what is no document: what applies to a part of a page is the page's. Shorter, sixty times over."""
SAFE: Final[Mapping[str, str]] = {
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-resource-policy": "same-origin",
    "cache-control": "no-store",
    "connection": "close",
}
"""Headers of every answer, beside a content-security-policy of its own."""
OPENER: Final = "same-origin"
"""The cross-origin-opener-policy of a document; browsers read it of nothing else."""
USELESS: Final = ("etag", "last-modified", "vary", "accept-ranges")
"""Headers that Starlette adds for caches and for parts of files; nothing is kept in a cache, and files are small."""

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


class Json(JSONResponse):
    """Plain data as an answer, in ASCII: a name of a file need not be UTF-8."""

    def render(self, content: Any) -> bytes:
        """JSON in one line."""
        return json.dumps(content, allow_nan=False, separators=(",", ":")).encode()


class Refused(Exception):
    """An answer that is no."""

    def __init__(
        self, status: int, code: str, what: str, allowed: str = "", todo: str = "", where: str = ""
    ) -> None:
        super().__init__(status, code)
        self.status = status
        self.error = {"code": code, "what": what, "where": where, "allowed": allowed, "todo": todo}

    def response(self) -> Response:
        """The answer."""
        return Json({"error": self.error}, self.status)


class Guard:
    """ASGI middleware around everything: see the module.

    Parameters
    ----------
    app : what answers those that may ask.
    door : who may ask.
    seconds : how long a body may take to arrive.
    """

    def __init__(self, app: ASGIApp, door: Door, seconds: float = BODY_SECONDS) -> None:
        self._app, self._door, self._seconds = app, door, seconds
        self._large = asyncio.Semaphore(LARGE_AT_ONCE)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "websocket":
            # There are none; older versions of Starlette would take this for a fault of their own.
            await send({"type": "websocket.close", "code": 1000, "reason": ""})
            return
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        status, began = 0, time.perf_counter()
        turn = contextlib.ExitStack()

        async def reply(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                turn.close()
                status = message["status"]
                headers = MutableHeaders(scope=message)
                headers.update(SAFE)
                document = headers.get("content-type", "").startswith("text/html")
                headers.setdefault("content-security-policy", CSP if document else NO_DOCUMENT)
                if document:
                    headers["cross-origin-opener-policy"] = OPENER
                for name in USELESS:
                    del headers[name]
            await send(message)

        try:
            self.check(scope)
            if _is_large(Headers(scope=scope)):
                await self._large.acquire()
                turn.callback(self._large.release)
            await self._app(scope, await self._body(receive), reply)
        except Refused as no:
            if no.status == 413:
                await _drain(receive)
            await no.response()(scope, receive, reply)
        except ClientDisconnect:
            return
        except Exception as fault:
            # Starlette has sent its plain 500 response; the message may contain paths or values, so it goes to
            # the log only.
            log.error(
                "a fault of lampyris: %s", type(fault).__name__, exc_info=log.isEnabledFor(logging.DEBUG)
            )
        finally:
            turn.close()
            self._tell(scope, status, time.perf_counter() - began)

    def check(self, scope: Scope) -> None:
        """Whether a request may be answered, by its head alone.

        Raises
        ------
        Refused : it may not.
        """
        path, headers = scope["path"], Headers(scope=scope)
        hosts, origins = headers.getlist("host"), headers.getlist("origin")
        if len(hosts) != 1 or hosts[0] not in self._door.hosts:
            raise Refused(421, "HOST", "not a name of this server", "the address it printed when it started")
        sites = headers.getlist("sec-fetch-site")
        # A browser may be sent to the page by a link elsewhere: it says nothing secret, the token is in the
        # fragment of the link, and no other page can look into it.
        follows = (headers.get("sec-fetch-mode"), headers.get("sec-fetch-dest")) == ("navigate", "document")
        own = sites in ([], ["same-origin"], ["none"]) or (path == "/" and follows and len(sites) == 1)
        if origins not in ([], [f"http://{hosts[0]}"]) or not own:
            raise Refused(403, "ORIGIN", "asked by a page that is not of this server")
        tokens = [token.encode("latin-1") for token in headers.getlist(TOKEN)]
        known = len(tokens) == 1 and hmac.compare_digest(tokens[0], self._door.token.encode())
        if not (known or path == "/" or path.startswith(OPEN)):
            raise Refused(
                401, "TOKEN", "this needs the token of the session", todo="open the address it printed"
            )
        if int(headers.get("content-length", "0")) > MAX_BODY:
            raise _too_large()

    async def _body(self, receive: Receive) -> Receive:
        """What gives the whole body in one message, and after it whatever comes (the client leaves)."""
        gathered = bytearray()
        try:
            async with asyncio.timeout(self._seconds):
                more = True
                while more:
                    message = await receive()
                    if message["type"] != "http.request":
                        raise ClientDisconnect
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
        text = ascii(scope["path"].replace(self._door.token, "***")[:200])[1:-1]
        method = ascii(scope["method"][:16])[1:-1]
        level = logging.INFO if status < 400 else logging.WARNING
        log.log(level, "%s %s %s %.0f ms", method, text, status or "left", 1e3 * seconds)


async def _drain(receive: Receive) -> None:
    """Read on for a moment."""
    drained, more = 0, True
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(DRAIN_SECONDS):
            while more and drained < MAX_DRAIN:
                message = await receive()
                drained += len(message.get("body", b""))
                more = message.get("more_body", False)


def _is_large(headers: Headers) -> bool:
    """Whether a body may be large: by its length, or because nobody says how long it is."""
    return int(headers.get("content-length", "0")) > LARGE or "transfer-encoding" in headers


def _too_large() -> Refused:
    return Refused(413, "BODY_SIZE", "more than is taken at once", f"at most {MAX_BODY:,} bytes")
