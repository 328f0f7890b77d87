"""The stage of a film: a map drawn once, a trail that grows, bodies that move, and a caption below."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from lampyris.model.trace import Event, Trace
from lampyris.report import sprites
from lampyris.report.raster import draw_map
from lampyris.report.sprites import Colour, Sprite, blend
from lampyris.report.style import FREE, Rgb, speed_map, terrain_colours, terrain_label, terrain_range

LONG = 560
"""Pixels of the map's longer side, about."""

LEAST = 11
"""Pixels of a body at least, however small the cells."""

MARGIN = 10
CAPTION = 64

_WIDE = 480
"""Pixels of the film's width at least: the caption needs them."""

_ICON, _GAP = 23, 14
"""Pixels of an icon in the legend, and between two entries."""

_FLASH = {
    "wait": (110, 110, 120),
    "replan": (123, 44, 191),
    "gate": (123, 44, 191),
    "mend": (123, 44, 191),
    "hit": (200, 30, 60),
}
"""Colour of the ring that flashes at an event."""

_PAPER: Colour = (255, 255, 255)
_FAINT: Colour = (107, 114, 128)
_GOOD: Colour = (0, 120, 80)
_BAD: Colour = (200, 30, 60)


class Stage:
    """Draws the moments of a trace, forward in time.

    Parameters
    ----------
    trace : shown.
    scale : pixels a cell; None: chosen by the map's size.
    stride : ticks between frames, told in the caption when more than one.
    """

    def __init__(self, trace: Trace, scale: int | None, stride: int = 1) -> None:
        self.trace = trace
        self.stride = stride
        grid = trace.scene.grid
        side = max(grid.width, grid.height)
        raster = draw_map(grid, LONG if scale is None else scale * side)
        self.scale = raster.scale
        rows, columns = raster.rgb.shape[:2]
        # Even sizes: some players of films refuse others.
        legend = sum(_ICON + _length(name, 13) + _GAP for *_, name in self._entries())
        self.width = _even(max(_WIDE, columns + 2 * MARGIN, legend + 2 * MARGIN))
        self.height = _even(rows + MARGIN + CAPTION)
        self.left, self.top = (self.width - columns) // 2, MARGIN
        self._foot = self.height - CAPTION + 6
        self._paper = np.full((self.height, self.width, 3), _PAPER, dtype=np.uint8)
        box = self._paper[self.top - 1 : self.top + rows + 1, self.left - 1 : self.left + columns + 1]
        box[:] = sprites.INK
        box[1:-1, 1:-1] = raster.rgb
        self._lines(rows, columns)
        self._legend()
        size = max(LEAST, round(self.scale * (0.86 if self.scale >= 16 else 1.0)))
        looks = [sprites.kind_of(b.kind) for b in trace.bodies]
        self._looks = [sprites.sprite(shape, colour, letter, size) for shape, colour, letter, _ in looks]
        self._discs = [self._disc(b.radius, look[1]) for b, look in zip(trace.bodies, looks, strict=True)]
        self._robot = sprites.sprite("circle", sprites.ROBOT, "", max(size, LEAST + 3))
        self._robot_disc = self._disc(trace.scene.robot.radius, sprites.ROBOT)
        goal = sprites.sprite("star", sprites.GOAL, "", max(LEAST + 6, round(self.scale * 0.95)))
        blend(self._paper, goal, *self._at(*trace.scene.goal))
        self._top_speed = float(trace.speed.max(initial=0.0)) or 1.0
        self._speeds = np.round(255 * speed_map()(np.linspace(0, 1, 256))[:, :3]).astype(int)
        self._events: dict[int, list[Event]] = {}
        for event in trace.events:
            self._events.setdefault(event.tick, []).append(event)
        self.rewind()

    def rewind(self) -> None:
        """Back to the first moment."""
        self._trail = self._paper.copy()
        self._drawn = 0
        self._captioned = -1

    def frame(self, moment: float) -> Rgb:
        """The picture at a moment, in ticks; whole, or between two.

        Moments must not run back without :meth:`rewind`: the trail and the caption are kept from frame to
        frame.
        """
        tick = int(moment)
        for t in range(self._drawn, tick):
            self._leg(self._trail, t, 1.0)
        self._drawn = max(self._drawn, tick)
        if tick != self._captioned:
            self._caption(tick)
            self._captioned = tick
        canvas = self._trail.copy()
        if moment > tick:
            self._leg(canvas, tick, moment - tick)
        places = [_place(t, moment - t0) for t, t0 in zip(self.trace.tracks, self.trace.appears, strict=True)]
        robot = self._at(*_between(self.trace.robot, moment))
        for place, disc in zip(places, self._discs, strict=True):
            if place is not None and disc is not None:
                blend(canvas, disc, *self._at(*place))
        if self._robot_disc is not None:
            blend(canvas, self._robot_disc, *robot)
        self._flash(canvas, moment, robot)
        for place, look in zip(places, self._looks, strict=True):
            if place is not None:
                blend(canvas, look, *self._at(*place))
        blend(canvas, self._robot, *robot)
        return canvas

    def palette_strip(self) -> Rgb:
        """Every colour a film may need, as rows of its width, so that a rare one gets into the palette."""
        colours = [
            *self._speeds[::6].tolist(), FREE, _PAPER, sprites.ROBOT, sprites.GOAL, sprites.INK, _FAINT,
            *(colour for _, colour, _, _ in sprites.KINDS.values()), *_FLASH.values(), _GOOD, _BAD,
        ]  # fmt: skip
        if (terrain := self.trace.scene.grid.terrain) is not None:
            values = np.unique(terrain[terrain > 0])
            colours += terrain_colours()[values[:: 1 + len(values) // 48]].tolist()
        each = -(-self.width // len(colours))
        strip = np.array(colours, dtype=np.uint8).repeat(each, axis=0)[: self.width]
        return np.broadcast_to(strip, (24, *strip.shape)).copy()

    def _at(self, x: float, y: float) -> tuple[float, float]:
        """Pixel of a place in cells."""
        return self.left + (x + 0.5) * self.scale, self.top + (y + 0.5) * self.scale

    def _lines(self, rows: int, columns: int) -> None:
        """Faint lines between cells, where cells are large enough."""
        if self.scale < 10:
            return
        step = round(self.scale)
        box = self._paper[self.top : self.top + rows, self.left : self.left + columns]
        for part in (box[step::step], box[:, step::step]):
            np.subtract(part, 14, out=part, where=part > 60)

    def _disc(self, radius_m: float, colour: Colour) -> Sprite | None:
        """The true size of a body that is wider than a cell."""
        pixels = radius_m / self.trace.scene.grid.resolution * self.scale
        return sprites.ring(round(pixels), 2, colour, 0.18) if pixels > self.scale / 2 else None

    def _leg(self, canvas: Rgb, tick: int, part: float) -> None:
        """The step after a tick, or a first part of it, coloured by the speed it led to."""
        a, b = self.trace.robot[tick].tolist(), self.trace.robot[tick + 1].tolist()
        if a == b:
            return
        end = (a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1]))
        share = min(1.0, float(self.trace.speed[tick + 1]) / self._top_speed)
        red, green, blue = self._speeds[round(255 * share)].tolist()
        _line(canvas, self._at(*a), self._at(*end), (red, green, blue), max(3, round(self.scale * 0.2)))

    def _flash(self, canvas: Rgb, moment: float, robot: tuple[float, float]) -> None:
        """A ring that widens around the robot after an event."""
        for tick in range(max(0, int(moment) - 1), int(moment) + 1):
            age = moment - tick
            for event in self._events.get(tick, ()):
                colour = _FLASH.get(event.word)
                if colour is not None and age < 1.5:
                    own = 0 if self._robot_disc is None else len(self._robot_disc.alpha) / 2
                    radius = round(max(LEAST, self.scale, own) * (0.8 + 0.5 * age))
                    blend(canvas, sprites.ring(radius, 3 if age < 0.75 else 2, colour, 0.0), *robot)

    def _caption(self, tick: int) -> None:
        """Tick, speed and its cause, and what is going on; written into the ground until the next tick."""
        trace = self.trace
        self._trail[self._foot : self._foot + 24] = _PAPER
        every = f" (1 in {self.stride} shown)" if self.stride > 1 else ""
        words = [e.word for e in self._events.get(tick, ()) if e.word in _FLASH]
        state, colour = " + ".join(dict.fromkeys(words)) or "driving", sprites.INK
        if tick == trace.ticks:
            state, colour = trace.outcome.value, _GOOD if trace.arrived else _BAD
        elif words:
            colour = _FLASH[words[-1]]
        now = f"tick {tick} of {trace.ticks}{every}"
        speed = f"{trace.speed[tick]:.3g} {trace.units}  ({trace.cause[tick]})"
        x = MARGIN + 2
        longest = f"tick {trace.ticks} of {trace.ticks}{every}"
        _write(self._trail, x, self._foot, now, 15, sprites.INK)
        _write(self._trail, x + _length(longest, 15) + 22, self._foot, speed, 15, sprites.INK)
        _write(self._trail, self.width - MARGIN - 2 - _length(state, 15), self._foot, state, 15, colour)

    def _entries(self) -> list[tuple[str, Colour, str, str]]:
        """Who is who: the robot, the goal, each kind of obstacle that occurs, and the terrain."""
        entries = [("circle", sprites.ROBOT, "", "robot"), ("star", sprites.GOAL, "", "goal")]
        entries += [sprites.kind_of(k) for k in dict.fromkeys(b.kind for b in self.trace.bodies)]
        if (terrain := self.trace.scene.grid.terrain) is not None:
            least, most = terrain_range(terrain)
            red, green, blue = terrain_colours()[most].tolist()
            entries.append(("square", (red, green, blue), "", terrain_label(least, most)))
        return entries

    def _legend(self) -> None:
        """The entries in a row below."""
        x, y = MARGIN + 2, self._foot + 30
        for shape, colour, letter, name in self._entries():
            blend(self._paper, sprites.sprite(shape, colour, letter, 17), x + 9, y + 9)
            _write(self._paper, x + _ICON, y + 1, name, 13, _FAINT)
            x += _ICON + _length(name, 13) + _GAP


def _even(size: int) -> int:
    return size + size % 2


def _place(track: Any, since: float) -> tuple[float, float] | None:
    """Where an obstacle is so many ticks after its first; None before."""
    return _between(track, since) if since >= 0 else None


def _between(track: Any, moment: float) -> tuple[float, float]:
    """A place on a track, in a straight line between two ticks."""
    k = min(int(moment), len(track) - 1)
    x, y = track[k].tolist()
    part = moment - k
    if part > 0 and k + 1 < len(track):
        x1, y1 = track[k + 1].tolist()
        return x + part * (x1 - x), y + part * (y1 - y)
    return float(x), float(y)


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
