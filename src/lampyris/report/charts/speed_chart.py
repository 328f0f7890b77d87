"""The speed chart: how fast along the path, and what limited the robot."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lampyris.model.profile import Profile
from lampyris.report import style
from lampyris.typing import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DPI = 150

_POINTS = 8
"""Points drawn for each edge of a profile in SI units, where v over s is a root, not a line."""


def draw_speed(profile: Profile, out: style.OutFile) -> None:
    """Draw speed over distance, the area under it coloured by the binding cause; PNG or SVG by the suffix.

    Each node's colour reaches half an edge to both sides. The same profile gives the same bytes.

    Raises
    ------
    UsageError : another suffix.
    FileError : the system refuses to write.
    """
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    suffix = style.suffix_of(out, (".png", ".svg"))
    figure = Figure(figsize=(8.0, 3.2), dpi=DPI, facecolor="white")
    axes = figure.add_axes((0.085, 0.27, 0.895, 0.6))
    colours = draw_speed_on(axes, profile)
    time = "s" if profile.metric else "transfers"
    title = f"{profile.law} law:  mean {profile.mean:.4g} {profile.units}  ·  {profile.duration:.4g} {time}"
    figure.text(0.02, 0.965, title, fontsize=10, fontweight="bold", color=style.INK, va="top")
    handles = [Patch(facecolor=colour, alpha=0.8, label=cause) for cause, colour in colours.items()]
    figure.legend(
        handles=handles, loc="lower left", bbox_to_anchor=(0.02, 0.01), ncols=8, frameon=False, fontsize=8.5,
        handlelength=1.2, columnspacing=1.2, borderaxespad=0, labelcolor=style.INK,
    )  # fmt: skip
    style.save(figure, out, suffix, DPI)


def draw_speed_on(axes: Axes, profile: Profile) -> dict[str, str]:
    """Draw speed over distance on axes, the area under it coloured by the binding cause; the colour of each."""
    colours = style.cause_colours(profile.cause)
    s, v = line_of(profile)
    border = np.concatenate(([profile.s[0]], (profile.s[1:] + profile.s[:-1]) / 2, [profile.s[-1]]))
    for first, last in runs_of(profile.cause):
        here = np.concatenate(([border[first]], s[(s > border[first]) & (s < border[last])], [border[last]]))
        axes.fill_between(
            here, np.interp(here, s, v), color=colours[profile.cause[first]], linewidth=0, alpha=0.8
        )
    axes.plot(s, v, color=style.INK, linewidth=1.3, solid_joinstyle="round")
    if len(v) <= 60 * _POINTS:
        axes.plot(profile.s, profile.v, "o", color=style.INK, markersize=3)
    unit = "m" if profile.metric else "cells"
    axes.set_xlabel(f"distance along the path ({unit})", fontsize=9, color=style.INK)
    axes.set_ylabel(f"speed ({profile.units})", fontsize=9, color=style.INK)
    axes.set_xlim(float(profile.s[0]), float(profile.s[-1]) or 1.0)
    axes.set_ylim(0, 1.08 * (float(profile.v.max()) or 1.0))
    axes.tick_params(labelsize=8, colors=style.INK, length=3, width=0.6)
    axes.grid(axis="y", color="#e3e5e9", linewidth=0.7, zorder=0)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    return colours


def line_of(profile: Profile) -> tuple[Floats, Floats]:
    """Points of the curve: between nodes v^2 is linear in s (SI units), or v is (dissertation's)."""
    s, v = profile.s, profile.v
    if not profile.metric or len(s) < 2:
        return s, v
    part = np.arange(_POINTS) / _POINTS
    at = (s[:-1, None] + np.diff(s)[:, None] * part).ravel()
    x = v**2
    squared = (x[:-1, None] + np.diff(x)[:, None] * part).ravel()
    return np.append(at, s[-1]), np.append(np.sqrt(np.maximum(squared, 0.0)), v[-1])


def runs_of(causes: tuple[str, ...]) -> list[tuple[int, int]]:
    """(first, one past the last) of each stretch of one cause."""
    cuts = [k for k in range(1, len(causes)) if causes[k] != causes[k - 1]]
    return list(zip([0, *cuts], [*cuts, len(causes)], strict=True))
