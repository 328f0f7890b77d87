"""Mutants at the edges of what a file says of itself: a size of 0 or off by one, a row's end lost, a version.

Header and cells are changed together as often as not: a size of 0 over no cells is past every check of the
cells' number, and only the check of the size itself can refuse it.
"""

from __future__ import annotations

import re
import struct
import zlib

from lampyris_selfcheck.reference.files.mutator import (
    BYTE_CHANGES,
    MAX_BYTES,
    TEXT_CHANGES,
    Corpus,
    Rng,
    change_png,
    pick,
)

_SHARE = 0.3
"""Of the mutants, which are changed at an edge; the others as files without a form are."""
_SIZE = re.compile(rb"[0-9]+")
_VERSIONS = (0, 1, 2, 3, 4, 255)


def change_rows(rng: Rng, data: bytes, corpus: Corpus) -> bytes:
    """Rows of characters, with or without a MovingAI header: a size, a row or a row's end changed."""
    if rng.random() > _SHARE or len(data) > MAX_BYTES // 10:
        return _any(rng, data, corpus)
    lines = data.split(b"\n")
    first = 4 if data.startswith(b"type") and len(lines) > 4 else 0
    match int(rng.integers(0, 4)):
        case 0 if first:
            return _resized(rng, lines)
        case 1:
            return _end_lost(rng, lines, first)
        case _:
            return _row_uneven(rng, lines, first)


def _resized(rng: Rng, lines: list[bytes]) -> bytes:
    """Height or width of 0 or off by one; as often as not with the rows to it."""
    what = int(rng.integers(1, 3))
    found = _SIZE.search(lines[what])
    size = 0 if rng.random() < 0.5 or not found else max(0, int(found[0][:4]) + _by_one(rng))
    head = [_SIZE.sub(b"%d" % size, line, count=1) if k == what else line for k, line in enumerate(lines[:4])]
    rows = lines[4:]
    if rng.random() < 0.5:
        rows = [*rows[:size], b""] if what == 1 else [row[:size].ljust(size, b".") for row in rows]
    return b"\n".join((*head, *rows))


def _end_lost(rng: Rng, lines: list[bytes], first: int) -> bytes:
    """An end of line is gone, or a cell stands where it was."""
    k = int(rng.integers(first, len(lines)))
    joined = pick(rng, (b"", b".", b"#", b"@")).join(lines[k : k + 2])
    return b"\n".join((*lines[:k], joined, *lines[k + 2 :]))


def _row_uneven(rng: Rng, lines: list[bytes], first: int) -> bytes:
    """A row of a cell more or fewer; the end of the last line is kept or not."""
    while len(lines) > first + 1 and not lines[-1].strip():
        lines = lines[:-1]
    k = int(rng.integers(first, len(lines)))
    row = lines[k][:-1] if rng.random() < 0.5 else lines[k] + b"."
    return b"\n".join((*lines[:k], row, *lines[k + 1 :])) + pick(rng, (b"", b"\n"))


def change_npy(rng: Rng, data: bytes, corpus: Corpus) -> bytes:
    """A NumPy file of another version, shape or number of bytes."""
    end = data.find(b"\n", 10)
    if rng.random() > _SHARE or not data.startswith(b"\x93NUMPY") or end < 0 or len(data) < 12:
        return _any(rng, data, corpus)
    start = 10 if data[6] == 1 else 12
    version, text, body = data[6], data[start : end + 1], data[end + 1 :]
    match int(rng.integers(0, 4)):
        case 0 | 1:
            version = int(pick(rng, _VERSIONS))
        case 2:
            text = _near_one(rng, text)
        case _:
            body = body[:-1] if rng.random() < 0.5 else body + b"\0"
    size = struct.pack("<H" if version == 1 else "<I", len(text) & 0xFFFF)
    return data[:6] + bytes((version, data[7])) + size + text + body


def _near_one(rng: Rng, text: bytes) -> bytes:
    """One of a text's numbers is 0, or off by one."""
    found = list(_SIZE.finditer(text))
    if not found:
        return text
    one = pick(rng, found)
    value = 0 if rng.random() < 0.4 else max(0, int(one[0][:9]) + _by_one(rng))
    return text[: one.start()] + b"%d" % value + text[one.end() :]


def change_bmp(rng: Rng, data: bytes, corpus: Corpus) -> bytes:
    """A BMP whose size is another, whose end is lost, or of whose run lengths one byte is off by one."""
    if rng.random() > _SHARE or len(data) < 40:
        return pick(rng, BYTE_CHANGES)(rng, data, corpus)
    raster = min(struct.unpack_from("<I", data, 10)[0], len(data) - 1)
    match int(rng.integers(0, 3)):
        case 0:
            at = int(pick(rng, (18, 22)))
            (size,) = struct.unpack_from("<i", data, at)
            size = 0 if rng.random() < 0.3 else max(-(2**31), min(size + _by_one(rng), 2**31 - 1))
            return data[:at] + struct.pack("<i", size) + data[at + 4 :]
        case 1:
            return data[: -int(rng.integers(1, 5))]
        case _:
            at = int(rng.integers(raster, len(data)))
            return data[:at] + bytes(((data[at] + _by_one(rng)) % 256,)) + data[at + 1 :]


def change_png_size(rng: Rng, data: bytes, corpus: Corpus) -> bytes:
    """A PNG whose header says 0 or one more or fewer, its checksum right; the others as PNG are."""
    if rng.random() > _SHARE / 3 or not data.startswith(b"\x89PNG") or len(data) < 33:
        return change_png(rng, data, corpus)
    return _repaired(_with_size(rng, data))


def _with_size(rng: Rng, data: bytes) -> bytes:
    at = int(pick(rng, (16, 20)))
    (size,) = struct.unpack_from(">I", data, at)
    size = 0 if rng.random() < 0.4 else (size + _by_one(rng)) % 2**32
    return data[:at] + struct.pack(">I", size) + data[at + 4 :]


def _repaired(data: bytes) -> bytes:
    return data[:29] + struct.pack(">I", zlib.crc32(data[12:29])) + data[33:]


def _by_one(rng: Rng) -> int:
    return int(pick(rng, (-1, 1)))


def _any(rng: Rng, data: bytes, corpus: Corpus) -> bytes:
    """What is done to a text where nothing is known of its form."""
    return pick(rng, TEXT_CHANGES if rng.random() < 0.8 else BYTE_CHANGES)(rng, data, corpus)
