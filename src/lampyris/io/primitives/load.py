"""Motion primitives from a file, whichever of the two formats it has."""

from __future__ import annotations

import os

from lampyris.errors import FileError, file_name
from lampyris.io.files import read_regular
from lampyris.io.primitives.mprim import looks_like_mprim, read_mprim
from lampyris.io.primitives.nav2_json import read_nav2
from lampyris.io.text.strict_json import MAX_BYTES
from lampyris.model.lattice.motion_primitives import MotionPrimitives


def load_primitives(path: str | os.PathLike[str]) -> MotionPrimitives:
    """Read the motion primitives of a file, by its content.

    Parameters
    ----------
    path : JSON as the generator of ``nav2_smac_planner`` writes it, or ``.mprim`` as SBPL reads it.

    Returns
    -------
    What the planner ``lattice`` takes as ``primitives``.

    Raises
    ------
    FileError : not such a file, or a primitive that does not begin and end at states of the lattice; with file, line
        and the primitive's number.
    LimitError : more bytes, headings, primitives or poses than allowed.

    Examples
    --------
    >>> import lampyris
    >>> robot = lampyris.Robot(drive="ackermann", turn_radius=0.5)
    >>> lampyris.save_primitives(lampyris.motion_primitives(robot, 0.1), "car.json")
    >>> lampyris.load_primitives("car.json").resolution
    0.1
    """
    name = file_name("path", path)
    data = read_regular(name, MAX_BYTES)
    text = data.removeprefix(b"\xef\xbb\xbf").lstrip()
    if text.startswith(b"{"):
        return read_nav2(data, name)
    if looks_like_mprim(data):
        return read_mprim(data, name)
    raise FileError(
        "PRIMITIVE_FORMAT",
        "neither JSON nor .mprim",
        where=f"{name}:1:1",
        allowed='JSON of nav2_smac_planner ("lattice_metadata", "primitives"), or "resolution_m:" first',
    )
