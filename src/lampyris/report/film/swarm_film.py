"""Films of a swarm: robots as discs of their true size that gather at sources."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from lampyris.model.swarm.swarm_trace import SwarmTrace
from lampyris.report import style
from lampyris.report.film import sprites
from lampyris.report.film.simulation_film import FPS, Shown, check, moments, write_film
from lampyris.report.pictures.raster import draw_map
from lampyris.report.style import FLEET, OutFile, Rgb
from lampyris.typing import FloatGrid

LONG = 600
"""Pixels of the map's longer side, about."""
MARGIN = 8
CAPTION = 30
_WIDE = 460
"""Pixels of the film's width at least."""
_LEAST = 5
"""Pixels of a robot at least."""
FREE_ROBOT = (110, 116, 128)
"""Colour of a robot that no source holds in the end."""


def swarm_film(
    trace: SwarmTrace,
    out: OutFile,
    *,
    signal: FloatGrid | None = None,
    fps: float = FPS,
    progress: Callable[[int], None] | None = None,
) -> None:
    """Draw a swarm as a film, WebP (lossless) or GIF by the file's suffix; the same trace gives the same bytes.

    Robots have the colour of the source that holds them in the end, and grey if none does; sources are crosses in rings.
    Below stand the iteration and how many robots each source holds.

    Parameters
    ----------
    trace : at least one iteration.
    signal : (height, width), >= 0: drawn beneath; None: nothing.
    fps : frames a second, 1 to 50.
    progress : called with the number of frames drawn so far.

    Raises
    ------
    UsageError : another suffix, or a number out of its range.
    FileError : the system refuses to write.
    """
    check(out, fps, None)
    shown = moments(trace.iterations, fps)
    write_film(SwarmRenderer(trace, shown, signal), shown, out, progress)


def colours_of(trace: SwarmTrace) -> NDArray[np.uint8]:
    """The colour of each robot, uint8 (n, 3): that of the source that holds it at the end."""
    many = np.array([*FLEET, FREE_ROBOT], dtype=np.uint8)
    by = trace.holder
    chosen: NDArray[np.uint8] = many[np.where(by < 0, len(FLEET), by % len(FLEET))]
    return chosen


class SwarmRenderer:
    """Draws the moments of a swarm; see :func:`swarm_film`."""

    def __init__(self, trace: SwarmTrace, shown: Shown, signal: FloatGrid | None) -> None:
        grid = trace.grid
        raster = draw_map(grid, LONG, signal, None if signal is None else style.landscape_colours()[::-1])
        self._scale = raster.scale
        rows, columns = raster.rgb.shape[:2]
        # Even sizes: some players of films refuse others.
        self._width = max(_WIDE, columns + 2 * MARGIN) + 1 & ~1
        self._height = rows + MARGIN + CAPTION + 1 & ~1
        self._left = (self._width - columns) // 2
        self._paper = np.full((self._height, self._width, 3), 255, dtype=np.uint8)
        self._paper[MARGIN : MARGIN + rows, self._left : self._left + columns] = raster.rgb
        self._trace, self._stride = trace, shown.stride
        self._tracks = grid.to_points(trace.xy[..., 0], trace.xy[..., 1])
        self._peaks = grid.to_points(trace.source_xy[..., 0], trace.source_xy[..., 1])
        radius = trace.settings.radius
        assert radius is not None
        side = max(_LEAST, round(2 * radius / grid.resolution * self._scale))
        self._disc = sprites.sprite("circle", (255, 255, 255), "", side)
        dark = 1.0 - self._disc.rgb[..., 0].astype(np.float64) / 255
        self._rim = dark if side >= 8 else np.zeros_like(dark)
        self._colours = colours_of(trace)
        self._cross = _cross(max(13, side + 8))
        self._captioned: tuple[int, Rgb] | None = None

    def frame(self, moment: float) -> Rgb:
        """The picture at a moment, in iterations; whole, or between two."""
        t = int(moment)
        part = moment - t
        places, peaks = self._tracks[t], self._peaks[t]
        if part > 0:
            places = places + part * (self._tracks[t + 1] - places)
            peaks = peaks + part * (self._peaks[t + 1] - peaks)
        canvas = self._paper.copy()
        self._stamp(canvas, places, self._disc.alpha, self._rim, self._colours)
        ink = np.broadcast_to(np.array(sprites.INK, dtype=np.uint8), (len(peaks), 3))
        self._stamp(canvas, peaks, self._cross, np.zeros_like(self._cross), ink)
        canvas[-CAPTION:] = self._caption(t)
        return canvas

    def rewind(self) -> None:
        """Frames do not depend on each other."""

    def palette_strip(self) -> Rgb:
        """Every colour a film may need, as rows of its width."""
        colours = np.concatenate((self._colours, self._colours // 2, [sprites.INK, (255, 255, 255)]))
        strip = colours.astype(np.uint8)[np.arange(self._width) * len(colours) // self._width]
        return np.broadcast_to(strip, (8, self._width, 3)).copy()

    def exact_colours(self) -> Rgb:
        """Colours that the palette must hold as they are, uint8 (n, 3)."""
        return np.unique(np.concatenate((self._colours, [sprites.INK])), axis=0).astype(np.uint8)

    def _stamp(
        self, canvas: Rgb, places: NDArray[np.float64], alpha: NDArray[np.float64], rim: NDArray[np.float64],
        colours: NDArray[np.uint8],
    ) -> None:  # fmt: skip
        """Put a shape at each place, cells, in its colour; ``rim`` is the share of ink in it. Later ones lie on top."""
        n = len(alpha)
        corner = np.round((places + 0.5) * self._scale - n / 2).astype(np.int64)
        ink = np.array(sprites.INK, dtype=np.float64)
        for (cx, cy), colour in zip(corner.tolist(), colours, strict=True):
            x, y = cx + self._left, cy + MARGIN
            x0, y0, x1, y1 = max(x, 0), max(y, 0), min(x + n, self._width), min(y + n, self._height)
            if x0 >= x1 or y0 >= y1:
                continue
            share = (slice(y0 - y, y1 - y), slice(x0 - x, x1 - x))
            face = colour * (1 - rim[share])[..., None] + ink * rim[share][..., None]
            under = canvas[y0:y1, x0:x1].astype(np.float64)
            canvas[y0:y1, x0:x1] = np.round(under + (face - under) * alpha[share][..., None])

    def _caption(self, t: int) -> Rgb:
        """Iteration and robots at each source; drawn once an iteration."""
        if self._captioned is None or self._captioned[0] != t:
            from PIL import Image, ImageDraw, ImageFont

            trace = self._trace
            held = trace.held[t].tolist()
            each = ", ".join(map(str, held[:8])) + (", ..." if len(held) > 8 else "")
            every = f" (1 in {self._stride} shown)" if self._stride > 1 else ""
            words = f"iteration {t} of {trace.iterations}{every}    {sum(held)} of {trace.robots} robots at sources: {each}"
            image = Image.new("RGB", (self._width, CAPTION), (255, 255, 255))
            font = ImageFont.load_default(size=14)
            ImageDraw.Draw(image).text((MARGIN, CAPTION / 2), words, font=font, fill=sprites.INK, anchor="lm")
            self._captioned = t, np.asarray(image)
        return self._captioned[1]


def _cross(size: int) -> NDArray[np.float64]:
    """How much of each pixel a ring with a cross covers, float (size, size)."""
    from PIL import Image, ImageDraw

    fine = 6
    big = size * fine
    image = Image.new("L", (big, big), 0)
    draw = ImageDraw.Draw(image)
    line = 2 * fine
    draw.ellipse((line, line, big - 1 - line, big - 1 - line), outline=255, width=line)
    middle = big // 2
    for a, b in ((0, big // 4), (3 * big // 4, big)):
        draw.rectangle((middle - line // 2, a, middle + line // 2, b), fill=255)
        draw.rectangle((a, middle - line // 2, b, middle + line // 2), fill=255)
    small = image.resize((size, size), Image.Resampling.BOX)
    return np.asarray(small, dtype=np.float64) / 255
