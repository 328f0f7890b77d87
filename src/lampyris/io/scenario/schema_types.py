"""Pieces that the tables of a scenario file are made of: rules, names, lists of numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, TypeAlias

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, StringConstraints
from pydantic_core import PydanticCustomError

from lampyris._core.scalars import MAX_SEED, SEED_RANGE
from lampyris.io.text.strict_yaml import shown

MAX_TEXT = 200


@dataclass(frozen=True, slots=True)
class Rule:
    """What to say when a field's value is refused.

    Parameters
    ----------
    code : of the error.
    allowed : in words.
    always : whether a value of the wrong type has this code too, and not TYPE.
    limit : whether a value that is too great is a LIMIT (exit code 5).
    keys : of a field that may be one of several tables: the keys by which they are distinguished.
    kinds : the same where the key is ``kind`` for all of them: its values.
    """

    code: str
    allowed: str
    always: bool = False
    limit: bool = False
    keys: tuple[str, ...] = ()
    kinds: tuple[str, ...] = ()


def _printable(text: str) -> str:
    if not text.isprintable():
        raise PydanticCustomError("text", "{what}", {"what": f"{shown(text)} is not printable"})
    return text


def _plain(settings: dict[str, Any]) -> dict[str, Any]:
    """Settings whose words fit into a message."""
    for key, value in settings.items():
        for text in (key, value):
            if isinstance(text, str) and (len(text) > MAX_TEXT or not text.isprintable()):
                what = f"{shown(text)}: {len(text):,} characters"
                raise PydanticCustomError("text", "{what}", {"what": what})
    return settings


class Table(BaseModel):
    """Strict, closed and frozen."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


Word: TypeAlias = Annotated[
    str, StringConstraints(min_length=1, max_length=64), AfterValidator(_printable), Rule("TEXT", "a name")
]
Settings: TypeAlias = Annotated[
    dict[str, Any], AfterValidator(_plain), Rule("TEXT", f"a table; text of at most {MAX_TEXT} characters")
]
Pair: TypeAlias = Annotated[list[int], Field(min_length=2, max_length=2)]
Metres: TypeAlias = Annotated[list[float], Field(min_length=2, max_length=2)]
FileName: TypeAlias = Annotated[
    str,
    StringConstraints(min_length=1, max_length=1000),
    Rule("PATH_FORM", "a path with / between its parts, relative to the scenario's folder"),
]
Resolution: TypeAlias = Annotated[
    float, Field(ge=1e-6, le=1000), Rule("MAP_RESOLUTION", "1e-6 to 1000 metres a cell")
]
Seed: TypeAlias = Annotated[int, Field(ge=0, le=MAX_SEED), Rule("SEED", SEED_RANGE, always=True)]
