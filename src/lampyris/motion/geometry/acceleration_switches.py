"""Nodes where the time-optimal profile of a sampled path changes its acceleration.

Between two nodes the square of the speed is a straight line. The time optimum of a sampled path, whose pieces have
constant curvature, is made of few such lines: full acceleration, the cap of a piece, full braking. They
change within edges: where the ramp up from the node before meets the cap or the ramp down to the node after.
Without nodes there the profile was up to 15 % slower, most of all between stops a cell or two apart.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lampyris.model.robot import Robot
from lampyris.motion import caps
from lampyris.motion.geometry.sampled_path import SampledPath
from lampyris.typing import Floats

_CLOSE = 1e-6
"""Share of an edge: a change so near to one of its nodes is at the node."""


def with_switches(samples: SampledPath, v: Floats, robot: Robot) -> SampledPath:
    """The sampled path with a node at each change of acceleration within its edges.

    Parameters
    ----------
    samples : on a curve.
    v : float64 (n,), m/s: the maximum speeds at the nodes under the robot's limits. They are exact, as the
        optimum from node to node depends on nothing else; only what lies between them is not.
    robot : its limits.
    """
    curve = samples.curve
    if curve is None or len(samples) < 2:
        return samples
    begin, end = samples.s[:-1], samples.s[1:]
    ds = end - begin
    bend = np.abs(curve.curvature[pieces(samples, 0.5 * (begin + end))])
    top = np.square(np.minimum(caps.curvature(bend, a_lat_max=robot.a_lat_max), robot.v_max))
    rise, fall = 2.0 * robot.a_max, 2.0 * robot.d_max
    x = v * v
    up, down = (top - x[:-1]) / rise, ds - (top - x[1:]) / fall
    peak = (x[1:] - x[:-1] + fall * ds) / (rise + fall)
    # Where the two ramps meet below the cap there is one change, else one at either end of the cap.
    sharp = up >= down
    first = np.where(sharp, peak, up)
    edges = np.concatenate((np.arange(len(ds)), np.flatnonzero(~sharp)))
    along = np.concatenate((first, down[~sharp]))
    within = (along > _CLOSE * ds[edges]) & (along < (1.0 - _CLOSE) * ds[edges])
    edges, along = edges[within], along[within]
    order = np.lexsort((along, edges))
    edges, along = edges[order], along[order]
    apart = np.ones(len(edges), dtype=np.bool_)
    apart[1:] = (edges[1:] != edges[:-1]) | (along[1:] - along[:-1] > _CLOSE * ds[edges[1:]])
    return inserted(samples, edges[apart], begin[edges[apart]] + along[apart])


def inserted(samples: SampledPath, edges: NDArray[np.int64], s: Floats) -> SampledPath:
    """The sampled path with more nodes.

    Parameters
    ----------
    samples : on a curve.
    edges : int64 (m,), rising: the edge of each new node, by number.
    s : float64 (m,), metres from the start, rising, each within its edge.
    """
    curve = samples.curve
    assert curve is not None
    xy, heading = curve.at(s)
    at = edges + 1
    return SampledPath(
        np.insert(samples.s, at, s),
        np.insert(samples.xy, at, xy, axis=0),
        np.insert(samples.heading, at, heading, axis=0),
        np.insert(samples.curvature, at, np.abs(curve.curvature[pieces(samples, s)])),
        np.insert(samples.stop, at, False),
        samples.resolution,
        curve,
    )


def pieces(samples: SampledPath, s: Floats) -> NDArray[np.int64]:
    """The piece of the sampled path's curve at each distance, int64."""
    assert samples.curve is not None
    found = np.searchsorted(samples.curve.begins, s, side="right") - 1
    return np.clip(found, 0, len(samples.curve.lengths) - 1)
