"""Checks that the settings of swarm planners share: each raises a SettingError that says what is allowed."""

from __future__ import annotations

from lampyris._core.scalars import in_range
from lampyris.errors import SettingError, did_you_mean, shown


def whole(where: str, name: str, value: object, least: int, most: int) -> None:
    """A whole number from least to most."""
    if not isinstance(value, int) or isinstance(value, bool) or not least <= value <= most:
        _refuse(where, name, value, f"a whole number, {least} to {most}")


def number(where: str, name: str, value: object, least: float, most: float) -> None:
    """A finite number from least to most."""
    if not in_range(value, least, most):
        _refuse(where, name, value, f"a number, {least:g} to {most:g}")


def flag(where: str, name: str, value: object) -> None:
    """True or False."""
    if not isinstance(value, bool):
        _refuse(where, name, value, "true or false")


def one_of(where: str, name: str, value: object, allowed: tuple[str, ...]) -> None:
    """One of some words."""
    if not isinstance(value, str) or value not in allowed:
        _refuse(where, name, value, ", ".join(allowed), did_you_mean(value, allowed))


def _refuse(where: str, name: str, value: object, allowed: str, todo: str = "") -> None:
    raise SettingError.of(name.upper(), name, shown(value), where=where, allowed=allowed, todo=todo)
