"""Settings are numbers in a range; what is not is refused by name."""

from __future__ import annotations

import math

import numpy as np

from lampyris.errors import SettingError


def number(where: str, value: object, least: float, most: float) -> float:
    """The value as a float from ``least`` to ``most``.

    Raises
    ------
    SettingError : ``LAW_SETTING``.
    """
    real = isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)
    if not (real and math.isfinite(value) and least <= value <= most):  # type: ignore[arg-type, operator]
        raise SettingError("LAW_SETTING", f"{value!r}", where=where, allowed=f"{least:g} to {most:g}")
    return float(value)  # type: ignore[arg-type]


def whole(where: str, value: object, least: int, most: int) -> int:
    """The value as a whole number from ``least`` to ``most``.

    Raises
    ------
    SettingError : ``LAW_SETTING``.
    """
    real = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if not (real and least <= value <= most):  # type: ignore[operator]
        allowed = f"a whole number, {least} to {most}"
        raise SettingError("LAW_SETTING", f"{value!r}", where=where, allowed=allowed)
    return int(value)  # type: ignore[call-overload, no-any-return]
