"""What several controllers drove on one map: their trails with the robot to scale, and the path they were to follow."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from lampyris.errors import UsageError
from lampyris.model.drive import Drive
from lampyris.report import style
from lampyris.report.pictures import canvas
from lampyris.report.pictures.compare_picture import look_of
from lampyris.report.pictures.footprints import outlines_along
from lampyris.typing import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SAMPLES = 800
"""Points of a trail, at most a few pixels apart."""

_OUTLINED = 4
"""Drives of which the robot is drawn along the trail; of more, where it ended alone."""


def draw_trails(drives: Mapping[str, Drive], out: style.OutFile) -> None:
    """Draw drives in one scene on its map, as PNG or SVG by the file's suffix; the same drives give the same bytes.

    Parameters
    ----------
    drives : at least one, by the name to show.

    Raises
    ------
    UsageError : another suffix, or no drive.
    FileError : the system refuses to write.
    """
    suffix = style.suffix_of(out, (".png", ".svg"))
    if not drives:
        raise UsageError("PICTURE", "no drives", where="drives", allowed="at least one")
    first = next(iter(drives.values()))
    grid = first.scene.grid
    labels = [_label(name, drive) for name, drive in drives.items()]
    figure, axes, frame = canvas.blank(grid, [], labels=[*labels, "path planned", "start", "goal", "wall"])
    items = _draw_planned(axes, drives)
    for k, drive in enumerate(drives.values()):
        items.append(_draw_trail(axes, drive, k, labels[k], len(drives) <= _OUTLINED))
    items += _draw_tracks(axes, first)
    ends = [(float(x), float(y)) for x, y in (first.scene.start, first.scene.goal)]
    items = canvas.draw_ends(axes, ends[0], ends[1], frame) + items
    items += canvas.patches(grid, None)
    robot = first.scene.robot
    title = f"{robot.drive} robot on {grid.name or 'a map'}, path of {first.planner}"
    subtitle = f"what {'each controller' if len(drives) > 1 else 'the controller'} drove, robot to scale"
    canvas.draw_words(figure, frame, title, subtitle, canvas.size_of(grid), items)
    style.save(figure, out, suffix, canvas.DPI)


def _label(name: str, drive: Drive) -> str:
    return f"{name}: {drive.outcome.value}, {drive.duration:.1f} s"


def _draw_planned(axes: Axes, drives: Mapping[str, Drive]) -> list[Any]:
    """The first path, dashed; later ones differ from drive to drive."""
    from matplotlib.lines import Line2D

    planned = [(one.paths or one.curves)[:1] for one in drives.values()]
    curves = [found[0] for found in planned if found and len(found[0].lengths)]
    if not curves:
        return []
    curve = curves[0]
    xy = curve.at(np.linspace(0.0, curve.length, _SAMPLES))[0]
    look: dict[str, Any] = {"color": style.INK, "linewidth": 1.0, "linestyle": (0, (4, 2)), "alpha": 0.75}
    axes.plot(xy[:, 0], xy[:, 1], zorder=5, **look)
    return [Line2D([], [], label="path planned", **look)]


def _draw_trail(axes: Axes, drive: Drive, k: int, label: str, outlined: bool) -> Any:
    from matplotlib.collections import PolyCollection
    from matplotlib.lines import Line2D

    colour, dash = look_of(k)
    look: dict[str, Any] = {"color": colour, "linestyle": dash, "linewidth": 1.8}
    times = np.linspace(0.0, drive.duration, _SAMPLES)
    xy = drive.at(times)[0]
    axes.plot(xy[:, 0], xy[:, 1], zorder=4, **look)
    polygons = _outlines(drive, drive.poses(times))
    shown = PolyCollection(
        polygons if outlined else polygons[-1:], facecolor=style.with_alpha(colour, 0.06), edgecolor=colour,
        linewidths=0.6, zorder=3,
    )  # fmt: skip
    axes.add_collection(shown, autolim=False)
    return Line2D([], [], label=label, **look)


def _outlines(drive: Drive, poses: Floats) -> list[Floats]:
    """The robot along its trail, cells."""
    frame = drive.scene.grid.frame
    return [frame.to_points(one[:, 0], one[:, 1]) for one in outlines_along(poses, drive.scene.robot)]


def _draw_tracks(axes: Axes, drive: Drive) -> list[Any]:
    """Where the obstacles of the first drive went, faintly."""
    from matplotlib.lines import Line2D

    look: dict[str, Any] = {"color": style.CAUSES["moving obstacle"], "linewidth": 0.7, "alpha": 0.5}
    for track in drive.tracks:
        axes.plot(track.xy[:, 0], track.xy[:, 1], zorder=2, **look)
    return [Line2D([], [], label="obstacle", **look)] if drive.tracks else []
