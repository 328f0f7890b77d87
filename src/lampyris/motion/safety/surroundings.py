"""What a sampled path passes, as bounds that hold between its nodes too: room to surfaces, speed zones.

A speed between two nodes is never above the greater of theirs. So a limit that changes along the path is kept
everywhere when each node obeys the least of it over the edges that touch the node.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lampyris._core import elementary
from lampyris._core.arrays import index_array
from lampyris.model.curve import PoseCurve
from lampyris.motion.geometry.sampled_path import SampledPath
from lampyris.motion.geometry.shape_clearance import edge_movement
from lampyris.typing import FloatGrid, Floats, Points

_TOUCH = 1e-9
"""Cells: what comes as near as this to a cell touches it."""

_SLACK = 1e-9
"""Share of an edge that measured distances may be off by, and far more."""


def least_around(edges: Floats) -> Floats:
    """At each node the least of the edges that touch it; (n - 1,) to (n,)."""
    out = np.empty(len(edges) + 1)
    out[0], out[-1] = edges[0], edges[-1]
    np.minimum(edges[:-1], edges[1:], out=out[1:-1])
    return out


def reach_of(samples: SampledPath, enough: float) -> float:
    """How far surfaces must be looked for, so that :func:`room` tells up to ``enough``; metres.

    Room below ``enough`` is then the same for every greater ``enough`` too: an edge with one end within reach
    has the other at most its own length farther, so both distances are known. Were the farther one cut off at
    the reach, a robot that brakes harder, and so looks less far, would find less room and drive slower.
    """
    if len(samples) < 2:
        return enough
    if isinstance(samples.curve, PoseCurve):
        moves, leaves = edge_movement(samples)
        longest, bow = float(moves.max()), float(leaves.max())
    else:
        longest = float((samples.s[1:] - samples.s[:-1]).max())
        bow = 0.125 * float(samples.curvature.max()) * longest * longest
    bent = enough + bow
    return math.sqrt(bent * bent + 0.25 * longest * longest) + longest * (1.0 + _SLACK)


def room(samples: SampledPath, distance: Floats, reach: float) -> Floats:
    """Least distance to a surface on the edges that touch each node, metres; see :func:`edge_room`."""
    return distance if len(samples) < 2 else least_around(edge_room(samples, distance, reach))


def edge_room(samples: SampledPath, distance: Floats, reach: float) -> Floats:
    """A lower bound of the distance to a surface on each edge, metres, (n - 1,); infinity where none is near.

    Parameters
    ----------
    samples : n nodes, at least two.
    distance : metres from each node to the nearest surface, infinity beyond ``reach``; (n,).
    reach : metres; see :func:`reach_of`.

    For a point p of a surface and a point x that divides a chord in the ratio L : 1 - L, Stewart's theorem
    says ``|x p|^2 = (1 - L) |a p|^2 + L |b p|^2 - L (1 - L) |a b|^2``. With the distances A and B of the two
    ends in place of those to p this bounds the distance everywhere on the chord from below, and its least
    value is ``A^2 - (A^2 - B^2 + D)^2 / (4 D)``, D = |a b|^2, where that lies between the ends, the lesser
    end otherwise. An arc leaves its chord by at most ``kappa ds^2 / 8``.

    Not taken: the bound by slope 1, ``(A + B - ds) / 2``. Half a cell from a wall, with nodes a quarter of a
    cell apart, it leaves 75 % of the room, this 97 %.

    On a curve of poses the distances are those of the robot's rim; each of its points moves on a chord or an arc of its
    own, and D is the square of the longest: the bound falls as D grows.
    """
    near = np.minimum(distance, reach)
    near *= near
    a, b = near[:-1], near[1:]
    ds, leaves = edge_movement(samples)
    d = ds * ds
    still = d == 0.0
    lean = a - b
    least = np.minimum(a, b)
    between = np.abs(lean) < d
    lean += d
    np.subtract(a, lean * lean / np.where(still, 1.0, 4.0 * d), out=least, where=between)
    np.maximum(least, 0.0, out=least)
    np.sqrt(least, out=least)
    least -= leaves
    np.maximum(least, 0.0, out=least)
    least[np.isinf(distance[:-1]) & np.isinf(distance[1:])] = np.inf
    return least


def cells_distance(xy: Points, cells: NDArray[np.int64], resolution: float, reach: float) -> Floats | None:
    """Metres from points to the nearest square of ``cells``, infinity beyond ``reach``; None: none is near.

    Parameters
    ----------
    xy : float64 (n, 2), cells.
    cells : int64 (m, 2).
    """
    far = reach / resolution + 0.5
    low, high = xy.min(axis=0) - far, xy.max(axis=0) + far
    near = ((cells >= low) & (cells <= high)).all(axis=1)
    found = cells[near].astype(np.float64)
    if len(found) == 0:
        return None
    best = np.empty(len(xy))
    block = max(1, 1_000_000 // len(found))
    for k in range(0, len(xy), block):
        gx = np.maximum(np.abs(found[:, :1] - xy[k : k + block, 0]) - 0.5, 0.0)
        gy = np.maximum(np.abs(found[:, 1:] - xy[k : k + block, 1]) - 0.5, 0.0)
        best[k : k + block] = (gx * gx + gy * gy).min(axis=0)
    out: Floats = np.sqrt(best) * resolution
    out[out > reach] = np.inf
    return out


def zone_limits(samples: SampledPath, zones: FloatGrid) -> Floats:
    """Least limit of the cells that the centre touches on the edges at each node; m/s, (n,)."""
    if len(samples) == 1:
        return zones_at(samples.xy, zones)
    return least_around(edge_zones(samples, zones))


def zones_at(xy: Points, zones: FloatGrid) -> Floats:
    """Least limit of the cells that each point touches; m/s, (n,)."""
    return _corner_limits(zones, xy - _TOUCH, xy + _TOUCH)


def edge_zones(samples: SampledPath, zones: FloatGrid) -> Floats:
    """Least limit of the cells that the centre touches on each edge; m/s, (n - 1,).

    Edges longer than a quarter of a cell are looked at in parts. Of each part the box counts, so that a cell
    passed within an eighth of a cell of its corner may count as touched, but none that is touched is missed.
    """
    xy = samples.xy
    ds = samples.s[1:] - samples.s[:-1]
    parts = max(1, math.ceil(float(ds.max()) / samples.resolution * 4.0 - 1e-6))
    if parts > 1:
        s = samples.s[:-1, None] + ds[:, None] * (np.arange(parts) / parts)
        s = np.append(s.ravel(), samples.s[-1])
        if samples.curve is not None:
            xy = samples.curve.at(s)[0]
        else:
            xy = np.stack([elementary.interp(s, samples.s, xy[:, k]) for k in (0, 1)], axis=-1)
    bend = np.minimum(samples.curvature[:-1], samples.curvature[1:])
    bulge = np.repeat(0.125 * bend * np.square(ds / parts) / samples.resolution, index_array(parts)) + _TOUCH
    a, b = xy[:-1], xy[1:]
    limit = _corner_limits(zones, np.minimum(a, b) - bulge[:, None], np.maximum(a, b) + bulge[:, None])
    least: Floats = limit.reshape(-1, parts).min(axis=1)
    return least


def _corner_limits(zones: FloatGrid, low: Points, high: Points) -> Floats:
    """The least limit of the cells that hold a corner of each box; boxes are smaller than a cell."""
    most = np.array([zones.shape[1] - 1, zones.shape[0] - 1])
    lo = np.clip(np.floor(low + 0.5).astype(np.int64), 0, most)
    hi = np.clip(np.floor(high + 0.5).astype(np.int64), 0, most)
    first = np.minimum(zones[lo[:, 1], lo[:, 0]], zones[lo[:, 1], hi[:, 0]])
    second = np.minimum(zones[hi[:, 1], lo[:, 0]], zones[hi[:, 1], hi[:, 0]])
    out: Floats = np.minimum(first, second)
    return out
