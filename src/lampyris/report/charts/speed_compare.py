"""Speed laws side by side: how fast each drives the same path, and what limits one of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from lampyris.errors import UsageError
from lampyris.model.profile import Profile
from lampyris.report import style
from lampyris.report.charts.speed_chart import DPI, line_of, runs_of
from lampyris.report.data.metrics import cause_shares, worth_telling

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_NEAR = 1.15
"""Caps are drawn up to so many times the maximum speed."""


def draw_comparison(profiles: Sequence[tuple[str, Profile]], chosen: int, out: style.OutFile) -> None:
    """Draw several profiles of one path over its length, as PNG or SVG by the file's suffix.

    The chosen one is thick, its caps are faint lines, and a band below says what holds it where. The same
    profiles give the same bytes.

    Parameters
    ----------
    profiles : the name of each law and its profile, in m/s.
    chosen : which of them is looked at.

    Raises
    ------
    UsageError : another suffix, or a profile that is not in metres and seconds.
    FileError : the system refuses to write.
    """
    from matplotlib.figure import Figure

    suffix = style.suffix_of(out, (".png", ".svg"))
    for name, one in profiles:
        if not one.metric:
            raise UsageError("CHART", f"{name} is in {one.units}", allowed="profiles in m/s", setting="chart")
    law, profile = profiles[chosen]
    shares = worth_telling(cause_shares(profile))
    rows = -(-len(shares) // 6)
    figure = Figure(figsize=(9.0, 5.2 + 0.2 * rows), dpi=DPI, facecolor="white")
    foot = (0.45 + 0.2 * rows) / figure.get_figheight()
    axes = figure.add_axes((0.075, foot + 0.16, 0.7, 0.92 - foot - 0.16))
    band = figure.add_axes((0.075, foot + 0.105, 0.7, 0.035), sharex=axes)
    top = max(float(p.v.max()) for _, p in profiles) or 1.0
    faint = _draw_caps(axes, profile, top)
    lines = [_draw_law(axes, name, p, k == chosen) for k, (name, p) in enumerate(profiles)]
    _dress(axes, band, profile, top)
    _draw_band(band, profile)
    title = f"Speed along the path, {profile.s[-1]:.4g} m"
    figure.text(0.02, 0.975, title, fontsize=12, fontweight="bold", color=style.INK, va="top")
    text: dict[str, Any] = {"frameon": False, "labelcolor": style.INK, "borderaxespad": 0}
    text |= {"alignment": "left", "title_fontproperties": {"weight": "bold", "size": 8.5}, "fontsize": 8.5}
    upper = axes.get_position().y1
    laws = figure.legend(
        handles=lines, title="law, time", loc="upper left", bbox_to_anchor=(0.785, upper), **text
    )
    if faint:
        under = upper - (0.27 + 0.2 * len(laws.get_texts())) / figure.get_figheight() - 0.02
        what = f"caps of {law}"
        figure.legend(handles=faint, title=what, loc="upper left", bbox_to_anchor=(0.785, under), **text)
    _draw_causes(figure, profile, law, foot)
    style.save(figure, out, suffix, DPI)


def _draw_law(axes: Axes, name: str, profile: Profile, chosen: bool) -> Any:
    colour, kind = style.law_look(name)
    look: dict[str, Any] = {"color": colour, "linestyle": kind, "linewidth": 2.6 if chosen else 1.5}
    s, v = line_of(profile)
    axes.plot(s, v, solid_joinstyle="round", zorder=4 if chosen else 3, **look)
    from matplotlib.lines import Line2D

    return Line2D([], [], label=f"{name}, {profile.duration:.4g} s", **look)


def _draw_caps(axes: Axes, profile: Profile, top: float) -> list[Any]:
    """The rules of the chosen law before they were made feasible; those never near the curve are left out."""
    from matplotlib.lines import Line2D

    items = []
    for cause, v in profile.caps:
        low = v <= _NEAR * top
        if not low.any():
            continue
        colour = style.CAUSES.get(cause, style.FAINT)
        look: dict[str, Any] = {"color": colour, "linewidth": 1.0, "alpha": 0.8}
        # Where a rule says nothing it is far above the picture, so that one sees where it begins.
        axes.plot(profile.s, np.minimum(v, 99 * top), zorder=2, **look)
        items.append(Line2D([], [], label=cause, **look))
    return items


def _dress(axes: Axes, band: Axes, profile: Profile, top: float) -> None:
    axes.set_ylabel("speed (m/s)", fontsize=9, color=style.INK)
    axes.set_ylim(0, 1.08 * top)
    axes.set_xlim(float(profile.s[0]), float(profile.s[-1]) or 1.0)
    axes.grid(axis="y", color="#e3e5e9", linewidth=0.7, zorder=0)
    axes.set_axisbelow(True)
    band.set_yticks([])
    band.set_ylim(0, 1)
    band.set_xlabel("distance along the path (m)", fontsize=9, color=style.INK)
    for one in (axes, band):
        one.tick_params(labelsize=8, colors=style.INK, length=3, width=0.6)
        for side in ("top", "right"):
            one.spines[side].set_visible(False)
    axes.tick_params(labelbottom=False)


def _draw_band(band: Axes, profile: Profile) -> None:
    """What holds the chosen law, as a band of colours."""
    colours = style.cause_colours(profile.cause)
    s = profile.s
    border = np.concatenate((s[:1], (s[1:] + s[:-1]) / 2, s[-1:]))
    for first, last in runs_of(profile.cause):
        band.axvspan(border[first], border[last], color=colours[profile.cause[first]], linewidth=0)


def _draw_causes(figure: Any, profile: Profile, law: str, foot: float) -> None:
    from matplotlib.patches import Patch

    colours = style.cause_colours(profile.cause)
    handles = [
        Patch(facecolor=colours[c.cause], label=f"{c.cause} {c.time:.0%}")
        for c in worth_telling(cause_shares(profile))
    ]
    where = {"loc": "upper left", "bbox_to_anchor": (0.02, foot - 0.035)}
    figure.text(
        0.02, foot - 0.03, f"what limits {law}, share of the time", fontsize=8.5, fontweight="bold",
        color=style.INK, va="bottom",
    )  # fmt: skip
    figure.legend(
        handles=handles, ncols=6, frameon=False, fontsize=8.5, handlelength=1.2, columnspacing=1.2,
        borderaxespad=0, labelcolor=style.INK, **where,
    )  # fmt: skip
