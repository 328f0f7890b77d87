"""Settings of speed laws as a table: nested ones are reached by dotted names such as ``blind.reach``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any

from lampyris.errors import SettingError, UnknownSettingError, did_you_mean, shown

_HIDDEN = frozenset(("name",))
"""Fields that say which law the settings belong to."""


def checked_kind(where: str, value: Any, kind: type, *, none: bool = False) -> None:
    """Refuse what is not of its kind.

    Raises
    ------
    SettingError : ``LAW_SETTING``.
    """
    if not (isinstance(value, kind) or (none and value is None)):
        allowed = f"{kind.__name__}{' or nothing' if none else ''}"
        raise SettingError("LAW_SETTING", shown(value), where=where, allowed=allowed)


def flattened(settings: Any) -> dict[str, Any]:
    """Settings of a law as one flat table, dotted names for nested ones; None where a rule is off."""
    out: dict[str, Any] = {}
    for f in fields(settings):
        value = getattr(settings, f.name)
        if f.name in _HIDDEN:
            continue
        if is_dataclass(value):
            out.update({f"{f.name}.{key}": v for key, v in flattened(value).items()})
        else:
            out[f.name] = value
    return out


def changed(settings: Any, given: Mapping[str, Any], kinds: Mapping[str, type], law: str) -> Any:
    """The same settings with some of them changed.

    Parameters
    ----------
    settings : a frozen dataclass.
    given : by name; ``rule.name`` for a setting of a rule that has its own. A rule alone is switched: True or
        ``on`` turns it on with its defaults, None, False or ``off`` turns it off, a mapping turns it on and
        sets.
    kinds : the settings of each rule that has its own.
    law : its name, for messages.

    Raises
    ------
    SettingError : ``LAW_SETTING``: an unknown name, or a value out of its range.
    """
    plain: dict[str, Any] = {}
    inner: dict[str, dict[str, Any]] = {}
    for key, value in given.items():
        rule, dot, rest = str(key).partition(".")
        if rule in kinds and (dot or isinstance(value, Mapping)):
            inner.setdefault(rule, {}).update({rest: value} if dot else value)
        elif rule in kinds and (value is True or value == "on"):
            inner.setdefault(rule, {})
        elif rule in kinds and (value is None or value is False or value == "off"):
            plain[rule] = None
        elif rule in kinds and not isinstance(value, kinds[rule]):
            own = ", ".join(f"{rule}.{f.name}" for f in fields(kinds[rule]))
            raise SettingError(
                "LAW_SETTING",
                f"{shown(value)}",
                where=f"{law}.{rule}",
                allowed=f"on, off; its settings are {own}",
            )
        else:
            plain[str(key)] = value
    _known(plain, settings, law, kinds)
    base = replace(settings, **plain)
    for rule, some in inner.items():
        if rule in plain and plain[rule] is None:
            # Nested settings next to "off" are accepted for a rule that is off: files that were saved whole.
            raise SettingError(
                "LAW_SETTING",
                f"{rule} is off and has settings",
                where=f"{law}.{rule}",
                allowed="one of the two",
            )
        now = getattr(base, rule)
        start = kinds[rule]() if now is None else now
        _known(some, start, f"{law}.{rule}", {})
        base = replace(base, **{rule: replace(start, **some)})
    return base


def _known(given: Mapping[str, Any], settings: Any, where: str, kinds: Mapping[str, type]) -> None:
    known = [f.name for f in fields(settings) if f.name not in _HIDDEN]
    for key in given:
        if key not in known:
            nested = [f"{rule}.{f.name}" for rule, kind in kinds.items() for f in fields(kind)]
            raise UnknownSettingError(
                "LAW_SETTING",
                f"{where} has no setting {shown(key)}",
                allowed=", ".join([*known, *nested]),
                todo=did_you_mean(key, [*known, *nested], cutoff=0.5),
                setting=str(key),
            )
