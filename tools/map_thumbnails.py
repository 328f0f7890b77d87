"""Draw thumbnails of all bundled maps, the picture of docs/maps.md.

python tools/map_thumbnails.py docs/img/maps.png
"""

from __future__ import annotations

import io
import sys

from PIL import Image, ImageDraw, ImageFont

from lampyris.io.maps import library
from lampyris.report import style

COLUMNS, CELL, HEAD, GAP = 7, 128, 20, 12
"""Thumbnails in a row; pixels of a place, of its name above it, and between two places."""


def main(out: str) -> None:
    """Draw row after row, in the order of the library."""
    names = library.names()
    rows = -(-len(names) // COLUMNS)
    picture = Image.new("RGB", (GAP + COLUMNS * (CELL + GAP), GAP + rows * (CELL + HEAD + GAP)), "white")
    pen, font = ImageDraw.Draw(picture), ImageFont.load_default(13)
    for k, name in enumerate(names):
        left, top = GAP + k % COLUMNS * (CELL + GAP), GAP + k // COLUMNS * (CELL + HEAD + GAP)
        pen.text((left, top), name, fill=style.INK, font=font)
        with Image.open(io.BytesIO(library.thumbnail_png(name))) as file:
            picture.paste(file.convert("RGB"), (left, top + HEAD))
    picture.save(out, optimize=True)


if __name__ == "__main__":
    main(sys.argv[1])
