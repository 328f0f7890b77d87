"""Films of a simulation: animated WebP or GIF, every frame drawn as an array of pixels.

A film is bounded: its map is at most about 560 pixels wide or high, and it has at most :data:`MAX_FRAMES`
frames. A short run glides between ticks; a long one shows every k-th tick, and says so in its caption.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from lampyris.errors import UsageError
from lampyris.model.trace import Trace
from lampyris.report.film.film_frames import Landscape, TraceRenderer
from lampyris.report.style import OutFile, Rgb, cannot_write, suffix_of

MAX_FRAMES = 240
"""Frames at most, the last held one not counted."""

GLIDE = 2
"""Frames for each tick of a short run: obstacles glide from cell to cell, so that one can see who goes where."""

FPS = 16.0
"""Frames a second, if nobody says."""

HOLD_MS = 1200
"""How long the outcome stands at the end."""


class Draws(Protocol):
    """What draws the moments of a run, forward in time."""

    def frame(self, moment: float) -> Rgb:
        """The picture at a moment."""
        ...

    def rewind(self) -> None:
        """Back to the first moment."""
        ...

    def palette_strip(self) -> Rgb:
        """Every colour a film may need, as rows of its width."""
        ...

    def exact_colours(self) -> Rgb:
        """Colours that the palette must hold as they are, uint8 (n, 3)."""
        ...


@dataclass(frozen=True, slots=True)
class Shown:
    """Which moments are shown (ticks, whole or in between; or seconds), and how long each stands."""

    moments: tuple[float, ...]
    each_ms: int
    stride: int


def film(
    trace: Trace,
    out: OutFile,
    *,
    fps: float = FPS,
    scale: int | None = None,
    progress: Callable[[int], None] | None = None,
    landscape: Landscape | None = None,
) -> None:
    """Draw a simulation as a film, WebP (lossless) or GIF by the file's suffix.

    Walls are dark, and those that come or go do so at their tick; the path driven stays behind as a line
    coloured by speed; obstacles differ by kind in shape, colour and letter; a ring flashes around the robot
    when it waits (grey) or replans (violet). What a robot with a sensor has not seen is shaded, and a circle shows its
    range, or a sector its field of view; a goal that moves is drawn where it is. Below stand the tick, the speed and what
    binds it, and in the end the outcome. The same trace gives the same bytes.

    Parameters
    ----------
    fps : frames a second, 1 to 50.
    scale : pixels a cell; None: so many that the longer side has about 560. Maps larger than that are shrunk.
    progress : called with the number of frames drawn so far.
    landscape : a layer beneath, such as luciferin; None: none.

    Raises
    ------
    UsageError : another suffix, or a number out of its range.
    FileError : the system refuses to write.
    """
    check(out, fps, scale)
    shown = moments(trace.ticks, fps)
    write_film(TraceRenderer(trace, scale, shown.stride, landscape), shown, out, progress)


def frames_of(trace: Trace, fps: float = FPS) -> int:
    """How many frames the film of a simulation has: what ``progress`` of :func:`film` comes to."""
    return len(moments(trace.ticks, fps).moments)


def check(out: OutFile, fps: float, scale: int | None) -> None:
    """Refuse what no film can be made of.

    Raises
    ------
    UsageError : another suffix than .webp and .gif, or a number out of its range.
    """
    suffix_of(out, (".webp", ".gif"))
    if isinstance(fps, bool) or not isinstance(fps, int | float) or not 1 <= fps <= 50:
        raise UsageError.of("FPS", "fps", f"{fps!r:.40}", allowed="1 to 50 frames a second")
    if scale is not None and (type(scale) is not int or not 1 <= scale <= 64):
        raise UsageError.of(
            "SCALE", "scale", f"{scale!r:.40}", allowed="a whole number, 1 to 64 pixels a cell"
        )


def write_film(stage: Draws, shown: Shown, out: OutFile, progress: Callable[[int], None] | None) -> None:
    """Draw every moment and write the film.

    Raises
    ------
    FileError : the system refuses to write.
    """
    images = list(_images(stage, shown, progress))
    durations = [shown.each_ms] * (len(images) - 1) + [HOLD_MS]
    _write(out, suffix_of(out, (".webp", ".gif")), images, durations)


def moments(ticks: int, fps: float) -> Shown:
    """The moments of a run: several a tick while the bound allows it, else every k-th tick and the last."""
    each_ms = frame_ms(fps)
    glide = max(1, min(GLIDE, MAX_FRAMES // max(1, ticks)))
    if ticks <= MAX_FRAMES:
        return Shown(tuple(k / glide for k in range(ticks * glide + 1)), each_ms, 1)
    stride = -(-ticks // MAX_FRAMES)
    return Shown((*map(float, range(0, ticks, stride)), float(ticks)), each_ms, stride)


def frame_ms(fps: float) -> int:
    """How long a frame stands: whole hundredths of a second, as GIF counts them, for both kinds."""
    return max(20, 10 * round(100 / fps))


def _images(stage: Draws, shown: Shown, progress: Callable[[int], None] | None) -> Iterator[Any]:
    from PIL import Image

    # One palette for all frames, made from a few of them: no flicker, and small files.
    picks = [shown.moments[k * (len(shown.moments) - 1) // 3] for k in range(4)]
    samples = np.concatenate([stage.palette_strip(), *(stage.frame(m) for m in picks)], axis=0)
    stage.rewind()
    exact = stage.exact_colours()
    palette = Image.fromarray(samples).quantize(
        256 - len(exact), method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE
    )
    if len(exact):
        palette.putpalette(exact.tobytes() + bytes(palette.getpalette() or ())[: 3 * (256 - len(exact))])
    for count, moment in enumerate(shown.moments, start=1):
        frame = Image.fromarray(stage.frame(moment))
        yield frame.quantize(palette=palette, dither=Image.Dither.NONE)
        if progress is not None:
            progress(count)


def _write(out: OutFile, suffix: str, images: list[Any], durations: list[int]) -> None:
    first, rest = images[0], images[1:]
    more: dict[str, Any] = {"save_all": True, "append_images": rest, "duration": durations, "loop": 0}
    if suffix == ".webp":
        more |= {"lossless": True, "quality": 0, "method": 1, "kmin": 0, "kmax": 0}
    else:
        more |= {"optimize": True, "disposal": 1}
    try:
        first.save(Path(out), format=suffix[1:].upper(), **more)
    except OSError as error:
        raise cannot_write(out, error) from None
