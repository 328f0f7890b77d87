"""Poses along straight segments and arcs."""

from __future__ import annotations

from lampyris.kernels._jit import kernel, u64
from lampyris.kernels.curves.angles import sine_cosine


@kernel(inline=True)
def moved(x, y, yaw, length, turn, lateral):
    """The pose at the end of a segment.

    Parameters
    ----------
    x, y, yaw : where it begins.
    length : distance driven, negative in reverse; 0: a turn in place.
    turn : change of the yaw.
    lateral : angle from the yaw to the direction of travel: 0 but for robots that move sideways.
    """
    half = 0.5 * turn
    chord = length
    if turn != 0.0:
        if abs(half) < 1e-4:
            chord = length * (1.0 - half * half / 6.0)
        else:
            s, _ = sine_cosine(half)
            chord = length * s / half
    s, c = sine_cosine(yaw + lateral + half)
    return x + chord * c, y + chord * s, yaw + turn


@kernel(out=("poses",), each=4000, of="poses")
def sample(x, y, yaw, lengths, turns, laterals, counts, poses):
    """Poses at equal distances on each of some segments, its end included and its beginning left out.

    Parameters
    ----------
    x, y, yaw : where the first segment begins.
    lengths, turns, laterals : float64 (n,): see :func:`moved`.
    counts : int64 (n,): poses on each segment, at least 1.
    poses : float64 (3 * sum(counts),): x, y, yaw of each.
    """
    at = 0
    for k in range(len(lengths)):
        n = counts[u64(k)]
        for i in range(1, n + 1):
            share = i / n
            px, py, angle = moved(x, y, yaw, share * lengths[u64(k)], share * turns[u64(k)], laterals[u64(k)])
            poses[u64(at)] = px
            poses[u64(at + 1)] = py
            poses[u64(at + 2)] = angle
            at += 3
        x = poses[u64(at - 3)]
        y = poses[u64(at - 2)]
        yaw = poses[u64(at - 1)]
