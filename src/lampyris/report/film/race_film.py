"""Films of a race: planners that explore the same map side by side on one clock, and then drive."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Literal

import numpy as np

from lampyris._core import elementary
from lampyris.errors import UsageError
from lampyris.model.race.race import Race, Racer
from lampyris.report.film import sprites
from lampyris.report.film.simulation_film import FPS, Shown, check, frame_ms, write_film
from lampyris.report.pictures.raster import draw_map
from lampyris.report.style import FREE, RACE, OutFile, Rgb
from lampyris.typing import Floats

SEARCH_S, DRIVE_S = 8.0, 6.0
"""Seconds of the film: of the search, and of the drive at most."""
WIDE, HIGH = 1200, 760
"""Pixels of the film at most, about."""
GAP, CAPTION = 10, 60
SEEN = 9.0
"""Pixels from a robot's base to its farthest side below which its shape cannot be seen."""
SHADES = 24
FIRST, LAST, FIELD, RINGS = 0.22, 0.62, 0.34, 0.85
"""Share of the planner's colour in the cells that it expanded first and last; in those of a field, and of rings after it."""
WORDS = {
    "cells": "cells expanded",
    "jump points": "jump points expanded",
    "poses": "poses expanded",
    "field and rings": "cells of field and rings",
    "tree": "lines of the tree",
    "none": "no order recorded",
}
PAPER, INK, FAINT = (231, 231, 228), (32, 36, 44), (91, 100, 114)
Clock = Literal["steps", "time"]


def race_film(
    race: Race,
    out: OutFile,
    *,
    clock: Clock = "steps",
    fps: float = FPS,
    progress: Callable[[int], None] | None = None,
) -> None:
    """Draw a race as a film, WebP (lossless) or GIF by the file's suffix.

    Each planner has a map; its cells get darker in the order in which it expanded them. Below its name stand how many cells
    it has expanded, cost, gap and milliseconds of planning. Once all have searched, the robots drive their paths with the
    times of the speed law.

    Parameters
    ----------
    clock : ``steps``: one step of every record at a time; ``time``: each record spread over its measured planning time.
    fps : frames a second, 1 to 50.
    progress : called with the number of frames drawn so far.

    Raises
    ------
    UsageError : another suffix, clock, or number out of its range.
    FileError : the system refuses to write.
    """
    check(out, fps, None)
    if clock not in ("steps", "time"):
        raise UsageError.of("CLOCK", "clock", f"{clock!r:.40}", allowed="steps, time")
    shown = moments_of(race, fps)
    write_film(RaceRenderer(race, clock), shown, out, progress)


def moments_of(race: Race, fps: float = FPS) -> Shown:
    """The moments of the film, seconds."""
    each = frame_ms(fps)
    length = SEARCH_S + min(DRIVE_S, race.duration)
    many = max(2, round(1000 * length / each))
    return Shown(tuple(length * k / (many - 1) for k in range(many)), each, 1)


class RaceRenderer:
    """Draws the moments of a race; see :func:`race_film`."""

    def __init__(self, race: Race, clock: Clock) -> None:
        grid, many = race.scene.grid, len(race.racers)
        self._race, self._clock = race, clock
        best = (0.0, 1)
        for columns in range(1, many + 1):
            rows = math.ceil(many / columns)
            wide, high = (WIDE - GAP) / columns - GAP, (HIGH - GAP) / rows - GAP - CAPTION
            best = max(best, (min(wide / grid.width, high / grid.height), columns))
        scale, self._columns = best
        raster = draw_map(grid, max(1, round(scale * max(grid.width, grid.height))))
        self._scale, self._map = raster.scale, raster.rgb
        self._rows_px, self._columns_px = raster.rgb.shape[:2]
        self._tile = max(self._columns_px, 250)
        rows = math.ceil(many / self._columns)
        self._width = self._columns * (self._tile + GAP) + GAP + 1 & ~1
        self._height = rows * (self._rows_px + CAPTION + GAP) + GAP + 1 & ~1
        self._tones = [_tones(k) for k in range(many)]
        self.rewind()

    def rewind(self) -> None:
        """Back to the first moment: nothing is explored."""
        paper = np.full((self._height, self._width, 3), PAPER, dtype=np.uint8)
        for k in range(len(self._race.racers)):
            x, y = self._corner(k)
            paper[y - CAPTION : y + self._rows_px, x : x + self._tile] = 255
            paper[y : y + self._rows_px, x : x + self._columns_px] = self._map
        self._canvas: Rgb = paper
        self._done = [0] * len(self._race.racers)
        self._moment = -1.0

    def frame(self, moment: float) -> Rgb:
        """The picture at a moment, in seconds of the film."""
        if moment < self._moment:
            self.rewind()
        self._moment = moment
        part = min(moment / SEARCH_S, 1.0)
        pace = max(1.0, self._race.duration / DRIVE_S)
        driven = (moment - SEARCH_S) * pace if moment > SEARCH_S else None
        states = [self._progress(racer, part) for racer in self._race.racers]
        for k, (steps, _) in enumerate(states):
            self._explore(k, steps)
        return self._over(states, driven)

    def _progress(self, racer: Racer, part: float) -> tuple[int, bool]:
        """Steps of its record by then, and whether its search is over."""
        looked = racer.exploration.steps
        if self._clock == "steps":
            done = part * self._race.steps / looked if looked else part
        else:
            longest = max(one.plan_s for one in self._race.racers)
            done = part * longest / racer.plan_s if racer.plan_s > 0 else 1.0
        over = done >= 1.0 or part >= 1.0
        return (looked if over else int(done * looked)), over

    def _explore(self, k: int, steps: int) -> None:
        """Colour the cells, or draw the lines, that are new."""
        looked, before = self._race.racers[k].exploration, self._done[k]
        if steps <= before:
            return
        self._done[k] = steps
        x, y = self._corner(k)
        box = self._canvas[y : y + self._rows_px, x : x + self._columns_px]
        if looked.kind == "tree":
            self._lines(box, looked.lines[before:steps], RACE[k % len(RACE)], 1)
            return
        cells = looked.cells[before:steps]
        at = np.arange(before, steps)
        shade = np.where(
            at < looked.field,
            SHADES,
            np.where(looked.field > 0, SHADES + 1, at * SHADES // max(looked.steps, 1)),
        )
        free = ~self._race.scene.grid.blocked[cells[:, 1], cells[:, 0]]
        colours = self._tones[k][shade[free]]
        left, top = (np.floor(cells[free][:, c] * self._scale).astype(np.int64) for c in (0, 1))
        side = max(1, math.ceil(self._scale))
        for dy in range(side):
            for dx in range(side):
                # Whole cells where they are pixels or more; of several in one pixel the last is seen.
                box[np.minimum(top + dy, self._rows_px - 1), np.minimum(left + dx, self._columns_px - 1)] = (
                    colours
                )

    def _over(self, states: list[tuple[int, bool]], driven: float | None) -> Rgb:
        """What lies over it: paths, marks, robots and captions."""
        from PIL import Image, ImageDraw, ImageFont

        image = Image.fromarray(self._canvas)
        pen = ImageDraw.Draw(image)
        bold, small = ImageFont.load_default(size=14), ImageFont.load_default(size=12)
        scene = self._race.scene
        for k, (racer, (steps, over)) in enumerate(zip(self._race.racers, states, strict=True)):
            x, y = self._corner(k)
            colour = RACE[k % len(RACE)]
            if over and len(racer.nodes) > 1:
                points = [self._pixel(k, *node) for node in racer.nodes.tolist()]
                pen.line(points, fill=INK, width=5, joint="curve")
                pen.line(points, fill=colour, width=3, joint="curve")
            self._mark(pen, self._pixel(k, *scene.start), "square", sprites.START)
            self._mark(pen, self._pixel(k, *scene.goal), "flag", sprites.GOAL)
            if driven is not None and len(racer.nodes) > 1:
                self._robot(pen, k, racer, driven, colour)
            pen.rectangle((x + 6, y - CAPTION + 7, x + 18, y - CAPTION + 19), fill=colour)
            pen.text((x + 24, y - CAPTION + 4), racer.label, font=bold, fill=INK)
            state = self._state(racer, over, driven)
            pen.text((x + self._tile - 6, y - CAPTION + 4), state, font=bold, fill=INK, anchor="ra")
            for line, words in enumerate(self._facts(racer, steps)):
                pen.text((x + 6, y - CAPTION + 24 + 16 * line), words, font=small, fill=FAINT)
        out: Rgb = np.asarray(image)
        return out

    def _state(self, racer: Racer, over: bool, driven: float | None) -> str:
        if not over:
            return "searching"
        if racer.plan.path is None:
            return "no path"
        if driven is None:
            return "path found"
        last, unit = float(racer.times[-1]), "s" if self._race.seconds else "transfers"
        return f"{'arrived' if driven >= last else 'driving'} {min(driven, last):.1f} {unit}"

    @staticmethod
    def _facts(racer: Racer, steps: int) -> tuple[str, str]:
        """What it has looked at, and what it found: two lines."""
        looked, plan = racer.exploration, racer.plan
        words = [f"{1000 * racer.plan_s:.3g} ms"]
        if plan.gap is not None and plan.any_angle_length is None:
            words.insert(0, f"gap {100 * plan.gap:.1f} %")
        if plan.path is not None:
            words.insert(0, f"{'length' if plan.any_angle_length else 'cost'} {racer.length:.5g}")
        shown = WORDS["none"] if looked.kind == "none" else f"{steps:,} {WORDS[looked.kind]}"
        return shown, ", ".join(words)

    def _corner(self, k: int) -> tuple[int, int]:
        """Pixel of the upper left corner of a planner's map."""
        row, column = divmod(k, self._columns)
        return GAP + column * (self._tile + GAP), GAP + CAPTION + row * (self._rows_px + CAPTION + GAP)

    def _pixel(self, k: int, x: float, y: float) -> tuple[float, float]:
        left, top = self._corner(k)
        return left + (x + 0.5) * self._scale, top + (y + 0.5) * self._scale

    def _lines(self, box: Rgb, lines: Floats, colour: tuple[int, int, int], width: int) -> None:
        from PIL import Image, ImageDraw

        image = Image.fromarray(box)
        pen = ImageDraw.Draw(image)
        for line in ((lines + 0.5) * self._scale).tolist():
            pen.line(line, fill=colour, width=width)
        box[:] = np.asarray(image)

    def _robot(self, pen: Any, k: int, racer: Racer, driven: float, colour: tuple[int, int, int]) -> None:
        """The robot's footprint to scale with its heading, where it has one and can be seen; else a mark of its place."""
        at, outline = _place(racer, driven), self._race.scene.robot.footprint
        scale = self._scale / racer.resolution
        if outline is None or max(max(abs(x), abs(y)) for x, y in outline) * scale < SEEN:
            self._mark(pen, self._pixel(k, *at), "robot", colour)
            return
        cos, sin = elementary.direction(_heading(racer, driven))
        x0, y0 = self._pixel(k, *at)
        corners = [(x0 + (x * cos - y * sin) * scale, y0 - (x * sin + y * cos) * scale) for x, y in outline]
        pen.polygon(corners, fill=colour, outline=(255, 255, 255), width=2)
        nose = max(x for x, _ in outline) * scale
        pen.line((x0, y0, x0 + nose * cos, y0 - nose * sin), fill=(255, 255, 255), width=2)

    def _mark(self, pen: Any, at: tuple[float, float], shape: str, colour: tuple[int, int, int]) -> None:
        (x, y), r = at, max(5.0, 0.4 * self._scale)
        if shape == "square":
            pen.rectangle((x - r, y - r, x + r, y + r), fill=colour, outline=(255, 255, 255))
        elif shape == "flag":
            pen.line((x, y + r, x, y - 1.6 * r), fill=INK, width=2)
            pen.polygon(
                [(x + 1, y - 1.6 * r), (x + 1.8 * r, y - 0.9 * r), (x + 1, y - 0.2 * r)],
                fill=colour,
                outline=(255, 255, 255),
            )
        else:
            pen.ellipse((x - r - 1, y - r - 1, x + r + 1, y + r + 1), fill=(255, 255, 255))
            pen.ellipse((x - r, y - r, x + r, y + r), fill=colour)
            pen.ellipse((x - r / 3, y - r / 3, x + r / 3, y + r / 3), fill=(255, 255, 255))

    def palette_strip(self) -> Rgb:
        """Every colour a film may need, as rows of its width."""
        colours = np.concatenate(
            [*self._tones, np.array([PAPER, INK, FAINT, sprites.START, sprites.GOAL, (255, 255, 255)])]
        )
        strip = colours.astype(np.uint8)[np.arange(self._width) * len(colours) // self._width]
        return np.broadcast_to(strip, (24, self._width, 3)).copy()

    def exact_colours(self) -> Rgb:
        """Colours that the palette must hold as they are, uint8 (n, 3)."""
        return np.array([*RACE[: len(self._tones)], INK, FREE, sprites.START, sprites.GOAL], dtype=np.uint8)


def _tones(k: int) -> Rgb:
    """Colours of the shades of a planner's cells, then of a field and of rings."""
    own, free = np.array(RACE[k % len(RACE)], dtype=np.float64), np.array(FREE, dtype=np.float64)
    shares = np.array([*np.linspace(FIRST, LAST, SHADES), FIELD, RINGS])[:, None]
    out: Rgb = np.round(free + shares * (own - free)).astype(np.uint8)
    return out


def _place(racer: Racer, driven: float) -> tuple[float, float]:
    """Where the robot is after so many seconds, cells."""
    x, y = (float(np.interp(driven, racer.times, racer.nodes[:, c])) for c in (0, 1))
    return x, y


def _heading(racer: Racer, driven: float) -> float:
    """Where the robot looks after so many seconds, radians counterclockwise from the rows: along its path, if nothing says."""
    if len(racer.headings):
        return float(np.interp(driven, racer.times, racer.headings))
    k = min(max(int(np.searchsorted(racer.times, driven, side="right")), 1), len(racer.nodes) - 1)
    dx, dy = racer.nodes[k] - racer.nodes[k - 1]
    return float(elementary.atan2(-dy, dx))
