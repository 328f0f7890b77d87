"""The key of films of fleets: what discs, squares and crosses are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lampyris.report.film import sprites
from lampyris.report.style import FLEET, Rgb

HEIGHT = 22
"""Pixels of the row."""
OBSTACLE = (40, 40, 46)
"""Colour of moving obstacles."""
WORDS = {
    "robot": "robot", "goal": "its goal", "failed": "stopped permanently", "obstacle": "moving obstacle",
}  # fmt: skip
_MARK = 10
_GAP = 14


def key_row(width: int, margin: int, kinds: Sequence[str]) -> Rgb:
    """A row of the film's width with a mark and its word for each kind of :data:`WORDS`."""
    from PIL import Image, ImageDraw, ImageFont

    image = Image.new("RGB", (width, HEIGHT), (255, 255, 255))
    pen, font = ImageDraw.Draw(image), ImageFont.load_default(size=12)
    x, top = margin, (HEIGHT - _MARK) // 2 - 2
    colour = tuple(FLEET[0])
    for kind in kinds:
        box = (x, top, x + _MARK, top + _MARK)
        if kind == "goal":
            pen.rectangle((x + 2, top + 2, x + _MARK - 2, top + _MARK - 2), fill=colour)
        else:
            pen.ellipse(box, fill=OBSTACLE if kind == "obstacle" else colour)
        if kind == "failed":
            pen.line(box, fill=sprites.INK, width=2)
            pen.line((x, top + _MARK, x + _MARK, top), fill=sprites.INK, width=2)
        x += _MARK + 5
        pen.text((x, HEIGHT / 2 - 2), WORDS[kind], font=font, fill=sprites.INK, anchor="lm")
        x += round(pen.textlength(WORDS[kind], font=font)) + _GAP
    return np.asarray(image)


def cross(size: int) -> NDArray[np.float64]:
    """How much of each pixel of a square a diagonal cross covers, float64 (size, size)."""
    at = np.arange(size)
    away = np.minimum(np.abs(at[:, None] - at[None, :]), np.abs(at[:, None] + at[None, :] - (size - 1)))
    made: NDArray[np.float64] = (away <= max(1, size // 8)).astype(np.float64)
    return made
