"""Nouns in a notebook: a table of what matters, and a small SVG of the map, path or speeds.

Only the colours of a field need matplotlib.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Iterable, Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from lampyris._core.noun import brief
from lampyris.model.curve import Curve
from lampyris.model.drive import Drive
from lampyris.model.field import Field
from lampyris.model.grid import Grid
from lampyris.model.path import Path
from lampyris.model.plan import Plan
from lampyris.model.profile import Profile
from lampyris.model.scene import Scene
from lampyris.model.trace import Trace
from lampyris.report import style
from lampyris.report.charts.speed_chart import line_of
from lampyris.report.html.page import Markup, join, tag
from lampyris.report.pictures.raster import draw_map
from lampyris.typing import FloatGrid, Points

_SIDE = 240
"""Pixels of the longer side of a small picture."""
_POINTS = 500
"""Points of a line in it at most."""

_FACTS: dict[type, tuple[str, ...]] = {
    Grid: ("name", "width", "height", "resolution", "origin"),
    Path: ("cost", "steps"),
    Plan: (
        "status",
        "planner",
        "cost",
        "optimal_cost",
        "gap",
        "steps",
        "iterations",
        "expansions",
        "sentence",
    ),
    Field: ("goal", "expansions", "rho", "gamma"),
    Profile: ("law", "duration", "mean", "units"),
    Curve: ("length", "resolution"),
    Trace: (
        "outcome",
        "planner",
        "law",
        "seed",
        "ticks",
        "replans",
        "waits",
        "cost",
        "collisions",
        "sentence",
    ),
    Drive: ("outcome", "planner", "law", "seed", "duration", "optimum", "replans", "sentence"),
}
"""What is shown of a noun with many fields; of the others all fields are."""


def html_of(noun: Any) -> str:
    """A noun as HTML, self-contained: a table, and a picture where there is something to draw.

    Parameters
    ----------
    noun : any noun of :mod:`lampyris.model`, or one made as they are.
    """
    names = _FACTS.get(type(noun)) or tuple(f.name for f in fields(noun) if f.repr)
    rows = [
        tag("tr", tag("th", name.replace("_", " ")), tag("td", _value(getattr(noun, name)))) for name in names
    ]
    table = tag("table", tag("caption", type(noun).__name__), tag("tbody", join(rows)))
    return tag("div", table, _picture(noun))


def _value(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    return str(value) if isinstance(value, str) else brief(value)


def _picture(noun: Any) -> Markup | None:
    """The small SVG of a noun; None where there is nothing to draw."""
    if isinstance(noun, Grid):
        return _map(noun)
    if isinstance(noun, Scene):
        return _map(noun.grid, ends=(noun.start, noun.goal))
    if isinstance(noun, Field):
        return _map(Grid(~noun.free), noun.cost, ends=(noun.goal,))
    if isinstance(noun, Trace):
        return _map(noun.scene.grid, lines=(noun.robot,), ends=(noun.scene.start, noun.scene.goal))
    if isinstance(noun, Drive):
        driven = noun.at(np.linspace(0.0, noun.duration, _POINTS))[0] if len(noun.t) and noun.curves else None
        return _map(
            noun.scene.grid,
            lines=() if driven is None else (driven,),
            ends=(noun.scene.start, noun.scene.goal),
        )
    if isinstance(noun, Plan):
        return None if noun.path is None else _alone(noun.path.cells)
    if isinstance(noun, Path):
        return _alone(noun.cells)
    if isinstance(noun, Curve):
        return _alone(noun.at(np.linspace(0.0, noun.length, _POINTS))[0])
    return _speeds(noun) if isinstance(noun, Profile) and len(noun.s) else None


def _map(
    grid: Grid,
    layer: FloatGrid | None = None,
    lines: Sequence[Any] = (),
    ends: Iterable[Sequence[float]] = (),
) -> Markup:
    """The map, with lines on it; coordinates of the picture are cells."""
    from PIL import Image

    raster = draw_map(grid, _SIDE, layer, None if layer is None else style.landscape_colours())
    packed = io.BytesIO()
    Image.fromarray(raster.rgb).save(packed, format="PNG", optimize=True)
    rows, columns = raster.rgb.shape[:2]
    source = f"data:image/png;base64,{base64.b64encode(packed.getvalue()).decode('ascii')}"
    size = f'width="{columns / raster.scale:g}" height="{rows / raster.scale:g}"'
    image = f'<image x="-0.5" y="-0.5" {size} preserveAspectRatio="none" href="{source}"/>'
    box = (-0.5, -0.5, float(grid.width), float(grid.height))
    return _svg(box, [image, *map(_line, lines), *_marks(ends, max(grid.width, grid.height))])


def _alone(points: Any) -> Markup:
    """A line without its map."""
    xy = np.asarray(points, dtype=np.float64)
    low, high = xy.min(axis=0) - 1.0, xy.max(axis=0) + 1.0
    size = high - low
    ends = [xy[0].tolist(), xy[-1].tolist()]
    return _svg((*low.tolist(), *size.tolist()), [_line(xy), *_marks(ends, float(size.max()))])


def _speeds(profile: Profile) -> Markup:
    """Speed over distance."""
    s, v = line_of(profile)
    x = _SIDE * s / (float(s[-1]) or 1.0)
    y = _SIDE / 3 * (1.0 - v / (float(v.max()) or 1.0))
    return _svg((0.0, -2.0, float(_SIDE), _SIDE / 3 + 4.0), [_line(np.stack((x, y), axis=-1))])


def _line(points: Any) -> str:
    xy: Points = np.asarray(points, dtype=np.float64)
    if len(xy) > _POINTS:
        xy = xy[np.unique(np.linspace(0, len(xy) - 1, _POINTS).round().astype(np.int64))]
    where = " ".join(f"{x:.5g},{y:.5g}" for x, y in xy.tolist())
    look = f'fill="none" stroke="{style.START}" stroke-width="2" vector-effect="non-scaling-stroke"'
    return f'<polyline points="{where}" {look}/>'


def _marks(ends: Iterable[Sequence[float]], size: float) -> list[str]:
    """Start and goal; a goal alone is the last."""
    given = list(ends)
    colours = (style.START, style.GOAL)[-len(given) :] if given else ()
    return [
        f'<circle cx="{x:g}" cy="{y:g}" r="{size / 45:.3g}" fill="{colour}" stroke="{style.INK}" '
        'vector-effect="non-scaling-stroke"/>'
        for (x, y), colour in zip(given, colours, strict=True)
    ]


def _svg(box: tuple[float, ...], parts: Iterable[str]) -> Markup:
    x, y, width, height = box
    scale = _SIDE / max(width, height)
    size = f'width="{max(1, round(width * scale))}" height="{max(1, round(height * scale))}"'
    view = f'viewBox="{x:g} {y:g} {width:g} {height:g}"'
    return Markup(f'<svg xmlns="http://www.w3.org/2000/svg" {size} {view}>{"".join(parts)}</svg>')
