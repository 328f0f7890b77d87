"""Modules of the page as one script, for a file that loads nothing.

Each module becomes a function that returns what it exports, in the order in which they import each other. No bundler is
needed for that: the modules have imports of names at their top and exports of declarations, and anything else is refused.
"""

from __future__ import annotations

import re
from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import Final

from lampyris.app.server.scripts import stripped_script, stripped_style
from lampyris.errors import InternalFault

IMPORT: Final = re.compile(r'^import ?\{([^}]*)\} ?from ?"([./a-z]+)";$', re.MULTILINE)
EXPORT: Final = re.compile(r"^export (?=(?:async )?(?:function ?\*?|class|const) ?(\w+))", re.MULTILINE)
OTHER: Final = re.compile(r"^(?:import|export)\b.*|\bimport\(", re.MULTILINE)
NEVER: Final = re.compile(r"</(?:script|style)|<!--", re.IGNORECASE)
"""What would end an element in the middle of its text."""


def folder(name: str) -> Traversable:
    """A folder of the app's files: ``static`` or ``replay``."""
    return files("lampyris.app").joinpath(name)


@cache
def script(entry: str) -> str:
    """A module of this folder with everything that it imports.

    Raises
    ------
    InternalFault : ``BUNDLE``: a module that is written in another way.
    """
    done: dict[str, str] = {}
    _add("replay", entry, done, ())
    text = '"use strict";\n' + "\n".join(done.values()) + "\n"
    return _whole(text, entry)


def _add(where: str, name: str, done: dict[str, str], above: tuple[str, ...]) -> None:
    """A module and what it imports; a module is known by its folder and its name, so that two folders may have one of a name."""
    own = f"{where}/{name}"
    if own in done:
        return
    text = stripped_script(folder(where).joinpath(name).read_text("utf-8"))
    heads = []
    for words, path in IMPORT.findall(text):
        part, _, base = path.rpartition("/")
        inner = part.removeprefix("..").strip("./") or where
        file = f"{inner}/{base}"
        if file in (*above, own):
            heads += [_later(word.strip(), file) for word in words.split(",")]
            continue
        _add(inner, base, done, (*above, own))
        heads.append(f"const {{{words.replace(' as ', ': ')}}} = {_variable(file)};")
    body = IMPORT.sub("", text)
    names = EXPORT.findall(body)
    body = EXPORT.sub("", body)
    if strange := OTHER.search(body):
        raise InternalFault("BUNDLE", f"{own}: {strange[0]!r:.80}")
    body = re.sub(r"\n{2,}", "\n", body).strip("\n")
    give = f"return {{ {', '.join(names)} }};"
    done[own] = "\n".join([f"const {_variable(own)} = (() => {{", *heads, body, give, "})();"])


def _later(word: str, file: str) -> str:
    """A function of a module that imports this one, and so is there only when the function is called."""
    if " as " in word or not word[:1].islower():
        raise InternalFault("BUNDLE", f"{word} of {file}, which imports the module that wants it")
    return f"const {word} = (...given) => {_variable(file)}.{word}(...given);"


def _variable(file: str) -> str:
    return "$" + file.removesuffix(".js").replace("-", "_").replace("/", "$")


@cache
def charts() -> str:
    """The library of the charts, with its licence."""
    return _whole(folder("static").joinpath("uplot.js").read_text("utf-8"), "uplot.js")


@cache
def style(*names: str) -> str:
    """Style sheets of the page, and after them that of this folder."""
    parts = [stripped_style(folder("static").joinpath(name).read_text("utf-8")) for name in names]
    parts.append(stripped_style(folder("replay").joinpath("viewer.css").read_text("utf-8")))
    return _whole(re.sub(r"\n{2,}", "\n", "\n".join(parts)), "viewer.css")


def _whole(text: str, name: str) -> str:
    if found := NEVER.search(text):
        raise InternalFault("BUNDLE", f"{name} has {found[0]!r}")
    return text
