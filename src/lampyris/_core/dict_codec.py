"""Dataclasses as dictionaries that JSON can hold, and back: what to_dict and from_dict of the nouns are made of.

Arrays are nested lists; two-dimensional masks are one string of 0 and 1 a row; numbers that are not finite are the
words ``inf``, ``-inf`` and ``nan``, which JSON has no numbers for. A dataclass is a dictionary of its fields by name
and its class's name as ``type``; the outermost has ``version`` besides.
"""

from __future__ import annotations

import math
import types
from collections.abc import Mapping
from collections.abc import Set as AbstractSet
from dataclasses import MISSING, Field, fields, is_dataclass
from enum import Enum
from functools import cache
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

from lampyris.errors import LampyrisError, SettingError, UnknownSettingError, did_you_mean, shown

VERSION = 1
"""Of the form of the dictionaries."""

_NOT_FINITE = {"inf": math.inf, "-inf": -math.inf, "nan": math.nan}

T = TypeVar("T")


def encode(value: Any) -> Any:
    """A value as dictionaries, lists, text, numbers and None.

    Raises
    ------
    SettingError : ``DICT``: it holds something that has no such form.
    """
    if value is None or isinstance(value, bool | int):
        return value.value if isinstance(value, Enum) else value
    if isinstance(value, float):
        number = float(value)
        return number if math.isfinite(number) else str(number)
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, str):
        return value
    if isinstance(value, np.generic):
        return encode(value.item())
    if isinstance(value, np.ndarray):
        return _encode_array(value)
    if isinstance(value, tuple | list):
        return [encode(one) for one in value]
    if isinstance(value, AbstractSet):
        return sorted(encode(one) for one in value)
    if isinstance(value, Mapping):
        return {str(key): encode(one) for key, one in value.items()}
    if is_dataclass(value) and not isinstance(value, type):
        return {"type": type(value).__name__} | {
            f.name: encode(getattr(value, f.name)) for f in _own(type(value))
        }
    raise SettingError("DICT", f"a {type(value).__name__}", allowed="what a noun of lampyris may hold")


def _encode_array(array: np.ndarray) -> Any:
    if array.dtype == np.bool_ and array.ndim == 2:
        return ["".join("1" if one else "0" for one in row) for row in array.tolist()]
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        return encode(array.tolist())
    return array.tolist()


def decode(kind: type[T], given: object, where: str = "") -> T:
    """A dataclass from what :func:`encode` made of it; its own checks judge the values.

    Parameters
    ----------
    kind : the class, or one that the class given derives from.
    given : the dictionary.
    where : where it stands in the outermost one, for messages.

    Raises
    ------
    SettingError : ``DICT``: another type or version, a field missing or too many, or of another kind.
    """
    if not isinstance(given, Mapping):
        raise _refused(given, where, f"a dictionary of a {kind.__name__}")
    # The last of a name: a dataclass with slots replaces the class that it was made from.
    named = [one for one in _family(kind) if one.__name__ == given.get("type")]
    made: Any = named[-1] if named else None
    if made is None:
        names = " or ".join(one.__name__ for one in _family(kind))
        raise _refused(given.get("type"), f"{where}.type".lstrip("."), names)
    version = given.get("version", VERSION)
    if version != VERSION or isinstance(version, bool):
        raise _refused(version, f"{where}.version".lstrip("."), f"version {VERSION}")
    known = {f.name: f for f in _own(made)}
    for name in given:
        if name not in known and name not in ("type", "version"):
            raise UnknownSettingError(
                "DICT", f"{shown(name)} is no field of a {made.__name__}", where=where, allowed=", ".join(known),
                todo=did_you_mean(name, known),
            )  # fmt: skip
    hints, values = _hints(made), {}
    for name, f in known.items():
        place = f"{where}.{name}".lstrip(".")
        if name in given:
            values[name] = _value(hints[name], given[name], place)
        elif f.default is MISSING and f.default_factory is MISSING:
            raise SettingError("DICT", "missing", where=place, allowed=f"every field of a {made.__name__}")
    try:
        noun: T = made(**values)
    except LampyrisError:
        raise
    except (TypeError, ValueError, IndexError, KeyError, AttributeError, OverflowError) as error:
        raise SettingError("DICT", f"no {made.__name__}: {error}", where=where) from None
    return noun


def _value(hint: Any, given: Any, where: str) -> Any:
    """What is given as a value of a type that a field is declared with."""
    origin, args = get_origin(hint), get_args(hint)
    if hint is Any or hint is object:
        return given
    if hint is type(None):
        return _of(given, given is None, where, "null")
    if origin in (Union, types.UnionType):
        return _one_of(args, given, where)
    if origin is np.ndarray:
        return _array(np.dtype(get_args(args[1])[0]), given, where)
    if origin is tuple:
        return _tuple(args, given, where)
    if origin is frozenset:
        return frozenset(_value(args[0], one, where) for one in _list(given, where))
    if origin is not None and issubclass(origin, Mapping):
        _of(
            given,
            isinstance(given, Mapping) and all(isinstance(key, str) for key in given),
            where,
            "a dictionary",
        )
        return {key: _value(args[1], one, f"{where}.{key}") for key, one in given.items()}
    if is_dataclass(hint):
        return decode(hint, given, where)  # type: ignore[arg-type]
    return _plain(hint, given, where)


def _plain(hint: Any, given: Any, where: str) -> Any:
    """Text, a number, a word of an enumeration."""
    if issubclass(hint, Enum):
        words = [one.value for one in hint]
        return hint(_of(given, given in words, where, ", ".join(map(str, words))))
    if hint is float:
        if isinstance(given, str) and given in _NOT_FINITE:
            return _NOT_FINITE[given]
        return _of(given, isinstance(given, int | float) and not isinstance(given, bool), where, "a number")
    if hint is int:
        return _of(given, isinstance(given, int) and not isinstance(given, bool), where, "a whole number")
    return _of(
        given, isinstance(given, hint), where, {str: "text", bool: "true or false"}.get(hint, hint.__name__)
    )


def _one_of(kinds: tuple[Any, ...], given: Any, where: str) -> Any:
    """What is given as the first of some types that it is one of."""
    if given is None and type(None) in kinds:
        return None
    kinds = tuple(kind for kind in kinds if kind is not type(None))
    nouns: list[Any] = [kind for kind in kinds if is_dataclass(kind)]
    if isinstance(given, Mapping) and nouns:
        named = [kind for kind in nouns if any(k.__name__ == given.get("type") for k in _family(kind))]
        if named:
            return decode(named[0], given, where)
        names = " or ".join(kind.__name__ for kind in nouns)
        raise _refused(given.get("type"), f"{where}.type", names)
    for kind in kinds[:-1]:
        try:
            return _value(kind, given, where)
        except SettingError:
            continue
    return _value(kinds[-1], given, where)


def _tuple(args: tuple[Any, ...], given: Any, where: str) -> tuple[Any, ...]:
    items = _list(given, where)
    if len(args) == 2 and args[1] is Ellipsis:
        return tuple(_value(args[0], one, f"{where}[{k}]") for k, one in enumerate(items))
    _of(given, len(items) == len(args), where, f"{len(args)} values")
    return tuple(
        _value(hint, one, f"{where}[{k}]") for k, (hint, one) in enumerate(zip(args, items, strict=True))
    )


def _array(dtype: np.dtype[Any], given: Any, where: str) -> np.ndarray:
    """A read-only array of lists."""
    rows = _list(given, where)
    if dtype == np.bool_ and rows and isinstance(rows[0], str):
        even = all(isinstance(row, str) and len(row) == len(rows[0]) and not row.strip("01") for row in rows)
        _of(given, even, where, "rows of 0 and 1, all of one length")
        made = np.array([[one == "1" for one in row] for row in rows], dtype=np.bool_).reshape(len(rows), -1)
    else:
        try:
            made = np.array(
                rows, dtype=dtype
            )  # of float, the words of what is not finite are numbers to NumPy
        except (TypeError, ValueError, OverflowError):
            raise _refused(given, where, f"lists of {dtype.name}") from None
    if dtype.kind in "iub" and made.size and not isinstance(rows[0], str):
        _of(given, np.array_equal(np.array(rows), made), where, f"lists of {dtype.name}")
    made.setflags(write=False)
    return made


def _list(given: Any, where: str) -> list[Any]:
    return list(_of(given, isinstance(given, list | tuple), where, "a list"))


def _of(given: Any, fits: bool, where: str, allowed: str) -> Any:
    if not fits:
        raise _refused(given, where, allowed)
    return given


def _refused(given: object, where: str, allowed: str) -> SettingError:
    return SettingError("DICT", shown(given), where=where, allowed=allowed)


@cache
def _own(kind: Any) -> tuple[Field[Any], ...]:
    """The fields that the constructor takes."""
    return tuple(f for f in fields(kind) if f.init)


@cache
def _hints(kind: Any) -> dict[str, Any]:
    return get_type_hints(kind)


def _family(kind: Any) -> list[Any]:
    """The class and all that derive from it."""
    return [kind, *(one for child in kind.__subclasses__() for one in _family(child))]
