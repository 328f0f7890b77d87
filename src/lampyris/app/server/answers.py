"""Answers: frames as they come from an engine, for as long as the client reads them."""

from __future__ import annotations

import asyncio
import json
import struct
from collections.abc import AsyncGenerator, AsyncIterator, Awaitable, Callable
from contextlib import aclosing
from typing import Any, cast

from starlette.types import Message, Receive, Scope, Send

from lampyris.app.server.guard import Json

FRAMES = "application/x-lampyris-frames"

STATUS = {"BUSY": 429, "INTERNAL": 500, "ENGINE": 503, "MAP": 404, "JOB": 404}
"""By an error's code; others are the asker's: 400."""


def unframed(piece: bytes) -> tuple[str, bytes]:
    """Kind and payload of a frame."""
    size, kind = struct.unpack_from("<IB", piece)
    if size != len(piece) - 4:
        raise ValueError("not one whole frame")
    return chr(kind), piece[5:]


class Streamed:
    """An answer of frames, as an ASGI application.

    An error that comes before anything else is an error of HTTP; one that comes later is a frame. When the
    client leaves, the iterator is closed, and with it the job.

    Parameters
    ----------
    frames : whole frames; the iterator is closed in any case.
    unpack : send the payloads of frames of bytes alone, as a file.
    headers : of the answer.
    """

    def __init__(
        self,
        frames: AsyncIterator[bytes],
        *,
        unpack: bool = False,
        kind: str = FRAMES,
        headers: tuple[tuple[bytes, bytes], ...] = (),
    ) -> None:
        self._frames, self._unpack = cast(AsyncGenerator[bytes, None], frames), unpack
        self._headers = [(b"content-type", kind.encode()), *headers]

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer."""
        await while_there(receive, lambda: self._send(scope, receive, send))

    async def _send(self, scope: Scope, receive: Receive, send: Send) -> None:
        begun = False
        async with aclosing(self._frames) as frames:
            async for piece in frames:
                kind, payload = unframed(piece)
                if kind == "X" and not begun:
                    await error_answer(json.loads(payload))(scope, receive, send)
                    return
                if kind == "X" and self._unpack:
                    # A file that ends early must not look whole: the connection is broken off instead.
                    return
                if self._unpack and kind != "B":
                    continue
                if not begun:
                    begun = True
                    await send({"type": "http.response.start", "status": 200, "headers": self._headers})
                body = payload if self._unpack else piece
                await send({"type": "http.response.body", "body": body, "more_body": True})
                # Frames that are all there, and a client that is not, would let nobody else have a turn.
                await asyncio.sleep(0)
        if not begun:
            await send({"type": "http.response.start", "status": 200, "headers": self._headers})
        await send({"type": "http.response.body", "body": b"", "more_body": False})


def error_answer(error: dict[str, Any]) -> Json:
    """An error as the whole answer."""
    return Json({"error": error}, STATUS.get(str(error.get("code")), 400))


async def while_there(receive: Receive, work: Callable[[], Awaitable[None]]) -> None:
    """Do some work for as long as the client is there; then it is cancelled."""

    async def left() -> None:
        message: Message = {"type": "http.request"}
        while message["type"] != "http.disconnect":
            message = await receive()

    doing, leaving = asyncio.ensure_future(work()), asyncio.ensure_future(left())
    try:
        await asyncio.wait({doing, leaving}, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in (doing, leaving):
            if not task.done():
                task.cancel()
        results = await asyncio.gather(doing, leaving, return_exceptions=True)
    if isinstance(results[0], Exception):
        raise results[0]
