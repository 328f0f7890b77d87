"""Good files of a size that something can be done with: maps of each format, paths, tracks, zones."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from lampyris.typing import BoolGrid
from lampyris_selfcheck.reference.files import corpora
from lampyris_selfcheck.reference.files.map_files import bmp, npy, png, rows
from lampyris_selfcheck.reference.files.mutator import Corpus


def _drawn(seed: int, width: int, height: int, share: float) -> BoolGrid:
    """Scattered walls and a wall with a gap; the corners are free."""
    rng = np.random.Generator(np.random.PCG64(seed))
    blocked = rng.random((height, width)) < share
    blocked[:, width // 2] = True
    blocked[height // 3, width // 2] = blocked[2 * height // 3, width // 2] = False
    blocked[:2, :2] = blocked[-2:, -2:] = False
    return blocked


GRIDS = (_drawn(1, 24, 18, 0.1), _drawn(2, 40, 30, 0.2), np.zeros((9, 60), dtype=np.bool_))
"""Maps, bool (height, width), True where blocked."""


def _grey(walls: BoolGrid) -> list[list[int]]:
    return np.where(walls, 0, 255).tolist()


def _png(walls: BoolGrid) -> bytes:
    return png(walls.shape[1], walls.shape[0], 8, 0, rows(*_grey(walls)))


def _bmp(walls: BoolGrid) -> bytes:
    height, width = walls.shape
    grey = np.zeros((height, -(-width * 3 // 4) * 4), dtype=np.uint8)
    grey[:, : 3 * width] = np.repeat(np.where(walls, 0, 255), 3, axis=1)
    return bmp(width, height, 24, grey[::-1].tobytes())


def _pgm(walls: BoolGrid) -> bytes:
    return b"P5 %d %d 255\n" % walls.shape[::-1] + np.where(walls, 0, 255).astype(np.uint8).tobytes()


def _npy(walls: BoolGrid) -> bytes:
    shape = f"({walls.shape[0]}, {walls.shape[1]})"
    return npy(f"{{'descr': '|b1', 'fortran_order': False, 'shape': {shape}, }}", walls.tobytes())


def _letters(walls: BoolGrid, free: str, blocked: str, between: str = "") -> bytes:
    return "".join(
        between.join(blocked if b else free for b in row) + "\n" for row in walls.tolist()
    ).encode()


def _movingai(walls: BoolGrid) -> bytes:
    head = b"type octile\nheight %d\nwidth %d\nmap\n" % walls.shape
    return head + _letters(walls, ".", "@")


def _terrain(walls: BoolGrid) -> bytes:
    table = np.where(walls, 254, np.arange(walls.size).reshape(walls.shape) % 200)
    return b"# lampyris costmap\n" + b"".join(",".join(map(str, r)).encode() + b"\n" for r in table.tolist())


def _path() -> bytes:
    """Along the third map, sampled closely, with bends."""
    x = np.arange(1.0, 58.0, 0.35)
    y = 4.0 + 2.5 * np.sin(x / 4.0)
    return b"x,y\n" + b"".join(b"%.6f,%.6f\n" % pair for pair in zip(x.tolist(), y.tolist(), strict=True))


def _teeth() -> bytes:
    return b"x_m,y_m\n" + b"".join(b"%g,%d\n" % (1 + 0.5 * k, 7 if k % 2 else 2) for k in range(110))


def _cells() -> bytes:
    cells = ", ".join(f"[{k}, {k // 8}]" for k in range(56))
    return f'{{"planner": "astar", "cells": [{cells}]}}'.encode()


def _poses() -> bytes:
    some = ", ".join(f'{{"pose": {{"position": {{"x": {1 + k / 2}, "y": {2 + k % 3}}}}}}}' for k in range(60))
    return f'{{"header": {{"frame_id": "map"}}, "poses": [{some}]}}'.encode()


def _track() -> bytes:
    return b"x,y\n" + b"".join(b"%d,1\n" % (k % 23) for k in range(1, 22))


def _movers() -> bytes:
    head = b"x_m,y_m,radius,top_speed,vx,vy\n"
    return head + b"".join(b"%d,%d,0.3,1,%d,0.5\n" % (3 * k, 2 * k, k % 2) for k in range(1, 7))


def _zones(shape: tuple[int, int]) -> bytes:
    limits = 0.2 + np.arange(shape[0] * shape[1]).reshape(shape) % 7 / 4.0
    return b"".join(",".join(f"{v:g}" for v in row).encode() + b"\n" for row in limits.tolist())


def _more(corpus: Corpus, *seeds: bytes) -> Corpus:
    """A corpus with larger files; these are drawn as often as all the others."""
    times = max(1, len(corpus.seeds) // max(1, len(seeds)))
    return replace(corpus, seeds=corpus.seeds + seeds * times)


ROS_PICTURE = "m.pgm"
BESIDE: Mapping[str, bytes] = MappingProxyType({ROS_PICTURE: _pgm(GRIDS[0])})
"""What lies beside the mutated files."""

CORPORA: Mapping[str, Mapping[str, Corpus]] = MappingProxyType(
    {
        "use-map": {
            "map.png": _more(corpora.PNG, *map(_png, GRIDS)),
            "map.bmp": _more(corpora.BMP, *map(_bmp, GRIDS)),
            "map.pgm": _more(corpora.PGM, *map(_pgm, GRIDS)),
            "map.npy": _more(corpora.NPY, *map(_npy, GRIDS)),
            "map.map": _more(corpora.MAP, *map(_movingai, GRIDS)),
            "map.txt": _more(corpora.TEXT, *(_letters(g, ".", "#") for g in GRIDS)),
            "map.csv": _more(corpora.CSV, *(_letters(g, "0", "1", ",") for g in GRIDS), _terrain(GRIDS[0])),
            "map.yaml": corpora.ROS,
        },
        "use-path": {
            "path.csv": _more(corpora.WAY, _path(), _teeth()),
            "path.json": _more(corpora.WAY_JSON, _cells(), _poses()),
            "path.yaml": corpora.WAY_YAML,
        },
        "use-beside": {
            "track.csv": _more(corpora.TRACK, _track()),
            "movers.csv": _more(corpora.MOVERS, _movers()),
            "zones.csv": _more(corpora.ZONES, _zones(GRIDS[0].shape)),
        },
        "use-scenario": {"s.yaml": corpora.SCENARIO_YAML, "s.json": corpora.SCENARIO_JSON},
    }
)
"""Good files and mutants of them by kind of case and by the name they are given."""
