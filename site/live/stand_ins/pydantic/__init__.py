"""The part of pydantic that scenario files need, in plain Python: pydantic's compiled core has no build for Pyodide
in the registries that the live page is made from.

Only the live page uses it. It reads the same models (:mod:`lampyris.io.scenario.schema`) by pydantic's strict rules and
reports the same kinds of mistakes at the same places; ``tests/site`` compares both on many scenarios.
"""

from __future__ import annotations

import copy
import inspect
import math
import re
import types
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from pydantic_core import PydanticCustomError

MISSING: Any = object()


class ConfigDict(dict[str, Any]):
    """Options of a model; those that are not the defaults of this reader are the same for all models here."""


@dataclass(frozen=True)
class AfterValidator:
    """A function that a checked value passes through."""

    func: Any


@dataclass(frozen=True)
class Discriminator:
    """Chooses a form by the value."""

    discriminator: Any


@dataclass(frozen=True)
class Tag:
    """The word of a form."""

    tag: str


@dataclass(eq=False)
class FieldInfo:
    """What is known of a field: bounds, default, alias."""

    default: Any = MISSING
    alias: str | None = None
    bounds: dict[str, Any] = field(default_factory=dict)
    annotation: Any = None
    metadata: list[Any] = field(default_factory=list)


def Field(default: Any = MISSING, *, alias: str | None = None, **bounds: Any) -> Any:
    """A field, or bounds in an annotation."""
    kept = {name: value for name, value in bounds.items() if name in _BOUNDS}
    return FieldInfo(default, alias, kept)


def StringConstraints(**bounds: Any) -> Any:
    """Bounds of a text."""
    return FieldInfo(bounds=bounds)


class ValidationError(ValueError):
    """All mistakes of a value."""

    def __init__(self, found: list[dict[str, Any]]) -> None:
        super().__init__(f"{len(found)} validation errors")
        self._found = found

    def errors(self, *, include_url: bool = False) -> list[dict[str, Any]]:
        """Each with its type, place, input and message."""
        return self._found

    def error_count(self) -> int:
        """How many."""
        return len(self._found)


_BOUNDS = ("ge", "gt", "le", "lt", "min_length", "max_length", "pattern")
_NUMBERS = {
    "gt": ("greater_than", lambda v, b: v > b),
    "ge": ("greater_than_equal", lambda v, b: v >= b),
    "lt": ("less_than", lambda v, b: v < b),
    "le": ("less_than_equal", lambda v, b: v <= b),
}


class _Reader:
    """Reads one value and collects what is wrong with it."""

    def __init__(self) -> None:
        self.found: list[dict[str, Any]] = []

    def wrong(self, kind: str, loc: tuple[Any, ...], value: Any, **ctx: Any) -> Any:
        self.found.append(
            {"type": kind, "loc": loc, "input": value, "msg": kind.replace("_", " "), "ctx": ctx}
        )
        return MISSING

    def read(self, hint: Any, value: Any, loc: tuple[Any, ...], marks: tuple[Any, ...] = ()) -> Any:
        """The value as the annotation has it; MISSING: it is wrong."""
        if get_origin(hint) is Annotated:
            # The inner marks are judged first.
            return self.read(hint.__origin__, value, loc, (*hint.__metadata__, *marks))
        read = self._kind(hint, value, loc, marks)
        if read is MISSING or read is None:
            return read
        for mark in marks:
            if isinstance(mark, FieldInfo) and not self._bounded(mark.bounds, read, loc, value):
                return MISSING
        for mark in marks:
            if isinstance(mark, AfterValidator):
                try:
                    read = mark.func(read)
                except PydanticCustomError as fault:
                    return self.wrong(fault.type, loc, value, **fault.context)
        return read

    def _kind(self, hint: Any, value: Any, loc: tuple[Any, ...], marks: tuple[Any, ...]) -> Any:
        origin, parts = get_origin(hint), get_args(hint)
        if hint is Any:
            return value
        if origin in (Union, types.UnionType):
            return self._one_of(parts, value, loc, marks)
        if origin is Literal:
            if any(type(value) is type(one) and value == one for one in parts):
                return value
            words = " or ".join(repr(one) for one in parts)
            return self.wrong("literal_error", loc, value, expected=words)
        if origin is list:
            if type(value) is not list:
                return self.wrong("list_type", loc, value)
            return self._all([(self.read(parts[0], one, (*loc, k))) for k, one in enumerate(value)])
        if origin is dict or hint is dict:
            return dict(value) if type(value) is dict else self.wrong("dict_type", loc, value)
        if isinstance(hint, type) and issubclass(hint, BaseModel):
            return hint._read(value, loc, self)
        return self._plain(hint, value, loc)

    def _plain(self, hint: Any, value: Any, loc: tuple[Any, ...]) -> Any:
        if hint is bool:
            return value if type(value) is bool else self.wrong("bool_type", loc, value)
        if hint is str:
            return value if type(value) is str else self.wrong("string_type", loc, value)
        if hint is int:
            return value if type(value) is int else self.wrong("int_type", loc, value)
        if hint is float:
            if type(value) not in (int, float):
                return self.wrong("float_type", loc, value)
            try:
                number = float(value)
            except OverflowError:
                return self.wrong("finite_number", loc, value)
            return number if math.isfinite(number) else self.wrong("finite_number", loc, value)
        raise TypeError(f"no rule for {hint!r}")

    def _one_of(
        self, parts: tuple[Any, ...], value: Any, loc: tuple[Any, ...], marks: tuple[Any, ...]
    ) -> Any:
        if type(None) in parts and value is None:
            return None
        forms = [part for part in parts if part is not type(None)]
        choose = next((mark.discriminator for mark in marks if isinstance(mark, Discriminator)), None)
        if choose is None:
            assert len(forms) == 1, "a union without a discriminator"
            return self.read(forms[0], value, loc)
        tag = choose(value)
        for form in forms:
            if any(isinstance(mark, Tag) and mark.tag == tag for mark in getattr(form, "__metadata__", ())):
                return self.read(form, value, (*loc, tag))
        return self.wrong("union_tag_not_found", loc, value)

    @staticmethod
    def _all(values: list[Any]) -> Any:
        return MISSING if any(one is MISSING for one in values) else values

    def _bounded(self, bounds: dict[str, Any], read: Any, loc: tuple[Any, ...], value: Any) -> bool:
        for name, bound in bounds.items():
            if bound is None:
                continue
            if name in _NUMBERS:
                kind, holds = _NUMBERS[name]
                if not holds(read, bound):
                    self.wrong(kind, loc, value, **{name: bound})
                    return False
                continue
            if name == "pattern":
                if re.search(bound, read) is None:
                    self.wrong("string_pattern_mismatch", loc, value, pattern=bound)
                    return False
                continue
            short = name == "min_length"
            if (len(read) < bound) if short else (len(read) > bound):
                word = "short" if short else "long"
                kind = f"string_too_{word}" if isinstance(read, str) else f"too_{word}"
                self.wrong(kind, loc, value, **{name: bound})
                return False
        return True


class _Fields:
    """The fields of a model, read from its annotations when they are first asked for."""

    def __get__(self, made: Any, model: type[BaseModel]) -> dict[str, FieldInfo]:
        if "_fields" not in model.__dict__:
            model._fields = _fields_of(model)
        return model._fields


class BaseModel:
    """A table: closed and strict."""

    model_config = ConfigDict()
    model_fields = _Fields()

    @classmethod
    def model_validate(cls, data: Any) -> Any:
        """The table of plain data.

        Raises
        ------
        ValidationError : everything that is wrong with it.
        """
        reader = _Reader()
        made = cls._read(data, (), reader)
        if reader.found:
            raise ValidationError(reader.found)
        return made

    @classmethod
    def _read(cls, data: Any, loc: tuple[Any, ...], reader: _Reader) -> Any:
        if isinstance(data, cls):
            return data
        if type(data) is not dict:
            return reader.wrong("model_type", loc, data)
        made, before = object.__new__(cls), len(reader.found)
        values: dict[str, Any] = {}
        given = set()
        fields = cls.model_fields
        for name, info in fields.items():
            key = info.alias or name
            if key in data:
                given.add(name)
                values[name] = reader.read(info.annotation, data[key], (*loc, key), tuple(info.metadata))
            elif info.default is MISSING:
                reader.wrong("missing", (*loc, key), data)
            else:
                values[name] = copy.copy(info.default)
        known = {info.alias or name for name, info in fields.items()}
        for key in data:
            if key not in known:
                reader.wrong("extra_forbidden", (*loc, key), data[key])
        made.__dict__.update(values)
        made.__dict__["model_fields_set"] = given
        return made if len(reader.found) == before else MISSING

    def model_dump(self) -> dict[str, Any]:
        """As plain data."""
        return {name: _dumped(self.__dict__[name]) for name in type(self).model_fields}

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and self.__dict__ == other.__dict__

    __hash__ = None  # type: ignore[assignment]


def _dumped(value: Any) -> Any:
    if isinstance(value, BaseModel):
        return value.model_dump()
    return [_dumped(one) for one in value] if isinstance(value, list) else value


def _fields_of(model: type[BaseModel]) -> dict[str, FieldInfo]:
    hints = get_type_hints(model, include_extras=True)
    order: dict[str, None] = {}
    for base in reversed(model.__mro__):
        order.update(dict.fromkeys(inspect.get_annotations(base)))
    fields = {}
    for name in order:
        declared = getattr(model, name, MISSING)
        info = declared if isinstance(declared, FieldInfo) else FieldInfo(declared)
        hint, marks = hints[name], []
        while get_origin(hint) is Annotated:
            marks = [*hint.__metadata__, *marks]
            hint = hint.__origin__
        if info.bounds:
            marks.append(FieldInfo(bounds=info.bounds))
        fields[name] = FieldInfo(info.default, info.alias, {}, hint, marks)
    return fields


def create_model(name: str, *, __base__: type[BaseModel], __doc__: str = "", **keys: Any) -> type[BaseModel]:
    """A model made of (annotation, field) by key."""
    made: dict[str, Any] = {
        "__annotations__": {key: hint for key, (hint, _) in keys.items()},
        "__doc__": __doc__,
    }
    made |= {key: one for key, (_, one) in keys.items()}
    return type(name, (__base__,), {**made, "__module__": __base__.__module__})
