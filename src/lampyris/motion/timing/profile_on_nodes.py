"""A profile through tracks with the nodes of its sampled path put in: what holds it where, and between."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lampyris.model.profile import Profile
from lampyris.motion.geometry.sampled_path import SampledPath
from lampyris.typing import Floats

_CLOSE = 1e-6
"""Share of an edge of the sampled path, or of a stretch: a node so near to another is not put in."""
_MET = ("wait", "moving obstacle")


def with_nodes(found: Profile, still: Profile, samples: SampledPath, a_max: float) -> Profile:
    """The same motion with a node at each node of the sampled path, too.

    :func:`lampyris.motion.timing.path_time.through_tracks` tells where the acceleration changes. Between two such
    nodes it is constant, so speeds and times of others are exact. What binds them: braking for the next node
    that does not brake; at the ceiling whatever makes the ceiling there; full acceleration; and below both,
    whom the stretch is slow for.

    Parameters
    ----------
    found : the motion, along the sampled path from its first node.
    still : the profile without tracks; its nodes are those of the sampled path.
    samples : the path.
    a_max : m/s2: of the robot.
    """
    share, at = _places(found, samples)
    if not len(at):
        return found
    edge = np.searchsorted(found.s, samples.s[at], side="right") - 1
    a, d = found.a[edge], samples.s[at] - found.s[edge]
    v = np.sqrt(np.maximum(np.square(found.v[edge]) + 2.0 * a * d, 0.0))
    t = found.t[edge] + 2.0 * d / (found.v[edge] + v)
    cause, cause_index = _causes(found, still, at, edge, v, a_max)
    xy = None if found.xy is None else samples.xy[at]
    # A stable order: those put in come after the node that their stretch begins with.
    order = np.argsort(np.concatenate((np.arange(len(found.s)), edge + share)), kind="stable")
    words, number = (*found.cause, *cause), np.concatenate((found.cause_index, cause_index))

    def joined(one: Floats, two: Floats) -> Floats:
        return np.concatenate((one, two))[order]

    names = [words[k] for k in order.tolist()]
    causes = number[order]
    # All braking is numbered again.
    causes = np.where([w == "braking" for w in names], _ahead(names), causes)
    caps = tuple((c, joined(u, still.v[at])) for c, u in found.caps)
    return Profile(
        found.law,
        joined(found.s, samples.s[at]),
        joined(found.v, v),
        joined(found.a, a),
        joined(found.t, t),
        tuple(names),
        found.units,
        causes,
        caps,
        None if xy is None or found.xy is None else np.concatenate((found.xy, xy))[order],
    )


def _places(found: Profile, samples: SampledPath) -> tuple[Floats, NDArray[np.int64]]:
    """Which nodes of the sampled path are put in, and how far along the stretch each is, as a share below 1."""
    s = samples.s
    if len(s) < 3 or len(found.s) < 2:
        return np.zeros(0), np.zeros(0, dtype=np.int64)
    k = np.clip(np.searchsorted(found.s, s, side="right") - 1, 0, len(found.s) - 2)
    long = found.s[k + 1] - found.s[k]
    apart = np.minimum(s - found.s[k], found.s[k + 1] - s)
    least = np.minimum(np.diff(s, prepend=-np.inf), np.diff(s, append=np.inf))
    kept = (long > 0.0) & (apart > _CLOSE * np.minimum(least, long))
    at = np.flatnonzero(kept)
    return (s[at] - found.s[k[at]]) / long[at], at


def _ahead(names: list[str]) -> NDArray[np.int64]:
    """For each node the next one from it on that does not brake."""
    out, ahead = np.full(len(names), -1), -1
    for k in range(len(names) - 1, -1, -1):
        if names[k] != "braking":
            ahead = k
        out[k] = ahead
    return out


def _causes(
    found: Profile,
    still: Profile,
    at: NDArray[np.int64],
    edge: NDArray[np.int64],
    v: Floats,
    a_max: float,
) -> tuple[list[str], NDArray[np.int64]]:
    words, cause_index = [], []
    for node, k, speed in zip(at.tolist(), edge.tolist(), v.tolist(), strict=True):
        word, who = "limit", -1
        before = (found.cause[k], int(found.cause_index[k]))
        after = (found.cause[k + 1], int(found.cause_index[k + 1]))
        if found.a[k] < 0.0:
            word = "braking"
        elif speed >= still.v[node] * (1.0 - 1e-6):
            word, who = still.cause[node], int(still.cause_index[node])
        elif found.a[k] >= a_max * (1.0 - 1e-6):
            word = "acceleration"
        elif before[0] in _MET:
            word, who = "moving obstacle", before[1]
        elif after[0] in _MET:
            word, who = "moving obstacle", after[1]
        elif found.a[k] > 0.0:
            word = "acceleration"
        words.append(word)
        cause_index.append(who)
    return words, np.array(cause_index, dtype=np.int64)
