"""Robots and shapes of obstacles from the keys of a table, in a scenario or in a file of its own."""

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


def with_footprint(
    given: Mapping[str, Any], owner: str = "robot", code: str = "ROBOT_FOOTPRINT"
) -> dict[str, Any]:
    """The same keys with a footprint in place of a rectangle.

    Parameters
    ----------
    owner, code : of errors: what the keys are those of, and the code.

    Raises
    ------
    SettingError : more than one of radius, rectangle and footprint; an outline that is none.
    """
    settings = dict(given)
    shapes = [name for name in ("radius", "rectangle", "footprint") if settings.get(name)]
    if len(shapes) > 1:
        raise SettingError(code, f"{' and '.join(shapes)} together", where=owner, allowed="one of them")
    rectangle = settings.pop("rectangle", None)
    if rectangle is not None:
        settings["footprint"] = rectangle_of(rectangle, f"{owner}.rectangle", code)
    elif settings.get("footprint") is not None:
        settings["footprint"] = footprint_of(settings["footprint"], f"{owner}.footprint", code)
    return settings
