"""Shortest curves between many pairs of poses."""

from __future__ import annotations

from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.curves.angles import sine_cosine
from lampyris.kernels.curves.dubins import dubins
from lampyris.kernels.curves.reeds_shepp import reeds_shepp


@kernel(out=("length", "lengths", "kinds"), each=60_000, of="length")
def shortest(starts, goals, radius, reverse, length, lengths, kinds, halt):
    """The shortest curve of each pair.

    Parameters
    ----------
    starts, goals : float64 (3 n,): x, y, yaw of each pose.
    radius : turning radius, in the unit of the poses.
    reverse : whether reverse is allowed: Reeds-Shepp curves, not Dubins curves.
    length : float64 (n,): length of each curve, in turning radii.
    lengths, kinds : float64 (5,), int64 (5,): segments of the last of them.
    """
    for k in range(len(length)):
        if k & 255 == 255 and stopped(halt):
            return
        i = 3 * k
        s, c = sine_cosine(starts[u64(i + 2)])
        dx = goals[u64(i)] - starts[u64(i)]
        dy = goals[u64(i + 1)] - starts[u64(i + 1)]
        x = (c * dx + s * dy) / radius
        y = (c * dy - s * dx) / radius
        yaw = goals[u64(i + 2)] - starts[u64(i + 2)]
        if reverse:
            length[u64(k)] = reeds_shepp(x, y, yaw, 1.0, 0.0, lengths, kinds)
        else:
            length[u64(k)] = dubins(x, y, yaw, lengths, kinds)
