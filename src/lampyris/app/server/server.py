"""The server: from requests to nouns and questions, from answers to bytes. It knows no algorithm.

Every path is in :data:`WAYS`; the guard refuses whatever is not (see :mod:`lampyris.app.server.guard`). GET never
changes anything.
"""

from __future__ import annotations

import asyncio
import secrets
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import aclosing
from dataclasses import dataclass, field
from typing import Any, Final, Protocol, cast

from starlette import routing
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response

from lampyris.app.engine.frames import error_frame, fault_of
from lampyris.app.server.answers import STATUS, Streamed
from lampyris.app.server.guard import BYTES, JSON, App, Door, Guard, Refused, Route, error_body
from lampyris.app.server.request_parsing import (
    CHECKED_LATER,
    FLAG,
    JOB,
    LIST,
    TABLE,
    TEXT,
    WHOLE,
    WORDS,
    Form,
    check_finite,
    dump,
    said,
    told,
)
from lampyris.app.server.static_files import TYPES, Shipped, both, shipped, static_files
from lampyris.errors import InputError, InternalFault, LampyrisError
from lampyris.io.text.strict_json import read_json
from lampyris.io.text.strict_yaml import read_yaml

STREAMS: Final = 16
TICKETS: Final = 16
TICKET_SECONDS: Final = 30.0
LOOKS: Final = 16
"""Threads that look things up."""
READS: Final = 2
"""Threads that read what a stranger wrote. They are others, so that eight bombs keep nobody from his maps."""

WAYS: Final = (
    Route("/", open=True, entrance=True),
    Route("/static/{name}", open=True),
    Route("/view/{ticket}", open=True),
    Route("/api/hello"),
    Route("/api/maps"),
    Route("/api/maps", "POST", BYTES),
    Route("/api/maps/{id}"),
    Route("/api/thumbs/{id}"),
    Route("/api/maps/{id}/delete", "POST", JSON),
    *(
        Route(f"/api/{verb}", "POST", JSON)
        for verb in ("plan", "simulate", "layer", "compare", "export", "make")
    ),
    Route("/api/scenario", "POST", JSON),
    Route("/api/study", "POST", JSON),
    Route("/api/study/{job}"),
    Route("/api/ticket", "POST", JSON),
    Route("/api/cancel", "POST", JSON),
)
"""Everything that may be asked. A page in a frame of its own (``/view``) has a ticket in place of a token."""

ASKED: Final[Mapping[str, Form]] = {
    "plan": {"scenario": TABLE, "record": FLAG, "layers": WORDS},
    "simulate": {"scenario": TABLE},
    "layer": {"scenario": TABLE, "layer": TEXT, "obstacle_cells": LIST, "tick": WHOLE},
    "compare": {"scenario": TABLE, "planners": LIST, "laws": LIST, "seeds": CHECKED_LATER},
    "export": {"scenario": TABLE, "what": TEXT, "settings": TABLE, "tick": WHOLE, "progress": FLAG},
    "make": {"map": TABLE},
}
"""The form of each question to an engine; what has another is refused."""

STUDY: Final[Form] = {
    "scenario": TABLE, "planners": LIST, "laws": LIST, "seeds": WHOLE, "queries": WHOLE,
}  # fmt: skip
OTHERS: Final[Mapping[str, Form]] = {
    "scenario": {"name": TEXT, "text": TEXT},
    "study": STUDY,
    "ticket": {"job": TEXT},
    "cancel": {"job": JOB},
    "delete": {"back": FLAG},
}
"""The form of what the server answers itself."""

EXPORTS: Final[Mapping[str, tuple[str, str]]] = {
    "png": ("image/png", "png"),
    "svg": ("image/svg+xml", "svg"),
    "webp": ("image/webp", "webp"),
    "gif": ("image/gif", "gif"),
    "csv": ("text/csv; charset=utf-8", "csv"),
    "scenario": ("application/yaml; charset=utf-8", "yaml"),
    "report": ("text/html; charset=utf-8", "html"),
}
"""What can be had as a file: its type, and how its name ends."""

VIEW_CSP: Final = (
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'; sandbox"
)
"""Of a report: one file with its own styles and pictures, that can run nothing and ask nobody."""


class EnginesLike(Protocol):
    """See :class:`lampyris.app.server.engines.Engines`."""

    def ask(self, question: dict[str, Any]) -> AsyncIterator[bytes]:
        """Frames."""

    async def cancel(self, job: int) -> None:
        """Stop a job."""


class LibraryLike(Protocol):
    """See :class:`lampyris.app.server.library.Library`."""

    def listing(self) -> Any:
        """Every map there is, as plain data."""

    def ground(self, id: str) -> bytes:
        """A map's bytes for the page."""

    def thumb(self, id: str) -> bytes:
        """A small picture of it, PNG."""

    def add(self, files: bytes) -> dict[str, Any]:
        """Keep an uploaded map."""

    def delete(self, id: str) -> None:
        """Put it away."""

    def bring_back(self, id: str) -> None:
        """Have it again."""

    def packed(self, id: str) -> dict[str, Any]:
        """A map as a question to an engine holds it."""


class StudiesLike(Protocol):
    """Studies that run beside the page."""

    async def start(self, body: Mapping[str, Any]) -> str:
        """Begin one; its job."""

    def progress(self, job: str) -> dict[str, Any]:
        """How far it is: ``state`` and ``done`` of ``total`` runs."""

    def report(self, job: str) -> bytes:
        """The finished report, HTML."""

    async def cancel(self, job: str) -> None:
        """Stop one."""


@dataclass
class Services:
    """What the server asks.

    Parameters
    ----------
    hello : what the page needs to know before anything else; called once, in a thread.
    """

    engines: EnginesLike
    library: LibraryLike
    hello: Callable[[], dict[str, Any]]
    studies: StudiesLike | None = None
    tickets: dict[str, tuple[float, str]] = field(default_factory=dict)
    streams: int = 0
    looks: ThreadPoolExecutor = field(default_factory=lambda: ThreadPoolExecutor(LOOKS, "lampyris-look"))
    reads: ThreadPoolExecutor = field(default_factory=lambda: ThreadPoolExecutor(READS, "lampyris-read"))

    async def look(self, work: Callable[..., Any], *given: Any) -> Any:
        """Do some work in a thread."""
        return await asyncio.get_running_loop().run_in_executor(self.looks, work, *given)

    async def read(self, work: Callable[..., Any], *given: Any) -> Any:
        """Do some work on what a stranger wrote in a thread."""
        return await asyncio.get_running_loop().run_in_executor(self.reads, work, *given)

    async def start(self) -> None:
        """Start what takes a while, before anybody asks."""
        if (start := getattr(self.engines, "start", None)) is not None:
            await start()

    async def close(self) -> None:
        """End what was started."""
        for threads in (self.looks, self.reads):
            threads.shutdown(wait=False, cancel_futures=True)
        for each in (self.engines, self.studies):
            if (close := getattr(each, "close", None)) is not None:
                await close()


def application(services: Services, door: Door) -> App:
    """The server as an ASGI application, guarded."""
    desk = Desk(services)
    app = Starlette(routes=desk.routes(), exception_handlers=HANDLERS)
    app.router.redirect_slashes = False
    return Guard(cast(App, app), door, WAYS)


class Desk:
    """A method for every way."""

    def __init__(self, services: Services) -> None:
        self._all = services
        self._static = static_files()
        self._hello: Shipped | None = None

    def routes(self) -> list[routing.Route]:
        """A route for every way, and no other."""
        table: dict[tuple[str, str], Callable[[Request], Awaitable[Any]]] = {
            ("GET", "/"): self.page,
            ("GET", "/static/{name}"): self.static,
            ("GET", "/view/{ticket}"): self.view,
            ("GET", "/api/hello"): self.hello,
            ("GET", "/api/maps"): self.maps,
            ("POST", "/api/maps"): self.add_map,
            ("GET", "/api/maps/{id}"): self.ground,
            ("GET", "/api/thumbs/{id}"): self.thumb,
            ("POST", "/api/maps/{id}/delete"): self.delete_map,
            ("POST", "/api/scenario"): self.scenario,
            ("POST", "/api/study"): self.study,
            ("GET", "/api/study/{job}"): self.study_progress,
            ("POST", "/api/ticket"): self.ticket,
            ("POST", "/api/cancel"): self.cancel,
            **{("POST", f"/api/{verb}"): self.ask for verb in ASKED},
        }
        return [routing.Route(way.path, table[way.method, way.path], methods=[way.method]) for way in WAYS]

    async def page(self, request: Request) -> Response:
        """The page."""
        return self._file(request, "index.html")

    async def static(self, request: Request) -> Response:
        """A file of the page."""
        return self._file(request, request.path_params["name"])

    def _file(self, request: Request, name: str) -> Response:
        found = self._static.get(name)
        if found is None:
            raise Refused(404, "NOT_FOUND", "there is nothing here")
        return shipped(request, *found)

    async def hello(self, request: Request) -> Response:
        """What there is: planners, laws, maps, limits."""
        if self._hello is None:
            self._hello = both(JSON, dump(await self._all.look(self._all.hello)))
        return shipped(request, *self._hello)

    async def maps(self, request: Request) -> Response:
        """The library."""
        return told(await self._all.look(self._all.library.listing))

    async def add_map(self, request: Request) -> Response:
        """Keep a map."""
        body = await request.body()
        return told(await self._all.read(self._all.library.add, body))

    async def ground(self, request: Request) -> Response:
        """A map's cells."""
        found = await self._all.look(self._all.library.ground, request.path_params["id"])
        return Response(found, media_type=BYTES)

    async def thumb(self, request: Request) -> Response:
        """A map's small picture."""
        found = await self._all.look(self._all.library.thumb, request.path_params["id"])
        return Response(found, media_type="image/png")

    async def delete_map(self, request: Request) -> Response:
        """Put an uploaded map away; ``back``: have it again."""
        back = (await said(request, OTHERS["delete"])).get("back") is True
        library, id = self._all.library, request.path_params["id"]
        await self._all.look(library.bring_back if back else library.delete, id)
        return told({"back" if back else "deleted": id})

    async def ask(self, request: Request) -> Any:
        """A question to an engine; its frames."""
        verb = request.url.path.rpartition("/")[2]
        body = await said(request, ASKED[verb])
        ground = {} if verb == "make" else await self._ground_of(body.get("scenario"))
        question = {**body, "verb": verb, **ground}
        frames = self._counted(question)
        if verb != "export" or body.get("progress") is True:
            return Streamed(frames)
        kind, ending = EXPORTS.get(str(body.get("what")), ("", ""))
        if not kind:
            raise Refused(400, "EXPORT", "no such kind of file", ", ".join(EXPORTS))
        name = f'attachment; filename="lampyris.{ending}"'
        return Streamed(frames, unpack=True, kind=kind, headers=((b"content-disposition", name.encode()),))

    async def _ground_of(self, scenario: Any) -> dict[str, Any]:
        """The map that a scenario names, as an engine takes it. Files are never named from the page."""
        if not isinstance(scenario, dict):
            raise Refused(400, "KEY", "no scenario", "a table", "send {scenario: ...}")
        spec = scenario.get("map")
        name = spec.get("library") if isinstance(spec, dict) else spec
        if isinstance(spec, dict) and "file" in spec:
            raise Refused(400, "PATH_OUTSIDE", "the app opens no files by name", todo="upload the map")
        if not isinstance(name, str):
            return {}
        return {"ground": await self._all.look(self._all.library.packed, name)}

    async def _counted(self, question: dict[str, Any]) -> AsyncIterator[bytes]:
        """The frames of an answer; the streams that run are counted, and a fault is the last frame."""
        if self._all.streams >= STREAMS:
            yield error_frame(InputError("BUSY", "too many answers at once", allowed=str(STREAMS)))
            return
        self._all.streams += 1
        try:
            async with aclosing(cast(Any, self._all.engines.ask(question))) as frames:
                async for piece in frames:
                    yield piece
        except LampyrisError as fault:
            yield error_frame(fault)
        finally:
            self._all.streams -= 1

    async def cancel(self, request: Request) -> Response:
        """Stop a job: of an engine by its number, a study by its word."""
        job = (await said(request, OTHERS["cancel"])).get("job")
        if job is None:
            raise Refused(400, "KEY", "no job", JOB.allowed, where="job")
        await (self._studies() if isinstance(job, str) else self._all.engines).cancel(job)
        return told({"cancelled": job})

    async def scenario(self, request: Request) -> Response:
        """A scenario file as plain data: the page reads what the command line reads, with the same limits."""
        body = await said(request, OTHERS["scenario"])
        name, text = (body.get(key) or "" for key in ("name", "text"))
        read: Callable[..., Any] = read_json if name.lower().endswith(".json") else read_yaml
        data = text.encode("utf-8", "surrogatepass")
        found = await self._all.read(read, data, name[:80])
        check_finite(found.data)
        return told({"scenario": found.data})

    async def study(self, request: Request) -> Response:
        """Begin a study."""
        body = await said(request, OTHERS["study"])
        ground = await self._ground_of(body.get("scenario"))
        return told({"job": await self._studies().start({**body, **ground})})

    async def study_progress(self, request: Request) -> Response:
        """How far a study is."""
        return told(self._studies().progress(request.path_params["job"]))

    def _studies(self) -> StudiesLike:
        if self._all.studies is None:
            raise Refused(404, "NOT_FOUND", "this server runs no studies")
        return self._all.studies

    async def ticket(self, request: Request) -> Response:
        """A word that opens a report once, soon: a new tab can send no token."""
        job = (await said(request, OTHERS["ticket"])).get("job") or ""
        self._studies().report(job)  # raises where there is none
        now = time.monotonic()
        old = self._all.tickets
        kept = [(word, way) for word, way in old.items() if now - way[0] < TICKET_SECONDS][1 - TICKETS :]
        ticket = secrets.token_urlsafe(32)
        self._all.tickets = {**dict(kept), ticket: (now, job)}
        return told({"ticket": ticket})

    async def view(self, request: Request) -> Response:
        """A report, for a ticket."""
        began, job = self._all.tickets.pop(request.path_params["ticket"], (float("-inf"), ""))
        if time.monotonic() - began >= TICKET_SECONDS:
            raise Refused(404, "NOT_FOUND", "there is nothing here", todo="open the report again")
        body = await self._all.look(self._studies().report, job)
        return Response(body, media_type=TYPES["html"], headers={"Content-Security-Policy": VIEW_CSP})


def _fault(request: Request, fault: Exception) -> Response:
    assert isinstance(fault, LampyrisError)
    return Response(
        error_body(fault_of(fault)),
        status_code=STATUS.get(fault.code, 500 if isinstance(fault, InternalFault) else 400),
        media_type=JSON,
    )


def _refused(request: Request, fault: Exception) -> Response:
    assert isinstance(fault, Refused)
    return Response(error_body(fault.error), status_code=fault.status, media_type=JSON)


def _internal(request: Request, fault: Exception) -> Response:
    # Starlette raises it again behind this answer, and the guard logs it.
    error = {"code": "INTERNAL", "what": "a fault of lampyris", "todo": "please report it"}
    return Response(error_body(error), status_code=500, media_type=JSON)


HANDLERS: Final[Mapping[Any, Callable[[Request, Exception], Response]]] = {
    LampyrisError: _fault,
    Refused: _refused,
    Exception: _internal,
}
