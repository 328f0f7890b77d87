"""ROS map_server maps: a YAML file and its picture, read by the rules of nav2_map_server, without ROS.

The rules are those of ``map_io.cpp`` in Nav2 since April 2025. The picture is turned to 8-bit grey; with
``p = grey / 255`` in 32-bit floats, ``occ`` is ``p`` if negated and ``1 - p`` otherwise. In the modes
trinary and scale, ``occ >= occupied_thresh`` is 100, then ``occ <= free_thresh`` is 0 and wins where both
hold; between them trinary has -1 and scale ``round(100 (occ - free) / (occupied - free))``; whatever is not
wholly opaque is -1. In the mode raw the grey is the value, -1 above 100, and negate, thresholds and alpha
mean nothing.

Grey of 8 bits and less is exact. Other pictures follow what GraphicsMagick's source, built with 16 bits,
does for Nav2: brightness of a colour is Rec. 601 luma, ``(306 R + 601 G + 117 B) >> 10``; deeper grey, and
grey of another white, is scaled to 16 bits and divided by 257 downwards. That has not been run beside it.

For planning only the value 0 is free. 1 to 99 (modes scale and raw) are blocked: Nav2's static layer takes
them for free unless specified otherwise, which is no default for a planner that knows nothing of costs. The
values themselves are in ``MapDocument.occupancy``. -1 is unknown, and blocked. Asked for costmap values, 1 to
98 are terrain instead, by the inverse of Nav2's own table (:mod:`lampyris.io.maps.formats.costmap`).
"""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lampyris.errors import FileError, plural
from lampyris.io.files import read_regular
from lampyris.io.maps.formats import bmp, pgm
from lampyris.io.maps.formats import png as image
from lampyris.io.maps.formats.colours import BRIGHTNESS, Pixels, brightness, clear_of
from lampyris.io.maps.formats.costmap import FROM_OCCUPANCY, read_costs
from lampyris.io.maps.formats.document import (
    BLOCKED,
    FREE,
    UNKNOWN,
    FileSource,
    Occupancy,
    Reading,
    byte_limit,
    look_up,
)
from lampyris.io.maps.formats.ros_yaml import Doubts, MapYaml, check_keys, image_path
from lampyris.io.text.strict_yaml import YamlDocument, read_yaml, shown

SUFFIXES = (".yaml", ".yml")
UNKNOWN_GREY = 205
"""The grey map savers write unknown cells in."""
_LIKELY = re.compile(rb"^(?:\xef\xbb\xbf)?\{?[ \t]*[\"']?image[\"']?[ \t]*:(?=\s|\"|$)", re.MULTILINE)


def looks_like(head: bytes) -> bool:
    """Whether a file begins like a map's YAML: text with a key ``image``."""
    return b"\0" not in head and _LIKELY.search(head) is not None


def read_ros(source: FileSource) -> Reading:
    """Read a map's YAML and its picture.

    Raises
    ------
    FileError : what :func:`lampyris.io.text.strict_yaml.read_yaml` says; MAP_KEY, MAP_RESOLUTION, MAP_ORIGIN,
        MAP_THRESH, MAP_NEGATE or MAP_MODE with line and column; PATH_FORM, PATH_OUTSIDE, FILE_MISSING,
        FILE_KIND or FILE_READ for the picture; IMG_DEPTH for 16 bits a channel with colour or alpha; and what
        the reader of the picture says.
    LimitError : YAML_SIZE, YAML_DEPTH, IMG_TOO_LARGE or FILE_TOO_LARGE.
    """
    document = read_yaml(source.data, source.name)
    doubts = Doubts(source.strict)
    says = check_keys(document, doubts)
    path = image_path(document, says.image, source, doubts)
    picture = _open(path, document, source)
    pixels = _pixels(picture)
    grey, colourful = _grey(pixels, picture)
    occupancy = look_up(occupancy_table(says).view(np.uint8), grey).view(np.int8)
    notes = [*doubts.notes, *pixels.notes, *_masked(occupancy, pixels, says)]
    if colourful:
        notes.append(BRIGHTNESS)
    notes += _grey_205(occupancy, grey, says)
    if source.values == "costmap":
        reading = read_costs(look_up(FROM_OCCUPANCY, occupancy.view(np.uint8)))
    else:
        reading = Reading(look_up(_CODES, occupancy.view(np.uint8)), tuple(_counted(occupancy)))
    return replace(
        reading,
        notes=(*notes, *reading.notes),
        resolution=says.resolution,
        origin=says.origin,
        occupancy=occupancy,
    )


def occupancy_table(says: MapYaml) -> Occupancy:
    """The occupancy of each grey 0 to 255, int8 (256,), opaque pixels."""
    grey = np.arange(256)
    if says.mode == "raw":
        return np.where(grey <= 100, grey, -1).astype(np.int8)
    p = grey.astype(np.float32) / np.float32(255)
    occ = p if says.negate else np.float32(1) - p
    # Nav2 holds thresholds as doubles and compares as floats: each is rounded first, their difference after.
    occupied, free = np.float32(says.occupied_thresh), np.float32(says.free_thresh)
    table = np.full(256, -1, dtype=np.int8)
    table[occ >= occupied] = 100
    table[occ <= free] = 0
    if says.mode == "scale":
        between = (occ > free) & (occ < occupied)
        if between.any():
            width = np.float32(says.occupied_thresh - says.free_thresh)
            share = (occ[between] - free) / width * np.float32(100)
            # Halves away from zero; in 64 bits, where adding a half is exact.
            table[between] = np.floor(share.astype(np.float64) + 0.5).astype(np.int8)
    return table


_CODES = np.full(256, BLOCKED, dtype=np.uint8)
_CODES[0] = FREE
_CODES[255] = UNKNOWN  # -1, as a byte


def _open(path: str, document: YamlDocument, source: FileSource) -> FileSource:
    try:
        data = read_regular(path, byte_limit(source.max_cells))
    except FileError as problem:
        raise document.error(problem.code, f"{shown(path)}: {problem.what}", "image") from None
    return FileSource(data, path, source.max_cells, quotes=False)


def _pixels(picture: FileSource) -> Pixels:
    head = picture.data[:4096]
    if not head:
        raise picture.error("IMG_EMPTY", "the file is empty")
    if head.startswith(image.MAGIC):
        return image.pixels_png(picture)
    if bmp.looks_like(head):
        return bmp.pixels_bmp(picture)
    if pgm.looks_like(head):
        return pgm.pixels_pgm(picture)
    raise image.not_a_picture(picture, "PNG, BMP, PGM")


def _grey(pixels: Pixels, picture: FileSource) -> tuple[NDArray[np.uint8], bool]:
    """8-bit grey (height, width), and whether it was made from colours."""
    if pixels.halved:
        raise picture.error(
            "IMG_DEPTH",
            "16 bits a channel, with colour or alpha",
            allowed="8 bits a channel, or 16-bit grey without alpha",
            todo="save it with 8 bits a channel",
        )
    if pixels.palette is not None or pixels.samples.ndim == 3:
        return brightness(pixels, picture)
    samples = pixels.samples
    if pixels.maxval == 255:
        return samples.astype(np.uint8, copy=False), False
    level = np.arange(pixels.maxval + 1, dtype=np.int64)
    deep = (level * 65535 + pixels.maxval // 2) // pixels.maxval
    grey: NDArray[np.uint8] = (deep // 257).astype(np.uint8)[samples]
    return grey, False


def _masked(occupancy: Occupancy, pixels: Pixels, says: MapYaml) -> list[str]:
    """Set to unknown, in place, what is not opaque or not in the file; and say so."""
    notes = []
    clear = clear_of(pixels)
    if clear is not None and says.mode != "raw" and (n := int(np.count_nonzero(clear))):
        occupancy[clear] = -1
        notes.append(f"{plural(n, 'transparent pixel')} read as unknown")
    if pixels.left_out is not None and (n := int(np.count_nonzero(pixels.left_out))):
        occupancy[pixels.left_out] = -1
        notes.append(f"{plural(n, 'pixel')} the picture leaves out read as unknown")
    return notes


def _grey_205(occupancy: Occupancy, grey: NDArray[np.uint8], says: MapYaml) -> list[str]:
    """Whether the grey of unknown cells is read as free."""
    notes = []
    if says.mode != "raw" and (n := int(np.count_nonzero((grey == UNKNOWN_GREY) & (occupancy == 0)))):
        why = "mode scale; trinary with" if says.mode == "scale" else f"free_thresh {says.free_thresh:g};"
        what = f"grey {UNKNOWN_GREY}, which map savers write for unknown"
        notes.append(f"{plural(n, 'pixel')} of {what}, read as free by {why} 0.196 keeps them unknown")
    return notes


def _counted(occupancy: Occupancy) -> list[str]:
    """What is blocked without being a wall."""
    notes = []
    if n := int(np.count_nonzero(occupancy == -1)):
        notes.append(f"{plural(n, 'cell')} unknown (blocked for planning)")
    if n := int(np.count_nonzero((occupancy > 0) & (occupancy < 100))):
        notes.append(f"{plural(n, 'cell')} of occupancy 1 to 99 read as blocked; only 0 is free")
    return notes
