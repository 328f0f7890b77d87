"""Run: the app from its start to Ctrl-C. What it starts it ends; temporary files go with it."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import re
import secrets
import signal
import socket
import sys
import tempfile
import webbrowser
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, Self
from urllib.parse import quote

from lampyris._core import system
from lampyris.app.server import listening
from lampyris.app.server.guard import door
from lampyris.app.server.server import Services, application
from lampyris.errors import UsageError
from lampyris.report.html.render import render

_HOSTNAME = re.compile(r"(?=.{1,253}\Z)[a-z0-9]([a-z0-9-]{0,62})(\.[a-z0-9]([a-z0-9-]{0,62}))*", re.ASCII)

USUAL = 8770
"""A browser keeps what a page stores by its port: another at each start would hide the drafts of the last."""

REMOTE = """\
warning: this listens for other machines, as {name}. Anyone who has the address below can use this machine's time
and memory and read its map library; the connection is not encrypted. Use it in a network you trust."""


def run_app(
    map_: str | None = None,
    *,
    port: int | None = 0,
    folder: Path | None = None,
    browser: bool = True,
    allow_remote: str | None = None,
    services: Callable[[Path], Services] | None = None,
) -> int:
    """Serve the app until it is interrupted. Returns the exit code.

    Parameters
    ----------
    map_ : shown at first: a bundled map or one of the folder; None: what the page had last.
    port : 0: a free one; None: :data:`USUAL`, or a free one if it is taken. The port of a server that has
        just ended may be had at once.
    folder : the user's maps; None: none.
    browser : open one.
    allow_remote : a name of this machine, under which others may reach it.
    services : makes what answers, given a folder for temporary files; None: the library and engines.

    Raises
    ------
    UsageError : PORT, HOSTNAME, FOLDER.
    """
    if allow_remote is not None and not _HOSTNAME.fullmatch(allow_remote):
        raise UsageError(
            "HOSTNAME", f"{allow_remote!r}", where="--allow-remote", allowed="a host's name in small letters"
        )
    if folder is not None and not folder.is_dir():
        raise UsageError("FOLDER", "no such folder", where=str(folder), todo="name a folder of maps")
    system.more_open_files(4096)  # 256 are soon taken by connections that send nothing
    sockets = _sockets(port, allow_remote is not None)
    _log_to_stderr()
    # Whatever is written from here on is the user's alone.
    before = os.umask(0o077)
    try:
        with (
            _EndSignals() as ends,
            tempfile.TemporaryDirectory(prefix="lampyris-", ignore_cleanup_errors=True) as temporary,
        ):
            made = services(Path(temporary)) if services else _services(folder, Path(temporary))
            token = secrets.token_hex(32)
            at = sockets[0].getsockname()[1]
            address = f"http://{allow_remote or '127.0.0.1'}:{at}/#t={token}"
            address += f"&m={quote(map_, safe='')}" if map_ else ""
            if allow_remote:
                print(REMOTE.format(name=allow_remote), file=sys.stderr)
            print(f"lampyris app: {address}\nCtrl-C ends it.", flush=True)
            if browser:
                _open(address, Path(temporary))
            asyncio.run(_serve(application(made, door(at, token, allow_remote)), sockets, made, ends))
    finally:
        os.umask(before)
        for each in sockets:
            each.close()
    return 0


def _sockets(port: int | None, remote: bool) -> list[socket.socket]:
    """Sockets of a port; without one those of the usual, so that the page finds its drafts again."""
    try:
        return listening.open_sockets(USUAL if port is None else port, remote=remote)
    except UsageError:
        if port is not None:
            raise
    return listening.open_sockets(0, remote=remote)


class _EndSignals:
    """SIGINT and SIGTERM from before the address is printed: a KeyboardInterrupt that is raised in a finaliser or
    in a callback from C, as while modules are imported, would be lost, and the app would go on."""

    SIGNALS: Final = (signal.SIGINT, signal.SIGTERM)

    def __init__(self) -> None:
        self.received = False

    def __enter__(self) -> Self:
        self._before = {each: signal.signal(each, self._receive) for each in self.SIGNALS}
        return self

    def _receive(self, *_: object) -> None:
        self.received = True

    def __exit__(self, *_: object) -> None:
        for each, handler in self._before.items():
            if (
                handler is not None
            ):  # None: it was set by another language than Python, and cannot be set again
                signal.signal(each, handler)


async def _serve(app: Any, sockets: list[Any], services: Services, ends: _EndSignals) -> None:
    """Serve until a signal; then end what was started."""
    server = listening.server(app)
    loop = asyncio.get_running_loop()

    def end(*_: object) -> None:
        server.force_exit = server.should_exit
        server.should_exit = True

    for word in ends.SIGNALS:
        try:
            loop.add_signal_handler(word, end)
        except NotImplementedError:
            signal.signal(word, end)
    if ends.received:
        end()
    try:
        await services.start()
        # The page asks for it first of all, and it takes a third of a second: while the browser opens.
        greeting = asyncio.ensure_future(asyncio.to_thread(services.hello))
        await server.serve(sockets=sockets)
        await asyncio.gather(greeting, return_exceptions=True)
    finally:
        await services.close()


def _services(folder: Path | None, temporary: Path) -> Services:
    """The library, the engines and the studies."""
    from lampyris.app.engine.bootstrap import hello
    from lampyris.app.server.engines import Engines
    from lampyris.app.server.library import Library
    from lampyris.app.server.studies import Studies

    return Services(Engines(folder=temporary), Library(folder), hello, Studies(temporary))


def _open(address: str, folder: Path) -> None:
    """Open the browser by way of a file of the user's own: its command line is for every user to see."""
    file = folder / "open.html"
    file.write_text(render("app/server/open.html.j2", address=address), encoding="utf-8")
    file.chmod(0o600)
    with contextlib.suppress(webbrowser.Error, OSError):
        webbrowser.open(file.as_uri())


class _OneLine(logging.Formatter):
    """A record as one line that a terminal only prints."""

    def format(self, record: logging.LogRecord) -> str:
        """The line."""
        text = super().format(record)
        if record.exc_info:
            return text  # asked for, by LAMPYRIS_DEBUG
        return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


class _AtMost(logging.Filter):
    """At most so many lines a second; the next one says how many were left out. Anyone who sends requests by the
    thousand would fill a terminal or a disk, and a pipe that nobody reads would stop the server."""

    LINES: Final = 50

    def __init__(self) -> None:
        super().__init__()
        self._second, self._written, self._left_out = 0, 0, 0

    def filter(self, record: logging.LogRecord) -> bool:
        """Whether it is written."""
        second = int(record.created)
        if second != self._second:
            self._second, self._written = second, 0
        if self._written >= self.LINES:
            self._left_out += 1
            return False
        self._written += 1
        if self._left_out:
            record.msg, record.args = f"{record.getMessage()} ({self._left_out:,} lines left out)", None
            self._left_out = 0
        return True


def _log_to_stderr() -> None:
    """What is refused or goes wrong, one line each; with LAMPYRIS_DEBUG every request."""
    log = logging.getLogger("lampyris.app")
    handler = logging.StreamHandler()
    if not os.environ.get("LAMPYRIS_DEBUG"):
        handler.addFilter(_AtMost())
    handler.setFormatter(_OneLine("%(asctime)s %(message)s", "%H:%M:%S"))
    log.handlers[:] = [handler]
    log.propagate = False
    debug = bool(os.environ.get("LAMPYRIS_DEBUG"))
    log.setLevel(logging.DEBUG if debug else logging.WARNING)
    # Its lines hold tracebacks, and addresses as they were sent.
    logging.getLogger("uvicorn").setLevel(logging.INFO if debug else logging.CRITICAL)
