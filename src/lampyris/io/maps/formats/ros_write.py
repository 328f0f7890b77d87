"""Writing ROS map_server maps: the YAML and the picture Nav2's map_saver would write.

Keys, their order and the pixels are those of ``map_io.cpp``: trinary has 254 free, 205 unknown, 0 occupied
and always the thresholds 0.65 and 0.196, which tell these three apart; raw has the value itself and 255 for
unknown; scale has ``(100 - value) / 100`` of white and transparent for unknown. Two differences, both so that
reading gives back what was written. Numbers are written with three decimals as Nav2 does, but in full where
that would move the map. Scale is written with thresholds 1 and 0, the only ones by which a value 1 to 99 is
read as itself; with Nav2's defaults 10 would come back as free.
"""

from __future__ import annotations

import io
import json
import os
import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lampyris._core import defaults
from lampyris._core.cancellation import uninterrupted
from lampyris.errors import UsageError
from lampyris.io.files import write_file
from lampyris.io.maps.formats.costmap import TO_OCCUPANCY, costs_of
from lampyris.io.maps.formats.document import MapDocument, Occupancy, look_up
from lampyris.io.maps.formats.ros import SUFFIXES, UNKNOWN_GREY
from lampyris.io.maps.formats.ros_yaml import MODES, plain_path
from lampyris.model.grid import Grid

FREE_GREY = 254
_THRESHOLDS = {"trinary": ("0.65", "0.196"), "scale": ("1.000", "0.000"), "raw": ("0.65", "0.196")}
_PLAIN_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.+-]*")


def save_ros(
    what: MapDocument | Grid,
    path: str | os.PathLike[str],
    *,
    mode: str | None = None,
    image_format: str | None = None,
    values: str = defaults.VALUES,
) -> None:
    """Write ``path``, a YAML file, and beside it the picture, named alike.

    Parameters
    ----------
    what : the map. Start, goal and moving obstacles are left out.
    path : ends in .yaml or .yml.
    mode : ``trinary``, ``scale`` or ``raw``. None is trinary, or raw where the map has occupancies 1 to 99,
        which trinary cannot hold: there they are occupied.
    image_format : ``pgm`` or ``png``. None is png for scale, which needs transparency, and pgm otherwise.
    values : ``costmap`` writes terrain as occupancies 1 to 98, as Nav2 publishes a costmap
        (:mod:`lampyris.io.maps.formats.costmap`); with ``occupancy`` a free cell is 0, whatever it costs.

    Raises
    ------
    UsageError : MAP_ENDING, MAP_MODE, IMAGE_FORMAT, or PATH_FORM (a name no reader would follow).
    FileError : FILE_WRITE.
    """
    target = Path(path)
    if target.suffix.lower() not in SUFFIXES:
        raise UsageError("MAP_ENDING", repr(target.suffix), where=str(target), allowed=", ".join(SUFFIXES))
    cells = occupancy_of(what, values)
    if mode is None:
        mode = "raw" if ((cells > 0) & (cells < 100)).any() else "trinary"
    if mode not in MODES:
        raise UsageError.of("MAP_MODE", "mode", repr(mode), allowed=", ".join(MODES))
    kind = image_format or ("png" if mode == "scale" else "pgm")
    if kind not in ("pgm", "png") or (mode == "scale" and kind == "pgm"):
        allowed = "png, as unknown cells are transparent" if mode == "scale" else "pgm, png"
        raise UsageError("IMAGE_FORMAT", f"image format {kind!r} for mode {mode}", allowed=allowed)
    picture = target.with_suffix(f".{kind}")
    if not plain_path(picture.name):
        allowed = "a file name without : at a drive's or address's place, | or \\"
        raise UsageError("PATH_FORM", repr(target.name), allowed=allowed)
    pixels = _pixels(cells, mode)
    # The picture first: a YAML file that names nothing is never left behind.
    write_file(picture, _pgm(pixels) if kind == "pgm" else _png(pixels))
    write_file(target, yaml_text(what, mode, picture.name).encode())


def yaml_text(what: MapDocument | Grid, mode: str, image: str) -> str:
    """The YAML file's text, keys and order as Nav2 has them."""
    grid = what if isinstance(what, Grid) else what.grid
    x, y, yaw = grid.origin
    turn = f"{yaw:.7g}"
    occupied, free = _THRESHOLDS[mode]
    return (
        f"image: {image if _PLAIN_NAME.fullmatch(image) else json.dumps(image, ensure_ascii=False)}\n"
        f"mode: {mode}\n"
        f"resolution: {_decimals(grid.resolution)}\n"
        f"origin: [{_decimals(x)}, {_decimals(y)}, {turn if float(turn) == yaw else repr(yaw)}]\n"
        "negate: 0\n"
        f"occupied_thresh: {occupied}\n"
        f"free_thresh: {free}\n"
    )


def occupancy_of(what: MapDocument | Grid, values: str = defaults.VALUES) -> Occupancy:
    """What to write of each cell, int8 (height, width): 0 free, 100 blocked, -1 unknown, and a document's own
    occupancy where it agrees with its grid; as costmap values also 1 to 98 where there is terrain.
    """
    grid = what if isinstance(what, Grid) else what.grid
    costmap = values == "costmap"
    cells = look_up(TO_OCCUPANCY.view(np.uint8), costs_of(grid, terrain=costmap)).view(np.int8)
    if isinstance(what, MapDocument) and what.occupancy is not None:
        # 1 to 98 would be read again as terrain where the map has none: of such a cell only 99 is its own.
        own = (cells == 100) & (what.occupancy > (98 if costmap else 0))
        cells[own] = what.occupancy[own]
    return cells


def _pixels(values: Occupancy, mode: str) -> NDArray[np.uint8]:
    """Grey (height, width), or grey and alpha (height, width, 2) in the mode scale."""
    unknown = values < 0
    wide = values.astype(np.int16)
    if mode == "trinary":
        grey = np.where(values == 0, FREE_GREY, 0)
        grey[unknown] = UNKNOWN_GREY
        return grey.astype(np.uint8)
    if mode == "raw":
        return np.where(unknown, 255, wide).astype(np.uint8)
    # Rounded down twice on the way from a share of white to 16 bits and to 8, as in Nav2.
    grey = np.where(unknown, 127, (100 - wide) * 255 // 100)
    return np.stack((grey, np.where(unknown, 0, 255)), axis=-1).astype(np.uint8)


def _pgm(pixels: NDArray[np.uint8]) -> bytes:
    return f"P5\n{pixels.shape[1]} {pixels.shape[0]}\n255\n".encode() + pixels.tobytes()


def _png(pixels: NDArray[np.uint8]) -> bytes:
    with uninterrupted():
        from PIL import Image

    if pixels.ndim == 3:
        # Red, green, blue and alpha: Nav2 found that GraphicsMagick loses the alpha of grey pictures.
        pixels = pixels[..., [0, 0, 0, 1]]
    out = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(pixels)).save(out, format="PNG")
    return out.getvalue()


def _decimals(value: float) -> str:
    """Three decimals, or all that there are where three are another number."""
    short = f"{value:.3f}"
    return short if float(short) == value else repr(value)
