"""A strict reader of our pages: what a browser would make of them, and what it would fetch or run."""

from __future__ import annotations

from html.parser import HTMLParser

from lampyris.report.html.render import environment

POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'"
ELEMENTS = {
    "a", "b", "body", "br", "caption", "code", "dd", "details", "div", "dl", "dt", "em", "figcaption", "figure",
    "footer", "h1", "h2", "h3", "head", "html", "img", "li", "main", "meta", "nav", "p", "pre", "section", "small",
    "span", "style", "summary", "table", "tbody", "td", "th", "thead", "title", "tr", "ul",
}  # fmt: skip
PARTS = "box, cell, facts, figure, fold, image, long_table, table"
SVG = frozenset(("svg", "g", "path", "defs", "use", "text", "tspan", "rect", "clippath", "style"))
VOID = frozenset(("br", "img", "meta", "path", "rect", "use"))


class Reader(HTMLParser):
    """Reads a page and keeps what is wrong with it."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.wrong: list[str] = []
        self.ids: list[str] = []
        self.links: list[str] = []
        self.words: list[str] = []
        self.seen: list[str] = []

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._look(tag, attrs)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._look(tag, attrs)
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if tag in VOID:
            return
        if not self.open or self.open.pop() != tag:
            self.wrong.append(f"</{tag}> closes nothing")

    def handle_data(self, data: str) -> None:
        if self.open[-1:] != ["style"]:
            self.words.append(data)

    def _look(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.seen.append(tag)
        if tag not in ELEMENTS | SVG:
            self.wrong.append(f"<{tag}>")
        for name, value in attrs:
            text = value or ""
            if name.startswith("on") or "javascript:" in text.lower():
                self.wrong.append(f"{name}={text}")
            if name in ("src", "href", "xlink:href"):
                if text.startswith("#"):
                    self.links.append(text[1:])
                elif not text.startswith("data:image/"):
                    self.wrong.append(f"{name}={text}")
            if "url(" in text and "url(#" not in text and name not in ("title", "alt"):
                self.wrong.append(f"{name}={text}")
            if name == "id":
                self.ids.append(text)


def read(page: str) -> Reader:
    """A page read to its end; fails if it is no sound page, or would fetch or run anything."""
    reader = Reader()
    reader.feed(page)
    reader.close()
    assert not reader.wrong, reader.wrong[:5]
    assert not reader.open, reader.open
    assert len(set(reader.ids)) == len(reader.ids), sorted(reader.ids)
    assert set(reader.links) <= set(reader.ids), set(reader.links) - set(reader.ids)
    assert page.startswith("<!DOCTYPE html>")
    assert f'http-equiv="Content-Security-Policy" content="{POLICY}"' in page
    return reader


def part(body: str, **values: object) -> str:
    """What a template of this body gives."""
    wanted = f'{{% from "report/html/parts.html.j2" import {PARTS} %}}'
    return environment().from_string(wanted + body).render(values)


def page(title: str, body: str, **values: object) -> str:
    """A whole page of a template with this body."""
    block = f"{{% block main %}}{body}{{% endblock %}}"
    return part(f'{{% extends "report/html/page.html.j2" %}}{block}', title=title, foot="", **values)
