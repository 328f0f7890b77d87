"""Robot files: the ``robot`` table of a scenario as a file of its own."""

from __future__ import annotations

import os

from pydantic import ValidationError

from lampyris.io.scenario.read import read_plain
from lampyris.io.scenario.schema import RobotTable
from lampyris.io.scenario.validation_errors import faults_of, raise_all


def read_robot(path: str | os.PathLike[str]) -> dict[str, float | None]:
    """What a file says of the robot.

    Parameters
    ----------
    path : YAML, or JSON if the name ends in ``.json``; keys of the ``robot`` table of scenario files::

        radius: 0.22    # metres
        v_max: 0.8      # m/s
        turn_radius: 0

    Returns
    -------
    The keys that the file has and their values; all others keep their defaults.

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
    return {key: getattr(table, key) for key in document.data}
