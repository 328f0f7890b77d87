"""Tables of scenario and study files made from the declared settings of a dataclass."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import Field, create_model

from lampyris._core.settings import Setting, defaults_of, descriptions_of, settings_of
from lampyris.io.scenario.schema_types import Rule, Table

_TYPES = {"number": float, "whole": int, "flag": bool}


def table_of(name: str, kind: type, summary: str, code: str = "") -> type[Table]:
    """A table with a key for every declared setting of a dataclass: its type, range, default and meaning.

    Parameters
    ----------
    name : of the model.
    kind : dataclass whose fields are declared by :mod:`lampyris._core.settings`.
    summary : what the table is, for the published schema.
    code : of errors about its values; empty: each setting's own name in capitals.
    """
    defaults = defaults_of(kind)
    texts = descriptions_of(kind)
    keys: dict[str, Any] = {}
    for key, setting in settings_of(kind).items():
        keys[key] = (_annotation(setting, code or key.upper()), _field(setting, defaults[key], texts[key]))
    made: type[Table] = create_model(name, __base__=Table, __doc__=summary, **keys)
    return made


def key_of(kind: type, name: str) -> tuple[Any, Any]:
    """One declared setting as a key of a table, with its own name as code: annotation and field."""
    setting, text = settings_of(kind)[name], descriptions_of(kind)[name]
    return _annotation(setting, name.upper()), _field(setting, defaults_of(kind)[name], text)


def _field(setting: Setting, default: Any, text: str) -> Any:
    return Field(default, description=f"{text} Null: {setting.none}." if setting.none else text)


def _annotation(setting: Setting, code: str) -> Any:
    if setting.kind == "word":
        base: Any = Literal[setting.words]
    else:
        bounds: list[Any] = []
        exact = int if setting.kind == "whole" else float
        if setting.low != -math.inf:
            bounds.append(Field(gt=exact(setting.low)) if setting.above else Field(ge=exact(setting.low)))
        if setting.high != math.inf:
            bounds.append(Field(le=exact(setting.high)))
        base = Annotated[(_TYPES[setting.kind], *bounds)] if bounds else _TYPES[setting.kind]
    rule = Rule(code, setting.allowed.replace("or none (", "or null ("))
    return Annotated[base | None if setting.none else base, rule]
