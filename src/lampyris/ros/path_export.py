"""Paths for other programs: nav_msgs/Path as JSON or YAML, as ``ros2 topic echo`` and ``rosbridge`` have it."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path as FilePath
from typing import Any, TypeAlias

import numpy as np

from lampyris._core import elementary
from lampyris._core.predicates import numbers
from lampyris.errors import SettingError, UsageError, shown
from lampyris.io.files import write_file
from lampyris.model.drive import Drive
from lampyris.model.grid import MapFrame
from lampyris.model.plan import Plan
from lampyris.model.profile import Profile
from lampyris.model.trace import Trace
from lampyris.ros import messages
from lampyris.ros.messages import Fields
from lampyris.typing import Cells, Floats

SUFFIXES = (".json", ".yaml", ".yml")
Driven: TypeAlias = Plan | Trace | Drive
"""What has a path."""


def path_poses(what: Driven) -> Floats:
    """Poses of a path: x, y (metres of the map frame) and yaw (radians), float64 (n, 3).

    Of a planner of poses its poses; of an any-angle planner its turning points; else the centres of the cells, with the
    direction of the step that leaves each. Of a simulation what was driven: of a drive at the ends of its segments, of a
    simulation in ticks the cells without waits.

    Raises
    ------
    UsageError : ``EXPORT``: there is no path.
    """
    if isinstance(what, Drive):
        if not what.curves:
            raise UsageError("EXPORT", "a robot that never set off has no path")
        return what.poses(what.t)
    if isinstance(what, Plan) and what.pose_path is not None:
        return np.array(what.pose_path.poses)
    frame: MapFrame | None = what.frame if isinstance(what, Plan) else what.scene.grid.frame
    cells: Cells | Floats | None = what.path.cells if what.path is not None else None
    if cells is None or frame is None:
        raise UsageError("EXPORT", f"no path: {what.sentence}", allowed="a plan or run with a path")
    if isinstance(what, Plan) and what.waypoints is not None:
        cells = what.waypoints
    xy = frame.to_metres(cells)
    return np.column_stack((xy, _along(xy, frame)))


def _along(xy: Floats, frame: MapFrame) -> Floats:
    """The direction of the line that leaves each point; the last keeps the one before."""
    if len(xy) < 2:
        return np.full(len(xy), frame.origin[2])
    d = np.diff(xy, axis=0)
    yaw = elementary.atan2(d[:, 1], d[:, 0])
    return np.append(yaw, yaw[-1])


def path_fields(what: Driven, profile: Profile | None = None, t: float = 0.0) -> dict[str, Any]:
    """The nav_msgs/Path of a plan or a run.

    Parameters
    ----------
    what : of which.
    profile : of the plan's cells: the stamp of each pose is then when the robot is to be there.
    t : seconds: stamp of the path.
    """
    poses = path_poses(what)
    times = None
    if isinstance(what, Drive):
        times = t + what.t
    elif profile is not None and profile.metric and len(profile.t) == len(poses):
        times = t + profile.t
    return messages.path(t, poses, times)


def export_path(what: Driven | Floats, path: str | os.PathLike[str], profile: Profile | None = None) -> None:
    """Write a path as nav_msgs/Path.

    Parameters
    ----------
    what : a plan, a simulation, a drive, or poses, float64 (n, 3): x, y (metres of the map frame), yaw.
    path : ``.json`` or ``.yaml``; a file that exists is replaced.
    profile : of the plan: its times become the poses' stamps.

    Raises
    ------
    UsageError : ``SUFFIX``; ``EXPORT``: no path.
    SettingError : ``POSES``: an array of another shape, or numbers that are not finite.
    FileError : ``FILE_WRITE``.

    Examples
    --------
    >>> import json, pathlib, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder) / "path.json"
    ...     export_path([(0.0, 0.0, 0.0), (1.0, 0.5, 0.0)], file)
    ...     json.loads(file.read_text())["poses"][1]["pose"]["position"]
    {'x': 1.0, 'y': 0.5, 'z': 0.0}
    """
    suffix = FilePath(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise UsageError("SUFFIX", repr(suffix), where=str(path), allowed=", ".join(SUFFIXES))
    if isinstance(what, Plan | Trace | Drive):
        fields = path_fields(what, profile)
    else:
        poses = numbers(what, (None, 3))
        if poses is None or not np.isfinite(poses).all():
            raise SettingError("POSES", shown(what), where="what", allowed="finite numbers of shape (n, 3)")
        fields = messages.path(0.0, poses)
    write_file(path, (json_text(fields) if suffix == ".json" else yaml_text(fields)).encode())


def json_text(fields: Fields) -> str:
    """A path as JSON, a pose a line."""
    poses = ",\n".join(json.dumps(one) for one in fields["poses"])
    return f'{{"header": {json.dumps(fields["header"])}, "poses": [\n{poses}\n]}}\n'


def yaml_text(fields: Fields) -> str:
    """The same as YAML, which ``ros2 topic pub`` takes."""
    lines = [f"header: {_flow(fields['header'])}", "poses:" + (" []" if not fields["poses"] else "")]
    lines += [f"- header: {_flow(one['header'])}\n  pose: {_flow(one['pose'])}" for one in fields["poses"]]
    return "\n".join(lines) + "\n"


def _flow(value: Any) -> str:
    """A value in YAML's flow style; numbers have a point, because YAML 1.1 takes ``1e-05`` for text."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_flow(one)}" for key, one in value.items()) + "}"
    if isinstance(value, float):
        assert math.isfinite(value)
        text = repr(value)
        mantissa, e, power = text.partition("e")
        return text if not e else f"{mantissa if '.' in mantissa else mantissa + '.0'}e{power}"
    return str(value)
