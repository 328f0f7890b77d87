"""Settings are numbers in a range; what is not is refused by name."""

from __future__ import annotations

from lampyris._core.scalars import in_range, is_whole
from lampyris.errors import SettingError, shown


def number(where: str, value: object, least: float, most: float) -> float:
    """The value as a float from ``least`` to ``most``.

    Raises
    ------
    SettingError : ``LAW_SETTING``.
    """
    if not in_range(value, least, most):
        raise SettingError("LAW_SETTING", shown(value), where=where, allowed=f"{least:g} to {most:g}")
    return float(value)


def whole(where: str, value: object, least: int, most: int) -> int:
    """The value as a whole number from ``least`` to ``most``.

    Raises
    ------
    SettingError : ``LAW_SETTING``.
    """
    if not is_whole(value, least, most):
        allowed = f"a whole number, {least} to {most}"
        raise SettingError("LAW_SETTING", shown(value), where=where, allowed=allowed)
    return int(value)
