"""Small pictures for a film, drawn large once and shrunk, so that their edges are smooth.

Each kind has its own shape, its own colour and, where there is room, its own letter: colour alone is never
asked to tell two apart.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris.report.style import FREE, Rgb

Colour = tuple[int, int, int]

ROBOT: Colour = (0, 114, 178)
START: Colour = (4, 165, 96)
GOAL: Colour = (182, 16, 28)
INK: Colour = (32, 36, 44)

KINDS: dict[str, tuple[str, Colour, str, str]] = {
    "random-walk": ("circle", (150, 16, 132), "W", "random walk"),
    "patrol": ("square", (50, 62, 62), "P", "patrol"),
    "crossing": ("triangle", (78, 51, 32), "X", "crossing"),
    "recorded": ("diamond", (61, 11, 200), "R", "recorded"),
}
"""Shape, colour, letter and name of each kind of obstacle."""

OTHER = ("pentagon", (110, 110, 110), "?", "obstacle")

_FINE = 6
"""A sprite is drawn so many times larger than it is shown."""

_LETTER = 15
"""Pixels of a sprite's side from which on it bears its letter."""


@dataclass(frozen=True, slots=True)
class Sprite:
    """Pixels and how much of each is covered: rgb uint8 (n, n, 3), alpha float (n, n), 0 to 1."""

    rgb: Rgb
    alpha: NDArray[np.float64]


def kind_of(kind: str) -> tuple[str, Colour, str, str]:
    """Shape, colour, letter and name; an unknown kind is a grey pentagon."""
    return KINDS.get(kind, OTHER)


@lru_cache(maxsize=64)
def sprite(shape: str, colour: Colour, letter: str, size: int, ink: Colour = (255, 255, 255)) -> Sprite:
    """A filled shape with a dark rim in a square of ``size`` pixels, and a letter in the colour ``ink``."""
    from PIL import Image, ImageDraw

    big = size * _FINE
    image = Image.new("RGBA", (big, big), (*FREE, 0))
    draw = ImageDraw.Draw(image)
    rim = max(_FINE, round(big * 0.07))
    for inset, fill in ((0, (*INK, 255)), (rim, (*colour, 255))):
        _fill(draw, shape, big, inset, fill)
    if letter and size >= _LETTER:
        from PIL import ImageFont

        font = ImageFont.load_default(size=big * 0.5)
        at = (big / 2, big * (0.6 if shape == "triangle" else 0.5))
        draw.text(at, letter, font=font, fill=(*ink, 255), anchor="mm")
    small = np.asarray(image.resize((size, size), Image.Resampling.BOX), dtype=np.float64)
    return Sprite(np.round(small[..., :3]).astype(np.uint8), small[..., 3] / 255)


def outline(vertices: NDArray[np.float64], ahead: NDArray[np.float64], colour: Colour) -> Sprite:
    """A footprint with a dark rim, its base in the middle of the sprite, and a light line from there ahead.

    Parameters
    ----------
    vertices : (k, 2), pixels from the base, y down.
    ahead : pixels from the base to the end of the line.
    """
    from PIL import Image, ImageDraw

    half = int(np.ceil(np.abs(vertices).max())) + 2
    side = 2 * half * _FINE
    image = Image.new("RGBA", (side, side), (*FREE, 0))
    draw = ImageDraw.Draw(image)
    points = [(x, y) for x, y in ((vertices + half) * _FINE).tolist()]
    draw.polygon(points, fill=(*colour, 235))
    draw.line([*points, points[0], points[1]], fill=(*INK, 255), width=2 * _FINE, joint="curve")
    base = half * _FINE
    front = [(base, base), (base + float(ahead[0]) * _FINE, base + float(ahead[1]) * _FINE)]
    draw.line(front, fill=(*FREE, 255), width=2 * _FINE)
    r = 2 * _FINE
    draw.ellipse((base - r, base - r, base + r, base + r), fill=(*FREE, 255))
    small = np.asarray(image.resize((2 * half, 2 * half), Image.Resampling.BOX), dtype=np.float64)
    return Sprite(np.round(small[..., :3]).astype(np.uint8), small[..., 3] / 255)


@lru_cache(maxsize=256)
def ring(radius: int, width: int, colour: Colour, inside: float) -> Sprite:
    """A circle's line, pixels; its inside covered to the share ``inside``."""
    n = 2 * radius + 3
    away = np.hypot(*(np.indices((n, n)) - (n - 1) / 2)) - radius
    line = np.clip(width / 2 + 0.5 - np.abs(away), 0.0, 1.0)
    alpha = np.maximum(line, np.where(away < 0, inside, 0.0))
    return Sprite(np.broadcast_to(np.array(colour, dtype=np.uint8), (n, n, 3)), alpha)


def _fill(draw: Any, shape: str, side: int, inset: int, fill: tuple[int, ...]) -> None:
    mid, r = side / 2, side / 2 - inset
    if shape == "circle":
        draw.ellipse((mid - r, mid - r, mid + r, mid + r), fill=fill)
    elif shape == "square":
        k = r * 0.86
        draw.rounded_rectangle((mid - k, mid - k, mid + k, mid + k), radius=k * 0.2, fill=fill)
    elif shape == "star":
        draw.polygon(_star(mid, r), fill=fill)
    else:
        corners = {"triangle": 3, "diamond": 4, "pentagon": 5}[shape]
        draw.polygon(_polygon(mid, r, corners), fill=fill)


def _polygon(mid: float, r: float, corners: int) -> list[tuple[float, float]]:
    turn = [2 * math.pi * k / corners - math.pi / 2 for k in range(corners)]
    low = mid + r * 0.18 if corners == 3 else mid
    return [(mid + r * math.cos(t), low + r * math.sin(t)) for t in turn]


def _star(mid: float, r: float) -> list[tuple[float, float]]:
    out = []
    for k in range(10):
        t, far = math.pi * k / 5 - math.pi / 2, r if k % 2 == 0 else r * 0.45
        out.append((mid + far * math.cos(t), mid + far * math.sin(t)))
    return out


def blend(canvas: Rgb, picture: Sprite, x: float, y: float) -> None:
    """Put a sprite on the canvas, its middle at pixel (x, y); what lies outside is cut off."""
    n = len(picture.alpha)
    left, top = round(x - n / 2), round(y - n / 2)
    x0, y0 = max(left, 0), max(top, 0)
    x1, y1 = min(left + n, canvas.shape[1]), min(top + n, canvas.shape[0])
    if x0 >= x1 or y0 >= y1:
        return
    part = slice(y0 - top, y1 - top), slice(x0 - left, x1 - left)
    alpha = picture.alpha[part][..., None]
    under = canvas[y0:y1, x0:x1]
    canvas[y0:y1, x0:x1] = np.round(under + (picture.rgb[part].astype(np.float64) - under) * alpha)
