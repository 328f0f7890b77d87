"""Plain numbers of a path, for tables and pages."""

from __future__ import annotations

import math
from typing import TypedDict

import numpy as np

from lampyris.model.grid import Grid
from lampyris.model.path import Path


class PathMetrics(TypedDict):
    """What :func:`path_metrics` returns.

    ``cells``: cells, both ends counted. ``straights``, ``diagonals``, ``knights``: steps of each kind.
    ``length_cells``, ``length_m``: geometric length, a diagonal sqrt 2. ``turns``: nodes at which the
    heading changes. ``turn_deg``: all turning added up, ``sharpest_deg``: the sharpest turn, both in
    degrees. ``smoothness``: 1 / (1 + turning in radians for each cell of length): 1 is a straight line.
    """

    cells: int
    straights: int
    diagonals: int
    knights: int
    length_cells: float
    length_m: float
    turns: int
    turn_deg: float
    sharpest_deg: float
    smoothness: float


def path_metrics(path: Path, grid: Grid) -> PathMetrics:
    """Lengths, steps and turns of a path on its map."""
    cells = path.cells.astype(np.int64)
    step = cells[1:] - cells[:-1]
    came, goes = step[:-1], step[1:]
    cross = came[:, 0] * goes[:, 1] - came[:, 1] * goes[:, 0]
    dot = (came * goes).sum(axis=1)
    turn = [math.atan2(abs(c), d) for c, d in zip(cross.tolist(), dot.tolist(), strict=True)]
    kinds = np.bincount(np.abs(step[:, 0] * step[:, 1]), minlength=3)
    length = float(path.arc[-1])
    total = math.fsum(turn)
    return {
        "cells": len(path.cells),
        "straights": int(kinds[0]),
        "diagonals": int(kinds[1]),
        "knights": int(kinds[2]),
        "length_cells": length,
        "length_m": length * grid.resolution,
        "turns": sum(t > 0 for t in turn),
        "turn_deg": math.degrees(total),
        "sharpest_deg": math.degrees(max(turn, default=0.0)),
        "smoothness": 1.0 / (1.0 + total / length) if length else 1.0,
    }
