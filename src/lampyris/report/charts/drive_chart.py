"""Charts of a drive in continuous time: how fast and why, and how near the next obstacle was."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from lampyris.model.drive import Drive
from lampyris.report import style
from lampyris.report.charts.speed_chart import DPI, runs_of
from lampyris.report.data.gaps import gaps_between
from lampyris.report.data.metrics import drive_shares, worth_telling
from lampyris.typing import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SAMPLES = 2400
"""Points in time of the lower curve, at most: two for each pixel."""

_MARKS = ("replan", "wait", "hit", "contact", "fault", "stop")
"""Events worth a line; of each kind the first is named."""


def distance_to_obstacles(drive: Drive, t: Floats) -> Floats:
    """Metres from the robot's rim to the nearest obstacle's at some times; infinity where there is none."""
    nearest = np.full(len(t), np.inf)
    for track in drive.tracks:
        nearest = np.minimum(nearest, gaps_between(drive, track, t))
    return nearest


def draw_drive(drive: Drive, out: style.OutFile) -> None:
    """Draw speed and distance to the nearest obstacle over time, as PNG or SVG by the file's suffix.

    The area under the speed is coloured by what binds it. The same drive gives the same bytes.

    Raises
    ------
    UsageError : another suffix.
    FileError : the system refuses to write.
    """
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    suffix = style.suffix_of(out, (".png", ".svg"))
    listed = worth_telling(drive_shares(drive))
    rows, beside = -(-len(listed) // 6), bool(drive.tracks)
    high = 3.3 + 1.5 * beside + 0.2 * rows
    figure = Figure(figsize=(9.0, high), dpi=DPI, facecolor="white")
    foot, upper = (0.72 + 0.2 * rows) / high, 1 - 0.48 / high
    split = foot + (upper - foot) * 0.36 if beside else foot
    axes = figure.add_axes((0.085, split + 0.03 * beside, 0.895, upper - split - 0.03 * beside))
    colours = style.cause_colours(drive.cause)
    _draw_speed(axes, drive, colours)
    last = axes
    if beside:
        last = figure.add_axes((0.085, foot, 0.895, split - foot - 0.02), sharex=axes)
        _draw_distance(last, drive)
        axes.tick_params(labelbottom=False)
    last.set_xlabel("time (s)", fontsize=9, color=style.INK)
    title = f"{drive.planner}, {drive.law} law: {drive.outcome.value} after {drive.duration:.4g} s"
    figure.text(0.02, 1 - 0.1 / high, title, fontsize=11, fontweight="bold", color=style.INK, va="top")
    handles = [Patch(facecolor=colours[c.cause], alpha=0.8, label=f"{c.cause} {c.time:.0%}") for c in listed]
    figure.legend(
        handles=handles, loc="lower left", bbox_to_anchor=(0.02, 0.06 / high), ncols=6, frameon=False,
        fontsize=8.5, handlelength=1.2, columnspacing=1.2, borderaxespad=0, labelcolor=style.INK,
    )  # fmt: skip
    style.save(figure, out, suffix, DPI)


def _draw_speed(axes: Axes, drive: Drive, colours: dict[str, str]) -> None:
    t, v = drive.t, drive.v
    end = np.append(t[1:], t[-1:])
    # A stretch's speed is a line; at its end it is what its acceleration makes of it.
    last = np.maximum(v + drive.a * (end - t), 0.0)
    line_t, line_v = np.stack((t, end), axis=1).ravel(), np.stack((v, last), axis=1).ravel()
    top = max(float(line_v.max(initial=0.0)), 1e-3)
    for a, b in runs_of(drive.cause):
        part = slice(2 * a, 2 * b)
        colour = colours[drive.cause[a]]
        # Down to below zero, so that what holds a robot that stands is seen too.
        axes.fill_between(line_t[part], -0.05 * top, line_v[part], color=colour, linewidth=0, alpha=0.8)
    axes.axhline(0.0, color=style.INK, linewidth=0.6)
    axes.plot(line_t, line_v, color=style.INK, linewidth=1.2, solid_joinstyle="round")
    seen: set[str] = set()
    for event in drive.moments:
        if event.word in _MARKS:
            look: dict[str, Any] = {"color": style.FAINT, "linewidth": 0.8, "linestyle": (0, (2, 2))}
            axes.axvline(event.t, zorder=1.5, **look)
            if event.word not in seen:
                axes.text(event.t, 1.1 * top, f" {event.word}", fontsize=7.5, color=style.FAINT, va="top")
            seen.add(event.word)
    axes.set_ylabel("speed (m/s)", fontsize=9, color=style.INK)
    axes.set_ylim(-0.05 * top, 1.12 * top)
    axes.set_xlim(0, drive.duration or 1.0)
    _plain(axes)


def _draw_distance(axes: Axes, drive: Drive) -> None:
    t = np.linspace(0.0, drive.duration, min(_SAMPLES, 2 + int(drive.duration * 50)))
    away = distance_to_obstacles(drive, t)
    axes.plot(t, np.where(np.isfinite(away), away, np.nan), color=style.CAUSES["danger"], linewidth=1.2)
    axes.axhline(0.0, color=style.CAUSES["wait"], linewidth=1.0)
    near = away[np.isfinite(away)]
    # What is much farther away than the robot needs to stop would flatten what is near.
    robot = drive.scene.robot
    enough = max(2.0, 4 * robot.v_max**2 / (2 * robot.d_max))
    axes.set_ylim(min(-0.05, float(near.min(initial=0.0))), min(enough, 1.05 * float(near.max(initial=0.5))))
    axes.set_ylabel("nearest\nobstacle (m)", fontsize=9, color=style.INK)
    _plain(axes)


def _plain(axes: Axes) -> None:
    axes.tick_params(labelsize=8, colors=style.INK, length=3, width=0.6)
    axes.grid(axis="y", color="#e3e5e9", linewidth=0.7, zorder=0)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
