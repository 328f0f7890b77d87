"""Robots from the keys of a ``robot`` table, in a scenario or in a file of its own."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from lampyris.errors import SettingError
from lampyris.model.robot import Robot, footprint_of, rectangle_of


def robot_of(given: Mapping[str, Any]) -> Robot:
    """A robot from the keys of a ``robot`` table.

    Raises
    ------
    SettingError : more than one of radius, rectangle and footprint; an outline that is none.
    """
    return Robot(**with_footprint(given))


def with_footprint(given: Mapping[str, Any]) -> dict[str, Any]:
    """The same keys with a footprint in place of a rectangle."""
    settings = dict(given)
    shapes = [name for name in ("radius", "rectangle", "footprint") if settings.get(name)]
    if len(shapes) > 1:
        raise SettingError(
            "ROBOT_FOOTPRINT", f"{' and '.join(shapes)} together", where="robot", allowed="one of them"
        )
    rectangle = settings.pop("rectangle", None)
    if rectangle is not None:
        settings["footprint"] = rectangle_of(rectangle)
    elif settings.get("footprint") is not None:
        settings["footprint"] = footprint_of(settings["footprint"])
    return settings
