"""Shipped: what is the same for every page, read once: its files, as they are and in gzip."""

from __future__ import annotations

import gzip
from collections.abc import Mapping
from importlib.resources import files
from typing import Final

from starlette.requests import Request
from starlette.responses import Response

TYPES: Final[Mapping[str, str]] = {
    "html": "text/html; charset=utf-8",
    "js": "text/javascript; charset=utf-8",
    "css": "text/css; charset=utf-8",
    "svg": "image/svg+xml",
    "png": "image/png",
    "webp": "image/webp",
    "json": "application/json",
    "txt": "text/plain; charset=utf-8",
}
"""What is served of the page's folder."""


PART_CSP: Final = "default-src 'none'; frame-ancestors 'none'"
"""Of what is a part of a page and no document: what applies is the page's. Shorter, sixty times over."""

Shipped = tuple[str, bytes, bytes]
"""Type, bytes and bytes in gzip."""


def both(kind: str, data: bytes) -> Shipped:
    """The same as it is and in gzip."""
    return kind, data, gzip.compress(data, 9, mtime=0)


def static_files() -> dict[str, Shipped]:
    """Each file of the page by name: no name is ever part of a path."""
    found = {}
    for file in sorted(files("lampyris.app").joinpath("static").iterdir(), key=lambda file: file.name):
        kind = TYPES.get(file.name.rpartition(".")[2])
        if kind and file.is_file():
            found[file.name] = both(kind, file.read_bytes())
    return found


def shipped(request: Request, kind: str, plain: bytes, packed: bytes) -> Response:
    """An answer in gzip for clients that accept it.

    Only of what is the same for everybody, the files and what there is to choose from: what is compressed
    with a secret beside something that a stranger chose can leak the secret.
    """
    part = kind.startswith(("text/javascript", "text/css"))
    heads = {"Content-Security-Policy": PART_CSP} if part else {}
    if "gzip" in request.headers.get("accept-encoding", ""):
        return Response(packed, media_type=kind, headers={**heads, "Content-Encoding": "gzip"})
    return Response(plain, media_type=kind, headers=heads)
