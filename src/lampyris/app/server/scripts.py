"""The page's files as they are sent: scripts and styles without comments and needless spaces, which are half of them.

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

KINDS: Final = {".js": "text/javascript", ".css": "text/css"}
"""Files that are sent without comments, and their types; a module is UTF-8, a style sheet what its page is."""

WORD: Final = re.compile(
    r"""(?P<comment>//[^\n]*|/\*(?:(?!\*/)[\s\S])*\*/)
    |(?P<text>"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*')
    |(?P<space>[ \t\n]+)
    |(?P<word>[\w$]+)
    |(?P<sign>[\s\S])""",
    re.VERBOSE,
)
"""What a script is made of, but for templates and regular expressions, which need to know what is before them."""
PATTERN: Final = re.compile(r"/(?![*/])(?:\\.|\[(?:\\.|[^\]\\\n])*\]|[^/\\\[\n])+/[a-z]*")
"""A regular expression, where a slash is no division."""
NOT_OURS: Final = "uplot"
"""How the files of others begin: they are sent as they are, with their licence."""
NEEDS_SPACE: Final = re.compile(r"[\w$] [\w$.]|[+-] [+-]|/ /")
"""The characters on both sides of a space that cannot be left out."""
STYLE_SPACE: Final = re.compile(
    r"""(?P<text>"(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])*')|[ \t]*(?P<sign>[{}])[ \t]*|[ \t]*\n[ \t]*"""
    r"""|(?<=[:,;])[ \t]+"""
)
"""Spaces of a style sheet that mean nothing, and its texts."""
BEFORE_PATTERN: Final = frozenset("(,=:[!&|?{};+-*%<>~^") | {
    "", "return", "typeof", "case", "in", "of", "do", "else", "void", "await", "yield", "delete",
}  # fmt: skip
"""Signs and words behind which a slash begins a regular expression."""


class PageFiles(StaticFiles):
    """The files of a folder; of scripts and styles the code."""

    def file_response(
        self, full_path: str | os.PathLike[str], stat_result: os.stat_result, *given: Any, **named: Any
    ) -> Response:
        """The response to a request for a file."""
        path = Path(full_path)
        kind = KINDS.get(path.suffix)
        if kind is not None and not path.name.startswith(NOT_OURS):
            return Response(code_of(str(full_path), stat_result.st_mtime_ns), headers={"content-type": kind})
        return super().file_response(full_path, stat_result, *given, **named)


@lru_cache(256)
def code_of(path: str, changed: int) -> bytes:
    """A file without its comments, as of a time of change."""
    text = Path(path).read_text("utf-8")
    made = stripped_script(text) if path.endswith(".js") else stripped_style(text)
    return made.encode()


def stripped_style(text: str) -> str:
    """A style sheet without comments and needless spaces; its lines keep their numbers, and its texts stay."""
    bare = re.sub(r"/\*[\s\S]*?\*/", lambda found: "\n" * found[0].count("\n"), text)
    return STYLE_SPACE.sub(lambda found: found["text"] or found["sign"] or found[0].strip(" \t"), bare)


def stripped_script(text: str) -> str:
    """A script without comments and needless spaces; its lines keep their numbers, and texts and patterns stay."""
    out: list[str] = []
    at, before = 0, ""
    spaced = False  # a space or a comment is behind `before`, in the same line
    depths: list[int] = []  # open braces within each ${...} of a template that is open
    while at < len(text):
        found = WORD.match(text, at)
        assert found is not None
        kind, piece = str(found.lastgroup), found[0]
        if kind in ("space", "comment"):
            at += len(piece)
            lines = piece.count("\n")
            # A line's end ends a statement; more than one are kept for their numbers.
            out += ["\n"] * lines
            spaced = True
            continue
        if kind == "sign" and piece == "/" and before in BEFORE_PATTERN:
            pattern = PATTERN.match(text, at)
            piece = pattern[0] if pattern is not None else piece
        elif kind == "sign" and (piece == "`" or (piece == "}" and depths and depths[-1] == 0)):
            if piece == "}":
                depths.pop()
            piece, inside = _template(text, at)
            if inside:
                depths.append(0)
            out.append(piece)
            at, before, spaced = at + len(piece), "{" if inside else "`", False
            continue
        elif kind == "sign" and depths and piece in "{}":
            depths[-1] += 1 if piece == "{" else -1
        at += len(piece)
        if spaced and out and out[-1] != "\n":
            # A pattern ends like a word: with its flags.
            last = before if len(before) == 1 else "w"
            out += [" "] if NEEDS_SPACE.match(f"{last} {piece[0]}") else []
        out.append(piece)
        before, spaced = piece, False
    return "".join(out)


def _template(text: str, at: int) -> tuple[str, bool]:
    """A template from its beginning, or from the end of what is computed within it; whether more is computed within it."""
    end = at + 1
    while end < len(text):
        if text[end] == "\\":
            end += 2
        elif text[end] == "`":
            return text[at : end + 1], False
        elif text.startswith("${", end):
            return text[at : end + 2], True
        else:
            end += 1
    return text[at:], False
