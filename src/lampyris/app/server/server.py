"""The server: from requests to nouns and questions, from answers to bytes. It knows no algorithm.

Every path is in :meth:`Desk.routes`; who may ask is the guard's (:mod:`lampyris.app.server.guard`). GET never changes
anything.
"""

from __future__ import annotations

import asyncio
import mimetypes
import secrets
import time
from collections.abc import AsyncIterator, Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import aclosing
from dataclasses import dataclass, field
from importlib.resources import files
from typing import TYPE_CHECKING, Any, Final, cast

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.middleware.gzip import GZipMiddleware
from starlette.requests import Request
from starlette.responses import FileResponse, HTMLResponse, Response
from starlette.routing import BaseRoute, Mount, Route

from lampyris.app.engine.frames import error_frame, fault_of
from lampyris.app.server import opening
from lampyris.app.server.answers import FRAMES, STATUS, Streamed
from lampyris.app.server.guard import Door, Guard, Json, Refused
from lampyris.app.server.request_parsing import (
    BYTES,
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
    check_kind,
    said,
)
from lampyris.app.server.scripts import PageFiles
from lampyris.errors import InputError, InternalFault, LampyrisError
from lampyris.io.text.strict_json import read_json
from lampyris.io.text.strict_yaml import read_yaml

if TYPE_CHECKING:
    from lampyris.app.server.engines import Engines
    from lampyris.app.server.library import Library
    from lampyris.app.server.studies import Studies

STREAMS: Final = 16
TICKETS: Final = 16
TICKET_SECONDS: Final = 30.0
LOOKS: Final = 16
"""Threads that look things up."""
READS: Final = 2
"""Threads that read untrusted input. They are others, so that eight bombs keep nobody from his maps."""

PACKED: Final = [Middleware(GZipMiddleware)]
"""Of what is the same for everyone: what is compressed together with a secret and text chosen by an attacker can leak
the secret."""

ASKED: Final[Mapping[str, Form]] = {
    "plan": {"scenario": TABLE, "record": FLAG, "layers": WORDS},
    "simulate": {"scenario": TABLE},
    "drive": {"scenario": TABLE},
    "fleet": {
        "scenario": TABLE, "robots": WHOLE, "agents": LIST, "planner": TEXT, "settings": TABLE, "seed": WHOLE,
        "seconds": CHECKED_LATER,
    },
    "swarm": {"scenario": TABLE, "robots": WHOLE, "seed": WHOLE, "sources": TEXT, "settings": TABLE},
    "layer": {"scenario": TABLE, "layer": TEXT, "obstacle_cells": LIST, "tick": WHOLE},
    "compare": {"scenario": TABLE, "planners": LIST, "laws": LIST, "seeds": CHECKED_LATER},
    "race": {"scenario": TABLE, "planners": LIST},
    "export": {"scenario": TABLE, "what": TEXT, "settings": TABLE, "tick": WHOLE, "progress": FLAG},
    "make": {"map": TABLE},
}  # fmt: skip
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
    "replay": ("text/html; charset=utf-8", "html"),
}
"""What can be had as a file: its type, and how its name ends."""

VIEW_CSP: Final = (
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'; sandbox"
)
"""Of a report: one file with its own styles and pictures, that can run nothing and ask nobody."""


@dataclass
class Services:
    """What the server asks.

    Parameters
    ----------
    hello : what the page needs to know before anything else; called once, in a thread.
    """

    engines: Engines
    library: Library
    hello: Callable[[], dict[str, Any]]
    studies: Studies | None = None
    tickets: dict[str, tuple[float, str]] = field(default_factory=dict)
    streams: int = 0
    looks: ThreadPoolExecutor = field(default_factory=lambda: ThreadPoolExecutor(LOOKS, "lampyris-look"))
    reads: ThreadPoolExecutor = field(default_factory=lambda: ThreadPoolExecutor(READS, "lampyris-read"))

    async def look(self, work: Callable[..., Any], *given: Any) -> Any:
        """Do some work in a thread."""
        return await asyncio.get_running_loop().run_in_executor(self.looks, work, *given)

    async def read(self, work: Callable[..., Any], *given: Any) -> Any:
        """Do some work on untrusted input in a thread."""
        return await asyncio.get_running_loop().run_in_executor(self.reads, work, *given)

    async def start(self) -> None:
        """Start ahead of time what takes a while."""
        opening.recorded_answers()
        if (start := getattr(self.engines, "start", None)) is not None:
            await start()

    async def close(self) -> None:
        """End what was started."""
        for threads in (self.looks, self.reads):
            threads.shutdown(wait=False, cancel_futures=True)
        for each in (self.engines, self.studies):
            if (close := getattr(each, "close", None)) is not None:
                await close()


def application(services: Services, door: Door) -> Guard:
    """The server as an ASGI application, guarded."""
    desk = Desk(services)
    app = Starlette(routes=desk.routes(), exception_handlers=HANDLERS)
    app.router.redirect_slashes = False
    return Guard(app, door)


class Desk:
    """A method for every route."""

    def __init__(self, services: Services) -> None:
        self._all = services
        self._hello: dict[str, Any] | None = None
        # What a system says of these files need not be what browsers run.
        mimetypes.add_type("text/javascript", ".js")

    def routes(self) -> list[BaseRoute]:
        """Everything that may be asked. A page in a frame of its own (``/view``) has a ticket in place of a token."""
        return [
            Route("/", self.page, middleware=PACKED),
            Mount("/static", PageFiles(packages=[("lampyris.app", "static")]), middleware=PACKED),
            Route("/view/{ticket}", self.view),
            Route("/api/hello", self.hello, middleware=PACKED),
            Route("/api/maps", self.maps),
            Route("/api/maps", self.add_map, methods=["POST"]),
            Route("/api/maps/{id}", self.ground),
            Route("/api/maps/{id}/delete", self.delete_map, methods=["POST"]),
            Route("/api/thumbs/{id}", self.thumb),
            *(Route(f"/api/{verb}", self.ask, methods=["POST"]) for verb in ASKED),
            Route("/api/scenario", self.scenario, methods=["POST"]),
            Route("/api/study", self.study, methods=["POST"]),
            Route("/api/study/{job}", self.study_progress),
            Route("/api/ticket", self.ticket, methods=["POST"]),
            Route("/api/cancel", self.cancel, methods=["POST"]),
        ]

    async def page(self, request: Request) -> Response:
        """The page."""
        return FileResponse(str(files("lampyris.app").joinpath("static", "index.html")))

    async def hello(self, request: Request) -> Response:
        """What there is: planners, laws, maps, limits."""
        if self._hello is None:
            self._hello = await self._all.look(self._all.hello)
        return Json(self._hello)

    async def maps(self, request: Request) -> Response:
        """The library."""
        return Json(await self._all.look(self._all.library.listing))

    async def add_map(self, request: Request) -> Response:
        """Keep a map."""
        check_kind(request, BYTES)
        body = await request.body()
        return Json(await self._all.read(self._all.library.add, body))

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
        return Json({"back" if back else "deleted": id})

    async def ask(self, request: Request) -> Any:
        """A question to an engine; its frames."""
        verb = request.url.path.rpartition("/")[2]
        body = await said(request, ASKED[verb])
        if (recorded := opening.recorded_answer(verb, body)) is not None:
            if "gzip" not in request.headers.get("accept-encoding", ""):
                return Streamed(opening.stream(recorded))
            packed = {"Content-Encoding": "gzip", "Vary": "Accept-Encoding"}
            return Response(opening.compressed(recorded.frames), media_type=FRAMES, headers=packed)
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
        return Json({"cancelled": job})

    async def scenario(self, request: Request) -> Response:
        """A scenario file as plain data: the page reads what the command line reads, with the same limits."""
        body = await said(request, OTHERS["scenario"])
        name, text = (body.get(key) or "" for key in ("name", "text"))
        read: Callable[..., Any] = read_json if name.lower().endswith(".json") else read_yaml
        data = text.encode("utf-8", "surrogatepass")
        found = await self._all.read(read, data, name[:80])
        check_finite(found.data)
        return Json({"scenario": found.data})

    async def study(self, request: Request) -> Response:
        """Begin a study."""
        body = await said(request, OTHERS["study"])
        ground = await self._ground_of(body.get("scenario"))
        return Json({"job": await self._studies().start({**body, **ground})})

    async def study_progress(self, request: Request) -> Response:
        """How far a study is."""
        return Json(self._studies().progress(request.path_params["job"]))

    def _studies(self) -> Studies:
        if self._all.studies is None:
            raise Refused(404, "NOT_FOUND", "this server runs no studies")
        return self._all.studies

    async def ticket(self, request: Request) -> Response:
        """A word that opens a report once, soon: a new tab can send no token."""
        job = (await said(request, OTHERS["ticket"])).get("job") or ""
        self._studies().report(job)  # raises where there is none
        now = time.monotonic()
        old = self._all.tickets
        kept = [(word, ticket) for word, ticket in old.items() if now - ticket[0] < TICKET_SECONDS][
            1 - TICKETS :
        ]
        ticket = secrets.token_urlsafe(32)
        self._all.tickets = {**dict(kept), ticket: (now, job)}
        return Json({"ticket": ticket})

    async def view(self, request: Request) -> Response:
        """A report, for a ticket."""
        began, job = self._all.tickets.pop(request.path_params["ticket"], (float("-inf"), ""))
        if time.monotonic() - began >= TICKET_SECONDS:
            raise Refused(404, "NOT_FOUND", "there is nothing here", todo="open the report again")
        body = await self._all.look(self._studies().report, job)
        return HTMLResponse(body, headers={"Content-Security-Policy": VIEW_CSP})


def _fault(request: Request, fault: Exception) -> Response:
    assert isinstance(fault, LampyrisError)
    status = STATUS.get(fault.code, 500 if isinstance(fault, InternalFault) else 400)
    return Json({"error": fault_of(fault)}, status)


def _refused(request: Request, fault: Exception) -> Response:
    assert isinstance(fault, Refused)
    return fault.response()


def _unknown(request: Request, fault: Exception) -> Response:
    """What Starlette refuses: 404 and 405."""
    assert isinstance(fault, HTTPException)
    code, what = ("METHOD", "no such method") if fault.status_code == 405 else ("NOT_FOUND", "nothing")
    answer = Refused(fault.status_code, code, f"there is {what} here").response()
    answer.headers.update(fault.headers or {})
    return answer


def _internal(request: Request, fault: Exception) -> Response:
    # Starlette raises it again behind this answer, and the guard logs it.
    return Refused(500, "INTERNAL", "a fault of lampyris", todo="please report it").response()


HANDLERS: Final[Mapping[Any, Callable[[Request, Exception], Response]]] = {
    LampyrisError: _fault,
    Refused: _refused,
    HTTPException: _unknown,
    Exception: _internal,
}
