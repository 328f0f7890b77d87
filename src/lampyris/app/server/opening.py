"""Opening: answers to the questions that the page asks about its opening scene, as recorded in the package.

The first engine needs seconds after the start of the app until its compiled code is loaded; with these answers the page
plays at once. ``tools/app_opening.py`` records them, and a test compares them with fresh ones, byte for byte. They contain
no times of planning: those of another machine would say nothing about this one.
"""

from __future__ import annotations

import gzip
import json
import struct
import zlib
from collections.abc import AsyncIterator, Iterator, Mapping
from functools import cache
from importlib.resources import files
from typing import Any, Final, NamedTuple

from lampyris.app.engine.frames import json_frame

RECORD: Final = ("recorded", "opening.gz")
"""The record's place in :mod:`lampyris.app`: a compressed sequence of frames, ``Q`` for each question and then its answer."""
TIMES: Final = frozenset({"timing", "seconds", "loading_seconds"})
"""Keys of an answer that no record contains."""
UNREADABLE: Final = (OSError, EOFError, LookupError, TypeError, ValueError, struct.error, zlib.error)
"""What reading a record that is missing or damaged raises."""


class RecordedAnswer(NamedTuple):
    """A question with its answer.

    Parameters
    ----------
    question : the body of the request, without keys that are null.
    frames : what an engine answers, without :data:`TIMES`.
    """

    question: dict[str, Any]
    frames: tuple[bytes, ...]


@cache
def recorded_answers() -> Mapping[str, RecordedAnswer]:
    """The recorded answers by their verbs; none, so that engines are asked, if the record cannot be read."""
    try:
        return _answers(gzip.decompress(files("lampyris.app").joinpath(*RECORD).read_bytes()))
    except UNREADABLE:
        return {}


def _answers(record: bytes) -> Mapping[str, RecordedAnswer]:
    found: dict[str, RecordedAnswer] = {}
    verb = ""
    for piece in _pieces(record):
        if piece[4:5] == b"Q":
            asked = json.loads(piece[5:])
            verb = asked["verb"]
            found[verb] = RecordedAnswer(asked["question"], ())
        else:
            found[verb] = found[verb]._replace(frames=(*found[verb].frames, piece))
    return found


def recorded_answer(verb: str, question: Mapping[str, Any]) -> RecordedAnswer | None:
    """The recorded answer to a question; None: there is none, and an engine must be asked."""
    found = recorded_answers().get(verb)
    if found is None or question != found.question or _text(question) != _text(found.question):
        return None  # True equals 1, which an engine refuses
    return found


@cache
def compressed(frames: tuple[bytes, ...]) -> bytes:
    """The frames of a recorded answer, compressed by gzip: the same for every client, and nothing in it is secret."""
    return gzip.compress(b"".join(frames), mtime=0)


async def stream(answer: RecordedAnswer) -> AsyncIterator[bytes]:
    """Its frames, as an engine sends them."""
    for piece in answer.frames:
        yield piece


def without_times(piece: bytes) -> bytes:
    """A frame of an answer as it is recorded."""
    if piece[4:5] not in (b"H", b"Z"):
        return piece
    data = {key: value for key, value in json.loads(piece[5:]).items() if key not in TIMES}
    return json_frame(piece[4:5].decode(), data)


def packed_record(answers: Mapping[str, RecordedAnswer]) -> bytes:
    """The record's bytes before they are compressed."""
    return b"".join(
        json_frame("Q", {"verb": verb, "question": one.question}) + b"".join(one.frames)
        for verb, one in answers.items()
    )


def _pieces(data: bytes) -> Iterator[bytes]:
    at = 0
    while at < len(data):
        size = 4 + struct.unpack_from("<I", data, at)[0]
        yield data[at : at + size]
        at += size


def _text(question: Mapping[str, Any]) -> str:
    return json.dumps(question, sort_keys=True)
