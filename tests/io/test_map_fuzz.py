"""Mutated files: a valid document or a LampyrisError, nothing else, not for long, without a warning."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lampyris.errors import LampyrisError
from lampyris.io.maps.formats.movingai import read_scen
from lampyris.io.maps.load import load_map
from lampyris_selfcheck.reference.files.map_files import adam7, bmp, chunk, npy, png, put, rows
from sizes import sized

PALETTE = chunk(b"PLTE", bytes([0] * 3 + [255] * 3 + [255, 0, 0]))
SEEDS = {
    "png grey": png(6, 5, 8, 0, rows(*[[0, 255, 0, 200, 100, 255]] * 5)),
    "png palette": png(4, 2, 2, 3, b"\0\x14\0\x50", before=PALETTE + chunk(b"tRNS", b"\xff\x00")),
    "png colour": png(
        2, 2, 16, 6, b"\0" + bytes(16) + b"\0" + b"\xff" * 16, before=chunk(b"eXIf", b"II*\0" + bytes(20))
    ),
    "png interlaced": png(9, 9, 8, 0, adam7([[0, 255, 255] * 3] * 9), interlace=1),
    "bmp 24": bmp(3, 3, 24, bytes([255] * 12 + [0] * 24)),
    "bmp 4": bmp(5, 2, 4, bytes([0x01, 0x10, 0, 0] * 2), palette=bytes(4) + b"\xff\xff\xff\0", used=2),
    "bmp runs": bmp(
        4,
        2,
        8,
        bytes([3, 1, 1, 0, 0, 0, 0, 3, 1, 0, 1, 0, 0, 1]),
        palette=bytes(4) + b"\xff" * 4,
        used=2,
        packing=1,
    ),
    "pgm 5": b"P5\n# made by hand\n4 3\n255\n" + bytes(range(12)),
    "pgm 2": b"P2\n3 2\n255\n0 255 128\n1 2 3\n",
    "pgm 4": b"P4 9 2\n\x80\x80\x7f\x00",
    "pgm 6": b"P6 2 1 255\n" + bytes(6),
    "map": b"type octile\nheight 3\nwidth 4\nmap\n.@T.\nGS..\n.WO.\n",
    "text": b"#..#\n#S?#\n#oG#\n",
    "csv": b"0,1,-1,0\r\n1; 0,0,1\n0,0,0,0\n".replace(b";", b","),
    "csv costmap": b"# lampyris costmap\n0;17;252\n253;254;255\n-1;63; 0\n",
    "npy": npy("{'descr': '|i1', 'fortran_order': False, 'shape': (3, 4), }", b"\0\1\xff" * 4),
    "scen": b"version 1\n3\tmaps/a.map\t10\t20\t1\t2\t9\t19\t12.50\n",
}
TOKENS = [
    b"0",
    b"-1",
    b"65536",
    b"99999999",
    b"4294967295",
    b"\xff",
    b"\0",
    b"\n",
    b"\r",
    b"#",
    b" ",
    b"1e9",
    b"\x80" * 4,
]


def mutate(rng: np.random.Generator, data: bytes) -> bytes:
    """One to four changes: a bit, a byte, a piece cut out, repeated, put in, or the end cut off."""
    out = bytearray(data)
    for _ in range(int(rng.integers(1, 5))):
        at = int(rng.integers(0, len(out) + 1))
        to = min(len(out), at + int(rng.integers(1, 9)))
        match int(rng.integers(0, 7)):
            case 0 if at < len(out):
                out[at] ^= 1 << int(rng.integers(0, 8))
            case 1 if at < len(out):
                out[at] = int(rng.integers(0, 256))
            case 2:
                del out[at:to]
            case 3:
                out[at:at] = out[at:to] * int(rng.integers(1, 4))
            case 4:
                del out[at:]
            case 5:
                out[at:to] = TOKENS[int(rng.integers(0, len(TOKENS)))]
            case _:
                out[at:at] = TOKENS[int(rng.integers(0, len(TOKENS)))]
    return bytes(out)


def repair(data: bytes) -> bytes:
    """Make the checksums of a mutated PNG right again, so that mutations reach what lies behind them."""
    out, at = bytearray(data[:8]), 8
    while at + 12 <= len(data):
        (length,) = struct.unpack_from(">I", data, at)
        length = min(length, len(data) - at - 12)
        out += chunk(data[at + 4 : at + 8], data[at + 8 : at + 8 + length])
        at += 12 + length
    return bytes(out)


def mutate_png(rng: np.random.Generator, data: bytes) -> bytes:
    """A mutation that keeps checksums; every third time, one inside the packed pixels."""
    if rng.integers(0, 3):
        return repair(mutate(rng, data))
    at = data.find(b"IDAT") - 4
    (length,) = struct.unpack_from(">I", data, at)
    raw = zlib.decompress(data[at + 8 : at + 8 + length])
    return data[:at] + chunk(b"IDAT", zlib.compress(mutate(rng, raw))) + data[at + 12 + length :]


COSTS = {"values": "costmap"}
LIGHT = {"colour": "luminance"}
CASES = [
    *((kind, {}) for kind in SEEDS),
    *((kind, COSTS) for kind in ("png grey", "png interlaced", "pgm 5", "pgm 2", "npy", "csv")),
    *((kind, LIGHT) for kind in ("png palette", "png colour", "bmp 4", "bmp 24", "pgm 6")),
]


@pytest.mark.commit(2)
@sized("cases", 125, 400)
@pytest.mark.parametrize(("kind", "options"), CASES)
def test_mutants(
    tmp_path: Path, kind: str, options: dict[str, str], cases: int, timely: Callable[..., Any]
) -> None:
    load: Callable[[Path], object] = read_scen if kind == "scen" else partial(load_map, **options)  # type: ignore[arg-type]
    change = mutate_png if kind.startswith("png") else mutate
    name = "m.csv" if kind == "csv" else "m"
    load(put(tmp_path, SEEDS[kind], name))
    rng = np.random.Generator(np.random.PCG64(sum(kind.encode())))
    read = refused = 0
    for _ in range(cases):
        data = change(rng, SEEDS[kind])
        path = put(tmp_path, data, name)
        try:
            found = timely(2, load, path)
        except LampyrisError as problem:
            refused += 1
            message = str(problem)
        else:
            read += 1
            message = ""
            if kind != "scen":
                assert found.grid.blocked.size <= 2**24
        assert not message or message.startswith("error[")
    assert read > 0, "no mutant was read: the mutations are too rough to tell anything"
    assert refused > 0
