"""Shipped: the files of the page, read once when the server starts."""

from __future__ import annotations

import gzip
from collections.abc import Mapping
from importlib.resources import files
from typing import Final

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


def static_files() -> dict[str, tuple[str, bytes, bytes]]:
    """Type, bytes and bytes in gzip of each file of the page, by name: no name is ever part of a path."""
    found = {}
    for file in sorted(files("lampyris.app").joinpath("static").iterdir(), key=lambda file: file.name):
        kind = TYPES.get(file.name.rpartition(".")[2])
        if kind and file.is_file():
            data = file.read_bytes()
            found[file.name] = (kind, data, gzip.compress(data, 9, mtime=0))
    return found
