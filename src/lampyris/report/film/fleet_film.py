"""Films of a fleet: robots as coloured discs that glide to goals of their colour."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from lampyris.errors import plural
from lampyris.model.fleet.fleet import Fleet
from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.report.film import sprites
from lampyris.report.film.fleet_key import HEIGHT, key_row
from lampyris.report.film.simulation_film import FPS, Shown, check, moments, write_film
from lampyris.report.pictures.raster import draw_map
from lampyris.report.style import FLEET, OutFile, Rgb

LONG = 640
"""Pixels of the map's longer side, about."""
MARGIN = 8
CAPTION = 30
_WIDE = 420
"""Pixels of the film's width at least."""
_LEAST = 5
"""Pixels of a robot at least, however small the cells."""
_RIMMED = 8
"""Pixels of a robot from which on it has a dark rim."""


def fleet_film(
    plan: FleetPlan,
    fleet: Fleet,
    out: OutFile,
    *,
    fps: float = FPS,
    scale: int | None = None,
    progress: Callable[[int], None] | None = None,
) -> None:
    """Draw a plan of a fleet as a film, WebP (lossless) or GIF by the file's suffix; the same plan gives the same bytes.

    Walls are dark; a robot is a disc, its goal a small square of the same colour (colours repeat); below stand the tick,
    how many robots are on their goals, and a key.

    Parameters
    ----------
    plan : with paths; of one that is not found, as far as they go.
    fleet : whose plan it is.
    fps : frames a second, 1 to 50.
    scale : pixels a cell; None: so many that the longer side has about 640.
    progress : called with the number of frames drawn so far.

    Raises
    ------
    UsageError : another suffix, or a number out of its range.
    FileError : the system refuses to write.
    """
    check(out, fps, scale)
    shown = moments(_ticks(plan), fps)
    write_film(FleetRenderer(plan, fleet, scale, shown), shown, out, progress)


def _ticks(plan: FleetPlan) -> int:
    return max(len(path) for path in plan.paths) - 1


class FleetRenderer:
    """Draws the moments of a plan.

    Parameters
    ----------
    plan, fleet, scale : see :func:`fleet_film`.
    shown : which moments.
    """

    def __init__(self, plan: FleetPlan, fleet: Fleet, scale: int | None, shown: Shown) -> None:
        grid = fleet.grid
        raster = draw_map(grid, LONG if scale is None else scale * max(grid.width, grid.height))
        self._scale = raster.scale
        rows, columns = raster.rgb.shape[:2]
        # Even sizes: some players of films refuse others.
        self._width = max(_WIDE, columns + 2 * MARGIN) + 1 & ~1
        self._height = rows + MARGIN + CAPTION + HEIGHT + 1 & ~1
        self._left = (self._width - columns) // 2
        self._paper = np.full((self._height, self._width, 3), 255, dtype=np.uint8)
        self._paper[MARGIN : MARGIN + rows, self._left : self._left + columns] = raster.rgb
        self._paper[-HEIGHT:] = key_row(self._width, MARGIN, ("robot", "goal"))
        self._ticks, self._stride = _ticks(plan), shown.stride
        last = self._ticks + 1
        self._tracks = np.stack(
            [path[np.minimum(np.arange(last), len(path) - 1)] for path in plan.paths], axis=1
        )
        self._goals = np.array(fleet.goals, dtype=np.int64)
        colours = np.array(FLEET, dtype=np.uint8)
        self._colours = colours[np.arange(len(plan.paths)) % len(colours)]
        self._disc = sprites.sprite("circle", (255, 255, 255), "", max(_LEAST, round(self._scale)))
        dark = 1.0 - self._disc.rgb[..., 0].astype(np.float64) / 255
        # Of a few pixels the rim would leave no colour.
        self._rim = dark if len(dark) >= _RIMMED else np.zeros_like(dark)
        goal = max(2, round(0.5 * self._scale))
        self._stamp(
            self._paper, self._goals.astype(np.float64), np.ones((goal, goal)), np.zeros((goal, goal))
        )
        self._captioned: tuple[int, Rgb] | None = None
        self._planner = plan.planner

    def frame(self, moment: float) -> Rgb:
        """The picture at a moment, in ticks; whole, or between two."""
        tick = int(moment)
        part = moment - tick
        places = self._tracks[tick].astype(np.float64)
        if part > 0:
            places += part * (self._tracks[tick + 1] - self._tracks[tick])
        canvas = self._paper.copy()
        self._stamp(canvas, places, self._disc.alpha, self._rim)
        canvas[-CAPTION - HEIGHT : -HEIGHT] = self._caption(tick)
        return canvas

    def rewind(self) -> None:
        """Frames do not depend on each other."""

    def palette_strip(self) -> Rgb:
        """Every colour a film may need, as rows of its width."""
        colours = np.concatenate((np.array(FLEET), np.array(FLEET) // 2, [sprites.INK, (255, 255, 255)]))
        strip = colours.astype(np.uint8)[np.arange(self._width) * len(colours) // self._width]
        return np.broadcast_to(strip, (8, self._width, 3)).copy()

    def exact_colours(self) -> Rgb:
        """Colours that the palette must hold as they are, uint8 (n, 3)."""
        return np.array(FLEET, dtype=np.uint8)

    def _stamp(
        self, canvas: Rgb, places: NDArray[np.float64], alpha: NDArray[np.float64], rim: NDArray[np.float64]
    ) -> None:
        """Put one shape at the place of every robot, cells, in its colour; ``rim`` is the share of ink in it."""
        n = len(alpha)
        corner = np.round((places + 0.5) * self._scale - n / 2).astype(np.int64)
        y = np.clip(corner[:, 1, None, None] + MARGIN + np.arange(n)[:, None], 0, self._height - 1)
        x = np.clip(corner[:, 0, None, None] + self._left + np.arange(n), 0, self._width - 1)
        ink = np.array(sprites.INK, dtype=np.float64)
        colour = self._colours[:, None, None, :] * (1 - rim)[None, :, :, None] + ink * rim[None, :, :, None]
        under = canvas[y, x].astype(np.float64)
        canvas[y, x] = np.round(under + (colour - under) * alpha[None, :, :, None])

    def _caption(self, tick: int) -> Rgb:
        """Tick and robots on their goals; drawn once a tick."""
        if self._captioned is None or self._captioned[0] != tick:
            from PIL import Image, ImageDraw, ImageFont

            home = int((self._tracks[tick] == self._goals).all(axis=1).sum())
            every = f" (1 in {self._stride} shown)" if self._stride > 1 else ""
            there = f"{home} of {plural(len(self._goals), 'robot')} on their goals"
            words = f"tick {tick} of {self._ticks}{every}    {there}    {self._planner}"
            image = Image.new("RGB", (self._width, CAPTION), (255, 255, 255))
            font = ImageFont.load_default(size=14)
            ImageDraw.Draw(image).text((MARGIN, CAPTION / 2), words, font=font, fill=sprites.INK, anchor="lm")
            self._captioned = tick, np.asarray(image)
        return self._captioned[1]
