"""Plots on your own matplotlib axes: metres of the map frame, x to the right and y up.

Every function takes ``ax=None`` (the current axes of pyplot, which are made if there are none) and returns the axes,
so that plots can be laid over each other and changed afterwards::

    ax = lampyris.plot.grid(scene.grid)
    lampyris.plot.path(plan, ax=ax, color="tab:blue")
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from lampyris._core import elementary
from lampyris._core.cancellation import uninterrupted
from lampyris._core.predicates import numbers
from lampyris.errors import SettingError, of_kind, shown
from lampyris.model.curve import Curve
from lampyris.model.drive import Drive
from lampyris.model.field import Field
from lampyris.model.grid import Grid, MapFrame
from lampyris.model.path import Path
from lampyris.model.plan import Plan
from lampyris.model.profile import Profile
from lampyris.model.scene import Scene
from lampyris.model.trace import Trace
from lampyris.motion.geometry.sampled_path import SampledPath
from lampyris.report import style
from lampyris.report.charts.speed_chart import draw_speed_on, line_of
from lampyris.report.data.gaps import with_footprint
from lampyris.report.pictures.footprints import outlines_along
from lampyris.report.pictures.raster import draw_map
from lampyris.typing import Cell, FloatGrid, Points

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["compare", "drive", "field", "grid", "path", "profile", "scene", "trace"]

PathLike: TypeAlias = Plan | Path | SampledPath | Curve | ArrayLike
"""What can be drawn as a path: one with places in cells."""

_PIXELS = 1200
"""Pixels of the longer side of a map, about."""
_SAMPLES = 1000
"""Points at which curves and drives are drawn."""


def grid(grid: Grid, *, ax: Axes | None = None) -> Axes:
    """A map: walls dark, unknown cells striped, terrain ochre.

    Parameters
    ----------
    grid : the map.
    ax : where to draw; None: the current axes.
    """
    of_kind("grid", grid, Grid)
    return _ground(grid, None, _axes(ax))


def field(field: Field, grid: Grid, *, layer: str = "cost", ax: Axes | None = None) -> Axes:
    """A cost-to-go field, on its map.

    Parameters
    ----------
    field : of :func:`lampyris.solve_field`.
    grid : its map.
    layer : ``cost`` or ``luciferin``.
    ax : where to draw; None: the current axes.

    Raises
    ------
    SettingError : no such layer; a field of another map.
    """
    of_kind("field", field, Field)
    of_kind("grid", grid, Grid)
    if layer not in ("cost", "luciferin"):
        raise SettingError("LAYER", shown(layer), where="layer", allowed="cost, luciferin")
    if field.free.shape != grid.blocked.shape:
        what = f"a field of shape {field.free.shape} on a map of shape {grid.blocked.shape}"
        raise SettingError("FIELD", what, where="grid", allowed="the map of the field")
    axes = _ground(grid, field.cost if layer == "cost" else field.luciferin, _axes(ax))
    _ends(axes, grid.frame, None, field.goal)
    return axes


def scene(scene: Scene, *, ax: Axes | None = None) -> Axes:
    """The map of a scene with its start and goal.

    Parameters
    ----------
    scene : what to draw.
    ax : where to draw; None: the current axes.
    """
    of_kind("scene", scene, Scene)
    axes = grid(scene.grid, ax=ax)
    _ends(axes, scene.grid.frame, scene.start, scene.goal)
    return axes


def path(path: PathLike, grid: Grid | None = None, *, ax: Axes | None = None, **line: Any) -> Axes:
    """A path as a line; the map is not drawn, see :func:`grid`.

    Parameters
    ----------
    path : a plan that found one, a path, a sampled path, a curve, or points (n, 2) in cells.
    grid : its map; None: a plan of :func:`lampyris.plan` knows where its cells lie, all else needs it.
    ax : where to draw; None: the current axes.
    line : properties of the line, as for ``Axes.plot``.

    Raises
    ------
    SettingError : nothing that can be drawn as a path, or a plan without one; no map where one is needed.
    """
    of_kind("grid", grid, Grid, none=True)
    where = path.frame if grid is None and isinstance(path, Plan) else None if grid is None else grid.frame
    xy = _points(path)
    if where is None:
        raise SettingError(
            "GRID", "this path does not know its map", where="grid", allowed="the map of the path"
        )
    axes = _axes(ax)
    metres = where.to_metres(xy)
    look: dict[str, Any] = {"color": style.PATH, "linewidth": 2.0}
    axes.plot(metres[:, 0], metres[:, 1], **(look | line))
    _in_metres(axes)
    return axes


def profile(profile: Profile, *, ax: Axes | None = None) -> Axes:
    """Speed over distance, the area below coloured by what limits the speed.

    Parameters
    ----------
    profile : what to draw; in metres and m/s, or in cells and velocity units.
    ax : where to draw; None: the current axes.
    """
    of_kind("profile", profile, Profile)
    axes = _axes(ax)
    draw_speed_on(axes, profile)
    return axes


def trace(trace: Trace, *, ax: Axes | None = None) -> Axes:
    """A simulation: its map, where the robot and the obstacles went, start and goal; of a robot with a sensor the map as it
    was known at the end.

    Parameters
    ----------
    trace : of :func:`lampyris.simulate`.
    ax : where to draw; None: the current axes.
    """
    of_kind("trace", trace, Trace)
    scene = replace(
        trace.scene, grid=trace.known_at(trace.ticks), goal=trace.goal_at(trace.ticks), goal_pose=None
    )
    return _run(scene, trace.robot, trace.tracks, ax)


def drive(drive: Drive, *, ax: Axes | None = None) -> Axes:
    """A drive in continuous time: its map, where the robot and the obstacles went, start and goal.

    A robot with a footprint and a heading is drawn to scale along its path.

    Parameters
    ----------
    drive : of :func:`lampyris.drive`.
    ax : where to draw; None: the current axes.
    """
    of_kind("drive", drive, Drive)
    driven = drive.at(np.linspace(0.0, drive.duration, _SAMPLES))[0] if len(drive.t) else np.zeros((0, 2))
    axes = _run(drive.scene, driven, [track.xy for track in drive.tracks], ax)
    if with_footprint(drive) and len(drive.t):
        from matplotlib.collections import PolyCollection

        poses = drive.poses(np.linspace(0.0, drive.duration, _SAMPLES))
        look: dict[str, Any] = {"facecolor": style.with_alpha(style.FOOTPRINT, 0.22), "edgecolor": style.INK}
        shown_ = PolyCollection(outlines_along(poses, drive.scene.robot), linewidths=0.7, zorder=2.5, **look)
        axes.add_collection(shown_, autolim=False)
    return axes


def compare(
    results: Mapping[str, Any] | Sequence[Any], grid: Grid | None = None, *, ax: Axes | None = None
) -> Axes:
    """Several paths, or several profiles, in one plot with a legend.

    Parameters
    ----------
    results : plans (or what else :func:`path` takes), or profiles, by the name to show; without names, the
        planners' or the laws'.
    grid : the map of the paths: it is drawn below them; None: none is.
    ax : where to draw; None: the current axes.

    Raises
    ------
    SettingError : ``COMPARE``: nothing to compare, profiles beside paths, or profiles in different units.
    """
    named = (
        list(results.items())
        if isinstance(results, Mapping)
        else [(_name(one, k), one) for k, one in enumerate(_sequence(results))]
    )
    profiles = [one for _, one in named if isinstance(one, Profile)]
    if not named or len(profiles) not in (0, len(named)) or len({one.units for one in profiles}) > 1:
        what = "no results" if not named else "results of different kinds or units"
        raise SettingError("COMPARE", what, where="results", allowed="paths, or profiles of one unit")
    axes = _axes(ax)
    if grid is not None and not profiles:
        of_kind("grid", grid, Grid)
        _ground(grid, None, axes)
    for k, (name, one) in enumerate(named):
        look: dict[str, Any] = {"color": f"C{k % 10}", "label": name, "linewidth": 2.0}
        if isinstance(one, Profile):
            axes.plot(*line_of(one), **look)
        else:
            path(one, grid, ax=axes, **look)
    if profiles:
        first = profiles[0]
        axes.set(
            xlabel=f"distance along the path ({'m' if first.metric else 'cells'})",
            ylabel=f"speed ({first.units})",
        )
    axes.legend()
    return axes


def _sequence(results: object) -> Sequence[Any]:
    if not isinstance(results, list | tuple):
        raise SettingError(
            "COMPARE", shown(results), where="results", allowed="results by name, or a list of them"
        )
    return results


def _name(result: object, k: int) -> str:
    name = getattr(result, "planner", None) or getattr(result, "law", None)
    return str(name) if name else f"path {k + 1}"


def _axes(ax: Axes | None) -> Axes:
    """The axes given, or the current ones of pyplot."""
    with uninterrupted():
        from matplotlib.axes import Axes as Given

    if isinstance(ax, Given):
        return ax
    if ax is not None:
        raise SettingError("AXES", shown(ax), where="ax", allowed="axes of matplotlib, or None")
    with uninterrupted():
        from matplotlib import pyplot

    return pyplot.gca()


def _ground(grid: Grid, layer: FloatGrid | None, axes: Axes) -> Axes:
    """The map as an image in metres, turned as the map frame has it."""
    from matplotlib.transforms import Affine2D

    raster = draw_map(grid, _PIXELS, layer, None if layer is None else style.landscape_colours())
    rows, columns = raster.rgb.shape[:2]
    x0, y0, yaw = grid.origin
    step, high = grid.resolution / raster.scale, grid.height * grid.resolution
    cos, sin = (float(v) for v in elementary.direction(yaw))
    turned = Affine2D.from_values(cos, sin, -sin, cos, x0, y0)
    # Blocks at the far edges may hang over: the extent is that of the raster, the limits are those of the map.
    axes.imshow(
        raster.rgb, extent=(0.0, columns * step, high - rows * step, high), zorder=0,
        interpolation="nearest" if raster.scale >= 1 else "antialiased", transform=turned + axes.transData,
    )  # fmt: skip
    corners = grid.to_metres(
        np.array([(x, y) for x in (-0.5, grid.width - 0.5) for y in (-0.5, grid.height - 0.5)])
    )
    (left, low), (right, top) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    axes.set(xlim=(left, right), ylim=(low, top))
    _in_metres(axes)
    return axes


def _in_metres(axes: Axes) -> None:
    axes.set(xlabel="x (m)", ylabel="y (m)", aspect="equal")


def _ends(axes: Axes, where: MapFrame, start: Cell | None, goal: Cell) -> None:
    for cell, marker, colour in ((start, "o", style.START), (goal, "*", style.GOAL)):
        if cell is not None:
            x, y = where.to_metres(cell).tolist()
            look: dict[str, Any] = {"markersize": 8 if marker == "o" else 12, "markeredgecolor": style.INK}
            axes.plot([x], [y], marker, color=colour, zorder=4, **look)


def _run(scene_: Scene, driven: Any, tracks: Sequence[Any], ax: Axes | None) -> Axes:
    """A run's map, tracks of its obstacles below the robot's."""
    axes = grid(scene_.grid, ax=ax)
    for track in tracks:
        path(track, scene_.grid, ax=axes, color=style.FAINT, linewidth=0.8, alpha=0.6)
    path(driven, scene_.grid, ax=axes)
    _ends(axes, scene_.grid.frame, scene_.start, scene_.goal)
    return axes


def _points(given: object) -> Points:
    """A path's places, cells, (n, 2)."""
    if isinstance(given, Curve):
        return given.at(np.linspace(0.0, given.length, _SAMPLES))[0]
    if isinstance(given, SampledPath):
        return given.xy
    found = given.path if isinstance(given, Plan) else given
    points = numbers(found.cells if isinstance(found, Path) else found, (None, 2))
    if points is None:
        what = "this plan holds no path" if isinstance(given, Plan) else shown(given)
        raise SettingError("PATH_POINTS", what, where="path", allowed="a plan, a path, or numbers (n, 2)")
    return points
