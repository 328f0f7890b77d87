"""Asking: what a request says, read strictly.

A request has a form: its keys, and for each key what its value may be (:class:`ValueRule`). What is deeper (a
scenario, who is compared) is checked by the code that uses it, which says the place.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import isfinite
from typing import Any, Final, TypeAlias

from starlette.requests import Request

from lampyris.app.server.guard import Refused
from lampyris.errors import FileError

JSON: Final = "application/json"
BYTES: Final = "application/octet-stream"
MAX_JSON: Final = 8 * 2**20
MOST_VALUES: Final = 1_000_000
"""Values, counted before any is made: in memory each is thirty times what it is in the text."""
MOST_WHOLE: Final = 2**64
"""Whole numbers beyond are refused: no setting has them, and greater ones are no floating-point numbers."""


@dataclass(frozen=True, slots=True)
class ValueRule:
    """What the value of a key may be. Null is the same as no such key.

    Parameters
    ----------
    fits : whether a value may be there.
    allowed : the same in words.
    """

    fits: Callable[[Any], bool]
    allowed: str


TABLE: Final = ValueRule(lambda value: isinstance(value, dict), "a table {...}")
LIST: Final = ValueRule(lambda value: isinstance(value, list), "a list [...]")
TEXT: Final = ValueRule(lambda value: isinstance(value, str), "text")
FLAG: Final = ValueRule(lambda value: isinstance(value, bool), "true or false")
WHOLE: Final = ValueRule(lambda value: type(value) is int, "a whole number")
WORDS: Final = ValueRule(
    lambda value: isinstance(value, list) and all(isinstance(one, str) for one in value), "a list of words"
)
JOB: Final = ValueRule(
    lambda value: isinstance(value, str) or type(value) is int, "the number of a job, or the word of a study"
)
CHECKED_LATER: Final = ValueRule(lambda value: True, "see who reads it")

Form: TypeAlias = Mapping[str, ValueRule]


def check_kind(request: Request, kind: str) -> None:
    """Refuse what is sent as another type: a form of another page can send plain text, and no JSON.

    Raises
    ------
    Refused : 415.
    """
    if request.headers.get("content-type", "").replace(" ", "").lower() not in (
        kind,
        f"{kind};charset=utf-8",
    ):
        raise Refused(415, "CONTENT_TYPE", "sent as another type", kind)


async def said(request: Request, form: Form | None) -> dict[str, Any]:
    """The body as a table of this form; None: any.

    Raises
    ------
    Refused : 400, 413, 415.
    """
    check_kind(request, JSON)
    raw = await request.body()
    if len(raw) > MAX_JSON:
        raise Refused(413, "JSON_SIZE", f"{len(raw):,} bytes", f"at most {MAX_JSON:,} bytes")
    if sum(map(raw.count, (b",", b"[", b"{"))) > MOST_VALUES:
        raise Refused(413, "JSON_SIZE", "too many values", f"at most {MOST_VALUES:,}")
    try:
        found = json.loads(
            raw.decode("utf-8"),
            parse_constant=_no_constant,
            parse_float=_finite,
            parse_int=_whole,
            object_pairs_hook=_once,
        )
    except (ValueError, RecursionError) as problem:
        what = str(problem) if isinstance(problem, json.JSONDecodeError | _Said) else "no JSON"
        raise Refused(400, "JSON_SYNTAX", what[:200], "JSON") from None
    if not isinstance(found, dict):
        raise Refused(400, "JSON_SHAPE", "not a table", "{...}")
    if form is None:
        return found
    for key, value in found.items():
        if key not in form:
            raise Refused(400, "KEY", f"unknown key {key[:40]!r}", ", ".join(form))
        if value is not None and not form[key].fits(value):
            raise Refused(400, "TYPE", f"{value!r:.60}", form[key].allowed, where=key)
    return {key: value for key, value in found.items() if value is not None}


def check_finite(value: Any, where: str = "") -> None:
    """Refuse plain data that JSON cannot hold: YAML has numbers that are not finite.

    Raises
    ------
    FileError : YAML_NUMBER, at its JSON pointer.
    """
    if isinstance(value, float) and not isfinite(value):
        raise FileError("YAML_NUMBER", f"{value} is not finite", where=where, allowed="finite numbers")
    parts = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, part in parts:
        check_finite(part, f"{where}/{key}")


class _Said(ValueError):
    """Wrong in words of our own."""


def _no_constant(word: str) -> Any:
    raise _Said(f"{word} is not finite")


def _finite(word: str) -> float:
    made = float(word)
    if not isfinite(made):
        raise _Said(f"{word[:40]} is not finite")
    return made


def _whole(word: str) -> int:
    if len(word) > 20 or abs(int(word)) > MOST_WHOLE:
        raise _Said(f"{word[:40]} is too great for a whole number, at most {MOST_WHOLE:,}")
    return int(word)


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    made = dict(pairs)
    if len(made) < len(pairs):
        raise _Said("a key is there twice")
    return made
