"""Films of fleets that drive in continuous time, or on and on: discs that go to squares of their colour."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from lampyris.errors import plural
from lampyris.model.fleet.fleet_trace import FleetTrace
from lampyris.model.fleet.lifelong import LifelongTrace
from lampyris.model.grid import Grid
from lampyris.report.film import sprites
from lampyris.report.film.fleet_key import HEIGHT, OBSTACLE, cross, key_row
from lampyris.report.film.simulation_film import FPS, MAX_FRAMES, Shown, check, frame_ms, moments, write_film
from lampyris.report.pictures.raster import draw_map
from lampyris.report.style import FLEET, OutFile, Rgb
from lampyris.typing import Floats

LONG = 640
"""Pixels of the map's longer side, about."""
MARGIN = 8
CAPTION = 30
_WIDE = 420
_LEAST = 5
"""Pixels of a robot at least, however small the cells."""
_RIMMED = 8


def fleet_drive_film(
    trace: FleetTrace, out: OutFile, *, fps: float = FPS, progress: Callable[[int], None] | None = None
) -> None:
    """Draw the drive of a fleet as a film, WebP (lossless) or GIF by the file's suffix; the same trace gives the same bytes.

    Robots are discs of their size, their goals small squares of the same colour, moving obstacles dark discs, and robots that
    have stopped permanently bear a cross; below stand the time, how many robots have arrived, and a key.

    Raises
    ------
    UsageError : another suffix, or a number out of its range.
    FileError : the system refuses to write.
    """
    check(out, fps, None)
    end = trace.duration_s
    count = max(2, min(MAX_FRAMES, int(np.ceil(2.0 * end)) + 1))
    times = np.linspace(0.0, end, count)
    shown = Shown(tuple(times.tolist()), frame_ms(fps), 1)
    arrived = np.where(np.isnan(trace.arrivals), np.inf, trace.arrivals)

    def places(t: float) -> tuple[Floats, Floats]:
        metres = trace.at(t)
        discs = [[np.interp(t, one.t, one.xy[:, c]) for c in range(2)] for one in trace.obstacles]
        return trace.grid.to_points(metres[:, 0], metres[:, 1]), np.array(discs).reshape(-1, 2)

    def caption(t: float) -> str:
        home = int(np.count_nonzero(arrived <= t + 1e-9))
        return f"{t:.1f} s of {end:.1f} s    {home} of {plural(len(trace.robots), 'robot')} arrived"

    sizes = 2.0 * np.array([one.radius for one in trace.robots]) / trace.grid.resolution
    wide = max((2.0 * one.radius / trace.grid.resolution for one in trace.obstacles), default=0.0)
    stage = DiscRenderer(
        trace.grid, trace.goals.astype(np.float64), float(sizes.max()), wide, places, caption, trace.faults
    )
    write_film(stage, shown, out, progress)


def lifelong_film(
    trace: LifelongTrace, out: OutFile, *, fps: float = FPS, progress: Callable[[int], None] | None = None
) -> None:
    """Draw a lifelong fleet as a film; below stand the tick, the tasks done and the throughput. See :func:`fleet_drive_film`."""
    check(out, fps, None)
    shown = moments(trace.ticks, fps)
    finished = np.sort(trace.done[trace.done >= 0])

    def places(t: float) -> tuple[Floats, Floats]:
        tick = int(t)
        here = trace.xy[tick].astype(np.float64)
        if t > tick:
            here = here + (t - tick) * (trace.xy[tick + 1] - trace.xy[tick])
        return here, np.zeros((0, 2))

    def caption(t: float) -> str:
        done = int(np.searchsorted(finished, int(t), side="right"))
        rate = done / int(t) if t >= 1 else 0.0
        every = f" (1 in {shown.stride} shown)" if shown.stride > 1 else ""
        return f"tick {int(t)} of {trace.ticks}{every}    {done} tasks done, {rate:.2f} a tick"

    stage = DiscRenderer(trace.grid, np.zeros((0, 2)), 0.8, 0.0, places, caption, trace.faults)
    write_film(stage, shown, out, progress)


class DiscRenderer:
    """Draws robots and obstacles as discs.

    Parameters
    ----------
    grid : the map.
    goals : float64 (n, 2), cells; none: not drawn.
    size, obstacle_size : diameters, cells.
    places : the cells of robots and obstacles at a moment, float64 (n, 2) and (m, 2).
    caption : the words at a moment.
    faults : robots that stop permanently, and when: they bear a cross from then on.
    """

    def __init__(
        self, grid: Grid, goals: Floats, size: float, obstacle_size: float,
        places: Callable[[float], tuple[Floats, Floats]], caption: Callable[[float], str],
        faults: Sequence[tuple[int, float]] = (),
    ) -> None:  # fmt: skip
        raster = draw_map(grid, LONG)
        self._scale = raster.scale
        rows, columns = raster.rgb.shape[:2]
        # Even sizes: some players of films refuse others.
        self._width = max(_WIDE, columns + 2 * MARGIN) + 1 & ~1
        self._height = rows + MARGIN + CAPTION + HEIGHT + 1 & ~1
        self._left = (self._width - columns) // 2
        self._paper = np.full((self._height, self._width, 3), 255, dtype=np.uint8)
        self._paper[MARGIN : MARGIN + rows, self._left : self._left + columns] = raster.rgb
        self._places, self._words = places, caption
        self._disc = sprites.sprite("circle", (255, 255, 255), "", max(_LEAST, round(size * self._scale)))
        self._other = sprites.sprite(
            "circle", (255, 255, 255), "", max(_LEAST, round(obstacle_size * self._scale))
        )
        dark = 1.0 - self._disc.rgb[..., 0].astype(np.float64) / 255
        self._rim = dark if len(dark) >= _RIMMED else np.zeros_like(dark)
        self._faults, self._cross = tuple(faults), cross(len(self._disc.alpha) | 1)
        there = {"robot": True, "goal": len(goals), "failed": len(faults), "obstacle": obstacle_size > 0}
        self._paper[-HEIGHT:] = key_row(self._width, MARGIN, [kind for kind, any_ in there.items() if any_])
        square = max(2, round(0.5 * self._scale))
        self._stamp(
            self._paper, goals, _colours(len(goals)), np.ones((square, square)), np.zeros((square, square))
        )

    def frame(self, moment: float) -> Rgb:
        """The picture at a moment."""
        robots, obstacles = self._places(moment)
        canvas = self._paper.copy()
        self._stamp(canvas, robots, _colours(len(robots)), self._disc.alpha, self._rim)
        dark = np.tile(np.array(OBSTACLE, dtype=np.float64), (len(obstacles), 1))
        self._stamp(canvas, obstacles, dark, self._other.alpha, np.zeros_like(self._other.alpha))
        failed = robots[[robot for robot, when in self._faults if when <= moment]]
        ink = np.tile(np.array(sprites.INK, dtype=np.float64), (len(failed), 1))
        self._stamp(canvas, failed, ink, self._cross, np.zeros_like(self._cross))
        canvas[-CAPTION - HEIGHT : -HEIGHT] = self._caption(self._words(moment))
        return canvas

    def rewind(self) -> None:
        """Frames do not depend on each other."""

    def palette_strip(self) -> Rgb:
        """Every colour a film may need, as rows of its width."""
        few = [OBSTACLE, sprites.INK, (255, 255, 255)]
        colours = np.concatenate((np.array(FLEET), np.array(FLEET) // 2, few)).astype(np.uint8)
        strip = colours[np.arange(self._width) * len(colours) // self._width]
        return np.broadcast_to(strip, (8, self._width, 3)).copy()

    def exact_colours(self) -> Rgb:
        """Colours that the palette must hold as they are, uint8 (n, 3)."""
        return np.array([*FLEET, OBSTACLE], dtype=np.uint8)

    def _stamp(
        self,
        canvas: Rgb,
        places: Floats,
        colours: Floats,
        alpha: NDArray[np.float64],
        rim: NDArray[np.float64],
    ) -> None:
        """Put one shape at many places, cells, each in its colour; ``rim`` is the share of ink in it."""
        n = len(alpha)
        corner = np.round((places + 0.5) * self._scale - n / 2).astype(np.int64)
        ink = np.array(sprites.INK, dtype=np.float64)
        for (left, top), colour in zip(corner.tolist(), colours, strict=True):
            y = np.clip(top + MARGIN + np.arange(n), 0, self._height - 1)[:, None]
            x = np.clip(left + self._left + np.arange(n), 0, self._width - 1)[None, :]
            face = colour * (1 - rim)[..., None] + ink * rim[..., None]
            under = canvas[y, x].astype(np.float64)
            canvas[y, x] = np.round(under + (face - under) * alpha[..., None]).astype(np.uint8)

    def _caption(self, words: str) -> Rgb:
        from PIL import Image, ImageDraw, ImageFont

        image = Image.new("RGB", (self._width, CAPTION), (255, 255, 255))
        font = ImageFont.load_default(size=14)
        ImageDraw.Draw(image).text((MARGIN, CAPTION / 2), words, font=font, fill=sprites.INK, anchor="lm")
        return np.asarray(image)


def _colours(n: int) -> Floats:
    many = np.array(FLEET, dtype=np.float64)
    return many[np.arange(n) % len(many)]
