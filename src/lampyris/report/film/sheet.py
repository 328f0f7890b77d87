"""The sheet a film is drawn on: a map drawn once, a place for captions below, and who is who.

A stage draws the moments of a run on it: :mod:`lampyris.report.film.film_frames` those of a trace, tick by tick,
:mod:`lampyris.report.film.drive_film` those of a drive in continuous time.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from lampyris.model.grid import Grid
from lampyris.report.film import sprites
from lampyris.report.film.sprites import Colour, Sprite, blend
from lampyris.report.pictures.raster import draw_map
from lampyris.report.style import (
    CUT_OFF,
    FREE,
    Rgb,
    landscape_colours,
    speed_map,
    terrain_colours,
    terrain_label,
    terrain_range,
)
from lampyris.typing import BoolGrid, FloatGrid

LONG = 560
"""Pixels of the map's longer side, about."""

LEAST = 11
"""Pixels of an obstacle at least, however small the cells."""

MARGIN = 10
CAPTION = 64

_WIDE = 480
"""Pixels of the film's width at least: the caption needs them."""

_ICON, _GAP = 23, 14
"""Pixels of an icon in the legend, and between two entries."""

FLASH = {
    "wait": (110, 110, 120),
    "replan": (123, 44, 191),
    "gate": (123, 44, 191),
    "repair": (123, 44, 191),
    "hit": (200, 30, 60),
    "contact": (200, 30, 60),
    "fault": (230, 120, 0),
    "stop": (230, 120, 0),
}
"""Colour of the ring that flashes at an event."""

PAPER: Colour = (255, 255, 255)
_UNSEEN: Colour = (158, 176, 200)
"""Of cells that a robot with a sensor has not seen."""
FAINT: Colour = (107, 114, 128)
GOOD: Colour = (0, 120, 80)
BAD: Colour = (200, 30, 60)

Entry = tuple[str, Colour, str, str]
"""Shape, colour, letter and name of an obstacle."""


class Sheet:
    """A map with room for a caption and a legend below, and where things are on it.

    Parameters
    ----------
    grid : the map.
    goal : cell.
    kinds : of the obstacles, as they occur.
    scale : pixels a cell; None: chosen by the map's size.
    layer : (height, width), drawn beneath in colours from 0 to its greatest value; infinity: none.
    layer_name : what the legend calls it.
    own_goal : whether the stage draws the goal itself (:meth:`star`), because it moves or lies under a shade.
    outlined : whether the robot has a footprint, which the legend shows by a square.
    unseen : whether the legend names the shade of :meth:`shade`.
    planner : whose robot it is, for the legend.
    via : cells in the order in which they are visited, for :meth:`places`.
    """

    def __init__(
        self,
        grid: Grid,
        goal: tuple[int, int],
        kinds: Iterable[str],
        scale: int | None,
        layer: FloatGrid | None = None,
        layer_name: str = "",
        *,
        own_goal: bool = False,
        unseen: bool = False,
        outlined: bool = False,
        planner: str = "",
        via: Sequence[tuple[int, int]] = (),
    ) -> None:
        self.grid, self._goal, self._via = grid, None if own_goal else goal, via
        self._long = LONG if scale is None else scale * max(grid.width, grid.height)
        self._colours = None if layer is None else landscape_colours()
        raster = draw_map(grid, self._long, layer, self._colours)
        self.scale = raster.scale
        rows, columns = raster.rgb.shape[:2]
        self._entries = entries = _entries(grid, kinds, layer_name if layer is not None else "")
        if outlined:
            entries[0] = ("square", *entries[0][1:])
        if planner:
            entries[0] = (*entries[0][:3], f"robot, {planner}")
        if unseen:
            entries.append(("square", _UNSEEN, "", "unseen"))
        if via:
            entries.append(("square", PAPER, "", "via point"))
        # Even sizes: some players of films refuse others.
        legend = sum(_ICON + _length(name, 13) + _GAP for *_, name in entries)
        self.width = _even(max(_WIDE, columns + 2 * MARGIN, legend + 2 * MARGIN))
        self.height = _even(rows + MARGIN + CAPTION)
        self.left, self.top = (self.width - columns) // 2, MARGIN
        self._foot = self.height - CAPTION + 6
        self.size = max(LEAST, round(self.scale * (0.86 if self.scale >= 16 else 1.0)))
        self.robot = sprites.sprite("circle", sprites.ROBOT, "", max(self.size, LEAST + 3))
        self.paper = self._draw(raster.rgb)
        self._speeds = np.round(255 * speed_map()(np.linspace(0, 1, 256))[:, :3]).astype(int)

    def paper_of(self, grid: Grid, layer: FloatGrid | None = None) -> Rgb:
        """The ground with another map of the same size on it, and another layer."""
        return self._draw(draw_map(grid, self._long, layer, self._colours).rgb)

    def _draw(self, rgb: Rgb) -> Rgb:
        rows, columns = rgb.shape[:2]
        paper: Rgb = np.full((self.height, self.width, 3), PAPER, dtype=np.uint8)
        box = paper[self.top - 1 : self.top + rows + 1, self.left - 1 : self.left + columns + 1]
        box[:] = sprites.INK
        box[1:-1, 1:-1] = rgb
        self._lines(box[1:-1, 1:-1])
        self._legend(paper)
        if self._goal is not None:
            self.star(paper, *self._goal)
        return paper

    def star(self, canvas: Rgb, x: float, y: float) -> None:
        """Draw the goal at a place in cells."""
        star = sprites.sprite("star", sprites.GOAL, "", max(LEAST + 6, round(self.scale * 0.95)))
        blend(canvas, star, *self.at(x, y))

    def places(self, canvas: Rgb) -> None:
        """Draw the via points, numbered in the order in which they are visited."""
        size = max(LEAST + 6, round(self.scale * 0.95))
        for k, (x, y) in enumerate(self._via, 1):
            blend(canvas, sprites.sprite("square", PAPER, f"{k}", size, sprites.INK), *self.at(x, y))

    def shade(self, canvas: Rgb, cells: BoolGrid) -> None:
        """Shade cells, bool (height, width), as not yet seen; what lies on them shows through."""
        rows, columns = (round(self.scale * n) for n in (self.grid.height, self.grid.width))
        box = canvas[self.top : self.top + rows, self.left : self.left + columns]
        y = np.minimum(((np.arange(len(box)) + 0.5) / self.scale).astype(np.int64), self.grid.height - 1)
        x = np.minimum(((np.arange(box.shape[1]) + 0.5) / self.scale).astype(np.int64), self.grid.width - 1)
        under = cells[np.ix_(y, x)]
        box[under] = (0.35 * box[under] + 0.65 * np.array(_UNSEEN)).astype(np.uint8)

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Pixel of a place in cells."""
        return self.left + (x + 0.5) * self.scale, self.top + (y + 0.5) * self.scale

    def look(self, kind: str) -> tuple[Sprite, Colour]:
        """How an obstacle of a kind is drawn, and its colour."""
        shape, colour, letter, _ = sprites.kind_of(kind)
        return sprites.sprite(shape, colour, letter, self.size), colour

    def disc(self, radius_m: float, colour: Colour) -> Sprite | None:
        """The true size of an obstacle that is wider than a cell."""
        pixels = radius_m / self.grid.resolution * self.scale
        return sprites.ring(round(pixels), 2, colour, 0.18) if pixels > self.scale / 2 else None

    def leg(self, canvas: Rgb, a: tuple[float, float], b: tuple[float, float], share: float) -> None:
        """A piece of the path driven, cells to cells, coloured by a share of the maximum speed."""
        red, green, blue = self._speeds[round(255 * min(1.0, share))].tolist()
        _line(canvas, self.at(*a), self.at(*b), (red, green, blue), max(3, round(self.scale * 0.2)))

    def flash(self, canvas: Rgb, word: str, age: float, robot: tuple[float, float], own: float) -> None:
        """A ring that widens around the robot after an event; ``own``: half the width of its disc, pixels."""
        colour = FLASH.get(word)
        if colour is not None and age < 1.5:
            radius = round(max(LEAST, self.scale, own) * (0.8 + 0.5 * age))
            blend(canvas, sprites.ring(radius, 3 if age < 0.75 else 2, colour, 0.0), *robot)

    def caption(self, canvas: Rgb, now: str, longest: str, middle: str, state: str, colour: Colour) -> None:
        """When it is, how fast and why, and what is going on; ``longest`` keeps the second where it is."""
        canvas[self._foot : self._foot + 24] = PAPER
        x = MARGIN + 2
        _write(canvas, x, self._foot, now, 15, sprites.INK)
        _write(canvas, x + _length(longest, 15) + 22, self._foot, middle, 15, sprites.INK)
        _write(canvas, self.width - MARGIN - 2 - _length(state, 15), self._foot, state, 15, colour)

    def exact_colours(self) -> Rgb:
        """Colours that the palette must hold as they are, uint8 (n, 3): all that are no ground, where a layer
        would otherwise take the palette for itself. None without a layer."""
        colours = [] if self._colours is None else list(dict.fromkeys(map(tuple, self._signs())))
        return np.array(colours, dtype=np.uint8).reshape(-1, 3)

    def _signs(self) -> list[Colour]:
        """Colours of all that is no ground."""
        return [
            *((r, g, b) for r, g, b in self._speeds[::6].tolist()),
            FREE, PAPER, sprites.ROBOT, sprites.GOAL, sprites.INK, FAINT,
            *(colour for _, colour, _, _ in sprites.KINDS.values()), *FLASH.values(), GOOD, BAD,
        ]  # fmt: skip

    def palette_strip(self) -> Rgb:
        """Every colour a film may need, as rows of its width, so that a rare one gets into the palette."""
        colours: list[Any] = [*self._signs()]
        if self._colours is not None:
            colours += [CUT_OFF, *self._colours[::6].tolist()]
        elif (terrain := self.grid.terrain) is not None:
            values = np.unique(terrain[terrain > 0])
            colours += terrain_colours()[values[:: 1 + len(values) // 48]].tolist()
        each = -(-self.width // len(colours))
        strip = np.array(colours, dtype=np.uint8).repeat(each, axis=0)[: self.width]
        return np.broadcast_to(strip, (24, *strip.shape)).copy()

    def _lines(self, box: Rgb) -> None:
        """Faint lines between cells, where cells are large enough."""
        if self.scale < 10:
            return
        step = round(self.scale)
        for part in (box[step::step], box[:, step::step]):
            np.subtract(part, 14, out=part, where=part > 60)

    def _legend(self, paper: Rgb) -> None:
        """The entries in a row below."""
        x, y = MARGIN + 2, self._foot + 30
        for shape, colour, letter, name in self._entries:
            blend(paper, sprites.sprite(shape, colour, letter, 17), x + 9, y + 9)
            _write(paper, x + _ICON, y + 1, name, 13, FAINT)
            x += _ICON + _length(name, 13) + _GAP


def _entries(grid: Grid, kinds: Iterable[str], layer: str) -> list[Entry]:
    """Who is who: the robot, the goal, each kind of obstacle that occurs, and the layer, else the terrain."""
    entries: list[Entry] = [("circle", sprites.ROBOT, "", "robot"), ("star", sprites.GOAL, "", "goal")]
    entries += [sprites.kind_of(k) for k in dict.fromkeys(kinds)]
    if layer:
        low, high = (tuple(landscape_colours()[k].tolist()) for k in (0, 255))
        entries += [("square", low, "", f"low {layer}"), ("square", high, "", "high")]
    elif (terrain := grid.terrain) is not None:
        least, most = terrain_range(terrain)
        red, green, blue = terrain_colours()[most].tolist()
        entries.append(("square", (red, green, blue), "", terrain_label(least, most)))
    return entries


def _even(size: int) -> int:
    return size + size % 2


def _line(canvas: Rgb, a: tuple[float, float], b: tuple[float, float], colour: Colour, width: int) -> None:
    """A line with round ends, drawn on the piece of the canvas that it touches."""
    from PIL import Image, ImageDraw

    pad = width + 1
    x0, y0 = max(0, int(min(a[0], b[0])) - pad), max(0, int(min(a[1], b[1])) - pad)
    x1, y1 = int(max(a[0], b[0])) + pad + 1, int(max(a[1], b[1])) + pad + 1
    piece = canvas[y0:y1, x0:x1]
    image = Image.fromarray(piece)
    draw = ImageDraw.Draw(image)
    ends = [(x - x0, y - y0) for x, y in (a, b)]
    draw.line(ends, fill=colour, width=width)
    if width > 4:
        r = width / 2 - 0.5
        for x, y in ends:
            draw.ellipse((x - r, y - r, x + r, y + r), fill=colour)
    piece[:] = np.asarray(image)


@lru_cache(maxsize=8)
def _font(size: int) -> Any:
    from PIL import ImageFont

    return ImageFont.load_default(size=size)


def _length(words: str, size: int) -> int:
    """Width of words, pixels."""
    return round(float(_font(size).getlength(words)))


def _write(canvas: Rgb, x: int, y: int, words: str, size: int, colour: Colour) -> None:
    """Words with their upper left corner at (x, y); what does not fit is cut off."""
    from PIL import Image, ImageDraw

    piece = canvas[y : y + 2 * size, x:]
    if piece.size == 0:
        return
    image = Image.fromarray(piece)
    ImageDraw.Draw(image).text((0, 0), words, font=_font(size), fill=colour, anchor="la")
    piece[:] = np.asarray(image)
