"""The dissertation's speed law, checked a second time: velocity units, one transfer a node."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lampyris.model.path import Path
from lampyris.model.profile import Profile
from lampyris.model.scene import Scene
from lampyris.referee.geometry.shapes import Ints
from lampyris.referee.motion import first
from lampyris.referee.verdict import Violation
from lampyris.typing import Floats

ROUNDING = 1e-9
"""Share of a bound that sums may be off by."""

_TOP, _FLOOR, _BRAKE = 80.0, 20.0, 40.0
_RISE = np.array([20.0, 28.0, 44.0])
"""Rise of speed with a straight, a diagonal and a knight's step (Table 3.1; the last is lampyris' own)."""


def check_dissertation(profile: Profile, path: Path, scene: Scene, v0: float) -> Violation | None:
    """The law of method.md, "The dissertation's speed law", in velocity units and transfers."""
    found = _ends(profile)
    if found is not None:
        return found
    v = profile.v
    if v[0] > v0 * (1 + ROUNDING):
        return Violation(
            "start", "node 0", f"{float(v[0])!r} at the start; the robot drives {float(v0)!r} there"
        )
    give = ROUNDING * _TOP
    cells = path.cells.astype(np.int64)
    d = cells[1:] - cells[:-1]
    rise = _RISE[np.minimum(np.abs(d[:, 0] * d[:, 1]), 2)]
    dv = np.diff(v)
    angle, ring = _angle_caps(d), _ring_caps(path, scene, d)
    inner = v[1:-1]
    count = np.arange(len(v), dtype=np.float64)
    return (
        first(
            "acceleration",
            ~(dv <= rise + give),
            lambda k: f"rises by {float(dv[k])!r}; {rise[k]:g} at most",
            "edge",
        )
        or first(
            "braking",
            ~(-dv <= _BRAKE + give),
            lambda k: f"falls by {float(-dv[k])!r}; {_BRAKE:g} at most",
            "edge",
        )
        or first(
            "angle",
            _shift(~(inner <= angle + give)),
            lambda k: f"{float(v[k])!r}; the bend allows {angle[k - 1]:g}",
        )
        or first(
            "ring",
            _shift(~(inner <= ring + give)),
            lambda k: f"{float(v[k])!r}; the walls allow {ring[k - 1]:g}",
        )
        or first(
            "a",
            ~(np.abs(profile.a[:-1] - dv) <= give),
            lambda k: f"a is {float(profile.a[k])!r}, v changes by {float(dv[k])!r}",
        )
        or first(
            "a", np.append(np.zeros(len(dv), np.bool_), profile.a[-1] != 0), lambda k: "must be 0 at the end"
        )
        or first("time", ~(profile.t == count), lambda k: f"t is {float(profile.t[k])!r} after {k} transfers")
    )


def _ends(profile: Profile) -> Violation | None:
    v = profile.v
    bad = ~((v >= 0) & (v <= _TOP * (1 + ROUNDING)))
    found = first("speed", bad, lambda k: f"{float(v[k])!r} {profile.units}; allowed 0 to {_TOP:g}")
    if found is None and len(v) > 1 and v[-1] != 0:
        found = Violation(
            "goal", f"node {len(v) - 1}", f"{float(v[-1])!r} {profile.units} at the goal; must be 0"
        )
    return found


def _shift(inner: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """What is said of inner nodes, at their own numbers."""
    return np.concatenate((np.zeros(1, dtype=np.bool_), inner))


def _angle_caps(d: Ints) -> Floats:
    """80, 60 or 20 at each inner node by the turn there: below 22.5 degrees, below 67.5, or sharper."""
    came, goes = d[:-1], d[1:]
    dot = (came * goes).sum(axis=1)
    cross = np.abs(came[:, 0] * goes[:, 1] - came[:, 1] * goes[:, 0])
    gentle = (dot > 0) & (cross < dot * math.tan(math.pi / 8))
    bend = (dot > 0) & (cross < dot * math.tan(3 * math.pi / 8))
    return np.where(gentle, 80.0, np.where(bend, 60.0, 20.0))


def _ring_caps(path: Path, scene: Scene, d: Ints) -> Floats:
    """``80 - 6 n1 - 3 n2``, not below 20, at each inner node, counting walls alone.

    n1: the eight neighbours that are blocked or off the map. n2: cells two away, within 45 degrees of the
    step that led here, that are blocked; there the outside of the map does not count.
    """
    grid = scene.grid
    # Two cells of frame: read without bounds; one copy says what is off the map.
    off = np.pad(np.zeros_like(grid.blocked), 2, constant_values=True)
    wall = np.pad(grid.blocked, 2, constant_values=False)
    inner = path.cells[1:-1].astype(np.int64) + 2
    x, y = inner[:, 0], inner[:, 1]
    hx, hy = d[:-1, 0], d[:-1, 1]
    n1 = np.zeros(len(inner), dtype=np.int64)
    n2 = np.zeros(len(inner), dtype=np.int64)
    for oy in range(-2, 3):
        for ox in range(-2, 3):
            away = max(abs(ox), abs(oy))
            if away == 1:
                n1 += wall[y + oy, x + ox] | off[y + oy, x + ox]
            elif away == 2:
                along, across = ox * hx + oy * hy, np.abs(ox * hy - oy * hx)
                n2 += wall[y + oy, x + ox] & (along > 0) & (across <= along)
    return np.maximum(_FLOOR, _TOP - 6.0 * n1 - 3.0 * n2)
