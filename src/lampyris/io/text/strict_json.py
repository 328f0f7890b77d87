"""JSON read strictly (RFC 8259): one object, plain data, every mistake with its line, column and pointer.

Python's own reader takes ``NaN``, turns ``1e999`` into infinity, lets the last of two equal keys win without
a word, and gives up with a RecursionError on deep nesting. So the text is read here, value by value: some
700,000 values a second, where Python's takes 9 million. Places are not kept for every value, they would
cost more memory than the data: a value's place is looked up on demand, by walking to it through
the tables and lists that it is in.
"""

from __future__ import annotations

import json
import re
from array import array
from dataclasses import dataclass, field
from typing import Any, NoReturn, TypeAlias

from lampyris.errors import FileError, LimitError
from lampyris.io.text.strict_yaml import KeyPath, Place, shown

MAX_BYTES = 2**24
MAX_DEPTH = 32
MAX_VALUES = 500_000
MAX_DIGITS = 30

_SPACE = re.compile(r"[ \t\n\r]*")
_NUMBER = re.compile(r"-?(?:0|[1-9][0-9]*)(\.[0-9]+)?([eE][-+]?[0-9]+)?")
_WORD = re.compile(r"-?[A-Za-z0-9_.+]+")
_CONSTANTS = {"true": True, "false": False, "null": None}
_NOT_FINITE = ("NaN", "Infinity", "-Infinity", "nan", "inf", "-inf", "-NaN")
# Control characters, and halves of a surrogate pair that stand alone.
_ODD = re.compile("[\x00-\x1f\x7f\ud800-\udfff]")
_scan_string = json.decoder.scanstring  # type: ignore[attr-defined]
_scan_value = json.JSONDecoder(strict=False).raw_decode
_Parts: TypeAlias = "tuple[dict[str | int, int] | None, array[int], array[int]]"
"""Of a table or list: number of each part by key (None: a list), where each begins, where its value does."""


def pointer(key_path: KeyPath) -> str:
    """The path to a value as a JSON pointer (RFC 6901), such as ``/start/0``; ``/`` for the whole document."""
    return "/" + "/".join(str(step).replace("~", "~0").replace("/", "~1") for step in key_path)


@dataclass(frozen=True, slots=True, eq=False)
class JsonDocument:
    """An object read from JSON; where each value stands is found out when asked.

    Parameters
    ----------
    data : dict, list, str, int, float, bool and None.
    where : the file as the caller named it.
    text : the file's characters.
    """

    data: dict[str, Any]
    where: str
    text: str
    _known: dict[int, _Parts] = field(default_factory=dict, repr=False)

    def at(self, *key_path: str | int) -> str:
        """``FILE:LINE:COLUMN`` of a value; of what it should be in, where there is no such value."""
        return _spot(self.where, self.place(*key_path))

    def at_key(self, *key_path: str | int) -> str:
        """``FILE:LINE:COLUMN`` of a key."""
        return _spot(self.where, _place(self.text, self._walk(key_path)[0]))

    def place(self, *key_path: str | int) -> Place:
        """Line and column, from 1."""
        return _place(self.text, self._walk(key_path)[1])

    def _walk(self, key_path: KeyPath) -> tuple[int, int]:
        """Positions of the last key (or item) on a path and of its value; of the parent where it ends early.

        What is passed by on the way to one place is not gone through again on the way to another: a file may
        have thousands of mistakes.
        """
        key = at = _skip(self.text, 0)
        for step in key_path:
            if self.text[at] not in "{[":
                break
            if at not in self._known:
                self._known[at] = _parts(self.text, at)
            names, keys, values = self._known[at]
            number = step if names is None else names.get(step)
            if not isinstance(number, int) or not 0 <= number < len(values):
                break
            key, at = keys[number], values[number]
        return key, at


def read_json(
    text: bytes,
    where: str,
    *,
    max_bytes: int = MAX_BYTES,
    max_depth: int = MAX_DEPTH,
    max_values: int = MAX_VALUES,
) -> JsonDocument:
    """Read one JSON document that is an object.

    Parameters
    ----------
    text : the file's bytes: UTF-8, a byte order mark is accepted.
    where : what to call the file in messages.
    max_bytes, max_depth, max_values : what is larger, deeper or has more values is refused on the way.

    Raises
    ------
    FileError : JSON_SYNTAX, JSON_SHAPE (not an object), JSON_DUPLICATE, JSON_NUMBER (not finite, too many
        digits), JSON_TEXT (control characters, half a surrogate pair).
    LimitError : JSON_SIZE, JSON_DEPTH.
    """
    if len(text) > max_bytes:
        raise LimitError(
            "JSON_SIZE", f"{len(text):,} bytes", where=where, allowed=f"at most {max_bytes:,} bytes"
        )
    if text.count(b",") >= max_values:
        # Before anything is made of them. Commas in texts count as well; no text has half a million.
        raise LimitError("JSON_SIZE", "too many values", where=where, allowed=f"at most {max_values:,}")
    return _Reader(_decoded(text, where), where, max_depth, max_values).document()


def _decoded(raw: bytes, where: str) -> str:
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise FileError("JSON_SYNTAX", "this is UTF-16", where=f"{where}:1:1", todo="save it as UTF-8")
    try:
        return raw.decode("utf-8").removeprefix("\ufeff")
    except UnicodeDecodeError as problem:
        before = raw[: problem.start].decode("utf-8")
        what = f"byte 0x{raw[problem.start]:02x} is not UTF-8"
        place = _spot(where, _place(before, len(before)))
        raise FileError("JSON_SYNTAX", what, where=place, todo="save it as UTF-8") from None


def _place(text: str, position: int) -> Place:
    return text.count("\n", 0, position) + 1, position - text.rfind("\n", 0, position)


def _spot(where: str, place: Place) -> str:
    return f"{where}:{place[0]}:{place[1]}"


def _skip(text: str, position: int) -> int:
    if text[position : position + 1] not in " \t\n\r":
        return position
    found = _SPACE.match(text, position)
    return position if found is None else found.end()


def _parts(text: str, at: int) -> _Parts:
    """What is in the table or list that begins at a position.

    The text has been read before, so it is known to be right; Python's reader steps over what is within.
    """
    names: dict[str | int, int] | None = {} if text[at] == "{" else None
    close = "]" if names is None else "}"
    keys, values = array("q"), array("q")
    position = _skip(text, at + 1)
    while text[position] != close:
        keys.append(position)
        if names is not None:
            name, position = _scan_string(text, position + 1, False)
            names.setdefault(name, len(names))
            position = _skip(text, _skip(text, position) + 1)
        values.append(position)
        position = _skip(text, _scan_value(text, position)[1])
        position = _skip(text, position + 1) if text[position] == "," else position
    return names, keys, values


class _Reader:
    """Reads values one after the other and knows the path to the one it is at."""

    def __init__(self, text: str, where: str, max_depth: int, max_values: int) -> None:
        self._text = text
        self._where = where
        self._max_depth = max_depth
        self._left = max_values
        self._max_values = max_values
        self._key_path: list[str | int] = []
        self._begins = {'"': self._string, "{": self._object, "[": self._list}

    def document(self) -> JsonDocument:
        """The document, and the check that nothing follows it."""
        begin = _skip(self._text, 0)
        if begin == len(self._text):
            self._refuse("JSON_SHAPE", "the file is empty", begin, "one object: { ... }")
        if self._text[begin] != "{":
            kind = "a list" if self._text[begin] == "[" else "no object"
            self._refuse("JSON_SHAPE", kind, begin, "one object: { ... }")
        data, end = self._object(begin)
        end = _skip(self._text, end)
        if end < len(self._text):
            self._syntax(end, "the end of the file")
        return JsonDocument(data, self._where, self._text)

    def _value(self, at: int) -> tuple[Any, int]:
        """The value that begins there, and where it ends."""
        self._left -= 1
        if self._left < 0:
            self._limit("JSON_SIZE", "too many values", at, f"at most {self._max_values:,}")
        text = self._text
        begins = self._begins.get(text[at : at + 1])
        if begins is not None:
            return begins(at)
        number = _NUMBER.match(text, at)
        if number is not None:
            return self._number(number), number.end()
        word = _WORD.match(text, at)
        if word is not None and word[0] in _CONSTANTS:
            return _CONSTANTS[word[0]], word.end()
        if word is not None and word[0] in _NOT_FINITE:
            self._refuse("JSON_NUMBER", f"{word[0]} is not finite", at, "finite numbers")
        return self._syntax(at, "a value")

    def _number(self, found: re.Match[str]) -> int | float:
        text = found[0]
        if self._text[found.end() : found.end() + 1].isalnum():
            self._syntax(found.end(), "the number to end here; it has no leading zeros and no unit")
        if found.lastindex is None:
            if len(text) > MAX_DIGITS and len(text.lstrip("-")) > MAX_DIGITS:
                what = f"a whole number of {len(text):,} digits"
                self._refuse("JSON_NUMBER", what, found.start(), f"at most {MAX_DIGITS}")
            return int(text)
        value = float(text)
        if value in (float("inf"), float("-inf")):
            self._refuse("JSON_NUMBER", f"{text[:40]} is not finite", found.start(), "numbers up to 1.7e308")
        return value

    def _string(self, at: int) -> tuple[str, int]:
        try:
            value, end = _scan_string(self._text, at + 1, False)
        except json.JSONDecodeError as problem:
            if problem.msg.startswith("Unterminated"):
                self._refuse("JSON_SYNTAX", 'a text without its closing "', at)
            self._refuse("JSON_SYNTAX", "an escape that JSON does not have", problem.pos)
        odd = _ODD.search(value)
        if odd is not None:
            number = ord(odd[0])
            kind = "half of a surrogate pair" if number >= 0xD800 else "a control character"
            allowed = "text without line breaks, other control characters and lone surrogates"
            self._refuse("JSON_TEXT", f"U+{number:04X}, {kind}", at, allowed)
        return value, end

    def _list(self, at: int) -> tuple[list[Any], int]:
        self._deeper(at)
        text, items = self._text, []
        self._key_path.append(0)
        at = _skip(text, at + 1)
        while text[at : at + 1] != "]":
            value, end = self._value(at)
            items.append(value)
            self._key_path[-1] = len(items)
            at = self._after(end, "]")
        self._key_path.pop()
        return items, at + 1

    def _object(self, at: int) -> tuple[dict[str, Any], int]:
        self._deeper(at)
        text, begin = self._text, at
        table: dict[str, Any] = {}
        self._key_path.append("")
        at = _skip(text, at + 1)
        while text[at : at + 1] != "}":
            if text[at : at + 1] != '"':
                self._key_path[-1:] = []
                self._syntax(at, 'a key in " "')
            key, end = self._string(at)
            self._key_path[-1] = key
            if key in table:
                first, _ = _place(text, self._first(begin, key))
                lines = f"on lines {first} and {_place(text, at)[0]}"
                self._refuse("JSON_DUPLICATE", f"{shown(key)} {lines}", at, "each key once")
            end = _skip(text, end)
            if text[end : end + 1] != ":":
                self._syntax(end, ":")
            table[key], end = self._value(_skip(text, end + 1))
            at = self._after(end, "}")
        self._key_path.pop()
        return table, at + 1

    def _first(self, begin: int, key: str) -> int:
        """Where a key of the object that begins there was met for the first time."""
        at = _skip(self._text, begin + 1)
        while True:
            name, end = _scan_string(self._text, at + 1, False)
            if name == key:
                return at
            end = _scan_value(self._text, _skip(self._text, _skip(self._text, end) + 1))[1]
            at = _skip(self._text, _skip(self._text, end) + 1)

    def _after(self, at: int, close: str) -> int:
        """Past the comma to the next item, or at the closing bracket."""
        text = self._text
        at = _skip(text, at)
        if text[at : at + 1] == close:
            return at
        if text[at : at + 1] != ",":
            self._syntax(at, f", or {close}")
        comma, at = at, _skip(text, at + 1)
        if text[at : at + 1] == close:
            self._refuse("JSON_SYNTAX", f"a comma before {close}", comma, todo="take the comma away")
        return at

    def _deeper(self, at: int) -> None:
        if len(self._key_path) >= self._max_depth:
            self._limit("JSON_DEPTH", "nested too deep", at, f"{self._max_depth} levels")

    def _syntax(self, at: int, expected: str) -> NoReturn:
        found = self._text[at : at + 1]
        what = f"unexpected {shown(found)}" if found else "the file ends too early"
        todo = "JSON has no comments" if found in ("/", "#") else ""
        self._refuse("JSON_SYNTAX", what, at, f"expected {expected}", todo)

    def _at(self, at: int) -> str:
        here = _spot(self._where, _place(self._text, at))
        return f"{here}: {_short(pointer(tuple(self._key_path)))}" if self._key_path else here

    def _limit(self, code: str, what: str, at: int, allowed: str) -> NoReturn:
        raise LimitError(code, what, where=self._at(at), allowed=allowed)

    def _refuse(self, code: str, what: str, at: int, allowed: str = "", todo: str = "") -> NoReturn:
        raise FileError(code, what, where=self._at(at), allowed=allowed, todo=todo)


def _short(text: str) -> str:
    """A pointer for a message: printable, and not longer than a line."""
    plain = text if text.isprintable() else ascii(text)[1:-1]
    return plain if len(plain) <= 100 else plain[:97] + "..."
