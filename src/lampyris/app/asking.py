"""Asking: what a request says, read strictly, and plain data as an answer."""

from __future__ import annotations

import json
from math import isfinite
from typing import Any, Final

from starlette.requests import Request
from starlette.responses import Response

from lampyris.app.guard import JSON, Refused

MAX_JSON: Final = 8 * 2**20
MOST_VALUES: Final = 1_000_000
"""Values, counted before any is made: in memory each is thirty times what it is in the text."""


async def said(request: Request, keys: tuple[str, ...] | None) -> dict[str, Any]:
    """The body as a table; ``keys``: those it may have, None: any.

    Raises
    ------
    Refused : 400, 413.
    """
    raw = await request.body()
    if len(raw) > MAX_JSON:
        raise Refused(413, "JSON_SIZE", f"{len(raw):,} bytes", f"at most {MAX_JSON:,} bytes")
    if sum(map(raw.count, (b",", b"[", b"{"))) > MOST_VALUES:
        raise Refused(413, "JSON_SIZE", "too many values", f"at most {MOST_VALUES:,}")
    try:
        found = json.loads(
            raw.decode("utf-8"), parse_constant=_no_constant, parse_float=_finite, object_pairs_hook=_once
        )
    except (ValueError, RecursionError) as problem:
        what = str(problem) if isinstance(problem, json.JSONDecodeError | _Said) else "no JSON"
        raise Refused(400, "JSON_SYNTAX", what[:200], "JSON") from None
    if not isinstance(found, dict):
        raise Refused(400, "JSON_SHAPE", "not a table", "{...}")
    allowed = found if keys is None else keys
    for key in found:
        if key not in allowed:
            raise Refused(400, "KEY", f"unknown key {key[:40]!r}", ", ".join(allowed))
    return found


class _Said(ValueError):
    """Wrong in words of our own."""


def _no_constant(word: str) -> Any:
    raise _Said(f"{word} is not finite")


def _finite(word: str) -> float:
    made = float(word)
    if not isfinite(made):
        raise _Said(f"{word[:40]} is not finite")
    return made


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    made = dict(pairs)
    if len(made) < len(pairs):
        raise _Said("a key is there twice")
    return made


def dump(value: Any) -> bytes:
    """JSON in one line."""
    return json.dumps(value, allow_nan=False, separators=(",", ":")).encode()


def told(value: Any) -> Response:
    """JSON as an answer."""
    return Response(dump(value), media_type=JSON)
