"""Measures of a path of poses, planned or driven: lengths, prices, reversals and turns."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import pairwise
from typing import Any

import numpy as np

from lampyris.model.curve import PoseCurve
from lampyris.model.drive import Drive
from lampyris.model.path import PosePath

LEAST_TURN = 1e-6
"""Radians of a step, or of a part of a curve, below which it is straight."""


def pose_measures(out: dict[str, Any], path: PosePath, resolution: float) -> None:
    """Of a planned path. Metres a cell: ``resolution``."""
    out.update(
        length_m=path.length_m,
        length_cells=path.length_m / resolution,
        cost_m=path.cost_m,
        lower_bound_m=path.lower_bound_m,
        bound=path.bound if math.isfinite(path.bound) else None,
        reversals=path.reversals,
    )
    turn = np.remainder(np.diff(path.poses[:, 2]) + math.pi, 2 * math.pi) - math.pi
    _turning(out, zip(path.gears.tolist(), turn.tolist(), strict=True))


def driven_measures(out: dict[str, Any], drive: Drive) -> None:
    """Of what was driven of each curve of poses; the length is there already."""
    steps: list[tuple[int, float]] = []
    for leg in np.unique(drive.leg).tolist():
        own = np.flatnonzero(drive.leg == leg)
        curve, s0, last = drive.curves[leg], float(drive.s[own[0]]), int(own[-1])
        assert isinstance(curve, PoseCurve)
        s1 = float(drive.s[last])
        if last + 1 < len(drive.t):
            dt = float(drive.t[last + 1] - drive.t[last])
            s1 += dt * (float(drive.v[last]) + 0.5 * float(drive.a[last]) * dt)
        ends = zip(curve.begins[:-1].tolist(), curve.begins[1:].tolist(), strict=True)
        for (b, e), gear, turn in zip(ends, curve.gears.tolist(), curve.turn.tolist(), strict=True):
            driven = min(e, s1) - max(b, s0)
            if driven > 1e-12:
                steps.append((gear, turn * driven))
    gears = [gear for gear, _ in steps if gear]
    out["reversals"] = sum(a != b for a, b in pairwise(gears))
    _turning(out, steps)


def _turning(out: dict[str, Any], steps: Iterable[tuple[int, float]]) -> None:
    """Turns, their sum and the smoothness; a turn is a row of steps that turn to the same side in the same gear."""
    turns, total, before = 0, 0.0, (0, 0)
    for gear, turn in steps:
        side = 0 if abs(turn) <= LEAST_TURN else 1 if turn > 0 else -1
        turns += side != 0 and (gear, side) != before
        before = (gear, side)
        total += abs(turn)
    cells = out["length_cells"]
    out.update(
        turns=turns, turn_deg=math.degrees(total), smoothness=1.0 / (1.0 + total / cells) if cells else 1.0
    )
