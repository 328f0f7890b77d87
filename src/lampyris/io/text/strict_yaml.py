"""YAML read strictly: one mapping, plain data, every value with its place in the file.

PyYAML only cuts the text into events; what they mean is decided here by the core schema of YAML 1.2. Its own
loaders follow YAML 1.1, where ``5e-2`` is text, ``010`` is 8, ``1:30`` is 90, ``no`` is False and the last of
two equal keys wins without a word; and they build aliases that unfold to gigabytes. So tags, anchors and
aliases are refused, equal keys are refused with both lines, and a number with a leading zero is refused, as
one reader takes it for octal and the next does not. ``no`` and ``1:30`` are text.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NoReturn, TypeAlias

from lampyris._core.cancellation import uninterrupted
from lampyris.errors import FileError, LimitError

if TYPE_CHECKING:
    from yaml import Event, SafeLoader

MAX_BYTES = 2**16
MAX_DEPTH = 32
MAX_VALUES = 10_000
MAX_DIGITS = 30
KeyPath: TypeAlias = tuple[str | int, ...]
"""The path to a value: keys and indices from the top, such as ``("origin", 2)``."""
Place: TypeAlias = tuple[int, int]
"""Line and column, from 1."""

_UNPRINTABLE = "[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]"
"""What YAML does not call printable; a lone surrogate is such. Compiled where it is used: that takes 4 ms."""
_WORDS: Mapping[str, Any] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
    **dict.fromkeys((".inf", ".Inf", ".INF", "+.inf", "+.Inf", "+.INF"), float("inf")),
    **dict.fromkeys(("-.inf", "-.Inf", "-.INF"), float("-inf")),
    **dict.fromkeys((".nan", ".NaN", ".NAN"), float("nan")),
}
_WHOLE = re.compile(r"[-+]?[0-9]+")
_BASED = re.compile(r"0o([0-7]+)|0x([0-9a-fA-F]+)")
_REAL = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?")


@dataclass(frozen=True, slots=True, eq=False)
class YamlDocument:
    """A mapping read from YAML, and where in the file each value stands.

    Parameters
    ----------
    data : dict, list, str, int, float, bool and None; keys are always text, as they were written.
    places : the place of each value, and so of each part of it, by the path to it.
    key_places : the place of each key, by the path to its value.
    where : the file as the caller named it.
    """

    data: dict[str, Any]
    places: Mapping[KeyPath, Place]
    key_places: Mapping[KeyPath, Place]
    where: str

    def at(self, *key_path: str | int) -> str:
        """``FILE:LINE:COLUMN`` of a value; of what it should be in, where there is no such value."""
        while key_path not in self.places:
            key_path = key_path[:-1]
        return _spot(self.where, self.places[key_path])

    def at_key(self, *key_path: str | int) -> str:
        """``FILE:LINE:COLUMN`` of a key."""
        return _spot(self.where, self.key_places[key_path])

    def error(
        self, code: str, what: str, *key_path: str | int, allowed: str = "", todo: str = ""
    ) -> FileError:
        """A FileError about a value, to be raised."""
        return FileError(code, what, where=self.at(*key_path), allowed=allowed, todo=todo)


def read_yaml(
    text: str | bytes,
    where: str,
    *,
    max_bytes: int = MAX_BYTES,
    max_depth: int = MAX_DEPTH,
    max_values: int = MAX_VALUES,
) -> YamlDocument:
    """Read one YAML document that is a mapping.

    Parameters
    ----------
    text : the file's bytes (UTF-8, a byte order mark is accepted), or text.
    where : what to call the file in messages.
    max_bytes, max_depth, max_values : what is larger, deeper or has more values is refused on the way. PyYAML
        reads some 20,000 values a second.

    Raises
    ------
    FileError : YAML_SYNTAX, YAML_SHAPE (not one mapping), YAML_DUPLICATE, YAML_TAG, YAML_ALIAS, YAML_NUMBER.
    LimitError : YAML_SIZE, YAML_DEPTH.
    """
    size = len(text) if isinstance(text, bytes) else len(text.encode("utf-8", "surrogatepass"))
    if size > max_bytes:
        raise LimitError("YAML_SIZE", f"{size:,} bytes", where=where, allowed=f"at most {max_bytes:,} bytes")
    return _Reader(_decoded(text, where), where, max_depth, max_values).document()


def _decoded(text: str | bytes, where: str) -> str:
    if isinstance(text, bytes):
        raw = text
        if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
            raise _syntax("this is UTF-16", where, (1, 1), "save it as UTF-8")
        try:
            text = raw.decode("utf-8")
        except UnicodeDecodeError as problem:
            before = raw[: problem.start].decode("utf-8")
            value = raw[problem.start]
            raise _syntax(
                f"byte 0x{value:02x} is not UTF-8", where, _place(before), "save it as UTF-8"
            ) from None
    text = text.removeprefix("\ufeff")
    odd = re.search(_UNPRINTABLE, text)
    if odd is not None:
        raise _syntax(f"character U+{ord(odd[0]):04X}", where, _place(text[: odd.start()]), "take it out")
    return text


def _place(before: str) -> Place:
    """Where a text goes on."""
    return before.count("\n") + 1, len(before) - (before.rfind("\n") + 1) + 1


def _spot(where: str, place: Place) -> str:
    return f"{where}:{place[0]}:{place[1]}"


def _syntax(what: str, where: str, place: Place, todo: str = "") -> FileError:
    return FileError("YAML_SYNTAX", what, where=_spot(where, place), todo=todo)


def shown(value: object) -> str:
    """A value for a message, short."""
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _loader(text: str, max_depth: int) -> SafeLoader:
    with uninterrupted():
        import yaml  # 30 ms, for those who read YAML alone

    class Loader(yaml.SafeLoader):
        """Takes no bracket for a key's begin where it is too deep anyway, as the events will say.

        PyYAML cuts a thousand characters ahead before it gives the first event, and looks for each of them at
        all that may begin a key: a thousand open brackets took 0.1 s, 1.7 s where others were at work too.
        """

        def save_possible_simple_key(self) -> None:
            if self.flow_level <= max_depth:
                super().save_possible_simple_key()

    return Loader(text)


class _Reader:
    """Builds data from PyYAML's events, and the places beside it."""

    def __init__(self, text: str, where: str, max_depth: int, max_values: int) -> None:
        with uninterrupted():
            import yaml

        self._yaml = yaml
        self._loader = _loader(text, max_depth)
        self._where = where
        self._max_depth = max_depth
        self._max_values = max_values
        self._places: dict[KeyPath, Place] = {}
        self._keys: dict[KeyPath, Place] = {}

    def document(self) -> YamlDocument:
        """The document, and the check that there is no second one."""
        events = self._yaml
        self._next()  # the stream's begin
        start = self._next()
        if isinstance(start, events.StreamEndEvent):
            self._refuse("YAML_SHAPE", "the file is empty", start, "one mapping of keys to values")
        top = self._next()
        if not isinstance(top, events.MappingStartEvent):
            self._plain(top)
            kind = "a list" if isinstance(top, events.SequenceStartEvent) else "a single value"
            self._refuse("YAML_SHAPE", kind, top, "one mapping of keys to values")
        data = self._value(top, (), 1)
        self._next()  # the document's end
        more = self._next()
        if not isinstance(more, events.StreamEndEvent):
            self._refuse("YAML_SHAPE", "a second document begins here", more, "one document")
        return YamlDocument(data, self._places, self._keys, self._where)

    def _next(self) -> Event:
        try:
            event: Event = self._loader.get_event()  # type: ignore[no-untyped-call]
            return event
        except self._yaml.MarkedYAMLError as problem:
            mark = problem.problem_mark or problem.context_mark
            place = (1, 1) if mark is None else (mark.line + 1, mark.column + 1)
            what = " ".join(word for word in (problem.context, problem.problem) if word)
            if "tag" in what:
                self._tag(place)
            todo = "write spaces instead of tabs" if "'\\t'" in what else ""
            raise _syntax(what or "not YAML", self._where, place, todo) from None
        except (ValueError, OverflowError):
            # A character's number beyond Unicode, a version of thousands of digits.
            mark = self._loader.get_mark()
            place = (mark.line + 1, mark.column + 1)
            raise _syntax("a number that is too large", self._where, place) from None

    def _value(self, event: Any, key_path: KeyPath, depth: int) -> Any:
        events = self._yaml
        self._plain(event)
        self._places[key_path] = _of(event)
        if len(self._places) > self._max_values:
            self._limit("YAML_SIZE", "too many values", event, f"at most {self._max_values:,}")
        if isinstance(event, events.ScalarEvent):
            return self._scalar(event)
        if depth > self._max_depth:
            self._limit("YAML_DEPTH", "nested too deep", event, f"{self._max_depth} levels")
        if isinstance(event, events.SequenceStartEvent):
            items: list[Any] = []
            while not isinstance(event := self._next(), events.SequenceEndEvent):
                items.append(self._value(event, (*key_path, len(items)), depth + 1))
            return items
        table: dict[str, Any] = {}
        while not isinstance(event := self._next(), events.MappingEndEvent):
            key = self._key(event, key_path)
            table[key] = self._value(self._next(), (*key_path, key), depth + 1)
        return table

    def _key(self, event: Any, key_path: KeyPath) -> str:
        self._plain(event)
        if not isinstance(event, self._yaml.ScalarEvent) or event.value == "":
            self._refuse("YAML_SHAPE", "a key that is not a word", event, "plain words as keys")
        key = self._text(event)
        if (first := self._keys.get((*key_path, key))) is not None:
            lines = f"{shown(key)} on lines {first[0]} and {_of(event)[0]}"
            self._refuse("YAML_DUPLICATE", lines, event, "each key once")
        self._keys[(*key_path, key)] = _of(event)
        return key

    def _scalar(self, event: Any) -> Any:
        """The value of a scalar by the core schema of YAML 1.2 (section 10.3.2); quoted is always text."""
        text = self._text(event)
        if not event.implicit[0]:
            return text
        if text in _WORDS:
            return _WORDS[text]
        if based := _BASED.fullmatch(text):
            self._short(text, event)
            return int(based[1], 8) if based[1] else int(based[2], 16)
        if _WHOLE.fullmatch(text):
            digits = text.lstrip("+-")
            if digits.startswith("0") and digits != "0":
                plain = digits.lstrip("0") or "0"
                self._refuse(
                    "YAML_NUMBER",
                    f"{text[:40]} is {plain[:40]} to some readers and octal to others",
                    event,
                    "numbers without leading zeros",
                    f"write {plain[:40]}, or put it in quotation marks if it is a text",
                )
            self._short(digits, event)
            return int(text)
        if _REAL.fullmatch(text):
            value = float(text)
            if value in (float("inf"), float("-inf")):
                self._refuse("YAML_NUMBER", f"{text[:40]} is too large for a number", event, "up to 1.7e308")
            return value
        return text

    def _short(self, digits: str, event: Any) -> None:
        if len(digits) > MAX_DIGITS:
            what = f"a whole number of {len(digits):,} digits"
            self._refuse("YAML_NUMBER", what, event, f"at most {MAX_DIGITS}")

    def _text(self, event: Any) -> str:
        """A scalar's characters. JSON writes what lies beyond 16 bits as two escapes: joined here."""
        try:
            return str(event.value).encode("utf-16", "surrogatepass").decode("utf-16")
        except UnicodeDecodeError:
            self._refuse("YAML_SYNTAX", "half of a pair of escapes (a lone surrogate)", event)

    def _plain(self, event: Any) -> None:
        """Refuse what can make a reader do more than read."""
        if isinstance(event, self._yaml.AliasEvent) or event.anchor is not None:
            name = shown(event.anchor)
            self._refuse("YAML_ALIAS", f"anchor or alias {name}", event, "values written out")
        if event.tag is not None:
            self._tag(_of(event), shown(event.tag))

    def _tag(self, place: Place, name: str = "") -> NoReturn:
        raise FileError(
            "YAML_TAG",
            f"tag {name}" if name else "a tag",
            where=_spot(self._where, place),
            allowed="no tags; nothing in a file is run",
            todo="take the tag away, or put the value in quotation marks",
        )

    def _limit(self, code: str, what: str, event: Any, allowed: str) -> NoReturn:
        raise LimitError(code, what, where=_spot(self._where, _of(event)), allowed=allowed)

    def _refuse(self, code: str, what: str, event: Any, allowed: str = "", todo: str = "") -> NoReturn:
        raise FileError(code, what, where=_spot(self._where, _of(event)), allowed=allowed, todo=todo)


def _of(event: Any) -> Place:
    return event.start_mark.line + 1, event.start_mark.column + 1
