"""Nouns in a notebook: a table of what matters, and a small SVG of the map, path or speeds.

Only the colours of a field need matplotlib.
"""

from __future__ import annotations

import io
from collections.abc import Iterable, Sequence
from dataclasses import fields
from typing import Any, NamedTuple

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
from lampyris.report.html.render import render
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
    return render(
        "report/pictures/noun.html.j2",
        name=type(noun).__name__,
        facts=[(name.replace("_", " "), _value(getattr(noun, name))) for name in names],
        drawing=_drawing(noun),
        style=style,
    )


class _Map(NamedTuple):
    """The raster of a map, in cells."""

    png: bytes
    width: float
    height: float


class _Drawing(NamedTuple):
    """What the SVG of a noun is made of: size in pixels, box and the rest in its own units."""

    width: int
    height: int
    box: tuple[float, float, float, float]
    map: _Map | None
    lines: list[str]
    marks: list[tuple[float, float, str]]
    radius: float


def _value(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    return str(value) if isinstance(value, str) else brief(value)


def _drawing(noun: Any) -> _Drawing | None:
    """None where there is nothing to draw."""
    if isinstance(noun, Grid):
        return _map(noun)
    if isinstance(noun, Scene):
        return _map(noun.grid, ends=(noun.start, noun.goal))
    if isinstance(noun, Field):
        return _map(Grid(~noun.free), noun.cost, ends=(noun.goal,))
    if isinstance(noun, Trace):
        ends = (noun.scene.start, noun.goal_at(noun.ticks))
        return _map(noun.known_at(noun.ticks), lines=(noun.robot,), ends=ends)
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
) -> _Drawing:
    """The map, with lines on it; coordinates of the picture are cells."""
    from PIL import Image

    raster = draw_map(grid, _SIDE, layer, None if layer is None else style.landscape_colours())
    packed = io.BytesIO()
    Image.fromarray(raster.rgb).save(packed, format="PNG", optimize=True)
    rows, columns = raster.rgb.shape[:2]
    box = (-0.5, -0.5, float(grid.width), float(grid.height))
    return _made(box, lines, ends, _Map(packed.getvalue(), columns / raster.scale, rows / raster.scale))


def _alone(points: Any) -> _Drawing:
    """A line without its map."""
    xy = np.asarray(points, dtype=np.float64)
    low, high = xy.min(axis=0) - 1.0, xy.max(axis=0) + 1.0
    (left, top), (width, height) = low.tolist(), (high - low).tolist()
    return _made((left, top, width, height), [xy], [xy[0].tolist(), xy[-1].tolist()])


def _speeds(profile: Profile) -> _Drawing:
    """Speed over distance."""
    s, v = line_of(profile)
    x = _SIDE * s / (float(s[-1]) or 1.0)
    y = _SIDE / 3 * (1.0 - v / (float(v.max()) or 1.0))
    return _made((0.0, -2.0, float(_SIDE), _SIDE / 3 + 4.0), [np.stack((x, y), axis=-1)])


def _made(
    box: tuple[float, float, float, float],
    lines: Sequence[Any],
    ends: Iterable[Sequence[float]] = (),
    map_: _Map | None = None,
) -> _Drawing:
    """A drawing of lines with their start and goal; one end alone is a goal."""
    longest = max(box[2:])
    width, height = (max(1, round(length * _SIDE / longest)) for length in box[2:])
    given = list(ends)
    colours = (style.START, style.GOAL)[-len(given) :] if given else ()
    marks = [(x, y, colour) for (x, y), colour in zip(given, colours, strict=True)]
    return _Drawing(width, height, box, map_, [_line(one) for one in lines], marks, longest / 45)


def _line(points: Any) -> str:
    xy: Points = np.asarray(points, dtype=np.float64)
    if len(xy) > _POINTS:
        xy = xy[np.unique(np.linspace(0, len(xy) - 1, _POINTS).round().astype(np.int64))]
    return " ".join(f"{x:.5g},{y:.5g}" for x, y in xy.tolist())
