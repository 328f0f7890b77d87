"""The page's files as they are sent: scripts without the lines that are comments alone, which are a third of them.

Every line keeps its number, so that what a browser reports is found in the file.
"""

from __future__ import annotations

import os
import re
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

from starlette.responses import Response
from starlette.staticfiles import StaticFiles

COMMENTS: Final = re.compile(r"^[ \t]*(?://[^\n]*|/\*\*(?:(?!\*/)[\s\S])*\*/[ \t]*)$", re.MULTILINE)
"""Lines of nothing but a comment. Types within a line of code stay."""


class PageFiles(StaticFiles):
    """The files of a folder; of ``.js`` files the code."""

    def file_response(
        self, full_path: str | os.PathLike[str], stat_result: os.stat_result, *given: Any, **named: Any
    ) -> Response:
        """The response to a request for a file."""
        if str(full_path).endswith(".js"):
            return Response(code_of(str(full_path), stat_result.st_mtime_ns), media_type="text/javascript")
        return super().file_response(full_path, stat_result, *given, **named)


@lru_cache(256)
def code_of(path: str, changed: int) -> bytes:
    """A script without its comments, as of a time of change."""
    text = Path(path).read_text("utf-8")
    return COMMENTS.sub(lambda found: "\n" * found[0].count("\n"), text).encode()
