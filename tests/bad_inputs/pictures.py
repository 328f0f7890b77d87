"""Rows 1 to 32: pictures."""

from __future__ import annotations

import os
import socket
import struct
import zlib
from pathlib import Path

from bad_inputs.case import Case, bad_map, good_map
from lampyris_selfcheck.reference.files.map_files import SIGNATURE, bmp, chunk, png, rows

GREY, COLOUR, INDEX = 0, 2, 3
LIMIT = "16,777,216"
SMALL = png(3, 2, 8, GREY, rows([0, 255, 205], [255, 255, 100]))
SMALL_CELLS = ("#.?", "..?")  # 100 is between the thresholds, 205 the grey of unknown


def packed_zeros(megabytes: int) -> bytes:
    """A zlib stream of so many times 2^20 zeros, made without unpacked zeros in memory.

    A full flush ends on a byte and forgets what was before: one piece can be repeated.
    """
    packer = zlib.compressobj(9)
    head = packer.compress(b"") + packer.flush(zlib.Z_FULL_FLUSH)
    piece = packer.compress(bytes(2**20)) + packer.flush(zlib.Z_FULL_FLUSH)
    packer = zlib.compressobj(9, wbits=-15)
    last = packer.flush()
    # Adler-32 of n zeros: the lower half stays 1, the upper counts.
    check = ((megabytes * 2**20 % 65521) << 16) | 1
    return head + piece * megabytes + last + struct.pack(">I", check)


def header_only(width: int, height: int) -> bytes:
    """A PNG of these claims and next to no pixels."""
    return png(width, height, 8, GREY, b"\0\0")


def wide_png() -> bytes:
    """13000 x 13000 grey pixels, all there, in some 170 kB."""
    head = struct.pack(">IIBBBBB", 13000, 13000, 8, GREY, 0, 0, 0)
    body = SIGNATURE + chunk(b"IHDR", head) + chunk(b"IDAT", packed_zeros(162))  # 13000 * 13001 and a bit
    return body + chunk(b"IEND")


def text_bomb() -> bytes:
    """A picture with 200 MB of packed text."""
    return png(3, 2, 8, GREY, rows([0] * 3, [0] * 3), before=chunk(b"zTXt", b"k\0\0" + packed_zeros(200)))


def wrong_checksum() -> bytes:
    """One bit of the header's checksum turned."""
    data = bytearray(SMALL)
    data[8 + 8 + 13] ^= 1
    return bytes(data)


def noisy_png() -> bytes:
    """Some hundreds of bytes of pixels that do not compress."""
    levels = bytes(k * k * 7 % 251 for k in range(400))
    return png(20, 20, 8, GREY, rows(*(levels[k : k + 20] for k in range(0, 400, 20))))


def coloured() -> bytes:
    """Grey but for one orange pixel at (12, 7)."""
    lines = [bytes([255, 255, 255] * 16) for _ in range(9)]
    lines[7] = lines[7][:36] + bytes([255, 128, 0]) + lines[7][39:]
    return png(16, 9, 8, COLOUR, rows(*lines))


def exif(orientation: int) -> bytes:
    """An EXIF chunk that says how to turn the picture."""
    body = b"II*\0" + struct.pack("<IHHHIHHI", 8, 1, 0x0112, 3, 1, orientation, 0, 0)
    return chunk(b"eXIf", body)


def gif() -> bytes:
    """The smallest GIF."""
    return b"GIF89a\1\0\1\0\x80\0\0\0\0\0\xff\xff\xff,\0\0\0\0\1\0\1\0\0\2\2D\1\0;"


def make_socket(folder: Path) -> None:
    """A socket in the file system, called ``s.png``. Its path must be short, so it is bound from inside."""
    here = os.open(".", os.O_RDONLY)
    os.chdir(folder)
    try:
        with socket.socket(socket.AF_UNIX) as bound:
            bound.bind("s.png")
    finally:
        os.fchdir(here)
        os.close(here)


KINDS = "a regular file"
ONLY = "PNG, BMP, PGM"

CONTAINER = [
    bad_map(1, "empty", "m.png", b"", "IMG_EMPTY", "the file is empty"),
    bad_map(1, "empty pgm", "m.pgm", b"", "IMG_EMPTY", "the file is empty"),
    bad_map(2, "text", "m.png", b"hello world\n", "IMG_FORMAT", 'starts with "hell"', ONLY),
    bad_map(3, "gif", "m.png", gif(), "IMG_FORMAT", "this is GIF", ONLY),
    bad_map(3, "tiff", "m.png", b"II*\0\x08\0\0\0" + bytes(20), "IMG_FORMAT", "this is TIFF", ONLY),
    bad_map(3, "tiff of the other order", "m.png", b"MM\0*" + bytes(20), "IMG_FORMAT", "this is TIFF", ONLY),
    bad_map(3, "svg", "m.png", b"<svg xmlns='http://www.w3.org/2000/svg'/>", "IMG_FORMAT", "SVG", ONLY),
    bad_map(3, "svg with a prologue", "m.png", b"<?xml version='1.0'?>\n<svg/>", "IMG_FORMAT", "SVG", ONLY),
    bad_map(3, "webp", "m.png", b"RIFF\x1a\0\0\0WEBPVP8L" + bytes(20), "IMG_FORMAT", "WebP", ONLY),
    bad_map(3, "jpeg", "m.png", b"\xff\xd8\xff\xe0\0\x10JFIF" + bytes(20), "IMG_FORMAT", "JPEG", ONLY),
    bad_map(3, "gif called pgm", "m.pgm", gif(), "IMG_FORMAT", "this is GIF", ONLY),
    good_map(4, "png called pgm", "m.pgm", SMALL, SMALL_CELLS, "called .pgm and is png", "between black"),
    good_map(4, "pgm called png", "m.png", b"P5 2 1 255\n\0\xff", ("#.",), "called .png and is pgm"),
    good_map(4, "png called map", "m.map", SMALL, SMALL_CELLS, "called .map and is png"),
    bad_map(5, "cut at 150", "m.png", lambda: noisy_png()[:150], "IMG_TRUNCATED", "'IDAT' ends early"),
    bad_map(5, "no end", "m.png", SMALL[:-12], "IMG_TRUNCATED", "before its end"),
    bad_map(5, "rows missing", "m.png", png(3, 3, 8, GREY, rows([0] * 3)), "IMG_TRUNCATED", "4 of 12 bytes"),
    bad_map(6, "checksum", "m.png", wrong_checksum(), "IMG_CORRUPT", "checksum of chunk 'IHDR'"),
    bad_map(
        7,
        "2147483647 squared",
        "m.png",
        header_only(2**31 - 1, 2**31 - 1),
        "IMG_TOO_LARGE",
        "4,611,686,014,132,420,609 cells",
        LIMIT,
        exit=5,
    ),
    bad_map(8, "60000 squared", "m.png", header_only(60000, 60000), "IMG_TOO_LARGE", "3,600,000,000", exit=5),
    bad_map(9, "13000 squared", "m.png", wide_png, "IMG_TOO_LARGE", "169,000,000 cells", LIMIT, exit=5),
    bad_map(10, "200 MB of text", "m.png", text_bomb, "IMG_CORRUPT", "text chunk too large", "1,048,576"),
    bad_map(11, "width 0", "m.png", header_only(0, 5), "IMG_SIZE", "0 x 5", "1 or more"),
    bad_map(11, "height 0", "m.png", header_only(5, 0), "IMG_SIZE", "5 x 0", "1 or more"),
    bad_map(
        12,
        "two frames",
        "m.png",
        png(1, 1, 8, GREY, rows([0]), before=chunk(b"acTL", struct.pack(">II", 2, 0))),
        "IMG_FRAMES",
        "2 frames",
        "give a single image",
    ),
]

MEANING = [
    good_map(
        13,
        "16 bits",
        "m.png",
        png(4, 1, 16, GREY, b"\0" + struct.pack(">4H", 0, 16384, 32768, 65535)),
        ("##?.",),
        "1 pixel between black and white",
    ),
    good_map(
        14,
        "palette upside down",
        "m.png",
        png(2, 1, 8, INDEX, rows([0, 1]), before=chunk(b"PLTE", b"\xff\xff\xff\0\0\0")),
        (".#",),
    ),
    bad_map(
        15,
        "orange",
        "m.png",
        coloured(),
        "IMG_COLOUR",
        "pixel (12,7)",
        "(255,128,0)",
        "legend",
        "--colour luminance",
    ),
    Case(
        15,
        "orange by its brightness",
        ("plan", "m.png", "--start", "0,0", "--goal", "0,0", "--colour", "luminance"),
        {"m.png": coloured},
        says=("its brightness decides", "1 pixel between black and white"),
    ),
    good_map(
        16,
        "transparent black",
        "m.png",
        png(3, 1, 8, 4, b"\0" + bytes([0, 0, 255, 255, 255, 254])),
        ("?.?",),
        "2 transparent pixels read as unknown",
    ),
    good_map(
        16,
        "a transparent palette colour",
        "m.png",
        png(
            3,
            1,
            8,
            INDEX,
            rows([0, 1, 2]),
            before=chunk(b"PLTE", bytes(3) + b"\xff" * 6) + chunk(b"tRNS", b"\xff\x80"),
        ),
        ("#?.",),
        "1 transparent pixel read as unknown",
    ),
    good_map(
        17,
        "exif",
        "m.png",
        png(2, 1, 8, GREY, rows([0, 255]), before=exif(6)),
        ("#.",),
        "EXIF orientation 6 is ignored",
        "turned",
    ),
]


def p5(width: object, height: object, maxval: object, raster: bytes) -> bytes:
    """A raw PGM."""
    return f"P5\n{width} {height}\n{maxval}\n".encode() + raster


PGM = [
    bad_map(18, "maxval 0", "m.pgm", p5(2, 1, 0, b"\0\0"), "PGM_MAXVAL", "0;", "1 to 65535"),
    bad_map(19, "maxval 70000", "m.pgm", p5(2, 1, 70000, b"\0\0"), "PGM_MAXVAL", "70000", "1 to 65535"),
    bad_map(
        20, "sample 200", "m.pgm", p5(3, 1, 100, b"\0\x64\xc8"), "PGM_SAMPLE", "pixel (2,0)", "200", "100"
    ),
    bad_map(
        20, "plain 255", "m.pgm", b"P2\n2 2\n100\n0 1\n100 255\n", "PGM_SAMPLE", "pixel (1,1)", "255", "100"
    ),
    good_map(
        21,
        "16 bits",
        "m.pgm",
        p5(4, 1, 65535, struct.pack(">4H", 0, 16384, 32768, 65535)),
        ("##?.",),
        "1 pixel between",
    ),
    good_map(21, "maxval 1000", "m.pgm", p5(3, 1, 1000, struct.pack(">3H", 0, 350, 1000)), ("##.",)),
    bad_map(22, "width -5", "m.pgm", p5(-5, 5, 255, b""), "PGM_SIZE", "width -5", "1 or more"),
    bad_map(22, "nothing", "m.pgm", p5(0, 0, 255, b""), "PGM_SIZE", "width 0", "1 or more"),
    bad_map(23, "37 bytes", "m.pgm", p5(10, 10, 255, bytes(37)), "IMG_TRUNCATED", "37 of 100"),
    bad_map(23, "37 samples", "m.pgm", b"P2 10 10 255\n" + b"0 " * 37, "IMG_TRUNCATED", "37 of 100"),
    bad_map(24, "12 bytes more", "m.pgm", p5(2, 2, 255, bytes(16)), "PGM_TRAILING", "12 bytes after"),
    bad_map(24, "3 samples more", "m.pgm", b"P2 2 1 255\n0 1 2 3 4\n", "PGM_TRAILING", "3 samples after"),
    bad_map(
        25, "abc", "m.pgm", b"P2\n2 2\n255\n0 abc\n1 2\n", "PGM_TOKEN", "line 4", "'abc'", "not a number"
    ),
    bad_map(25, "width ten", "m.pgm", b"P2\nten 2\n255\n0 1\n", "PGM_TOKEN", "line 2", "'ten'", "width"),
    bad_map(26, "5000 digits", "m.pgm", p5("9" * 3000, 1, 1, b""), "PGM_TOKEN", "longer than 10 digits"),
    bad_map(
        26, "5000 digits more than a header", "m.pgm", p5("9" * 5000, 1, 1, b""), "PGM_HEADER", "4096 bytes"
    ),
    bad_map(
        27,
        "50 MB of comment",
        "m.pgm",
        lambda: b"P5\n#" + b"x" * 50_000_000 + b"\n2 2\n255\n" + bytes(4),
        "PGM_HEADER",
        "header longer than 4096 bytes",
    ),
    good_map(28, "P1", "m.pbm", b"P1\n3 1\n1 0 1\n", ("#.#",)),
    good_map(28, "P4", "m.pbm", b"P4\n3 1\n\xa0", ("#.#",)),
    bad_map(
        28, "P6", "m.ppm", b"P6 2 1 255\n" + bytes([0, 0, 0, 0, 255, 0]), "IMG_COLOUR", "(1,0)", "(0,255,0)"
    ),
]

_TWO_COLOURS = bytes(4) + b"\xff\xff\xff\0"

BMP = [
    bad_map(
        29,
        "60000 squared",
        "m.bmp",
        bmp(60000, 60000, 8, b"\0", palette=_TWO_COLOURS, used=2),
        "IMG_TOO_LARGE",
        "3,600,000,000 cells",
        LIMIT,
        exit=5,
    ),
    bad_map(29, "3 bits", "m.bmp", bmp(2, 2, 3, bytes(8)), "BMP_DEPTH", "3 bits", "1, 4, 8, 24, 32"),
    bad_map(
        29,
        "run lengths cut",
        "m.bmp",
        bmp(4, 2, 8, bytes([4, 1, 0, 0, 2]), palette=_TWO_COLOURS, used=2, packing=1),
        "IMG_TRUNCATED",
        "end early",
    ),
    bad_map(29, "cut", "m.bmp", bmp(4, 2, 24, bytes(9)), "IMG_TRUNCATED", "9 of 24 bytes"),
    good_map(
        30,
        "top down",
        "m.bmp",
        bmp(2, -2, 8, b"\0\1\0\0\1\1\0\0", palette=_TWO_COLOURS, used=2),
        ("#.", ".."),
    ),
    good_map(
        30,
        "bottom up",
        "m.bmp",
        bmp(2, 2, 8, b"\0\1\0\0\1\1\0\0", palette=_TWO_COLOURS, used=2),
        ("..", "#."),
    ),
]

FILES = [
    bad_map(31, "directory", "d", None, "FILE_KIND", KINDS, "directory", setup=lambda f: (f / "d").mkdir()),
    bad_map(31, "pipe", "p.png", None, "FILE_KIND", KINDS, "pipe", setup=lambda f: os.mkfifo(f / "p.png")),
    bad_map(31, "socket", "s.png", None, "FILE_KIND", KINDS, "socket", setup=make_socket),
    bad_map(31, "device", "/dev/zero", None, "FILE_KIND", KINDS, "device"),
    bad_map(
        31,
        "a link to a device",
        "z.png",
        None,
        "FILE_KIND",
        KINDS,
        "device",
        setup=lambda f: (f / "z.png").symlink_to("/dev/zero"),
    ),
    bad_map(31, "no such file", "nowhere.png", None, "FILE_MISSING", "neither a file nor a bundled map"),
    bad_map(31, "a bundled name misspelt", "giude", None, "FILE_MISSING", "did you mean guide"),
    good_map(32, "one cell", "m.png", png(1, 1, 8, GREY, rows([255])), (".",)),
]

CASES: list[Case] = [*CONTAINER, *MEANING, *PGM, *BMP, *FILES]
