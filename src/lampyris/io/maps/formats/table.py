"""The formats that maps are read in besides NumPy's, and which one a file has."""

from __future__ import annotations

from pathlib import Path

from lampyris.io.maps.formats import bmp, movingai, pgm, plain_text, ros
from lampyris.io.maps.formats import csv as csv_file
from lampyris.io.maps.formats import png as image
from lampyris.io.maps.formats.document import FileSource, Format
from lampyris.io.maps.formats.npy import NUMPY

HEAD_BYTES = 4096

_IMAGES = (
    Format("png", (".png",), lambda head: head.startswith(image.MAGIC), image.read_png),
    Format("bmp", (".bmp", ".dib"), bmp.looks_like, bmp.read_bmp),
    Format("pgm", (".pgm", ".pbm", ".ppm", ".pnm"), pgm.looks_like, pgm.read_pgm),
)
_CSV = Format("csv", csv_file.SUFFIXES, csv_file.looks_like, csv_file.read_csv)
_MOVINGAI = Format("movingai", (".map",), movingai.looks_like, movingai.read_map)
FORMATS = (*_IMAGES, NUMPY, _CSV, _MOVINGAI)
ROS = Format("ros", ros.SUFFIXES, ros.looks_like, ros.read_ros)
TEXT = Format("text", (".txt",), lambda head: True, plain_text.read_text)
_PICTURES = tuple(s for f in _IMAGES for s in f.suffixes)


def format_of(source: FileSource) -> Format:
    """What a file is, by its first bytes.

    Raises
    ------
    FileError : IMG_EMPTY, or the file is a picture that is not read, or no text.
    """
    head = source.data[:HEAD_BYTES]
    suffix = Path(source.name).suffix.lower()
    if not head:
        if suffix in ROS.suffixes:
            return ROS  # its reader says what should be there
        raise source.error("IMG_EMPTY", "the file is empty")
    for form in FORMATS:
        if form.begins(head):
            return form
    if ROS.begins(head):
        return ROS
    other = image.foreign(head)
    if not other:
        for form in (ROS, _CSV):
            if suffix in form.suffixes:
                return form
    if other or b"\0" in head or suffix in _PICTURES:
        raise image.not_a_picture(source, "PNG, BMP, PGM, ROS YAML, MovingAI, plain text, NumPy, CSV")
    if suffix in _MOVINGAI.suffixes:
        return _MOVINGAI  # its reader says what the first line should be
    return TEXT


def usual_format(suffix: str) -> Format | None:
    """The format of files that usually end like this; None if there is none."""
    return next((f for f in (*FORMATS, ROS, TEXT) if suffix in f.suffixes), None)
