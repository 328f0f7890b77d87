"""Settings, each declared once: at the field of a frozen dataclass.

A field made by :func:`number`, :func:`whole`, :func:`word` or :func:`flag` holds the default, the range and the
unit of a setting; what it means is said in the docstring of its class, under Parameters (:func:`meanings_of`).
Everything else is derived from these two: the check when an object is made (:func:`check_settings`), command
line options, scenario and study schemas, forms of the app, tables of the docs::

    @dataclass(frozen=True)
    class Robot:
        v_max: float = number(1.0, 1e-6, 1e6, unit="m/s")

        def __post_init__(self) -> None:
            check_settings(self, under_code("ROBOT_LIMIT", "robot."))

NumPy is not imported here: the command line reads declarations before it knows which verb runs.
"""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from functools import cache
from types import MappingProxyType
from typing import Any, Literal

from lampyris._core.scalars import is_real, is_whole, is_word
from lampyris.errors import SettingError, did_you_mean, shown

Kind = Literal["number", "whole", "word", "flag"]

_KEY = "lampyris.setting"


@dataclass(frozen=True, slots=True)
class Setting:
    """What a setting may be.

    Parameters
    ----------
    kind : a ``number``, a ``whole`` number, a ``word`` of several, or a ``flag`` (True or False).
    low, high : range of a number.
    above : whether ``low`` itself is excluded.
    unit : of a number, such as ``m/s``; empty: none.
    words : what a word may be.
    none : what None means; empty: None is not allowed.
    off : a number outside the range that is allowed too, and what it means.
    title : what forms call it; empty: its name says it.
    """

    kind: Kind
    low: float = -math.inf
    high: float = math.inf
    above: bool = False
    unit: str = ""
    words: tuple[str, ...] = ()
    none: str = ""
    off: tuple[float, str] | None = None
    title: str = ""

    def accepts(self, value: object) -> bool:
        """Whether a value is allowed."""
        if value is None:
            return bool(self.none)
        if self.kind == "flag":
            return isinstance(value, bool)
        if self.kind == "word":
            return is_word(value, self.words)
        if not (is_whole(value) if self.kind == "whole" else is_real(value)):
            return False
        number = float(value)  # type: ignore[arg-type]
        if self.off is not None and number == self.off[0]:
            return True
        return self.low <= number <= self.high and not (self.above and number == self.low)

    @property
    def allowed(self) -> str:
        """What is allowed, in words."""
        if self.kind == "flag":
            text = "true or false"
        elif self.kind == "word":
            text = ", ".join(self.words)
        else:
            text = f"{'a whole number' if self.kind == 'whole' else 'a number'}{self._range()}"
            text += f" {self.unit}" if self.unit else ""
        if self.off is not None:
            text += f", or {self.off[0]:g} ({self.off[1]})"
        return f"{text}, or none ({self.none})" if self.none else text

    def _range(self) -> str:
        low, high = (_written(x, self.kind) for x in (self.low, self.high))
        if self.low == -math.inf and self.high == math.inf:
            return ""
        if self.high == math.inf:
            return f" above {low}" if self.above else f" of at least {low}"
        if self.above:
            return f" above {low}, at most {high}"
        return f" from {low} to {high}"

    def converted(self, value: Any) -> Any:
        """An allowed value as the type of the setting."""
        if value is None or self.kind in ("flag", "word"):
            return value
        return int(value) if self.kind == "whole" else float(value)


def _written(value: float, kind: Kind) -> str:
    return f"{int(value):,}" if kind == "whole" and math.isfinite(value) else f"{value:g}"


def number(
    default: float | None,
    low: float,
    high: float,
    *,
    unit: str = "",
    above: bool = False,
    none: str = "",
    off: tuple[float, str] | None = None,
    title: str = "",
) -> Any:
    """Declare a setting that is a number; see :class:`Setting`."""
    setting = Setting("number", low, high, above, unit, none=none, off=off, title=title)
    return field(default=default, metadata={_KEY: setting})


def whole(
    default: int | None,
    low: int,
    high: int,
    *,
    unit: str = "",
    none: str = "",
    off: tuple[float, str] | None = None,
    title: str = "",
) -> Any:
    """Declare a setting that is a whole number; see :class:`Setting`."""
    setting = Setting("whole", low, high, unit=unit, none=none, off=off, title=title)
    return field(default=default, metadata={_KEY: setting})


def word(default: str, words: tuple[str, ...], *, title: str = "") -> Any:
    """Declare a setting that is one of several words; see :class:`Setting`."""
    return field(default=default, metadata={_KEY: Setting("word", words=words, title=title)})


def flag(default: bool, *, title: str = "") -> Any:
    """Declare a setting that is True or False; see :class:`Setting`."""
    return field(default=default, metadata={_KEY: Setting("flag", title=title)})


def redeclared(parent: type, name: str, default: Any) -> Any:
    """Declare a setting of a parent class again, with another default."""
    return field(default=default, metadata={_KEY: settings_of(parent)[name]})


def settings_of(owner: Any) -> Mapping[str, Setting]:
    """The declared settings of a dataclass or of one of its objects, in the order of its fields."""
    return _declared(owner if isinstance(owner, type) else type(owner))


@cache
def _declared(kind: type) -> Mapping[str, Setting]:
    return MappingProxyType({f.name: f.metadata[_KEY] for f in fields(kind) if _KEY in f.metadata})


def defaults_of(owner: Any) -> Mapping[str, Any]:
    """The default of each declared setting of a dataclass."""
    return {f.name: f.default for f in fields(owner) if _KEY in f.metadata}


def default_of(kind: type, name: str) -> Any:
    """The default of a field of a dataclass, declared or plain."""
    return next(one.default for one in fields(kind) if one.name == name)


def meanings_of(kind: type) -> Mapping[str, str]:
    """What the docstrings of a class and its parents say of each parameter, by name; plain text."""
    found: dict[str, str] = {}
    for base in reversed(kind.__mro__):
        _, _, part = inspect.cleandoc(base.__doc__ or "").partition("Parameters\n")
        for names, text in _PARAMETER.findall(part):
            for name in names.split(","):
                found[name.strip()] = _ROLE.sub(r"\1", " ".join(text.split()).replace("``", ""))
    return found


def descriptions_of(kind: type) -> Mapping[str, str]:
    """Each declared setting of a class as sentences, with its unit."""
    meanings = meanings_of(kind)
    found: dict[str, str] = {}
    for name, setting in settings_of(kind).items():
        text = meanings.get(name, name.replace("_", " "))
        first, dot, rest = (text if text.endswith(".") else f"{text}.").partition(". ")
        unit = f" ({setting.unit})" if setting.unit else ""
        first = f"{first[0].upper()}{first[1:].rstrip('.')}{unit}."
        found[name] = f"{first} {rest}" if dot else first
    return found


_PARAMETER = re.compile(r"^([a-z][\w, ]*?) : (.*(?:\n {4}.*)*)", re.MULTILINE)
_ROLE = re.compile(r":(?:class|func|meth|attr|mod|data):`(?:[\w.]*\.)?(\w+)`")

Refuse = Callable[[str, str, str, str], SettingError]
"""From a setting's name, its value in words, what is allowed, and advice to the error to raise."""


def check_settings(owner: Any, refuse: Refuse) -> None:
    """Check every declared setting of a new object of a frozen dataclass, and convert numbers to its type.

    Raises
    ------
    SettingError : made by ``refuse``, for the first value that is not allowed.
    """
    for name, setting in settings_of(owner).items():
        value = getattr(owner, name)
        if not setting.accepts(value):
            todo = did_you_mean(value, setting.words) if isinstance(value, str) and setting.words else ""
            raise refuse(name, shown(value), setting.allowed, todo)
        object.__setattr__(owner, name, setting.converted(value))


def under_code(code: str, prefix: str = "") -> Refuse:
    """Errors of one code, at the place ``prefix`` and the setting's name."""

    def refuse(name: str, value: str, allowed: str, todo: str) -> SettingError:
        return SettingError(code, value, where=f"{prefix}{name}", allowed=allowed, todo=todo)

    return refuse


def under_name(owner: str) -> Refuse:
    """Errors that have a setting's own name for their code, as those of planners have.

    Parameters
    ----------
    owner : whose settings these are, such as the name of a planner.
    """

    def refuse(name: str, value: str, allowed: str, todo: str) -> SettingError:
        return SettingError.of(name.upper(), name, value, where=owner, allowed=allowed, todo=todo)

    return refuse
