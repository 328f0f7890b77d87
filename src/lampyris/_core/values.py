"""What all nouns share: a short repr, HTML, dictionaries; and values with arrays in them, equal when their contents
are, and read-only in every copy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields
from reprlib import Repr
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from lampyris._core import dict_codec, presentation
from lampyris.errors import SettingError

if TYPE_CHECKING:
    import pandas

MAX_REPR = 120
"""Characters of a noun's repr, at most."""

_BRIEF = Repr()
_BRIEF.maxtuple = _BRIEF.maxlist = _BRIEF.maxdict = _BRIEF.maxfrozenset = 3
_BRIEF.maxstring, _BRIEF.maxlong, _BRIEF.maxother = 40, 24, 60


class Noun:
    """What the nouns derive from; a dataclass with ``frozen=True, slots=True, repr=False``."""

    __slots__ = ()

    def __repr__(self) -> str:
        text = self._brief()
        return text if len(text) <= MAX_REPR else f"{text[: MAX_REPR - 4]}...{text[-1]}"

    def _brief(self) -> str:
        """The class with the fields that differ from their defaults; nouns with more to say say it in words."""
        words = []
        for f in fields(self):  # type: ignore[arg-type]
            value = getattr(self, f.name)
            default = f.default_factory() if f.default_factory is not MISSING else f.default
            if f.repr and f.init and not _same(value, default):
                words.append(f"{f.name}={brief(value)}")
        return f"{type(self).__name__}({', '.join(words)})"

    def _repr_html_(self) -> str | None:
        """A table and, where there is something to draw, a small picture, for notebooks."""
        return presentation.html_of(self) if presentation.html_of is not None else None

    def to_dict(self) -> dict[str, Any]:
        """All of it as dictionaries, lists, text and numbers that JSON can hold, with ``type`` and ``version``.

        ``json.dumps(noun.to_dict(), allow_nan=False)`` works; :meth:`from_dict` makes an equal noun of it.
        """
        made = dict_codec.encode(self)
        return {"type": made.pop("type"), "version": dict_codec.VERSION, **made}

    @classmethod
    def from_dict(cls, given: Mapping[str, Any]) -> Self:
        """A noun from what :meth:`to_dict` said of it.

        Raises
        ------
        SettingError : ``DICT``: another type or version, or a field that is missing, unknown or of another kind;
            and what the noun itself refuses.
        """
        return dict_codec.decode(cls, given)


class Tabular:
    """Nouns that are rows over time or distance."""

    __slots__ = ()

    def _table(self, **options: Any) -> pandas.DataFrame:
        if presentation.frame_of is None:
            raise SettingError("PANDAS", "the package lampyris is not loaded", todo="import lampyris")
        return presentation.frame_of(self, **options)


class Value(Noun):
    """What nouns with arrays derive from; a dataclass with ``frozen=True, slots=True, eq=False, repr=False``.

    Two of one class are equal if all their fields are that are compared (``field(compare=False)`` leaves one
    out); arrays are if their shape, element type and elements are. Copies, pickled ones too, are equal to
    their original, and their arrays are read-only, as those of the original are.
    """

    __slots__ = ()

    def __eq__(self, other: object) -> bool:
        if self is other:
            return True
        if type(self) is not type(other):
            return NotImplemented
        compared = (f.name for f in fields(self) if f.compare)  # type: ignore[arg-type]
        return all(_same(getattr(self, name), getattr(other, name)) for name in compared)

    def __hash__(self) -> int:
        compared = (f.name for f in fields(self) if f.compare)  # type: ignore[arg-type]
        key = (type(self), *(_hashed(getattr(self, name)) for name in compared))
        return hash(key)  # bits: for sets and dicts of the caller; nothing is sorted or drawn by it

    def __reduce__(self) -> tuple[Any, ...]:
        names = [f.name for f in fields(self)]  # type: ignore[arg-type]
        return _rebuilt, (type(self), {name: getattr(self, name) for name in names})


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return a is b or (a.dtype == b.dtype and np.array_equal(a, b, equal_nan=a.dtype.kind in "fc"))
    if isinstance(a, tuple) and isinstance(b, tuple):
        return len(a) == len(b) and all(map(_same, a, b))
    if isinstance(a, np.generic) or isinstance(b, np.generic):
        a, b = (one.item() if isinstance(one, np.generic) else one for one in (a, b))
    return type(a) is type(b) and bool(a == b or (a != a and b != b))


def brief(value: object) -> str:
    """A field's value as the repr of its noun shows it."""
    if isinstance(value, np.ndarray):
        return f"<{value.dtype.name} {' x '.join(map(str, value.shape)) or 'number'}>"
    return _BRIEF.repr(value)


def _hashed(value: Any) -> Any:
    """Something hashable that equal values share, quickly: of arrays the shape."""
    if isinstance(value, np.ndarray):
        return value.shape
    if isinstance(value, tuple):
        return len(value)
    return len(value) if isinstance(value, Mapping) else value


def _rebuilt(kind: type[Value], values: dict[str, Any]) -> Value:
    """A value from its fields, without the checks that they have passed."""
    made = object.__new__(kind)
    for name, value in values.items():
        _freeze(value)
        object.__setattr__(made, name, value)
    return made


def _freeze(value: Any) -> None:
    if isinstance(value, np.ndarray):
        value.setflags(write=False)
    elif isinstance(value, tuple):
        for one in value:
            _freeze(one)
