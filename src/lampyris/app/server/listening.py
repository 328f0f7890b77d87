"""Listening: sockets of this machine only, and uvicorn's server with two limits of time that it has not."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import Iterator
from typing import Final

import uvicorn
from starlette.types import ASGIApp
from uvicorn.protocols.http.h11_impl import H11Protocol

from lampyris._core.system import reuses_ports
from lampyris.errors import UsageError

HEAD_SECONDS: Final = 10.0
MAX_HEAD: Final = 16 * 1024
BACKLOG: Final = 256
"""Connections the system holds for us; beyond them a sound client waits a second for its next try."""
STALL_SECONDS: Final = 30.0
SEND_BUFFER: Final = 256 * 1024
"""Bytes of an answer that the system holds. A third of what Linux makes of it must be taken in
:data:`STALL_SECONDS`, to distinguish a slow reader from one that does not read."""


class Protocol(H11Protocol):
    """A connection that must send a head in time, and take its answer.

    uvicorn's own limit on waiting begins when the first answer is over; and who reads nothing, or a byte now and
    then, would hold an engine forever.
    """

    head_seconds: float = HEAD_SECONDS
    stall_seconds: float = STALL_SECONDS

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin."""
        super().connection_made(transport)
        self._late = self.loop.call_later(self.head_seconds, self._give_up)
        self._stalled: asyncio.TimerHandle | None = None

    def _give_up(self) -> None:
        if not self.cycle:
            self.transport.close()

    def pause_writing(self) -> None:
        """Wait for the reader, but not forever."""
        super().pause_writing()
        self._stalled = self.loop.call_later(self.stall_seconds, self.transport.abort)

    def resume_writing(self) -> None:
        """Go on: enough was taken."""
        if self._stalled is not None:
            self._stalled.cancel()
        super().resume_writing()

    def connection_lost(self, exc: Exception | None) -> None:
        """End."""
        self._late.cancel()
        if self._stalled is not None:
            self._stalled.cancel()
        super().connection_lost(exc)


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
        # No IPv6, or another program has its port: then there is 127.0.0.1, which is what is printed.
        return [first]
    return [first, second]


def _listen(family: socket.AddressFamily, host: str, port: int) -> socket.socket:
    made = socket.socket(family, socket.SOCK_STREAM)
    try:
        if reuses_ports():
            # The port of the server before may be had at once. Elsewhere this would let others share it.
            made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if family == socket.AF_INET6:
            made.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
        made.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
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


def server(app: ASGIApp) -> Server:
    """uvicorn with our protocol and nothing it might add of its own."""
    config = uvicorn.Config(
        app,
        http=Protocol,
        ws="none",
        loop="asyncio",
        lifespan="off",
        log_config=None,
        access_log=False,
        proxy_headers=False,
        server_header=False,
        date_header=False,
        h11_max_incomplete_event_size=MAX_HEAD,
        backlog=BACKLOG,
        timeout_graceful_shutdown=1,
    )
    return Server(config)
