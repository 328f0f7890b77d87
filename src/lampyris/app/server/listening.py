"""Listening: sockets of this machine only, and the bytes of a request's head before anything reads them.

The head of every request is held back until it is whole and then looked at as bytes. h11 accepts some things
that proxies and browsers never send and attackers do (lines that end in LF alone, a length beside chunks,
HTTP/1.0); here they are refused, and so is what takes its time. A connection carries one request.

The guard judges the head as well, before anything is allocated for the request: one without the token is
answered and closed here, its body unread. Connections are counted by what they may do (:data:`HEADS`,
:data:`CONNECTIONS`, :data:`OPEN`, :data:`LINGERING`), so that no number of requests without the token takes
the place of one that has it.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import re
import socket
import sys
from collections import Counter, deque
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, Final, cast

import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol

from lampyris.app.server.guard import (
    JSON,
    MAX_HEAD,
    MAX_HEADERS,
    MAX_URL,
    App,
    Guard,
    Headers,
    Refused,
    error_body,
    safe,
)
from lampyris.errors import UsageError

HEAD_SECONDS: Final = 10.0
HEADS: Final = 256
"""Connections that may wait for the rest of their head; beyond them the one that waits longest is closed.
Several times what is accepted in one turn of the loop, so that a burst closes none that has just come."""
CONNECTIONS: Final = 32
"""Requests with the token that are answered at a time."""
OPEN: Final = 64
"""Requests without the token for what needs none (files of the page) that are answered at a time; beyond them
the oldest is broken off. Such an answer takes a millisecond, unless nobody reads it."""
LINGERING: Final = 64
"""Refused connections that are kept for :data:`LINGER_SECONDS`; beyond them the oldest is closed at once."""
BACKLOG: Final = 256
"""Connections the system holds for us; beyond them a sound client waits a second for its next try."""
ACCEPTED: Final = 64
"""Connections that are accepted in one turn of the loop, before those that are there are read."""
LINGER_SECONDS: Final = 0.2
STALL_SECONDS: Final = 30.0
LEAST_TAKEN: Final = 64 * 1024
"""Bytes of a waiting answer that must be taken in so many seconds. Who reads nothing, or a byte now and then,
would hold an engine or a connection for ever."""

_REQUEST_LINE: Final = re.compile(rb"([A-Z]{1,16}) (/[\x21-\x7e]*) HTTP/1\.1")
_HEADER: Final = re.compile(rb"([!#$%&'*+.^_`|~0-9A-Za-z-]++):([^\x00-\x08\x0a-\x1f\x7f]*+)")
# Blanks are stripped from values afterwards: here they are a way to ask 16 KiB 100 million questions.
_ONCE: Final = (b"host", b"origin", b"content-length", b"transfer-encoding", b"content-type")

log = logging.getLogger("lampyris.app")


class BadHead(Refused):
    """A head that is no head of HTTP/1.1, or takes too long, or comes when there are too many."""


Door = Callable[[str, bytes, Headers], bool]
"""Judges method, target and headers: whether they bear the token. Raises :class:`Refused`."""


def check_head(head: bytes) -> tuple[str, bytes, list[tuple[bytes, bytes]]]:
    """Look at the head of a request, without the empty line that ends it.

    Returns
    -------
    Method, target and headers, their names in small letters.

    Raises
    ------
    BadHead : 400, 414 or 431.
    """
    lines = head.split(b"\r\n")
    if len(lines[0]) > MAX_URL + 32:
        raise BadHead(414, "URL", "the address is too long")
    if len(lines) - 1 > MAX_HEADERS:
        raise BadHead(431, "HEADERS", "too many headers")
    first = _REQUEST_LINE.fullmatch(lines[0])
    if not first:
        raise BadHead(400, "HTTP", "not a request of HTTP/1.1 to this server")
    headers = []
    for line in lines[1:]:
        found = _HEADER.fullmatch(line)
        if not found:
            raise BadHead(400, "HTTP", "a header that is none")
        headers.append((found[1].lower(), found[2].strip(b" \t")))
    many = Counter(name for name, _ in headers)
    if any(many[name] > 1 for name in _ONCE):
        raise BadHead(400, "HTTP", "a header that may be there once is there twice")
    told = dict(headers)
    coded, length = told.get(b"transfer-encoding"), told.get(b"content-length")
    if coded not in (None, b"chunked") or (coded and length is not None):
        raise BadHead(400, "HTTP", "no telling how long the body is")
    if length is not None and not re.fullmatch(rb"[0-9]{1,18}", length):
        raise BadHead(400, "HTTP", "no telling how long the body is")
    return first[1].decode(), first[2], headers


def plain_answer(no: Refused) -> bytes:
    """A whole answer, for those whose request is never read."""
    body = error_body(no.error)
    own = [(b"content-type", JSON.encode()), (b"content-length", str(len(body)).encode())]
    if no.status == 405:
        own.append((b"allow", no.error["allowed"].encode()))
    lines = [b"HTTP/1.1 %d Refused" % no.status, *(k + b": " + v for k, v in safe(own)), b"", body]
    return b"\r\n".join(lines)


class OneRequest(H11Protocol):
    """A connection: its head within ten seconds and 16 KiB, one request, one answer that is taken."""

    head_seconds: float = HEAD_SECONDS
    """How long a head may take."""
    stall_seconds: float = STALL_SECONDS
    """How long an answer may wait for its reader."""

    _made = 0
    _lingering: Final[deque[OneRequest]] = deque()
    """Refused ones that are not closed yet, oldest first."""

    def __init__(self, *given: Any, door: Door | None = None, **named: Any) -> None:
        super().__init__(*given, **named)
        self._door = door
        self._bears: bool | None = None
        """Whether its request has the token; None: its head is not whole, or was refused."""

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin; where there are too many without a head, the one that has waited longest goes."""
        super().connection_made(transport)
        OneRequest._made += 1
        self.order = OneRequest._made
        self._held: bytearray | None = bytearray()
        self._deaf = False
        self._untaken: int | None = None
        self._stalled = self.loop.call_later(self.stall_seconds, self._look)
        self._late = self.loop.call_later(self.head_seconds, self.refuse, BadHead(408, "SLOW", "no request"))
        idle = [one for one in self._others() if one.waits]
        if len(idle) >= HEADS:
            # Browsers open connections ahead of need, and those of a stranger who says nothing are not worth
            # more than the user's next click.
            min(idle, key=lambda one: one.order).refuse(_TOO_MANY)

    def _others(self) -> list[OneRequest]:
        """The other connections of this server that are not refused."""
        return [one for one in self.connections if isinstance(one, OneRequest) and one is not self]

    @property
    def waits(self) -> bool:
        """Whether the head is not whole yet."""
        return self._held is not None

    def data_received(self, data: bytes) -> None:
        """Hold bytes back until the head is whole; then h11 reads it."""
        if self._deaf:
            return
        if self._held is None:
            super().data_received(data)
            return
        self._held += data
        end = self._held.find(b"\r\n\r\n")
        if end > MAX_HEAD or (end < 0 and len(self._held) > MAX_HEAD):
            self.refuse(BadHead(431, "HEADERS", "too many headers, or too long ones"))
        elif end < 0 and b"\n" in self._held.replace(b"\r\n", b""):
            self.refuse(BadHead(400, "HTTP", "a line that ends in LF alone"))
        elif end >= 0:
            self._judge(end)

    def _judge(self, end: int) -> None:
        """The head is whole: have it answered, or refuse it and read no more."""
        assert self._held is not None
        whole = bytes(self._held)
        try:
            method, target, headers = check_head(whole[:end])
        except BadHead as no:
            self.refuse(no)
            return
        try:
            bears = self._door is None or self._door(method, target, headers)
        except Refused as no:
            sized = dict(headers)
            self.refuse(no, body=sized.get(b"content-length", b"0") != b"0" or b"transfer-encoding" in sized)
            return
        alike = [one for one in self._others() if one._bears is bears]
        if len(alike) >= (CONNECTIONS if bears else OPEN):
            if bears:
                self.refuse(_TOO_MANY)
                return
            min(alike, key=lambda one: one.order).transport.abort()
        self._bears = bears
        self._late.cancel()
        self._held = None
        super().data_received(whole)

    def connection_lost(self, exc: Exception | None) -> None:
        """End."""
        self._late.cancel()
        self._stalled.cancel()
        with contextlib.suppress(ValueError):
            self._lingering.remove(self)
        super().connection_lost(exc)

    def resume_writing(self) -> None:
        """Go on: enough was taken."""
        self._untaken = None
        super().resume_writing()

    def _look(self) -> None:
        """Look whether the reader takes what waits for it; nothing is added to that meanwhile."""
        left = self.transport.get_write_buffer_size()
        if left:
            left += _unacknowledged(self.transport.get_extra_info("socket"))
        if not left or not (self.flow.write_paused or self.transport.is_closing()):
            self._untaken = None
        elif self._untaken is not None and self._untaken - left < LEAST_TAKEN:
            log.warning("408 an answer that nobody reads")
            self.transport.abort()
            return
        else:
            self._untaken = left
        self._stalled = self.loop.call_later(self.stall_seconds, self._look)

    def send_400_response(self, msg: str) -> None:
        """What h11 cannot read (a bad chunk, say)."""
        self.refuse(BadHead(400, "HTTP", "not a request of HTTP/1.1"))

    def refuse(self, no: Refused, *, body: bool = True) -> None:
        """Say no in plain bytes, unless an answer has begun, and close.

        Parameters
        ----------
        body : whether the client may still be sending. Then it is closed a moment later, for closing at once,
            with bytes of the client unread, would take the answer back.
        """
        self._late.cancel()
        silent = self._held is not None and not self._held
        self._held, self._deaf, self._bears = None, True, None
        self.connections.discard(self)
        if self.cycle is not None:
            # Anyone who is answering is told that nobody listens.
            silent = self.cycle.response_started
            self.cycle.disconnected = True
            self.cycle.message_event.set()
        if silent:
            # A browser's connection ahead of need, which would be puzzled by an answer.
            self.transport.close()
            return
        if isinstance(no, BadHead):  # others were written down by the guard
            log.warning("%s %s", no.status, no.error["what"])
        self.transport.write(plain_answer(no))
        if not body:
            self.transport.close()
            return
        if self.transport.can_write_eof():
            self.transport.write_eof()
        self._lingering.append(self)
        if len(self._lingering) > LINGERING:
            self._lingering.popleft().transport.abort()
        self.loop.call_later(LINGER_SECONDS, self.transport.close)


_TOO_MANY: Final = BadHead(503, "CONNECTIONS", "too many connections")


def _unacknowledged(wire: Any) -> int:
    """Bytes that the system has not handed over yet, where it tells: it asks for more only when a third of
    its megabytes has been taken, and who reads slowly would look like one who does not read.
    """
    try:
        import fcntl
        import termios

        told = fcntl.ioctl(wire.fileno(), termios.TIOCOUTQ, bytes(4))
        return int.from_bytes(told, sys.byteorder)
    except (ImportError, OSError, AttributeError):
        return 0


class Server(uvicorn.Server):
    """uvicorn that leaves signals to us: its own way raises them again before engines have been ended."""

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Begin to accept. For asyncio what the system holds and what it accepts at once are one number."""
        await super().startup(sockets=sockets)
        for each in sockets or ():
            each.listen(BACKLOG)

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Capture none."""
        yield


def open_sockets(port: int, remote: bool = False) -> list[socket.socket]:
    """Sockets that listen: loopback alone, IPv6's too where the machine has it; ``remote``: every address.

    Parameters
    ----------
    port : 0: a free one.

    Raises
    ------
    UsageError : the port is taken, or not for us.
    """
    first = _listen(socket.AF_INET, "0.0.0.0" if remote else "127.0.0.1", port)
    try:
        second = _listen(socket.AF_INET6, "::" if remote else "::1", first.getsockname()[1])
    except (UsageError, OSError):
        # No IPv6, or somebody else has its port: then there is 127.0.0.1, which is what is printed.
        return [first]
    return [first, second]


def _listen(family: socket.AddressFamily, host: str, port: int) -> socket.socket:
    made = socket.socket(family, socket.SOCK_STREAM)
    try:
        if os.name == "posix":
            # The port of the server before may be had at once. Elsewhere this would let others share it.
            made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if family == socket.AF_INET6:
            made.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
        made.bind((host, port))
        # Here, because binding alone may succeed beside a server that listens.
        made.listen(BACKLOG)
        made.setblocking(False)
    except OSError as problem:
        made.close()
        raise UsageError(
            "PORT",
            f"port {port}: {problem.strerror or problem}",
            where="--port",
            todo="choose another, or leave --port out",
        ) from None
    return made


def server(app: App) -> Server:
    """uvicorn with our protocol and nothing it might add of its own. A guard judges heads as they come."""
    door = app.at_door if isinstance(app, Guard) else None
    config = uvicorn.Config(
        cast(Any, app),
        http=cast(Any, partial(OneRequest, door=door)),
        ws="none",
        loop="asyncio",
        lifespan="off",
        log_config=None,
        access_log=False,
        proxy_headers=False,
        server_header=False,
        date_header=False,
        h11_max_incomplete_event_size=MAX_HEAD + 1024,
        backlog=ACCEPTED,
        timeout_graceful_shutdown=1,
    )
    return Server(config)
