"""Listening: sockets of this machine only, and the bytes of a request's head before anything reads them.

The head of every request is held back until it is whole and then looked at as bytes. h11 accepts some things
that proxies and browsers never send and attackers do (lines that end in LF alone, a length beside chunks,
HTTP/1.0); here they are refused, and so is what takes its time. A connection carries one request.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import re
import socket
import sys
from collections import Counter
from collections.abc import Iterator
from typing import Any, Final, cast

import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol

from lampyris.app.guard import JSON, MAX_HEAD, MAX_HEADERS, MAX_URL, App, error_body, safe
from lampyris.errors import UsageError

HEAD_SECONDS: Final = 10.0
CONNECTIONS: Final = 32
BACKLOG: Final = 256
"""Connections the system holds for us; beyond them a sound client waits a second for its next try."""
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


class BadHead(Exception):
    """A head that is refused."""

    def __init__(self, status: int, code: str, what: str) -> None:
        super().__init__(status, code)
        self.status, self.code, self.what = status, code, what


def check_head(head: bytes) -> None:
    """Look at the head of a request, without the empty line that ends it.

    Raises
    ------
    BadHead : 400, 414 or 431.
    """
    lines = head.split(b"\r\n")
    if len(lines[0]) > MAX_URL + 32:
        raise BadHead(414, "URL", "the address is too long")
    if len(lines) - 1 > MAX_HEADERS:
        raise BadHead(431, "HEADERS", "too many headers")
    if not _REQUEST_LINE.fullmatch(lines[0]):
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


def plain_answer(no: BadHead) -> bytes:
    """A whole answer, for those whose request is never read."""
    body = error_body({"code": no.code, "what": no.what, "where": "", "allowed": "", "todo": ""})
    own = [(b"content-type", JSON.encode()), (b"content-length", str(len(body)).encode())]
    lines = [b"HTTP/1.1 %d Refused" % no.status, *(k + b": " + v for k, v in safe(own)), b"", body]
    return b"\r\n".join(lines)


class OneRequest(H11Protocol):
    """A connection: its head within ten seconds and 16 KiB, one request, one answer that is taken."""

    head_seconds: float = HEAD_SECONDS
    """How long a head may take."""
    stall_seconds: float = STALL_SECONDS
    """How long an answer may wait for its reader."""

    _made = 0

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin; where there are too many, the one that has waited longest for a head goes."""
        super().connection_made(transport)
        OneRequest._made += 1
        self.order = OneRequest._made
        self._held: bytearray | None = bytearray()
        self._deaf = False
        self._untaken: int | None = None
        self._stalled = self.loop.call_later(self.stall_seconds, self._look)
        self._late = self.loop.call_later(self.head_seconds, self.refuse, BadHead(408, "SLOW", "no request"))
        if len(self.connections) > CONNECTIONS:
            # Browsers open connections ahead of need, and those of a stranger who says nothing are not worth
            # more than the user's next click.
            idle = [c for c in self.connections if isinstance(c, OneRequest) and c.waits and c is not self]
            oldest = min(idle, key=lambda c: c.order, default=self)
            oldest.refuse(BadHead(503, "CONNECTIONS", "too many connections"))

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
            try:
                check_head(bytes(self._held[:end]))
            except BadHead as no:
                self.refuse(no)
                return
            self._late.cancel()
            whole, self._held = bytes(self._held), None
            super().data_received(whole)

    def connection_lost(self, exc: Exception | None) -> None:
        """End."""
        self._late.cancel()
        self._stalled.cancel()
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

    def refuse(self, no: BadHead) -> None:
        """Say no in plain bytes, unless an answer has begun, and close."""
        self._late.cancel()
        silent = self._held is not None and not self._held
        self._held, self._deaf = None, True
        self.connections.discard(self)
        if self.cycle is not None:
            # Whoever is answering is told that nobody listens.
            silent = self.cycle.response_started
            self.cycle.disconnected = True
            self.cycle.message_event.set()
        if silent:
            # A browser's connection ahead of need, which would be puzzled by an answer.
            self.transport.close()
            return
        log.warning("%s %s", no.status, no.what)
        self.transport.write(plain_answer(no))
        # Closing at once, with bytes of the client unread, would take the answer back.
        if self.transport.can_write_eof():
            self.transport.write_eof()
        self.loop.call_later(LINGER_SECONDS, self.transport.close)


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
    """uvicorn with our protocol and nothing it might add of its own."""
    config = uvicorn.Config(
        cast(Any, app),
        http=OneRequest,
        ws="none",
        loop="asyncio",
        lifespan="off",
        log_config=None,
        access_log=False,
        proxy_headers=False,
        server_header=False,
        date_header=False,
        h11_max_incomplete_event_size=MAX_HEAD + 1024,
        backlog=BACKLOG,
        timeout_graceful_shutdown=1,
    )
    return Server(config)
