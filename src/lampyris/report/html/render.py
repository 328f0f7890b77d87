"""Pages from templates: one file that loads nothing, runs nothing and is the same bytes every time.

A template (``*.html.j2`` beside its module) says what a page looks like, its module what stands in it. Jinja2
escapes every value; only figures of :mod:`lampyris.report.charts.svg` are marked safe, in ``parts.html.j2``.
"""

from __future__ import annotations

import base64
import re
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from jinja2 import Environment

_INTERVAL = re.compile(r"(.+?) (\[[^\[\]]*\](?: n \d+)?)")


class PageFigure(NamedTuple):
    """A drawing (SVG) with what it shows; ``wide`` ones scroll in their own box on a narrow screen."""

    drawing: str
    caption: str
    wide: bool = False


def render(template: str, **values: object) -> str:
    """A page, or a part of one.

    Parameters
    ----------
    template : its file, as a path within the package.
    values : what its expressions name.
    """
    return environment().get_template(template).render(values)


@cache
def environment() -> Environment:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    made = Environment(
        loader=PackageLoader("lampyris", ""),
        autoescape=True,
        finalize=printable,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    made.filters |= {"data_uri": data_uri, "split_interval": split_interval}
    return made


def printable(value: object) -> object:
    """A value as it goes into a page: None as nothing, and no text that a browser would obey (control and
    direction marks)."""
    if value is None:
        return ""
    if hasattr(value, "__html__"):
        return value
    words = str(value)
    if words.isprintable():
        return words
    return "".join(c if c.isprintable() or c == "\n" else repr(c)[1:-1] for c in words)


def split_interval(words: str) -> tuple[str, str]:
    """``12.3 [11.9, 12.8]`` as its value and its interval, which is set in smaller figures."""
    match = _INTERVAL.fullmatch(words)
    return (match[1], match[2]) if match else (words, "")


def data_uri(data: bytes, kind: str) -> str:
    """A picture or film, held in the page itself; ``kind`` is its media type."""
    return f"data:{kind};base64,{base64.b64encode(data).decode('ascii')}"
