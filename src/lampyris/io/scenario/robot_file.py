"""Robot files: the ``robot`` table of a scenario as a file of its own."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError

from lampyris.errors import SettingError
from lampyris.io.scenario.read import read_plain
from lampyris.io.scenario.schema import RobotTable
from lampyris.io.scenario.validation_errors import faults_of, raise_all
from lampyris.model.footprint import footprint_of, rectangle_of
from lampyris.model.robot import Robot


def robot_of(given: Mapping[str, Any]) -> Robot:
    """A robot from the keys of a ``robot`` table.

    Raises
    ------
    SettingError : more than one of radius, rectangle and footprint; an outline that is none.
    """
    return Robot(**_with_footprint(given))


def _with_footprint(given: Mapping[str, Any]) -> dict[str, Any]:
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


def read_robot(path: str | os.PathLike[str]) -> dict[str, Any]:
    """What a file says of the robot.

    Parameters
    ----------
    path : YAML, or JSON if the name ends in ``.json``; keys of the ``robot`` table of scenario files::

        rectangle: [1.2, 0.6]   # length, width in metres; or radius, or footprint: [[x, y], ...]
        drive: ackermann
        turn_radius: 1.5
        v_max: 0.8              # m/s

    Returns
    -------
    The keys that the file has and their values, a rectangle as ``footprint``; all others keep their defaults.

    Raises
    ------
    FileError : an unknown key, or a value out of its range; with file, line and column.
    LimitError : it is too large.
    """
    document = read_plain(os.fspath(path))
    try:
        table = RobotTable.model_validate(document.data)
    except ValidationError as problem:
        raise_all(faults_of(document, problem, RobotTable), problem.error_count())
    try:
        return _with_footprint({key: getattr(table, key) for key in document.data})
    except SettingError as fault:
        fault.where = f"{os.fspath(path)}: {fault.where}"
        raise
