"""What the live page asks, answered in the page itself: the routes of the app's server without a server.

It runs in Pyodide (``worker.js``) and, to make the recording and to compare hashes, in CPython. Questions go to the
same functions as those of the app's engine (:mod:`lampyris.app.engine.work`).
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from urllib.parse import unquote

from lampyris._core import cancellation
from lampyris.app.engine import work
from lampyris.app.engine.bootstrap import hello
from lampyris.app.engine.decode import read_container
from lampyris.app.engine.frames import error_frame, fault_of, json_frame
from lampyris.app.server import library
from lampyris.errors import InternalFault, LampyrisError, UsageError
from lampyris.io.text.strict_json import read_json
from lampyris.io.text.strict_yaml import read_yaml

FRAMES = "application/x-lampyris-frames"
JSON = "application/json"
VERBS = ("plan", "simulate", "drive", "fleet", "swarm", "layer", "compare", "race", "export", "make")
SPOOL = Path("/tmp/lampyris-live-maps")


class Answer:
    """The head of an answer and its pieces: bytes of a whole, or frame by frame.

    Parameters
    ----------
    status : as HTTP numbers them. kind : its media type. pieces : what follows.
    """

    def __init__(self, status: int, kind: str, pieces: Iterator[bytes]) -> None:
        self.status, self.kind, self._pieces = status, kind, pieces

    def next(self) -> bytes | None:
        """The next piece; None: that was all."""
        return next(self._pieces, None)


def ask(path: str, body: Any = None) -> Answer:
    """The answer to a request of the page: no error is raised, each is an answer.

    Parameters
    ----------
    path : as the app's server knows it. body : JSON as text, or bytes of files; None: the request has none.
    """
    try:
        return _route(path, body)
    except LampyrisError as fault:
        return _json({"error": fault_of(fault)}, 400)
    except ModuleNotFoundError as fault:
        return _json({"error": fault_of(_missing(fault))}, 400)
    except Exception as fault:
        return _json({"error": fault_of(_internal(fault))}, 500)


@cache
def _library() -> library.Library:
    # A map of the reader's own, read in the reader's own page: there are no processes to do it in.
    library.decode = _decode
    return library.Library(None, SPOOL)


def _decode(files: bytes) -> dict[str, Any]:
    with TemporaryDirectory() as folder:
        return read_container(files, Path(folder))


def _route(path: str, body: Any) -> Answer:
    what, _, rest = path.removeprefix("/api/").partition("/")
    rest = unquote(rest)
    if what == "hello":
        return _json(hello())
    if what == "maps" and not rest and body is None:
        return _json(_library().listing())
    if what == "maps" and not rest:
        return _json(_library().add(bytes(body.to_bytes() if hasattr(body, "to_bytes") else body)))
    if what == "maps" and rest.endswith("/delete"):
        id, back = rest.removesuffix("/delete"), json.loads(body).get("back") is True
        (_library().bring_back if back else _library().delete)(id)
        return _json({"back" if back else "deleted": id})
    if what == "maps" and rest:
        return Answer(200, "application/octet-stream", iter([_library().ground(rest)]))
    if what == "thumbs":
        return Answer(200, "image/png", iter([_library().thumb(rest)]))
    if what == "scenario" and body is not None:
        return _json({"scenario": _scenario(json.loads(body))})
    if what in VERBS and body is not None:
        return _asked(what, json.loads(body))
    if what == "cancel":
        return _json({"cancelled": json.loads(body or b"{}").get("job")})
    raise UsageError(
        "NOT_FOUND",
        "this page has no server: it cannot do that",
        where=path[:80],
        todo="install lampyris and run `lampyris app`",
    )


def _scenario(asked: dict[str, Any]) -> Any:
    name, text = str(asked.get("name") or ""), str(asked.get("text") or "")
    read = read_json if name.lower().endswith(".json") else read_yaml
    return read(text.encode(), name[:80]).data


def _asked(verb: str, body: dict[str, Any]) -> Answer:
    spec = body.get("scenario", {}).get("map") if verb != "make" else None
    name = spec.get("library") if isinstance(spec, dict) else spec
    ground = {"ground": _library().packed(name)} if isinstance(name, str) else {}
    frames = _told(work.answer({**body, "verb": verb, **ground}, cancellation.checkpoint))
    first = next(frames, b"")
    if first[4:5] == b"X":
        return _json({"error": json.loads(first[5:])}, 400)
    return Answer(200, FRAMES, _from(first, frames))


def _from(first: bytes, rest: Iterator[bytes]) -> Iterator[bytes]:
    yield first
    yield from rest


def _told(frames: Iterator[bytes]) -> Iterator[bytes]:
    """The frames; whatever goes wrong is the last of them."""
    try:
        yield from frames
    except LampyrisError as fault:
        yield error_frame(fault)
    except ModuleNotFoundError as fault:
        yield error_frame(_missing(fault))
    except Exception as fault:
        yield error_frame(_internal(fault))


def _missing(fault: ModuleNotFoundError) -> LampyrisError:
    what = f"this needs {fault.name}, which the live page does not have"
    return UsageError("MODULE", what, todo="install lampyris and run `lampyris app`")


def _internal(fault: Exception) -> LampyrisError:
    return InternalFault("INTERNAL", f"{type(fault).__name__}: {fault}"[:500])


def _json(value: Any, status: int = 200) -> Answer:
    return Answer(status, JSON, iter([json_frame("J", value)[5:]]))
