"""What pydantic found wrong in a scenario, in lampyris' own form: code, place, value, what is allowed."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import UnionType
from typing import Any, NoReturn, Protocol, Union, get_args, get_origin

from pydantic import Tag, ValidationError
from pydantic_core import ErrorDetails

from lampyris.errors import FileError, LampyrisError, LimitError, did_you_mean, plural
from lampyris.io.scenario.schema import ScenarioFile
from lampyris.io.scenario.schema_types import Rule, Table
from lampyris.io.text.strict_json import JsonDocument, pointer
from lampyris.io.text.strict_yaml import KeyPath, shown

MOST = 20
"""Mistakes reported at once; the rest are counted."""
_TYPES = {
    "int_type": "is not a whole number",
    "int_from_float": "is not a whole number",
    "float_type": "is not a number",
    "string_type": "is not text",
    "bool_type": "is not true or false",
    "list_type": "is not a list",
    "dict_type": "is not a table",
    "model_type": "is not a table",
    "model_attributes_type": "is not a table",
}


class Document(Protocol):
    """What the YAML reader and the JSON reader make: plain data, and where it stands."""

    @property
    def data(self) -> dict[str, Any]:
        """The whole."""
        ...

    @property
    def where(self) -> str:
        """The file as the caller named it."""
        ...

    def at(self, *key_path: str | int) -> str:
        """``FILE:LINE:COLUMN`` of a value; of what it should be in, where there is no such value."""
        ...

    def at_key(self, *key_path: str | int) -> str:
        """``FILE:LINE:COLUMN`` of a key."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class PlainDocument:
    """Plain data that is in no file; its places are JSON pointers alone."""

    data: dict[str, Any]
    where: str

    def at(self, *key_path: str | int) -> str:
        """What the whole is called."""
        return self.where

    def at_key(self, *key_path: str | int) -> str:
        """What the whole is called."""
        return self.where


def spot(document: Document, key_path: KeyPath) -> str:
    """``FILE:LINE:COLUMN: /pointer`` of a value."""
    return f"{document.at(*key_path)}: {_short(pointer(key_path))}" if key_path else document.at()


def raise_all(faults: Sequence[LampyrisError], total: int = 0) -> NoReturn:
    """Raise the first; the others are its notes (``__notes__``), a line each, those above 20 a number."""
    first = faults[0]
    for other in faults[1:MOST]:
        first.add_note(str(other))
    if (more := max(total, len(faults)) - MOST) > 0:
        first.add_note(f"and {more:,} more")
    raise first


def in_order(document: Document, faults: Iterable[LampyrisError]) -> list[LampyrisError]:
    """Mistakes in the order of their places in the file, those without a place last."""

    def place(fault: LampyrisError) -> tuple[float, float]:
        found = re.match(r":(\d+):(\d+)", fault.where.removeprefix(document.where))
        return (int(found[1]), int(found[2])) if found else (float("inf"), 0)

    return sorted(faults, key=place)


def faults_of(
    document: Document, problem: ValidationError, file: type[Table] = ScenarioFile
) -> list[LampyrisError]:
    """The mistakes of a file, the first hundred, as errors of ours in its order; ``file`` is its table."""
    found = problem.errors(include_url=False)
    return in_order(document, [_fault(document, one, file) for one in found[: 5 * MOST]])


def _fault(document: Document, one: ErrorDetails, file: type[Table]) -> LampyrisError:
    key_path, table, rule = _resolve(one["loc"], file)
    kind, value = one["type"], one["input"]
    where = spot(document, key_path)
    if kind == "extra_forbidden":
        return _unknown_key(document, key_path, table)
    if kind == "missing":
        allowed = rule.allowed if rule else ""
        what = f"`{key_path[-1]}` is missing"
        return FileError("KEY", what, where=spot(document, key_path[:-1]), allowed=allowed)
    if kind == "union_tag_not_found":
        return _no_kind(document, key_path, value, rule)
    if kind in _TYPES:
        code = rule.code if rule and rule.always else "TYPE"
        return FileError(code, f"{brief(value)} {_TYPES[kind]}", where=where, allowed=_allowed(kind, rule))
    if kind in ("too_short", "too_long") and _inner(one["loc"]):
        # Of a pair inside a list of cells, not of the list.
        return FileError("TYPE", plural(len(value), "value"), where=where, allowed="[x, y]: two numbers")
    if rule is None:
        return FileError("RANGE", f"{brief(value)}: {one['msg']}", where=where)
    if kind == "less_than_equal" and rule.limit:
        most = one["ctx"]["le"]
        return LimitError("LIMIT", f"{value:,}", where=where, allowed=f"at most {most:,}")
    code = rule.code
    if code == "TEXT":
        code = "JSON_TEXT" if isinstance(document, JsonDocument | PlainDocument) else "YAML_TEXT"
    todo = did_you_mean(value, re.findall("'([^']*)'", str(one.get("ctx", {}).get("expected", ""))))
    what = str(one["ctx"]["what"]) if kind == "text" else _sized(value)
    return FileError(code, what, where=where, allowed=rule.allowed, todo=todo)


def _resolve(loc: Iterable[str | int], file: type[Table]) -> tuple[KeyPath, type[Table], Rule | None]:
    """The path in the file, the table it ends in and the rule of its field, from pydantic's place.

    Tags of unions stand in pydantic's places and not in the file: they are known by what was expected there.
    """
    table, hint = file, _Hint(file)
    key_path: list[str | int] = []
    rule: Rule | None = None
    for step in loc:
        tags = hint.tags()
        if step in tags:
            hint = tags[step]
            rule, table = hint.rule or rule, hint.table or table
            continue
        key_path.append(step)
        if hint.table is not None:
            rule = _rules(table).get(str(step))
            hint = hint.inside(step)
        else:
            hint = hint.inside(step)
            rule = hint.rule or rule
        table = hint.table or table
    return tuple(key_path), table, rule


class _Hint:
    """An annotation of a field, or of a part of it: what may stand there."""

    def __init__(self, hint: Any) -> None:
        self.rule: Rule | None = None
        while True:
            if hasattr(hint, "__metadata__"):
                self.rule = self.rule or next((m for m in hint.__metadata__ if isinstance(m, Rule)), None)
                hint = hint.__origin__
            elif type(None) in get_args(hint) and len(get_args(hint)) == 2:  # it, or null
                hint = next(part for part in get_args(hint) if part is not type(None))
            else:
                break
        self.hint = hint
        self.table = hint if isinstance(hint, type) and issubclass(hint, Table) else None

    def tags(self) -> Mapping[str | int, _Hint]:
        """What each tag of a union means; nothing where there is none."""
        if get_origin(self.hint) not in (Union, UnionType):
            return {}
        marked = [(part, getattr(part, "__metadata__", ())) for part in get_args(self.hint)]
        return {m.tag: _Hint(part) for part, marks in marked for m in marks if isinstance(m, Tag)}

    def inside(self, step: str | int) -> _Hint:
        """What may stand behind a key or an index."""
        if self.table is not None:
            fields = self.table.model_fields.items()
            return _Hint(next((f.annotation for name, f in fields if step == (f.alias or name)), Any))
        parts = get_args(self.hint)
        return _Hint(parts[-1] if get_origin(self.hint) in (list, dict) else Any)


def _rules(table: type[Table]) -> Mapping[str, Rule]:
    rules = {}
    for name, field in table.model_fields.items():
        own = (mark for mark in field.metadata if isinstance(mark, Rule))
        rule = next(own, None) or _rule_in(field.annotation)
        if rule is not None:
            rules[field.alias or name] = rule
    return rules


def _rule_in(hint: Any) -> Rule | None:
    """The rule inside an annotation such as ``Resolution | None``."""
    for mark in getattr(hint, "__metadata__", ()):
        if isinstance(mark, Rule):
            return mark
    found = (_rule_in(part) for part in get_args(hint))
    return next((rule for rule in found if rule is not None), None)


def _keys(table: type[Table]) -> list[str]:
    return [field.alias or name for name, field in table.model_fields.items()]


def _unknown_key(document: Document, key_path: KeyPath, table: type[Table]) -> FileError:
    key = str(key_path[-1])
    given = _value(document.data, key_path[:-1])
    free = [k for k in _keys(table) if not (isinstance(given, dict) and k in given)]
    if table is ScenarioFile:
        free.append("fleet")  # makes it a scenario of another kind
    near = did_you_mean(key, free).removeprefix("did you mean ").removesuffix("?")
    return FileError(
        "KEY",
        f"unknown key {shown(key)}",
        where=f"{document.at_key(*key_path)}: {_short(pointer(key_path))}",
        allowed=", ".join(k for k in _keys(table) if k != "$schema"),
        todo=f"did you mean {pointer((*key_path[:-1], near))}?" if near else "",
    )


def _no_kind(document: Document, key_path: KeyPath, value: Any, rule: Rule | None) -> FileError:
    """A value that none of several forms begins to fit."""
    code, allowed, todo = (rule.code, rule.allowed, "") if rule else ("TYPE", "", "")
    if rule and rule.kinds and isinstance(value, dict):
        if "kind" not in value:
            return FileError("KEY", "`kind` is missing", where=spot(document, key_path), allowed=allowed)
        key_path = (*key_path, "kind")
        todo, value = did_you_mean(value["kind"], rule.kinds), value["kind"]
    elif rule and rule.keys and isinstance(value, dict):
        wrong = (key for key in value if key not in rule.keys)
        todo = next((hint for key in wrong if (hint := did_you_mean(key, rule.keys))), "")
        what = f"a table with {', '.join(shown(k) for k in list(value)[:5])}" if value else "an empty table"
        return FileError("KEY", what, where=spot(document, key_path), allowed=allowed, todo=todo)
    return FileError(code, brief(value), where=spot(document, key_path), allowed=allowed, todo=todo)


def _value(data: Any, key_path: KeyPath) -> Any:
    for step in key_path:
        data = data[step]
    return data


def _inner(loc: Sequence[str | int]) -> bool:
    """Whether a place is an item of a list of cells."""
    return isinstance(loc[-1], int) and loc[-2] in ("track", "waypoints", "blocked", "freed")


def _allowed(kind: str, rule: Rule | None) -> str:
    return rule.allowed if rule else {"model_type": "a table; {} for all its defaults"}.get(kind, "")


def _sized(value: Any) -> str:
    if isinstance(value, list):
        return plural(len(value), "value")
    if isinstance(value, str) and len(value) > 60:
        return f"{len(value):,} characters"
    return brief(value)


def brief(value: Any) -> str:
    """A value as the file has it, for a message."""
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, list):
        return f"a list of {plural(len(value), 'value')}"
    if isinstance(value, str):
        return shown(value)
    text = json.dumps(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _short(text: str) -> str:
    plain = text if text.isprintable() else ascii(text)[1:-1]
    return plain if len(plain) <= 100 else plain[:97] + "..."
