"""A map with a curve on it, coloured by speed or by what holds the robot back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from lampyris.errors import UsageError
from lampyris.model.grid import Grid
from lampyris.model.obstacles import ObstacleStates
from lampyris.model.profile import Profile
from lampyris.model.robot import Robot
from lampyris.report import style
from lampyris.report.charts.speed_chart import runs_of
from lampyris.report.data.metrics import cause_shares, worth_telling
from lampyris.report.pictures import canvas
from lampyris.report.pictures.canvas import FigureLayout
from lampyris.report.pictures.footprints import outlines_along
from lampyris.typing import Floats, Points

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOUR_BY = ("speed", "cause")


def draw_sampled_path(
    grid: Grid,
    profile: Profile,
    out: style.OutFile,
    *,
    by: str = "speed",
    obstacle_states: ObstacleStates | None = None,
    given: Points | None = None,
    radius: float = 0.0,
    poses: Floats | None = None,
    robot: Robot | None = None,
) -> None:
    """Draw a profile's curve on its map, as PNG or SVG by the file's suffix.

    The same arguments give the same bytes.

    Parameters
    ----------
    profile : with the places of its nodes (``xy``).
    by : ``speed``: dark is slow; ``cause``: each in its colour, with its share of the time in the legend.
    obstacle_states : moving obstacles; drawn with their sizes and, if it is known, where they go within a second.
    given : the path as it was given, cells (n, 2); drawn as a thin line.
    radius : of the robot, metres; what it sweeps is drawn pale.
    poses, robot : poses of the map frame, (n, 3), and the robot that is drawn at them to scale; None: none is drawn.

    Raises
    ------
    UsageError : another suffix, no such colouring, or a profile without places.
    FileError : the system refuses to write.
    """
    suffix = style.suffix_of(out, (".png", ".svg"))
    if by not in COLOUR_BY:
        raise UsageError("COLOUR_BY", repr(by), where="by", allowed=" or ".join(COLOUR_BY))
    if profile.xy is None:
        raise UsageError("PICTURE", "a profile without places", allowed="one of a sampled path (xy)")
    top = float(profile.v.max()) or 1.0
    bars = [(style.speed_map(), top, f"speed ({profile.units})")] if by == "speed" else []
    labels = _cause_labels(profile) if by == "cause" else {}
    others = ["start", "goal", "wall", "moving obstacle", "path given", "robot to scale"] if labels else []
    words = [*labels.values(), *others]
    figure, axes, frame = canvas.blank(grid, bars, labels=words)
    items = _draw_given(axes, given)
    items = _draw_line(axes, profile, labels, frame, radius / grid.resolution) + items
    items += _draw_obstacles(axes, obstacle_states, grid)
    items += _draw_robot(axes, poses, robot, grid)
    items = canvas.draw_ends(axes, profile.xy[0].tolist(), profile.xy[-1].tolist(), frame) + items
    items += canvas.patches(grid, None)
    title = f"{profile.law} law on {grid.name or 'a map'}"
    unit = ("m", "s") if profile.metric else ("cells", "transfers")
    subtitle = f"{profile.s[-1]:.4g} {unit[0]} in {profile.duration:.4g} {unit[1]}"
    mean = profile.s[-1] / profile.duration if profile.metric and profile.duration else profile.mean
    subtitle += f"  ·  mean {mean:.3g} {profile.units}, greatest {profile.v.max():.3g}"
    canvas.draw_words(figure, frame, title, subtitle, canvas.size_of(grid), items)
    style.save(figure, out, suffix, canvas.DPI)


def _cause_labels(profile: Profile) -> dict[str, str]:
    """A legend entry for each cause, the one that holds longest first."""
    return {c.cause: f"{c.cause} {c.time:.0%}" for c in worth_telling(cause_shares(profile))}


def _draw_line(
    axes: Axes, profile: Profile, labels: dict[str, str], frame: FigureLayout, radius: float
) -> list[Any]:
    """The curve over a dark casing, each edge in a colour of its own."""
    from matplotlib.collections import LineCollection
    from matplotlib.lines import Line2D

    xy = profile.xy
    assert xy is not None
    width = float(np.clip(frame.cell * 0.22, 2.0, 5.5))
    if radius * frame.cell > width:
        # What the disc sweeps: a line as wide as the disc, in points.
        axes.plot(
            xy[:, 0], xy[:, 1], color=style.INK, alpha=0.08, linewidth=2 * radius * frame.cell,
            solid_capstyle="round", solid_joinstyle="round", zorder=2.5,
        )  # fmt: skip
    for colour, wider in (("white", 3.0), (style.INK, 1.8)):
        look: dict[str, Any] = {"color": colour, "linewidth": width + wider, "zorder": 3}
        axes.plot(xy[:, 0], xy[:, 1], solid_capstyle="round", solid_joinstyle="round", **look)
    if not labels:
        edges = list(np.stack((xy[:-1], xy[1:]), axis=1))
        lines = LineCollection(edges, cmap=style.speed_map(), linewidths=width, capstyle="round", zorder=4)
        lines.set_array((profile.v[:-1] + profile.v[1:]) / 2)
        lines.set_clim(0, float(profile.v.max()) or 1.0)
        axes.add_collection(lines, autolim=False)
        return [Line2D([], [], color=style.speed_map()(0.6), linewidth=3, label="path, by speed")]
    colours = style.cause_colours(profile.cause)
    # Each node's colour reaches half an edge to both sides, as in the chart.
    halves = np.concatenate((xy[:1], (xy[:-1] + xy[1:]) / 2, xy[-1:]))
    runs = runs_of(profile.cause)
    parts = [np.concatenate((halves[a : a + 1], xy[a:b], halves[b : b + 1])) for a, b in runs]
    inks = [colours[profile.cause[a]] for a, _ in runs]
    shown = LineCollection(parts, colors=inks, linewidths=width, capstyle="butt", zorder=4)
    axes.add_collection(shown, autolim=False)
    return [Line2D([], [], color=colours[c], linewidth=3, label=text) for c, text in labels.items()]


def _draw_given(axes: Axes, given: Points | None) -> list[Any]:
    from matplotlib.lines import Line2D

    if given is None or len(given) < 2:
        return []
    look: dict[str, Any] = {"color": style.FAINT, "linewidth": 1.0, "linestyle": (0, (4, 2))}
    axes.plot(given[:, 0], given[:, 1], zorder=2.8, **look)
    return [Line2D([], [], label="path given", **look)]


def _draw_robot(axes: Axes, poses: Floats | None, robot: Robot | None, grid: Grid) -> list[Any]:
    """The robot to scale at places along a path of poses."""
    from matplotlib.collections import PolyCollection
    from matplotlib.patches import Patch

    if poses is None or robot is None:
        return []
    polygons = [grid.frame.to_points(one[:, 0], one[:, 1]) for one in outlines_along(poses, robot)]
    look: dict[str, Any] = {"facecolor": style.with_alpha(style.INK, 0.06), "edgecolor": style.INK}
    axes.add_collection(PolyCollection(polygons, linewidths=0.7, zorder=2.7, **look), autolim=False)
    return [Patch(label="robot to scale", linewidth=0.7, **look)]


def _draw_obstacles(axes: Axes, obstacle_states: ObstacleStates | None, grid: Grid) -> list[Any]:
    """Discs with their sizes, numbered as the causes call them, and arrows."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Circle

    if obstacle_states is None or not len(obstacle_states):
        return []
    colour = style.CAUSES["moving obstacle"]
    for k, (x, y) in enumerate(obstacle_states.xy.tolist()):
        size = max(float(obstacle_states.radius[k]) / grid.resolution, 0.25)
        axes.add_patch(Circle((x, y), size, facecolor=colour, edgecolor=style.INK, linewidth=0.8, zorder=2.9))
        look: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 7, "color": style.INK}
        axes.text(x, y, str(k), zorder=5.5, clip_on=True, **look)
        if obstacle_states.velocity is not None and (v := obstacle_states.velocity[k]).any():
            rim = np.array((x, y)) + v / np.sqrt((v * v).sum()) * size
            arrow: dict[str, Any] = {"arrowstyle": "->", "color": style.INK, "linewidth": 1.0}
            axes.annotate("", rim + v / grid.resolution, rim, arrowprops=arrow, zorder=5.2)
    mark: dict[str, Any] = {"marker": "o", "markerfacecolor": colour, "markeredgecolor": style.INK}
    return [Line2D([], [], linestyle="", markersize=8, label="moving obstacle", **mark)]
