"""Nouns with arrays in them: equal when their contents are, and read-only in every copy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from functools import cache
from typing import Any, TypeVar

import numpy as np

from lampyris._core.noun import Noun, same

V = TypeVar("V", bound="Value")


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
        return all(same(getattr(self, name), getattr(other, name)) for name in compared)

    def __hash__(self) -> int:
        compared = (f.name for f in fields(self) if f.compare)  # type: ignore[arg-type]
        key = (type(self), *(_hashed(getattr(self, name)) for name in compared))
        return hash(key)  # bits: for sets and dicts of the caller; nothing is sorted or drawn by it

    def __reduce__(self) -> tuple[Any, ...]:
        names = [f.name for f in fields(self)]  # type: ignore[arg-type]
        return _rebuilt, (type(self), {name: getattr(self, name) for name in names})


def _hashed(value: Any) -> Any:
    """Something hashable that equal values share, quickly: of arrays the shape."""
    if isinstance(value, np.ndarray):
        return value.shape
    if isinstance(value, tuple):
        return len(value)
    return len(value) if isinstance(value, Mapping) else value


def with_fields(value: V, **others: Any) -> V:
    """The same value with other contents of some fields, without checks; its arrays are shared, not copied."""
    for other in others.values():
        _freeze(other)
    kind: Any = type(value)
    kept = {name: getattr(value, name) for name in names(kind)}
    return unchecked(type(value), kept | others)


def completed(value: V, **others: Any) -> V:
    """Set fields of a frozen value that no other code holds yet, and return it; nothing is checked or copied."""
    for name, other in others.items():
        object.__setattr__(value, name, other)
    return value


@cache
def names(kind: Any) -> tuple[str, ...]:
    """Names of the fields of a class, in order."""
    return tuple(f.name for f in fields(kind))


def unchecked(kind: type[V], values: dict[str, Any]) -> V:
    """A value from all of its fields, without checks and copies: its arrays must be its own, and read-only."""
    made = object.__new__(kind)
    for name, value in values.items():
        object.__setattr__(made, name, value)
    return made


def _rebuilt(kind: type[V], values: dict[str, Any]) -> V:
    """A value from its fields, without the checks that they have passed."""
    for value in values.values():
        _freeze(value)
    return unchecked(kind, values)


def _freeze(value: Any) -> None:
    if isinstance(value, np.ndarray):
        value.setflags(write=False)
    elif isinstance(value, tuple):
        for one in value:
            _freeze(one)
