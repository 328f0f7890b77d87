"""Robot files: the ``robot`` table of a scenario as a file of its own."""

from __future__ import annotations

import os
from typing import Any

from pydantic import ValidationError

from lampyris.errors import SettingError
from lampyris.io.scenario.read import read_plain
from lampyris.io.scenario.robot_table import with_footprint
from lampyris.io.scenario.schema import RobotTable
from lampyris.io.scenario.validation_errors import faults_of, raise_all


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
        return with_footprint({key: getattr(table, key) for key in document.data})
    except SettingError as fault:
        fault.where = f"{os.fspath(path)}: {fault.where}"
        raise
