"""Html: one page in one file that loads nothing, runs nothing and is the same bytes every time.

A page has no script and no address of another place, and its policy forbids both to whatever might slip in.
Every word that comes from a file is escaped by the functions here: what is HTML already is :class:`Markup`,
what is not is escaped, and there is no other way in.
"""

from __future__ import annotations

import base64
import re
from collections.abc import Iterable, Sequence
from typing import TypeAlias

from lampyris.errors import InternalFault
from lampyris.report.html.page_style import CSS
from lampyris.report.html.table import Tab

POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'"
"""What the page itself forbids the browser: any request, any script, any form."""
ELEMENTS = (
    *(
        "a",
        "b",
        "br",
        "caption",
        "code",
        "dd",
        "details",
        "div",
        "dl",
        "dt",
        "em",
        "figcaption",
        "figure",
        "h2",
    ),
    *(
        "h3",
        "h4",
        "header",
        "img",
        "li",
        "nav",
        "ol",
        "p",
        "pre",
        "section",
        "small",
        "span",
        "strong",
        "sub",
    ),
    *("h1", "summary", "sup", "table", "tbody", "td", "th", "thead", "tr", "ul", "main", "footer"),
)
"""All that a page is made of."""
_EMPTY = frozenset(("br", "img"))
_NAME = re.compile(r"[a-z][a-z0-9-]*")
_KINDS = ("image/webp", "image/png", "image/gif")
_LONG = 44
"""Characters from which on a cell's words may be broken into lines."""
_INTERVAL = re.compile(r"(.+?) (\[[^\[\]]*\](?: n \d+)?)")


class Markup(str):
    """Text that is HTML already; made by the functions of this file only."""

    __slots__ = ()


Inside: TypeAlias = object
"""What may stand in an element: :class:`Markup` as it is, None as nothing, all else as its text, escaped."""


def text(value: object) -> Markup:
    """Any value as text: escaped, and without what a browser would obey (control and direction marks)."""
    if isinstance(value, Markup):
        return value
    if value is None:
        return Markup("")
    words = str(value)
    if not words.isprintable():
        words = "".join(c if c.isprintable() or c == "\n" else repr(c)[1:-1] for c in words)
    for plain, escaped in (("&", "&amp;"), ("<", "&lt;"), (">", "&gt;"), ('"', "&quot;"), ("'", "&#39;")):
        words = words.replace(plain, escaped)
    return Markup(words)


def join(parts: Iterable[Inside], between: str = "") -> Markup:
    """Several things, one after the other."""
    return Markup(text(between).join(text(p) for p in parts))


def tag(name: str, *inside: Inside, **attributes: str | int | bool | None) -> Markup:
    """An element.

    Parameters
    ----------
    name : one of :data:`ELEMENTS`.
    attributes : ``class_`` for ``class``, ``_`` for ``-``; True: without a value; None and False: not there.

    Raises
    ------
    InternalFault : an element or attribute that no page of ours has.
    """
    if name not in ELEMENTS:
        raise InternalFault("HTML", f"element {name!r}", allowed=" ".join(sorted(ELEMENTS)))
    words = [name]
    for key, value in attributes.items():
        attribute = key.rstrip("_").replace("_", "-")
        link = attribute in ("src", "href") and not str(value).startswith(("data:image/", "#"))
        if not _NAME.fullmatch(attribute) or attribute.startswith("on") or link:
            raise InternalFault("HTML", f"attribute {attribute}={str(value)[:40]!r} of {name}")
        if value is not None and value is not False:
            words.append(attribute if value is True else f'{attribute}="{text(value)}"')
    start = f"<{' '.join(words)}>"
    return Markup(start if name in _EMPTY else f"{start}{join(inside)}</{name}>")


def paragraph(*inside: Inside) -> Markup:
    """A paragraph."""
    return tag("p", *inside)


def section(anchor: str, title: Inside, *inside: Inside, level: int = 2) -> Markup:
    """A section with its heading; ``anchor`` is what a link within the page names."""
    return tag("section", tag(f"h{level}", title), *inside, id=anchor)


def fold(title: Inside, *inside: Inside) -> Markup:
    """Something long, closed until it is asked for."""
    return tag("details", tag("summary", title), *inside)


def facts(pairs: Iterable[tuple[Inside, Inside]]) -> Markup:
    """A list of what is what; pairs without a second are left out."""
    rows = (tag("div", tag("dt", name), tag("dd", value)) for name, value in pairs if value not in (None, ""))
    return tag("dl", *rows, class_="facts")


def items(parts: Iterable[Inside]) -> Markup:
    """A list."""
    return tag("ul", *(tag("li", part) for part in parts))


def table(tab: Tab, *, classes: Sequence[str] = ()) -> Markup:
    """A table, with its title above, its note below, in a box of its own that scrolls when it is wide.

    The first column names the rows. ``12.3 [11.9, 12.8]`` has its interval in smaller figures.

    Parameters
    ----------
    classes : a word for each row; ``verdict-...`` are coloured. Empty: none.
    """
    sides = ["right" if side == "r" else None for side in tab.align]
    head = tag("tr", *(tag("th", h, scope="col", class_=s) for h, s in zip(tab.header, sides, strict=True)))
    rows = []
    for k, texts in enumerate(tab.texts()):
        first = tag("th", _cell(texts[0]), scope="row", class_=sides[0])
        rest = (
            tag("td", _cell(t), class_="long" if len(t) > _LONG else s)
            for t, s in zip(texts[1:], sides[1:], strict=True)
        )
        rows.append(tag("tr", first, *rest, class_=(classes[k] or None) if classes else None))
    whole = tag(
        "table", tag("caption", tag("span", tab.title)), tag("thead", head), tag("tbody", *join_lines(rows))
    )
    note = tag("p", tab.note, class_="note") if tab.note else ""
    return tag(
        "div",
        tag("div", whole, class_="scroll", tabindex=0),
        Markup(note),
        class_="tab",
        id=f"tab-{tab.name}",
    )


def join_lines(parts: Iterable[Markup]) -> Iterable[Markup]:
    """Each on a line of its own, so that two pages can be compared line by line."""
    for part in parts:
        yield Markup("\n" + part)


def _cell(words: str) -> Markup:
    match = _INTERVAL.fullmatch(words)
    if match is None:
        return text(words)
    return join((match[1], Markup(" "), tag("small", match[2])))


def figure(drawing: Markup, caption: Inside, *, wide: bool = False) -> Markup:
    """A drawing with what it shows; ``wide`` ones scroll in their own box on a narrow screen."""
    box = tag("div", drawing, class_="scroll drawing wide" if wide else "scroll drawing", tabindex=0)
    return tag("figure", box, tag("figcaption", caption))


def image(data: bytes, kind: str, alt: str, *, width: int | None = None, height: int | None = None) -> Markup:
    """A picture or film, held in the page itself.

    Parameters
    ----------
    kind : ``image/webp``, ``image/png`` or ``image/gif``.
    alt : what it shows, for who cannot see it.
    width, height : pixels, so that the page does not jump when it appears.
    """
    if kind not in _KINDS:
        raise InternalFault("HTML", f"kind {kind!r}", allowed=", ".join(_KINDS))
    source = f"data:{kind};base64,{base64.b64encode(data).decode('ascii')}"
    return tag("img", src=source, alt=alt, width=width, height=height)


def page(title: str, *inside: Inside, foot: Inside = "") -> str:
    """A whole page, from its document type to its end."""
    head = (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="color-scheme" content="light dark">\n'
        f"<title>{text(title)}</title>\n<style>\n{CSS}</style>\n</head>\n<body>\n"
    )
    main = tag("main", tag("h1", title), *join_lines(text(part) for part in inside))
    return f"{head}{main}\n{tag('footer', foot)}\n</body>\n</html>\n"
