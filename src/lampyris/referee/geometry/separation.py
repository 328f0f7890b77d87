"""Obstacles against obstacles: the least distance of two discs over every time in which both move straight.

Times are cut into equal windows. Within a window, pieces of tracks whose boxes are apart cannot meet; for the
others the least distance follows from the relative motion, which is straight and uniform.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lampyris._core.arrays import index_array
from lampyris.model.obstacles import Track
from lampyris.model.traffic import Obstacle
from lampyris.referee.geometry.shapes import TOUCH, Ints
from lampyris.referee.verdict import Violation
from lampyris.typing import Floats

UNAVOIDING = ("cutter",)
"""Kinds that run into others on purpose: they are not judged."""
FIXED = ("recorded",)
"""Kinds whose tracks are given: two of them may overlap. Every other kind keeps off all that are judged."""

_AT_ONCE = 1_000_000
"""Pairs of pieces that are looked at in one go."""


def obstacles_violation(
    tracks: Sequence[Track], obstacles: Sequence[Obstacle], resolution: float, duration: float
) -> Violation | None:
    """Whether two obstacles, one of them of a kind that avoids the others, ever overlap.

    Parameters
    ----------
    resolution : metres a cell.
    duration : seconds.
    """
    found = least_gap(tracks, obstacles, resolution, duration)
    if found is None or found[0] >= 0.0:
        return None
    _, t, i, j, distance = found
    reach = tracks[i].radius + tracks[j].radius
    what = f"{distance:.9g} m between the centres of obstacles {i} and {j} at {t:.9g} s; the radii make {reach:g}"
    return Violation("obstacles apart", f"obstacle {i}", what)


def least_gap(
    tracks: Sequence[Track], obstacles: Sequence[Obstacle], resolution: float, duration: float
) -> tuple[float, float, int, int, float] | None:
    """The least gap between the rims of two obstacles that must keep apart, where their boxes ever meet.

    Returns
    -------
    gap (metres; what counts as touching is forgiven), when (seconds), both obstacles, and the distance of their
    centres; None: no two boxes meet.
    """
    word = [obstacle.kind for obstacle in obstacles]
    judged = np.array([w not in UNAVOIDING for w in word], dtype=np.bool_)
    avoids = np.array([w not in UNAVOIDING and w not in FIXED for w in word], dtype=np.bool_)
    if judged.sum() < 2 or not avoids.any() or duration <= 0.0:
        return None
    # As many windows as the busiest track has pieces: a box is then seldom longer than one step.
    windows = max(len(track.t) for track in tracks)
    rows = [_pieces(k, tracks[k], resolution, duration, windows) for k in np.flatnonzero(judged).tolist()]
    window, obstacle, t0, t1, ax, ay, bx, by = np.concatenate(rows).T
    who = obstacle.astype(np.int64)
    radius = np.array([track.radius for track in tracks])[who]
    # Windows lie side by side on one axis, so that one sort orders all of them.
    width = float(max(ax.max(), bx.max()) - min(ax.min(), bx.min()) + 4.0 * radius.max() + 1.0)
    left = np.minimum(ax, bx) - radius + window * width
    right = np.maximum(ax, bx) + radius + window * width
    order = np.argsort(left, kind="stable")
    last = np.searchsorted(left[order], right[order], side="left")
    counts = last - np.arange(1, len(order) + 1)
    best: tuple[float, float, int, int, float] | None = None
    total = np.cumsum(counts)
    at = 0
    while at < len(order):
        end = max(at + 1, int(np.searchsorted(total, (total[at - 1] if at else 0) + _AT_ONCE, side="right")))
        first = np.repeat(np.arange(at, end), index_array(counts[at:end]))
        begin = np.repeat(
            total[at:end] - counts[at:end] - (total[at - 1] if at else 0), index_array(counts[at:end])
        )
        i, j = order[first], order[first + 1 + np.arange(len(first)) - begin]
        low = np.minimum(ay, by) - radius
        high = np.maximum(ay, by) + radius
        keep = (who[i] != who[j]) & (low[i] < high[j]) & (low[j] < high[i])
        keep &= (avoids[who[i]] | avoids[who[j]]) & (np.minimum(t1[i], t1[j]) > np.maximum(t0[i], t0[j]))
        i, j = i[keep], j[keep]
        if len(i):
            gap, when, distance = _nearest(i, j, t0, t1, (ax, ay, bx, by), radius)
            k = int(np.argmin(gap))
            if best is None or gap[k] < best[0]:
                pair = sorted((int(who[i[k]]), int(who[j[k]])))
                best = (float(gap[k]), float(when[k]), pair[0], pair[1], float(distance[k]))
        at = end
    return best


def _pieces(number: int, track: Track, resolution: float, duration: float, windows: int) -> Floats:
    """The straight pieces of a track, cut at the borders of windows, metres; (n, 8): window, obstacle, from when
    to when, from where to where.
    """
    cuts = np.unique(np.concatenate((track.t, np.linspace(0.0, duration, windows + 1))))
    cuts = cuts[(cuts >= track.t[0]) & (cuts <= duration)]
    if len(cuts) < 2:
        return np.zeros((0, 8))
    # Within a piece of the track; beyond its last time it stands.
    k = np.clip(np.searchsorted(track.t, cuts, side="right") - 1, 0, len(track.t) - 1)
    nxt = np.minimum(k + 1, len(track.t) - 1)
    span = np.where(nxt > k, track.t[nxt] - track.t[k], 1.0)
    share = np.where(nxt > k, (cuts - track.t[k]) / span, 0.0)[:, None]
    xy = (track.xy[k] + share * (track.xy[nxt] - track.xy[k])) * resolution
    n = len(cuts) - 1
    middle = 0.5 * (cuts[:-1] + cuts[1:])
    window = np.clip(np.floor(middle / duration * windows), 0, windows - 1)
    ends = (xy[:-1, 0], xy[:-1, 1], xy[1:, 0], xy[1:, 1])
    return np.stack((window, np.full(n, float(number)), cuts[:-1], cuts[1:], *ends), axis=1)


def _nearest(
    i: Ints, j: Ints, t0: Floats, t1: Floats, ends: tuple[Floats, Floats, Floats, Floats], radius: Floats
) -> tuple[Floats, Floats, Floats]:
    """Gap, time and distance where two pieces are nearest to each other, in the time that both last."""
    begin, end = np.maximum(t0[i], t0[j]), np.minimum(t1[i], t1[j])
    ax, ay, bx, by = ends
    vx, vy = (bx - ax) / (t1 - t0), (by - ay) / (t1 - t0)
    px = ax[i] + vx[i] * (begin - t0[i]) - ax[j] - vx[j] * (begin - t0[j])
    py = ay[i] + vy[i] * (begin - t0[i]) - ay[j] - vy[j] * (begin - t0[j])
    ux, uy = vx[i] - vx[j], vy[i] - vy[j]
    speed = ux * ux + uy * uy
    later = np.where(speed > 0.0, -(px * ux + py * uy) / np.where(speed > 0.0, speed, 1.0), 0.0)
    later = np.clip(later, 0.0, end - begin)
    distance = np.hypot(px + ux * later, py + uy * later)
    reach = radius[i] + radius[j]
    return distance - reach + TOUCH * np.maximum(1.0, reach), begin + later, distance
